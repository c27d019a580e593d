"""The document that `cfmkit suggest` prints, from metrics.json: proposals, near misses, families without proposals."""

from __future__ import annotations

import re
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
"""Cell of a value that no model computes or for which the material lacks data; a note says the reason."""
COLUMN_RANKS = {"parts": 4, "variant": 3, "hysteresis": 2, "life": 1}
"""Columns that narrow pages leave out, the largest first."""


def document_of(
    record: Mapping[str, Any],  # what metrics.json says
    code: ExitCode,  # of the process
    files: Written | None = None,  # what was written
) -> Document:
    """Return the document of a search."""
    proposals = [*record["proposals"], *record["unjudged"]]
    head, _, rest = record["message"].partition("; ")
    notes = [Note("time", rest, whole=True)] if rest and not record["warnings"] else []  # which say the same
    return Document(
        exit_code=code,
        title="suggest",
        summary=head,
        tables=tuple(_proposal_tables(record)),
        notes=(
            *notes,
            *_common_notes(proposals),
            *_miss_notes(record["near_misses"]),
            *(_incomplete_notes(proposals, files) if files else ()),
        ),
        warnings=tuple(
            WarningEntry(warning["name"], warning["message"], warning["message"]) for warning in record["warnings"]
        ),
        files=files,
        next=_export_command(proposals, files) if files else "",
    )


def _export_command(proposals: Sequence[Mapping[str, Any]], files: Written) -> str:
    """Return the command that writes the files to cut or print of the best proposal."""
    if not proposals:
        return ""
    return command_line("cfmkit", "export", str(Path(files.folder) / proposals[0]["folder"] / "design.yaml"))


def _proposal_tables(record: Mapping[str, Any]) -> Iterator[PageTable]:
    columns = _filled_columns(record)
    heads = (
        GridColumn("", False),
        *(GridColumn(head, head == "variant", COLUMN_RANKS.get(head, 0)) for head in columns),
    )
    listed = (*record["proposals"], *record["unjudged"])
    order = f"proposals by {', '.join(record['order'])}" + ("; not judged in full last" if record["unjudged"] else "")
    numbered = [
        Span(f"{k} {proposal['family']}", link=quote(f"{proposal['folder']}/report.html"))
        for k, proposal in enumerate(listed, 1)
    ]
    near_misses = record["near_misses"]
    for heading, names, rows in (
        (order, numbered, listed),
        ("alternatives: one unmet requirement", [miss["family"] for miss in near_misses], near_misses),
    ):
        if rows:
            cells = (
                (name, *(cell(proposal) for cell in columns.values()))
                for name, proposal in zip(names, rows, strict=True)
            )
            yield PageTable(heading, heads, tuple(cells))
    pair = (GridColumn("", False), GridColumn())
    named = {proposal["family"] for proposal in listed}
    shown_misses = {(miss["family"], miss["misses"][0]) for miss in near_misses}
    without_proposal = tuple(
        _family_without_proposal(entry)
        for entry in record["families"]
        if entry["family"] not in named and (entry["nearest"] or (entry["family"], entry["reason"]) not in shown_misses)
    )
    if without_proposal:
        yield PageTable("no proposals from these families", pair, without_proposal)


def _common_notes(proposals: Sequence[Mapping[str, Any]]) -> Iterator[Note]:
    """Yield what was not judged, end stops, and what is warned of, each once with the numbers of its proposals."""
    texts_of_many: dict[str, list[int]] = defaultdict(list)
    warned: dict[str, dict[int, str]] = defaultdict(dict)
    for number, proposal in enumerate(proposals, 1):
        stops = (note for note in proposal.get("notes", ()) if note.startswith("end stop"))
        for text in (*proposal["unjudged"], *stops):
            texts_of_many[text].append(number)
        for text in proposal["warnings"]:  # a name, and often what it means for this proposal
            warned[re.split("[: ]", text, maxsplit=1)[0]][number] = text
    for text, numbers in texts_of_many.items():
        yield Note(f"no. {_join_numbers(numbers)}", text, whole=True)
    for name, texts in warned.items():
        text = next(iter(texts.values())) if len(set(texts.values())) == 1 else name
        yield Note(f"no. {_join_numbers(list(texts))}", f"{text} (see `cfmkit show {name}`)", whole=True)


