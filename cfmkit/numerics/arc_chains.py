"""Chains of circular arcs and straight lines (`ArcChain`), and the chain that fits a smooth curve (`fit_arcs`).

A chain is stored by its nodes and bulges. The bulge of a piece is tan(turn / 4), positive when it turns left: zero is a
straight line, one a half circle. Nodes and bulges stay well conditioned however flat a piece is, where centre and
radius do not. Points are complex numbers x + iy throughout.

A curve is given by exact points and unit tangents. Two arcs that meet with a common tangent (a biarc) join any two
points with given tangents. Of the one-parameter family of biarcs the one with equal tangent lengths is taken: it
depends on nothing but the data, turns with them and reverses with them [BM].

Pieces run from sample to sample, each as long as the tolerance allows when the curve is swept from one end, and from
the other. Between these two sets of knots the final ones are chosen, so that all pieces use about the same share of the
tolerance, and a curve run backwards or seen in a mirror gets the same arcs. Beside the distance the angle between curve
and arcs can be bounded, as far as the samples allow: arcs that stay within micrometres may still lean by hundredths.

Between samples the curve is taken to be its cubic Hermite interpolant: on a circle that is nearly the circle, on a
smooth curve it is off by the fourth power of the samples' distance. How far it may be off is estimated by leaving each
sample out in turn, and charged to the tolerance.

Reference
---------
[BM] K. M. Bolton, Biarc curves, Computer-Aided Design 7 (1975) 89-92.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import atan, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cfmkit.arrays import FloatArray, read_only
from cfmkit.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Iterator


ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class ArcChain:
    """A chain of m pieces: `nodes` (m + 1,) complex and `bulges` (m,).

    A closed chain repeats its first node at the end.
    """

    nodes: ComplexArray
    bulges: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", read_only(self.nodes, np.complex128))
        object.__setattr__(self, "bulges", read_only(self.bulges))
        if self.nodes.ndim != 1 or self.nodes.shape != (len(self.bulges) + 1,) or not len(self.bulges):
            raise ValueError("a chain of m >= 1 pieces has m + 1 nodes and m bulges")

    @property
    def chords(self) -> ComplexArray:
        """From each node to the next."""
        return np.diff(self.nodes)

    @property
    def turns(self) -> FloatArray:
        """Angle by which each piece turns to the left [rad]."""
        return np.asarray(4 * np.arctan(self.bulges))

    @property
    def curvatures(self) -> FloatArray:
        """Curvature of each piece, positive to the left [1 / length]."""
        return np.asarray(2 * np.sin(self.turns / 2) / np.abs(self.chords))

    @property
    def tangents(self) -> tuple[ComplexArray, ComplexArray]:
        """Unit tangents at the start and at the end of each piece."""
        along = self.chords / np.abs(self.chords)
        half = np.exp(0.5j * self.turns)
        return along / half, along * half

    @property
    def area(self) -> float:
        """Area that a closed chain encloses, positive when it runs counter-clockwise."""
        polygon = 0.5 * float(np.sum((np.conj(self.nodes[:-1]) * self.nodes[1:]).imag))
        turns, chords = self.turns, np.abs(self.chords)
        # the circular segment between a piece and its chord; the series avoids 0/0 on straight pieces
        flat = np.abs(turns) < 1e-3
        safe = np.where(flat, 1.0, turns)
        segment = np.where(flat, turns / 12, (safe - np.sin(safe)) / (8 * np.sin(safe / 2) ** 2))
        return polygon + float(np.sum(chords**2 * segment))

    def append(self, following: ArcChain) -> ArcChain:
        """Return this chain followed by `following`, whose first node is dropped."""
        return ArcChain(np.append(self.nodes, following.nodes[1:]), np.append(self.bulges, following.bulges))

    def close(self) -> ArcChain:
        """Return the chain with its last node exactly on its first."""
        return ArcChain(np.append(self.nodes[:-1], self.nodes[0]), self.bulges)

    def flatten(self, sagitta: float) -> ComplexArray:
        """Return points on the chain, all nodes among them, whose chords stay within `sagitta` of it."""
        turns = np.abs(self.turns)
        step = np.minimum(np.sqrt(8 * sagitta * np.abs(self.curvatures)), np.pi / 4)
        counts = np.maximum(np.ceil(turns / np.maximum(step, 1e-300)), 1).astype(int)
        piece = np.repeat(np.arange(len(counts)), counts)
        first = np.cumsum(counts) - counts
        fraction = (np.arange(len(piece)) - first[piece]) / counts[piece]
        points = points_on(self.nodes[piece], self.chords[piece], self.turns[piece], fraction)
        return np.append(points, self.nodes[-1])


def points_on(start: ComplexArray, chord: ComplexArray, turn: FloatArray, fraction: FloatArray) -> ComplexArray:
    """Return the point at a fraction of an arc's length, given its start, chord and turn [rad].

    >>> bool(abs(points_on(np.array(1 + 0j), np.array(-2 + 0j), np.array(np.pi), np.array(0.5)) - 1j) < 1e-15)
    True
    """
    share = fraction * np.sinc(fraction * turn / (2 * np.pi)) / np.sinc(turn / (2 * np.pi))
    return np.asarray(start + chord * share * np.exp(0.5j * (fraction - 1) * turn))


_STEP_TURN = 0.8  # of a tangent against the chord to the next sample [rad]


class CoarseDataError(GeometryError):
    """The samples do not determine the curve as closely as asked; `index` is the sample before the doubtful place."""

    def __init__(self, message: str, index: int) -> None:
        super().__init__(message)
        self.index = index

    def __reduce__(self) -> tuple[type[CoarseDataError], tuple[str, int]]:
        return type(self), (str(self), self.index)


def check_samples(points: FloatArray, tangents: FloatArray, tolerance: float) -> tuple[ComplexArray, ComplexArray]:
    """Return the samples as complex numbers once they are known to run along a curve."""
    if len(points) < 2 or not tolerance > 0:
        raise ValueError("a fit needs two samples or more and a tolerance above zero")
    z, t = (np.asarray(values, dtype=np.float64) @ np.array([1, 1j]) for values in (points, tangents))
    if not (np.isfinite(z).all() and np.isfinite(t).all()):
        raise CoarseDataError("a point or tangent is not finite", int(np.argmin(np.isfinite(z) & np.isfinite(t))))
    if (wrong := np.abs(np.abs(t) - 1) > 1e-6).any():
        raise CoarseDataError("a tangent is not of length one", int(np.argmax(wrong)))
    chord = np.diff(z)
    if (same := np.abs(chord) <= 1e-12 * np.abs(z).max()).any():
        raise CoarseDataError("two neighbouring points coincide", int(np.argmax(same)))
    turn = np.maximum(np.abs(np.angle(chord / t[:-1])), np.abs(np.angle(t[1:] / chord)))
    worst = int(np.argmax(turn))
    if turn[worst] > _STEP_TURN:
        raise too_coarse(worst, len(z), f"the tangent is {np.degrees(turn[worst]):.0f} deg off their chord")
    return z, t / np.abs(t)


def too_coarse(index: int, count: int, why: str) -> CoarseDataError:
    """Return the error that says between which samples the curve is not known well enough, and why."""
    return CoarseDataError(
        f"points {index + 1} and {index + 2} of {count} are too far apart for the tolerance, or there is a corner "
        f"between them: {why}; give more points there, or split the curve at the corner",
        index,
    )


def cubic(p0: ComplexArray, t0: ComplexArray, p1: ComplexArray, t1: ComplexArray, f: FloatArray) -> ComplexArray:
    """Return the cubic between end points and unit tangents at fraction `f`."""
    length = _hermite_speed(p0, t0, p1, t1)
    g = 1 - f
    return np.asarray(p0 + (p1 - p0) * f * f * (3 - 2 * f) + length * f * g * (g * t0 - f * t1))


def slope(p0: ComplexArray, t0: ComplexArray, p1: ComplexArray, t1: ComplexArray, f: FloatArray) -> ComplexArray:
    """Return the derivative of `cubic` by `f`."""
    length = _hermite_speed(p0, t0, p1, t1)
    g = 1 - f
    return np.asarray(6 * f * g * (p1 - p0) + length * (g * (1 - 3 * f) * t0 + f * (3 * f - 2) * t1))


def _hermite_speed(p0: ComplexArray, t0: ComplexArray, p1: ComplexArray, t1: ComplexArray) -> FloatArray:
    """Return the length of the end derivatives with which the cubic is nearly the circle where there is one."""
    return np.asarray(2 * np.abs(p1 - p0) / (1 + np.sqrt((1 + (t0.conj() * t1).real) / 2)))


def doubt(z: ComplexArray, t: ComplexArray) -> FloatArray:
    """Return how far the curve may be from its interpolant between each two samples.

    The interpolant that skips a sample misses it by e = f'''' a^2 b^2 / 24, with a and b the distances to its
    neighbours; the one that does not is off by f'''' a^4 / 384 at most. It also misses the tangent there, by 2 e (1/a -
    1/b); where it misses it by more, the curve is no smooth one: a corner by the angle q leaves q a / 8. Of two samples
    alone, the curve lies between the two arcs that touch it at one end.
    """
    step = np.abs(np.diff(z))
    if len(z) == 2:
        chord = z[1] - z[0]
        lens = np.tan(np.angle(chord / t[0]) / 2) - np.tan(np.angle(t[1] / chord) / 2)
        return np.asarray(np.abs(step / 2 * lens))
    before, after = step[:-1], step[1:]
    miss, turn = _miss_of_neighbours(z, t, before / (before + after))
    corner = np.abs(turn - 2 * miss * (1 / before - 1 / after))
    off = np.zeros(len(step))
    off[1:] = np.abs(miss) / 16 * (after / before) ** 2 + corner * after
    off[:-1] = np.maximum(off[:-1], np.abs(miss) / 16 * (before / after) ** 2 + corner * before)
    return off


def _miss_of_neighbours(z: ComplexArray, t: ComplexArray, fraction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far each inner sample lies to the left of the interpolant through its neighbours, and turns left."""
    ends = z[:-2], t[:-2], z[2:], t[2:]
    for _ in range(2):
        along = slope(*ends, fraction)
        gap = (z[1:-1] - cubic(*ends, fraction)) / along
        fraction = fraction + gap.real
    along = slope(*ends, fraction)
    return gap.imag * np.abs(along), np.angle(t[1:-1] / along)


