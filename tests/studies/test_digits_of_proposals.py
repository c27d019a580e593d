"""Proposals have the digits that their process can hold, and are judged with them."""

from __future__ import annotations

import re
from functools import cache

import pytest
from suggest_support import proposal_of, request

import cfmkit
from cfmkit import Run
from cfmkit.families import family
from cfmkit.stock import series_of
from cfmkit.studies.parts.parts import accuracy_of
from cfmkit.studies.stock_and_digits import decimals_of, lengths_and_angles
from cfmkit.studies.suggest.file_of_proposal import round_to_process
from cfmkit.studies.suggest.proposal_making_and_judging import judge_proposal, numbers_of
from cfmkit.studies.suggest.search import offer_of

STEEL = {"material": "steel-s235", "safety": "1.5"}
REQUESTS = {
    "beam": {"overload": "60 N"},
    "vcfm": {},
    "slider-crank": {"force": "1 N", "travel": "0.3 in", "ripple": "6 %", "envelope": "[80 mm, 90 mm, 10 mm]"},
    "slider-crank, springs at pins": STEEL
    | {"force": "20 N", "travel": "20 mm", "envelope": "[200 mm, 200 mm, 40 mm]"},
    "slider-crank, flexures": {"force": "0.5 N", "ripple": "20 %", "envelope": "[90 mm, 90 mm, 50 mm]"},
    "cam": STEEL | {"force": "50 N", "travel": "100 mm", "envelope": "[250 mm, 350 mm, 80 mm]"},
    "cam, catalogue springs": STEEL | {"force": "50 N", "travel": "100 mm", "envelope": "[250 mm, 350 mm, 90 mm]"},
}


@cache
def propose_first(case):
    name, _, variant = case.partition(", ")
    asked = request(**REQUESTS[case])
    candidates = offer_of(family(name), asked, Run()).candidates
    chosen = (candidate for candidate in candidates if candidate.variant.endswith(variant))
    made = (proposal_of(name, candidate, asked) for candidate in chosen)
    return asked, next(proposal for proposal in made if proposal.passes)


@pytest.mark.parametrize("case", list(REQUESTS))
def test_no_length_and_no_angle_of_a_proposal_has_more_digits_than_its_process_holds(case):
    _, proposal = propose_first(case)
    spec = cfmkit.loads(proposal.text)
    written = dict(
        lengths_and_angles(spec.model_dump(mode="json", exclude_unset=True), ("mechanism", "analysis", "design"))
    )
    allowed = decimals_of(accuracy_of(spec))
    assert len(written) > 3
    decimals = {path: len(text.split()[0].partition(".")[2]) for path, text in written.items()}
    assert {path: written[path] for path, count in decimals.items() if count > allowed} == {}
    # what is no length either, but for the limits of the block `design` and of the requirements
    assert not re.findall(r"\d\.\d{7,}", proposal.text)
    wires = [float(wire) for wire in re.findall(r"wire: (\S+) mm", proposal.text)]
    assert all(series_of("wire", "metric").holds(1e-3 * wire) for wire in wires)


@pytest.mark.parametrize("case", list(REQUESTS))
def test_the_file_of_a_proposal_analysed_again_gives_the_numbers_that_were_judged(case):
    asked, proposal = propose_first(case)
    result = cfmkit.analyze(cfmkit.loads(proposal.text))
    assert all(outcome.ok for outcome in result.requirements)
    box = family(proposal.family).envelope(result)
    again = numbers_of(result, box, asked)
    assert again["mean"] is not None
    assert {name: again[name] for name in ("mean", "ripple", "safety_factor", "across", "along", "depth")} == {
        name: proposal.numbers[name] for name in ("mean", "ripple", "safety_factor", "across", "along", "depth")
    }
    low, high = (float(end) for end in result.spec.analysis.window)
    assert asked.travel * (1.0 - 1e-12) <= high - low <= asked.travel + 2e-6


def test_the_width_makes_up_for_the_rounding_of_the_thickness():
    asked, proposal = propose_first("vcfm")
    spec = cfmkit.loads(proposal.text).replace({"requirements": (), "design": None})
    thin = {f"mechanism.{block}.thickness": 0.1004e-3 for block in ("positive", "bistable")}
    spec = spec.replace(thin)
    means = []
    for entry in (spec, round_to_process(spec, asked, 3), spec.replace(dict.fromkeys(thin, 0.1e-3))):
        means.append(cfmkit.analyze(entry).metrics["force_mean"].value)
    rounded = round_to_process(spec, asked, 3).mechanism.bistable
    assert rounded.thickness == pytest.approx(0.1e-3, rel=1e-12)
    assert means[1] == pytest.approx(means[0], rel=1e-3)
    assert means[2] < 0.99 * means[0]  # the thickness alone would have taken 1.2 % of the force


def test_a_tapered_strip_keeps_its_force_when_its_thicknesses_are_rounded():
    asked, proposal = propose_first("slider-crank")
    spec = cfmkit.loads(proposal.text).replace({"requirements": (), "design": None})
    thick = float(spec.mechanism.beam.thickness)
    taper = tuple(1e-5 * round(1e5 * thick) + extra for extra in (4e-7, 1.4e-6, 2.4e-6, 3.4e-6, 4.4e-6))
    spec = spec.replace({"mechanism.beam.thickness": taper})
    rounded = round_to_process(spec, asked, 3)
    alone = rounded.replace({"mechanism.beam.width": spec.mechanism.beam.width})
    means = [cfmkit.analyze(entry).metrics["force_mean"].value for entry in (spec, rounded, alone)]
    assert means[1] == pytest.approx(means[0], rel=1e-4)
    assert means[2] < (1.0 - 5e-4) * means[0]


def test_a_window_is_as_long_as_a_travel_that_has_more_digits_than_the_process_holds():
    asked = request(travel="2.00004 mm")
    candidate = offer_of(family("vcfm"), asked, Run()).candidates[0]
    proposal = proposal_of("vcfm", candidate, asked)
    low, high = (1e3 * float(end) for end in cfmkit.loads(proposal.text).analysis.window)
    assert high - low == pytest.approx(2.001, abs=1e-9)
    again = judge_proposal("vcfm", "2 Vs", proposal.spec, asked)  # what is rounded stays as it is
    assert cfmkit.dumps(again.spec) == proposal.text.replace(proposal.spec.name, again.spec.name)


def test_leaves_that_are_thinner_than_any_process_makes_are_named():
    asked = request(force="12 mN", travel="100 um", envelope="[12 mm, 9 mm, 0.5 mm]", material="titanium-6al-4v")
    candidate = offer_of(family("vcfm"), asked, Run()).candidates[0]
    notes = proposal_of("vcfm", candidate, asked).notes
    (note,) = [note for note in notes if note.startswith("leaves of ")]
    assert note.endswith("mm are thinner than 0.2 mm, the least assumed of wire-edm: state --process")
    thick = propose_first("vcfm")[1]
    assert cfmkit.loads(thick.text).mechanism.bistable.thickness > 0.0004
    assert not any(note.startswith("leaves of ") for note in thick.notes)
