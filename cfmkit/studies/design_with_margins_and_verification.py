"""A design as it is delivered: what the family makes of a specification, moved for its yield, verified as a solid.

At the end its widths are those of a sheet that is sold, where that is wanted, and its dimensions have the digits that
its process can hold.

`cfmkit design` and the points of a study that designs take the same way.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cfmkit.families.run_control import Run
    from cfmkit.results import Design
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.point_evaluation import Designer


def run_design(
    spec: Spec,  # with a `design` block
    designer: Designer,  # what designs perfect parts of the family
    # seed, progress, time budget. If a yield is requested, the search for the perfect part has half of the time, and
    # that for its margins what is left. A part from a sheet is designed again for its solid, with the whole budget:
    # with what is left, the finished design could be lost
    run: Run,
) -> Design:
    """Return the design of a specification, with all that its block `design` asks for, or why there is none."""
    from cfmkit.studies.stock_and_digits import with_digits_of_process, with_stock_sheet, with_whole_strands

    rounded = _finished_design(spec, designer, run)

    def finish(variant: Spec) -> Design:
        return _finished_design(variant, designer, run)

    rounded = with_whole_strands(spec, with_stock_sheet(spec, rounded, finish, run), finish, run)
    return with_digits_of_process(spec, rounded, finish, run)


def _finished_design(spec: Spec, designer: Designer, run: Run) -> Design:
    """Return the design of a specification with its margins, verified."""
    asked = getattr(spec, "design", None)
    if asked is not None and asked.by_requirements:
        from cfmkit.studies.redesign_to_requirements import move_free_values

        designer = move_free_values
    plain = getattr(asked, "yield", None) is None
    result = designer(spec, run) if plain else _with_yield(spec, designer, run)
    if getattr(asked, "verify", None) is not None:
        from cfmkit.studies.verify_design_by_solid_model import verify_by_solid

        result = verify_by_solid(spec, result, run)
    return result


def _with_yield(spec: Spec, designer: Designer, run: Run) -> Design:
    """Return a design of perfect parts, in half of the time, with margins for the yield, in the time that is left."""
    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.studies.parts.redesign import with_design_margins

    clock = Clock.from_budgets(run.time_budget)
    half = None if run.time_budget is None else 0.5 * run.time_budget
    design = designer(spec, replace(run.part(0.0, 0.5), time_budget=half))
    return with_design_margins(spec, design, replace(run.part(0.5, 1.0), time_budget=clock.get_time_left()))
