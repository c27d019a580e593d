"""DXF R2010 in millimetres, for laser cutters, mills and CAD programs.

Closed contours are one closed LWPOLYLINE each, arcs as bulges; whole circles are
CIRCLEs. The same drawing gives the same bytes: dates and identifiers are fixed.
"""

from __future__ import annotations

import io
import math
import os
import sys
import tempfile
import threading
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import OutputError
from cfmkit.export.arc_outlines import Outline, flat_points
from cfmkit.export.layers import ENGRAVED_LAYER, LayerLook, looks
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import ModuleType

    from cfmkit.export.contours import EngravedText

_UNITS_MILLIMETRES, _MEASUREMENT_METRIC = 4, 1
_COORDINATE_DIGITS = 9  # of coordinates [mm]: a picometre, the scale of rounding errors
_ALIGN_CENTER, _ALIGN_MIDDLE = 1, 2  # of texts, about their point
_EZDXF_LOCK = threading.Lock()


def dxf_bytes(drawn: Sequence[Outline], labels: Sequence[EngravedText] = ()) -> bytes:
    """Return outlines and engraved texts as DXF."""
    layers = looks([*(outline.layer for outline in drawn), *(ENGRAVED_LAYER for _ in labels)])
    with _EZDXF_LOCK, _same_bytes(_ezdxf()) as ezdxf:
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
        return _encode(document)


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
    """Set the extents, and what a viewer shows first."""
    low, high = np.round(points.min(axis=0), _COORDINATE_DIGITS), np.round(points.max(axis=0), _COORDINATE_DIGITS)
    document.modelspace().reset_extents((*low.tolist(), 0.0), (*high.tolist(), 0.0))
    height = 1.1 * max(*(high - low).tolist(), 1.0)
    document.set_modelspace_vport(height=height, center=tuple(((low + high) / 2).tolist()))


def _encode(document: Any) -> bytes:
    # ezdxf collects the classes in a set, whose order differs between processes
    document.classes.add_required_classes(document.dxfversion)
    for key in sorted(document.classes.classes):
        document.classes.classes.move_to_end(key)
    text = io.StringIO()
    document.write(text)
    return bytes(document.encode(text.getvalue()))


@contextmanager
def _same_bytes(ezdxf: ModuleType) -> Iterator[ModuleType]:
    """Have ezdxf write fixed dates and identifiers."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield ezdxf
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def _ezdxf() -> ModuleType:
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
                with _environment("XDG_CACHE_HOME", folder):
                    import_module("ezdxf")
        except OSError as error:
            raise OutputError(f"DXF needs a temporary folder for a moment: {error}; set TMPDIR to one") from error
    return import_module("ezdxf")


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
