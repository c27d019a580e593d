"""The arrays of a network that compiled code takes: of elements, springs, loads, contacts of nodes and of sides."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.edges import find_circle, find_leading, half_thickness_of
from cfmkit.elastica.contact.terms import compliance
from cfmkit.elastica.mechanics.compiled_module import ADDRESS_FIELDS, slope_products
from cfmkit.elastica.mechanics.discretise import Attached, BeamElements, ContactAt, Discretisation
from cfmkit.elastica.mechanics.numbering import number_free
from cfmkit.elastica.model.beam_fits import coefficients_of
from cfmkit.elastica.model.contact import BeamOnObstacle, NodeOnObstacle, ObstacleEdge
from cfmkit.elastica.model.network import LineSpring, SlideSpring

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.equations import NumpyEquations

CLOSED_NODE = 3  # column of `contact_at`
ROTATION_STOP, MOTION_STOP, NODE_PAD = range(3)
IN_PLACE = ("angle", "weight", "rigidity", "ahead", "length", "bend", "rest", "curl")
"""Arrays of a `Model` that `sides.c` changes where elements move."""
OF_ELEMENTS = tuple(
    name for name in BeamElements._fields if name in ADDRESS_FIELDS and name not in ("ends", "unknowns")
)
WHOLE_NUMBERS = frozenset(("slot", "leaves", "spring_at", "load_at", "contact_at", "side_at", "moved_at"))


def model_arrays(of: NumpyEquations) -> dict[str, Any]:
    """Return the arrays of a `Model` in C order, but for those that networks of one topology share."""
    mesh = of.mesh
    e, a = mesh.elements, mesh.attachments
    arrays: dict[str, Any] = {name: getattr(e, name) for name in OF_ELEMENTS}
    arrays |= {"arm": a.arm, "origin": a.origin, "frame": a.frame, "base": mesh.base, "rate": mesh.rate}
    arrays |= {"bend": (e.weight * e.rigidity) @ slope_products(mesh.degree), "unit": of.unit}
    arrays |= term_arrays(mesh)
    if has_more_unknowns(mesh):
        arrays |= {"slot": number_free(mesh.free, mesh.size), "leaves": last_elements(mesh)[mesh.free]}
    if mesh.contacts:
        arrays |= contact_arrays(mesh)
    if mesh.moving is not None:
        sides, parts = side_arrays(mesh, len(arrays["edge"]))
        arrays |= sides | {"edge": np.concatenate([arrays["edge"], parts])}
        arrays |= {name: np.array(arrays[name]) for name in IN_PLACE if arrays[name] is not None}  # which C changes
    return {
        name: np.ascontiguousarray(values, np.int64 if name in WHOLE_NUMBERS else np.float64)
        for name, values in arrays.items()
        if values is not None
    }


def term_arrays(mesh: Discretisation) -> dict[str, Any]:
    """Return the arrays of springs and loads in a `Model`."""
    arrays: dict[str, Any] = {}
    for name, rows in (
        ("spring", [spring_row(mesh, spring) for spring in mesh.springs]),
        ("load", [load_row(mesh, load) for load in mesh.loads]),
    ):
        if rows:
            arrays[f"{name}_at"] = np.array([at for at, _ in rows], np.int64)
            arrays[name] = np.array([values for _, values in rows], float)
    return arrays


def has_more_unknowns(mesh: Discretisation) -> bool:
    """Return True if there are unknowns of contacts, which may all be open."""
    return mesh.size != mesh.numbering.size


def spring_row(mesh: Discretisation, attached: Attached) -> tuple[tuple[int, int, int], tuple[float, ...]]:
    """Return kind and places of a spring, and its stiffness and what else it needs."""
    item, scales, attachments = attached.item, mesh.scales, mesh.attachments
    rest = attachments.origin[list(attached.places)] + attachments.arm[list(attached.places)]
    stiffness = item.stiffness * scales.length / scales.force
    if isinstance(item, SlideSpring):
        free = item.free_displacement / scales.length
        values = (stiffness, free, np.cos(item.direction), np.sin(item.direction), *rest[0])
        return (1, attached.places[0], -1), values
    if isinstance(item, LineSpring):
        ground = np.array(item.ground) / scales.length
        length = float(np.hypot(*((rest[1] if item.end else ground) - rest[0])))
        free = length if item.free_length is None else item.free_length / scales.length
        end = attached.places[1] if item.end else -1
        return (0, attached.places[0], end), (stiffness, length, free - length, *ground, 0.0)
    start, end = attached.places if item.start is not None else (-1, attached.places[0])
    return (2, start, end), (item.stiffness / scales.moment, item.free_angle, 0.0, 0.0, 0.0, 0.0)


def load_row(mesh: Discretisation, attached: Attached) -> tuple[tuple[int, int, int], tuple[float, ...]]:
    """Return place of a load, whether it grows and follows, and force and moment."""
    item, scales = attached.item, mesh.scales
    unit = scales.drive if attached.grows else 1.0
    values = (item.fx * unit / scales.force, item.fy * unit / scales.force, item.moment * unit / scales.moment)
    return (attached.places[0], int(attached.grows), int(item.follows)), values


def contact_arrays(mesh: Discretisation) -> dict[str, Any]:
    """Return the arrays of the contacts of nodes in a `Model`: (contacts, 8), (contacts, 6), (parts, 6)."""
    rows: list[tuple[int, ...]] = []
    values: list[tuple[float, ...]] = []
    parts: list[FloatArray] = []
    first = 0
    for contact in mesh.node_contacts:
        kind, numbers = _describe(mesh, contact)
        edge = contact.item.outline if isinstance(contact.item, NodeOnObstacle) else None
        counts = (len(edge.length), len(edge.radius), int(edge.closed)) if edge else (0, 0, 0)
        closed = -1 if contact.closed is None else int(contact.closed)
        rows.append((kind, contact.place, contact.unknown, closed, first, *counts))
        values.append((*numbers, compliance(mesh, contact), mesh.scales.length))
        if edge:
            parts.append(edge_rows(edge))
            first += len(parts[-1])
    return {
        "contact_at": np.array(rows, np.int64).reshape(-1, 8),
        "contact": np.array(values).reshape(-1, 6),
        "edge": np.concatenate([np.empty((0, 6)), *parts]),
    }


@lru_cache(maxsize=128)
def edge_rows(edge: ObstacleEdge) -> FloatArray:
    """Return the segments of an outline, then its arcs, (parts, 6)."""
    segments = np.column_stack([edge.start, edge.along, edge.length, np.zeros(len(edge.length))])
    arcs = np.column_stack([edge.centre, edge.radius, edge.first, edge.sweep, edge.bulge])
    return read_only(np.concatenate([segments, arcs]))


def last_elements(mesh: Discretisation) -> Any:
    """Return the last element that holds each unknown, (size,); forces and places of contacts as long as nodes."""
    last = mesh.numbering.last_element
    if not mesh.contacts:
        return last
    kept = np.append(last, np.full(mesh.size - len(last), -1))
    for contact in mesh.contacts:
        rows = [contact.unknown, contact.slide] if contact.slide >= 0 else [contact.unknown]
        kept[rows] = last[mesh.attachments.unknowns[contact.place]].max()
    return kept


def _describe(mesh: Discretisation, contact: ContactAt) -> tuple[int, tuple[float, float, float, float]]:
    """Return the kind of a contact, and its gap or the radius of its pad, its sense, and its direction."""
    item: Any = contact.item
    if isinstance(item, NodeOnObstacle):
        return NODE_PAD, (item.radius, 0.0, 0.0, 0.0)
    if item.turns:
        return ROTATION_STOP, (item.gap, item.sense, 0.0, 0.0)
    along = float(np.cos(item.direction)), float(np.sin(item.direction))
    return MOTION_STOP, (item.gap / mesh.scales.length, item.sense, *along)


def side_arrays(mesh: Discretisation, first_part: int) -> tuple[dict[str, Any], Any]:
    """Return the arrays of contacts of sides in a `Model`, and the parts of their outlines, which begin at a row."""
    moving, sides = mesh.moving, mesh.side_contacts
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
