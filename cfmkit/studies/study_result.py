"""Outcome of a study for a program: the same tables and the same summary as its files, in memory."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import named

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.specs.spec import Spec
    from cfmkit.studies.sensitivity.result_types import Findings
    from cfmkit.tables import Table


@dataclass(frozen=True)
class StudyResult:
    """The outcome of a sweep or a sensitivity study, in border units (mm, N, ...).

    Attributes
    ----------
    table : Table
        As results.csv: one row per point. ``table["force_ripple"]`` is a column.
    summary : mapping
        As metrics.json.
    curves : Table, optional
        As curves.csv, of a sweep that keeps them.
    indices, convergence : Table, optional
        As indices.csv and convergence.csv, of a sensitivity study.
    varied : tuple of str
        Headers of the columns that were varied.
    spec : Spec, optional
        What was varied.
    findings : Findings, optional
        What a sensitivity study found, which its pictures are drawn from.
    """

    table: Table
    summary: Mapping[str, Any]
    curves: Table | None = None
    indices: Table | None = None
    convergence: Table | None = None
    varied: tuple[str, ...] = ()
    spec: Spec | None = None
    findings: Findings | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Keep the texts of what is inside short."""
        object.__setattr__(self, "summary", named(self.summary))

    def __repr__(self) -> str:
        """Return the study in a line."""
        return f"<StudyResult: {self.summary.get('message', '')}; {self.table!r}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: how the study ended, its best point, requirements, a figure, first points."""
        from html import escape

        from cfmkit.plots.vector_formats import first_picture
        from cfmkit.tables.html import first_rows, html_table

        parts = [f"<p>{escape(str(self.summary.get('message', '')))}</p>"]
        if best := self.summary.get("best"):
            reported = ", ".join(f"{path} {value}" for path, value in best["values"].items())
            parts.append(f"<p>{escape(reported)}: {escape(best['sense'])} {escape(best['by'].replace('_', ' '))}</p>")
            rows = [(name, _reported(one), one["definition"]) for name, one in self.summary["metrics"].items()]
            parts.append(html_table(("metric of the best point", "value", "what it is"), rows[:MOST_TOLD]))
        required = [one for one in self.summary.get("requirements", ()) if "of" in one]
        if required:
            met = [(f"{one['metric']}{_bounds(one)}", f"{one['met']} of {one['of']}") for one in required]
            parts.append(html_table(("requirement", "points that meet it"), met))
        return f"<div>{''.join(parts)}{first_picture(self.figures)}{first_rows(self.table)}</div>"

    @property
    def figures(self) -> Mapping[str, Callable[[], Figure]]:
        """Functions that draw each picture of a study, by its name: ``study.figures["force_mean"]()``."""
        if self.findings is not None:
            from cfmkit.plots.sensitivity import figures

            return figures(self.findings)
        if self.spec is None or "drawn" not in self.summary:
            return {}
        from cfmkit.studies.pictures import makers_of_tables

        return makers_of_tables(self.spec, self.summary, self.table, self.curves)

    def to_pandas(self) -> Any:
        """Return the points as a `pandas.DataFrame`, columns headed ``force_mean [N]``."""
        from cfmkit.tables.optional_libraries import library

        return library("pandas", "to_pandas").DataFrame(dict(self.table.as_dict()))

    def to_xarray(self) -> Any:
        """Return the points as an `xarray.Dataset`: one dimension per varied value where they are a grid.

        Points that are no grid stand along the dimension ``point``. Units stand in the attribute ``units``.
        """
        from cfmkit.tables.optional_libraries import library

        xarray = library("xarray", "to_xarray")
        frame = self.to_pandas()
        axes = list(self.varied)
        size = int(np.prod([frame[name].nunique() for name in axes])) if axes else 0
        if axes and size == len(frame) and not frame.duplicated(axes).any():
            found = xarray.Dataset.from_dataframe(frame.set_index(axes))
        else:
            found = xarray.Dataset.from_dataframe(frame.rename_axis("point"))
        units = {column.header: column.unit for column in self.table.columns}
        found = found.rename({header: header.partition(" [")[0] for header in units if header in found.variables})
        for header, unit in units.items():
            if unit is not None:
                found[header.partition(" [")[0]].attrs["units"] = unit
        return found


MOST_TOLD = 8
"""Metrics of the best point that a notebook shows: more are in `StudyResult.summary`."""


def _reported(metric: Mapping[str, Any]) -> str:
    value, unit = metric["value"], metric["unit"]
    if not isinstance(value, float | int):
        return "" if value is None else str(value)
    return f"{value:.5g}" + (f" {unit}" if unit not in (None, "", "1") else "")


def _bounds(one: Mapping[str, Any]) -> str:
    low, high = (
        f" {sign} {one[end]}" if one.get(end) is not None else "" for sign, end in ((">=", "min"), ("<=", "max"))
    )
    return low + high
