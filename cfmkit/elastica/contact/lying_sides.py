"""Sides of beams that lie on an obstacle along a length: whether they do, and a first guess of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.contact.side_conditions import ROUNDING_OF_KIND
from cfmkit.elastica.mechanics.moving_elements import PLACE_STEP
from cfmkit.elastica.model.contact import NodeOnBeam
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import Polynomial

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.changes import PieceOfPath
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.contact import BeamOnObstacle, BeamSide
    from cfmkit.numerics.continuation.problem import PathEquilibrium

NO_TENSION = 1e-9  # share of a force along an obstacle that is none
STRAIGHT_TURN = 1e-9  # turn of an unloaded beam that is none [rad]


def may_lie(piece: PieceOfPath, item: BeamSide, parameter: float) -> bool:
    """Return True if a side takes on another curvature where it lies on an obstacle."""
    is_round = isinstance(item, NodeOnBeam) or len(item.outline.radius) > 0
    return is_round or abs(_measure_unloaded_bend(piece, item, parameter)) > STRAIGHT_TURN


def _measure_unloaded_bend(piece: PieceOfPath, item: BeamSide, parameter: float) -> float:
    """Return the curvature of an unloaded beam by its parameter [rad]."""
    fitted = piece.whole.mesh.fits[item.beam]
    sides = [float(np.real(fitted.angle(parameter + step, parameter))) for step in (PLACE_STEP, -PLACE_STEP)]
    return (sides[0] - sides[1]) / (2 * PLACE_STEP)


def presses_where_it_spreads(piece: PieceOfPath, item: BeamOnObstacle, place: Any, force: Any, angle: float) -> bool:
    """Return True if a side that spreads lies on the obstacle; else it touches at points, with a free part between.

    Where nothing pulls along a round obstacle it is tried: with what lies there the tension grows, or is none.
    """
    mesh = piece.whole.mesh
    bulge = float(item.outline.distance(np.asarray(place) * mesh.scales.length).curvature)
    if bulge:
        tension = float(np.array([np.cos(angle), np.sin(angle)]) @ force)
        return bool(np.sign(bulge) * tension > -NO_TENSION * float(np.hypot(*force)))
    return True


def why_not_laid(piece: PieceOfPath, item: BeamSide) -> str:
    """Return why a beam cannot lie on an obstacle along a length; empty if it can."""
    if isinstance(item, NodeOnBeam):
        return "between parts of the mechanism that is not modelled"
    beam = piece.whole.mesh.fits.network.beams[item.beam]
    shape, section = beam.shape, beam.section
    if section.shear:
        return "with shear deformation that is not modelled: leave it out of the beam"
    if isinstance(section.thickness, Taper) or not isinstance(shape, Polynomial) or len(shape.coefficients) > 2:
        return "that is modelled for beams of one thickness and curvature only"
    return ""


def guess_laid(mesh: Discretisation, z: FloatArray, element: int, tension: float) -> None:
    """Put what is known of an element that lies on an obstacle into a state."""
    side_contact = mesh.elements.unknowns[element]
    z[side_contact[8:-2]] = 0.0
    z[side_contact[-2]], z[side_contact[-1]] = tension, 0.0


def presses(piece: PieceOfPath, at: PathEquilibrium) -> bool:
    """Return True if everything that lies on an obstacle presses on it."""
    whole, count = piece.grow(at), len(piece.whole.mesh.contacts)
    rows = [count + k for k, contact in enumerate(piece.sides.all) if contact.kind == "pulls"]
    return all(piece.row_value(whole, row) > -ROUNDING_OF_KIND["pulls"] for row in rows)