_SEARCH_PARTS, _CHECK_PARTS = 4, 16  # parts of each step between samples at which arcs are compared with the curve
_MAX_TRIES = 25  # with less and less of the tolerance, before the fit is given up
_MOST_TURN = 2.5  # of one piece [rad], so that no arc comes near a full turn
_ROUNDING_SHARE = 1e-3  # share of the tolerance kept back for rounding and for merging equal arcs


@dataclass(frozen=True)
class Biarc:
    """Two arcs with the common tangent `direction` at `joint`; curvatures and bulges before and after it."""

    joint: complex
    direction: complex
    curvatures: tuple[float, float]
    bulges: tuple[float, float]

    @property
    def turn(self) -> float:
        """The angle by which both arcs together turn to the left [rad]."""
        return 4 * (atan(self.bulges[0]) + atan(self.bulges[1]))


def biarc(
    # p0, p1: end points
    p0: complex,
    # t0, t1: unit tangents there
    t0: complex,
    p1: complex,
    t1: complex,
) -> Biarc | None:
    """Return the biarc with equal tangent lengths, or None if the ends face the wrong way [BM]."""
    chord, both, square = p1 - p0, t0 + t1, abs(p1 - p0) ** 2
    ahead = (chord * both.conjugate()).real
    if ahead <= 0:
        return None
    length = square / (ahead + sqrt(ahead**2 + square * abs(t0 - t1) ** 2))
    joint = p0 + (chord + length * (t0 - t1)) / 2
    direction = (chord - length * both) / abs(chord - length * both)
    before, after = (p0 - joint) * direction.conjugate(), (p1 - joint) * direction.conjugate()
    return Biarc(
        joint,
        direction,
        (2 * before.imag / abs(before) ** 2, 2 * after.imag / abs(after) ** 2),
        (before.imag / (abs(before) - before.real), after.imag / (abs(after) + after.real)),
    )


