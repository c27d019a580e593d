"""Sides of beams that touch at points, in compiled code (`sides.c`); what lies on an obstacle is in numpy.

`SlidingEquations` is the specification (tests/unit/test_elastica_march.py).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.contact.edges import find_circle, find_leading, half_thickness_of
from cfmkit.elastica.mechanics.contact_arrays import edge_rows, side_contacts
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, NodeOnBeam, NodeOnObstacle, Stop
from cfmkit.elastica.model.plain_beams_at_once import is_plain

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Discretisation

CLOSED_SIDE = 5  # column of `side_at`
IN_PLACE = ("angle", "weight", "rigidity", "ahead", "length", "bend")
"""Arrays of a `Model` that `sides.c` changes where elements move."""


def are_sides_compiled(mesh: Discretisation) -> bool:
    """Return True if `sides.c` has all contacts: those of plain beams at points, and of nodes without friction."""
    follows = any(load.item.follows for load in mesh.loads)
    kinds = {type(contact.item) for contact in mesh.contacts}
    beams = {mesh.elements.beam[number] for number in mesh.moving.elements} if mesh.moving is not None else set()
    return (
        not follows
        and mesh.elements.curl is None
        and kinds <= {Stop, NodeOnObstacle, BeamOnObstacle, NodeOnBeam, BeamOnBeam}
        and all(contact.rub < 0 and not contact.laid for contact in mesh.contacts)
        and all(is_plain(mesh.fits.network.beams[beam]) for beam in beams)
    )


def side_arrays(mesh: Discretisation, first_part: int, products: Any) -> tuple[dict[str, Any], Any]:
    """Return the arrays of contacts of sides in a `Model`, and the parts of their outlines, which begin at a row."""
    moving, sides, bundle = mesh.moving, side_contacts(mesh), mesh.fits.bundle
    assert moving is not None
    rule, length, numbers = basis(mesh.degree), mesh.scales.length, np.asarray(moving.elements)
    rows, values, parts = [], [], [np.empty((0, 6))]
    for contact in sides:
        item: Any = contact.item
        edge = item.outline if isinstance(item, BeamOnObstacle) else None
        closed = -1 if contact.closed is None else int(contact.closed)
        at = contact.element, contact.place, contact.unknown, contact.slide, contact.flag, closed
        row = int(np.flatnonzero(numbers == contact.element)[0])
        counts = (len(edge.length), len(edge.radius), int(edge.closed)) if edge else (0, 0, 0)
        circle, radius = (-1, 0.0) if edge else find_circle(mesh, item)
        rows.append((*at, first_part, circle, row, *counts, sides.index(find_leading(mesh, contact))))
        values.append((half_thickness_of(mesh, item.beam), length, radius))
        if edge:
            parts.append(edge_rows(edge))
            first_part += len(parts[-1])
    names = [bundle.names[k] for k in bundle.plain]
    plain = [names.index(mesh.elements.beam[number]) for number in numbers]
    rigidity = bundle.rigidities[0][plain] / (mesh.scales.force * length**2)
    law = np.column_stack([bundle.length[plain] / length, rigidity, bundle.coefficients[plain]])
    arrays = {
        "side_at": np.array(rows), "side": np.array(values), "moved_at": numbers, "moved_fixed": moving.fixed,
        "moved_shares": moving.shares, "moved_law": law, "rule": np.stack([rule.places, rule.weights]),
        "unit_bend": rule.weights @ products,
    }  # fmt: skip
    return arrays, np.concatenate(parts)
