"""Designs of the vcfm family: limits, the exact pass, equivalent targets."""

from __future__ import annotations

import re

import numpy as np
import pytest
import yaml
from suggest_support import propose, request
from vcfm_support import CONFIGS, MM, TABLE_I

import cfmkit
from cfmkit import Run, api
from cfmkit.families import Request, family
from cfmkit.families.vcfm import proposals
from cfmkit.families.vcfm.design import closed_form, fit_widths
from cfmkit.results import Status
from cfmkit.runs import read_request


def designed(*changes, stem="vcfm_pla"):
    return api.design(cfmkit.load(CONFIGS / f"{stem}.yaml", changes))


LIMITS = {
    # change: finding, key whose nearest feasible value is stated, other keys that the message names
    "design.stroke=5.8 mm": ("stroke_unreachable", "design.stroke", "design.rise"),
    "design.min_thickness=1.2 mm": ("too_thin", "design.stroke", "design.min_thickness"),
    "design.max_span=50 mm": ("envelope", "design.max_span"),
    "design.max_width=8 mm": ("envelope", "design.max_width"),
    "design.leaf_length=25 mm": ("overstressed", "design.leaf_length"),
    "mechanism.bistable.half_beams=8": ("out_of_plane_buckling", "design.leaf_length"),
}


@pytest.mark.parametrize("change", LIMITS)
def test_a_limit_is_named_and_the_nearest_feasible_value_works(change):
    name, path, *others = LIMITS[change]
    more = ("design.min_thickness=0.5 mm",) if name == "stroke_unreachable" else ()
    found = designed(change, *more)
    assert found.status is Status.INFEASIBLE
    assert found.warnings[0].name == name
    assert all(f"'{key}'" in found.message for key in others or [path])
    assert set(found.nearest_feasible) == {path}
    cured = designed(change, *more, f"{path}={found.nearest_feasible[path]}")
    assert cured.status is Status.COMPLETE, cured.message


BARE = {
    "cfmkit": 1,
    "family": "vcfm",
    "mechanism": {
        "material": {"youngs_modulus": "1477 MPa", "yield_strength": "30 MPa"},
        "positive": {"length": "27 mm", "angle": "7 deg", "thickness": "1.5 mm", "width": "10 mm"},
        "bistable": {"half_beams": 4, "length": "30 mm", "angle": "8 deg", "thickness": "1 mm", "width": "3.6 mm"},
    },
}


@pytest.mark.parametrize(
    ("force", "adjustment", "stroke", "rise"), [(11.15, 5, 3.8, 4.265), (42.4, 31, 5.1, 5.6), (24, 3, 2.2, 2.6)]
)
def test_a_bare_design_block_leads_to_an_analysis_of_what_was_requested(tmp_path, force, adjustment, stroke, rise):
    """Window, travel, preloads and requirements of the design itself: all met, without a word against it."""
    block = f"design: {{force: {force} N, adjustment: {adjustment} N, stroke: {stroke} mm, rise: {rise} mm}}\n"
    (tmp_path / "bare.yaml").write_text(yaml.safe_dump(BARE) + block)
    spec = api.design(cfmkit.load(tmp_path / "bare.yaml")).spec
    low, high = spec.analysis.window
    assert stroke * MM * (1 - 1e-3) <= high - low <= stroke * MM
    assert spec.analysis.travel == high
    # leaves buckle and straighten at 2h/3 (1 -/+ sqrt(1 - (pi t/h)^2)): between these lies the stroke
    height, thickness = rise * MM, spec.mechanism.bistable.thickness
    assert 4 / 3 * height * np.sqrt(1 - (np.pi * thickness / height) ** 2) == pytest.approx(stroke * MM, rel=1e-3)
    assert spec.analysis.preloads == pytest.approx((0.0, rise * MM * adjustment / force))
    for model in ("analytic", "exact"):
        found = api.analyze(spec.replace({"analysis.fidelity": model}))
        outcomes = {outcome.metric: outcome for outcome in found.requirements}
        assert {"force_ripple", "deviation_from_target", "force_change_max", "safety_factor"} == set(outcomes)
        assert all(outcome.ok for outcome in outcomes.values())
        # the widths that these forces take are those of wide leaves, which no change of the design cures
        assert {item.name for item in found.warnings} <= {"wide_beam"}


