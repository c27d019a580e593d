"""A proposal whose lengths and angles have the digits that its process can hold, before it is judged.

What bends has a force proportional to its width and to the cube of its thickness: the width makes up for the rounding
of the thickness beside it. The window begins at a rounded place and is no shorter than the travel.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from cfmkit.specs.yamlio.path_notation import read_item_suffix
from cfmkit.studies.stock_and_digits import lengths_and_angles, round_to_digits

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.suggestion_request import Request
    from cfmkit.specs.spec import Spec

ROUNDED_BLOCKS = ("mechanism", "analysis", "design")
MOTION_UNITS = {"force": ("mm", 1e-3), "torque": ("deg", math.pi / 180.0)}
"""Kind of a request -> unit of its motion in files, and what that is in SI."""


def round_to_process(spec: Spec, request: Request, decimals: int) -> Spec:
    """Return a specification whose lengths and angles have so many decimals, in millimetres and degrees.

    Raises SpecError if values that have to agree no longer do.
    """
    written = dict(lengths_and_angles(spec.model_dump(mode="json", exclude_unset=True), ROUNDED_BLOCKS))
    rounded = {path: round_to_digits(text, decimals) for path, text in written.items()}
    rounded |= {
        path: round_to_digits(text, decimals) for path, text in _make_up_for_thickness(written, rounded).items()
    }
    rounded |= _ends_of_motion(written, request, decimals)
    changes = {path: text for path, text in rounded.items() if text != written[path]}
    return spec.replace(changes) if changes else spec


def _make_up_for_thickness(written: Mapping[str, str], rounded: Mapping[str, str]) -> dict[str, str]:
    """Return widths with which what bends is as stiff with rounded thicknesses as before, by their paths."""
    widths = {}
    for path, text in written.items():
        block, _, key = path.rpartition(".")
        beside = [item for item in written if item.removesuffix(read_item_suffix(item)) == f"{block}.thickness"]
        if key == "width" and beside:
            # tapered leaves are in series: their compliances add up
            before, after = (sum(_number(texts[item]) ** -3 for item in beside) for texts in (written, rounded))
            widths[path] = f"{_number(text) * after / before} mm"
    return widths


def _ends_of_motion(written: Mapping[str, str], request: Request, decimals: int) -> dict[str, str]:
    """Return the end of the window, and all lengths that are equal to it, rounded up to hold the travel."""
    start, end = (written.get(f"analysis.window.{number}") for number in (0, 1))
    if start is None or end is None:
        return {}
    unit, size = MOTION_UNITS[request.kind]
    begin, tick = _number(round_to_digits(start, decimals)), 10.0**-decimals
    last = begin + math.ceil(round(request.travel / size / tick, 6)) * tick
    return {path: round_to_digits(f"{last} {unit}", decimals) for path, text in written.items() if text == end}


def _number(text: str) -> float:
    return float(text.split()[0])
