"""A path under loads at every place of a node's motion instead of the loads: equilibria between its points.

The motion is held while the load is solved for, so that a force may have an extreme there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.results.between_points import MIN_PATH_POINTS, PLACE_RTOL, BetweenPoints
from cfmkit.numerics.continuation.problem import Border

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.equations import SolvedStates
    from cfmkit.elastica.results.path import EquilibriumPath
    from cfmkit.numerics.continuation.problem import PathEquilibrium


@dataclass(frozen=True, eq=False)
class BetweenLoads(BetweenPoints):
    """Effort and stress of a path under loads at every place of a node's motion."""

    row: FloatArray  # (n + 1,) what the free unknowns and the drive count for in the dimensionless motion
    unit_of_motion: float  # [m or rad]
    rest: float  # the motion where all unknowns are zero [m or rad]

    @property
    def _motion(self) -> FloatArray:
        return np.asarray(self.unit_of_motion * (self.path.free @ self.row[:-1]) + self.rest)

    @property
    def _scale(self) -> float:
        return self.unit_of_motion

    def _effort_on(self, path: EquilibriumPath) -> FloatArray:
        return path.drive

    def _solve_places(self, y: FloatArray, wanted: FloatArray, loads: FloatArray) -> tuple[SolvedStates, FloatArray]:
        goals = wanted - self.rest / self.unit_of_motion
        solved = [self._solve_place(*guess) for guess in zip(y, loads, goals, strict=True)]
        ways = np.array([np.nan if spot is None else spot.drive for spot in solved])
        return self._equations.collect(solved), ways

    def _solve_place(self, y: FloatArray, load: float, goal: float) -> PathEquilibrium | None:
        border = Border(self.row, goal)
        first = self._equations.solve(y, load, border)
        # the solver watches poses and forces: once more, so that the load is as exact as they are
        return None if first is None else self._equations.solve(first.x, first.drive, border)

    def _find_allowed_counts(self, _nearest: Any, left: Any) -> Any:
        return np.stack([self._unstable[left], self._unstable[left + 1]], axis=1)  # a largest load: two of each kind

    @cached_property
    def own_drive(self) -> FloatArray:
        """Dimensionless motions at the points, increasing."""
        return self.own_points / self.unit_of_motion

    @cached_property
    def _stretch(self) -> Any:
        """Parted by other branches only: at a largest load a path is smooth."""
        branch = self.path.branch[self._order]
        parted = np.concatenate([[False], branch[1:] != branch[:-1]])
        parted[self._contacts] = True
        return np.cumsum(parted)

    @cached_property
    def _events(self) -> FloatArray:
        return np.sort(self.own_drive[self._contacts])  # bifurcations are reported by loads: motions may be several


def interpolate_loads(
    path: EquilibriumPath,  # under loads
    node: str,  # whose motion it is over
    along: float | None,  # direction of the motion [rad]; None: its rotation
    unit: float = 1.0,  # what the load is multiplied by: parts side by side
    axial: bool = True,  # whether the stress has its axial part
    allowed: float | None = None,  # stress [Pa]; where it is passed is solved for
) -> BetweenLoads | None:
    """Return a path under loads at every place of a node's motion.

    None if the motion turns back, where a link with an arm moves the node, where points are too few, or miss the
    tolerance.
    """
    mesh = path.mesh
    if len(path) < MIN_PATH_POINTS or not np.all(path.accurate) or (along is not None and node not in mesh.bodies):
        return None
    place = mesh.nodes[node]
    unknowns, frame = mesh.attachments.unknowns[place], mesh.attachments.frame[place]
    if along is None:
        parts, scale = {int(unknowns[3]): 1.0}, 1.0
    else:
        cos, sin = np.cos(along), np.sin(along)
        shares = cos * frame[0] + sin * frame[1], sin * frame[0] - cos * frame[1]
        parts, scale = dict(zip(unknowns[:2].tolist(), shares, strict=True)), mesh.scales.length
    row, slots = np.zeros(len(mesh.free) + 1), {unknown: k for k, unknown in enumerate(mesh.free.tolist())}
    for unknown, share in parts.items():
        if unknown in slots:
            row[slots[unknown]] += share
    moved = path.motion(node)
    motion = moved[:, 2] if along is None else moved[:, 0] * np.cos(along) + moved[:, 1] * np.sin(along)
    rest = motion - scale * (path.free @ row[:-1])
    steps, least = np.diff(motion), PLACE_RTOL * float(np.ptp(motion))  # rounding may go one way, too
    if not row.any() or np.ptp(rest) > least or not ((steps > least).all() or (steps < -least).all()):
        return None
    return BetweenLoads(path, unit, axial, allowed, read_only(row), scale, float(rest.mean()))
