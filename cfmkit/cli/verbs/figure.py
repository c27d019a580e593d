"""``cfmkit figure``: several pictures of several runs as one figure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cfmkit.cli import shell_completion
from cfmkit.cli.options import Changing, FigureChoice, Jobs, NoLock, Quiet, argument, flag, option
from cfmkit.documents.document import Document, Written

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal

PLACE = 36
EXAMPLE = "cfmkit figure figure.yaml --figures pdf"


@dataclass(frozen=True, kw_only=True)
class FigureOptions(Changing, FigureChoice):
    """Arguments and options."""

    file: Annotated[
        str,
        argument("FILE", "YAML file: panels (each with run and plot), columns, width.", shell_completion.specs),
    ]
    out: Annotated[
        str | None, option("-o", "--out", metavar="DIR", text="Output folder; default: cfm-out/FILE-figure/.")
    ] = None
    figure_width: Annotated[
        str | None,
        option("--figure-width", metavar="174mm", text="Printed width; default: the file's, else 160mm."),
    ] = None
    no_plots: Annotated[bool, flag("--no-plots", text="A figure is all there is.", hidden=True)] = False
    jobs: Jobs = None
    quiet: Quiet = False
    no_lock: NoLock = False


def run(options: FigureOptions, terminal: Terminal) -> Document:
    """Combine plots of several runs in one figure with lettered panels; a file states the plots and the width."""
    from cfmkit.errors import UsageError
    from cfmkit.runs.composed_figure import panels, read
    from cfmkit.store import RunFolder
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import cores, serial

    if options.no_plots:
        raise UsageError("--no-plots: a figure is all that this command makes")
    if options.out is not None and not options.out.strip():
        raise UsageError("--out is empty; give a folder")
    form, asked = options.form, read(options.file, options.changes)
    form = replace(form, width=form.width or asked.width)
    out, stem = options.out or str(Path("cfm-out") / f"{Path(options.file).stem}-figure"), Path(options.file).stem
    jobs = options.jobs or cores()
    with RunFolder(out) as folder:
        from cfmkit.plots.composed_figure import composed

        drawn = panels(options.file, asked, serial if jobs == 1 else Pool(jobs))
        for name, content in form.write(composed(drawn, asked.columns, form), stem):
            folder.write(name, content)
        about = {"command": "figure", "arguments": list(terminal.arguments), "spec": {"source": options.file}}
        manifest = folder.commit({**about, "status": "complete", "exit_code": 0})
    written = Written(out, (*manifest.files, "manifest.json"))
    return Document(dict(written.data), title="figure", files=written)
