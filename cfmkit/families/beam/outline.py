"""The mechanism as a part that can be cut: beams with their true thickness, joints merged, inside corners rounded.

At clamps and at the part that is guided the beams end in pads, at pinned supports in eyes with a hole; rigid links and
what joins two mirrored halves are bars. Stages in series are drawn above each other, legs side by side once.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.elastica import PointLoad
from cfmkit.elastica.model.network_under_drive import Layout
from cfmkit.export.contours import (
    Contour,
    Curve2D,
    Drawing,
    DrawnDimension,
    Region,
    Sheet,
    Smooth,
    circle,
    mark,
)
from cfmkit.export.strips_joined_away_from_nodes import DrawnBlock
from cfmkit.export.union import Piece
from cfmkit.families.beam.network_elements_spec import PartSpec
from cfmkit.families.beam.network_from_spec import assemble, mirror_axis, moving_nodes, on_axis, thinnest_of
from cfmkit.families.beam.strips_and_gaps import BeamStrip, mirrored, strips
from cfmkit.families.beam.warnings_of_joined_beams import joined_unasked, pins_drawn_solid
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.export.beam_sections import BeamSection
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec

PAD = 4.0
"""Depth of a pad behind the end of a beam, in thicknesses."""

EYE, HOLE = 2.5, 1.2
"""Radii of the eye and of the hole at a pinned support, in thicknesses."""

FINE = 2e-4
"""How far outlines may be from the exact ones unless somebody states another value, in thicknesses of the thinnest
beam: both edges together change its bending stiffness by 1.2e-3 at most."""

STANDS = 1e-4
"""A beam that ends nearer to its node than this stands on it, in thicknesses, as places do that differ by rounding."""

ON = 1e-6
"""A beam that turns by less than this continues another one [rad]."""

EXACT = 1e-5
"""How far lines may be from the edges of the outline when it is measured, in thicknesses of the thinnest beam."""

LEAST = 0.1
"""Pads of which less than this share is behind all beams are none."""

SWEPT = 25
"""Poses at which what moves must be clear of the frame: in between beams go by less than their thickness."""

_CORNERS = 64
"""A polygon with so many lies within its circle by at most 0.12 % of the radius."""


SHARE = 0.2
"""Part of the tolerance that polygons of eyes may be off."""

SPARSE = 5.0
"""How far lines between the points of a beam may be from its edges, in tolerances: edges are cubics between the points,
which are nearer by the square of that again."""


@dataclass(frozen=True)
class HeldPlace:
    """A place of the part that is held or driven and moves as one rigid piece.

    Attributes
    ----------
    name : str
        Of its node; of the mirrored half with a prime.
    node : str
    at : (2,) array
        Where the node is [m].
    shapes : tuple of (n, 2) arrays
        Polygons that it covers [m]; a line (2, 2) across a beam where the node is neither a pad nor an eye.
    seams : tuple of (2, 2) arrays
        Lines at which it begins [m].
    padded : bool
        Whether its shapes are pads.
    """

    name: str
    node: str
    at: FloatArray
    shapes: tuple[FloatArray, ...]
    seams: tuple[FloatArray, ...] = ()
    padded: bool = False


@dataclass(frozen=True, eq=False)
class BeamEnd:
    """Where a beam begins or ends, seen from there.

    Attributes
    ----------
    beam : str
    strip : BeamStrip
        Its outermost piece.
    last : bool
        Whether it is the end of the piece, not its start.
    """

    beam: str
    strip: BeamStrip
    last: bool

    @property
    def at(self) -> FloatArray:
        """Its middle (2,) [m]."""
        return self.strip.points[-1 if self.last else 0]

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


def regions(spec: BeamSpec, tolerance: float | None = None) -> tuple[HeldPlace, ...]:
    """Return where the part of `drawing` is held, driven or loaded: pads from the root plane on, the holes of eyes.

    Parameters
    ----------
    spec : BeamSpec
        Whose part is drawn.
    tolerance : float, optional
        As for `drawing` [m].
    """
    assembly = assemble(spec)
    tolerance = tolerance or _fine(assembly)
    beams = _strips(assembly, tolerance)
    loaded = {load.node for load in assembly.network.loads if isinstance(load, PointLoad)}
    return tuple(_held_places(assembly, beams, tolerance, loaded))


def _strips(assembly: Assembly, tolerance: float = np.inf) -> dict[str, list[BeamStrip]]:
    """Return every beam in smooth pieces, as exact as a drawing of some tolerance [m] needs them."""
    network = assembly.network
    fits = Layout(network, assembly.drive()).fits
    return {name: strips(network, fits, name, SPARSE * tolerance) for name in network.beams}


def _held_places(
    assembly: Assembly, beams: dict[str, list[BeamStrip]], tolerance: float, loaded: Collection[str] = ()
) -> Iterator[HeldPlace]:
    network, axis = assembly.network, mirror_axis(assembly)
    moving = moving_nodes(assembly)
    bars = _bars(assembly, beams, *axis) if axis is not None else {}
    for node, about in network.nodes.items():
        ends = _ends(assembly, beams, node)
        held = about.support.along or about.support.across or about.support.rotation
        if not ends or not (held or node in moving or node in loaded):
            continue
        region = _region(assembly, node, ends, SHARE * tolerance)
        joined = (bars[node],) if node in bars else ()
        yield replace(region, shapes=(*region.shapes, *joined))
        if axis is not None and not on_axis(assembly, node):
            yield HeldPlace(
                f"{node}'",
                node,
                mirrored(region.at[None], *axis)[0],
                tuple(mirrored(shape, *axis) for shape in region.shapes),
                tuple(mirrored(seam, *axis) for seam in region.seams),
                region.padded,
            )


def _region(assembly: Assembly, node: str, ends: list[BeamEnd], bulge: float) -> HeldPlace:
    """Return the place of the described half at which a node is held or driven."""
    about = assembly.network.nodes[node]
    at = np.array([about.x, about.y])
    pads = [] if not _padded(assembly, node) else list(_pads(assembly, node, ends))
    if pads:
        return HeldPlace(node, node, at, tuple(pad for pad, _ in pads), tuple(end.cap for _, end in pads), True)
    end = ends[0]
    if about.support.across and not about.support.rotation and not on_axis(assembly, node):
        return HeldPlace(node, node, at, (_disc(end.at, HOLE * end.thickness, bulge),))
    return HeldPlace(node, node, at, (end.cap,), (end.cap,))


def drawing(spec: BeamSpec, tolerance: float | None = None) -> Drawing:
    """Return the part, its centre lines, and the point table of every beam.

    Parameters
    ----------
    spec : BeamSpec
        What to draw.
    tolerance : float, optional
        Largest distance of the contour from the exact edges [m]; default: `FINE`.
    """
    from cfmkit.export.union import merged

    assembly = assemble(spec)
    fine = _fine(assembly)
    tolerance = tolerance or fine
    beams = _strips(assembly, tolerance)
    halves = both_halves(assembly, beams)
    solid = _drawn_parts(assembly, beams, SHARE * tolerance)
    frame = _frame(assembly, beams, tolerance)
    lines = [_line(strip) for strips_of in halves.values() for strip in strips_of]
    part, fillet = spec.mechanism.part or PartSpec(), spec.mechanism.fillet
    pieces = [*solid.pieces, *map(Piece.polygon, frame)]
    contours = merged(pieces, fine / FINE, fillet, solid.holes)
    sections = _checked(beams, pieces, solid.holes, contours, fine / FINE, fillet)
    contours += tuple(circle(one.at, 0.5 * one.diameter, "cut", hole=True) for one in part.holes)
    paths = [Contour((line,), "path") for line in lines]
    moving = moving_nodes(assembly)
    places = _held_places(assembly, beams, tolerance)
    marks = [mark(shape, place.node in moving) for place in places for shape in place.shapes]
    marks += [mark(shape, False) for shape in frame]
    tables = tuple(_table(f"beam-{name}", found) for name, found in beams.items())
    legs = spec.mechanism.copies.legs if spec.mechanism.copies else 1
    notes = (f"one of {legs} equal parts side by side is drawn: make it {legs} times",) if legs > 1 else ()
    dimensions, facts = tuple(_dimensions(assembly)), tuple(_facts(assembly, fillet))
    return Drawing(
        "beams",
        (*contours, *paths, *marks),
        tables,
        notes,
        _sheet(assembly, beams),
        dimensions=dimensions,
        facts=facts,
        warnings=(*pins_drawn_solid(spec), *joined_unasked(assembly, beams, solid.blocks, contours, fillet)),
        tolerance=fine,
        sections=sections,
    )


def _checked(
    beams: dict[str, list[BeamStrip]],
    pieces: Sequence[Piece],
    holes: Sequence[Piece],
    contours: Sequence[Contour],
    thinnest: float,
    fillet: float,
) -> tuple[BeamSection, ...]:
    """Return the sections of beams between joints, all of which the outline has; its area is that of its pieces.

    Of pieces that are not the longest one of their beam, those count that fillets at both ends leave free.

    Raises
    ------
    cfmkit.errors.GeometryError
        Where the outline is not what is specified.
    """
    from cfmkit.export.beam_sections import areas_of, check_area, free_sections

    covered = [piece.covered(thinnest) for piece in pieces]
    first = np.cumsum([0, *map(len, covered)])
    sections, own, number = [], [], 0
    for name, found in beams.items():  # the first of the pieces are these, in this order
        longest = max(strip.length for strip in found)
        for k, strip in enumerate(found):
            low, high = (min(max(number + k + by, number), number + len(found)) for by in (-1, 2))
            if strip.length >= min(longest, 4.0 * fillet):
                sections.append(strip.section(name))
                own.append(range(int(first[low]), int(first[high])))
        number += len(found)
    rings = [one.points(EXACT * thinnest) for one in contours]
    areas = [area for one in covered for area in one]
    judged = free_sections(sections, rings, areas, own, fillet)
    sizes = [(-1.0 if one.hole else 1.0) * _size(ring) for one, ring in zip(contours, rings, strict=True)]
    check_area(sum(sizes), *areas_of(pieces, holes, thinnest, fillet))
    return judged


def _fine(assembly: Assembly) -> float:
    return FINE * min(thinnest_of(beam.section) for beam in assembly.network.beams.values())


def standing_frame(spec: BeamSpec) -> tuple[FloatArray, ...]:
    """Return the polygons of the frame around the part and of the bars to its pads [m], if one is requested."""
    assembly = assemble(spec)
    tolerance = _fine(assembly)
    return _frame(assembly, _strips(assembly, tolerance), tolerance)


def _frame(assembly: Assembly, beams: dict[str, list[BeamStrip]], tolerance: float) -> tuple[FloatArray, ...]:
    """Return the same for a mechanism that is built."""
    from cfmkit.export.ground_frame import ground_frame

    part = assembly.spec.mechanism.part or PartSpec()
    if part.frame is None or part.frame.ground is None:
        return ()
    nodes, moving = assembly.network.nodes, moving_nodes(assembly)
    pads: dict[str, FloatArray] = {}
    covered: list[FloatArray] = []
    places = tuple(_held_places(assembly, beams, tolerance))
    for place in places:
        about = nodes[place.node].support
        clamped = about.along and about.across and about.rotation and place.node not in moving
        if clamped and place.padded:
            pads |= {f"{place.name} ({k})" if k else place.name: shape for k, shape in enumerate(place.shapes)}
        else:
            covered += list(place.shapes)
            covered += [place.at + EYE / HOLE * (shape - place.at) for shape in place.shapes if len(shape) > 4]
    return ground_frame(
        pads, _swept(assembly, places), covered, part.frame.ground, part.frame.clearance, part.frame.inside
    ).pieces


def _swept(assembly: Assembly, places: tuple[HeldPlace, ...]) -> Any:
    """Return all that beams, and pads that move, cover at rest and over the travel."""
    from cfmkit.export.ground_frame import moved, swept
    from cfmkit.families.beam.model import solve

    spec, axis = assembly.spec, mirror_axis(assembly)
    solid = spec.analysis.fidelity == "solid"
    path = (solution := solve(spec.replace({"analysis.fidelity": "inextensible"}) if solid else spec)).path
    chosen = np.unique(np.linspace(0, max(len(solution.keep) - 1, 0), SWEPT).astype(int))
    points = [int(solution.keep[one]) for one in chosen] if len(solution.keep) else []
    rest = list(itertools.chain.from_iterable(_strips(assembly).values()))
    lines = [one.points for one in rest]
    lines += [path.shape(name, point) for point in points for name in path.layout.network.beams]
    shapes = []
    for place in places:
        motion = path.motion(place.node)
        if not np.abs(motion).max(initial=0.0) > 0:
            continue
        own = place.name == place.node
        for x, y, turn in motion[points].tolist():
            by = np.array([x, y])
            if not own and axis is not None:
                by, turn = mirrored(by[None], 0j, axis[1])[0], -turn
            shapes += [moved(shape, by, turn, place.at) for shape in place.shapes if len(shape) > 2]
    if axis is not None:
        lines += [mirrored(line, *axis) for line in lines]
    half = 0.5 * max(float(one.thickness.max()) for one in rest)
    return swept(lines, half, shapes)


def _dimensions(assembly: Assembly) -> Iterator[DrawnDimension]:
    """Yield how far what is held reaches, its mirror image included, and where the driven node is from the first."""
    nodes = assembly.network.nodes
    driven = assembly.spec.mechanism.drive.node
    held = {name: node for name, node in nodes.items() if node.support.along and node.support.across}
    if not held:
        return
    at, axis = np.array([(node.x, node.y) for node in held.values()]), mirror_axis(assembly)
    at = at if axis is None else np.vstack([at, mirrored(at, *axis)])
    words = "across clamps" if all(node.support.rotation for node in held.values()) else "across supports"
    first, last = at[at.argmin(axis=0)], at[at.argmax(axis=0)]
    yield from _distances(words, first[0], last[0], ("x",))
    yield from _distances(words, first[1], last[1], ("y",))
    if driven in nodes and driven not in held:
        yield from _distances(
            f"{driven} from {next(iter(held))}", at[0], (nodes[driven].x, nodes[driven].y), ("x", "y")
        )


def _distances(words: str, start: Any, end: Any, along: tuple[Literal["x", "y"], ...]) -> Iterator[DrawnDimension]:
    for axis in along:
        if abs(end["xy".index(axis)] - start["xy".index(axis)]) > STANDS * math.dist(start, end):
            yield DrawnDimension(words, (float(start[0]), float(start[1])), (float(end[0]), float(end[1])), axis)


def _facts(assembly: Assembly, fillet: float) -> Iterator[tuple[str, str]]:
    """Yield what the part is made of, and how thick its beams are."""
    mechanism = assembly.spec.mechanism
    materials = {name: one.words for name, one in mechanism.of_beams("material").items()}
    yield "material", _by_beam(materials) if len({*materials.values()}) > 1 else next(iter(materials.values()))
    yield "fillets", format_short(fillet, "length") if fillet else "none"
    thick = {}
    for name, given in mechanism.of_beams("thickness").items():
        ends = [given] if isinstance(given, float) else [value for _, value in given]
        thick[name] = " ... ".join(dict.fromkeys(format_short(value, "length") for value in (min(ends), max(ends))))
    yield "thickness", _by_beam(thick)


def _by_beam(texts: Mapping[str, str]) -> str:
    """Return each text once, with the beams that it is about."""
    named: dict[str, list[str]] = {}
    for name, text in texts.items():
        named.setdefault(text, []).append(name)
    return "; ".join(f"{text}: {', '.join(names)}" for text, names in named.items())


def _sheet(assembly: Assembly, beams: dict[str, list[BeamStrip]]) -> Sheet:
    """Return the mechanism's width, and where beams have another one."""
    mechanism, axis = assembly.spec.mechanism, mirror_axis(assembly)
    widths = mechanism.of_beams("width")
    own = [
        Region(strip.polygon, width)
        for name, found in beams.items()
        for width in {widths[name.split(".")[0]]} - {mechanism.width}
        for strip in found
    ]
    if axis is not None:
        own += [Region(mirrored(one.polygon, *axis), one.thickness) for one in own]
    return Sheet(mechanism.width, tuple(own))


