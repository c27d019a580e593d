"""What is wished, as the requirements that a proposal's file keeps, and what of it no model here can judge.

Every number of a wish becomes a requirement on a metric, so that `cfmkit analyze` of the file says the same as the
search. What a wish asks for and nothing is known of, as the life of a material without fatigue data, is no
requirement: the proposal says that it was not judged, and is no mechanism that meets the wish. A yield is that of many
parts: it stands in the block `sensitivity`, as `min_yield`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.families.base import ENVELOPE
from cfmkit.metrics import evaluate
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cfmkit.families.base import Room
    from cfmkit.families.wishes import Wish
    from cfmkit.metrics import Definition
    from cfmkit.results import Quantity, Result
    from cfmkit.specs.spec import Spec

ADJUSTED = 0.025
"""How far the mean may be from an end of the adjustment: as far as from a force that is wished as a number."""

STRAIGHT_LINKS = "1 %"
"""Largest elastic turn of a link over that of its spring: models of links take them for rigid."""

LIVES = ("fatigue_life", "spring_life")
"""Metrics that say how many cycles the material, and bought springs, last."""


def windows_of(spec: Spec, wish: Wish) -> tuple[dict[str, Any], ...]:
    """Return a requirement over the motion in which a part has to bear its stress.

    Solids are solved at the ends of the windows of all requirements: with this one they are those of the finished file.
    """
    return ({"metric": "safety_factor", "min": "1", "over": pressed(wish, spec)},)


def demanded(
    wish: Wish, result: Result, space: Room | None, values: Iterable[Definition]
) -> tuple[dict[str, Any], ...]:
    """Return the requirements that say what is wished of a mechanism, over the window of its analysis.

    Parameters
    ----------
    wish : Wish
    result : Result
        An analysis of the mechanism: only what it has metrics for is required.
    space : Room or None
        The box that it stays in.
    values : iterable of Definition
        Of the scalar results of its family.
    """
    found = evaluate(result, None, None, values)
    return (
        *_of_effort(wish),
        *_of_stress(wish, result, found),
        *_of_box(wish, space),
        *_of_loss(wish, result),
        *_of_lives(wish, result, found),
        *_of_adjustment(wish, found),
    )


def unjudged(wish: Wish, result: Result) -> Iterator[str]:
    """Yield what is wished and no model here can judge, each with the reason."""
    found = evaluate(result)
    if wish.hysteresis is not None and "unload" not in result.curve.branches:
        yield f"hysteresis not judged: no loss factor is known of {_material(result)}"
    if wish.cycles is not None:
        yield from _unknown_lives(result, found)
    if wish.adjustable is not None and "adjusted_force_min" not in found:
        yield "adjustment not judged: the model does not know its ends"
    names = {one.name for one in result.warnings}
    if "sharp_corners" in names:
        yield "stress not judged: inside corners are sharp"
    if "mesh_coarse" in names:
        yield "force and stress not judged: the mesh is too coarse"
    if _bends(result) and result.allowable_stress is None:
        yield f"stress not judged: no strength is known of {_material(result)}"
    contact = getattr(result.spec.at("mechanism"), "contact", None)
    if contact is not None and contact.material.yield_strength is None:
        yield f"contact pressure not judged: no strength is known of {_material(result)}"


def pressed(wish: Wish, spec: Spec) -> tuple[str, str]:
    """Return over what a mechanism has to bear its stress: all it does; of made parts from half of the run-in on.

    A made part begins and ends a little before or after the perfect one: a metric over all that this does has no value.
    """
    window: Any = spec.at("analysis.window")
    if wish.good_parts is None or window is None or wish.kind == "torque":
        return "0 %", "100 %"
    return format_short(0.5 * float(window[0]), "length", 12), format_short(float(window[1]), "length", 12)


def _share(value: float) -> str:
    return f"{100.0 * value:.12g} %"


def _known(found: Mapping[str, Quantity], name: str) -> float | None:
    return found[name].value if name in found else None


def _of_effort(wish: Wish) -> Iterator[dict[str, Any]]:
    yield {"metric": f"{wish.kind}_ripple", "max": _share(wish.ripple)}
    low, high = (format_short(value, wish.kind, 12) for value in (wish.low, wish.high))
    if wish.banded:
        yield {"metric": f"{wish.kind}_min", "min": low}
        yield {"metric": f"{wish.kind}_max", "max": high}
    else:
        yield {"metric": f"{wish.kind}_mean", "min": low, "max": high}


def _of_stress(wish: Wish, result: Result, found: Mapping[str, Quantity]) -> Iterator[dict[str, Any]]:
    if _known(found, "safety_factor") is not None:
        yield {"metric": "safety_factor", "min": "1", "over": pressed(wish, result.spec)}
    if _known(found, "link_safety_factor") is not None:
        yield {"metric": "link_safety_factor", "min": "1"}
        yield {"metric": "link_turn_share_max", "max": STRAIGHT_LINKS}


def _of_box(wish: Wish, space: Room | None) -> Iterator[dict[str, Any]]:
    if space is None:
        return
    width, height, depth = space.sides
    across, along = wish.room[:2]
    given = (along, across) if space.sideways else (across, along)
    if wish.kind == "torque":  # what turns may lie either way in the plane
        given = (max(given), min(given)) if width >= height else (min(given), max(given))
    sides = [*given, *((wish.depth,) if wish.depth is not None and depth is not None else ())]
    for name, most in zip(ENVELOPE, sides, strict=False):
        yield {"metric": name, "max": format_short(most, "length", 12)}


def _of_loss(wish: Wish, result: Result) -> Iterator[dict[str, Any]]:
    if wish.hysteresis is not None and "unload" in result.curve.branches:
        lost = wish.hysteresis * wish.target * wish.travel
        yield {"metric": "hysteresis_area", "max": format_short(lost, "energy", 12)}


def _of_lives(wish: Wish, result: Result, found: Mapping[str, Quantity]) -> Iterator[dict[str, Any]]:
    if wish.cycles is None:
        return
    if _bends(result) and "fatigue_life" in found:
        yield {"metric": "fatigue_life", "min": f"{wish.cycles}", "over": pressed(wish, result.spec)}
    if _known(found, "spring_life") is not None:
        yield {"metric": "spring_life", "min": f"{wish.cycles}"}


def _unknown_lives(result: Result, found: Mapping[str, Quantity]) -> Iterator[str]:
    wired = "wire_stress_max" in found or _has_springs(result.spec)
    links = "link_safety_factor" in found
    if (_bends(result) or links) and getattr(_block(result.spec), "fatigue", None) is None:
        yield f"life not judged: no S-N data for {_material(result)}"
    elif _bends(result) and "fatigue_life" not in found:
        yield "life not judged: no model of the fatigue of its contact"
    if wired and _known(found, "spring_life") is None:
        yield "life not judged: no S-N data for the wire of its springs"
    if not (_bends(result) or links or wired):
        yield "life not judged: no stress of its parts is modelled"


def _bends(result: Result) -> bool:
    """Return True if the model knows the stress of a part that bends."""
    return "max_stress" in result.curve.extra


def _has_springs(spec: Spec) -> bool:
    """Return True if a mechanism is driven by bought springs."""
    springs = getattr(spec.at("mechanism"), "springs", None)
    return springs is not None and any(getattr(springs, name, None) for name in ("stiffness", "rates", "wound"))


def _block(spec: Spec) -> Any:
    """Return the material of a mechanism, or of its contact."""
    mechanism = spec.at("mechanism")
    return getattr(mechanism, "material", None) or getattr(getattr(mechanism, "contact", None), "material", None)


def _material(result: Result) -> str:
    return getattr(_block(result.spec), "name", None) or "its material"


def _of_adjustment(wish: Wish, found: Mapping[str, Quantity]) -> Iterator[dict[str, Any]]:
    if wish.adjustable is None or "adjusted_force_min" not in found:
        return
    low, high = wish.adjustable
    yield {"metric": "adjusted_force_min", "max": format_short(low * (1.0 + ADJUSTED), "force", 12)}
    yield {"metric": "adjusted_force_max", "min": format_short(high * (1.0 - ADJUSTED), "force", 12)}
    yield {"metric": "adjusted_ripple_max", "max": _share(wish.ripple)}
