"""Results as a notebook shows them: metrics, requirements and one figure, in a few kilobytes.

What `cfmkit.analyze` gives back is an `AnalysisView`: a `Result` that also measures itself when it is asked to.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING

from cfmkit.arrays import Named, Several
from cfmkit.families import family
from cfmkit.results import Result
from cfmkit.specs.units import format_short
from cfmkit.tables.html import html_table

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
        """What became of each requirement of the specification."""
        from cfmkit.metrics import check, values_of_family

        return Several(check(self.spec.part_requirements, self, values_of_family(family(self.spec.family).values)))

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        from cfmkit.plots.figures import figures
        from cfmkit.plots.vector_formats import first_picture

        parts = [f"<strong>{escape(self.spec.name)}</strong> ({escape(self.spec.family)}): {escape(self.message)}"]
        if self.curves:
            lead = (*family(self.spec.family).leading, "force_mean", "torque_mean", "usable_stroke")
            known = {name: self.metrics[name] for name in dict.fromkeys(lead) if name in self.metrics}
            rows = [(name, _reported(one), one.definition) for name, one in known.items() if one.value is not None]
            parts.append(html_table(("metric", "value", "what it is"), rows))
        if self.requirements:
            met = [(one.sentence, "yes" if one.ok else "no") for one in self.requirements]
            parts.append(html_table(("requirement", "met"), met))
        parts += [f"<p>{escape(one.name)}: {escape(one.message)}</p>" for one in self.warnings]
        return "<div>" + "".join(parts) + first_picture(figures(family(self.spec.family), self)) + "</div>"


def _reported(quantity: Quantity) -> str:
    if quantity.word is not None:
        return quantity.word
    return "" if quantity.value is None else format_short(quantity.value, quantity.dimension)