def test_what_a_design_is_told_to_analyse_stays():
    given = ("analysis={preloads: [0 mm, 1 mm], window: [1.5 mm, 4 mm]}", "requirements=[]")
    spec = designed(*given).spec
    assert spec.analysis.preloads == (0.0, 1e-3)
    assert spec.analysis.window == (1.5e-3, 4e-3)
    assert spec.requirements == ()


def test_leaves_that_cannot_buckle_have_no_nearest_stroke_and_are_told_the_rise():
    found = designed("design.min_thickness=2 mm")
    assert found.warnings[0].name == "too_thin"
    assert "'design.min_thickness'" in found.message
    assert "a rise above 6.283 mm, by 'design.rise'" in found.message
    assert found.nearest_feasible == {}


def test_a_design_without_strength_or_targets_is_invalid():
    assert "yield_strength" in designed("mechanism.material={youngs_modulus: 1477 MPa}").message
    assert api.design(cfmkit.load(TABLE_I)).status is Status.INVALID


def test_the_exact_pass_brings_the_exact_mean_to_the_target():
    for refine, error in ((True, 2e-4), (False, 9e-3)):
        found = designed(f"design.refine={str(refine).lower()}")
        exact = api.analyze(found.spec.replace({"analysis.fidelity": "exact"}))
        mean = api.evaluate(exact, ["force_mean"])["force_mean"].value
        assert abs(mean / 11.15 - 1) < error
        assert (abs(mean / 11.15 - 1) > 2e-3) is not refine


def test_rise_and_preload_say_the_same():
    one, other = (
        designed("design={force: 11.15 N, adjustment: 5 N, stroke: 3.8 mm, rise: 4.265 mm}"),
        designed("design={force: 11.15 N, adjustment: 5 N, stroke: 3.8 mm, preload: 1.9125560538116592 mm}"),
    )
    sizes = "mechanism.bistable.thickness", "mechanism.bistable.width", "mechanism.positive.width"
    assert [one.spec.get_value(path) for path in sizes] == pytest.approx(
        [other.spec.get_value(path) for path in sizes], rel=1e-9
    )


def test_the_sizes_of_a_design_follow_its_targets_without_jumps():
    """Targets 1e-9 apart: to which side the leaves buckle is open, and must not show."""
    paths = "mechanism.bistable.width", "mechanism.positive.width"
    found = []
    for change in range(6):
        preload = 1.9125560538116592 * (1 + 1e-9 * change)
        spec = designed(f"design={{force: 11.15 N, adjustment: 5 N, stroke: 3.8 mm, preload: {preload!r} mm}}").spec
        found.append([spec.get_value(path) for path in paths])
    assert np.abs(np.diff(np.log(found), 2, axis=0)).max() < 1e-10


def test_without_an_adjustment_there_is_no_preload_and_nothing_is_required_of_one(tmp_path):
    block = "design: {force: 11.15 N, stroke: 3.8 mm, rise: 4.265 mm}\n"
    (tmp_path / "bare.yaml").write_text(yaml.safe_dump(BARE) + block)
    found = api.design(cfmkit.load(tmp_path / "bare.yaml"))
    assert found.spec.analysis.preloads == (0.0,)
    assert "force_change_max" not in {one.metric for one in found.spec.requirements}
    made = api.analyze(found.spec)
    assert made.status is Status.COMPLETE
    low, high = (float(end) for end in found.spec.analysis.window)
    inside = (made.curve.displacement >= low) & (made.curve.displacement <= high)
    np.testing.assert_allclose(made.curve.force[inside], 11.15, rtol=0.02)


