"""``cfmkit design``: from targets to a mechanism, and what it then does."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from cfmkit.cli.options import Common, Computing
from cfmkit.cli.studies import Fresh, Jobs

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.cli.answer import Answer
    from cfmkit.cli.terminal import Terminal
    from cfmkit.families.base import Run
    from cfmkit.report import Report
    from cfmkit.spec import Spec
    from cfmkit.store import RunFolder
    from cfmkit.tables import Table

PLACE = 10


@dataclass(frozen=True, kw_only=True)
class Options(Computing, Common):
    """Arguments and options."""

    jobs: Jobs = None
    fresh: Fresh = False


def run(options: Options, terminal: Terminal) -> Answer:
    """Design a mechanism for the targets of its spec, analyse it, and draw what is to be cut."""
    from cfmkit.cli.runs import Verb, execute
    from cfmkit.studies.executors import cores

    running = partial(long_run, options.jobs or cores(), options.fresh)
    return execute(Verb("design", "designed and analysed", compute, running=running), options, terminal)


@contextmanager
def long_run(jobs: int, fresh: bool, folder: RunFolder, plain: Run) -> Iterator[Run]:
    """Yield a run that works in several processes and notes what it has finished in the folder's journal."""
    from cfmkit.cli.studies import noting
    from cfmkit.studies.executors import serial
    from cfmkit.studies.pool import Pool

    with noting(folder, fresh) as journal:
        yield replace(plain, executor=serial if jobs == 1 else Pool(jobs), notes=journal)


def compute(spec: Spec, run: Run) -> Report:
    """Return the report on the designed mechanism, or on why there is none."""
    from cfmkit import api
    from cfmkit.report import Supplement, report_on, undesigned

    design = api.design(spec, run)
    result = api.analyze(design.spec, run) if design.spec is not None else undesigned(spec, design)
    tables = {f"{stem}.csv": partial(_csv, table) for stem, table in design.tables.items()}
    return report_on(result, design).beside({}, Supplement(files=tables, lines=design.notes))


def _csv(table: Callable[[], Table]) -> bytes:
    from cfmkit.tables import to_csv

    return to_csv(table())
