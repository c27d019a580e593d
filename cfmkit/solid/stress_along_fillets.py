"""Fillets of a solved part, its rounded inside corners: where they are, and the largest stress in each at every pose.

Fillets are read off the boundary that is meshed: arcs of the cutter's radius that turn towards the waste. Whole circles
are holes, not fillets.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import read_only

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.boundary_and_element_sizes import Ring
    from cfmkit.solid.meshed_part import MeshSolution

RADIUS_RTOL = 0.02
"""Three neighbouring vertices stand on a fillet if their circle's radius differs from it by this share at most."""
ARC_EXTENSION = math.radians(6.0)
"""How far beyond its outermost vertices an arc may go on: outlines may lack the vertex at which it begins."""
MIN_STRESS_SHARE = 1e-9
"""Fillets with less than this share of the part's largest stress join pieces that move as one: it is rounding."""
RADIUS_DISTANCE_TOL = 0.01
"""Points nearer to the circle of a fillet than this are on it, and ends of a fillet nearer to a piece are on its edge;
in radii."""


@dataclass(frozen=True, eq=False)
class FilletArc:
    """Place of a fillet."""

    ring: int  # number of the ring that it is on
    center: FloatArray  # (2,) of its circle, in the waste [m]
    radius: float  # [m]
    ends: FloatArray  # (2, 2) its first and last vertex, the material on the left [m]

    @property
    def turn(self) -> float:
        """Angle from its first to its last vertex, positive [rad]."""
        first, last = self.ends - self.center
        return float((math.atan2(first[1], first[0]) - math.atan2(last[1], last[0])) % (2 * math.pi))

    @property
    def middle(self) -> FloatArray:
        """Point half way along it (2,) [m]."""
        first = self.ends[0] - self.center
        c, s = math.cos(0.5 * self.turn), math.sin(0.5 * self.turn)
        return np.asarray(self.center + np.array([[c, s], [-s, c]]) @ first)

    def covers(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which points (n, 2) [m] are on it."""
        radial, middle = points - self.center, self.middle - self.center
        off = np.abs(np.arctan2(middle[0] * radial[:, 1] - middle[1] * radial[:, 0], radial @ middle))
        return np.asarray(
            (np.abs(np.hypot(*radial.T) - self.radius) < RADIUS_DISTANCE_TOL * self.radius)
            & (off <= 0.5 * self.turn + ARC_EXTENSION)
        )

    def find_touched(self, pieces: Mapping[str, Sequence[FloatArray]]) -> tuple[str, ...]:
        """Return the names of the pieces, closed polygons (n, 2) [m] each, on whose edges it begins or ends."""
        from shapely import LinearRing, Point

        distance, ends = RADIUS_DISTANCE_TOL * self.radius, [Point(end) for end in self.ends]

        def touches(polygon: FloatArray) -> bool:
            return any(LinearRing(polygon).distance(end) < distance for end in ends)

        return tuple(name for name, polygons in pieces.items() if any(map(touches, polygons)))


@dataclass(frozen=True, eq=False)
class FilletStress:
    """A fillet with its largest stress at every pose."""

    arc: FilletArc
    travel: FloatArray  # (k,) of the poses, rising [m or rad]
    stress: FloatArray  # (k,) along the edge, that of largest size, tension positive [Pa]

    def largest(self, low: float, high: float) -> tuple[float, float] | None:
        """Return the largest stress of the poses from one travel to another [Pa], and the travel of it [m or rad].

        Largest in size; tension is positive. At ends that are no pose the size is interpolated, and the sign is that of
        the nearest pose. None if the part does not come to any.
        """
        from scipy.interpolate import PchipInterpolator

        slack = 1e-9 * float(np.ptp(self.travel))  # an end of a window is a pose, but for rounding
        inside = (self.travel >= low - slack) & (self.travel <= high + slack)
        ends = np.array([end for end in (low, high) if self.travel[0] <= end <= self.travel[-1]])
        places = np.concatenate([self.travel[inside], ends])
        if not len(places):
            return None
        size = np.abs(self.stress)
        stress = np.concatenate([size[inside], PchipInterpolator(self.travel, size)(ends)])
        worst = int(stress.argmax())
        nearest = int(np.abs(self.travel - places[worst]).argmin())
        return float(np.copysign(stress[worst], self.stress[nearest])), float(places[worst])


def stressed_fillets(
    solved: MeshSolution,
    radius: float,  # of its fillets [m]; 0 if it has none
) -> tuple[FilletStress, ...]:
    """Return the fillets of a solved part with their stresses, without those of rigid pieces."""
    grid, rising = solved.problem.elements.mesh, np.argsort(solved.course.travel)
    stress, nodes = solved.along_edges
    ring_of = np.zeros(len(grid.nodes), int)
    ring_of[grid.edges] = grid.rings[:, None]
    stressed = []
    for number, ring in enumerate(solved.part.rings):
        for arc in arcs(ring, number, radius):
            is_on_arc = (ring_of[nodes] == number) & arc.covers(grid.nodes[nodes])
            if np.abs(stress[:, is_on_arc]).max(initial=0.0) > MIN_STRESS_SHARE * np.abs(stress).max():
                worst = np.abs(stress[:, is_on_arc]).argmax(axis=1)
                largest = stress[:, is_on_arc][np.arange(len(stress)), worst]
                stressed.append(FilletStress(arc, solved.course.travel[rising], read_only(largest[rising])))
    return tuple(stressed)


def arcs(ring: Ring, number: int, radius: float) -> Iterator[FilletArc]:
    """Yield the arcs of a radius that turn towards the waste on a ring."""
    points, count = ring.points, len(ring.points)
    centers, radii = _circles_through(points)
    on = (ring.turns < 0) & (np.abs(radii - radius) <= RADIUS_RTOL * radius)
    if radius <= 0 or on.all():
        return
    for first in np.flatnonzero(on & ~np.roll(on, 1)):
        run = [int(first)]
        while on[(run[-1] + 1) % count]:
            run.append((run[-1] + 1) % count)
        ends = points[[run[0] - 1, (run[-1] + 1) % count]]
        yield FilletArc(number, centers[run].mean(axis=0), radius, read_only(ends))


def _circles_through(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return centre (n, 2) and radius (n,) [m] of the circle through each vertex and its two neighbours."""
    a, b = np.roll(points, 1, axis=0) - points, np.roll(points, -1, axis=0) - points
    twice = 2.0 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        aa, bb = (a * a).sum(axis=1) / twice, (b * b).sum(axis=1) / twice
        away = np.column_stack([b[:, 1] * aa - a[:, 1] * bb, a[:, 0] * bb - b[:, 0] * aa])
    return points + away, np.asarray(np.hypot(*away.T))
