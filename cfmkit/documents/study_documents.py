"""The documents of studies: what `cfmkit sweep` and `cfmkit sensitivity` print.

Of a sweep: how many points meet the requirements, the best one, ranges of results. Of a sensitivity study: the yield,
and the values in the order of their influence.
"""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.documents.document import (
    MAX_WARNING_LENGTH,
    Document,
    GridColumn,
    Note,
    PageTable,
    Tone,
    ValueRow,
    WarningEntry,
    Written,
    format_bounds,
    name_in_words,
    shortened_to_clause,
)
from cfmkit.documents.run_document import value_and_bounds, warning_of
from cfmkit.errors import ExitCode
from cfmkit.metrics.metric_definitions import words
from cfmkit.studies.sensitivity.result_types import IN_UNITS
from cfmkit.studies.sensitivity.run_and_files import exit_code, is_met_by_interval, message, warnings, yield_ok
from cfmkit.studies.sensitivity.tolerance import VARIANCE_DROP, YIELD_GAIN

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.specs.spec import Spec
    from cfmkit.studies.parts.share import Share
    from cfmkit.studies.sensitivity.result_types import Findings, IndexLine


MAX_RANGES = 6  # results whose range a short page shows
NO_INFLUENCE_RTOL = 1e-9
"""Share of a value by which it may change and still counts as the same: rounding of sums leaves as much."""


def sweep_document(
    spec: Spec,  # what was varied
    summary: Mapping[str, Any],  # what metrics.json says of it
    dimensions: Mapping[str, str],  # of its metrics, by name
    code: ExitCode,  # of the process
    files: Written | None = None,  # what was written
    reused: int = 0,  # points that came from the journal
) -> Document:
    """Return the document of a sweep."""
    counts = summary["points"]
    ends = ", ".join(f"{count} {name_in_words(name)}" for name, count in counts.items() if name != "total")
    again = f" ({reused} from the journal)" if reused else ""
    return Document(
        exit_code=code,
        title=" ".join(spec.name.split()),
        summary=f"{counts['total']} points: {ends}{again}" if counts["total"] else "no point was finished",
        verdict=_sweep_verdict(summary, code),
        headline=(
            *(
                ValueRow(
                    _describe_objective(requirement["metric"]),
                    f"met at {requirement['met']} of {requirement['of']}",
                    format_bounds(requirement),
                    bool(requirement["ok"]),
                )
                for requirement in summary["requirements"]
            ),
            *_best_point_rows(summary, dimensions),
        ),
        tables=tuple(_range_tables(summary, dimensions)),
        notes=tuple(_best_settings(summary)),
        warnings=tuple(
            WarningEntry(
                warning["name"],
                shortened_to_clause(warning["message"], MAX_WARNING_LENGTH - len(warning["name"]) - 2),
                warning["message"],
            )
            for warning in summary["warnings"]
        ),
        files=files,
    )


def _sweep_verdict(summary: Mapping[str, Any], code: ExitCode) -> str:
    if code is ExitCode.REQUIREMENT_MISSED:
        return "no point meets every requirement"
    if code is not ExitCode.OK:
        return name_in_words(str(summary["status"] if code is not ExitCode.INTERRUPTED else "interrupted"))
    return "requirements can be met" if summary["requirements"] else "complete"


def _best_settings(summary: Mapping[str, Any]) -> Iterator[Note]:
    """Yield what was varied, at the best point, as options that can be pasted."""
    if summary["best"]:
        values = summary["best"]["values"].items()
        settings = [f"{path}={''.join(str(value).split())}" for path, value in values]
        yield Note("best", " ".join(f"--set {setting}" for setting in settings), whole=True, is_command=True)


def _best_point_rows(summary: Mapping[str, Any], dimensions: Mapping[str, str]) -> Iterator[ValueRow]:
    best = summary["best"]
    if not best:
        return
    metric = summary["metrics"][best["by"]]
    value = _quantity(metric["value"], metric["unit"], dimensions.get(best["by"], ""))
    tie = f" ({best['ties']} tie)" if best["ties"] > 1 else ""
    yield ValueRow(f"{best['sense']} {_describe_objective(best['by'])}", f"{value}, point {best['point']}{tie}")


