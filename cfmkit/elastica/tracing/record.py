"""What tracing a network on one discretisation comes to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.effort import effort, motion

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.outcome.path import Event, PathStatus
    from cfmkit.elastica.tracing.imperfection import Buckling
    from cfmkit.numerics.continuation.path import Point


@dataclass(frozen=True, eq=False)
class TracedPath:
    """Equilibria of a network under a drive, in path order."""

    network: Network
    load: Drive
    problem: NetworkProblem
    points: tuple[Point, ...]
    events: tuple[Event, ...]
    status: PathStatus
    message: str
    first: Buckling | None = None  # first loss of stability
    error: float = np.inf  # estimated, of efforts and motions, relative to the largest of the path
    imperfection: str = ""

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    @cached_property
    def z(self) -> FloatArray:
        """All unknowns at every point, (n, size), dimensionless."""
        network = self.problem.network
        values = network.base + self.drives[:, None] * network.rate
        values[:, network.free] = np.array([point.at.x for point in self.points]).reshape(len(self), -1)
        return np.asarray(values)

    @cached_property
    def drives(self) -> FloatArray:
        """The drive at every point, dimensionless."""
        return np.array([point.at.drive for point in self.points])

    @property
    def drive(self) -> FloatArray:
        """The drive at every point [m, rad or 1]."""
        return self.drives * self.problem.network.scales.drive

    @property
    def unstable(self) -> Any:
        """Number of unstable directions at every point while the drive is held."""
        return np.array([point.at.unstable for point in self.points], int)

    @property
    def requested(self) -> Any:
        """Index of the requested value at every point, -1 between them."""
        return np.array([point.target for point in self.points], int)

    @property
    def at_requested(self) -> Any:
        """Indices of the points at requested values."""
        return np.flatnonzero(self.requested >= 0)

    @cached_property
    def effort(self) -> FloatArray:
        """What the drive works with at every point, SI."""
        network = self.problem.network
        if not network.rate.any():
            return np.array([effort(network, z, drive) for z, drive in zip(self.z, self.drives, strict=True)])
        known = np.array([point.at.effort for point in self.points]) * network.scales.moment / network.scales.drive
        for index in np.flatnonzero(np.isnan(known)):
            known[index] = effort(network, self.z[index], self.drives[index])
        return known

    @cached_property
    def gradient(self) -> FloatArray:
        """Forces on all unknowns that nothing in the functional balances: those of supports and a drive, (n, size)."""
        network = self.problem.network
        pairs = zip(self.z, self.drives, strict=True)
        return np.array([energy.gradient(network, z, drive) for z, drive in pairs]).reshape(self.z.shape)

    def motion(self, node: str) -> FloatArray:
        """Return displacement and rotation of a node at every point, (n, 3) [m, m, rad]."""
        return np.array([motion(self.problem.network, node, z) for z in self.z]).reshape(-1, 3)

    def reaction(self, node: str) -> FloatArray:
        """Return force and moment that hold a node that no link moves, (n, 3) [N, N, N m]."""
        network = self.problem.network
        x, y, turn = network.bodies[node]
        cos, sin = network.attachments.frame[network.nodes[node]]
        along, across, moment = self.gradient[:, x], self.gradient[:, y], self.gradient[:, turn]
        force = np.stack([cos * along - sin * across, sin * along + cos * across], axis=-1)
        scales = network.scales
        return np.column_stack([force * scales.force, moment * scales.moment])
