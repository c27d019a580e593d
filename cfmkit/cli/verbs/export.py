"""``cfmkit export``: the parts of a spec as files to cut or print."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cfmkit.cli.answer import Answer
from cfmkit.cli.options import Common, OneSpec, Quiet

if TYPE_CHECKING:
    from cfmkit.cli.terminal import Terminal

PLACE = 30

Kerf = Annotated[
    str | None,
    typer.Option(
        "--kerf", metavar="LENGTH", help="Width of the cut: adds a DXF moved by half of it.", show_default=False
    ),
]
Tolerance = Annotated[
    str | None,
    typer.Option(
        "--tolerance",
        metavar="LENGTH",
        help="Largest distance from the exact curves; default: 0.005 mm.",
        show_default=False,
    ),
]


@dataclass(frozen=True, kw_only=True)
class Options(OneSpec, Common):
    """Arguments and options."""

    kerf: Kerf = None
    tolerance: Tolerance = None
    quiet: Quiet = False


def run(options: Options, terminal: Terminal) -> Answer:
    """Write what is to be cut or printed, as it stands in a spec: DXF, SVG, CSV."""
    from cfmkit import api
    from cfmkit.cli.runs import folder_of
    from cfmkit.runs.run import provenance
    from cfmkit.runs.specfile import bind, read_spec
    from cfmkit.store import RunFolder

    out = folder_of(options, "export")
    spec = bind(read_spec(options.spec, options.changes))
    with RunFolder(out) as folder:
        drawn, notes = api.drawn_files(spec, options.kerf, options.tolerance)
        for name, data in drawn.items():
            folder.write(name, data)
        origin = provenance("export", spec, options.spec, terminal.arguments)
        manifest = folder.commit(origin | {"status": "complete", "exit_code": 0})
    return _answer(out, [*manifest.files, "manifest.json"], notes)


def _answer(out: str, names: list[str], notes: tuple[str, ...]) -> Answer:
    def view(screen: Terminal) -> None:
        from cfmkit.cli.layout import paragraph, written

        for note in notes:
            screen.show(*paragraph("note", note, screen.width))
        screen.show(*written(out, names, screen))

    data: dict[str, Any] = {"out": out, "files": names, "notes": list(notes)}
    return Answer(data, view)
