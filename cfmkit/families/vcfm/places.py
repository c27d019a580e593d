"""The nominal curve at every place: what the model says there, with places so dense that the force hides nothing.

Thin leaves buckle within a hundredth of the travel, and the peak of the force stands there: places crowd at the start,
and around both ends of the constant negative stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.model import Push, Solution

EVEN = 257
"""Places at even steps: the force beyond the peak is smooth, and the leaves' law has no shorter waves."""

CROWDED = np.geomspace(1e-6, 1.0, 73)
"""Shares of the travel, and of the way from an end of the constant stiffness, at which more places stand."""


@dataclass(frozen=True, eq=False)
class Places:
    """The force at the nominal preload (a `cfmkit.results.ClosedForm`), with the stress of all preloads."""

    solution: Solution

    @cached_property
    def places(self) -> FloatArray:
        """Increasing travels of the shuttle [m]."""
        travel = self.solution.nominal.travel
        low, high = float(travel[0]), float(travel[-1])
        marks = [mark for mark in (*self.solution.character.linear, 0.0) if np.isfinite(mark) and low <= mark < high]
        around = [mark + sign * CROWDED * (high - low) for mark in marks for sign in (-1.0, 1.0)]
        grid = np.unique(np.concatenate([np.linspace(low, high, EVEN), marks, *around]))
        return grid[(grid >= low) & (grid <= high)]

    @property
    def peaks(self) -> FloatArray:
        """All places: thin leaves have their peak before the second point of a curve [m]."""
        return self.places

    def effort(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the force at travels of any shape [N]."""
        sampler, travel = self.solution.sampler, np.ravel(places)
        force = sampler.leaf_force(travel) + sampler.spring(travel + self.solution.nominal.preload)[0]
        return np.asarray(force.reshape(np.shape(places)))

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of leaves and spring at travels of any shape, of all preloads there [Pa]."""
        travel = np.ravel(places)
        leaves = self.solution.sampler.leaves(travel).stress
        found = np.max([np.maximum(leaves, self._spring(push, travel)) for push in self.solution.pushes], axis=0)
        return np.asarray(found.reshape(np.shape(places)))

    def _spring(self, push: Push, travel: FloatArray) -> FloatArray:
        """Return the stress of the spring at a preload, none beyond its curve [Pa]."""
        beyond = (travel < push.travel[0]) | (travel > push.travel[-1])
        return np.where(beyond, 0.0, self.solution.sampler.spring(travel + push.preload)[1])
