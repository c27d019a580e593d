"""Drawn parts of a design, each analysed in full and checked against the requirements; and the yield by them.

Parts are drawn as `cfmkit sensitivity --method tolerance` draws them, and analysed as rows of one solution where the
family has such, else one by one. A part without a result counts as one that misses the requirements.

Yields are stated before and after the design, and for better workshops. Errors that scale the force of a whole part, as
that of the modulus does, are no matter of its shape. The yield is therefore stated a second time without those, and a
third time after a trim that brings the mean force of each part to that of the design. Which errors those are is not
guessed from their names: each is moved by its standard deviation, and common is what changes the force by the same
share everywhere in the window.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError, SpecError
from cfmkit.families import family
from cfmkit.metrics import split_name, warn_of_uncovered_windows, window_of
from cfmkit.metrics.requirements import Bounds
from cfmkit.results import Quantity
from cfmkit.specs.further_metrics import OF_MANY_PARTS
from cfmkit.specs.spec import DesignKeys
from cfmkit.studies.engine import NullMonitor, Work
from cfmkit.studies.engine import run as computed
from cfmkit.studies.journal import Journal
from cfmkit.studies.parts.parts import NO_TOLERANCE, Parts
from cfmkit.studies.parts.share import Share, percent
from cfmkit.studies.parts.uncertain_values import plan_of
from cfmkit.studies.point_evaluation import Study, metrics_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import DesignBlock, Spec
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
    numbers, why = np.full((len(values), len(metrics)), np.nan), ""
    for indices, rows in records.batches():
        early = {k: text for k, (status, text) in rows.odd.items() if status.key != "complete"}
        why = why or next((text for text in early.values() if text), "")
        complete = np.ones(len(indices), dtype=bool)
        complete[list(early)] = False
        failed[indices], met[indices], numbers[indices] = ~complete, rows.met & complete[:, None], rows.values
    lacking = np.flatnonzero(np.isnan(numbers[:, 1:]).any(axis=1) & ~failed)
    reason = _why_lacking(parts.part(values[lacking[0]]), run) if len(lacking) else ""
    level = Study(nominal.spec, (), metrics[:1]).quantities(nominal)[0].value
    trimmed = _judge_trimmed(spec, nominal, metrics, numbers, met, np.nan if level is None else level)
    return Outcomes(met, trimmed, failed, why, (len(lacking), reason))


def _why_lacking(part: Spec, run: Run) -> str:
    """Return what a part's analysis says of a window beyond its curve; empty where something else is the matter."""
    try:
        result = warn_of_uncovered_windows(family(part.family).analyze(part, run))
    except CfmError as error:
        return str(error)
    return next((warning.message for warning in result.warnings if warning.name == "window_outside"), "")


def _metrics_to_note(spec: Spec, nominal: Result) -> tuple[Metric, ...]:
    """Return what a trim needs to know of each part: the mean force, then each requirement's metric and its ends."""
    curve = nominal.curve
    prefix = "torque" if curve.kind == "torque" else "force"
    # of one branch, always the same: the worse of two changes from part to part
    # and without a window over that of a requirement: at the ends of the travel a part may have no force
    over = (
        None
        if window_of(nominal)
        else next((requirement.over for requirement in spec.part_requirements if requirement.over), None)
    )
    first = f"[{curve.branches[0]}]" if any(curve.branches) else ""
    wanted: list[tuple[str, Any]] = [(f"{prefix}_mean{first}", over)]
    for requirement in spec.part_requirements:
        wanted.append((requirement.metric, requirement.over))
        name, branch = split_name(requirement.metric)
        if name == "deviation_from_target":
            bracket = f"[{branch}]" if branch else ""
            wanted += [(f"{prefix}_{end}{bracket}", requirement.over) for end in ("max", "min")]
    return tuple(
        replace(metrics_of(spec, [name], curve)[0], over=over, label=f"{k}") for k, (name, over) in enumerate(wanted)
    )


