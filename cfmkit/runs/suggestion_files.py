"""Output of `suggest`: a folder for each proposal, table, figures, page, metrics.json; the exit code."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.documents import html
from cfmkit.documents.suggestion_document import document_of
from cfmkit.errors import ExitCode
from cfmkit.specs.units import format_short, to_border
from cfmkit.studies.pool import give_up_at
from cfmkit.studies.serial_and_cluster_executors import BUG
from cfmkit.tables.json_writing import json_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.families.run_control import Run
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.suggest.proposal_making_and_judging import Proposal
    from cfmkit.studies.suggest.search import Suggestions
    from cfmkit.studies.suggest.spec import SuggestBlock


COLUMNS: Mapping[str, tuple[str, str]] = {
    "mean": ("", ""),
    "ripple": ("ratio", "1"),
    "hysteresis": ("ratio", "1"),
    "safety_factor": ("ratio", "1"),
    "across": ("length", "mm"),
    "along": ("length", "mm"),
    "depth": ("length", "mm"),
    "parts": ("count", ""),
    "life": ("ratio", "1"),
    "yield": ("ratio", "1"),
    "stiffening": ("ratio", "1"),
}
"""What is reported of each proposal: its dimension and the unit of the files."""


@dataclass(frozen=True)
class Deadlines:
    """Deadlines of parts that a late run leaves out."""

    figures: Clock  # of the search and of proposals whose turn comes after it
    files: Clock  # of proposals, all but ``design.yaml``


def numbers_in_border_units(proposal: Proposal) -> dict[str, Any]:
    """Return a proposal's numbers in border units, by the name of its column."""
    found: dict[str, Any] = {}
    for name, value in proposal.numbers.items():
        dimension = COLUMNS[name][0] or "ratio"
        found[name] = (
            None if value is None else float(to_border(value, dimension)) if dimension != "count" else int(value)
        )
    return found


def with_force(found: Suggestions, proposal: Proposal) -> dict[str, Any]:
    """Return the same with the mean in N or N*mm."""
    mean = proposal.numbers.get("mean")
    return numbers_in_border_units(proposal) | {
        "mean": None if mean is None else float(to_border(mean, found.request.kind))
    }


STATUSES = {
    ExitCode.OK: "complete",
    ExitCode.PARTIAL: "partial",
    ExitCode.NO_SOLUTION: "infeasible",
    ExitCode.BUG: "crashed",
}
"""What metrics.json says of each end."""


def exit_code(found: Suggestions) -> ExitCode:
    """Return 0 if a proposal does all that is required, 70 if a bug ended all, 6 if not all was judged, else 4."""
    if found.proposals:
        return ExitCode.OK
    reasons = [one.offer.reason for one in found.answers if one.offer.reason]
    reasons += [reason for each in found.failed.values() for reason in each]
    if found.bugs and not found.near and all(reason.startswith(BUG) for reason in reasons):
        return ExitCode.BUG
    return ExitCode.PARTIAL if found.late or found.unjudged else ExitCode.NO_SOLUTION


def folder_name(number: int, proposal: Proposal) -> str:
    """Return the folder of a proposal: ``1-vcfm-2-vs``."""
    words = "".join(letter if letter.isalnum() else "-" for letter in proposal.variant.lower())
    return f"{number}-{proposal.family}-" + "-".join(word for word in words.split("-") if word)


def as_json(found: Suggestions, block: SuggestBlock) -> dict[str, Any]:
    """Return what metrics.json and ``--json`` say."""
    code = exit_code(found)
    return {
        "status": STATUSES[code],
        "message": message(found),
        "suggest": block.model_dump(mode="json", exclude_unset=True, by_alias=True),
        "order": list(block.prefer),
        "proposals": [_record(found, one, number) for number, one in enumerate(found.proposals, 1)],
        "unjudged": [
            _record(found, one, number) for number, one in enumerate(found.unjudged, len(found.proposals) + 1)
        ],
        "near_misses": [_record(found, one) for one in found.near],
        "families": [
            {
                "family": one.family,
                "candidates": len(one.offer.candidates),
                "made": one.made,
                "proposals": sum(each.family == one.family for each in found.proposals),
                "reason": _reason(found, one.family, one.offer.reason),
                "nearest": dict(one.nearest),
            }
            for one in found.answers
        ],
        "warnings": list(_warnings(found)),
    }


