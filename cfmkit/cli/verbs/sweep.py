"""``cfmkit sweep``: one mechanism in many variants."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.cli import options as shell_completion
from cfmkit.cli.options import StudyOptions, flag, option
from cfmkit.errors import CfmError, ExitCode, UsageError, lines_of
from cfmkit.numerics.unit_cube_samples import SAMPLE_KINDS, list_phrases

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document
    from cfmkit.specs.yamlio import YamlDocument
    from cfmkit.studies.engine import Records
    from cfmkit.studies.summary_and_tables import Summary
    from cfmkit.studies.sweep_request_and_files import SweepRequest

HELP_POSITION = 22
HELP_EXAMPLE = "cfmkit sweep cam.yaml --vary mechanism.roller_radius=8mm:16mm:5"


@dataclass(frozen=True, kw_only=True)
class SweepOptions(StudyOptions):
    """Arguments and options."""

    vary: list[str] | None = option(
        "A.B=VALUES",
        "Vary a value: start:stop:n or \\[a, b], with units, e.g. mechanism.roller_radius='8 mm:16 mm:5'. "
        "Repeatable; replaces what the spec's block sweep varies.",
        autocompletion=shell_completion.changes,
    )
    zip: bool = flag("Vary values in step instead of in all combinations.")
    sample: str | None = option(
        "KIND:N", f"Draw N points from ranges start:stop. KIND: {', '.join(SAMPLE_KINDS)} ({list_phrases()})."
    )
    design: bool = flag("Redesign the mechanism at each point.")
    curves: bool = flag("Write the curve of every point to curves.csv.")
    metrics: str | None = option("A,B", "Columns of results.csv; default: all.")


def run(options: SweepOptions, terminal: Terminal) -> Document:
    """Analyse a mechanism in many variants: one row per point, whether it could be solved or not.

    Finished points are kept in the folder: after an interruption, run the same command again to continue.
    """
    from cfmkit.cli.run_study_in_folder import open_study
    from cfmkit.documents import study_documents
    from cfmkit.runs.run import RunTask, placing, read
    from cfmkit.studies.sweep_request_and_files import outputs, prepare, summary_of, writes_curves

    start = time.perf_counter()
    document, spec = read(RunTask(options.spec, "", options.changes, options.fidelity))
    asked = request(options)
    with placing(document):
        work = prepare(spec, asked)
    with open_study("sweep", options, terminal, start) as study:
        study.folder.check("results.csv", "metrics.json", "resolved.yaml")
        records = study.compute(work)
        summary = summary_of(records)
        tables = study.write_tables(outputs(records, summary, writes_curves(spec, asked)))  # which fill the summary
        code, reported = exit_code(records, summary), summary.as_json(records)
        dimensions = {metric.name: metric.dimension for metric in work.study.metrics}
        page = study_documents.sweep_document(spec, reported, dimensions, code, reused=records.reused)
        varied = [item.path for item in work.plan.variables]
        study.write_pages(page, work.study, varied, tables, partial(_pictures, records, summary))
        finished = study.commit(page, work.study, options.seed, [records], reported)
    return replace(finished, complaints=(*_sweep_complaints(records, code, options, document), *finished.complaints))


def request(options: SweepOptions) -> SweepRequest:
    """Return what the options ask for.

    Raises UsageError if one is malformed, or two contradict each other.
    """
    from cfmkit.cli.run_study_in_folder import split_names
    from cfmkit.studies.sweep_request_and_files import SweepRequest
    from cfmkit.studies.variations import parse_variation

    if options.zip and options.sample:
        raise UsageError("--zip and --sample exclude each other")
    method, samples = _read_sample(options.sample) if options.sample else ("zip" if options.zip else None, None)
    return SweepRequest(
        vary=tuple(parse_variation(option) for option in options.vary or ()),
        combine=method,
        samples=samples,
        design=options.design or None,
        curves=options.curves or None,
        metrics=split_names(options.metrics),
        seed=options.seed,
        most=options.max_points,
        pictures=options.report or not options.no_plots,
    )


def _read_sample(text: str) -> tuple[str, int]:
    method, _, count = text.partition(":")
    if method not in SAMPLE_KINDS or not (count.isascii() and count.isdigit()) or not 0 < len(count) < 19:
        kinds = " or ".join(f"{kind}:N" for kind in SAMPLE_KINDS)
        raise UsageError(f"--sample {text!r}: write {kinds}, e.g. sobol:256")
    if int(count) < 1:
        raise UsageError("--sample: there must be at least one point")
    return method, int(count)


def exit_code(records: Records, summary: Summary) -> ExitCode:
    """Return the exit code of the process; points that were not computed count first."""
    if records.finished < len(records):
        return ExitCode.INTERRUPTED
    return summary.exit_code()


def _sweep_complaints(records: Records, code: ExitCode, options: SweepOptions, document: YamlDocument) -> Iterator[str]:
    from cfmkit.cli.failures import go_on

    if code is ExitCode.INVALID:
        yield from _first_refusal(records, document)
    if code is ExitCode.INTERRUPTED:
        missing = len(records) - records.finished
        yield f"interrupted  {missing} of {len(records)} points were not computed; {go_on(options.fresh)}"


def _first_refusal(records: Records, document: YamlDocument) -> tuple[str, ...]:
    """Return why the first point is invalid: the table has the message, and the file knows its place."""
    from cfmkit.runs.run import placing

    study = records.work.study
    try:
        with placing(document):
            reported = study.solve(study.variant(records.work.plan.point(0))).message
    except CfmError as error:
        return lines_of(error)
    return (f"error    {reported}",)


def _pictures(records: Records, summary: Summary) -> dict[str, Any]:
    from cfmkit.studies.pictures import makers  # imports matplotlib, which takes half a second

    return makers(records, summary)
