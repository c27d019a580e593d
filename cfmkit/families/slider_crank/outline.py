"""Outlines of a slider-crank as cut or printed: its links, or its part, and the mirror image of a pair."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import OUTLINE_TOLERANCE, Arc, Line, Smooth, polygons
from cfmkit.families.deferred_imports import deferred_imports
from cfmkit.families.slider_crank.linkage import resolve

with deferred_imports():
    from cfmkit.families.slider_crank.printed.outline import drawing as draw_part
    from cfmkit.families.slider_crank.springs.outline import drawing as draw_links

if TYPE_CHECKING:
    from cfmkit.export.contours import Contour, Drawing, Edge
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


def drawing(spec: SliderCrankSpec, tolerance: float = OUTLINE_TOLERANCE) -> Drawing:
    """Return the outlines of one leg as the fidelity has it: of straight edges and arcs, exact.

    Raises `CannotBuild` if it cannot be assembled.
    """
    made = (draw_links if spec.built_as == "springs" else draw_part)(resolve(spec))
    legs = spec.mechanism.legs
    notes = (f"one of {legs} equal legs is drawn: make it {legs} times",) if legs > 1 else ()
    if spec.mechanism.copies == "mirrored":
        made = with_mirror_image(made)
        notes = (*notes, "the pair is drawn: the lower part is the mirror image of the upper one, on the same slider")
    return replace(made, notes=(*notes, *made.notes))


def with_mirror_image(drawing: Drawing) -> Drawing:
    """Return a drawing with the mirror image of its parts below them, apart from them."""
    heights = np.concatenate(polygons(drawing.contours))[:, 1]
    low, high = float(heights.min()), float(heights.max())
    axis = low - 0.05 * (high - low) - 0.002
    mirrored = tuple(_mirror_contour(contour, axis) for contour in drawing.contours)
    return replace(drawing, contours=(*drawing.contours, *mirrored))


def _mirror_contour(contour: Contour, axis: float) -> Contour:
    """Return a contour as seen in a mirror along y = axis [m]."""

    def edge(edge_of_half: Edge) -> Edge:
        if isinstance(edge_of_half, Line):
            (a, b), (c, d) = edge_of_half.start, edge_of_half.end
            return Line((a, 2.0 * axis - b), (c, 2.0 * axis - d))
        if isinstance(edge_of_half, Arc):
            x, y = edge_of_half.center
            return Arc((x, 2.0 * axis - y), edge_of_half.radius, -edge_of_half.start, -edge_of_half.end)
        flip = np.array([1.0, -1.0])
        return Smooth(edge_of_half.points * flip + np.array([0.0, 2.0 * axis]), edge_of_half.tangents * flip)

    return replace(contour, edges=tuple(edge(half_edge).reverse() for half_edge in reversed(contour.edges)))
