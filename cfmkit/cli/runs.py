"""What `design` and `analyze` have in common: options in, an answer out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit.cli.answer import Answer
from cfmkit.errors import UsageError
from cfmkit.runs.run import Outcome, Request, Verb, carry_out, spec_of
from cfmkit.runs.specfile import STDIN

if TYPE_CHECKING:
    from cfmkit.cli.options import Computing, OneSpec
    from cfmkit.cli.terminal import Terminal
    from cfmkit.runs.report import Report


def execute(verb: Verb, options: Computing, terminal: Terminal) -> Answer:
    """Run a verb over the spec that the options name and write the folder."""
    out = folder_of(options, verb.name)
    wanted = Request(options.spec, out, options.changes, options.fidelity, options.seed, not options.no_plots)
    with terminal.progress() as progress:
        return answer(carry_out(verb, wanted, terminal.arguments, progress))


def answer(outcome: Outcome) -> Answer:
    """Return the answer of a finished run."""
    found = outcome.report
    data = found.as_json() | {
        "family": found.result.spec.family,
        "name": found.result.spec.name,
        "out": outcome.folder,
        "files": [*outcome.written, "manifest.json"],
    }
    design = found.design
    if design is not None:
        data |= {"active_bounds": list(design.active_bounds), "nearest_feasible": dict(design.nearest_feasible)}
    if outcome.kept:
        data |= {"kept": outcome.kept}

    def view(terminal: Terminal) -> None:
        from cfmkit.cli.layout import show_run

        show_run(outcome, terminal)

    return Answer(data, view, found.exit_code, quiet_complaints=tuple(_complaints(found)))


def _complaints(found: Report) -> list[str]:
    """Return what a user must hear who has asked to hear nothing else."""
    status = found.status
    if not status.usable:
        design = found.design
        told = design.explanation if design is not None and design.spec is None else found.message
        return [f"error    {status.key.replace('_', ' ')}: {told}"]
    partial = [] if status.exit_code == 0 else [f"partial  {found.message}"]
    return [*partial, *(f"missed   {outcome.sentence.removesuffix(': missed')}" for outcome in found.missed)]


def folder_of(options: OneSpec, verb: str) -> str:
    """Return the output folder: the one asked for, or one named after the spec and the verb.

    Raises
    ------
    cfmkit.errors.UsageError
        If the spec comes from standard input and no folder is given.
    """
    if options.out is not None:
        if not options.out.strip():
            raise UsageError("--out is empty; give a folder")
        return options.out
    if options.spec == STDIN:
        raise UsageError("a spec from standard input has no name; say with --out where to write")
    return str(Path("cfm-out") / f"{Path(options.spec).stem}-{verb}")


__all__ = ["Outcome", "Verb", "answer", "execute", "folder_of", "spec_of"]