@dataclass(frozen=True, eq=False)
class DrawnParts:
    """What a part is united from.

    Attributes
    ----------
    pieces, holes : list of Piece
        All that is united, and what is then cut out of eyes.
    blocks : list of DrawnBlock
        Pads, eyes and bars among the pieces: of the described half, and between both.
    """

    pieces: list[Piece]
    holes: list[Piece]
    blocks: list[DrawnBlock]


def both_halves(assembly: Assembly, beams: dict[str, list[BeamStrip]]) -> dict[str, list[BeamStrip]]:
    """Return beams by name, those of a mirrored half with a prime."""
    if (axis := mirror_axis(assembly)) is None:
        return beams
    return {**beams, **{f"{name}'": [strip.mirrored(*axis) for strip in found] for name, found in beams.items()}}


def _drawn_parts(assembly: Assembly, beams: dict[str, list[BeamStrip]], bulge: float) -> DrawnParts:
    """Return strips, what closes them where they meet, and the blocks at their ends.

    Nothing else is added: pieces that continue each other share their end, however thick each is there.
    """
    halves, axis = both_halves(assembly, beams), mirror_axis(assembly)
    pieces = [strip.piece for found in halves.values() for strip in found]
    for name, found in halves.items():
        for one, two in itertools.pairwise(found):
            pieces += _closed([BeamEnd(name, one, True), BeamEnd(name, two, False)])
    for ends in _meeting_ends(assembly, halves).values():
        pieces += _closed(ends)
    blocks = list(_blocks(assembly, beams))
    solid = [block.shape for block in blocks]
    eyes = [end for node, ends in _meeting_ends(assembly, halves).items() if _pinned(assembly, node) for end in ends]
    blocks += [
        DrawnBlock(f"the eye of {end.beam} at {node}", (node,), _disc(end.at, EYE * end.thickness, bulge))
        for node, ends in _meeting_ends(assembly, beams).items()
        if _pinned(assembly, node)
        for end in ends
    ]
    if axis is not None:
        bars = _bars(assembly, beams, *axis)
        solid += [mirrored(shape, *axis) for shape in solid] + list(bars.values())
        blocks += [DrawnBlock(f"the bar of {node}", (node, f"{node}'"), bar) for node, bar in bars.items()]
    pieces += [Piece.polygon(shape) for shape in solid] + [_round(end, EYE) for end in eyes]
    return DrawnParts(pieces, [_round(end, HOLE) for end in eyes], blocks)


