"""``cfmkit schema``: what editors need to complete and check specs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cfmkit.cli import completion
from cfmkit.cli.answer import Answer, told_of
from cfmkit.cli.options import Common

if TYPE_CHECKING:
    from cfmkit.cli.terminal import Terminal

PLACE = 70

FamilyName = Annotated[
    str | None,
    typer.Argument(
        metavar="[FAMILY]",
        help="One family only; default: all.",
        show_default=False,
        autocompletion=completion.families,
    ),
]


@dataclass(frozen=True, kw_only=True)
class Options(Common):
    """Arguments and options."""

    family: FamilyName = None


def run(options: Options, terminal: Terminal) -> Answer:
    """Print the JSON schema of specs, for editors."""
    from cfmkit import families
    from cfmkit.specs.keys import schema

    if options.family is not None:
        return _answer(schema({options.family: families.family(options.family).spec_type}))
    return told_of(families.skipped(), _answer(schema({one.name: one.spec_type for one in families.records()})))


def _answer(found: dict[str, Any]) -> Answer:
    return Answer({"schema": found}, lambda screen: screen.document(found))
