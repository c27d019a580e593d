"""Walls of a part thinner than their process can make: beams, frames, and what is left between a hole and an edge.

From places all along the edges a ray runs into the material until it meets an edge that faces back: that is how thick
the part is there. Tips of corners are thin as well, but no walls, and are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import OUTLINE_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.export.contours import Contour

MIN_FACING_SINE = 0.7  # sine of the angle at which a ray must meet an edge that is the other side of a wall: 45 degrees
PER_WALL, MOST_PLACES = 2.0, 20_000
"""Places along an edge in the thinnest wall that a process makes, and all round a part at most."""
MIN_WAY_AROUND = 4.0
"""Way along the edge from one side of a wall to the other, in its thickness, at least: round a tip of 27 degrees it is
4.2 times as long as the ray, round blunter ones less. The end of a wall belongs to it up to 1.5 thicknesses from there.
"""


@dataclass(frozen=True)
class ThinWall:
    """A wall where it is thinnest."""

    thickness: float  # [m]
    at: tuple[float, float]  # in the middle of the wall [m]


def facing_lines(
    # starts, along: (n, 2) each: lines of an outline: where each begins, and the vector to its end [m]
    starts: FloatArray,
    along: FloatArray,
    # places, normals: (m, 2) each: where rays start [m], and unit vectors into the material
    places: FloatArray,
    normals: FloatArray,
    reach: float,  # length of the rays [m]
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Return every line that rays meet face to face: the ray, the line, and how far away (k,) [m]."""
    from shapely import STRtree, linestrings

    tree = STRtree(linestrings(np.stack([starts, starts + along], 1)))
    ray, line = tree.query(linestrings(np.stack([places, places + reach * normals], 1)))
    ray_to_start, side = starts[line] - places[ray], along[line]
    with np.errstate(divide="ignore", invalid="ignore"):
        det = normals[ray, 0] * side[:, 1] - normals[ray, 1] * side[:, 0]
        depth = (ray_to_start[:, 0] * side[:, 1] - ray_to_start[:, 1] * side[:, 0]) / det
        share = (ray_to_start[:, 0] * normals[ray, 1] - ray_to_start[:, 1] * normals[ray, 0]) / det
        # a wall looks back: lines that the ray meets at less than 45 degrees belong to a corner, not to a wall
        steep = np.abs(det) > MIN_FACING_SINE * np.hypot(*side.T)
    met = steep & (share >= 0) & (share <= 1) & (depth > 1e-8 * reach) & (depth <= reach)
    return ray[met], line[met], depth[met]


@dataclass(frozen=True)
class EdgeLines:
    """The lines of all outlines of a part, the material on their left."""

    # starts, along, (n, 2): [m]
    starts: FloatArray
    along: FloatArray
    # ring, at, (n,): which outline each is of, and the way along it to where it begins [m]
    ring: NDArray[np.int64]
    at: FloatArray
    around: FloatArray  # (r,) lengths of the outlines [m]

    @classmethod
    def from_contours(cls, contours: Sequence[Contour], sagitta: float) -> EdgeLines:
        """Return the lines of closed contours that are cut, within `sagitta` [m] of their arcs."""
        starts, along, ring, at = [], [], [], []
        around: list[float] = []
        for contour in contours:
            points = contour.points(sagitta)
            x, y = (points - points[0]).T
            if (float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 0) != contour.hole:
                points = points[::-1]
            vectors = np.roll(points, -1, axis=0) - points
            lengths = np.hypot(*vectors.T)
            kept = lengths > 0.0
            ring.append(np.full(int(kept.sum()), len(around)))
            starts.append(points[kept])
            along.append(vectors[kept])
            at.append(np.cumsum(lengths[kept]) - lengths[kept])
            around.append(float(lengths.sum()))
        join = np.concatenate
        return cls(join(starts), join(along), join(ring), join(at), np.array(around))

    def places(self, step: float) -> tuple[NDArray[np.int64], FloatArray]:
        """Return of which line (m,), and how far along it in parts of its length (m,), places by a step [m] are."""
        step = max(step, float(self.around.sum()) / MOST_PLACES)
        count = np.maximum(np.ceil(np.hypot(*self.along.T) / step), 1).astype(int)
        line = np.repeat(np.arange(len(count)), count)
        number = np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
        return line, (number + 0.5) / count[line]


def thin_walls(
    contours: Sequence[Contour],  # of its drawing; those that are closed and cut count
    least: float,  # thinnest wall that can be made [m]
    # how far each edge may be from the exact one [m]: a wall just as thick as can be made is not thin
    tolerance: float = OUTLINE_TOLERANCE,
) -> tuple[ThinWall, ...]:
    """Return the walls of a part that are thinner than can be made, the thinnest first."""
    cut = [contour for contour in contours if contour.layer == "cut" and contour.closed]
    if not cut or least <= 2.0 * tolerance:
        return ()
    edges = EdgeLines.from_contours(cut, 0.2 * tolerance)
    line, share = edges.places(least / PER_WALL)
    lengths = np.hypot(*edges.along.T)
    places = edges.starts[line] + share[:, None] * edges.along[line]
    unit = edges.along[line] / lengths[line, None]
    normals = np.column_stack([-unit[:, 1], unit[:, 0]])
    ray, met, depth = facing_lines(edges.starts, edges.along, places, normals, least - 2.0 * tolerance)
    # the nearest line that a ray meets is the other side of its wall
    order = np.lexsort([depth, ray])
    ray, met, depth = ray[order], met[order], depth[order]
    first = np.diff(ray, prepend=-1) > 0
    ray, met, depth = ray[first], met[first], depth[first]
    ends = places[ray] + depth[:, None] * normals[ray]
    arc_of_ray = edges.at[line[ray]] + share[ray] * lengths[line[ray]]
    arc_met = edges.at[met] + np.hypot(*(ends - edges.starts[met]).T)
    apart, around = np.abs(arc_met - arc_of_ray), edges.around[edges.ring[met]]
    tip = (edges.ring[met] == edges.ring[line[ray]]) & (np.minimum(apart, around - apart) < MIN_WAY_AROUND * depth)
    return tuple(_merge_into_walls(places[ray][~tip], ends[~tip], depth[~tip], least))


def _merge_into_walls(starts: FloatArray, ends: FloatArray, thickness: FloatArray, least: float) -> Iterator[ThinWall]:
    """Yield walls from lines through them, (k, 2) each [m]: what lies side by side is one wall."""
    from shapely import STRtree, buffer, get_parts, linestrings, union_all

    if not len(starts):
        return
    through = linestrings(np.stack([starts, ends], 1))
    bodies = get_parts(union_all(buffer(through, least / PER_WALL)))
    line, body = STRtree(bodies).query(through, predicate="intersects")
    order = np.lexsort([thickness[line], body])
    body, line = body[order], line[order]
    thinnest = line[np.diff(body, prepend=-1) > 0]
    for k in thinnest[np.argsort(thickness[thinnest], kind="stable")].tolist():
        x, y = (0.5 * (starts[k] + ends[k])).tolist()
        yield ThinWall(float(thickness[k]), (x, y))
