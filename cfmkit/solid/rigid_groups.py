"""Supports and drives of a part: groups of nodes that move as one rigid piece each.

A group's three motions, two displacements and a turn about its centre, are a part that is driven times the travel, plus
directions in which it is free. A clamp has neither; a guide is driven along and nothing else; a pin is free to turn.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray
    from scipy.sparse import csc_array

    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class Group:
    """Nodes that move as one."""

    name: str  # for messages and results
    nodes: NDArray[np.int64]  # (k,)
    center: FloatArray  # (2,) about which it turns [m]
    # (3,) motion per unit of travel: x, y [m], turn [rad]
    driven: FloatArray = field(default_factory=lambda: np.zeros(3))
    # (3, f) orthonormal columns: motions that are left to equilibrium
    free: FloatArray = field(default_factory=lambda: np.zeros((3, 0)))
    # (3,) constant force x, y [N], which keeps its direction, and moment [N m] on it about its centre
    load: FloatArray = field(default_factory=lambda: np.zeros(3))


def find_within(nodes: FloatArray, shapes: Sequence[FloatArray], max_distance: float) -> NDArray[np.bool_]:
    """Return which nodes (n, 2) [m] are in polygons, or on lines of two points, or within `max_distance` [m]."""
    from shapely import LineString, Polygon, distance, points, union_all

    covered = union_all([Polygon(shape) if len(shape) > 2 else LineString(shape) for shape in shapes])
    return np.asarray(distance(covered, points(nodes)) <= max_distance)


def rotation_matrix(angle: float, derivative: int = 0) -> FloatArray:
    """Return a rotation matrix, or its derivative with respect to the angle [rad]."""
    c, s = np.cos(angle + derivative * np.pi / 2), np.sin(angle + derivative * np.pi / 2)
    return np.array([[c, -s], [s, c]])


@dataclass(frozen=True)
class Supports:
    """The unknowns of a held part: displacements of the nodes in no group, then the free motions of the groups."""

    places: FloatArray  # (n, 2) nodes [m]
    groups: tuple[Group, ...]  # no node is in two of them

    @cached_property
    def loose(self) -> NDArray[np.int64]:
        """The displacements (2 x node + direction) that belong to no group."""
        held = np.zeros(len(self.places), bool)
        for group in self.groups:
            held[group.nodes] = True
        return np.flatnonzero(np.repeat(~held, 2))

    @cached_property
    def size(self) -> int:
        """Number of unknowns."""
        return int(len(self.loose) + sum(group.free.shape[1] for group in self.groups))

    def motions(self, unknowns: FloatArray, travel: float) -> list[FloatArray]:
        """Return x, y [m] and turn [rad] of every group."""
        motions, first = [], len(self.loose)
        for group in self.groups:
            last = first + group.free.shape[1]
            motions.append(group.driven * travel + group.free @ unknowns[first:last])
            first = last
        return motions

    def evaluate_displacements(self, unknowns: FloatArray, travel: float) -> FloatArray:
        """Return the displacements (n, 2) [m] of all nodes."""
        moved = np.zeros((len(self.places), 2))
        moved.ravel()[self.loose] = unknowns[: len(self.loose)]
        for group, motion in zip(self.groups, self.motions(unknowns, travel), strict=True):
            arm = self.places[group.nodes] - group.center
            moved[group.nodes] = motion[:2] + arm @ (rotation_matrix(motion[2]) - np.eye(2)).T
        return moved

    def _levers(self, motions: list[FloatArray]) -> list[FloatArray]:
        """Return, for every group, how its nodes' displacements follow its motions, (2k, 3)."""
        levers = []
        for group, motion in zip(self.groups, motions, strict=True):
            arm = (self.places[group.nodes] - group.center) @ rotation_matrix(motion[2], 1).T
            lever = np.zeros((len(group.nodes), 2, 3))
            lever[:, 0, 0] = lever[:, 1, 1] = 1.0
            lever[:, :, 2] = arm
            levers.append(lever.reshape(-1, 3))
        return levers

    def reactions(self, unknowns: FloatArray, travel: float, forces: FloatArray) -> FloatArray:
        """Return force x, y [N] and moment about its centre [N m] on every group, (groups, 3), that hold it there.

        They come on top of its constant load.
        """
        levers = self._levers(self.motions(unknowns, travel))
        pairs = zip(self.groups, levers, strict=True)
        reactions = [lever.T @ forces[group.nodes].ravel() - group.load for group, lever in pairs]
        return np.array(reactions).reshape(-1, 3)

    @property
    def loaded(self) -> bool:
        """Whether constant loads act on groups."""
        return any(group.load.any() for group in self.groups)

    def scale_loads(self, share: float) -> Supports:
        """Return the supports with their constant loads multiplied by a share."""
        return replace(self, groups=tuple(replace(group, load=share * group.load) for group in self.groups))

    def residual(self, unknowns: FloatArray, travel: float, forces: FloatArray) -> FloatArray:
        """Return what is out of balance in each unknown [N or N m]."""
        reactions = self.reactions(unknowns, travel, forces)
        ends = [group.free.T @ reaction for group, reaction in zip(self.groups, reactions, strict=True)]
        return np.concatenate([forces.ravel()[self.loose], *ends])

    def linearize_motion(self, unknowns: FloatArray, travel: float, forces: FloatArray) -> Carried:
        """Return how free motions and the travel move the nodes; forces (n, 2) [N] act on these."""
        motions = self.motions(unknowns, travel)
        count = self.size - len(self.loose)
        ways, curved, first = np.zeros((2 * len(self.places), count + 1)), np.zeros((count + 1, count + 1)), 0
        for group, motion, lever in zip(self.groups, motions, self._levers(motions), strict=True):
            rows = (2 * group.nodes[:, None] + np.arange(2)).ravel()
            last = first + group.free.shape[1]
            ways[rows, first:last] = lever @ group.free
            ways[rows, -1] = lever @ group.driven
            arm = (self.places[group.nodes] - group.center) @ rotation_matrix(motion[2], 2).T
            turns = np.zeros(count + 1)
            turns[first:last], turns[-1] = group.free[2], group.driven[2]
            curved += float((forces[group.nodes] * arm).sum()) * np.outer(turns, turns)
            first = last
        return Carried(self.loose, ways, curved)


