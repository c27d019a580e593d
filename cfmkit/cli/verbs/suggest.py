"""``cfmkit suggest``: from a wish to mechanisms of every family that does it."""

from __future__ import annotations

import re
import shlex
import time
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cfmkit.cli.options import (
    Common,
    Fresh,
    Jobs,
    NoLock,
    NoPlots,
    Out,
    Quiet,
    Seed,
    WithReport,
    argument,
    option,
    seconds,
)
from cfmkit.cli.page_block_types import (
    BAD,
    BLANK,
    LABEL,
    CellGrid,
    GridColumn,
    Paragraph,
    Span,
    TextLine,
    Written,
    line,
    next_command,
)
from cfmkit.cli.verb_result import Answer, reported_for
from cfmkit.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cfmkit.cli.output import Terminal
    from cfmkit.cli.page_block_types import Block

PLACE = 5
EXAMPLE = "cfmkit suggest --force '20 N' --travel '10 mm' --room 100x100x20mm"

BUDGET = "3min"

SPARE, WRITING = 4.0, 1.0
"""Before the end of the time budget no more figures are begun [s], those of one proposal take about two; and nothing
but what was found is written."""

WRITTEN = 0.1
"""Share of the time budget that is kept for files."""


def _key(name: str, metavar: str, text: str) -> Any:
    return option(f"--{name}", metavar=metavar, text=text)


@dataclass(frozen=True, kw_only=True)
class SuggestOptions(Common):
    """Arguments and options."""

    wish: Annotated[
        str | None,
        argument("WISH", "YAML file with a block 'wish'; - reads standard input."),
    ] = None
    force: Annotated[str | None, _key("force", "FORCE", "Constant force, '20 N', or a band, '19 N, 21 N'.")] = None
    torque: Annotated[str | None, _key("torque", "TORQUE", "Constant torque, '100 N*mm', or a band.")] = None
    travel: Annotated[str | None, _key("travel", "LENGTH", "Travel over which the force is to be constant.")] = None
    angle: Annotated[str | None, _key("angle", "ANGLE", "Angle over which the torque is to be constant.")] = None
    ripple: Annotated[str | None, _key("ripple", "SHARE", "Largest (max - min)/max over the travel; default: 5 %.")] = (
        None
    )
    room: Annotated[
        str | None, _key("room", "AxBxCmm", "Space available: across the travel, along it, and the depth (optional).")
    ] = None
    material: Annotated[
        list[str] | None,
        _key("material", "A,B", "Permitted materials; `cfmkit show materials` lists them. Repeatable."),
    ] = None
    process: Annotated[
        str | None, _key("process", "NAME", "Manufacturing process: fdm, sls, laser, wire-edm or mill.")
    ] = None
    adjustable: Annotated[str | None, _key("adjustable", "A,B", "Lowest and highest adjustable force: 15N,25N.")] = None
    hysteresis: Annotated[
        str | None, _key("hysteresis", "SHARE", "Largest energy loss of a cycle, as a share of its work.")
    ] = None
    cycles: Annotated[
        str | None, _key("cycles", "N", "Required life in cycles; judged for materials with fatigue data.")
    ] = None
    made_well: Annotated[
        str | None, _key("yield", "SHARE", "Required share of manufactured parts that meet the wish.")
    ] = None
    prefer: Annotated[
        list[str] | None,
        _key("prefer", "A,B", "Ranking, most important first: size,ripple,parts,stress,depth. Repeatable."),
    ] = None
    time_budget: Annotated[
        str, option("--time-budget", metavar="TIME", shown=True, text="Time for the whole command: 60s, 10min.")
    ] = BUDGET
    out: Out = None
    seed: Seed = 0
    jobs: Jobs = None
    fresh: Fresh = False
    no_plots: NoPlots = False
    report: WithReport = False
    quiet: Quiet = False
    no_lock: NoLock = False


KEYS = (
    "force", "torque", "travel", "angle", "ripple", "room", "material", "process", "adjustable", "hysteresis", "cycles",
    "made_well", "prefer",
)  # fmt: skip
"""Options that are keys of a wish."""

LISTS = ("material", "adjustable", "prefer")

BANDS = ("force", "torque")
"""Keys that are a list where two values are given."""


