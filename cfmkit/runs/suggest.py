"""Search of `suggest` as Python and the command line have it: the function, its record for metrics.json, its files.

`cfmkit.suggest` takes requirements from keywords or a file and returns ranked proposals. The record is what
metrics.json, ``--json`` and notebooks say of a search, with its exit code. Files are a folder for each proposal, table,
figures, page and metrics.json.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.documents import html
from cfmkit.documents.suggestion_document import document_of
from cfmkit.errors import ExitCode, Problem, SpecError
from cfmkit.families.run_control import Run, read_time
from cfmkit.runs.specfile import STDIN_PATH, content, rename_source, standard_input
from cfmkit.specs.units import format_short, to_border
from cfmkit.specs.yamlio import read_document
from cfmkit.studies.pool import give_up_at
from cfmkit.studies.suggest.outcome_of_search import Suggestions
from cfmkit.studies.suggest.spec import SuggestBlock, SuggestFile
from cfmkit.tables.csv_and_json import json_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.suggest.proposal_making_and_judging import Proposal


RECORD_COLUMNS: Mapping[str, tuple[str, str]] = {
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


def numbers_in_border_units(suggestions: Suggestions, proposal: Proposal) -> dict[str, Any]:
    """Return a proposal's numbers in border units, the mean in N or N*mm, by the name of its column."""
    numbers: dict[str, Any] = {}
    for name, value in proposal.numbers.items():
        dimension = suggestions.request.kind if name == "mean" else RECORD_COLUMNS[name][0]
        numbers[name] = (
            None if value is None else int(value) if dimension == "count" else float(to_border(value, dimension))
        )
    return numbers


STATUS_BY_CODE = {
    ExitCode.OK: "complete",
    ExitCode.PARTIAL: "partial",
    ExitCode.NO_SOLUTION: "infeasible",
    ExitCode.BUG: "crashed",
}
"""What metrics.json says of each end."""


def folder_name(number: int, proposal: Proposal) -> str:
    """Return the folder of a proposal: ``1-vcfm-2-vs``."""
    words = "".join(letter if letter.isalnum() else "-" for letter in proposal.variant.lower())
    return f"{number}-{proposal.family}-" + "-".join(word for word in words.split("-") if word)


def as_json(suggestions: Suggestions, block: SuggestBlock) -> dict[str, Any]:
    """Return what metrics.json and ``--json`` say."""
    return {
        "status": STATUS_BY_CODE[suggestions.exit_code],
        "message": suggestions.message,
        "suggest": block.model_dump(mode="json", exclude_unset=True, by_alias=True),
        "order": list(block.prefer),
        "proposals": [
            _record(suggestions, proposal, number) for number, proposal in enumerate(suggestions.proposals, 1)
        ],
        "unjudged": [
            _record(suggestions, proposal, number)
            for number, proposal in enumerate(suggestions.unjudged, len(suggestions.proposals) + 1)
        ],
        "near_misses": [_record(suggestions, proposal) for proposal in suggestions.near],
        "families": [
            {
                "family": answer.family,
                "candidates": len(answer.offer.candidates),
                "made": answer.made,
                "proposals": sum(proposal.family == answer.family for proposal in suggestions.proposals),
                "reason": _reason_without_proposal(suggestions, answer.family, answer.offer.reason),
                "nearest": dict(answer.nearest),
            }
            for answer in suggestions.answers
        ],
        "warnings": list(_search_warnings(suggestions)),
    }


def _reason_without_proposal(suggestions: Suggestions, name: str, out_of_reach: str) -> str:
    if out_of_reach or any(proposal.family == name for proposal in suggestions.listed):
        return out_of_reach
    untried = sum(
        len(answer.offer.candidates) for answer in suggestions.answers if answer.family == name and not answer.made
    )
    if untried:
        return f"none of its {untried} candidates was tried in the time"
    misses = [proposal.missed[0] for proposal in suggestions.near if proposal.family == name]
    return (misses or list(suggestions.failed.get(name, ())) or [""])[0]


