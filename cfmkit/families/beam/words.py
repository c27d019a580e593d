"""What the engine says, with places of the drive and lengths as a user reads them: the engine knows SI numbers only."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.families.beam.build import Assembly

_NUMBER = r"(-?\d[\d.]*(?:e[+-]?\d+)?)"
_PLACE = re.compile(rf"\b(at|near) {_NUMBER}(?![\d.e]| of )")  # not a share: "lost at 0.4 of the constant loads"
_LENGTH = re.compile(rf"{_NUMBER} m\b")
_DIMENSIONS = {"displacement": "length", "rotation": "angle", "force": "force", "moment": "torque"}


def percent(share: float) -> str:
    """Return a share as a reader wants it, to three digits.

    Examples
    --------
    >>> percent(0.025512)
    '2.55 %'
    """
    return format_short(share, "ratio", 3)


def drive_text(assembly: Assembly, value: float) -> str:
    """Return a value of the drive [SI, of one copy] as the user reads it, of all copies together."""
    kind = assembly.spec.mechanism.drive.kind
    if kind == "loads":
        return f"{value:.5g} times the loads"
    unit = assembly.parallel if kind in ("force", "moment") else 1
    return format_short(unit * value, _DIMENSIONS[kind])


def in_units(assembly: Assembly, text: str) -> str:
    """Return a sentence of the engine with units."""
    text = _LENGTH.sub(lambda found: format_short(float(found[1]), "length"), text)
    return _PLACE.sub(lambda found: f"{found[1]} {drive_text(assembly, float(found[2]))}", text)
