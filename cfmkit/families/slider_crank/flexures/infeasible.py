"""What is said where no strip meets its targets: how far the nearest is off, and which target it would meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.findings import mm, mpa, newton, percent
from cfmkit.families.refusals import no_design
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.flexures.descent import VIOLATION
from cfmkit.numerics.sqp import Ending
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.flexures.search import Found
    from cfmkit.results import Design


def infeasible(found: Found) -> Design:
    """Return what the nearest strip misses, and the target that it would meet."""
    descent, program, task = found.descent, found.program, found.task
    if descent.ending is Ending.NO_ANSWER:
        why = "could not begin: the first strip has no equilibrium over 'design.travel'; ask for less of it, or "
        why += "for other ranges in 'design.beam'"
        return no_design(finding("target_unreachable", f"the search {why}"))
    state = program.state(descent.z)
    if state is None:
        return no_design(
            finding("target_unreachable", f"the search {descent.ending.value}; change 'design.travel' or 'design.beam'")
        )
    low, high = float(state.force.min()), float(state.force.max())
    level, missed, nearest = 0.5 * (low + high), [], {}
    off, limit = max(high / task.force - 1.0, 1.0 - low / task.force), task.material.allowable_stress
    if off > program.ripple(descent.z):
        missed.append(f"is up to {percent(off)} off the force")
        flat = high - low <= 2.0 * level * program.ripple(descent.z)
        name = "design.force" if flat else "design.tolerance"
        nearest[name] = newton(level) if flat else format_short(off, "ratio")
    worst = float(state.stress.max())
    if limit is not None and worst > limit * (1.0 + 0.1 * VIOLATION):
        missed.append(f"has a stress of {mpa(worst)}")
        nearest["allowable stress"] = mpa(worst)
    text = (
        f"no strip within the ranges keeps the force, the band and the stress: from {mm(task.start)} to "
        f"{mm(program.stroke(descent.z))} the nearest {' and '.join(missed)} ({descent.ending.value}); change "
        "'design.force', 'design.travel' or the ranges in 'design.beam'"
    )
    return no_design(finding("target_unreachable", text), nearest)
