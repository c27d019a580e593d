"""The slider-crank with its springs and its dimensions named; not to scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots import dimensions as draw
from cfmkit.plots.dimensions import DrawingSymbol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIMENSIONS = (
    DrawingSymbol("r1", "mechanism.crank_length", "crank, from the pivot to the crank pin"),
    DrawingSymbol("r2", "mechanism.coupler_length", "coupler, from the crank pin to the slider pin"),
    DrawingSymbol("e", "mechanism.offset", "height of the slider pin's path above the pivot"),
    DrawingSymbol(
        "x_in", "mechanism.stretched_position", "place of the slider where crank and coupler are in line; instead of r2"
    ),
    DrawingSymbol(
        "theta", "analysis.angle", "crank angle from the slider's path; mechanism.unloaded_angle: springs at rest"
    ),
    DrawingSymbol("K1", "mechanism.springs.pivot", "torsion spring at the pivot (K_RA)"),
    DrawingSymbol("K2", "mechanism.springs.crank_pin", "torsion spring between crank and coupler (K_RB)"),
    DrawingSymbol("K3", "mechanism.springs.slider_pin", "torsion spring between coupler and slider (K_RC)"),
    DrawingSymbol("K_P", "mechanism.springs.slider", "spring along the slider's path (K_PC)"),
    DrawingSymbol(
        "T, F",
        "analysis.drive: torque or force",
        "what drives: a torque at the crank, or a force that pushes the slider in",
    ),
)

LINK, STEEL = "#4C5B6B", "#D9DEE3"


def figure() -> Figure:
    """Return the drawing."""
    page, ax = draw.drawing("slider-crank: springs at its joints, constant torque or force", (160.0, 74.0), DIMENSIONS)
    pivot, crank, coupler, offset, turn = np.array([24.0, 18.0]), 42.0, 72.0, 20.0, np.radians(62.0)
    pin = pivot + crank * np.array([np.cos(turn), np.sin(turn)])
    slider = np.array([pin[0] + np.sqrt(coupler**2 - (pin[1] - pivot[1] - offset) ** 2), pivot[1] + offset])
    stretched = pivot + draw.by(np.sqrt((crank + coupler) ** 2 - offset**2), offset)
    straight = pivot + crank / (crank + coupler) * (stretched - pivot)
    draw.line(ax, [pivot, straight, stretched], "#9AA5B1", 1.2, dashed=True, order=1.5)
    draw.disc(ax, straight, 1.1, dashed=True)
    draw.line(ax, [pivot, pivot + draw.by(116, 0)], "#6B6B6B", 0.5, order=1.2)
    draw.line(ax, [slider - [20, 0], [155, slider[1]]], "#6B6B6B", 0.5, dashed=True, order=1.2)
    draw.ground(ax, (pivot[0] - 8, pivot[1] - 4), (pivot[0] + 8, pivot[1] - 4))
    draw.ground(ax, (slider[0] - 12, slider[1] - 5), (152, slider[1] - 5))
    draw.line(ax, [pivot, pin], LINK, 3.2)
    draw.line(ax, [pin, slider], LINK, 3.2)
    draw.area(ax, slider + np.array([[-7, -5], [7, -5], [7, 5], [-7, 5]]), STEEL, 2.5)
    for place in (pivot, pin, slider):
        draw.spiral(ax, place, 4.6)
        draw.disc(ax, place, 1.3, order=4)
    draw.coil(ax, slider + draw.by(7, 0), np.array([152.0, slider[1]]), 2.4, 7)
    draw.ground(ax, (152, slider[1] - 7), (152, slider[1] + 7))
    draw.length(ax, pivot, pin, "r1", 8.0)
    draw.length(ax, pin, slider, "r2", 9.0)
    draw.length(ax, (pivot[0] + 82, pivot[1]), (pivot[0] + 82, slider[1]), "e", 0.0, -3.0)
    draw.length(ax, (pivot[0], 6), (stretched[0], 6), "x_in", 0.0, 3.0)
    draw.line(ax, [stretched, (stretched[0], 4)], "#6B6B6B", 0.5, order=1.2)
    draw.line(ax, [pivot, (pivot[0], 4)], "#6B6B6B", 0.5, order=1.2)
    draw.angle(ax, pivot, 17.0, 0.0, 62.0, "theta", 5.5)
    draw.leader(ax, pivot + draw.by(-4, 2), pivot + draw.by(-14, 8), "K1")
    draw.leader(ax, pin + draw.by(0, 4.6), pin + draw.by(2, 12), "K2")
    draw.leader(ax, slider + draw.by(-3, 4), slider + draw.by(-6, 14), "K3")
    draw.leader(ax, (147, slider[1] + 2.4), (147, slider[1] + 13), "K_P")
    draw.leader(ax, straight, straight + draw.by(8, -7), "stretched", dot=False)
    draw.arrow(ax, slider + draw.by(24, 3.6), slider + draw.by(7.5, 3.6), "F", slider + draw.by(27, 4.6))
    turned = np.radians(np.linspace(75, 118, 20))
    arc = pivot + 30.0 * np.column_stack([np.cos(turned), np.sin(turned)])
    draw.line(ax, arc, "#D55E00", 1.5)
    draw.arrow(ax, arc[-2], arc[-1], "T", arc[-1] + draw.by(-4, 1))
    return page
