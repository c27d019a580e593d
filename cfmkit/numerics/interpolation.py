"""Interpolation: cubics through neighbours with crossings and extremes, monotone cubics, polynomials at nodes, panels.

- Between the samples of a smooth function: the cubic through the four nearest of them; its error goes with the fourth
  power of the spacing. The first argument increases; nothing here sorts or bridges a fold.
- A function through points that neither overshoots nor rings: straight lines, or monotone cubics [FB]. Beyond its first
  and last point it keeps its end values. Values, slopes and integrals are those of the same polynomials, so that an
  integral differentiates back to the value to rounding.
- Polynomials through values at nodes: their values elsewhere and their slopes, as matrices [BT].
- Functions as a row of Chebyshev polynomials, one per panel [T, ch. 2-4]. A panel's polynomial goes through the values
  at its nodes, none of which is an end: a jump or a kink between two panels does no harm. How fast the coefficients
  fall says whether a panel is short enough.

References
----------
[FB] F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants,
    SIAM J. Sci. Stat. Comput. 5 (1984): what scipy's ``PchipInterpolator`` does.
[BT] J.-P. Berrut, L. N. Trefethen, Barycentric Lagrange interpolation, SIAM Review 46 (2004) 501.
[T] L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM (2013).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import chebyshev

from cfmkit.arrays import ShortRepr, distinct

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray


_N_HALVINGS = 60


def value_at(x: FloatArray, y: FloatArray, place: float) -> float:
    """Return the cubic's value at one place between the first and the last sample.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 3.0, 4.0, 6.0])
    >>> round(value_at(x, x**3, 2.0), 12)
    8.0
    """
    count = min(4, len(x))
    first = min(max(int(np.searchsorted(x, place)) - 2, 0), len(x) - count)
    places_of_row, values = x[first : first + count].tolist(), y[first : first + count].tolist()
    total = 0.0
    for i in range(count):
        weight = 1.0
        for j in range(count):
            if j != i:
                weight *= (float(place) - places_of_row[j]) / (places_of_row[i] - places_of_row[j])
        total += weight * values[i]
    return total


def values_at(x: FloatArray, y: FloatArray, places: FloatArray) -> FloatArray:
    """Return the cubic's values at many places, (n,) or of samples (m, k) all columns, (n, k); see `value_at`."""
    count = min(4, len(x))
    first = np.clip(np.searchsorted(x, places) - 2, 0, len(x) - count)
    nodes = first[:, None] + np.arange(count)
    return _values_of_polynomials(x[nodes], y[nodes], places)


EXTREME_RTOL = 1e-10
"""Height of an extreme over the samples around it, in parts of the largest, below which it is rounding."""


