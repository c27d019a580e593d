"""The outline of a printed slider-crank: one piece with flexures or a strip, as it is cut and as it is solved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.arc_outlines import check_simple
from cfmkit.export.contours import Contour, Curve2D, Drawing, DrawnDimension, Region, Sheet, circle, mark
from cfmkit.export.drawn_as_specified import check_outline
from cfmkit.export.fillets import round_inside_corners, sharp_notes
from cfmkit.export.fixing_holes_and_labels import add_fixing_holes, remove_screws
from cfmkit.export.posed_part import PosedBody, swept
from cfmkit.families.fem_results import remove_frame
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import STRIP_BEAM
from cfmkit.families.slider_crank.printed.part import STRAIGHT_SINE, Leg, bodies, choose_points
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.export.contours import BeamSection
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


N_SWEPT_POSES = 25  # poses at which what moves must be clear of the frame


def drawing(spec: SliderCrankSpec) -> Drawing:
    """Return the outline of one leg, with a table of its sections."""
    return _draw_leg(spec, Leg.from_spec(spec))


def _draw_leg(spec: SliderCrankSpec, leg: Leg) -> Drawing:
    """Return a leg with its inside corners rounded, its fixing holes, and the frame around it.

    Raises GeometryError if a flexure or the strip, or the area of the leg, is not that of the specification.
    """
    from cfmkit.export.union import SAGITTA_RTOL, OutlinePiece, merge_pieces

    part, fillet = spec.mechanism.cut_part, spec.mechanism.fillet
    outline, path = leg.contours
    rounded, sharp = round_inside_corners(outline, fillet)
    sections = check_outline((rounded,), tuple(leg.specified_pieces()), leg.thinnest, fillet)
    frame = _frame(spec, leg)
    made: tuple[Contour, ...] = (rounded,)
    if frame:
        check_simple(rounded.points(SAGITTA_RTOL * leg.thinnest), "the outline of the leg")  # the union would hide it
        made = merge_pieces(
            [OutlinePiece.from_contour(rounded), *map(OutlinePiece.polygon, frame)], leg.thinnest, fillet
        )
    holes = (circle(hole.at, 0.5 * hole.diameter, "cut", hole=True) for hole in part.holes)
    marks = [mark(pad, driven) for pad, driven in zip(leg.pads, (False, True), strict=True)]
    marks += [mark(shape, driven=False) for shape in frame]
    widest = float(leg.width.max())
    thin = [piece for piece in leg.pieces if piece.name and leg.width[piece.start] < widest]
    regions = [
        Region(
            _rectangle_around(leg.points[piece.start], leg.points[piece.start + 1], leg.widest),
            float(leg.width[piece.start]),
        )
        for piece in thin
    ]
    contours, bare = add_fixing_holes((*made, *holes), marks, part.screws)
    return Drawing(
        "slider-crank",
        (*contours, path, *marks),
        (_table(leg),),
        (*sharp_notes(sharp, fillet), *bare),
        Sheet(widest, tuple(regions)),
        tuple(_dimensions(leg.points)),
        tuple(_title_block_lines(spec, leg)),
        sections=sections,
    )


def _table(leg: Leg) -> Curve2D:
    """Return the centre line with its sections."""
    columns = {
        "x": (leg.points[:, 0], "length"),
        "y": (leg.points[:, 1], "length"),
        "thickness": (leg.thickness, "length"),
    }
    if leg.pieces[0].name == STRIP_BEAM:
        return Curve2D("strip", {"place": (leg.place, "length"), **columns})
    return Curve2D("flexures", {**columns, "width": (leg.width, "length")})


@dataclass(frozen=True)
class SolvedPiece:
    """One leg as it is printed."""

    # contour, holes: the outline with its fillets, thicker than drawn where printing adds to it
    contour: Contour
    holes: tuple[Contour, ...]
    # at the ground and at the slider: the face where the leg begins comes first [m]
    pads: tuple[FloatArray, FloatArray]
    sheet: Sheet  # widths
    thinnest: float  # of flexures or strip [m]
    sections: tuple[BeamSection, ...]  # of these
    frame: tuple[FloatArray, ...] = ()  # what stands around it and does not bend [m]
    sharp: tuple[str, ...] = ()  # one line per inside corner that no fillet fits, with its place


def solved_piece(spec: SliderCrankSpec) -> SolvedPiece:
    """Return one leg as it is solved as a solid."""
    spec = remove_screws(spec)
    part, leg = spec.mechanism.part, Leg.from_spec(spec, as_printed=True)
    frame: tuple[FloatArray, ...] = ()
    if part is not None and part.frame is not None and part.frame.ground is not None:
        frame = _frame(spec, Leg.from_spec(spec))
        spec = remove_frame(spec, frame, leg.pads)
    drawn = _draw_leg(spec, leg)
    outline, *others = (contour for contour in drawn.contours if contour.layer == "cut")
    return SolvedPiece(outline, tuple(others), leg.pads, drawn.sheet, leg.thinnest, drawn.sections, frame, drawn.notes)


def _frame(spec: SliderCrankSpec, leg: Leg) -> tuple[FloatArray, ...]:
    """Return the polygons of the frame around the leg and of the bar to its pad [m]; none if none is requested."""
    from cfmkit.export.ground_frame import ground_frame

    part = spec.mechanism.part
    if part is None or part.frame is None or part.frame.ground is None:
        return ()
    about, moving = part.frame, swept(_moving(spec, leg))
    return ground_frame(
        {"the ground": leg.pads[0]}, moving, (), part.frame.ground, about.clearance, about.inside
    ).pieces


def _moving(spec: SliderCrankSpec, leg: Leg) -> Iterator[PosedBody]:
    """Yield leg and pad at the slider at rest and over the travel; all of the leg as wide as its widest piece."""
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.printed.model import analyze

    yield PosedBody.line("leg", "free", leg.points, leg.widest)
    yield PosedBody.polygon("pad", "driven", leg.pads[1])
    fidelity = {"analysis.fidelity": None} if spec.analysis.fidelity == "solid" else {}
    solution: Any = analyze(spec.replace(fidelity), Run()).state
    if solution is not None:
        _, slider, *leg_bodies = bodies(spec, solution, choose_points(solution, N_SWEPT_POSES))
        yield slider
        yield PosedBody.line("leg", "free", np.concatenate([body.core for body in leg_bodies], axis=1), leg.widest)


def _dimensions(points: FloatArray) -> Iterator[DrawnDimension]:
    """Yield how far the ends of the centre line are apart."""
    start, end = ((float(x), float(y)) for x, y in (points[0], points[-1]))
    yield DrawnDimension("ends of the centre line", start, end, "x")
    if abs(end[1] - start[1]) > STRAIGHT_SINE:
        yield DrawnDimension("ends of the centre line", start, end, "y")


def _title_block_lines(spec: SliderCrankSpec, leg: Leg) -> Iterator[tuple[str, str]]:
    """Yield what the piece is made of, and how thick it is along its centre line."""
    if spec.mechanism.material is not None:
        yield "material", spec.mechanism.material.words
    limits = dict.fromkeys(
        format_short(float(thickness), "length") for thickness in (leg.thinnest, leg.thickness.max())
    )
    yield "thickness", " ... ".join(limits) + " along the centre line"


def _rectangle_around(start: FloatArray, end: FloatArray, half: float) -> FloatArray:
    """Return the rectangle with a straight line as its middle and a half height [m]."""
    along = (end - start) / np.hypot(*(end - start))
    side = half * np.array([-along[1], along[0]])
    return np.array([start - side, end - side, end + side, start + side])
