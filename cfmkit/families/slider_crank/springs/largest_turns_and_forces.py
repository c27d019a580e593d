"""Largest turns, energies and forces inside over a motion, wherever they are: they do not depend on a curve's points.

All of them are those of the closed form, for one mechanism or for many as rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.largest_next_to_samples import finite_samples
from cfmkit.families.slider_crank.springs.sprung_linkage import reactions
from cfmkit.metrics.continuous_means_and_extremes import extremes

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


GRID_SIZES, TURN_NODES = 129, 385  # places of the grid for less and for more than a quarter turn
Ends = tuple["FloatArray", "FloatArray"]  # largest and smallest values


def is_wide(assembly: Assembly, low: Any, high: Any) -> bool:
    """Return whether a motion, or one of several, takes more than a quarter turn."""
    return bool(assembly.drive == "torque" and np.any(high - low > 0.5 * np.pi))


@dataclass(frozen=True, eq=False, repr=False)
class MotionExtremes(ShortRepr):
    """The extremes of a linkage over a motion, or of m linkages as rows, of which all are wide or none is."""

    assembly: Assembly
    low: Any  # ends of the motion, floats or (m, 1) [rad or m]
    high: Any

    @cached_property
    def places(self) -> FloatArray:
        """A grid over the motion, (m, n), the unloaded position one of its places; the last one may stand twice."""
        low, high, start = (np.reshape(column, (-1, 1)) for column in (self.low, self.high, self.assembly.start))
        wide = is_wide(self.assembly, self.low, self.high)
        share = self.assembly.spread(np.linspace(0.0, 1.0, TURN_NODES if wide else GRID_SIZES))
        places = low + (high - low) * share
        inside = (low < start) & (start < high) & (places != start).all(axis=1, keepdims=True)
        more = np.where(inside, start, places[:, -1:])
        grid = np.broadcast_to(places, (len(more), places.shape[1]))
        return np.sort(np.hstack([grid, more]), axis=1)

    @cached_property
    def last(self) -> NDArray[np.intp]:
        """Index of the last place of each row, (m,)."""
        places = self.places
        return np.asarray(places.shape[1] - np.where(places[:, -1] > places[:, -2], 1, 2), dtype=np.intp)

    @cached_property
    def units(self) -> UnitCurves:
        """Efforts of unit springs there."""
        return self.assembly.units(self.places)

    @cached_property
    def turns(self) -> Ends:
        """Largest and smallest turn of the spring at each joint, of the slider's its travel, (4, m) each [rad or m]."""
        values = self.units.turn
        count = values.shape[1]
        motion = np.tile(np.broadcast_to(self.places, values.shape[1:]), (4, 1))
        last = np.tile(np.broadcast_to(self.last, count), 4)

        def turn(at: FloatArray) -> FloatArray:
            """Return each joint's turn at the places of its rows."""
            places = at.reshape(4, count, -1)
            units = self.assembly.units(places.swapaxes(0, 1).reshape(count, -1))
            return np.asarray(np.einsum("jmjk->jmk", units.turn.reshape(4, count, 4, -1)).reshape(at.shape))

        high, low = extremes(turn, motion, values.reshape(4 * count, -1), uneven=True, last=last)
        return high.reshape(4, count), low.reshape(4, count)

    @property
    def largest_turns(self) -> FloatArray:
        """Sizes of the largest turns, (4, m) [rad; the last m]."""
        high, low = self.turns
        return np.maximum(np.abs(high), np.abs(low))

    @cached_property
    def energy(self) -> FloatArray:
        """The largest energy in the springs, (m,) [J]."""
        return self._find_extremes(lambda units: 0.5 * self.assembly.total(units.turn**2))[0]

    @cached_property
    def coupler(self) -> Ends:
        """The largest and the smallest tension in the couplers of all legs, (m,) each [N]."""
        return self._find_extremes(lambda units: self._reactions(units)[0])

    @cached_property
    def guide(self) -> Ends:
        """The largest and the smallest force on the guide of all legs, (m,) each [N]."""
        return self._find_extremes(lambda units: self._reactions(units)[1])

    def _reactions(self, units: UnitCurves) -> tuple[FloatArray, FloatArray]:
        is_driven = self.assembly.drive == "force"
        return reactions(self.assembly, units, self.assembly.total(units.effort) if is_driven else np.zeros(1))

    def _find_extremes(self, function: Callable[[UnitCurves], FloatArray]) -> Ends:
        """Return the largest and the smallest value over the motion; NaN where none is finite."""
        values = function(self.units)
        motion, values, last = finite_samples(self.places, values, self.last)
        return extremes(lambda at: function(self.assembly.units(at)), motion, values, uneven=True, last=last)
