"""One attempt at a path on one mesh: legs of marching, joined where the path needs a decision."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams import beside, branch_ends, branches, corners, critical, endings, folds, preload
from cfmkit.beams.accuracy import errors, largest_force
from cfmkit.beams.discretise import Mesh
from cfmkit.beams.expanded import ExpandedSolver
from cfmkit.beams.kernels.codes import DENIED, DONE, INERTIA, INFO, LONG, NO_START, STALLED
from cfmkit.beams.path import Event, Path, PathStatus
from cfmkit.beams.solver import SENSE, TRIES, Points, Solver, Spot, march_options
from cfmkit.beams.steady import steadier

if TYPE_CHECKING:
    from cfmkit.beams.drive import Control
    from cfmkit.beams.events import Singular
    from cfmkit.beams.layout import Layout
    from cfmkit.curves import FloatArray

_HOPS = 60  # decisions on one path
_FINE_STEPS = ((1e-5, 16), (1e-6, 24), (0.0, 48))  # of a beam, where singular points are looked for, by the tolerance
_LOOSEST = 1e-7  # tolerance of Newton's method
_TRIES = 6  # to land on a point asked for, before a bifurcation is looked for there
_NEARBY = 0.01  # share of the drive's range
_SMALLEST = 1e-9  # shortest step as a share of the range: a column of slenderness 5000 buckles at 4e-7 of its length


@dataclass
class Run:
    """One attempt at a path on one mesh."""

    layout: Layout
    mesh: Mesh
    control: Control
    to_first: bool = False  # whether the first bifurcation ends it
    ramped: str = ""  # what a share of takes the place of the drive: see `cfmkit.beams.discretise.assemble_model`
    begin: Spot | None = None  # near the equilibrium where it starts, if that is known
    status: PathStatus = PathStatus.COMPLETE
    message: str = ""
    events: list[Event] = field(default_factory=list)
    branch: str = "primary"
    too_long: bool = False
    share: float = 1.0  # of the constant loads and displacements that was reached
    ends: tuple[branch_ends.BranchEnd, ...] = ()  # of the branch that it is on
    toward: branch_ends.BranchEnd | None = None  # the one that it is marching to
    error: float = np.inf  # as estimated
    first: Singular | None = None  # the first bifurcation at which stability is lost
    ramp: Run | None = None  # the run to the prestress or the constant loads, if that has the first bifurcation
    without_branch: Singular | None = None  # the last bifurcation behind which no stable branch was found yet
    pinned: list[float] = field(default_factory=list)  # points asked for at bifurcations that were not marched to
    visited: Counter[tuple[float, ...]] = field(default_factory=Counter)  # how often it was taken up again, and where
    again_at: float = np.nan  # where it was taken up for the second time
    patient: bool = False  # whether a point asked for may be tried for as often as it takes
    begun: int = 0  # index of the point from which the drive leads again, behind a limit point
    first_asked: int = 0  # number of the point asked for from which on they are to be done from there, or along the arc
    fold_at: float = np.nan  # where a march stalled last at what looked like a limit point
    before_fold: int = 0  # unstable directions before the last limit point
    closed: bool = True  # no branch, or its end is known, or it is known to have none before the last point asked for
    entry: float = np.inf  # first step on a branch that was just entered

    def __post_init__(self) -> None:
        """Build the solver."""
        tolerance = min(_LOOSEST, 1e-3 * self.control.tolerance)
        self.solver = Solver(self.layout, self.mesh, tolerance, self.ramped)
        self.values = np.ones(1) if self.ramped else self.layout.drive.points / self.layout.scales.drive
        self.targets = self.values  # along the arc: up to where the drive turns round next
        self.points: Points = Points(np.empty((0, self.solver.size)), np.empty(0), np.empty((0, INFO)))
        self.branches: list[str] = []
        values: list[float] = self.values.tolist()
        self.low, self.high = min(0.0, *values), max(0.0, *values)
        self.span = self.high - self.low
        self.natural = True  # by the drive, not by the arc length

    @property
    def unit(self) -> float:
        """SI value of one unit of the drive."""
        return 1.0 if self.ramped else self.layout.scales.drive

    @cached_property
    def fine(self) -> ExpandedSolver:
        """The same segments with more steps and nothing eliminated: singular points are seen in full, and exactly."""
        tolerance = 0.0 if self.to_first else self.control.tolerance
        whole = next(steps for limit, steps in _FINE_STEPS if tolerance >= limit)
        steps = max(-(-whole // self.mesh.segments), 2 * self.mesh.steps)
        return ExpandedSolver(self.layout, Mesh(self.mesh.segments, steps), 1e-11, self.ramped)

    def follow(self) -> None:
        """Trace from rest to the last point asked for, or to where it ends, and name the branches."""
        self._follow()
        left = set(self.branches) - {"primary"}
        if left and self.natural and not self.closed and not self.too_long and not branch_ends.close_behind(self):
            control = replace(self.control, branch="primary")
            primary = Run(self.layout, self.mesh, control, ramped=self.ramped, begin=self.begin)
            primary.follow()
            branch_ends.relabel(self, primary)

    def _follow(self) -> None:
        spot, self.share, code = preload.start(self)
        self.too_long = code == LONG
        if spot is None and code == DONE:
            return
        if self.branch != "primary":
            ending = preload.end_of_branch(self)
            self.ends = (ending,) if ending else ()
        asked, hops, fresh = int(self.targets[0] == 0.0), 0, True
        while spot is not None and asked < len(self.targets) and hops < _HOPS:
            code, asked, spot = self._leg(spot, asked, fresh)
            away = critical.begun_again(self) if fresh else None
            fresh = False
            hops += 1
            if away is not None:
                spot, asked = away, self.asked()
                continue
            if code == DONE and asked == len(self.targets):
                if asked == len(self.values):
                    break
                spot = folds.turn(self, asked)
                continue
            following = self._taken_up(code, spot, asked)
            if following is None and not len(self.points):
                break
            if following is None or self.too_long or (self.to_first and self.first is not None):
                return
            spot, asked = following, self.asked()
        if not len(self.points):
            endings.no_start(self, self.share)
        elif asked == len(self.targets):
            while self.natural and self.points.info[-1, 1] < 0.0:
                self.drop_last()
        else:
            last = float(self.points.drive[-1]) * self.unit
            self.status, self.message = PathStatus.LOST, f"the path turned back and forth at {last:.6g}"

    def _taken_up(self, code: int, spot: Spot, asked: int) -> Spot | None:
        """Return where to go on after a march that ended early, at `spot`; None to stop."""
        steadies = code == INERTIA and bool(self.points.info[-1, 0] < self.points.info[-2, 0])
        if code in (NO_START, STALLED) or (steadies and self.control.branch == "stable"):
            away = critical.left(self, spot)
            if away is not None or code == NO_START:
                return away
        if code == INERTIA and self.control.branch == "stop":
            self.status = PathStatus.JUMPS
            last = float(self.points.drive[-1]) * self.unit
            self.message = f"stability is lost at {last:.6g}: the path ends there"
            return None
        if code == INERTIA:
            return folds.resumed(self, branches.cross(self))
        if code == DONE:
            return branch_ends.rejoin(self, spot)
        if code == DENIED:
            self.patient = not beside.behind(self, float(self.targets[asked]))
            return spot if self.patient else branches.cross(self)
        if code == STALLED and self.natural and len(self.points):
            return self._got_over(spot, asked)
        endings.stop(self, code)
        return None

    def _got_over(self, spot: Spot, asked: int) -> Spot | None:
        """Return where to go on after a march by the drive that stalled; None to stop."""
        fold = folds.near(self)
        if fold and abs(spot.drive - self.fold_at) <= _NEARBY * self.span:
            return folds.follow(self)
        self.fold_at = spot.drive if fold else np.nan
        if not fold and steadier(self):
            return self.spot(-1)
        joined = branch_ends.hop(self, spot, asked) if any(name != "primary" for name in self.branches) else None
        joined = joined or corners.past(self, spot, asked)
        if joined is not None or self.status is not PathStatus.COMPLETE:
            return joined
        if self.control.through_folds:
            return folds.follow(self)
        endings.stop(self, STALLED)
        return None

    def come_by(self, *place: float) -> None:
        """Take note of a place where the path is taken up again: the second time it does not get past it."""
        self.again_at = place[0] if place in self.visited else np.nan
        self.visited[place] += 1

    @property
    def stuck(self) -> bool:
        """Whether the path was taken up for the second time near where it is."""
        return bool(abs(float(self.points.drive[-1]) - self.again_at) <= _NEARBY * self.span)

    def asked(self) -> int:
        """Return the number of points asked for that are done."""
        done = self.points.info[self.begun :, 1]
        return max(self.first_asked, int(done.max()) + 1) if len(done) else 0

    def as_points(self, spot: Spot, asked: int) -> Points:
        """Return one equilibrium as a list of points."""
        info = np.array([[spot.unstable, asked, 0.0, 0.0, spot.tangent[-1], spot.shortness]])
        return Points(spot.y[None], np.array([spot.drive]), info)

    def append(self, points: Points) -> None:
        """Add points to the path, on the present branch."""
        # what a march returns are views of far more room
        self.points = self.points.joined(points) if len(self.points) else points.copied()
        self.branches += [self.branch] * len(points)

    def spot(self, index: int) -> Spot:
        """Return a stored point as a place to go on from, with its tangent."""
        again = self.solver.solve(self.points.y[index], float(self.points.drive[index]))
        if again is not None:
            return again
        return Spot(self.points.y[index], float(self.points.drive[index]), self.solver.unit.copy())

    def settled(self, spot: Spot) -> Spot | None:
        """Return an equilibrium of another mesh, solved on this one, if it is near and as stable."""
        near = self.solver.solve(spot.y, spot.drive)
        return near if near is not None and near.unstable == spot.unstable else None

    def fine_spot(self, index: int) -> Spot | None:
        """Return a stored point, solved again on the fine mesh."""
        return self.fine.solve(self.fine.expand(self.points.y[index]), float(self.points.drive[index]))

    def reach(self, ahead: float) -> float:
        """Return how far poses may change beside a bifurcation as the drive goes on: branches open like its root."""
        return 0.2 * float(np.sqrt(ahead / self.span)) + 1e-3

    def _leg(self, spot: Spot, asked: int, fresh: bool) -> tuple[int, int, Spot]:
        """March once; return why it ended, the points done and the last spot. A fresh start is yet to be solved for."""
        left, numbers = branch_ends.left(self, spot, asked)
        options = self.options(spot, self._first_step(spot, asked))
        patient = self.patient or not self.natural or self.control.branch == "stop"
        options[TRIES] = np.inf if patient else _TRIES
        self.patient = False
        if fresh:
            options[SENSE] = np.sign(next(value for value in self.targets if value))
        room = max(len(left) + 3, self.control.most_points + len(self.targets) - len(self.points))
        code, points = self.solver.march(spot, left, options, room)
        if numbers is not None:
            points.info[:, 1] = numbers[points.info[:, 1].astype(int)]
        if fresh and asked:
            points.info[:1, 1] = 0
        self.append(points)
        if len(points):
            spot = self.spot(-1) if code == STALLED else self.last(points)
        return code, self.asked(), spot

    def last(self, points: Points) -> Spot:
        """Return the last of some points as a place to go on from."""
        return Spot(points.y[-1], float(points.drive[-1]), self.solver.unit.copy(), int(points.info[-1, 0]))

    def _first_step(self, spot: Spot, asked: int) -> float:
        if self.control.first_step is not None:
            step, self.entry = min(self.control.first_step * self.span, self.entry), np.inf
            return step if not self.natural else float(np.copysign(step, self.targets[asked] - spot.drive))
        if not self.natural:
            step, self.entry = min(folds.first_step(self), self.entry), np.inf
            return step
        ahead = float(self.targets[asked] - spot.drive)
        step, self.entry = min(abs(ahead), 0.05 * self.span, self.entry), np.inf
        return float(np.sign(ahead)) * step

    def options(self, spot: Spot, step: float) -> FloatArray:
        """Return the options of a march from a point."""
        return march_options(
            self.solver.tolerance,
            step,
            self.control.largest_turn,
            self.natural,
            _SMALLEST * self.span,
            self.span if self.natural else 1.0,
            (self.low - 0.5 * self.span, self.high + 0.5 * self.span),
            spot.unstable,
        )

    def drop_last(self) -> None:
        """Take back the last point."""
        self.points = self.points.take(slice(0, -1))
        self.branches.pop()

    def path(self) -> Path:
        """Return the outcome; where the tolerance is not reached, every point is judged by itself."""
        accurate = np.ones(len(self.points), dtype=bool)
        if not self.error <= self.control.tolerance:
            accurate = errors(self, range(len(self.points)), float(largest_force(self).max())) <= self.control.tolerance
            endings.inaccurate(self, int((~accurate).sum()))
        accurate.setflags(write=False)
        return Path(
            solver=self.solver,
            points=self.points,
            branch=np.array(self.branches, dtype=np.str_),
            status=self.status,
            message=self.message or self.status.value,
            events=tuple(self.events),
            error=self.error,
            accurate=accurate,
        )
