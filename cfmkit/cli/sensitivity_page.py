"""The page of a sensitivity study: the yield, the parameters in the order of what they do, what failed."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from cfmkit.cli.answer import Answer
from cfmkit.cli.layout import across, paragraph, title, written
from cfmkit.cli.terminal import BAD, FAINT, GOOD, LABEL
from cfmkit.errors import ExitCode
from cfmkit.studies.sensitivity.output import as_json, exit_code, message, warnings

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rich.console import RenderableType

    from cfmkit.cli.terminal import Terminal
    from cfmkit.studies.sensitivity.findings import Findings, Line
    from cfmkit.studies.sensitivity.tolerance import Yield

SHOWN = {
    "oat": ("swing", "normalised_slope"),
    "local": ("normalised_slope", "gradient"),
    "morris": ("mu_star", "sigma"),
    "sobol": ("total_order", "first_order"),
    "tolerance": ("yield_gain_when_halved", "variance_drop_when_halved"),
}
"""Indices on the page; the first says in which order."""

PERCENT = SHOWN["tolerance"]
NOTHING = 1e-12

MOST = 6
"""Parameters that are shown of each metric."""


def answer(found: Findings, folder: str, files: Sequence[str], seconds: float) -> Answer:
    """Return the answer of a finished study."""
    spec, code = found.setup.study.spec, exit_code(found)
    data = as_json(found) | {"family": spec.family, "name": spec.name, "out": folder, "files": list(files)}
    records = [piece.records for piece in found.evaluator.pieces]
    data |= {"reused": sum(one.reused for one in records)}
    bugs = sum(one.bugs for one in records)
    complaints = [f"error    {bugs} samples hit a bug in cfmkit; -vv shows the first"] if bugs else []

    def view(terminal: Terminal) -> None:
        terminal.show(*_page(found, folder, files, seconds, terminal))

    return Answer(data, view, code, tuple(complaints), tuple(_quiet(found, data, code)))


def _quiet(found: Findings, data: Mapping[str, Any], code: ExitCode) -> Iterator[str]:
    """Yield what a user must hear who has asked to hear nothing else."""
    if code not in (ExitCode.OK, ExitCode.REQUIREMENT_MISSED):
        yield f"{data['status']:<9}{message(found)}"
    for one in data["requirements"]:
        if not one["ok"]:
            yield f"missed   {one['sentence'].removesuffix(': missed')}"


def _page(
    found: Findings, folder: str, files: Sequence[str], seconds: float, terminal: Terminal
) -> Iterator[RenderableType]:
    yield _header(found, seconds, terminal.width)
    yield Text()
    if found.all_met is not None:
        yield _yields(found, found.all_met)
        yield Text()
    for metric, lines in _by_metric(found).items():
        yield Text(f"  {metric.replace('_', ' ')}", LABEL)
        yield _ranking(found, lines, everything=terminal.verbose > 0)
        yield Text()
    for outcome in found.setup.nominal.outcomes:
        if not outcome.ok:
            yield from paragraph("missed", f"without any deviation: {outcome.sentence}", terminal.width, BAD)
    if found.interrupted:
        yield from paragraph("stopped", message(found), terminal.width, BAD)
    for item in warnings(found):
        yield from paragraph("warning", f"{item.name}: {item.message}", terminal.width, BAD)
    if found.evaluator.failed:
        yield from paragraph("first", found.evaluator.first_failure, terminal.width)
    yield from written(folder, files, terminal)


def _header(found: Findings, seconds: float, width: int) -> Text:
    evaluator = found.evaluator
    reused = sum(piece.records.reused for piece in evaluator.pieces)
    right = f"{found.setup.method}, {evaluator.count} samples in {seconds:.2f} s"
    right += f", {reused} from the journal" if reused else ""
    return across(title(found.setup.study.spec), right, width)


def _yields(found: Findings, share: Yield) -> Table:
    grid = Table.grid(padding=(0, 3, 0, 0))
    for _ in range(4):
        grid.add_column(overflow="fold")
    wanted = found.setup.block.min_yield
    verdict = Text() if wanted is None else Text("ok", GOOD) if share.value >= wanted else Text("MISSED", BAD)
    bound = "" if wanted is None else f">= {100 * wanted:.4g} %"
    grid.add_row(Text("  yield", LABEL), Text(_share(share)), Text(bound), verdict)
    for outcome, one in zip(found.setup.nominal.outcomes, found.each_met, strict=True):
        limits = outcome.sentence.rpartition(": ")[0].partition(", ")[2]
        grid.add_row(Text(f"  {outcome.metric.replace('_', ' ')}"), Text(_share(one)), Text(limits, FAINT), Text())
    return grid


def _share(one: Yield) -> str:
    if one.value != one.value:
        return f"not stated: {one.failed} of {one.count} parts have no result"
    low, high = (f"{100 * end:.1f}" for end in one.wilson)
    return f"{100 * one.value:.1f} %   95 %: {low} ... {high} %"


def _by_metric(found: Findings) -> dict[str, dict[str, dict[str, Line]]]:
    """Return metric -> parameter -> index -> line, the parameters that do most first."""
    tree: dict[str, dict[str, dict[str, Line]]] = defaultdict(lambda: defaultdict(dict))
    for line in found.lines:
        tree[line.metric][line.parameter][line.index] = line
    return {metric: dict(sorted(each.items(), key=_rank)) for metric, each in tree.items()}


def _rank(item: tuple[str, dict[str, Line]]) -> float:
    """Return how far up a parameter stands: largest first, those without a value before all."""
    names = [names[0] for names in SHOWN.values()] + ["variance_drop_when_halved"]
    line = next((item[1][name] for name in names if name in item[1]), None)
    return 0.0 if line is None else -abs(line.value) if line.value is not None else -float("inf")


def _ranking(found: Findings, each: dict[str, dict[str, Line]], everything: bool) -> Table:
    indices = [name for name in SHOWN[found.setup.method] if any(name in lines for lines in each.values())]
    grid = Table(box=None, header_style=FAINT, padding=(0, 3, 0, 0), pad_edge=False)
    grid.add_column("", overflow="fold")
    for name in indices:
        grid.add_column(name.replace("_", " "), no_wrap=True)
    for parameter, lines in list(each.items())[: None if everything else MOST]:
        grid.add_row(Text(f"    {parameter}"), *(Text(_index(lines.get(name))) for name in indices))
    return grid


def _index(line: Line | None) -> str:
    if line is None or line.value is None:
        return "not stated"
    percent = line.index in PERCENT
    unit = " %" if percent else "" if line.unit == "1" else f" {line.unit}"
    value, low, high = (None if end is None else _short(end, percent) for end in (line.value, line.low, line.high))
    if low is None or low == value == high:
        return f"{value}{unit}"
    return f"at least {value}{unit}" if high is None else f"{value}{unit}  ({low} ... {high})"


def _short(value: float, percent: bool) -> str:
    """Return a number of three digits; what is nothing but rounding is zero."""
    return "0" if abs(value) < NOTHING else f"{100 * value if percent else value:.3g}"
