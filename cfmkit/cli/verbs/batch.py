"""``cfmkit batch``: many specifications at once, for continuous integration."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from cfmkit.cli.options import (
    FIDELITY_OPTION,
    FRESH_FLAG,
    JOBS_OPTION,
    NO_LOCK_FLAG,
    QUIET_FLAG,
    REPORT_FLAG,
    SEED_OPTION,
    TIMEOUT_OPTION,
    FigureChoice,
    SpecOptions,
    argument,
    flag,
    option,
)
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document
    from cfmkit.runs.batch import BatchResult


HELP_POSITION = 26
HELP_EXAMPLE = "cfmkit batch 'specs/*.yaml' --junit results.xml"


@dataclass(frozen=True, kw_only=True)
class BatchOptions(SpecOptions, FigureChoice):
    """Arguments and options."""

    specs: list[str] = argument("SPEC", "YAML files, folders, or quoted patterns such as 'configs/**/*.yaml'.")
    out: str | None = option("DIR", "Output folder; default: cfm-out/batch/.", "-o", "--out")
    verb: Literal["design", "analyze"] | None = option(
        None, "What to do with every spec; default: design where there is a block design, else analyze."
    )
    junit: str | None = option("FILE", "Write JUnit XML: a test for each requirement.")
    summary: str | None = option("FILE", "Write the outcome in Markdown, e.g. for a job's summary.")
    annotations: Literal["github"] | None = option(
        None, "Report problems with file and line, in the format of GitHub annotations."
    )
    compare: str | None = option(
        "OLDDIR", "Compare the metrics with those of an earlier batch; end with exit code 5 if one has changed."
    )
    compare_tolerance: str | None = option("SHARE", "Relative change that is tolerated; default: 0.0001 %.")
    accept: bool = flag("Make the results the reference: replace those in the folder of --compare.")
    fail_fast: bool = flag("Start no more specs once one has failed.")
    jobs: int | None = JOBS_OPTION()
    timeout_per_point: float | None = TIMEOUT_OPTION()
    fresh: bool = FRESH_FLAG()
    fidelity: str | None = FIDELITY_OPTION()
    seed: int = SEED_OPTION()
    report: bool = REPORT_FLAG()
    quiet: bool = QUIET_FLAG()
    no_lock: bool = NO_LOCK_FLAG()


def run(options: BatchOptions, terminal: Terminal) -> Document:
    """Design or analyse many specs, check their requirements and summarise; the exit code is that of the worst.

    The results of an earlier batch are reused if nothing has changed: the spec, the options, cfmkit, and the files
    that were written.
    """
    from cfmkit.cli.progress import watching
    from cfmkit.cli.run_study_in_folder import open_journal
    from cfmkit.documents.batch_document import document_of
    from cfmkit.documents.document import Note, Written
    from cfmkit.runs.batch import batch, list_unreached_options
    from cfmkit.studies.batch_sources_and_outcomes import message

    start = time.perf_counter()
    with watching(terminal, "specs") as progress:
        result = batch(
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
            compare_tolerance=_read_tolerance(options),
            accept=options.accept,
            page=options.report,
            form=options.form,
            arguments=terminal.arguments,
            monitor=progress,
            noting=open_journal,
        )
    written = Written(result.folder, result.files, time.perf_counter() - start)
    named = tuple(Note("written", file, whole=True) for file in (options.junit, options.summary) if file)
    if result.accepted:
        named = (*named, Note("accepted", f"{result.accepted} has these results now", whole=True))
    document = document_of(result.entries, result.exit_code, written, result.compared)
    return replace(
        document,
        data=dict(result.summary)
        | written.data
        | {"junit": options.junit, "reused": sum(entry.reused for entry in result.entries)}
        | ({"accepted": result.accepted} if result.accepted else {}),
        notes=(*document.notes, *named),
        complaints=(
            *_batch_complaints(result, options, terminal),
            *list_unreached_options(result.entries, options.changes),
            *(_annotation_lines(result) if options.annotations else ()),
        ),
        quiet_complaints=() if result.exit_code is ExitCode.OK else (message(result.entries),),
        errors=tuple({"message": line} for entry in result.entries for line in entry.errors),
    )


def _read_tolerance(options: BatchOptions) -> float | None:
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


def _annotation_lines(result: BatchResult) -> Iterator[str]:
    from cfmkit.documents.continuous_integration import workflow_commands

    return workflow_commands(result.entries, _place_of, result.compared.changes if result.compared else ())


def _place_of(name: str, number: int) -> tuple[int, int]:
    """Return line and column of a requirement; (0, 0) if the file cannot be read any more."""
    from cfmkit.errors import CfmError
    from cfmkit.runs.specfile import read_spec

    try:
        line, column = read_spec(name).place(f"requirements.{number}")
    except CfmError:
        return 0, 0
    return line or 0, column or 0


def _batch_complaints(result: BatchResult, options: BatchOptions, terminal: Terminal) -> Iterator[str]:
    from cfmkit.cli.failures import go_on
    from cfmkit.runs.batch import complaints

    yield from complaints(result.entries, terminal.tracebacks)
    if result.exit_code is ExitCode.INTERRUPTED:
        left = sum(entry.skipped for entry in result.entries)
        yield f"interrupted  {left} of {len(result.entries)} specs were not run; {go_on(options.fresh)}"