def inner_extremes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return where the cubics between samples rise above or fall below both samples around them, increasing.

    Examples
    --------
    >>> x = np.array([-1.5, -0.6, 0.5, 1.0, 2.0])
    >>> inner_extremes(x, x**2).round(12).tolist()
    [0.0]
    """
    return inner_extremes_of_rows([(x, y)])[0]


def inner_extremes_of_rows(rows: Sequence[tuple[FloatArray, FloatArray]]) -> list[FloatArray]:
    """Return `inner_extremes` of several functions, each with samples of its own."""
    long = [(x, y) for x, y in rows if len(x) >= 4]
    if not long:
        return [np.zeros(0) for _ in rows]
    counts = np.array([len(x) for x, _ in long])
    ends = np.cumsum(counts)
    x, y = (np.concatenate(column) for column in zip(*long, strict=True))
    row = np.repeat(np.arange(len(long)), counts - 1)
    left = np.arange(len(row)) + row  # the last sample of a row begins no step
    first = np.clip(left - 1, (ends - counts)[row], ends[row] - 4)[:, None] + np.arange(4)
    neighbours, values = x[first], y[first]
    t = neighbours - x[left][:, None]
    slopes = np.diff(values, axis=1) / np.diff(t, axis=1)
    second = np.diff(slopes, axis=1) / (t[:, 2:] - t[:, :-2])
    third = (second[:, 1] - second[:, 0]) / (t[:, 3] - t[:, 0])
    # Newton's form as powers of t: the slope is c + 2 b t + 3 a t^2
    a, b = third, second[:, 0] - third * t[:, :3].sum(axis=1)
    c = slopes[:, 0] - second[:, 0] * (t[:, 0] + t[:, 1])
    c += third * (t[:, 0] * t[:, 1] + t[:, 0] * t[:, 2] + t[:, 1] * t[:, 2])
    width = x[left + 1] - x[left]
    with np.errstate(invalid="ignore", divide="ignore"):
        root = -(b + np.copysign(np.sqrt(b * b - 3.0 * a * c), b))
        places = np.stack([root / (3.0 * a), c / root], axis=1)
        inside = (places > 0.0) & (places < width[:, None])
    step, which = np.nonzero(inside)
    roots = x[left[step]] + places[step, which]
    heights = _values_of_polynomials(neighbours[step], values[step], roots)
    least = (EXTREME_RTOL * np.maximum.reduceat(np.abs(y), ends - counts))[row[step]]
    before, behind = y[left[step]], y[left[step] + 1]
    turns = (heights > np.maximum(before, behind) + least) | (heights < np.minimum(before, behind) - least)
    roots, row = roots[turns], row[step][turns]
    roots_of_rows = iter([distinct(roots[row == k]) for k in range(len(long))])
    return [next(roots_of_rows) if len(x) >= 4 else np.zeros(0) for x, _ in rows]


def _values_of_polynomials(neighbours: FloatArray, values: FloatArray, places: FloatArray) -> FloatArray:
    """Return the polynomials through some samples each, (n, k), at one place each, (n,)."""
    total, count = np.zeros((len(places), *values.shape[2:])), neighbours.shape[1]
    for i in range(count):
        weight = np.ones(len(places))
        for j in range(count):
            if j != i:
                weight *= (places - neighbours[:, j]) / (neighbours[:, i] - neighbours[:, j])
        total += weight.reshape(-1, *[1] * (values.ndim - 2)) * values[:, i]
    return total


def crossing(x: FloatArray, y: FloatArray, level: float) -> float | None:
    """Return where the function first reaches a level from below; None if it never does."""
    reached = np.flatnonzero(y >= level)
    if not len(reached):
        return None
    index = int(reached[0])
    if index == 0:
        return float(x[0])
    return bisect(lambda place: value_at(x, y, place) >= level, float(x[index - 1]), float(x[index]))


def crossings(x: FloatArray, y: FloatArray, level: float) -> list[float]:
    """Return where the function passes a level between two samples, in either direction, increasing.

    Examples
    --------
    >>> x = np.array([-3.0, -1.0, 1.0, 3.0, 4.0])
    >>> np.round(crossings(x, x**2, 4.0), 12).tolist()
    [-2.0, 2.0]
    """
    above = y >= level

    def has_passed(place: float, up: bool) -> bool:
        return (value_at(x, y, place) >= level) == up

    steps = np.flatnonzero(above[1:] != above[:-1])
    return [bisect(partial(has_passed, up=bool(above[k + 1])), float(x[k]), float(x[k + 1])) for k in steps.tolist()]


def bisect(holds: Callable[[float], bool], low: float, high: float) -> float:
    """Return the place between `low`, where a condition fails, and `high`, where it holds, from which on it holds."""
    for _ in range(_N_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def first_extreme(
    x: FloatArray, y: FloatArray, sign: int = 1, after: float = -np.inf, corners: FloatArray | None = None
) -> tuple[float, float] | None:
    """Return place and value of the first inner maximum (sign 1) or minimum (-1) after a place; None without one.

    An extreme of the samples that is one of some corners is the extreme: no cubic goes across it.
    """
    z = sign * y
    top = (z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:]) & (x[1:-1] > after)
    if not top.any():
        return None
    index = int(np.argmax(top)) + 1
    if corners is not None and x[index] in corners:
        return float(x[index]), float(y[index])
    low, high = float(x[index - 1]), float(x[index + 1])
    ratio = 0.5 * (np.sqrt(5.0) - 1)
    for _ in range(_N_HALVINGS):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if sign * value_at(x, y, left) > sign * value_at(x, y, right):
            high = right
        else:
            low = left
    place = 0.5 * (low + high)
    return place, value_at(x, y, place)


NEWTON_STEPS = 6
"""Towards an integral within one piece: the first guess is that of a straight line, which most curves are made of."""


@dataclass(frozen=True)
class ThroughPoints:
    """A function through points.

    Examples
    --------
    >>> step = ThroughPoints((0.0, 1.0, 2.0, 3.0), (1.0, 1.0, 2.0, 2.0))
    >>> [float(step.evaluate(x)) for x in (-1.0, 0.5, 1.5, 9.0)]
    [1.0, 1.0, 1.5, 2.0]
    >>> float(step.integral(3.0))
    4.5
    """

    places: tuple[float, ...]  # increasing, at least two
    values: tuple[float, ...]  # one for each place
    smooth: bool = True  # monotone cubics with a continuous slope; else straight lines

    @cached_property
    def _knots(self) -> FloatArray:
        return np.array(self.places)

    @cached_property
    def _coefficients(self) -> tuple[FloatArray, ...]:
        """Coefficients of 1, t, t^2, t^3 on each piece, t from its start, (n - 1,) each."""
        y, h = np.array(self.values), np.diff(self._knots)
        rise = np.diff(y) / h
        if not self.smooth or len(y) == 2:
            return y[:-1], rise, 0.0 * rise, 0.0 * rise
        from scipy.interpolate import PchipInterpolator

        slope = PchipInterpolator(self._knots, y).derivative()(self._knots)
        second = (3.0 * rise - 2.0 * slope[:-1] - slope[1:]) / h
        third = (slope[:-1] + slope[1:] - 2.0 * rise) / (h * h)
        return y[:-1], slope[:-1], second, third

    @cached_property
    def _integrals_before(self) -> FloatArray:
        """Integral up to the start of each piece."""
        h, (a, b, c, d) = np.diff(self._knots), self._coefficients
        pieces = h * (a + h * (b / 2.0 + h * (c / 3.0 + h * d / 4.0)))
        return np.concatenate([[0.0], np.cumsum(pieces)])[:-1]

    def _piece(self, x: Any) -> tuple[Any, Any]:
        """Return which piece places belong to, and how far into it they are, ends kept."""
        inside = np.clip(x, self._knots[0], self._knots[-1])
        piece = np.clip(np.searchsorted(self._knots, inside, side="right") - 1, 0, len(self._knots) - 2)
        return piece, inside - self._knots[piece]

    def evaluate(self, x: Any) -> Any:
        """Return values at places, a number or an array."""
        piece, t = self._piece(x)
        a, b, c, d = (term[piece] for term in self._coefficients)
        return a + t * (b + t * (c + t * d))

    def slope(self, x: Any) -> Any:
        """Return derivatives at places; at and beyond the ends those of the first and the last piece."""
        piece, t = self._piece(x)
        _, b, c, d = (term[piece] for term in self._coefficients)
        return b + t * (2.0 * c + t * 3.0 * d)

    def integral(self, x: Any) -> Any:
        """Return integrals from the first place."""
        piece, t = self._piece(x)
        a, b, c, d = (term[piece] for term in self._coefficients)
        beyond = np.asarray(x) - np.clip(x, self._knots[0], self._knots[-1])
        areas = t * (a + t * (b / 2.0 + t * (c / 3.0 + t * d / 4.0)))
        return self._integrals_before[piece] + areas + beyond * (a + t * (b + t * (c + t * d)))

    def invert_integral(
        self,
        values: FloatArray,  # wanted
        less: float = 0.0,  # below the function, or little above where that is near zero
    ) -> FloatArray:
        """Return places up to which the integral of the function less a constant is as wanted.

        By Newton's method on the piece of each value: exact in the digits of the way into the piece. Where a piece
        bends much, or a value is beyond the ends, it may not get there: the integral tells.

        Examples
        --------
        >>> ramp = ThroughPoints((0.0, 2.0), (0.0, 4.0))
        >>> ramp.invert_integral(np.array([0.0, 1.0, 4.0])).tolist()
        [0.0, 1.0, 2.0]
        """
        starts, widths = self._integrals_before - less * self._knots[:-1], np.diff(self._knots)
        piece = np.clip(np.searchsorted(starts, values, side="right") - 1, 0, len(widths) - 1)
        a, b, c, d = (term[piece] for term in self._coefficients)
        a, left, width = a - less, np.maximum(values - starts[piece], 0.0), widths[piece]
        root = np.sqrt(np.maximum(a * a + 2.0 * b * left, 0.0))  # of a straight line it is this
        step = np.minimum(2.0 * left / np.maximum(a + root, 1e-300), width)
        for _ in range(NEWTON_STEPS):
            rate = np.maximum(a + step * (b + step * (c + step * d)), 1e-300)
            excess = step * (a + step * (b / 2.0 + step * (c / 3.0 + step * d / 4.0))) - left
            step = np.minimum(np.maximum(step - excess / rate, 0.0), width)
        return self._knots[piece] + step

    def extremes(self, low: float, high: float) -> tuple[float, float]:
        """Return the smallest and the largest value between two places: these functions have no extreme off a point."""
        between = self._knots[(self._knots > low) & (self._knots < high)]
        values = self.evaluate(np.concatenate([[low], between, [high]]))
        return float(values.min()), float(values.max())


def interpolation(nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Return the matrix from values at nodes (n,) to those of their polynomial at places, (m, n) [BT, eq. 4.2].

    Examples
    --------
    >>> (interpolation(np.array([0.0, 1.0, 2.0]), np.array([1.5, 2.0])) @ [0.0, 1.0, 4.0]).round(12).tolist()
    [2.25, 4.0]
    """
    gaps = places[:, None] - nodes
    hit = np.abs(gaps) < 1e-14
    terms = _barycentric_weights(nodes) / np.where(hit, 1.0, gaps)
    matrix: FloatArray = terms / terms.sum(axis=1, keepdims=True)
    exact = hit.any(axis=1)
    matrix[exact] = hit[exact]
    return matrix


