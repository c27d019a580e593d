"""Drawing of a beam mechanism as a part that can be cut: outline, dimensions, point tables, warnings on what it joins.

Warnings say what the drawing joins although the mechanism does not.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.export.contours import Contour, Curve2D, Drawing, DrawnDimension, Region, Sheet, Smooth, circle, mark
from cfmkit.export.drawn_as_specified import (
    DrawnBlock,
    DrawnStrip,
    NodesAndBodies,
    SpecifiedPiece,
    check_outline,
    joined_away_from_nodes,
)
from cfmkit.export.fixing_holes_and_labels import add_fixing_holes
from cfmkit.export.union import OutlinePiece
from cfmkit.families.beam.drawn_pieces import STANDING_DISTANCE, both_halves, drawn_parts
from cfmkit.families.beam.finding_names import finding
from cfmkit.families.beam.network_from_spec import assemble, is_on_axis, node_place
from cfmkit.families.beam.part import (
    POLYGON_TOLERANCE_SHARE,
    drawn_fillet,
    drawn_frame,
    fine_tolerance,
    held_places,
    strips_of,
)
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.export.drawn_as_specified import Join
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.families.beam.strips_and_gaps import BeamStrip
    from cfmkit.results import Finding


def drawing(spec: BeamSpec, tolerance: float | None = None) -> Drawing:
    """Return the part, its centre lines, and the point table of every beam; `fine_tolerance` is the default.

    Raises `GeometryError` if the outline of a beam, or its area, is not that of the specification.
    """
    from cfmkit.export.union import merge_pieces

    assembly, part, fillet, legs = assemble(spec), spec.mechanism.cut_part, drawn_fillet(spec), spec.mechanism.legs
    fine, thinnest = fine_tolerance(assembly), assembly.thinnest
    tolerance = tolerance or fine
    beams = strips_of(assembly, tolerance)
    solid = drawn_parts(assembly, beams, POLYGON_TOLERANCE_SHARE * tolerance)
    frame = drawn_frame(assembly, beams, tolerance)
    pieces = [*solid.pieces, *map(OutlinePiece.polygon, frame)]
    contours = merge_pieces(pieces, thinnest, fillet, solid.holes)
    holes = [area for hole in solid.holes for area in hole.to_polygons(thinnest)]
    sections = check_outline(contours, tuple(_specified_pieces(beams, pieces, thinnest)), thinnest, fillet, holes)
    contours += tuple(circle(hole.at, 0.5 * hole.diameter, "cut", hole=True) for hole in part.holes)
    paths = [Contour((_axis(strip),), "path") for strips in both_halves(assembly, beams).values() for strip in strips]
    places = held_places(assembly, beams, tolerance)
    marks = [mark(shape, place.node in assembly.moving_nodes) for place in places for shape in place.shapes]
    marks += [mark(shape, False) for shape in frame]
    contours, bare = add_fixing_holes(contours, marks, part.screws)
    notes = (f"one of {legs} equal parts side by side is drawn: make it {legs} times",) if legs > 1 else ()
    return Drawing(
        "beams",
        (*contours, *paths, *marks),
        tuple(_table(f"beam-{name}", strips) for name, strips in beams.items()),
        (*notes, *bare),
        _sheet(assembly, beams),
        dimensions=tuple(_dimensions(assembly)),
        facts=tuple(_title_block_lines(assembly, fillet)),
        warnings=(*pins_drawn_solid(spec), *find_unintended_joins(assembly, beams, solid.blocks, contours, fillet)),
        tolerance=fine,
        sections=sections,
    )


def _specified_pieces(
    beams: dict[str, list[BeamStrip]], pieces: Sequence[OutlinePiece], size: float
) -> Iterator[SpecifiedPiece]:
    """Yield the pieces that a part is united from, the first of which are the strips of beams, with their sections."""
    sections = [strip.section(name) for name, strips in beams.items() for strip in strips]
    for number, piece in enumerate(pieces):
        yield SpecifiedPiece(piece.to_polygons(size), tuple(sections[number : number + 1]))


def _dimensions(assembly: Assembly) -> Iterator[DrawnDimension]:
    """Yield how far what is held reaches, its mirror image included, and where the driven node is from the first."""
    nodes = assembly.network.nodes
    driven = assembly.spec.mechanism.drive.node
    held = {name: node for name, node in nodes.items() if node.support.along and node.support.across}
    if not held:
        return
    at = np.vstack(assembly.add_images([np.array([(node.x, node.y) for node in held.values()])]))
    words = "across clamps" if all(node.support.rotation for node in held.values()) else "across supports"
    first, last = at[at.argmin(axis=0)], at[at.argmax(axis=0)]
    yield from _dimension(words, first[0], last[0], ("x",))
    yield from _dimension(words, first[1], last[1], ("y",))
    if driven in nodes and driven not in held:
        yield from _dimension(
            f"{driven} from {next(iter(held))}", at[0], (nodes[driven].x, nodes[driven].y), ("x", "y")
        )


def _dimension(words: str, start: Any, end: Any, along: tuple[Literal["x", "y"], ...]) -> Iterator[DrawnDimension]:
    for axis in along:
        if abs(end["xy".index(axis)] - start["xy".index(axis)]) > STANDING_DISTANCE * math.dist(start, end):
            yield DrawnDimension(words, (float(start[0]), float(start[1])), (float(end[0]), float(end[1])), axis)


def _title_block_lines(assembly: Assembly, fillet: float) -> Iterator[tuple[str, str]]:
    """Yield what the part is made of, and how thick its beams are."""
    mechanism = assembly.spec.mechanism
    materials = {name: material.words for name, material in mechanism.collect_beam_values("material").items()}
    yield "material", _group_by_text(materials) if len({*materials.values()}) > 1 else next(iter(materials.values()))
    yield "fillets", format_short(fillet, "length") if fillet else "none"
    thick = {}
    for name in mechanism.beams:
        ends = mechanism.list_thicknesses(name)
        thick[name] = " ... ".join(dict.fromkeys(format_short(value, "length") for value in (min(ends), max(ends))))
    yield "thickness", _group_by_text(thick)


def _group_by_text(texts: Mapping[str, str]) -> str:
    """Return each text once, with the beams that it is about."""
    named: dict[str, list[str]] = {}
    for name, text in texts.items():
        named.setdefault(text, []).append(name)
    return "; ".join(f"{text}: {', '.join(names)}" for text, names in named.items())


def _sheet(assembly: Assembly, beams: dict[str, list[BeamStrip]]) -> Sheet:
    """Return the mechanism's width, and where beams have another one."""
    mechanism, regions = assembly.spec.mechanism, list[Region]()
    widths = mechanism.collect_beam_values("width")
    for name, strips in beams.items():
        if (width := widths[name.split(".")[0]]) != mechanism.width:
            regions += [Region(strip.polygon, width) for strip in strips]
    if (mirror := assembly.mirror) is not None:
        regions += [Region(mirror.reflect(region.polygon), region.thickness) for region in regions]
    return Sheet(mechanism.width, tuple(regions))


