"""Loss by the friction of pins and guide in a design that states none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.metrics import evaluate
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.run_control import Run
    from cfmkit.results import Result

PLAIN_FRICTION = 0.15  # coefficient of pins and guide, assumed: dry steel on steel has 0.1 to 0.2
JOINT_NAMES = {"pins": "pins", "bearings": "plain bearings of the rollers", "guide": "guide"}
"""Names of what rubs, by its block of the mechanism."""


def friction_note(
    result: Result,  # of a design; mechanisms without pins have no note
    run: Run,  # for the analysis with friction
) -> str:
    """Return the mean force both ways with pins and guide that rub as assumed; empty where friction is stated."""
    record, mechanism = family(result.spec.family), getattr(result.spec, "mechanism", None)
    if not record.part or not result.status.usable:
        return ""
    rubbing = getattr(record.part(result), "rubbing", {})
    if not rubbing or any(getattr(mechanism, block, None) is not None for block in rubbing):
        return ""
    blocks = {f"mechanism.{block}": {**sizes, "friction": PLAIN_FRICTION} for block, sizes in rubbing.items()}
    try:
        outcome = record.analyze(result.spec.replace(blocks), run)
    except SpecError:
        return ""
    kind = result.curve.kind
    name = f"{kind}_mean"
    means = [evaluate(outcome, [f"{name}[{path}]"])[f"{name}[{path}]"].value for path in ("load", "unload")]
    frictionless = evaluate(result, [name])[name].value
    where = _name_joints(rubbing)
    if None in means or frictionless is None:
        return f"no force all the way, with {PLAIN_FRICTION:g} assumed in {where}: no friction is stated"
    up, down, free = (format_short(float(entry or 0.0), kind) for entry in (*means, frictionless))
    return (
        f"mean {kind} {up} one way, {down} back with {PLAIN_FRICTION:g} in {where} (assumed: none is stated); {free} "
        "without"
    )


def _name_joints(rubbing: Mapping[str, Mapping[str, float]]) -> str:
    """Return what rubs with its sizes, as "pins (3 mm) and guide"."""
    *first, last = (
        " ".join([name, *(f"({format_short(size, 'length')})" for size in rubbing[block].values())])
        for block, name in JOINT_NAMES.items()
        if block in rubbing
    )
    return f"{', '.join(first)} and {last}" if first else last
