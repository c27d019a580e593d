"""The whole of a batch (`cfmkit.batch`): a job per specification, reuse of unchanged runs, summary and exit code."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from cfmkit.arrays import Several, shorten_values
from cfmkit.documents.run_outcome import worst
from cfmkit.errors import CfmError, ExitCode, SpecError, UsageError, code_of, lines_of, visible
from cfmkit.plots.figure_options import DEFAULT_FORM, FigureForm
from cfmkit.runs import batch_files
from cfmkit.runs.run import FinishedRun, RunTask, Verb, journal_of, long_run, read, run_analysis, run_design
from cfmkit.runs.run import carry_out as carry_out_run
from cfmkit.studies.batch_sources_and_outcomes import SKIPPED_MESSAGE, Entry
from cfmkit.studies.engine import NullMonitor

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.runs.run import Noting
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.earlier_batch import BatchComparison, KeptRuns
    from cfmkit.studies.engine import Monitor
    from cfmkit.studies.serial_and_cluster_executors import Executor, Lost
    from cfmkit.tables import Table


@dataclass(frozen=True)
class BatchJob:
    """One specification of a batch and the folder it writes to, below the batch's own."""

    index: int
    spec: str
    folder: str


@dataclass(frozen=True)
class BatchWork:
    """Everything a worker needs for any job of a batch."""

    common: RunTask  # what holds for every specification; its folder is that of the batch
    verb: str | None  # ``design`` or ``analyze``; None: design what has a block `design`
    arguments: tuple[str, ...]  # the command line, for the manifests
    fresh: bool = False  # whether searches begin anew, too, where an earlier one was ended

    @property
    def deciding(self) -> list[Any]:
        """Everything in it that decides what a run finds and writes."""
        common = self.common
        page = ["report"] if common.page else []  # without a page: as it always was, so that earlier batches are reused
        form = [] if common.form.is_default else [repr(common.form), repr(common.form.settings)]
        return [list(common.changes), common.fidelity, common.seed, not common.plots, self.verb, *page, *form]

    def __call__(self, job: BatchJob) -> Entry:
        """Return what becomes of one specification; nothing is raised but what ends the process."""
        start = time.perf_counter()
        entry = Entry(job.spec, job.folder)
        try:
            entry = self._run_entry(entry)
        except CfmError as error:
            entry = _failed_entry(entry, error)
        except Exception as error:
            entry = replace(_failed_entry(entry, error), bug="".join(traceback.format_exception(error)))
        return replace(entry, seconds=time.perf_counter() - start)

    def refusal(self, job: BatchJob) -> Entry | None:
        """Return what is wrong with a specification; None if it is valid."""
        try:
            read(replace(self.common, spec=job.spec))
        except CfmError as error:
            return _failed_entry(Entry(job.spec, job.folder), error)
        return None

    def _run_entry(self, entry: Entry) -> Entry:
        wanted = replace(self.common, spec=entry.spec, out=os.path.join(self.common.out, entry.folder))
        spec = read(wanted)[1]
        verb = _verb_of_batch(self.verb or _verb_of_spec(spec), self.fresh)
        name = " ".join(spec.name.split())
        described = replace(
            entry, verb=verb.name, family=spec.family, name=name, data=_hash_input_files(spec, entry.spec)
        )
        try:
            outcome = carry_out_run(verb, wanted, self.arguments)
        except CfmError as error:
            return _failed_entry(described, error)
        return _entry_of(described, outcome)


def _verb_of_spec(spec: Spec) -> str:
    """Return the verb that a specification asks for."""
    from cfmkit.families import family

    designs = getattr(spec, "design", None) is not None and family(spec.family).design is not None
    return "design" if designs else "analyze"


def _hash_input_files(spec: Spec, file: str) -> tuple[tuple[str, str | None], ...]:
    """Return (file, hash) of each file that a specification takes values or data from."""
    from cfmkit.specs.data_file_paths import list_data_files
    from cfmkit.specs.yamlio.base_file import base_files
    from cfmkit.store import file_hash

    folder = os.path.dirname(file) or "."
    bases = tuple((os.path.relpath(base, folder), file_hash(base.resolve())) for base in base_files(file))
    return (*bases, *((str(source), file_hash(source.path.resolve())) for source in list_data_files(spec.model_dump())))


def _verb_of_batch(name: str, fresh: bool) -> Verb:
    if name == "design":
        # One process: the specifications of the batch share the cores already.
        return Verb("design", run_design, running=partial(long_run, 1, fresh))
    return Verb("analyze", run_analysis)


