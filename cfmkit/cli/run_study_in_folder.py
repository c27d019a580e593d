"""Common part of verbs that evaluate many points: a locked folder with its journal, an executor, files, report."""

from __future__ import annotations

import shlex
import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from cfmkit.cli.options import folder_of
from cfmkit.documents.document import Written
from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.cli.options import StudyOptions
    from cfmkit.cli.output import Terminal
    from cfmkit.cli.progress import StudyProgress
    from cfmkit.documents.document import Document
    from cfmkit.plots.figure_options import FigureForm
    from cfmkit.store import RunFolder
    from cfmkit.store.safe_disk_changes import Data
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.journal import Journal
    from cfmkit.studies.point_evaluation import Study
    from cfmkit.studies.serial_and_cluster_executors import Executor


NOTHING_KEPT = "nothing that could be reused is finished yet: the same command starts from the beginning"
"""Of short searches and first points: these are computed again."""


@contextmanager
def open_journal(folder: RunFolder, fresh: bool = False) -> Iterator[Journal]:
    """Yield the open journal of a folder; if a signal ends the block, its message says how the run can go on."""
    from cfmkit.cli.failures import Stopped, go_on
    from cfmkit.studies.journal import Journal

    Stopped.began = True
    with Journal(folder.journal, fresh) as journal:
        try:
            yield journal
        except Stopped as stop:
            kept = f"what is finished is kept: {go_on(fresh)}"
            stop.add(kept if len(journal) else NOTHING_KEPT)
            raise


@dataclass(frozen=True)
class StudyFolder:
    """The output folder of a study: its options, journal, progress and files."""

    verb: str
    options: StudyOptions
    terminal: Terminal
    form: FigureForm
    in_parquet: bool
    start: float
    folder: RunFolder
    journal: Journal
    progress: StudyProgress

    def compute(self, work: Work) -> Records:
        """Return the rows of a study, as far as the user lets it run."""
        from cfmkit.studies.engine import run

        records = run(work, executor_for(work, self.options), self.journal, self.progress)
        if records.bug and self.terminal.tracebacks:
            self.terminal.complain(records.bug.rstrip("\n").split("\n"))
        return records

    def write_tables(self, outputs: Iterable[tuple[str, Data]]) -> dict[str, bytes]:
        """Write the files of a study but figures and report; return what these need of them."""
        kept: dict[str, bytes] = {}
        for name, data in outputs:
            if self.options.report or (self.in_parquet and name == "results.csv"):
                kept[name] = data = data if isinstance(data, bytes) else b"".join(map(bytes, data))
            self.folder.write(name, data)
        if self.in_parquet:
            from cfmkit.tables import read_csv
            from cfmkit.tables.table import parquet

            self.folder.write("results.parquet", parquet(read_csv(kept["results.csv"])))
        return kept

    def write_pages(
        self,
        document: Document,
        study: Study,
        varied: Sequence[str],
        tables: Mapping[str, bytes],
        pictures: Callable[[], Mapping[str, Callable[[], Figure]]],
    ) -> None:
        """Write the figures and the report that the options ask for."""
        options, form = self.options, self.form
        makers = pictures() if options.report or not options.no_plots else {}
        drawn: dict[str, Figure] = {}
        for stem, make in makers.items() if not options.no_plots else ():
            figure = form.draw(make)
            drawn |= {stem: figure} if options.report else {}
            for name, content in form.write(figure, stem):
                self.folder.write(name, content)
        if options.report:
            from cfmkit.documents import report_html

            command = shlex.join(["cfmkit", *self.terminal.arguments])
            shown = form.select_page_figures(makers, drawn)
            point = command_of_a_point(options, study.design)
            page = report_html.study_page(document, study.spec, varied, tables, command, shown, point)
            self.folder.write(report_html.REPORT_NAME, page)

    def commit(
        self, document: Document, study: Study, seed: int, pieces: Sequence[Records], data: Mapping[str, Any]
    ) -> Document:
        """Put the files in place, make the journal of a finished study small, and return the document with its data."""
        from cfmkit.runs.run import provenance
        from cfmkit.studies.engine import compact

        spec, code = study.spec, document.exit_code
        ending = {"points": sum(map(len, pieces)), "status": code.name.lower(), "exit_code": int(code)}
        about = provenance(self.verb, spec, self.options.spec, self.terminal.arguments) | {"seed": seed} | ending
        files = (*self.folder.commit(about).files, "manifest.json")
        if all(piece.finished == len(piece) for piece in pieces):
            compact(self.journal, pieces)
        out = folder_of(self.options.out, self.options.spec, self.verb)
        written = Written(out, files, time.perf_counter() - self.start)
        record = dict(data) | {"family": spec.family, "name": spec.name} | written.data
        record["reused"] = sum(piece.reused for piece in pieces)
        bugs = sum(piece.bugs for piece in pieces)
        complaints = (f"error    {bugs} points hit a bug in cfmkit; -vv shows the first",) if bugs else ()
        return replace(document, data=record, files=written, complaints=complaints)


@contextmanager
def open_study(verb: str, options: StudyOptions, terminal: Terminal, start: float) -> Iterator[StudyFolder]:
    """Lock the folder and open the journal, to reuse nothing if `fresh`; Ctrl-C asks to stop inside the block."""
    from cfmkit.cli.progress import watching
    from cfmkit.store import RunFolder

    form, in_parquet = options.form, wants_parquet(options.table)
    with (
        RunFolder(folder_of(options.out, options.spec, verb)) as folder,
        open_journal(folder, options.fresh) as journal,
        watching(terminal) as progress,
    ):
        yield StudyFolder(verb, options, terminal, form, in_parquet, start, folder, journal, progress)


def command_of_a_point(options: StudyOptions, redesigns: bool) -> str:
    """Return the command that computes a point of a study, but for what the study varies."""
    spec = options.spec if options.spec != "-" else "SPEC"
    said = [
        "design" if redesigns else "analyze",
        spec,
        *(part for change in options.changes for part in ("--set", change)),
    ]
    said += ["--fidelity", options.fidelity] if options.fidelity else []
    return shlex.join(["cfmkit", *said, *(["--seed", str(options.seed)] if options.seed else [])])


def wants_parquet(text: str) -> bool:
    """Return whether ``--table`` names Parquet; UsageError if it names anything else than formats that can be had."""
    wanted = split_names(text)
    unknown = [name for name in wanted if name not in ("csv", "parquet")]
    if unknown or not wanted:
        raise UsageError(f"--table: there is no format {''.join(unknown[:1])!r}; there are csv, parquet")
    if "parquet" in wanted:
        from cfmkit.tables.table import require_pyarrow

        require_pyarrow()
    return "parquet" in wanted


def split_names(text: str | None) -> tuple[str, ...]:
    """Return the names that an option lists, separated by commas; () without it."""
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())


def executor_for(work: Work, options: StudyOptions) -> Executor:
    """Return the executor of a study: processes, a cluster, or this process; UsageError if options contradict."""
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import Cluster, cores, serial

    timeout = options.timeout_per_point
    if timeout is not None and timeout <= 0:
        raise UsageError(f"--timeout-per-point: {timeout:g} is not allowed: must be > 0")
    jobs = options.jobs or cores()
    if options.cluster is not None:
        if timeout is not None:
            raise UsageError(
                "--timeout-per-point works only with processes on this machine: a cluster cannot stop a single point"
            )
        return Cluster(options.cluster, jobs)
    count = -(-len(work.plan) // work.together)
    if timeout is not None:
        return Pool(min(jobs, count), timeout * work.together)
    return serial if min(jobs, count) == 1 else Pool(min(jobs, count))
