"""Common part of `design`, `analyze` and `calibrate`: options in, the document of a run out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cfmkit.cli.options import folder_of
from cfmkit.documents.document import BAD_TONE, Document, Note, Written
from cfmkit.documents.run_document import RunCommand, complaints_of, data_of, document_of
from cfmkit.runs.run import RunTask, carry_out

if TYPE_CHECKING:
    from cfmkit.cli.options import ComputeOptions
    from cfmkit.cli.output import Terminal
    from cfmkit.runs.run import FinishedRun, Verb


NO_MOTION = (
    "--animate: no film was written, because this run has no poses to draw: it has no curve, its family draws none, "
    "or the cam is analysed dynamically or as measured"
)
"""What is said where a film was requested and there is none."""


def execute(
    verb: Verb, options: ComputeOptions, terminal: Terminal, page: bool = False, budget: float | None = None
) -> Document:
    """Run a verb over the spec that the options name, in a time budget [s] if there is one, and write the folder."""
    out = folder_of(options.out, options.spec, verb.name)
    wanted = RunTask(options.spec, out, options.changes, options.fidelity, options.seed, not options.no_plots)
    wanted = replace(wanted, page=page, form=options.form, animate=getattr(options, "animate", None))
    if wanted.animate == "mp4":
        from cfmkit.plots.animation import require_ffmpeg

        require_ffmpeg()
    with terminal.progress(budget) as progress:
        outcome = carry_out(verb, wanted, terminal.arguments, progress)
    found = _document(outcome)
    if wanted.animate and f"figures/motion.{wanted.animate}" not in outcome.written:
        return replace(found, complaints=(*found.complaints, NO_MOTION))
    return found


def _document(outcome: FinishedRun) -> Document:
    """Return the document of a finished run."""
    report, verb = outcome.report, outcome.verb
    command = RunCommand(verb.name, outcome.source, outcome.changes, verb.words, outcome.folder)
    written = Written(outcome.folder, (*outcome.written, "manifest.json"), outcome.seconds)
    found = document_of(report, command, written)
    data = data_of(report) | written.data | ({"kept": outcome.kept} if outcome.kept else {})
    kept = tuple(
        Note(
            "kept",
            f"{name} was edited since the last run; the edited version is kept as {spare}",
            "",
            BAD_TONE,
            whole=True,
        )
        for name, spare in outcome.kept.items()
    )
    return replace(found, data=data, notes=(*found.notes, *kept), quiet_complaints=complaints_of(report))
