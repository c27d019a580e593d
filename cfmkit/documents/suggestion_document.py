"""The document of `suggest`: proposals with their numbers, near misses, and families that cannot meet the request."""

from __future__ import annotations

from collections import defaultdict
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
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.errors import ExitCode

HEADS = ("", "variant", "mean", "ripple", "size", "safety", "parts", "model")
"""Of the table, as far as a proposal has a value; "hysteresis" and "yield" follow where there are some."""

NO_VALUE = "-"

VARIANT = 1
"""The column whose cells may be cut; a number is never."""


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
    notes = [Note("time", rest, whole=True)] if rest else []
    return Document(
        exit_code=code,
        title="suggest",
        summary=head,
        tables=tuple(_tables(record)),
        notes=(*notes, *_remarks(found), *(_incomplete(found, files) if files else ())),
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
    more = _shares(record)
    proposals, unjudged = record["proposals"], record["unjudged"]
    rows = [
        (*_row(number, one, record), *(_share(one[name]) for name in more))
        for number, one in enumerate((*proposals, *unjudged), 1)
    ]
    heads = (*HEADS, *more)
    kept = [column for column in range(len(heads)) if any(row[column] not in ("", NO_VALUE) for row in rows)]
    columns = tuple(GridColumn(heads[column], column == VARIANT) for column in kept)
    for heading, listed in (("proposals", rows[: len(proposals)]), ("not judged in full", rows[len(proposals) :])):
        if listed:
            yield PageTable(heading, columns, tuple(tuple(row[column] for column in kept) for row in listed))
    pair = (GridColumn("", False), GridColumn())
    near = tuple((one["family"], f"{one['variant']}: {one['misses'][0]}") for one in record["near_misses"])
    if near:
        yield PageTable("near misses: one unmet requirement", pair, near)
    named = {one["family"] for one in (*proposals, *unjudged)}
    silent = tuple(_silent(one) for one in record["families"] if one["family"] not in named)
    if silent:
        yield PageTable("no proposals from these families", pair, silent)


def _remarks(found: Sequence[Mapping[str, Any]]) -> Iterator[Note]:
    """Yield what was not judged and what is warned of, each once with the numbers of its proposals."""
    texts: dict[str, list[int]] = defaultdict(list)
    for number, one in enumerate(found, 1):
        for text in (*one["unjudged"], *one["warnings"]):
            texts[text].append(number)
    for text, numbers in texts.items():
        yield Note(f"no. {_numbers(numbers)}", text, whole=True)


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
            f"the time ran out: of {', '.join(bare)} only design.yaml was written, and what is cut if there was time; "
            "`cfmkit analyze` of that file gives the curve and figures, `cfmkit export --format dxf,svg,png` the files "
            "to cut and a drawing"
        )
        yield Note("note", text, whole=True)


def _shares(record: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the shares that follow the other columns of the table."""
    lossy = any(one["hysteresis"] is not None for one in (*record["proposals"], *record["unjudged"]))
    return (*(("hysteresis",) if lossy else ()), *(("yield",) if "yield" in record["suggest"] else ()))


def _silent(one: Mapping[str, Any]) -> tuple[str, str]:
    """Return why a family has no proposal, and the nearest request that it could meet."""
    nearest = ", ".join(f"{key} {value}" for key, value in one["nearest"].items())
    return one["family"], (one["reason"] or "no mechanism fits") + (f"; nearest: {nearest}" if nearest else "")


def _row(number: int, one: Mapping[str, Any], record: Mapping[str, Any]) -> tuple[str | Span, ...]:
    unit = "N*mm" if "torque" in record["suggest"] else "N"
    sides = [one["across"], one["along"], one["depth"]]
    return (
        Span(f"{number} {one['family']}", link=quote(f"{one['folder']}/report.html")),
        one["variant"],
        f"{one['mean']:.4g} {unit}",
        NO_VALUE if one["ripple"] is None else f"{100 * one['ripple']:.2g} %",
        " x ".join(f"{side:.3g}" for side in sides if side is not None) + " mm",
        NO_VALUE if one["safety_factor"] is None else f"{one['safety_factor']:.3g}",
        str(one["parts"]),
        one["model"],
    )


def _share(value: float | None) -> str:
    return NO_VALUE if value is None else f"{100 * value:.3g} %"
