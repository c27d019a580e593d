"""Manufactured parts of a design: drawn at random from `design.tolerances` and checked against its requirements.

Parts are drawn as `cfmkit sensitivity --method tolerance` draws them, with the same grammar, and each is analysed in
full. A part without a result is a bad part: whoever made it has nothing to sell.

Errors that scale the force of a whole part, as that of the modulus does, are no matter of its shape. The yield is
therefore told a second time with those frozen, and a third time after a trim that brings the mean force of each part to
that of the design. Which errors those are is not guessed from their names: each is moved by its standard deviation, and
common is what changes the force by the same share everywhere in the window.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError, SpecError
from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.metrics import split_name, windows_judged
from cfmkit.results import Quantity, Result
from cfmkit.specs.spec import DesignKeys
from cfmkit.specs.what_yield_metrics_mean import OF_MANY_PARTS
from cfmkit.studies.choose_metrics_to_note import metrics_of
from cfmkit.studies.engine import Silent, Work
from cfmkit.studies.engine import run as computed
from cfmkit.studies.journal import Journal
from cfmkit.studies.parts_scaled_by_a_factor import EXACTLY, SHARES, goes_with, once_scaled, one_sigma, power
from cfmkit.studies.point_evaluation import Study
from cfmkit.studies.sensitivity.evaluation import plan_of
from cfmkit.studies.sensitivity.probability_confidence_intervals import LEVEL, clopper_pearson, wilson
from cfmkit.studies.stated_or_assumed_tolerances import NO_TOLERANCE, DesignTolerances, tolerances_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.specs.spec import DesignBlock, Spec
    from cfmkit.studies.point_evaluation import Metric

ALIKE = 0.1
"""An error is common if its relative change of force varies along the motion by at most this share of itself."""

FAINT = 0.05
"""Where the force is below this share of its largest value, a share of it says nothing."""

TRIED = 3
"""Parts without common errors that are analysed, to see that the others follow from those with these errors."""


@dataclass(frozen=True)
class YieldShare:
    """Share of good parts among some."""

    # good, failed, count: parts that meet everything, that have no complete result, and all
    good: int
    failed: int
    count: int
    why: str = ""  # what became of the first without a complete result

    @property
    def value(self) -> float:
        """The share of good ones."""
        return self.good / self.count

    def as_json(self) -> dict[str, Any]:
        """Return what metrics.json says, with both intervals."""
        return {
            "value": self.value,
            "wilson": list(wilson(self.good, self.count)),
            "clopper_pearson": list(clopper_pearson(self.good, self.count)),
            "level": LEVEL,
            "good": self.good,
            "failed": self.failed,
            "parts": self.count,
        }


@dataclass(frozen=True)
class JudgedParts:
    """Parts with what their analyses say."""

    met: NDArray[np.bool_]  # (n, r) which requirement each part meets; false where it has no result
    trimmed: NDArray[np.bool_]  # (n, r) the same after the trim
    failed: NDArray[np.bool_]  # (n,) which parts have no result, or one that ends early
    why: str  # what became of the first of those
    lacking: tuple[int, str]  # how many others have no value for a requirement, and why the first has none
    values: FloatArray  # (n, m) of the metrics that `_noted` says; nan where there is none

    def share(self, met: NDArray[np.bool_] | None = None) -> YieldShare:
        """Return the share of parts that meet every requirement."""
        good: NDArray[np.bool_] = np.asarray((self.met if met is None else met).all(axis=1))
        return YieldShare(int(good.sum()), int(self.failed.sum()), len(good), self.why)


class _Told(Silent):
    """Passes on how many parts are judged."""

    def __init__(self, run: Run, what: str, count: int) -> None:
        self._run, self._what, self._count, self._done = run, what, count, 0

    def done(self, points: int, failed: int, reused: bool) -> None:
        """Take that more parts are judged."""
        self._done += points
        self._run.progress(self._done / self._count, f"{self._done} of {self._count} {self._what}")


def judge(made: DesignTolerances, values: FloatArray, nominal: Result, run: Run, what: str = "parts") -> JudgedParts:
    """Return what becomes of parts.

    Parameters
    ----------
    made : DesignTolerances
        Of the specification that is made.
    values : (n, d) array
        Of its parameters in each part [SI].
    nominal : Result
        Of the perfect part.
    run : Run
        Processes, notes and progress.
    what : str
        What progress calls them.
    """
    metrics, spec = _noted(made.spec, nominal), made.spec
    study = Study(spec, made.paths, metrics, seed=run.seed, findings=False, made=True)
    work = Work(study, plan_of(made.parameters, values))
    journal = run.notes if isinstance(run.notes, Journal) else None
    records = computed(work, run.executor, journal, _Told(run, what, len(values)))
    count = len(spec.part_requirements)
    met, failed = np.zeros((len(values), count), dtype=bool), np.ones(len(values), dtype=bool)
    found, why = np.full((len(values), len(metrics)), np.nan), ""
    for indices, rows in records.batches():
        why = why or next((text for status, text in rows.odd.values() if status.key != "complete"), "")
        complete = np.ones(len(indices), dtype=bool)
        complete[[k for k, (status, _) in rows.odd.items() if status.key != "complete"]] = False
        failed[indices] = ~complete
        met[indices] = rows.met & complete[:, None]
        found[indices] = rows.values
    lacking = np.flatnonzero(np.isnan(found[:, 1:]).any(axis=1) & ~failed)
    about = (len(lacking), _why_lacking(made, values[lacking[0]], run) if len(lacking) else "")
    level = Study(nominal.spec, (), (metrics[0],)).quantities(nominal)[0].value
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = level / found[:, 0] if level is not None else np.full(len(found), np.nan)
    trimmed = once_scaled(spec, nominal, metrics, found, met, factor)
    return JudgedParts(met, trimmed, failed, why, about, found)


def _why_lacking(made: DesignTolerances, values: FloatArray, run: Run) -> str:
    """Return what a part's analysis says of a window beyond its curve; empty where something else is the matter."""
    part = made.spec.replace(dict(zip(made.paths, values.tolist(), strict=True)), as_made=True)
    try:
        result = windows_judged(family(part.family).analyze(part, run))
    except CfmError as error:
        return str(error)
    return next((one.message for one in result.warnings if one.name == "window_outside"), "")