def differentiation(nodes: FloatArray) -> FloatArray:
    """Return the matrix from values at nodes to slopes of their polynomial there, (n, n) [BT, eq. 9.4].

    Examples
    --------
    >>> (differentiation(np.array([0.0, 1.0, 2.0])) @ [0.0, 1.0, 4.0]).round(12).tolist()
    [0.0, 2.0, 4.0]
    """
    weights, gaps = _barycentric_weights(nodes), nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    matrix: FloatArray = weights / weights[:, None] / gaps
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


def _barycentric_weights(nodes: FloatArray) -> FloatArray:
    gaps = nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    return np.asarray(1.0 / gaps.prod(axis=1))


N_PANEL_NODES = 16  # of a panel
MAX_PLACES = 1000
"""Places at which functions are requested at once, after which halving ends: strips and flexures need some hundreds,
and a force that is rounding alone, as that of a leg 100 m long, would never be resolved."""
_UNIT_NODES = chebyshev.chebpts1(N_PANEL_NODES)
_COEFFICIENT_TRANSFORM = (
    chebyshev.chebvander(_UNIT_NODES, N_PANEL_NODES - 1).T
    * (np.where(np.arange(N_PANEL_NODES), 2.0, 1.0) / N_PANEL_NODES)[:, None]
)


