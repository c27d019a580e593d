"""What `design`, `analyze` and `calibrate` have in common: options in, an answer out, and the page of a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit.cli.answer import Answer
from cfmkit.cli.page_blocks import (
    BAD,
    BLANK,
    CellGrid,
    Paragraph,
    Span,
    Written,
    columns,
    command_line,
    spaced,
    title,
    verdict,
    whole_line,
)
from cfmkit.cli.terminal import MARGIN
from cfmkit.errors import ExitCode, UsageError
from cfmkit.runs.run import Request, carry_out
from cfmkit.runs.specfile import STDIN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.options import Computing, OneSpec
    from cfmkit.cli.page_blocks import Block
    from cfmkit.cli.terminal import Terminal
    from cfmkit.runs.run import FinishedRun, Verb
    from cfmkit.runs.run_findings import Report


NO_MOTION = (
    "--animate: no film was written, because this run has no poses to draw: it has no curve, its family draws none, "
    "or the cam is lifted in time or measured as cut"
)
"""What is said where a film was requested and there is none."""


def execute(verb: Verb, options: Computing, terminal: Terminal, page: bool = False) -> Answer:
    """Run a verb over the spec that the options name and write the folder."""
    out = folder_of(options, verb.name)
    wanted = Request(options.spec, out, options.changes, options.fidelity, options.seed, not options.no_plots)
    wanted = replace(wanted, page=page, form=options.form, animate=getattr(options, "animate", None))
    if wanted.animate == "mp4":
        from cfmkit.plots.animation import require_ffmpeg

        require_ffmpeg()
    with terminal.progress() as progress:
        outcome = carry_out(verb, wanted, terminal.arguments, progress)
    found = answer(outcome, everything=terminal.verbose > 0)
    if wanted.animate and f"figures/motion.{wanted.animate}" not in outcome.written:
        return replace(found, complaints=(*found.complaints, NO_MOTION))
    return found


def folder_of(options: OneSpec, verb: str) -> str:
    """Return the output folder: the one requested, or one named after the spec and the verb.

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


def answer(outcome: FinishedRun, everything: bool) -> Answer:
    """Return the answer of a finished run; its page shows what matters most, or everything."""
    found = outcome.report
    spec = found.result.spec
    written = Written(outcome.folder, (*outcome.written, "manifest.json"))
    data = found.as_json() | {"family": spec.family, "name": spec.name} | written.data
    design = found.design
    if design is not None:
        data |= {"active_bounds": list(design.active_bounds), "nearest_feasible": dict(design.nearest_feasible)}
    if outcome.kept:
        data |= {"kept": outcome.kept}
    page = _page(outcome, written, everything)
    return Answer(data, page, found.exit_code, quiet_complaints=tuple(_complaints(found)))


def _complaints(found: Report) -> list[str]:
    """Return what a user must hear who has asked to hear nothing else."""
    status = found.status
    if not status.usable:
        design = found.design
        told = design.explanation if design is not None and design.spec is None else found.message
        return [f"error    {spaced(status.key)}: {told}"]
    partial = [] if status.exit_code == 0 else [f"partial  {found.message}"]
    return [*partial, *(f"missed   {outcome.sentence.removesuffix(': missed')}" for outcome in found.missed)]


def _page(outcome: FinishedRun, written: Written, everything: bool) -> Iterator[Block]:
    """Yield a header, the numbers that matter, how the run ended, warnings, files."""
    from cfmkit.cli.run_numbers import rows, searched

    found = outcome.report
    done = outcome.verb.done if found.result.status.usable else "tried"
    yield title(found.result.spec, f"{done} in {outcome.seconds:.2f} s", droppable=True)
    yield BLANK
    if listed := rows(found, everything):
        cells = [(f"  {row.label}", row.value, row.bound, verdict(row.ok)) for row in listed]
        yield CellGrid(columns(True, True, False, False), cells)
        yield BLANK
    for word, text in found.supplement.lines:
        yield Paragraph(word, text)
    for text in searched(found.design.search) if found.design else ():
        yield Paragraph("search", text)
    yield from _ending(found)
    yield from _warnings(outcome)
    yield written.block(everything)
    for name, spare in outcome.kept.items():
        yield Paragraph("kept", f"{name} had been edited; that version is now {spare}", BAD)


def _ending(found: Report) -> Iterator[Block]:
    """Yield how the run ended, where that is not as asked, and what the design decided."""
    status, design = found.status, found.design
    if status.exit_code is not ExitCode.OK:
        yield Paragraph("partial" if status.usable else "failed", found.message, BAD)
    elif design is not None and design.message != design.status.value:
        yield Paragraph("design", design.message)
    if design is not None and design.nearest_feasible:
        yield Paragraph("feasible", ", ".join(f"{path} = {value}" for path, value in design.nearest_feasible.items()))
    if found.missed:
        yield Paragraph("missed", f"{len(found.missed)} of {len(found.requirements)} requirements", BAD)


def _warnings(outcome: FinishedRun) -> Iterator[Block]:
    """Yield the warnings that say more than the run's message, each with the commands that would cure it."""
    for item in outcome.report.warnings:
        if item.message == outcome.report.result.message:
            continue
        yield Paragraph("warning", f"{item.name}: {item.message}" + (":" if item.cures else ""), BAD)
        for cure in item.cures:
            yield whole_line(Span(" " * MARGIN + _cure(outcome, cure)))


def _cure(outcome: FinishedRun, cure: str) -> str:
    """Return the command line that applies a cure to the spec of a run, changed as it was."""
    verb = "design" if cure.startswith("design.") else outcome.verb.name
    path = cure.partition("=")[0]
    kept = [change for change in outcome.changes if change.partition("=")[0].strip() != path]
    settings = [word for change in (*kept, cure) for word in ("--set", change)]
    folder = ["-o", outcome.folder] if outcome.source == STDIN else []
    return command_line("cfmkit", verb, outcome.source, *settings, *folder)
