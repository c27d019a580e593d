"""Laws of `suggest` reach what is known to exist: tight envelopes, late starts, travels of nearly all the reach."""

from __future__ import annotations

import pytest
from suggest_support import propose

import cfmkit
from cfmkit.families.beam.proposals import kept_shapes
from cfmkit.runs.read_suggest_file import read_request
from cfmkit.studies.suggest.proposal_making_and_judging import ProposalJob, judge_proposal, make_proposal

ABS = "{youngs_modulus: 1800 MPa, poisson_ratio: 0.35, yield_strength: 42.5 MPa}"


def offered(name, **keys):
    asked = read_request(None, {"safety": "1", **keys}).request()
    return asked, propose(name, asked).candidates


def test_a_diamond_shorter_than_the_leaves_stands_close_below_them():
    """The shipped finger of PLA is 51 mm high; with the diamond a rise below the leaves it needed 60 mm."""
    envelope = "[219 mm, 51.4 mm, 13.2 mm]"
    asked, candidates = offered(
        "vcfm", force="20 N", travel="9.9 mm", ripple="0.5 %", envelope=envelope, material="pla"
    )
    assert candidates
    frames = [candidate.spec.mechanism.frame for candidate in candidates]
    assert all(frame.clearance >= frame.block for frame in frames)
    assert asked.envelope[1] > 0.05


def test_flexures_for_a_short_travel_begin_late():
    keys = {"force": "1.5 N", "travel": "2.97 mm", "ripple": "0.73 %", "envelope": "[87.4 mm, 136.4 mm, 2.65 mm]"}
    asked, candidates = offered("slider-crank", **keys, material=f"[{ABS}]")
    starts = [float(one.spec.analysis.window[0]) for one in candidates if one.variant == "flexures"]
    assert max(starts) == pytest.approx(0.35 * asked.travel)


def test_a_tapered_strip_is_offered_for_a_travel_of_nearly_all_the_reach():
    keys = {"force": "1.506 N", "travel": "36.95 mm", "ripple": "2 %", "envelope": "[87.4 mm, 136.4 mm, 5.19 mm]"}
    _, candidates = offered("slider-crank", **keys, material=f"[{ABS}]")
    assert "tapered strip" in {one.variant for one in candidates}


def test_strips_that_are_probably_too_wide_come_after_those_that_are_not():
    keys = {"force": "1.506 N", "travel": "33 mm", "ripple": "2 %", "envelope": "[87.4 mm, 136.4 mm, 5.19 mm]"}
    _, full = offered("slider-crank", **keys, material=f"[{ABS}]")
    _, reserved = offered("slider-crank", **keys | {"safety": "1.5"}, material=f"[{ABS}]")
    assert not full[0].doubtful
    assert all(one.doubtful for one in reserved if one.variant == "strip")


def test_a_cam_whose_shafts_are_too_thick_for_its_rollers_is_no_proposal():
    spec = cfmkit.load("configs/cam.yaml").replace({"mechanism.roller_radius": "2 mm"})
    asked = read_request(None, {"force": "50 N", "travel": "230 mm", "envelope": "[500 mm, 700 mm]"}).request()
    proposal = judge_proposal("cam", "small rollers", spec, asked)
    assert "stress" in proposal.fails
    assert any(text.startswith("shafts of the rollers: ") for text in proposal.missed)


def test_a_shape_is_offered_with_its_own_thickness_too():
    """The shipped arch and 1 % more room: of 1.15 times its thickness it has larger pads, and does not fit."""
    material = "[{youngs_modulus: 2 GPa, poisson_ratio: 0.35, yield_strength: 60 MPa}]"
    keys = {"force": "0.4 N", "travel": "5.94 mm", "ripple": "1.8 %", "envelope": "[67.7 mm, 19.95 mm, 10.1 mm]"}
    asked, candidates = offered("beam", **keys, material=material)
    arches = [one for one in candidates if one.variant == "shape arch"]
    missed = [make_proposal(ProposalJob("beam", one, asked, 0)).missed for one in arches]
    assert () in missed
    thickest = max(arches, key=lambda one: one.spec.mechanism.thickness)
    assert any("needs" in text for text in missed[arches.index(thickest)])


def test_no_stored_shape_touches_itself():
    for kept in kept_shapes():
        result = cfmkit.analyze(kept.spec.replace({"analysis.fidelity": "reissner", "analysis.points": 11}))
        assert "beams_touch" not in {one.name for one in result.warnings}, kept.name
