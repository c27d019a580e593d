"""Arrays of a network made from those of another: with rotations of a higher degree, without floors, made up alike.

A higher degree is for errors, and for what needs more than statics does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.elements import element_tables
from cfmkit.elastica.mechanics.numbering import number

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Discretisation


UNKNOWNS_OF_CONTACTS = ("unknown", "slide", "flag", "rub", "anchor")


def raise_degree(mesh: Discretisation, degree: int) -> Discretisation:
    """Return a network with the same elements and a higher degree of their rotations, and with its floors."""
    if degree == mesh.degree:
        return mesh
    e = mesh.elements
    many = element_tables([mesh.fits], mesh.scales, degree, mesh.numbering.row, e.cuts)
    tables = {name: table[0] for name, table in many.items()}
    if np.any(mesh.floored):
        tables["axial"] = tables["axial"] + mesh.floor[:, None]
    coarse = mesh.numbering
    numbering = number(coarse.topology._replace(degree=degree))
    ends, ahead = coarse.n_ends, numbering.size - coarse.size
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
    elements = e._replace(**tables, unknowns=numbering.unknowns, moved_cuts=None)
    return replace(
        mesh, degree=degree, elements=elements, numbering=numbering, size=size, free=free, base=base, rate=rate,
        contacts=contacts, moving=moving,
    )  # fmt: skip


def embed(mesh: Discretisation, fine: Discretisation, z: Any) -> Any:
    """Return a state (..., size) of a network in the unknowns of one of a higher degree: shapes are hierarchical."""
    ends, old, new = mesh.numbering.n_ends, mesh.elements.unknowns, fine.elements.unknowns
    found = np.zeros((*z.shape[:-1], fine.size), z.dtype)
    found[..., :ends] = z[..., :ends]
    found[..., new[:, 8 : mesh.degree + 7]] = z[..., old[:, 8 : mesh.degree + 7]]
    found[..., new[:, -2:]] = z[..., old[:, -2:]]
    behind = mesh.size - mesh.numbering.size
    if behind:
        found[..., -behind:] = z[..., -behind:]
    return found


def make_inextensible(mesh: Discretisation, elements: Any) -> Discretisation:
    """Return the same arrays with elements that do not stretch at all."""
    axial, floored = mesh.elements.axial.copy(), mesh.floored.copy()
    axial[elements], floored[elements] = 0.0, False
    return replace(mesh, elements=mesh.elements._replace(axial=axial), floored=floored)