def _entry_of(entry: Entry, outcome: FinishedRun) -> Entry:
    """Return the outcome of a specification that was computed."""
    data, code = outcome.report.as_json(), ExitCode(outcome.report.exit_code)
    sentences = [requirement["sentence"] for requirement in data["requirements"] if not requirement["ok"]]
    if code not in (ExitCode.OK, ExitCode.REQUIREMENT_MISSED):
        sentences = [data["message"]]
    return replace(
        entry,
        status=data["status"],
        code=code,
        message="; ".join(sentences),
        requirements=tuple(data["requirements"]),
        warnings=tuple(data["warnings"]),
        written=True,
    )


def _failed_entry(entry: Entry, error: Exception) -> Entry:
    code, complaints = code_of(error), tuple(_describe_fault(entry, error))
    first, *more = complaints
    message = first.removeprefix("error    ") + (f" (and {len(more)} more)" if more else "")
    return replace(entry, status=code.name.lower(), code=code, message=message, errors=complaints)


def _describe_fault(entry: Entry, error: Exception) -> Iterator[str]:
    """Yield what standard error shows of a fault; of one in an option, too, which specification has it."""
    if not isinstance(error, SpecError):
        yield from lines_of(error)
        return
    for problem in error.problems:
        yield str(problem) if not problem.source.startswith("--") else f"{visible(entry.spec)}: {problem}"


def lost_entry(job: BatchJob, outcome: Lost) -> Entry:
    """Return the outcome of a specification whose process did not answer."""
    code = outcome.status.exit_code
    return Entry(job.spec, job.folder, "", "", "", outcome.status.key, code, outcome.message, bug=outcome.bug)


@dataclass(frozen=True)
class BatchExecution:
    """Execution of a batch."""

    executor: Executor  # runs jobs in this process or in several
    fail_fast: bool  # whether the first failure ends the batch
    progress: Monitor
    kept: KeptRuns  # finished runs of an earlier batch in the same folder


def carry_out(work: BatchWork, jobs: Sequence[BatchJob], execution: BatchExecution) -> tuple[Entry, ...]:
    """Return the outcome of every specification, in their order; those that were not run are skipped.

    What an earlier batch has finished and nobody has changed since is not computed again.
    """
    entries_by_number: dict[int, Entry] = {}

    def stopping() -> bool:
        failed = execution.fail_fast and any(entry.code is not ExitCode.OK for entry in entries_by_number.values())
        return failed or execution.progress.stopping()

    def note(job: BatchJob, entry: Entry) -> None:
        entries_by_number[job.index] = entry
        execution.progress.add_finished(1, int(entry.code is not ExitCode.OK), entry.reused)

    def new() -> Iterator[BatchJob]:
        for job in jobs:
            if stopping():
                return
            entry = execution.kept.recall(job.spec, job.folder)
            if entry is not None and not entry.verb:
                entry = work.refusal(job)
            if entry is None:
                yield job
            else:
                note(job, entry)

    execution.progress.total(len(jobs))
    for job, outcome in execution.executor(work, new(), stopping):
        entry = outcome if isinstance(outcome, Entry) else lost_entry(job, outcome)
        execution.kept.keep(entry)
        note(job, entry)
    message = "not run: interrupted" if execution.progress.stopping() else SKIPPED_MESSAGE
    return tuple(entries_by_number.get(job.index) or Entry(job.spec, job.folder, message=message) for job in jobs)


def choose_executor(jobs: int | None, count: int, timeout: float | None) -> Executor:
    """Return the executor of the jobs: this process, or a pool of several.

    Raises UsageError if the timeout is not above zero.
    """
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import cores, serial

    if timeout is not None and timeout <= 0:
        raise UsageError(f"--timeout-per-point: {timeout:g} is not allowed: must be > 0")
    wanted = min(jobs or cores(), count)
    return serial if wanted <= 1 and timeout is None else Pool(max(wanted, 1), timeout)


def exit_code(entries: Sequence[Entry], interrupted: bool, compared: BatchComparison | None = None) -> ExitCode:
    """Return the exit code of the process: the first of 70, 7, 3, 4, 6, 5 that occurs; a change counts as 5."""
    changed = compared is not None and compared.changes_beyond_tolerance
    codes = [*(entry.code for entry in entries), *([ExitCode.REQUIREMENT_MISSED] if changed else [])]
    return ExitCode.INTERRUPTED if interrupted else worst(codes)


