"""Paths of the functional at the requested points, as far as a path simply goes on."""

from __future__ import annotations

from typing import Any

import numpy as np

from cfmkit.elastica import Control
from cfmkit.elastica.results.path import EquilibriumPath, PathStatus
from cfmkit.elastica.tracing.trace import DegreeAndPieces, trace_on


def beam_stress(path: EquilibriumPath, beam: str, axial: bool = True) -> Any:
    """Return the largest stress of a beam at every point [Pa] and its place (share of the length), (2, n)."""
    return np.array(path.beam_stresses(axial))[:, list(path.network.beams).index(beam)]


def functional_path(net: Any, drive: Any, degree: int = 18, pieces: int = 1) -> EquilibriumPath:
    """Return the path of a network with one degree, at the points of a drive."""
    path = trace_on(net, drive, Control(tolerance=1e-10), DegreeAndPieces(degree, pieces)).path
    assert path.status is PathStatus.COMPLETE
    return path.take(path.at_requested)