def _noted(spec: Spec, nominal: Result) -> tuple[Metric, ...]:
    """Return what a trim needs to know of each part: the mean force, then each requirement's metric and its ends."""
    from cfmkit.metrics import window_of

    curve = nominal.curve
    prefix = "torque" if curve.kind == "torque" else "force"
    # of one branch, always the same: the worse of two changes from part to part
    # and without a window over that of a requirement: at the ends of the travel a part may have no force
    over = None if window_of(nominal) else next((one.over for one in spec.part_requirements if one.over), None)
    wanted: list[tuple[str, Any]] = [(f"{prefix}_mean{_first_branch(curve)}", over)]
    for one in spec.part_requirements:
        wanted.append((one.metric, one.over))
        name, branch = split_name(one.metric)
        if name == "deviation_from_target":
            bracket = f"[{branch}]" if branch else ""
            wanted += [(f"{prefix}_{end}{bracket}", one.over) for end in ("max", "min")]
    return tuple(
        replace(metrics_of(spec, [name], curve)[0], over=over, label=f"{k}") for k, (name, over) in enumerate(wanted)
    )


def _first_branch(curve: Curve) -> str:
    return f"[{curve.branches[0]}]" if any(curve.branches) else ""


def _without(
    made: DesignTolerances, shared: tuple[int, ...], values: FloatArray, judged: JudgedParts, nominal: Result, run: Run
) -> JudgedParts | None:
    """Return what becomes of parts without some common errors, from what became of them with these.

    None if force and stress do not go exactly with each of them, or a requirement is on something else.
    """
    spec, metrics = made.spec, _noted(made.spec, nominal)
    departs = np.array([split_name(one.name)[0] == "deviation_from_target" for one in metrics])
    powers = np.array([power(one, stresses=True) for one in metrics])
    followed = (powers != 0) | departs | [split_name(one.name)[0] in SHARES for one in metrics]
    groups = [members for members in made.joined() if set(members) <= set(shared)]
    if not followed.all() or len(values) <= TRIED or len(nominal.curve.branches) > 1:
        return None
    if not all(goes_with(made, one, nominal, run) for one in groups):
        return None
    still = values[:TRIED].copy()
    still[:, shared] = made.nominal[list(shared)]
    factor = np.prod([made.nominal[one[0]] / values[:, one[0]] for one in groups], axis=0)
    solved = judge(made, still, nominal, run)
    expected = judged.values[:TRIED] * factor[:TRIED, None] ** powers
    same = np.isclose(solved.values, expected, rtol=100 * EXACTLY, atol=0.0, equal_nan=True) | departs
    if not same.all() or (solved.failed != judged.failed[:TRIED]).any():
        return None
    met = once_scaled(spec, nominal, metrics, judged.values, judged.met, factor, stresses=True)
    return replace(judged, met=met)


