"""The boundary of a part as closed chains of points, and how finely it must be meshed where.

The chains are so dense that the true edge lies within the outline's tolerance of their lines. A vertex at which the
direction turns by more than `CORNER_TURN` is a corner and becomes a node; everything else is a smooth edge, whose
radius is read off the turn between neighbouring lines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from cfmkit.arrays import read_only
from cfmkit.errors import GeometryError
from cfmkit.export.thin_walls import facing_lines
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

CORNER_TURN = math.radians(25.0)
"""Turn of a true corner [rad]: lines that stand for arcs turn by a degree, sharp corners of parts are rounded by the
cutter or stand at pads, square."""
SIZE_GRADING = 0.25
"""How fast element sizes may grow [m per m]: 0.2 to 0.3 keeps triangles near the boundary above 25 degrees."""
MOST_PLACES = 20_000  # places round the boundary at which sizes are looked up; more take seconds
PLACES_AT_ONCE = 128
"""Places whose sizes are spread at once: more hide fewer that smaller neighbours have covered, fewer take calls."""
MOST_REFINED = 1000.0
"""Largest elements in parts of the smallest: beyond it grading alone takes half a minute, and what is so thin beside
the rest of a part is a flaw of its drawing."""


@dataclass(frozen=True)
class Ring:
    """A closed chain of lines, the material on its left."""

    points: FloatArray  # (n, 2) vertices, the first not repeated [m]

    @classmethod
    def from_points(cls, points: FloatArray, hole: bool, step: float = 0.0) -> Ring:
        """Return the ring through closed points (n, 2) [m], turned so that the material is on its left.

        Of a `step` [m] or less, two opposite corners, one vertex is left.
        """
        ring = np.asarray(points, float)
        ring = ring[:-1] if np.array_equal(ring[0], ring[-1]) else ring
        ring_of_steps = cls(read_only(_merge_steps(ring, step)))
        return ring_of_steps if (ring_of_steps.area > 0) != hole else cls(read_only(ring_of_steps.points[::-1]))

    @property
    def area(self) -> float:
        """Of what it goes round [m2]; negative round a hole."""
        x, y = (self.points - self.points[0]).T
        return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))

    @cached_property
    def lengths(self) -> FloatArray:
        """Lengths of the lines, each from its vertex to the next, (n,) [m]."""
        return np.asarray(np.hypot(*(np.roll(self.points, -1, axis=0) - self.points).T))

    @cached_property
    def places(self) -> FloatArray:
        """Arc lengths of the vertices, and of the first again, (n + 1,) [m]."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @cached_property
    def turns(self) -> FloatArray:
        """Change of direction at each vertex, positive to the left, (n,) [rad]."""
        along = np.roll(self.points, -1, axis=0) - self.points
        angle = np.arctan2(along[:, 1], along[:, 0])
        turn = angle - np.roll(angle, 1)
        return np.asarray((turn + math.pi) % (2 * math.pi) - math.pi)

    @cached_property
    def corners(self) -> NDArray[np.int64]:
        """Indices of the vertices that are corners."""
        return np.flatnonzero(np.abs(self.turns) > CORNER_TURN)

    @cached_property
    def radii(self) -> FloatArray:
        """Radius of the edge at each vertex, (n,) [m]; infinite at corners and where the edge is straight."""
        reach = 0.5 * (self.lengths + np.roll(self.lengths, 1))
        turn = np.where(np.abs(self.turns) > CORNER_TURN, 0.0, np.abs(self.turns))
        with np.errstate(divide="ignore"):
            return np.asarray(np.where(turn > 1e-9, reach / np.maximum(turn, 1e-300), math.inf))

    @cached_property
    def curvature_jumps(self) -> FloatArray:
        """By how much the curvature of the lines behind and before each vertex differs, (n,) [1/m]; 0 at corners."""
        turn = np.where(np.abs(self.turns) > CORNER_TURN, 0.0, self.turns)
        curvature = 0.5 * (turn + np.roll(turn, -1)) / self.lengths
        jumps = np.abs(curvature - np.roll(curvature, 1))
        return np.asarray(np.where(np.abs(self.turns) > CORNER_TURN, 0.0, jumps))

    def locate(self, arc: FloatArray) -> FloatArray:
        """Return the points (k, 2) [m] at arc lengths (k,) [m], taken round the ring."""
        closed = np.concatenate([self.points, self.points[:1]])
        s = np.mod(arc, self.places[-1])
        return np.column_stack([np.interp(s, self.places, closed[:, k]) for k in (0, 1)])

    def normals(self, arc: FloatArray, behind: bool = False) -> FloatArray:
        """Return unit vectors (k, 2) into the material at arc lengths (k,) [m]; at vertices of the line after them.

        With `behind` of the line before them.
        """
        line = np.searchsorted(self.places, np.mod(arc, self.places[-1]), side="left" if behind else "right") - 1
        along = (np.roll(self.points, -1, axis=0) - self.points)[line] / self.lengths[line, None]
        return np.column_stack([-along[:, 1], along[:, 0]])


