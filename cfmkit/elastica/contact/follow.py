"""A path with contact: pieces with one set of closed contacts each, located changes between, friction behind each.

On each piece the path is smooth and `cfmkit.numerics.continuation` follows it. Where a gap or a force becomes negative
the change is solved for by its own equations: gap and force of that contact are both zero there. Then a contact begins
or ends, and the path goes on to the side on which no gap and no force becomes negative: where that is back, the drive
has a limit point at the change. A contact between whose change and the drive nothing can move blocks the drive.

With Coulomb friction forces are continuous along a path. So a contact that slips may only go on to slip or begin to
stick, one that sticks may slip where its tangential force is as large as friction allows, against that force, and one
that just touches may do anything. Of all combinations those are possible whose gaps, forces and ways of slip go on as
they must: their rates say so. Which are possible is not unique where friction is large.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from cfmkit.elastica.contact.conditions import FORCE_ROUNDING
from cfmkit.elastica.contact.equations import NO_FRICTION
from cfmkit.elastica.contact.first_change import find_change, find_change_before_end
from cfmkit.elastica.contact.path_items import BeyondChange, ContactChange, PathItem, Remeshed
from cfmkit.elastica.contact.piece import PieceOfPath
from cfmkit.elastica.contact.side_changes import enter_side_change
from cfmkit.elastica.model.contact import FrictionState
from cfmkit.numerics.continuation.arc import follow_arc, unit_tangent
from cfmkit.numerics.continuation.by_arc import pass_fold
from cfmkit.numerics.continuation.follow import LOCKED_MESSAGE, each_point, follow, follow_on, limit_points
from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point, Walk, WhyStopped

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.numerics.continuation.path import Options, PathBranch
    from cfmkit.numerics.continuation.problem import PathEquilibrium


AT_LIMIT = 1e-7  # share of the friction by which the tangential force may miss its limit where slip may begin
UNDECIDED_RATE_RTOL = (
    1e-6  # share of the largest rate below which a rate does not say how a condition goes on: a step does
)
TRIAL_STEP_FRACTION = 1e-4  # of the range: that step
RIGID_RATE = 1e9  # motion or force per drive beyond which the contacts leave no way to move
MAX_TOGETHER = 5  # contacts whose states are chosen together: three to this power are tried


def choose_friction(
    piece: PieceOfPath,  # with the contacts that are closed there, and what friction did before
    at: PathEquilibrium,  # in the unknowns of all contacts
    senses: tuple[float, ...],  # senses of the drive, the first that is possible is taken
    changed: int | None = None,  # contact that begins or ends there
    settled: int | None = None,  # contact that can only go on as the piece says
    turns: bool = False,  # whether the drive turns back: what slips is tried to stick first
) -> BeyondChange | None:
    """Return the first combination of states of friction that can go on from an equilibrium; None if none can."""
    numbers = piece.rubbing
    choices = [[piece.friction[k]] if k == settled else list(_list_continuations(piece, at, k, turns)) for k in numbers]
    several = [k for k, states in enumerate(choices) if len(states) > 1]
    for k in several[MAX_TOGETHER:]:
        del choices[k][1:]
    tried = []
    for states in itertools.product(*choices):
        beyond = replace(piece, friction=dict(zip(numbers, states, strict=True)))
        start = _find_loose_start(beyond, at)
        if start is not None:
            tried.append((beyond, start))
    for sense in senses:
        possible = [(beyond, start) for beyond, start in tried if _goes_on(beyond, start, sense, changed)]
        if possible:
            return BeyondChange(*possible[0], sense, len(possible))
    return None


def _find_loose_start(piece: PieceOfPath, at: PathEquilibrium) -> PathEquilibrium | None:
    """Return the start of a piece; None if there is none, or its contacts leave no way to move with the drive."""
    start = piece.solve_near(at)
    return start if start is not None and np.abs(start.rate).max(initial=0.0) < RIGID_RATE else None


def _list_continuations(piece: PieceOfPath, at: PathEquilibrium, number: int, turns: bool) -> Iterator[FrictionState]:
    """Yield the states in which the friction of a closed contact may go on, the likelier ones first."""
    contact, before = piece.whole.mesh.contacts[number], piece.friction.get(number, NO_FRICTION)
    z = piece.whole.values(at.x, at.drive)
    limit, rub = contact.item.friction * float(z[contact.unknown]), float(z[contact.rub])
    if before.sense == 0:
        yield before
        if abs(abs(rub) - limit) <= AT_LIMIT * limit:
            yield FrictionState(-float(np.sign(rub)))
    elif before.sense == NO_FRICTION.sense:
        yield piece.stick_at(at, number)
        if limit <= piece.estimate_force_rounding(at):
            yield from (FrictionState(1.0), FrictionState(-1.0))
    else:
        sticks = piece.stick_at(at, number)
        yield from (sticks, before) if turns else (before, sticks)


def _goes_on(piece: PieceOfPath, at: PathEquilibrium, sense: float, changed: int | None) -> bool:
    """Return True if no force, no gap and no way of slip of a contact at its limit goes the wrong way."""
    rates = list(_measure_margin_rates(piece, at, sense, changed))
    if any(rate < -UNDECIDED_RATE_RTOL for rate in rates):
        return False
    return all(rate > UNDECIDED_RATE_RTOL for rate in rates) or _can_step_on(piece, at, sense)


def _measure_margin_rates(
    piece: PieceOfPath, at: PathEquilibrium, sense: float, changed: int | None
) -> Iterator[float]:
    """Yield how the conditions change that are just met, each as a share of the largest rate."""
    mesh, z, moved = piece.whole.mesh, piece.whole.values(at.x, at.drive), sense * piece.measure_rates(at)
    largest, rounding = float(np.abs(moved).max()), piece.estimate_force_rounding(at)
    if changed is not None:
        yield sense * piece.measure_growth(at, changed) / largest
    for number, state in piece.friction.items():
        contact = mesh.contacts[number]
        if state.sense:
            yield sense * piece.measure_slip_rate(at, number) / largest
            continue
        limit, rub = contact.item.friction * float(z[contact.unknown]), float(z[contact.rub])
        if abs(rub) < (1 - AT_LIMIT) * limit - rounding:
            continue
        grown = float(moved[contact.rub])
        excess = abs(grown) if limit <= rounding else float(np.sign(rub)) * grown
        yield (contact.item.friction * float(moved[contact.unknown]) - excess) / largest


def _can_step_on(piece: PieceOfPath, at: PathEquilibrium, sense: float) -> bool:
    """Return True if all conditions are met a small step further on."""
    start, step = piece.shrink(at), sense * TRIAL_STEP_FRACTION * piece.options.span
    new = piece.own_problem.solve(start.x + step * start.rate, start.drive + step)
    if new is None:
        return False
    grown = piece.grow(new)
    roundings = piece.conditions.roundings(piece.values(grown.x[None], np.array([grown.drive])))
    return not piece.violates(grown, roundings, sense)


SAME_PLACE = 1e-11  # share of the range within which a change is at a point
MAX_CHANGES_AT_ONE_PLACE = 20
FIRST_ARC = 0.1  # of the step before, behind a limit point at a change
SHORTEST_STEP = 1e-6  # share of the range
BLOCKED_MESSAGE = "the drive is blocked by {names} at {{place}}"
SNAP_MESSAGE = "the drive cannot go on at {{place}}, where {names} {what}: a limit point; follow it by through_folds"
BUCKLES_AWAY = "stability is lost at {place}, where a part that an obstacle holds buckles away from it"
NO_FRICTION_STATE = "friction of {names} leaves no state that can go on at {{place}}: neither sticking nor slipping"
STABILITY_LOSS_MESSAGE = "stability is lost at {{place}}, where {names} {what}"


class EndOfPiece(NamedTuple):
    """Why a piece ends, where the walk is then, and the last point."""

    stop: PathStop
    walk: Walk
    at: PathEquilibrium


def follow_in_contact(
    problem: NetworkProblem,
    start: PathEquilibrium,
    targets: FloatArray,
    options: Options,
    branch: PathBranch | None = None,
) -> Iterator[PathItem]:
    """Yield what `follow_network` does, of a network with contacts."""
    closed = frozenset(
        number
        for number, contact in enumerate(problem.mesh.contacts)
        if contact.slide >= 0 or problem.values(start.x, start.drive)[contact.unknown] > FORCE_ROUNDING
    )
    part = PieceOfPath(problem, closed, options)
    if any(contact.rub >= 0 for contact in problem.mesh.contacts) and not problem.ramp:
        part = part.stick_all(start)  # constant loads have come on without friction
        start = part.grow(part.shrink(start))
    yield from limit_points(_follow_pieces(part, start, targets, branch), options.most_points)


def _find_turns(problem: NetworkProblem, start: float, targets: FloatArray) -> list[int]:
    """Return behind how many requested values the drive turns back, and how many there are; with friction only."""
    if not any(contact.rub >= 0 for contact in problem.mesh.contacts):
        return [len(targets)]
    ways = np.sign(np.diff(np.append(start, targets)))
    moving = np.flatnonzero(ways)
    turns = moving[1:][ways[moving[1:]] != ways[moving[:-1]]]
    return [*turns.tolist(), len(targets)]


def _follow_pieces(
    part: PieceOfPath, start: PathEquilibrium, targets: FloatArray, branch: PathBranch | None
) -> Iterator[PathItem]:
    """Yield the items of a path piece by piece, with the changes of contacts between."""
    options, turns = part.options, _find_turns(part.whole, start.drive, targets)
    first = targets[: turns[0]]
    items = follow(part.own_problem, part.shrink(start), first, options, branch)
    walk, count, place = Walk(part.own_problem, options, first, start, 0.0, branch=branch), 0, np.inf
    previous: PathEquilibrium | None = None
    while True:
        outcome = yield from _follow_to_change(part, items, walk, previous)
        if isinstance(outcome, EndOfPiece) and outcome.stop.end is WhyStopped.COMPLETE and turns[1:]:
            at, sense = outcome.at, float(np.sign(targets[turns[0]] - outcome.at.drive))
            chosen = choose_friction(part, at, (sense,), turns=True)
            if chosen is None:
                yield PathStop(WhyStopped.LOST, at.drive, NO_FRICTION_STATE.format(names=part.name_rubbing_contacts()))
                return
            yield from _change_friction(chosen, part.friction, at)
            step = options.first_step * options.span
            walk = outcome.walk._replace(targets=targets[: turns[1]], number=turns[0], step=step)
            part, previous, turns = chosen.piece, chosen.at, turns[1:]
            items, count = _follow_next_piece(part, walk, chosen.at, sense), 0
            continue
        if isinstance(outcome, EndOfPiece):
            yield outcome.stop
            return
        walk, change, sense = outcome
        is_same_place = abs(change.at.drive - place) <= SAME_PLACE * options.span
        count, place = (count + 1 if is_same_place else 0), change.at.drive
        if count > MAX_CHANGES_AT_ONE_PLACE:
            yield PathStop(WhyStopped.LOST, place, "contacts begin and end without end at {place}")
            return
        mesh = (change.piece or part).whole.mesh
        after = _enter(part, change, sense)
        if isinstance(after, PathStop):
            yield change._replace(kind="blocks") if after.end is WhyStopped.BLOCKED else change
            yield after
            return
        changed, before = change.piece or part, part.friction
        turned, part, at, sense = after.sense != sense, after.piece, after.at, after.sense
        yield change._replace(after=at.unstable, states=after.n_states)
        yield from _change_friction(after._replace(n_states=1), before, at, change.number)
        if part.whole.mesh is not mesh:
            yield Remeshed(part.whole)
        if turned and not options.through_folds:
            yield _stop_at_change(WhyStopped.LIMIT_POINT, SNAP_MESSAGE, changed, change)
            return
        if at.unstable > change.before and options.branch != "primary" and not options.through_folds:
            yield _stop_at_change(WhyStopped.JUMPS, STABILITY_LOSS_MESSAGE, changed, change)
            return
        if turned:
            yield PathEvent("limit point", place, change.before, at.unstable, at)
        walk = yield from _deliver_before(part, walk, place, at)
        items, previous = (
            iter([PathStop(WhyStopped.COMPLETE, place)]) if walk.done else _follow_next_piece(part, walk, at, sense),
            at,
        )


def _stop_at_change(end: WhyStopped, message: str, changed: PieceOfPath, change: ContactChange) -> PathStop:
    """Return the end of a path at a change of a contact."""
    text = message.format(names=changed.name_contact(change.number), what=change.kind)
    return PathStop(end, change.at.drive, text)


def _change_friction(
    chosen: BeyondChange, before: Mapping[int, FrictionState], at: PathEquilibrium, changed: int | None = None
) -> Iterator[ContactChange]:
    """Yield what begins to stick or to slip where the drive turns, or with the contact that is changed."""
    for number, state in chosen.piece.friction.items():
        if number in before and number != changed and before[number].sense != state.sense:
            contact = chosen.piece.whole.mesh.contacts[number].number
            kind: Literal["slips", "sticks"] = "slips" if state.sense else "sticks"
            yield ContactChange(kind, number, at, at.unstable, chosen.at.unstable, contact, states=chosen.n_states)


def _deliver_before(part: PieceOfPath, walk: Walk, place: float, at: PathEquilibrium) -> Generator[Point, None, Walk]:
    """Yield what is requested between a change and the first place of a contact that moves or parts."""
    low, high = sorted((place, at.drive))
    while not walk.done and low != high and low <= walk.targets[walk.number] <= high:
        reached = part.own_problem.solve(part.shrink(at).x, float(walk.targets[walk.number]))
        if reached is None:
            break
        yield Point(part.grow(reached), walk.number, walk.branch)
        walk = walk._replace(number=walk.number + 1)
    return walk


def _follow_next_piece(
    part: PieceOfPath, walk: Walk, at: PathEquilibrium, sense: float
) -> Iterator[Point | PathEvent | PathStop]:
    """Yield the items of the next piece: by the drive, or by the arc length where it leads away from the next value."""
    problem, options = part.own_problem, walk.options
    start, step = part.shrink(at), max(walk.step, SHORTEST_STEP * options.span)
    walk = Walk(problem, options, walk.targets, start, step, walk.number, trail=(start,), branch=walk.branch)
    if sense == walk.sense:
        yield from each_point(follow_on(walk))
        return
    tangent = unit_tangent(problem, start, sense * np.append(start.rate, 1.0), options.span)
    length = float(FIRST_ARC * step / max(abs(tangent[-1]), SHORTEST_STEP))
    move = next(follow_arc(problem, start, tangent, min(length, options.largest_motion), options), None)
    if move is None:
        yield PathStop(WhyStopped.LOST, start.drive, "no step converged at {place}")
        return
    outcome = yield from pass_fold(walk, move)
    if isinstance(outcome, Walk):
        yield from each_point(follow_on(outcome))
    elif outcome is not None:
        yield outcome


def _follow_to_change(
    part: PieceOfPath, items: Iterator[Point | PathEvent | PathStop], walk: Walk, previous: PathEquilibrium | None
) -> Generator[Point | PathEvent | ContactChange | Remeshed, None, EndOfPiece | tuple[Walk, ContactChange, float]]:
    """Yield the items of a piece up to a change; return the walk there, the change and the sense of travel.

    `previous` is where the piece begins if that was yielded before.
    """
    waiting: list[PathEvent] = []
    mesh, last = part.whole.mesh, None
    for item in items:
        if isinstance(item, PathEvent):
            waiting.append(part.grow_event(item))
            continue
        if isinstance(item, PathStop):
            change = find_change_before_end(part, previous, item)
            if change is None:
                yield from waiting
                return EndOfPiece(item, _pass_point(walk, last), previous or walk.current)
            at, step = None, item.drive
        else:
            (at, is_quiet), step = part.own_problem.grow_watched(item.at), item.at.drive
            change = None if is_quiet or previous is None else find_change(part, previous, at)
        if change is not None:
            assert previous is not None
            walk = _pass_point(walk, last)
            if isinstance(change, PathStop):
                lost = next((event for event in waiting if event.after > event.before), None)
                if lost is None:
                    return EndOfPiece(change, walk, previous)
                yield from waiting  # the way on from there goes through an obstacle
                return EndOfPiece(PathStop(WhyStopped.JUMPS, lost.drive, BUCKLES_AWAY), walk, previous)
            sense = 1.0 if step >= previous.drive else -1.0
            place = change.at.drive
            yield from (event for event in waiting if (place - event.drive) * sense > 0)
            walk = walk._replace(step=abs(step - previous.drive))
            tied = SAME_PLACE * walk.options.span
            beside = abs(place - previous.drive) <= tied and change.piece is None
            if change.piece is not None and change.piece.whole.mesh is not mesh:
                yield Remeshed(change.piece.whole)
            if not walk.done and abs(walk.targets[walk.number] - place) <= tied and not beside:
                yield Point(change.at, walk.number, walk.branch)
                walk = walk._replace(number=walk.number + 1)
            elif not beside:
                yield Point(change.at, -1, walk.branch)
            return walk, change, sense
        yield from waiting
        waiting = []
        assert isinstance(item, Point)
        assert at is not None
        yield Point(at, item.target, item.branch)
        if previous is not None and part.is_locked(previous, at):
            stop = PathStop(WhyStopped.LIMIT_POINT, at.drive, LOCKED_MESSAGE)
            return EndOfPiece(stop, _pass_point(walk, last), at)
        last = item if item.target >= 0 or last is None else item._replace(target=last.target)
        previous = at
    walk = _pass_point(walk, last)
    return EndOfPiece(PathStop(WhyStopped.LOST, walk.current.drive, "no step converged at {place}"), walk, walk.current)


def _pass_point(walk: Walk, point: Point | None) -> Walk:
    """Return the walk behind a point, whose target is the last that was reached."""
    if point is None:
        return walk
    number = point.target + 1 if point.target >= 0 else walk.number
    return walk._replace(number=number, branch=point.branch)


def _enter(part: PieceOfPath, change: ContactChange, sense: float) -> PathStop | BeyondChange:
    """Return the piece behind a change, its start, and the sense of the drive there."""
    number, contacts = change.number, part.whole.mesh.contacts
    if change.condition is not None or contacts[number].slide >= 0:
        return enter_side_change(part, change, sense)
    if change.kind in ("slips", "sticks"):
        state = part.stick_at(change.at, number)
        if change.kind == "slips":  # against the tangential force
            state = FrictionState(
                -float(np.sign(part.whole.values(change.at.x, change.at.drive)[contacts[number].rub]))
            )
        settled = replace(part, friction={**part.friction, number: state})
        return _enter_friction(settled, change, sense, None)
    begins = change.kind == "begins"
    beyond = part.with_closed(part.closed | {number} if begins else part.closed - {number})
    if not part.whole.ramp and beyond.rubbing:
        return _enter_friction(beyond, change, sense, number)
    at, place = _find_loose_start(beyond, change.at), change.at.drive
    if at is None and begins:
        return PathStop(WhyStopped.BLOCKED, place, BLOCKED_MESSAGE.format(names=beyond.name_contacts(number)))
    if at is None:
        message = STABILITY_LOSS_MESSAGE.format(names=beyond.name_contact(number), what="ends")
        return PathStop(WhyStopped.JUMPS, place, message)
    return BeyondChange(beyond, at, -sense if beyond.measure_growth(at, number) * sense < 0 else sense)


def _enter_friction(
    beyond: PieceOfPath, change: ContactChange, sense: float, changed: int | None
) -> PathStop | BeyondChange:
    """Return the piece behind a change, its start and the sense of the drive where a closed contact has friction."""
    settled = change.number if changed is None else None
    chosen = choose_friction(beyond, change.at, (sense, -sense), changed, settled)
    if chosen is not None:
        return chosen
    if _find_loose_start(beyond.stick_all(change.at), change.at) is None:
        message = BLOCKED_MESSAGE.format(names=beyond.name_contacts(change.number))
        return PathStop(WhyStopped.BLOCKED, change.at.drive, message)
    return PathStop(WhyStopped.LOST, change.at.drive, NO_FRICTION_STATE.format(names=beyond.name_rubbing_contacts()))