def common(made: DesignTolerances, nominal: Result, run: Run) -> tuple[int, ...]:
    """Return the parameters whose errors change the force by the same share everywhere in the window."""
    found: list[int] = []
    for members in made.joined():
        share = _force_share(made, members, nominal, run)
        if share is not None and np.ptp(share) <= ALIKE * abs(share.mean()) and abs(share.mean()) > 0:
            found += members
    return tuple(sorted(found))


def _force_share(made: DesignTolerances, members: tuple[int, ...], nominal: Result, run: Run) -> FloatArray | None:
    """Return by which share a standard deviation of some parameters changes the force; None if it cannot be said."""
    changes = {made.paths[k]: one_sigma(made.parameters[k]) for k in members}
    try:
        moved = family(made.spec.family).analyze(made.spec.replace(changes), run)
    except CfmError:
        return None
    if not moved.curves:
        return None
    before, after = nominal.curve, moved.curve
    same = before.motion.shape == after.motion.shape and np.allclose(before.motion, after.motion, rtol=1e-9, atol=1e-12)
    if not same:
        return None
    low, high = _window(nominal)
    with np.errstate(invalid="ignore"):
        loud = np.abs(before.effort) > FAINT * np.nanmax(np.abs(before.effort))
        inside = (before.motion >= low) & (before.motion <= high) & loud & np.isfinite(after.effort)
    return np.asarray(after.effort[inside] / before.effort[inside] - 1.0) if inside.sum() > 1 else None


def _window(result: Result) -> tuple[float, float]:
    from cfmkit.metrics import window_of

    found = window_of(result)
    return (found.lo, found.hi) if found else (float(result.curve.motion.min()), float(result.curve.motion.max()))


