"""Identities and limits of the vcfm family: laws, windows, blocks, tables, shapes, outlines, pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from study_rows import assert_rows_equal_runs, draw_points, study_of
from vcfm_support import CONFIGS, MM, analyzed, leaf, table_i

import cfmkit
from cfmkit import api
from cfmkit.errors import GeometryError
from cfmkit.export import files
from cfmkit.families import family
from cfmkit.families.vcfm.curves_in_rows import PreloadedRows
from cfmkit.families.vcfm.leaf_laws_from_spec import leaf_spring, parts
from cfmkit.families.vcfm.leaves.cosine import CosineLeaf
from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
from cfmkit.families.vcfm.leaves.hybrid import HybridLeaf
from cfmkit.families.vcfm.leaves.kinds import LeafKind, LeafLaw, stack_laws
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Diamond, Folded, UShape
from cfmkit.families.vcfm.leaves.s_form import POLE_LOAD, axial_root, compliance, end_curvature, pose
from cfmkit.families.vcfm.leaves.v_beam import TrussLeaf, VBeam, critical_force
from cfmkit.families.vcfm.leaves_spec import LEAF_KINDS, SPRING_KINDS
from cfmkit.families.vcfm.model import rests_by_laws, rests_of, solve_rows
from cfmkit.families.vcfm.part import _leaf_spring, leaf_thickness
from cfmkit.families.vcfm.quantities import SCALAR_QUANTITIES, force_statistics
from cfmkit.families.vcfm.range_and_flatness_findings import extreme_sums
from cfmkit.metrics import CycleRows, evaluate
from cfmkit.results import Status
from cfmkit.studies import points_at_once

# --- preloads together, and lines together ---------------------------------------------------------------------


@pytest.mark.parametrize("name", ["vcfm_ding2022", "vcfm_cosine", "vcfm_hybrid"])
def test_what_all_preloads_share_is_what_each_has_alone(name):
    spec = cfmkit.load(CONFIGS / f"{name}.yaml").replace({"analysis.preloads": ["0 mm", "1 mm", "3 mm", "-0.5 mm"]})
    solution = cfmkit.analyze(spec).state
    grid = np.linspace(0.0, spec.travel, spec.analysis.points)
    together = PreloadedRows(solution.sampler, np.array(spec.analysis.preloads)[:, None], solution.curves.stops)
    alone = [rests_of(replace(together, preload=one[None]), grid)[0] for one in together.preload]
    assert rests_of(together, grid) == pytest.approx(alone, rel=1e-13, nan_ok=True)
    windows = np.transpose(solution.curves.flat_parts(spec.analysis.flatness))
    for row, (push, window) in enumerate(zip(solution.pushes, windows, strict=True)):
        one = solution.curves.select_rows(np.array([row]))
        wanted = np.ravel(one.flat_parts(spec.analysis.flatness))
        assert window == pytest.approx(wanted, rel=1e-12, nan_ok=True)
        if push.rest:
            left = one.force_at(np.array([[push.rest]]))[0, 0]
            assert abs(left) < 1e-12 * np.abs(push.force).max()


def test_the_stress_of_a_buckled_arch_is_bending_and_the_axial_stress_of_its_critical_force():
    """As exact leaves have it: within half a percent, of which the axial stress is several."""
    closed, exact = (
        analyzed("mechanism.bistable.structure=cosine", f"analysis.fidelity={model}")
        .values["bistable_stress_max"]
        .value
        for model in ("analytic", "exact")
    )
    assert closed == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize("count", [1, 2, 3, 500])
def test_extremes_of_many_lines_are_those_of_the_few_that_matter(count):
    rng, factors = np.random.default_rng(count), np.geomspace(0.2, 5.0, 41)
    slopes, offsets = rng.normal(size=count).round(1), rng.normal(size=count)
    sums = factors[:, None] * slopes + offsets
    for way, wanted in ((1.0, sums.max(axis=1)), (-1.0, sums.min(axis=1))):
        np.testing.assert_allclose(extreme_sums(factors, slopes, offsets, way), wanted, rtol=1e-13, atol=1e-13)


# --- the S form ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("z", [-900.0, -30.0, -0.36, -0.34, 0.0, 0.34, 0.36, 5.0, 15.0, 20.0])
def test_the_shortening_is_a_quarter_of_the_falling_end_curvature(z):
    """e = -(dw/dz)/4 and its own derivative, across the ranges of series, circular and hyperbolic functions."""
    step = 1e-4 * max(1.0, abs(z) * 1e-2)
    ends = np.array([z - step, z + step])
    e, slope = compliance(np.array([z]))
    assert e[0] == pytest.approx(-0.25 * np.diff(end_curvature(ends))[0] / (2 * step), rel=1e-6)
    assert slope[0] == pytest.approx(np.diff(compliance(ends)[0])[0] / (2 * step), rel=1e-5)


def test_the_axial_root_solves_its_equation_everywhere():
    travel = np.concatenate([-np.geomspace(1e-6, 0.2, 40), np.geomspace(1e-6, 0.4, 200)])
    at = pose(np.radians(7), travel)
    stretch = (1 / 35) ** 2 / 3
    z = axial_root(at.shortening, at.turn, stretch)
    assert (z < POLE_LOAD).all()
    assert stretch * z + at.turn**2 * compliance(z)[0] == pytest.approx(at.shortening, abs=1e-15, rel=1e-9)


def test_a_pose_keeps_its_digits_for_tiny_travels():
    at = pose(np.radians(7), np.array([1e-9]))
    assert at.turn[0] == pytest.approx(1e-9 * np.cos(np.radians(7)), rel=1e-8)
    assert at.shortening[0] == pytest.approx(1e-9 * np.sin(np.radians(7)), rel=1e-8)


def test_the_force_is_the_derivative_of_no_jump():
    """The two laws are joined where they cross."""
    law = VBeam(leaf())
    for place in law.linear_range:
        below, above = law.force(np.array([place - 1e-9, place + 1e-9]))
        assert above == pytest.approx(below, abs=1e-7)


def test_laws_are_the_same_for_one_leaf_and_for_many():
    thickness = np.array([0.6, 0.9, 1.2, 1.4])
    travel = np.linspace(-0.5, 7, 61)
    together = VBeam(leaf(thickness[:, None])).force(travel[None, :])
    for row, one in zip(together, thickness, strict=True):
        assert row == pytest.approx(VBeam(leaf(float(one))).force(travel), rel=1e-9, abs=1e-10)


def test_forces_scale_with_width_modulus_and_size():
    travel, strip = np.linspace(0.1, 6, 50), leaf()
    wide = VBeam(LeafStrip(35.0, strip.angle, 1.0, 12.0, 1477.0, 0.3))
    stiff = VBeam(LeafStrip(35.0, strip.angle, 1.0, 6.0, 2954.0, 0.3))
    large = VBeam(LeafStrip(70.0, strip.angle, 2.0, 12.0, 1477.0, 0.3))
    once = VBeam(strip).force(travel)
    assert wide.force(travel) == pytest.approx(2 * once, rel=1e-12)
    assert stiff.force(travel) == pytest.approx(2 * once, rel=1e-12)
    assert large.force(2 * travel) == pytest.approx(4 * once, rel=1e-9)


def test_a_diamond_without_angle_is_a_parallel_guide():
    flat = LeafStrip(25.0, 0.0, 1.0, 10.0, 1477.0, 0.3)
    assert Diamond(flat).stiffness == pytest.approx(12 * flat.bending / 25.0**3, rel=6e-3)


@pytest.mark.parametrize("model", ["analytic", "exact"])
@pytest.mark.parametrize(
    "changes",
    [
        ["analysis.flatness=5 %"],
        ["analysis.flatness=1 %", "mechanism.positive.width=8.509 mm"],
        ["mechanism.bistable.structure=cosine", "mechanism.bistable.thickness=2 mm"],
        ["mechanism.bistable.thickness=0.3 mm", "mechanism.positive.width=0.25 mm"],
    ],
)
def test_places_do_not_depend_on_the_number_of_points(model, changes):
    names = ("window_start", "window_end", "window_length", "window_force", "least_force", "rest_shift_max")
    names += ("bistable_stress_max", "spring_stress_max", "travel_stress_max")
    few, some, many = (
        analyzed(f"analysis.fidelity={model}", *changes, f"analysis.points={n}", preloads="[0 mm, 1 mm]")
        for n in (31, 301, 3001)
    )
    for found in (few, some):
        for name in names:
            assert found.values[name].value == pytest.approx(many.values[name].value, rel=1e-6), name


def test_the_stress_at_the_end_of_the_window_does_not_depend_on_the_number_of_points():
    """It was that of the last sample before: 0.5 % too low with 41 points."""
    few, many = (analyzed("analysis.window=[2 mm, 4.03 mm]", f"analysis.points={n}") for n in (41, 1500))
    for name in ("spring_stress_max", "bistable_stress_max"):
        assert few.values[name].value == pytest.approx(many.values[name].value, rel=1e-6), name


def test_the_ends_of_a_window_are_where_the_force_leaves_the_band():
    found = analyzed("analysis.flatness=1 %", "mechanism.positive.width=8.509 mm", "analysis.points=121")
    start, end = (found.values[name].value for name in ("window_start", "window_end"))
    fine = analyzed("mechanism.positive.width=8.509 mm", "analysis.points=60001").curve
    for low, high in ((start, end), (start - 1e-5, end), (start, end + 1e-5)):
        inside = (fine.motion >= low) & (fine.motion <= high)
        ripple = np.ptp(fine.force[inside]) / fine.force[inside].max()
        assert bool(ripple <= 0.01 * (1 + 2e-4)) is ((low, high) == (start, end))


def test_the_map_of_preloads_has_a_start_of_the_window_without_jags():
    """From one preload to the next it moves evenly; by samples it jumped by their distance."""
    found = analyzed("analysis.flatness=5 %", preloads="[0 mm, 6 mm]")
    drawn = api.figures(found)["adjustability"]()
    lines = [line.get_ydata() for line in drawn.axes[-1].lines if len(line.get_ydata()) > 10]
    steps = np.diff(lines[0])
    assert np.abs(np.diff(steps)).max() < 0.02 * np.abs(steps).max()


# --- rows ------------------------------------------------------------------------------------------------------

RANGES = {
    "mechanism.positive.length": "22 mm:28 mm",
    "mechanism.positive.thickness": "1.2 mm:1.8 mm",
    "mechanism.bistable.angle": "5 deg:9 deg",
    "mechanism.bistable.thickness": "0.6 mm:1.5 mm",
    "mechanism.bistable.half_beams": [2, 4],
}
WIDE = RANGES | {
    "mechanism.bistable.angle": "4 deg:17 deg",
    "mechanism.bistable.thickness": "0.4 mm:4 mm",
    "mechanism.material.youngs_modulus": "1200 MPa:2000 MPa",
}
IN_WINDOW = ("force_mean", "force_sd", "force_max", "force_min", "force_ripple", "half_band", "deviation_from_mean")
NAMES = (*IN_WINDOW, "static_balance", *SCALAR_QUANTITIES)


@pytest.mark.slow
@pytest.mark.parametrize(("names", "ranges"), [(NAMES, RANGES), (("force_mean", "rise"), WIDE)], ids=["all", "wide"])
@pytest.mark.parametrize("model", ["truss", "analytic"])
@pytest.mark.parametrize(
    ("window", "preloads"),
    [
        ("[2 mm, 4 mm]", "[0 mm]"),
        ("[1.003 mm, 4.111 mm]", "[0 mm]"),
        ("null", "[0 mm]"),
        ("[2 mm, 4 mm]", "[0 mm, 9 mm, 3 mm]"),
    ],
)
def test_rows_have_the_numbers_and_warnings_of_their_points(model, window, preloads, names, ranges):
    spec = table_i(
        f"analysis.fidelity={model}", f"analysis.window={window}", "analysis.points=101", "requirements=[]",
        "mechanism.material={youngs_modulus: 1477 MPa, yield_strength: 30 MPa}", "analysis.flatness=5 %",
        preloads=preloads,
    )  # fmt: skip
    study, plan = study_of(spec, draw_points(spec, ranges, 64), names)
    assert points_at_once(study, plan) > 1
    rows = assert_rows_equal_runs(study, plan, step=4)
    if ranges is WIDE:
        assert sum(mask.any() for mask in rows.warned.values()) > (2 if model == "truss" else 5)


def of_widths(*changes, preloads="[0 mm]"):
    """Return Table I with changes as rows of two widths; nothing where its model is not solved in rows."""
    spec = table_i("analysis.window=[2 mm, 4 mm]", *changes, preloads=preloads)
    return [rows for _, rows in solve_rows([spec.replace({"mechanism.bistable.width": w}) for w in (5e-3, 6e-3)])]


@pytest.mark.parametrize(
    "changes",
    [
        ["mechanism.bistable.structure=cosine"],
        ["mechanism.bistable.structure=hybrid", "mechanism.bistable.flexure_length=5 mm", "analysis.fidelity=analytic"],
        ["mechanism.positive.structure=straight", "mechanism.positive.angle=0 deg"],
        ["analysis.preloads=[1 mm]"],
        ["analysis.preloads=[0 mm, -1 mm]"],
        ["mechanism.bistable.flexure_length=16 mm"],
    ],
)
def test_every_closed_form_is_solved_in_rows_at_any_preload(changes):
    (rows,) = of_widths(*changes)
    assert rows.complete.all()


def test_what_has_no_closed_form_is_left_to_the_model_of_one():
    assert not of_widths("analysis.fidelity=exact")


def test_rows_warn_of_the_stress_at_all_preloads_and_leave_springs_that_close_to_the_model_of_one():
    made_of = "mechanism.material={youngs_modulus: 1477 MPa, yield_strength: 50 MPa}"
    (pushed,) = of_widths(made_of, preloads="[0 mm, 7.5 mm]")
    assert pushed.findings()["overstressed"].all()
    (free,) = of_widths(made_of)
    assert "overstressed" not in free.findings()
    (closed,) = of_widths(preloads="[0 mm, 12 mm]")
    assert not closed.complete.any()


# --- curves and tables -----------------------------------------------------------------------------------------


def test_force_is_leaves_and_spring_together_and_every_curve_starts_at_rest():
    found = analyzed(preloads="[0 mm, 5 mm, -1 mm]")
    for curve, push in zip(found.curves, found.state.pushes, strict=True):
        extra = curve.extra
        assert curve.force == pytest.approx(extra["bistable_force"].values + extra["spring_force"].values)
        assert curve.force[0] == pytest.approx(0, abs=1e-6)
        assert curve.displacement[0] == pytest.approx(push.rest, abs=1e-15)
        assert curve.label == {"preload": (push.preload, "length")}
    assert found.state.pushes[1].rest < 0 < found.state.pushes[2].rest


def test_the_adjustability_table_has_a_row_for_each_preload():
    found = analyzed(preloads="[0 mm, 2.5 mm, 7.5 mm]")
    table = found.tables["adjustability"]()
    assert table["preload"].tolist() == [0, 2.5, 7.5]
    stiffness = found.values["positive_stiffness"].value / 1e3
    assert table["force_change"] == pytest.approx(stiffness * table["preload"], abs=1e-9)
    assert (np.diff(table["rest_position"]) < 0).all()


def test_half_of_the_spring_is_half_as_stiff():
    whole, half = (analyzed(f"mechanism.positive.loaded={part}") for part in ("whole", "half"))
    assert half.values["positive_stiffness"].value == pytest.approx(0.5 * whole.values["positive_stiffness"].value)


def test_an_exact_run_that_cannot_be_followed_is_partial_and_says_how_far_it_came():
    found = analyzed("analysis.fidelity=exact", "mechanism.bistable.guided=false", "analysis.travel=6 mm")
    assert found.status is Status.PARTIAL
    assert "were followed only to 5.7" in found.message
    assert found.curve.motion[-1] < 5.8 * MM


def test_a_spring_that_is_drawn_straight_is_followed_on_as_it_stretches():
    """With corners that leave it open; at 500 mm its beams are straight: stiff, and as far as it goes linear."""
    preloads = "[0 mm, 400 mm, 450 mm, 500 mm]"
    found = analyzed("analysis.fidelity=exact", "mechanism.frame.corner=600 mm", preloads=preloads)
    assert found.status is Status.COMPLETE
    low, middle, high = (curve.force[-1] for curve in found.curves[1:])
    assert high - middle == pytest.approx(middle - low, rel=0.02)


@pytest.mark.parametrize("preload", [-4.0, -5.0])
def test_a_spring_that_is_pulled_over_the_whole_travel_is_followed_to_its_end(preload):
    changes = "analysis.travel=4 mm", "analysis.window=null", "analysis.points=41", "requirements=[]"
    found, closed = (
        analyzed(*changes, f"analysis.fidelity={model}", preloads=f"[{preload} mm]") for model in ("exact", "analytic")
    )
    assert found.status is Status.COMPLETE
    assert found.curve.motion[-1] == pytest.approx(4 * MM)
    assert found.curve.effort[-1] == pytest.approx(closed.curve.effort[-1], abs=0.06)


def test_exact_forces_do_not_depend_on_the_number_of_points():
    few, many = (analyzed("analysis.fidelity=exact", f"analysis.points={n}") for n in (31, 481))
    at = np.interp(few.curve.motion, many.curve.motion, many.curve.force)
    assert at == pytest.approx(few.curve.force, abs=1e-9)


@pytest.mark.parametrize("structure", ["v-beam", "cosine"])
@pytest.mark.parametrize(("slenderness", "top"), [(3.4, 3.0), (10.66, 1.4), (14.2, 2.1), (40, 1.4)])
def test_exact_leaves_are_those_of_a_path_through_the_very_points(structure, slenderness, top):
    """Before thin leaves buckle, too: 1/500 of the rise at Q = 40. To 1e-6 of the peak, up to three times the rise."""
    from cfmkit.elastica import Control, Displacement, trace
    from cfmkit.families.vcfm.exact_model import DOWN_ANGLE, leaf_network
    from cfmkit.families.vcfm.interpolated_equilibrium_path import trace_leaf

    rise = 4.265427 * MM
    spec = table_i(
        f"mechanism.bistable.thickness={rise / slenderness} m", f"mechanism.bistable.structure={structure}",
        "analysis.fidelity=exact",
    )  # fmt: skip
    found = trace_leaf(leaf_network(spec), "shuttle", top * rise)
    onset, draw = found.edges[1], np.random.default_rng(7)
    places = np.sort(np.concatenate([draw.uniform(0, onset, 20), draw.uniform(0, top * rise, 60)]))
    path = trace(leaf_network(spec), Displacement("shuttle", DOWN_ANGLE, places), Control(tolerance=1e-8))
    here = path.at_requested
    force, stress, _, buckled = found.evaluate(path.drive[here])
    peak = np.abs(path.effort[path.drive < rise]).max()
    assert force == pytest.approx(path.effort[here], abs=1e-6 * peak)
    assert stress == pytest.approx(path.beam_stresses()[0][0][here], rel=1e-3, abs=2e-4 * stress.max())
    assert buckled.tolist() == [found.edges[1] < place < found.buckled_range[1] for place in path.drive[here]]


@pytest.mark.parametrize(
    ("structure", "angle", "length", "slenderness"),
    [("v-beam", 7, 35, 3.14309), ("v-beam", 7, 35, 3.15), ("v-beam", 4, 50, 3.15124), ("cosine", 3, 80, 2.34064)],
)
def test_leaves_just_slender_enough_to_buckle_keep_to_the_buckled_branch(structure, angle, length, slenderness):
    """Nodes requested next to a bifurcation led past the branch: the force was that of the unstable form."""
    thickness = length * np.sin(np.radians(angle)) / slenderness
    found = analyzed(
        f"mechanism.bistable.thickness={thickness} mm", f"mechanism.bistable.structure={structure}",
        f"mechanism.bistable.angle={angle} deg", f"mechanism.bistable.length={length} mm",
        "analysis.fidelity=exact", "analysis.window=null", "analysis.travel=6 mm",
    )  # fmt: skip
    forms = found.curve.extra["leaf_form"].values.tolist()
    assert found.curve.stable.all()
    assert [form for form, before in zip(forms, ["", *forms], strict=False) if form != before] == [
        "bent", "buckled", "bent",
    ]  # fmt: skip


def test_arches_that_just_begin_to_buckle_are_followed_to_the_end():
    """Their branch opens and closes within 0.08 mm: at 2.3098 to 2.31 the run was partial, and said that they jump."""
    thickness = 80 * np.sin(np.radians(3)) / 2.3099
    found, near = (
        analyzed(
            f"mechanism.bistable.thickness={thickness * factor} mm", "mechanism.bistable.structure=cosine",
            "mechanism.bistable.angle=3 deg", "mechanism.bistable.length=80 mm", "analysis.fidelity=exact",
            "analysis.window=null", "analysis.travel=6 mm", "analysis.preloads=[0 mm]",
        )
        for factor in (1.0, 1.0002)  # the thicker ones do not buckle
    )  # fmt: skip
    assert found.status is Status.COMPLETE
    assert found.curve.stable.all()
    force, other = (one.curve.extra["bistable_force"].values for one in (found, near))
    assert force * 1.0002**3 == pytest.approx(other, abs=3e-4 * force.max())


def test_exact_leaves_have_their_force_where_a_coarse_sampling_cut_the_peak_off():
    """At 0.4 mm the four leaves carry 0.7147 N just before they buckle; interpolated from 127 points it was 0.55 N."""
    found = analyzed("analysis.fidelity=exact", "mechanism.bistable.thickness=0.4 mm", "analysis.points=4801")
    leaves = np.interp(0.125 * MM, found.curve.motion, found.curve.extra["bistable_force"].values)
    assert leaves == pytest.approx(0.7147, abs=5e-5)


LEAF = LeafStrip(35 * MM, np.radians(7), 1 * MM, 6 * MM, 1477e6, 0.3)


def test_force_and_stress_of_a_bar_are_those_of_its_shortened_line():
    """By the half difference of the squares of its lengths: pressed up to twice the rise, drawn beyond."""
    bar = TrussLeaf(LEAF)
    for travel in np.array([0.1, 0.7, 1.0, 1.5, 2.4]) * LEAF.rise:
        across, along = bar.bent_line(travel)[-1] - bar.bent_line(travel)[0]
        strain = 0.5 * (1.0 - (across**2 + along**2) / LEAF.length**2)
        assert bar.stress(travel) == pytest.approx(LEAF.youngs_modulus * abs(strain), rel=1e-10)
        assert bar.force(travel) == pytest.approx(LEAF.axial * strain * along / LEAF.length, rel=1e-10, abs=1e-12)


def test_an_arch_has_a_finite_shortening_at_the_load_of_its_own_wave():
    """There its own wave grows without bound, and the other one cancels it."""
    before, there, behind = 0.25 * np.pi**2 * np.array([1.0 - 1e-4, 1.0, 1.0 + 1e-4])
    arch = CosineLeaf(LEAF)
    coefficients = np.array([arch._quadratic(np.array([z])) for z in (before, there, behind)])[..., 0]
    assert coefficients[1] == pytest.approx(0.5 * (coefficients[0] + coefficients[2]), rel=1e-6)


# --- kinds ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ForceAndStress(LeafLaw):
    """The law of a bar, and nothing else of it."""

    def force(self, travel):
        return TrussLeaf(self.strip).force(travel)

    def stress(self, travel):
        return TrussLeaf(self.strip).stress(travel)


@dataclass(frozen=True)
class BarInColumns(ForceAndStress):
    """The same for leaves in columns."""

    one_by_one = False


def test_what_a_law_leaves_out_follows_from_its_force_for_leaves_in_columns():
    leaves = [LEAF, replace(LEAF, thickness=2e-3), replace(LEAF, angle=0.1)]
    columns = stack_laws([BarInColumns(leaf) for leaf in leaves])
    for name in ("negative_stiffness", "first_stiffness", "balance"):
        alone = [getattr(ForceAndStress(leaf), name) for leaf in leaves]
        assert np.ravel(getattr(columns, name)).tolist() == pytest.approx(alone, rel=1e-12), name
        assert np.shape(getattr(columns, name)) == (3, 1), name


def test_a_law_of_force_and_stress_has_all_that_is_asked_of_a_leaf():
    leaf, bar = ForceAndStress(LEAF), TrussLeaf(LEAF)
    travel = np.linspace(0.0, 2.0, 9)[None] * LEAF.rise
    assert leaf.first_stiffness == pytest.approx(bar.first_stiffness, rel=2e-3)
    assert leaf.negative_stiffness == pytest.approx(bar.negative_stiffness, rel=1e-4)
    assert leaf.balance == bar.balance
    assert not leaf.is_buckled(travel).any()
    two = stack_laws([leaf, ForceAndStress(replace(LEAF, thickness=2e-3))])
    assert two.force(travel)[1] == pytest.approx(2.0 * leaf.force(travel)[0], rel=1e-12)
    assert two.state(travel)[1].shape == two.is_buckled(travel).shape == (2, 9)
    assert two.balance[:, 0].tolist() == [bar.balance] * 2


def test_the_example_of_the_page_is_a_kind_of_leaf():
    page = (CONFIGS.parent / "docs" / "extending.md").read_text(encoding="utf-8")
    code = page.split("## A kind of leaf or spring")[1].split("```py\n")[1].split("```")[0]
    given = {"Any": Any, "LeafKind": LeafKind, "LeafLaw": LeafLaw, "VBeam": VBeam}
    names: dict[str, Any] = given | {"dataclass": dataclass, "replace": replace, "__name__": __name__}
    exec(code, names)  # the page's own code
    travel, kind = np.linspace(0.0, 2.0, 41) * LEAF.rise, names["TAPERED"]
    even = VBeam(replace(LEAF, thickness=1.1 * LEAF.thickness))
    law = kind.law(LEAF, None)
    for read in ("force", "stress", "is_buckled"):
        assert getattr(law, read)(travel).tolist() == getattr(even, read)(travel).tolist()
    assert law.profile[1] == (LEAF.thickness, 1.2 * LEAF.thickness, LEAF.thickness)


def test_the_law_of_a_record_is_that_of_its_specification():
    for name, kind in LEAF_KINDS.items():
        spec = table_i(f"mechanism.bistable.structure={name}", "mechanism.bistable.flexure_length=5 mm")
        assert spec.mechanism.bistable.kind is kind
        assert spec.analysis.fidelity == (kind.fidelity or "analytic")
        law = parts(spec).leaf
        shares, thicknesses = law.profile
        assert (shares[0], shares[-1], min(thicknesses)) == (0.0, 1.0, law.strip.thickness)
        assert law.bent_line(0.0)[-1] == pytest.approx([law.strip.reach, law.strip.rise], rel=1e-9)
    for name, kind in SPRING_KINDS.items():
        about = table_i(f"mechanism.positive.structure={name}", "mechanism.positive.radius=4 mm").mechanism
        law = leaf_spring(about.flexures, about.material)
        assert about.flexures.kind is kind
        assert (law.strip.angle > 0) == kind.is_inclined
        place = 1e-5
        stiffer = law.force(3.0 * place) / law.force(place) / 3.0
        assert stiffer == pytest.approx(1.0, abs=1e-9) if kind.is_linear else stiffer > 1.0 + 1e-6


def test_a_step_of_the_thickness_is_drawn_with_the_smaller_one():
    drawn = leaf_thickness(HybridLeaf(LEAF, 0.2 * LEAF.length), 11) / LEAF.thickness
    assert drawn.tolist() == [1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 4.0, 4.0, 1.0, 1.0, 1.0]


# --- shapes, outlines, pictures --------------------------------------------------------------------------------


@pytest.mark.parametrize(("stem", "error"), [("ding2022", 0.035), ("cosine", 0.05), ("hybrid", 0.16)])
@pytest.mark.parametrize("travel", [-1.0, 0.5, 2.0, 4.0])
def test_drawn_leaves_have_the_shape_of_exact_ones(stem, error, travel):
    from cfmkit.elastica import Control, Displacement, trace
    from cfmkit.families.vcfm.exact_model import DOWN_ANGLE, leaf_network

    spec = cfmkit.load(CONFIGS / f"vcfm_{stem}.yaml")
    drawn = parts(spec).leaf.bent_line(travel * MM)
    drive = Displacement("shuttle", DOWN_ANGLE, travel * MM * np.linspace(0, 1, 7)[1:])
    apart = []
    for sign in (1, -1):
        exact = trace(leaf_network(spec), drive, Control(sign=sign)).shape("leaf", -1)
        apart.append(np.abs(np.interp(drawn[:, 0], *exact.T) - drawn[:, 1]).max())
    assert min(apart) < error * MM


def test_an_arch_without_travel_is_drawn_along_its_unloaded_centre_line():
    """But for the square of its slope, some thousandth."""
    arch = CosineLeaf(LEAF)
    x, y, _ = arch.centre_line
    across, along = arch.bent_line(0.0).T
    unloaded = np.interp(across, LEAF.reach - x[::-1], LEAF.rise + y[::-1])
    assert np.abs(along - unloaded).max() < 1e-3 * LEAF.rise
    assert np.hypot(np.diff(x), np.diff(y)).sum() == pytest.approx(arch.developed, rel=1e-5)


@pytest.mark.parametrize("travel", [2.0, 3.0, 4.0])
def test_a_drawn_buckled_leaf_is_shorter_by_the_strain_of_its_axial_force(travel):
    arch, beam = CosineLeaf(LEAF), VBeam(LEAF)
    for law, length, force, rtol in (
        (arch, arch.developed, arch.critical_force, 0.05),
        (beam, LEAF.length, critical_force(LEAF), 0.005),
    ):
        assert law.is_buckled(travel * MM)
        drawn = np.hypot(*np.diff(law.bent_line(travel * MM), axis=0).T).sum()
        assert 1.0 - drawn / length == pytest.approx(force / LEAF.axial, rel=rtol)


def test_a_drawn_u_shape_has_the_shape_of_the_exact_one():
    from cfmkit.elastica import Displacement, Section, trace

    spring = UShape(LeafStrip(35 * MM, 0.0, 1 * MM, 6 * MM, 1477e6, 0.3), 6 * MM)
    chain = spring.chain(Section(1477e6, 6 * MM, 1 * MM, axial=False))
    (drawn,), height = spring.bent_lines(2 * MM, 0.0)
    path = trace(chain.network, Displacement(chain.node, -0.5 * np.pi, np.array([2 * MM])))
    corners, places = np.arange(len(drawn)), np.linspace(0, len(drawn) - 1, 40 * len(drawn))
    line = np.stack([np.interp(places, corners, drawn[:, axis]) for axis in (0, 1)], axis=1)
    exact = np.concatenate([path.shape(beam, -1) for beam in chain.network.beams])
    assert height == pytest.approx(10 * MM)
    assert max(np.hypot(*(line - place).T).min() for place in exact) < 0.02 * MM


@pytest.mark.parametrize("kind", [Diamond, Folded])
def test_the_corner_of_a_spring_stays_half_way_between_its_blocks(kind):
    spring = kind(replace(LEAF, angle=0.0) if kind is Folded else LEAF)
    _, (driven, base, corner) = spring.blocks(8 * MM, 3 * MM, 0.5 * MM, 0.0, 1.5 * MM)
    low, high = base.core[..., 1].max(), driven.core[..., 1].min()
    assert corner.core[..., 1].mean() == pytest.approx(0.5 * (low + high), abs=1e-12)


@pytest.mark.parametrize("loaded", ["whole", "half"])
@pytest.mark.parametrize("structure", ["diamond", "folded", "straight", "u-shape"])
@pytest.mark.parametrize("kind", ["v-beam", "cosine", "hybrid"])
def test_both_structures_can_be_written_for_cutting(kind, structure, loaded):
    """The writer refuses outlines that are open, cross themselves or lie in each other."""
    spec = table_i(
        f"mechanism.bistable.structure={kind}", "mechanism.bistable.flexure_length=5 mm",
        f"mechanism.positive.structure={structure}", "mechanism.positive.radius=4 mm",
        f"mechanism.positive.loaded={loaded}",
    )  # fmt: skip
    drawing = api.drawing(spec)
    assert {"vcfm.dxf", "vcfm.svg", "leaf.csv"} <= set(files(drawing))
    cut = [contour for contour in drawing.contours if contour.layer == "cut"]
    inside = loaded == "whole" and structure != "straight"
    assert len([contour for contour in cut if contour.hole]) == 2 + inside
    assert len(cut) == 4 + inside
    assert not [note for note in drawing.notes if "fillet" in note]


@pytest.mark.parametrize("compression", [0.0, 1.0])
def test_leaves_of_a_spring_are_drawn_from_the_edge_of_its_block(compression):
    spec = table_i()
    strips = [body.core[0] for body in _leaf_spring(spec, 0.0, compression * MM) if body.name == "spring"]
    ends = [abs(0.5 * (strip[1] + strip[-2])[0]) for strip in strips]  # before them a piece lies within the block
    assert ends == pytest.approx([0.5 * spec.mechanism.frame.block] * 4, rel=1e-9)


@pytest.mark.parametrize("stem", ["ding2022", "cosine", "straight", "hybrid", "u_shape"])
def test_every_picture_can_be_drawn(stem):
    result = api.analyze(cfmkit.load(CONFIGS / f"vcfm_{stem}.yaml", ["analysis.points=61"]))
    pictures = api.figures(result)
    assert {"force", "split", "stress", "mechanism"} <= set(pictures)
    for draw in pictures.values():
        figure = draw()
        assert figure.axes
    assert ("adjustability" in pictures) is (len(result.curves) > 1)


def test_the_map_of_preloads_shows_where_the_window_starts():
    """From the as-made pose it stays where the leaves buckle; from rest it begins later the more the preload."""
    found = analyzed(preloads="[4 mm, 7.5 mm]")
    drawn = api.figures(found)["adjustability"]()
    lines = [line.get_ydata() for line in drawn.axes[-1].lines if len(line.get_ydata()) > 10]
    assert len(drawn.axes) == 3
    assert lines[0] == pytest.approx(0.91, abs=0.02)
    assert lines[1][-1] - lines[1][0] == pytest.approx(0.955 - 0.571, abs=0.03)


def test_what_the_table_of_preloads_says_of_a_window_does_not_depend_on_the_points():
    """The curve turns a corner where the leaves buckle, inside this window: between points it is no straight line."""
    spec = cfmkit.load("configs/vcfm_pla_adjustable.yaml").replace({"analysis.window": ["1 mm", "4.4 mm"]})
    few, many = (cfmkit.analyze(spec.replace({"analysis.points": points})).state for points in (23, 801))
    wanted = force_statistics(many.window_forces[0, 0])
    assert force_statistics(few.window_forces[0, 0]) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("points", [23, 801])
def test_the_ends_of_a_window_have_the_force_of_the_model(points):
    spec = cfmkit.load("configs/vcfm_ding2022.yaml").replace({"analysis.points": points})
    solution = cfmkit.analyze(spec).state
    low, high = 0.61e-3, 3.33e-3
    inside = CycleRows.from_curves(solution.branches, (np.array([low]), np.array([high]))).first.inside.values[0]
    wanted = solution.sampler.leaf_force(np.array([low, high])) + solution.sampler.spring(np.array([low, high]))[0]
    assert inside[[0, -1]] == pytest.approx(wanted, rel=1e-14)
    assert np.isnan(solution.nominal.evaluate_within_ends(np.array([[-1e-3, 1.0]]))).all()


def test_a_bend_that_is_tighter_than_its_leaf_is_thick_is_not_drawn():
    spec = cfmkit.load(CONFIGS / "vcfm_u_shape.yaml").replace({"mechanism.positive.radius": 1e-6})
    with pytest.raises(GeometryError, match="use a radius above 0"):
        cfmkit.export(spec)


@pytest.mark.parametrize("config", ["vcfm_cosine", "vcfm_u_shape"])
def test_a_travel_of_nanometres_behind_a_preload_needs_no_billion_points(config):
    spec = cfmkit.load(
        CONFIGS / f"{config}.yaml", ["analysis.travel=7.5e-9 mm", "analysis.window=null", "requirements=[]"]
    )
    found = cfmkit.analyze(spec)
    assert all(len(curve) <= 30 * spec.analysis.points for curve in found.curves)


def test_rows_take_windows_that_are_shares_of_the_travel():
    spec = table_i().replace(
        {
            "analysis.fidelity": "analytic",
            "analysis.travel": "8 mm",
            "analysis.window": ("30 %", "80 %"),
            "requirements": [],
        }
    )
    study, plan = study_of(spec, {"mechanism.bistable.width": (6e-3, 7e-3)}, ("force_mean",))
    assert points_at_once(study, plan) > 1
    assert_rows_equal_runs(study, plan)


def test_the_room_of_a_mechanism_begins_where_a_preload_pushes_it_to_and_has_walls_as_thick_as_stated():
    room = family("vcfm").envelope
    plain, pushed = (room(analyzed("analysis.points=21", preloads=one)) for one in ("[0 mm]", "[0 mm, 7.5 mm]"))
    (rest,) = rests_by_laws(parts(table_i()), [7.5 * MM], np.array([0.0]))
    assert rest == pytest.approx(-0.955 * MM, rel=1e-3)
    assert pushed.along - plain.along == pytest.approx(-rest, rel=1e-9)
    assert pushed.across == plain.across
    framed = room(analyzed("analysis.points=21", "mechanism.part.frame={wall: 10 mm, ground: 6 mm, stop: 6 mm}"))
    assert framed.across - plain.across == pytest.approx(8 * MM, rel=1e-9)  # the blocks are 6 mm
    assert framed.along - plain.along == pytest.approx(6 * MM, rel=1e-9)  # the bar on the shuttle
    # a spring that does not fit its seat cannot be cut: the box is that of the poses
    longer = "analysis.points=21", "mechanism.positive.length=45 mm"
    refused = analyzed(*longer, "mechanism.part.frame={wall: 10 mm, seat: 1 mm}")
    with pytest.raises(GeometryError, match="does not fit between the walls"):
        api.drawing(refused.spec)
    assert room(refused) == room(analyzed(*longer))


@pytest.mark.parametrize(
    ("name", "preload", "target"),
    [
        ("vcfm_pla", "1.9126 mm", 16.15),
        ("vcfm_bought_springs", "1.92 mm", 15.925),
        ("vcfm_bought_springs", "-1 mm", 8.663),
    ],
)
def test_a_curve_with_a_preload_is_compared_with_the_force_that_the_design_has_there(name, preload, target):
    changes = [f"analysis.preloads=[{preload}, 0 mm]", "analysis.fidelity=analytic", "requirements=[]"]
    found = cfmkit.analyze(cfmkit.load(CONFIGS / f"{name}.yaml", changes))
    assert found.target == pytest.approx(target, abs=0.01)
    assert evaluate(found, ["deviation_from_target"])["deviation_from_target"].value < 0.02


def test_a_target_with_a_preload_is_known_where_the_rise_is_and_the_force_above_zero():
    alone = table_i(preloads="[1 mm]").replace({"design": {"force": "12 N", "stroke": "3 mm", "rise": "4 mm"}})
    assert cfmkit.analyze(alone).target == pytest.approx(15.0)
    assert cfmkit.analyze(alone.replace({"analysis.preloads": ["-4 mm"]})).target is None
    open_rise = alone.replace(
        {"design": {"force": "12 N", "stroke": "3 mm", "adjustment": "3 N", "catalogue": "generic"}}
    )
    assert cfmkit.analyze(open_rise).target is None
    assert cfmkit.analyze(open_rise.replace({"analysis.preloads": ["0 mm"]})).target == 12.0
