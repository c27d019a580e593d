"""The mechanism as a part that can be cut: beams with their true thickness, joints merged, inside corners rounded."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.export.contours import Contour, Curve2D, Drawing, DrawnDimension, Region, Sheet, Smooth, circle, mark
from cfmkit.export.drawn_as_specified import SpecifiedPiece, check_outline
from cfmkit.export.fixing_holes import add_fixing_holes
from cfmkit.export.union import OutlinePiece
from cfmkit.families.beam.drawn_pieces import STANDING_DISTANCE, both_halves, drawn_parts
from cfmkit.families.beam.network_from_spec import assemble, mirror_axis, moving_nodes
from cfmkit.families.beam.part import (
    OUTLINE_TOLERANCE,
    POLYGON_TOLERANCE_SHARE,
    drawn_fillet,
    drawn_frame,
    fine_tolerance,
    held_places,
    strips_of,
)
from cfmkit.families.beam.strips_and_gaps import BeamStrip, mirror_points
from cfmkit.families.beam.warnings_of_joined_beams import joined_unasked, pins_drawn_solid
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec


def drawing(spec: BeamSpec, tolerance: float | None = None) -> Drawing:
    """Return the part, its centre lines, and the point table of every beam; `FINE` is the default tolerance.

    Raises `GeometryError` if the outline of a beam, or its area, is not that of the specification.
    """
    from cfmkit.export.union import merge_pieces

    assembly = assemble(spec)
    fine = fine_tolerance(assembly)
    tolerance = tolerance or fine
    beams = strips_of(assembly, tolerance)
    halves = both_halves(assembly, beams)
    solid = drawn_parts(assembly, beams, POLYGON_TOLERANCE_SHARE * tolerance)
    frame = drawn_frame(assembly, beams, tolerance)
    lines = [_line(strip) for strips_of in halves.values() for strip in strips_of]
    part, fillet = spec.mechanism.cut_part, drawn_fillet(spec)
    pieces = [*solid.pieces, *map(OutlinePiece.polygon, frame)]
    contours = merge_pieces(pieces, fine / OUTLINE_TOLERANCE, fillet, solid.holes)
    thinnest, holes = (
        fine / OUTLINE_TOLERANCE,
        [area for hole in solid.holes for area in hole.to_polygons(fine / OUTLINE_TOLERANCE)],
    )
    sections = check_outline(contours, tuple(_specified_pieces(beams, pieces, thinnest)), thinnest, fillet, holes)
    contours += tuple(circle(one.at, 0.5 * one.diameter, "cut", hole=True) for one in part.holes)
    paths = [Contour((line,), "path") for line in lines]
    moving = moving_nodes(assembly)
    places = held_places(assembly, beams, tolerance)
    marks = [mark(shape, place.node in moving) for place in places for shape in place.shapes]
    marks += [mark(shape, False) for shape in frame]
    tables = tuple(_table(f"beam-{name}", found) for name, found in beams.items())
    legs = spec.mechanism.copies.legs if spec.mechanism.copies else 1
    contours, bare = add_fixing_holes(contours, marks, part.screws)
    notes = (f"one of {legs} equal parts side by side is drawn: make it {legs} times",) if legs > 1 else ()
    dimensions, facts = tuple(_dimensions(assembly)), tuple(_facts(assembly, fillet))
    return Drawing(
        "beams",
        (*contours, *paths, *marks),
        tables,
        (*notes, *bare),
        _sheet(assembly, beams),
        dimensions=dimensions,
        facts=facts,
        warnings=(*pins_drawn_solid(spec), *joined_unasked(assembly, beams, solid.blocks, contours, fillet)),
        tolerance=fine,
        sections=sections,
    )


def _specified_pieces(
    beams: dict[str, list[BeamStrip]], pieces: Sequence[OutlinePiece], size: float
) -> Iterator[SpecifiedPiece]:
    """Yield the pieces that a part is united from, the first of which are the strips of beams, with their sections."""
    strips_of = [(name, strip) for name, found in beams.items() for strip in found]
    for number, piece in enumerate(pieces):
        own = (strips_of[number][1].section(strips_of[number][0]),) if number < len(strips_of) else ()
        yield SpecifiedPiece(piece.to_polygons(size), own)


def _dimensions(assembly: Assembly) -> Iterator[DrawnDimension]:
    """Yield how far what is held reaches, its mirror image included, and where the driven node is from the first."""
    nodes = assembly.network.nodes
    driven = assembly.spec.mechanism.drive.node
    held = {name: node for name, node in nodes.items() if node.support.along and node.support.across}
    if not held:
        return
    at, axis = np.array([(node.x, node.y) for node in held.values()]), mirror_axis(assembly)
    at = at if axis is None else np.vstack([at, mirror_points(at, *axis)])
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
        if abs(end["xy".index(axis)] - start["xy".index(axis)]) > STANDING_DISTANCE * math.dist(start, end):
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
        own += [Region(mirror_points(one.polygon, *axis), one.thickness) for one in own]
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
