"""Changes of stability along a path: limit points and bifurcations located, classified, and left for a stable branch.

At a singular point the tangent has a null vector. Where the drive has an extreme on the path it is a limit point, else
a bifurcation: there the null vector points along the path that crosses.

Its modes are those of the second derivative K of the energy. The energy is that of the poses q; the forces p in the
beams follow from them. It is known by its inverse K^-1, the part of the inverse of the tangent of both that belongs to
q: that exists where beams do not stretch, too. An eigenvalue of K is negative for every unstable direction.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.equilibrium.network_solver import FORCE_WEIGHT, Spot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.uncondensed_solver import ExpandedSolver

_SEARCHES = 40  # solutions in which a bracket is closed at most: halving alone would take forty to 1e-12 of it
_CLOSE = 1e-4  # share of the determinant at the ends that is near enough to interpolate the rest, at least
_LOOSE = 10.0  # the same in units of the tolerance
_HUGE = 700.0  # logarithm of a number that is not too large
_OUTSIDE = 0.1  # of a bracket: one end may lie at the singular point, on either side
_ASIDE = 0.03  # share of a bracket's part by which to stay off a singular point of several modes
_NEAREST = 1e-4  # share of the eigenvalue at the ends by which to do so: nearer, solutions may be those of branches
_NEAR = 0.05  # share of what it is at the ends that is near zero
_SIZES = (0.06, 0.015, 0.0036)  # how far from a bifurcation its branch is entered [rad]: some are short
_RIGID = 1e-14  # share of the largest compliance that is none
_ROUNDING = 1e-14  # share of the largest entry by which a singular tangent is made regular
_MOVED = 1e-3  # share of a mode's largest change of a pose from which a node counts as moved
_FIRST_KICK, _KICKS = 1e-3, 16  # change of the unknowns that is tried first, and how often


class Singular(NamedTuple):
    """A singular point: the equilibrium, its null vector, all its modes in one where several are critical, its kind."""

    spot: Spot
    null: FloatArray
    fold: bool
    before: int
    after: int


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

    `tolerance` is that of the path. Without the vector the inertia is that right next to the point, else of both ends.

    The determinant of the tangent, with the sign that the inertia gives it, is brought near zero by the Illinois
    variant of the rule of false position, or faster where inverse interpolation stays inside the bracket. The last bit
    is interpolated: at a bifurcation no bordered system is regular, so that Newton's method does not get there.
    Where several modes become unstable it is, instead, the eigenvalue of the one that does so next to the stabler end.
    """
    stable, unstable = (one, other) if one.unstable < other.unstable else (other, one)
    search = _Search(solver, stable, unstable, natural, min(max(_CLOSE, _LOOSE * tolerance), 0.01))
    for attempt in range(_SEARCHES):
        if not search.closer(middle=attempt % 6 == 5):
            break
    if not search.near_enough():
        return None
    spot = search.interpolated()
    if not vector:
        low, high = stable.unstable, search.nearest_unstable()
        before, after = (low, high) if stable is one else (high, low)
        return Singular(spot, np.zeros(solver.n), fold, before, after)
    return Singular(spot, search.null(spot), fold, one.unstable, other.unstable)


