"""Requirements that a proposal's file keeps, those that no model here can judge, and those missed, in words.

Every number of a request becomes a requirement on a metric, so that `cfmkit analyze` of the file says the same as the
search. What a request asks for and nothing is known of, as the life of a material without fatigue data, is no
requirement: the proposal says that it was not judged, and does not meet the request. A yield is that of many
parts: it stands in the block `sensitivity`, as `min_yield`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.families.base import ENVELOPE_METRICS
from cfmkit.metrics import evaluate
from cfmkit.specs.units import format_short
from cfmkit.stock.processes import finest_process
from cfmkit.studies.stock_and_digits import is_leaf

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cfmkit.families.base import BoundingBox
    from cfmkit.families.proposals import Request
    from cfmkit.metrics import Definition
    from cfmkit.results import Quantity, Result
    from cfmkit.specs.spec import Spec


ADJUSTMENT_TOL = 0.025
"""How far the mean may be from an end of the adjustment: as far as from a force that is required as a number."""
STRAIGHT_LINKS = "1 %"  # largest elastic turn of a link over that of its spring: models of links take them for rigid
LIFE_METRICS = ("fatigue_life", "spring_life")
"""Metrics that say how many cycles the material, and bought springs, last."""


def windows_of(spec: Spec, request: Request) -> tuple[dict[str, Any], ...]:
    """Return a requirement over the motion in which a part has to bear its stress.

    Solids are solved at the ends of the windows of all requirements: with this one they are those of the finished file.
    """
    return ({"metric": "safety_factor", "min": f"{request.safety:.12g}", "over": stressed_motion(request, spec)},)


def list_requirements(
    request: Request,
    result: Result,  # an analysis of the mechanism: only what it has metrics for is required
    space: BoundingBox | None,  # the box that it stays in
    values: Iterable[Definition],  # of the scalar results of its family
) -> tuple[dict[str, Any], ...]:
    """Return the requirements that say what is required of a mechanism.

    They are over the window of its analysis; stress and fatigue life over all motion that it has to bear.
    """
    quantities = evaluate(result, None, None, values)
    return (
        *_require_effort(request),
        *_require_stress(request, result, quantities),
        *_require_box(request, space),
        *_require_loss(request, result),
        *_require_lives(request, result, quantities),
        *_require_adjustment(request, quantities),
    )


def list_unjudged(request: Request, result: Result) -> Iterator[str]:
    """Yield what is required and no model here can judge, each with the reason."""
    quantities = evaluate(result)
    if request.hysteresis is not None and "unload" not in result.curve.branches:
        yield f"hysteresis not judged: no loss factor is known of {_name_material(result)}"
    if request.stated.cycles is not None:
        yield from _list_unknown_lives(result, quantities)
    if request.adjustable is not None and "adjusted_force_min" not in quantities:
        yield "adjustment not judged: the model does not know its ends"
    names = {warning.name for warning in result.warnings}
    if "sharp_corners" in names:
        yield "stress not judged: inside corners are sharp"
    if "mesh_coarse" in names:
        yield "force and stress not judged: the mesh is too coarse"
    if _bends(result) and result.allowable_stress is None:
        yield f"stress not judged: no strength is known of {_name_material(result)}"
    contact = getattr(result.spec.get_value("mechanism"), "contact", None)
    if contact is not None and contact.material.yield_strength is None:
        yield f"contact pressure not judged: no strength is known of {_name_material(result)}"


def list_misses_within_mesh_error(request: Request, result: Result, values: Iterable[Definition]) -> Iterator[str]:
    """Yield what is missed if the largest stress of a solid is as much larger as its mesh may be off."""
    quantities = evaluate(result, None, None, values)
    factor, error = (_value_of(quantities, name) for name in ("safety_factor", "mesh_stress_error"))
    if factor is not None and error is not None and factor / (1.0 + error) < request.safety <= factor:
        least = factor / (1.0 + error)
        off = f"{100.0 * error:.2g} %"
        yield f"safety {factor:.3g} is {least:.3g} if the mesh is {off} off, required >= {request.safety:g}"


def stressed_motion(request: Request, spec: Spec) -> tuple[str, str]:
    """Return over what a mechanism has to bear its stress: all it does; of made parts from half of the run-in on.

    A made part begins and ends a little before or after the perfect one: a metric over all that this does has no value.
    """
    window: Any = spec.get_value("analysis.window")
    if request.stated.min_yield is None or window is None or request.kind == "torque":
        return "0 %", "100 %"
    end = "100 %" if request.stated.overload is not None else format_short(float(window[1]), "length", 12)
    return format_short(0.5 * float(window[0]), "length", 12), end  # an end stop is where it is for all parts


def _percent_text(value: float) -> str:
    return f"{100.0 * value:.12g} %"


def _value_of(quantities: Mapping[str, Quantity], name: str) -> float | None:
    return quantities[name].value if name in quantities else None


def _require_effort(request: Request) -> Iterator[dict[str, Any]]:
    yield {"metric": f"{request.kind}_ripple", "max": _percent_text(request.ripple)}
    low, high = (format_short(value, request.kind, 12) for value in (request.low, request.high))
    if request.banded:
        yield {"metric": f"{request.kind}_min", "min": low}
        yield {"metric": f"{request.kind}_max", "max": high}
    else:
        yield {"metric": f"{request.kind}_mean", "min": low, "max": high}


def _require_stress(request: Request, result: Result, quantities: Mapping[str, Quantity]) -> Iterator[dict[str, Any]]:
    least = f"{request.safety:.12g}"
    if _value_of(quantities, "safety_factor") is not None:
        yield {"metric": "safety_factor", "min": least, "over": stressed_motion(request, result.spec)}
    if _value_of(quantities, "link_safety_factor") is not None:
        yield {"metric": "link_safety_factor", "min": least}
        yield {"metric": "link_turn_share_max", "max": STRAIGHT_LINKS}
    if _value_of(quantities, "spring_safety_factor") is not None:
        yield {"metric": "spring_safety_factor", "min": least}


def _require_box(request: Request, space: BoundingBox | None) -> Iterator[dict[str, Any]]:
    if space is None:
        return
    width, height, depth = space.sides
    across, along = request.envelope[:2]
    limits = (along, across) if space.sideways else (across, along)
    if request.kind == "torque":  # what turns may lie either way in the plane
        limits = (max(limits), min(limits)) if width >= height else (min(limits), max(limits))
    sides = [*limits, *((request.depth,) if request.depth is not None and depth is not None else ())]
    for name, most in zip(ENVELOPE_METRICS, sides, strict=False):
        yield {"metric": name, "max": format_short(most, "length", 12)}


def _require_loss(request: Request, result: Result) -> Iterator[dict[str, Any]]:
    if request.hysteresis is not None and "unload" in result.curve.branches:
        lost = request.hysteresis * request.target * request.travel
        yield {"metric": "hysteresis_area", "max": format_short(lost, "energy", 12)}


def _require_lives(request: Request, result: Result, quantities: Mapping[str, Quantity]) -> Iterator[dict[str, Any]]:
    if (cycles := request.stated.cycles) is None:
        return
    if _bends(result) and "fatigue_life" in quantities and getattr(_block(result.spec), "fatigue", None) is not None:
        yield {"metric": "fatigue_life", "min": f"{cycles}", "over": stressed_motion(request, result.spec)}
    if _value_of(quantities, "spring_life") is not None:
        yield {"metric": "spring_life", "min": f"{cycles}"}


def _list_unknown_lives(result: Result, quantities: Mapping[str, Quantity]) -> Iterator[str]:
    wired = "wire_stress_max" in quantities or _has_springs(result.spec)
    links = "link_safety_factor" in quantities
    if (_bends(result) or links) and getattr(_block(result.spec), "fatigue", None) is None:
        yield f"life not judged: no S-N data for {_name_material(result)}"
    elif _bends(result) and "fatigue_life" not in quantities:
        yield "life not judged: no model of the fatigue of its contact"
    if wired and _value_of(quantities, "spring_life") is None:
        yield "life not judged: no S-N data for the wire of its springs"
    if not (_bends(result) or links or wired):
        yield "life not judged: no stress of its parts is modelled"


def _bends(result: Result) -> bool:
    """Return True if the model knows the stress of a part that bends."""
    return "max_stress" in result.curve.extra


def _has_springs(spec: Spec) -> bool:
    """Return True if a mechanism is driven by bought springs."""
    springs = getattr(spec.get_value("mechanism"), "springs", None)
    return springs is not None and any(getattr(springs, name, None) for name in ("stiffness", "rates", "wound"))


def _block(spec: Spec) -> Any:
    """Return the material of a mechanism, or of its contact."""
    mechanism = spec.get_value("mechanism")
    return getattr(mechanism, "material", None) or getattr(getattr(mechanism, "contact", None), "material", None)


def _name_material(result: Result) -> str:
    return getattr(_block(result.spec), "name", None) or "its material"


def _require_adjustment(request: Request, quantities: Mapping[str, Quantity]) -> Iterator[dict[str, Any]]:
    if request.adjustable is None or "adjusted_force_min" not in quantities:
        return
    low, high = request.adjustable
    yield {"metric": "adjusted_force_min", "max": format_short(low * (1.0 + ADJUSTMENT_TOL), "force", 12)}
    yield {"metric": "adjusted_force_max", "min": format_short(high * (1.0 - ADJUSTMENT_TOL), "force", 12)}
    yield {"metric": "adjusted_ripple_max", "max": _percent_text(request.ripple)}


LENGTH_RTOL = 1e-9  # on lengths that are compared: what writing a number down does to its last digit
METRIC_TOPICS = {
    "ripple": "ripple", "safety": "stress", "life": "life", "hysteresis": "hysteresis", "adjusted": "adjustment",
    "link_turn": "stiffness",
}  # fmt: skip
"""Parts of names of metrics, and what a requirement on them is about; all others are about the force."""
DISQUALIFYING_FINDINGS = {
    "stress": ("overstressed", "surface_stress_exceeded", "bearing_overloaded"),
    "springs": (
        "spring_overstretched", "spring_buckles", "spring_binds_on_pin", "spring_slack", "spring_closed",
        "joint_overrotated",
    ),
    "force": ("lift_off", "tip_jams", "tip_lifts_off", "force_negative"),
    "stability": ("unstable", "unstable_branch", "asymmetric_buckling", "out_of_plane_buckling"),
    "clearance": ("parts_touch", "rollers_collide", "flanks_collide", "beams_touch", "meets_itself"),
    "drawing": ("part_not_drawn", "joined_away_from_nodes"),
}  # fmt: skip
"""Warnings of an analysis with which a mechanism is no proposal, whatever its numbers say, by what they are about."""


def topic_of(metric: str) -> str:
    """Return what a requirement on a metric is about, in a word.

    Examples
    --------
    >>> topic_of("force_ripple"), topic_of("link_safety_factor"), topic_of("force_mean")
    ('ripple', 'stress', 'force')
    """
    return next((topic for part, topic in METRIC_TOPICS.items() if part in metric), "force")


def disqualifying(result: Result) -> Iterator[tuple[str, str]]:
    """Yield topic and sentence of every warning with which a mechanism is no proposal."""
    for topic, names in DISQUALIFYING_FINDINGS.items():
        yield from (
            (topic, f"{warning.name}: {warning.message}") for warning in result.warnings if warning.name in names
        )


def largest_force(request: Request, result: Result) -> float:
    """Return the largest mean of all branches, or of a band the largest force [N or N m]."""
    name = f"{request.kind}_{'max' if request.banded else 'mean'}"
    values = [quantity.value for key, quantity in evaluate(result).items() if key.partition("[")[0] == name]
    return max((value for value in values if value is not None), default=0.0)


def raised_out(request: Request, force: float, share: float) -> list[str]:
    """Return whether the stiffening of wide beams takes a force out of its band, in a sentence if it does."""
    most = (1.0 + share) * force
    if most <= request.high * (1.0 + LENGTH_RTOL):
        return []
    texts = [format_short(value, request.kind) for value in (force, most, request.high)]
    return [f"wide_beam: the {request.kind} is between {texts[0]} and {texts[1]}, allowed <= {texts[2]}"]


def sides_outside(request: Request, space: BoundingBox | None) -> Iterator[str]:
    """Yield by which sides a mechanism leaves the envelope; one that turns may lie either way in the plane."""
    if space is None:
        yield "the envelope that it needs is not known"
        return
    sides = [space.across, space.along]
    envelope = list(request.envelope[:2])
    if request.kind == "torque":
        sides, envelope = sorted(sides), sorted(envelope)
    for name, need, have in zip(("across the travel", "along the travel"), sides, envelope, strict=True):
        if need > have * (1.0 + LENGTH_RTOL):
            needed, given_side = _format_apart(need, have)
            yield f"needs {needed} {name}: {given_side} given"
    if request.depth is not None and space.depth is None:
        yield f"its depth is not known: {space.assumed}"
    elif request.depth is not None and space.depth is not None and space.depth > request.depth * (1.0 + LENGTH_RTOL):
        needed, given_depth = _format_apart(space.depth, request.depth)
        yield f"needs a depth of {needed}: {given_depth} given"


def _format_apart(first: float, second: float) -> tuple[str, str]:
    """Return two lengths that differ with as many digits as it takes to see that they do.

    Examples
    --------
    >>> _format_apart(0.012, 0.010), _format_apart(0.01000004, 0.010)
    (('12 mm', '10 mm'), ('10.00004 mm', '10 mm'))
    """
    for digits in range(4, 17):
        texts = format_short(first, "length", digits), format_short(second, "length", digits)
        if texts[0] != texts[1]:
            break
    return texts


def too_thin(spec: Spec) -> Iterator[str]:
    """Yield whether a leaf is thinner than all processes that make its material are assumed to make, in a sentence."""
    material: Any = getattr(spec.get_value("mechanism"), "material", None)
    leaves = [size for path, size in spec.leaves() if is_leaf(path, size)]
    if material is None or not leaves:
        return
    process, thin = finest_process(material.name, material.modulus), min(leaves)
    if thin < process.least_feature * (1.0 - LENGTH_RTOL):
        sizes = [format_short(size, "length", 3) for size in (thin, process.least_feature)]
        yield f"leaves of {sizes[0]} are thinner than {sizes[1]}, the least assumed of {process.name}: state --process"


def too_short(request: Request, result: Result) -> Iterator[str]:
    """Yield whether the window that was judged is shorter than the travel that is required."""
    window: Any = result.spec.get_value("analysis.window")
    length = 0.0 if window is None else float(window[1]) - float(window[0])
    if length < request.travel * (1.0 - LENGTH_RTOL):
        dimension = "length" if request.kind == "force" else "angle"
        reported = format_short(length, dimension), format_short(request.travel, dimension)
        yield f"is constant over {reported[0]}; {reported[1]} required"