def _round(end: BeamEnd, size: float) -> Piece:
    """Return a disc about the end of a beam, of a radius in its thicknesses."""
    return Piece.disc((float(end.at[0]), float(end.at[1])), size * end.thickness)


def _pinned(assembly: Assembly, node: str) -> bool:
    """Tell whether the beams at a node of either half end in eyes."""
    support = assembly.network.nodes[node.rstrip("'")].support
    return support.across and not support.rotation and not _padded(assembly, node.rstrip("'"))


def _meeting_ends(assembly: Assembly, halves: dict[str, list[BeamStrip]]) -> dict[str, list[BeamEnd]]:
    """Return the ends of beams by node; nodes of a mirrored half have a prime, unless they are on the axis."""
    found: dict[str, list[BeamEnd]] = {}
    for name, own in halves.items():
        beam, image = assembly.network.beams[name.rstrip("'")], name.endswith("'")
        for node, end in ((beam.start, BeamEnd(name, own[0], False)), (beam.end, BeamEnd(name, own[-1], True))):
            found.setdefault(f"{node}'" if image and not on_axis(assembly, node) else node, []).append(end)
    return found


def _closed(ends: list[BeamEnd]) -> Iterator[Piece]:
    """Yield what closes the ends of beams at a node.

    Where all beams leave to one side, more than half a turn between two of them is open: there the corners of these two
    and the node are joined, which leaves the section through the corner as thick as the beams. Ends that are a little
    apart, as where two halves do not quite meet, are joined by the smallest convex piece.
    """
    from shapely import MultiPoint

    away = [float(np.hypot(*(end.at - ends[0].at))) for end in ends]
    if max(away) > STANDS * ends[0].thickness:
        near = [end.cap for end, apart in zip(ends, away, strict=True) if apart < end.thickness]
        hull = MultiPoint(np.concatenate(near)).convex_hull
        if len(near) > 1 and hull.geom_type == "Polygon":
            yield Piece.polygon(np.asarray(hull.exterior.coords)[:-1])
        return
    ordered = sorted(ends, key=lambda end: end.angle % math.tau)
    for one, other in zip(ordered, [*ordered[1:], ordered[0]], strict=True):
        gap = (other.angle - one.angle) % math.tau
        if math.pi + ON < gap < math.tau - ON:
            yield Piece.polygon(np.array([one.at, one.cap[0], other.cap[1]]))


