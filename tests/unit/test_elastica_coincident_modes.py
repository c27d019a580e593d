"""Several modes critical at once, or nearly: leaves and columns in parallel, judged by one of them alone."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import cfmkit.elastica as el

LENGTH, SHUTTLE = 35e-3, el.slider_support(np.pi / 2)


def leaves(many: Any, count: int, thickness: float = 7e-4, angle: float = 8.0, support: Any = SHUTTLE) -> Any:
    """Return leaves left and right of one shuttle, that many or with these factors on their thickness; the drive."""
    factors = [1.0] * many if isinstance(many, int) else many
    rise, across = LENGTH * np.sin(np.radians(angle)), LENGTH * np.cos(np.radians(angle))
    nodes, beams = {"d": el.Node(0, rise, support)}, {}
    for i, factor in enumerate(factors):
        down = 5e-3 * (i // 2)
        nodes[f"w{i}"] = el.Node((-1 if i % 2 == 0 else 1) * across, -down, el.CLAMPED_SUPPORT)
        beams[f"b{i}"] = el.Beam(f"w{i}", "d", el.Section(1477e6, 6e-3, thickness * factor), end_offset=(0.0, -down))
    return el.Network(nodes, beams), el.Displacement("d", -np.pi / 2, np.linspace(0.05, 2.1, count) * rise)


@cache
def alone(count: int = 15, factor: float = 1.0, thickness: float = 7e-4, angle: float = 8.0) -> el.Path:
    return el.trace(*leaves([factor], count, thickness, angle), el.Control(tolerance=1e-9))


def moments(path: el.Path, point: int) -> Any:
    """Return the moments at the shuttle."""
    at = path.at_requested[point]
    return np.array([path.end_force(name, 1)[at, 2] for name in path.network.beams])


def changes(path: el.Path) -> list[tuple[str, int, int]]:
    return [(event.kind, event.before, event.after) for event in path.events]


@pytest.mark.parametrize(("many", "tolerance"), [(2, 1e-9), (5, 1e-5), (8, 1e-3)])
def test_equal_leaves_buckle_together_and_straighten_together(many: int, tolerance: float) -> None:
    """They do not act on each other: everything is as for one of them, that many times."""
    one, paths = alone(), [el.trace(*leaves(many, 15), el.Control(tolerance=tolerance, sign=sign)) for sign in (1, -1)]
    for path, sense in zip(paths, (-1, 1), strict=True):
        assert path.status is el.PathStatus.COMPLETE, path.message
        assert path.stable.all()
        assert changes(path) == [("bifurcation", 0, many), ("bifurcation", many, 0)]
        assert [event.drive for event in path.events] == pytest.approx([event.drive for event in one.events], rel=1e-7)
        expected = many * one.effort[one.at_requested]
        allowed = 10 * tolerance * np.abs(expected).max()
        np.testing.assert_allclose(path.effort[path.at_requested], expected, rtol=0, atol=allowed)
        sides = moments(path, 4) * sense
        assert sides == pytest.approx(np.full(many, abs(moments(one, 4)[0])), rel=1e-3)


@pytest.mark.parametrize(
    ("factors", "thickness", "angle", "tolerance"),
    [
        ((1, 1 + 1e-7), 7e-4, 8.0, 1e-5),
        ((1, 1 + 1e-6), 7e-4, 8.0, 1e-3),
        ((1, 1 + 1e-4), 7e-4, 8.0, 1e-7),
        ((1, 1 + 1e-5, 1 + 1e-4), 7e-4, 8.0, 1e-6),
        (tuple(1 + 1e-3 * i for i in range(5)), 7e-4, 8.0, 1e-5),
        ((1, 1), 1e-4, 9.4, 1e-3),
        ((1, 1), 2e-4, 9.4, 1e-5),
        ((1, 1), 5e-4, 9.4, 1e-9),
    ],
)
def test_leaves_that_hardly_differ_bear_what_each_bears_alone(
    factors: tuple[float, ...], thickness: float, angle: float, tolerance: float
) -> None:
    """They buckle together; those that differ by 1e-3 straighten one after the other: several ends of branches."""
    path = el.trace(*leaves(factors, 15, thickness, angle), el.Control(tolerance=tolerance))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    if max(factors) < 1 + 1e-3:
        assert changes(path) == [("bifurcation", 0, len(factors)), ("bifurcation", len(factors), 0)]
    each = [alone(15, factor, thickness, angle) for factor in factors]
    expected = sum(one.effort[one.at_requested] for one in each)
    allowed = 10 * tolerance * np.abs(expected).max()
    np.testing.assert_allclose(path.effort[path.at_requested], expected, rtol=0, atol=allowed)


@pytest.mark.parametrize(("many", "count"), [(2, 11), (2, 20), (4, 51)])
def test_no_rounded_corner_hides_a_bifurcation_of_several_modes(many: int, count: int) -> None:
    """Its branch has its name, the sign decides, and whoever wants to stop there is told."""
    one, places = alone(count, 1.0, 5.66e-4, 4.6), []
    for sign in (1, -1):
        path = el.trace(*leaves(many, count, 5.66e-4, 4.6), el.Control(tolerance=1e-6, sign=sign))
        assert changes(path) == [("bifurcation", 0, many), ("bifurcation", many, 0)]
        assert (sign * moments(path, count // 3) < 0).all()
        places.append([event.drive for event in path.events])
    assert places[0] == pytest.approx([event.drive for event in one.events], rel=1e-6)
    stopped = el.trace(*leaves(many, count, 5.66e-4, 4.6), el.Control(tolerance=1e-6, branch="stop"))
    assert stopped.status is el.PathStatus.JUMPS


def test_steps_do_not_shrink_until_they_follow_a_rounded_corner() -> None:
    """As they did here, where every shorter step came a little nearer to the bifurcation and not past it."""
    network, drive = leaves(5, 29, 0.0006034841487544531, 5.047877770936848)
    points = np.linspace(0.03, 2.1, 29) * float(drive.points[-1]) / 2.1
    path = el.trace(network, el.Displacement("d", -np.pi / 2, points), el.Control(tolerance=6.665797876563091e-08))
    assert changes(path) == [("bifurcation", 0, 5), ("bifurcation", 5, 0)]


@pytest.mark.parametrize(("sign", "tolerance"), [(1, 1e-3), (-1, 1e-6)])
def test_leaves_on_a_shuttle_that_may_turn_fare_alike_with_any_points(sign: Any, tolerance: float) -> None:
    """One mode turns the shuttle, three do not: the branch that they lead to has a limit point, which ends the path."""
    paths = [
        el.trace(
            *leaves(4, count, support=el.slider_support(np.pi / 2, True)), el.Control(tolerance=tolerance, sign=sign)
        )
        for count in (5, 43)
    ]
    for path, middle in zip(paths, (2, 21), strict=True):
        assert path.status is el.PathStatus.LIMIT_POINT, path.message
        assert path.stable.all()
        assert changes(path) == [("bifurcation", 0, 4)]
        assert path.drive[-1] == pytest.approx(6.294452e-3, rel=max(1e-6, tolerance**2))
        same = [path.effort[path.requested == number][0] for number in (0, middle)]
        assert same == pytest.approx(paths[0].effort[paths[0].at_requested][[0, 2]], abs=20 * tolerance)


@pytest.mark.parametrize(("many", "factor"), [(2, 1.0), (5, 1 + 1e-6), (3, 1 + 1e-3)])
def test_columns_under_one_platform_bear_its_load_together(many: int, factor: float) -> None:
    """Under a load as under a displacement; were one to buckle alone the others would bear more than they can."""

    def columns(count: int) -> el.Path:
        nodes, beams = {"d": el.Node(0, 0.1, SHUTTLE)}, {}
        for i in range(count):
            x = 0.02 * (i - 0.5 * (count - 1))
            nodes[f"w{i}"] = el.Node(x, 0, el.CLAMPED_SUPPORT)
            section = el.Section(2e9, 1e-2, 1e-3 * (factor if i else 1.0))
            beams[f"b{i}"] = el.Beam(f"w{i}", "d", section, end_offset=(x, 0.0))
        drive = el.Loading((el.PointLoad("d", fy=-count * critical),), np.linspace(0.1, 1.3, 13))
        return el.trace(el.Network(nodes, beams), drive, el.Control(tolerance=1e-5))

    critical = 4 * np.pi**2 * 2e9 * (1e-2 * 1e-9 / 12) / 0.1**2
    one, path = columns(1), columns(many)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    apart = changes(path)  # a column that differs buckles before the others, or behind them
    assert [before for _, before, _ in apart] == [0] * len(apart)
    assert sum(after for _, _, after in apart) == many
    assert path.events[0].drive == pytest.approx(one.events[0].drive, rel=1e-6 + 3 * (factor - 1))
    assert (moments(path, -1) < 0).all()
    expected = many * one.effort[one.at_requested]
    np.testing.assert_allclose(path.effort[path.at_requested][-2:], expected[-2:], rtol=1e-4 + 30 * (factor - 1))


def test_a_mode_that_is_one_of_several_bends_all_leaves() -> None:
    path = el.trace(*leaves(3, 15), el.Control(tolerance=1e-5, imperfection=1e-5))
    assert path.status is el.PathStatus.COMPLETE
    assert path.events == ()
    found = moments(path, 4)
    assert found == pytest.approx(np.full(3, found.mean()), rel=0.05)
    assert found.mean() == pytest.approx(moments(alone(), 4)[0], rel=0.05)
