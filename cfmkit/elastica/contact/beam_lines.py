"""Angles and changes of curvature of the middle lines of beams, at ends and inside; their curvature before any load."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.energy import rotation_columns
from cfmkit.elastica.mechanics.moving_elements import PLACE_STEP, lengths_at
from cfmkit.elastica.mechanics.polynomials import shape_functions
from cfmkit.elastica.mechanics.poses import poses

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation


def list_elements(mesh: Discretisation, beam: str) -> list[int]:
    """Return the elements of a beam, in order."""
    return [number for number, name in enumerate(mesh.elements.beam) if name == beam]


class LoadedBeamEnd(NamedTuple):
    """An end of a beam in states (..., size)."""

    element: int
    angle: Any  # (...) of the section [rad]
    place: Any  # (..., 2)


def find_end(mesh: Discretisation, beam: str, last: bool, z: FloatArray) -> LoadedBeamEnd:
    """Return the first or the last end of a beam."""
    element, side, e = list_elements(mesh, beam)[-1 if last else 0], int(last), mesh.elements
    unloaded = float(np.real(mesh.fits[beam].angle(float(side), float(e.cuts[element].mean()))))
    place = poses(mesh.attachments, z, [int(e.ends[element, side])]).place[..., 0, :]
    return LoadedBeamEnd(element, unloaded + z[..., e.unknowns[element, 3 + 4 * side]], place)


def measure_bend(mesh: Discretisation, z: FloatArray, element: int, end: int) -> Any:
    """Return the change of curvature at an end of an element (0 or 1) in states (n, size), (n,)."""
    slopes = shape_functions(mesh.degree, np.array([float(end)]))[1][0]
    rotation = z[:, mesh.elements.unknowns[element, rotation_columns(mesh.degree)]]
    return rotation @ slopes / lengths_at(mesh, z, element)


def measure_unloaded_curvature(mesh: Discretisation, beam: str, parameter: FloatArray, element: int) -> Any:
    """Return the curvature of an unloaded beam at parameters (n,) of an element, (n,)."""
    fitted, inside = mesh.fits[beam], float(mesh.elements.cuts[element].mean())
    ahead, behind = (np.real(fitted.angle(parameter + step, inside)) for step in (PLACE_STEP, -PLACE_STEP))
    speed = np.real(fitted.speed(parameter, inside)) / mesh.scales.length
    return (ahead - behind) / (2 * PLACE_STEP) / speed
