"""Results of Python functions with metrics and requirements when they are read, a plot, and a view in notebooks.

`cfmkit.analyze` returns an `AnalysisView`, which is a `Result`. A notebook shows it by the document that the command
line prints.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING

from cfmkit.arrays import Named, Several
from cfmkit.families import family
from cfmkit.results import Quantity, Result

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from cfmkit.metrics import Outcome


class Metrics(Named[Quantity]):
    """Metrics by name; a notebook shows all of them as a table."""

    def __missing__(self, name: str) -> Quantity:
        """Raise KeyError with the metric that may be meant."""
        from cfmkit.specs.yamlio import did_you_mean

        raise KeyError(f"there is no metric {name!r}; {did_you_mean(name, list(self)) or '`cfmkit show metrics`'}")

    def _repr_html_(self) -> str:
        """Return the table: a row a metric, a column a branch."""
        from cfmkit.documents.notebook import table_of
        from cfmkit.documents.run_document import metrics_table

        return table_of(metrics_table(self))


class Requirements(Several["Outcome"]):
    """Outcomes of requirements, in the order of the specification; a notebook shows them as a table."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        """Return the table: a row a requirement."""
        from cfmkit.documents.notebook import table_of
        from cfmkit.documents.run_document import requirements_table

        return table_of(requirements_table(self))


@dataclass(frozen=True, repr=False)
class AnalysisView(Result):
    """A result with its metrics and requirements, computed when they are first needed."""

    @classmethod
    def from_result(cls, result: Result) -> AnalysisView:
        """Return a result as an analysis."""
        return cls(**{item.name: getattr(result, item.name) for item in fields(result)})

    @cached_property
    def metrics(self) -> Mapping[str, Quantity]:
        """Every metric and scalar result by name, in SI: ``result.metrics["force_mean"].value``."""
        from cfmkit.metrics import evaluate

        return Metrics(evaluate(self))

    @cached_property
    def requirements(self) -> Sequence[Outcome]:
        """Outcome of each requirement of the specification."""
        return Requirements(family(self.spec.family).check(self))

    def plot(self, ax: Axes | None = None, *, bands: bool = True, names: bool = True, arrows: bool = True) -> Axes:
        """Draw force over displacement, or torque over angle, and return the axes.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            To draw on, as one of several in a figure of your own; default: a new figure of `matplotlib.pyplot`,
            160 x 100 mm, which a notebook shows.
        bands : bool
            Shade what the requirements allow.
        names : bool
            Write the names of branches, bands and levels beside them.
        arrows : bool
            Draw an arrow along each branch, in the direction of the motion.

        Raises
        ------
        cfmkit.errors.SolutionError
            If nothing was solved.
        """
        from cfmkit.plots.curves import CurveLook, plot_curve
        from cfmkit.plots.style import new_axes

        _ = self.curve  # the error says why there is none
        return plot_curve(self, new_axes() if ax is None else ax, CurveLook(bands, names, arrows))

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        from cfmkit.documents.notebook import show_html
        from cfmkit.documents.run_document import document_of
        from cfmkit.documents.run_outcome import Report
        from cfmkit.plots.figures import figures

        report = Report(self, self.metrics, tuple(self.requirements))
        return show_html(document_of(report), figures(family(self.spec.family), self))
