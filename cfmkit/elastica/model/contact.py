"""One-sided contacts as values: stops, pads of nodes, sides of beams, friction; outlines of obstacles with distances.

A contact has a gap g >= 0 and presses with a force f >= 0, of which one is zero. A gap is positive on the free side.
An elastic contact yields by f / stiffness along the normal. Pads of nodes and stops of motions may have Coulomb
friction: the tangential force is at most friction times f, and as large as that, against the motion, where it slips.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import ShortRepr

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray

BESIDE_END = 1e-9  # share of a piece by which the foot of a point may lie beyond its end: rounding
POINTS_PER_TURN = 120  # of an arc that is drawn
STRAIGHT_ON = 1e-12  # turn of a polyline below which it has no corner [rad]


@dataclass(frozen=True)
class Stop:
    """A stop that limits the motion of a node along a direction, or its rotation."""

    name: str
    node: str
    gap: float  # free way before any load [m or rad]
    direction: float | None  # [rad]; None: the rotation is limited
    sense: float = 1.0  # of a rotation: 1 counter-clockwise, -1 clockwise
    stiffness: float = math.inf  # [N/m or N m/rad]
    friction: float = 0.0  # coefficient; of a motion only

    @property
    def turns(self) -> bool:
        """True if a rotation is limited: the force is a moment."""
        return self.direction is None


class FrictionState(NamedTuple):
    """Friction at a contact: in which sense it slips, 0 where it sticks, 2 where there is none; and where."""

    sense: float
    anchor: float = 0.0  # place along the obstacle at which it sticks, in mean beam lengths


class WayAlong(NamedTuple):
    """Distances of places along a line at one distance from an outline, with its derivatives by the place."""

    value: Any  # (...) [m]
    gradient: Any  # (..., 2)
    hessian: Any  # (..., 2, 2) [1/m]


class Distance(NamedTuple):
    """Signed distance of places from an outline, positive on its free side, with its derivatives."""

    value: Any  # (...) [m]
    normal: Any  # (..., 2) its gradient
    curvature: Any  # (...) second derivative along the outline [1/m]


@dataclass(frozen=True, eq=False, repr=False)
class ObstacleEdge(ShortRepr):
    """A smooth line of segments and arcs with the free side to its left: endless, or closed.

    Its first and last segment go on for ever unless it is closed.
    """

    # start, along, length: of the segments (s, 2), (s, 2), (s,) [m]
    start: FloatArray
    along: FloatArray
    length: FloatArray
    # centre, radius, first, sweep, bulge: of the arcs (a, 2), (a,) ... [m, rad]; bulge 1 towards the free side, else -1
    centre: FloatArray
    radius: FloatArray
    first: FloatArray
    sweep: FloatArray
    bulge: FloatArray
    closed: bool = False

    @property
    def smallest_bulge(self) -> float:
        """Smallest radius of an arc that bulges towards the free side [m]; infinite without one."""
        return float(self.radius[self.bulge > 0].min(initial=math.inf))

    @property
    def smallest_hollow(self) -> float:
        """Smallest radius of an arc that is hollow as seen from the free side [m]; infinite without one."""
        return float(self.radius[self.bulge < 0].min(initial=math.inf))

    def lines(self, reach: float) -> list[FloatArray]:
        """Return its parts as points along them, (n, 2) each; endless ones are `reach` [m] long."""
        polylines, last = [], len(self.length) - 1
        for number, (start, along, length) in enumerate(zip(self.start, self.along, self.length, strict=True)):
            low = -reach if number == 0 and not self.closed else 0.0
            high = length + reach if number == last and not self.closed else length
            polylines.append(np.array([start + low * along, start + high * along]))
        for centre, radius, first, sweep, _ in self._arcs:
            angle = first + sweep * np.linspace(0.0, 1.0, 2 + math.ceil(POINTS_PER_TURN * abs(sweep) / math.tau))
            polylines.append(centre + radius * np.column_stack([np.cos(angle), np.sin(angle)]))
        return polylines

    def distance(self, places: Any) -> Distance:
        """Return the signed distance of places (..., 2) [m] from the nearest point of the outline.

        Places may be complex: what is nearest is decided by their real parts.
        """
        places = np.asarray(places)
        parts = [*self._from_segments(places), *self._from_arcs(places)]
        return parts[0][0] if len(parts) == 1 else Distance(*_choose_nearest(parts, [part for part, _ in parts]))

    def way_along(self, places: Any, offset: float) -> WayAlong:
        """Return how far places (..., 2) [m] are along the line at a distance from it: the obstacle to the right.

        Of a closed one it is known but for whole rounds; see `round_length`.
        """
        places, ways, begins = np.asarray(places), list[WayAlong](), self._part_begins(offset)
        for start, along, begin in zip(self.start, self.along, begins, strict=False):
            ways.append(WayAlong(begin + (places - start) @ along, along + 0.0 * places, np.zeros((*places.shape, 2))))
        for (centre, radius, first, sweep, bulge), begin in zip(self._arcs, begins[len(self.start) :], strict=True):
            away = places - centre
            reach = np.sqrt((away * away).sum(axis=-1))[..., None]
            outwards = away / reach
            across = np.stack([-outwards[..., 1], outwards[..., 0]], axis=-1)
            turned = (_turn_along(away, first, sweep) + BESIDE_END) % math.tau - BESIDE_END
            size = -bulge * (radius + bulge * offset)
            value = np.sign(sweep) * turned + 0j if np.iscomplexobj(places) else np.sign(sweep) * turned
            if np.iscomplexobj(places):  # by a complex step
                value = value + 1j * (np.real(across) * np.imag(places)).sum(axis=-1) / np.real(reach[..., 0])
            both = outwards[..., :, None] * across[..., None, :]
            bend = -size * (both + np.swapaxes(both, -1, -2)) / (reach * reach)[..., None]
            ways.append(WayAlong(begin + size * value, size * across / reach, bend))
        return WayAlong(*_choose_nearest([*self._from_segments(places), *self._from_arcs(places)], ways))

    @property
    def _arcs(self) -> Iterator[tuple[Any, ...]]:
        return zip(self.centre, self.radius, self.first, self.sweep, self.bulge, strict=True)

    def round_length(self, offset: float) -> float:
        """Return the length of the line at a distance from a closed outline [m]; infinite of an endless one."""
        lengths = (self.radius + self.bulge * offset) * np.abs(self.sweep)
        return float(self.length.sum() + lengths.sum()) if self.closed else math.inf

    def _part_begins(self, offset: float) -> list[float]:
        """Return how far along the line at a distance the segments begin, then the arcs [m]."""
        ends = [tuple(at) for at in self.start + self.length[:, None] * self.along]
        arc_at = self.centre + self.radius[:, None] * np.column_stack([np.cos(self.first), np.sin(self.first)])
        begins, arc_begins, reached = [], [0.0] * len(self.radius), 0.0
        for end, length in zip(ends, self.length.tolist(), strict=True):
            begins.append(reached)
            reached += length
            for k, at in enumerate(arc_at):
                if math.dist(at, end) <= BESIDE_END * (1.0 + length) * max(float(self.radius[k]), length):
                    arc_begins[k] = reached
                    reached += float((self.radius[k] + self.bulge[k] * offset) * abs(self.sweep[k]))
        return [*begins, *arc_begins]

    def _from_segments(self, places: Any) -> list[tuple[Distance, Any]]:
        parts, last = [], len(self.length) - 1
        for number, (start, along, length) in enumerate(zip(self.start, self.along, self.length, strict=True)):
            normal = np.array([-along[1], along[0]])
            place, slack = np.real((places - start) @ along), BESIDE_END * (1.0 + length)
            ahead = np.full(place.shape, True) if number == 0 and not self.closed else place >= -slack
            behind = np.full(place.shape, True) if number == last and not self.closed else place <= length + slack
            value = (places - start) @ normal
            flat = np.broadcast_to(normal, places.shape), np.zeros(value.shape)
            parts.append((Distance(value, *flat), ahead & behind))
        return parts

    def _from_arcs(self, places: Any) -> list[tuple[Distance, Any]]:
        parts = []
        for centre, radius, first, sweep, bulge in self._arcs:
            away = places - centre
            reach = np.sqrt((away * away).sum(axis=-1))
            safe = np.where(reach == 0, 1.0, reach)
            turned = _turn_along(away, first, sweep) % math.tau
            beside = (turned <= abs(sweep) + BESIDE_END) | (turned >= math.tau - BESIDE_END)
            parts.append((Distance(bulge * (reach - radius), bulge * away / safe[..., None], bulge / safe), beside))
        return parts


def _turn_along(away: Any, first: float, sweep: float) -> Any:
    """Return by how much vectors (..., 2) from the centre of an arc are turned from its begin, along it [rad]."""
    return np.sign(sweep) * (np.arctan2(np.real(away[..., 1]), np.real(away[..., 0])) - first)


def _choose_nearest(parts: list[tuple[Distance, Any]], values: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Return the values of the part that is nearest to each place, of those beside which it lies."""
    pick = np.array([np.where(beside, np.abs(np.real(part.value)), np.inf) for part, beside in parts]).argmin(axis=0)
    chosen = []
    for rows in zip(*values, strict=True):
        stacked = np.array(rows)
        index = pick.reshape(1, *pick.shape, *(1,) * (stacked.ndim - 1 - pick.ndim))
        chosen.append(np.take_along_axis(stacked, index, axis=0)[0])
    return chosen


