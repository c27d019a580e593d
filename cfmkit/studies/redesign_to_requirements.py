"""Designs without targets of their own: the free values of a mechanism move until it meets its requirements.

The curve keeps its form and gets the mean that the requirements on its effort allow, their middle. Values move as in
the correction of a made part: widths before thicknesses, and no further than is needed. A mechanism that meets all
requirements stays as it is. A part that is a planar solid is moved by the beams of its family, and its widths are
corrected once so that its solid has that mean.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError, SpecError
from cfmkit.families import family
from cfmkit.families.base import add_size
from cfmkit.metrics import check, values_of_family
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.parameters_to_fit import FitParameter
    from cfmkit.families.run_control import Run
    from cfmkit.metrics.requirements import Outcome
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

FIDELITY_KEY = "analysis.fidelity"
NO_LEVEL_MESSAGE = (
    "the requirements state no {0} that the mechanism could be designed for: require '{0}_mean', or a band of it"
)


@dataclass(frozen=True)
class AsDrawn:
    """A part that is made as drawn, without errors."""

    errors: tuple[FitParameter, ...] = ()
    values: FloatArray = field(default_factory=lambda: np.zeros(0))

    def part_of(self, drawn: Spec) -> Spec:
        """Return the drawing."""
        return drawn


def move_free_values(
    spec: Spec,  # with a block `design` that states `free`, and no target of its family
    run: Run,  # seed, progress, time budget
) -> Design:
    """Return a specification whose free values were moved until all requirements are met, or why there is none."""
    from cfmkit.experiment.aimed_curve import aim_of
    from cfmkit.experiment.redrawn_values import Redesign, limits_of
    from cfmkit.studies.verify_design_by_solid_model import verify_by_solid

    nominal = _analyze(spec, run)
    if not nominal.curves:
        return Design(None, nominal.status, nominal.message)
    outcomes = _outcomes(nominal)
    if nominal.status is Status.COMPLETE and outcomes and all(outcome.ok for outcome in outcomes):
        return Design(spec, Status.COMPLETE, notes=(("free", "all requirements are met as it is: nothing was moved"),))
    kind = nominal.curve.kind
    target = _mean_required(outcomes, kind)
    if target is None:
        return Design(None, Status.INVALID, NO_LEVEL_MESSAGE.format(kind))
    drawn = _by_beams(spec)
    begun = nominal if drawn is spec else _analyze(drawn, run)
    if not begun.curves:
        return Design(None, begun.status, begun.message)
    own = aim_of(begun)
    aim = replace(own, efforts=tuple(target / own.mean_effort * effort for effort in own.efforts))
    redesign = Redesign(drawn, (AsDrawn(),), aim, limits_of(drawn))
    try:
        moved = redesign.drawing(redesign.solve())
    except CfmError as problem:
        return Design(None, Status.INFEASIBLE, str(problem))
    design = Design(moved, Status.COMPLETE, notes=(("free", _changes(spec, moved, tuple(redesign.limits))),))
    if drawn is not spec:
        design = verify_by_solid(spec, design, run)
    return design if design.spec is None else _judge(design, run)


def _analyze(spec: Spec, run: Run) -> Result:
    record = family(spec.family)
    result: Result = record.analyze(spec, run)
    return add_size(result, record.envelope(result)) if result.curves else result


def _outcomes(result: Result) -> Sequence[Outcome]:
    return check(result.spec.part_requirements, result, values_of_family(family(result.spec.family).outputs.values))


def _judge(design: Design, run: Run) -> Design:
    """Return a design, or what it misses by more than the rounding of its values."""
    assert design.spec is not None
    missed = [outcome.sentence for outcome in _outcomes(_analyze(design.spec, run)) if not outcome.ok]
    if not missed:
        return design
    reported = f"no values in the ranges of 'design.free' meet all requirements; the nearest: {'; '.join(missed)}"
    return Design(None, Status.INFEASIBLE, reported)


def _mean_required(outcomes: Sequence[Outcome], kind: str) -> float | None:
    """Return the middle of what requirements allow for the effort [N or N m]; None if they do not bound it twice."""
    lows = [one.min for one in outcomes if one.metric in (f"{kind}_mean", f"{kind}_min") and one.min is not None]
    highs = [one.max for one in outcomes if one.metric in (f"{kind}_mean", f"{kind}_max") and one.max is not None]
    return 0.5 * (max(lows) + min(highs)) if lows and highs else None


def _by_beams(spec: Spec) -> Spec:
    """Return a specification with the finest model of its family that is no solid."""
    if spec.fidelity != "solid":
        return spec
    for name in reversed([name for name in family(spec.family).models if name != "solid"]):
        try:
            return spec.replace({FIDELITY_KEY: name})
        except SpecError:  # what that model needs is not there
            continue
    return spec


def _changes(before: Spec, after: Spec, paths: Sequence[str]) -> str:
    from cfmkit.experiment.redrawn_values import dimension_of

    moved = [
        f"{path} {format_short(float(old), dimension_of(before, path))} -> "
        f"{format_short(float(new), dimension_of(before, path), 6)}"
        for path in paths
        if (old := before.get_value(path)) != (new := after.get_value(path))
    ]
    return f"moved so that the requirements are met: {'; '.join(moved)}" if moved else "nothing was moved"
