"""``cfmkit batch``: many specs at once, for continuous integration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cfmkit.cli import completion
from cfmkit.cli.answer import Answer
from cfmkit.cli.options import Changing, Common, Fidelity, NoPlots, Quiet, Seed
from cfmkit.cli.studies import Fresh, Jobs, Timeout
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from cfmkit.cli.terminal import Terminal
    from cfmkit.runs.batch import BatchResult

PLACE = 26

Specs = Annotated[
    list[str],
    typer.Argument(
        metavar="SPEC...",
        help="YAML files, folders, or quoted patterns such as 'configs/**/*.yaml'.",
        show_default=False,
        autocompletion=completion.specs,
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
    from cfmkit.cli import studies
    from cfmkit.cli.progress import watching
    from cfmkit.runs.batch import batch, unreached

    start = studies.now()
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
            arguments=terminal.arguments,
            monitor=progress,
            noting=studies.noting,
        )
    seconds = studies.now() - start
    answer = _answer(found, Ending(found.folder, found.files, options.junit, seconds, options.fresh), terminal)
    return replace(answer, complaints=(*answer.complaints, *unreached(found.entries, options.changes)))


@dataclass(frozen=True)
class Ending:
    """Where a batch was written, how long it took, and whether it reused nothing."""

    folder: str
    files: tuple[str, ...]
    junit: str | None
    seconds: float
    fresh: bool = False


def _answer(found: BatchResult, ending: Ending, terminal: Terminal) -> Answer:
    from cfmkit.cli.failures import go_on
    from cfmkit.runs.batch import complaints
    from cfmkit.studies.batch import message

    entries, code = found.entries, found.exit_code
    data = dict(found.summary) | {"out": ending.folder, "files": list(ending.files), "junit": ending.junit}
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
