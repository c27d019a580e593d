"""Where the stress along a beam is largest: the extreme of the polynomial through places of each element.

On an element the bending moment is a polynomial and the normal force as smooth as its rotation, so that a polynomial
through as many places as the element resolves has the stress to the element's own accuracy; its extreme is found on
grids that become finer, not sampled.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from cfmkit.elastica.results.beam_states import elements_of, sections, states_of_elements

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria
    from cfmkit.elastica.model.network import Network

N_MORE_PLACES = 8
"""Places on an element more than the degree of its rotation: sines of the angle, and tapers, are no polynomials."""
N_GRID, N_ZOOMS = 49, 5
"""Places of a grid between two ends, and how often the neighbours of its highest place become the ends of the next: the
last grid is (2/48)^5 of an element wide, where a parabola's top is known to rounding."""
AT_END = 1e-14  # fraction of an element within which a place is its end
TIED = 1e-9  # share by which one element's stress must be higher than that of the one before it


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


def extremes(net: Network, at: Equilibria, beam: str, signs: FloatArray) -> tuple[Any, Any, Any, Any]:
    """Return the highest combinations of bending and axial stress along a beam.

    Parameters
    ----------
    net, at, beam : Network, Equilibria, str
        As of `states`.
    signs : (c, 2) array
        What bending and axial stress count for, in each of c combinations.

    Returns
    -------
    value, place, element, fraction : (p, c) arrays
        [Pa]; fraction of the arc length; number of the element on the beam, and place on it.
    """
    fractions, to_series = places(at.network.degree + N_MORE_PLACES)
    shape = (len(at.z), len(signs))
    best, place, chosen, where = np.full(shape, -np.inf), np.zeros(shape), np.zeros(shape, int), np.zeros(shape)
    for number, element in enumerate(elements_of(at.network, beam)):
        found = states_of_elements(net, at, [element], fractions)
        seen = sections(net, beam, found)
        both = np.stack([seen.bending_stress, seen.axial_stress])
        series = np.einsum("cs,spk->pck", signs, both) @ to_series.T
        top, fraction = _top(series)
        inner = legendre.legval(2 * fraction - 1, to_series @ found.place)
        arc = np.where(fraction < AT_END, found.place[0], np.where(fraction > 1 - AT_END, found.place[-1], inner))
        better = top > np.where(best > 0, best * (1 + TIED), best)
        best, place = np.where(better, top, best), np.where(better, arc, place)
        chosen, where = np.where(better, number, chosen), np.where(better, fraction, where)
    return best, np.clip(place, 0.0, 1.0), chosen, where


def _top(series: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest values of Legendre series (p, c, k) on [0, 1], (p, c), and where they are."""
    low, high = np.full(series.shape[:-1], -1.0), np.full(series.shape[:-1], 1.0)
    steps = np.linspace(0.0, 1.0, N_GRID)
    first = series @ legendre.legvander(2 * steps - 1, series.shape[-1] - 1).T
    values, grid = first, np.broadcast_to(2 * steps - 1, first.shape)
    for zoom in range(N_ZOOMS):
        if zoom:
            grid = low[..., None] + (high - low)[..., None] * steps
            values = _evaluate(series, grid)
        at = values.argmax(axis=-1)[..., None]
        top = np.take_along_axis(values, at, -1)[..., 0]
        low = np.take_along_axis(grid, np.maximum(at - 1, 0), -1)[..., 0]
        high = np.take_along_axis(grid, np.minimum(at + 1, N_GRID - 1), -1)[..., 0]
        middle = np.take_along_axis(grid, at, -1)[..., 0]
    return top, (1 + middle) / 2


def _evaluate(series: FloatArray, grid: FloatArray) -> FloatArray:
    """Return Legendre series (..., k) at places (..., m) of their own, by Clenshaw's recurrence."""
    ahead, last = np.zeros_like(grid), np.zeros_like(grid)
    for k in range(series.shape[-1] - 1, 0, -1):
        ahead, last = series[..., k, None] + (2 * k + 1) / (k + 1) * grid * ahead - (k + 1) / (k + 2) * last, ahead
    return np.asarray(series[..., 0, None] + grid * ahead - 0.5 * last)


def signed_extremes(net: Network, at: Equilibria, beam: str, axial: bool) -> SideExtremes:
    """Return the highest and lowest stress on both sides of a beam at every point."""
    sense = np.array([1.0, -1.0, 1.0, -1.0])  # of highest and lowest
    signs = np.stack([sense * [1.0, 1.0, -1.0, -1.0], sense * float(axial)], axis=1)
    value, place, element, fraction = extremes(net, at, beam, signs)
    return SideExtremes(*(a.reshape(-1, 2, 2) for a in (value * sense, place, element, fraction)))


def largest_stress(net: Network, at: Equilibria, beam: str, axial: bool) -> tuple[FloatArray, FloatArray]:
    """Return the largest stress of a beam at every point [Pa], and its place as a fraction of the arc length."""
    signs = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] if axial else [(1.0, 0.0), (-1.0, 0.0)]
    value, place, _, _ = extremes(net, at, beam, np.array(signs))
    best = value.argmax(axis=1)[:, None]
    return np.take_along_axis(value, best, 1)[:, 0], np.take_along_axis(place, best, 1)[:, 0]


def stress_at(net: Network, at: Equilibria, beam: str, element: Any, fraction: Any, axial: bool) -> Any:
    """Return the stress on both sides of a beam at places of its own for every point, (p, 2, n).

    Parameters
    ----------
    net, at, beam : Network, Equilibria, str
        As of `states`; with complex steps, too.
    element, fraction : (p, 2, n) arrays
        As of `SideExtremes`.
    axial : bool
        Whether the stress has its axial part.
    """
    fractions, to_series = places(at.network.degree + N_MORE_PLACES)
    found = np.zeros(np.shape(fraction), at.z.dtype)
    sides = np.array([1.0, -1.0])[:, None]
    for number, own in enumerate(elements_of(at.network, beam)):
        here = element == number
        if not here.any():
            continue
        seen = sections(net, beam, states_of_elements(net, at, [own], fractions))
        bending, pull = (
            np.moveaxis(legendre.legvander(2 * fraction - 1, len(fractions) - 1), -1, 0)
            * np.moveaxis(values @ to_series.T, -1, 0)[:, :, None, None]
            for values in (seen.bending_stress, seen.axial_stress)
        )
        stress = sides * bending.sum(axis=0) + (pull.sum(axis=0) if axial else 0.0)
        found = np.where(here, stress, found)
    return found