def _merge_steps(ring: FloatArray, least: float) -> FloatArray:
    """Return a closed chain (n, 2) [m] with one vertex for the two of a step: opposite corners `least` [m] apart."""
    chain = Ring(ring)
    corner, turns = np.abs(chain.turns) > CORNER_TURN, chain.turns
    step = (chain.lengths <= least) & corner & np.roll(corner, -1) & (turns * np.roll(turns, -1) < 0.0)
    if not step.any():
        return ring
    ring = np.where(step[:, None], 0.5 * (ring + np.roll(ring, -1, axis=0)), ring)
    return np.asarray(ring[~np.roll(step, 1)])


@dataclass(frozen=True)
class Sizes:
    """Wanted lengths of the sides of elements [m], anywhere in the part."""

    places: FloatArray  # (m, 2) along the boundary [m]
    sizes: FloatArray  # (m,) wanted there [m]; they grow from place to place by `SIZE_GRADING` at most
    largest: float  # [m]

    @cached_property
    def _place_tree(self) -> cKDTree:
        return cKDTree(self.places)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the sizes (k,) [m] at points (k, 2) [m]."""
        return self.looked_up(points)[0]

    def looked_up(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the sizes (k,) at points (k, 2), and their distances from the boundary (k,) [m]."""
        distance, nearest = self._place_tree.query(points)
        return np.minimum(self.sizes[nearest] + SIZE_GRADING * distance, self.largest), np.asarray(distance)


def sizes(
    rings: tuple[Ring, ...],  # its boundary
    largest: float,  # largest size [m]
    share: float,  # of the radius of a curved edge
    # elements across the thickness at least: two six-node triangles carry the bending stress of a strip to 1e-3
    across: float,
) -> Sizes:
    """Return element sizes for a part.

    Raises GeometryError if the part is so thin somewhere, or its edge so sharply curved, that it would need elements
    `MOST_REFINED` times smaller than the largest.
    """
    coarse = _resolve_sizes(*_wanted_sizes(rings, 0.5 * largest, largest, share, across), largest)[1]
    around = sum(float(ring.places[-1]) for ring in rings)
    step = 0.5 * max(min(largest, float(coarse.min())), around / MOST_PLACES)
    places, wanted = _resolve_sizes(*_wanted_sizes(rings, step, largest, share, across), largest)
    return Sizes(places, _grade_sizes(places, wanted), largest)


def _resolve_sizes(places: FloatArray, wanted: FloatArray, largest: float) -> tuple[FloatArray, FloatArray]:
    """Return the places and wanted sizes; GeometryError if elements would have to be too small."""
    least = int(wanted.argmin())
    if wanted[least] * MOST_REFINED < largest:
        raise GeometryError(
            f"the part is too thin, or its edge too sharply curved, at {place_text(places[least])}: elements of "
            f"{format_short(largest, 'length')} cannot resolve it"
        )
    return places, wanted


