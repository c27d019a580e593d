"""What is followed, the path so far, and the moves that decisions come to: all of them values.

A decision is a function of a `PathProblem` and a `Trail`; it returns a move, or None where it has nothing to say.
Nothing is changed in place, so that a decision can be tried, judged and dropped.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import copysign
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.equilibrium.mesh import Mesh
from cfmkit.elastica.equilibrium.network_solver import MarchOptions, Points, Solver, Spot
from cfmkit.elastica.equilibrium.uncondensed_solver import ExpandedSolver
from cfmkit.elastica.outcome.path import Event, PathStatus

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.model.drive import Control
    from cfmkit.elastica.model.network_under_drive import Layout

MOST_SEGMENTS = 512
"""Segments of a beam up to which singular points are looked for.

That is done with nothing condensed out: with 2000 segments it takes minutes a solution.
"""

PRIMARY = "primary"  # name of the branch that a path from rest is on until it leaves it
_FINE_STEPS = ((1e-5, 16), (1e-6, 24), (0.0, 48))  # of a beam, where singular points are looked for, by the tolerance
_LOOSEST = 1e-7  # tolerance of Newton's method: it converges quadratically, so that less would save nothing
_SMALLEST = 1e-9  # shortest step as a share of the range: a column of slenderness 5000 buckles at 4e-7 of its length
_BEYOND = 0.5  # share of the drive's range by which a path through limit points may leave it
_NEARBY = 0.01  # share of the drive's range within which a place counts as the same when a path is taken up again


@dataclass(frozen=True, eq=False)
class PathProblem:
    """What is followed, on which mesh, and how.

    Attributes
    ----------
    layout : Layout
        The index map of the network, and its drive.
    mesh : Mesh
        How beams are cut into segments and steps.
    control : Control
        Tolerance, steps, branch.
    first_only : bool
        Whether the path ends with the first bifurcation.
    ramp : str
        What a share of takes the place of the drive: see `cfmkit.elastica.equilibrium.mesh.assemble_model`.
    begin : Spot or None
        Near the equilibrium where it starts, if that is known.
    """

    layout: Layout
    mesh: Mesh
    control: Control
    first_only: bool = False
    ramp: str = ""
    begin: Spot | None = None

    @cached_property
    def solver(self) -> Solver:
        """The solver that a path begins with."""
        tolerance = min(_LOOSEST, 1e-3 * self.control.tolerance)
        return Solver(self.layout, self.mesh, tolerance, self.ramp)

    @cached_property
    def fine(self) -> ExpandedSolver:
        """The same segments with more steps and nothing condensed out: singular points are seen in full, and exactly.

        Points may be requested exactly at a bifurcation. Its place on the mesh that is marched on is only as exact as
        the tolerance. Located there, 9 of 591 tests of paths with bifurcations fail: four request points at a place
        that is known from elsewhere (the critical load, a branch's end) and come to lie on the wrong side; two ask for
        places to 1e-8 and 1e-7; one loses the end of a branch; one arch fares otherwise at another tolerance (twice).
        """
        tolerance = 0.0 if self.first_only else self.control.tolerance
        whole = next(steps for limit, steps in _FINE_STEPS if tolerance >= limit)
        steps = max(-(-whole // self.mesh.segments), 2 * self.mesh.steps)
        return ExpandedSolver(self.layout, Mesh(self.mesh.segments, steps), 1e-11, self.ramp)

    @cached_property
    def values(self) -> FloatArray:
        """Values of the drive that are requested, dimensionless."""
        return np.ones(1) if self.ramp else self.layout.drive.points / self.layout.scales.drive

    @cached_property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest value of the drive, zero among them."""
        values: list[float] = self.values.tolist()
        return min(0.0, *values), max(0.0, *values)

    @cached_property
    def span(self) -> float:
        """The drive's range."""
        return self.limits[1] - self.limits[0]

    @property
    def sense(self) -> float:
        """The sense in which the drive goes first, 1 or -1."""
        return copysign(1.0, next(value for value in self.values.tolist() if value))

    @property
    def unit(self) -> float:
        """SI value of one unit of the drive."""
        return 1.0 if self.ramp else self.layout.scales.drive

    def on_primary(self) -> PathProblem:
        """Return the same problem, never to leave the primary path."""
        control = replace(self.control, branch="primary")
        return PathProblem(self.layout, self.mesh, control, ramp=self.ramp, begin=self.begin)

    def options(self, trail: Trail, spot: Spot, step: float, **others: float) -> MarchOptions:
        """Return the options of a march from a point; `others`: landings, sense, or another longest step."""
        (low, high), span, natural = self.limits, self.span, trail.stretch.natural
        given = {"longest": span if natural else 1.0, **others}
        return MarchOptions(
            tolerance=trail.solver.tolerance,
            step=step,
            largest_change=self.control.largest_turn,
            natural=natural,
            smallest=_SMALLEST * span,
            lowest=low - _BEYOND * span,
            highest=high + _BEYOND * span,
            inertia=spot.unstable,
            **given,
        )

    def reach(self, ahead: float) -> float:
        """Return how far poses may change near a bifurcation as the drive goes on: branches open like its root."""
        return 0.2 * float(np.sqrt(ahead / self.span)) + 1e-3

    def nearest_target(self, targets: FloatArray, place: float) -> float:
        """Return the distance from a place to the nearest of some requested points."""
        return float(np.abs(targets - place).min(initial=np.inf))


class BranchEnd(NamedTuple):
    """Where a branch joins the path that was left for it: at its begin, or where that path becomes stable again.

    Drive and state, an equilibrium of that path beyond, its inertia on this side and beyond, its name.
    """

    drive: float
    y: FloatArray
    beyond: Spot
    before: int
    after: int
    onto: str


class Stretch(NamedTuple):
    """The part of a path that is being followed: by the drive, or by the arc length up to where the drive turns.

    Attributes
    ----------
    targets : (n,) array
        Requested values up to its end, dimensionless.
    natural : bool
        Whether steps go by the drive.
    first_requested : int
        Number of the requested point from which on they are to be done from here, or along the arc.
    begun : int
        Index of the point from which the drive leads again, behind a limit point.
    before_fold : int
        Unstable directions before the last limit point.
    """

    targets: FloatArray
    natural: bool = True
    first_requested: int = 0
    begun: int = 0
    before_fold: int = 0


class Ending(NamedTuple):
    """How a path ended; `too_long`: because a segment is too long for its load, which a finer cut may mend."""

    status: PathStatus = PathStatus.COMPLETE
    message: str = ""
    too_long: bool = False


@dataclass(frozen=True, eq=False)
class Trail:
    """The path so far.

    Attributes
    ----------
    solver : Solver
        That it goes on with.
    stretch : Stretch
        What is being followed.
    points, branches, events
        Equilibria, the names of the branches that they are on, what happened.
    branch : str
        The branch that it is on.
    ends : tuple of BranchEnd
        Where that ends.
    closed : bool
        No branch, or its end is known, or it is known to have none before the last requested point.
    pinned : tuple of float
        Requested points at bifurcations that were not marched to.
    first, without_branch : Singular or None
        The first bifurcation at which stability is lost; the last one behind which no stable branch was found yet.
    visited : mapping
        How often the path was taken up again, by the place.
    again_at, fold_at : float
        Where it was taken up for the second time; where a march stalled last at what looked like a limit point.
    ending : Ending
        How it ended, if it did.
    """

    solver: Solver
    stretch: Stretch
    points: Points
    branches: tuple[str, ...] = ()
    events: tuple[Event, ...] = ()
    branch: str = PRIMARY
    ends: tuple[BranchEnd, ...] = ()
    closed: bool = True
    pinned: tuple[float, ...] = ()
    first: Singular | None = None
    without_branch: Singular | None = None
    visited: Mapping[tuple[float, ...], int] = field(default_factory=dict)
    again_at: float = np.nan
    fold_at: float = np.nan
    ending: Ending = field(default_factory=Ending)

    @classmethod
    def begun(cls, problem: PathProblem, branch: str = PRIMARY) -> Trail:
        """Return a path without any point yet."""
        none = Points.none(problem.solver.size)
        return cls(problem.solver, Stretch(problem.values), none, branch=branch, closed=branch == PRIMARY)

    @cached_property
    def requested(self) -> int:
        """Number of requested points that are done."""
        done = self.points.requested[self.stretch.begun :]
        return max(self.stretch.first_requested, int(done.max()) + 1) if len(done) else 0

    @property
    def ahead(self) -> FloatArray:
        """Requested values that are not done yet."""
        return self.stretch.targets[self.requested :]

    @property
    def drive(self) -> float:
        """The drive at the last point."""
        return float(self.points.drive[-1])

    @property
    def last_step(self) -> float:
        """Change of the drive between the last two points, without a sign."""
        return abs(float(self.points.drive[-1] - self.points.drive[-2]))

    def unstable(self, index: int) -> int:
        """Return the number of unstable directions at a point."""
        return int(self.points.unstable[index])

    def changed(self, **fields: Any) -> Trail:
        """Return the path with other values of some fields: `dataclasses.replace`, in a fifth of its time."""
        other = object.__new__(Trail)
        vars(other).update(vars(self), **fields)
        vars(other).pop("requested", None)  # it depends on the others
        return other

    def with_points(self, points: Points) -> Trail:
        """Return the path with points added to it, on the present branch."""
        # what a march returns are views of far more room
        joined = self.points.joined(points) if len(self.points) else points.copied()
        return self.changed(points=joined, branches=self.branches + (self.branch,) * len(points))

    def with_spot(self, spot: Spot, requested: int) -> Trail:
        """Return the path with an equilibrium added to it; `requested`: which of the requested points it is, or -1."""
        return self.with_points(Points.of(spot, requested))

    def up_to(self, count: int) -> Trail:
        """Return the path with its first points only; a negative number counts those that are taken back."""
        return self.changed(points=self.points.take(slice(0, count)), branches=self.branches[:count])

    def with_last(self, point: Points, name: str) -> Trail:
        """Return the path with a point of a named branch added to it."""
        return self.with_points(point).changed(branches=(*self.branches, name))

    def with_event(self, event: Event) -> Trail:
        """Return the path with something that happened on it."""
        return self.changed(events=(*self.events, event))

    def stopped(self, status: PathStatus, message: str, too_long: bool = False) -> Trail:
        """Return the path with the reason of its end."""
        return self.changed(ending=Ending(status, message, too_long))

    def come_by(self, *place: float) -> Trail:
        """Return the path with a note of where it is taken up again: the second time it does not get past it."""
        again_at = place[0] if place in self.visited else np.nan
        visited = {**self.visited, place: self.visited.get(place, 0) + 1}
        return self.changed(visited=visited, again_at=again_at)

    def stuck(self, problem: PathProblem) -> bool:
        """Tell whether the path was taken up for the second time near where it is."""
        return bool(abs(self.drive - self.again_at) <= _NEARBY * problem.span)

    def spot(self, index: int) -> Spot:
        """Return a stored point as a place to go on from, with its tangent."""
        y, drive = self.points.y[index], float(self.points.drive[index])
        again = self.solver.solve(y, drive)
        return Spot(y, drive, self.solver.unit.copy()) if again is None else again

    def last_of(self, points: Points) -> Spot:
        """Return the last of some points as a place to go on from by the drive."""
        return Spot(points.y[-1], float(points.drive[-1]), self.solver.unit.copy(), int(points.unstable[-1]))

    def settled(self, spot: Spot) -> Spot | None:
        """Return an equilibrium of another mesh, solved on this one, if it is near and as stable."""
        near = self.solver.solve(spot.y, spot.drive)
        return near if near is not None and near.unstable == spot.unstable else None

    def settled_or_given(self, spot: Spot) -> Spot:
        """Return an equilibrium of another mesh, solved on this one if that is possible, as a place to go on from."""
        return self.settled(spot) or replace(spot, tangent=self.solver.unit.copy())


def fine_spot(problem: PathProblem, trail: Trail, index: int) -> Spot | None:
    """Return a stored point, solved again on the fine mesh."""
    fine = problem.fine
    return fine.solve(fine.expand(trail.points.y[index]), float(trail.points.drive[index]))


class Resume(NamedTuple):
    """Go on from an equilibrium.

    Attributes
    ----------
    trail : Trail
        The path up to there.
    spot : Spot
        The equilibrium.
    step : float
        Longest first step.
    patient : bool
        Whether a requested point may be tried for as often as it takes.
    fresh : bool
        Whether the equilibrium is the start, yet to be solved for.
    """

    trail: Trail
    spot: Spot
    step: float = np.inf
    patient: bool = False
    fresh: bool = False


class Stop(NamedTuple):
    """Go on no further: the path is what it is, and says why."""

    trail: Trail


Move = Resume | Stop


class Leg(NamedTuple):
    """What a march has led to: why it ended, the path, where it is, and the end of a branch that it was to reach."""

    code: int
    trail: Trail
    spot: Spot
    toward: BranchEnd | None = None