def complaints(entries: Sequence[Entry], tracebacks: bool) -> Iterator[str]:
    """Yield what belongs on standard error: faults of files with their places, bugs."""
    for entry in entries:
        yield from entry.errors
        if entry.bug and not entry.errors:
            yield f"error    {visible(entry.spec)}: {entry.message}"
        if entry.bug and tracebacks:
            yield from entry.bug.rstrip("\n").split("\n")


@dataclass(frozen=True)
class BatchResult:
    """Outcome of a batch."""

    entries: tuple[Entry, ...]  # one per specification, in their order
    exit_code: ExitCode  # the worst of them: what the command would return
    folder: str  # the output folder; each specification has one of its own below
    files: tuple[str, ...]  # what was written there
    compared: BatchComparison | None = None  # with an earlier batch
    accepted: str = ""  # the folder of the reference that has these results now; empty if none was to be replaced

    def __post_init__(self) -> None:
        """Keep the texts of what is inside short."""
        for name in ("entries", "files"):
            object.__setattr__(self, name, Several(getattr(self, name)))

    def __repr__(self) -> str:
        """Return the batch in a line."""
        return f"<BatchResult in {self.folder!r}: exit code {int(self.exit_code)}; {self.table!r}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the first specifications with their verdicts."""
        from cfmkit.documents.batch_document import document_of
        from cfmkit.documents.notebook import show_html

        return show_html(document_of(self.entries, self.exit_code, compared=self.compared))

    @property
    def summary(self) -> Mapping[str, Any]:
        """Content of metrics.json."""
        summary: Mapping[str, Any] = shorten_values(batch_files.data(self.entries, self.exit_code, self.compared))
        return summary

    @property
    def table(self) -> Table:
        """Content of results.csv: one row per specification."""
        from cfmkit.studies.batch_sources_and_outcomes import results_table

        return results_table(self.entries)

    @property
    def requirements(self) -> Table:
        """Content of requirements.csv: one row per requirement."""
        from cfmkit.studies.batch_sources_and_outcomes import requirements_table

        return requirements_table(self.entries)


