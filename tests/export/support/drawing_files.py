"""Drawings as files, by the writers of the package."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.export.arc_outlines import outlines
from cfmkit.export.dxf_svg_csv import dxf_bytes, svg_bytes

if TYPE_CHECKING:
    from cfmkit.export.contours import Drawing


def write_dxf(drawing: Drawing, tolerance: float | None = None) -> bytes:
    """Return a drawing as DXF, its arcs within a tolerance [m] of the exact curves."""
    return dxf_bytes(outlines(drawing, tolerance), drawing.labels)


def write_svg(drawing: Drawing, tolerance: float | None = None) -> bytes:
    """Return a drawing as SVG, its arcs within a tolerance [m] of the exact curves."""
    return svg_bytes(drawing.name, outlines(drawing, tolerance), drawing.labels)