@dataclass(frozen=True)
class Yields:
    """Judgement of many parts of a design."""

    made: DesignTolerances  # on the design
    # after, trimmed: of its parts, as they are and after the trim
    after: YieldShare
    trimmed: YieldShare
    frozen: YieldShare | None  # without common errors; None if there are none
    common: tuple[str, ...]  # the paths of those
    each: tuple[YieldShare, ...]  # of parts that meet one requirement
    before: YieldShare | None  # of the specification that the design began with
    why: str = ""  # why there is no yield of that
    # how many of the parts have a curve, but no value for a requirement, and why the first has none
    lacking: tuple[int, str] = (0, "")

    def quantities(self) -> dict[str, Quantity]:
        """Return the metrics of many parts."""
        low, high = clopper_pearson(self.after.good, self.after.count)
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
        requirements = self.made.spec.part_requirements
        each = [{"metric": one.metric} | share.as_json() for one, share in zip(requirements, self.each, strict=True)]
        return self.after.as_json() | {
            "seed": self.made.seed,
            "before": self.before.as_json() if self.before else None,
            "with_common_frozen": (self.frozen or self.after).as_json(),
            "after_trim": self.trimmed.as_json(),
            "common": list(self.common),
            "requirements": each,
        }

    def sentence(self) -> str:
        """Return the yield in a sentence, and what would raise it."""
        low, high = clopper_pearson(self.after.good, self.after.count)
        reported = f"{_percent(self.after.value)} of {self.after.count} parts drawn from design.tolerances are good "
        reported += f"({_percent(low)} to {_percent(high)} with 95 % confidence)"
        if self.before is not None:
            reported += f"; {_percent(self.before.value)} of the specification as given"
        if self.after.failed:
            reported += f"; {self.after.failed} have no complete result and count as bad (the first: {self.after.why})"
        count, reason = self.lacking
        if count:
            first = f" (the first: {reason})" if reason else ""
            reported += f"; {count} have no value for a requirement and count as bad{first}"
        if self.frozen is not None:
            reported += (
                f"; {_percent(self.frozen.value)} without the errors of the whole part ({', '.join(self.common)})"
            )
        reported += f"; {_percent(self.trimmed.value)} after a trim of the force"
        worst = min(range(len(self.each)), key=lambda k: self.each[k].value)
        if self.each[worst].value < 1.0:
            metric = self.made.spec.part_requirements[worst].metric
            reported += f"; most are lost by {metric}, which {_percent(1.0 - self.each[worst].value)} miss"
        return reported


def _percent(value: float) -> str:
    return f"{100.0 * value:.3g} %"


def yields_of(design: Result, given: Spec | None, run: Run) -> Yields | None:
    """Return the yield of a design and of the specification that it began with; None without tolerances.

    Parameters
    ----------
    design : Result
        The analysis of the design.
    given : Spec, optional
        What it began with.
    run : Run
        Seed, processes, notes and progress.

    Raises
    ------
    cfmkit.errors.SpecError
        If a tolerance is on a value that the design does not have.
    """
    block = getattr(design.spec, "design", None) or getattr(given, "design", None)
    if not isinstance(block, DesignKeys):
        return None
    made = tolerances_of(design.spec, block, run.seed)
    if made is None:
        return None
    values = made.drawn()
    judged = judge(made, values, design, run.part(0.0, 0.4))
    shared = common(made, design, run)
    frozen = None
    if shared:
        still = values.copy()
        still[:, shared] = made.nominal[list(shared)]
        follows = _without(made, shared, values, judged, design, Run(run.seed))
        frozen = (follows or judge(made, still, design, run.part(0.4, 0.7), "parts without common errors")).share()
    before, why = _before(given, block, run.part(0.7, 1.0))
    each = tuple(judged.share(judged.met[:, [k]]) for k in range(judged.met.shape[1]))
    paths = tuple(made.paths[k] for k in shared)
    return Yields(made, judged.share(), judged.share(judged.trimmed), frozen, paths, each, before, why, judged.lacking)


def no_yields(given: Spec) -> dict[str, Quantity]:
    """Return the metrics of many parts that requirements are on, without values: no tolerance is known."""
    asked = dict.fromkeys(one.metric for one in given.requirements if one.metric in OF_MANY_PARTS)
    return {name: Quantity(None, "ratio", OF_MANY_PARTS[name], NO_TOLERANCE) for name in asked}


def _before(given: Spec | None, block: DesignBlock, run: Run) -> tuple[YieldShare | None, str]:
    """Return the yield of the specification as given, or why there is none."""
    if given is None:
        return None, "nothing was given to begin with"
    try:
        made = tolerances_of(given, block, run.seed)
        result = family(given.family).analyze(given, run)
        if made is None or not result.curves:
            return None, f"the specification as given has no curve: {result.message}"
        return judge(made, made.drawn(), result, run, "parts as given").share(), ""
    except SpecError as error:
        return None, "; ".join(f"{one.path}: {one.message}" for one in error.problems)
    except CfmError as error:
        return None, str(error)


__all__ = [
    "DesignTolerances",
    "JudgedParts",
    "YieldShare",
    "Yields",
    "common",
    "judge",
    "no_yields",
    "tolerances_of",
    "yields_of",
]