def line_edge(through: Sequence[float], direction: float) -> ObstacleEdge:
    """Return a straight line through a point [m], along a direction [rad]; the free side is to its left."""
    along = np.array([[math.cos(direction), math.sin(direction)]])
    return _make_edge([np.asarray(through, float)], along, [0.0], [])


def circle_edge(centre: Sequence[float], radius: float, hole: bool = False) -> ObstacleEdge:
    """Return a disc, free outside, or a hole, free inside [m]."""
    arc = (np.asarray(centre, float), radius, 0.0, math.tau, -1.0 if hole else 1.0)
    return _make_edge([], [], [], [arc], closed=True)


def polyline_edge(points: Sequence[Sequence[float]], fillet: float, closed: bool = False) -> ObstacleEdge:
    """Return straight sides through points [m] with rounded corners; the free side is to the left.

    Raises ValueError if two points are the same, the line turns back on itself, or the fillet is too large for a side.
    """
    corners = np.asarray(points, float)
    ring = np.vstack([corners, corners[:1]]) if closed else corners
    sides = np.diff(ring, axis=0)
    length = np.hypot(*sides.T)
    if (length == 0).any():
        raise ValueError("two neighbouring points are the same")
    along = sides / length[:, None]
    count = len(length)
    turning = [(k, (k + 1) % count) for k in range(count if closed else count - 1)]
    turn = np.array([_angle_between(along[a], along[b]) for a, b in turning])
    if (np.abs(turn) > math.pi - 1e-6).any():
        raise ValueError("it turns back on itself at a corner")
    cut = np.zeros((count, 2))  # of every side, by the corner at its begin and at its end
    for (a, b), angle in zip(turning, turn.tolist(), strict=True):
        cut[a, 1] = cut[b, 0] = fillet * abs(math.tan(angle / 2)) if abs(angle) > STRAIGHT_ON else 0.0
    left = length - cut.sum(axis=1)
    if (left < -1e-12 * length).any():
        side = int((left / length).argmin())
        most = fillet * float(length[side] / cut[side].sum())
        raise ValueError(f"the sides allow a fillet of at most {most * 1e3:.6g} mm")
    arcs = []
    for (a, _), angle in zip(turning, turn.tolist(), strict=True):
        if abs(angle) <= STRAIGHT_ON:
            continue
        bend = math.copysign(1.0, angle)  # 1: to the left, so that the free side sees a hollow
        begin = ring[a + 1] - along[a] * cut[a, 1]
        centre = begin + bend * fillet * np.array([-along[a][1], along[a][0]])
        arcs.append((centre, fillet, math.atan2(*(begin - centre)[::-1]), angle, -bend))
    return _make_edge(ring[:-1] + along * cut[:, :1], along, np.maximum(left, 0.0), arcs, closed)


