"""Drawings as files: DXF and SVG of what is to be cut, CSV of the exact points. Nothing here touches a disk."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.export.arc_outlines import outlines
from cfmkit.export.dxf import dxf_bytes, write_dxf
from cfmkit.export.geometry import TOLERANCE
from cfmkit.export.kerf import with_kerf
from cfmkit.export.layers import check_name
from cfmkit.export.points import write_points
from cfmkit.export.svg import svg_bytes, write_svg

if TYPE_CHECKING:
    from cfmkit.export.geometry import Drawing

__all__ = ["TOLERANCE", "files", "write_dxf", "write_points", "write_svg"]


def files(drawing: Drawing, kerf: float | None = None, tolerance: float = TOLERANCE) -> dict[str, bytes]:
    """Return every file of a drawing, by name: DXF, SVG and one CSV per table.

    A drawing without anything on layer `reference` gets a reference square beside it.

    Parameters
    ----------
    drawing : Drawing
        What to draw; its name is the stem of the file names.
    kerf : float, optional
        Width of the cut [m]. Adds ``<name>-kerf.dxf``, where all cut contours are moved
        into the waste by half of it; the other files always have the true size.
    tolerance : float
        Largest distance of the arcs from the exact smooth curves [m].

    Raises
    ------
    cfmkit.errors.GeometryError
        If the drawing cannot be cut as it is, or not with that kerf.
    """
    stem = check_name(drawing.name, "drawing")
    drawn = outlines(drawing.with_reference_square(), tolerance)
    found = {f"{stem}.dxf": dxf_bytes(drawn), f"{stem}.svg": svg_bytes(stem, drawn)}
    if kerf is not None:
        found[f"{stem}-kerf.dxf"] = dxf_bytes(with_kerf(drawn, kerf))
    return found | write_points(drawing)
