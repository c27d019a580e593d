"""Requirements that a mechanism misses, in words: its envelope, its travel, and a force that wide beams raise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.metrics import evaluate
from cfmkit.specs.units import format_short
from cfmkit.stock.processes import finest_process
from cfmkit.studies.stock_and_digits import is_leaf

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.base import BoundingBox
    from cfmkit.families.suggestion_request import Request
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

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
        yield from ((topic, f"{one.name}: {one.message}") for one in result.warnings if one.name in names)


def largest_force(request: Request, result: Result) -> float:
    """Return the largest mean of all branches, or of a band the largest force [N or N m]."""
    name = f"{request.kind}_{'max' if request.banded else 'mean'}"
    values = [one.value for key, one in evaluate(result).items() if key.partition("[")[0] == name]
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
    given = list(request.envelope[:2])
    if request.kind == "torque":
        sides, given = sorted(sides), sorted(given)
    for name, need, have in zip(("across the travel", "along the travel"), sides, given, strict=True):
        if need > have * (1.0 + LENGTH_RTOL):
            needed, given_side = _apart(need, have)
            yield f"needs {needed} {name}: {given_side} given"
    if request.depth is not None and space.depth is None:
        yield f"its depth is not known: {space.assumed}"
    elif request.depth is not None and space.depth is not None and space.depth > request.depth * (1.0 + LENGTH_RTOL):
        needed, given_depth = _apart(space.depth, request.depth)
        yield f"needs a depth of {needed}: {given_depth} given"


def _apart(one: float, other: float) -> tuple[str, str]:
    """Return two lengths that differ with as many digits as it takes to see that they do.

    Examples
    --------
    >>> _apart(0.012, 0.010), _apart(0.01000004, 0.010)
    (('12 mm', '10 mm'), ('10.00004 mm', '10 mm'))
    """
    for digits in range(4, 17):
        texts = format_short(one, "length", digits), format_short(other, "length", digits)
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