def _axis(strip: BeamStrip) -> Smooth:
    return Smooth(strip.points, np.column_stack([np.cos(strip.angle), np.sin(strip.angle)]))


def _table(name: str, strips: list[BeamStrip]) -> Curve2D:
    """Return the exact points of a beam: centre line, angle, thickness, both edges."""
    points = np.concatenate([strip.points for strip in strips])
    left, right = (np.concatenate([strip.sides[k] for strip in strips]) for k in (0, 1))
    columns = {
        "x": (points[:, 0], "length"),
        "y": (points[:, 1], "length"),
        "angle": (np.concatenate([strip.angle for strip in strips]), "angle"),
        "thickness": (np.concatenate([strip.thickness for strip in strips]), "length"),
        "left_x": (left[:, 0], "length"),
        "left_y": (left[:, 1], "length"),
        "right_x": (right[:, 0], "length"),
        "right_y": (right[:, 1], "length"),
    }
    return Curve2D(name, columns)


MAX_NAMED_PAIRS = 4  # pairs that one line names


def find_unintended_joins(
    assembly: Assembly,
    beams: dict[str, list[BeamStrip]],  # the described half
    blocks: Sequence[DrawnBlock],  # pads, eyes and bars of the described half, and bars that join the halves
    contours: Sequence[Contour],  # the outline
    fillet: float,  # its inside corners [m]
) -> Iterator[Finding]:
    """Yield a warning that names what the outline joins although the network has it apart."""
    strips, blocks = [_draw_strip(assembly, name, strips_of_beam) for name, strips_of_beam in beams.items()], [*blocks]
    if (mirror := assembly.mirror) is not None:
        for strip in [*strips]:
            ends = _image(assembly, strip.ends[0]), _image(assembly, strip.ends[1])
            strips.append(replace(strip, name=f"{strip.name}'", points=mirror.reflect(strip.points), ends=ends))
        # bars between the halves are their own image
        for block in [block for block in blocks if not any(node.endswith("'") for node in block.nodes)]:
            nodes = tuple(_image(assembly, node) for node in block.nodes)
            blocks.append(DrawnBlock(f"{block.name}'", nodes, mirror.reflect(block.shape)))
    joins = joined_away_from_nodes(strips, blocks, _nodes_and_bodies(assembly), contours, fillet)
    if joins:
        more = f" and {len(joins) - MAX_NAMED_PAIRS} more" if len(joins) > MAX_NAMED_PAIRS else ""
        pairs = ", ".join(_describe_join(join) for join in joins[:MAX_NAMED_PAIRS])
        yield finding(
            "joined_away_from_nodes",
            f"drawn as one piece although the mechanism has them apart: {pairs}{more}; the part is stiffer than its "
            "beams: move them apart, or make it in layers",
        )


