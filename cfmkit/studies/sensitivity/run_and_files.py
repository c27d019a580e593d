"""A sensitivity study by its method: draw, evaluate, analyse, state; and its files (results.csv, indices.csv, ...)."""

from __future__ import annotations

from math import isnan
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode
from cfmkit.families import family
from cfmkit.metrics import metrics_json
from cfmkit.results import Finding, Quantity, Status
from cfmkit.studies.sensitivity.evaluation import Evaluator, Interrupted
from cfmkit.studies.sensitivity.method import method_named
from cfmkit.studies.sensitivity.result_types import Findings
from cfmkit.studies.summary_and_tables import results_table
from cfmkit.studies.variations import write_value
from cfmkit.tables import Table, TableColumn, csv_chunks, to_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cfmkit.store.safe_disk_changes import Data
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.parts.uncertain_values import Parameter
    from cfmkit.studies.sensitivity.result_types import IndexLine
    from cfmkit.studies.sensitivity.setup import Setup


def carry_out(
    setup: Setup,  # what to do
    compute: Callable[[Work], Records],  # from `Work` to `Records`: serial, in processes, on a cluster
) -> Findings:
    """Return what a study finds."""
    evaluator = Evaluator(setup.study, setup.parameters, compute, by_role=setup.record.by_role)
    try:
        findings: Findings = setup.record.run(setup, evaluator)
    except Interrupted:
        return Findings(setup, evaluator, interrupted=True)
    return findings


YIELD_DEFINITION = "share of parts that meet every requirement, of those drawn from the tolerances"


def outputs(findings: Findings) -> Iterator[tuple[str, Data]]:
    """Yield every file of a study but the pictures as (name, content)."""
    from cfmkit.specs.yamlio import dump
    from cfmkit.tables.csv_and_json import json_bytes

    spec = findings.setup.study.spec
    yield "results.csv", results_csv(findings)
    if not findings.interrupted:
        yield "indices.csv", to_csv(lines_table(findings.lines))
    if findings.convergence:
        yield "convergence.csv", to_csv(lines_table(findings.convergence))
    yield "metrics.json", json_bytes(as_json(findings))
    yield "resolved.yaml", dump(family(spec.family).resolve(spec), complete=True).encode()


def results_csv(findings: Findings) -> Iterator[bytes]:
    """Yield results.csv: to which block a sample belongs and what it is for, then as in a sweep."""
    first = True
    for piece in findings.evaluator.pieces:
        for indices, rows in piece.records.batches():
            leading = (
                TableColumn("block", piece.blocks[indices]),
                TableColumn("role", tuple(piece.roles[indices].tolist())),
            )
            chunks = csv_chunks(Table((*leading, *results_table(piece.records, indices, rows).columns)))
            header = next(chunks)
            if first:
                yield header
            first = False
            yield from chunks


def lines_table(lines: Sequence[IndexLine]) -> Table:
    """Return indices as a tidy table."""

    def column(name: str) -> TableColumn:
        return TableColumn(name, tuple(getattr(line, name) for line in lines))

    return Table(tuple(map(column, ("metric", "parameter", "index", "value", "low", "high", "unit", "samples"))))


def exit_code(findings: Findings) -> ExitCode:
    """Return the exit code of the process: samples that failed count before requirements that are missed."""
    if findings.interrupted:
        return ExitCode.INTERRUPTED
    evaluator = findings.evaluator
    if evaluator.count and evaluator.failed == evaluator.count and not evaluator.ends[Status.TIMEOUT]:
        alike = (end for end in (Status.CRASHED, Status.INVALID) if evaluator.ends[end] == evaluator.count)
        return next(alike, Status.NO_EQUILIBRIUM).exit_code
    stated = findings.setup.method == "local" and not findings.lacking
    # a tolerance that does not exist is an answer
    if (evaluator.failed and not stated) or (findings.lacking and findings.setup.method != "inverse"):
        return ExitCode.PARTIAL
    missed = not all(outcome.ok for outcome in findings.setup.nominal.outcomes) or not yield_ok(findings)
    return ExitCode.REQUIREMENT_MISSED if missed else ExitCode.OK


def yield_ok(findings: Findings) -> bool:
    """Return whether the yield is what was requested; true if nothing was.

    The tolerances of `inverse` aim at that yield: of parts drawn within them nearly half the times a few less are good.
    They miss it where so many parts rule it out.
    """
    wanted = findings.setup.block.min_yield
    if wanted is None or not method_named(findings.setup.method).draws_parts:
        return True
    share = findings.all_met
    return share is not None and (
        share.value >= wanted or (findings.setup.method == "inverse" and share.wilson[1] >= wanted)
    )


def is_met_by_interval(findings: Findings) -> bool:
    """Return whether the yield is what was requested because its interval has that in it, and not its value."""
    wanted, share = findings.setup.block.min_yield, findings.all_met
    return wanted is not None and share is not None and share.value < wanted and yield_ok(findings)


