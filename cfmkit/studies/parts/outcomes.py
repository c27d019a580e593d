"""Drawn parts of a design, each analysed in full and checked against the requirements.

Parts are drawn as `cfmkit sensitivity --method tolerance` draws them, and analysed as rows of one solution where the
family has such, else one by one. A part without a result counts as one that misses the requirements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.metrics import split_name, window_of, windows_judged
from cfmkit.metrics.requirements import Bounds
from cfmkit.studies.choose_metrics_to_note import metrics_of
from cfmkit.studies.engine import NullMonitor, Work
from cfmkit.studies.engine import run as computed
from cfmkit.studies.journal import Journal
from cfmkit.studies.parts.share import Share
from cfmkit.studies.parts.uncertain_values import plan_of
from cfmkit.studies.point_evaluation import Study

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.parts.parts import Parts
    from cfmkit.studies.point_evaluation import Metric

FORCE_DIMENSIONS = ("force", "torque", "energy")  # dimensions of metrics that go with the force


@dataclass(frozen=True)
class Outcomes:
    """Analysed parts."""

    met: NDArray[np.bool_]  # (n, r) which requirement each part meets; False where it has no result
    trimmed: NDArray[np.bool_]  # (n, r) the same where a trim has brought the mean force of each to the design's
    failed: NDArray[np.bool_]  # (n,) which parts have no result, or one that ends early
    why: str  # message of the first of those
    lacking: tuple[int, str]  # how many others have no value for a requirement, and why the first has none

    def share(self, met: NDArray[np.bool_] | None = None) -> Share:
        """Return the share of parts that meet every requirement."""
        return Share.from_outcomes(
            np.asarray((self.met if met is None else met).all(axis=1)), self.failed, why=self.why
        )


class _Progress(NullMonitor):
    """Progress of parts that are analysed."""

    def __init__(self, run: Run, what: str, count: int) -> None:
        self._run, self._what, self._count, self._done = run, what, count, 0

    def add_finished(self, points: int, failed: int, reused: bool) -> None:
        """Take that more parts are analysed."""
        self._done += points
        self._run.progress(self._done / self._count, f"{self._done} of {self._count} {self._what}")


def analyze_parts(parts: Parts, values: FloatArray, nominal: Result, run: Run, what: str = "parts") -> Outcomes:
    """Return which requirements parts with values (n, d) [SI] meet; `nominal`: the result of the perfect part."""
    spec = parts.spec
    metrics = _metrics_to_note(spec, nominal)
    study = Study(spec, parts.paths, metrics, seed=run.seed, findings=False, manufactured=True)
    work = Work(study, plan_of(parts.parameters, values))
    journal = run.notes if isinstance(run.notes, Journal) else None
    records = computed(work, run.executor, journal, _Progress(run, what, len(values)))
    met, failed = np.zeros((len(values), len(spec.part_requirements)), dtype=bool), np.ones(len(values), dtype=bool)
    found, why = np.full((len(values), len(metrics)), np.nan), ""
    for indices, rows in records.batches():
        early = {k: text for k, (status, text) in rows.odd.items() if status.key != "complete"}
        why = why or next((text for text in early.values() if text), "")
        complete = np.ones(len(indices), dtype=bool)
        complete[list(early)] = False
        failed[indices], met[indices], found[indices] = ~complete, rows.met & complete[:, None], rows.values
    lacking = np.flatnonzero(np.isnan(found[:, 1:]).any(axis=1) & ~failed)
    reason = _why_lacking(parts.part(values[lacking[0]]), run) if len(lacking) else ""
    level = Study(nominal.spec, (), metrics[:1]).quantities(nominal)[0].value
    trimmed = _judge_trimmed(spec, nominal, metrics, found, met, np.nan if level is None else level)
    return Outcomes(met, trimmed, failed, why, (len(lacking), reason))


def _why_lacking(part: Spec, run: Run) -> str:
    """Return what a part's analysis says of a window beyond its curve; empty where something else is the matter."""
    try:
        result = windows_judged(family(part.family).analyze(part, run))
    except CfmError as error:
        return str(error)
    return next((one.message for one in result.warnings if one.name == "window_outside"), "")


def _metrics_to_note(spec: Spec, nominal: Result) -> tuple[Metric, ...]:
    """Return what a trim needs to know of each part: the mean force, then each requirement's metric and its ends."""
    curve = nominal.curve
    prefix = "torque" if curve.kind == "torque" else "force"
    # of one branch, always the same: the worse of two changes from part to part
    # and without a window over that of a requirement: at the ends of the travel a part may have no force
    over = None if window_of(nominal) else next((one.over for one in spec.part_requirements if one.over), None)
    first = f"[{curve.branches[0]}]" if any(curve.branches) else ""
    wanted: list[tuple[str, Any]] = [(f"{prefix}_mean{first}", over)]
    for one in spec.part_requirements:
        wanted.append((one.metric, one.over))
        name, branch = split_name(one.metric)
        if name == "deviation_from_target":
            bracket = f"[{branch}]" if branch else ""
            wanted += [(f"{prefix}_{end}{bracket}", one.over) for end in ("max", "min")]
    return tuple(
        replace(metrics_of(spec, [name], curve)[0], over=over, label=f"{k}") for k, (name, over) in enumerate(wanted)
    )


def _judge_trimmed(
    spec: Spec,
    nominal: Result,
    metrics: Sequence[Metric],
    found: FloatArray,
    met: NDArray[np.bool_],
    level: float,
) -> NDArray[np.bool_]:
    """Return which requirements parts meet once their forces are multiplied so that each mean force is the level.

    Metrics of forces go with the factor and shares of the force stay; a departure from a target follows from the ends
    of the force. Whatever else follows the force in a way of its own is left as it was.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = level / found[:, 0]
    column, out = 1, met.copy()
    for k, one in enumerate(spec.part_requirements):
        metric, values = metrics[column], found[:, column]
        column += 1
        if split_name(one.metric)[0] == "deviation_from_target":
            ends = found[:, column : column + 2]
            column += 2
            if nominal.target:
                values = np.abs(factor[:, None] * ends / nominal.target - 1.0).max(axis=1)
        elif metric.dimension in FORCE_DIMENSIONS:
            values = factor * values
        else:
            continue
        out[:, k] = np.isfinite(values) & Bounds.from_requirement(one, metric.dimension).met_by(values)
    return out