@dataclass(frozen=True, repr=False)
class ChebyshevPanels(ShortRepr):
    """A function that is one polynomial on each panel."""

    ends: FloatArray  # (k + 1,) of the panels, increasing
    # (k, 2) what each polynomial was made over: its panel, or the most of it where no value could be had at an end
    spans: FloatArray
    coefficients: FloatArray  # (k, N_PANEL_NODES) of the Chebyshev polynomials; NaN where a node is not known

    def evaluate(self, x: FloatArray) -> FloatArray:
        """Return the function at some places, by Clenshaw's recurrence; beyond the ends by the nearest panel's."""
        panel = np.searchsorted(self.ends[1:-1], x, side="right")
        low, high = self.spans[panel].T
        t = (2.0 * x - low - high) / (high - low)
        c, b, b_before = self.coefficients[panel], np.zeros(x.shape), np.zeros(x.shape)
        for k in range(N_PANEL_NODES - 1, 0, -1):
            b, b_before = c[..., k] + 2.0 * t * b - b_before, b
        return np.asarray(c[..., 0] + t * b - b_before)


def nodes_of(panel: tuple[float, float]) -> FloatArray:
    """Return the nodes of a panel between two ends, increasing."""
    low, high = panel
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * _UNIT_NODES)


def coefficients(panel: tuple[float, float], x: FloatArray, values: FloatArray) -> FloatArray:
    """Return the Chebyshev coefficients of a panel from values at places that hold its nodes; NaN if one is missing.

    Examples
    --------
    >>> x = nodes_of((0.0, 2.0))
    >>> coefficients((0.0, 2.0), x, x**2)[:3].round(12).tolist()
    [1.5, 2.0, 0.5]
    """
    nodes = nodes_of(panel)
    at = np.minimum(np.searchsorted(x, nodes), len(x) - 1)
    return np.asarray(_COEFFICIENT_TRANSFORM @ np.where(x[at] == nodes, values[at], np.nan))


