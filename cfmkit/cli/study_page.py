"""The page that a study prints: how many points ended how, the best of them, where the files are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from cfmkit.cli.layout import across, paragraph, title, written
from cfmkit.cli.terminal import BAD, FAINT, GOOD, LABEL
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from cfmkit.cli.studies import Ending
    from cfmkit.cli.terminal import Terminal

MOST_METRICS = 6


def show_study(ending: Ending, source: str, terminal: Terminal) -> None:
    """Print the page of a finished study."""
    terminal.show(*_page(ending, terminal))


def _page(ending: Ending, terminal: Terminal) -> Iterator[RenderableType]:
    yield _header(ending, terminal.width)
    yield Text()
    yield _numbers(ending, everything=terminal.verbose > 0)
    yield Text()
    if ending.code is ExitCode.REQUIREMENT_MISSED:
        yield from paragraph("missed", "no point meets every requirement", terminal.width, BAD)
    for one in ending.data["warnings"]:
        yield from paragraph("warning", f"{one['name']}: {one['message']}", terminal.width, BAD)
    yield from written(ending.folder, ending.files, terminal)


def _header(ending: Ending, width: int) -> Text:
    records = ending.records
    reused = f", {records.reused} from the journal" if records.reused else ""
    right = f"{records.finished} points in {ending.seconds:.2f} s{reused}"
    return across(title(records.work.study.spec), right, width)


def _numbers(ending: Ending, everything: bool) -> Table:
    grid = Table.grid(padding=(0, 3, 0, 0))
    for _ in range(3):
        grid.add_column(overflow="fold")
    data = ending.data
    for name, count in data["points"].items():
        if name != "total":
            style = GOOD if name == "complete" else BAD
            grid.add_row(Text(f"  {name.replace('_', ' ')}", style), Text(f"{count} points"), Text())
    for one in data["requirements"]:
        grid.add_row(
            Text(f"  {_words(one['metric'])}"),
            Text(f"met at {one['met']} of {one['of']}"),
            Text(_bounds(one), FAINT),
        )
    if data["best"]:
        _best(grid, ending, everything)
    return grid


def _best(grid: Table, ending: Ending, everything: bool) -> None:
    best, metrics = ending.data["best"], ending.data["metrics"]
    grid.add_row()
    grid.add_row(
        Text("  best", LABEL),
        Text(f"point {best['point']}" + (f", first of {best['ties']} as good" if best["ties"] > 1 else "")),
        Text(f"{best['sense']} {_words(best['by'])}" + _among(best), FAINT),
    )
    for path, value in best["values"].items():
        grid.add_row(Text(f"  {path}"), Text(value), Text())
    dimensions = {one.name: one.dimension for one in ending.records.work.study.metrics}
    names = [best["by"], *(name for name in metrics if name != best["by"])]
    for name in names if everything else names[:MOST_METRICS]:
        if (value := metrics[name]["value"]) is not None:
            told = _quantity(value, metrics[name]["unit"], dimensions[name])
            grid.add_row(Text(f"  {_words(name)}"), Text(told), Text())


def _among(best: dict[str, object]) -> str:
    if best["requirements_met"] is None:
        return ""
    return " of those that meet every requirement" if best["requirements_met"] else "; no point meets every requirement"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _quantity(value: float | str, unit: str, dimension: str) -> str:
    """Return a value in its border unit; of what has none, shares are percentages, counts and factors are not."""
    if isinstance(value, str):
        return value
    if dimension == "ratio":
        return f"{100 * value:.4g} %"
    return f"{value:.5g}" if unit == "1" else f"{value:.5g} {unit}"


def _bounds(one: dict[str, object]) -> str:
    bounds = [f">= {one['min']}"] if one["min"] is not None else []
    return " and ".join([*bounds, *([f"<= {one['max']}"] if one["max"] is not None else [])])
