"""Natural frequencies about the equilibria of a path, with the drive held and with it free, and flutter.

The motions that the constraints allow are spanned by an orthonormal basis; there the stiffness K and the mass M are
dense and small. M v = K v / omega^2 is solved for the largest 1/omega^2: a Cholesky factor of K does not depend on how
stiff its stiffest direction is, so that slender beams, whose stretch is a million times as stiff as their bending, keep
their lowest frequencies to rounding. A pose without such a factor is unstable, or moves freely.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.elastica.vibration.stiffness_and_mass_matrices import Linearisation
from cfmkit.errors import InputError
from cfmkit.numerics.one_blas_thread import one_blas_thread

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.outcome.path import Path
    from cfmkit.elastica.vibration.network_masses_type import NetworkMasses
    from cfmkit.elastica.vibration.stiffness_and_mass_matrices import Linearised

_AT_ONCE = 16  # points whose matrices are in memory together: some megabytes
_TIED = 1e-10  # share of the largest row from which a constraint counts: a straight beam's along itself is rounding
_NEUTRAL = 1e-9  # share of the largest stiffness, all of similar size, within which a direction has none
_REAL = 1e-5  # share of a square of a frequency that its imaginary part is at least where two have met: roots that meet
# are a square root of rounding apart
_SMALL = 200  # unknowns up to which all frequencies are as quick as a few
_SPARE, _MOST_ROUNDS, _SETTLED = 16, 40, 1e-12  # modes beside those wanted; rounds; share of a value that it changes by
_RESOLVED = 3  # so many times the modes wanted are examined for flutter: higher ones of the basis are no modes of beams


@dataclass(frozen=True, repr=False)
class Frequencies(ShortRepr):
    """Natural frequencies of a network about some equilibria.

    Attributes
    ----------
    points : (p,) int array
        Indices of the points of the path.
    held, free : (p, n) arrays
        The lowest ones with the drive held, and with it free, ascending [Hz]. Zero where a motion has no stiffness;
        nan where the pose is unstable, and where a network has fewer.
    flutters, diverges : (p,) bool arrays
        Whether loads that turn with their node make motions grow that swing, or that do not: two squares of
        frequencies are complex, or one is negative. As the drive has it: held if it is a motion, free if it is a load.
        Other networks do not flutter, and whether they diverge is reported by the path.
    """

    points: Any
    held: FloatArray
    free: FloatArray
    flutters: Any
    diverges: Any


@one_blas_thread
def frequencies(
    path: Path,
    masses: NetworkMasses,
    count: int,
    points: Any = None,
    hold: tuple[str, float | None] | None = None,
) -> Frequencies:
    """Return the lowest `count` natural frequencies of a network about equilibria of its path.

    Parameters
    ----------
    path : Path
        The equilibria.
    masses : NetworkMasses
        Density of every beam, masses of nodes. Sections rotate with inertia where they shear, too.
    count : int
        How many frequencies, at least 1.
    points : (p,) int array, optional
        Indices of the points of the path; all unless given.
    hold : (str, float or None), optional
        Of a drive by loads: which node stands still while the drive is held, along which direction [rad]; None: it
        does not rotate. Without it, held and free are the same.

    Raises
    ------
    cfmkit.errors.InputError
        If a beam has no density, or the count is not positive.
    """
    if count < 1:
        raise InputError(f"at least one frequency must be requested, got {count}")
    chosen = np.arange(len(path)) if points is None else np.asarray(points, dtype=np.int64)
    system = Linearisation(path, masses, count, hold)
    unit = float(np.sqrt(path.layout.scales.rigidity) / path.layout.scales.length**2 / (2 * np.pi))
    held, free = (np.full((len(chosen), count), np.nan) for _ in range(2))
    grows = np.zeros((2, len(chosen)), dtype=bool)
    for first in range(0, len(chosen), _AT_ONCE):
        own = chosen[first : first + _AT_ONCE]
        matrices = system.at(own)
        for k in range(len(own)):
            one, other = _reduced(matrices, k, True), _reduced(matrices, k, False)
            (squares, *still), (others, *loose) = _squares(one, count), _squares(other, count)
            held[first + k], free[first + k] = unit * np.sqrt(squares), unit * np.sqrt(others)
            grows[:, first + k] = still if len(matrices.driven) else loose
    flutters, diverges = (read_only(row, np.bool_) for row in grows)
    return Frequencies(read_only(chosen, np.int64), read_only(held), read_only(free), flutters, diverges)


@dataclass(frozen=True)
class _Reduced:
    """Stiffness, what loads that turn add to it, and mass, in a basis of the motions that are possible."""

    stiffness: FloatArray
    turning: FloatArray | None
    mass: FloatArray


def _reduced(system: Linearised, k: int, held: bool) -> _Reduced:
    """Return the matrices of one point."""
    own = system.free if held else np.concatenate([system.free, system.driven])
    rows = system.tied[k] if not held else np.concatenate([system.tied[k], system.held[k]])
    basis = _basis(rows[:, own])
    pick = np.ix_(own, own)
    stiffness, mass = (basis.T @ matrix[k][pick] @ basis for matrix in (system.stiffness, system.mass))
    turning = system.turning[k][pick]
    whole = basis.T @ turning @ basis if turning.any() else None
    return _Reduced(0.5 * (stiffness + stiffness.T), whole, 0.5 * (mass + mass.T))


def _basis(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis (n, m) of what some rows (k, n) leave free."""
    from scipy.linalg import qr

    n = rows.shape[1]
    if not len(rows):
        return np.eye(n)
    q, r, _ = qr(rows.T, mode="full", pivoting=True)
    sizes = np.abs(np.diag(r))
    rank = int((sizes > _TIED * sizes.max(initial=0.0)).sum())
    return np.asarray(q[:, rank:])


