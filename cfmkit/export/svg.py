"""SVG at real size: one millimetre in the drawing is one millimetre on paper, y pointing up.

Arcs are arcs (`A` commands), so that nothing is lost against the DXF.
"""

from __future__ import annotations

import math
from functools import partial
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.arc_outlines import Outline, flat_points
from cfmkit.export.layers import ENGRAVED_LAYER, LayerLook, check_name, looks
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.export.contours import EngravedText

_DRAWING_MARGIN = 5.0  # around the drawing [mm]
_STROKE_WIDTH = 0.25  # width of every line [mm]


def svg_bytes(name: str, drawn: Sequence[Outline], labels: Sequence[EngravedText] = ()) -> bytes:
    """Return outlines and engraved texts as SVG 1.1 at real size."""
    points = to_border(np.vstack([flat_points(outline.chain) for outline in drawn]), "length")
    digits = _digits(float(np.ptp(points, axis=0).max()))
    shape = partial(_shape, digits=digits)
    (left, low), (right, high) = points.min(axis=0) - _DRAWING_MARGIN, points.max(axis=0) + _DRAWING_MARGIN
    width, height = _text(right - left), _text(high - low)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" width="{width}mm" height="{height}mm"'
        f' viewBox="{_text(left)} {_text(-high)} {width} {height}">'
    )
    title = check_name(name, "drawing")
    layers = [
        line
        for layer, look in looks(outline.layer for outline in drawn).items()
        for line in _group(layer, look, [shape(outline) for outline in drawn if outline.layer == layer])
    ]
    layers += _texts(labels)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', head, f"<title>{title}</title>", *layers, "</svg>", ""]
    return "\n".join(lines).encode()


def _group(layer: str, look: LayerLook, members: Sequence[str]) -> list[str]:
    dashes = f' stroke-dasharray="{" ".join(map(_text, look.dashes))}"' if look.dashes else ""
    style = f'fill="none" stroke="{look.rgb}" stroke-width="{_text(_STROKE_WIDTH)}" stroke-linejoin="round"{dashes}'
    return [f'<g id="{layer}" {style}>', *members, "</g>"] if members else []


def _texts(labels: Sequence[EngravedText]) -> list[str]:
    """Return engraved texts, centred about their points; y is turned over, and with it the direction."""
    if not labels:
        return []
    found = [
        f'<g id="{ENGRAVED_LAYER}" fill="{looks([ENGRAVED_LAYER])[ENGRAVED_LAYER].rgb}" '
        f'font-family="sans-serif" text-anchor="middle">'
    ]
    for one in labels:
        x, y, size = (float(to_border(value, "length")) for value in (*one.at, one.height))
        turn = f"translate({_text(x)} {_text(-y)}) rotate({_text(-math.degrees(one.angle))})"
        # capitals are 0.7 of a font's size high
        look = f'y="{_text(0.5 * size)}" font-size="{_text(size / 0.7)}"'
        found.append(f'<text transform="{turn}" {look}>{escape(one.text, quote=False)}</text>')
    return [*found, "</g>"]


def _shape(outline: Outline, digits: int) -> str:
    """Return one outline as a `circle` or a `path`; y is turned over, and with it the sense of every arc."""
    number = partial(_text, digits=digits)
    if outline.circle:
        center, radius = (to_border(value, "length") for value in outline.circle)
        return f'<circle cx="{number(center.real)}" cy="{number(-center.imag)}" r="{number(radius)}"/>'
    nodes = to_border(outline.chain.nodes, "length")
    steps = [f"M {number(nodes[0].real)} {number(-nodes[0].imag)}"]
    for start, end, bulge in zip(nodes[:-1], nodes[1:], outline.chain.bulges.tolist(), strict=True):
        point = f"{number(end.real)} {number(-end.imag)}"
        if abs(bulge) * abs(end - start) < 10.0**-digits:
            steps.append(f"L {point}")
        else:
            radius = number(abs(end - start) * (1 + bulge**2) / (4 * abs(bulge)))
            steps.append(f"A {radius} {radius} 0 {int(abs(bulge) > 1)} {int(bulge < 0)} {point}")
    if outline.closed:
        steps[-1:] = ["Z"] if steps[-1].startswith("L") else [steps[-1], "Z"]
    return f'<path d="{" ".join(steps)}"/>'


def _digits(size: float) -> int:
    """Return with how many digits a drawing of a size [mm] is written: nanometres, finer below 10 mm."""
    return 6 + max(0, 1 - math.floor(math.log10(size))) if size > 0.0 else 6


def _text(value: float, digits: int = 6) -> str:
    """Return millimetres without idle zeros."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
