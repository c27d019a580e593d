"""``cfmkit new``: a spec to start from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cfmkit.cli import completion
from cfmkit.cli.answer import Answer
from cfmkit.cli.options import Common
from cfmkit.errors import visible

if TYPE_CHECKING:
    from cfmkit.cli.terminal import Terminal

PLACE = 50

FamilyName = Annotated[
    str,
    typer.Argument(
        metavar="FAMILY",
        help="A family of mechanisms; `cfmkit show` lists them.",
        show_default=False,
        autocompletion=completion.families,
    ),
]
OutFile = Annotated[
    str | None,
    typer.Option(
        "-o", "--out", metavar="FILE", help="File to write, - prints it; default: FAMILY.yaml.", show_default=False
    ),
]


@dataclass(frozen=True, kw_only=True)
class Options(Common):
    """Arguments and options."""

    family: FamilyName
    out: OutFile = None


def run(options: Options, terminal: Terminal) -> Answer:
    """Write a commented spec to start from; no file is ever replaced."""
    from cfmkit.cli.templates import template
    from cfmkit.families import family

    text = template(options.family)
    name = f"{options.family}.yaml" if options.out is None else options.out
    if name == "-":
        return Answer({"family": options.family, "text": text}, lambda screen: screen.text(text))
    _write(Path(name), text)
    verb = "design" if family(options.family).design else "analyze"

    def view(screen: Terminal) -> None:
        from cfmkit.cli.layout import paragraph, quoted
        from cfmkit.cli.terminal import GOOD

        screen.show(*paragraph("written", visible(name), screen.width, GOOD))
        screen.show(*paragraph("next", " ".join(map(quoted, ["cfmkit", verb, name])), screen.width))

    return Answer({"family": options.family, "file": name}, view)


def _write(path: Path, text: str) -> None:
    """Write a file that is not there yet.

    Raises
    ------
    cfmkit.errors.OutputError
        If it is, or cannot be written.
    """
    from cfmkit.store.disk import reporting, write_new

    with reporting(path):
        write_new(path, text.encode())