def _squares(system: _Reduced, count: int) -> tuple[FloatArray, bool, bool]:
    """Return the lowest squares of the frequencies, nan where it is unstable; whether it flutters, and diverges."""
    if system.turning is not None:
        return _with_turning(system, count)
    return _symmetric(system.stiffness, system.mass, count), False, False


def _symmetric(stiffness: FloatArray, mass: FloatArray, count: int) -> FloatArray:
    """Return the lowest squares of the frequencies of a symmetric system; nan if it is unstable."""
    from scipy.linalg import eigh

    found = np.full(count, np.nan)
    stiffness, mass = _evened(stiffness, mass)
    neutral, factor = 0, _firm_factor(stiffness)
    if factor is None:
        values, vectors = np.linalg.eigh(stiffness)
        neutral = int((values < _NEUTRAL * values[-1]).sum())
        moving = mass @ vectors[:, :neutral]
        share = vectors[:, :neutral].T @ moving
        if values[0] < -_NEUTRAL * values[-1] or (neutral and np.linalg.eigvalsh(share)[0] <= 0.0):
            return found
        if neutral:  # the others are orthogonal to those without stiffness, by mass
            rest = _basis(moving.T)
            stiffness, mass = rest.T @ stiffness @ rest, rest.T @ mass @ rest
    n = len(stiffness)
    lowest = min(max(count - neutral, 0), n)
    found[:neutral] = 0.0
    if lowest:
        known = None if factor is None or n <= _SMALL else _largest(mass, factor, lowest)
        if known is None:
            known = eigh(mass, stiffness, eigvals_only=True, subset_by_index=[n - lowest, n - 1])[::-1]
        inverse = known
        inverse = inverse[inverse > np.finfo(float).eps * inverse[0]]  # what has no mass does not swing
        found[neutral : neutral + len(inverse)] = 1.0 / inverse
    return found


def _firm_factor(stiffness: FloatArray) -> FloatArray | None:
    """Return Cholesky's factor of a matrix of ones on its diagonal, None unless positive by more than rounding."""
    try:
        factor = np.linalg.cholesky(stiffness)
    except np.linalg.LinAlgError:
        return None
    return np.asarray(factor) if (np.diag(factor) ** 2 > _NEUTRAL).all() else None


def _largest(mass: FloatArray, factor: FloatArray, count: int) -> FloatArray | None:
    """Return the largest values of M v = mu K v, falling, by iteration of a subspace; None where that does not settle.

    `factor` is Cholesky's of K. A subspace, and not one vector, so that equal frequencies are found as often as they
    occur: it is wider than the modes wanted, so few rounds do.
    """
    from scipy.linalg import solve_triangular

    known: Any = np.zeros(count)
    motions: Any = np.random.default_rng(0).standard_normal((len(mass), 3 * count + _SPARE))
    for _ in range(_MOST_ROUNDS):
        motions, _ = np.linalg.qr(motions)
        bent = solve_triangular(factor, motions, lower=True, trans=1)
        image = solve_triangular(factor, mass @ bent, lower=True)
        found = np.linalg.eigvalsh(motions.T @ image)[::-1][:count]
        if (np.abs(found - known) <= _SETTLED * found).all():
            return np.asarray(found)
        motions, known = image, found
    return None


def _evened(stiffness: FloatArray, *others: FloatArray) -> tuple[FloatArray, ...]:
    """Return matrices in unknowns whose own stiffness is one, where they have any."""
    size = np.sqrt(np.abs(np.diag(stiffness)))
    size = np.where(size > _NEUTRAL * size.max(), size, 1.0)
    return tuple(matrix / np.outer(size, size) for matrix in (stiffness, *others))


def _with_turning(system: _Reduced, count: int) -> tuple[FloatArray, bool, bool]:
    """Return the same under loads that turn with their node.

    The lowest ones are told from the inverse: M v = K v / omega^2.
    """
    found = np.full(count, np.nan)
    stiffness, turning, mass = _evened(system.stiffness, system.turning, system.mass)  # type: ignore[arg-type]
    try:
        inverse = np.linalg.eigvals(np.linalg.solve(stiffness + turning, mass))
    except np.linalg.LinAlgError:
        return found, False, True
    lowest = inverse[np.argsort(-np.abs(inverse))][: _RESOLVED * count + _RESOLVED]
    squares = 1.0 / lowest[np.abs(lowest) > np.finfo(float).eps * np.abs(lowest[0])]
    complex_ones = np.abs(squares.imag) > _REAL * np.abs(squares)
    swings, falls = bool(complex_ones.any()), bool((squares.real[~complex_ones] <= 0.0).any())
    if not (swings or falls):
        real = np.sort(squares.real)[:count]
        found[: len(real)] = real
    return found, swings, falls


__all__ = ["Frequencies", "frequencies"]
