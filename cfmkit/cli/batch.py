"""The work of a batch: one specification after the other, or several at once, each like a run of its own."""

from __future__ import annotations

import os
import time
import traceback
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.cli.failures import answer_to
from cfmkit.cli.terminal import Terminal
from cfmkit.errors import CfmError, ExitCode, OutputError, UsageError, visible
from cfmkit.results import Status
from cfmkit.studies.batch import LEFT, Entry

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cfmkit.cli.answer import Answer
    from cfmkit.cli.options import Computing
    from cfmkit.cli.progress import StudyProgress
    from cfmkit.cli.runs import Verb
    from cfmkit.spec import Spec
    from cfmkit.studies.executors import Executor, Lost
    from cfmkit.studies.kept import KeptRuns


@dataclass(frozen=True)
class Job:
    """One specification of a batch and the folder it writes to, below the batch's own."""

    index: int
    spec: str
    folder: str


@dataclass(frozen=True)
class BatchWork:
    """What a worker needs to do any job of a batch.

    Attributes
    ----------
    out : str
        The output folder of the batch.
    options : Computing
        What holds for every specification.
    verb : str or None
        ``design`` or ``analyze``; None: design what has a block `design`.
    arguments : tuple of str
        The command line, for the manifests.
    fresh : bool
        Whether searches begin anew, too, where an earlier one was ended.
    """

    out: str
    options: Computing
    verb: str | None
    arguments: tuple[str, ...]
    fresh: bool = False

    @property
    def deciding(self) -> list[Any]:
        """Everything in it that decides what a run finds and writes."""
        given = self.options
        return [list(given.changes), given.fidelity, given.seed, given.no_plots, self.verb]

    def __call__(self, job: Job) -> Entry:
        """Return what becomes of one specification; nothing is raised but what ends the process."""
        start = time.perf_counter()
        entry = Entry(job.spec, job.folder)
        try:
            entry = self._done(entry)
        except CfmError as error:
            entry = _failed(entry, error)
        except Exception as error:
            entry = replace(_failed(entry, error), bug="".join(traceback.format_exception(error)))
        return replace(entry, seconds=time.perf_counter() - start)

    def refusal(self, job: Job) -> Entry | None:
        """Return what is wrong with a specification; None if it is valid."""
        from cfmkit.cli.runs import spec_of

        try:
            spec_of(replace(self.options, spec=job.spec))
        except CfmError as error:
            return _failed(Entry(job.spec, job.folder), error)
        return None

    def _done(self, entry: Entry) -> Entry:
        from cfmkit.cli.runs import execute, spec_of

        options = replace(self.options, spec=entry.spec, out=os.path.join(self.out, entry.folder))
        spec = spec_of(options)
        verb = _verb(self.verb or _natural(spec), self.fresh)
        name = " ".join(spec.name.split())
        known = replace(entry, verb=verb.name, family=spec.family, name=name, data=_data_of(spec))
        try:
            answer = execute(verb, options, Terminal(self.arguments, quiet=True))
        except CfmError as error:
            return _failed(known, error)
        return _answered(known, answer)


def _natural(spec: Spec) -> str:
    """Return the verb that a specification asks for."""
    from cfmkit.families import family

    designs = getattr(spec, "design", None) is not None and family(spec.family).design is not None
    return "design" if designs else "analyze"


def _data_of(spec: Spec) -> tuple[tuple[str, str | None], ...]:
    """Return the data files that a specification names, and the hashes of their content."""
    from cfmkit.store import file_hash
    from cfmkit.tables.source import named_in

    return tuple((str(source), file_hash(source.path.resolve())) for source in named_in(spec.model_dump()))


def _verb(name: str, fresh: bool) -> Verb:
    from cfmkit.cli.runs import Verb
    from cfmkit.cli.verbs import analyze, design

    if name == "design":
        # One process: the specifications of the batch share the cores already.
        return Verb("design", "designed and analysed", design.compute, running=partial(design.long_run, 1, fresh))
    return Verb("analyze", "analysed", analyze.compute)


def _answered(entry: Entry, answer: Answer) -> Entry:
    data: dict[str, Any] = dict(answer.data)
    told = [one["sentence"] for one in data["requirements"] if not one["ok"]]
    if answer.exit_code not in (ExitCode.OK, ExitCode.REQUIREMENT_MISSED):
        told = [data["message"]]
    return replace(
        entry,
        status=data["status"],
        code=ExitCode(answer.exit_code),
        message="; ".join(told),
        requirements=tuple(data["requirements"]),
        warnings=tuple(data["warnings"]),
        written=True,
    )