def pins_drawn_solid(spec: BeamSpec) -> Iterator[Finding]:
    """Yield a warning that names the pins between beams, which the outline does not have."""
    ends = [
        f"{name} at {node}"
        for name, beam in spec.mechanism.beams.items()
        for node, joint in ((beam.start, beam.start_joint), (beam.end, beam.end_joint))
        if joint == "pin"
    ]
    if ends:
        text = f"drawn as one piece with what they turn on: {', '.join(ends)}; add the pins by hand"
        yield finding("pins_not_drawn", text)


def _describe_join(join: Join) -> str:
    at = ", ".join(format_short(place, "length") for place in np.round(join.at, 9).tolist())
    pair = f"{join.first} with itself" if join.first == join.second else f"{join.first} and {join.second}"
    filled = f", where fillets fill the gap of {format_short(join.gap, 'length')}" if join.gap > 0 else ""
    return f"{pair} at ({at}){filled}"


def _draw_strip(assembly: Assembly, name: str, beam_strips: Sequence[BeamStrip]) -> DrawnStrip:
    beam = assembly.network.beams[name]
    points = np.concatenate([strip.points for strip in beam_strips])
    return DrawnStrip(name, points, np.concatenate([strip.thickness for strip in beam_strips]), (beam.start, beam.end))


def _image(assembly: Assembly, node: str) -> str:
    """Return the name of a node in the mirrored half: on the axis it is the same."""
    return node if is_on_axis(assembly, node) else f"{node}'"


def _nodes_and_bodies(assembly: Assembly) -> NodesAndBodies:
    """Return the nodes of both halves and their rigid bodies: the ground, and what links and bars join."""
    network, mirror = assembly.network, assembly.mirror
    places = {name: node_place(network, name) for name in network.nodes}
    held = {name for name in network.nodes if assembly.stands(name)}
    pairs = [(link.master, link.node) for link in network.links] + list(combinations(sorted(held), 2))
    if mirror is not None:
        pairs += [(_image(assembly, first), _image(assembly, second)) for first, second in pairs]
        pairs += [(name, _image(assembly, name)) for name in sorted(held | assembly.moving_nodes)]
        places |= {_image(assembly, name): mirror.reflect(at) for name, at in places.items()}
    return NodesAndBodies(places, _bodies(pairs))


def _bodies(pairs: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return the body of each node of some pairs that move as one."""
    body: dict[str, str] = {}
    for first, second in pairs:
        kept, gone = body.setdefault(first, first), body.setdefault(second, second)
        body = {node: kept if representative == gone else representative for node, representative in body.items()}
    return body
