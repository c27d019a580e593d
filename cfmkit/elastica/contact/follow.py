"""A path with contact: followed with one set of closed contacts at a time, between located changes of that set.

On each piece the path is smooth and `cfmkit.numerics.continuation` follows it. Where a gap or a force becomes negative
the change is solved for by its own equations: gap and force of that contact are both zero there. Then a contact begins
or ends, and the path goes on to the side on which no gap and no force becomes negative: where that is back, the drive
has a limit point at the change. A contact between whose change and the drive nothing can move blocks the drive.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.elastica.contact.equations import with_closed
from cfmkit.elastica.contact.terms import gaps, measure
from cfmkit.elastica.model.contact import NodeOnObstacle
from cfmkit.numerics.continuation.arc import follow_arc, unit_tangent
from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.folds import pass_fold
from cfmkit.numerics.continuation.follow import LOCKED, LOCKED_FORCE, LOCKED_STEP, follow, follow_on
from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point, Walk, WhyStopped
from cfmkit.numerics.continuation.problem import arc_weights, largest_motion
from cfmkit.numerics.continuation.steps import hermite

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.numerics.continuation.path import Options, PathBranch
    from cfmkit.numerics.continuation.problem import PathEquilibrium

GAP_ROUNDING, FORCE_ROUNDING = 1e-11, 1e-10
"""Gap, in mean beam lengths, and force, as a share of the largest and of one, that may be negative by rounding."""
SAME_PLACE = 1e-11  # share of the range within which a change is at a point
FEWEST_SAMPLES, MOST_SAMPLES = 16, 400  # of a step between whose ends a gap may close and open again
SAMPLES_PER_RADIUS = 6.0  # of the smallest radius that a pad may pass
FAR = 2.0  # times a step's motion by which a gap must be open at both ends for nothing to happen between
STEEP = 3.0  # times a step's motion that its slopes may promise, for a cubic to tell what is between
MAX_MISS = 1.0  # motions of a step by which a located change may lie off its guess
BESIDE_STEP = 0.02  # of a step, by which a change may lie beside it: then it is at its end
RIGID_RATE = 1e9  # motion or force per drive beyond which the contacts leave no way to move
MAX_CHANGES_AT_ONE_PLACE = 20
FIRST_ARC = 0.1  # of the step before, behind a limit point at a change
SHORTEST_STEP = 1e-6  # share of the range
BLOCKED = "the drive is blocked by {names} at {{place}}"
SNAPS = "the drive cannot go on at {{place}}, where {names} {what}: a limit point; follow it by through_folds"
LOSES = "stability is lost at {{place}}, where {names} {what}"
NOT_LOCATED = "where {names} {what} was not found near {{place}}"


class ContactChange(NamedTuple):
    """The begin or end of a contact; unstable directions before and after it."""

    kind: Literal["begins", "ends", "blocks"]
    number: int  # of the contact
    at: PathEquilibrium
    before: int
    after: int


Item = Point | PathEvent | PathStop | ContactChange


def follow_in_contact(
    problem: NetworkProblem,
    start: PathEquilibrium,
    targets: FloatArray,
    options: Options,
    branch: PathBranch | None = None,
) -> Iterator[Item]:
    """Yield points, events and changes of contacts of a path in order, and its ending at last; see `follow`.

    Every change comes behind a point that lies at it.
    """
    if not problem.mesh.contacts:
        yield from follow(problem, start, targets, options, branch)
        return
    closed = frozenset(
        number
        for number, contact in enumerate(problem.mesh.contacts)
        if problem.values(start.x, start.drive)[contact.unknown] > FORCE_ROUNDING
    )
    yield from _until_full(_follow(problem, start, targets, options, branch, closed), options)


def _until_full(items: Iterator[Item], options: Options) -> Iterator[Item]:
    """Yield the items of a path, at most as many points as are allowed."""
    between = 0
    for item in items:
        yield item
        between += isinstance(item, Point) and item.target < 0
        if between > options.most_points:
            assert isinstance(item, Point)
            yield PathStop(WhyStopped.FULL, item.at.drive, "more points than allowed at {place}")
            return


def _follow(
    problem: NetworkProblem, start: PathEquilibrium, targets: FloatArray, options: Options, branch: PathBranch | None,
    closed: frozenset[int],
) -> Iterator[Item]:  # fmt: skip
    part = _Part(problem, closed, options)
    items = follow(part.own, part.shrink(start), targets, options, branch)
    walk, count, place = Walk(part.own, options, targets, start, 0.0, branch=branch), 0, np.inf
    previous: PathEquilibrium | None = None
    while True:
        outcome = yield from _follow_part(part, items, walk, previous)
        if isinstance(outcome, PathStop):
            yield outcome
            return
        walk, change, sense = outcome
        near = abs(change.at.drive - place) <= SAME_PLACE * options.span
        count, place = (count + 1 if near else 0), change.at.drive
        if count > MAX_CHANGES_AT_ONE_PLACE:
            yield PathStop(WhyStopped.LOST, place, "contacts begin and end without end at {place}")
            return
        after = _enter(part, change, sense)
        if isinstance(after, PathStop):
            yield change._replace(kind="blocks") if after.end is WhyStopped.BLOCKED else change
            yield after
            return
        part, at, sense, turned = after
        yield change._replace(after=at.unstable)
        names, what = part.say(change.number), change.kind
        if turned and not options.through_folds:
            yield PathStop(WhyStopped.LIMIT_POINT, place, SNAPS.format(names=names, what=what))
            return
        if at.unstable > change.before and options.branch != "primary" and not options.through_folds:
            yield PathStop(WhyStopped.JUMPS, place, LOSES.format(names=names, what=what))
            return
        if turned:
            yield PathEvent("limit point", place, change.before, at.unstable, at)
        if walk.done:
            yield PathStop(WhyStopped.COMPLETE, place)
            return
        items, previous = _go_on(part, walk, at, sense), at


def _go_on(part: _Part, walk: Walk, at: PathEquilibrium, sense: float) -> Iterator[Point | PathEvent | PathStop]:
    """Yield the items of the next piece: by the drive, or by the arc length where it leads away from the next value."""
    own, options = part.own, walk.options
    start, step = part.shrink(at), max(walk.step, SHORTEST_STEP * options.span)
    walk = Walk(own, options, walk.targets, start, step, walk.number, trail=(start,), branch=walk.branch)
    if sense == walk.sense:
        yield from follow_on(walk)
        return
    tangent = unit_tangent(own, start, sense * np.append(start.rate, 1.0), options.span)
    length = float(FIRST_ARC * step / max(abs(tangent[-1]), SHORTEST_STEP))
    move = next(follow_arc(own, start, tangent, min(length, options.largest_motion), options), None)
    if move is None:
        yield PathStop(WhyStopped.LOST, start.drive, "no step converged at {place}")
        return
    outcome = yield from pass_fold(walk, move)
    if isinstance(outcome, Walk):
        yield from follow_on(outcome)
    elif outcome is not None:
        yield outcome


def _follow_part(
    part: _Part, items: Iterator[Point | PathEvent | PathStop], walk: Walk, previous: PathEquilibrium | None
) -> Generator[Point | PathEvent | ContactChange, None, PathStop | tuple[Walk, ContactChange, float]]:
    """Yield the items of a piece up to a change; return the walk there, the change and the sense of travel.

    `previous` is where the piece begins if that was yielded before.
    """
    waiting: list[PathEvent] = []
    for item in items:
        if isinstance(item, PathEvent):
            waiting.append(part.grow_event(item))
            continue
        if isinstance(item, PathStop):
            found = part.find_change_before_end(previous, item)
            if found is None:
                yield from waiting
                return item
            at, step = None, item.drive
        else:
            at, step = part.grow(item.at), item.at.drive
            found = None if previous is None else part.find_change(previous, at)
        if found is not None:
            assert previous is not None
            if isinstance(found, PathStop):
                return found
            sense = 1.0 if step >= previous.drive else -1.0
            place = found.at.drive
            yield from (event for event in waiting if (place - event.drive) * sense > 0)
            walk = replace(walk, step=abs(step - previous.drive))
            tied = SAME_PLACE * walk.options.span
            beside = abs(place - previous.drive) <= tied
            if not walk.done and abs(walk.targets[walk.number] - place) <= tied and not beside:
                yield Point(found.at, walk.number, walk.branch)
                walk = replace(walk, number=walk.number + 1)
            elif not beside:
                yield Point(found.at, -1, walk.branch)
            return walk, found, sense
        yield from waiting
        waiting = []
        assert isinstance(item, Point)
        assert at is not None
        yield item._replace(at=at)
        if previous is not None and part.is_locked(previous, at):
            return PathStop(WhyStopped.LIMIT_POINT, at.drive, LOCKED)
        if item.target >= 0:
            walk = replace(walk, number=item.target + 1)
        walk, previous = replace(walk, branch=item.branch), at
    return PathStop(WhyStopped.LOST, walk.here.drive, "no step converged at {place}")


def _enter(part: _Part, change: ContactChange, sense: float) -> PathStop | tuple[_Part, PathEquilibrium, float, bool]:
    """Return the piece behind a change, its start, the sense of the drive there, and whether it has turned."""
    begins, number = change.kind == "begins", change.number
    closed = part.closed | {number} if begins else part.closed - {number}
    beyond = part.with_closed(closed)
    near = beyond.shrink(change.at)
    at = beyond.own.solve(near.x, near.drive)
    names = beyond.say(number)
    if at is None or not np.abs(at.rate).max(initial=0.0) < RIGID_RATE:
        if not begins:
            return PathStop(WhyStopped.JUMPS, near.drive, LOSES.format(names=names, what="ends"))
        return PathStop(WhyStopped.BLOCKED, near.drive, BLOCKED.format(names=beyond.say_all(number)))
    whole = beyond.grow(at)
    turned = bool(beyond.grows_along(whole, number) * sense < 0)
    return beyond, whole, (-sense if turned else sense), turned


@dataclass(frozen=True, eq=False)
class _Part:
    """The problem with one set of closed contacts, beside the problem of all, whose unknowns points have."""

    whole: NetworkProblem
    closed: frozenset[int]
    options: Options

    @cached_property
    def own(self) -> NetworkProblem:
        """The problem whose contacts neither begin nor end."""
        return replace(self.whole, mesh=with_closed(self.whole.mesh, self.closed))

    def with_closed(self, closed: frozenset[int]) -> _Part:
        """Return the problem with another set of closed contacts."""
        return _Part(self.whole, closed, self.options)

    def say(self, number: int) -> str:
        """Return what a contact is called."""
        return describe(self.whole, number)

    def say_all(self, number: int) -> str:
        """Return what a contact and those that are closed with it are called, where they block the drive together."""
        others = [self.say(other) for other in sorted(self.closed - {number})]
        return " with ".join([self.say(number), *others[:2]])

    # -- unknowns ------------------------------------------------------------------------------------------------------
    @cached_property
    def _kept(self) -> Any:
        return np.isin(self.whole.mesh.free, self.own.mesh.free)

    def shrink(self, at: PathEquilibrium) -> PathEquilibrium:
        """Return an equilibrium without the forces of open contacts."""
        return at._replace(x=at.x[self._kept], rate=at.rate[self._kept])

    def _spread(self, values: Any) -> Any:
        found = np.zeros((len(self._kept), *np.shape(values)[1:]))
        found[self._kept] = values
        return found

    def grow(self, at: PathEquilibrium) -> PathEquilibrium:
        """Return an equilibrium with the forces of all contacts."""
        return at._replace(x=self._spread(at.x), rate=self._spread(at.rate))

    def grow_event(self, event: PathEvent) -> PathEvent:
        """Return an event whose equilibria have the forces of all contacts."""
        within = None if event.within is None else (self.grow(event.within[0]), self.grow(event.within[1]))
        near = None if event.near is None else self.grow(event.near)
        modes = None if event.modes is None else self._spread(event.modes)
        return replace(event, near=near, modes=modes, within=within)

    def is_locked(self, before: PathEquilibrium, at: PathEquilibrium) -> bool:
        """Return True if forces are as large as where a structure locks, between two points that nearly coincide."""
        forces = (np.abs(at.x) / self.whole.unit)[~self.whole.motions]
        near = abs(at.drive - before.drive) <= LOCKED_STEP * self.options.span
        return bool(near and forces.max(initial=0.0) > LOCKED_FORCE)

    # -- gaps and forces -----------------------------------------------------------------------------------------------
    def values(self, x: FloatArray, drives: FloatArray) -> FloatArray:
        """Return the forces of closed and the gaps of open contacts in states (n, free), (contacts, n)."""
        mesh, way = self.whole.mesh, drives[:, None]
        z = np.asarray(way * mesh.base if self.whole.ramp else mesh.base + way * mesh.rate)
        z[:, mesh.free] = x
        return np.array(
            [
                z[:, contact.unknown] if number in self.closed else gaps(mesh, contact, z)
                for number, contact in enumerate(mesh.contacts)
            ]
        )

    def roundings(self, values: FloatArray) -> FloatArray:
        """Return by how much a force or a gap may be negative, (contacts,)."""
        closed = np.isin(np.arange(len(values)), list(self.closed))
        largest = float(np.abs(values[closed]).max(initial=1.0))
        return np.where(closed, FORCE_ROUNDING * largest, GAP_ROUNDING)

    def grows_along(self, at: PathEquilibrium, number: int) -> float:
        """Return how force or gap of a contact changes with the drive at an equilibrium."""
        mesh = self.whole.mesh
        contact = mesh.contacts[number]
        moved = np.array(mesh.base if self.whole.ramp else mesh.rate, float)
        moved[mesh.free] = at.rate
        if number in self.closed:
            return float(moved[contact.unknown])
        gap = measure(mesh, contact, self.whole.values(at.x, at.drive))
        return float(gap.gradient @ moved[gap.unknowns])

    # -- changes -------------------------------------------------------------------------------------------------------
    def find_change_before_end(
        self, previous: PathEquilibrium | None, stop: PathStop
    ) -> ContactChange | PathStop | None:
        """Return the first change between the last point and the end of a piece that ends early; None without any."""
        if previous is None or stop.end in (WhyStopped.COMPLETE, WhyStopped.FULL) or stop.drive == previous.drive:
            return None
        near = self.shrink(previous)
        last = correct(self.own, near.x + (stop.drive - near.drive) * near.rate, stop.drive)
        if last is None or largest_motion(self.own, last.x - near.x) > self.options.largest_motion:
            return None
        return self.find_change(previous, self.grow(last))

    def find_change(self, first: PathEquilibrium, last: PathEquilibrium) -> ContactChange | PathStop | None:
        """Return the first change of a contact between two points of the piece; None if there is none."""
        step = _StepBetween(self, first, last)
        if step.is_far:
            return None
        values = step.values
        rounding = self.roundings(values)
        dips = (values < -rounding[:, None])[:, 1:]
        if not dips.any():
            return None
        if not dips[:, -1].any():  # only the guess says so: see whether the equilibrium does
            at = step.solve(float(step.shares[1:][dips.any(axis=0).argmax()]))
            if at is None:
                return None
            return self.find_change_at_end(first, self.grow(at), rounding)
        found = [self._locate(step, int(number)) for number in np.flatnonzero(dips.any(axis=1))]
        missing = next((number for number, change in found if change is None), None)
        known = [change for _, change in found if change is not None]
        if not known:
            assert missing is not None
            what = "ends" if missing in self.closed else "begins"
            return PathStop(WhyStopped.LOST, first.drive, NOT_LOCATED.format(names=self.say(missing), what=what))
        return min(known, key=lambda change: step.share_of(change.at))

    def find_change_at_end(
        self, first: PathEquilibrium, last: PathEquilibrium, rounding: FloatArray
    ) -> ContactChange | PathStop | None:
        """Return the first change up to a point that may violate a condition; None if it does not."""
        values = self.values(last.x[None], np.array([last.drive]))[:, 0]
        return self.find_change(first, last) if (values < -rounding).any() else None

    def _locate(self, step: _StepBetween, number: int) -> tuple[int, ContactChange | None]:
        """Return where a contact changes within a step: where its gap and its force are both zero."""
        share = step.crossing(number)
        if share is None:
            return number, None
        guess, drive = step.at(share)
        kind: Literal["begins", "ends"] = "ends" if number in self.closed else "begins"
        both = self.with_closed(self.closed | {number})
        x = guess[both._kept]
        border = np.zeros(len(x) + 1)
        border[int(both._kept[: self._slot(number)].sum())] = 1.0
        state = both.own.equations.solve(x, drive, border, 0.0)
        if state is not None and np.isfinite(state.rate).all():
            free = both._spread(state.free)
            free[self._slot(number)] = 0.0
            at = step.first._replace(x=free, drive=float(state.way), effort=np.nan, stiffness=np.nan)
            if step.contains(at, guess):
                return number, ContactChange(kind, number, at, step.first.unstable, step.first.unstable)
        at_bracket = step.bisect(number)
        if at_bracket is None:
            return number, None
        return number, ContactChange(kind, number, at_bracket, step.first.unstable, step.first.unstable)

    def _slot(self, number: int) -> int:
        """Return the number of a contact's force among the free unknowns of the whole problem."""
        return int(np.searchsorted(self.whole.mesh.free, self.whole.mesh.contacts[number].unknown))


