"""Where no start meets all limits: which of them block, and the nearest values for which there would be a shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.designing import limits
from cfmkit.designing.variables import at_bounds
from cfmkit.families.beam.build import thickest_of
from cfmkit.families.beam.findings import percent
from cfmkit.families.beam.shaping.goals import Flattest
from cfmkit.families.beam.shaping.search import VIOLATION, Found, StartBudget, met
from cfmkit.families.beam.shaping.sqp_program import Shaping
from cfmkit.families.beam.shaping.variables import Variables
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from cfmkit.families.beam.shaping.task import Task, TaskLimits

MOST = 3
"""Designs that are looked at, the ones that miss the limits least."""

AT_BOUND = 1e-4
"""A variable so near to its bound, in units of the size and in rad, is held by it."""


@dataclass(frozen=True)
class Blocked:
    """Why there is no design.

    Attributes
    ----------
    missed : mapping
        Limit -> by how much the best design misses it, and where.
    nearest : mapping of str to str
        Path below `design.optimise` or `mechanism` -> value for which the other limits could be met.
    freed : Found or None
        A design that meets all limits after all.
    """

    missed: Mapping[str, str]
    nearest: Mapping[str, str]
    freed: Found | None


def blocked(task: Task, found: Iterable[Found], plan: StartBudget) -> Blocked:
    """Return what blocks, judged from the designs that miss the limits least."""
    best = sorted(found, key=lambda one: one.violation)[:MOST]
    missed = missed_by(task, best[0])
    nearest: dict[str, str] = {}
    for name in missed:
        gives = [_given(task, one, plan, (name,)) for one in best]
        for one in gives:
            if one.feasible:
                return Blocked(missed, {}, one)
        slack = min((one.violation for one in gives if set(missed_by(task, one)) <= {name}), default=None)
        if slack is not None:
            nearest |= NEAREST[name](task, 1.02 * slack)
    if not nearest:  # none gives way alone: all that are missed together, by the same share
        gives = [_given(task, one, plan, tuple(missed)) for one in best]
        slack = min((one.violation for one in gives if set(missed_by(task, one)) <= set(missed)), default=None)
        if slack is not None:
            nearest = {key: value for name in missed for key, value in NEAREST[name](task, 1.02 * slack).items()}
    return Blocked(missed, nearest, None)


def _given(task: Task, found: Found, plan: StartBudget, give: tuple[str, ...]) -> Found:
    """Return a design that meets all limits but some, and misses those as little as possible."""
    rest = [met(task, found, task.orders[-1], plan, tuple(set(missed_by(task, found)) - set(give)) or give, 0.9)]
    return met(task, rest[0], task.orders[-1], plan, give, 0.98)


def missed_by(task: Task, found: Found) -> dict[str, str]:
    """Return the limits that a design misses, each with its worst place and by how much, the worst first."""
    program = Shaping(Variables(task, found.order), found.start, Flattest())
    view = program.view(found.x)
    if view is None:
        return {}
    rows = limits.missed(program.limits(view), VIOLATION)
    return {one.name: f"{one.about}: missed by {percent(one.by)}" for one in rows}


def held_by(task: Task, found: Found, close: float = 2e-3) -> tuple[str, ...]:
    """Return the limits and bounds that hold a design, by name and place."""
    variables = Variables(task, found.order)
    program = Shaping(variables, found.start, Flattest())
    view = program.view(found.x, sloped=True)
    at_bound = at_bounds(found.x, variables.bounds, AT_BOUND)
    held = [f"{name} at its bound" for name, at in zip(variables.names, at_bound, strict=True) if at]
    return tuple(held) if view is None else (*held, *limits.held(program.limits(view), close))


def _stress(task: Task, slack: float) -> dict[str, str]:
    factor = task.safety_factor / (1 + slack)
    if factor >= 1:
        return {"mechanism.safety_factor": f"at most {factor:.4g}"}
    strength = (task.allowable_stress or 0.0) * (1 + slack)
    return {"mechanism.material.yield_strength": f"at least {format_short(strength, 'stress')}, without safety factor"}


def _force(task: Task, slack: float) -> dict[str, str]:
    if task.limits.force_min is not None:
        return {"design.optimise.force.min": f"at most {format_short(task.limits.force_min * (1 - slack), 'force')}"}
    return {"design.optimise.force.tolerance": f"at least {task.limits.force_tolerance + slack:.3g}"}


def _clearance(task: Task, slack: float) -> dict[str, str]:
    thick = max(thickest_of(beam.section) for beam in task.network.beams.values())
    gap = ((task.limits.clearance or 0.0) + thick) * (1 - slack) - thick
    return {"design.optimise.limits.clearance": f"at most {format_short(max(0.0, gap), 'length')}"}


def _box(key: str) -> Callable[[Task, float], dict[str, str]]:
    def nearest(task: Task, slack: float) -> dict[str, str]:
        more = format_short(slack * task.size, "length")
        return {f"design.optimise.limits.{key}": f"wider by {more} on the sides that hold"}

    return nearest


def _scaled(
    key: str, value: Callable[[TaskLimits, float], float], sense: str, dimension: str
) -> Callable[..., dict[str, str]]:
    def nearest(task: Task, slack: float) -> dict[str, str]:
        return {f"design.optimise.limits.{key}": f"{sense} {format_short(value(task.limits, slack), dimension)}"}

    return nearest


NEAREST: dict[str, Callable[[Task, float], dict[str, str]]] = {
    "stress": _stress,
    "envelope": _box("envelope"),
    "deformed_envelope": _box("deformed_envelope"),
    "max_length_ratio": _scaled(
        "max_length_ratio", lambda one, s: 1 / max(1e-3, 1 / (one.length_ratio or 1.0) - s), "at least", "count"
    ),
    "min_slenderness": _scaled(
        "min_slenderness", lambda one, s: (one.slenderness or 0.0) * (1 - s), "at most", "count"
    ),
    "min_radius": _scaled("min_radius", lambda one, s: (one.radius or 0.0) * (1 - s), "at most", "length"),
    "clearance": _clearance,
    "force": _force,
}
"""For each limit what it would have to be if it gives way by an amount in its own scale."""
