"""The layers of a drawing, and how each looks in every file format."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Iterable


@dataclass(frozen=True)
class LayerLook:
    """Colour as AutoCAD index and as RGB, and the dashes [mm] of a line that nothing is cut along."""

    index: int
    rgb: str
    dashes: tuple[float, ...] = ()


_LAYER_LOOKS = {
    "cut": LayerLook(1, "#ff0000"),
    "path": LayerLook(150, "#007fff", (6.0, 1.5, 1.0, 1.5)),
    "reference": LayerLook(8, "#808080"),
}
HELD_LAYER, DRIVEN_LAYER = "held", "driven"
"""Layers of what stands while the mechanism works, and of what is moved: closed contours that nothing is cut along."""
ENGRAVED_LAYER = "engraved"  # layer of texts on the parts
_MARK_LOOKS = {HELD_LAYER: LayerLook(3, "#008000", (1.0, 1.0)), DRIVEN_LAYER: LayerLook(30, "#ff8000", (1.0, 1.0))}
_MARK_LOOKS[ENGRAVED_LAYER] = LayerLook(5, "#0000ff")
_OTHER_LOOKS = (LayerLook(6, "#ff00ff"), LayerLook(4, "#00a0a0"), LayerLook(34, "#995200"), LayerLook(92, "#408000"))


def looks(used: Iterable[str]) -> dict[str, LayerLook]:
    """Return the look of the three usual layers, of marks and of every other one in use, in that order."""
    used = list(dict.fromkeys(used))
    marks = {name: look for name, look in _MARK_LOOKS.items() if name in used}
    others = [name for name in used if name not in _LAYER_LOOKS | marks]
    for name in others:
        check_name(name, "layer")
    return _LAYER_LOOKS | marks | {name: _OTHER_LOOKS[index % len(_OTHER_LOOKS)] for index, name in enumerate(others)}


def check_name(name: str, what: str) -> str:
    """Return `name` if it can be part of a file name and of every format.

    Raises GeometryError if it cannot.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}", name):
        raise GeometryError(f"{name!r} cannot name a {what}: use letters, digits, '-', '_' and '.', at most 100")
    return name
