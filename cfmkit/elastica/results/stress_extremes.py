"""Largest stresses along beams and their places: at the points of an equilibrium path, and between them.

On an element the bending moment is a polynomial and the normal force as smooth as its rotation, so that a polynomial
through as many places as the element resolves has the stress to the element's own accuracy; its extreme is found by
Newton's method from the highest place of a grid. All elements of some beams are looked at together.

Between the points of a path a cubic through the points alone is wrong where the stress of a beam has an extreme, so the
equilibrium is solved there, and where the stress passes a limit. The places and stresses of a beam, with those solved
ones inserted, are called its knots.
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
from cfmkit.numerics.interpolation import crossings, inner_extremes_of_rows, values_at

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.design_derivatives import Equilibria
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.results.beam_states import BeamSections, BeamStates

    Knots = tuple[FloatArray, FloatArray]  # places, increasing, and stresses of one beam
    Solve = Callable[[FloatArray], tuple[FloatArray, Any]]


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
    """Return the highest of c combinations of bending and axial stress, with factors (c, 2), along b beams.

    They are values [Pa], fractions of the arc length, numbers of elements on the beam, and places on these, (b, p, c).
    """
    beam_elements = [elements_of(at.mesh, beam) for beam in beams]
    elements = [number for numbers in beam_elements for number in numbers]
    widths = np.array([net.beams[at.mesh.elements.beam[number]].section.width for number in elements])

    def find_forces(some: slice, fractions: Any) -> tuple[BeamStates, Any]:
        part = replace(at, z=at.z[some], drive=at.drive[some])
        return forces_of_elements(net, part, elements, fractions), np.repeat(widths, len(fractions))

    return _highest(beam_elements, _find_tops(at, len(elements), signs, find_forces))


def extremes_of_designs(
    networks: Sequence[Network], meshes: Sequence[Discretisation], at: Equilibria, row: Any, signs: FloatArray
) -> FloatArray:
    """Return the highest combinations along all beams of some designs, (b, p, c); see `forces_of_designs`."""

    def find_forces(some: slice, fractions: Any) -> tuple[BeamStates, Any]:
        part = replace(at, z=at.z[some], drive=at.drive[some])
        return forces_of_designs(networks, meshes, part, row[some], fractions)

    beam_elements = [elements_of(at.mesh, beam) for beam in networks[0].beams]
    return np.asarray(_highest(beam_elements, _find_tops(at, len(at.mesh.elements.beam), signs, find_forces))[0])


def _find_tops(
    at: Equilibria, count: int, signs: FloatArray, find_forces: Callable[[slice, Any], tuple[BeamStates, Any]]
) -> list[tuple[Any, Any, Any]]:
    """Return the highest stresses on each of m elements, places on their beams and on them, in pieces of the points.

    `find_forces` returns forces at some points and fractions of the elements, and widths there.
    """
    fractions, to_series = places(at.mesh.degree + N_MORE_PLACES)
    together, tops = max(1, MAX_TOGETHER // max(1, count * len(signs) * N_GRID)), []
    for k in range(0, max(1, len(at.z)), together):
        forces, widths = find_forces(slice(k, k + together), fractions)
        arcs = forces.place.reshape(*forces.place.shape[:-1], count, len(fractions))
        arcs = arcs if arcs.ndim == 3 else arcs[None]
        tops.append(_element_tops(sections_of_width(widths, forces), arcs, signs, to_series))
    return tops


def _highest(
    beam_elements: Sequence[Sequence[int]], parts: Sequence[tuple[Any, Any, Any]]
) -> tuple[Any, Any, Any, Any]:
    """Return the highest stress of each beam [Pa], its place, element and fraction of the element, (b, p, c) each.

    `parts` come from `_element_tops` for all elements, in pieces of the points; of equal stresses the first one counts.
    """
    value, place, fraction = (np.concatenate(column, axis=1) for column in zip(*parts, strict=True))
    shape, end = (len(beam_elements), *value.shape[1:]), 0
    best, chosen = np.full(shape, -np.inf), np.zeros(shape, int)
    arc, where = np.zeros(shape), np.zeros(shape)
    for k, numbers in enumerate(beam_elements):
        for number in range(len(numbers)):
            better = value[end] > np.where(best[k] > 0, best[k] * (1 + STRESS_RTOL), best[k])
            best[k], chosen[k] = np.where(better, value[end], best[k]), np.where(better, number, chosen[k])
            arc[k], where[k] = np.where(better, place[end], arc[k]), np.where(better, fraction[end], where[k])
            end += 1
    return best, np.clip(arc, 0.0, 1.0), chosen, where


def _element_tops(seen: BeamSections, arcs: Any, signs: FloatArray, to_series: FloatArray) -> tuple[Any, Any, Any]:
    """Return the highest stresses on elements, (m, p, c), from sections at their places, arc lengths (p or 1, m, k)."""
    shape = len(seen.bending_stress), *arcs.shape[1:]
    both = np.array([seen.bending_stress, seen.axial_stress]).reshape(2, *shape)
    series = np.einsum("cs,spmk->mpck", signs, both) @ to_series.T
    top, x = _series_maximum(series)
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


def _series_maximum(series: FloatArray) -> tuple[FloatArray, FloatArray]:
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
    value, place, element, fraction = (array[0] for array in extremes(net, at, [beam], signs))
    return SideExtremes(*(a.reshape(-1, 2, 2) for a in (value * sense, place, element, fraction)))


def largest_stresses(net: Network, at: Equilibria, beams: Sequence[str], axial: bool) -> tuple[FloatArray, FloatArray]:
    """Return the largest stress of each of b beams at every point, (b, p) [Pa], and its place on the arc length."""
    value, place, _, _ = extremes(net, at, beams, _side_factors(axial))
    best = value.argmax(axis=-1)[..., None]
    return np.take_along_axis(value, best, -1)[..., 0], np.take_along_axis(place, best, -1)[..., 0]


def _side_factors(axial: bool) -> FloatArray:
    """Return the factors of bending and axial stress on the sides of a beam, (c, 2)."""
    both = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
    return np.array(both if axial else [(1.0, 0.0), (-1.0, 0.0)])


def largest_stresses_of_designs(
    networks: Sequence[Network], meshes: Sequence[Discretisation], at: Equilibria, row: Any, axial: bool
) -> FloatArray:
    """Return the largest stress of each of b beams at points of some designs, (b, p) [Pa]; see `forces_of_designs`."""
    return np.asarray(extremes_of_designs(networks, meshes, at, row, _side_factors(axial)).max(axis=-1))


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
    stresses = np.zeros(np.shape(fraction), at.z.dtype)
    sides = np.array([1.0, -1.0])[:, None]
    for number, mesh_element in enumerate(elements_of(at.mesh, beam)):
        is_on_element = element == number
        if not is_on_element.any():
            continue
        seen = sections(net, beam, forces_of_elements(net, at, [mesh_element], fractions))
        bending, pull = (
            np.moveaxis(legendre.legvander(2 * fraction - 1, len(fractions) - 1), -1, 0)
            * np.moveaxis(values @ to_series.T, -1, 0)[:, :, None, None]
            for values in (seen.bending_stress, seen.axial_stress)
        )
        stress = sides * bending.sum(axis=0) + (pull.sum(axis=0) if axial else 0.0)
        stresses = np.where(is_on_element, stress, stresses)
    return stresses


N_EXTREME_ROUNDS = 3  # rounds in which extremes are located and solved for: the third moves them by less than rounding
CANDIDATE_SHARE = 0.9
"""Share of the largest stress of all beams from which on an extreme of one beam may be the largest."""
N_FIRST_POINTS = 24  # points at which the stress is computed first
NEIGHBOUR_SHARE = 0.95  # share of the largest stress at these from which on the largest of all may be near
STENCIL_REACH = 4  # points on either side that a cubic, or the next one, may go through


def solve_extremes(
    # t, rows: (n,), (b, n): places of points, increasing, and the stress of each of b beams there [Pa]
    t: FloatArray,
    rows: FloatArray,
    solve: Solve,  # from places (m,) to stresses (b, m) and whether they were found, (m,)
    bound: float = 0.0,  # beams that are stressed less at all points are left as they are [Pa]
) -> tuple[Knots, ...]:
    """Return places and stresses of each beam, with extremes that may be the largest of all."""
    return solve_all_extremes([(t, rows, bound)], lambda places: [solve(places[0])])[0]


def solve_all_extremes(
    curves: Sequence[tuple[FloatArray, FloatArray, float]],
    solve: Callable[[list[FloatArray]], list[tuple[FloatArray, Any]]],
) -> list[tuple[Knots, ...]]:
    """Return the results of `solve_extremes` for several curves; `solve` takes places, or none, of each in one call."""
    knots_by_curve = [[(t, row) for row in rows] for t, rows, _ in curves]
    largest = [rows.max(axis=0) for _, rows, _ in curves]
    for _ in range(N_EXTREME_ROUNDS):
        stressed = [
            [
                beam_knots if beam_knots[1].max() >= bound else (beam_knots[0][:0], beam_knots[1][:0])
                for beam_knots in knots
            ]
            for knots, (_, _, bound) in zip(knots_by_curve, curves, strict=True)
        ]
        places = iter(inner_extremes_of_rows([beam_knots for knots in stressed for beam_knots in knots]))
        more = [
            [_keep_tops(beam_knots, next(places), t, top) for beam_knots in knots]
            for knots, (t, _, _), top in zip(knots_by_curve, curves, largest, strict=True)
        ]
        if not any(len(places) for places_by_beam in more for places in places_by_beam):
            break
        solved = solve([np.concatenate(places_by_beam) for places_by_beam in more])
        knots_by_curve = [
            _add_solved(knots, knots, places_by_beam, *answer) if any(map(len, places_by_beam)) else knots
            for knots, places_by_beam, answer in zip(knots_by_curve, more, solved, strict=True)
        ]
    return [tuple(knots) for knots in knots_by_curve]


def largest_inside(
    x: FloatArray,  # (n,): places of the points, increasing
    stresses: Callable[[Any], FloatArray],  # from numbers of points to the stress of each of b beams there, (b, m) [Pa]
    solve: Solve,  # as of `solve_extremes`
    window: FloatArray,  # (2,): minus infinity is returned if no point and no extreme between two is inside
) -> float:
    """Return the largest stress of all beams at and between points of a smooth path inside of a window [Pa].

    The stress is computed at few points first; then at all of those near which it may be the largest.
    """
    few = choose_few_points(x, *window)
    known_stresses = stresses(few)
    more = find_near_largest(x, few, known_stresses, *window)
    if len(more):
        few = np.concatenate([few, more])
        known_stresses = np.concatenate([known_stresses, stresses(more)], axis=1)
        order = np.argsort(few, kind="stable")
        few, known_stresses = few[order], known_stresses[:, order]
    runs = runs_of_points(x, few, known_stresses, window)
    return largest_of_runs(x, few, known_stresses, window, [solve_extremes(*run[:2], solve, run[2]) for run in runs])


def choose_few_points(x: FloatArray, low: float, high: float) -> NDArray[np.intp]:
    """Return the numbers of points at which the stress is computed first, in a window and next to it."""
    first = max(int(np.searchsorted(x, low)) - STENCIL_REACH, 0)
    last = min(int(np.searchsorted(x, high, side="right")) + STENCIL_REACH, len(x)) - 1
    return np.append(np.arange(first, last, max(1, (last - first) // N_FIRST_POINTS)), last)


def find_near_largest(
    x: FloatArray, few: NDArray[np.intp], stresses: FloatArray, low: float, high: float
) -> NDArray[np.intp]:
    """Return which other points are near the largest stress, from the stresses (b, m) at few of them."""
    first, last = int(few[0]), int(few[-1])
    inside = (x[few] >= low) & (x[few] <= high)
    top = stresses[:, inside].max(initial=0.0)
    guess = values_at(x[few], stresses.T, x[first : last + 1]).max(axis=1)
    nearby = first + np.flatnonzero(guess >= NEIGHBOUR_SHARE * top)
    wanted = np.zeros(len(x), dtype=bool)
    for step in range(-STENCIL_REACH, STENCIL_REACH + 1):
        wanted[np.clip(nearby + step, first, last)] = True
    wanted[few] = False
    return np.flatnonzero(wanted)


def runs_of_points(
    x: FloatArray, points: NDArray[np.intp], stresses: FloatArray, window: FloatArray
) -> list[tuple[FloatArray, FloatArray, float]]:
    """Return places and stresses (b, n) of neighbouring points between which the largest may be, and a bound to it."""
    inside = (x[points] >= window[0]) & (x[points] <= window[1])
    bound = NEIGHBOUR_SHARE * stresses[:, inside].max(initial=-np.inf)
    parts = np.split(np.arange(len(points)), np.flatnonzero(np.diff(points) > 1) + 1)
    runs = [(x[points[part]], stresses[:, part], bound) for part in parts if len(part) > 3]
    return [run for run in runs if run[1].max() >= bound]


def largest_of_runs(
    x: FloatArray, points: NDArray[np.intp], stresses: FloatArray, window: FloatArray, runs: Sequence[Sequence[Knots]]
) -> float:
    """Return the largest stress inside of a window, of points and of runs whose extremes are known [Pa]."""
    at_points = [(x[points], row) for row in stresses]
    every = [*at_points, *(knots for run in runs for knots in run)]
    tops = (y[(t >= window[0]) & (t <= window[1])].max(initial=-np.inf) for t, y in every)
    return float(max(tops))


def solve_passes(knots: tuple[Knots, ...], t: FloatArray, solve: Solve, allowed: float) -> tuple[Knots, ...]:
    """Return knots of each beam with the places where its stress passes the allowable one [Pa].

    They are those of the last of some rounds only: knots that nearly coincide spoil a cubic.
    """
    all_knots = list(knots)
    for _ in range(N_EXTREME_ROUNDS):
        more = [_find_passes(beam_knots, allowed, t) for beam_knots in all_knots]
        if not any(map(len, more)):
            break
        all_knots = _add_solved(all_knots, list(knots), more, *solve(np.concatenate(more)))
    return tuple(all_knots)


def _keep_tops(knots: Knots, top: FloatArray, t: FloatArray, largest: FloatArray) -> FloatArray:
    """Return those of the extremes of the stress of a beam that may be the largest of all."""
    ways, values = knots
    beside = np.searchsorted(ways, top)
    return top[np.maximum(values[beside - 1], values[beside]) >= CANDIDATE_SHARE * np.interp(top, t, largest)]


def _find_passes(knots: Knots, allowed: float, known_places: FloatArray) -> FloatArray:
    """Return where the stress of a beam passes the allowable one, but for known places."""
    return np.array(sorted({*crossings(*knots, allowed)} - {*known_places.tolist()}))


def _add_solved(
    cubics: list[Knots], knots: list[Knots], more: list[FloatArray], stresses: FloatArray, accurate: Any
) -> list[Knots]:
    """Return the knots of each beam with more places: stresses as solved, or on its cubic where that failed."""
    extended_knots: list[Knots] = []
    end = 0
    for beam_knots, cubic, places, row in zip(knots, cubics, more, stresses, strict=True):
        mine = slice(end, end := end + len(places))
        stress = row[mine]
        if not accurate[mine].all():
            stress = np.where(accurate[mine], stress, values_at(*cubic, places))
        extended_knots.append(insert_knots(*beam_knots, places, stress) if len(places) else cubic)
    return extended_knots


def insert_knots(x: FloatArray, y: FloatArray, places: FloatArray, values: FloatArray) -> Knots:
    """Return increasing places with some more among them, and their values."""
    at = np.searchsorted(x, places)
    return np.insert(x, at, places), np.insert(y, at, values)
