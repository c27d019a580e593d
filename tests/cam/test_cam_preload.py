"""Cams whose springs are tight at the start: constant from the first point on, and no undercut."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cam_support import analyze, cam, design_exactly

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families.cam.geometry.slope_law import SlopeLaw

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def tight():
    """Return the designed cam of the published springs, tight at the start."""
    return design_exactly(cfmkit.load(CONFIGS / "cam_preloaded.yaml"))


def ends(spec, **changes):
    """Return force at the start and end on the way up, and on the way down [N]."""
    curve = cfmkit.analyze(spec.replace(changes) if changes else spec).curve
    up, down = (curve.effort[curve.branch == name] for name in ("load", "unload"))
    return [up[[0, -1]], down[[-1, 0]]]


def test_the_published_springs_6_4_mm_shorter_need_no_undercut(tight):
    assert tight.mechanism.springs.preload == pytest.approx(2 * 3.218e-3, abs=1e-6)
    found = cfmkit.analyze(tight)
    assert not [warning.name for warning in found.warnings]
    assert found.values["roller_radius_max"].value == pytest.approx(16e-3, rel=1e-9)
    assert found.values["spring_elongation_max"].value == pytest.approx(132.03e-3, abs=5e-6)
    up, down = ends(tight)
    assert (up[0], down[0]) == (pytest.approx(50.43, abs=5e-3), pytest.approx(49.58, abs=5e-3))


@pytest.mark.parametrize(
    ("mounted", "start", "radius"),
    [({}, 954.91e-3, 565.20e-3), ({"mounting": "down", "profile__slope_factor": 0.8}, 659.41e-3, 249.42e-3)],
)
def test_the_largest_roller_is_that_of_the_tightest_place_wherever_that_is(mounted, start, radius):
    """Springs that are stretched much make the start steep, and nearly straight."""
    springs = {"stiffness": "0.69 N/mm", "count": 2, "preload": "200 mm"}
    found = analyze(cam(rest_half_width="150 mm", springs=springs, profile__force_constant="50 mm", **mounted,
                        profile__stroke="118.9 mm"))  # fmt: skip
    law = found.state.assembly.profile.path.law
    along = law.curvature_radius(np.linspace(0.15, found.state.assembly.profile.end, 4001))
    assert along[0] == pytest.approx(start, rel=1e-4)
    assert found.values["roller_radius_max"].value == along.min() == pytest.approx(radius, rel=1e-4)


def test_without_friction_the_force_is_constant_from_the_first_point_on(tight):
    force = cfmkit.analyze(tight.replace({"mechanism.rolling_friction": 0})).curve.effort
    np.testing.assert_allclose(force, 50.0, rtol=1e-12)


def test_the_springs_store_what_the_constant_force_does(tight):
    curve = cfmkit.analyze(tight.replace({"mechanism.rolling_friction": 0})).curve
    elongation, travel = curve.extra["spring_elongation"].values, curve.motion
    stored = 0.5 * tight.mechanism.springs.total * (elongation**2 - elongation[0] ** 2)
    np.testing.assert_allclose(stored, 50.0 * travel, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("friction", [0.02, -0.02])
def test_a_profile_cut_for_friction_is_exact_on_its_way(friction):
    spec = cfmkit.load(CONFIGS / "cam_preloaded.yaml").replace(
        {"design.friction": friction, "mechanism.rolling_friction": abs(friction)}
    )
    way = 0 if friction > 0 else 1
    found = design_exactly(spec)
    assert found.mechanism.springs.preload > 0
    np.testing.assert_allclose(ends(found)[way], 50.0, rtol=1e-9)


@pytest.mark.parametrize("friction", [-0.05, 0.0, 0.03])
@pytest.mark.parametrize("radius", [11e-3, 16e-3, 40e-3])
def test_with_the_smallest_preload_the_path_starts_with_the_radius_of_the_roller(friction, radius):
    law = SlopeLaw(9.058e-3, 68e-3, 0.2, friction)
    half = law.smallest_preload(radius)
    tight = replace(law, preload=half)
    assert tight.curvature_radius(68e-3) == pytest.approx(radius, rel=1e-9)
    assert replace(law, preload=0.99 * half).curvature_radius(68e-3) < radius


def test_no_preload_is_needed_where_the_roller_fits():
    law = SlopeLaw(20e-3, 68e-3, 0.2)
    assert law.smallest_preload(10e-3) == 0


def test_the_smallest_force_constant_knows_the_preload():
    law = SlopeLaw(9.058e-3, 68e-3, 0.2, preload=2e-3)
    smallest = law.smallest_force_constant(16e-3)
    assert smallest < replace(law, preload=0.0).smallest_force_constant(16e-3)
    assert replace(law, force_constant=smallest).curvature_radius(68e-3) == pytest.approx(16e-3, rel=1e-9)


def test_a_rest_length_says_the_same_as_a_preload(tight):
    preload = tight.mechanism.springs.preload
    same = tight.replace({"mechanism.springs": {"stiffness": 690, "count": 2, "rest_length": 0.136 - preload}})
    for one, other in zip(ends(tight), ends(same), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_springs_that_are_tighter_than_the_cam_is_cut_for_push_harder_at_the_start(tight):
    stretched = tight.replace({"mechanism.springs.preload": 0.010})
    assert stretched.mechanism.springs_rest == pytest.approx(0.063)
    assert ends(stretched)[0][0] == pytest.approx(ends(tight)[0][0] * 10 / 6.43627493, rel=1e-6)


def test_a_sweep_over_the_preload_states_what_single_runs_do(tight):
    values = ["4 mm", "6 mm", "8 mm"]
    study = cfmkit.sweep(tight, vary={"mechanism.springs.preload": values}, metrics=["force_mean"])
    alone = [cfmkit.analyze(tight.replace({"mechanism.springs.preload": value})) for value in values]
    expected = [one.metrics["force_mean"].value for one in alone]
    np.testing.assert_allclose(np.asarray(study.table["force_mean"], float), expected, rtol=1e-12)


def test_the_dynamic_model_has_the_same_springs():
    spec = cfmkit.load(CONFIGS / "cam_dynamics.yaml")
    slow = {"analysis.dynamics.time": 1000.0, "mechanism.springs.preload": 0.005, "mechanism.profile.preload": 0.005}
    moved = cfmkit.analyze(spec.replace({**slow, "analysis.gravity": False})).curve.effort
    constant = spec.mechanism.profile.force_constant
    np.testing.assert_allclose(np.median(moved), 4 * spec.mechanism.springs.total * constant, rtol=2e-3)


@pytest.mark.parametrize(
    ("springs", "words"),
    [
        ({"preload": "6 mm", "rest_length": "130 mm"}, "say the same"),
        ({"rest_length": "140 mm"}, "the springs would be slack"),
        ({"preload": "136 mm"}, "must be below 136 mm"),
        ({"preload": "-1 mm"}, "must be >= 0"),
    ],
)
def test_springs_that_cannot_be_are_refused_in_one_line(springs, words):
    spec = cfmkit.load(CONFIGS / "cam_preloaded.yaml")
    with pytest.raises(SpecError, match=words):
        spec.replace({"mechanism.springs": {"stiffness": "0.69 N/mm", **springs}})


@pytest.mark.parametrize("given", [{"preload": "6.44 mm"}, {"rest_length": "130 mm"}])
def test_where_no_preload_is_needed_none_is_written(given):
    spec = cfmkit.load(CONFIGS / "cam_preloaded.yaml").replace(
        {"mechanism.roller_radius": 0.009, "mechanism.springs": {"stiffness": "0.69 N/mm", "count": 2, **given}}
    )
    found = cfmkit.design(spec)
    assert "no preload is needed" in found.message
    assert found.spec.mechanism.preload == 0
    assert found.spec.mechanism.profile.preload is None