def arc_edge(centre: Sequence[float], radius: float, start: float, end: float) -> ObstacleEdge:
    """Return a part of the edge of a disc [m], between two angles [rad], that goes on straight at both ends.

    The free side is outside of the disc.
    """
    middle, (low, high) = np.asarray(centre, float), sorted((start, end))
    first, last = (np.array([math.cos(angle), math.sin(angle)]) for angle in (high, low))
    along = np.array([[first[1], -first[0]], [last[1], -last[0]]])  # clockwise: the disc is to the right
    starts = [middle + radius * first, middle + radius * last]
    return _make_edge(starts, along, [0.0, 0.0], [(middle, radius, high, low - high, 1.0)])


def _make_edge(start: Any, along: Any, length: Any, arcs: Sequence[Any], closed: bool = False) -> ObstacleEdge:
    centre = np.array([arc[0] for arc in arcs], float).reshape(-1, 2)
    radius, first, sweep, bulge = (np.array([arc[k] for arc in arcs], float) for k in range(1, 5))
    starts, ways = np.asarray(start, float).reshape(-1, 2), np.asarray(along, float).reshape(-1, 2)
    return ObstacleEdge(starts, ways, np.asarray(length, float), centre, radius, first, sweep, bulge, closed)


def _angle_between(first: FloatArray, second: FloatArray) -> float:
    """Return the angle from one unit vector to another [rad]."""
    return math.atan2(float(first[0] * second[1] - first[1] * second[0]), float(first @ second))