def run(options: SuggestOptions, terminal: Terminal) -> Answer:
    """Suggest mechanisms for a wish: a force, a travel and a room. Start here if there is no spec yet.

    Candidates from every family are designed and analysed from their written files with the finest model. Those that
    meet the whole wish are listed, then those of which not everything could be judged.
    """
    from cfmkit import families
    from cfmkit.cli.run_study_in_folder import noting
    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.families.run_control import Run
    from cfmkit.runs import suggestion_files
    from cfmkit.runs.read_wish import wish_of
    from cfmkit.runs.run import long_run
    from cfmkit.store import RunFolder
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import cores
    from cfmkit.studies.suggest.search import RESERVE, suggest

    start, begun = time.perf_counter(), time.time()
    budget = seconds(options.time_budget)
    given = keys(options)
    if options.wish is None and not given:
        raise UsageError("a wish is missing: name a file, or say --force, --travel and --room")
    ends = begun + budget
    block = wish_of(options.wish, given)
    out = _folder(options)
    with RunFolder(out) as folder, terminal.progress() as progress:
        folder.check("metrics.json", "suggestions.csv")
        plain = Run(options.seed, progress, time_budget=budget - (time.perf_counter() - start))
        jobs = options.jobs or cores()
        with long_run(jobs, options.fresh, folder, plain, noting) as working:
            if jobs == 1:  # a process of its own, which can be ended when the time is up
                working = replace(working, executor=Pool(1))
            reserve = max(SPARE, WRITTEN * budget) if options.no_plots else RESERVE
            found = suggest(block.wish(), working, block.prefer, reserve)
            deadlines = suggestion_files.Deadlines(Clock(ends - SPARE), Clock(ends - WRITING))
            command = shlex.join(["cfmkit", *terminal.arguments]) if options.report else None
            for name, content in suggestion_files.files(
                found, block, working, not options.no_plots, deadlines, command
            ):
                folder.write(name, content)
        code = suggestion_files.exit_code(found)
        manifest = folder.commit(
            {
                "command": "suggest", "arguments": list(terminal.arguments), "seed": options.seed,
                "wish": block.model_dump(mode="json", exclude_unset=True, by_alias=True), "reused": found.reused,
                "status": code.name.lower(), "exit_code": int(code),
            }
        )  # fmt: skip
    written = Written(out, (*manifest.files, "manifest.json"), time.perf_counter() - start)
    data = suggestion_files.as_json(found, block) | written.data | {"reused": found.reused}
    complaints = () if code is ExitCode.OK else (f"error    {data['message']}",)
    page = _page(data, written, terminal.verbose > 0)
    answer = Answer(data, page, code, tuple(_bugs(found.bugs, terminal.tracebacks)), quiet_complaints=complaints)
    return reported_for(families.skipped(), answer)


def _bugs(bugs: Sequence[str], shown: bool) -> Iterator[str]:
    """Yield how many candidates a bug ended, and the first traceback if it is to be shown."""
    if bugs:
        yield f"error    {len(bugs)} of the families and candidates hit a bug in cfmkit; -vv shows the first"
    if bugs and shown:
        yield from bugs[0].rstrip("\n").split("\n")


def keys(options: SuggestOptions) -> dict[str, str]:
    """Return the keys of a wish that options say, each as a file would have it."""
    found = {}
    for one in fields(options):
        value = getattr(options, one.name)
        if one.name not in KEYS or value is None or value == []:
            continue
        if isinstance(value, list):
            value = value[0] if len(value) == 1 else ",".join(part.strip().strip("[]") for part in value)
        if one.name == "room":
            value = room(value)
        elif (one.name in LISTS or (one.name in BANDS and _are_two(value))) and not value.strip().startswith("["):
            value = f"[{value}]"
        found["yield" if one.name == "made_well" else one.name] = value
    return found


def _are_two(text: str) -> bool:
    """Return True if a text has two values with units, so that its comma is no decimal one."""
    parts = text.split(",")
    return len(parts) == 2 and all(re.search(r"[a-zA-Z]", part) for part in parts)


def room(text: str) -> str:
    """Return the sides of a room as a list: ``80x60x6mm``, or ``80 mm x 60 mm``.

    Examples
    --------
    >>> room("80x60x6mm"), room("80 mm x 6 cm")
    ('[80 mm, 60 mm, 6 mm]', '[80 mm, 6 cm]')
    """
    if text.strip().startswith("["):
        return text
    sides = [side.strip() for side in re.split(r"(?<=[\d. a-z])x(?=[\d. ])", text.strip())]
    unit = re.sub(r"^[\d.eE+-]*\s*", "", sides[-1])
    full = [side if re.search(r"[a-zA-Z]", side) else f"{side} {unit}" for side in sides]
    return "[" + ", ".join(re.sub(r"(?<=\d)(?=[a-zA-Z])", " ", side) for side in full) + "]"


def _folder(options: SuggestOptions) -> str:
    if options.out is not None:
        if not options.out.strip():
            raise UsageError("--out is empty; give a folder")
        return options.out
    if options.wish == "-":
        raise UsageError("a wish from standard input has no name; give the output folder with --out")
    stem = "options" if options.wish is None else Path(options.wish).stem
    return str(Path("cfm-out") / f"{stem}-suggest")


