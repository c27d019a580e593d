"""The same network with rotations of a higher degree: for errors, and for what needs more than statics does."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.element_tables import element_tables

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Discretisation

UNKNOWNS_OF_CONTACTS = ("unknown", "slide", "flag", "rub", "anchor")


def raise_degree(mesh: Discretisation, degree: int) -> Discretisation:
    """Return a network with the same elements and a higher degree of their rotations, and with its floors."""
    if degree == mesh.degree:
        return mesh
    e = mesh.elements
    tables = element_tables(mesh.fits, mesh.scales, degree, mesh.cuts)
    if np.any(mesh.floored):
        tables["axial"] = tables["axial"] + mesh.floor[:, None]
    count, ends = len(e.beam), n_end_motions(mesh)
    bubbles = ends + np.arange(count * (degree - 1)).reshape(count, -1)
    forces = ends + count * (degree - 1) + np.arange(2 * count).reshape(count, -1)
    unknowns = np.hstack([e.unknowns[:, :8], bubbles, forces])
    forces_end = ends + count * (degree + 1)
    ahead = forces_end - _first_behind_forces(mesh)
    size = mesh.size + ahead
    contacts = tuple(
        one._replace(**{name: value + ahead for name in UNKNOWNS_OF_CONTACTS if (value := getattr(one, name)) >= 0})
        for one in mesh.contacts
    )
    moving = mesh.moving
    if moving is not None:
        moving = moving._replace(places=[place + ahead for place in moving.places])
    free = np.concatenate([mesh.free[mesh.free < ends], np.arange(ends, size)])
    base, rate = np.zeros(size, mesh.base.dtype), np.zeros(size)
    base[:ends], rate[:ends] = mesh.base[:ends], mesh.rate[:ends]
    elements = e._replace(**tables, unknowns=unknowns, moved_cuts=None)
    return replace(
        mesh, degree=degree, elements=elements, size=size, free=free, base=base, rate=rate, contacts=contacts,
        moving=moving,
    )  # fmt: skip


def embed(mesh: Discretisation, fine: Discretisation, z: Any) -> Any:
    """Return a state (..., size) of a network in the unknowns of one of a higher degree: shapes are hierarchical."""
    ends, old, new = n_end_motions(mesh), mesh.elements.unknowns, fine.elements.unknowns
    found = np.zeros((*z.shape[:-1], fine.size), z.dtype)
    found[..., :ends] = z[..., :ends]
    found[..., new[:, 8 : mesh.degree + 7]] = z[..., old[:, 8 : mesh.degree + 7]]
    found[..., new[:, -2:]] = z[..., old[:, -2:]]
    behind = mesh.size - _first_behind_forces(mesh)
    if behind:
        found[..., -behind:] = z[..., -behind:]
    return found


def _first_behind_forces(mesh: Discretisation) -> int:
    """Return the first unknown behind section forces: forces and places of contacts."""
    return int(mesh.elements.unknowns[:, -2:].max()) + 1


def n_end_motions(mesh: Discretisation) -> int:
    """Return the number of unknowns that move ends of elements; bubbles and forces come behind them."""
    return int(mesh.elements.unknowns[:, 8].min())
