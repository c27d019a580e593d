"""Requests for a yield: what is offered for them, what moves for them, and what is said where no shape has it."""

from __future__ import annotations

import pytest
from suggest_support import proposal_of, propose, request

import cfmkit
from cfmkit import Run
from cfmkit.families import Candidate
from cfmkit.studies.parts.near_parts import expected_shares
from cfmkit.studies.parts.parts import Parts
from cfmkit.studies.suggest import proposal_making_and_judging
from cfmkit.studies.suggest.proposal_making_and_judging import Proposal, ProposalJob, redesign_for_yield
from cfmkit.studies.suggest.search import _key, _MadeCandidates, _Times
from cfmkit.studies.suggest.yield_of_proposal import MovedForYield, move_for_yield

MEASURED = "{youngs_modulus: 1477 MPa, poisson_ratio: 0.3, yield_strength: 30.5 MPa}"


def offered(name, asked):
    return propose(name, asked).candidates


@pytest.mark.slow
def test_after_a_trim_no_error_of_the_modulus_is_left():
    asked = ({"metric": "force_mean", "min": "1.45 N", "max": "1.55 N"}, {"metric": "half_band", "max": "5 %"})
    spec = cfmkit.load("configs/slider_crank_strip.yaml").replace({"analysis.points": 17})
    spec = spec.replace({"mechanism.material": "pla", "mechanism.beam.width": "3.083 mm"})
    mean = cfmkit.analyze(spec).metrics["force_mean"].value
    spec = spec.replace({"mechanism.beam.width": spec.mechanism.beam.width * 1.5 / mean, "requirements": asked})
    shares = expected_shares(cfmkit.analyze(spec), Parts.from_assumed_errors(spec, 0), Run())
    assert shares.proportional
    assert shares.good.value < shares.measured.value < shares.trimmed.value
    assert shares.trimmed.value > 0.99


VS = {"envelope": "[120 mm, 90 mm, 15 mm]", "material": MEASURED, "force": "[5 N, 6 N]"}
PRINTED = "{youngs_modulus: 2600 MPa, poisson_ratio: 0.3, yield_strength: 55 MPa}"
SHAPES = {
    "force": "[1.6 N, 2.4 N]", "travel": "4 mm", "ripple": "12 %", "envelope": "[120 mm, 120 mm, 30 mm]",
    "material": PRINTED, "process": "fdm",
}  # fmt: skip


@pytest.mark.parametrize(("name", "keys"), [("vcfm", VS), pytest.param("beam", SHAPES, marks=pytest.mark.slow)])
def test_for_a_yield_the_thickest_leaves_come_first(name, keys):
    def thicknesses(asked):
        found = offered(name, asked)
        parts = [one.spec.mechanism for one in found if one.variant == found[0].variant]
        return [one.thickness if name == "beam" else one.bistable.thickness for one in parts]

    first, *others = thicknesses(request(**keys, **{"yield": "80 %"}))
    assert others
    assert first == max(first, *others)
    first, *others = thicknesses(request(**keys))
    assert first < max(others)


@pytest.mark.slow
def test_a_yield_that_the_modulus_rules_out_is_said_to_be_so_with_what_to_do():
    keys = {"force": "20 N", "travel": "5 mm", "envelope": "[200 mm, 150 mm, 30 mm]", "material": "pla"}
    asked = request(**keys, process="fdm", ripple="6 %", **{"yield": "60 %"})
    one = proposal_of("vcfm", offered("vcfm", asked)[0], asked)
    assert one.is_near_miss, one.missed or one.message
    assert not one.movable
    # 1 - 0.975/1.025 of 4 GPa, out of 1.6 to 4 GPa
    assert "no shape exceeds 8.13 %" in one.missed[0]
    for words in ("once the modulus is measured", "after a trim", "1600 MPa to 4000 MPa", "cfmkit calibrate"):
        assert words in one.missed[0]


@pytest.fixture
def near():
    return Proposal("vcfm", "2 Vs", cfmkit.dumps(cfmkit.load("configs/vcfm_pla.yaml")), ("yield 50 %",), movable=True,
                    numbers={"yield": 0.5})  # fmt: skip