class _Force:
    """A contact whose force is no moment."""

    turns = False


class _RigidForce(_Force):
    """The side of a beam: a bed of springs would be another model, and friction with rolling depends on the way."""

    stiffness, friction = math.inf, 0.0


@dataclass(frozen=True)
class NodeOnObstacle(_Force):
    """The round pad of a node and a rigid obstacle that is fixed to the ground."""

    name: str
    node: str
    outline: ObstacleEdge = field(compare=False)
    radius: float = 0.0  # of the pad [m]
    stiffness: float = math.inf  # [N/m]
    friction: float = 0.0  # coefficient


@dataclass(frozen=True)
class BeamOnObstacle(_RigidForce):
    """The side of a beam and a rigid obstacle that is fixed to the ground; it touches at places that are unknowns."""

    name: str
    beam: str
    outline: ObstacleEdge = field(compare=False)


@dataclass(frozen=True)
class NodeOnBeam(_RigidForce):
    """The round pad of a node and the side of a beam, which touch at a place along the beam that is an unknown."""

    name: str
    node: str
    beam: str
    radius: float = 0.0  # of the pad [m]


@dataclass(frozen=True)
class BeamOnBeam(_RigidForce):
    """One of two beams whose sides touch at a place of each that is an unknown.

    A pair has one for each of its beams: of one name, one after the other; the first `leads` and has gap and force.
    """

    name: str
    beam: str
    partner: str
    leads: bool = True


BeamSide = BeamOnObstacle | NodeOnBeam | BeamOnBeam
"""A contact of the side of a beam, whose place along the beam is an unknown."""
Contact = Stop | NodeOnObstacle | BeamSide


def describe(item: Contact) -> str:
    """Return the names of a contact: of a stop, or of a pad or a side and what it touches."""
    if isinstance(item, Stop):
        return f"stop {item.name!r}"
    if isinstance(item, NodeOnBeam):
        return f"{item.node!r} on beam {item.beam!r}"
    if isinstance(item, BeamOnBeam):
        return " and ".join(f"{beam!r}" for beam in (item.beam, item.partner)[:: 1 if item.leads else -1])
    side = f"{item.node!r}" if isinstance(item, NodeOnObstacle) else f"beam {item.beam!r}"
    return f"{side} on {item.name!r}"
