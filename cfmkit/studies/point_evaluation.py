"""Study of a specification (sweep, sensitivity, parts): how a point is solved, and what is noted of it.

A `Study` holds everything that decides the row of a point but the varied values. It notes the metrics that are
requested, or all that the mechanism can have.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError, SpecError
from cfmkit.families import family
from cfmkit.families import origin as family_origin
from cfmkit.families.base import ENVELOPE_METRICS
from cfmkit.families.run_control import Run
from cfmkit.metrics import (
    definition_of,
    definitions,
    evaluate,
    metrics_by_name,
    requirement_problems,
    values_of_family,
    warn_of_uncovered_windows,
    window_of,
)
from cfmkit.metrics.window_metrics import STATIC_BALANCE
from cfmkit.results import Result
from cfmkit.specs.block import STUDY_BLOCKS
from cfmkit.specs.data_file_paths import list_data_files
from cfmkit.specs.units import to_border
from cfmkit.store import file_hash, origin, stable_hash

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cfmkit.curves import Curve, Kind
    from cfmkit.errors import Problem
    from cfmkit.metrics import Definition
    from cfmkit.metrics.metric_values import Surveys
    from cfmkit.results import Design, Quantity
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.units import Ends
    from cfmkit.studies.plan import Plan

    Designer = Callable[[Any, Run], Design]
    DesignMaker = Callable[[Spec, Designer, Run], Design]


NOT_DECIDING = {"name", "description", *STUDY_BLOCKS}
"""Parts of a specification that change no result of a point."""
RECORD_VERSION = 5  # how records of the journal are written: those of another number are computed again


@dataclass(frozen=True)
class Metric:
    """A column of results."""

    name: str  # with ``[branch]`` where wanted
    dimension: str  # of `cfmkit.specs.units`
    definition: str = ""  # what it is
    # where it is measured: places [m or rad], or shares of the travel; default: the window of the analysis
    over: Ends | None = None
    label: str = ""  # heads the column; default: the name, ``force_mean_load`` for ``force_mean[load]``
    words: tuple[str, ...] = ()  # those that a metric of the dimension ``text`` is an index into

    def __post_init__(self) -> None:
        if not self.label:
            object.__setattr__(self, "label", self.name.replace("[", "_").replace("]", ""))


def design_without_margins(spec: Spec, designer: Designer, run: Run) -> Design:
    """Return the design of a family for parts without errors: no margins for a yield, no verification."""
    return designer(spec, run)


@dataclass(frozen=True)
class Study:
    """Everything that decides the row of a point, but the varied values."""

    spec: Spec  # what is varied
    paths: tuple[str, ...]  # what varies, in order
    metrics: tuple[Metric, ...]  # what is noted
    design: bool = False  # whether the mechanism is designed anew at each point
    curves: bool = False  # whether curves are kept
    seed: int = 0  # random seed of an analysis
    findings: bool = True  # whether the names of findings are noted
    # designs the mechanism of a point, ``make_design(spec, designer, run)``; default: the family's designer alone
    make_design: DesignMaker = design_without_margins
    # whether points are manufactured parts: stated values must agree with each other, those of parts need not
    manufactured: bool = False

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the metrics."""
        return tuple(item.name for item in self.metrics)

    def definitions(self, kind: Kind) -> Mapping[str, Definition]:
        """Return every metric of curves of a kind and every value of the family, by name."""
        if kind not in self._definitions:
            self._definitions[kind] = metrics_by_name(kind, values_of_family(family(self.spec.family).outputs.values))
        return self._definitions[kind]

    @cached_property
    def _definitions(self) -> dict[Kind, Mapping[str, Definition]]:
        return {}

    def format_metric(self, column: int, value: float) -> float | str | None:
        """Return a metric's value as files say it: in the border unit, or a word; None if there is none."""
        metric = self.metrics[column]
        if not isfinite(value):
            return None
        return metric.words[int(value)] if metric.words else float(to_border(value, metric.dimension))

    @cached_property
    def identity(self) -> bytes:
        """The hash of everything that decides a row, but the varied values.

        Of data files the content counts, and so does that of cfmkit: its version does not change with each commit.
        """
        spec = self.spec.model_dump(mode="json", exclude=NOT_DECIDING)
        noted = [(metric.name, metric.over) for metric in self.metrics]
        data = [[str(source), file_hash(source.path.resolve())] for source in list_data_files(self.spec.model_dump())]
        computing = [origin(), family_origin(self.spec.family)]
        about = [
            RECORD_VERSION,
            self.paths,
            noted,
            self.design,
            self.curves,
            self.seed,
            self.findings,
            self.manufactured,
        ]
        about += [computing, data]
        return bytes.fromhex(stable_hash([spec, *about]))

    def key(self, values: Sequence[Any]) -> str:
        """Return the name of a point by content: the same for the same study and the same values."""
        text = repr([(type(value).__name__, value) for value in values])
        return hashlib.sha256(self.identity + text.encode()).hexdigest()[:32]

    def variant(self, values: Sequence[Any]) -> Spec:
        """Return the specification of one point.

        Raises SpecError if it is not valid.
        """
        return self.plain.replace(dict(zip(self.paths, values, strict=True)), as_made=self.manufactured)

    @cached_property
    def plain(self) -> Spec:
        """The specification without what is said of studies, which each variant would read again."""
        return self.spec.model_copy(update={name: None for name in STUDY_BLOCKS if hasattr(self.spec, name)})

    def solve(self, spec: Spec) -> Result:
        """Return the result of a variant, designed first if the study says so, with the warnings of both."""
        record, run = family(spec.family), Run(self.seed)
        if not self.design or record.design is None:
            return warn_of_uncovered_windows(record.with_envelope(record.analyze(spec, run), self.names))
        design = self.make_design(spec, record.design.make, Run(self.seed))
        if design.spec is None:
            return Result(spec, design.status, design.explanation, warnings=design.warnings)
        result = warn_of_uncovered_windows(record.with_envelope(record.analyze(design.spec, run), self.names))
        return replace(result, warnings=(*design.warnings, *result.warnings))

    def check_requirements(self, kind: Kind) -> None:
        """Raise SpecError if a requirement is not well put for curves of a kind."""
        if kind not in self._problems_by_kind:
            definitions = self.definitions(kind).values()
            self._problems_by_kind[kind] = tuple(requirement_problems(self.spec.part_requirements, definitions, kind))
        if problems := self._problems_by_kind[kind]:
            raise SpecError(problems)

    @cached_property
    def _problems_by_kind(self) -> dict[Kind, tuple[Problem, ...]]:
        return {}

    def quantities(self, result: Result) -> tuple[Quantity, ...]:
        """Return what each metric of the study is on a result, with the reason where it has no value."""
        surveys: Surveys = {}
        extra = values_of_family(family(result.spec.family).outputs.values)
        quantities: dict[tuple[str, Ends | None], Quantity] = {}
        for over in dict.fromkeys(metric.over for metric in self.metrics):
            names = [metric.name for metric in self.metrics if metric.over == over]
            window = None if over is None else window_of(result, over)
            quantities |= {(name, over): item for name, item in evaluate(result, names, window, extra, surveys).items()}
        return tuple(quantities[metric.name, metric.over] for metric in self.metrics)