def _failed(entry: Entry, error: Exception) -> Entry:
    answer = answer_to(error)
    code = answer.exit_code
    first, *more = answer.complaints or ("",)
    told = first.removeprefix("error    ") + (f" (and {len(more)} more)" if more else "")
    return replace(entry, status=code.name.lower(), code=code, message=told, errors=answer.complaints)


def lost(job: Job, outcome: Lost) -> Entry:
    """Return what became of a specification whose process did not answer."""
    bug = outcome.status is Status.CRASHED
    code = ExitCode.BUG if bug else outcome.status.exit_code
    return Entry(job.spec, job.folder, "", "", "", outcome.status.key, code, outcome.message, bug=outcome.bug)


@dataclass(frozen=True)
class Crew:
    """How a batch gets done: by what, until when, and who is told."""

    executor: Executor
    fail_fast: bool
    progress: StudyProgress
    kept: KeptRuns


def carry_out(work: BatchWork, jobs: Sequence[Job], crew: Crew) -> tuple[Entry, ...]:
    """Return what became of every specification, in their order; those that were not run are skipped.

    What an earlier batch has finished and nobody has changed since is not computed again.
    """
    found: dict[int, Entry] = {}

    def stopping() -> bool:
        failed = crew.fail_fast and any(one.code is not ExitCode.OK for one in found.values())
        return failed or crew.progress.stopping()

    def note(job: Job, entry: Entry) -> None:
        found[job.index] = entry
        crew.progress.done(1, int(entry.code is not ExitCode.OK), entry.reused)

    def new() -> Iterator[Job]:
        for job in jobs:
            if stopping():
                return
            entry = crew.kept.recall(job.spec, job.folder)
            if entry is not None and not entry.verb:
                entry = work.refusal(job)
            if entry is None:
                yield job
            else:
                note(job, entry)

    crew.progress.total(len(jobs))
    for job, outcome in crew.executor(work, new(), stopping):
        entry = outcome if isinstance(outcome, Entry) else lost(job, outcome)
        crew.kept.keep(entry)
        note(job, entry)
    told = "not run: interrupted" if crew.progress.stopped else LEFT
    return tuple(found.get(job.index) or Entry(job.spec, job.folder, message=told) for job in jobs)


def executor_for(jobs: int | None, count: int, timeout: float | None) -> Executor:
    """Return what gets specifications done: this process, or several.

    Raises
    ------
    cfmkit.errors.UsageError
        If the time allowed is none.
    """
    from cfmkit.studies.executors import cores, serial
    from cfmkit.studies.pool import Pool

    if timeout is not None and timeout <= 0:
        raise UsageError(f"--timeout-per-point: {timeout:g} is not allowed: must be > 0")
    wanted = min(jobs or cores(), count)
    return serial if wanted <= 1 and timeout is None else Pool(max(wanted, 1), timeout)


def prepared(path: str) -> Callable[[bytes], None]:
    """Return what writes a file; its folder is made now, and a folder in its place is told now.

    Raises
    ------
    cfmkit.errors.OutputError
        If it will not be possible to write it.
    """
    from cfmkit.store import atomic_write
    from cfmkit.store.disk import reporting

    if not path.strip():
        raise UsageError("--junit is empty; name a file")
    with reporting(path):
        os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    if os.path.isdir(path):
        raise OutputError(f"cannot write {path}: it is a folder")

    def write(data: bytes) -> None:
        atomic_write(path, data)

    return write


def exit_code(entries: Sequence[Entry], interrupted: bool) -> ExitCode:
    """Return what the process is to say: the first of 70, 7, 3, 4, 6, 5 that occurs."""
    from cfmkit.report import worst

    return ExitCode.INTERRUPTED if interrupted else worst([one.code for one in entries])


def complaints(entries: Sequence[Entry], tracebacks: bool) -> Iterator[str]:
    """Yield what belongs on standard error: faults of files with their places, bugs."""
    for one in entries:
        yield from one.errors
        if one.bug and not one.errors:
            yield f"error    {visible(one.spec)}: {one.message}"
        if one.bug and tracebacks:
            yield from one.bug.rstrip("\n").split("\n")
