"""Elements whose ends are places of contacts on a beam: their tables, ends and lengths at any of these places.

The bending moment has a kink where a contact presses: there an element ends, so that polynomials keep their accuracy.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.elements import smooth_marks, smooth_tables
from cfmkit.elastica.model.beam_fits import has_polynomial_angle
from cfmkit.numerics.dual_array import COMPLEX_STEP

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation


MOVED_TABLES = ("angle", "weight", "rigidity", "axial", "shear", "ahead", "rest", "curl", "hindrance")
PLACE_STEP = 1e-6  # of a beam's parameter, by which is differentiated


def compute_moved_tables(mesh: Discretisation, places: Any) -> dict[str, Any]:
    """Return the tables of the elements in `mesh.moving`, (..., r, q), with contacts at some places (..., k)."""
    moving = mesh.moving
    assert moving is not None
    cuts = moving.evaluate(places)
    wide = mesh.elements.curl is not None
    tables_by_name: dict[str, Any] = {}
    for rows, beam, inside in _parts(mesh):
        fitted, section = mesh.fits[beam], mesh.fits.network.beams[beam]
        tables = smooth_tables(section, fitted, mesh.scales, mesh.degree, cuts[..., rows, :], inside, wide)
        for name, values in tables.items():
            inner = values.shape[len(cuts.shape) - 1 :]
            table = tables_by_name.setdefault(name, np.empty((*cuts.shape[:-1], *inner), values.dtype))
            table[(..., rows, *(slice(None),) * len(inner))] = values
    floor = mesh.floor[moving.elements]
    if floor.any():
        tables_by_name["axial"] = tables_by_name["axial"] + floor[:, None]
    return tables_by_name | {"moved_cuts": cuts}


def with_places(mesh: Discretisation, z: Any) -> Discretisation:
    """Return the arrays with contacts at their places in states (..., size): tables of elements are (..., e, q).

    The same arrays, if no element moves.
    """
    e, moving = mesh.elements, mesh.moving
    if moving is None:
        return mesh
    moved = compute_moved_tables(mesh, z[..., moving.places])
    changed: dict[str, Any] = {}
    for name, values in moved.items():
        table_at_rest = e.cuts if name == "moved_cuts" else getattr(e, name)
        rank = 1 if name == "length" else 2
        first = table_at_rest.reshape(-1, *table_at_rest.shape[-rank:])[0]
        whole = np.broadcast_to(first, (*z.shape[:-1], *first.shape)).copy()
        whole[(..., moving.elements, *(slice(None),) * (rank - 1))] = values
        changed[name] = whole
    laid = np.zeros((*z.shape[:-1], len(e.beam)), bool)
    for contact in mesh.contacts:
        if contact.slide >= 0:
            for side in (-1, 1):
                laid[..., contact.element + (side > 0)] |= np.rint(z[..., contact.flag]) == side
    changed["laid"] = laid if laid.any() else None
    return replace(mesh, elements=e._replace(**changed))


def cuts_at(mesh: Discretisation, z: Any) -> Any:
    """Return where all elements begin and end in states (..., size), (..., e, 2)."""
    cuts = np.empty((*z.shape[:-1], *mesh.elements.cuts.shape))
    cuts[...] = mesh.elements.cuts
    if mesh.moving is not None:
        cuts[..., mesh.moving.elements, :] = mesh.moving.evaluate(z[..., mesh.moving.places])
    return cuts


def lengths_at(mesh: Discretisation, z: Any, number: int) -> Any:
    """Return the length of an element in states (n, size), (n,) or a number."""
    fitted = mesh.fits[mesh.elements.beam[number]]
    if mesh.moving is None or not fitted.course.uniform:
        return with_places(mesh, z).elements.length[..., number]
    low, high = cuts_at(mesh, z)[:, number].T
    return (high - low) * fitted.length / mesh.scales.length


def copy_moved_tables(mesh: Discretisation) -> Discretisation:
    """Return the arrays with copies of the tables that moving contacts change; of several states those of the first."""
    e = mesh.elements
    names = [name for name in (*MOVED_TABLES, "length") if getattr(e, name) is not None]
    if e.weight.ndim > 2:
        first: dict[str, Any] = {name: getattr(e, name)[0] for name in names}
        e = e._replace(**first, moved_cuts=None)
    copies: dict[str, Any] = {name: np.array(getattr(e, name)) for name in names}
    return replace(mesh, elements=e._replace(**copies, laid=None))


def _parts(mesh: Discretisation) -> list[tuple[Any, str, float]]:
    """Return rows of `mesh.moving` in each smooth part of each beam, its name and a place inside the part."""
    if _parts not in mesh.cache:
        assert mesh.moving is not None
        numbers, parts = np.asarray(mesh.moving.elements), []
        for beam in dict.fromkeys(mesh.elements.beam[number] for number in numbers):
            middles = mesh.elements.cuts[numbers].mean(axis=1)
            of_beam = np.array([mesh.elements.beam[number] == beam for number in numbers])
            for begin, end in itertools.pairwise(smooth_marks(mesh.fits.network.beams[beam], mesh.fits[beam])):
                rows = np.flatnonzero(of_beam & (begin <= middles) & (middles < end))
                if len(rows):
                    parts.append((rows, beam, 0.5 * (begin + end)))
        mesh.cache[_parts] = parts
    return mesh.cache[_parts]  # type: ignore[no-any-return]


def unloaded_beam_at(
    mesh: Discretisation, contact: ContactAt, parameter: float
) -> tuple[tuple[float, float, float], float, float, float]:
    """Return the unloaded angle, its slope and ds/dt by the parameter, curvature, half thickness and its slope."""
    name: Any = contact.item.beam  # type: ignore[union-attr]
    beam, fitted = mesh.fits.network.beams[name], mesh.fits[name]
    inside, step, length = float(mesh.elements.cuts[contact.element].mean()), PLACE_STEP, mesh.scales.length
    if has_polynomial_angle(beam):
        stepped = complex(fitted.angle(parameter + 1j * COMPLEX_STEP, inside))
        angle, turning = stepped.real, stepped.imag / COMPLEX_STEP
        half, speed = 0.5 * float(beam.section.thickness_at(0.5, inside)) / length, fitted.length / length
        return (angle, turning, speed), turning / speed, half, 0.0
    t = np.array([parameter - step, parameter, parameter + step])
    angle = np.real(fitted.angle(t, inside)) + 0.0 * t
    speed = float(np.real(fitted.speed(np.array([parameter]), inside) + np.zeros(1))[0]) / length
    along = (fitted.arc(np.clip(t, 0, 1)), float(np.real(fitted.arc(inside))))
    half = 0.5 * (np.real(beam.section.thickness_at(*along)) + 0.0 * t) / length
    turning, tapering = (angle[2] - angle[0]) / (2 * step), float(half[2] - half[0]) / (2 * step)
    return (float(angle[1]), float(turning), speed), float(turning) / speed, float(half[1]), tapering / speed
