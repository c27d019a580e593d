"""The first change of a contact between two points of a piece of a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.elastica.contact.path_items import ContactChange
from cfmkit.elastica.contact.side_changes import locate_side_change
from cfmkit.elastica.contact.step_between import StepBetween
from cfmkit.elastica.model.contact import BeamOnObstacle
from cfmkit.numerics.continuation.path import PathStop, WhyStopped
from cfmkit.numerics.continuation.problem import largest_motion
from cfmkit.numerics.continuation.steps import correct

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.changes import PieceOfPath
    from cfmkit.elastica.model.contact import BeamSide
    from cfmkit.numerics.continuation.problem import PathEquilibrium

NOT_LOCATED = "where {names} {what} was not found near {{place}}"


def find_change_before_end(
    piece: PieceOfPath, previous: PathEquilibrium | None, stop: PathStop
) -> ContactChange | PathStop | None:
    """Return the first change between the last point and the end of a piece that ends early; None without any."""
    if previous is None or stop.end in (WhyStopped.COMPLETE, WhyStopped.FULL) or stop.drive == previous.drive:
        return None
    start = piece.shrink(previous)
    last = correct(piece.own, start.x + (stop.drive - start.drive) * start.rate, stop.drive)
    if last is None or largest_motion(piece.own, last.x - start.x) > piece.options.largest_motion:
        return None
    return find_change(piece, previous, piece.grow(last))


def find_change(piece: PieceOfPath, first: PathEquilibrium, last: PathEquilibrium) -> ContactChange | PathStop | None:
    """Return the first change of a contact between two points of a piece; None if there is none."""
    step = StepBetween(piece, first, last)
    if step.is_far:
        return None
    values = step.values
    rounding = piece.roundings(values)
    dips = (values < -rounding[:, None])[:, 1:]
    if not dips.any():
        return None
    if not dips[:, -1].any():  # only the guess says so: see whether the equilibrium does
        at = step.solve(float(step.shares[1:][dips.any(axis=0).argmax()]))
        return None if at is None else _find_change_at_end(piece, first, piece.grow(at), rounding)
    rows = np.flatnonzero(dips.any(axis=1)).tolist()
    beside = [row for row in rows if _is_beside_change(piece, row, rows)]
    located = {row: _locate(piece, step, row) for row in rows if row not in beside}
    changes = [change for change in located.values() if isinstance(change, ContactChange)]
    # a contact that parts, or moves, brings the side beside it into the obstacle: nothing else touches by that
    for row in beside:
        values_there = [piece.row_value(change.at, row) for change in changes if change.piece is None]
        if not changes or min(values_there, default=0.0) < -rounding[row]:
            located[row] = _locate(piece, step, row)
    changes = [change for change in located.values() if isinstance(change, ContactChange)]
    if not changes:
        missing = next(iter(located))
        what, names = ("ends" if missing in piece.closed else "begins"), piece.say(missing)
        lost = PathStop(WhyStopped.LOST, first.drive, NOT_LOCATED.format(names=names, what=what))
        return next((stop for stop in located.values() if isinstance(stop, PathStop)), lost)

    return min(changes, key=lambda change: step.share_of(change.at, change.piece))


def _is_beside_change(piece: PieceOfPath, row: int, rows: list[int]) -> bool:
    """Return True if a row is a side that touches where another of its contacts changes, too."""
    count = len(piece.whole.mesh.contacts)
    rubs = row - count >= len(piece.sides.all)
    if row < count or rubs or piece.sides.all[row - count].kind != "touch":
        return False
    item = piece.sides.all[row - count].item
    sides = [k for k in rows if count <= k < count + len(piece.sides.all)]
    return any(k != row and _touch_alike(piece.sides.all[k - count].item, item) for k in sides)


def _touch_alike(item: BeamSide, neighbour: BeamSide) -> bool:
    """Return True if two contacts are one, or of the same parts of the mechanism."""
    return item is neighbour or (not isinstance(item, BeamOnObstacle) and item.name == neighbour.name)


def _find_change_at_end(
    piece: PieceOfPath, first: PathEquilibrium, last: PathEquilibrium, rounding: FloatArray
) -> ContactChange | PathStop | None:
    """Return the first change up to a point that may violate a condition; None if it does not."""
    values = piece.values(last.x[None], np.array([last.drive]))[:, 0]
    travel = StepBetween(piece, first, last).travel
    values[list(piece.slipping_rows)] = [piece.row_value(last, row, travel) for row in piece.slipping_rows]
    return find_change(piece, first, last) if (values < -rounding).any() else None


def _locate(piece: PieceOfPath, step: StepBetween, row: int) -> ContactChange | PathStop | None:
    """Return where a contact changes within a step: where its gap and its force are both zero."""
    first_rub = len(piece.whole.mesh.contacts) + len(piece.sides.all)
    if row >= first_rub:
        number, at = piece.rubbing[row - first_rub], step.bisect(row)
        if at is None:
            return None
        what: Literal["slips", "sticks"] = "sticks" if row in piece.slipping_rows else "slips"
        return ContactChange(
            what, number, at, step.first.unstable, step.first.unstable, piece.whole.mesh.contacts[number].number
        )
    if row >= len(piece.whole.mesh.contacts):
        return locate_side_change(piece, step, row)
    contact, unstable = piece.whole.mesh.contacts[row].number, step.first.unstable
    share = step.crossing(row)
    if share is None:
        return None
    guess, drive = step.interpolate(share)
    kind: Literal["begins", "ends"] = "ends" if row in piece.closed else "begins"
    both = piece.with_closed(piece.closed | {row})
    x = guess[both.own_mask]
    border = np.zeros(len(x) + 1)
    border[int(both.own_mask[: piece.slot(row)].sum())] = 1.0
    state = both.own.equations.solve(x, drive, border, 0.0)
    if state is not None and np.isfinite(state.rate).all():
        free = both.expand_state(state.x)
        free[piece.slot(row)] = 0.0
        at = step.first._replace(x=free, drive=state.drive, effort=np.nan, stiffness=np.nan)
        if step.contains(at, guess):
            return ContactChange(kind, row, at, unstable, unstable, contact)
    bracketed = step.bisect(row)
    return None if bracketed is None else ContactChange(kind, row, bracketed, unstable, unstable, contact)
