"""The file of a proposal: its digits, end stop, material, process and screws, and the block `design`.

Lengths and angles have the digits that its process can hold, before it is judged. What bends has a force proportional
to its width and to the cube of its thickness: the width makes up for the rounding of the thickness beside it. The
window begins at a rounded place and is no shorter than the travel.

A proposal that has to bear an overload has an end stop, rigid, a little behind the travel that is required. Before the
stop the curve is as it was. The analysis of the proposal ends at it, so that box and stress are those of all that the
mechanism can do, and what a load has above the mechanism's own force there is borne by the stop.

With the block `design` `cfmkit design` takes the file: widths and thicknesses of what bends move until the requirements
are met again, as after another material or force was written into it; a planar solid corrects them at the end. A cam
keeps the targets that it was designed for, a linkage with springs at its pins is given those of its own springs that
hold the effort.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError, SolutionError
from cfmkit.experiment.redrawn_values import MOST_CHANGE, section_paths
from cfmkit.export.fixing_holes_and_labels import NO_HOLES
from cfmkit.families.hardware import PartStrength, pin_for
from cfmkit.specs.units import Place, format_short
from cfmkit.specs.yamlio.paths import read_item_suffix
from cfmkit.stock.processes import PROCESSES_BY_NAME
from cfmkit.studies.stock_and_digits import lengths_and_angles, round_to_digits

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.base import Family
    from cfmkit.families.proposals import Request
    from cfmkit.results import Result
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


NO_END_STOP = "its mechanisms have no end stop, which an overload needs"


def add_end_stop(spec: Spec, request: Request) -> Spec:
    """Return a mechanism with its end stop; as it is if no overload is required.

    Raises SolutionError if it can have none.
    """
    window: Any = spec.get_value("analysis.window")
    if request.stated.overload is None or window is None:
        return spec
    changes = spec.end_stop_changes(round(float(window[1]) + request.stop_margin, 9))
    if not changes:
        raise SolutionError(NO_END_STOP)
    return spec.replace(changes)


def remove_end_stop(spec: Spec, request: Request) -> Spec:
    """Return a mechanism without the end stop that an overload needs: corrections look for windows behind it."""
    return spec if request.stated.overload is None else spec.replace({"mechanism.stops": {}})


def note_end_stop(request: Request, result: Result, depth: float | None) -> tuple[str, ...]:
    """Return what the end stop of an analysed mechanism of a depth [m] carries, in a sentence; empty without one.

    With it comes the pin that bears it, standing out of what holds the mechanism over all of its depth.
    """
    if request.stated.overload is None:
        return ()
    curve = result.curve
    carried = max(request.stated.overload - float(curve.effort[curve.motion.argmax()]), 0.0)
    place, load = format_short(request.stop_margin, "length"), format_short(request.stated.overload, "force")
    said = f"end stop, rigid, {place} behind the travel: it carries {format_short(carried, 'force', 3)} of {load}"
    if depth is None:
        return (f"{said}; its strength is not judged: the depth is not known",)
    mechanism = result.spec.get_value("mechanism")
    material = getattr(mechanism, "material", None) or getattr(getattr(mechanism, "contact", None), "material", None)
    strength = PartStrength.from_material(material, request.safety)
    pin, bears = pin_for(carried, 0.5 * depth, depth, strength, "metric")
    words = f"a steel pin of {format_short(pin, 'length')} that stands out by the depth"
    return (f"{said}: {words} bears it" if bears else f"{said}: more than {words} bears",)


USUAL_SCREWS = ("M4", "M3", "M2.5", "M2", "M1.6")  # screws that hold small parts, the first one that fits


def add_process_and_materials(spec: Spec, request: Request) -> Spec:
    """Return a specification whose material is as stated, and whose part says by which process it is made if one is.

    Its inside corners are as round as before, or as round as the process makes them: a smaller radius has more stress.
    """
    mechanism = spec.get_value("mechanism")
    owners = {"mechanism": mechanism, "mechanism.contact": getattr(mechanism, "contact", None)}
    for path, owner in owners.items():
        if (material := getattr(owner, "material", None)) is not None:
            block = material.model_dump(exclude_unset=True)
            if (stated := request.stated_material(block)) != block:
                spec = spec.replace({f"{path}.material": dict(stated)})
    if request.stated.process is None:
        return spec
    radius = PROCESSES_BY_NAME[request.stated.process].least_radius
    fillet = getattr(spec.get_value("mechanism"), "fillet", 0.0)
    changes: tuple[dict[str, Any], ...] = (
        {"mechanism.part.process": request.stated.process, "mechanism.part.fillet": max(radius, fillet)},
        {"mechanism.part.process": request.stated.process},
        {"mechanism.plate.process": request.stated.process},
    )
    for change in changes:
        try:
            return spec.replace(change)
        except CfmError:  # another kind of part
            continue
    return spec


def add_screws(record: Family, spec: Spec) -> Spec:
    """Return a part with holes for screws of usual sizes whose heads fit everywhere; without if none do."""
    if record.outline is None:
        return spec
    for screw in USUAL_SCREWS:
        try:
            fastened = spec.replace({"mechanism.part.screws": screw})
            drawing = record.outline(fastened)
        except CfmError:  # another kind of part, or none that can be cut
            return spec
        if not any(NO_HOLES in note for note in drawing.notes):
            return fastened
    return spec


def block_for_redesign(
    spec: Spec,  # as it was designed, its block `design` included
    request: Request,  # its thinnest leaf and its depth limit what moves
) -> Mapping[str, Any] | None:
    """Return the block `design` of a proposal; None if nothing of it may change."""
    paths = section_paths(spec)
    if paths:
        free = {path: _range(path, float(spec.get_value(path)), request) for path in paths}
        return {"free": free} | ({"verify": "solid"} if spec.fidelity == "solid" else {})
    block = getattr(spec, "design", None)
    if block is not None:
        stated: Mapping[str, Any] = block.model_dump(exclude_unset=True)
        return stated
    return _list_own_spring_targets(spec, request)


def _range(path: str, value: float, request: Request) -> tuple[str, str]:
    """Return between which lengths a width or a thickness may move, its own value included."""
    low, high = ends = value / MOST_CHANGE, value * MOST_CHANGE
    if path.endswith("width") and request.depth is not None:
        high = max(value, min(high, request.depth))
    if "thickness" in path:
        low = min(value, max(low, request.thinnest))
    # a limit that is the value, the depth or the thinnest leaf is written in full
    written = [format_short(end, "length", 3 if end in ends else 12) for end in (low, high)]
    return written[0], written[1]


def _list_own_spring_targets(spec: Spec, request: Request) -> Mapping[str, Any] | None:
    """Return the targets of a linkage, whose catalogue are the springs at its pins; None if it has none."""
    springs = getattr(spec.get_value("mechanism"), "springs", None)
    bought = getattr(springs, "bought", ())
    window: Any = spec.get_value("analysis.window")
    if not bought or window is None:
        return None
    motion, dimension = ("angle", "angle") if request.kind == "torque" else ("travel", "length")
    return {
        request.kind: request.target,
        motion: tuple(Place(float(end), dimension) for end in window),
        "springs": tuple(dict.fromkeys(spring.at for spring in bought)),
        "catalogue": tuple(_as_listed(spring) for spring in bought),
    }


def _as_listed(spring: Any) -> Mapping[str, Any]:
    """Return a spring at a pin as a catalogue lists it, in the number that it is built in."""
    wire = {} if spring.wound is None else spring.wound.model_dump(exclude_unset=True)
    stated = {"free_length": spring.free_length, "life": spring.life}
    listed = {"name": spring.name, "kind": spring.spring_type.kind, "counts": (spring.count,)}
    return wire | listed | {key: value for key, value in stated.items() if value is not None}
