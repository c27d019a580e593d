"""A sweep: its request, its plan of points, and the files that it writes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.errors import UsageError
from cfmkit.families import family
from cfmkit.studies.delivered_design import run_design
from cfmkit.studies.engine import Work
from cfmkit.studies.plan import MOST_POINTS, Draw, grid, sample_axes, zip_axes
from cfmkit.studies.point_evaluation import Study, metrics_of, sample_curve
from cfmkit.studies.summary_and_tables import Summary, curves_csv, main_columns, results_csv
from cfmkit.studies.variations import WantedVariation, axes, collect_variations, length_to_vary

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.specs.spec import Spec
    from cfmkit.specs.study_spec import Combine
    from cfmkit.store.safe_disk_changes import Data
    from cfmkit.studies.engine import Records
    from cfmkit.studies.plan import Plan

MOST_CURVES = 100  # curves in one picture; of studies with more points only the metrics are drawn
NOTHING_TO_VARY = "nothing to vary: give --vary '{example}', or add a block 'sweep: {vary: {...}}' to the spec"


@dataclass(frozen=True)
class SweepRequest:
    """Options of a sweep; what is left out follows the specification's block `sweep`."""

    # what varies; none: as in the specification. What is given replaces all of that
    vary: tuple[WantedVariation, ...] = ()
    combine: Combine | None = None  # how values are combined
    samples: int | None = None  # points that are drawn
    # design, curves: whether to design anew at each point, and to keep every curve
    design: bool | None = None
    curves: bool | None = None
    metrics: tuple[str, ...] = ()  # columns; none: as in the specification, else all
    seed: int = 0  # random seed
    most: int = MOST_POINTS  # points that are allowed
    pictures: bool = False  # whether pictures will be drawn: those of one parameter show curves


def prepare(spec: Spec, request: SweepRequest) -> Work:
    """Return what a sweep has to do, with everything checked that can be before a point is computed.

    Raises UsageError if there is nothing to vary, too much, or a metric that does not exist; SpecError if a path or
    value is wrong.
    """
    block = spec.sweep
    asked = request.vary or (collect_variations(block.vary) if block else ())
    if not asked:
        raise UsageError(NOTHING_TO_VARY.replace("{example}", _example(spec)))
    plan = _make_plan(spec, request, asked)
    design = _is_given(request.design, block.design if block else False)
    drawn = request.pictures and len(plan.variables) == 1 and len(plan) <= MOST_CURVES
    curves = writes_curves(spec, request) or drawn
    if design and family(spec.family).design is None:
        raise UsageError(f"{family(spec.family).phrase} cannot be designed, only analysed")
    names = request.metrics or (block.metrics if block else ())
    metrics = metrics_of(spec, names, sample_curve(spec, plan, design))
    return Work(Study(spec, plan.paths, metrics, design, curves, request.seed, make_design=run_design), plan)


def _example(spec: Spec) -> str:
    """Return how a length of a specification's own mechanism is varied, by a tenth down and up."""
    path, value = length_to_vary(spec)
    return f"{path}={0.9 * value:.4g} mm:{1.1 * value:.4g} mm:5"


def writes_curves(spec: Spec, request: SweepRequest) -> bool:
    """Return whether curves.csv is requested."""
    return _is_given(request.curves, spec.sweep.curves if spec.sweep else False)


def _is_given(option: bool | None, otherwise: bool) -> bool:
    return otherwise if option is None else option


def _make_plan(spec: Spec, request: SweepRequest, asked: tuple[WantedVariation, ...]) -> Plan:
    block = spec.sweep
    combine, samples = request.combine, request.samples
    if combine is None:
        combine = block.combine if block and not request.vary else "grid"
        samples = block.samples if block and not request.vary else None
    if combine == "grid":
        return grid(axes(spec, asked), request.most)
    if combine == "zip":
        return zip_axes(axes(spec, asked, joint=True), request.most)
    return sample_axes(axes(spec, asked, drawn=True), _read_draw(combine, samples, request.seed), request.most)


def _read_draw(combine: str, samples: int | None, seed: int) -> Draw:
    if samples is None or samples < 1:
        raise UsageError(f"how many points are to be drawn? Write --sample {combine}:256")
    return Draw(combine, samples, seed)


def summary_of(records: Records) -> Summary:
    """Return an empty summary for the rows of a study."""
    study = records.work.study
    return Summary(study, main_columns(study, family(study.spec.family).outputs.headline))


def outputs(records: Records, summary: Summary, curves: bool = False) -> Iterator[tuple[str, Data]]:
    """Yield every file of a sweep but the pictures as (name, content); the summary is filled on the way."""
    from cfmkit.specs.yamlio import dump
    from cfmkit.tables.csv_and_json import json_bytes

    study = records.work.study
    yield "results.csv", results_csv(records, summary.add)
    if curves:
        yield "curves.csv", curves_csv(records)
    yield "metrics.json", json_bytes(summary.as_json(records) | {"drawn": _picture_data(records, summary)})
    yield "resolved.yaml", dump(family(study.spec.family).resolve(study.spec), complete=True).encode()


def _picture_data(records: Records, summary: Summary) -> dict[str, Any]:
    """Return what the pictures of a sweep show: so they can be drawn again from its files, in a figure of several."""
    study, plan = records.work.study, records.work.plan
    shown = [study.metrics[column] for column in summary.shown]
    return {
        "varied": [
            {
                "path": variable.path,
                "dimension": variable.dimension,
                "words": [*map(str, variable.shown)] if variable.dimension == "text" else [],
            }
            for variable in plan.variables
        ],
        "grid": [] if plan.joint else [len(variable.values) for variable in plan.variables],
        "metrics": [
            {"name": metric.name, "column": metric.label, "dimension": metric.dimension, "words": list(metric.words)}
            for metric in shown
        ],
    }