def _blocks(assembly: Assembly, beams: dict[str, list[BeamStrip]]) -> Iterator[DrawnBlock]:
    """Yield pads, arms and bars of the described half, all behind the beams that end there."""
    network, ends = assembly.network, _meeting_ends(assembly, beams)
    for node, own in ends.items():
        for pad, end in _pads(assembly, node, own) if _padded(assembly, node) else ():
            yield DrawnBlock(f"the pad of {end.beam} at {node}", (node,), pad)
        place = np.array([network.nodes[node].x, network.nodes[node].y])
        for end in own:
            breadth = PAD * end.thickness
            if np.hypot(*(end.at - place)) > STANDS * breadth:
                arm = _bar(place, end.at, breadth, own)
                yield DrawnBlock(f"the arm of {end.beam} at {node}", (node,), arm)
    thick = max(float(strip.thickness.max()) for found in beams.values() for strip in found)
    for link in network.links:
        a, b = (_anchor(assembly, beams, one) for one in (link.master, link.node))
        if np.hypot(*(b - a)) > 0:
            bar = _bar(a, b, PAD * thick, [*ends.get(link.master, []), *ends.get(link.node, [])])
            yield DrawnBlock(f"the bar from {link.master} to {link.node}", (link.master, link.node), bar)


def _padded(assembly: Assembly, node: str) -> bool:
    """Tell whether the beams at a node end in a pad: at a clamp, at a guide, at what moves as one with another node.

    Not on the mirror axis: there the beams of the two halves meet.
    """
    if on_axis(assembly, node):
        return False
    found = assembly.network.nodes[node]
    linked = {link.node for link in assembly.network.links}
    return (found.support.rotation and found.support.across) or node in linked


