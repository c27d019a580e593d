"""Decisions on a path: from what a march has led to, to where to go on. None of them marches here."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cfmkit.elastica import CLAMPED, Beam, Control, Displacement, Event, Network, Node, PathStatus, Section, guided
from cfmkit.elastica.continuation import (
    branch_rejoins_path,
    decision_loop,
    decisions_after_march,
    ending_messages,
    passing_limit_points,
    points_at_bifurcation,
)
from cfmkit.elastica.continuation.decisions_after_march import decided
from cfmkit.elastica.continuation.path_and_moves import BranchEnd, Leg, PathProblem, Resume, Stop, Stretch, Trail
from cfmkit.elastica.equilibrium.mesh import Mesh
from cfmkit.elastica.equilibrium.network_solver import Spot
from cfmkit.elastica.kernels.status_codes import DONE, FULL, INERTIA, LONG, OUTSIDE, STALLED
from cfmkit.elastica.model.network_under_drive import Layout

ASKED = (1e-3, 2e-3, 3e-3)  # [m]; the mean beam length is 0.1 m


def problem(asked: tuple[float, ...] = ASKED, **control: Any) -> PathProblem:
    """Return a cantilever whose guided end is moved across it."""
    nodes = {"a": Node(0.0, 0.0, CLAMPED), "b": Node(0.1, 0.0, guided(np.pi / 2))}
    network = Network(nodes, {"x": Beam("a", "b", Section(2e9, 1e-2, 1e-3, axial=True))})
    return PathProblem(Layout(network, Displacement("b", np.pi / 2, np.array(asked))), Mesh(2, 1), Control(**control))


def trail(of: PathProblem, *places: tuple[float, int, int]) -> Trail:
    """Return a path through places: the drive, the number of the requested point or -1, the unstable directions."""
    made = Trail.begun(of)
    for drive, asked, unstable in places:
        made = made.with_spot(spot(of, drive, unstable), asked)
    return made


def spot(of: PathProblem, drive: float, unstable: int = 0) -> Spot:
    y = np.full(of.solver.size, 0.1 * drive)
    return Spot(y, drive, of.solver.unit.copy(), unstable)


def leg(of: PathProblem, code: int, path: Trail, toward: BranchEnd | None = None) -> Leg:
    return Leg(code, path, spot(of, path.drive), toward)


@pytest.mark.parametrize(
    ("code", "status", "words"),
    [
        (OUTSIDE, PathStatus.OUTSIDE, "the drive left its range at 0.002"),
        (FULL, PathStatus.FULL, "stopped after 2 points at 0.002"),
        (LONG, PathStatus.LOST, "a segment is too long for its load at 0.002"),
    ],
)
def test_a_march_that_cannot_go_on_ends_the_path_with_the_reason(code, status, words):
    of = problem()
    path = trail(of, (0.01, 0, 0), (0.02, 1, 0))
    move = decided(of, leg(of, code, path), fresh=False)
    assert isinstance(move, Stop)
    assert (move.trail.ending.status, move.trail.ending.message) == (status, words)
    assert move.trail.ending.too_long == (code == LONG)
    assert path.ending.status is PathStatus.COMPLETE


def test_a_path_that_is_only_judged_ends_where_stability_is_lost():
    of = problem(branch="stop")
    path = trail(of, (0.01, 0, 0), (0.02, 1, 1))
    move = decided(of, leg(of, INERTIA, path), fresh=False)
    assert isinstance(move, Stop)
    assert move.trail.ending.status is PathStatus.JUMPS
    assert move.trail.ending.message == "stability is lost at 0.002: the path ends there"


def test_a_path_with_all_its_points_is_complete():
    of = problem()
    path = trail(of, (0.01, 0, 0), (0.02, 1, 0), (0.03, 2, 0))
    move = decided(of, leg(of, DONE, path), fresh=False)
    assert isinstance(move, Resume)
    assert move.trail is path
    assert path.requested == 3
    assert not len(path.ahead)


def test_the_drive_takes_over_where_it_turns_behind_limit_points():
    """Along the arc only the points up to the turn are done; the others by the drive again, from the last one."""
    of = problem((1e-3, 2e-3, 1e-3))
    path = trail(of, (0.01, 0, 0), (0.02, 1, 0))
    path = replace(path, stretch=Stretch(of.values[:2], natural=False), without_branch=None, visited={(0.1,): 2})
    move = decided(of, leg(of, DONE, path), fresh=False)
    assert isinstance(move, Resume)
    after = move.trail.stretch
    assert (after.natural, after.first_requested, after.begun) == (True, 2, 1)
    assert after.targets.tolist() == of.values.tolist()
    assert not move.trail.visited
    assert passing_limit_points.one_way(of.values.tolist(), 1) == (0, 2)


def test_a_stall_along_the_arc_is_the_end():
    of = problem(through_folds=True)
    path = trail(of, (0.01, 0, 0), (0.02, 1, 0))
    path = replace(path, stretch=path.stretch._replace(natural=False))
    move = decided(of, leg(of, STALLED, path), fresh=False)
    assert isinstance(move, Stop)
    assert (move.trail.ending.status, move.trail.ending.message) == (PathStatus.LOST, "no step converged at 0.002")


def test_a_branch_is_followed_to_just_before_its_end_and_counts_its_points_as_they_were_asked_for():
    of = problem()
    end = BranchEnd(0.025, spot(of, 0.025).y, spot(of, 0.026), 1, 0, "primary")
    path = replace(trail(of, (0.01, 0, 0)), branch="bifurcated", ends=(end,), closed=False)
    values, numbers, toward = decision_loop.ahead(of, path, spot(of, 0.01), 1)
    assert numbers is not None
    assert numbers.tolist() == [1, -1, -1]
    assert values[0] == of.values[1]
    assert end.drive - branch_rejoins_path.BEFORE_END * of.span <= values[1] < end.drive
    assert toward is end


def test_a_branch_that_comes_to_its_end_goes_on_where_it_leads():
    of = problem()
    end = BranchEnd(0.025, spot(of, 0.025).y, spot(of, 0.026), 1, 0, "primary")
    path = replace(trail(of, (0.01, 0, 0), (0.02, 1, 0)), branch="bifurcated", ends=(end,), closed=False)
    near = path.with_spot(spot(of, 0.025 - 1e-7), -1)
    move = decided(of, leg(of, DONE, near, end), fresh=False)
    assert isinstance(move, Resume)
    assert (move.trail.branch, move.trail.ends, move.trail.closed) == ("primary", (), True)
    assert move.trail.events == (Event("bifurcation", pytest.approx(2.5e-3), 1, 0),)
    assert move.spot.drive > end.drive


def test_a_branch_that_passes_the_end_at_a_distance_stays_a_branch():
    of = problem()
    end = BranchEnd(0.025, spot(of, 0.025).y + 1.0, spot(of, 0.026), 1, 0, "primary")
    path = replace(trail(of, (0.01, 0, 0), (0.0249, 1, 0)), branch="bifurcated", ends=(end,), closed=False)
    move = decided(of, leg(of, DONE, path, end), fresh=False)
    assert isinstance(move, Resume)
    assert (move.trail.branch, move.trail.ends, move.trail.events) == ("bifurcated", (), ())


def test_points_at_a_bifurcation_count_as_reached_by_way_of_it():
    of = problem((1e-3, 2e-3, 2e-3 + 1e-9, 3e-3))
    path = trail(of, (0.01, 0, 0))
    assert points_at_bifurcation.count(of, path, 0.02, 0.01) == 2
    assert points_at_bifurcation.count(of, path, 0.015, 0.01) == 0


def test_what_changes_the_inertia_and_is_not_found_is_looked_at_with_shorter_steps_then_told(monkeypatch):
    of = problem()
    path = trail(of, (0.01, 0, 0), (0.0101, -1, 1))
    monkeypatch.setattr(decisions_after_march, "fine_spot", lambda *_: None)
    monkeypatch.setattr(decisions_after_march.points_at_bifurcation, "passed", lambda *_: None)
    monkeypatch.setattr(decisions_after_march, "uncondensed", lambda *_: None)
    for _ in range(2):
        move = decisions_after_march.crossed(of, path)
        assert isinstance(move, Resume)
        assert move.step == pytest.approx(0.25 * 1e-4)
        assert len(move.trail.points) == 1
        path = move.trail.with_spot(spot(of, 0.0101, 1), -1)
    move = decisions_after_march.crossed(of, path)
    assert move.trail.events == (Event("unresolved", pytest.approx(1.01e-3), 0, 1),)
    assert len(move.trail.points) == 2


def test_decisions_leave_the_path_that_they_are_made_from_as_it_is():
    of = problem(through_folds=True)
    path = trail(of, (0.01, 0, 0), (0.02, 1, 0))
    info, drives = path.points.info.copy(), path.points.drive.copy()
    passing_limit_points.around(of, path)
    ending_messages.stop(of, path, OUTSIDE)
    path.up_to(-1).with_spot(spot(of, 0.5), 1).with_event(Event("bifurcation", 0.1, 0, 1)).come_by(0.1)
    assert np.array_equal(path.points.info, info)
    assert np.array_equal(path.points.drive, drives)
    assert (len(path.branches), path.events, dict(path.visited), path.stretch.natural) == (2, (), {}, True)


def test_changed_path_counts_its_requested_points_anew():
    path = trail(problem(), (0.01, 0, 0), (0.02, 1, 0))
    assert path.requested == 2  # known from here on
    assert path.changed(stretch=path.stretch._replace(first_requested=3)).requested == 3
    assert (path.up_to(1).requested, path.requested) == (1, 2)
