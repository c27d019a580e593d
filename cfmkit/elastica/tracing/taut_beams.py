"""Beams of a path that are taut: where their ends need elements of their own, and where they are pulled straight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.mechanics.element_cuts import TAUT_RATIO
from cfmkit.elastica.results.path import Path, PathStatus

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray

MORE_TENSION = 1.5  # times what is known, from which on layers are cut anew
MAX_TENSION = 1e4  # L sqrt(N/EI) of a beam beyond which it is pulled straight: it locks
RECUT_SHARE = 0.15  # share of a beam from which on a taut element is cut again


def find_tension(path: Path, known: Mapping[str, float]) -> dict[str, float]:
    """Return the beams whose elements are taut to their largest L sqrt(N/EI), if more than is known."""
    e, found = path.mesh.elements, dict[str, float]()
    if not len(path):
        return {}
    whole = _tautness(path)
    if not whole.max() > TAUT_RATIO:
        return {}
    resolved = np.where(whole < MAX_TENSION, whole, 0.0).max(axis=0)
    for number, (beam, (left, right)) in enumerate(zip(e.beam, e.cuts, strict=True)):
        if right - left > RECUT_SHARE and resolved[number] * (right - left) > TAUT_RATIO:
            found[beam] = max(found.get(beam, 0.0), float(resolved[number]))
    return {beam: value for beam, value in found.items() if MORE_TENSION * known.get(beam, 0.0) < value}


def _tautness(path: Path) -> FloatArray:
    """Return L sqrt(N/EI) at every point with the length of an element's beam, (n, e)."""
    e = path.mesh.elements
    force = np.abs(path.at.z[:, e.unknowns[:, -2:]]).max(axis=2)
    bending = (e.rigidity * e.weight).sum(axis=-1) * e.length
    row = path.mesh.numbering.row
    return np.asarray(np.sqrt(force / bending) * np.bincount(row, e.length.reshape(-1, len(row))[0])[row])


def drop_locked_points(path: Path) -> Path:
    """Return a path that ends early up to where a beam that does not stretch is pulled straight: there forces soar."""
    if path.status is PathStatus.COMPLETE or not len(path):
        return path
    rigid = ~path.mesh.axial.any(axis=1)
    if not rigid.any():
        return path
    locked = (_tautness(path)[:, rigid] > MAX_TENSION).any(axis=1)
    return path.take(slice(0, int(locked.argmax()))) if locked.any() else path
