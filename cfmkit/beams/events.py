"""Where stability changes along a path: limit points and bifurcations, found, told apart, and left for a stable branch.

At a singular point the tangent has a null vector. Where the drive has an extreme on the path it is a limit point, else
a bifurcation: there the null vector points along the path that crosses.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.solver import FORCE_WEIGHT, Solver, Spot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.beams.expanded import ExpandedSolver
    from cfmkit.curves import FloatArray

_SEARCHES = 40
_CLOSE = 1e-5  # share of the determinant at the ends that is near enough to interpolate the rest: the smallest,
_LOOSE = 10.0  # and in units of the tolerance
_NOTHING = 1e-6  # share of a determinant that is rounding
_OUTSIDE = 0.1  # of a bracket: one end may lie at the singular point, on either side
_MOVED = 1e-3  # share of a mode's largest change of a pose from which a node counts as moved
_TURNS = 5  # of inverse iteration
_AROUND = 16  # directions in which branches are looked for where two modes are critical at once
_SIZES = (0.06, 0.015, 0.0036)  # how far from a bifurcation its branch is entered [rad]: some are short
_FIRST_KICK, _KICKS = 1e-3, 16  # change of the unknowns that is tried first, and how often


@dataclass(frozen=True)
class Singular:
    """A singular point: the equilibrium, its null vector and which kind it is.

    `others` holds more null vectors, (n, k), where several modes are critical at once; `null` is one of them.
    """

    spot: Spot
    null: FloatArray
    fold: bool
    before: int
    after: int
    others: FloatArray | None = None


def locate(
    solver: ExpandedSolver,
    one: Spot,
    other: Spot,
    natural: bool,
    tolerance: float,
    fold: bool = False,
    vector: bool = True,
) -> Singular | None:
    """Return the singular point between two neighbouring equilibria with different inertia; its null vector if wanted.

    `tolerance` is that of the path.

    The determinant of the tangent, with the sign that the inertia gives it, is brought near zero by the Illinois
    variant of the rule of false position, or faster where inverse interpolation stays inside the bracket. The last bit
    is interpolated: at a bifurcation no bordered system is regular, so that Newton's method does not get there.
    """
    search = _Search(solver, one, other, natural, min(max(_CLOSE, _LOOSE * tolerance), 0.01))
    for attempt in range(_SEARCHES):
        if not search.closer(middle=attempt % 6 == 5):
            break
    if not search.near_enough():
        return None
    spot, many = search.interpolated(), abs(other.unstable - one.unstable)
    if not vector:
        return Singular(spot, np.zeros(solver.n), fold, one.unstable, other.unstable)
    regular = one if abs(search.samples[0][1]) > _NOTHING * search.scale else other  # a path may begin just there
    nulls = _nulls_of(solver, spot, regular, max(1, many))
    return Singular(spot, nulls[:, 0], fold, one.unstable, other.unstable, nulls[:, 1:] if many > 1 else None)


def with_nulls(solver: ExpandedSolver, singular: Singular, regular: Spot, count: int) -> Singular:
    """Return a singular point with so many vectors that its tangent shrinks most, some only nearly to nothing."""
    nulls = _nulls_of(solver, singular.spot, regular, count)
    return replace(singular, null=nulls[:, 0], others=nulls[:, 1:])


class _Search:
    """A bracket around a singular point on the path between two equilibria."""

    def __init__(self, solver: Solver, one: Spot, other: Spot, natural: bool, close: float) -> None:
        self.solver, self.one, self.other, self.close, self.natural = solver, one, other, close, natural
        weights = np.where(np.arange(solver.n) < solver.n_free, 1.0, FORCE_WEIGHT)
        chord = np.append(weights * (other.y - one.y)[: solver.n], other.drive - one.drive)
        self.border = solver.unit if natural else chord
        self.start, self.stop = self._level(one), self._level(other)
        self.known = close > _CLOSE  # Newton's method knows the determinant before its last step
        largest = max(self._log_size(one), self._log_size(other))
        self.log_unit = largest if math.isfinite(largest) else 0.0  # sizes in this unit: of many beams they overflow
        self.samples = [(0.0, self._measure(one), one), (1.0, self._measure(other), other)]
        self.low, self.high = self.samples[0][:2], self.samples[1][:2]
        self.foretold = False  # whether the samples foretell where the determinant is hardly any
        less, self.scale = sorted((abs(self.low[1]), abs(self.high[1])))
        self.goal = self.close * max(math.sqrt(less * self.scale), _CLOSE * self.scale)

    def _level(self, spot: Spot) -> float:
        return float(self.border[:-1] @ spot.y[: self.solver.n] + self.border[-1] * spot.drive)

    def _measure(self, spot: Spot) -> float:
        """Return the size of the tangent's determinant: positive with the inertia of the first end, else negative."""
        size = self._size(spot)
        return size if spot.unstable == self.one.unstable else -size

    def _size(self, spot: Spot) -> float:
        """Return the size of the tangent's determinant."""
        return math.exp(self._log_size(spot) - self.log_unit)

    def _log_size(self, spot: Spot) -> float:
        """Return the logarithm of that size, which a solution may bring along."""
        if self.known and not math.isnan(spot.log_size):
            return spot.log_size
        matrix, _ = self.solver.tangent_at(spot.y, spot.drive)
        return float(np.linalg.slogdet(matrix)[1])

    def closer(self, middle: bool) -> bool:
        """Shrink the bracket once; tell whether to go on."""
        (low, f_low), (high, f_high) = self.low, self.high
        share = 0.5 * (low + high) if middle else (low * f_high - high * f_low) / (f_high - f_low)
        if not middle and len(self.samples) > 2:
            chosen, weights = self._nearest()
            guess = float(sum(w * sample[0] for w, sample in zip(weights, chosen, strict=True)))
            share = guess if low + 1e-3 * (high - low) < guess < high - 1e-3 * (high - low) else share
        y, drive = self._guess(share)
        loose = self.close > _CLOSE and len(self.samples) > 2
        if loose and self._size(Spot(y, drive, self.border)) < self.goal:
            self.foretold = True  # near enough: solving there, where no system is regular, would take long
            return False
        near = self.solver.solve(y, drive, self.border, self.start + share * (self.stop - self.start))
        if near is None:
            return False
        value = self._measure(near)
        self.samples.append((share, value, near))
        if value > 0:
            self.low, self.high = (share, value), (high, f_high if middle else 0.5 * f_high)
        else:
            self.high, self.low = (share, value), (low, f_low if middle else 0.5 * f_low)
        return abs(value) > self.goal and self.high[0] - self.low[0] > 1e-13

    def _guess(self, share: float) -> tuple[FloatArray, float]:
        """Return unknowns and drive at a share, interpolated between the nearest samples."""
        near = sorted(self.samples, key=lambda sample: abs(sample[0] - share))[:3]
        places = [sample[0] for sample in near]
        weights = [math.prod((share - q) / (p - q) for q in places if q != p) for p in places]
        y = sum(w * sample[2].y for w, sample in zip(weights, near, strict=True))
        return np.asarray(y), float(sum(w * sample[2].drive for w, sample in zip(weights, near, strict=True)))

    def _nearest(self) -> tuple[list[tuple[float, float, Spot]], list[float]]:
        """Return up to four samples nearest to zero and the weights that interpolate between them where it is."""
        ranked = sorted(self.samples, key=lambda sample: abs(sample[1]))
        chosen = [ranked[0]]
        for sample in ranked[1:]:
            if len(chosen) < 4 and all(abs(sample[1] - c[1]) > 1e-3 * abs(sample[1]) for c in chosen):
                chosen.append(sample)
        values = [c[1] for c in chosen]
        return chosen, [math.prod(v / (v - u) for v in values if v != u) for u in values]

    def near_enough(self) -> bool:
        """Tell whether the determinant has come down to a small share of what it is at the ends."""
        return self.foretold or min(abs(sample[1]) for sample in self.samples) < 0.05 * self.scale

    def interpolated(self) -> Spot:
        """Return the point where the determinant vanishes, from the samples nearest to it."""
        chosen, weights = self._nearest()
        y = sum(w * c[2].y for w, c in zip(weights, chosen, strict=True))
        drive = float(sum(w * c[2].drive for w, c in zip(weights, chosen, strict=True)))
        low, high = sorted((self.one.drive, self.other.drive))
        out = max(low - drive, drive - high)
        if self.natural and out > _OUTSIDE * (high - low):  # samples too unlike each other
            return chosen[0][2]
        return Spot(np.asarray(y), drive, chosen[0][2].tangent)


