"""A network of beams with the words of its specification named; not to scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots import dimensions as draw
from cfmkit.plots.dimensions import DrawingSymbol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray

DIMENSIONS = (
    DrawingSymbol(
        "n1 ... n5", "mechanism.nodes.NAME.at", "[x, y] of a node; support: clamped, pinned, guided (along `direction`)"
    ),
    DrawingSymbol(
        "b1 ... b4", "mechanism.beams.NAME", "a beam from node `start` to node `end`; at a free node beams join rigidly"
    ),
    DrawingSymbol("u", "from 0 to 1 along a beam", "arc length from its start, over its length"),
    DrawingSymbol(
        "eta(u)", "mechanism.beams.NAME.shape", "direction of the unloaded beam: coefficients c0 + c1 u + c2 u^2 + ..."
    ),
    DrawingSymbol("c0", "mechanism.beams.NAME.shape.coefficients", "direction at its start, from x; c1 and c2 bend it"),
    DrawingSymbol("L", "mechanism.beams.NAME.shape.length", "along the beam; default: what fits between its nodes"),
    DrawingSymbol("w, t", "mechanism.thickness, .width", "in the plane, out of it (w and t in the paper of Lan)"),
    DrawingSymbol(
        "F, d", "mechanism.drive", "node that is moved (or loaded) and its direction; analysis.travel says how far"
    ),
    DrawingSymbol("mirror", "mechanism.copies", "equal parts that share the load: a mirror image, legs, layers"),
)

LEAF = "#0072B2"
PLACES = {"n1": (90.0, 10.0), "n2": (148.0, 10.0), "n3": (139.0, 46.0), "n4": (106.0, 53.0), "n5": (90.0, 80.0)}
"""Nodes of the right half on the page [mm]."""


def figure() -> Figure:
    """Return the drawing."""
    page, ax = draw.drawing("beam: a planar network of slender beams in large deflection", (160.0, 92.0), DIMENSIONS)
    place = {name: np.array(at) for name, at in PLACES.items()}
    shapes = {
        ("n1", "n3"): (1.3092, -1.5707),
        ("n2", "n3"): (-0.756, 1.5707),
        ("n3", "n4"): (0.3013, 1.5707),
        ("n4", "n5"): (0.226, -1.148),
    }
    drawn = {ends: beam(place[ends[0]], place[ends[1]], shape) for ends, shape in shapes.items()}
    for points in drawn.values():
        draw.line(ax, points, LEAF, 2.6)
        draw.line(ax, np.array([160.0, 0.0]) + points * [-1, 1], "#B9C6D3", 1.4)
    draw.line(ax, [(80, 3), (80, 88)], "#6B6B6B", 0.5, dashed=True, order=1.2)
    for name in ("n1", "n2"):
        at = place[name]
        draw.ground(ax, at - draw.by(8, 0), at + draw.by(8, 0), 2.0)
    draw.ground(ax, place["n5"] + draw.by(5, 7), place["n5"] + draw.by(5, -5), 2.0)
    for at in place.values():
        draw.disc(ax, at, 1.4)
    draw.arrow(ax, place["n5"] + draw.by(0, 9), place["n5"] + draw.by(0, 2), "F, d", place["n5"] + draw.by(-7, 7))
    for name, off in {"n1": (-6, 5), "n2": (7, 5), "n3": (7, 1), "n4": (-6, -4), "n5": (13, 4)}.items():
        draw.leader(ax, place[name], place[name] + off, name, dot=False)
    for name, (ends, shift) in {
        "b2": (("n2", "n3"), (9, 0)),
        "b3": (("n3", "n4"), (0, 7)),
        "b4": (("n4", "n5"), (9, 4)),
    }.items():
        middle = drawn[ends][60]
        draw.leader(ax, middle, middle + shift, name)
    first = drawn["n1", "n3"]
    draw.line(ax, [first[0], first[0] + draw.by(24, 0)], "#6B6B6B", 0.5)
    heading = np.degrees(np.arctan2(*(first[1] - first[0])[::-1]))
    draw.angle(ax, first[0], 17.0, 0.0, float(heading), "c0", 4.0)
    tangent = (first[46] - first[44]) / np.hypot(*(first[46] - first[44]))
    draw.line(ax, [first[45], first[45] + 17 * tangent], "#004B8D", 0.6, dashed=True)
    draw.line(ax, [first[45], first[45] + draw.by(17, 0)], "#6B6B6B", 0.5)
    draw.angle(ax, first[45], 13.0, 0.0, float(np.degrees(np.arctan2(tangent[1], tangent[0]))), "eta(u)", 8.0)
    draw.leader(ax, first[25], first[30] + draw.by(15, -4), "b1, of length L")
    draw.leader(ax, first[45], first[45] + draw.by(-6, 9), "u")
    draw.leader(ax, drawn["n2", "n3"][25], drawn["n2", "n3"][25] + draw.by(-12, -2), "w")
    draw.leader(ax, (160 - drawn["n3", "n4"][60][0], drawn["n3", "n4"][60][1]), (32, 74), "mirror")
    return page


def beam(start: FloatArray, end: FloatArray, bends: tuple[float, float], points: int = 121) -> FloatArray:
    """Return points of a beam whose direction is c0 + c1 u + c2 u^2, turned and scaled to end where it should."""
    u = np.linspace(0.0, 1.0, points)
    step = np.exp(1j * (bends[0] * u + bends[1] * u**2))
    way = np.concatenate([[0.0], np.cumsum(0.5 * (step[1:] + step[:-1]))])
    way = complex(*start) + way * (complex(*end) - complex(*start)) / way[-1]
    return np.column_stack([way.real, way.imag])
