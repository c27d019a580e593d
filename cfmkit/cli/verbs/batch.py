"""``cfmkit batch``: many specs at once, for continuous integration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cfmkit.cli.answer import Answer
from cfmkit.cli.options import Changing, Common, Fidelity, NoPlots, Quiet, Seed
from cfmkit.cli.studies import Fresh, Jobs, Timeout
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.cli.batch import BatchWork
    from cfmkit.cli.terminal import Terminal
    from cfmkit.store import RunFolder
    from cfmkit.studies.batch import Entry

PLACE = 26

Specs = Annotated[
    list[str],
    typer.Argument(
        metavar="SPEC...",
        help="YAML files, folders, or quoted patterns such as 'configs/**/*.yaml'.",
        show_default=False,
    ),
]
VerbOption = Annotated[
    Literal["design", "analyze"] | None,
    typer.Option(
        "--verb",
        help="What to do with every spec; default: design where there is a block design, else analyze.",
        show_default=False,
    ),
]
BatchFolder = Annotated[
    str | None,
    typer.Option("-o", "--out", metavar="DIR", help="Output folder; default: cfm-out/batch/.", show_default=False),
]
JUnit = Annotated[
    str | None,
    typer.Option("--junit", metavar="FILE", help="Write JUnit XML: a test for each requirement.", show_default=False),
]
FailFast = Annotated[bool, typer.Option("--fail-fast", help="Start no more specs once one has failed.")]


@dataclass(frozen=True, kw_only=True)
class Options(Changing, Common):
    """Arguments and options."""

    specs: Specs
    out: BatchFolder = None
    verb: VerbOption = None
    junit: JUnit = None
    fail_fast: FailFast = False
    jobs: Jobs = None
    timeout_per_point: Timeout = None
    fresh: Fresh = False
    fidelity: Fidelity = None
    seed: Seed = 0
    no_plots: NoPlots = False
    quiet: Quiet = False


def run(options: Options, terminal: Terminal) -> Answer:
    """Design or analyse many specs, check their requirements, and sum up; the exit code says the worst.

    A spec that an earlier batch has finished is reused as long as nothing has changed: neither spec nor options, nor
    cfmkit, nor a file that was written.
    """
    from cfmkit.cli import batch, studies
    from cfmkit.cli.progress import watching
    from cfmkit.specfile import addressed
    from cfmkit.store import RunFolder
    from cfmkit.studies.batch import folders, sources
    from cfmkit.studies.junit import junit
    from cfmkit.studies.kept import KeptRuns

    start = studies.now()
    out = _folder(options)
    for change in options.changes:
        addressed(change)
    files = sources(options.specs, out)
    jobs = [batch.Job(k, *pair) for k, pair in enumerate(zip(files, folders(files), strict=True))]
    executor = batch.executor_for(options.jobs, len(jobs), options.timeout_per_point)
    report = None if options.junit is None else batch.prepared(options.junit)
    work = _work(options, out, terminal)
    with (
        RunFolder(out) as folder,
        studies.noting(folder, options.fresh) as journal,
        watching(terminal, "specs") as progress,
    ):
        folder.check("results.csv", "requirements.csv", "metrics.json")
        kept = KeptRuns(out, work.deciding, journal)
        entries = batch.carry_out(work, jobs, batch.Crew(executor, options.fail_fast, progress, kept))
        code = batch.exit_code(entries, progress.stopped)
        written = _write(folder, entries, _about(options, terminal, code))
    if report is not None:
        report(junit(entries))
    return _answer(entries, code, Ending(out, written, options.junit, studies.now() - start, options.fresh), terminal)


def _folder(options: Options) -> str:
    from cfmkit.errors import UsageError

    if options.out is not None and not options.out.strip():
        raise UsageError("--out is empty; give a folder")
    return options.out or "cfm-out/batch"


def _work(options: Options, out: str, terminal: Terminal) -> BatchWork:
    from cfmkit.cli.batch import BatchWork
    from cfmkit.cli.options import Computing

    common = Computing(
        spec="",
        set=options.set,
        fidelity=options.fidelity,
        seed=options.seed,
        no_plots=options.no_plots,
        quiet=True,
    )
    return BatchWork(out, common, options.verb, terminal.arguments, options.fresh)


def _about(options: Options, terminal: Terminal, code: ExitCode) -> dict[str, Any]:
    """Return what the manifest says about the run."""
    return {
        "command": "batch",
        "arguments": list(terminal.arguments),
        "seed": options.seed,
        "spec": {"source": list(options.specs)},
        "status": code.name.lower(),
        "exit_code": int(code),
    }


def _write(folder: RunFolder, entries: Sequence[Entry], about: dict[str, Any]) -> tuple[str, ...]:
    from cfmkit.jsontext import json_bytes
    from cfmkit.studies.batch import requirements_table, results_table
    from cfmkit.tables import to_csv

    folder.write("results.csv", to_csv(results_table(entries)))
    folder.write("requirements.csv", to_csv(requirements_table(entries)))
    folder.write("metrics.json", json_bytes(_data(entries, ExitCode(about["exit_code"]))))
    return (*folder.commit(about).files, "manifest.json")


def _data(entries: Sequence[Entry], code: ExitCode) -> dict[str, Any]:
    from cfmkit.cli.answer import status_of
    from cfmkit.studies.batch import message

    required = [{"spec": one.spec, **requirement} for one in entries for requirement in one.requirements]
    return {
        "status": status_of(code),
        "message": message(entries),
        "metrics": {},
        "requirements": required,
        "warnings": [{"spec": one.spec, **item} for one in entries for item in one.warnings],
        "specs": [one.as_json() for one in entries],
    }


@dataclass(frozen=True)
class Ending:
    """Where a batch was written, how long it took, and whether it reused nothing."""

    folder: str
    files: tuple[str, ...]
    junit: str | None
    seconds: float
    fresh: bool = False


def _answer(entries: Sequence[Entry], code: ExitCode, ending: Ending, terminal: Terminal) -> Answer:
    from cfmkit.cli.batch import complaints
    from cfmkit.cli.failures import go_on
    from cfmkit.studies.batch import message

    data = _data(entries, code) | {"out": ending.folder, "files": list(ending.files), "junit": ending.junit}
    data["reused"] = sum(one.reused for one in entries)

    def view(screen: Terminal) -> None:
        from cfmkit.cli.batch_page import show_batch

        show_batch(entries, ending, screen)

    told = tuple(complaints(entries, terminal.tracebacks))
    if code is ExitCode.INTERRUPTED:
        left = sum(one.skipped for one in entries)
        told += (f"interrupted  {left} of {len(entries)} specs were not run; {go_on(ending.fresh)}",)
    quiet = () if code is ExitCode.OK else (message(entries),)
    return Answer(data, view, code, told, quiet, tuple({"message": line} for one in entries for line in one.errors))
