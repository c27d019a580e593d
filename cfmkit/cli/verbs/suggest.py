"""``cfmkit suggest``: from a request to mechanisms of every family that meets it."""

from __future__ import annotations

import shlex
import time
from dataclasses import dataclass, make_dataclass, replace
from typing import TYPE_CHECKING

from cfmkit.cli.options import (
    FRESH_FLAG,
    JOBS_OPTION,
    NO_LOCK_FLAG,
    NO_PLOTS_FLAG,
    OUT_OPTION,
    QUIET_FLAG,
    REPORT_FLAG,
    SEED_OPTION,
    Common,
    argument,
    option,
    seconds,
)
from cfmkit.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document

HELP_POSITION = 5
HELP_EXAMPLE = "cfmkit suggest --force '20 N' --travel '10 mm' --envelope 100x100x20mm"
DEFAULT_BUDGET = "3min"
FIGURES_RESERVE, WRITING_RESERVE = 4.0, 1.0
"""Before the end of the time budget no more figures are begun [s], those of one proposal take about two; and nothing
but what was found is written."""
WRITING_SHARE = 0.1  # share of the time budget that is kept for files


@dataclass(frozen=True, kw_only=True)
class SuggestOptions(Common):
    """Arguments and options, but those that are keys of a request: see `make_options`."""

    request: str | None = argument("FILE", "YAML file with a block 'suggest'; - reads standard input.", default=None)
    time_budget: str = option("TIME", "Time for the whole command: 60s, 10min.", shown=True, default=DEFAULT_BUDGET)
    out: str | None = OUT_OPTION()
    seed: int = SEED_OPTION()
    jobs: int | None = JOBS_OPTION()
    fresh: bool = FRESH_FLAG()
    no_plots: bool = NO_PLOTS_FLAG()
    report: bool = REPORT_FLAG()
    quiet: bool = QUIET_FLAG()
    no_lock: bool = NO_LOCK_FLAG()


def make_options() -> type[SuggestOptions]:
    """Return the options of the command: one for each key of a request, then all others."""
    from cfmkit.families.request_spec import SuggestBlock

    keys = [
        (
            name,
            (list[str] if item.is_repeatable else str) | None,
            option(item.metavar, item.help, f"--{SuggestBlock.key_of(name)}"),
        )
        for name, item in SuggestBlock.options().items()
    ]
    of_request = make_dataclass("RequestOptions", keys, bases=(Common,), frozen=True, kw_only=True)
    return make_dataclass("AllOptions", [], bases=(SuggestOptions, of_request), frozen=True, kw_only=True)


def run(options: SuggestOptions, terminal: Terminal) -> Document:
    """Suggest mechanisms for requirements: a force, a travel and an envelope. Start here if there is no spec yet.

    Candidates from every family are designed and analysed from their written files with the finest model. Those that
    meet all requirements are listed, then those of which not everything could be judged.
    """
    from cfmkit import families
    from cfmkit.cli.options import folder_of
    from cfmkit.cli.run_study_in_folder import open_journal
    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.documents import suggestion_document
    from cfmkit.documents.document import Written, with_skipped_families
    from cfmkit.families.proposals import Request
    from cfmkit.families.run_control import Run
    from cfmkit.runs import suggest as suggestion_files
    from cfmkit.runs import suggest as suggestion_record
    from cfmkit.runs.run import long_run
    from cfmkit.runs.suggest import read_request
    from cfmkit.store import RunFolder
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import cores
    from cfmkit.studies.suggest.search import FIGURE_SECONDS, suggest

    start, begun = time.perf_counter(), time.time()
    budget = seconds(options.time_budget)
    values_by_key = keys(options)
    if options.request is None and not values_by_key:
        raise UsageError("requirements are missing: name a file, or give --force, --travel and --envelope")
    ends = begun + budget
    block = read_request(options.request, values_by_key)
    out = folder_of(options.out, options.request or "options", "suggest")
    with RunFolder(out) as folder, terminal.progress(budget) as progress:
        folder.check("metrics.json", "suggestions.csv")
        plain = Run(options.seed, progress, time_budget=budget - (time.perf_counter() - start))
        jobs = options.jobs or cores()
        with long_run(jobs, options.fresh, folder, plain, open_journal) as working:
            if jobs == 1:  # a process of its own, which can be ended when the time is up
                working = replace(working, executor=Pool(1))
            reserve = max(FIGURES_RESERVE, WRITING_SHARE * budget) if options.no_plots else FIGURE_SECONDS
            suggestions = suggest(Request.from_block(block), working, block.prefer, reserve)
            deadlines = suggestion_files.Deadlines(Clock(ends - FIGURES_RESERVE), Clock(ends - WRITING_RESERVE))
            command = shlex.join(["cfmkit", *terminal.arguments]) if options.report else None
            for name, content in suggestion_files.files(
                suggestions, block, working, not options.no_plots, deadlines, command
            ):
                folder.write(name, content)
        code = suggestions.exit_code
        manifest = folder.commit(
            {
                "command": "suggest", "arguments": list(terminal.arguments), "seed": options.seed,
                "suggest": block.as_written(),
                "reused": suggestions.reused, "status": code.name.lower(), "exit_code": int(code),
            }
        )  # fmt: skip
    written = Written(out, (*manifest.files, "manifest.json"), time.perf_counter() - start)
    data = suggestion_record.as_json(suggestions, block) | written.data | {"reused": suggestions.reused}
    complaints = () if code is ExitCode.OK else (f"error    {data['message']}",)
    document = replace(
        suggestion_document.document_of(data, code, written),
        data=data,
        complaints=tuple(_bug_complaints(suggestions.bugs, terminal.tracebacks)),
        quiet_complaints=complaints,
    )
    return with_skipped_families(families.list_skipped(), document)


def _bug_complaints(bugs: Sequence[str], shown: bool) -> Iterator[str]:
    """Yield how many candidates a bug ended, and the first traceback if it is to be shown."""
    if bugs:
        yield f"error    {len(bugs)} of the families and candidates hit a bug in cfmkit; -vv shows the first"
    if bugs and shown:
        yield from bugs[0].rstrip("\n").split("\n")


def keys(options: SuggestOptions) -> dict[str, str]:
    """Return the keys of a request that options say, each as a file would have it."""
    from cfmkit.families.request_spec import SuggestBlock

    values_by_key = {}
    for name, item in SuggestBlock.options().items():
        value = getattr(options, name)
        if value is None or value == []:
            continue
        if isinstance(value, list):
            value = value[0] if len(value) == 1 else ",".join(part.strip().strip("[]") for part in value)
        values_by_key[SuggestBlock.key_of(name)] = item.write(value)
    return values_by_key
