"""``cfmkit export``: the parts of a spec as files to cut or print, finite-element decks or a dimensioned drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.cli.options import QUIET_FLAG, OneSpec, option
from cfmkit.documents.document import Document, Note, Written
from cfmkit.errors import ExitCode, sentence_of

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal

HELP_POSITION = 30
HELP_EXAMPLE = "cfmkit export cam.yaml --kerf 0.2mm"


@dataclass(frozen=True, kw_only=True)
class ExportOptions(OneSpec):
    """Arguments and options."""

    kerf: str | None = option("LENGTH", "Width of the cut; adds a DXF that is offset by half of it.")
    tolerance: str | None = option(
        "LENGTH", "Largest deviation from the exact curves; default: 0.005 mm; beams: a 5000th of the thinnest."
    )
    format: str | None = option(
        "LIST",
        "Any of dxf,svg,csv,stl,3mf,step,inp,png,pdf (the last two: a dimensioned drawing); default: dxf,svg,csv.",
    )
    quiet: bool = QUIET_FLAG()


def run(options: ExportOptions, terminal: Terminal) -> Document:
    """Write the parts of a spec as files to cut or print, finite-element decks, or a dimensioned drawing."""
    from cfmkit.cli.options import folder_of
    from cfmkit.documents.run_document import warning_of
    from cfmkit.runs.exported_files import export_files
    from cfmkit.runs.run import provenance
    from cfmkit.runs.specfile import bind, read_spec
    from cfmkit.store import RunFolder

    out = folder_of(options.out, options.spec, "export")
    spec = bind(read_spec(options.spec, options.changes))
    with RunFolder(out) as folder:
        files, drawing, failed = export_files(spec, options.kerf, options.tolerance, options.format)
        for name, data in files.items():
            folder.write(name, data)
        origin = provenance("export", spec, options.spec, terminal.arguments)
        code = ExitCode.PARTIAL if failed else ExitCode.OK
        manifest = folder.commit(origin | {"status": "partial" if failed else "complete", "exit_code": int(code)})
    written = Written(out, (*manifest.files, "manifest.json"))
    warnings = [{"name": finding.name, "message": finding.message} for finding in drawing.warnings]
    problems = [f"{name} is not written: {sentence_of(error)}" for name, error in failed.items()]
    return Document(
        written.data | {"notes": list(drawing.notes), "warnings": warnings},
        exit_code=code,
        complaints=tuple(f"error    {problem}" for problem in problems),
        errors=tuple({"message": problem} for problem in problems),
        title=" ".join(spec.name.split()),
        verdict="partial" if failed else "",
        notes=tuple(Note("note", note, whole=True) for note in drawing.notes),
        warnings=tuple(warning_of(finding) for finding in drawing.warnings),
        files=written,
    )