def _nulls_of(solver: ExpandedSolver, spot: Spot, regular: Spot, count: int) -> FloatArray:
    """Return null vectors (n, count) in the scaling that balances the tangent at a regular point nearby."""
    ordinary, _ = solver.tangent_at(regular.y, regular.drive)
    balance, sizes = np.ones(solver.n), np.abs(ordinary)
    for _ in range(8):
        balance /= np.sqrt((sizes * balance).max(axis=1) * balance)
    matrix, _ = solver.tangent_at(spot.y, spot.drive)
    scales = np.outer(balance, balance)
    found = _null_vectors(matrix * scales, ordinary * scales, count) * balance[:, None]
    found /= np.linalg.norm(found, axis=0)
    return np.array([null * _side(solver, null) for null in found.T]).T


def _side(solver: ExpandedSolver, direction: FloatArray) -> float:
    """Return the sign that gives a null vector its side: by unknowns that every mesh has, those of nodes if they move.

    In a symmetric network several are the largest: the first decides, not rounding.
    """
    shown = _shown(solver, direction)
    leading = np.flatnonzero(np.abs(shown) > 0.99 * np.abs(shown).max())[0]
    return -float(np.sign(shown[leading]))  # by choice: any sign would do, as long as it stays


def _shown(solver: ExpandedSolver, direction: FloatArray) -> FloatArray:
    """Return the entries of a change of z that every mesh has: those of nodes if they move, else of last forces."""
    moved, forces = direction[: solver.plain_free], direction[solver.n_free : solver.n].reshape(-1, 3)[solver.lasts]
    poses = np.abs(direction[: solver.n_free]).max(initial=0.0)
    return moved if np.abs(moved).max(initial=0.0) > _MOVED * poses else forces.ravel()


