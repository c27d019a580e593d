"""Paths of the functional at the requested points, as far as a path simply goes on."""

from __future__ import annotations

from typing import Any

import numpy as np
from equilibria import equilibria

from cfmkit.elastica.results.path import EquilibriumPath, PathStatus


def beam_stress(path: EquilibriumPath, beam: str, axial: bool = True) -> Any:
    """Return the largest stress of a beam at every point [Pa] and its place (share of the length), (2, n)."""
    return np.array(path.beam_stresses(axial))[:, list(path.network.beams).index(beam)]


def functional_path(net: Any, drive: Any, degree: int = 18, pieces: int = 1) -> EquilibriumPath:
    """Return the path of a network at the points of a drive."""
    at, _ = equilibria(net, drive, degree, pieces)
    count = len(at.z)
    numbers, stable = np.arange(count), np.zeros(count, int)
    branch, accurate = np.array(["primary"] * count), np.ones(count, bool)
    return EquilibriumPath(net, drive, at, stable, numbers, branch, PathStatus.COMPLETE, "", (), 0.0, accurate)
