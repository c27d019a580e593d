"""Geometry of a mechanism in poses, as named bodies held, driven, free or in contact: outline, box, swept area.

A family returns these bodies once (`families/NAME/part.py`). Views are written once for all families, also pictures,
animations and the frame around what moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.arrays import distinct

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cfmkit.arrays import FloatArray

Role = Literal["held", "driven", "free", "contact"]
"""Whether a body stands, moves as the drive says, moves as the mechanism lets it, or rolls or slides on another one."""

MIRROR_FACTORS = np.array([-1.0, 1.0])  # factors of x and y of the mirror image about the y axis
N_CIRCLE_POINTS = 73
N_PLACES, N_COVERING = 26, 41
"""Positions of a screw that are tried along half an edge, and poses in which they must be free."""


@dataclass(frozen=True, eq=False)
class PosedBody:
    """A body in p poses: all points within `half_thickness` of a point, a line or the inside of a polygon."""

    name: str  # of the kind of body: several may have it
    role: Role
    core: FloatArray  # (p, k, 2) points of the line, or corners of the polygon [m]; p = 1 for what does not move
    half_thickness: Any = 0.0  # a number, or (k,) at the points of a line [m]
    closed: bool = False  # whether the core is a polygon
    round: bool = False  # whether a line ends in half circles

    @classmethod
    def polygon(cls, name: str, role: Role, corners: FloatArray) -> PosedBody:
        """Return a polygon (k, 2) or (p, k, 2) [m]."""
        return cls(name, role, np.asarray(corners).reshape(-1, *np.shape(corners)[-2:]), closed=True)

    @classmethod
    def line(cls, name: str, role: Role, points: FloatArray, half_thickness: Any, round: bool = False) -> PosedBody:
        """Return what is around a line, or a point, (k, 2) or (p, k, 2) [m]."""
        return cls(name, role, np.asarray(points).reshape(-1, *np.shape(points)[-2:]), half_thickness, round=round)

    @property
    def reach(self) -> float:
        """Largest distance of its material from the core [m]."""
        return float(np.max(self.half_thickness))

    def core_at(self, pose: int) -> FloatArray:
        """Return the core in a pose (k, 2) [m]."""
        core: FloatArray = self.core[pose if len(self.core) > 1 else 0]
        return core

    def outline(self, pose: int = 0) -> FloatArray:
        """Return the outline of the body in a pose (n, 2) [m]."""
        core = self.core_at(pose)
        if self.closed:
            return core
        if len(core) == 1:
            return arc(core[0], self.reach, 0.0, math.tau)
        if not self.round:
            return band(core, self.half_thickness)
        (x, y), half = core[-1] - core[0], self.reach
        left = math.atan2(y, x) + 0.5 * math.pi
        return np.vstack([arc(core[-1], half, left - math.pi, math.pi), arc(core[0], half, left, math.pi)])

    def move(self, x: float, y: float) -> PosedBody:
        """Return the body moved by x and y [m]."""
        return replace(self, core=self.core + np.array([x, y]))

    def mirror(self) -> PosedBody:
        """Return the mirror image of the body about the y axis; a polygon keeps its sense."""
        return replace(self, core=(self.core[:, ::-1] if self.closed else self.core) * MIRROR_FACTORS)

    def shape(self, pose: int) -> Any:
        """Return the area covered in a pose as a geometry of shapely; a line with its largest half thickness."""
        from shapely import LineString, Point, Polygon

        core = self.core_at(pose)
        if self.closed:
            return Polygon(core).buffer(0)
        if len(core) == 1:
            return Point(core[0]).buffer(self.reach)
        return LineString(core).buffer(self.reach, cap_style="round" if self.round else "flat")


def arc(center: Any, radius: float, begin: float, turn: float, points: int = N_CIRCLE_POINTS) -> FloatArray:
    """Return points of an arc from an angle on, counter-clockwise (n, 2) [m]."""
    angle = begin + np.linspace(0.0, turn, points)
    return np.asarray(center) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def rectangle(left: float, bottom: float, right: float, top: float) -> FloatArray:
    """Return the corners of a rectangle, counter-clockwise (4, 2) [m]; its sides may be given in either order."""
    (x0, x1), (y0, y1) = sorted((left, right)), sorted((bottom, top))
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def band(line: FloatArray, half: Any) -> FloatArray:
    """Return the outline (2n, 2) of a strip around a line (n, 2); half of its thickness is a number or (n,) [m]."""
    along = np.gradient(line, axis=0)
    along /= np.maximum(np.hypot(*along.T), 1e-300)[:, None]
    aside = np.broadcast_to(np.asarray(half, dtype=float), len(line))[:, None] * np.column_stack(
        [-along[:, 1], along[:, 0]]
    )
    return np.concatenate([line + aside, (line - aside)[::-1]])


def join_poses(poses: Sequence[Sequence[PosedBody]]) -> tuple[PosedBody, ...]:
    """Return the bodies of several poses, each given as the same bodies in the same order, as bodies in all poses."""
    joined = []
    for same in zip(*poses, strict=True):
        cores = np.concatenate([body.core for body in same])
        still = bool((cores == cores[:1]).all())
        joined.append(replace(same[0], core=cores[:1] if still else cores))
    return tuple(joined)


@dataclass(frozen=True, eq=False)
class PosedPart:
    """A mechanism over its motion: bodies in poses, direction, depth and further facts for its envelope."""

    bodies: tuple[PosedBody, ...]
    direction: float = 0.5 * math.pi  # of the travel [rad]
    depth: float | None = None  # out of the plane [m]; None if nothing is known of it
    pieces: int = 1  # separate pieces that the mechanism is put together from, bought ones included
    assumed: str = ""  # dimensions that were assumed because the specification has none, as one clause; empty if none
    # what rubs, by its block of the mechanism, with the sizes that the block needs beside `friction` [m]
    rubbing: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    faults: tuple[str, ...] = ()  # parts that do not bear their loads, or cannot be made, each in a sentence


def box(bodies: Iterable[PosedBody], direction: float = 0.5 * math.pi) -> FloatArray:
    """Return the smallest and the largest place of bodies in all their poses, across and along a direction (2, 2) [m].

    A line counts as far as it reaches anywhere: a box is a little large rather than small.
    """
    sine, cosine = math.sin(direction), math.cos(direction)
    axes = np.array([[sine, -cosine], [cosine, sine]])
    if abs(cosine) < 1e-15:  # upwards: x and y themselves
        axes = np.eye(2)
    ends = []
    for body in bodies:
        places = body.core.reshape(-1, 2) @ axes.T
        ends.append((places.min(axis=0) - body.reach, places.max(axis=0) + body.reach))
    return np.array([np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)])


def swept(bodies: Iterable[PosedBody]) -> Any:
    """Return what bodies cover in all their poses together, as a geometry of shapely."""
    from shapely import union_all

    return union_all([body.shape(pose) for body in bodies for pose in range(len(body.core))])


def screw_positions(
    ground: FloatArray,  # (4, 2): rectangle along the axes [m]
    moving: Sequence[PosedBody],  # what passes over it
    head: float,  # diameter of the screw's head, which is also its distance from the edge [m]
) -> tuple[list[FloatArray], bool]:
    """Return a position next to each corner of a base plate where a screw can be reached beside all that moves.

    Positions along the edges are tried, the nearest to the corner first; a corner from which half of both edges is
    covered has no screw. If fewer than two are left, the screws are in the corners, below what moves, and the second
    value is False.
    """
    (x0, y0), (x1, y1) = (ground.min(axis=0) + head).tolist(), (ground.max(axis=0) - head).tolist()
    shares = np.linspace(0.0, 0.5, N_PLACES)
    corners = [(x, y, far_x, far_y) for x, far_x in ((x0, x1), (x1, x0)) for y, far_y in ((y0, y1), (y1, y0))]
    along = np.array(
        [
            place
            for x, y, far_x, far_y in corners
            for share in shares
            for place in ((x + share * (far_x - x), y), (x, y + share * (far_y - y)))
        ]
    )
    places = along.reshape(4, -1, 2)
    room = np.min([_distances(replace(body, core=body.core[_evenly_moved(body.core)]), along) for body in moving], 0)
    clear = room.reshape(4, -1) >= 0.5 * head
    result = [places[k, clear[k].argmax()] for k in range(4) if clear[k].any()]
    reached = len(result) > 1
    return result if reached else [places[k, 0] for k in range(4)], reached


def _distances(body: PosedBody, places: FloatArray) -> FloatArray:
    """Return how far places (q, 2) are from a body in its nearest pose, 0 inside, (q,) [m]; lines end in circles."""
    corners, at = body.core @ np.array([1.0, 1j]), (places @ np.array([1.0, 1j]))[:, None, None]
    is_ring = body.closed or corners.shape[1] == 1
    start, end = (corners, np.roll(corners, -1, axis=1)) if is_ring else (corners[:, :-1], corners[:, 1:])
    side, off = end - start, at - start
    share = (off * side.conj()).real / np.maximum(np.abs(side) ** 2, 1e-300)
    away = np.abs(off - np.clip(share, 0.0, 1.0) * side).min(axis=(1, 2))
    if body.closed:
        passes = (start.imag > at.imag) != (end.imag > at.imag)
        to_the_left = (off * side.conj()).imag * np.sign(side.imag) > 0.0
        away[((passes & to_the_left).sum(axis=2) % 2 == 1).any(axis=1)] = 0.0
    return np.asarray(np.maximum(away - body.reach, 0.0))


def _evenly_moved(core: FloatArray) -> Any:
    """Return the numbers of poses (p, k, 2) between which a body moves by equal distances, the ends included."""
    steps = np.hypot(*np.moveaxis(np.diff(core, axis=0), -1, 0)).max(axis=1)
    path = np.concatenate([[0.0], np.cumsum(steps)])
    return distinct(np.searchsorted(path, np.linspace(0.0, path[-1], N_COVERING)))
