"""Everything that can be wrong with a mechanism is found, by its name and with the numbers that decide."""

from __future__ import annotations

import pytest
from vcfm_support import analyzed, message, names, table_i

import cfmkit
from cfmkit import api
from cfmkit.errors import SpecError
from cfmkit.families.vcfm.findings import FINDINGS, finding
from cfmkit.results import Status

FLAT = "mechanism.positive.width=8.509 mm"
"""With K_p = K_n."""


def leaf(**values: str) -> list[str]:
    return [f"mechanism.bistable.{name}={value}" for name, value in values.items()]


CASES = {
    "no_negative_stiffness": (leaf(thickness="3.1 mm"), "only rises"),
    "no_linear_region": (leaf(thickness="1.5 mm"), "not above pi"),
    "not_flat": (["analysis.flatness=5 %"], "3.202 N/mm and K_n = 2.725 N/mm do not cancel"),
    "bistable": ([], "so the mechanism returns by itself"),
    "overload": ([], "a stop at 4.771 mm"),
    "asymmetric_buckling": (leaf(guided="false"), "51.1 %"),
    "out_of_plane_buckling": (leaf(width="1.9 mm"), "1.9 mm wide and 1 mm thick"),
    "yield": (["mechanism.material.allowable_stress=22 MPa"], "passes 22 MPa at 4.2 mm"),
    "imperfection": (leaf(waviness="0.1 mm"), "10 % of the thickness"),
    "theory_range": (leaf(angle="16 deg"), "16 deg: beyond 15 deg"),
    "truss_law": (["analysis.fidelity=truss"], "35.9 % higher at 2 times the travel"),
    "measured_contradiction": ([], "the force is K_p h = 5.972 N; 11.15 N needs 2.614 N/mm"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_failure_mode_is_found_with_its_numbers(name):
    changes, words = CASES[name]
    assert words in message(analyzed(*changes), name)


def test_a_sound_mechanism_has_nothing_to_be_said_against_it():
    found = analyzed(FLAT, "analysis.travel=4.7 mm", "analysis.measured=null", "mechanism.bistable.width=6 mm")
    assert set(names(found)) == {"bistable"}


@pytest.mark.parametrize("name", ["not_flat", "overload", "measured_contradiction"])
def test_what_does_not_hold_is_not_said(name):
    changes = {
        "not_flat": [FLAT],
        "overload": ["analysis.travel=4.7 mm"],
        "measured_contradiction": ["analysis.measured.positive_stiffness=2.61 N/mm"],
    }[name]
    assert name not in names(analyzed(*changes))


def test_travel_beyond_the_closed_forms_is_told():
    told = message(analyzed("analysis.travel=7.2 mm"), "theory_range")
    assert "beyond 1.6 times the rise (6.825 mm)" in told
    assert "theory_range" not in names(analyzed("analysis.travel=7.2 mm", "analysis.fidelity=exact"))


def test_a_pull_beyond_the_rise_leaves_no_outward_force():
    found = analyzed(FLAT, preloads="[0 mm, -2 mm, -4.3 mm]")
    told = message(found, "preload_out_of_range")
    assert "a preload of -4.3 mm" in told
    assert "vanishes at -4.265 mm" in told
    assert "preload_out_of_range" not in names(analyzed(FLAT, preloads="[0 mm, -2 mm, -4.1 mm]"))


def test_a_pulled_nominal_curve_that_reaches_zero_is_a_reversal():
    found = analyzed(FLAT, preloads="[-4.3 mm]")
    assert "no outward force is left" in message(found, "force_reversal")
    assert "force_reversal" not in names(analyzed(FLAT, preloads="[-4 mm]"))


def test_without_spring_enough_the_mechanism_stays_where_it_snaps_to():
    found = analyzed("mechanism.positive.width=0.5 mm")
    assert "stays there until it is pulled back" in message(found, "bistable")
    assert found.values["least_force"].value < 0


def test_the_unstable_form_is_marked_and_named():
    found = analyzed("analysis.fidelity=exact", "analysis.branch=primary", "analysis.travel=4 mm")
    assert "from 0.9167 mm to 4 mm" in message(found, "unstable_branch")
    assert not found.curve.stable[-1]
    assert found.curve.stable[0]


def test_the_stroke_that_a_design_cannot_reach_is_told_with_the_nearest_that_it_can():
    spec = cfmkit.load(
        "configs/vcfm_pla.yaml", ["design.stroke=5.8 mm", "mechanism.bistable.half_beams=2", "requirements=[]"]
    )
    design = api.design(spec)
    assert design.status is Status.INFEASIBLE
    assert design.warnings[0].name == "stroke_unreachable"
    assert "above 4.35 mm" in design.message


def test_every_finding_is_explained_and_no_other_can_be_made():
    tested = {*CASES, "preload_out_of_range", "force_reversal", "unstable_branch", "stroke_unreachable"}
    designs = {"too_thin", "envelope", "stress_unreachable"}  # see test_vcfm_design.py
    assert tested | designs == set(FINDINGS)
    with pytest.raises(KeyError):
        finding("bad_luck", "")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["mechanism.positive.structure=u-shape"], "needs 'radius'"),
        (["mechanism.bistable.structure=hybrid"], "needs 'flexure_length'"),
        (leaf(structure="hybrid", flexure_length="18 mm"), "shorter than 'length'"),
        (["mechanism.material={poisson_ratio: 0.3}"], "needs 'name' or 'youngs_modulus'"),
        (["mechanism.material.name=cheese"], "cheese"),
        (["analysis.preloads=[0 mm, 0 mm]"], "twice"),
        (["analysis.fidelity=truss", "mechanism.bistable.structure=cosine"], "truss laws are for"),
        (["mechanism.bistable.half_beams=0"], "1"),
        (["design={force: 1 N, adjustment: 1 N, stroke: 1 mm}"], "either 'preload' or 'rise'"),
    ],
)
def test_what_makes_no_sense_is_refused(changes, words):
    with pytest.raises(SpecError, match=words):
        table_i(*changes)