def _null_vectors(matrix: FloatArray, regular: FloatArray, count: int) -> FloatArray:
    """Return vectors (n, count) that a nearly singular matrix shrinks most compared with a regular one near it.

    Inverse iteration. Compared: a slender beam hardly stretches, so that its force has a small eigenvalue everywhere.
    """
    shift = 1e-14 * float(np.abs(matrix).max())
    try:
        grown = np.linalg.inv(matrix + shift * np.eye(len(matrix))) @ regular
    except np.linalg.LinAlgError:  # singular to the last bit
        return np.asarray(np.linalg.svd(matrix)[2][-count:].T)
    nulls = grown[:, np.abs(grown).max(axis=0).argsort()[::-1][:count]]
    for _ in range(_TURNS):
        nulls = grown @ _orthonormal(nulls)
    return _orthonormal(nulls)


def _orthonormal(vectors: FloatArray) -> FloatArray:
    """Return orthonormal vectors (n, k) that span what some independent ones do."""
    if vectors.shape[1] == 1:
        return np.asarray(vectors / np.linalg.norm(vectors))
    return np.asarray(np.linalg.qr(vectors)[0])


def leave(solver: ExpandedSolver, singular: Singular, sign: int, forward: float) -> Spot | None:
    """Return an equilibrium on the branch that crosses at a bifurcation, on the stable side of it.

    `sign` says which of the two mirror images; `forward` is the sense in which the drive goes. None if the branch
    leads backwards (the bifurcation is subcritical) or is less stable than the path before it.
    """
    if singular.others is None:
        return entered(solver, singular, sign * singular.null, forward)
    found: list[tuple[tuple[float, ...], Spot]] = []
    for direction in _directions(np.column_stack([singular.null, singular.others])):
        spot = entered(solver, singular, direction, forward)
        if spot is not None:
            change = _shown(solver, spot.y[: solver.n] - singular.spot.y[: solver.n])
            order = tuple((sign * np.round(change / np.abs(change).max(), 1)).tolist())
            found.append((order, spot))
    return min(found, key=lambda one: one[0])[1] if found else None


def _directions(nulls: FloatArray) -> FloatArray:
    """Return directions (k, n) all around a space of null vectors."""
    many = nulls.shape[1]
    if many == 2:
        turns = 2 * np.pi * np.arange(_AROUND) / _AROUND
        shares = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    else:
        shares = np.array([one for one in itertools.product((-1.0, 0.0, 1.0), repeat=min(many, 4)) if any(one)])
        shares /= np.linalg.norm(shares, axis=1)[:, None]
    found: FloatArray = shares @ nulls[:, : shares.shape[1]].T
    return found


def entered(
    solver: ExpandedSolver,
    singular: Singular,
    direction: FloatArray,
    forward: float,
    sizes: Sequence[float] = _SIZES,
) -> Spot | None:
    """Return an equilibrium on the branch that a null vector points along, one of some sizes [rad] away from it."""
    found = (_leave(solver, singular, direction, forward, size) for size in sizes)
    return next((spot for spot in found if spot is not None), None)


def _leave(
    solver: ExpandedSolver, singular: Singular, direction: FloatArray, forward: float, size: float
) -> Spot | None:
    """Return an equilibrium on the branch that is about `size` [rad] away from the bifurcation."""
    spot = singular.spot
    border = np.append(direction, 0.0)
    level = float(direction @ spot.y[: solver.n])
    kick = _FIRST_KICK
    for _ in range(_KICKS):
        guess = solver.shifted(spot.y, spot.drive, kick * direction)
        moved = solver.pose_change(guess, spot.y)
        if not 0.3 * size <= moved <= size:
            kick *= 0.7 * size / moved if moved > 0 else 10.0
            continue
        near = solver.solve(guess, spot.drive, border, level + kick)
        if near is None or solver.pose_change(near.y, guess) > 0.5 * size:
            kick *= 0.5
            continue
        ahead = (near.drive - spot.drive) * forward > 0
        settled = solver.solve(near.y, near.drive)
        return settled if settled is not None and ahead and settled.unstable <= singular.before else None
    return None
