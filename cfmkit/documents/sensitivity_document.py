"""The document of a sensitivity study: the yield, and the values in the order of their influence."""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from typing import TYPE_CHECKING

from cfmkit.documents.document import Document, GridColumn, Note, PageTable, Tone, ValueRow, Written, name_in_words
from cfmkit.documents.run_document import value_and_bounds, warning_of
from cfmkit.metrics.metric_definitions import words
from cfmkit.studies.sensitivity.monte_carlo_yield import VARIANCE_DROP, YIELD_GAIN
from cfmkit.studies.sensitivity.output import exit_code, is_met_by_interval, message, warnings, yield_ok
from cfmkit.studies.sensitivity.result_types import IN_UNITS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.studies.parts.share import Share
    from cfmkit.studies.sensitivity.result_types import Findings, IndexLine

PERCENT_INDICES = (YIELD_GAIN, VARIANCE_DROP)  # indices that are shown in percent
NO_INFLUENCE = 1e-12
"""An index below this is the rounding of a difference of numbers near 1 (2e-16 each), not an influence."""
MAX_PARAMETERS = 6  # parameters of each metric on a short page: two metrics with them fit on a screen of 24 lines


def document_of(found: Findings, files: Written | None = None) -> Document:
    """Return the document of a sensitivity study."""
    evaluator, spec = found.evaluator, found.setup.study.spec
    reused = sum(piece.records.reused for piece in evaluator.pieces)
    again = f" ({reused} from the journal)" if reused else ""
    return Document(
        exit_code=exit_code(found),
        title=" ".join(spec.name.split()),
        summary=f"{found.setup.method}, {evaluator.count} samples{again}",
        verdict=_verdict(found),
        headline=tuple(_yields(found)),
        tables=tuple(_rankings(found)),
        notes=tuple(_notes(found)),
        warnings=tuple(warning_of(item) for item in warnings(found)),
        files=files,
    )


def _verdict(found: Findings) -> str:
    if found.interrupted:
        return "interrupted"
    if any(not outcome.ok for outcome in found.setup.nominal.outcomes):
        return "nominal values miss requirements"
    if found.all_met is None:
        return f"{found.evaluator.failed} samples failed" if found.evaluator.failed else "complete"
    return (
        "yield reached"
        if yield_ok(found) and found.setup.block.min_yield is not None
        else ("yield missed" if found.setup.block.min_yield is not None else "complete")
    )


def _notes(found: Findings) -> Iterator[Note]:
    for outcome in found.setup.nominal.outcomes:
        if not outcome.ok:
            yield Note("missed", f"by the nominal values: {outcome.sentence}", tone=Tone.BAD)
    if found.interrupted:
        yield Note("stopped", message(found), tone=Tone.BAD, whole=True)
    if is_met_by_interval(found):
        yield Note("yield", "its 95 % interval reaches the one that is required: not missed", whole=True)
    if found.evaluator.failed:
        yield Note("first", found.evaluator.first_failure)


def _yields(found: Findings) -> Iterator[ValueRow]:
    if found.all_met is None:
        return
    wanted = found.setup.block.min_yield
    bound = "" if wanted is None else f">= {100 * wanted:.4g} %"
    yield ValueRow("yield", share_of(found.all_met), bound, None if wanted is None else yield_ok(found))
    for outcome, one in zip(found.setup.nominal.outcomes, found.each_met, strict=True):
        yield ValueRow(words(outcome.metric), f"{share_of(one)}  {_describe_label(value_and_bounds(outcome)[1])}")


def share_of(one: Share) -> str:
    """Return the share of parts that are good, with its 95 % interval."""
    if one.value != one.value:
        return f"not stated: {one.failed} of {one.count} parts have no result"
    low, high = (f"{100 * end:.1f}" for end in one.wilson)
    least, most = (100 * (one.good + more) / one.count for more in (0, one.failed))
    value = f"{least:.1f} to {most:.1f} %" if one.failed else f"{100 * one.value:.1f} %"
    return f"{value} (95 %: {low} to {high} %)"


def _rankings(found: Findings) -> Iterator[PageTable]:
    shares = {metric.label for metric in found.setup.study.metrics if metric.dimension == "ratio"}
    for metric, each in _group_by_metric(found).items():
        indices = [name for name in found.setup.record.indices if any(name in lines for lines in each.values())]
        ranked = enumerate(indices)
        heads = (
            GridColumn(_describe_label(metric)),
            *(GridColumn(name_in_words(name), wraps=False, rank=rank) for rank, name in ranked),
        )
        rows = tuple(
            (_drop_block(parameter), *(_index(lines.get(name), metric in shares) for name in indices))
            for parameter, lines in each.items()
        )
        yield PageTable("", heads, rows, MAX_PARAMETERS)


def _describe_label(label: str) -> str:
    """Return the label of a column with its window, or the limits of a requirement, as people write it."""
    return name_in_words(label).replace(" ... ", " to ")


def _drop_block(parameters: str) -> str:
    """Return parameters without the block that nearly all stand in."""
    return ", ".join(path.removeprefix("mechanism.") for path in parameters.split(", "))


def _group_by_metric(found: Findings) -> dict[str, dict[str, dict[str, IndexLine]]]:
    """Return metric -> parameter -> index -> line, the parameters with the largest influence first."""
    tree: dict[str, dict[str, dict[str, IndexLine]]] = defaultdict(lambda: defaultdict(dict))
    for one in found.lines:
        tree[one.metric][one.parameter][one.index] = one
    rank = partial(_rank, found.setup.record.indices)
    return {metric: dict(sorted(each.items(), key=rank)) for metric, each in tree.items()}


def _rank(indices: tuple[str, ...], item: tuple[str, dict[str, IndexLine]]) -> float:
    """Return how far up a parameter stands: largest first, those without a value before all."""
    line = next((item[1][name] for name in indices if name in item[1]), None)
    return 0.0 if line is None else -abs(line.value) if line.value is not None else -float("inf")


def _index(line: IndexLine | None, of_share: bool) -> str:
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
    return "0" if abs(value) < NO_INFLUENCE else f"{100 * value if percent else value:.3g}"