def message(findings: Findings) -> str:
    """Return the outcome in one sentence."""
    evaluator = findings.evaluator
    reported = f"{findings.setup.method}: {evaluator.count} samples"
    if findings.interrupted:
        of = f"{evaluator.missing} of {evaluator.count + evaluator.missing} samples"
        again = "run the same command again without --fresh" if findings.fresh else "run the same command again"
        return f"{reported}; interrupted: {of} were not computed; {again} to continue"
    if evaluator.failed:
        reported += f", {evaluator.failed} without a result (the first: {evaluator.first_failure})"
    if findings.unstated:
        reported += f"; {findings.unstated} of {len(findings.lines)} indices are not stated"
    return reported


def warnings(findings: Findings) -> tuple[Finding, ...]:
    """Return what the user must know beside the numbers."""
    evaluator, setup = findings.evaluator, findings.setup
    extra = []
    if evaluator.failed:
        reported = f"{evaluator.failed} of {evaluator.count} samples have no result: indices that need them are not "
        reported += "stated, and as parts they count as bad"
        extra.append(Finding("failed_samples", reported))
    elif findings.unstated and not findings.interrupted:
        reported = f"{findings.unstated} indices are not stated: "
        if setup.method == "inverse":
            reported = f"{findings.unstated} tolerances are not stated: even without the error of that parameter, "
            reported += "or of all parameters, the yield would be too low"
        else:
            reported += "samples have no value" if findings.lacking else f"{', '.join(findings.constant)} does not vary"
        extra.append(Finding("not_stated", reported))
    return (*setup.warnings, *extra)


def as_json(findings: Findings) -> dict[str, Any]:
    """Return what metrics.json says."""
    setup = findings.setup
    code = exit_code(findings)
    return {
        "status": _STATUS_BY_CODE.get(code, "complete"),
        "message": message(findings),
        "method": setup.method,
        "metrics": metrics_json(_metrics(findings)),
        "requirements": _list_requirements(findings),
        "warnings": [{"name": item.name, "message": item.message} for item in warnings(findings)],
        "yield": findings.all_met and findings.all_met.as_json(),
        "samples": _describe_samples(findings),
        "parameters": [_describe_parameter(parameter) for parameter in setup.parameters],
        "correlated": _correlated_pairs(setup),
        "indices": [vars(line) for line in findings.lines],
    }


_STATUS_BY_CODE = {
    ExitCode.INTERRUPTED: "interrupted",
    **dict.fromkeys((ExitCode.BUG, ExitCode.INVALID, ExitCode.NO_SOLUTION), "no_result"),
    ExitCode.PARTIAL: "partial",
}


def _metrics(findings: Findings) -> dict[str, Quantity]:
    """Return the metrics of the specification itself, and the yield."""
    study, values = findings.setup.study, findings.setup.nominal.values.tolist()
    noted = {
        metric.label: Quantity(value, metric.dimension, metric.definition)
        for metric, value in zip(study.metrics, values, strict=True)
    }
    if findings.all_met is not None:
        noted["yield"] = Quantity(
            _finite_or_none(findings.all_met.value), "ratio", YIELD_DEFINITION, "no parts were drawn"
        )
    return noted


def _list_requirements(findings: Findings) -> list[dict[str, Any]]:
    outcomes = findings.setup.nominal.outcomes
    shares = findings.each_met or (None,) * len(outcomes)
    records = [
        outcome.as_json() | {"yield": share and share.as_json()}
        for outcome, share in zip(outcomes, shares, strict=True)
    ]
    wanted = findings.setup.block.min_yield
    if wanted is None or findings.all_met is None:
        return records
    value, good = _finite_or_none(findings.all_met.value), yield_ok(findings)
    shown = "no value" if value is None else f"{100 * value:.4g} %"
    if value is not None and findings.all_met.failed:
        shown += f" ({findings.all_met.failed} of {findings.all_met.count} parts failed)"
    outcome = "ok, within the 95 % interval" if is_met_by_interval(findings) else "ok" if good else "missed"
    sentence = f"yield {shown}, required >= {100 * wanted:.4g} %: {outcome}"
    bounds = {"value": value, "min": wanted, "max": None, "unit": "1", "over": None, "over_unit": None}
    return [*records, {"metric": "yield", **bounds, "ok": good, "sentence": sentence}]


def _finite_or_none(value: float) -> float | None:
    return None if isnan(value) else value


def _describe_samples(findings: Findings) -> dict[str, Any]:
    evaluator, setup = findings.evaluator, findings.setup
    ends = {status.key: count for status, count in evaluator.ends.items() if count}
    about: dict[str, Any] = {"blocks": setup.samples, "evaluated": evaluator.count, "failed": evaluator.failed}
    if findings.interrupted:
        about["missing"] = evaluator.missing
    return about | {
        "by_status": ends,
        "seed": setup.seed,
    }


def _describe_parameter(parameter: Parameter) -> dict[str, Any]:
    spread = parameter.spread
    low, high = spread.ends
    about = {
        "path": parameter.path,
        "distribution": spread.kind,
        "nominal": write_value(spread.nominal, parameter.dimension),
    }
    if spread.kind == "normal":
        about["deviation"] = write_value(spread.deviation, parameter.dimension)
    return about | {"range": [write_value(low, parameter.dimension), write_value(high, parameter.dimension)]}


def _correlated_pairs(setup: Setup) -> list[dict[str, Any]]:
    pairs = setup.parts.correlated if setup.record.draws_parts else ()
    return [{"parameters": [setup.paths[k] for k in members], "correlation": value} for members, value in pairs]