def _search_warnings(suggestions: Suggestions) -> Iterator[dict[str, str]]:
    if suggestions.late and suggestions.listed:
        yield {
            "name": "search_cut_short",
            "message": "the time budget ended the search: increase it with --time-budget",
        }


def _record(suggestions: Suggestions, proposal: Proposal, number: int | None = None) -> dict[str, Any]:
    about = {"family": proposal.family, "variant": proposal.variant, **numbers_in_border_units(suggestions, proposal)}
    place = {} if number is None else {"folder": folder_name(number, proposal)}
    judged = {
        "verdict": proposal.verdict, "model": proposal.model, "unjudged": list(proposal.open),
        "warnings": list(proposal.warnings),
    }  # fmt: skip
    return about | place | judged | {"misses": list(proposal.missed), "notes": list(proposal.notes)}


def suggest(
    request: str | os.PathLike[str] | None = None,
    *,
    seed: int = 0,
    jobs: int = 1,
    time_budget: str | float | None = 180.0,
    force: str | Sequence[str] | None = None,
    torque: str | Sequence[str] | None = None,
    travel: str | None = None,
    angle: str | None = None,
    ripple: str | float | None = None,
    envelope: Sequence[str] | None = None,
    material: str | Sequence[str] | None = None,
    process: str | None = None,
    adjustable: Sequence[str] | None = None,
    hysteresis: str | float | None = None,
    cycles: int | None = None,
    min_yield: str | float | None = None,
    safety: str | float | None = None,
    springs: str | Sequence[str] | None = None,
    overload: str | None = None,
    prefer: Sequence[str] | None = None,
) -> SuggestionsView:
    """Return mechanisms of every family that meet the requirements, ranked, and those not judged in full.

    Parameters
    ----------
    request : path-like, optional
        A YAML file with a block `suggest`.
    seed : int
        Random seed.
    jobs : int
        Processes; 1: only this one, in which a long job cannot be stopped when the time budget ends.
    time_budget : str or float, optional
        A text with its unit (``"20 s"``, ``"2 min"``), or a number [s]; None: no limit.
    force, torque : str or sequence of str, optional
        To keep constant, ``"20 N"``, or a band of them. These and the next ones replace the keys of the file.
    travel, angle : str, optional
        Over which the force, or the torque, is constant.
    ripple : str or float, optional
        Largest (max - min)/max over the travel.
    envelope : sequence of str, optional
        Box that it stays in, ``["80 mm", "60 mm", "6 mm"]``: across the travel, along it, and the depth.
    material : str or sequence of str, optional
        Allowed materials.
    process : str, optional
        How it is made.
    adjustable : sequence of str, optional
        Range over which the constant force must be adjustable, its lowest and its highest value.
    hysteresis : str or float, optional
        Largest energy loss of a cycle, as a share of its work.
    cycles : int, optional
        Required life.
    min_yield : str or float, optional
        Smallest share of manufactured parts that meet all requirements, as 0.95 or ``"95 %"``: the key `yield`.
    safety : str or float, optional
        Smallest safety factor.
    springs : str or sequence of str, optional
        Which springs may be used.
    overload : str, optional
        Force along the travel that a rigid end stop has to bear.
    prefer : sequence of str, optional
        What decides the order: ``size``, ``ripple``, ``parts``, ``stress``, ``depth``.

    Raises
    ------
    cfmkit.errors.SpecError
        If the request contradicts itself, or is malformed.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.suggest(force="10 kN", travel="10 mm", envelope=["20 mm", "20 mm", "1 mm"], material="pla")
    >>> len(found.proposals), len(found.answers)
    (0, 4)
    """
    arguments = locals()
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import serial
    from cfmkit.studies.suggest.search import suggest as search_families

    def format_value(value: Any) -> str:
        return "[" + ", ".join(map(format_value, value)) + "]" if isinstance(value, list | tuple) else str(value)

    keys = {key: value for key, value in arguments.items() if key in SuggestBlock.model_fields and value is not None}
    keys |= {} if min_yield is None else {"yield": min_yield}
    name = None if request is None else os.fspath(request)
    block = read_request(name, {key: format_value(value) for key, value in keys.items()}, mark="")
    run = Run(seed, time_budget=read_time(time_budget), executor=serial if jobs == 1 else Pool(jobs))
    return SuggestionsView.answering(search_families(block.request(), run, block.prefer), block)


