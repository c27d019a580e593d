"""``cfmkit batch``: many specifications at once, for continuous integration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from cfmkit.cli.options import (
    Changing,
    Fidelity,
    FigureChoice,
    Fresh,
    Jobs,
    NoLock,
    Quiet,
    Seed,
    Timeout,
    WithReport,
    argument,
    flag,
    option,
)
from cfmkit.cli.page_block_types import (
    BAD,
    BLANK,
    FAINT,
    GOOD,
    LABEL,
    CellGrid,
    Paragraph,
    Span,
    TextLine,
    Written,
    columns,
)
from cfmkit.cli.verb_result import Answer
from cfmkit.errors import ExitCode, visible

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.cli.output import Terminal
    from cfmkit.cli.page_block_types import Block
    from cfmkit.runs.batch import BatchResult
    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.metric_changes_since_earlier_batch import BatchComparison


PLACE = 26
EXAMPLE = "cfmkit batch 'specs/*.yaml' --junit results.xml"


@dataclass(frozen=True, kw_only=True)
class BatchOptions(Changing, FigureChoice):
    """Arguments and options."""

    specs: Annotated[
        list[str],
        argument("SPEC", "YAML files, folders, or quoted patterns such as 'configs/**/*.yaml'."),
    ]
    out: Annotated[str | None, option("-o", "--out", metavar="DIR", text="Output folder; default: cfm-out/batch/.")] = (
        None
    )
    verb: Annotated[
        Literal["design", "analyze"] | None,
        option(
            "--verb", text="What to do with every spec; default: design where there is a block design, else analyze."
        ),
    ] = None
    junit: Annotated[
        str | None, option("--junit", metavar="FILE", text="Write JUnit XML: a test for each requirement.")
    ] = None
    summary: Annotated[
        str | None, option("--summary", metavar="FILE", text="Write the outcome in Markdown, e.g. for a job's summary.")
    ] = None
    annotations: Annotated[
        Literal["github"] | None,
        option("--annotations", text="Report problems with file and line, in the format of GitHub annotations."),
    ] = None
    compare: Annotated[
        str | None,
        option(
            "--compare",
            metavar="OLDDIR",
            text="Compare the metrics with those of an earlier batch; end with exit code 5 if one has changed.",
        ),
    ] = None
    compare_tolerance: Annotated[
        str | None,
        option("--compare-tolerance", metavar="SHARE", text="Relative change that is tolerated; default: 0.0001 %."),
    ] = None
    fail_fast: Annotated[bool, flag("--fail-fast", text="Start no more specs once one has failed.")] = False
    jobs: Jobs = None
    timeout_per_point: Timeout = None
    fresh: Fresh = False
    fidelity: Fidelity = None
    seed: Seed = 0
    report: WithReport = False
    quiet: Quiet = False
    no_lock: NoLock = False


def run(options: BatchOptions, terminal: Terminal) -> Answer:
    """Design or analyse many specs, check their requirements and summarise; the exit code is that of the worst.

    The results of an earlier batch are reused if nothing has changed: the spec, the options, cfmkit, and the files
    that were written.
    """
    from cfmkit.cli import run_study_in_folder
    from cfmkit.cli.progress import watching
    from cfmkit.runs.batch import batch, unreached
    from cfmkit.studies.batch_sources_and_outcomes import message

    start = run_study_in_folder.now()
    with watching(terminal, "specs") as progress:
        found = batch(
            options.specs,
            "cfm-out/batch" if options.out is None else options.out,
            verb=options.verb,
            changes=options.changes,
            fidelity=options.fidelity,
            seed=options.seed,
            plots=not options.no_plots,
            jobs=options.jobs,
            timeout_per_point=options.timeout_per_point,
            fail_fast=options.fail_fast,
            fresh=options.fresh,
            junit=options.junit,
            summary=options.summary,
            compare=options.compare,
            compare_tolerance=_tolerance(options),
            page=options.report,
            form=options.form,
            arguments=terminal.arguments,
            monitor=progress,
            noting=run_study_in_folder.noting,
        )
    written = Written(found.folder, found.files, run_study_in_folder.now() - start)
    return Answer(
        dict(found.summary) | written.data | {"junit": options.junit, "reused": _reused(found.entries)},
        _page(found, written, tuple(filter(None, (options.junit, options.summary))), terminal.verbose > 0),
        found.exit_code,
        (
            *_complaints(found, options, terminal),
            *unreached(found.entries, options.changes),
            *(_annotations(found) if options.annotations else ()),
        ),
        () if found.exit_code is ExitCode.OK else (message(found.entries),),
        tuple({"message": line} for one in found.entries for line in one.errors),
    )


def _tolerance(options: BatchOptions) -> float | None:
    from cfmkit.errors import QuantityError, UsageError
    from cfmkit.specs.units import read_quantity

    if options.compare_tolerance is None:
        return None
    if options.compare is None:
        raise UsageError("--compare-tolerance applies to a comparison: name an earlier batch with --compare")
    try:
        return read_quantity(options.compare_tolerance, "ratio")
    except QuantityError as error:
        raise UsageError(f"--compare-tolerance: {error}") from None


def _annotations(found: BatchResult) -> Iterator[str]:
    from cfmkit.cli.github_annotations import workflow_commands

    return workflow_commands(found.entries, found.compared.changes if found.compared else ())


def _complaints(found: BatchResult, options: BatchOptions, terminal: Terminal) -> Iterator[str]:
    from cfmkit.cli.failures import go_on
    from cfmkit.runs.batch import complaints

    yield from complaints(found.entries, terminal.tracebacks)
    if found.exit_code is ExitCode.INTERRUPTED:
        left = sum(one.skipped for one in found.entries)
        yield f"interrupted  {left} of {len(found.entries)} specs were not run; {go_on(options.fresh)}"


def _reused(entries: Sequence[Entry]) -> int:
    return sum(one.reused for one in entries)


MOST_CHANGES = 8
"""Changed values that are shown without ``-v``, so that verdicts stay on the screen."""


def _page(found: BatchResult, written: Written, more: Sequence[str], everything: bool) -> Iterator[Block]:
    """Yield one line per specification, and what is wrong below it."""
    from cfmkit.studies.batch_sources_and_outcomes import message

    entries = found.entries
    count = _reused(entries)
    reused = f", {count} reused" if count else ""
    yield TextLine((Span(message(entries), LABEL),), f"{written.seconds:.2f} s{reused}")
    yield BLANK
    yield CellGrid(columns(True, True, True, True), [_row(one) for one in entries], gap=2)
    yield BLANK
    for one in entries:
        for requirement in one.missed if one.verb and not one.errors else ():
            reported = requirement["sentence"].removesuffix(": missed")
            yield Paragraph("missed", f"{visible(one.spec)}: {reported}", BAD)
        for item in one.warnings if everything else ():
            yield Paragraph("warning", f"{visible(one.spec)}: {item['name']}: {item['message']}", BAD)
    if found.compared is not None:
        yield from _changes(found.compared, everything)
    yield written.block(everything)
    for file in more:
        yield Paragraph("written", file, GOOD)


def _changes(compared: BatchComparison, everything: bool) -> Iterator[Block]:
    """Yield what has changed since an earlier batch, those values first that changed beyond the tolerance."""
    beyond = compared.beyond
    reported = (
        f"{len(compared.changes)} values differ from {visible(compared.folder)}, {len(beyond)} beyond the tolerance"
    )
    yield Paragraph("compared", reported, BAD if beyond else GOOD)
    shown = compared.changes if everything else beyond[:MOST_CHANGES]
    for one in shown:
        yield Paragraph("changed", f"{visible(one.spec)}: {one.sentence}", BAD if one.beyond else FAINT)
    if len(beyond) > len(shown):
        yield Paragraph("changed", f"{len(beyond) - len(shown)} more; -v shows all, changes.csv has them", FAINT)


def _row(one: Entry) -> tuple[str | Span, ...]:
    from cfmkit.studies.batch_sources_and_outcomes import outcome

    word = outcome(one)
    good = word == "ok"
    tone = GOOD if good else FAINT if one.skipped else BAD
    return f"  {visible(one.spec)}", one.verb, Span(word if good or one.skipped else word.upper(), tone), _detail(one)


def _detail(one: Entry) -> str:
    """Return how many requirements are met, or what went wrong before any could be."""
    if one.skipped:
        return ""
    if one.errors:
        return "see above"
    if one.missed and one.code is ExitCode.REQUIREMENT_MISSED:
        return f"{len(one.missed)} of {len(one.requirements)} requirements"
    if one.code:
        return one.message
    reported = f"{len(one.requirements)} requirement{'s' * (len(one.requirements) != 1)} met"
    count = len(one.warnings)
    return reported + (f", {count} warning{'s' * (count != 1)}" if count else "")