def _range_tables(summary: Mapping[str, Any], dimensions: Mapping[str, str]) -> Iterator[PageTable]:
    """Yield the range of every result, beside its value at the best point; what does not change comes last."""
    leading: list[tuple[str, ...]] = []
    rows: list[tuple[str, ...]] = []
    constant: list[tuple[str, ...]] = []
    first = [summary["best"]["by"]] if summary["best"] else []
    asked = [requirement["metric"] for requirement in summary["requirements"]]
    names = [name for name in dict.fromkeys((*first, *asked, *summary["range"])) if name in summary["range"]]
    for name in names:
        extent, dimension = summary["range"][name], dimensions.get(name, "")
        low, high = (_quantity(extent[end], extent["unit"], dimension) for end in ("min", "max"))
        at_best = summary["metrics"].get(name, {}).get("value")
        shown = "" if at_best is None else _quantity(at_best, extent["unit"], dimension)
        if extent["max"] - extent["min"] <= NO_INFLUENCE_RTOL * max(abs(extent["min"]), abs(extent["max"])):
            row, others = (_describe_objective(name), low, "no influence", shown), constant
        else:
            row, others = (_describe_objective(name), low, high, shown), rows
        (leading if name in (*first, *asked) else others).append(row)
    if leading or rows:
        heads = ("from", "to", *(("best point",) if summary["best"] else ()))
        columns = (GridColumn("range of"), *(GridColumn(head, wraps=False) for head in heads))
        yield PageTable("", columns, tuple(row[: len(columns)] for row in (*leading, *rows)), MAX_RANGES)
    if constant:
        columns = (GridColumn("no influence on"), GridColumn("value", wraps=False))
        yield PageTable("Results without influence", columns, tuple(row[:2] for row in constant), 0)


def _describe_objective(label: str) -> str:
    """Return the label of a result as people write it, with its branch and window.

    Examples
    --------
    >>> _describe_objective("force_mean[load] over 5 ... 235 mm")
    'force mean on load over 5 to 235 mm'
    """
    return name_in_words(label).replace("[", " on ").replace("]", "").replace(" ... ", " to ")


def _quantity(value: float | str, unit: str, dimension: str) -> str:
    """Return a value in its border unit; of what has none, shares are percentages, counts and factors are not."""
    if isinstance(value, str):
        return value
    if dimension == "ratio":
        return f"{100 * value:.4g} %"
    return f"{value:.5g}" if unit == "1" else f"{value:.5g} {unit}"


PERCENT_INDICES = (YIELD_GAIN, VARIANCE_DROP)  # indices that are shown in percent
NO_INFLUENCE_INDEX = 1e-12
"""An index below this is the rounding of a difference of numbers near 1 (2e-16 each), not an influence."""
MAX_PARAMETERS = 6  # parameters of each metric on a short page: two metrics with them fit on a screen of 24 lines


def sensitivity_document(findings: Findings, files: Written | None = None) -> Document:
    """Return the document of a sensitivity study."""
    evaluator, spec = findings.evaluator, findings.setup.study.spec
    reused = sum(piece.records.reused for piece in evaluator.pieces)
    again = f" ({reused} from the journal)" if reused else ""
    return Document(
        exit_code=exit_code(findings),
        title=" ".join(spec.name.split()),
        summary=f"{findings.setup.method}, {evaluator.count} samples{again}",
        verdict=_yield_verdict(findings),
        headline=tuple(_yield_rows(findings)),
        tables=tuple(_ranking_tables(findings)),
        notes=tuple(_sensitivity_notes(findings)),
        warnings=tuple(warning_of(item) for item in warnings(findings)),
        files=files,
    )


def _yield_verdict(findings: Findings) -> str:
    if findings.interrupted:
        return "interrupted"
    if any(not outcome.ok for outcome in findings.setup.nominal.outcomes):
        return "nominal values miss requirements"
    if findings.all_met is None:
        return f"{findings.evaluator.failed} samples failed" if findings.evaluator.failed else "complete"
    return (
        "yield reached"
        if yield_ok(findings) and findings.setup.block.min_yield is not None
        else ("yield missed" if findings.setup.block.min_yield is not None else "complete")
    )


def _sensitivity_notes(findings: Findings) -> Iterator[Note]:
    for outcome in findings.setup.nominal.outcomes:
        if not outcome.ok:
            yield Note("missed", f"by the nominal values: {outcome.sentence}", tone=Tone.BAD)
    if findings.interrupted:
        yield Note("stopped", message(findings), tone=Tone.BAD, whole=True)
    if is_met_by_interval(findings):
        yield Note("yield", "its 95 % interval reaches the one that is required: not missed", whole=True)
    if findings.evaluator.failed:
        yield Note("first", findings.evaluator.first_failure)


