"""Snap-through leaves beside a spring, with their dimensions named; not to scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots import dimensions as draw
from cfmkit.plots.dimensions import DrawingSymbol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIMENSIONS = (
    DrawingSymbol(
        "L2", "mechanism.bistable.length", "between the ends of a leaf; half_beams says how many leaves there are"
    ),
    DrawingSymbol("theta2", "mechanism.bistable.angle", "of a leaf from the direction across the motion"),
    DrawingSymbol("t2, b2", "mechanism.bistable.thickness, .width", "of a leaf in the plane, out of it"),
    DrawingSymbol("h", "L2 sin(theta2): metric rise", "travel of the shuttle until the leaves are flat"),
    DrawingSymbol("L1", "mechanism.positive.length", "of a leaf of the spring, here a diamond of two chains"),
    DrawingSymbol(
        "theta1", "mechanism.positive.angle", "of a leaf of the diamond from the direction across the motion"
    ),
    DrawingSymbol("t1, b1", "mechanism.positive.thickness, .width", "of a leaf of the spring in the plane, out of it"),
    DrawingSymbol("dr", "analysis.preloads", "preload: how far the spring's far end is moved against the shuttle"),
    DrawingSymbol("d", "analysis.travel", "displacement of the shuttle"),
)

BLOCK, LEAF, SPRING = "#D9DEE3", "#0072B2", "#D55E00"


def figure() -> Figure:
    """Return the drawing."""
    page, ax = draw.drawing(
        "vcfm: snap-through leaves beside a spring; a preload adjusts the force", (160.0, 126.0), DIMENSIONS
    )
    middle, reach, rise = 80.0, 45.0, 12.0
    draw.area(ax, [(75, 62), (85, 62), (85, 112), (75, 112)], BLOCK)
    for top in (104.0, 84.0):
        for side in (1.0, -1.0):
            draw.line(ax, [(middle + 5 * side, top), (middle + (5 + reach) * side, top - rise)], LEAF, 2.0)
    draw.ground(ax, (130, 66), (130, 98))
    draw.ground(ax, (30, 98), (30, 66))
    # The diamond: rigid blocks above and below, leaves to the rigid corners at its sides.
    top, bottom, wide = 60.0, 18.0, 34.0
    for y, low in ((top, -3.0), (bottom, 3.0)):
        draw.area(
            ax,
            [
                (middle - 5, y + min(low, 0)),
                (middle + 5, y + min(low, 0)),
                (middle + 5, y + max(low, 0)),
                (middle - 5, y + max(low, 0)),
            ],
            BLOCK,
        )
    for side in (1.0, -1.0):
        corner = middle + (5 + wide) * side
        draw.area(ax, [(corner, 31), (corner + 4 * side, 31), (corner + 4 * side, 47), (corner, 47)], BLOCK)
        draw.line(ax, [(middle + 5 * side, top - 1.5), (corner, 46)], SPRING, 2.0)
        draw.line(ax, [(middle + 5 * side, bottom + 1.5), (corner, 32)], SPRING, 2.0)
    draw.area(ax, [(77, 59.5), (83, 59.5), (83, 62.5), (77, 62.5)], BLOCK)
    draw.arrow(ax, (80, 125), (80, 113.5), "F, d", (86, 121))
    draw.arrow(ax, (80, 5), (80, 16.5), "dr", (85, 8))
    draw.line(ax, [(60, 104), (75, 104)], "#6B6B6B", 0.5)
    draw.length(ax, (85, 104), (130, 92), "L2", 7.0)
    draw.length(ax, (24, 92), (24, 104), "h", 0.0, 3.4)
    draw.line(ax, [(22, 92), (30, 92)], "#6B6B6B", 0.5)
    draw.line(ax, [(22, 104), (75, 104)], "#6B6B6B", 0.5)
    draw.line(ax, [(30, 72), (62, 72)], "#6B6B6B", 0.5)
    draw.angle(ax, (30, 72), 21.0, 0.0, float(np.degrees(np.arctan2(rise, reach))), "theta2", 8.0)
    draw.leader(ax, (110, 84 - rise * 25 / reach), (118, 66), "t2 (b2 out of the plane)")
    draw.length(ax, (85, top - 1.5), (119, 46), "L1", 6.0)
    draw.line(ax, [(85, bottom + 1.5), (113, bottom + 1.5)], "#6B6B6B", 0.5)
    draw.angle(ax, (85, bottom + 1.5), 22.0, 0.0, float(np.degrees(np.arctan2(12.5, 34))), "theta1", 8.0)
    draw.leader(ax, (58, bottom + 1.5 + 12.5 * 17 / 34), (40, 16), "t1 (b1 out of the plane)")
    draw.leader(ax, (77, 76), (52, 114), "shuttle")
    return page
