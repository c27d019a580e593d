"""The document of `suggest`: proposals with their numbers, near misses, and families that cannot meet the request."""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from cfmkit.documents.document import (
    Document,
    GridColumn,
    Note,
    PageTable,
    Span,
    WarningEntry,
    Written,
    command_line,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.errors import ExitCode

NO_VALUE = "-"

NOT_JUDGED = "open"
"""Of a value that no model here has, or of which the material says nothing; a note says the reason."""

COLUMN_RANKS = {"parts": 4, "variant": 3, "hysteresis": 2, "life": 1}
"""Columns that narrow pages leave out, the largest first."""


def document_of(record: Mapping[str, Any], code: ExitCode, files: Written | None = None) -> Document:
    """Return the document of a search.

    Parameters
    ----------
    record : mapping
        What metrics.json says.
    code : ExitCode
        Of the process.
    files : Written, optional
        What was written.
    """
    found = [*record["proposals"], *record["unjudged"]]
    head, _, rest = record["message"].partition("; ")
    notes = [Note("time", rest, whole=True)] if rest and not record["warnings"] else []  # which say the same
    return Document(
        exit_code=code,
        title="suggest",
        summary=head,
        tables=tuple(_tables(record)),
        notes=(*notes, *_remarks(found), *_unmet(record["near_misses"]), *(_incomplete(found, files) if files else ())),
        warnings=tuple(WarningEntry(one["name"], one["message"], one["message"]) for one in record["warnings"]),
        files=files,
        next=_next(found, files) if files else "",
    )


def _next(found: Sequence[Mapping[str, Any]], files: Written) -> str:
    """Return the command that writes the files to cut or print of the best proposal."""
    if not found:
        return ""
    return command_line("cfmkit", "export", str(Path(files.folder) / found[0]["folder"] / "design.yaml"))


def _tables(record: Mapping[str, Any]) -> Iterator[PageTable]:
    columns = _columns(record)
    heads = (
        GridColumn("", False),
        *(GridColumn(head, head == "variant", COLUMN_RANKS.get(head, 0)) for head in columns),
    )
    listed = (*record["proposals"], *record["unjudged"])
    order = f"proposals by {', '.join(record['order'])}" + ("; not judged in full last" if record["unjudged"] else "")
    numbered = [Span(f"{k} {one['family']}", link=_page_of(one)) for k, one in enumerate(listed, 1)]
    near = record["near_misses"]
    for heading, names, rows in (
        (order, numbered, listed),
        ("alternatives: one unmet requirement", [one["family"] for one in near], near),
    ):
        if rows:
            cells = ((name, *(cell(one) for cell in columns.values())) for name, one in zip(names, rows, strict=True))
            yield PageTable(heading, heads, tuple(cells))
    pair = (GridColumn("", False), GridColumn())
    named = {one["family"] for one in listed}
    known = {(one["family"], one["misses"][0]) for one in near}
    silent = tuple(
        _silent(one)
        for one in record["families"]
        if one["family"] not in named and (one["nearest"] or (one["family"], one["reason"]) not in known)
    )
    if silent:
        yield PageTable("no proposals from these families", pair, silent)


def _remarks(found: Sequence[Mapping[str, Any]]) -> Iterator[Note]:
    """Yield what was not judged and what is warned of, each once with the numbers of its proposals."""
    texts: dict[str, list[int]] = defaultdict(list)
    for number, one in enumerate(found, 1):
        for text in (*one["unjudged"], *(f"{name} (see `cfmkit show {name}`)" for name in one["warnings"])):
            texts[text].append(number)
    for text, numbers in texts.items():
        yield Note(f"no. {_numbers(numbers)}", text, whole=True)


def _unmet(near: Sequence[Mapping[str, Any]]) -> Iterator[Note]:
    """Yield what each alternative misses."""
    for one in near:
        yield Note("unmet", f"{one['family']} {one['variant']}: {one['misses'][0]}", whole=True)


def _numbers(numbers: Sequence[int]) -> str:
    """Return numbers with runs of them as ranges.

    Examples
    --------
    >>> _numbers([1, 2, 3, 5, 9])
    '1-3, 5, 9'
    """
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)


def _incomplete(found: Sequence[Mapping[str, Any]], files: Written) -> Iterator[Note]:
    bare = [one["folder"] for one in found if f"{one['folder']}/metrics.json" not in files.files]
    if bare:
        text = (
            f"no time was left for the curve and figures of {', '.join(bare)}: `cfmkit analyze` of its design.yaml "
            "makes them, `cfmkit export --format dxf,svg,png` the files to cut and a drawing"
        )
        yield Note("note", text, whole=True)


def _silent(one: Mapping[str, Any]) -> tuple[str, str]:
    """Return why a family has no proposal, and the nearest request that it could meet."""
    nearest = ", or with ".join(f"{key} {value}" for key, value in one["nearest"].items())
    return one["family"], (one["reason"] or "no mechanism fits") + (f"; feasible with {nearest}" if nearest else "")


def _columns(record: Mapping[str, Any]) -> dict[str, Callable[[Mapping[str, Any]], str]]:
    """Return the columns of the table, each with the text of its cell; those that no proposal fills are left out."""
    block, listed = record["suggest"], (*record["proposals"], *record["unjudged"], *record["near_misses"])
    kind, unit = ("torque", "N*mm") if "torque" in block else ("force", "N")
    columns: dict[str, Callable[[Mapping[str, Any]], str]] = {
        "variant": lambda one: str(one["variant"]),
        kind: lambda one: _cell(one["mean"], lambda value: f"{value:.4g} {unit}"),
        "ripple": lambda one: _cell(one["ripple"], lambda value: f"{100 * value:.2g} %"),
        "size": _size,
        "safety": lambda one: _cell(one["safety_factor"], lambda value: f"{value:.3g}"),
    }
    for name, key in (("hysteresis", "hysteresis"), ("yield", "yield"), ("life", "cycles")):
        if key in block or any(one[name] is not None for one in listed):
            shown = (lambda value: f"{value:.2g}") if name == "life" else (lambda value: f"{100 * value:.3g} %")
            columns[name] = partial(_value, name, shown)
    columns |= {
        "parts": lambda one: NO_VALUE if one["parts"] is None else str(one["parts"]),
        "verdict": lambda one: str(one["verdict"]),
    }
    empty = (NOT_JUDGED, NO_VALUE, "")
    return {name: cell for name, cell in columns.items() if any(cell(one) not in empty for one in listed)}


def _value(name: str, shown: Callable[[float], str], one: Mapping[str, Any]) -> str:
    return _cell(one[name], shown)


def _cell(value: float | None, shown: Callable[[float], str]) -> str:
    return NOT_JUDGED if value is None else shown(value)


def _size(one: Mapping[str, Any]) -> str:
    sides = [one[side] for side in ("across", "along", "depth") if one[side] is not None]
    return "x".join(f"{side:.3g}" for side in sides) + " mm"


def _page_of(one: Mapping[str, Any]) -> str:
    return quote(f"{one['folder']}/report.html")