NEED_STRESS = ("stress_max", "safety_factor")
"""Metrics of curves that have stresses; others leave these columns out unless asked."""
NEED_FATIGUE = ("fatigue_life",)  # metrics that need fatigue data of the material
NEED_CURVE = ("deviation_from_curve", "rms_to_curve")  # metrics that compare with a target curve
NEED_TIME = ("force_after", "torque_after")
"""Metrics of a time, which their name says: without one there is nothing to note."""


def metrics_of(
    spec: Spec,  # its family knows more metrics
    names: Iterable[str],  # what is requested; none for the default
    sample: Curve | None = None,  # a curve of the study, which says whether it is about forces or torques
) -> tuple[Metric, ...]:
    """Return the metrics with these names; without names, every one that such a curve can have.

    The default has one column per metric, over all branches, and then the family's own
    values. A branch is had by name only: ``force_mean[load]``.

    Raises UsageError if a metric or its branch is not known.
    """
    outputs, kind = family(spec.family).outputs, sample.kind if sample is not None else "force"
    family_values = values_of_family(outputs.values)
    asked = tuple(dict.fromkeys(names))
    if not asked:
        left_out = _left_out(spec, sample)
        listed = (item.name for item in definitions(kind, family_values))
        asked = tuple(name for name in dict.fromkeys(listed) if name not in left_out)
    metrics = metrics_by_name(kind, family_values)
    meant = [(name, definition_of(name, metrics, outputs.branches)) for name in asked]
    return tuple(
        Metric(name, definition.dimension, definition.definition, words=outputs.words.get(name, ()))
        for name, definition in meant
    )


def _left_out(spec: Spec, sample: Curve | None) -> frozenset[str]:
    """Return the metrics that no point of such a study can have, or only if named: they cost time."""
    stressed = sample is None or "max_stress" in sample.extra
    lasting = getattr(spec, "durability", None)
    lives = () if lasting is not None and lasting.fatigue is not None else NEED_FATIGUE
    followed = () if spec.target_curve is not None else NEED_CURVE
    by_name = (STATIC_BALANCE, *ENVELOPE_METRICS)
    return frozenset((*followed, *(() if stressed else NEED_STRESS), *lives, *NEED_TIME, *by_name))


def sample_curve(spec: Spec, plan: Plan, design: bool) -> Curve | None:
    """Return a curve of the study to see what it is about: of the specification itself, or of a point."""
    probe = Study(spec, plan.paths, (), design)
    for variant in _candidates(probe, plan):
        try:
            outcome = probe.solve(variant)
        except CfmError:
            continue
        if outcome.curves:
            return outcome.curves[0]
    return None


def _candidates(probe: Study, plan: Plan) -> Iterator[Spec]:
    """Yield the specification as it is, then a few variants spread over the study."""
    yield probe.spec
    for index in dict.fromkeys((0, len(plan) - 1, len(plan) // 2)):
        try:
            yield probe.variant(plan.point(index))
        except CfmError:
            continue
