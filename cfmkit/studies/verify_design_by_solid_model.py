"""Designs that end with the part as drawn: solved as a solid, and corrected once so that its force is the wanted one.

A planar solid's force is proportional to its width. Where widths are free, all of them are multiplied by what the force
misses; the stress stays as it is. Where a sheet fixes them, the force that is designed for is multiplied by it, and the
design is repeated.

Under a load both move as far as they give way: their forces are compared at the same travel, so that the corrected part
moves as far under its load as the beams do.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.reported_values_of_finished_design import search_values
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.metrics import evaluate, mean_effort, window_of
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

FIDELITY_KEY = "analysis.fidelity"
WIDTH_DIGITS = 7  # significant ones of a corrected width: a tenth of a micrometre in a metre
AT_END = {"design.rescale.force": "nominal_force"}
"""Levels that are no mean over the window, but the force at its end; and the metric that is compared."""


def verify_by_solid(given: Spec, design: Design, run: Run) -> Design:
    """Return a design that ends with its part as a solid, whose force is the wanted one: the mean, or that at the end.

    Parameters
    ----------
    given : Spec
        With `design.verify`.
    design : Design
        What the family made of it; returned as it is where there is none.
    run : Run
        Seed, progress, time budget.

    Returns
    -------
    Design
        Its specification has `analysis.fidelity: solid`. INVALID where the design cannot be a solid, INFEASIBLE where a
        corrected width is not in its range, PARTIAL or NO_EQUILIBRIUM where the solid cannot be followed to the end.
    """
    if design.spec is None:
        return design
    record = family(given.family)
    try:
        as_solid = design.spec.replace({FIDELITY_KEY: "solid"})
    except SpecError as error:
        reported = "; ".join(problem.message for problem in error.problems)
        return Design(None, Status.INVALID, f"design.verify: this design cannot be analysed as a solid: {reported}")
    beams = record.analyze(design.spec, run)
    solid = record.analyze(as_solid, run)
    levels = record.design.levels if record.design else ()
    path = next((path for path in levels if _level(given, path)), None)
    own, found, where = _values(beams, solid, AT_END[path]) if path in AT_END else _means(beams, solid)
    wanted = own if path is None else math.copysign(_level(given, path), own or 0.0)
    if solid.status is not Status.COMPLETE or not wanted or not found or not own or wanted / found <= 0:
        reported = f"the part as a solid has no force that could be corrected: {solid.message}"
        return replace(design, spec=as_solid, notes=(*design.notes, ("verify", reported)))
    factor = wanted / found
    kind = solid.curve.kind
    mean, which = ("", f"force{where}") if path in AT_END else ("mean ", "mean force")
    begun = (
        f"{design.spec.fidelity} has a {mean}{kind} of {format_short(own, kind)}, the part as a solid of "
        f"{format_short(found, kind)} ({100 * (found / own - 1):+.2g} %){where}"
    )
    if _sheet(as_solid):
        return _relevel(given, design, as_solid, path, factor, begun, run)
    corrected = {path: float(f"{factor * width:.{WIDTH_DIGITS}g}") for path, width in _widths(as_solid).items()}
    outside = _explain_outside(given, design.spec, corrected)
    if outside is not None:
        return outside
    reported = "; ".join(
        f"{path} {format_short(width, 'length')} -> {format_short(corrected[path], 'length', 6)}"
        for path, width in _widths(as_solid).items()
    )
    made = as_solid.replace(corrected)
    aim = format_short(wanted, kind)
    note = f"{begun}; all widths are multiplied by {factor:.5g}, so that the solid has {aim}: {reported}"
    numbers = {
        "verified_target": (wanted, kind, f"requested {which} of the part as a solid"),
        "verified_before": (own, kind, f"{which} of the design by its own model"),
        "verified_solid_before": (found, kind, f"{which} of the part as a solid, before its correction"),
        "verified_width_factor": (factor, "ratio", "factor by which all widths were multiplied"),
    }
    about = search_values(numbers, "solid", solid.travel or (0.0, 0.0), made.motion or "length")
    return replace(design, spec=made, search={**design.search, **about}, notes=(*design.notes, ("verify", note)))


def _relevel(
    given: Spec, design: Design, as_solid: Spec, path: str | None, factor: float, begun: str, run: Run
) -> Design:
    """Return a design of another force, whose solid has the wanted one: the widths are those of the sheet."""
    if path is None:
        reported = f"{begun}; the sheet fixes the widths and the design states no force: no correction is made"
        return replace(design, spec=as_solid, notes=(*design.notes, ("verify", reported)))
    wanted = _level(given, path)
    method = family(given.family).design
    assert method is not None
    again = method.make(given.replace({path: factor * wanted}), run)
    if again.spec is None:
        return replace(again, message=f"design.verify: for a solid of {format_short(wanted, 'force')}, {again.message}")
    # what is wanted stays what is wanted
    made = again.spec.replace({path: wanted, FIDELITY_KEY: "solid"})
    other, aim = format_short(factor * wanted, "force", 5), format_short(wanted, "force")
    note = f"{begun}; the sheet fixes the widths, so it is designed for {other} instead of {aim}"
    if (
        getattr(given.get_value("design"), "yield", None) is not None
    ):  # these are judged by requirements about what is wanted
        note += "; the margins of design.yield are not repeated for that force"
    return replace(again, spec=made, notes=(*again.notes, ("verify", note)))


def _values(beams: Result, solid: Result, name: str) -> tuple[float | None, float | None, str]:
    """Return the forces of both at the end of the window, and that they are those there."""
    own, found = (evaluate(one, [name])[name].value if one.curves else None for one in (beams, solid))
    return own, found, " at the end of the window"


def _means(beams: Result, solid: Result) -> tuple[float | None, float | None, str]:
    """Return the mean forces or torques of both, and over which travel where that is not their window."""
    if not beams.curves or not solid.curves or np.allclose(beams.travel or 0.0, solid.travel or 0.0, rtol=1e-9):
        return mean_effort(beams), mean_effort(solid), ""
    far = min(abs(float(one.curve.motion[-1])) for one in (beams, solid))
    window = window_of(beams)
    low, high = sorted((abs(window.lo), abs(window.hi))) if window is not None else (0.0, far)
    reported = format_short(min(high, far), solid.spec.motion or "length")
    over = f" over the travel up to {reported}, which both reach"
    return _mean_over_travel(beams, low, min(high, far)), _mean_over_travel(solid, low, min(high, far)), over


def _mean_over_travel(result: Result, low: float, high: float) -> float | None:
    """Return the mean over a travel of either sign [m or rad], whatever points the curve has; None if it turns back."""
    from scipy.interpolate import PchipInterpolator

    motion, effort = np.abs(result.curve.motion), result.curve.effort
    if not (np.diff(motion) > 0).all() or low >= high:
        return None
    return float(PchipInterpolator(motion, effort).integrate(low, high)) / (high - low)


def _widths(spec: Spec) -> Mapping[str, float]:
    return {f"mechanism.{key}": float(width) for key, width in spec.out_of_plane_widths.items() if width is not None}


def _sheet(spec: Spec) -> bool:
    try:
        return spec.get_value("mechanism.part.sheet") is not None
    except KeyError:
        return False


def _level(spec: Spec, path: str) -> float:
    try:
        return float(spec.get_value(path) or 0.0)
    except KeyError:
        return 0.0


def _explain_outside(given: Spec, designed: Spec, corrected: Mapping[str, float]) -> Design | None:
    """Return why there is no design, where a corrected width is not in the range that it is designed in."""
    for path, (low, high) in family(given.family).free(given, designed).items():
        if path in corrected and not low * (1 - 1e-9) <= corrected[path] <= high * (1 + 1e-9):
            reported = (
                f"design.verify: for the requested force of the solid {path} would be "
                f"{format_short(corrected[path], 'length')}, outside its range of {format_short(low, 'length')} to "
                f"{format_short(high, 'length')}"
            )
            return Design(None, Status.INFEASIBLE, reported)
    return None
