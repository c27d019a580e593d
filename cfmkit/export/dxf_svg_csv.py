"""Outlines as files at real size, in millimetres: DXF R2010, SVG, and CSV of their exact points.

In DXF closed contours are one closed LWPOLYLINE each, arcs as bulges; whole circles are CIRCLEs. The same drawing gives
the same bytes: dates and identifiers are fixed. In SVG arcs are arcs (`A` commands), so that nothing is lost against
the DXF, and y points up. Points are one table per file: for CAD splines and for checking a finished part.
"""

from __future__ import annotations

import io
import math
import os
import sys
import tempfile
import threading
from contextlib import contextmanager
from functools import partial
from html import escape
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError, OutputError
from cfmkit.export.arc_outlines import Outline, flat_points
from cfmkit.export.contours import ENGRAVED_LAYER, LayerLook, check_name, looks
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import ModuleType

    from cfmkit.export.contours import Drawing, EngravedText


_UNITS_MILLIMETRES, _MEASUREMENT_METRIC = 4, 1
_COORDINATE_DIGITS = 9  # of coordinates [mm]: a picometre, the scale of rounding errors
_ALIGN_CENTER, _ALIGN_MIDDLE = 1, 2  # of texts, about their point
_EZDXF_LOCK = threading.Lock()


def dxf_bytes(drawn: Sequence[Outline], labels: Sequence[EngravedText] = ()) -> bytes:
    """Return outlines and engraved texts as DXF."""
    layers = looks([*(outline.layer for outline in drawn), *(ENGRAVED_LAYER for _ in labels)])
    with _EZDXF_LOCK, _fixed_dates(_import_ezdxf()) as ezdxf:
        document = ezdxf.new("R2010", units=_UNITS_MILLIMETRES)
        document.header["$MEASUREMENT"] = _MEASUREMENT_METRIC
        for name, look in layers.items():
            _add_layer(document, name, look)
        space = document.modelspace()
        for outline in drawn:
            _add_outline(space, outline)
        for label in labels:
            _add_label(space, label)
        _show_all(document, to_border(np.vstack([flat_points(outline.chain) for outline in drawn]), "length"))
        return _encode_document(document)


def _add_layer(document: Any, name: str, look: LayerLook) -> None:
    attributes: dict[str, object] = {"color": look.index}
    if look.dashes:
        signed = [length * (-1) ** index for index, length in enumerate(look.dashes)]
        document.linetypes.add(f"{name}-dashes", [sum(look.dashes), *signed])
        attributes["linetype"] = f"{name}-dashes"
    document.layers.add(name, **attributes)


def _add_outline(space: Any, outline: Outline) -> None:
    attributes = {"layer": outline.layer}
    if outline.circle:
        center, radius = (np.round(to_border(value, "length"), _COORDINATE_DIGITS) for value in outline.circle)
        space.add_circle((float(center.real), float(center.imag)), float(radius), dxfattribs=attributes)
        return
    nodes = np.round(to_border(outline.chain.nodes, "length"), _COORDINATE_DIGITS) + 0.0
    bulges = np.append(outline.chain.bulges, 0.0)
    vertices = zip(nodes.real.tolist(), nodes.imag.tolist(), bulges.tolist(), strict=True)
    kept = list(vertices)[:-1] if outline.closed else list(vertices)
    space.add_lwpolyline(kept, format="xyb", close=outline.closed, dxfattribs=attributes)


def _add_label(space: Any, label: EngravedText) -> None:
    x, y = (round(float(to_border(value, "length")), _COORDINATE_DIGITS) for value in label.at)
    look = {"layer": ENGRAVED_LAYER, "rotation": round(math.degrees(label.angle), _COORDINATE_DIGITS)}
    text = space.add_text(
        label.text, height=round(float(to_border(label.height, "length")), _COORDINATE_DIGITS), dxfattribs=look
    )
    text.dxf.halign, text.dxf.valign = _ALIGN_CENTER, _ALIGN_MIDDLE
    text.dxf.insert = text.dxf.align_point = (x, y)


def _show_all(document: Any, points: Any) -> None:
    """Set the extents of a DXF document and its first view to all points."""
    low, high = np.round(points.min(axis=0), _COORDINATE_DIGITS), np.round(points.max(axis=0), _COORDINATE_DIGITS)
    document.modelspace().reset_extents((*low.tolist(), 0.0), (*high.tolist(), 0.0))
    height = 1.1 * max(*(high - low).tolist(), 1.0)
    document.set_modelspace_vport(height=height, center=tuple(((low + high) / 2).tolist()))


def _encode_document(document: Any) -> bytes:
    # ezdxf collects the classes in a set, whose order differs between processes
    document.classes.add_required_classes(document.dxfversion)
    for key in sorted(document.classes.classes):
        document.classes.classes.move_to_end(key)
    text = io.StringIO()
    document.write(text)
    return bytes(document.encode(text.getvalue()))


