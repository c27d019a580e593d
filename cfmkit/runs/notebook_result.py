"""Results as a notebook shows them: metrics, requirements and one figure, in a few kilobytes.

What `cfmkit.analyze` gives back is an `AnalysisView`: a `Result` that also measures itself when it is asked to.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING

from cfmkit.arrays import Named, Several
from cfmkit.families import family
from cfmkit.results import Result

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.metrics import Outcome
    from cfmkit.results import Quantity


@dataclass(frozen=True, repr=False)
class AnalysisView(Result):
    """A result with its metrics and requirements, computed when they are first needed."""

    @classmethod
    def of(cls, result: Result) -> AnalysisView:
        """Return a result as an analysis."""
        return cls(**{item.name: getattr(result, item.name) for item in fields(result)})

    @cached_property
    def metrics(self) -> Mapping[str, Quantity]:
        """Every metric and scalar result by name, in SI: ``result.metrics["force_mean"].value``."""
        from cfmkit.metrics import evaluate

        return Named(evaluate(self))

    @cached_property
    def requirements(self) -> tuple[Outcome, ...]:
        """Outcome of each requirement of the specification."""
        from cfmkit.metrics import check, values_of_family

        return Several(check(self.spec.part_requirements, self, values_of_family(family(self.spec.family).values)))

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        from cfmkit.documents.notebook import shown
        from cfmkit.documents.run_document import document_of
        from cfmkit.documents.run_outcome import Report
        from cfmkit.plots.figures import figures

        report = Report(self, self.metrics, self.requirements)
        return shown(document_of(report), figures(family(self.spec.family), self))