def _judge_trimmed(
    spec: Spec,
    nominal: Result,
    metrics: Sequence[Metric],
    numbers: FloatArray,
    met: NDArray[np.bool_],
    level: float,
) -> NDArray[np.bool_]:
    """Return which requirements parts meet once their forces are multiplied so that each mean force is the level.

    Metrics of forces go with the factor and shares of the force stay; a departure from a target follows from the ends
    of the force. Whatever else follows the force in a way of its own is left as it was.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = level / numbers[:, 0]
    column, out = 1, met.copy()
    for k, requirement in enumerate(spec.part_requirements):
        metric, values = metrics[column], numbers[:, column]
        column += 1
        if split_name(requirement.metric)[0] == "deviation_from_target":
            ends = numbers[:, column : column + 2]
            column += 2
            if nominal.target:
                values = np.abs(factor[:, None] * ends / nominal.target - 1.0).max(axis=1)
        elif metric.dimension in FORCE_DIMENSIONS:
            values = factor * values
        else:
            continue
        out[:, k] = np.isfinite(values) & Bounds.from_requirement(requirement, metric.dimension).met_by(values)
    return out


COMMON_SPREAD = 0.1
"""An error is common if its relative change of force varies along the motion by at most this share of itself."""
LEAST_FORCE = 0.05  # where the force is below this share of its largest value, a share of it says nothing


@dataclass(frozen=True)
class Yields:
    """Yields of a design, of those that were drawn."""

    parts: Parts  # of the design
    after: Share  # parts as they are
    trimmed: Share  # the same parts after a trim
    frozen: Share | None  # without common errors; None if there are none
    common: tuple[str, ...]  # the paths of those
    requirement_shares: tuple[Share, ...]  # of parts that meet one requirement
    before: Share | None  # of the specification that the design began with
    why: str = ""  # why there is none of that
    # how many of the parts have a curve, but no value for a requirement, and why the first has none
    lacking: tuple[int, str] = (0, "")

    def quantities(self) -> dict[str, Quantity]:
        """Return the metrics of many parts."""
        low, high = self.after.clopper_pearson
        numbers = {
            "yield": self.after.value,
            "yield_low": low,
            "yield_high": high,
            "yield_before": self.before.value if self.before else None,
            "yield_with_common_frozen": (self.frozen or self.after).value,
            "yield_after_trim": self.trimmed.value,
        }
        reasons = {"yield_before": self.why}
        return {
            name: Quantity(numbers[name], "ratio", about, reasons.get(name, ""))
            for name, about in OF_MANY_PARTS.items()
        }

    def as_json(self) -> dict[str, Any]:
        """Return the block `yield` of metrics.json."""
        requirements = self.parts.spec.part_requirements
        outcomes = [
            {"metric": requirement.metric} | share.as_json()
            for requirement, share in zip(requirements, self.requirement_shares, strict=True)
        ]
        return self.after.as_json() | {
            "seed": self.parts.seed,
            "before": self.before.as_json() if self.before else None,
            "with_common_frozen": (self.frozen or self.after).as_json(),
            "after_trim": self.trimmed.as_json(),
            "common": list(self.common),
            "requirements": outcomes,
        }

    def sentence(self) -> str:
        """Return the yield in a sentence, and what would raise it."""
        low, high = self.after.clopper_pearson
        reported = f"{percent(self.after.value)} of {self.after.count} parts drawn from design.tolerances are good "
        reported += f"({percent(low)} to {percent(high)} with 95 % confidence)"
        if self.before is not None:
            reported += f"; {percent(self.before.value)} of the specification as given"
        if self.after.failed:
            reported += f"; {self.after.failed} have no complete result and count as bad (the first: {self.after.why})"
        count, reason = self.lacking
        if count:
            first = f" (the first: {reason})" if reason else ""
            reported += f"; {count} have no value for a requirement and count as bad{first}"
        if self.frozen is not None:
            without = f"without the errors of the whole part ({', '.join(self.common)})"
            reported += f"; {percent(self.frozen.value)} {without}"
        reported += f"; {percent(self.trimmed.value)} after a trim of the force"
        worst = min(range(len(self.requirement_shares)), key=lambda k: self.requirement_shares[k].value)
        if self.requirement_shares[worst].value < 1.0:
            metric = self.parts.spec.part_requirements[worst].metric
            reported += f"; most are lost by {metric}, which {percent(1.0 - self.requirement_shares[worst].value)} miss"
        return reported


def yields_of(design: Result, requested: Spec | None, run: Run) -> Yields | None:
    """Return the yield of an analysed design and of the specification that it began with; None without tolerances.

    Raises SpecError if a tolerance is on a value that the design does not have.
    """
    block: DesignKeys | None = getattr(design.spec, "design", None) or getattr(requested, "design", None)
    if not isinstance(block, DesignKeys) or (parts := Parts.from_design(design.spec, block, run.seed)) is None:
        return None
    values = parts.draw()
    analyzed = analyze_parts(parts, values, design, run.part(0.0, 0.4))
    shared, frozen = common_errors(parts, design, run), None
    if shared:
        still = parts.remove_errors(values, shared)
        frozen = analyze_parts(parts, still, design, run.part(0.4, 0.7), "parts without common errors").share()
    is_same = requested == design.spec  # a design that is designed again: its parts are known
    before, why = (analyzed.share(), "") if is_same else _yield_before(requested, block, run.part(0.7, 1.0))
    shares = tuple(analyzed.share(analyzed.met[:, [k]]) for k in range(analyzed.met.shape[1]))
    paths = tuple(parts.paths[k] for k in shared)
    return Yields(
        parts, analyzed.share(), analyzed.share(analyzed.trimmed), frozen, paths, shares, before, why, analyzed.lacking
    )


def no_yields(requested: Spec) -> dict[str, Quantity]:
    """Return the metrics of many parts that requirements are on, without values: no tolerance is known."""
    asked = dict.fromkeys(
        requirement.metric for requirement in requested.requirements if requirement.metric in OF_MANY_PARTS
    )
    return {name: Quantity(None, "ratio", OF_MANY_PARTS[name], NO_TOLERANCE) for name in asked}


def _yield_before(requested: Spec | None, block: DesignBlock, run: Run) -> tuple[Share | None, str]:
    """Return the yield of the specification as given, or why there is none."""
    if requested is None:
        return None, "nothing was given to begin with"
    try:
        parts = Parts.from_design(requested, block, run.seed)
        result = family(requested.family).analyze(requested, run)
        if parts is None or not result.curves:
            return None, f"the specification as given has no curve: {result.message}"
        return analyze_parts(parts, parts.draw(), result, run, "parts as given").share(), ""
    except SpecError as error:
        return None, "; ".join(f"{problem.path}: {problem.message}" for problem in error.problems)
    except CfmError as error:
        return None, str(error)


def common_errors(parts: Parts, nominal: Result, run: Run) -> tuple[int, ...]:
    """Return the parameters whose errors change the force by the same share everywhere in the window."""
    places: list[int] = []
    for members in parts.joined:
        share = _force_change(parts, members, nominal, run)
        if share is not None and np.ptp(share) <= COMMON_SPREAD * abs(share.mean()) and abs(share.mean()) > 0:
            places += members
    return tuple(sorted(places))


def _force_change(parts: Parts, members: tuple[int, ...], nominal: Result, run: Run) -> FloatArray | None:
    """Return by which share a standard deviation of some parameters changes the force; None if it cannot be said."""
    changes = {parts.paths[k]: float(parts.nominal[k] + parts.deviations[k]) for k in members}
    try:
        moved = family(parts.spec.family).analyze(parts.spec.replace(changes), run)
    except CfmError:
        return None
    if not moved.curves:
        return None
    before, after = nominal.curve, moved.curve
    same = before.motion.shape == after.motion.shape and np.allclose(before.motion, after.motion, rtol=1e-9, atol=1e-12)
    if not same:
        return None
    window = window_of(nominal)
    low, high = (window.lo, window.hi) if window else (float(before.motion.min()), float(before.motion.max()))
    with np.errstate(invalid="ignore"):
        large = np.abs(before.effort) > LEAST_FORCE * np.nanmax(np.abs(before.effort))
        inside = (before.motion >= low) & (before.motion <= high) & large & np.isfinite(after.effort)
    return np.asarray(after.effort[inside] / before.effort[inside] - 1.0) if inside.sum() > 1 else None