def place_text(place: Sequence[float] | FloatArray) -> str:
    """Return a place (2,) [m] for a message, rounded to nanometres.

    >>> place_text([0.005, -3e-19])
    '(5 mm, 0 mm)'
    """
    return f"({', '.join(format_short(round(float(coordinate), 9) + 0.0, 'length') for coordinate in place)})"


def _wanted_sizes(
    rings: tuple[Ring, ...], step: float, largest: float, share: float, across: float
) -> tuple[FloatArray, FloatArray]:
    """Return places along the boundary (m, 2) no farther apart than a step, and element sizes there (m,) [m]."""
    pairs = [(ring, _dense_arc_lengths(ring, step)) for ring in rings]
    places = np.concatenate([ring.locate(arc) for ring, arc in pairs])
    wanted = np.concatenate([np.minimum(share * _radius_at(ring, arc), largest) for ring, arc in pairs])
    for behind in (False, True):
        normals = np.concatenate([ring.normals(arc, behind) for ring, arc in pairs])
        wanted = np.minimum(wanted, _ray_lengths(rings, places, normals, across * largest) / across)
    return places, wanted


def _dense_arc_lengths(ring: Ring, step: float) -> FloatArray:
    """Return arc lengths (k,) [m] along a ring: all vertices, and between them places no farther apart than `step`."""
    pieces = np.maximum(1, np.ceil(ring.lengths / step)).astype(int)
    return np.concatenate(
        [start + np.arange(n) * length / n for start, n, length in zip(ring.places, pieces, ring.lengths, strict=False)]
    )


def _radius_at(ring: Ring, arc: FloatArray) -> FloatArray:
    """Return the radius [m] at arc lengths: that of the vertex before or behind, whichever is smaller."""
    line = np.clip(np.searchsorted(ring.places, arc, side="right") - 1, 0, len(ring.points) - 1)
    vertex = np.isclose(arc, ring.places[line], rtol=0.0, atol=1e-12)
    behind = ring.radii[(line + 1) % len(ring.points)]
    inside = np.where(
        np.isfinite(ring.radii[line]) & np.isfinite(behind), np.minimum(ring.radii[line], behind), math.inf
    )
    return np.asarray(np.where(vertex, ring.radii[line], inside))


def _ray_lengths(rings: tuple[Ring, ...], places: FloatArray, normals: FloatArray, reach: float) -> FloatArray:
    """Return how far rays from places (m, 2) along normals run through material, (m,) [m]; infinite beyond `reach`."""
    starts = np.concatenate([ring.points for ring in rings])
    along = np.concatenate([np.roll(ring.points, -1, axis=0) - ring.points for ring in rings])
    ray, _, depth = facing_lines(starts, along, places, normals, reach)
    thickness = np.full(len(places), math.inf)
    np.minimum.at(thickness, ray, depth)
    return thickness


def _grade_sizes(places: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return sizes that nowhere grow faster than `SIZE_GRADING`: the smallest of (size there + grading x distance)."""
    order = np.argsort(wanted)
    sizes = wanted.copy()
    tree = cKDTree(places)
    top = float(wanted.max())
    # from the smallest size on, as in Dijkstra's way through a graph
    for start in range(0, len(order), PLACES_AT_ONCE):
        some = order[start : start + PLACES_AT_ONCE]
        # where a smaller neighbour has been, its reach covers this one's
        some = some[(sizes[some] < top) & (sizes[some] >= wanted[some])]
        if not len(some):
            continue
        met = tree.query_ball_point(places[some], (top - sizes[some]) / SIZE_GRADING)
        source = np.repeat(some, [len(numbers) for numbers in met])
        targets = np.concatenate([np.asarray(numbers, np.int64) for numbers in met])
        away = np.hypot(*(places[targets] - places[source]).T)
        np.minimum.at(sizes, targets, wanted[source] + SIZE_GRADING * away)
    return sizes
