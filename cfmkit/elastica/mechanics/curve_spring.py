"""A nonlinear spring as an energy term: one function of the unknowns, and a line in `ENERGY_TERMS`.

The force is a curve through given points, between them monotone cubics, beyond them straight on. Networks with it run
on numpy.

References
----------
[FC] F. N. Fritsch, R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238: monotone piecewise cubics.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.terms import ENERGY_TERMS, Contribution, force_along_direction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Attached, Discretisation


@dataclass(frozen=True)
class CurveSpring:
    """A spring that resists the motion of a node along a fixed direction by a curve of forces."""

    start: str  # the node
    direction: float  # [rad]
    displacement: tuple[float, ...]  # increasing [m]
    force: tuple[float, ...]  # against the motion [N]
    end: None = None  # the ground

    def __post_init__(self) -> None:
        if len(self.displacement) != len(self.force) or len(self.force) < 2:
            raise InputError("a spring's curve needs as many forces as displacements, at least two")
        if any(after <= before for before, after in pairwise(self.displacement)):
            raise InputError("the displacements of a spring's curve must increase")

    def evaluate(self, displacement: Any) -> tuple[Any, Any, Any]:
        """Return energy [J], force [N] and stiffness [N/m] at a displacement [m], by chance with a complex step.

        Examples
        --------
        >>> spring = CurveSpring("a", 0.0, (0.0, 1.0, 2.0), (0.0, 3.0, 6.0))
        >>> tuple(round(float(value), 9) for value in spring.evaluate(3.0))
        (13.5, 9.0, 3.0)
        """
        knots, pieces = _curve(self.displacement, self.force)
        number = int(np.searchsorted(knots, np.real(displacement), side="right"))
        cubic = pieces[number]
        d = displacement - knots[max(number - 1, 0)]
        energy = (((cubic[0] * d / 4 + cubic[1] / 3) * d + cubic[2] / 2) * d + cubic[3]) * d + cubic[4]
        force = ((cubic[0] * d + cubic[1]) * d + cubic[2]) * d + cubic[3]
        return energy, force, (3 * cubic[0] * d + 2 * cubic[1]) * d + cubic[2]


@lru_cache(maxsize=64)
def _curve(displacement: tuple[float, ...], force: tuple[float, ...]) -> tuple[Any, Any]:
    """Return the knots (n,), and of the pieces before, between and behind them the cubics' coefficients (n + 1, 5).

    The last coefficient is the energy where a piece begins; of no displacement it is zero.
    """
    from scipy.interpolate import PchipInterpolator

    knots = np.array(displacement)
    curve = PchipInterpolator(knots, force)
    slopes, primitive = curve.derivative()(knots), curve.antiderivative()
    energies = primitive(knots) - _energy_at_rest(knots, force, slopes, primitive)
    inner = np.vstack([curve.c, energies[:-1]]).T
    ends = [[0.0, 0.0, slopes[k], force[k], energies[k]] for k in (0, -1)]
    return knots, np.vstack([ends[0], inner, ends[1]])


def _energy_at_rest(knots: Any, force: Any, slopes: Any, primitive: Any) -> float:
    """Return the antiderivative at no displacement: on the curve, or on the straight line beyond its ends."""
    if knots[0] <= 0.0 <= knots[-1]:
        return float(primitive(0.0))
    k = 0 if knots[0] > 0.0 else -1
    d = -knots[k]
    return float(primitive(knots[k]) + d * force[k] + d * d * slopes[k] / 2)


def curve_spring(mesh: Discretisation, spring: Attached, z: Any, _share: Any, _drive: Any) -> Contribution:
    """Return the term of a spring with a curve of forces."""
    item, scales = spring.item, mesh.scales
    at = poses(mesh.attachments, z, list(spring.places))
    along = np.array([np.cos(item.direction), np.sin(item.direction)])
    rest = mesh.attachments.origin[spring.places[0]] + mesh.attachments.arm[spring.places[0]]
    energy, force, stiffness = item.evaluate((at.place[0] - rest) @ along * scales.length)
    return force_along_direction(
        at, along, energy / scales.moment, force / scales.force, stiffness * scales.length / scales.force
    )


ENERGY_TERMS[CurveSpring] = curve_spring
