"""The block `design` of a proposal, with which `cfmkit design` takes its file.

Widths and thicknesses of what bends move until the requirements are met again, as after another material or force was
written into the file; a planar solid corrects them at the end. A cam keeps the targets that it was designed for, a
linkage with springs at its pins is given those of its own springs that hold the effort.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.experiment.redrawn_values import MOST_CHANGE, section_paths
from cfmkit.specs.units import Place, format_short

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.suggestion_request import Request
    from cfmkit.specs.spec import Spec


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
    known = {"free_length": spring.free_length, "life": spring.life}
    listed = {"name": spring.name, "kind": spring.kind, "counts": (spring.count,)}
    return wire | listed | {key: value for key, value in known.items() if value is not None}
