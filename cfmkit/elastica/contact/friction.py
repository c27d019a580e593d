"""States of Coulomb friction behind a change of a contact, and where the drive turns back.

Forces are continuous along a path. So a contact that slips may only go on to slip or begin to stick, one that sticks
may slip where its tangential force is as large as friction allows, against that force, and one that just touches may do
anything. Of all combinations those are possible whose gaps, forces and ways of slip go on as they must: their rates
say so. Which are possible is not unique where friction is large.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.elastica.contact.equations import NO_FRICTION
from cfmkit.elastica.contact.terms import slip_way
from cfmkit.elastica.model.contact import FrictionState

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.elastica.contact.changes import PieceOfPath
    from cfmkit.numerics.continuation.problem import PathEquilibrium

AT_LIMIT = 1e-7  # share of the friction by which the tangential force may miss its limit where slip may begin
UNDECIDED_RATE_RTOL = (
    1e-6  # share of the largest rate below which a rate does not say how a condition goes on: a step does
)
TRIAL_STEP_FRACTION = 1e-4  # of the range: that step
RIGID_RATE = 1e9  # motion or force per drive beyond which the contacts leave no way to move
MAX_TOGETHER = 5  # contacts whose states are chosen together: three to this power are tried


class ChosenState(NamedTuple):
    """A piece whose friction can go on, its start, the sense of the drive, and how many choices can go on that way."""

    piece: PieceOfPath
    at: PathEquilibrium
    sense: float
    n_states: int


def choose_friction(
    piece: PieceOfPath,  # with the contacts that are closed there, and what friction did before
    at: PathEquilibrium,  # in the unknowns of all contacts
    senses: tuple[float, ...],  # senses of the drive, the first that is possible is taken
    changed: int | None = None,  # contact that begins or ends there
    settled: int | None = None,  # contact that can only go on as the piece says
    turns: bool = False,  # whether the drive turns back: what slips is tried to stick first
) -> ChosenState | None:
    """Return the first combination of states of friction that can go on from an equilibrium; None if none can."""
    numbers = [k for k in sorted(piece.closed) if piece.whole.mesh.contacts[k].rub >= 0]
    choices = [[piece.friction[k]] if k == settled else list(_continuations(piece, at, k, turns)) for k in numbers]
    several = [k for k, states in enumerate(choices) if len(states) > 1]
    for k in several[MAX_TOGETHER:]:
        del choices[k][1:]
    tried = []
    for states in itertools.product(*choices):
        beyond = replace(piece, friction=dict(zip(numbers, states, strict=True)))
        near = beyond.shrink(at)
        start = beyond.own.solve(near.x, near.drive)
        if start is None or not np.abs(start.rate).max(initial=0.0) < RIGID_RATE:
            continue
        tried.append((beyond, beyond.grow(start)))
    for sense in senses:
        possible = [(beyond, start) for beyond, start in tried if _goes_on(beyond, start, sense, changed)]
        if possible:
            return ChosenState(*possible[0], sense, len(possible))
    return None


def is_jammed(piece: PieceOfPath, at: PathEquilibrium) -> bool:
    """Return True if nothing can move with the drive where all contacts with friction stick."""
    mesh, z = piece.whole.mesh, piece.whole.values(at.x, at.drive)
    rubbing = [number for number in piece.closed if mesh.contacts[number].rub >= 0]
    stuck = {k: FrictionState(0.0, float(slip_way(mesh, mesh.contacts[k], z).value)) for k in rubbing}
    beyond = replace(piece, friction=stuck)
    near = beyond.shrink(at)
    start = beyond.own.solve(near.x, near.drive)
    return start is None or not np.abs(start.rate).max(initial=0.0) < RIGID_RATE


def _continuations(piece: PieceOfPath, at: PathEquilibrium, number: int, turns: bool) -> Iterator[FrictionState]:
    """Yield the states in which the friction of a closed contact may go on, the likelier ones first."""
    mesh, z = piece.whole.mesh, piece.whole.values(at.x, at.drive)
    contact, before = mesh.contacts[number], piece.friction.get(number, NO_FRICTION)
    limit, rub = contact.item.friction * float(z[contact.unknown]), float(z[contact.rub])
    if before.sense == 0:
        yield before
        if abs(abs(rub) - limit) <= AT_LIMIT * limit:
            yield FrictionState(-float(np.sign(rub)))
        return
    sticks = FrictionState(0.0, float(slip_way(mesh, contact, z).value))
    if before.sense == NO_FRICTION.sense:
        yield sticks
        if limit <= piece.roundings_of_force(at):
            yield FrictionState(1.0)
            yield FrictionState(-1.0)
        return
    yield from (sticks, before) if turns else (before, sticks)


def _goes_on(piece: PieceOfPath, at: PathEquilibrium, sense: float, changed: int | None) -> bool:
    """Return True if no force, no gap and no way of slip of a contact at its limit goes the wrong way."""
    rates = list(_margin_rates(piece, at, sense, changed))
    if any(rate < -UNDECIDED_RATE_RTOL for rate in rates):
        return False
    return all(rate > UNDECIDED_RATE_RTOL for rate in rates) or _steps_on(piece, at, sense)


def _margin_rates(piece: PieceOfPath, at: PathEquilibrium, sense: float, changed: int | None) -> Iterator[float]:
    """Yield how the conditions change that are just met, each as a share of the largest rate."""
    mesh, z, moved = piece.whole.mesh, piece.whole.values(at.x, at.drive), sense * piece.moved_by_drive(at)
    largest, rounding = float(np.abs(moved).max()), piece.roundings_of_force(at)
    if changed is not None:
        yield sense * piece.grows_along(at, changed) / largest
    for number, state in piece.friction.items():
        contact = mesh.contacts[number]
        if state.sense:
            yield sense * piece.slip_rate(at, number) / largest
            continue
        limit, rub = contact.item.friction * float(z[contact.unknown]), float(z[contact.rub])
        if abs(rub) < (1 - AT_LIMIT) * limit - rounding:
            continue
        grown = float(moved[contact.rub])
        excess = abs(grown) if limit <= rounding else float(np.sign(rub)) * grown
        yield (contact.item.friction * float(moved[contact.unknown]) - excess) / largest


def _steps_on(piece: PieceOfPath, at: PathEquilibrium, sense: float) -> bool:
    """Return True if all conditions are met a small step further on."""
    start, step = piece.shrink(at), sense * TRIAL_STEP_FRACTION * piece.options.span
    new = piece.own.solve(start.x + step * start.rate, start.drive + step)
    if new is None:
        return False
    grown = piece.grow(new)
    values = piece.values(grown.x[None], np.array([grown.drive]))
    for row in piece.slipping_rows:
        values[row] = piece.row_value(grown, row, sense)
    return bool((values[:, 0] >= -piece.roundings(values)).all())
