"""Proposals that bear an overload: a rigid end stop behind the travel limits the motion and carries the load."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from suggest_support import POM, block, proposal_of, request

import cfmkit
from cfmkit import Run
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.studies.suggest.file_of_proposal import NO_END_STOP
from cfmkit.studies.suggest.search import offer_of

CONFIGS = Path(__file__).parents[2] / "configs"

STRIP = {"force": "2 N", "travel": "5 mm", "ripple": "6 %", "envelope": "[120 mm, 120 mm, 12 mm]"}
CAM = {"force": "50 N", "travel": "100 mm", "envelope": "[250 mm, 350 mm, 80 mm]", "material": "steel-s235"}
REQUESTS = {"beam": {}, "vcfm": {}, "slider-crank": STRIP, "cam": CAM}


@cache
def propose_first(name):
    asked = request(overload="60 N", **REQUESTS[name])
    return asked, proposal_of(name, offer_of(family(name), asked, Run()).candidates[0], asked)


@pytest.fixture(scope="module", params=list(REQUESTS))
def proposal(request):
    return propose_first(request.param)


def end_of(spec):
    """Where the stop is [m]."""
    stops = spec.mechanism.stops
    return stops["end"].gap if isinstance(stops, dict) else stops.upper


def test_the_file_of_a_proposal_has_a_stop_behind_its_travel_and_meets_the_request(proposal):
    asked, made = proposal
    assert made.passes, made.missed or made.message
    spec = cfmkit.loads(made.text)
    result = cfmkit.analyze(spec)
    assert result.status.name == "COMPLETE"
    assert all(outcome.ok for outcome in result.requirements)
    begin, end = (float(place) for place in spec.analysis.window)
    assert end - begin == pytest.approx(asked.travel, rel=1e-5)
    assert end_of(spec) == pytest.approx(end + 0.03 * asked.travel, rel=1e-12)
    # box and stress are those at the stop
    assert result.curve.motion.max() == pytest.approx(
        end_of(spec), abs=1.01e-6
    )  # at the stop itself the drive is blocked


def test_the_stop_carries_what_the_overload_has_above_the_own_force(proposal):
    asked, made = proposal
    curve = cfmkit.analyze(cfmkit.loads(made.text)).curve
    number = float(re.search(r"carries (\S+) N of 60 N", made.notes[0])[1])
    assert number + curve.effort[curve.motion.argmax()] == pytest.approx(asked.stated.overload, rel=2e-3)


def test_a_proposal_is_driven_no_further_than_its_stop(proposal):
    spec = cfmkit.loads(proposal[1].text)
    longer = 1.05 * end_of(spec)
    driven = spec.replace({"analysis.travel": (0.0, longer) if spec.family == "slider-crank" else longer})
    result = cfmkit.analyze(driven.replace({"requirements": ()}))
    assert result.curve.motion.max() == pytest.approx(end_of(spec), rel=1e-12)
    assert result.status.name == "PARTIAL"


def test_before_its_stop_a_proposal_has_the_force_that_it_has_without(proposal):
    spec = cfmkit.loads(proposal[1].text)
    if spec.family == "cam":
        free = spec.replace({"mechanism.stops": None, "analysis.travel": end_of(spec)})
    else:
        free = spec.replace({"mechanism.stops": {}})
    curve, same = cfmkit.analyze(spec).curve, cfmkit.analyze(free).curve
    assert np.allclose(curve.motion, same.motion, rtol=0.0, atol=1e-12)
    assert np.allclose(curve.effort, same.effort, rtol=1e-9, atol=1e-9 * same.effort.max())


@pytest.mark.parametrize("name", ["beam", "slider-crank"])
def test_a_solid_may_have_a_stop_that_its_travel_does_not_reach(name):
    spec = cfmkit.loads(propose_first(name)[1].text).replace({"analysis.fidelity": "solid"})
    longer = 1.001 * end_of(spec)  # which contact would end
    with pytest.raises(SpecError, match=r"mechanism\.stops|ends before them"):
        spec.replace({"analysis.travel": (0.0, longer) if name == "slider-crank" else longer})


def test_springs_at_pins_and_stages_in_series_are_not_offered_for_an_overload():
    keys = {"force": "50 N", "travel": "20 mm", "envelope": "[200 mm, 200 mm, 40 mm]", "material": "steel-s235"}
    asked, plain = request(overload="200 N", **keys), request(**keys)
    linkages = [offer_of(family("slider-crank"), one, Run()) for one in (plain, asked)]
    assert all(not candidate.spec.end_stop_changes(1.0) for candidate in linkages[0].candidates)
    assert (linkages[1].candidates, linkages[1].reason) == ((), NO_END_STOP)
    layered = cfmkit.load(CONFIGS / "beam_two_layers.yaml")
    assert not layered.end_stop_changes(0.01)
    assert layered.replace({"mechanism.copies.layers": 1}).end_stop_changes(0.01)


def test_a_note_says_what_the_stop_carries(proposal):
    assert proposal[1].notes[0].startswith("end stop, rigid")


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"overload": "-60 N"}, "--overload: -60 N is not allowed: must be > 0"),
        ({"overload": "60"}, "--overload: 60 has no unit"),
        ({"overload": "10.2 N"}, "10.2 N is not above the largest own force, 10.25 N"),
        ({"overload": "20 N", "adjustable": "[8 N, 25 N]"}, "20 N is not above the largest own force, 25 N"),
    ],
)
def test_an_overload_that_makes_no_sense_is_refused_in_one_line(keys, words):
    with pytest.raises(SpecError) as caught:
        block(POM | keys)
    (problem,) = caught.value.problems
    assert words in str(problem)


def test_an_overload_goes_with_a_force_only():
    keys = {"torque": "1 N*m", "angle": "20 deg", "envelope": "[80 mm, 60 mm]", "overload": "60 N"}
    with pytest.raises(SpecError, match="goes with 'force' only"):
        block(keys)


def test_a_stop_up_to_which_the_travel_goes_is_no_near_contact():
    _, made = propose_first("beam")
    assert not {"near_contact", "closure_adjusted"} & {name.partition(" ")[0] for name in made.warnings}


def test_the_pin_that_is_named_for_a_stop_bears_it_in_bending_by_hand(proposal):
    asked, made = proposal
    number, pin = re.search(r"carries (\S+) N of 60 N: a steel pin of (\S+) mm", made.notes[0]).groups()
    moment = float(number) * 0.5 * made.numbers["depth"]
    stress = 32.0 * moment / (np.pi * (1e-3 * float(pin)) ** 3)
    assert stress <= 235e6 / max(asked.safety, 1.5)
