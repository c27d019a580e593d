"""Sides of beams that touch at points, in compiled code (`sides.c`); what lies on an obstacle is in numpy.

`SlidingEquations` is the specification (tests/elastica/test_elastica_march.py).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.contact.edges import find_circle, find_leading, half_thickness_of
from cfmkit.elastica.mechanics.contact_arrays import edge_rows, side_contacts
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, NodeOnBeam, NodeOnObstacle, Stop
from cfmkit.elastica.model.plain_beams_at_once import coefficients_of, has_polynomial_angle

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation

CLOSED_SIDE = 5  # column of `side_at`
IN_PLACE = ("angle", "weight", "rigidity", "ahead", "length", "bend", "rest", "curl")
"""Arrays of a `Model` that `sides.c` changes where elements move."""


def are_sides_compiled(mesh: Discretisation) -> bool:
    """Return True if `sides.c` has all contacts: those of uniform beams at points, and of nodes without friction."""
    follows = any(load.item.follows for load in mesh.loads)
    kinds = {type(contact.item) for contact in mesh.contacts}
    beams = {mesh.elements.beam[number] for number in mesh.moving.elements} if mesh.moving is not None else set()
    return (
        not follows
        and kinds <= {Stop, NodeOnObstacle, BeamOnObstacle, NodeOnBeam, BeamOnBeam}
        and all(contact.rub < 0 and not contact.laid for contact in mesh.contacts)
        and all(has_polynomial_angle(mesh.fits.network.beams[beam]) for beam in beams)
        and not any(mesh.fits.network.beams[beam].section.shear for beam in beams)
    )


def side_arrays(mesh: Discretisation, first_part: int) -> tuple[dict[str, Any], Any]:
    """Return the arrays of contacts of sides in a `Model`, and the parts of their outlines, which begin at a row."""
    moving, sides = mesh.moving, side_contacts(mesh)
    assert moving is not None
    length, numbers = mesh.scales.length, np.asarray(moving.elements).tolist()
    rows, values, parts = [], [], [np.empty((0, 6))]
    for contact in sides:
        item: Any = contact.item
        edge = item.outline if isinstance(item, BeamOnObstacle) else None
        closed = -1 if contact.closed is None else int(contact.closed)
        at = contact.element, contact.place, contact.unknown, contact.slide, contact.flag, closed
        counts = (len(edge.length), len(edge.radius), int(edge.closed)) if edge else (0, 0, 0)
        circle, radius = (-1, 0.0) if edge else find_circle(mesh, item)
        row, leading = numbers.index(contact.element), sides.index(find_leading(mesh, contact))
        rows.append((*at, first_part, circle, row, *counts, leading))
        values.append((half_thickness_of(mesh, item.beam), length, radius))
        if edge:
            parts.append(edge_rows(edge))
            first_part += len(parts[-1])
    arrays = {
        "side_at": np.array(rows), "side": np.array(values), "moved_at": numbers, "moved_fixed": moving.fixed,
        "moved_shares": moving.shares, "moved_law": measure_laws(mesh),
    }  # fmt: skip
    return arrays, np.concatenate(parts)


def measure_laws(mesh: Discretisation) -> FloatArray:
    """Return length, rigidity and curling of the beam of each element that moves, and its angle, (moved, 3 + m)."""
    length, force = mesh.scales.length, mesh.scales.force
    laws: dict[str, FloatArray] = {}
    names = [mesh.elements.beam[number] for number in mesh.moving.elements]  # type: ignore[union-attr]
    beams = {name: mesh.fits.network.beams[name] for name in names}
    angles = coefficients_of(list(beams.values())) + 0.0
    for (name, beam), angle in zip(beams.items(), angles, strict=True):
        section, fitted = beam.section, mesh.fits[name]
        angle[0] += fitted.rotation
        rigidity = float(np.ravel(section.rigidities(np.array([0.5]), 0.5)[0])[0])
        curl = float(np.ravel(section.curling(section.thickness_at(0.5, 0.5))[0])[0])
        laws[name] = np.array([fitted.length / length, rigidity / (force * length**2), curl / length**2, *angle])
    return np.array([laws[name] for name in names])