@dataclass(frozen=True, eq=False)
class _StepBetween:
    """What lies between two points of a piece, by the cubic through them, or the chord where slopes are steep."""

    part: _Part
    first: PathEquilibrium
    last: PathEquilibrium

    @cached_property
    def moved(self) -> float:
        """Largest motion of the step."""
        return largest_motion(self.part.whole, self.last.x - self.first.x)

    @cached_property
    def _is_smooth(self) -> bool:
        width = abs(self.last.drive - self.first.drive)
        rates = (largest_motion(self.part.whole, at.rate) for at in (self.first, self.last))
        return width > 0 and max(rates) * width <= STEEP * self.moved

    @cached_property
    def shares(self) -> FloatArray:
        """Places at which gaps and forces are looked at, from 0 to 1: so dense that no obstacle is passed."""
        items = [contact.item for contact in self.part.whole.mesh.contacts]
        length = self.part.whole.mesh.scales.length
        radii = [item.outline.smallest_bulge + item.radius for item in items if isinstance(item, NodeOnObstacle)]
        wanted = SAMPLES_PER_RADIUS * self.moved * length / min(radii, default=np.inf)
        return np.linspace(0.0, 1.0, int(np.clip(np.ceil(wanted), FEWEST_SAMPLES, MOST_SAMPLES)) + 1)

    @property
    def is_far(self) -> bool:
        """True if every contact is open and its gap is more than the step can close."""
        if self.part.closed:
            return False
        mesh, ends = self.part.whole.mesh, self.part.values(*self.at(np.array([[0.0], [1.0]])))
        arms = np.hypot(*mesh.attachments.arm[[contact.place for contact in mesh.contacts]].T)
        return bool((ends > FAR * self.moved * (1.0 + arms[:, None])).all())

    @cached_property
    def values(self) -> FloatArray:
        """Forces of closed and gaps of open contacts there, (contacts, shares)."""
        return self.part.values(*self.at(self.shares[:, None]))

    def at(self, share: Any) -> tuple[FloatArray, Any]:
        """Return the unknowns (n,) and the drive at a share of the step, or (m, n) and (m,) at m of them, (m, 1)."""
        drive = self.first.drive + share * (self.last.drive - self.first.drive)
        if self._is_smooth:
            x = hermite(self.first, self.last, drive)
        else:
            x = self.first.x + share * (self.last.x - self.first.x)
        x = np.where(share == 1.0, self.last.x, x)
        return x, np.where(share == 1.0, self.last.drive, drive)[..., 0] if np.ndim(share) else drive

    def solve(self, share: float) -> PathEquilibrium | None:
        """Return the equilibrium of the piece at a share of the step."""
        x, drive = self.at(share)
        at = correct(self.part.own, x[self.part._kept], drive)
        if at is None or largest_motion(self.part.own, at.x - x[self.part._kept]) > MAX_MISS * self.moved + 1e-9:
            return None
        return at

    def crossing(self, number: int) -> float | None:
        """Return the first share at which force or gap of a contact vanishes, by straight lines; None if nowhere."""
        values = self.values[number]
        below = np.flatnonzero(values[1:] < 0)
        if not len(below):
            return None
        behind = int(below[0]) + 1
        before, after = float(values[behind - 1]), float(values[behind])
        part = 0.0 if before <= 0 else before / (before - after)
        return float(self.shares[behind - 1] + part * (self.shares[behind] - self.shares[behind - 1]))

    def share_of(self, at: PathEquilibrium) -> float:
        """Return at which share of the step an equilibrium lies, across its chord."""
        weights = arc_weights(self.part.whole, self.part.options.span)
        start = np.append(self.first.x, self.first.drive)
        chord, way = np.append(self.last.x, self.last.drive) - start, np.append(at.x, at.drive) - start
        finite = np.isfinite(weights)
        return float((weights * chord)[finite] @ way[finite] / ((weights * chord)[finite] @ chord[finite]))

    def contains(self, at: PathEquilibrium, guess: FloatArray) -> bool:
        """Return True if an equilibrium lies within the step, near a guess."""
        near = largest_motion(self.part.whole, at.x - guess) <= MAX_MISS * self.moved + 1e-9
        return near and -BESIDE_STEP <= self.share_of(at) <= 1 + BESIDE_STEP

    def bisect(self, number: int) -> PathEquilibrium | None:
        """Return the equilibrium of the piece at which force or gap vanishes, by its drive alone; None if lost."""
        from scipy.optimize import brentq

        part = self.part

        def value(share: float) -> float:
            at = self.solve(share)
            if at is None:
                raise ArithmeticError
            whole = part.grow(at)
            return float(part.values(whole.x[None], np.array([whole.drive]))[number, 0])

        try:
            low, high = value(0.0), value(1.0)
            if low <= 0:
                return self.first
            if high > 0:
                return None
            share = float(brentq(value, 0.0, 1.0, xtol=1e-15, rtol=1e-14))
        except ArithmeticError:
            return None
        at = self.solve(share)
        return None if at is None else part.grow(at)


def describe(problem: NetworkProblem, number: int) -> str:
    """Return what a contact is called: a stop by its name, a pad by its node and its obstacle."""
    item = problem.mesh.contacts[number].item
    return f"{item.node!r} on {item.name!r}" if isinstance(item, NodeOnObstacle) else f"stop {item.name!r}"