@pytest.mark.parametrize("structure", ["cosine arches", "hybrid leaves", "folded spring"])
def test_a_proposal_with_another_structure_is_adjusted_by_preloads_of_its_own_spring(structure):
    stated = {"force": "10 N", "travel": "2 mm", "ripple": "5 %", "envelope": "[200 mm, 200 mm]"}
    request = Request.from_block(read_request(None, stated | {"adjustable": "[8 N, 12 N]"}))
    words = proposals.STRUCTURE_BLOCKS[structure][1].variant
    candidates = proposals.propose(request, Run()).candidates
    chosen = next(one for one in candidates if one.variant.startswith(words))
    made = family("vcfm").design.make(chosen.spec.replace({"design.refine": False}), Run()).spec
    finished = chosen.finish(made, request)
    found = cfmkit.analyze(finished)
    change = next(one.values for one in found.tables["adjustability"]().columns if one.name == "force_change")
    assert list(change) == pytest.approx([0.0, 2.0, -2.0], abs=0.025)
    assert "overstressed" not in [one.name for one in found.warnings]


DESIGNS = {
    # changes: closed form (Q, t2, L2, theta2 in deg, b2, L1, b1), then b2 and b1 after the fit
    "vcfm_pla": ([], (4.22283, 1.00999, 30.22753, 8.1113, 3.59771, 27.052, 10.3268), (3.59411, 10.4295)),
    "vcfm_aluminium": ([], (3.6276, 0.4135, 26.836, None, None, 21.474, None), (9.638, 21.174)),
}


@pytest.mark.parametrize("stem", DESIGNS)
def test_worked_designs_by_closed_forms_and_one_exact_pass(stem):
    _, closed, fitted = DESIGNS[stem]
    spec = cfmkit.load(CONFIGS / f"{stem}.yaml")
    sizes = closed_form(spec, spec.design)
    leaf, spring_leaf = sizes.leaf, sizes.spring_leaf
    mm = [leaf.thickness, leaf.length, leaf.width, spring_leaf.length, spring_leaf.width]
    t2, l2, b2, l1, b1 = (value / MM for value in mm)
    found = (leaf.slenderness, t2, l2, np.degrees(leaf.angle), b2, l1, b1)
    digits = (5e-5, 5e-5, 5e-4, 5e-5, 5e-5, 5e-4, 5e-4)
    for value, wanted, digit in zip(found, closed, digits, strict=True):
        assert wanted is None or value == pytest.approx(wanted, abs=1.1 * digit)
    after, (stress, _) = fit_widths(spec, spec.design, sizes)
    assert (after.leaf.width / MM, after.spring_leaf.width / MM) == pytest.approx(fitted, rel=2e-4)
    assert stress == pytest.approx(spec.mechanism.allowable_stress, rel=2e-3)


# --- proposals ---------------------------------------------------------------------------------------------------


def test_the_width_that_a_refusal_of_leaves_names_is_the_least_that_they_fit():
    """There with helical springs, as narrow as their leaves; with a diamond in a wider envelope."""

    def offer_within(across):
        return propose("vcfm", request(envelope=f"[{across} mm, 100 mm]"))

    across = float(re.search(r"need ([\d.]+) mm across", offer_within(20.0).reason)[1])
    assert not offer_within(0.998 * across).candidates
    (coiled,) = offer_within(1.002 * across).candidates
    assert coiled.variant == "2 Vs, catalogue springs"
    unrefined = coiled.spec.replace({"design.refine": False})
    drawn = family("vcfm").envelope(cfmkit.analyze(family("vcfm").design.make(unrefined, Run()).spec))
    assert drawn.across == pytest.approx(1e-3 * across, rel=2e-3)
    assert {"2 Vs", "2 Vs, catalogue springs"} <= {each.variant for each in offer_within(60.0).candidates}