def _moves(assembly: Assembly, node: str) -> bool:
    """Tell whether a pad at a node moves: it is driven, guided or linked."""
    about = assembly.network.nodes[node].support
    return node in moving_nodes(assembly) or not (about.along and about.across and about.rotation)


def _anchor(assembly: Assembly, beams: dict[str, list[BeamStrip]], node: str) -> FloatArray:
    """Return where bars to a node end [m]: in the middle of a pad there, else at the node."""
    ends = _ends(assembly, beams, node)
    if _padded(assembly, node):
        for pad, _ in _pads(assembly, node, ends):
            middle: FloatArray = pad.mean(axis=0)
            return middle
    found = assembly.network.nodes[node]
    return np.array([found.x, found.y])


def _ends(assembly: Assembly, beams: dict[str, list[BeamStrip]], node: str) -> list[BeamEnd]:
    """Return the ends of beams at a node, first those that begin there."""
    return sorted(_meeting_ends(assembly, beams).get(node, []), key=lambda end: end.last)


def _disc(center: FloatArray, radius: float, bulge: float) -> FloatArray:
    """Return a polygon whose sides are no farther than `bulge` [m] within the circle."""
    step = 2.0 * math.acos(max(1.0 - bulge / radius, 0.0))
    turn = np.linspace(0.0, 2 * math.pi, max(_CORNERS, math.ceil(2 * math.pi / step)), endpoint=False)
    return center + radius * np.column_stack([np.cos(turn), np.sin(turn)])


