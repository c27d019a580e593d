"""Sweeps and sensitivity studies as Python asks for them: with blocks of a file, or arrays of NumPy, in memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import QuantityError, UsageError
from cfmkit.specs.units import format_quantity
from cfmkit.studies.plan import MOST_POINTS
from cfmkit.studies.serial_and_cluster_executors import serial
from cfmkit.studies.study_result import StudyResult
from cfmkit.studies.variable_paths import CannotVary, leaf
from cfmkit.tables import read_csv

if TYPE_CHECKING:
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.serial_and_cluster_executors import Executor


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
    from cfmkit.studies.parts.uncertain_values import with_options
    from cfmkit.studies.sensitivity.output import outputs
    from cfmkit.studies.sensitivity.run_sensitivity_method import carry_out
    from cfmkit.studies.sensitivity.setup import prepare

    if block:
        asked = dict(block)
        if isinstance(asked.get("parameters"), Mapping):
            asked["parameters"] = {path: in_words(it, spec, path) for path, it in asked["parameters"].items()}
        spec = spec.replace({"sensitivity": with_options(spec.sensitivity, asked)})
    found = carry_out(prepare(spec), partial(_computed, _executor(jobs)))
    return replace(_read(outputs(found)), spec=found.setup.study.spec, findings=found)


def _computed(executor: Executor, work: Work) -> Records:
    """Return the records of a piece of work."""
    from cfmkit.studies.engine import run

    return run(work, executor)


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
    """Return the dimension of a value; None if it has none, or the path is wrong, which others tell better."""
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
