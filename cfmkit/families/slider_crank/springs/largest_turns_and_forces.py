"""Largest turns, energies and forces inside over a motion, wherever they are: they do not depend on a curve's points.

All of them are those of the closed form, for one mechanism or for many that differ in their springs alone: energies
and forces are linear in the rates.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.sprung_linkage import reactions
from cfmkit.metrics.continuous_means_and_extremes import extremes

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


NODES, TURN_NODES = 129, 385
"""Places of the grid for less and for more than a quarter turn."""

Ends = tuple["FloatArray", "FloatArray"]
"""Largest and smallest values."""


@dataclass(frozen=True)
class MotionExtremes:
    """The extremes of a linkage over a motion.

    Attributes
    ----------
    assembly : Assembly
        Its rates do not matter.
    low, high : float
        The motion [rad or m].
    """

    assembly: Assembly
    low: float
    high: float

    @cached_property
    def nodes(self) -> tuple[FloatArray, UnitCurves]:
        """A grid over the motion, the unloaded position one of its places, and what unit springs do there."""
        wide = self.assembly.drive == "torque" and self.high - self.low > 0.5 * np.pi
        share = np.linspace(0.0, 1.0, TURN_NODES if wide else NODES)
        if self.assembly.drive == "force":  # the force runs like the square root of the travel from the stretched place
            share = share**2
        places = self.low + (self.high - self.low) * share
        if self.low < self.assembly.start < self.high:
            places = np.union1d(places, [self.assembly.start])
        return places, self.assembly.units(places)

    @cached_property
    def turns(self) -> Ends:
        """Largest and smallest turn of the spring at each joint, of the slider's its travel, (4,) each [rad or m]."""
        places, units = self.nodes

        def turn(at: FloatArray) -> FloatArray:
            """Return each joint's turn at the places of its row."""
            return np.asarray(np.einsum("jjm->jm", self.assembly.units(at.ravel()).turn.reshape(4, *at.shape)))

        return extremes(turn, places[None, :], units.turn, uneven=True)

    @property
    def largest_turns(self) -> FloatArray:
        """Sizes of the largest turns, (4,) [rad; the last m]."""
        high, low = self.turns
        return np.maximum(np.abs(high), np.abs(low))

    def energy(self, rates: FloatArray) -> FloatArray:
        """Return the largest energy in the springs of each design, (d,) [J]; `rates` is (d, 4)."""
        return self._of(rates, lambda units: 0.5 * units.turn**2)[0]

    def coupler(self, rates: FloatArray) -> Ends:
        """Return the largest and the smallest tension in the coupler of each design, (d,) each [N]."""
        return self._of(rates, lambda units: self._unit_reactions(units, 0))

    def guide(self, rates: FloatArray) -> Ends:
        """Return the largest and the smallest force on the guide of each design, (d,) each [N]."""
        return self._of(rates, lambda units: self._unit_reactions(units, 1))

    def _unit_reactions(self, units: UnitCurves, which: int) -> FloatArray:
        """Return what a unit spring at each joint puts on coupler or guide, (4, n)."""
        drives = units.effort if self.assembly.drive == "force" else np.zeros_like(units.effort)
        alone = (replace(self.assembly, rates=rates) for rates in np.eye(4))
        return np.array([reactions(one, units, drive)[which] for one, drive in zip(alone, drives, strict=True)])

    def _of(self, rates: FloatArray, unit: Callable[[UnitCurves], FloatArray]) -> Ends:
        """Return the extremes of what is linear in the rates of each design."""
        there = np.flatnonzero(rates.any(axis=0))  # a spring that is nowhere does nothing, even at a pole
        rates = rates[:, there]
        places, units = self.nodes

        def values(at: FloatArray) -> FloatArray:
            found = unit(self.assembly.units(at.ravel()))[there].reshape(-1, *at.shape)
            return np.asarray(np.einsum("dj,jdm->dm", rates, found))

        each = unit(units)[there]
        known = np.isfinite(each).all(axis=0)
        if not known.any():
            nothing = np.full(len(rates), np.nan)
            return nothing, nothing
        return extremes(values, places[known][None, :], rates @ each[:, known], uneven=True)
