"""The motion that a slider is given: where it is, how fast, how accelerated, at any times.

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, eq. 17.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


class Moment(NamedTuple):
    """Slider position [m], speed [m/s] and acceleration [m/s^2], each (n,) or a number."""

    position: Any
    speed: Any
    acceleration: Any


@dataclass(frozen=True)
class Cycloid:
    """Cycloidal motion: rest to rest without a jump of acceleration [SS, eq. 17].

    Attributes
    ----------
    start : float
        Slider position at the beginning [m].
    stroke : float
        Travel, negative for lowering [m].
    time : float
        Duration [s].
    """

    start: float
    stroke: float
    time: float

    def times(self, points: int) -> FloatArray:
        """Return `points` equal steps from beginning to end [s]."""
        return np.linspace(0.0, self.time, points)

    def at(self, times: FloatArray | np.float64) -> Moment:
        """Return position, speed and acceleration at times between 0 and `time` [s].

        Examples
        --------
        >>> middle = Cycloid(0.2, 0.1, 0.5).at(np.array([0.25]))
        >>> [round(float(values[0]), 12) for values in middle]
        [0.25, 0.4, 0.0]
        """
        share = times / self.time
        turn = (2.0 * np.pi) * share
        sine, speed = np.sin(turn), self.stroke / self.time
        position = self.start + self.stroke * (share - sine / (2.0 * np.pi))
        return Moment(position, speed * (1.0 - np.cos(turn)), (2.0 * np.pi * speed / self.time) * sine)
