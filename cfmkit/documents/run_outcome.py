"""Outcome of a run as one value (`Report`): a result with its metrics, requirements, warnings, status and exit code."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode
from cfmkit.metrics.requirements import judge_part_metric
from cfmkit.results import Result, Status
from cfmkit.specs.further_metrics import OF_MANY_PARTS
from cfmkit.tables.csv_and_json import json_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.curves import Curve
    from cfmkit.documents.document import PageTable
    from cfmkit.metrics import Outcome
    from cfmkit.results import Design, Finding, Quantity
    from cfmkit.specs.spec import Spec


CODES_BY_SEVERITY = (
    ExitCode.BUG,
    ExitCode.IO,
    ExitCode.INVALID,
    ExitCode.NO_SOLUTION,
    ExitCode.PARTIAL,
    ExitCode.REQUIREMENT_MISSED,
)
"""Which exit code counts where several apply: the first of these."""


@dataclass(frozen=True)
class Supplement:
    """Additions of a verb to the report on a result."""

    data: Mapping[str, Any] = field(default_factory=dict)  # more keys of metrics.json
    files: Mapping[str, Callable[[], bytes]] = field(default_factory=dict)  # more files: what makes the content of each
    lines: tuple[tuple[str, str], ...] = ()  # more paragraphs of the page: the word that begins each, and the text
    warnings: tuple[Finding, ...] = ()  # more of them
    curves: tuple[Curve, ...] = ()  # what curve.csv holds, where that is not what the result has
    shortfall: str = ""  # what was requested in addition to the result and is missing, in one sentence
    figures: Mapping[str, Callable[[], Figure]] = field(default_factory=dict)  # more figures: what draws each, by name
    tables: tuple[PageTable, ...] = ()  # of the page

    def plus(self, more: Supplement) -> Supplement:
        """Return both supplements as one, this one's entries first."""
        return Supplement(
            {**self.data, **more.data},
            {**self.files, **more.files},
            (*self.lines, *more.lines),
            (*self.warnings, *more.warnings),
            (*self.curves, *more.curves),
            "; ".join(text for text in (self.shortfall, more.shortfall) if text),
            {**self.figures, **more.figures},
            (*self.tables, *more.tables),
        )


@dataclass(frozen=True)
class Report:
    """A result with everything that is read off it."""

    result: Result  # of any status
    metrics: Mapping[str, Quantity]  # by name, in SI
    requirements: tuple[Outcome, ...]  # in the order of the specification
    design: Design | None = None  # what led to the result, if it was designed
    supplement: Supplement = Supplement()  # what else the verb has to say

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Findings of the design, of the analysis and of the supplement, each once."""
        designed = self.design.warnings if self.design else ()
        return tuple(dict.fromkeys((*designed, *self.result.warnings, *self.supplement.warnings)))

    @property
    def status(self) -> Status:
        """Status of the run: that of the result, but partial where something else that was asked is missing."""
        solved = self.result.status is Status.COMPLETE
        return Status.PARTIAL if solved and self.supplement.shortfall else self.result.status

    @property
    def message(self) -> str:
        """One sentence on the outcome."""
        return self.result.message if self.status is self.result.status else self.supplement.shortfall

    @property
    def missed(self) -> tuple[Outcome, ...]:
        """The requirements that are not met."""
        return tuple(outcome for outcome in self.requirements if not outcome.ok)

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of the process: how the solve ended counts before the requirements."""
        missed = [ExitCode.REQUIREMENT_MISSED] if self.missed else []
        return worst([self.status.exit_code, *missed])

    def extend(self, metrics: Mapping[str, Quantity], supplement: Supplement) -> Report:
        """Return the report with more metrics and with a supplement."""
        both = self.supplement.plus(supplement)
        return replace(self, metrics={**self.metrics, **metrics}, supplement=both)

    def judge_yields(self) -> Report:
        """Return the report with the outcome of requirements on a yield, which its metrics have, in their places."""
        single = iter(self.requirements)
        spec = self.result.spec
        judged = tuple(
            judge_part_metric(requirement, self.metrics[requirement.metric])
            if requirement.metric in self.metrics and requirement.metric in OF_MANY_PARTS
            else next(single)
            for requirement in spec.requirements
            if requirement.metric not in OF_MANY_PARTS or requirement.metric in self.metrics
        )
        return replace(self, requirements=judged)

    def as_json(self) -> dict[str, Any]:
        """Return what metrics.json says; what only a design search knows is a block of its own, no metric."""
        from cfmkit.metrics import metrics_json, search_json

        searched = {"search": search_json(self.design.search)} if self.design and self.design.search else {}
        return (
            {
                "status": self.status.key,
                "message": self.message,
                "metrics": metrics_json(self.metrics),
                "requirements": [outcome.as_json() for outcome in self.requirements],
                "warnings": [{"name": item.name, "message": item.message} for item in self.warnings],
            }
            | searched
            | dict(self.supplement.data)
        )


def worst(codes: list[ExitCode]) -> ExitCode:
    """Return the exit code of the highest severity among several.

    Examples
    --------
    >>> worst([ExitCode.OK, ExitCode.REQUIREMENT_MISSED, ExitCode.PARTIAL]).name
    'PARTIAL'
    """
    return next(
        (code for code in (*CODES_BY_SEVERITY, *codes) if code in codes and code is not ExitCode.OK), ExitCode.OK
    )


def report_on(result: Result, design: Design | None = None) -> Report:
    """Return the report on a result, and on the design that led to it."""
    from cfmkit.families import family
    from cfmkit.metrics import evaluate

    return Report(result, evaluate(result), family(result.spec.family).check(result), design)


def empty_result(spec: Spec, design: Design) -> Result:
    """Return the empty result of a design that failed: nothing was analysed."""
    return Result(spec, design.status, design.message)


__all__ = ["Report", "Supplement", "empty_result", "json_bytes", "report_on", "worst"]
