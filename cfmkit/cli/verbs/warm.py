"""``cfmkit warm``: compiles the beam engine ahead of its first use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.cli.options import Common, Quiet
from cfmkit.cli.page_block_types import Verbatim
from cfmkit.cli.verb_result import Answer

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal

PLACE = 85

READY = "the beam engine is ready"


@dataclass(frozen=True, kw_only=True)
class WarmOptions(Common):
    """Arguments and options."""

    quiet: Quiet = False


def run(options: WarmOptions, terminal: Terminal) -> Answer:
    """Compile the beam engine now and keep it, so that no later run has to wait for it.

    For container images and pipeline caches. Code that is already compiled is only loaded.
    """
    from cfmkit.elastica.warming import warm

    parts = []
    for part in warm():
        parts.append(part)
        if not (terminal.json or terminal.quiet):
            terminal.show(Verbatim(f"  {part.name:<25} {part.seconds:6.1f} s\n"))
    data = {"parts": [{"name": part.name, "seconds": round(part.seconds, 3)} for part in parts]}
    return Answer(data | {"message": READY}, (Verbatim(f"{READY}\n"),))
