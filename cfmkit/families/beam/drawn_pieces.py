"""Outline pieces of the part of a flat beam mechanism, for export and meshing: strips, joints at nodes, blocks at ends.

The network of beams and its strips go in; polygons and discs to unite, and holes to cut, come out. The part is the
union of the strips as specified. Where beams meet, the gap between them is closed by the smallest piece that leaves the
section as thick as the beams. Pads at clamps, eyes at pins, arms to nodes and bars along links lie behind all beams
that end at them.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import signed_area
from cfmkit.export.drawn_as_specified import DrawnBlock
from cfmkit.export.union import OutlinePiece
from cfmkit.families.beam.network_from_spec import is_on_axis, node_place

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.strips_and_gaps import BeamStrip

PAD_DEPTH = 4.0  # depth of a pad behind the end of a beam, in thicknesses
EYE_RADIUS, HOLE_RADIUS = 2.5, 1.2  # radii of the eye and of the hole at a pinned support, in thicknesses
STANDING_DISTANCE = 1e-4
"""A beam whose end is nearer to its node than this ends at it [thicknesses]: the two then differ by rounding only."""
CONTINUATION_ANGLE = 1e-6  # a beam that turns by less than this continues another one [rad]
MIN_PAD_SHARE = 0.1  # a pad is left out if less than this share of it lies behind all beams that end there
SQUARE_SINE = 0.1
"""Sine of the angle between a beam and a section at a bend below which the section is that across the beam."""
SECTION_LENGTH_FACTOR = 1.02
"""Length of sections at bends, in what straight beams have there: edges of curved ones are a little off. Beyond the
edge a section has no nodes."""
_N_CIRCLE_CORNERS = 64  # a polygon with so many lies within its circle by at most 0.12 % of the radius


@dataclass(frozen=True, eq=False)
class BeamEnd:
    """End of a beam, seen from there."""

    beam: str
    strip: BeamStrip  # its outermost piece
    last: bool  # whether it is the end of the piece, not its start

    @property
    def at(self) -> FloatArray:
        """Its middle (2,) [m]."""
        return np.asarray(self.strip.points[-1 if self.last else 0])

    @property
    def thickness(self) -> float:
        """Of the beam there [m]."""
        return float(self.strip.thickness[-1 if self.last else 0])

    @property
    def angle(self) -> float:
        """Direction in which the beam goes from there [rad]."""
        return float(self.strip.angle[-1] + math.pi) if self.last else float(self.strip.angle[0])

    @property
    def along(self) -> FloatArray:
        """The same as a unit vector (2,)."""
        return np.array([math.cos(self.angle), math.sin(self.angle)])

    @property
    def cap(self) -> FloatArray:
        """The line across it, from the left of the beam to the right (2, 2) [m]."""
        aside = 0.5 * self.thickness * np.array([-self.along[1], self.along[0]])
        return np.array([self.at + aside, self.at - aside])


@dataclass(frozen=True, eq=False)
class DrawnParts:
    """Pieces that a part is united from."""

    # pieces, holes: all that is united, and what is then cut out of eyes
    pieces: list[OutlinePiece]
    holes: list[OutlinePiece]
    blocks: list[DrawnBlock]  # pads, eyes and bars among the pieces: of the described half, and between both


def both_halves(assembly: Assembly, beams: dict[str, list[BeamStrip]]) -> dict[str, list[BeamStrip]]:
    """Return beams by name, those of a mirrored half with a prime."""
    if (mirror := assembly.mirror) is None:
        return beams
    return {**beams, **{f"{name}'": [strip.reflect(mirror) for strip in strips] for name, strips in beams.items()}}


def drawn_parts(assembly: Assembly, beams: dict[str, list[BeamStrip]], max_deviation: float) -> DrawnParts:
    """Return strips, what closes them where they meet, and the blocks at their ends.

    Nothing else is added: pieces that continue each other share their end, however thick each is there.
    """
    halves = both_halves(assembly, beams)
    pieces = [strip.piece for strips in halves.values() for strip in strips]
    for name, strips in halves.items():
        for first, second in itertools.pairwise(strips):
            pieces += _close_ends([BeamEnd(name, first, True), BeamEnd(name, second, False)])
    meeting = meeting_ends(assembly, halves)
    for ends in meeting.values():
        pieces += _close_ends(ends)
    blocks = list(_blocks(assembly, beams))
    bars = bars_between_halves(assembly, beams)
    solid = [*assembly.add_images([block.shape for block in blocks]), *bars.values()]
    eyes = [end for node, ends in meeting.items() if _is_pinned(assembly, node) for end in ends]
    blocks += [
        DrawnBlock(f"the eye of {end.beam} at {node}", (node,), disc(end.at, EYE_RADIUS * end.thickness, max_deviation))
        for node, ends in meeting_ends(assembly, beams).items()
        if _is_pinned(assembly, node)
        for end in ends
    ]
    blocks += [DrawnBlock(f"the bar of {node}", (node, f"{node}'"), bar) for node, bar in bars.items()]
    pieces += [OutlinePiece.polygon(shape) for shape in solid] + [_round(end, EYE_RADIUS) for end in eyes]
    return DrawnParts(pieces, [_round(end, HOLE_RADIUS) for end in eyes], blocks)


def _round(end: BeamEnd, size: float) -> OutlinePiece:
    """Return a disc about the end of a beam, of a radius in its thicknesses."""
    return OutlinePiece.disc((float(end.at[0]), float(end.at[1])), size * end.thickness)


def _is_pinned(assembly: Assembly, node: str) -> bool:
    """Return True if the beams at a node of either half end in eyes."""
    support = assembly.network.nodes[node.rstrip("'")].support
    return support.across and not support.rotation and not is_padded(assembly, node.rstrip("'"))


def meeting_ends(assembly: Assembly, halves: dict[str, list[BeamStrip]]) -> dict[str, list[BeamEnd]]:
    """Return the ends of beams by node; nodes of a mirrored half have a prime, unless they are on the axis."""
    ends_by_node: dict[str, list[BeamEnd]] = {}
    for name, strips in halves.items():
        beam, image = assembly.network.beams[name.rstrip("'")], name.endswith("'")
        for node, end in ((beam.start, BeamEnd(name, strips[0], False)), (beam.end, BeamEnd(name, strips[-1], True))):
            ends_by_node.setdefault(f"{node}'" if image and not is_on_axis(assembly, node) else node, []).append(end)
    return ends_by_node


def _close_ends(ends: list[BeamEnd]) -> Iterator[OutlinePiece]:
    """Yield what closes the ends of beams at a node.

    Where all beams leave to one side, more than half a turn between two of them is open: there the corners of these two
    and the node are joined, which leaves the section through the corner as thick as the beams. Ends that are a little
    apart, as where two halves do not quite meet, are joined by the smallest convex piece.
    """
    away = [float(np.hypot(*(end.at - ends[0].at))) for end in ends]
    if max(away) > STANDING_DISTANCE * ends[0].thickness:
        caps = [end.cap for end, apart in zip(ends, away, strict=True) if apart < end.thickness]
        yield from OutlinePiece.from_convex_hull(np.concatenate(caps)) if len(caps) > 1 else ()
        return
    ordered = sorted(ends, key=lambda end: end.angle % math.tau)
    for first, second in zip(ordered, [*ordered[1:], ordered[0]], strict=True):
        gap = (second.angle - first.angle) % math.tau
        if math.pi + CONTINUATION_ANGLE < gap < math.tau - CONTINUATION_ANGLE:
            yield OutlinePiece.polygon(np.array([first.at, first.cap[0], second.cap[1]]))


def _blocks(assembly: Assembly, beams: dict[str, list[BeamStrip]]) -> Iterator[DrawnBlock]:
    """Yield pads, arms and bars of the described half, all behind the beams that end there."""
    network, ends = assembly.network, meeting_ends(assembly, beams)
    for node, beam_ends in ends.items():
        for pad, end in pads_behind(assembly, node, beam_ends) if is_padded(assembly, node) else ():
            yield DrawnBlock(f"the pad of {end.beam} at {node}", (node,), pad)
        place = node_place(network, node)
        for end in beam_ends:
            breadth = PAD_DEPTH * end.thickness
            if np.hypot(*(end.at - place)) > STANDING_DISTANCE * breadth:
                arm = _bar(place, end.at, breadth, beam_ends)
                yield DrawnBlock(f"the arm of {end.beam} at {node}", (node,), arm)
    for link in network.links:
        a, b = (_anchor(assembly, beams, end_node) for end_node in (link.master, link.node))
        if np.hypot(*(b - a)) > 0:
            bar = _bar(a, b, _bar_width(beams), [*ends.get(link.master, []), *ends.get(link.node, [])])
            yield DrawnBlock(f"the bar from {link.master} to {link.node}", (link.master, link.node), bar)


def is_padded(assembly: Assembly, node: str) -> bool:
    """Return True if the beams at a node end in a pad: at a clamp, at a guide, at what moves as one with another node.

    Not on the mirror axis: there the beams of the two halves meet.
    """
    if is_on_axis(assembly, node):
        return False
    place = assembly.network.nodes[node]
    linked = {link.node for link in assembly.network.links}
    return (place.support.rotation and place.support.across) or node in linked


def _bar_width(beams: dict[str, list[BeamStrip]]) -> float:
    return PAD_DEPTH * max(float(strip.thickness.max()) for strips in beams.values() for strip in strips)


def _anchor(assembly: Assembly, beams: dict[str, list[BeamStrip]], node: str) -> FloatArray:
    """Return where bars to a node end [m]: in the middle of a pad there, else at the node."""
    ends = ends_at(assembly, beams, node)
    if is_padded(assembly, node):
        for pad, _ in pads_behind(assembly, node, ends):
            middle: FloatArray = pad.mean(axis=0)
            return middle
    return node_place(assembly.network, node)


def ends_at(assembly: Assembly, beams: dict[str, list[BeamStrip]], node: str) -> list[BeamEnd]:
    """Return the ends of beams at a node, first those that begin there."""
    return sorted(meeting_ends(assembly, beams).get(node, []), key=lambda end: end.last)


def mitre_direction(ends: Sequence[BeamEnd]) -> float | None:
    """Return the direction in which a section halves the angle between two beams [rad]; None if there are not two."""
    if len(ends) != 2:
        return None
    along = ends[0].along - ends[1].along
    return math.atan2(along[0], -along[1]) if np.hypot(*along) > CONTINUATION_ANGLE else None


def section_at_bend(
    ends: Sequence[BeamEnd],  # beams of one side, or of both
    direction: float,  # of the line: that of the mirror axis, or half way between two beams [rad]
    fillet: float,  # radius of the inside corner [m]
) -> FloatArray:
    """Return the line through a node from edge to edge (2, 2) [m], where beams leave it to both sides or to one."""
    line = np.array([math.cos(direction), math.sin(direction)])
    reach = [0.0, 0.0]
    for end in ends:
        lean = float(line @ end.along)
        square = math.sqrt(max(1.0 - lean**2, 0.0))
        if square < SQUARE_SINE:
            return ends[0].cap
        inside, outside = (0.5 * end.thickness + fillet) / square - fillet, 0.5 * end.thickness * square
        over = 1.0 if square > 1.0 - CONTINUATION_ANGLE else SECTION_LENGTH_FACTOR
        for side, sign in enumerate((1.0, -1.0)):
            reach[side] = max(reach[side], over * (inside if sign * lean > 0.0 else outside))
    return np.array([ends[0].at + reach[0] * line, ends[0].at - reach[1] * line])


def disc(center: FloatArray, radius: float, max_deviation: float) -> FloatArray:
    """Return a polygon whose sides are no farther than `max_deviation` [m] within the circle."""
    step = 2.0 * math.acos(max(1.0 - max_deviation / radius, 0.0))
    turn = np.linspace(0.0, 2 * math.pi, max(_N_CIRCLE_CORNERS, math.ceil(2 * math.pi / step)), endpoint=False)
    return center + radius * np.column_stack([np.cos(turn), np.sin(turn)])


def pads_behind(assembly: Assembly, node: str, ends: list[BeamEnd]) -> Iterator[tuple[FloatArray, BeamEnd]]:
    """Yield the pads behind the ends of the beams at a node, square to them: all beams keep their free length.

    Of beams that leave to opposite sides nothing is behind both: they have no pad.
    """
    part = assembly.spec.mechanism.cut_part
    for end in ends:
        depth, breadth = part.pad or (PAD_DEPTH * end.thickness, PAD_DEPTH * end.thickness)
        half = 0.5 * breadth
        if part.frame is not None:
            depth = (part.frame.wall if assembly.stands(node) else part.frame.shuttle) or depth
        side, out = half * np.array([end.along[1], -end.along[0]]), -depth * end.along
        pad = np.array([end.at + side, end.at - side, end.at - side + out, end.at + side + out])
        for neighbour in ends:
            pad = _part_behind_end(pad, neighbour) if neighbour is not end else pad
        if len(pad) > 2 and abs(signed_area(pad)) > MIN_PAD_SHARE * depth * half:
            yield pad, end


def _part_behind_end(shape: FloatArray, end: BeamEnd) -> FloatArray:
    """Return what of a convex polygon (n, 2) lies behind the end of a beam [m]; nothing may be left."""
    ahead = (shape - end.at) @ end.along
    ahead = np.where(np.abs(ahead) <= STANDING_DISTANCE * end.thickness, 0.0, ahead)
    corners = []
    for a, b, ahead_here, ahead_next in zip(shape, np.roll(shape, -1, axis=0), ahead, np.roll(ahead, -1), strict=True):
        if ahead_here <= 0:
            corners.append(a)
        if ahead_here * ahead_next < 0:
            corners.append(a + ahead_here / (ahead_here - ahead_next) * (b - a))
    return np.array(corners).reshape(-1, 2)


def _bar(a: FloatArray, b: FloatArray, width: float, ends: Sequence[BeamEnd] = ()) -> FloatArray:
    """Return a bar around the line between two places, with square ends half a width beyond them.

    It does not lie over beams that end at it, but for those that run along it.
    """
    along = (b - a) / np.hypot(*(b - a))
    side, over = 0.5 * width * np.array([-along[1], along[0]]), 0.25 * width * along
    bar = np.array([a - over - side, b + over - side, b + over + side, a - over + side])
    for end in ends:
        if max(float((place - end.at) @ end.along) for place in (a, b)) <= STANDING_DISTANCE * width:
            bar = _part_behind_end(bar, end)
    return bar


def bars_between_halves(assembly: Assembly, beams: dict[str, list[BeamStrip]]) -> dict[str, FloatArray]:
    """Return the bars that join the moving parts of two halves, behind the pads, by their nodes."""
    halves, frame = both_halves(assembly, beams), assembly.spec.mechanism.cut_part.frame
    bars: dict[str, FloatArray] = {}
    for node in sorted(assembly.moving_nodes) if assembly.mirror is not None else ():
        ends = ends_at(assembly, halves, node)
        if not ends or is_on_axis(assembly, node):
            continue
        pads = list(pads_behind(assembly, node, ends)) if is_padded(assembly, node) else []
        middle = _far_side(pads[0][0], pads[0][1]) if pads else _anchor(assembly, beams, node)
        middle, image = assembly.add_images([middle])
        if np.hypot(*(image - middle)) > 0:
            width = (frame and frame.shuttle) or _bar_width(beams)
            bars[node] = _bar(middle, image, width, [*ends, *ends_at(assembly, halves, f"{node}'")])
    return bars


def _far_side(pad: FloatArray, end: BeamEnd) -> FloatArray:
    """Return the middle of the side of a pad that is farthest behind its beam [m]."""
    ahead = (pad - end.at) @ end.along
    middle: FloatArray = pad[ahead <= ahead.min() + STANDING_DISTANCE * end.thickness].mean(axis=0)
    return middle
