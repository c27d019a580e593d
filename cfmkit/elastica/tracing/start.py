"""The equilibrium that a drive begins at: at rest, or under what is constant, which is applied by shares of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.discretise import without_floor
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.numerics.continuation.correct import correct
from cfmkit.numerics.continuation.follow import follow
from cfmkit.numerics.continuation.path import End, Ending, Event, Options, Point

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.drive import Control
    from cfmkit.numerics.continuation.problem import Equilibrium

FIRST_SHARE = 0.5  # of what is constant, in the first step
FLOOR_SHARE = 0.01
"""Part of the flexibility along a straight beam that its floor may bear: where it bears less, it is taken away."""
FLOOR_STRAIN = 1e-7  # of a beam that does not stretch, from which on the drive stretches it


class Start(NamedTuple):
    """Where a path begins."""

    problem: NetworkProblem  # along the drive
    at: Equilibrium | None  # None: nothing to begin at
    ramp: NetworkProblem  # along the share of what is constant
    events: tuple[Event, ...]  # on the way, at shares
    ending: Ending | None  # of the way, unless it is complete


def find_start(network: Discretisation, control: Control) -> Start:
    """Return the equilibrium under what is constant, on a stable branch if there is one."""
    problem, ramp = NetworkProblem(network), NetworkProblem(network, ramp=True)
    rest = correct(problem if not problem.loaded else ramp, np.zeros(len(network.free)), 0.0)
    if rest is None:
        return Start(problem, None, ramp, (), None)
    if not problem.loaded:
        return Start(*_remove_floors(problem, rest), ramp, (), None)
    options = Options(1.0, control.branch, control.sign, largest_motion=control.largest_turn, first_step=FIRST_SHARE)
    events: list[Event] = []
    last, ending = rest, None
    for item in follow(ramp, rest, np.ones(1), options):
        if isinstance(item, Event):
            events.append(item)
        elif isinstance(item, Point):
            last = item.at
        else:
            ending = item
    assert ending is not None
    if ending.end is not End.COMPLETE:
        return Start(problem, None, ramp, tuple(events), ending)
    at = correct(problem, last.x, 0.0)
    return Start(*(_remove_floors(problem, at) if at else (problem, None)), ramp, tuple(events), None)


def _remove_floors(problem: NetworkProblem, at: Equilibrium) -> tuple[NetworkProblem, Equilibrium | None]:
    """Return the problem without the floors of flexibility that bear nothing, and its equilibrium.

    Left in, nearly rigid networks of thin straight beams have errors of 1e-5 and more.
    """
    network = problem.network
    elements = np.flatnonzero(network.floored)
    if not elements.size:
        return problem, at
    slot = np.full(network.size, -1)
    slot[network.free] = np.arange(len(network.free))
    rows = slot[network.elements.unknowns[elements, -2:]]
    unit = np.zeros((len(network.free), rows.size))
    unit[rows.ravel(), np.arange(rows.size)] = 1.0
    inverse = problem.linearise(at.x, at.drive).solve(unit)
    if inverse is None:
        return problem, at
    share = np.abs(inverse[rows.ravel(), np.arange(rows.size)]).reshape(rows.shape).max(axis=1)
    share *= network.elements.axial[elements].max(axis=1) * network.elements.length[elements]
    needless = elements[share < FLOOR_SHARE]
    if not needless.size:
        return problem, at
    stiff = replace(problem, network=without_floor(network, needless))
    return stiff, correct(stiff, at.x, at.drive)


def is_stretched(network: Discretisation, z: np.ndarray) -> bool:
    """Return True if a beam that does not stretch was stretched through its floor at any of k states, (k, size)."""
    elements = np.flatnonzero(network.floored)
    if not elements.size or not len(z):
        return False
    force = np.abs(z[:, network.elements.unknowns[elements][:, -2:]]).max(axis=(0, 2))
    return bool((force * network.elements.axial[elements].max(axis=1) > FLOOR_STRAIN).any())
