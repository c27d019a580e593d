"""Requested points at bifurcations, on both ends of a branch; the solver with nothing eliminated."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cfmkit.elastica as el
from cfmkit.errors import InputError

LENGTH, ANGLE = 35e-3, np.radians(8)
RISE = LENGTH * np.sin(ANGLE)
REGULAR = np.linspace(0.05, 2.1, 15) * RISE


LEAF = el.Section(1477e6, 6e-3, 7e-4)


def pressed(points: Any, tolerance: float, branch: Any = "stable", section: el.Section = LEAF) -> el.Path:
    """Return the path of half a V-beam as slender as it needs to be to buckle on its way."""
    return turned(np.sort(points), tolerance, branch, section)


def turned(points: Any, tolerance: float, branch: Any = "stable", section: el.Section = LEAF) -> el.Path:
    """Return the path of the same half, pressed and released."""
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "d": el.Node(LENGTH * np.cos(ANGLE), RISE, el.slider_support(np.pi / 2)),
    }
    leaf = el.Network(nodes, {"v": el.Beam("wall", "d", section)})
    return el.trace(leaf, el.Displacement("d", -np.pi / 2, points), el.Control(tolerance=tolerance, branch=branch))


@pytest.fixture(scope="module")
def exact() -> el.Path:
    path = pressed(REGULAR, 1e-10)
    assert [event.kind for event in path.events] == ["bifurcation", "bifurcation"]
    return path


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-10, 1e-9, -1e-8, 1e-7, -1e-6, 3e-6, -1e-5, 1e-4, -1e-3])
def test_a_point_at_the_begin_or_the_end_of_a_branch(exact: el.Path, which: int, tolerance: float, off: float) -> None:
    """It is there, the path goes on as without it, and both bifurcations are found where they are."""
    place = exact.events[which].drive
    path = pressed(np.append(REGULAR, place + off * RISE), tolerance)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    assert path.requested[path.at_requested].tolist() == list(range(16))
    assert path.drive[path.at_requested] == pytest.approx(np.sort(np.append(REGULAR, place + off * RISE)), rel=1e-12)
    assert [(e.kind, e.before, e.after) for e in path.events] == [("bifurcation", 0, 1), ("bifurcation", 1, 0)]
    assert [e.drive for e in path.events] == pytest.approx([e.drive for e in exact.events], abs=tolerance * RISE)
    usual = np.isin(path.drive[path.at_requested].round(12), REGULAR.round(12))
    found, expected = path.effort[path.at_requested], exact.effort[exact.at_requested]
    np.testing.assert_allclose(found[usual], expected, rtol=0, atol=10 * tolerance * np.abs(expected).max())
    aside = place + (1e-3 if which else -1e-3) * RISE  # on the path without a branch
    near = pressed([aside, RISE] if which == 0 else [*REGULAR[:9], aside], 1e-8)
    here = float(near.effort[np.abs(near.drive - aside).argmin()])
    assert found[~usual] == pytest.approx([here], abs=0.03 * np.abs(expected).max())


@pytest.mark.parametrize("off", [0.0, -1e-9, 1e-9, 1e-6])
def test_a_point_at_a_bifurcation_of_a_path_that_goes_straight_on(exact: el.Path, off: float) -> None:
    path = pressed(np.append(REGULAR, exact.events[0].drive + off * RISE), 1e-6, "primary")
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.requested[path.at_requested].tolist() == list(range(16))
    assert [(e.kind, e.before, e.after) for e in path.events] == [("bifurcation", 0, 1), ("bifurcation", 1, 0)]


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7, 1e-9])
def test_the_last_point_may_lie_at_an_end_of_a_branch(exact: el.Path, which: int, tolerance: float) -> None:
    """The path ends with it, although its end is found only from a little further on."""
    places = [event.drive for event in exact.events]
    path = pressed([0.5 * places[0], *([RISE] * which), places[which]], tolerance)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.error <= tolerance
    assert path.stable.all()
    assert path.drive[-1] == places[which]
    assert [e.drive for e in path.events] == pytest.approx(places[: which + 1], abs=tolerance * RISE)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-9])
@pytest.mark.parametrize(
    ("points", "changes"),
    [
        ((1, 0.06, 1), "+-+"),
        ((1, "begin", 1), "+"),
        ((1, "end", 1), "+"),
        ((1, "just before", 0.5), "+-+"),
        ((1, 2.1, 1, 0.03), "+-+-"),
        ((1, 2.1, 1, 2.1), "+-+-"),
    ],
)
def test_a_drive_that_turns_back_leaves_a_branch_by_either_end(
    exact: el.Path, points: Any, changes: str, tolerance: float
) -> None:
    """Where it turns at an end it stays on the branch. What is met is the same both ways."""
    begin, end = (event.drive / RISE for event in exact.events)
    named = {"begin": begin, "end": end, "just before": begin - 1e-6}
    places = [named.get(point, point) for point in points]
    path = turned(np.array(places) * RISE, tolerance)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.requested[path.at_requested].tolist() == list(range(len(places)))
    assert path.stable.all()
    assert "".join("+" if event.after else "-" for event in path.events) == changes
    nearest = [min(abs(event.drive - place * RISE) for place in (begin, end)) for event in path.events]
    assert max(nearest) < tolerance * 2.1 * RISE
    for p, name in zip(places, path.branch[path.at_requested], strict=True):
        assert p in (begin, end) or (name == "primary") == (not begin < p < end)
    alike = [path.effort[path.at_requested[k]] for k, p in enumerate(places) if p == 1]
    zero = 1e-11 * np.abs(path.effort).max()  # there the force vanishes
    assert alike == pytest.approx([alike[0]] * len(alike), rel=100 * tolerance, abs=zero)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-9])
@pytest.mark.parametrize("offs", [(-1e-7, 0.0), (0.0, 1e-7), (-1e-7, 1e-7), (-1e-6, -1e-7, 0.0, 1e-7, 1e-6)])
@pytest.mark.parametrize("behind", [(), (2.1,)])
def test_points_next_to_each_other_at_the_end_of_a_branch(
    exact: el.Path, offs: Any, behind: Any, tolerance: float
) -> None:
    end = exact.events[1].drive / RISE
    path = pressed(np.array([1.0, *(end + off for off in offs), *behind]) * RISE, tolerance)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.requested[path.at_requested].tolist() == list(range(1 + len(offs) + len(behind)))
    assert path.stable.all()
    assert [(event.kind, event.after) for event in path.events] == [("bifurcation", 1), ("bifurcation", 0)]


def test_a_given_first_step_does_not_keep_a_bifurcation_from_being_found() -> None:
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "d": el.Node(LENGTH * np.cos(ANGLE), RISE, el.slider_support(np.pi / 2)),
    }
    leaf = el.Network(nodes, {"v": el.Beam("wall", "d", LEAF)})
    for step in (0.3, 0.1, 0.01):
        path = el.trace(leaf, el.Displacement("d", -np.pi / 2, REGULAR), el.Control(tolerance=1e-6, first_step=step))
        assert path.status is el.PathStatus.COMPLETE
        assert path.stable.all()
        assert len(path.events) == 2


def test_a_drive_that_stands_still_is_refused() -> None:
    with pytest.raises(InputError, match="must differ from one to the next"):
        el.Displacement("d", 0.0, np.array([1e-3, 1e-3, 2e-3]))


def test_as_many_points_as_asked_for_are_always_allowed() -> None:
    path = pressed(np.linspace(0.05, 2.1, 2500) * RISE, 1e-5)
    assert path.status is el.PathStatus.COMPLETE, path.message


@pytest.mark.parametrize("count", [9, 61])
def test_bifurcations_between_two_points_of_the_primary_path_are_told_one_by_one(count: int) -> None:
    """Of a V of two leaves three modes become unstable and stable again; with 9 points two of them in one step."""
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(40e-3, 3e-3),
        "c": el.Node(80e-3, 0, el.CLAMPED_SUPPORT),
    }
    leaf = el.Section(2e9, 6e-3, 0.5e-3)
    net = el.Network(nodes, {"x": el.Beam("a", "b", leaf), "y": el.Beam("b", "c", leaf)})
    path = el.trace(
        net, el.Displacement("b", -np.pi / 2, np.linspace(0, 9.3e-3, count)[1:]), el.Control(branch="primary")
    )
    assert [event.after - event.before for event in path.events] == [1, 1, 1, -1, -1, -1]
    expected = [0.144709, 0.296103, 0.540543, 1.769872, 3.704185, 4.519626]  # mm: with 61 points
    np.testing.assert_allclose([1e3 * event.drive for event in path.events], expected, rtol=2e-6)


@pytest.mark.parametrize(
    ("rise", "thickness", "travel", "points"),
    [
        (4.6943915, 0.50606212, 9.6913175, 16),
        (4.881, 0.4587, 12.586, 7),
        (4.190, 0.33341, 10.933, 18),
        (4.1598965, 0.3633672, 11.4588855, 19),
    ],
)
def test_coarse_points_do_not_lead_from_the_primary_path_onto_a_branch(
    rise: float, thickness: float, travel: float, points: int
) -> None:
    """A step over two bifurcations of these V, or the first behind the third, had come to another branch."""
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(40e-3, 1e-3 * rise),
        "c": el.Node(80e-3, 0, el.CLAMPED_SUPPORT),
    }
    leaf = el.Section(2e9, 6e-3, 1e-3 * thickness)
    net = el.Network(nodes, {"x": el.Beam("a", "b", leaf), "y": el.Beam("b", "c", leaf)})
    drive = el.Displacement("b", -np.pi / 2, np.linspace(0, 1e-3 * travel, points)[1:])
    path = el.trace(net, drive, el.Control(branch="primary"))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert np.abs(path.motion("b")[:, 2]).max() < 1e-6
    assert path.unstable.max() == 3
    assert len(path.events) == 6
