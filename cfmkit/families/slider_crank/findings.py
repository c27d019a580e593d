"""Everything a slider-crank can suffer from, by name.

The names are stable; the sentences say what the name means. The message that a
run reports carries the numbers that decide and the cure.
"""

from __future__ import annotations

from cfmkit.results import Finding
from cfmkit.units import format_short

FINDINGS = {
    "not_assemblable": "crank and coupler do not reach the slider's way, or not in the unloaded position",
    "coupler_dead_point": "the motion ends where the coupler stands across the slider's way",
    "out_of_reach": "the slider cannot travel as far as asked",
    "force_unbounded": "no finite force holds the slider where crank and coupler are in one line",
    "no_spring": "no spring acts on the mechanism",
}


def finding(name: str, message: str, *cures: str) -> Finding:
    """Return a finding of this family; the name must be one that `FINDINGS` explains."""
    if name not in FINDINGS:
        raise KeyError(name)
    return Finding(name, message, cures)


def deg(value: float) -> str:
    """Return an angle as the user reads it."""
    return format_short(value, "angle")


def mm(value: float) -> str:
    """Return a length as the user reads it."""
    return format_short(value, "length")