def message(found: Suggestions) -> str:
    """Return how it ended, in one sentence."""
    if found.proposals:
        late = "; the time budget ended the search before everything was tried" if found.late else ""
        count = len(found.proposals)
        more = f", {len(found.unjudged)} more not judged in full" if found.unjudged else ""
        return f"{count} mechanism{' meets' if count == 1 else 's meet'} the requirements{more}{late}"
    if exit_code(found) is ExitCode.BUG:
        return "bugs in cfmkit ended every candidate"
    if found.unjudged:
        count = len(found.unjudged)
        late = "; increase the time budget (--time-budget)" if found.late else ""
        were = "was" if count == 1 else "were"
        return f"no mechanism is known to meet the requirements, {count} {were} not judged in full{late}"
    if found.late:
        return "the time budget ended the search before a mechanism met the requirements; increase it (--time-budget)"
    return "no mechanism meets the requirements"


def _reason(found: Suggestions, name: str, out_of_reach: str) -> str:
    if out_of_reach or any(one.family == name for one in found.listed):
        return out_of_reach
    untried = sum(len(one.offer.candidates) for one in found.answers if one.family == name and not one.made)
    if untried:
        return f"none of its {untried} candidates was tried in the time"
    near = [one.missed[0] for one in found.near if one.family == name]
    return (near or list(found.failed.get(name, ())) or [""])[0]


def _warnings(found: Suggestions) -> Iterator[dict[str, str]]:
    if found.late and found.listed:
        yield {
            "name": "search_cut_short",
            "message": "the time budget ended the search: increase it with --time-budget",
        }


def _record(found: Suggestions, one: Proposal, number: int | None = None) -> dict[str, Any]:
    about = {"family": one.family, "variant": one.variant, **with_force(found, one)}
    place = {} if number is None else {"folder": folder_name(number, one)}
    judged = {
        "verdict": one.verdict, "model": one.model, "unjudged": list(one.open), "warnings": list(one.warnings),
    }  # fmt: skip
    return about | place | judged | {"misses": list(one.missed), "notes": list(one.notes)}


def files(
    found: Suggestions, block: SuggestBlock, run: Run, plots: bool, deadlines: Deadlines, command: str | None = None
) -> Iterator[tuple[str, bytes]]:
    """Yield every file of the run as (name below the folder, content).

    Parameters
    ----------
    found, block : Suggestions and SuggestBlock
        Proposals, and the block `suggest`.
    run : Run
        Its executor draws the proposals.
    plots : bool
        Whether to draw.
    deadlines : Deadlines
        What is left out when its time is up.
    command : str, optional
        How the search was started, for ``report.html``; None: no page is written, nor one of each proposal.
    """
    yield "metrics.json", json_bytes(as_json(found, block))
    yield "suggestions.csv", table(found)
    in_time = not deadlines.figures.late()
    drawn = {"proposals": _picture(found)} if found.listed and in_time and (plots or command is not None) else {}
    if plots:
        from cfmkit.plots.style import png

        for name, figure in drawn.items():
            yield f"figures/{name}.png", png(figure)
    if command is not None:
        texts = {folder_name(number, one): one.text for number, one in enumerate(found.listed, 1)}
        yield html.NAME, page(as_json(found, block), exit_code(found), texts, drawn, command)
    work = partial(_make_files, (plots, command is not None), deadlines, found.listed)
    made = dict(give_up_at(run.executor, deadlines.files.deadline)(work, iter(range(len(found.listed))), lambda: False))
    for index, one in enumerate(found.listed):
        files = made.get(index)
        for name, data in files if isinstance(files, list) else [("design.yaml", one.text.encode())]:
            yield f"{folder_name(index + 1, one)}/{name}", data


