"""The JSON document of a command: the same keys first, whatever the verb and the outcome."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from cfmkit.documents.document import Document


def envelope(document: Document) -> dict[str, Any]:
    """Return what ``--json`` prints of a document."""
    plain = {
        "status": status_of(document.exit_code),
        "message": "",
        "exit_code": int(document.exit_code),
        "metrics": {},
        "requirements": [],
        "warnings": [],
        "errors": list(document.errors),
    }
    return plain | dict(document.data)


def status_of(code: ExitCode) -> str:
    """Return the status that goes with an exit code where no solver gave one."""
    return "complete" if code is ExitCode.OK else code.name.lower()