OPTIONS_SOURCE = "options"  # name of a request that has no file


def read_request(
    name: str | None,  # the file; ``-`` is standard input
    keys: Mapping[str, str],  # key of the request -> its value as a file would have it
    mark: str = "--",  # what stands before a key in messages; nothing where keys are arguments of a function
) -> SuggestBlock:
    """Return the request of a file, or of none, with keys replaced by what options say.

    Raises SpecError with everything that is wrong with it.
    """
    if name is None:
        document = read_document("cfmkit: 1\nsuggest: {}\n", OPTIONS_SOURCE)
    else:
        document = read_document(standard_input() if name == STDIN_PATH else content(name), name)
    for key, value in keys.items():
        document = document.set(f"suggest.{key}={value}")
    try:
        return document.bind(SuggestFile).suggest
    except SpecError as error:
        reported = error
    for key in keys:
        reported = rename_source(reported, f"--set suggest.{key}", f"{mark}{key}")
    raise reported if name is not None else _name_missing_options(reported, keys, mark)


def _name_missing_options(error: SpecError, keys: Mapping[str, str], mark: str) -> SpecError:
    """Return the error of a request without a file, with all missing keys in one sentence."""
    duty, path = ("torque", "angle") if "torque" in keys else ("force", "travel")
    missing = [mark + key for key in (duty, path, "envelope") if key not in keys]
    if not missing:
        return error
    verb = "are" if missing[1:] else "is"
    sentence = " and ".join(filter(None, (", ".join(missing[:-1]), missing[-1])))
    others = [problem for problem in error.problems if problem.source != OPTIONS_SOURCE]
    return SpecError([Problem("", 0, 0, "", f"{sentence} {verb} missing"), *others])


@dataclass(frozen=True, repr=False)
class SuggestionsView(Suggestions):
    """Proposals with what was requested; a notebook shows their table and the mechanisms to one scale."""

    block: SuggestBlock | None = field(default=None, compare=False)  # always there; it follows fields with defaults

    @classmethod
    def answering(cls, suggestions: Suggestions, block: SuggestBlock) -> SuggestionsView:
        """Return suggestions with the block `suggest` that they answer."""
        return cls(**{item.name: getattr(suggestions, item.name) for item in fields(suggestions)}, block=block)

    def __repr__(self) -> str:
        """Return the proposals in a line: family and variant of the first ten."""
        listed = [f"{proposal.family} {proposal.variant}"[:100] for proposal in self.listed[:10]]
        return f"<Suggestions: {'; '.join([self.message, *listed])}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        from cfmkit.documents.notebook import show_html
        from cfmkit.documents.suggestion_document import document_of
        from cfmkit.studies.suggest.figures import to_one_scale

        assert self.block is not None  # `answering`
        figures = {"proposals": lambda: to_one_scale(self.listed, self.request)} if self.listed else {}
        return show_html(document_of(as_json(self, self.block), self.exit_code), figures)


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
    from cfmkit.runs.run import files

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
    from cfmkit.runs.exported_files import part_on_paper
    from cfmkit.runs.run import geometry, part_of

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
    return ", ".join(f"{key.replace('_', ' ')} {_say_value(key, value)}" for key, value in pairs.items())


SHARE_COLUMNS = ("ripple", "hysteresis", "yield")  # numbers of a proposal that are shares
LIST_SEPARATORS = {"envelope": " x ", "material": " or ", "prefer": ", "}
"""What stands between the values of a key that has several; else they are the two ends of a band."""


def _say_value(key: str, value: Any) -> str:
    if isinstance(value, list | tuple):
        return LIST_SEPARATORS.get(key, " to ").join(_say_value(key, item) for item in value)
    if isinstance(value, dict):
        return str(value.get("name") or _list_in_words(value))
    return format_short(value, "ratio", 3) if key in SHARE_COLUMNS and isinstance(value, float | int) else str(value)