@dataclass(frozen=True)
class Carried:
    """Derivatives of nodal displacements by free motions of groups and by the travel."""

    loose: NDArray[np.int64]  # (l,) as of `Supports`
    # (2n, f + 1) derivatives of the nodes' displacements with respect to f free motions and the travel
    ways: FloatArray
    curved: FloatArray  # (f + 1, f + 1) what the forces on the nodes add to the stiffness as groups turn [N m]

    def borders(self, stiffness: csc_array) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the derivatives of the residual that are not those of loose nodes by each other.

        Of loose nodes by the f free motions (l, f), of these by each other (f, f), and of all by the travel (l + f,).
        """
        pulled = stiffness @ self.ways
        corner = self.ways.T @ pulled + self.curved
        beside = pulled[self.loose]
        slope = np.concatenate([beside[:, -1], corner[:-1, -1]])
        return beside[:, :-1], corner[:-1, :-1], slope

    def moves(self, vector: FloatArray) -> FloatArray:
        """Return how the nodes move (n, 2) in a direction of unknowns and travel (l + f + 1,)."""
        moves = self.ways @ vector[len(self.loose) :]
        moves[self.loose] += vector[: len(self.loose)]
        return moves.reshape(-1, 2)

    def times(self, pull: Callable[[FloatArray], FloatArray], vector: FloatArray) -> FloatArray:
        """Return how residuals and effort (l + f + 1,) change in a direction of unknowns and travel (l + f + 1,).

        `pull` gives the change of the nodes' forces (n, 2) in a direction of the nodes.
        """
        forces = pull(self.moves(vector)).ravel()
        return np.concatenate([forces[self.loose], self.ways.T @ forces + self.curved @ vector[len(self.loose) :]])