def moved_to(monkeypatch, shares):
    """Let searches reach shares to first order, one after the other; return what each is asked for."""
    asked = []

    def moved(_candidate, spec, _request, share, _run):
        asked.append(share)
        return MovedForYield(spec, 0.5, shares[len(asked) - 1], "mechanism.bistable.thickness")

    monkeypatch.setattr(proposal_making_and_judging, "move_for_yield", moved)
    return asked


def test_more_is_requested_where_fewer_drawn_parts_are_good_than_first_order_has_it(near, monkeypatch):
    asked = moved_to(monkeypatch, [0.8, 0.9])
    outcomes = iter([(("yield 70 %",), 0.7), ((), 0.82)])

    def judge(_spec):
        missed, share = next(outcomes)
        return Proposal("vcfm", "2 Vs", near.text, missed, numbers={"yield": share}, movable=bool(missed))

    found = redesign_for_yield(near, Candidate("2 Vs", near.spec), request(**{"yield": "80 %"}), Run(), judge)
    assert asked == [0.8, pytest.approx(0.85)]
    assert found.good
    assert found.notes[0].startswith("designed with margins: yield")


def test_what_margins_do_not_reach_names_the_largest_yield_and_the_costliest_tolerance(near, monkeypatch):
    moved_to(monkeypatch, [0.6])

    def judge(_spec):
        return Proposal("vcfm", "2 Vs", near.text, ("yield 58 %",), numbers={"yield": 0.58}, movable=True)

    found = redesign_for_yield(near, Candidate("2 Vs", near.spec), request(**{"yield": "80 %"}), Run(), judge)
    assert found.is_near_miss
    assert not found.movable
    assert found.numbers["yield"] == 0.58
    assert found.missed[0].startswith("yield 58 %; design margins cannot improve it further")
    assert "largest contributor: mechanism.bistable.thickness" in found.missed[0]


def test_what_moves_out_of_the_room_for_a_yield_stays_as_it_was(near, monkeypatch):
    moved_to(monkeypatch, [0.8])

    def judge(_spec):
        return Proposal("vcfm", "2 Vs", near.text, ("needs 82 mm across the travel: 80 mm given",))

    found = redesign_for_yield(near, Candidate("2 Vs", near.spec), request(**{"yield": "80 %"}), Run(), judge)
    assert found.numbers["yield"] == 0.5
    assert "needs 82 mm" in found.missed[0]


def test_families_that_lack_proposals_try_their_nearest_again_once(near):
    asked = request(**{"yield": "80 %"})
    making = _MadeCandidates(Run(), _Times(), 3, [])
    job = ProposalJob("vcfm", Candidate("2 Vs", near.spec), asked, 0)
    worse = Proposal("vcfm", "1 V", near.text, ("yield 20 %",), movable=True, numbers={"yield": 0.2})
    for one in (worse, near):
        making._take(job, one)
    (again,) = making.with_margins(1)
    assert again.earlier is near
    assert _key(again) != _key(job)
    good = Proposal("vcfm", "2 Vs", near.text, numbers={"yield": 0.9})
    making._take(again, good)
    assert making.done == [worse, good]
    assert making.with_margins(1) == []


@pytest.mark.slow
def test_a_strip_moved_for_a_yield_has_it():
    given = cfmkit.load("configs/studies/slider_crank_strip_yield.yaml")
    asked = tuple(one for one in given.requirements if one.metric != "yield")
    parameters = {path: {"normal": one.normal} for path, one in given.design.tolerances.items()}
    block = {"method": "tolerance", "parameters": parameters, "samples": 60}
    given = given.replace({"analysis.points": 31})
    spec = given.replace({"design": None, "requirements": asked, "sensitivity": block})
    candidate = Candidate("strip", given, design=True)
    moved = move_for_yield(candidate, spec, request(**{"yield": "85 %"}), 0.85, Run())
    assert moved.began < 0.6
    assert moved.share >= 0.85
    found = cfmkit.sensitivity(moved.spec, method="tolerance", samples=60, parameters=parameters)
    assert found.summary["yield"]["value"] >= 0.8
