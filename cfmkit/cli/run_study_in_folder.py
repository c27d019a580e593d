"""Common part of the verbs that evaluate many points: a folder, a journal, an executor."""

from __future__ import annotations

import shlex
import time
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.cli.options import StudyOptions
    from cfmkit.cli.output import Terminal
    from cfmkit.cli.progress import StudyProgress
    from cfmkit.errors import ExitCode
    from cfmkit.specs.spec import Spec
    from cfmkit.store import Manifest, RunFolder
    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.journal import Journal
    from cfmkit.studies.serial_and_cluster_executors import Executor


@dataclass(frozen=True)
class Desk:
    """Workplace of a study: its folder, its journal, and its progress monitor."""

    folder: RunFolder
    journal: Journal
    progress: StudyProgress


@dataclass(frozen=True)
class Made:
    """Origin of a study, for its manifest."""

    # command, source: the verb, and the specification as it was named
    command: str
    source: str
    spec: Spec  # what it said
    # seed, points: random seed, and how many points there are
    seed: int
    points: int


def command_of_a_point(options: StudyOptions, redesigns: bool) -> str:
    """Return the command that computes a point of a study, but for what the study varies."""
    spec = options.spec if options.spec != "-" else "SPEC"
    said = ["design" if redesigns else "analyze", spec, *(part for one in options.changes for part in ("--set", one))]
    said += ["--fidelity", options.fidelity] if options.fidelity else []
    return shlex.join(["cfmkit", *said, *(["--seed", str(options.seed)] if options.seed else [])])


def commit(place: Desk, made: Made, terminal: Terminal, code: ExitCode) -> Manifest:
    """Put the files in place with a manifest that says what was run."""
    from cfmkit.runs.run import family_package
    from cfmkit.store import stable_hash

    about = {
        "command": made.command,
        "arguments": list(terminal.arguments),
        "seed": made.seed,
        "spec": {
            "source": made.source,
            "sha256": stable_hash(made.spec.model_dump(mode="json")),
            **family_package(made.spec.family),
        },
        "points": made.points,
        "status": code.name.lower(),
        "exit_code": int(code),
    }
    return place.folder.commit(about)


@contextmanager
def noting(folder: RunFolder, fresh: bool = False) -> Iterator[Journal]:
    """Yield the open journal of a folder; a signal that ends the block says whether the same command goes on."""
    from cfmkit.cli.failures import Stopped
    from cfmkit.studies.journal import Journal

    Stopped.began = True
    with Journal(folder.journal, fresh) as journal:
        try:
            yield journal
        except Stopped as stop:
            if len(journal):
                stop.goes_on(fresh)
            else:
                stop.starts_over()
            raise


def finish(place: Desk, pieces: Sequence[Records]) -> None:
    """Make the journal small, once every point of a study has its row and the files are in place."""
    from cfmkit.studies.engine import compact

    if all(piece.finished == len(piece) for piece in pieces):
        compact(place.journal, pieces)


def wants_parquet(text: str) -> bool:
    """Return whether ``--table`` names Parquet.

    Raises
    ------
    cfmkit.errors.UsageError
        If it names anything else than formats, or what is needed for one is not there.
    """
    wanted = names(text)
    unknown = [name for name in wanted if name not in ("csv", "parquet")]
    if unknown or not wanted:
        raise UsageError(f"--table: there is no format {''.join(unknown[:1])!r}; there are csv, parquet")
    if "parquet" in wanted:
        from cfmkit.tables.parquet_writing import require_pyarrow

        require_pyarrow()
    return "parquet" in wanted


def as_parquet(results: bytes) -> bytes:
    """Return results.csv as Parquet."""
    from cfmkit.tables import read_csv
    from cfmkit.tables.parquet_writing import parquet

    return parquet(read_csv(results))


def names(text: str | None) -> tuple[str, ...]:
    """Return what an option lists with commas."""
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())


@contextmanager
def desk(out: str, terminal: Terminal, fresh: bool = False) -> Iterator[Desk]:
    """Lock the folder and open the journal, to reuse nothing if `fresh`; Ctrl-C asks to stop inside the block."""
    from cfmkit.cli.progress import watching
    from cfmkit.store import RunFolder

    with RunFolder(out) as folder, noting(folder, fresh) as journal, watching(terminal) as progress:
        yield Desk(folder, journal, progress)


def executor_for(work: Work, options: StudyOptions) -> Executor:
    """Return what gets the points done: processes, a cluster, or this process where that is enough.

    Raises
    ------
    cfmkit.errors.UsageError
        If options contradict each other.
    """
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import cores, serial

    timeout = options.timeout_per_point
    if timeout is not None and timeout <= 0:
        raise UsageError(f"--timeout-per-point: {timeout:g} is not allowed: must be > 0")
    jobs = options.jobs or cores()
    if options.cluster is not None:
        from cfmkit.studies.serial_and_cluster_executors import Cluster

        if timeout is not None:
            raise UsageError(
                "--timeout-per-point works only with processes on this machine: a cluster cannot stop a single point"
            )
        return Cluster(options.cluster, jobs)
    count = -(-len(work.plan) // work.together)
    if timeout is not None:
        return Pool(min(jobs, count), timeout * work.together)
    return serial if min(jobs, count) == 1 else Pool(min(jobs, count))


def compute(work: Work, options: StudyOptions, place: Desk) -> Records:
    """Return the rows of a study, as far as the user lets it run."""
    from cfmkit.studies.engine import run

    return run(work, executor_for(work, options), place.journal, place.progress)


def tracebacks(records: Records, terminal: Terminal) -> None:
    """Show the first traceback, if the user wants to see it."""
    if records.bug and terminal.tracebacks:
        terminal.complain(records.bug.rstrip("\n").split("\n"))


def now() -> float:
    """Return the time of a clock that only runs forward [s]."""
    return time.perf_counter()