def _pads(assembly: Assembly, node: str, ends: list[BeamEnd]) -> Iterator[tuple[FloatArray, BeamEnd]]:
    """Yield the pads behind the ends of the beams at a node, square to them: all beams keep their free length.

    Of beams that leave to opposite sides nothing is behind both: they have no pad.
    """
    part, moves = assembly.spec.mechanism.part, _moves(assembly, node)
    for end in ends:
        depth, half = PAD * end.thickness, 0.5 * PAD * end.thickness
        if part is not None and part.pad is not None:
            depth, half = part.pad[0], 0.5 * part.pad[1]
        if part is not None and part.frame is not None:
            depth = (part.frame.shuttle if moves else part.frame.wall) or depth
        side, out = half * np.array([end.along[1], -end.along[0]]), -depth * end.along
        pad = np.array([end.at + side, end.at - side, end.at - side + out, end.at + side + out])
        for other in ends:
            pad = _behind(pad, other) if other is not end else pad
        if len(pad) > 2 and _size(pad) > LEAST * depth * half:
            yield pad, end


def _behind(shape: FloatArray, end: BeamEnd) -> FloatArray:
    """Return what of a convex polygon (n, 2) lies behind the end of a beam [m]; nothing may be left."""
    ahead = (shape - end.at) @ end.along
    ahead = np.where(np.abs(ahead) <= STANDS * end.thickness, 0.0, ahead)
    found = []
    for a, b, one, other in zip(shape, np.roll(shape, -1, axis=0), ahead, np.roll(ahead, -1), strict=True):
        if one <= 0:
            found.append(a)
        if one * other < 0:
            found.append(a + one / (one - other) * (b - a))
    return np.array(found).reshape(-1, 2)