def resolve_panels(
    # all functions at increasing places, (n,) -> (m, n). Where halves lack a value, their panel is kept as it is
    functions: Callable[[FloatArray], FloatArray],
    ends: FloatArray,  # (k + 1,): of the panels at first, increasing
    # size of the last coefficients of each function, relative to the largest value seen, at which it has converged
    close: Sequence[float],
    # at most so many of a panel, for functions with corners; none follows a round of more than `MAX_PLACES` places
    halvings: int,
) -> tuple[ChebyshevPanels, ...]:
    """Return functions as panels, each halved until the polynomials of all functions have converged on it.

    Examples
    --------
    >>> (bow,) = resolve_panels(lambda x: np.abs(x - 0.3)[None, :], np.array([0.0, 1.0]), (1e-6,), 12)
    >>> float(bow.evaluate(np.array([0.75]))[0].round(12)), len(bow.ends) > 4
    (0.45, True)
    """
    wanted = list(pairwise(np.asarray(ends).tolist()))
    parents: dict[tuple[float, float], list[FloatArray]] = {}
    done: dict[tuple[float, float], list[FloatArray]] = {}
    largest = np.zeros(len(close))
    for left in range(halvings, -1, -1):
        places = np.unique(np.concatenate([nodes_of(panel) for panel in wanted]))
        values = functions(places)
        if parents and not np.isfinite(values).all():
            done |= parents
            break
        largest = np.fmax(largest, np.nanmax(np.abs(values), axis=1, initial=0.0))
        rough: dict[tuple[float, float], list[FloatArray]] = {}
        for panel in wanted:
            series = [coefficients(panel, places, row) for row in values]
            tails = np.array([np.abs(values[-3:]).max() for values in series])
            (rough if left and len(places) <= MAX_PLACES and (tails > close * largest).any() else done)[panel] = series
        if not rough:
            break
        middles = {panel: 0.5 * (panel[0] + panel[1]) for panel in rough}
        parents = rough
        wanted = [half for (low, high), at in middles.items() for half in ((low, at), (at, high))]
    ordered = sorted(done)
    borders, spans = np.array([low for low, _ in ordered] + [ordered[-1][1]]), np.array(ordered)
    return tuple(
        ChebyshevPanels(borders, spans, np.array([done[panel][k] for panel in ordered])) for k in range(len(close))
    )
