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
from cfmkit.export.union import quarter_pieces
from cfmkit.families.beam.network_elements_spec import PartSpec
from cfmkit.families.beam.network_from_spec import assemble, mirror_axis, moving_nodes, on_axis, thinnest_of
from cfmkit.families.beam.strips_and_gaps import BeamStrip, mirrored, strips
from cfmkit.families.beam.warnings_of_joined_beams import joined_unasked, pins_drawn_solid
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.network import Network
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec

PAD = 4.0
"""Depth of a pad behind the end of a beam, in thicknesses."""

EYE, HOLE = 2.5, 1.2
"""Radii of the eye and of the hole at a pinned support, in thicknesses."""

FINE = 2e-4
"""How far outlines may be from the exact ones unless somebody states another value, in thicknesses of the thinnest
beam: both edges together change its bending stiffness by 1.2e-3 at most."""

ROUGH = 1e-4
"""A beam that ends nearer to its node than this stands on it, in breadths of the bar that would join them."""

SWEPT = 25
"""Poses at which what moves must be clear of the frame: in between beams go by less than their thickness."""

_CORNERS = 64
"""A polygon with so many lies within its circle by at most 0.12 % of the radius."""


SHARE = 0.2
"""Part of the tolerance that each step from the exact edges to the lines of the contour may take; there are four."""


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
    """

    name: str
    node: str
    at: FloatArray
    shapes: tuple[FloatArray, ...]
    seams: tuple[FloatArray, ...] = ()


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
    return {name: strips(network, fits, name, SHARE * tolerance) for name in network.beams}


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
            )


def _region(assembly: Assembly, node: str, ends: list[tuple[BeamStrip, bool]], bulge: float) -> HeldPlace:
    """Return the place of the described half at which a node is held or driven."""
    about = assembly.network.nodes[node]
    at = np.array([about.x, about.y])
    if _padded(assembly, node):
        pads = [_pad(assembly, strip, last, _moves(assembly, node)) for strip, last in ends]
        return HeldPlace(node, node, at, tuple(pads), tuple(pad[:2] for pad in pads))
    strip, last = ends[0]
    index = -1 if last else 0
    size = float(strip.thickness[index])
    if about.support.across and not about.support.rotation and not on_axis(assembly, node):
        return HeldPlace(node, node, at, (_disc(strip.points[index], HOLE * size, bulge),))
    across = np.array([-math.sin(strip.angle[index]), math.cos(strip.angle[index])])
    line = strip.points[index] + 0.5 * size * np.array([across, -across])
    return HeldPlace(node, node, at, (line,), (line,))


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
    pieces, blocks, holes = _pieces(assembly, beams, SHARE * tolerance)
    frame = _frame(assembly, beams, tolerance)
    lines = [_line(strip) for found in beams.values() for strip in found]
    if (axis := mirror_axis(assembly)) is not None:
        bars = _bars(assembly, beams, *axis)
        pieces = [*pieces, *(mirrored(piece, *axis)[::-1] for piece in pieces), *bars.values()]
        holes = [*holes, *(mirrored(hole, *axis)[::-1] for hole in holes)]
        lines = [*lines, *(_mirrored_line(line, *axis) for line in lines)]
        blocks += [DrawnBlock(f"the bar of {node}", (node, f"{node}'"), bar) for node, bar in bars.items()]
    part = spec.mechanism.part or PartSpec()
    pieces = [*pieces, *frame]
    contours = merged(pieces, part.fillet, holes, rough=SHARE * tolerance)
    contours += tuple(circle(one.at, 0.5 * one.diameter, "cut", hole=True) for one in part.holes)
    paths = [Contour((line,), "path") for line in lines]
    moving = moving_nodes(assembly)
    places = _held_places(assembly, beams, tolerance)
    marks = [mark(shape, place.node in moving) for place in places for shape in place.shapes]
    marks += [mark(shape, False) for shape in frame]
    tables = tuple(_table(f"beam-{name}", found) for name, found in beams.items())
    legs = spec.mechanism.copies.legs if spec.mechanism.copies else 1
    notes = (f"one of {legs} equal parts side by side is drawn: make it {legs} times",) if legs > 1 else ()
    dimensions, facts = tuple(_dimensions(assembly)), tuple(_facts(assembly, part.fillet))
    return Drawing(
        "beams",
        (*contours, *paths, *marks),
        tables,
        notes,
        _sheet(assembly, beams),
        dimensions=dimensions,
        facts=facts,
        warnings=(*pins_drawn_solid(spec), *joined_unasked(assembly, beams, blocks, contours, part.fillet)),
        tolerance=fine,
    )


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
        if clamped and len(place.shapes[0]) == 4:
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
        if abs(end["xy".index(axis)] - start["xy".index(axis)]) > ROUGH * math.dist(start, end):
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


def _mirrored_line(line: Smooth, at: complex, direction: float) -> Smooth:
    return Smooth(mirrored(line.points, at, direction), mirrored(line.tangents, 0j, direction))


def _pieces(
    assembly: Assembly, beams: dict[str, list[BeamStrip]], bulge: float
) -> tuple[list[FloatArray], list[DrawnBlock], list[FloatArray]]:
    """Return the polygons of one half, those of them that are pads, eyes and bars by name, and the holes in eyes."""
    network = assembly.network
    pieces = [part for found in beams.values() for strip in found for part in strip.polygons]
    blocks: list[DrawnBlock] = []
    holes = []

    def add(name: str, shape: FloatArray, *nodes: str) -> None:
        pieces.append(shape)
        blocks.append(DrawnBlock(name, nodes, shape))

    for name, found in beams.items():
        beam = network.beams[name]
        for one, two in itertools.pairwise(found):
            pieces.append(_disc(one.points[-1], 0.5 * min(one.thickness[-1], two.thickness[0]), bulge))
        for node, strip, last in ((beam.start, found[0], False), (beam.end, found[-1], True)):
            size = float(strip.thickness[-1 if last else 0])
            at = strip.points[-1 if last else 0]
            pieces.append(_disc(at, 0.5 * size, bulge))
            support = network.nodes[node].support
            if _padded(assembly, node):
                add(f"the pad of {name} at {node}", _pad(assembly, strip, last, _moves(assembly, node)), node)
            elif support.across and not support.rotation:
                add(f"the eye of {name} at {node}", _disc(at, EYE * size, bulge), node)
                holes.append(_disc(at, HOLE * size, bulge))
            for arm in _arm(network, node, at, PAD * size):
                add(f"the arm of {name} at {node}", arm, node)
    thick = max(float(strip.thickness.max()) for found in beams.values() for strip in found)
    for link in network.links:
        a, b = (_anchor(assembly, beams, one) for one in (link.master, link.node))
        if np.hypot(*(b - a)) > 0:
            add(f"the bar from {link.master} to {link.node}", _bar(a, b, PAD * thick), link.master, link.node)
    return pieces, blocks, holes


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
    if ends and _padded(assembly, node):
        middle: FloatArray = _pad(assembly, *ends[0], _moves(assembly, node)).mean(axis=0)
        return middle
    found = assembly.network.nodes[node]
    return np.array([found.x, found.y])


def _ends(assembly: Assembly, beams: dict[str, list[BeamStrip]], node: str) -> list[tuple[BeamStrip, bool]]:
    """Return the strips that end at a node, and whether with their last point."""
    network = assembly.network
    firsts = [(found[0], False) for name, found in beams.items() if network.beams[name].start == node]
    return firsts + [(found[-1], True) for name, found in beams.items() if network.beams[name].end == node]


def _arm(network: Network, node: str, at: FloatArray, width: float) -> list[FloatArray]:
    """Return the bar from a node to the end of a beam that stands beside it [m]; none where it stands on it."""
    place = np.array([network.nodes[node].x, network.nodes[node].y])
    return [_bar(place, at, width)] if np.hypot(*(at - place)) > ROUGH * width else []


def _disc(center: FloatArray, radius: float, bulge: float) -> FloatArray:
    """Return a polygon whose sides are no farther than `bulge` [m] within the circle."""
    turn = np.linspace(0.0, 2 * math.pi, max(_CORNERS, 4 * quarter_pieces(radius, bulge)), endpoint=False)
    return center + radius * np.column_stack([np.cos(turn), np.sin(turn)])


def _pad(assembly: Assembly, strip: BeamStrip, last: bool, moves: bool) -> FloatArray:
    """Return a rectangle behind the end of a beam, square to it: the beam keeps its free length."""
    part = assembly.spec.mechanism.part
    index = -1 if last else 0
    at, angle, size = strip.points[index], float(strip.angle[index]), float(strip.thickness[index])
    out = np.array([math.cos(angle), math.sin(angle)]) * (1 if last else -1)
    side = np.array([-out[1], out[0]])
    depth, half = PAD * size, 0.5 * PAD * size
    if part is not None and part.pad is not None:
        depth, half = part.pad[0], 0.5 * part.pad[1]
    if part is not None and part.frame is not None:
        depth = (part.frame.shuttle if moves else part.frame.wall) or depth
    return np.array(
        [at + half * side, at - half * side, at - half * side + depth * out, at + half * side + depth * out]
    )


def _bar(a: FloatArray, b: FloatArray, width: float) -> FloatArray:
    """Return a bar around the line between two places, with square ends half a width beyond them."""
    along = (b - a) / np.hypot(*(b - a))
    side, over = 0.5 * width * np.array([-along[1], along[0]]), 0.25 * width * along
    return np.array([a - over - side, b + over - side, b + over + side, a - over + side])


def _bars(
    assembly: Assembly, beams: dict[str, list[BeamStrip]], at: complex, direction: float
) -> dict[str, FloatArray]:
    """Return the bars that join the moving parts of two halves, behind the pads, by their nodes."""
    thick = max(float(strip.thickness.max()) for found in beams.values() for strip in found)
    found: dict[str, FloatArray] = {}
    for node in sorted(moving_nodes(assembly)):
        ends = _ends(assembly, beams, node)
        if not ends or on_axis(assembly, node):
            continue
        padded = _padded(assembly, node)
        middle = _pad(assembly, *ends[0], True)[2:].mean(axis=0) if padded else _anchor(assembly, beams, node)
        other = mirrored(middle[None], at, direction)[0]
        if np.hypot(*(other - middle)) > 0:
            found[node] = _bar(middle, other, _shuttle(assembly) or PAD * thick)
    return found


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
