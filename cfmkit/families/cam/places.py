"""Places on a cam's curve, solved for: nodes so dense that the force hides nothing between two of them.

With friction the force rises from zero to its constant value within nanometres of travel, on a corner within a
tenth of a millimetre: nodes stand at even shares of the logarithm there, at even steps of the springs' stretch
beyond, and close together again before the end, where a brace may come near horizontal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.contact import flank_pressure, stress
from cfmkit.families.cam.statics import forces

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.track_states import TrackStates
    from cfmkit.families.cam.model import Solution
    from cfmkit.families.cam.statics import Forces

_SHARES = np.concatenate(
    [np.geomspace(1e-14, 1e-4, 51), np.linspace(0.0, 1.0, 181) ** 2, 1.0 - np.geomspace(1e-9, 0.03, 24)]
)
_ON_CORNER = np.concatenate([np.geomspace(1e-9, 0.02, 30), np.linspace(0.0, 1.0, 61)])


def nodes(total: FloatArray, corner: FloatArray) -> FloatArray:
    """Return travels at which the force is looked at, (d, n), increasing [m].

    Parameters
    ----------
    total, corner : (d,) array
        Travel of each cam, and that at which its roller leaves the corner; 0 without one [m].
    """
    on_corner = np.minimum(corner, total)[:, None] * _ON_CORNER
    return np.sort(np.concatenate([total[:, None] * _SHARES, on_corner], axis=1), axis=1)


@dataclass(frozen=True, eq=False)
class Places:
    """The loop of a solved mechanism at every place (a `cfmkit.results.ClosedForm`)."""

    solution: Solution

    @cached_property
    def places(self) -> FloatArray:
        """Increasing displacements [m]."""
        solution = self.solution
        grid = nodes(solution.travel[-1:], np.array([solution.corner_travel]))[0]
        return np.asarray(grid + solution.origin)

    @property
    def peaks(self) -> FloatArray:
        """None: between two samples of a usual curve no cam has a peak of its own."""
        return np.empty(0)

    def effort(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the force on the way up or down at displacements of any shape [N]."""
        return np.asarray(self._at(branch, places)[1].slider.reshape(np.shape(places)))

    def stress(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the stress below the contact at displacements of any shape [Pa]; NaN on the corner."""
        states, found = self._at(branch, places)
        pressed = flank_pressure(self.solution.assembly, states, found.contact)
        return np.asarray(stress(pressed).reshape(np.shape(places)))

    def _at(self, branch: str, places: FloatArray) -> tuple[TrackStates, Forces]:
        """Return where the rollers are at displacements, and the forces there, as one row."""
        solution = self.solution
        track, friction = solution.assembly.track, solution.assembly.spec.mechanism.rolling_friction
        travel = np.clip(np.ravel(places) - solution.origin, 0.0, solution.travel[-1])
        states = track.states(track.start + travel)
        return states, forces(states, solution.assembly.loads, friction if branch == "load" else -friction)
