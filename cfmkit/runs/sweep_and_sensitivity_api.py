"""Sweeps and sensitivity studies as Python asks for them, and their outcome in memory: tables, summary, figures.

Blocks of a file, or arrays of NumPy, go in; the same tables and the same summary as in a study's files come out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.api import given_arguments, spec_of
from cfmkit.arrays import shorten_values
from cfmkit.documents.document import Document
from cfmkit.errors import QuantityError, UsageError
from cfmkit.specs.further_metrics import names_of
from cfmkit.specs.units import format_quantity
from cfmkit.studies.plan import MOST_POINTS
from cfmkit.studies.serial_and_cluster_executors import serial
from cfmkit.studies.variations import CannotVary, leaf
from cfmkit.tables import read_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from matplotlib.figure import Figure

    from cfmkit.api import AnySpec, Metric
    from cfmkit.specs.sensitivity_methods import MethodWord
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.study_spec import Combine
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.sensitivity.result_types import Findings
    from cfmkit.studies.serial_and_cluster_executors import Executor
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
        from cfmkit.studies.pictures import list_pictures_of_tables

        return list_pictures_of_tables(self.spec, self.summary, self.table, self.curves)

    def to_pandas(self) -> Any:
        """Return the points as a `pandas.DataFrame`, columns headed ``force_mean [N]``."""
        from cfmkit.tables.table import library

        return library("pandas", "to_pandas").DataFrame(dict(self.table.as_dict()))

    def to_xarray(self) -> Any:
        """Return the points as an `xarray.Dataset`: one dimension per varied value where they are a grid.

        Points that are no grid stand along the dimension ``point``. Units stand in the attribute ``units``.
        """
        from cfmkit.tables.table import library

        xarray = library("xarray", "to_xarray")
        frame = self.to_pandas()
        axes = list(self.varied)
        size = int(np.prod([frame[name].nunique() for name in axes])) if axes else 0
        if axes and size == len(frame) and not frame.duplicated(axes).any():
            dataset = xarray.Dataset.from_dataframe(frame.set_index(axes))
        else:
            dataset = xarray.Dataset.from_dataframe(frame.rename_axis("point"))
        units = {column.header: column.unit for column in self.table.columns}
        dataset = dataset.rename({header: header.partition(" [")[0] for header in units if header in dataset.variables})
        for header, unit in units.items():
            if unit is not None:
                dataset[header.partition(" [")[0]].attrs["units"] = unit
        return dataset


def sweep(
    spec: AnySpec,
    jobs: int = 1,
    *,
    vary: Mapping[str, Any] | None = None,
    combine: Combine | None = None,
    samples: int | None = None,
    metrics: Iterable[Metric] | None = None,
    design: bool | None = None,
    curves: bool | None = None,
    seed: int = 0,
) -> StudyResult:
    """Return a mechanism in many variants: one row per point, whether it could be solved or not.

    Parameters
    ----------
    spec : Spec or path-like
        What is varied.
    jobs : int
        Processes.
    vary : mapping, optional
        Path -> ``"start:stop:n"``, a list of texts with units, or a NumPy array in SI units. This and the next ones
        replace the specification's block `sweep`; without any of them the block counts.
    combine : str, optional
        All combinations (``"grid"``), values in step (``"zip"``), or points that are drawn: one of the words of
        `cfmkit.numerics.unit_cube_samples.SAMPLE_KINDS`, as ``"lhs"`` or ``"sobol"``.
    samples : int, optional
        Points that are drawn.
    metrics : iterable of str or callable, optional
        Columns: names, or functions of a `Result` (see `metric`). Default: all.
    design : bool, optional
        Design the mechanism anew at each point.
    curves : bool, optional
        Keep the curve of every point.
    seed : int
        Random seed.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is nothing to vary, too much, or a metric that does not exist.
    cfmkit.errors.SpecError
        If a path or value is wrong.

    Examples
    --------
    >>> import cfmkit
    >>> spec = cfmkit.load("configs/cam.yaml")
    >>> vary = {"mechanism.springs.stiffness": ["0.5 N/mm", "1 N/mm"]}
    >>> cfmkit.sweep(spec, vary=vary, metrics=["theoretical_force"]).table["theoretical_force"].tolist()
    [36.232, 72.464]
    """
    from cfmkit.documents.study_documents import sweep_document
    from cfmkit.studies.engine import run
    from cfmkit.studies.sweep_request_and_files import SweepRequest, outputs, prepare, summary_of

    spec = spec_of(spec)
    if isinstance(vary, Mapping):
        vary = {path: write_values(values, spec, path) for path, values in vary.items()}
    block = given_arguments(
        vary=vary, combine=combine, samples=samples, metrics=names_of(metrics), design=design, curves=curves
    )
    if block:
        spec = spec.replace({"sweep": block})
    work = prepare(spec, SweepRequest(seed=_require_seed(seed)))
    records = run(work, _choose_executor(jobs))
    summary = summary_of(records)
    result = _read_result(outputs(records, summary, spec.sweep is not None and spec.sweep.curves))
    dimensions = {metric.name: metric.dimension for metric in work.study.metrics}
    document = sweep_document(spec, result.summary, dimensions, summary.exit_code())
    varied = tuple(result.table.headers[: len(work.plan.variables)])
    return replace(result, varied=varied, spec=spec, document=document)


def sensitivity(
    spec: AnySpec,
    jobs: int = 1,
    *,
    method: MethodWord | None = None,
    parameters: Mapping[str, Any] | None = None,
    correlated: Sequence[Mapping[str, Any]] | None = None,
    samples: int | None = None,
    sampling: str | None = None,
    metrics: Iterable[Metric] | None = None,
    min_yield: str | float | None = None,
    costs: Mapping[str, float] | None = None,
    design: bool | None = None,
    seed: int | None = None,
) -> StudyResult:
    """Return the influence of each value, or the yield of manufactured parts.

    Parameters
    ----------
    spec : Spec or path-like
        What is varied.
    jobs : int
        Processes.
    method : str, optional
        One of the words of `cfmkit.specs.sensitivity_methods.METHOD_NAMES`, as ``"sobol"`` or ``"tolerance"``. This
        and the next ones replace the values of the specification's block `sensitivity`.
    parameters : mapping, optional
        Path -> a range ``["199 mm", "201 mm"]`` or a tolerance ``{"normal": "0.1 mm"}``.
    correlated : sequence of mapping, optional
        Parameters that deviate together: ``{"parameters": [...], "correlation": 1.0}``.
    samples : int, optional
        Points per parameter, trajectories, base samples or parts.
    sampling : str, optional
        How they are drawn, one of the words of `cfmkit.numerics.unit_cube_samples.SAMPLE_KINDS`; default: parts at
        random, base samples from a Sobol sequence.
    metrics : iterable of str or callable, optional
        Names, or functions of a `Result` (see `metric`). Default: those of the requirements.
    min_yield : str or float, optional
        Share of parts that must meet all requirements.
    costs : mapping, optional
        Of the method inverse: path -> what its tolerance costs, over its width.
    design : bool, optional
        Design the mechanism anew at each sample.
    seed : int, optional
        Random seed.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is nothing to vary, too much, or a metric that does not exist.
    cfmkit.errors.SpecError
        If a path or value is wrong.
    cfmkit.errors.SolutionError
        If the specification itself has no solution.

    Examples
    --------
    >>> import cfmkit
    >>> spec = cfmkit.load("configs/cam.yaml")
    >>> parameters = {"mechanism.springs.stiffness": {"normal": "1 %"}}
    >>> found = cfmkit.sensitivity(spec, method="tolerance", samples=20, parameters=parameters)
    >>> found.summary["yield"]["value"]
    0.8
    """
    from cfmkit.documents.study_documents import sensitivity_document
    from cfmkit.studies.parts.uncertain_values import with_options
    from cfmkit.studies.sensitivity.run_and_files import carry_out, outputs
    from cfmkit.studies.sensitivity.setup import prepare

    spec = spec_of(spec)
    if isinstance(parameters, Mapping):
        parameters = {path: write_values(values, spec, path) for path, values in parameters.items()}
    block = given_arguments(
        method=method,
        parameters=parameters,
        correlated=correlated,
        samples=samples,
        sampling=sampling,
        metrics=names_of(metrics),
        min_yield=min_yield,
        costs=costs,
        design=design,
        seed=seed,
    )
    if block:
        spec = spec.replace({"sensitivity": with_options(spec.sensitivity, block)})
    findings = carry_out(prepare(spec), partial(_run_work, _choose_executor(jobs)))
    return replace(
        _read_result(outputs(findings)),
        spec=findings.setup.study.spec,
        findings=findings,
        document=sensitivity_document(findings),
    )


def _run_work(executor: Executor, work: Work) -> Records:
    """Return the records of a piece of work."""
    from cfmkit.studies.engine import run

    return run(work, executor)


def write_values(values: Any, spec: Spec, path: str) -> Any:
    """Return what a file would say for values from NumPy: numbers of a dimension are in SI units, as in results.

    A range is the list of its numbers. What is not from NumPy has no unit where it is a bare number, as in a file.

    Raises UsageError if an array has more than one dimension, a value is not finite, or a range has more values than a
    study points.
    """
    if isinstance(values, range):
        if values[MOST_POINTS:]:
            raise UsageError(f"{path}: a range of more than {MOST_POINTS} values; take fewer")
        return list(values)
    if isinstance(values, Mapping):
        return {key: write_values(value, spec, path) for key, value in values.items()}
    if isinstance(values, list | tuple) and any(isinstance(value, np.generic | np.ndarray) for value in values):
        return [write_values(value, spec, path) for value in values]
    if isinstance(values, np.ndarray):
        if values.ndim > 1:
            raise UsageError(f"{path}: an array of {values.ndim} dimensions is not a list of values; flatten it")
        values = values[()]
    if isinstance(values, np.ndarray):
        return [write_values(value, spec, path) for value in values]
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
    """Return the dimension of a value; None if it has none, or the path is wrong, which others tell better."""
    try:
        quantity = leaf(type(spec), path).quantity
    except CannotVary:
        return None
    return quantity.dimensions[0] if quantity else None


def _require_seed(seed: Any) -> int:
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise UsageError(f"seed: {seed!r} is not allowed: must be a whole number >= 0")
    return seed


def _choose_executor(jobs: int) -> Executor:
    if jobs < 1:
        raise UsageError(f"jobs: {jobs} is not allowed: must be >= 1")
    from cfmkit.studies.pool import Pool

    return serial if jobs == 1 else Pool(jobs)


def _read_result(files: Any) -> StudyResult:
    """Return what the files of a study would say."""
    import json

    contents = {name: data if isinstance(data, bytes) else b"".join(data) for name, data in files}
    tables = {name.removesuffix(".csv"): read_csv(data) for name, data in contents.items() if name.endswith(".csv")}
    curves, indices, convergence = map(tables.get, ("curves", "indices", "convergence"))
    return StudyResult(tables["results"], json.loads(contents["metrics.json"]), curves, indices, convergence)
