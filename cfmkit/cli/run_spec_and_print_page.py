"""Common part of `design`, `analyze` and `calibrate`: options in, the folder written, the document of the run out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cfmkit.cli.options import folder_of
from cfmkit.documents.document import Document, Note, Tone, Written
from cfmkit.documents.run_document import complaints_of, data_of, document_of
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
    task = RunTask(
        options.spec,
        folder_of(options.out, options.spec, verb.name),
        options.changes,
        options.fidelity,
        options.seed,
        not options.no_plots,
        page=page,
        form=options.form,
        animate=getattr(options, "animate", None),
        time_budget=budget,
    )
    if task.animate == "mp4":
        from cfmkit.plots.mechanism_in_motion import require_ffmpeg

        require_ffmpeg()
    with terminal.progress(budget) as progress:
        finished = carry_out(verb, task, terminal.arguments, progress)
    document = _document(finished)
    if task.animate and f"figures/motion.{task.animate}" not in finished.manifest.files:
        return replace(document, complaints=(*document.complaints, NO_MOTION))
    return document


def _document(run: FinishedRun) -> Document:
    """Return the document of a finished run."""
    written = Written(run.command.folder, (*run.manifest.files, "manifest.json"), run.seconds)
    document = document_of(run.report, run.command, written)
    kept = tuple(
        Note("kept", f"{name} was edited since the last run; the edited version is kept as {spare}", "", Tone.BAD, True)
        for name, spare in run.kept.items()
    )
    data = data_of(run.report) | written.data | ({"kept": run.kept} if run.kept else {})
    return replace(document, data=data, notes=(*document.notes, *kept), quiet_complaints=complaints_of(run.report))
