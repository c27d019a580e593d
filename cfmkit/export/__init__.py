"""Drawings as files: DXF and SVG of what is to be cut, CSV of the exact points, bodies as STL, 3MF and STEP.

Nothing here touches a disk, but for a temporary folder where a library needs one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.lazy_names import lazy_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.export.arc_outlines import Outline
    from cfmkit.export.contours import Drawing

__getattr__, _OFFERED_NAMES = lazy_names(
    __name__,
    {
        "arc_outlines": "outlines",
        "contours": "Arc Contour Curve2D Drawing Line Smooth circle polygon polygons",
        "posed_part": "PosedBody box rectangle screw_positions swept",
        "union": "OutlinePiece merge_pieces",
    },
)
__all__ = ["DEFAULT_FORMATS", "FILE_FORMATS", "files", *_OFFERED_NAMES]
FILE_FORMATS = ("dxf", "svg", "csv", "stl", "3mf", "step")  # what `files` can write
DEFAULT_FORMATS = FILE_FORMATS[:3]  # what it writes unless told: what a cutter needs


def files(
    drawing: Drawing,  # what to draw; its name is the stem of the file names
    # width of the cut [m]. Adds ``<name>-kerf.dxf``, where all cut contours are moved into the waste by half of it; the
    # other files always have the true size
    kerf: float | None = None,
    # largest distance of the arcs from the exact smooth curves [m], and of the triangles of bodies from the arcs;
    # default: that of the drawing
    tolerance: float | None = None,
    formats: Sequence[str] = DEFAULT_FORMATS,  # of `FILE_FORMATS`
) -> dict[str, bytes]:
    """Return the files of a drawing, by name: DXF, SVG and one CSV per table, and bodies where they are requested.

    A drawing without anything on layer `reference` gets a reference square beside it.

    Raises GeometryError if the drawing cannot be cut as it is, or not with that kerf; if it has no thickness for a
    body; UsageError if the library for a format is not installed.
    """
    from cfmkit.export.arc_outlines import outlines
    from cfmkit.export.contours import check_name
    from cfmkit.export.dxf_svg_csv import dxf_bytes, svg_bytes, write_points
    from cfmkit.export.kerf import with_kerf

    tolerance = drawing.tolerance if tolerance is None else tolerance
    stem = check_name(drawing.name, "drawing")
    drawn = outlines(drawing.with_reference_square(), tolerance)
    contents: dict[str, bytes] = {}
    if "dxf" in formats:
        contents[f"{stem}.dxf"] = dxf_bytes(drawn, drawing.labels)
        if kerf is not None:
            contents[f"{stem}-kerf.dxf"] = dxf_bytes(with_kerf(drawn, kerf), drawing.labels)
    if "svg" in formats:
        contents[f"{stem}.svg"] = svg_bytes(stem, drawn, drawing.labels)
    if "csv" in formats:
        contents |= write_points(drawing)
    return contents | _bodies(drawing, drawn, tolerance, formats)


def _bodies(drawing: Drawing, drawn: Sequence[Outline], tolerance: float, formats: Sequence[str]) -> dict[str, bytes]:
    """Return the files that have a third dimension."""
    contents: dict[str, bytes] = {}
    if {"stl", "3mf"} & set(formats):
        from cfmkit.export.bodies_stl_3mf_step import bodies, plates, stl_bytes, threemf_bytes

        extruded = bodies(plates(drawn, drawing.sheet, tolerance))
        writers = {"stl": stl_bytes, "3mf": threemf_bytes}
        contents |= {
            f"{drawing.name}.{kind}": writers[kind](drawing.name, extruded) for kind in writers if kind in formats
        }
    if "step" in formats:
        from cfmkit.export.bodies_stl_3mf_step import step_bytes

        contents[f"{drawing.name}.step"] = step_bytes(drawing.name, drawn, drawing.sheet)
    return contents
