"""Loss by the friction of pins and guide in a design that states none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.metrics import evaluate
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result

PLAIN_FRICTION = 0.15
"""Coefficient of pins and guide, assumed: dry steel on steel has 0.1 to 0.2."""


def friction_note(
    result: Result,  # of a design; mechanisms without pins have no note
    run: Run,  # for the analysis with friction
) -> str:
    """Return the mean force both ways with pins and guide that rub as assumed; empty where friction is stated."""
    record, mechanism = family(result.spec.family), getattr(result.spec, "mechanism", None)
    stated = [getattr(mechanism, key, False) for key in ("pins", "guide")]
    if stated != [None, None] or not record.part or not result.status.usable:
        return ""
    pin = getattr(record.part(result), "pin", None)
    if pin is None:
        return ""
    rubbing: dict[str, Any] = {"mechanism.pins": {"diameter": pin, "friction": PLAIN_FRICTION}}
    rubbing["mechanism.guide"] = {"friction": PLAIN_FRICTION}
    try:
        outcome = record.analyze(result.spec.replace(rubbing), run)
    except SpecError:
        return ""
    kind = result.curve.kind
    name = f"{kind}_mean"
    means = [evaluate(outcome, [f"{name}[{path}]"])[f"{name}[{path}]"].value for path in ("load", "unload")]
    frictionless = evaluate(result, [name])[name].value
    if None in means or frictionless is None:
        return f"no force all the way, with {PLAIN_FRICTION:g} assumed in pins and guide: no friction is stated"
    up, down, free = (format_short(float(entry or 0.0), kind) for entry in (*means, frictionless))
    size = format_short(pin, "length")
    return (
        f"mean {kind} {up} one way, {down} back with {PLAIN_FRICTION:g} in pins ({size}) and guide (assumed: none is "
        f"stated); {free} without"
    )
