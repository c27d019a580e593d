"""``cfmkit design``: from targets to a mechanism, and what it then does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.cli.options import Common, Computing

if TYPE_CHECKING:
    from cfmkit.cli.answer import Answer
    from cfmkit.cli.terminal import Terminal
    from cfmkit.families.base import Run
    from cfmkit.report import Report
    from cfmkit.spec import Spec

PLACE = 10


@dataclass(frozen=True, kw_only=True)
class Options(Computing, Common):
    """Arguments and options."""


def run(options: Options, terminal: Terminal) -> Answer:
    """Design a mechanism for the targets of its spec, analyse it, and draw what is to be cut."""
    from cfmkit.cli.runs import Verb, execute

    return execute(Verb("design", "designed and analysed", compute), options, terminal)


def compute(spec: Spec, run: Run) -> Report:
    """Return the report on the designed mechanism, or on why there is none."""
    from cfmkit import api
    from cfmkit.report import report_on, undesigned

    design = api.design(spec, run)
    result = api.analyze(design.spec, run) if design.spec is not None else undesigned(spec, design)
    return report_on(result, design)
