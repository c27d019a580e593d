"""Equilibria of a network by `cfmkit.elastica.mechanics` alone, as far as its path simply goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.discretise import Discretisation, discretise
from cfmkit.elastica.mechanics.equations import MarchCode, MarchPlan, begin
from cfmkit.elastica.mechanics.march import equations

if TYPE_CHECKING:
    from cfmkit.numerics.continuation import PathEquilibrium


def states(network: Discretisation, goals: Any) -> list[PathEquilibrium]:
    """Return the states at dimensionless values of the drive; what is constant is applied first."""
    ramp, own = equations(network, True), equations(network)
    first = begin(ramp)
    assert first is not None
    loaded = ramp.march(first, np.array([1.0]), MarchPlan(0.25, 1.0))
    assert loaded.code is MarchCode.DONE
    start = begin(own, loaded.states[-1].x)
    assert start is not None
    march = own.march(start, np.asarray(goals, float), MarchPlan(0.2 * abs(goals[-1]), abs(goals[-1]), tolerance=1e-12))
    assert march.code is MarchCode.DONE
    found = [state for state, target in zip(march.states, march.target, strict=True) if target >= 0]
    return [own.solve(state.x, state.drive) or state for state in found]


def equilibria(net: Any, drive: Any, degree: int = 16, pieces: int = 1) -> tuple[Equilibria, Any]:
    """Return the equilibria at the points of a drive, and their slopes (p, n)."""
    network = discretise(net, drive, degree, pieces)
    found = states(network, drive.points / network.scales.drive)
    own = equations(network)
    z = np.array([own.values(state.x, state.drive) for state in found])
    at = Equilibria(network, z, np.array([state.drive for state in found]))
    return at, np.array([state.rate for state in found])
