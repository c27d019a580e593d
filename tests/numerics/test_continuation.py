"""Paths of structures in closed form: limit points, bifurcations, branches that begin and end, several modes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from small_structures import Structure, bulge, columns, truss

from cfmkit.numerics.continuation.corners import mark_corners
from cfmkit.numerics.continuation.follow import follow
from cfmkit.numerics.continuation.path import Options, PathEvent, PathStop, Point, WhyStopped
from cfmkit.numerics.continuation.problem import Border, PathEquilibrium
from cfmkit.numerics.continuation.steps import correct


def run(structure: Structure, targets: Any, **options: Any) -> tuple[list[Point], list[PathEvent], PathStop]:
    """Return the points at requested values, the events and the ending of a path from rest."""
    targets = np.asarray(targets, float)
    span = float(np.ptp(np.append(targets, 0.0)))
    items = list(follow(structure, structure.rest(), targets, Options(span, **options)))
    points = [item for item in items if isinstance(item, Point) and item.target >= 0]
    assert isinstance(items[-1], PathStop)
    return points, [item for item in items if isinstance(item, PathEvent)], items[-1]


def lean(load: float) -> float:
    """Return the lean of a column of unit stiffness beyond its critical load."""
    return float(brentq(lambda x: x - load * np.sin(x), 1e-9, np.pi))


HEIGHT = 0.2
CREST = brentq(lambda x: truss(HEIGHT).hessian(np.array([x]), 0.0)[0, 0], 0.01, 0.15)
LIMIT = float(truss(HEIGHT).gradient(np.array([CREST]), 0.0)[0])


def test_a_truss_stops_at_its_limit_point() -> None:
    points, events, ending = run(truss(HEIGHT), np.linspace(0.25, 2, 8) * LIMIT)
    assert events == []
    assert (ending.end, ending.drive) == (WhyStopped.LIMIT_POINT, pytest.approx(LIMIT, rel=1e-9))
    assert [point.target for point in points][:3] == [0, 1, 2]


def test_a_truss_snaps_through_by_its_arc_length() -> None:
    points, events, ending = run(truss(HEIGHT), np.array([0.5, 2.5]) * LIMIT, through_folds=True)
    assert [event.drive for event in events] == pytest.approx([LIMIT, -LIMIT], rel=1e-9)
    assert ending.end is WhyStopped.COMPLETE
    assert [point.target for point in points] == [0, 0, 0, 1]
    assert points[-1].at.x[0] > 2 * HEIGHT
    for point in points:
        assert truss(HEIGHT).gradient(point.at.x, point.at.drive) == pytest.approx(0.0, abs=1e-12)


def test_a_truss_that_leaves_the_range_of_the_drive_ends_there() -> None:
    points, _, ending = run(truss(HEIGHT), np.array([0.5, 1.2]) * LIMIT, through_folds=True)
    assert ending.end is WhyStopped.OUTSIDE
    assert {point.target for point in points} == {0}


@pytest.mark.parametrize("sign", [1, -1])
def test_a_column_leans_beyond_its_critical_load(sign: int) -> None:
    loads = [0.5, 1.0 + 1e-6, 1.001, 1.3, 2.0]
    points, events, ending = run(columns(1.0), loads, sign=sign)
    assert [(event.kind, event.before, event.after) for event in events] == [("bifurcation", 0, 1)]
    assert events[0].drive == pytest.approx(1.0, abs=1e-9)
    assert ending.end is WhyStopped.COMPLETE
    leans = [float(point.at.x[0]) for point in points]
    assert leans == pytest.approx([0.0, *(-sign * lean(load) for load in loads[1:])], rel=1e-7)
    assert [point.at.unstable for point in points] == [0] * 5


def test_a_column_may_stay_straight() -> None:
    points, events, ending = run(columns(1.0), [0.5, 1.5, 2.0], branch="primary")
    assert [point.at.unstable for point in points] == [0, 1, 1]
    assert events[0].drive == pytest.approx(1.0, abs=1e-9)
    assert ending.end is WhyStopped.COMPLETE


def test_a_path_may_stop_where_stability_is_lost() -> None:
    points, events, ending = run(columns(1.0), [0.5, 1.5], branch="stop")
    assert (len(points), len(events), ending.end) == (1, 0, WhyStopped.JUMPS)
    assert ending.drive == pytest.approx(1.0, abs=1e-9)


def test_a_bent_column_has_no_bifurcation() -> None:
    points, events, ending = run(columns(1.0, bend=1e-4), [0.0, 2.0][1:])
    assert events == []
    assert ending.end is WhyStopped.COMPLETE
    assert points[-1].at.x[0] == pytest.approx(lean(2.0), rel=1e-3)


@pytest.mark.parametrize("stiffness", [(1.0, 1.0), (1.0, 1.0 + 1e-7), (1.0, 1.0, 1.0, 1.0 + 1e-6), (1.0, 1.001)])
def test_columns_that_buckle_together_all_lean(stiffness: tuple[float, ...]) -> None:
    points, events, ending = run(columns(*stiffness), [0.5, 1.5, 2.0])
    assert ending.end is WhyStopped.COMPLETE
    assert sum(event.after - event.before for event in events) == len(stiffness)
    assert [point.at.unstable for point in points] == [0, 0, 0]
    assert np.abs(points[-1].at.x) == pytest.approx(lean(2.0), rel=3e-3)


def test_columns_that_differ_buckle_one_after_the_other() -> None:
    points, events, _ = run(columns(1.0, 1.2), [0.5, 1.1, 1.5])
    assert [event.drive for event in events] == pytest.approx([1.0, 1.2], abs=1e-9)
    assert points[1].at.x[1] == 0.0
    assert abs(points[1].at.x[0]) == pytest.approx(lean(1.1), rel=1e-9)


@pytest.mark.parametrize("first_step", [0.02, 0.05, 0.4])
def test_a_branch_is_left_where_it_ends(first_step: float) -> None:
    loads = np.append(np.linspace(0.1, 2.5, 23), 3.0)
    points, events, ending = run(bulge(1.0, 2.0), loads, first_step=first_step)
    assert ending.end is WhyStopped.COMPLETE
    assert [(event.before, event.after) for event in events] == [(0, 1), (1, 0)]
    assert [event.drive for event in events] == pytest.approx([1.0, 2.0], abs=1e-8)
    amount = np.clip((loads - 1) * (2 - loads), 0, None) ** 0.5
    assert [abs(float(point.at.x[0])) for point in points] == pytest.approx(amount, abs=1e-7)


def test_a_drive_that_turns_back_leaves_the_branch_where_it_began() -> None:
    loads = [0.5, 1.2, 1.5, 1.2, 0.5]
    points, events, ending = run(columns(1.0), loads)
    assert ending.end is WhyStopped.COMPLETE
    assert [event.drive for event in events] == pytest.approx([1.0, 1.0], abs=1e-8)
    assert np.abs([point.at.x[0] for point in points]) == pytest.approx(
        [0.0, lean(1.2), lean(1.5), lean(1.2), 0.0], abs=1e-8
    )


def test_a_path_has_no_more_points_between_than_allowed() -> None:
    points, _, ending = run(columns(1.0), [0.5, 2.0], most_points=3)
    assert ending.end is WhyStopped.FULL
    assert len(points) <= 2


def test_an_equilibrium_under_a_condition_solves_the_condition() -> None:
    found = correct(columns(1.0), np.array([0.4]), 1.0, Border(np.array([1.0, 0.0]), 0.5))
    assert found is not None
    assert found.x[0] == pytest.approx(0.5, rel=1e-12)
    assert found.drive == pytest.approx(0.5 / np.sin(0.5), rel=1e-12)


def test_nothing_is_found_where_no_equilibrium_is_near() -> None:
    assert correct(truss(HEIGHT), np.array([0.05]), 3 * LIMIT) is None or LIMIT < 0
    stuck = replace(columns(1.0), hessian=lambda _x, _: np.zeros((1, 1)))
    assert correct(stuck, np.array([0.1]), 0.5) is None


def bent(width: float) -> list[Point | PathStop]:
    """Return points of a curve that rises by 1 up to a drive of 1 and falls by 0.5 from there on, over a width."""
    drives = np.unique([0.0, *(1.0 + 0.7 * side * 0.5**k for k in range(16) for side in (-1, 1))])
    root = np.hypot(drives - 1.0, width)
    efforts, slopes = drives - 0.75 * (drives - 1.0 + root), 0.25 - 0.75 * (drives - 1.0) / root
    none = np.zeros(1)
    curve = zip(drives, efforts, slopes, strict=True)
    states = [PathEquilibrium(none, drive, none, 0, effort, slope) for drive, effort, slope in curve]
    return [*(Point(at) for at in states), PathStop(WhyStopped.COMPLETE, float(drives[-1]))]


@pytest.mark.parametrize(("width", "corner", "count"), [(1e-3, 0.02, 1), (1e-3, 2e-5, 0), (2.0, 0.02, 0)])
def test_a_curve_that_bends_within_the_corner_of_the_options_has_a_bifurcation_there(width, corner, count):
    items = list(mark_corners(bent(width), Options(1.7, corner=corner)))
    events = [item for item in items if isinstance(item, PathEvent)]
    assert len(events) == count
    assert [item for item in items if not isinstance(item, PathEvent)] == bent(width)
    for event in events:
        assert event.drive == pytest.approx(1.0, abs=0.1 * width)
        assert event.within[0].drive < 1.0 < event.within[1].drive
