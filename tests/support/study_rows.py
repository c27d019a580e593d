"""Rows of a study beside a run of each of its points: one comparison for all families."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from given_points import GivenPoints
from scipy.stats import qmc

import cfmkit
from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.metrics import check, gaps, values_of_family
from cfmkit.results import Status
from cfmkit.studies import Study, evaluate_rows, metrics_of
from cfmkit.tables import curve_table, to_csv

if TYPE_CHECKING:
    from collections.abc import Mapping

GROUPS = (("force",), ("torque", "rotational_stiffness"), ("length",), ("angle",))
"""Dimensions of columns that are compared with the largest of all: one of them may be the difference of others."""
FLAT_EXTREMES = {"peak_force", "peak_displacement", "valley_force", "valley_displacement"}
"""Metrics that of what is left in the last digits of forces keep the root, where a path was traced."""


def study_of(spec: Any, values: Mapping[str, Any], names: tuple[str, ...] = ()) -> tuple[Study, GivenPoints]:
    """Return a study over given values (path -> one a point), by default with every metric that a sweep notes."""
    plan = GivenPoints(values)
    return Study(spec, plan.paths, metrics_of(spec, names, cfmkit.analyze(spec).curves[0])), plan


def draw_points(spec: Any, ranges: Mapping[str, Any], count: int) -> dict[str, Any]:
    """Return points of a Sobol sequence within ranges ``"low:high"``, or among listed values: path -> one a point."""
    shares = qmc.Sobol(len(ranges), seed=0).random(count).T
    drawn = {}
    for (path, stated), share in zip(ranges.items(), shares, strict=True):
        if isinstance(stated, str):
            low, high = (spec.replace({path: end}).get_value(path) for end in stated.split(":"))
            drawn[path] = low + (high - low) * share
        else:
            drawn[path] = [stated[int(place)] for place in share * len(stated)]
    return drawn


def vary_numbers(spec: Any, draw: np.random.Generator, count: int, spread: float) -> dict[str, Any]:
    """Return up to three numbers of a specification at random about their own values: path -> one a point."""
    own = {
        path: value
        for path, value in spec.leaves()
        if path.startswith(("mechanism.", "analysis.")) and isinstance(value, float) and value
    }
    chosen = draw.choice(sorted(own), draw.integers(1, 4), replace=False).tolist()
    return {path: own[path] * draw.uniform(1 - spread, 1 + spread, count) for path in chosen}


@dataclass(frozen=True)
class Run:
    """What a study would note of a point, from an analysis of its own."""

    status: Status
    message: str = ""
    values: tuple[float | None, ...] = ()
    met: tuple[bool, ...] = ()
    warnings: frozenset[str] = frozenset()
    curve: bytes = b""


def run_point(study: Study, plan: Any, k: int) -> Run:
    """Return what comes of a point: its analysis, metrics and requirements, without rows."""
    try:
        result = study.solve(study.variant(plan.point(k)))
    except CfmError as error:
        status = {3: Status.INVALID, 4: Status.NO_EQUILIBRIUM}[error.exit_code]
        problems = getattr(error, "problems", ())
        lines = [": ".join(filter(None, (problem.path, problem.message))) for problem in problems]
        return Run(status, "; ".join(lines) or " ".join(str(error).split()))
    warnings = frozenset(item.name for item in result.warnings)
    if not result.status.usable:
        return Run(result.status, result.message, warnings=warnings)
    numbers = (item.value for item in study.quantities(result))
    values = tuple(None if value is None or not np.isfinite(value) else value for value in numbers)
    extra = values_of_family(family(study.spec.family).outputs.values)
    met = tuple(outcome.ok for outcome in check(study.spec.part_requirements, result, extra))
    missing = "; ".join(gap.short for gap in gaps(result))
    message = missing if result.status is Status.COMPLETE else result.message
    return Run(result.status, message, values, met, warnings, to_csv(curve_table(result.curves)))


def assert_rows_equal_runs(study: Study, plan: Any, step: int = 1, rtol: float = 1e-12, flat: float = 1e-12) -> Any:
    """Return the rows of a study; every `step`-th has status, message, warnings, requirements, numbers of a run."""
    together = evaluate_rows(study, plan, 0, len(plan))
    sizes = np.nan_to_num(np.abs(together.values)).max(axis=0)
    kinds = [metric.dimension for metric in study.metrics]
    for group in GROUPS:
        same = [k for k, dimension in enumerate(kinds) if dimension in group]
        sizes[same] = sizes[same].max(initial=0.0)
    # of ratios large ones are of a mean that vanishes, small ones may be what a difference leaves of one: 1e-15
    sizes = np.where(np.equal(kinds, "ratio"), np.maximum(sizes * np.maximum(sizes, 1.0), 1e-3), sizes)
    force = sizes[kinds.index("force")] if "force" in kinds else 0.0
    sizes = np.where(np.equal(kinds, "energy"), np.maximum(sizes, 0.1 * force), sizes)
    tolerance = np.where([name in FLAT_EXTREMES for name in study.names], flat, rtol) * sizes
    for k in range(0, len(plan), step):
        point, alone = dict(zip(plan.paths, plan.point(k), strict=True)), run_point(study, plan, k)
        assert together.status(k) == (alone.status, alone.message)
        assert {name for name, mask in together.warned.items() if mask[k]} == alone.warnings, point
        if alone.values:
            own, row = np.array([np.nan if v is None else v for v in alone.values]), together.values[k]
            wrong = ~((np.abs(row - own) <= tolerance) | (np.isnan(own) & np.isnan(row)))
            assert not [(study.names[m], row[m], own[m]) for m in np.flatnonzero(wrong)], point
            assert tuple(together.met[k].tolist()) == alone.met
    return together
