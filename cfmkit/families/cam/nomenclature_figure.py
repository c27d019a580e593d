"""The cam mechanism with its dimensions named: a cam without undercut, not to scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots import dimensions as draw
from cfmkit.plots.dimensions import DrawingSymbol

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray

DIMENSIONS = (
    DrawingSymbol("l", "mechanism.brace_length", "brace, from the slider's pin to the roller's axis"),
    DrawingSymbol("x0", "mechanism.rest_half_width", "half the distance of the roller axes with the springs at rest"),
    DrawingSymbol("r", "mechanism.roller_radius", "radius of a roller"),
    DrawingSymbol("K", "mechanism.springs", "stiffness of all springs together: {stiffness, count} or a list"),
    DrawingSymbol("A", "mechanism.profile.force_constant", "what the profile is cut for: the force is F = 4 K A"),
    DrawingSymbol("s", "analysis.travel", "displacement of the slider, from 0 to mechanism.profile.stroke"),
    DrawingSymbol(
        "mu", "mechanism.rolling_friction", "rolling resistance over roller radius; it makes load differ from unload"
    ),
)

BRACE, START, RADIUS, CONSTANT = 52.0, 17.0, 6.0, 6.5
"""Of the drawn mechanism [mm on the page]."""

STEEL, LINK = "#D9DEE3", "#4C5B6B"


def figure() -> Figure:
    """Return the drawing."""
    page, ax = draw.drawing(
        "cam: two rollers on a cam, pulled together by springs and up by braces", (160.0, 112.0), DIMENSIONS
    )
    _mechanism(ax, np.array([80.0, 14.0]))
    return page


def path(out: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the centres of the right roller and the normals there, by their distances from the axis (no friction)."""
    lean = out / np.sqrt(BRACE**2 - out**2)
    height = (out - START) ** 2 / (2 * CONSTANT) - np.sqrt(BRACE**2 - out**2) + np.sqrt(BRACE**2 - START**2)
    slope = (out - START) / CONSTANT + lean
    normals = np.column_stack([slope, -np.ones_like(slope)]) / np.sqrt(1 + slope**2)[:, None]
    return np.column_stack([out, height]), normals


def _mechanism(ax: Axes, foot: FloatArray) -> None:
    rollers, normals = path(np.linspace(START, 43.0, 120))
    flank = rollers - RADIUS * normals
    inner = np.vstack(
        [flank, [[flank[-1][0], flank[-1][1] + 2]], [[-flank[-1][0], flank[-1][1] + 2]], flank[::-1] * [-1, 1]]
    )
    draw.area(ax, foot + inner, "#EEF1F4")
    for side in (1.0, -1.0):
        draw.line(ax, foot + rollers * [side, 1.0], "#0072B2", 0.8, dashed=True, order=2.4)
    (here,), (normal,) = path(np.array([35.0]))
    rest = np.array([START, 0.0])
    slider = np.array([0.0, here[1] + np.sqrt(BRACE**2 - here[0] ** 2)])
    first = np.array([0.0, np.sqrt(BRACE**2 - START**2)])
    corners = np.array([[-3, -3], [3, -3], [3, 3], [-3, 3], [-3, -3]])
    draw.line(ax, foot + first + corners, "#6B6B6B", 0.8, dashed=True)
    for side in (1.0, -1.0):
        turned = np.array([side, 1.0])
        draw.disc(ax, foot + rest * turned, RADIUS, dashed=True)
        draw.disc(ax, foot + here * turned, RADIUS, STEEL)
        draw.line(ax, [foot + slider, foot + here * turned], LINK, 2.4, order=4)
        draw.disc(ax, foot + here * turned, 1.1, order=4.2)
    draw.coil(ax, foot + here * [-1, 1], foot + here, 2.6, 14)
    draw.line(ax, [foot + draw.by(0, -9), foot + draw.by(0, 96)], "#6B6B6B", 0.5, dashed=True, order=1.2)
    draw.area(ax, foot + slider + corners, LINK, 4.3)
    draw.arrow(ax, foot + slider + draw.by(0, 3.5), foot + slider + draw.by(0, 13), "F", foot + slider + draw.by(4, 11))
    draw.length(ax, foot + here, foot + slider, "l", -7.0)
    draw.length(ax, foot + draw.by(0, 0), foot + rest, "x0", -9.0)
    draw.length(ax, foot + here, foot + here + RADIUS * np.array([0.94, -0.34]), "r", 0.0, 2.6)
    draw.length(ax, foot + draw.by(-52, first[1]), foot + draw.by(-52, slider[1]), "s", 0.0, 3.0)
    draw.line(ax, [foot + draw.by(-54, first[1]), foot + first], "#6B6B6B", 0.5, order=1.2)
    draw.line(ax, [foot + draw.by(-54, slider[1]), foot + slider], "#6B6B6B", 0.5, order=1.2)
    draw.leader(ax, foot + here * [-0.45, 1] + draw.by(0, 1.5), foot + draw.by(-22, here[1] + 11), "K")
    draw.leader(ax, foot + flank[45] * [-1, 1], foot + draw.by(-60, flank[45][1] - 3), "profile, cut for A")
    draw.leader(
        ax, foot + here + draw.by(RADIUS * -normal[0], RADIUS * -normal[1]), foot + draw.by(55, here[1] - 14), "mu"
    )
    draw.leader(ax, foot + rest * [-1, 1] + draw.by(-RADIUS, 0), foot + draw.by(-52, 3), "at rest, s = 0", dot=False)
