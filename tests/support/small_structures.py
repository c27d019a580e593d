"""Structures of a few unknowns in closed form, as problems for `cfmkit.numerics.continuation`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.numerics.continuation import PathEquilibrium

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True, eq=False)
class Linear:
    """Residual and tangent of a dense problem at one place."""

    residual: Any
    rate: Any
    tangent: Any

    @property
    def unstable(self) -> int:
        """Number of negative eigenvalues."""
        return int((np.linalg.eigvalsh(self.tangent) < 0).sum())

    def solve(self, right: Any) -> Any:
        """Return the solution of the tangent's equations."""
        try:
            return np.linalg.solve(self.tangent, right)
        except np.linalg.LinAlgError:
            return None


@dataclass(frozen=True, eq=False)
class Structure:
    """A problem by functions of (x, drive): gradient, its derivative by x and by the drive."""

    gradient: Callable[[Any, float], Any]
    hessian: Callable[[Any, float], Any]
    by_drive: Callable[[Any, float], Any]
    size: int

    @property
    def unit(self) -> Any:
        """All unknowns are of size one."""
        return np.ones(self.size)

    @property
    def motions(self) -> Any:
        """All unknowns are motions."""
        return np.ones(self.size, bool)

    def linearise(self, x: Any, drive: float) -> Linear:
        """Return residual and tangent."""
        parts = (function(x, drive) for function in (self.gradient, self.by_drive, self.hessian))
        return Linear(*(np.asarray(part, float) for part in parts))

    def modes(self, at: PathEquilibrium, count: int) -> tuple[Any, Any]:
        """Return the eigenvalues nearest to zero with their vectors."""
        values, vectors = np.linalg.eigh(self.hessian(at.x, at.drive))
        order = np.argsort(np.abs(values))[:count]
        return values[order], vectors[:, order]

    def orient(self, modes: Any) -> Any:
        """Return the sum of the modes, its largest part negative."""
        total = modes @ np.sign(modes[np.abs(modes).argmax(axis=0), np.arange(modes.shape[1])])
        return -total

    def rest(self) -> PathEquilibrium:
        """Return the equilibrium at rest: all unknowns zero."""
        zero = np.zeros(self.size)
        here = self.linearise(zero, 0.0)
        assert not here.residual.any()
        return PathEquilibrium(zero, 0.0, -np.linalg.solve(here.tangent, here.rate), here.unstable)


def truss(height: float) -> Structure:
    """Return two bars of unit stiffness over unit half span under a load down at their ridge; x: how far it sinks.

    The load is (1 / l0 - 1 / l) (height - x), l the length of a bar: a limit point where its slope vanishes.
    """
    rest = np.hypot(1.0, height)

    def load(x: Any) -> Any:
        rise = height - x
        return (1 / rest - 1 / np.hypot(1.0, rise)) * rise * -1.0

    def slope(x: Any) -> Any:
        rise = height - x
        return 1 / rest - 1 / np.hypot(1.0, rise) + rise**2 / np.hypot(1.0, rise) ** 3

    return Structure(
        lambda x, drive: load(x) - drive, lambda x, _: np.diag(slope(x)), lambda _x, _: np.array([-1.0]), 1
    )


def columns(*stiffness: float, bend: float = 0.0) -> Structure:
    """Return upright rigid columns of unit length on torsion springs, each under the drive as its load.

    k x = drive sin(x), x the lean: pitchforks at the stiffnesses. `bend` is a lean at rest that unfolds them.
    """
    k = np.array(stiffness)
    return Structure(
        lambda x, drive: k * x - drive * np.sin(x + bend),
        lambda x, drive: np.diag(k - drive * np.cos(x + bend)),
        lambda x, _: -np.sin(x + bend),
        len(k),
    )


def bulge(first: float, last: float) -> Structure:
    """Return x^3 = (drive - first)(last - drive) x: a branch begins at one drive and ends at the other.

    A second unknown follows the drive.
    """
    return Structure(
        lambda x, drive: np.array([x[0] ** 3 - (drive - first) * (last - drive) * x[0], x[1] - drive]),
        lambda x, drive: np.diag([3 * x[0] ** 2 - (drive - first) * (last - drive), 1.0]),
        lambda x, drive: np.array([-(first + last - 2 * drive) * x[0], -1.0]),
        2,
    )
