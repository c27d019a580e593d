"""Sections of beams as specified, and how thick a drawn or meshed part is there: is the part what was specified?

Across the middle of every smooth piece of a beam the part must have the beam's thickness. Joints are left out: sections
at which the part runs on into another beam or a block, and short pieces beside a step, which a fillet may thicken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray

SECTION_RTOL = 1e-3  # largest relative error of an area and of a section modulus, b t^2 / 6


@dataclass(frozen=True, eq=False)
class BeamSection:
    """A section of a beam as specified."""

    beam: str  # its name, for messages
    # at, across, (2,): its middle [m], and the unit vector along it
    at: FloatArray
    across: FloatArray
    # thickness, length: of the beam there, and of its piece that is smooth [m]
    thickness: float
    length: float

    def cut(self, starts: FloatArray, ends: FloatArray) -> tuple[float, float]:
        """Return how far the material goes to both sides, as bounded by lines (n, 2) [m]; infinite without a bound."""
        along = np.array([self.across[1], -self.across[0]])
        one, other = ((points - self.at) @ along for points in (starts, ends))
        met = (one > 0) != (other > 0)
        share = one[met] / (one[met] - other[met])
        away = ((starts[met] + share[:, None] * (ends[met] - starts[met])) - self.at) @ self.across
        return (
            float(-away[away < 0].max(initial=-np.inf)),
            float(away[away > 0].min(initial=np.inf)),
        )

    def line(self, cut: tuple[float, float]) -> FloatArray:
        """Return the ends of the section that reaches so far to both sides (2, 2) [m]."""
        return np.array([self.at - cut[0] * self.across, self.at + cut[1] * self.across])

    def check(self, measured: float, what: str, remedy: str) -> None:
        """Refuse a thickness [m] whose section modulus is not that of the specification.

        Raises GeometryError with the beam, the place, both values and a remedy.
        """
        if abs((measured / self.thickness) ** 2 - 1.0) <= SECTION_RTOL:
            return
        x, y = (format_short(float(one), "length") for one in self.at)
        found = f"{format_short(measured, 'length')} thick" if np.isfinite(measured) else "endless"
        raise GeometryError(
            f"beam {self.beam!r} is {found} in the {what} at ({x}, {y}), but "
            f"{format_short(self.thickness, 'length')} in the specification: {remedy}"
        )


def lines_of(rings: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return starts and ends (n, 2) of the lines of closed rings (k, 2) of points [m]."""
    return np.concatenate(list(rings)), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