HEADS = ("", "", "mean", "ripple", "room", "safety", "parts", "model")
"""Of the table; "hysteresis" follows where a proposal has some, and "yield" where one is wished."""

VARIANT = 1
"""The column whose cells may take several lines; a number is never broken."""


def _page(data: Mapping[str, Any], written: Written, everything: bool) -> Iterator[Block]:
    """Yield the proposals as a table, near misses, families out of reach with their nearest wish, files."""
    head, _, rest = data["message"].partition("; ")  # the time stands behind what fits into a line
    yield TextLine((Span("suggest", LABEL), Span(f"  {head}")), f"{written.seconds:.1f} s")
    if rest:
        yield Paragraph("", rest)
    listed = [*data["proposals"], *data["unjudged"]]
    if data["proposals"]:
        yield BLANK
        yield from _rows(data["proposals"], data, 1)
    if data["unjudged"]:
        yield BLANK
        yield line("not judged in full", LABEL)
        yield from _rows(data["unjudged"], data, len(data["proposals"]) + 1)
    if data["near_misses"]:
        yield BLANK
        yield line("near misses: one requirement not met", LABEL)
        near = [[one["family"], f"{one['variant']}: {one['misses'][0]}"] for one in data["near_misses"]]
        yield CellGrid((GridColumn("", False), GridColumn()), near, gap=2, indented=True)
    named = {one["family"] for one in listed}
    silent = [one for one in data["families"] if one["family"] not in named]
    if silent:
        yield BLANK
        yield line("no proposals from these families", LABEL)
        yield CellGrid((GridColumn("", False), GridColumn()), [_silent(one) for one in silent], gap=2, indented=True)
    for one in data["warnings"]:
        yield Paragraph("warning", f"{one['name']}: {one['message']}", BAD)
    yield BLANK
    yield written.block(everything)
    if bare := [one["folder"] for one in listed if not _complete(one["folder"], written.files)]:
        yield Paragraph(
            "note",
            f"the time ran out: of {', '.join(bare)} only design.yaml was written, and what is cut if there was time; "
            "`cfmkit analyze` of that file gives the curve and figures, `cfmkit export --format dxf,svg,png` the files "
            "to cut and a drawing",
        )
    if listed:  # files to cut or print of the best
        best = Path(written.folder) / listed[0]["folder"] / "design.yaml"
        yield next_command("cfmkit", "export", str(best))


def _rows(listed: Sequence[Mapping[str, Any]], data: Mapping[str, Any], first: int) -> Iterator[Block]:
    """Yield a table of mechanisms, and below it what else a row says: what was not judged, and warnings."""
    more = _more(data)
    rows = [
        [*_row(str(number), one, data), *(_share(one[name]) for name in more)]
        for number, one in enumerate(listed, first)
    ]
    heads = tuple(GridColumn(head, number == VARIANT) for number, head in enumerate((*HEADS, *more)))
    yield CellGrid(heads, rows, gap=2, indented=True)
    said = [(number, [*one["unjudged"], *one["warnings"]]) for number, one in enumerate(listed, first)]
    cells = [[str(number), "; ".join(words)] for number, words in said if words]
    if cells:
        yield CellGrid((GridColumn("", False), GridColumn()), cells, gap=2, indented=True)


def _complete(folder: str, files: Iterable[str]) -> bool:
    """Return True if a proposal's analysis is there, not its spec and its drawing alone."""
    return f"{folder}/metrics.json" in files


def _more(data: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the shares that follow the other columns of the table."""
    lossy = any(one["hysteresis"] is not None for one in (*data["proposals"], *data["unjudged"]))
    return (*(("hysteresis",) if lossy else ()), *(("yield",) if "yield" in data["wish"] else ()))


def _silent(one: Mapping[str, Any]) -> list[str]:
    """Return why a family has no proposal, and the nearest wish that it could meet."""
    nearest = ", ".join(f"{key} {value}" for key, value in one["nearest"].items())
    return [one["family"], (one["reason"] or "no mechanism fits") + (f"; nearest: {nearest}" if nearest else "")]


def _row(number: str, one: Mapping[str, Any], data: Mapping[str, Any]) -> list[str]:
    unit = "N*mm" if "torque" in data["wish"] else "N"
    sides = [one["across"], one["along"], one["depth"]]
    room_needed = " x ".join(f"{side:.3g}" for side in sides if side is not None) + " mm"
    return [
        f"{number} {one['family']}",
        one["variant"],
        f"{one['mean']:.4g} {unit}",
        "-" if one["ripple"] is None else f"{100 * one['ripple']:.2g} %",
        room_needed,
        "-" if one["safety_factor"] is None else f"{one['safety_factor']:.3g}",
        str(one["parts"]),
        one["model"],
    ]


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.3g} %"
