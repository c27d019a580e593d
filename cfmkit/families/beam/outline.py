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
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.export.beam_sections import SpecifiedPiece, check_outline
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
from cfmkit.export.union import OutlinePiece
from cfmkit.families.beam.drawn_pieces import (
    EYE,
    HOLE,
    STANDS,
    BeamEnd,
    bars_between_halves,
    both_halves,
    disc,
    drawn_parts,
    ends_at,
    is_padded,
    mitre_direction,
    pads_behind,
    section_at_bend,
)
from cfmkit.families.beam.network_elements_spec import PartSpec
from cfmkit.families.beam.network_from_spec import assemble, mirror_axis, moving_nodes, on_axis, thinnest_of
from cfmkit.families.beam.strips_and_gaps import BeamStrip, mirrored, strips
from cfmkit.families.beam.warnings_of_joined_beams import joined_unasked, pins_drawn_solid
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec

FINE = 2e-4
"""How far outlines may be from the exact ones unless somebody states another value, in thicknesses of the thinnest
beam: both edges together change its bending stiffness by 1.2e-3 at most."""

SHARP = 1e-4
"""Fillets smaller than this are not drawn, in thicknesses of the thinnest beam."""

SWEPT = 25
"""Poses at which what moves must be clear of the frame: in between beams go by less than their thickness."""

SHARE = 0.2
"""Part of the tolerance that polygons of eyes may be off."""

SPARSE = 5.0
"""How far lines between the points of a beam may be from its edges, in tolerances: edges are cubics between the points,
which are nearer by the square of that again."""


@dataclass(frozen=True)
class HeldPlace:
    """A place of the part that is held or driven and moves as one rigid piece."""

    name: str  # of its node; of the mirrored half with a prime
    node: str
    at: FloatArray  # (2,) where the node is [m]
    # polygons that it covers [m]; a line (2, 2) across a beam where the node is neither a pad nor an eye
    shapes: tuple[FloatArray, ...]
    seams: tuple[FloatArray, ...] = ()  # lines at which it begins [m]
    padded: bool = False  # whether its shapes are pads


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
    fits = BeamFits(network)
    return {name: strips(network, fits, name, SPARSE * tolerance) for name in network.beams}


def _held_places(
    assembly: Assembly, beams: dict[str, list[BeamStrip]], tolerance: float, loaded: Collection[str] = ()
) -> Iterator[HeldPlace]:
    network, axis = assembly.network, mirror_axis(assembly)
    moving = moving_nodes(assembly)
    bars = bars_between_halves(assembly, beams, *axis) if axis is not None else {}
    for node, about in network.nodes.items():
        ends = ends_at(assembly, beams, node)
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
    pads = [] if not is_padded(assembly, node) else list(pads_behind(assembly, node, ends))
    if pads:
        return HeldPlace(node, node, at, tuple(pad for pad, _ in pads), tuple(end.cap for _, end in pads), True)
    end = ends[0]
    if about.support.across and not about.support.rotation and not on_axis(assembly, node):
        return HeldPlace(node, node, at, (disc(end.at, HOLE * end.thickness, bulge),))
    axis = mirror_axis(assembly)
    mitre = axis[1] if axis is not None and on_axis(assembly, node) else mitre_direction(ends)
    section = end.cap if mitre is None else section_at_bend(ends, mitre, drawn_fillet(assembly.spec))
    return HeldPlace(node, node, at, (section,), (section,))


def drawing(spec: BeamSpec, tolerance: float | None = None, check: bool = True) -> Drawing:
    """Return the part, its centre lines, and the point table of every beam.

    Parameters
    ----------
    spec : BeamSpec
        What to draw.
    tolerance : float, optional
        Largest distance of the contour from the exact edges [m]; default: `FINE`.
    check : bool
        Whether a part that is not as specified is refused; False if only its size is needed.

    Raises
    ------
    cfmkit.errors.GeometryError
        If the outline of a beam, or its area, is not that of the specification.
    """
    from cfmkit.export.union import merged

    assembly = assemble(spec)
    fine = _fine(assembly)
    tolerance = tolerance or fine
    beams = _strips(assembly, tolerance)
    halves = both_halves(assembly, beams)
    solid = drawn_parts(assembly, beams, SHARE * tolerance)
    frame = _frame(assembly, beams, tolerance)
    lines = [_line(strip) for strips_of in halves.values() for strip in strips_of]
    part, fillet = spec.mechanism.part or PartSpec(), drawn_fillet(spec)
    pieces = [*solid.pieces, *map(OutlinePiece.polygon, frame)]
    contours = merged(pieces, fine / FINE, fillet, solid.holes)
    thinnest, holes = fine / FINE, [area for hole in solid.holes for area in hole.covered(fine / FINE)]
    specified = tuple(_specified(beams, pieces, thinnest)) if check else ()
    sections = check_outline(contours, specified, thinnest, fillet, holes) if check else ()
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


def drawn_fillet(spec: BeamSpec) -> float:
    """Return the radius of inside corners as drawn [m]: those much smaller than the beams are sharp corners."""
    fillet = spec.mechanism.fillet
    return fillet if fillet >= SHARP * spec.mechanism.thinnest else 0.0


def _specified(
    beams: dict[str, list[BeamStrip]], pieces: Sequence[OutlinePiece], size: float
) -> Iterator[SpecifiedPiece]:
    """Yield the pieces that a part is united from, the first of which are the strips of beams, with their sections."""
    strips_of = [(name, strip) for name, found in beams.items() for strip in found]
    for number, piece in enumerate(pieces):
        own = (strips_of[number][1].section(strips_of[number][0]),) if number < len(strips_of) else ()
        yield SpecifiedPiece(piece.covered(size), own)


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
    lines += [path.shape(name, point) for point in points for name in path.network.beams]
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