def _picture(found: Suggestions) -> Figure:
    """Return all proposals to one scale; on a page each leads to its report."""
    from cfmkit.studies.suggest.figures import to_one_scale

    links = [f"{folder_name(number, one)}/{html.NAME}" for number, one in enumerate(found.listed, 1)]
    return to_one_scale(found.listed, found.request, links)


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
    left = deadlines.files.left()
    if left is not None and left < SLOWER * proposal.seconds:  # its analysis would not end in time, its drawing does
        return [
            ("design.yaml", proposal.text.encode()),
            *_draw_part(spec, plots=wanted[0] and not deadlines.figures.late()),
        ]
    plots, page = wanted
    found = dict(files(report_on(api.analyze(spec), design), plots and not deadlines.figures.late(), page))
    return list(({"design.yaml": b""} | found | {"design.yaml": proposal.text.encode()}).items())


SLOWER = 2.0
"""How much longer than before an analysis may take: others run beside it, and figures are drawn."""


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


def table(found: Suggestions) -> bytes:
    """Return suggestions.csv: a row a proposal, then those that were not judged in full, then the near misses."""
    from cfmkit.tables import to_csv
    from cfmkit.tables.table import Table, TableColumn

    rows = [*enumerate(found.listed, 1), *((None, one) for one in found.near)]
    numbers = [with_force(found, one) for _, one in rows]
    unit = "N" if found.request.kind == "force" else "N*mm"
    columns = [
        TableColumn("number", tuple(number for number, _ in rows)),
        TableColumn("family", tuple(one.family for _, one in rows)),
        TableColumn("variant", tuple(one.variant for _, one in rows)),
    ]
    for name, (dimension, border) in COLUMNS.items():
        head = f"{found.request.kind}_mean" if name == "mean" else name
        values = tuple(each.get(name) for each in numbers)
        columns.append(TableColumn(head, values, unit if name == "mean" else border if dimension != "count" else None))
    columns.append(TableColumn("verdict", tuple(one.verdict for _, one in rows)))
    columns.append(TableColumn("model", tuple(one.model for _, one in rows)))
    columns.append(TableColumn("warnings", tuple("; ".join(one.warnings) for _, one in rows)))
    columns.append(TableColumn("unjudged", tuple("; ".join(one.open) for _, one in rows)))
    columns.append(TableColumn("misses", tuple("; ".join(one.missed) for _, one in rows)))
    columns.append(TableColumn("folder", tuple("" if n is None else folder_name(n, one) for n, one in rows)))
    return to_csv(Table(tuple(columns)))


def page(
    record: Mapping[str, Any], code: ExitCode, texts: Mapping[str, str], drawn: Mapping[str, Figure], command: str
) -> bytes:
    """Return the page of a search.

    Parameters
    ----------
    record : mapping
        What metrics.json says.
    code : ExitCode
        Of the process.
    texts : mapping of str to str
        The specification of each proposal, by its folder.
    drawn : mapping of str to Figure
        The pictures, by their names.
    command : str
        How the search was started.
    """
    document = document_of(record, code)
    found = (*record["proposals"], *record["unjudged"])
    specs = [(f"Specification {one['folder']}", texts[one["folder"]]) for one in found]
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


SHARES = ("ripple", "hysteresis", "yield")
"""Numbers of a proposal that are shares."""

JOINED = {"envelope": " x ", "material": " or ", "prefer": ", "}
"""What stands between the values of a key that has several; else they are the two ends of a band."""


def _words(key: str, value: Any) -> str:
    if isinstance(value, list | tuple):
        return JOINED.get(key, " to ").join(_words(key, one) for one in value)
    if isinstance(value, dict):
        return str(value.get("name") or _list_in_words(value))
    return format_short(value, "ratio", 3) if key in SHARES and isinstance(value, float | int) else str(value)
