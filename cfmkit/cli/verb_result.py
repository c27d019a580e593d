"""What a verb gives back: data for ``--json``, a page for the terminal, an exit code."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cfmkit.cli.page_block_types import Block


@dataclass(frozen=True)
class Answer:
    """The outcome of one command."""

    # more of the JSON document than the envelope has; values for its keys replace them
    data: Mapping[str, Any] = field(default_factory=dict)
    # what a terminal shows; not looked at under ``--json`` and ``-q``, so it may be computed as it is read
    page: Iterable[Block] = ()
    exit_code: ExitCode = ExitCode.OK  # of the process
    complaints: tuple[str, ...] = ()  # lines for standard error, whatever the options
    quiet_complaints: tuple[str, ...] = ()  # more of them where the page is not shown
    errors: tuple[Mapping[str, Any], ...] = ()  # the same for the JSON document


def reported_for(skipped: Sequence[str], answer: Answer) -> Answer:
    """Return an answer that also reports the families that were skipped: one line each, and in the document."""
    if not skipped:
        return answer
    others = answer.data.get("warnings", ())
    data = {"warnings": [*others, *({"name": "family_skipped", "message": line} for line in skipped)]}
    lines = tuple(f"warning  {line}; skipped (see `cfmkit doctor`)" for line in skipped)
    return replace(answer, data={**answer.data, **data}, complaints=(*answer.complaints, *lines))


def document(answer: Answer) -> dict[str, Any]:
    """Return the JSON document of an answer: the same keys first, whatever the verb and the outcome."""
    envelope = {
        "status": status_of(answer.exit_code),
        "message": "",
        "exit_code": int(answer.exit_code),
        "metrics": {},
        "requirements": [],
        "warnings": [],
        "errors": list(answer.errors),
    }
    return envelope | dict(answer.data)


def status_of(code: ExitCode) -> str:
    """Return the status that goes with an exit code where no solver gave one."""
    return "complete" if code is ExitCode.OK else code.name.lower()