def fit_arcs(
    points: FloatArray,  # (n, 2): on the curve, in order
    tangents: FloatArray,  # (n, 2): of unit length there, pointing along the order of the points
    tolerance: float,  # largest distance of the curve from the chain, in the unit of the points
    # largest angle between the curve and the chain [rad], but for pieces from one sample to the next
    lean: float = np.inf,
) -> ArcChain:
    """Return a tangent-continuous chain of arcs close to a curve, from the first to the last sample.

    Raises CoarseDataError if the samples are too far apart for the tolerance, or the curve has a corner.
    """
    curve = _Curve.from_samples(points, tangents, (tolerance, lean), _SEARCH_PARTS)
    check = _Curve.from_samples(points, tangents, (tolerance, lean), _CHECK_PARTS)
    for knots in curve.proposals():
        used = [check.usage(i, j) for i, j in pairwise(knots)]
        if max(used) <= 1:
            return curve.chain(knots)
        worst = knots[int(np.argmax(used))]
        if knots[knots.index(worst) + 1] == worst + 1:
            break
    raise too_coarse(worst, len(points), "two arcs do not follow the curve from one to the next")


@dataclass(frozen=True)
class _Curve:
    """Samples and probes between them, ready to be compared with arcs.

    `targets` holds each sample followed by `stride` - 1 points between it and the next,
    `headings` the unit tangents there, `weights` one over the distance allowed; `turning` and `bending`
    sum up the signed and the absolute turn of the tangent.
    """

    points: list[complex]
    tangents: list[complex]
    turning: list[float]
    bending: list[float]
    arclength: FloatArray
    targets: ComplexArray
    headings: ComplexArray
    weights: FloatArray
    limits: tuple[float, float]
    stride: int

    @classmethod
    def from_samples(cls, points: FloatArray, tangents: FloatArray, limits: tuple[float, float], stride: int) -> _Curve:
        tolerance = limits[0]
        z, t = check_samples(points, tangents, tolerance)
        unsure = doubt(z, t)
        worst = int(np.argmax(unsure))
        if unsure[worst] > tolerance / 2:
            raise too_coarse(worst, len(z), f"it may be off by {unsure[worst] / tolerance:.2g} tolerances")
        ends = z[:-1], t[:-1], z[1:], t[1:]
        probes = np.arange(1, stride)[:, None] / stride
        slopes = slope(*ends, probes)
        allowed = np.full((len(z), stride), tolerance * (1 - _ROUNDING_SHARE))
        allowed[:-1, 1:] -= unsure[:, None]
        step = np.angle(t[1:] / t[:-1])
        return cls(
            z.tolist(),
            t.tolist(),
            np.append(0.0, np.cumsum(step)).tolist(),
            np.append(0.0, np.cumsum(np.abs(step))).tolist(),
            np.append(0.0, np.cumsum(np.abs(np.diff(z)))),
            np.append(np.vstack([z[:-1], cubic(*ends, probes)]).T.ravel(), z[-1]),
            np.append(np.vstack([t[:-1], slopes / np.abs(slopes)]).T.ravel(), t[-1]),
            1 / allowed.ravel()[: 1 - stride],
            limits,
            stride,
        )

    def piece(self, i: int, j: int) -> Biarc | None:
        """Return the biarc from sample i to sample j, if it turns as the curve does."""
        if self.bending[j] - self.bending[i] > _MOST_TURN:
            return None
        arcs = biarc(self.points[i], self.tangents[i], self.points[j], self.tangents[j])
        wanted = self.turning[j] - self.turning[i]
        return arcs if arcs is not None and abs(arcs.turn - wanted) < 1 else None

    def usage(self, i: int, j: int) -> float:
        """Return the share of the tolerance that a piece from sample i to sample j uses; above 1 it does not fit.

        Distances grow with the cube of a piece's length and angles with its square: a
        power of the angle lets one number stand for both.
        """
        arcs = self.piece(i, j)
        if arcs is None:
            return np.inf
        span, turned = slice(self.stride * i, self.stride * j + 1), arcs.direction.conjugate()
        local = (self.targets[span] - arcs.joint) * turned
        x, y = local.real, local.imag
        curvature = np.where(x < 0, *arcs.curvatures)
        # distance from a circle through the origin along x, without the cancellation of |z - centre| - radius
        power = curvature * (x * x + y * y) - 2 * y
        radial = np.sqrt(np.abs(1 + curvature * power))
        used = float((np.abs(power) / (1 + radial) * self.weights[span]).max())
        if j == i + 1 or not np.isfinite(self.limits[1]):
            return used
        heading = self.headings[span] * turned
        across = heading.imag * (1 - curvature * y) - heading.real * curvature * x
        turned_off = float((np.abs(across) / radial).max())
        return max(used, float((turned_off / self.limits[1]) ** 1.5))

    def proposals(self) -> Iterator[list[int]]:
        """Yield knots, the best ones first: spread evenly, or else as a sweep from the start leaves them."""
        for spread in (True, False):
            for share in 0.9 ** np.arange(_MAX_TRIES):
                forward, backward = self.swept(share)
                yield _balance_knots(forward, backward, self.arclength) if spread else forward

    def swept(self, share: float) -> tuple[list[int], list[int]]:
        """Return the knots of the longest pieces that use `share` of the tolerance, from the start and from the end."""
        last = len(self.points) - 1
        forward, backward = [0], [last]
        for knots, sense, end in ((forward, 1, last), (backward, -1, 0)):
            length = 1
            while knots[-1] != end:
                length = self._longest(knots[-1], sense, share, length)
                knots.append(knots[-1] + sense * length)
        return forward, backward[::-1]

    def _longest(self, knot: int, direction: int, share: float, guess: int) -> int:
        """Return how many samples the longest fitting piece spans; one is always taken."""
        room = len(self.points) - 1 - knot if direction > 0 else knot
        fits, fails, length, tries = 1, room + 1, guess, 0
        while fails - fits > 1:
            length = min(max(length, fits + 1), fails - 1, 4 * fits + 8 * guess)
            used = self.usage(*sorted((knot, knot + direction * length)))
            fits, fails = (length, fails) if used <= share else (fits, length)
            tries += 1
            # the deviation grows with the cube of the length; where it does not, halve the bracket
            growth = (share / max(used, 1e-9)) ** (1 / 3)
            length = int(min(length * growth, room)) if tries % 3 and growth else (fits + fails) // 2
        return fits

    def chain(self, knots: list[int]) -> ArcChain:
        """Return the chain of the pieces between the knots; equal arcs of a piece become one."""
        nodes, bulges = [self.points[0]], list[float]()
        for i, j in pairwise(knots):
            arcs = self.piece(i, j)
            if arcs is None:
                raise too_coarse(i, len(self.points), "no two arcs join them")
            uneven = abs(arcs.curvatures[0] - arcs.curvatures[1]) * abs(self.points[j] - self.points[i]) ** 2
            if uneven > _ROUNDING_SHARE**2 * self.limits[0]:
                nodes.append(arcs.joint)
                bulges.extend(arcs.bulges)
            else:
                bulges.append(float(np.tan(arcs.turn / 4)))
            nodes.append(self.points[j])
        return ArcChain(np.array(nodes), np.array(bulges))


def _balance_knots(forward: list[int], backward: list[int], arclength: FloatArray) -> list[int]:
    """Return knots between the latest (`forward`) and the earliest (`backward`) possible ones, spread evenly.

    Rounding to a sample goes towards the middle of the curve where it is a tie, so that
    the curve run backwards has the same knots.
    """
    if len(forward) != len(backward):
        return min(forward, backward, key=len)
    share = np.linspace(0, 1, len(forward))
    target = arclength[forward] * (1 - share) + arclength[backward] * share
    above = np.clip(np.searchsorted(arclength, target), 1, len(arclength) - 1)
    lead = (target - arclength[above - 1]) - (arclength[above] - target)
    tie = np.abs(lead) < 1e-9 * arclength[-1]
    up = np.where(tie, target < arclength[-1] / 2, lead > 0)
    inner = np.where(up, above, above - 1)[1:-1]
    return sorted({0, *inner.tolist(), len(arclength) - 1})