def _yield_rows(findings: Findings) -> Iterator[ValueRow]:
    if findings.all_met is None:
        return
    wanted = findings.setup.block.min_yield
    bound = "" if wanted is None else f">= {100 * wanted:.4g} %"
    yield ValueRow("yield", share_of(findings.all_met), bound, None if wanted is None else yield_ok(findings))
    for outcome, share in zip(findings.setup.nominal.outcomes, findings.each_met, strict=True):
        yield ValueRow(words(outcome.metric), f"{share_of(share)}  {_describe_metric(value_and_bounds(outcome)[1])}")


def share_of(share: Share) -> str:
    """Return the share of parts that are good, with its 95 % interval."""
    if share.value != share.value:
        return f"not stated: {share.failed} of {share.count} parts have no result"
    low, high = (f"{100 * end:.1f}" for end in share.wilson)
    least, most = (100 * (share.good + more) / share.count for more in (0, share.failed))
    value = f"{least:.1f} to {most:.1f} %" if share.failed else f"{100 * share.value:.1f} %"
    return f"{value} (95 %: {low} to {high} %)"


def _ranking_tables(findings: Findings) -> Iterator[PageTable]:
    shares = {metric.label for metric in findings.setup.study.metrics if metric.dimension == "ratio"}
    for metric, lines_by_parameter in _group_by_metric(findings).items():
        indices = [
            name
            for name in findings.setup.record.indices
            if any(name in lines for lines in lines_by_parameter.values())
        ]
        ranked = enumerate(indices)
        heads = (
            GridColumn(_describe_metric(metric)),
            *(GridColumn(name_in_words(name), wraps=False, rank=rank) for rank, name in ranked),
        )
        rows = tuple(
            (_drop_block(parameter), *(_format_index(lines.get(name), metric in shares) for name in indices))
            for parameter, lines in lines_by_parameter.items()
        )
        yield PageTable("", heads, rows, MAX_PARAMETERS)


def _describe_metric(label: str) -> str:
    """Return the label of a column with its window, or the limits of a requirement, as people write it."""
    return name_in_words(label).replace(" ... ", " to ")


def _drop_block(parameters: str) -> str:
    """Return parameters without the block that nearly all stand in."""
    return ", ".join(path.removeprefix("mechanism.") for path in parameters.split(", "))


def _group_by_metric(findings: Findings) -> dict[str, dict[str, dict[str, IndexLine]]]:
    """Return metric -> parameter -> index -> line, the parameters with the largest influence first."""
    tree: dict[str, dict[str, dict[str, IndexLine]]] = defaultdict(lambda: defaultdict(dict))
    for line in findings.lines:
        tree[line.metric][line.parameter][line.index] = line
    rank = partial(_rank_by_influence, findings.setup.record.indices)
    return {metric: dict(sorted(lines_by_parameter.items(), key=rank)) for metric, lines_by_parameter in tree.items()}


def _rank_by_influence(indices: tuple[str, ...], item: tuple[str, dict[str, IndexLine]]) -> float:
    """Return minus the largest influence of a parameter, -inf without value: a sort key, the largest first."""
    line = next((item[1][name] for name in indices if name in item[1]), None)
    return 0.0 if line is None else -abs(line.value) if line.value is not None else -float("inf")


def _format_index(line: IndexLine | None, of_share: bool) -> str:
    """Return an index with its interval; in per cent if it is a share, or has the unit of a metric that is one."""
    if line is None or line.value is None:
        return "not stated"
    percent = line.index in PERCENT_INDICES or (of_share and line.index in IN_UNITS and line.unit == "1")
    unit = " %" if percent else "" if line.unit == "1" else f" {line.unit}"
    value, low, high = (None if end is None else _short(end, percent) for end in (line.value, line.low, line.high))
    if low is None or low == value == high:
        return "no influence" if value == "0" else f"{value}{unit}"
    return f"at least {value}{unit}" if high is None else f"{value}{unit}  ({low} to {high})"


def _short(value: float, percent: bool) -> str:
    """Return a number of three digits; what is nothing but rounding is zero."""
    return "0" if abs(value) < NO_INFLUENCE_INDEX else f"{100 * value if percent else value:.3g}"