class _Search:
    """A bracket around a singular point on the path between two equilibria."""

    def __init__(self, solver: ExpandedSolver, one: Spot, other: Spot, natural: bool, close: float) -> None:
        self.solver, self.one, self.other, self.close, self.natural = solver, one, other, close, natural
        self.border = solver.unit if natural else _chord(solver, one, other)
        self.start, self.stop = self._level(one), self._level(other)
        self.several = other.unstable - one.unstable > 1
        self.close = max(close, _NEAREST) if self.several else close
        self.known = close > _CLOSE  # Newton's method knows the determinant before its last step
        largest = 0.0 if self.several else max(self._log_size(one), self._log_size(other))
        self.log_unit = largest if math.isfinite(largest) else 0.0  # sizes in this unit: of many beams they overflow
        self.samples = [(0.0, self._measure(one), one), (1.0, self._measure(other), other)]
        self.low, self.high = (sample[:2] for sample in self.samples)
        self.predicted = False  # whether the samples foretell where it is hardly anything
        less, self.scale = sorted((abs(self.low[1]), abs(self.high[1])))
        self.goal = self.close * max(math.sqrt(less * self.scale), _CLOSE * self.scale)

    def _level(self, spot: Spot) -> float:
        return float(self.border[:-1] @ spot.y[: self.solver.n] + self.border[-1] * spot.drive)

    def _measure(self, spot: Spot) -> float:
        """Return what is brought near zero: positive with the inertia of the first end, else negative."""
        size = self._size(spot)
        return size if spot.unstable == self.one.unstable else -size

    def _size(self, spot: Spot) -> float:
        """Return the size of the tangent's determinant, or of the eigenvalue that changes its sign first of several."""
        if not self.several:
            return math.exp(min(self._log_size(spot) - self.log_unit, _HUGE))
        values = eigenvalues(self.solver, spot.y, spot.drive)
        return abs(float(values[min(self.one.unstable, len(values) - 1)]))

    def _log_size(self, spot: Spot) -> float:
        """Return the logarithm of the size of the determinant, which a solution may bring along."""
        if self.known and not math.isnan(spot.log_size):
            return spot.log_size
        matrix, _ = self.solver.tangent_at(spot.y, spot.drive)
        return float(np.linalg.slogdet(matrix)[1])

    def null(self, spot: Spot) -> FloatArray:
        """Return the null vector (n,) of the singular point; of several modes all that are critical, to one side."""
        curvature = Curvature(self.solver, spot.y, spot.drive)
        nearest = np.abs(curvature.values).argsort()[: self.other.unstable - self.one.unstable]
        critical = np.abs(curvature.values[nearest]) < _NEAR * self.scale
        return curvature.null(nearest[critical] if critical.any() else nearest[:1])

    def closer(self, middle: bool) -> bool:
        """Shrink the bracket once; tell whether to go on."""
        (low, f_low), (high, f_high) = self.low, self.high
        share = 0.5 * (low + high) if middle else (low * f_high - high * f_low) / (f_high - f_low)
        if not middle and len(self.samples) > 2:
            chosen, weights = self._nearest()
            guess = float(sum(w * sample[0] for w, sample in zip(weights, chosen, strict=True)))
            share = guess if low + 1e-3 * (high - low) < guess < high - 1e-3 * (high - low) else share
        if self.several:
            share -= _ASIDE * (share - low)
        y, drive = self._guess(share)
        loose = self.close > _CLOSE and len(self.samples) > 2
        if loose and self._size(Spot(y, drive, self.border)) < self.goal:
            self.predicted = True  # near enough: solving there, where no system is regular, would take long
            return False
        near = self._solved(share, y, drive)
        if near is None and self.several and not self.near_enough():
            share -= 4 * _ASIDE * (share - low)
            near = self._solved(share, *self._guess(share))
        if near is None:
            return False
        value = self._measure(near)
        self.samples.append((share, value, near))
        if value > 0:
            self.low, self.high = (share, value), (high, f_high if middle else 0.5 * f_high)
        else:
            self.high, self.low = (share, value), (low, f_low if middle else 0.5 * f_low)
        return abs(value) > self.goal and self.high[0] - self.low[0] > 1e-13

    def _solved(self, share: float, y: FloatArray, drive: float) -> Spot | None:
        """Return the equilibrium at a share, near a guess."""
        return self.solver.solve(y, drive, self.border, self.start + share * (self.stop - self.start))

    def nearest_unstable(self) -> int:
        """Return the number of unstable directions right next to the singular point."""
        return min((sample for sample in self.samples if sample[1] <= 0), key=lambda sample: -sample[1])[2].unstable

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
        """Tell whether what is brought near zero is a small share of what it is at the ends."""
        return self.predicted or min(abs(sample[1]) for sample in self.samples) < _NEAR * self.scale

    def interpolated(self) -> Spot:
        """Return the point where it vanishes, from the samples nearest to it."""
        chosen, weights = self._nearest()
        y = sum(w * c[2].y for w, c in zip(weights, chosen, strict=True))
        drive = float(sum(w * c[2].drive for w, c in zip(weights, chosen, strict=True)))
        low, high = sorted((self.one.drive, self.other.drive))
        out = max(low - drive, drive - high)
        if self.natural and out > _OUTSIDE * (high - low):  # samples too unlike each other
            return chosen[0][2]
        return Spot(np.asarray(y), drive, chosen[0][2].tangent)


def _chord(solver: ExpandedSolver, one: Spot, other: Spot) -> FloatArray:
    """Return the way from one equilibrium to another, as the bordering row of the arc length."""
    weights = np.where(np.arange(solver.n) < solver.n_free, 1.0, FORCE_WEIGHT)
    return np.append(weights * (other.y - one.y)[: solver.n], other.drive - one.drive)


