"""Two oblique springs: against energies, limits, finite differences and the paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cfmkit_oblique.design import departure, design
from cfmkit_oblique.model import Solution
from hypothesis import given, settings
from hypothesis import strategies as st

import cfmkit
from cfmkit import Run
from cfmkit.results import Status

CONFIG = Path(__file__).parents[1] / "configs" / "oblique_carrella2007.yaml"


def springs(**changes):
    return cfmkit.load(CONFIG).replace({key.replace("__", "."): value for key, value in changes.items()})


def mechanism(span, oblique, free, vertical):
    block = {"half_span": span, "oblique": {"stiffness": oblique, "free_length": free}}
    return springs(mechanism={**block, "vertical": {"stiffness": vertical, "free_length": 1e3}})


def energy(spec, x):
    """Energy of the three springs by their lengths alone [J]."""
    part = spec.mechanism
    height = np.sqrt(part.oblique.free_length**2 - part.half_span**2)
    oblique = np.sqrt(part.half_span**2 + (height - x) ** 2) - part.oblique.free_length
    return 0.5 * part.vertical.stiffness * x**2 + part.oblique.stiffness * oblique**2


sizes = st.floats(0.01, 1.0)
rates = st.floats(10.0, 1e5)


@settings(deadline=None)  # the first example waits for imports
@given(sizes, rates, st.floats(1.01, 10.0), rates)
def test_the_force_is_the_slope_of_the_springs_energy(span, oblique, share, vertical):
    spec = mechanism(span, oblique, share * span, vertical)
    solution = Solution(spec)
    x = np.linspace(0.0, solution.travel, 21)
    # the complex step has no error of differences: the slope to rounding
    slope = energy(spec, x + 1e-30j).imag / 1e-30
    np.testing.assert_allclose(solution.exact(x), slope, rtol=1e-10, atol=1e-10 * np.abs(slope).max())


@given(sizes, rates, st.floats(1.01, 10.0), rates)
def test_the_stated_stiffness_is_the_slope_in_the_flat_position(span, oblique, share, vertical):
    solution = Solution(mechanism(span, oblique, share * span, vertical))
    step = 1e-4 * span
    ends = solution.exact(np.array([solution.height - step, solution.height + step]))
    scale = vertical + 2.0 * oblique * share
    assert solution.stiffness == pytest.approx((ends[1] - ends[0]) / (2.0 * step), abs=1e-7 * scale)


def test_without_oblique_springs_the_vertical_one_is_left():
    solution = Solution(mechanism(0.05, 1e-9, 0.075, 400.0))
    x = np.linspace(0.0, 0.1, 11)
    np.testing.assert_allclose(solution.exact(x), 400.0 * x, atol=1e-9)


def test_the_relaxed_mechanism_has_no_force_and_its_mirror_image_twice_that_of_the_plateau():
    solution = Solution(springs())
    start, middle, end = solution.exact(np.array([0.0, solution.height, 2.0 * solution.height]))
    assert (start, end) == (pytest.approx(0.0, abs=1e-12), pytest.approx(2.0 * middle))


def test_the_error_of_the_cubic_falls_with_the_fifth_power():
    solution = Solution(springs())
    far, near = (
        abs(solution.exact(solution.height + reach) - solution.cubic(solution.height + reach)) for reach in (4e-3, 2e-3)
    )
    assert np.log2(far / near) == pytest.approx(5.0, abs=0.02)


@pytest.mark.parametrize(
    ("share", "ratio"), [(2 / 3, 1.0), (0.5, 0.5), (0.8, 2.0)]
)  # alpha = g / (2 (1 - g)): of the paper's condition
def test_the_ratio_of_stiffnesses_for_zero_stiffness(share, ratio):
    solution = Solution(mechanism(0.05, 100.0, 0.05 / share, 100.0))
    assert solution.zero_ratio == pytest.approx(ratio)
    right = Solution(mechanism(0.05, 100.0 * ratio, 0.05 / share, 100.0))
    assert right.stiffness == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize(("below", "degrees"), [(1e-4, 48), (1.0, 57)])
def test_the_inclinations_with_the_widest_range_of_low_stiffness_are_those_of_the_abstract(below, degrees):
    """Carrella, Brennan, Waters 2007, abstract: least severe between approximately 48 and 57 degrees."""
    ratios = np.linspace(0.3, 0.9, 6001)
    # stiffness over that of the vertical spring = 1 + g/(1-g) (1 - g^2/L^3), L^2 = g^2 + z^2, lengths over L0
    length = (ratios**2 / (1.0 - (below - 1.0) * (1.0 - ratios) / ratios)) ** (1 / 3)
    best = ratios[np.argmax(length**2 - ratios**2)]
    assert round(np.degrees(np.arccos(best))) == degrees


def test_the_soft_range_ends_where_the_slope_is_that_of_the_vertical_spring():
    result = cfmkit.analyze(springs())
    solution, half = result.state, 0.5 * result.values["soft_range"].value
    slope = np.diff(solution.exact(solution.height + half + np.array([-1e-7, 1e-7])))[0] / 2e-7
    assert slope == pytest.approx(400.0, rel=1e-6)


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 0.3), st.floats(1e-3, 0.3))
def test_a_design_keeps_its_force_within_the_tolerance_over_the_range(force, share, tolerance):
    request = {"force": force, "range": share * 0.1, "tolerance": tolerance}
    found = design(springs(design=request, mechanism__vertical__free_length=100.0), Run())
    assert found.status is Status.COMPLETE, found.message
    solution = Solution(found.spec)
    low, high = found.spec.analysis.window
    middle = solution.exact(np.array(solution.height))
    off = np.abs(solution.exact(np.linspace(low, high, 201)) / middle - 1.0)
    assert middle == pytest.approx(force)
    assert off.max() <= tolerance * (1 + 1e-9)
    assert solution.stiffness == pytest.approx(0.0, abs=1e-12 * found.spec.mechanism.vertical.stiffness)
    # the springs could not be shorter: the tolerance is used up, or the springs are hardly compressed
    assert off.max() == pytest.approx(tolerance, rel=1e-9) or found.spec.mechanism.half_span == pytest.approx(
        0.99 * found.spec.mechanism.oblique.free_length
    )


@given(st.floats(0.01, 0.99), st.floats(1e-6, 10.0))
def test_the_departure_is_that_of_the_force(ratio, reach):
    solution = Solution(mechanism(1.0, 0.5 * ratio / (1.0 - ratio), 1.0 / ratio, 1.0))
    middle, end = solution.exact(solution.height + np.array([0.0, reach]))
    assert departure(ratio, reach) == pytest.approx((end - middle) / middle, abs=1e-12, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "name", "nearest"),
    [
        ({"design.height_max": "20 mm"}, "no_room", "design.range"),
        ({"design.height_max": "20 mm"}, "no_room", "design.height_max"),
        ({"design.height_max": "1 mm"}, "no_room", "design.height_max"),
        ({"design.range": "10 m", "mechanism.vertical.free_length": "100 m"}, "no_room", "design.range"),
        ({"mechanism.oblique.solid_length": "55 mm"}, "coils_touch", "mechanism.oblique.solid_length"),
        ({"mechanism.vertical.free_length": "60 mm"}, "coils_touch", "mechanism.vertical.free_length"),
    ],
)
def test_what_cannot_be_designed_names_the_nearest_that_can(changes, name, nearest):
    spec = springs(design={"force": 20.0, "range": 0.02}).replace(changes)
    found = cfmkit.design(spec)
    assert (found.status, found.spec, found.warnings[0].name) == (Status.INFEASIBLE, None, name)
    again = cfmkit.design(spec.replace({nearest: found.nearest_feasible[nearest]}))
    assert again.status is Status.COMPLETE, again.message


@pytest.mark.parametrize(("share", "name"), [(0.9, "stiff"), (1.1, "falling")])
def test_a_slope_that_is_not_zero_is_a_warning_whose_cure_makes_it_zero(share, name):
    result = cfmkit.analyze(springs(mechanism__oblique__stiffness=400.0 * share))
    assert [item.name for item in result.warnings] == [name]
    (cure,) = result.warnings[0].cures
    assert cfmkit.analyze(springs(mechanism__oblique__stiffness=cure.partition("=")[2])).warnings == ()


def test_a_curve_ends_where_coils_touch():
    result = cfmkit.analyze(springs(mechanism__vertical__solid_length="60 mm"))
    assert (result.status, result.warnings[0].name) == (Status.PARTIAL, "coils_touch")
    assert result.curve.motion[-1] == pytest.approx(0.09)
    result = cfmkit.analyze(springs(mechanism__oblique__solid_length="60 mm"))
    assert (result.status, result.warnings[0].name) == (Status.PARTIAL, "coils_touch")
    assert result.curve.extra["oblique_length"].values[-1] == pytest.approx(0.06)


@pytest.mark.parametrize(
    ("path", "value", "reported"),
    [
        ("mechanism.oblique.free_length", "50 mm", "'oblique.free_length' must be above 'half_span'"),
        ("mechanism.vertical.solid_length", "150 mm", "'solid_length' must be below 'free_length'"),
        ("mechanism.half_span", "0 mm", "must be > 0"),
        ("mechanism.oblique.stiffness", "-1 N/mm", "must be > 0"),
        ("analysis.fidelity", "dynamic", "dynamic"),
    ],
)
def test_what_is_wrong_is_told_in_one_sentence(path, value, reported):
    with pytest.raises(cfmkit.SpecError) as caught:
        springs().replace({path: value})
    (problem,) = caught.value.problems
    assert reported in problem.message
