"""Files of `suggest`: a folder for each proposal, table, figures, page, metrics.json."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.documents import html
from cfmkit.documents.suggestion_document import document_of
from cfmkit.runs.suggestion_record import RECORD_COLUMNS, as_json, folder_name, numbers_in_border_units
from cfmkit.specs.units import format_short
from cfmkit.studies.pool import give_up_at
from cfmkit.tables.json_writing import json_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.errors import ExitCode
    from cfmkit.families.run_control import Run
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.suggest.outcome_of_search import Suggestions
    from cfmkit.studies.suggest.proposal_making_and_judging import Proposal
    from cfmkit.studies.suggest.spec import SuggestBlock


@dataclass(frozen=True)
class Deadlines:
    """Deadlines of parts that a late run leaves out."""

    figures: Clock  # of the search and of proposals whose turn comes after it
    files: Clock  # of proposals, all but ``design.yaml``


def files(
    # suggestions, block: proposals, and the block `suggest`
    suggestions: Suggestions,
    block: SuggestBlock,
    run: Run,  # its executor draws the proposals
    plots: bool,  # whether to draw
    deadlines: Deadlines,  # what is left out when its time is up
    # how the search was started, for ``report.html``; None: no page is written, nor one of each proposal
    command: str | None = None,
) -> Iterator[tuple[str, bytes]]:
    """Yield every file of the run as (name below the folder, content)."""
    yield "metrics.json", json_bytes(as_json(suggestions, block))
    yield "suggestions.csv", table(suggestions)
    in_time = not deadlines.figures.late()
    drawn = (
        {"proposals": _picture(suggestions)}
        if suggestions.listed and in_time and (plots or command is not None)
        else {}
    )
    if plots:
        from cfmkit.plots.style import png

        for name, figure in drawn.items():
            yield f"figures/{name}.png", png(figure)
    if command is not None:
        texts = {folder_name(number, proposal): proposal.text for number, proposal in enumerate(suggestions.listed, 1)}
        yield html.REPORT_NAME, page(as_json(suggestions, block), suggestions.exit_code, texts, drawn, command)
    work = partial(_make_files, (plots, command is not None), deadlines, suggestions.listed)
    made = dict(
        give_up_at(run.executor, deadlines.files.deadline)(work, iter(range(len(suggestions.listed))), lambda: False)
    )
    for index, proposal in enumerate(suggestions.listed):
        files = made.get(index)
        for name, data in files if isinstance(files, list) else [("design.yaml", proposal.text.encode())]:
            yield f"{folder_name(index + 1, proposal)}/{name}", data


def _picture(suggestions: Suggestions) -> Figure:
    """Return all proposals to one scale; on a page each leads to its report."""
    from cfmkit.studies.suggest.figures import to_one_scale

    links = [
        f"{folder_name(number, proposal)}/{html.REPORT_NAME}" for number, proposal in enumerate(suggestions.listed, 1)
    ]
    return to_one_scale(suggestions.listed, suggestions.request, links)


def _make_files(
    wanted: tuple[bool, bool], deadlines: Deadlines, proposals: Sequence[Proposal], index: int
) -> list[tuple[str, bytes]]:
    """Return the files of one proposal: its specification first, which `analyze` takes; alone where the time is up."""
    from cfmkit import api
    from cfmkit.documents.run_outcome import report_on
    from cfmkit.results import Design, Status
    from cfmkit.runs.files_a_run_writes import files

    proposal = proposals[index]
    if deadlines.files.late():
        return [("design.yaml", proposal.text.encode())]
    spec = proposal.spec
    design = Design(spec, Status.COMPLETE)
    left = deadlines.files.get_time_left()
    if (
        left is not None and left < MAX_SLOWDOWN * proposal.seconds
    ):  # its analysis would not end in time, its drawing does
        return [
            ("design.yaml", proposal.text.encode()),
            *_draw_part(spec, plots=wanted[0] and not deadlines.figures.late()),
        ]
    plots, page = wanted
    made_files = dict(files(report_on(api.analyze(spec), design), plots and not deadlines.figures.late(), page))
    return list(({"design.yaml": b""} | made_files | {"design.yaml": proposal.text.encode()}).items())


MAX_SLOWDOWN = 2.0  # how much longer than before an analysis may take: others run beside it, and figures are drawn


def _draw_part(spec: Spec, plots: bool) -> Iterator[tuple[str, bytes]]:
    """Yield the files to cut or print, and the drawing, which need no analysis."""
    from cfmkit.runs.files_a_run_writes import geometry, part_of
    from cfmkit.runs.part_on_paper import part_on_paper

    drawing = part_of(spec)
    if drawing is None:
        return
    yield from geometry(drawing)
    if plots:
        from cfmkit.plots.style import png

        yield "figures/drawing.png", png(part_on_paper(drawing, spec))


def table(suggestions: Suggestions) -> bytes:
    """Return suggestions.csv: a row a proposal, then those that were not judged in full, then the near misses."""
    from cfmkit.tables import to_csv
    from cfmkit.tables.table import Table, TableColumn

    rows = [*enumerate(suggestions.listed, 1), *((None, proposal) for proposal in suggestions.near)]
    numbers = [numbers_in_border_units(suggestions, proposal) for _, proposal in rows]
    unit = "N" if suggestions.request.kind == "force" else "N*mm"
    columns = [
        TableColumn("number", tuple(number for number, _ in rows)),
        TableColumn("family", tuple(proposal.family for _, proposal in rows)),
        TableColumn("variant", tuple(proposal.variant for _, proposal in rows)),
    ]
    for name, (dimension, border) in RECORD_COLUMNS.items():
        head = f"{suggestions.request.kind}_mean" if name == "mean" else name
        values = tuple(record.get(name) for record in numbers)
        columns.append(TableColumn(head, values, unit if name == "mean" else border if dimension != "count" else None))
    columns.append(TableColumn("verdict", tuple(proposal.verdict for _, proposal in rows)))
    columns.append(TableColumn("model", tuple(proposal.model for _, proposal in rows)))
    columns.append(TableColumn("warnings", tuple("; ".join(proposal.warnings) for _, proposal in rows)))
    columns.append(TableColumn("unjudged", tuple("; ".join(proposal.open) for _, proposal in rows)))
    columns.append(TableColumn("misses", tuple("; ".join(proposal.missed) for _, proposal in rows)))
    columns.append(TableColumn("folder", tuple("" if n is None else folder_name(n, proposal) for n, proposal in rows)))
    return to_csv(Table(tuple(columns)))


def page(
    record: Mapping[str, Any],  # what metrics.json says
    code: ExitCode,  # of the process
    texts: Mapping[str, str],  # the specification of each proposal, by its folder
    drawn: Mapping[str, Figure],  # the pictures, by their names
    command: str,  # how the search was started
) -> bytes:
    """Return the page of a search."""
    document = document_of(record, code)
    proposals = (*record["proposals"], *record["unjudged"])
    specs = [(f"Specification {proposal['folder']}", texts[proposal["folder"]]) for proposal in proposals]
    return html.page(document, drawn, subject=_list_in_words(record["suggest"]), command=command, texts=specs)


def _list_in_words(pairs: Mapping[str, Any]) -> str:
    """Return keys and values in words.

    Examples
    --------
    >>> _list_in_words({"force": "10 N", "ripple": 0.03, "envelope": ["80 mm", "60 mm"], "adjustable": ["8 N", "12 N"]})
    'force 10 N, ripple 3 %, envelope 80 mm x 60 mm, adjustable 8 N to 12 N'
    >>> _list_in_words({"material": [{"name": "pla"}, {"name": "pom"}], "prefer": ["size", "ripple"]})
    'material pla or pom, prefer size, ripple'
    """
    return ", ".join(f"{key.replace('_', ' ')} {_words(key, value)}" for key, value in pairs.items())


SHARE_COLUMNS = ("ripple", "hysteresis", "yield")  # numbers of a proposal that are shares
LIST_SEPARATORS = {"envelope": " x ", "material": " or ", "prefer": ", "}
"""What stands between the values of a key that has several; else they are the two ends of a band."""


def _words(key: str, value: Any) -> str:
    if isinstance(value, list | tuple):
        return LIST_SEPARATORS.get(key, " to ").join(_words(key, item) for item in value)
    if isinstance(value, dict):
        return str(value.get("name") or _list_in_words(value))
    return format_short(value, "ratio", 3) if key in SHARE_COLUMNS and isinstance(value, float | int) else str(value)