def _miss_notes(near_misses: Sequence[Mapping[str, Any]]) -> Iterator[Note]:
    """Yield what each alternative misses."""
    for miss in near_misses:
        yield Note("unmet", f"{miss['family']} {miss['variant']}: {miss['misses'][0]}", whole=True)


def _join_numbers(numbers: Sequence[int]) -> str:
    """Return numbers as text, successive ones as a range: ``1-3, 5``.

    Examples
    --------
    >>> _join_numbers([1, 2, 3, 5, 9])
    '1-3, 5, 9'
    """
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)


def _incomplete_notes(proposals: Sequence[Mapping[str, Any]], files: Written) -> Iterator[Note]:
    bare = [proposal["folder"] for proposal in proposals if f"{proposal['folder']}/metrics.json" not in files.files]
    if bare:
        text = (
            f"no time was left for the curve and figures of {', '.join(bare)}: `cfmkit analyze` of its design.yaml "
            "makes them, `cfmkit export --format dxf,svg,png` the files to cut and a drawing"
        )
        yield Note("note", text, whole=True)


def _family_without_proposal(record: Mapping[str, Any]) -> tuple[str, str]:
    """Return why a family has no proposal, and the nearest request that it could meet."""
    nearest = ", or with ".join(f"{key} {value}" for key, value in record["nearest"].items())
    return record["family"], (record["reason"] or "no mechanism fits") + (
        f"; feasible with {nearest}" if nearest else ""
    )


def _filled_columns(record: Mapping[str, Any]) -> dict[str, Callable[[Mapping[str, Any]], str]]:
    """Return the columns of the table, each with the text of its cell; those that no proposal fills are left out."""
    block, listed = record["suggest"], (*record["proposals"], *record["unjudged"], *record["near_misses"])
    kind, unit = ("torque", "N*mm") if "torque" in block else ("force", "N")
    columns: dict[str, Callable[[Mapping[str, Any]], str]] = {
        "variant": lambda proposal: str(proposal["variant"]),
        kind: lambda proposal: _value_cell(proposal["mean"], lambda value: f"{value:.4g} {unit}"),
        "ripple": lambda proposal: _value_cell(proposal["ripple"], lambda value: f"{100 * value:.2g} %"),
        "size": _size_in_words,
        "safety": lambda proposal: _value_cell(proposal["safety_factor"], lambda value: f"{value:.3g}"),
    }
    for name, key in (("hysteresis", "hysteresis"), ("yield", "yield"), ("life", "cycles")):
        if key in block or any(proposal[name] is not None for proposal in listed):
            shown = (lambda value: f"{value:.2g}") if name == "life" else (lambda value: f"{100 * value:.3g} %")
            columns[name] = partial(_proposal_cell, name, shown)
    columns |= {
        "parts": lambda proposal: NO_VALUE if proposal["parts"] is None else str(proposal["parts"]),
        "verdict": lambda proposal: str(proposal["verdict"]),
    }
    empty = (NOT_JUDGED, NO_VALUE, "")
    return {name: cell for name, cell in columns.items() if any(cell(proposal) not in empty for proposal in listed)}


def _proposal_cell(name: str, shown: Callable[[float], str], proposal: Mapping[str, Any]) -> str:
    return _value_cell(proposal[name], shown)


def _value_cell(value: float | None, shown: Callable[[float], str]) -> str:
    return NOT_JUDGED if value is None else shown(value)


def _size_in_words(proposal: Mapping[str, Any]) -> str:
    sides = [proposal[side] for side in ("across", "along", "depth") if proposal[side] is not None]
    return "x".join(f"{side:.3g}" for side in sides) + " mm"
