"""``cfmkit design``: from targets to a mechanism, the analysis of that mechanism, and its drawings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from cfmkit.cli.options import FRESH_FLAG, JOBS_OPTION, REPORT_FLAG, ComputeOptions, RunPictures, option, seconds

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document

HELP_POSITION = 10
HELP_EXAMPLE = "cfmkit design cam.yaml --set design.force='80 N'"


@dataclass(frozen=True, kw_only=True)
class DesignOptions(ComputeOptions, RunPictures):
    """Arguments and options."""

    report: bool = REPORT_FLAG()
    jobs: int | None = JOBS_OPTION()
    fresh: bool = FRESH_FLAG()
    time_budget: str | None = option("TIME", "Time after which a search ends with the best found: 60s, 10min.")


def run(options: DesignOptions, terminal: Terminal) -> Document:
    """Design a mechanism for the targets of its spec, analyse it, and draw the parts to cut or print."""
    from cfmkit.cli.run_spec_and_print_page import execute
    from cfmkit.cli.run_study_in_folder import open_journal
    from cfmkit.runs.run import Verb, long_run, run_design
    from cfmkit.studies.serial_and_cluster_executors import cores

    budget = None if options.time_budget is None else seconds(options.time_budget)
    running = partial(long_run, options.jobs or cores(), options.fresh, noting=open_journal)
    return execute(Verb("design", run_design, running=running), options, terminal, options.report, budget)