@contextmanager
def _fixed_dates(ezdxf: ModuleType) -> Iterator[ModuleType]:
    """Have ezdxf write fixed dates and identifiers."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield ezdxf
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def _import_ezdxf() -> ModuleType:
    """Import ezdxf without a scan of all fonts and a cache in the home folder.

    It does both on import, unless it finds that cache. We draw no text: an empty one will
    do, in a folder that is gone afterwards. Call this with the lock held.
    """
    if "ezdxf" not in sys.modules:
        try:
            with tempfile.TemporaryDirectory(prefix="cfmkit-") as folder:
                cache = Path(folder) / "ezdxf" / "font_manager_cache.json"
                cache.parent.mkdir()
                cache.write_text('{"version": 2, "font-faces": []}', encoding="utf-8")
                with _set_environment("XDG_CACHE_HOME", folder):
                    import_module("ezdxf")
        except OSError as error:
            raise OutputError(f"DXF needs a temporary folder for a moment: {error}; set TMPDIR to one") from error
    return import_module("ezdxf")


@contextmanager
def _set_environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


_DRAWING_MARGIN = 5.0  # around the drawing [mm]
_STROKE_WIDTH = 0.25  # width of every line [mm]


def svg_bytes(name: str, drawn: Sequence[Outline], labels: Sequence[EngravedText] = ()) -> bytes:
    """Return outlines and engraved texts as SVG 1.1 at real size."""
    points = to_border(np.vstack([flat_points(outline.chain) for outline in drawn]), "length")
    digits = _coordinate_digits(float(np.ptp(points, axis=0).max()))
    shape = partial(_svg_shape, digits=digits)
    (left, low), (right, high) = points.min(axis=0) - _DRAWING_MARGIN, points.max(axis=0) + _DRAWING_MARGIN
    width, height = _svg_text(right - left), _svg_text(high - low)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" width="{width}mm" height="{height}mm"'
        f' viewBox="{_svg_text(left)} {_svg_text(-high)} {width} {height}">'
    )
    title = check_name(name, "drawing")
    layers = [
        line
        for layer, look in looks(outline.layer for outline in drawn).items()
        for line in _svg_group(layer, look, [shape(outline) for outline in drawn if outline.layer == layer])
    ]
    layers += _svg_labels(labels)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', head, f"<title>{title}</title>", *layers, "</svg>", ""]
    return "\n".join(lines).encode()


def _svg_group(layer: str, look: LayerLook, members: Sequence[str]) -> list[str]:
    dashes = f' stroke-dasharray="{" ".join(map(_svg_text, look.dashes))}"' if look.dashes else ""
    style = f'fill="none" stroke="{look.rgb}" stroke-width="{_svg_text(_STROKE_WIDTH)}" stroke-linejoin="round"{dashes}'
    return [f'<g id="{layer}" {style}>', *members, "</g>"] if members else []


def _svg_labels(labels: Sequence[EngravedText]) -> list[str]:
    """Return engraved texts, centred about their points; y is turned over, and with it the direction."""
    if not labels:
        return []
    placed = [
        f'<g id="{ENGRAVED_LAYER}" fill="{looks([ENGRAVED_LAYER])[ENGRAVED_LAYER].rgb}" '
        f'font-family="sans-serif" text-anchor="middle">'
    ]
    for label in labels:
        x, y, size = (float(to_border(value, "length")) for value in (*label.at, label.height))
        turn = f"translate({_svg_text(x)} {_svg_text(-y)}) rotate({_svg_text(-math.degrees(label.angle))})"
        # capitals are 0.7 of a font's size high
        look = f'y="{_svg_text(0.5 * size)}" font-size="{_svg_text(size / 0.7)}"'
        placed.append(f'<text transform="{turn}" {look}>{escape(label.text, quote=False)}</text>')
    return [*placed, "</g>"]


def _svg_shape(outline: Outline, digits: int) -> str:
    """Return one outline as a `circle` or a `path`; y is turned over, and with it the sense of every arc."""
    number = partial(_svg_text, digits=digits)
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


def _coordinate_digits(size: float) -> int:
    """Return with how many digits a drawing of a size [mm] is written: nanometres, finer below 10 mm."""
    return 6 + max(0, 1 - math.floor(math.log10(size))) if size > 0.0 else 6


def _svg_text(value: float, digits: int = 6) -> str:
    """Return millimetres without idle zeros."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def write_points(drawing: Drawing) -> dict[str, bytes]:
    """Return the drawing's tables as CSV with the header ``x [mm],y [mm],...``, by file name.

    Raises GeometryError if two tables have one name, or a name that no file can have.
    """
    from cfmkit.tables import Table, border_column, to_csv

    files: dict[str, bytes] = {}
    for table in drawing.tables:
        name = f"{check_name(table.name, 'table')}.csv"
        if name in files:
            raise GeometryError(f"the drawing {drawing.name!r} has two tables named {table.name!r}")
        columns = (border_column(key, values, dimension) for key, (values, dimension) in table.columns.items())
        files[name] = to_csv(Table(tuple(columns)))
    return files
