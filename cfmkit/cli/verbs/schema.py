"""``cfmkit schema``: the JSON schema with which editors complete and check specs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.cli import options as shell_completion
from cfmkit.cli.options import Common, argument
from cfmkit.documents.document import Document, JsonText, with_skipped_families

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal

HELP_POSITION = 70
HELP_EXAMPLE = "cfmkit schema cam > cam.schema.json"


@dataclass(frozen=True, kw_only=True)
class SchemaOptions(Common):
    """Arguments and options."""

    family: str | None = argument("FAMILY", "One family only; default: all.", shell_completion.families, default=None)


def run(options: SchemaOptions, terminal: Terminal) -> Document:
    """Print the JSON schema of specs, for editors."""
    from cfmkit import families
    from cfmkit.runs.editor_schema import schema

    if options.family is not None:
        return _schema_document(schema([families.family(options.family)]))
    return with_skipped_families(families.list_skipped(), _schema_document(schema(families.records())))


def _schema_document(schema: dict[str, Any]) -> Document:
    return Document({"schema": schema}, (JsonText(schema),))
