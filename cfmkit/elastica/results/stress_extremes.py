"""Largest stresses along beams and their places: the extreme of the polynomial through places of each element.

On an element the bending moment is a polynomial and the normal force as smooth as its rotation, so that a polynomial
through as many places as the element resolves has the stress to the element's own accuracy; its extreme is found by
Newton's method from the highest place of a grid. All elements of some beams are looked at together.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from cfmkit.elastica.results.beam_states import (
    elements_of,
    forces_of_designs,
    forces_of_elements,
    sections,
    sections_of_width,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.results.beam_states import BeamSections

N_MORE_PLACES = 8
"""Places on an element more than the degree of its rotation: sines of the angle, and tapers, are no polynomials."""
N_GRID = 49  # places of a grid on an element: the extreme lies between the neighbours of the highest one
MAX_STEPS = 10  # of Newton's method, or halvings where it leaves the neighbours
MAX_TOGETHER = 1_000_000  # numbers on the grids of some points: 8 MB
STRESS_ROUNDING = 4 * np.finfo(float).eps  # share by which a value is higher than another one
AT_END = 1e-14  # fraction of an element within which a place is its end
STRESS_RTOL = 1e-9  # share by which one element's stress must be higher than that of the one before it


class SideExtremes(NamedTuple):
    """Highest and lowest stress on both sides of a beam at p points, tension positive.

    The first axis after the points is the side: that of positive bending stress M t / 2I, then the other; the second
    is highest, lowest.
    """

    value: Any  # (p, 2, 2) [Pa]
    place: Any  # (p, 2, 2) fraction of the arc length
    element: Any  # (p, 2, 2) number of the element on the beam
    fraction: Any  # (p, 2, 2) place on it


@lru_cache(maxsize=32)
def places(count: int) -> tuple[tuple[float, ...], Any]:
    """Return Chebyshev places with both ends, as fractions, and the matrix from values there to Legendre series."""
    x = -np.cos(np.pi * np.arange(count) / (count - 1))
    return tuple(((1 + x) / 2).tolist()), np.linalg.inv(legendre.legvander(x, count - 1))


def extremes(net: Network, at: Equilibria, beams: Sequence[str], signs: FloatArray) -> tuple[Any, Any, Any, Any]:
    """Return the highest combinations of bending and axial stress along some beams.

    Parameters
    ----------
    net, at : Network, Equilibria
        As of `states`.
    beams : sequence of str
        Their names, b.
    signs : (c, 2) array
        What bending and axial stress count for, in each of c combinations.

    Returns
    -------
    value, place, element, fraction : (b, p, c) arrays
        [Pa]; fraction of the arc length; number of the element on the beam, and place on it.
    """
    own = [elements_of(at.mesh, beam) for beam in beams]
    elements = [number for numbers in own for number in numbers]
    together = max(1, MAX_TOGETHER // max(1, len(elements) * len(signs) * N_GRID))
    parts = [
        _element_extremes(net, replace(at, z=at.z[k : k + together], drive=at.drive[k : k + together]), elements, signs)
        for k in range(0, max(1, len(at.z)), together)
    ]
    return _highest(own, parts)


def extremes_of_designs(
    networks: Sequence[Network], meshes: Sequence[Discretisation], at: Equilibria, row: Any, signs: FloatArray
) -> FloatArray:
    """Return the highest combinations along all beams of some designs, (b, p, c); see `forces_of_designs`."""
    fractions, to_series = places(at.mesh.degree + N_MORE_PLACES)
    elements = len(at.mesh.elements.beam)
    together, parts = max(1, MAX_TOGETHER // (elements * len(signs) * N_GRID)), []
    for k in range(0, len(at.z), together):
        some = slice(k, k + together)
        own = replace(at, z=at.z[some], drive=at.drive[some])
        found, widths = forces_of_designs(networks, meshes, own, row[some], fractions)
        arcs = found.place.reshape(len(own.z), elements, len(fractions))
        parts.append(_tops(sections_of_width(widths, found), arcs, signs, to_series))
    return np.asarray(_highest([elements_of(at.mesh, beam) for beam in networks[0].beams], parts)[0])


def _highest(own: Sequence[Sequence[int]], parts: Sequence[tuple[Any, Any, Any]]) -> tuple[Any, Any, Any, Any]:
    """Return the highest values of each beam from those of all elements, which are parts of the points."""
    value, place, fraction = (np.concatenate(column, axis=1) for column in zip(*parts, strict=True))
    shape, end = (len(own), *value.shape[1:]), 0
    best, chosen = np.full(shape, -np.inf), np.zeros(shape, int)
    arc, where = np.zeros(shape), np.zeros(shape)
    for k, numbers in enumerate(own):
        for number in range(len(numbers)):
            better = value[end] > np.where(best[k] > 0, best[k] * (1 + STRESS_RTOL), best[k])
            best[k], chosen[k] = np.where(better, value[end], best[k]), np.where(better, number, chosen[k])
            arc[k], where[k] = np.where(better, place[end], arc[k]), np.where(better, fraction[end], where[k])
            end += 1
    return best, np.clip(arc, 0.0, 1.0), chosen, where


def _element_extremes(net: Network, at: Equilibria, elements: list[int], signs: FloatArray) -> tuple[Any, Any, Any]:
    """Return the highest stresses on each of m elements, places on their beams and on them, (m, p, c) each."""
    fractions, to_series = places(at.mesh.degree + N_MORE_PLACES)
    widths = np.array([net.beams[at.mesh.elements.beam[number]].section.width for number in elements])
    found = forces_of_elements(net, at, elements, fractions)
    arcs = found.place.reshape(-1, len(elements), len(fractions))
    return _tops(sections_of_width(np.repeat(widths, len(fractions)), found), arcs, signs, to_series)


def _tops(seen: BeamSections, arcs: Any, signs: FloatArray, to_series: FloatArray) -> tuple[Any, Any, Any]:
    """Return the highest stresses on elements, (m, p, c), from sections at their places, arc lengths (p or 1, m, k)."""
    shape = len(seen.bending_stress), *arcs.shape[1:]
    both = np.array([seen.bending_stress, seen.axial_stress]).reshape(2, *shape)
    series = np.einsum("cs,spmk->mpck", signs, both) @ to_series.T
    top, x = _top(series)
    arcs = np.moveaxis(np.broadcast_to(arcs, shape), 0, 1)
    inner = np.einsum("mpck,mpk->mpc", legendre.legvander(x, shape[-1] - 1), arcs @ to_series.T)
    fraction, first, last = (1 + x) / 2, arcs[..., :1], arcs[..., -1:]
    place = np.where(fraction < AT_END, first, np.where(fraction > 1 - AT_END, last, inner))
    return top, place, fraction


@lru_cache(maxsize=32)
def _polynomials(count: int) -> tuple[Any, Any]:
    """Return Legendre polynomials at places of the grid, (grid, count), and the matrix to the series of the slope."""
    table = legendre.legvander(np.linspace(-1.0, 1.0, N_GRID), count - 1)
    return table, np.pad(legendre.legder(np.eye(count)), ((0, 1), (0, 0)))


def _top(series: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest values of Legendre series (..., k) on [-1, 1], (...), and where they are."""
    count, grid = series.shape[-1], np.linspace(-1.0, 1.0, N_GRID)
    table, slopes = _polynomials(count)
    values = series @ table.T
    at = values.argmax(axis=-1)
    top = np.take_along_axis(values, at[..., None], -1)[..., 0]
    place, low, high = grid[at], grid[np.maximum(at - 1, 0)], grid[np.minimum(at + 1, N_GRID - 1)]
    by_order = np.stack([series, series @ slopes.T, series @ (slopes @ slopes).T], axis=-2)
    x, polynomials = place, table[at]
    for number in range(MAX_STEPS):
        value, slope, curvature = np.moveaxis(np.matmul(by_order, polynomials[..., None])[..., 0], -1, 0)
        low, high = np.where(slope > 0, x, low), np.where(slope < 0, x, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = x - slope / curvature
        follows = (curvature < 0) & (newton >= low) & (newton <= high)
        step = np.where(follows, newton, 0.5 * (low + high)) - x
        if number == MAX_STEPS - 1 or (np.abs(slope * step) <= STRESS_ROUNDING * np.abs(top)).all():
            break
        x = x + step
        polynomials = legendre.legvander(x, count - 1)
    higher = value > top + STRESS_ROUNDING * np.abs(top)
    return np.where(higher, value, top), np.where(higher, x, place)


def signed_extremes(net: Network, at: Equilibria, beam: str, axial: bool) -> SideExtremes:
    """Return the highest and lowest stress on both sides of a beam at every point."""
    sense = np.array([1.0, -1.0, 1.0, -1.0])  # of highest and lowest
    signs = np.stack([sense * [1.0, 1.0, -1.0, -1.0], sense * float(axial)], axis=1)
    value, place, element, fraction = (found[0] for found in extremes(net, at, [beam], signs))
    return SideExtremes(*(a.reshape(-1, 2, 2) for a in (value * sense, place, element, fraction)))


def largest_stresses(net: Network, at: Equilibria, beams: Sequence[str], axial: bool) -> tuple[FloatArray, FloatArray]:
    """Return the largest stress of each of b beams at every point, (b, p) [Pa], and its place on the arc length."""
    value, place, _, _ = extremes(net, at, beams, _signs(axial))
    best = value.argmax(axis=-1)[..., None]
    return np.take_along_axis(value, best, -1)[..., 0], np.take_along_axis(place, best, -1)[..., 0]


def _signs(axial: bool) -> FloatArray:
    """Return what bending and axial stress count for in the largest of all sides, (c, 2)."""
    both = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
    return np.array(both if axial else [(1.0, 0.0), (-1.0, 0.0)])


def largest_stresses_of_designs(
    networks: Sequence[Network], meshes: Sequence[Discretisation], at: Equilibria, row: Any, axial: bool
) -> FloatArray:
    """Return the largest stress of each of b beams at points of some designs, (b, p) [Pa]; see `forces_of_designs`."""
    return np.asarray(extremes_of_designs(networks, meshes, at, row, _signs(axial)).max(axis=-1))


def stress_at(
    # net, at, beam: as of `states`; with complex steps, too
    net: Network,
    at: Equilibria,
    beam: str,
    # element, fraction: (p, 2, n): as of `SideExtremes`
    element: Any,
    fraction: Any,
    axial: bool,  # whether the stress has its axial part
) -> Any:
    """Return the stress on both sides of a beam at places of its own for every point, (p, 2, n)."""
    fractions, to_series = places(at.mesh.degree + N_MORE_PLACES)
    found = np.zeros(np.shape(fraction), at.z.dtype)
    sides = np.array([1.0, -1.0])[:, None]
    for number, own in enumerate(elements_of(at.mesh, beam)):
        here = element == number
        if not here.any():
            continue
        seen = sections(net, beam, forces_of_elements(net, at, [own], fractions))
        bending, pull = (
            np.moveaxis(legendre.legvander(2 * fraction - 1, len(fractions) - 1), -1, 0)
            * np.moveaxis(values @ to_series.T, -1, 0)[:, :, None, None]
            for values in (seen.bending_stress, seen.axial_stress)
        )
        stress = sides * bending.sum(axis=0) + (pull.sum(axis=0) if axial else 0.0)
        found = np.where(here, stress, found)
    return found
