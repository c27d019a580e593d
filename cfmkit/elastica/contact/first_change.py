"""First change of a contact within a step of a path: the first condition that becomes negative, located.

Along a piece of a path the same contacts are closed. It ends where a gap becomes zero (a contact begins), a contact
force becomes zero (it ends), or friction is exceeded or holds again (it slips or sticks). Each of these is a condition,
dimensionless and positive before its change. The first root of all on the way to the next equilibrium is searched for,
also where a condition dips below zero in between.
"""

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
    from cfmkit.elastica.contact.piece import PieceOfPath
    from cfmkit.elastica.model.contact import BeamSide
    from cfmkit.numerics.continuation.problem import PathEquilibrium

CHANGE_OF_KIND: dict[str, Literal["begins", "ends", "slips", "sticks"]] = {
    "gap": "begins", "force": "ends", "grip": "slips", "slip": "sticks",
}  # fmt: skip
NOT_LOCATED = "where {names} {what} was not found near {{place}}"


def find_change_before_end(
    piece: PieceOfPath, previous: PathEquilibrium | None, stop: PathStop
) -> ContactChange | PathStop | None:
    """Return the first change between the last point and the end of a piece that ends early; None without any."""
    if previous is None or stop.end in (WhyStopped.COMPLETE, WhyStopped.FULL) or stop.drive == previous.drive:
        return None
    start = piece.shrink(previous)
    last = correct(piece.own_problem, start.x + (stop.drive - start.drive) * start.rate, stop.drive)
    if last is None or largest_motion(piece.own_problem, last.x - start.x) > piece.options.largest_motion:
        return None
    return find_change(piece, previous, piece.grow(last))


def find_change(piece: PieceOfPath, first: PathEquilibrium, last: PathEquilibrium) -> ContactChange | PathStop | None:
    """Return the first change of a contact between two points of a piece; None if there is none."""
    step = StepBetween(piece, first, last)
    dips = (step.values < -step.roundings[:, None])[:, 1:]
    if not dips.any():
        return None
    if not dips[:, -1].any():  # only the guess says so: see whether the equilibrium does
        at = step.solve(float(step.shares[1:][dips.any(axis=0).argmax()]))
        return None if at is None else _find_change_at_end(piece, first, piece.grow(at), step.roundings)
    rows = np.flatnonzero(dips.any(axis=1)).tolist()
    beside = [row for row in rows if _is_beside_change(piece, row, rows)]
    located = {row: _locate(piece, step, row) for row in rows if row not in beside}
    changes = [change for change in located.values() if isinstance(change, ContactChange)]
    # a contact that parts, or moves, brings the side beside it into the obstacle: nothing else touches by that
    for row in beside:
        values_there = [piece.measure_condition(change.at, row) for change in changes if change.piece is None]
        if not changes or min(values_there, default=0.0) < -step.roundings[row]:
            located[row] = _locate(piece, step, row)
    changes = [change for change in located.values() if isinstance(change, ContactChange)]
    if not changes:
        missing = next(iter(located))
        what, names = ("ends" if missing in piece.closed else "begins"), piece.name_contact(missing)
        lost = PathStop(WhyStopped.LOST, first.drive, NOT_LOCATED.format(names=names, what=what))
        return next((stop for stop in located.values() if isinstance(stop, PathStop)), lost)
    return min(changes, key=lambda change: step.find_share(change.at, change.piece))


def _is_beside_change(piece: PieceOfPath, row: int, rows: list[int]) -> bool:
    """Return True if a row is a side that touches where another of its contacts changes, too."""
    conditions = piece.conditions.all
    others = (conditions[k] for k in rows if k != row and conditions[k].kind not in ("gap", "force", "grip", "slip"))
    return conditions[row].kind == "touch" and any(_touch_alike(c.item, conditions[row].item) for c in others)


def _touch_alike(item: BeamSide, neighbour: BeamSide) -> bool:
    """Return True if two contacts are the same, or of the same two parts of the mechanism."""
    return item is neighbour or (not isinstance(item, BeamOnObstacle) and item.name == neighbour.name)


def _find_change_at_end(
    piece: PieceOfPath, first: PathEquilibrium, last: PathEquilibrium, rounding: FloatArray
) -> ContactChange | PathStop | None:
    """Return the first change up to a point that may violate a condition; None if it does not."""
    return find_change(piece, first, last) if piece.violates(last, rounding, last.drive - first.drive) else None


def _locate(piece: PieceOfPath, step: StepBetween, row: int) -> ContactChange | PathStop | None:
    """Return where a contact changes within a step: where its gap and its force are both zero."""
    kind, number, _, _, _ = piece.conditions.all[row]
    if kind not in CHANGE_OF_KIND:
        return locate_side_change(piece, step, row)
    at = _solve_change(piece, step, row) if kind in ("gap", "force") else None
    if at is None and (kind in ("grip", "slip") or step.crossing(row) is not None):
        at = step.bisect(row)
    unstable, contact = step.first.unstable, piece.whole.mesh.contacts[number].number
    return None if at is None else ContactChange(CHANGE_OF_KIND[kind], number, at, unstable, unstable, contact)


def _solve_change(piece: PieceOfPath, step: StepBetween, row: int) -> PathEquilibrium | None:
    """Return where gap and force of a contact are both zero, by these two equations."""
    share = step.crossing(row)
    if share is None:
        return None
    guess, both = step.guess(share), piece.with_closed(piece.closed | {row})
    state = both.solve_at_level(guess, {both.find_own_slot(row): 1.0}, 0.0)
    if state is None:
        return None
    free = both.expand_state(state.x)
    free[piece.slot(row)] = 0.0
    at = step.first._replace(x=free, drive=state.drive, effort=np.nan, stiffness=np.nan)
    return at if step.contains(at, guess.x) else None