def _size(shape: FloatArray) -> float:
    """Return the area of a polygon (n, 2) [m2]."""
    x, y = (shape - shape[0]).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def _bar(a: FloatArray, b: FloatArray, width: float, ends: Sequence[BeamEnd] = ()) -> FloatArray:
    """Return a bar around the line between two places, with square ends half a width beyond them.

    It does not lie over beams that end at it, but for those that run along it.
    """
    along = (b - a) / np.hypot(*(b - a))
    side, over = 0.5 * width * np.array([-along[1], along[0]]), 0.25 * width * along
    bar = np.array([a - over - side, b + over - side, b + over + side, a - over + side])
    for end in ends:
        if max(float((place - end.at) @ end.along) for place in (a, b)) <= STANDS * width:
            bar = _behind(bar, end)
    return bar


def _bars(
    assembly: Assembly, beams: dict[str, list[BeamStrip]], at: complex, direction: float
) -> dict[str, FloatArray]:
    """Return the bars that join the moving parts of two halves, behind the pads, by their nodes."""
    halves = both_halves(assembly, beams)
    thick = max(float(strip.thickness.max()) for found in beams.values() for strip in found)
    found: dict[str, FloatArray] = {}
    for node in sorted(moving_nodes(assembly)):
        ends = _ends(assembly, halves, node)
        if not ends or on_axis(assembly, node):
            continue
        pads = list(_pads(assembly, node, ends)) if _padded(assembly, node) else []
        middle = _far_side(pads[0][0], pads[0][1]) if pads else _anchor(assembly, beams, node)
        other = mirrored(middle[None], at, direction)[0]
        if np.hypot(*(other - middle)) > 0:
            images = _ends(assembly, halves, f"{node}'")
            found[node] = _bar(middle, other, _shuttle(assembly) or PAD * thick, [*ends, *images])
    return found


def _far_side(pad: FloatArray, end: BeamEnd) -> FloatArray:
    """Return the middle of the side of a pad that is farthest behind its beam [m]."""
    ahead = (pad - end.at) @ end.along
    middle: FloatArray = pad[ahead <= ahead.min() + STANDS * end.thickness].mean(axis=0)
    return middle


def _shuttle(assembly: Assembly) -> float | None:
    part = assembly.spec.mechanism.part
    return part.frame.shuttle if part is not None and part.frame is not None else None


def _line(strip: BeamStrip) -> Smooth:
    return Smooth(strip.points, np.column_stack([np.cos(strip.angle), np.sin(strip.angle)]))


def _table(name: str, found: list[BeamStrip]) -> Curve2D:
    """Return the exact points of a beam: centre line, angle, thickness, both edges."""
    points = np.concatenate([strip.points for strip in found])
    left, right = (np.concatenate([strip.sides[k] for strip in found]) for k in (0, 1))
    columns = {
        "x": (points[:, 0], "length"),
        "y": (points[:, 1], "length"),
        "angle": (np.concatenate([strip.angle for strip in found]), "angle"),
        "thickness": (np.concatenate([strip.thickness for strip in found]), "length"),
        "left_x": (left[:, 0], "length"),
        "left_y": (left[:, 1], "length"),
        "right_x": (right[:, 0], "length"),
        "right_y": (right[:, 1], "length"),
    }
    return Curve2D(name, columns)
