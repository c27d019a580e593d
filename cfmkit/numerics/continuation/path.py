"""Data of path following: settings, points, events, batches of steps, reasons to stop, the follower's state `Walk`."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.numerics.continuation.problem import PathEquilibrium, largest_motion

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.problem import ContinuationProblem


BEND_SHARE = 0.125  # of what a bifurcation may be rounded over: longest step over a bend of the curve
AT_EVENT = 3e-7
"""Share of the range within which a requested value at which the drive turns back is at an event: nothing happens."""


class PathBranch(NamedTuple):
    """The branch that a path has been on since a bifurcation."""

    drive: float  # at the bifurcation
    sign: int
    label: str = ""  # of what is followed, if it is not the drive of the path proper


class Options(NamedTuple):
    """Settings of the follower."""

    span: float  # range of the drive
    branch: Literal["stable", "primary", "stop"] = "stable"
    sign: int = 1  # of two mirror-image branches
    through_folds: bool = False
    largest_motion: float = 0.35  # in one step
    largest_force: float = 8.0  # change of a force in one step, in its unit, besides half of what it was
    first_step: float = 0.05  # share of the range
    most_points: int = 2000
    cluster: float = 1e-3  # share of the range within which bifurcations may be one
    corner: float = 0.0  # share of the range over which a bifurcation may be rounded; 0: no corner counts as one
    growth: float = 1.6  # of the step, after a good prediction
    finest_step: float = 1e-13  # share of the range below which no step is tried

    @property
    def longest_bend(self) -> float:
        """Longest step over a bend of the curve, of the drive."""
        return BEND_SHARE * self.corner * self.span


class Point(NamedTuple):
    """An equilibrium of a path."""

    at: PathEquilibrium
    target: int = -1  # number of the requested value that it is at
    branch: PathBranch | None = None  # None: the path from rest, not left so far


class PointColumns(NamedTuple):
    """The points of a path, one after the other."""

    x: list[FloatArray]  # (k, n) each
    drive: FloatArray  # (p,)
    unstable: Any  # (p,)
    effort: FloatArray  # (p,)
    target: Any  # (p,)
    branches: tuple[PathBranch | None, ...]

    @classmethod
    def from_points(cls, points: list[Point | MarchedSteps]) -> PointColumns:
        """Return single points and those of marches as columns."""
        x, rows, branches = list[Any](), list[Any](), list[PathBranch | None]()
        for item in points:
            if isinstance(item, MarchedSteps):
                x.append(item.x)
                rows.append((item.drive, item.unstable, item.effort, item.target))
            else:
                x.append(item.at.x[None])
                numbers = item.at.drive, item.at.unstable, item.at.effort, item.target
                if rows and isinstance(rows[-1][0], list):
                    for column, number in zip(rows[-1], numbers, strict=True):
                        column.append(number)
                else:
                    rows.append(tuple([number] for number in numbers))
            branches += [item.branch] * len(x[-1])
        if not rows:
            return cls([], np.empty(0), np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64), ())
        drive, unstable, effort, target = (np.concatenate(parts) for parts in zip(*rows, strict=True))
        return cls(x, drive, unstable, effort, target, tuple(branches))


@dataclass(frozen=True, eq=False)
class PathEvent:
    """A bifurcation or limit point; unstable directions before and after it on the path that it lies on.

    They are the same where the drive turns back just at it.
    """

    kind: Literal["bifurcation", "limit point"]
    drive: float
    before: int
    after: int
    nearest: PathEquilibrium | None = None  # equilibrium beside it
    modes: Any = None  # (n, k) critical ones, if they were computed
    within: tuple[PathEquilibrium, PathEquilibrium] | None = None  # equilibria on both sides, of one path


class WhyStopped(Enum):
    """Reasons for the end of a path."""

    COMPLETE = "all requested values were reached"
    LIMIT_POINT = "the drive cannot go further"
    BLOCKED = "the drive is blocked"
    JUMPS = "stability is lost and no stable equilibrium is near"
    LOST = "no step converged"
    OUTSIDE = "the path left the range of the drive"
    FULL = "more points than allowed"


@dataclass(frozen=True)
class PathStop:
    """The last item of a path."""

    end: WhyStopped
    drive: float
    message: str = ""  # why, with {place} for the drive there


@dataclass(frozen=True, eq=False)
class MarchedSteps:
    """Equilibria of k steps that a problem took by itself, by the rules of `steps.advance`."""

    x: FloatArray  # (k, n)
    drive: FloatArray  # (k,)
    rate: FloatArray  # (k, n)
    unstable: Any  # (k,)
    effort: FloatArray  # (k,)
    target: Any  # (k,) number of the requested value that each is at, -1 if at none
    step: float  # with which to go on
    branch: PathBranch | None

    @property
    def stuck(self) -> bool:
        """True if steps failed, and not because something happens."""
        return False

    @cached_property
    def states(self) -> tuple[PathEquilibrium, ...]:
        """The equilibria one by one."""
        return tuple(map(self.point_at, range(len(self.drive))))

    def point_at(self, k: int) -> PathEquilibrium:
        """Return one of the equilibria."""
        numbers = float(self.drive[k]), self.rate[k], int(self.unstable[k]), float(self.effort[k])
        return PathEquilibrium(self.x[k], *numbers)

    def each_point(self) -> Iterator[Point]:
        """Yield the points one by one."""
        for at, target in zip(self.states, self.target.tolist(), strict=True):
            yield Point(at, target, self.branch)


class Walk(NamedTuple):
    """State of the follower: the last equilibria of one smooth piece, the next step and value."""

    problem: ContinuationProblem
    options: Options
    targets: FloatArray
    current: PathEquilibrium  # the last one
    step: float
    number: int = 0  # of the next requested value
    before: PathEquilibrium | None = None  # on the same smooth piece, for the predictor
    trail: tuple[PathEquilibrium | MarchedSteps, ...] = ()  # this smooth piece
    branch: PathBranch | None = None
    modes: int = 1  # critical where this branch began
    rejections: int = 0  # two for each, less one for each accepted step
    searched: PathEquilibrium | None = None  # from where it was looked for a bifurcation ahead
    steepest: float = 0.0  # largest stiffness on the way so far

    @property
    def sense(self) -> float:
        """Sign of the way to the next requested value."""
        return 1.0 if self.targets[self.number] >= self.current.drive else -1.0

    @property
    def origin(self) -> PathEquilibrium:
        """The first equilibrium of this smooth piece."""
        first = self.trail[0]
        return first.point_at(0) if isinstance(first, MarchedSteps) else first

    def look_back(self) -> Iterator[PathEquilibrium]:
        """Yield the equilibria of this smooth piece, the last first."""
        for part in reversed(self.trail):
            if isinstance(part, MarchedSteps):
                yield from map(part.point_at, reversed(range(len(part.drive))))
            else:
                yield part

    @property
    def done(self) -> bool:
        """True if all requested values are reached."""
        return self.number >= len(self.targets)

    def move(self, new: PathEquilibrium, reached: int = 0) -> Walk:
        """Return the walk one equilibrium further on the same smooth piece."""
        trail = (*self.trail, new)
        steepest = max(self.steepest, abs(new.stiffness))
        number = self.number + reached
        return self._replace(before=self.current, current=new, trail=trail, number=number, steepest=steepest)

    def restart(self, new: PathEquilibrium, step: float, same_piece: bool = False) -> Walk:
        """Return the walk at an equilibrium from which the slope alone predicts."""
        trail = (*self.trail, new) if same_piece else (new,)
        return self._replace(before=None, current=new, step=step, trail=trail, rejections=0)

    def shorten(self, step: float, penalty: int = 2) -> Walk:
        """Return the walk with a shorter step after a rejected one."""
        keep = self.before is not None and step >= 0.25 * abs(self.current.drive - self.before.drive)
        return self._replace(step=step, before=self.before if keep else None, rejections=self.rejections + penalty)

    def turns_at(self, drive: float) -> bool:
        """Return True if the drive turns back at the next requested value and that lies at a drive."""
        if self.number + 1 >= len(self.targets):
            return False
        goal, after = self.targets[self.number : self.number + 2]
        return bool((after - goal) * self.sense < 0 and abs(goal - drive) <= AT_EVENT * self.options.span)

    def targets_up_to(self, drive: float) -> range:
        """Return the numbers of the next requested values up to a drive, as far as they go one way."""
        sense, end = self.sense, self.number
        while end < len(self.targets) and (drive - self.targets[end]) * sense >= 0:
            if end > self.number and (self.targets[end] - self.targets[end - 1]) * sense <= 0:
                break
            end += 1
        return range(self.number, end)

    def deliver_values(
        self, drive: float, solve: Callable[[float], PathEquilibrium | None]
    ) -> Generator[Point, None, Walk | None]:
        """Yield the points at requested values up to a drive; return the walk behind them, None if one is not found."""
        walk = self
        for number in () if self.done else self.targets_up_to(drive):
            at = solve(float(self.targets[number]))
            if at is None:
                return None
            yield Point(at, number, self.branch)
            walk = walk._replace(number=number + 1)
        return walk

    def measure_motion(self, new: PathEquilibrium) -> float:
        """Return the largest motion between here and another equilibrium."""
        return largest_motion(self.problem, new.x - self.current.x)
