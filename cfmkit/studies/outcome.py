"""What a study gives to a program: the same tables and the same summary as its files, in memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.errors import UsageError
from cfmkit.studies.executors import serial
from cfmkit.tables import read_csv

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.spec import Spec
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.executors import Executor
    from cfmkit.tables import Table


@dataclass(frozen=True)
class StudyResult:
    """The outcome of a sweep or a sensitivity study, in border units (mm, N, ...).

    Attributes
    ----------
    table : Table
        As results.csv: one row a point. ``table["force_ripple"]`` is a column.
    summary : mapping
        As metrics.json.
    curves : Table, optional
        As curves.csv, of a sweep that keeps them.
    indices, convergence : Table, optional
        As indices.csv and convergence.csv, of a sensitivity study.
    """

    table: Table
    summary: Mapping[str, Any]
    curves: Table | None = None
    indices: Table | None = None
    convergence: Table | None = None

    def to_pandas(self) -> Any:
        """Return the points as a `pandas.DataFrame`, columns headed ``force_mean [N]``."""
        import pandas as pd

        return pd.DataFrame(dict(self.table.as_dict()))


def swept(spec: Spec, jobs: int, block: Mapping[str, Any]) -> StudyResult:
    """Return a sweep; see `cfmkit.sweep`."""
    from cfmkit.studies.engine import run
    from cfmkit.studies.sweep import Request, outputs, prepare, summary_of

    asked = dict(block)
    seed = _seed(asked.pop("seed", 0))
    if asked:
        spec = spec.replace({"sweep": asked})
    request = Request(seed=seed)
    work = prepare(spec, request)
    records = run(work, _executor(jobs))
    curves = spec.sweep is not None and spec.sweep.curves
    return _read(outputs(records, summary_of(records), curves))


def examined(spec: Spec, jobs: int, block: Mapping[str, Any]) -> StudyResult:
    """Return a sensitivity study; see `cfmkit.sensitivity`."""
    from cfmkit.studies.engine import run
    from cfmkit.studies.sensitivity.methods import carry_out
    from cfmkit.studies.sensitivity.output import outputs
    from cfmkit.studies.sensitivity.parameters import with_options
    from cfmkit.studies.sensitivity.setup import prepare

    if block:
        spec = spec.replace({"sensitivity": with_options(spec.sensitivity, dict(block))})
    executor = _executor(jobs)

    def compute(work: Work) -> Records:
        return run(work, executor)

    return _read(outputs(carry_out(prepare(spec), compute)))


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
    return StudyResult(tables.pop("results"), json.loads(found["metrics.json"]), **tables)
