"""What a study gives to a program: the same tables and the same summary as its files, in memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import named
from cfmkit.errors import QuantityError, UsageError
from cfmkit.specs.units import format_quantity
from cfmkit.studies.plan import MOST_POINTS
from cfmkit.studies.serial_and_cluster_executors import serial
from cfmkit.studies.variable_paths import CannotVary, leaf
from cfmkit.tables import read_csv

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.specs.spec import Spec
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.serial_and_cluster_executors import Executor
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
    """

    table: Table
    summary: Mapping[str, Any]
    curves: Table | None = None
    indices: Table | None = None
    convergence: Table | None = None
    varied: tuple[str, ...] = ()
    spec: Spec | None = None

    def __post_init__(self) -> None:
        """Keep the texts of what is inside short."""
        object.__setattr__(self, "summary", named(self.summary))

    def __repr__(self) -> str:
        """Return the study in a line."""
        return f"<StudyResult: {self.summary.get('message', '')}; {self.table!r}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: how the study ended, its best point, requirements, a figure, first points."""
        from html import escape

        from cfmkit.tables.html import first_rows, html_table

        parts = [f"<p>{escape(str(self.summary.get('message', '')))}</p>"]
        if best := self.summary.get("best"):
            told = ", ".join(f"{path} {value}" for path, value in best["values"].items())
            parts.append(f"<p>{escape(told)}: {escape(best['sense'])} {escape(best['by'].replace('_', ' '))}</p>")
            rows = [(name, _told(one), one["definition"]) for name, one in self.summary["metrics"].items()]
            parts.append(html_table(("metric of the best point", "value", "what it is"), rows[:MOST_TOLD]))
        required = [one for one in self.summary.get("requirements", ()) if "of" in one]
        if required:
            met = [(f"{one['metric']}{_bounds(one)}", f"{one['met']} of {one['of']}") for one in required]
            parts.append(html_table(("requirement", "points that meet it"), met))
        return f"<div>{''.join(parts)}{self._picture()}{first_rows(self.table)}</div>"

    @property
    def figures(self) -> Mapping[str, Callable[[], Figure]]:
        """What draws each picture of a sweep, by its name: ``study.figures["force_mean"]()``."""
        if self.spec is None or "drawn" not in self.summary:
            return {}
        from cfmkit.studies.pictures import makers_of_tables

        return makers_of_tables(self.spec, self.summary, self.table, self.curves)

    def _picture(self) -> str:
        """Return the first picture as SVG; nothing where there is none."""
        from cfmkit.plots.vector_formats import inline, svg

        name, draw = next(iter(self.figures.items()), ("", None))
        return "" if draw is None else inline(svg(draw()), name)

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


def _told(metric: Mapping[str, Any]) -> str:
    value, unit = metric["value"], metric["unit"]
    if not isinstance(value, float | int):
        return "" if value is None else str(value)
    return f"{value:.5g}" + (f" {unit}" if unit not in (None, "", "1") else "")


def _bounds(one: Mapping[str, Any]) -> str:
    low, high = (
        f" {sign} {one[end]}" if one.get(end) is not None else "" for sign, end in ((">=", "min"), ("<=", "max"))
    )
    return low + high


def swept(spec: Spec, jobs: int, block: Mapping[str, Any]) -> StudyResult:
    """Return a sweep; see `cfmkit.sweep`."""
    from cfmkit.studies.engine import run
    from cfmkit.studies.sweep_request_and_files import SweepRequest, outputs, prepare, summary_of

    asked = dict(block)
    seed = _seed(asked.pop("seed", 0))
    if isinstance(asked.get("vary"), Mapping):
        asked["vary"] = {path: in_words(values, spec, path) for path, values in asked["vary"].items()}
    if asked:
        spec = spec.replace({"sweep": asked})
    request = SweepRequest(seed=seed)
    work = prepare(spec, request)
    records = run(work, _executor(jobs))
    curves = spec.sweep is not None and spec.sweep.curves
    found = _read(outputs(records, summary_of(records), curves))
    return replace(found, varied=tuple(found.table.headers[: len(work.plan.variables)]), spec=spec)


def examined(spec: Spec, jobs: int, block: Mapping[str, Any]) -> StudyResult:
    """Return a sensitivity study; see `cfmkit.sensitivity`."""
    from cfmkit.studies.engine import run
    from cfmkit.studies.sensitivity.methods import carry_out
    from cfmkit.studies.sensitivity.output import outputs
    from cfmkit.studies.sensitivity.parameters import with_options
    from cfmkit.studies.sensitivity.setup import prepare

    if block:
        asked = dict(block)
        if isinstance(asked.get("parameters"), Mapping):
            asked["parameters"] = {path: in_words(it, spec, path) for path, it in asked["parameters"].items()}
        spec = spec.replace({"sensitivity": with_options(spec.sensitivity, asked)})
    executor = _executor(jobs)

    def compute(work: Work) -> Records:
        return run(work, executor)

    return _read(outputs(carry_out(prepare(spec), compute)))


def in_words(values: Any, spec: Spec, path: str) -> Any:
    """Return what a file would say for values from NumPy: numbers of a dimension are in SI units, as in results.

    A range is the list of its numbers. What is not from NumPy has no unit where it is a bare number, as in a file.

    Raises
    ------
    cfmkit.errors.UsageError
        If an array has more than one dimension, a value is not finite, or a range has more values than a study points.
    """
    if isinstance(values, range):
        if values[MOST_POINTS:]:
            raise UsageError(f"{path}: a range of more than {MOST_POINTS} values; take fewer")
        return list(values)
    if isinstance(values, Mapping):
        return {key: in_words(value, spec, path) for key, value in values.items()}
    if isinstance(values, list | tuple) and any(isinstance(value, np.generic | np.ndarray) for value in values):
        return [in_words(value, spec, path) for value in values]
    if isinstance(values, np.ndarray):
        if values.ndim > 1:
            raise UsageError(f"{path}: an array of {values.ndim} dimensions is not a list of values; flatten it")
        values = values[()]
    if isinstance(values, np.ndarray):
        return [in_words(value, spec, path) for value in values]
    if not isinstance(values, np.generic):
        return values
    dimension = _dimension(spec, path)
    plain = values.item()
    if dimension in (None, "ratio") or not isinstance(plain, int | float) or isinstance(plain, bool):
        return plain
    try:
        return format_quantity(plain, dimension)
    except QuantityError as error:
        raise UsageError(f"{path}: {error}") from None


def _dimension(spec: Spec, path: str) -> str | None:
    """Return the dimension of a value; None where it has none, or the path is wrong, which others tell better."""
    try:
        quantity = leaf(type(spec), path).quantity
    except CannotVary:
        return None
    return quantity.dimensions[0] if quantity else None


def _seed(seed: Any) -> int:
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise UsageError(f"seed: {seed!r} is not allowed: must be a whole number >= 0")
    return seed


def _executor(jobs: int) -> Executor:
    if jobs < 1:
        raise UsageError(f"jobs: {jobs} is not allowed: must be >= 1")
    from cfmkit.studies.pool import Pool

    return serial if jobs == 1 else Pool(jobs)


def _read(files: Any) -> StudyResult:
    """Return what the files of a study would say."""
    import json

    found = {name: data if isinstance(data, bytes) else b"".join(data) for name, data in files}
    tables = {name.removesuffix(".csv"): read_csv(data) for name, data in found.items() if name.endswith(".csv")}
    curves, indices, convergence = map(tables.get, ("curves", "indices", "convergence"))
    return StudyResult(tables["results"], json.loads(found["metrics.json"]), curves, indices, convergence)