def batch(
    specs: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str] = "cfm-out/batch",
    *,
    verb: Literal["design", "analyze"] | None = None,
    changes: Iterable[str] = (),
    fidelity: str | None = None,
    seed: int = 0,
    plots: bool = True,
    jobs: int | None = 1,
    timeout_per_point: float | None = None,
    fail_fast: bool = False,
    fresh: bool = False,
    junit: str | None = None,
    summary: str | None = None,
    compare: str | os.PathLike[str] | None = None,
    compare_tolerance: float | None = None,
    accept: bool = False,
    page: bool = False,
    form: FigureForm | None = None,
    arguments: Sequence[str] = (),
    monitor: Monitor | None = None,
    noting: Noting = journal_of,
) -> BatchResult:
    """Design or analyse many specifications, check their requirements, and write a folder for each and for all.

    A specification that an earlier batch in the same folder has finished is reused as long as nothing has changed.

    Parameters
    ----------
    specs : path-like or iterable of path-like
        YAML files, folders, or patterns such as ``configs/**/*.yaml``.
    out : path-like
        The output folder.
    verb : {"design", "analyze"}, optional
        Default: design where there is a block `design`, else analyze.
    changes : iterable of str
        As ``--set`` takes them; ``cam:mechanism...=`` for one family only.
    fidelity : str, optional
        For all of them.
    seed : int
        Random seed.
    plots : bool
        Whether to draw.
    jobs : int, optional
        Processes; None: all cores.
    timeout_per_point : float, optional
        Time allowed for each specification [s].
    fail_fast : bool
        Start no more once one has failed.
    fresh : bool
        Reuse nothing.
    junit : str, optional
        A file for JUnit XML, a test for each requirement.
    summary : str, optional
        A file for the outcome in Markdown.
    compare : path-like, optional
        The folder of an earlier batch; what has changed beyond the tolerance is a missed requirement. It may be `out`.
    compare_tolerance : float, optional
        Relative change of a metric that counts as none; default: 1e-6.
    accept : bool
        Make the results the reference: they replace those in the folder `compare`, which need not exist yet. Changes
        are still listed, but are no missed requirement.
    page : bool
        Whether to write a ``report.html`` for each, and one for all that links them.
    form : FigureForm, optional
        How figures are written.
    arguments : sequence of str
        What manifests say of the command line.
    monitor : Monitor, optional
        Progress callback with cancellation.
    noting : callable
        What opens the journal of the folder.

    Raises
    ------
    cfmkit.errors.UsageError
        If a name stands for no file, or an option is malformed.
    cfmkit.errors.OutputError
        If the folder cannot be written.

    Examples
    --------
    >>> import cfmkit, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     found = cfmkit.batch(["configs/cam.yaml"], folder, plots=False)
    >>> found.exit_code.name, [(one.spec, one.status) for one in found.entries]
    ('OK', [('configs/cam.yaml', 'complete')])
    """
    from cfmkit.documents.continuous_integration import junit as junit_of
    from cfmkit.documents.continuous_integration import prepare_file
    from cfmkit.runs.batch_files import BatchReference
    from cfmkit.store import RunFolder
    from cfmkit.studies.earlier_batch import KeptRuns

    place, named = os.fspath(out), _list_named(specs)
    stated = (changes,) if isinstance(changes, str) else tuple(changes)
    _check_options(place, verb, stated)
    common = RunTask("", place, stated, fidelity, seed, plots, of_many=True, page=page, form=form or DEFAULT_FORM)
    work = BatchWork(common, verb, tuple(arguments), fresh)
    todo = _list_jobs(named, place)
    executor = choose_executor(jobs, len(todo), timeout_per_point)
    write_junit = None if junit is None else prepare_file(junit)
    write_summary = None if summary is None else prepare_file(summary, "--summary")
    reference = BatchReference.read(compare, compare_tolerance, accept, place)
    watched = monitor or NullMonitor()
    with RunFolder(place) as folder, noting(folder, fresh) as journal:
        folder.check("results.csv", "requirements.csv", "metrics.json")
        kept = KeptRuns(place, work.deciding, journal)
        entries = carry_out(work, todo, BatchExecution(executor, fail_fast, watched, kept))
        interrupted = watched.stopping()
        compared = None if reference is None else reference.compare(entries, place)
        code = exit_code(entries, interrupted, None if accept else compared)
        about = batch_files.describe_batch(work.arguments, seed, named, code)
        written = batch_files.write(folder, entries, about, page, compared)
    accepted = reference is not None and not interrupted and reference.accept_results(place, entries, work.arguments)
    if write_junit is not None:
        write_junit(junit_of(entries))
    if write_summary is not None:
        from cfmkit.documents.continuous_integration import summary as in_markdown

        write_summary(in_markdown(entries, compared))
    return BatchResult(entries, code, place, written, compared, reference.folder if reference and accepted else "")


def _check_options(out: str, verb: str | None, changes: Iterable[str]) -> None:
    """Raise UsageError if an option is malformed."""
    from cfmkit.runs.specfile import split_address

    if not out.strip():
        raise UsageError("--out is empty; give a folder")
    if verb not in (None, "design", "analyze"):
        raise UsageError(f"verb: {verb!r} is not one of 'design', 'analyze'")
    for change in changes:
        split_address(change)


def _list_jobs(named: Sequence[str], out: str) -> list[BatchJob]:
    """Return a job for each specification that the names stand for."""
    from cfmkit.studies.batch_sources_and_outcomes import folders, sources

    files = sources(named, out)
    return [BatchJob(k, *pair) for k, pair in enumerate(zip(files, folders(files), strict=True))]


def _list_named(specs: Any) -> list[str]:
    """Return the names of the files, folders and patterns that are given."""
    if isinstance(specs, str | os.PathLike):
        specs = [specs]
    named = list(specs) if isinstance(specs, Iterable) else [specs]
    if odd := [name for name in named if not isinstance(name, str | os.PathLike)]:
        raise UsageError(f"a batch reads files: a path is needed, not {type(odd[0]).__name__}; cfmkit.dumps writes one")
    if not named:
        raise UsageError("there is no specification: name files, folders or patterns")
    return [str(os.fspath(name)) for name in named]


def list_unreached_options(entries: Sequence[Entry], changes: Iterable[str]) -> Iterator[str]:
    """Yield the options that are for a family of which there is no specification."""
    from cfmkit.runs.specfile import split_address

    families = {entry.family for entry in entries}
    for change in changes if "" not in families else ():  # what is not valid may be of any family
        family, _ = split_address(change)
        if family is not None and family not in families:
            yield f"warning  --set {visible(change)}: no specification is of the family {family!r}"
