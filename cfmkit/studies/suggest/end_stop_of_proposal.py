"""The end stop of a proposal that has to bear an overload: rigid, a little behind the travel that is required.

Before the stop the curve is as it was. The analysis of the proposal ends at it, so that box and stress are those of all
that the mechanism can do, and what a load has above the mechanism's own force there is borne by the stop.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.errors import SolutionError
from cfmkit.families.hardware import PartStrength, pin_for
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.families.suggestion_request import Request
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

NO_END_STOP = "its mechanisms have no end stop, which an overload needs"


def add_end_stop(spec: Spec, request: Request) -> Spec:
    """Return a mechanism with its end stop; as it is if no overload is required.

    Raises SolutionError if it can have none.
    """
    window: Any = spec.get_value("analysis.window")
    if request.overload is None or window is None:
        return spec
    changes = spec.end_stop_changes(round(float(window[1]) + request.stop_margin, 9))
    if not changes:
        raise SolutionError(NO_END_STOP)
    return spec.replace(changes)


def remove_end_stop(spec: Spec, request: Request) -> Spec:
    """Return a mechanism without the end stop that an overload needs: corrections look for windows behind it."""
    return spec if request.overload is None else spec.replace({"mechanism.stops": {}})


def note_end_stop(request: Request, result: Result, depth: float | None) -> tuple[str, ...]:
    """Return what the end stop of an analysed mechanism of a depth [m] carries, in a sentence; empty without one.

    With it comes the pin that bears it, standing out of what holds the mechanism over all of its depth.
    """
    if request.overload is None:
        return ()
    curve = result.curve
    carried = max(request.overload - float(curve.effort[curve.motion.argmax()]), 0.0)
    place, load = format_short(request.stop_margin, "length"), format_short(request.overload, "force")
    said = f"end stop, rigid, {place} behind the travel: it carries {format_short(carried, 'force', 3)} of {load}"
    if depth is None:
        return (f"{said}; its strength is not judged: the depth is not known",)
    mechanism = result.spec.get_value("mechanism")
    material = getattr(mechanism, "material", None) or getattr(getattr(mechanism, "contact", None), "material", None)
    strength = PartStrength.from_material(material, request.safety)
    pin, bears = pin_for(carried, 0.5 * depth, depth, strength, "metric")
    words = f"a steel pin of {format_short(pin, 'length')} that stands out by the depth"
    return (f"{said}: {words} bears it" if bears else f"{said}: more than {words} bears",)
