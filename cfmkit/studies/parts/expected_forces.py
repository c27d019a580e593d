"""The test plan in one sentence: what to make, what to measure on it, and what force to expect where, of 95 % of parts.

Forces are linear estimates of parts drawn from `design.tolerances`, or from what the process is assumed to hold.
The dimensions are those whose errors move the force most: what is worth measuring before the force is looked at. What
is no dimension and moves it as much, a modulus or the rate of a spring, is named beside them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.metrics import window_of
from cfmkit.specs.units import format_short
from cfmkit.studies.parts.near_parts import N_DRAWN, Unknown, efforts_of_parts
from cfmkit.studies.parts.parts import Parts

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result

NAMED_PARTS_SHARE = 0.95  # share of parts whose forces are named
MAX_NAMED_DIMENSIONS = 3  # how many dimensions are named: more are not measured
SIZE_DIMENSIONS = ("length", "angle")  # what a dimension is measured in


def expected_forces(result: Result, run: Run) -> str:
    """Return the sentence; empty of a part of whose errors nothing is known, or that cannot be followed."""
    if not result.curves:
        return ""
    try:
        parts, whence = Parts.from_expected_errors(result.spec, run.seed)
        if parts is None:
            return ""
        places = _places(result)
        near = efforts_of_parts(parts, places, result.curve.branches[0], run)
    except (CfmError, Unknown):
        return ""
    errors = parts.draw(N_DRAWN) - parts.nominal
    low, high = np.quantile(
        near.numbers(errors), ((1.0 - NAMED_PARTS_SHARE) / 2.0, (1.0 + NAMED_PARTS_SHARE) / 2.0), axis=0
    )
    weight = (np.abs(near.by_error) * errors.std(axis=0)).sum(axis=0)
    curve = result.curve
    at = [format_short(place, curve.motion_dimension) for place in places]
    ends = [[format_short(force, curve.kind, 3) for force in one] for one in zip(near.middle, low, high, strict=True)]
    expected = [
        f"{force} at {place} ({least.partition(' ')[0]} to {most})"
        for place, (force, least, most) in zip(at, ends, strict=True)
    ]
    make = "make the part in geometry/" if family(result.spec.family).outline else "make the part"
    verb = "displace to" if curve.motion_dimension == "length" else "turn to"
    return (
        f"{make}, {_to_measure(parts, weight)}, {verb} {_list_names(at)}, and expect {_list_names(expected)}: "
        f"each range holds for {100 * NAMED_PARTS_SHARE:.0f} % of parts {whence} (linear estimate)"
    )


def _to_measure(parts: Parts, weight: FloatArray) -> str:
    """Return what to measure, of parameters that move the force by `weight` (d,): the first few dimensions.

    Then what else is among as many of all parameters.
    """
    order = [int(k) for k in np.argsort(-weight) if weight[k] > 0]
    sizes = [k for k in order if parts.parameters[k].dimension in SIZE_DIMENSIONS][:MAX_NAMED_DIMENSIONS]
    others = [k for k in order[:MAX_NAMED_DIMENSIONS] if parts.parameters[k].dimension not in SIZE_DIMENSIONS]
    reported = [f"measure {_list_names([_dimension(parts, k) for k in sizes])}"] if sizes else []
    if others:
        reported.append(f"determine {_list_names([_name_parameter(parts, k) + ' in the design)' for k in others])}")
    return ", ".join(reported)


def _dimension(parts: Parts, k: int) -> str:
    """Return a dimension with its drawn value, as ``bistable.thickness (1.01 mm as drawn)``."""
    parent, _, last = parts.paths[k].rpartition(".")
    thickness = getattr(parts.spec.get_value(parent), "thickness", None)
    if last != "offset" or thickness is None:
        return f"{_name_parameter(parts, k)} as drawn)"
    # an error of all thicknesses is nothing that is drawn
    ends = (min(thickness), max(thickness)) if isinstance(thickness, tuple) else (thickness,)
    reported = " to ".join(format_short(end, "length") for end in ends)
    return f"{parent.removeprefix('mechanism.')}.thickness ({reported} as drawn)"


def _name_parameter(parts: Parts, k: int) -> str:
    """Return the name and the value of a parameter, the bracket still open."""
    value = format_short(float(parts.nominal[k]), parts.parameters[k].dimension)
    return f"{parts.paths[k].removeprefix('mechanism.')} ({value}"


def _list_names(items: list[str]) -> str:
    return ", ".join(items[:-1]) + (" and " if len(items) > 1 else "") + items[-1]


def _places(result: Result) -> FloatArray:
    """Return the two ends of the window, or the middle and the end of the travel."""
    found, motion = window_of(result), result.curve.motion
    least, most = float(motion.min()), float(motion.max())
    return np.array([found.lo, found.hi] if found else [0.5 * (most + least), most if most > 0.0 else least])
