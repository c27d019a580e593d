"""Geometry of a vcfm: unloaded edges of leaves and spring, pieces for solid models, bodies at any travel and preload.

The shuttle moves down along x = 0; the leaves go from it to the walls at both sides, the spring stands below it on
a base that the preload pushes up. The unloaded apex of the lowest leaves is the origin.

The deformed centre lines of the leaves follow from the closed forms. There a leaf goes from the wall at (0, 0) to the
shuttle at (X, h - d); its ends keep their direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.contours import Arc, BeamSection, Contour, Edge, Line, Smooth
from cfmkit.export.drawn_as_specified import SpecifiedPiece
from cfmkit.export.fillets import round_inside_corners
from cfmkit.export.posed_part import MIRROR_FACTORS, PosedBody, PosedPart, band, join_poses, rectangle
from cfmkit.families.findings import mm
from cfmkit.families.rows import with_values
from cfmkit.families.vcfm.leaf_laws_from_spec import leaf_law, leaf_spring
from cfmkit.families.vcfm.surroundings import FrameSizes, frame_sizes

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.curves_in_rows import PreloadCurve
    from cfmkit.families.vcfm.leaves.kinds import LeafLaw, LeafSpring
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.results import Result

N_POSES = 9
"""Travels of each preload that a box counts: rigid parts move linearly, leaves bulge less than a wall is thick."""
N_WINDINGS = 8  # turns of a bought spring as they are drawn

Point = tuple[float, float]
Item = Point | Arc | Smooth  # a corner, or an edge that is not straight


# --- over the motion --------------------------------------------------------------------------------------------


def part_over_motion(result: Result) -> PosedPart | None:
    """Return a solved mechanism from rest over its travel at all preloads; None if nothing was solved."""
    if result.state is None:
        return None
    solution: Solution = result.state
    mechanism = solution.spec.mechanism
    poses = [(place, push.preload) for push in solution.pushes for place in _travels(push)]
    coil = mechanism.springs.outer_diameter or 0.0 if mechanism.springs else mechanism.flexures.width
    return PosedPart(
        bodies(solution, poses),
        depth=max(coil, mechanism.bistable.width),
        # leaves and a spring of leaves; or leaves, bought springs and the plate at their far ends
        pieces=2 + (mechanism.springs.count if mechanism.springs else 0),
    )


def _travels(push: PreloadCurve) -> list[float]:
    """Return travels of a curve, from unloaded or, where a preload pushes the shuttle back, from rest on [m]."""
    end = float(push.travel[-1])
    back = [push.rest] if push.rest is not None and push.rest < 0 else []
    return [*back, *np.linspace(0.0, end, N_POSES).tolist()]


def bodies(solution: Solution, poses: Sequence[tuple[float, float]]) -> tuple[PosedBody, ...]:
    """Return everything at some travels of the shuttle and preloads [m]."""
    spec = solution.spec
    try:
        sizes = sizes_of_frame(spec)
    except GeometryError:  # such a part cannot be cut, as its export says: plain walls stand for its frame
        sizes = frame_sizes(with_values(spec, {"mechanism.part": None}), None)
    # coils of which nothing says it are drawn as long as the farthest pose needs them
    farthest = max(push.preload for push in solution.pushes) + float(solution.first.travel[-1])
    return join_poses([list(_pose(spec, sizes, solution.parts.leaf, *pose, farthest)) for pose in poses])


def _pose(
    spec: VcfmSpec, sizes: FrameSizes, leaf: LeafLaw, travel: float, preload: float, farthest: float
) -> Iterator[PosedBody]:
    """Yield everything in one pose."""
    for body in sizes.bodies():
        yield body.move(0.0, -travel) if body.role == "driven" else body
    line = leaf.bent_line(travel)[::-1] * MIRROR_FACTORS + np.array([sizes.wall, -float(leaf.strip.rise)])
    half, spacing = 0.5 * leaf_thickness(leaf, len(line)), spec.mechanism.frame.spacing
    for number in range(spec.mechanism.bistable.half_beams):
        half_beam = PosedBody.polygon("leaf", "free", band(line + np.array([0.0, number // 2 * spacing]), half))
        yield half_beam.mirror() if number % 2 else half_beam
    if spec.mechanism.springs is None:
        yield from _leaf_spring(spec, sizes.bottom - travel, travel + preload)
    else:
        yield from _coils(spec, sizes.bottom - travel, sizes.head - travel, travel + preload, farthest)


def leaf_thickness(law: LeafLaw, count: int) -> FloatArray:
    """Return the thickness of a snap-through leaf at `count` even places of its length, at a step the smaller [m]."""
    place, (shares, heights) = np.linspace(0.0, 1.0, count), np.array(law.profile)
    return np.asarray(np.minimum(np.interp(place, shares, heights), np.interp(-place, -shares[::-1], heights[::-1])))


def _leaf_spring(spec: VcfmSpec, top: float, compression: float) -> Iterator[PosedBody]:
    """Yield the blocks and leaves of a spring whose upper end is at `top`, at a compression [m]."""
    frame, law = spec.mechanism.frame, _spring_law(spec)
    foot, blocks = law.blocks(frame.block, frame.corner, spec.mechanism.fillet, top, compression)
    lines, _ = law.bent_lines(compression, frame.corner)
    strips = [_strip(line + np.array([0.5 * frame.block, foot]), law.strip.thickness) for line in lines]
    for body in (*blocks, *strips):
        yield body
        in_the_middle = body.name in ("block", "base") and body.core[..., 0].min() < 0.0
        if spec.mechanism.flexures.loaded == "whole" and not in_the_middle:
            yield body.mirror()


def _strip(line: FloatArray, thickness: float) -> PosedBody:
    """Return a leaf of a spring, a little of it within the blocks at its ends: their faces are upright, it is not."""
    ends = [line[0] - line[1], line[-1] - line[-2]]
    beyond = [0.5 * thickness * abs(y) / np.hypot(x, y) * np.array([x, y]) / max(abs(x), abs(y)) for x, y in ends]
    return PosedBody.polygon(
        "spring", "free", band(np.vstack([line[0] + beyond[0], line, line[-1] + beyond[1]]), 0.5 * thickness)
    )


def _coils(spec: VcfmSpec, bottom: float, head: float, deflection: float, farthest: float) -> Iterator[PosedBody]:
    """Yield bought springs side by side: below the shuttle, or above it where they are pulled.

    Sizes that are not stated are such as fit the frame: only the deflection is to scale then.
    """
    springs, frame = spec.mechanism.springs, spec.mechanism.frame
    assert springs is not None
    across = springs.outer_diameter or 1.5 * frame.block
    hangs, relaxed = springs.hang, springs.free_length or max(2.0 * frame.corner, 1.5 * farthest)
    length = relaxed + springs.spring_type.lengthening * deflection
    start = head if hangs else bottom
    end = start + length if hangs else start - length
    wire = springs.wound.wire if springs.wound else 0.06 * across
    shown = min(springs.count, 4)
    pitch = 1.2 * across
    # an even number leaves the middle to the force
    middles = pitch * (np.arange(shown) - 0.5 * (shown - 1)) + (pitch if hangs and shown % 2 else 0.0)
    phase = np.linspace(0.0, 2.0 * np.pi * N_WINDINGS, 40 * N_WINDINGS + 1)
    heights = start + (end - start) * phase / phase[-1]
    for middle in middles:
        line = np.column_stack([middle + 0.5 * (across - wire) * np.sin(phase), heights])
        yield PosedBody.polygon("spring", "free", band(line, 0.5 * wire))
    left, right = float(middles.min()) - 0.6 * across, float(middles.max()) + 0.6 * across
    yield PosedBody.polygon("base", "held", rectangle(left, end, right, end + (frame.block if hangs else -frame.block)))
    if hangs:  # a beam on the shuttle that they pull on
        yield PosedBody.polygon("beam", "driven", rectangle(min(left, 0.0), start - 0.5 * frame.block, right, start))


# --- unloaded: exact edges ---------------------------------------------------------------------------------------


def specified_pieces(spec: VcfmSpec, top: float) -> Iterator[SpecifiedPiece]:
    """Yield what both structures are united from, their spring with its upper end at `top` [m], and their sections."""
    sizes, law = sizes_of_frame(spec), _leaf_law(spec)
    for level in range(_levels(spec)):
        apex = (sizes.half, level * spec.mechanism.frame.spacing)
        upper, lower = (_edge(law, side, apex) for side in (1.0, -1.0))
        leaf = np.vstack([_points(item) for item in (*upper, *_flip(lower))])
        yield SpecifiedPiece((leaf,), tuple(leaf_sections(law, apex)))
        yield SpecifiedPiece((leaf * MIRROR_FACTORS,))
    yield from (SpecifiedPiece((body.outline(),)) for body in sizes.bodies())
    if spec.mechanism.springs is None:
        thickness = _spring_law(spec).strip.thickness
        for body in _leaf_spring(spec, top, 0.0):
            yield SpecifiedPiece((body.outline(),), (_section(body, thickness),) if body.name == "spring" else ())


def leaf_sections(law: LeafLaw, apex: Point) -> Iterator[BeamSection]:
    """Yield the section in the middle of every piece of a leaf whose thickness has no step."""
    x, y, slope = law.centre_line
    length = float(np.hypot(np.diff(x), np.diff(y)).sum())
    for (start, first_thickness), (end, last_thickness) in pairwise(zip(*law.profile, strict=True)):
        if end > start:
            at = [float(np.interp(0.5 * (start + end), np.linspace(0.0, 1.0, len(x)), row)) for row in (x, y, slope)]
            across = np.array([-at[2], 1.0]) / np.hypot(1.0, at[2])
            place = np.array([apex[0] + at[0], apex[1] + at[1]])
            yield BeamSection(
                "leaf", place, across, float(0.5 * (first_thickness + last_thickness)), (end - start) * length
            )


def _section(strip: PosedBody, thickness: float) -> BeamSection:
    """Return the section in the middle of a leaf of the spring."""
    left, right = strip.outline()[: (half := len(strip.outline()) // 2)], strip.outline()[half:][::-1]
    line, across = 0.5 * (left + right), (left - right)[half // 2]
    length = float(np.hypot(*np.diff(line, axis=0).T).sum())
    return BeamSection("spring", line[half // 2], across / np.hypot(*across), thickness, length)


def _levels(spec: VcfmSpec) -> int:
    """Return the number of Vs above each other."""
    return -(-spec.mechanism.bistable.half_beams // 2)


def _check_levels(spec: VcfmSpec) -> None:
    """Refuse leaves of neighbouring levels that overlap.

    Raises GeometryError with the place where they are closest, and the spacing at which they just touch.
    """
    frame, about = spec.mechanism.frame, spec.mechanism.bistable
    law = _leaf_law(spec)
    x, y, slope = law.centre_line
    steepest = int(np.abs(slope).argmax())
    least = max(law.profile[1]) * float(np.hypot(1.0, slope[steepest]))
    if about.half_beams > 2 and frame.spacing <= least:
        at = (0.5 * frame.shuttle_width + float(x[steepest]), float(y[steepest]) + 0.5 * frame.spacing)
        raise GeometryError(
            f"the leaves of neighbouring Vs overlap, at ({mm(at[0])}, {mm(at[1])}): {mm(frame.spacing)} apart, they "
            f"touch at {mm(least)}; use a larger 'mechanism.frame.spacing'"
        )


def leaves_contours(spec: VcfmSpec) -> tuple[list[Contour], float]:
    """Return the outline of shuttle, leaves and walls with the holes between them, and its lowest point [m].

    Raises GeometryError if leaves overlap.
    """
    _check_levels(spec)
    sizes, law, levels = sizes_of_frame(spec), _leaf_law(spec), range(_levels(spec))
    half, bottom, wall, out = sizes.half, sizes.bottom, sizes.wall, sizes.out
    upper, lower = (
        [_edge(law, side, (half, level * spec.mechanism.frame.spacing)) for level in levels] for side in (1.0, -1.0)
    )
    right: list[Item] = [(0.0, sizes.head), (half, sizes.head)]
    if sizes.stopped:
        right = [(0.0, sizes.head), (out, sizes.head), (out, sizes.under), (half, sizes.under)]
    right += [*upper[-1], (wall, sizes.wall_top), (out, sizes.wall_top)]
    contours = []
    if sizes.floor is None:
        right += [(out, sizes.wall_bottom), (wall, sizes.wall_bottom), *_flip(lower[0]), (half, bottom), (0.0, bottom)]
        contours = [_close_symmetric(right)]
    else:
        right += [(out, sizes.foot), (0.0, sizes.foot)]
        inner: list[Item] = [(0.0, bottom), (half, bottom), *lower[0], (wall, sizes.floor), *sizes.ledge]
        contours = [_close_symmetric(right), _contour([*inner, *_mirror_chain(inner)], hole=True)]
    for below, above in pairwise(levels):
        hole = [*lower[above], *_flip(upper[below])]
        contours += [_contour(hole, hole=True), _contour(_mirror_chain(hole), hole=True)]
    return contours, min(bottom, sizes.foot)


def sizes_of_frame(spec: VcfmSpec) -> FrameSizes:
    """Return the sizes of what stands around leaves, and holds the spring."""
    frame = spec.mechanism.part.frame if spec.mechanism.part is not None else None
    seated = frame is not None and frame.seat is not None
    return frame_sizes(spec, spring_contours(spec, 0.0)[0].extents if seated else None)


def _leaf_law(spec: VcfmSpec) -> LeafLaw:
    return leaf_law(spec.mechanism.bistable, spec.mechanism.material)


def _edge(law: LeafLaw, side: float, apex: Point) -> list[Item]:
    """Return the upper (1) or lower (-1) edge of a leaf from the shuttle at `apex` to the wall."""
    x, y, slope = law.centre_line
    stretch = np.hypot(1.0, slope)
    if len(x) > 2:
        half = 0.5 * side * law.strip.thickness
        points = np.column_stack([x - half * slope / stretch, y + half / stretch]) + np.array(apex)
        return [Smooth(points, np.column_stack([1.0 / stretch, slope / stretch]))]
    up = 0.5 * side * float(stretch[0])
    return [
        (apex[0] + share * float(x[-1]), apex[1] + share * float(y[-1]) + up * height)
        for share, height in zip(*law.profile, strict=True)
    ]


@dataclass(frozen=True)
class SolvedPiece:
    """As much of a part as symmetry leaves: a closed contour with its fillets, and what of it is rigid."""

    contour: Contour
    # moved, held, (n, 2): polygon, or line of two points, that moves down, and the one that stands [m]
    moved: FloatArray
    held: tuple[FloatArray, ...]
    of_leaf: bool  # whether it is of the leaves, not of the spring
    sections: tuple[BeamSection, ...]  # of its leaves
    glides: bool = False  # whether what is held moves across as it likes: the middle of a corner


def solved_leaf(spec: VcfmSpec) -> SolvedPiece:
    """Return one leaf between shuttle and wall; both leaves of a V where the shuttle can turn."""
    law, fillet = _leaf_law(spec), spec.mechanism.fillet
    strip = law.strip
    half, far = 0.5 * spec.mechanism.frame.shuttle_width, 0.5 * spec.mechanism.frame.shuttle_width + float(strip.reach)
    rise, over = float(strip.rise), 2.0 * (max(law.profile[1]) + fillet)
    upper, lower = (_edge(law, side, (half, 0.0)) for side in (1.0, -1.0))
    out = far + spec.mechanism.frame.block
    right: list[Item] = [(0.0, over), (half, over), *upper, (far, over - rise), (out, over - rise)]
    right += [(out, -over - rise), (far, -over - rise), *_flip(lower), (half, -over), (0.0, -over)]
    wall = np.array([[far, over - rise], [out, over - rise], [out, -over - rise], [far, -over - rise]])
    sections = tuple(leaf_sections(law, (half, 0.0)))
    if spec.mechanism.bistable.guided:
        shuttle = np.array([[0.0, over], [half, over], [half, -over], [0.0, -over]])
        return SolvedPiece(round_inside_corners(_contour(right), fillet)[0], shuttle, (wall,), True, sections)
    shuttle = np.array([[-half, over], [half, over], [half, -over], [-half, -over]])
    return SolvedPiece(
        round_inside_corners(_close_symmetric(right), fillet)[0], shuttle, (wall, wall * MIRROR_FACTORS), True, sections
    )


def solved_spring(spec: VcfmSpec) -> SolvedPiece:
    """Return one chain of the spring, of a diamond or folded beams the upper half of it."""
    law, frame, fillet = _spring_law(spec), spec.mechanism.frame, spec.mechanism.fillet
    half = 0.5 * frame.block
    around, bottom, held, glides = law.solved_piece(law.edges(frame.block, frame.corner, fillet, 0.0), half)
    block = np.array([[0.0, 0.0], [half, 0.0], [half, bottom], [0.0, bottom]])
    contour = _contour([(0.0, 0.0), (half, 0.0), *around])
    made = round_inside_corners(contour, fillet)[0]
    x0, y0, x1, y1 = made.extents
    strips = (body for body in _leaf_spring(spec, 0.0, 0.0) if body.name == "spring")
    sections = [_section(strip, law.strip.thickness) for strip in strips]
    inside = tuple(section for section in sections if x0 < section.at[0] < x1 and y0 < section.at[1] < y1)
    return SolvedPiece(made, block, (np.array(held),), False, inside, glides)


def spring_contours(spec: VcfmSpec, top: float) -> list[Contour]:
    """Return the spring with its rigid blocks, its upper end at `top` [m]."""
    frame, half = spec.mechanism.frame, 0.5 * spec.mechanism.frame.block
    outer, inner, low = _spring_law(spec).edges(frame.block, frame.corner, spec.mechanism.fillet, top)
    if spec.mechanism.flexures.loaded == "half":
        hollow = [(-half, inner[-1][1]), *_flip(inner), (-half, inner[0][1])] if inner else []
        return [_contour([(-half, top), (half, top), *outer, (half, low), (-half, low), *hollow])]
    outline = _close_symmetric([(0.0, top), (half, top), *outer, (half, low), (0.0, low)])
    return [outline, _contour([*inner, *_mirror_chain(inner)], hole=True)] if inner else [outline]


def _spring_law(spec: VcfmSpec) -> LeafSpring:
    return leaf_spring(spec.mechanism.flexures, spec.mechanism.material)


def _close_symmetric(right: list[Item]) -> Contour:
    return _contour([*right, *_mirror_chain(right)])


def _points(item: Item) -> FloatArray:
    """Return the points of a corner or an edge that is not an arc (n, 2) [m]."""
    return np.array([item]) if isinstance(item, tuple) else item.points  # type: ignore[union-attr]


def _ends(item: Item) -> tuple[Point, Point]:
    if isinstance(item, tuple):
        return item, item
    first, last = item.ends
    return (first.real, first.imag), (last.real, last.imag)


def _flip(items: Sequence[Item]) -> list[Item]:
    """Return a chain run the other way."""
    return [item if isinstance(item, tuple) else item.reverse() for item in reversed(items)]


def _mirror_chain(items: Sequence[Item]) -> list[Item]:
    """Return the mirror image of a chain, run the other way, so that it closes the first."""
    return [(-item[0], item[1]) if isinstance(item, tuple) else item.mirror() for item in _flip(items)]


def _contour(items: Sequence[Item], hole: bool = False) -> Contour:
    """Return a closed contour through corners and edges, straight between them."""
    edges: list[Edge] = []
    for item, following in zip(items, [*items[1:], items[0]], strict=True):
        if not isinstance(item, tuple):
            edges.append(item)
        start, stop = _ends(item)[1], _ends(following)[0]
        if np.hypot(stop[0] - start[0], stop[1] - start[1]) > 1e-12:
            edges.append(Line(start, stop))
    return Contour(tuple(edges), "cut", closed=True, hole=hole)