def leave(solver: ExpandedSolver, singular: Singular, sign: int, forward: float) -> Spot | None:
    """Return an equilibrium on the branch that crosses at a bifurcation of one mode, on the stable side of it.

    `sign` says which of the two mirror images; `forward` is the sense in which the drive goes. None if the branch
    leads backwards (the bifurcation is subcritical) or is less stable than the path before it.
    """
    return entered(solver, singular, sign * singular.null, forward)


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


class Curvature:
    """Eigenvalues `values` (m,) of the second derivative at (y, drive), rising, without those of rigid directions.

    `modes` (n, m) are the changes of z that go with them, of unit size in q; `newton` (m,) is Newton's step along them.
    """

    def __init__(self, solver: ExpandedSolver, y: FloatArray, drive: float) -> None:
        """Invert the tangent."""
        self.solver, self.y, self.drive, free = solver, y, drive, solver.n_free
        matrix, _ = solver.tangent_at(y, drive)
        residual, slot = solver.scratch[3], solver.model.slot
        forces = np.zeros(solver.n)
        forces[slot[slot >= 0]] = residual[: solver.n_dofs][slot >= 0]
        forces[free:] = residual[solver.n_dofs :]
        inverse = -_inverse(matrix)
        compliance = inverse[:free, :free]
        given, vectors = np.linalg.eigh(0.5 * (compliance + compliance.T))
        bends = _bends(given)
        given, vectors = given[bends], vectors[:, bends]
        order = (1.0 / given).argsort()
        self.values, vectors = 1.0 / given[order], vectors[:, order]
        self.modes = inverse[:, :free] @ vectors * self.values
        self.step = inverse @ forces
        self.newton = vectors.T @ self.step[:free]

    def moved(self, steps: FloatArray) -> FloatArray:
        """Return the unknowns after steps (m,) along the modes; what is not in equilibrium else is put right."""
        change = self.step + self.modes @ (steps - self.newton)
        return self.solver.shifted(self.y, self.drive, change)

    def down(self) -> FloatArray:
        """Return the steps that lead down: Newton's, but away from where the energy is highest along a mode."""
        steps: FloatArray = np.sign(self.values) * self.newton
        return steps

    def aside(self, chosen: NDArray[Any]) -> FloatArray:
        """Return steps (m,) of chosen modes, by their numbers, to one side whatever vectors span them.

        The unknown that they can change most is changed, then the one that the rest of them can change most, and so
        on: of modes of different beams each takes part. These are unknowns that every mesh has: those of nodes if they
        move, else last forces. In a symmetric network several change most: the first decides, not rounding.
        """
        solver, modes, count = self.solver, self.modes[:, chosen], len(chosen)
        poses = modes[: solver.plain_free]
        forces = modes[solver.n_free :].reshape(-1, 3, count)[solver.lasts].reshape(-1, count)
        steps, left = np.zeros(len(self.values)), np.eye(count)
        for _ in range(count):
            part = poses @ left
            sizes = np.linalg.norm(part, axis=1)
            if not sizes.max(initial=0.0) > _MOVED:
                part = forces @ left
                sizes = np.linalg.norm(part, axis=1)
            row = part[np.flatnonzero(sizes >= 0.99 * sizes.max())[0]]
            row = row / np.linalg.norm(row)
            steps[chosen] -= row  # by choice: either sign would do, as long as it stays
            left -= np.outer(left @ row, row)
        return steps

    def null(self, chosen: NDArray[Any]) -> FloatArray:
        """Return the null vector (n,) of a singular point: chosen modes, all to one side."""
        null = self.modes @ self.aside(chosen)
        return np.asarray(null / np.linalg.norm(null))


def eigenvalues(solver: ExpandedSolver, y: FloatArray, drive: float) -> FloatArray:
    """Return only the `values` of the curvature: quicker."""
    compliance = -_inverse(solver.tangent_at(y, drive)[0])[: solver.n_free, : solver.n_free]
    given = np.asarray(np.linalg.eigvalsh(0.5 * (compliance + compliance.T)))
    return np.sort(1.0 / given[_bends(given)])


def _bends(compliances: FloatArray) -> NDArray[np.bool_]:
    """Tell which directions are not rigid."""
    size = np.abs(compliances)
    return np.asarray(size > _RIGID * size.max(initial=0.0))


def _inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse of a matrix, or of one near it where it is singular to the last bit."""
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        inverse = np.linalg.inv(matrix + _ROUNDING * float(np.abs(matrix).max()) * np.eye(len(matrix)))
    return np.asarray(inverse)
