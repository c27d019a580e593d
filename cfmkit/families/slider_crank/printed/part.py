"""Geometry of a printed slider-crank: one unloaded leg, with its exact edges, and while it is pressed.

Flexures, strip and distances of pins are exact. What is around them is a sensible choice: pads behind the clamped
end and at the slider, links wider than any flexure.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.contours import BeamSection, Contour, Line, polygon
from cfmkit.export.drawn_as_specified import SpecifiedPiece
from cfmkit.export.posed_part import PosedBody, PosedPart
from cfmkit.families.slider_crank.linkage import linkage_of
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import corners, flexures_of, strip_of
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import FLEXURE_BEAMS, STRIP_BEAM, taper_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.printed.solution import Solution
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.results import Result

PAD_SIZE = (0.012, 0.010)  # length and width of the pads [m]
STRAIGHT_SINE, MITRE_LIMIT = 1e-9, 2.0
"""Sine of an angle that is no corner; reach of the edges at a sharp corner, in half widths."""
SAME_PLACE = 1e-9  # points nearer to each other than this are one, in lengths of the centre line
COMPLEX_AXES = np.array([1.0, 1j])  # from x and y to x + iy
LINK_RATIO = 5.0  # width of a rigid link in flexure thicknesses
N_POSES = 13  # places of the motion that a box counts


@dataclass(frozen=True)
class LegPiece:
    """A straight piece of a leg, from one point to the next."""

    name: str  # of its flexure, or of the strip; empty for rigid links
    start: int  # number of its first point
    half: tuple[float, float]  # half of its thickness at both ends [m]


@dataclass(frozen=True, eq=False)
class Leg:
    """One unloaded leg, from the ground to the slider."""

    points: FloatArray  # (n, 2) ends of its straight pieces [m]
    place: FloatArray  # (n,) how far along its centre line they are [m]
    # thickness, width, (n,): of what bends there, in the plane and out of it [m]
    thickness: FloatArray
    width: FloatArray
    pieces: tuple[LegPiece, ...]
    pad: tuple[float, float, float]  # depth of the pad at the ground, of that at the slider, breadth of both [m]

    @classmethod
    def from_spec(cls, spec: SliderCrankSpec, as_printed: bool = False) -> Leg:
        """Return the leg of a specification as it is drawn, or with what printing adds to a strip."""
        beam = spec.mechanism.beam
        if spec.piece == "beam" and beam is not None:
            strip = strip_of(spec.mechanism)
            marks = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(strip.corners, axis=0).T))])
            shares = np.unique(np.concatenate([marks / marks[-1], strip.places]))
            points = np.column_stack([np.interp(shares * marks[-1], marks, strip.corners[:, k]) for k in (0, 1)])
            thickness = np.interp(shares, strip.places, np.asarray(strip.thickness)) - (
                0.0 if as_printed else beam.offset
            )
            halves = itertools.pairwise((0.5 * thickness).tolist())
            pieces = tuple(LegPiece(STRIP_BEAM, k, half) for k, half in enumerate(halves))
            width = np.full(len(points), beam.width)
            return cls(points, shares * marks[-1], thickness, width, pieces, _pad_sizes(spec))
        flexures = flexures_of(spec.mechanism)
        points = corners(spec.mechanism, None)
        thickness, width = (
            np.repeat([getattr(flexure, key) for flexure in flexures], 2) for key in ("thickness", "width")
        )
        half, bar = 0.5 * thickness[::2], 0.5 * LINK_RATIO * float(thickness.max())
        pieces = tuple(
            LegPiece("", k, (bar, bar)) if k % 2 else LegPiece(FLEXURE_BEAMS[k // 2], k, (float(half[k // 2]),) * 2)
            for k in range(len(points) - 1)
        )
        place = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        return cls(points, place, thickness, width, pieces, _pad_sizes(spec))

    @property
    def thinnest(self) -> float:
        """Smallest thickness of what bends [m]."""
        return float(self.thickness.min())

    @property
    def widest(self) -> float:
        """Largest half width of the leg between its pads [m]."""
        return max(max(piece.half) for piece in self.pieces)

    @property
    def pads(self) -> tuple[FloatArray, FloatArray]:
        """Pads at the ground and at the slider, the face where the leg begins first, two (4, 2) arrays [m]."""
        *depths, breadth = self.pad
        ends = []
        for k, sense, depth in ((0, -1.0, depths[0]), (len(self.points) - 1, 1.0, depths[1])):
            outward = sense * _direction(self.points, k)
            side = 0.5 * breadth * np.array([-outward[1], outward[0]])
            out = self.points[k] + depth * outward
            ends.append(np.array([self.points[k] + side, self.points[k] - side, out - side, out + side]))
        return ends[0], ends[1]

    @property
    def contours(self) -> tuple[Contour, Contour]:
        """Its outline with sharp corners, between two pads, and its centre line."""
        pad = 0.5 * self.pad[2]
        half, at = [pad], [0]
        for piece in self.pieces:
            # where the thickness has no step, one point of the outline is enough
            steps = len(half) == 1 or piece.half[0] != half[-1]
            half += [*([piece.half[0]] if steps else []), piece.half[1]]
            at += [*([piece.start] if steps else []), piece.start + 1]
        points, wide = self.points[[*at, at[-1]]], np.array([*half, pad])
        begin, end = _direction(points, 0), _direction(points, len(points) - 1)
        line = np.vstack([points[0] - self.pad[0] * begin, points, points[-1] + self.pad[1] * end])
        wide = np.concatenate([[wide[0]], wide, [wide[-1]]])
        around = [(float(x), float(y)) for x, y in (*_edge(line, wide), *reversed(_edge(line, -wide)))]
        kept = [point for point, following in zip(around, [*around[1:], around[0]], strict=True) if point != following]
        centre = [(float(x), float(y)) for x, y in dict.fromkeys(map(tuple, points))]
        path = Contour(tuple(Line(a, b) for a, b in itertools.pairwise(centre)), "path")
        return polygon(kept, "cut"), path

    def specified_pieces(self) -> Iterator[SpecifiedPiece]:
        """Yield what it is united from, with the sections of flexures or of the strip."""
        ends = (
            self.points[[piece.start for piece in self.pieces]],
            self.points[[piece.start + 1 for piece in self.pieces]],
        )
        length = np.hypot(*(ends[1] - ends[0]).T)
        # places that differ by rounding have no piece between them
        kept = np.flatnonzero(length > SAME_PLACE * self.place[-1])
        directions = (ends[1] - ends[0])[kept] / length[kept, None]
        half = np.array([self.pieces[k].half for k in kept])
        # at a bend without a step the outer edges meet beyond the ends
        turn = np.abs(np.angle((directions[1:] @ COMPLEX_AXES) / (directions[:-1] @ COMPLEX_AXES)))
        beyond = np.where(half[:-1, 1] == half[1:, 0], half[1:, 0] * np.tan(0.5 * turn), 0.0)
        before, after = np.append(0.0, beyond), np.append(beyond, 0.0)
        for number, k in enumerate(kept.tolist()):
            along, across = directions[number], np.array([-directions[number, 1], directions[number, 0]])
            line = np.array([ends[0][k] - before[number] * along, ends[1][k] + after[number] * along])
            aside = half[number][:, None] * across
            middle, thickness = 0.5 * (ends[0][k] + ends[1][k]), float(half[number].sum())
            section = BeamSection(self.pieces[k].name, middle, across, thickness, float(length[k]))
            area = np.vstack([line + aside, (line - aside)[::-1]])
            yield SpecifiedPiece((area,), (section,) if self.pieces[k].name else ())
        yield from (SpecifiedPiece((pad,)) for pad in self.pads)


def pad_of(spec: SliderCrankSpec) -> tuple[float, float]:
    """Return depth and breadth of the pads [m]."""
    part = spec.mechanism.part
    return PAD_SIZE if part is None or part.pad is None else part.pad


def _pad_sizes(spec: SliderCrankSpec) -> tuple[float, float, float]:
    """Return depth of the pad at the ground, of that at the slider, and breadth of both [m]."""
    depth, breadth = pad_of(spec)
    frame = spec.mechanism.part.frame if spec.mechanism.part is not None else None
    return (depth, depth, breadth) if frame is None else (frame.wall or depth, frame.shuttle or depth, breadth)


def part_over_motion(result: Result) -> PosedPart:
    """Return one leg as it moves; legs lie above each other."""
    spec: Any = result.spec
    depth = spec.mechanism.legs * float(Leg.from_spec(spec).width.max())
    moving = bodies(spec, result.state, choose_points(result.state, N_POSES))
    return PosedPart(moving, direction=0.0, depth=depth, pieces=spec.mechanism.sets)


def bodies(spec: SliderCrankSpec, solution: Solution, points: NDArray[Any]) -> tuple[PosedBody, ...]:
    """Return the pads, and the flexures with the links between them, or the strip, at points of the travel.

    The leg's pieces come in their order, from the ground to the slider.
    """
    leg, path = Leg.from_spec(spec, as_printed=True), solution.pressed.path
    at = [int(path.at_requested[point]) for point in points]
    pieces: list[PosedBody] = []
    for name, beam in path.network.beams.items():
        line = np.array([path.shape(name, point) for point in at])
        if pieces:
            link = np.stack([pieces[-1].core[:, -1], line[:, 0]], axis=1)
            pieces.append(PosedBody.line("link", "free", link, leg.widest))
        taper = taper_of(beam.section)
        half = 0.5 * np.interp(path.places(name), taper.stations, taper.values)
        pieces.append(PosedBody.line("flexure", "free", line, half))
    ground, slider = leg.pads
    angle = linkage_of(spec.mechanism).travel_direction
    travel = solution.travel[points, None] * np.array([np.cos(angle), np.sin(angle)])
    return (
        PosedBody.polygon("pad", "held", ground),
        PosedBody.polygon("pad", "driven", slider + travel[:, None]),
        *pieces,
    )


def choose_points(solution: Solution, count: int) -> NDArray[np.intp]:
    """Return so many points of the travel, evenly, its ends included."""
    return np.unique(np.linspace(0, len(solution.travel) - 1, count).astype(int))


def _direction(points: FloatArray, k: int) -> FloatArray:
    """Return the unit vector along a chain at one of its points, between its distinct neighbours."""
    apart = np.flatnonzero(np.hypot(*(points - points[k]).T) > 0)
    before, after = apart[apart < k], apart[apart > k]
    start = points[before[-1]] if len(before) else points[k]
    stop = points[after[0]] if len(after) else points[k]
    along: FloatArray = (stop - start) / np.hypot(*(stop - start))
    return along


@dataclass(frozen=True)
class _ChainSide:
    """One side of a straight piece of a chain: its last point on the centre line, and both ends of the edge [m]."""

    along: FloatArray
    end: FloatArray
    first: FloatArray
    last: FloatArray


def _edge(line: FloatArray, half: FloatArray) -> list[FloatArray]:
    """Return the corners of the edge to the left of a chain, or to the right where half widths are negative [m].

    Every straight piece has exactly its width up to where its edge meets the next one.
    """
    sides = []
    for k in range(len(line) - 1):
        along = line[k + 1] - line[k]
        if (length := np.hypot(*along)) > 0:
            normal = np.array([-along[1], along[0]]) / length
            sides.append(
                _ChainSide(along / length, line[k + 1], line[k] + half[k] * normal, line[k + 1] + half[k + 1] * normal)
            )
    inner = [corner for side, following in itertools.pairwise(sides) for corner in _corner(side, following)]
    return [sides[0].first, *inner, sides[-1].last]


def _corner(side: _ChainSide, following: _ChainSide) -> list[FloatArray]:
    """Return where two edges meet; where the width steps, both ends on the line that halves the angle."""
    if abs(_cross_product(side.along, following.along)) < STRAIGHT_SINE:
        return [side.last, following.first]
    at, reach = side.end, float(np.hypot(*(side.last - side.end)))
    ways = side.last - side.first, following.last - following.first
    if np.isclose(reach, np.hypot(*(following.first - at)), rtol=1e-9, atol=0.0):
        met = _meeting(side.last, ways[0], following.first, ways[1])
        if np.hypot(*(met - at)) <= MITRE_LIMIT * reach:
            return [met]
        middle = side.last + following.first - 2.0 * at
        return [at + reach * middle / np.hypot(*middle)]
    halving = following.along - side.along
    return [_meeting(side.last, ways[0], at, halving), _meeting(following.first, ways[1], at, halving)]


def _meeting(a: FloatArray, a_along: FloatArray, b: FloatArray, b_along: FloatArray) -> FloatArray:
    """Return where the lines through two points along two ways meet."""
    met: FloatArray = a + _cross_product(b - a, b_along) / _cross_product(a_along, b_along) * a_along
    return met


def _cross_product(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
