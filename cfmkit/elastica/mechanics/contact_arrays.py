"""Contacts of nodes as `contact.c` takes them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.terms import compliance
from cfmkit.elastica.model.contact import NodeOnObstacle, ObstacleEdge

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.contact_unknowns import ContactAt
    from cfmkit.elastica.mechanics.discretise import Discretisation

CLOSED_NODE = 3  # column of `contact_at`
ROTATION_STOP, MOTION_STOP, NODE_PAD = range(3)


def node_contacts(mesh: Discretisation) -> list[ContactAt]:
    """Return the contacts of nodes."""
    return [contact for contact in mesh.contacts if contact.slide < 0]


def side_contacts(mesh: Discretisation) -> list[ContactAt]:
    """Return the contacts of sides of beams."""
    return [contact for contact in mesh.contacts if contact.slide >= 0]


def contact_arrays(mesh: Discretisation) -> dict[str, Any]:
    """Return the arrays of the contacts of nodes in a `Model`: (contacts, 8), (contacts, 6), (parts, 6)."""
    rows: list[tuple[int, ...]] = []
    values: list[tuple[float, ...]] = []
    parts: list[FloatArray] = []
    first = 0
    for contact in node_contacts(mesh):
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
