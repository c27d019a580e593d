"""Outcome of a study for a program: the same tables and the same summary as its files, in memory."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import shorten_values
from cfmkit.documents.document import Document

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.specs.spec import Spec
    from cfmkit.studies.sensitivity.result_types import Findings
    from cfmkit.tables import Table


@dataclass(frozen=True)
class StudyResult:
    """The outcome of a sweep or a sensitivity study, in border units (mm, N, ...)."""

    table: Table  # as results.csv: one row per point. ``table["force_ripple"]`` is a column
    summary: Mapping[str, Any]  # as metrics.json
    curves: Table | None = None  # as curves.csv, of a sweep that keeps them
    # indices, convergence: as indices.csv and convergence.csv, of a sensitivity study
    indices: Table | None = None
    convergence: Table | None = None
    varied: tuple[str, ...] = ()  # headers of the columns that were varied
    spec: Spec | None = None  # what was varied
    # what a sensitivity study found, which its pictures are drawn from
    findings: Findings | None = field(default=None, repr=False, compare=False)
    # what the command line prints of it
    document: Document = field(default_factory=Document, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Keep the texts of what is inside short."""
        object.__setattr__(self, "summary", shorten_values(self.summary))

    def __repr__(self) -> str:
        """Return the study in a line."""
        return f"<StudyResult: {self.summary.get('message', '')}; {self.table!r}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the document of the study, a figure, and the first points."""
        from cfmkit.documents.notebook import show_html
        from cfmkit.tables.html import first_rows

        return show_html(self.document, self.figures, first_rows(self.table))

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
