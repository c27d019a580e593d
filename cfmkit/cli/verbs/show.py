"""``cfmkit show``: what the program knows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

from cfmkit.cli import completion
from cfmkit.cli.answer import Answer, told_of
from cfmkit.cli.options import Common, argument

if TYPE_CHECKING:
    from cfmkit.cli.terminal import Terminal

PLACE = 60


@dataclass(frozen=True, kw_only=True)
class ShowOptions(Common):
    """Arguments and options."""

    topic: Annotated[
        str | None,
        argument(
            "FAMILY|units|metrics|materials|references|NAME",
            "What to explain: a topic, or anything by its name: pla, force_ripple, MPa; default: list what there is.",
            completion.topics,
        ),
    ] = None


def run(options: ShowOptions, terminal: Terminal) -> Answer:
    """Explain a family with every key of its spec, list units, metrics, materials or papers, or explain one by name."""
    from cfmkit.cli.topics import explain, skipped

    found = explain(options.topic)
    return told_of(skipped(options.topic), replace(found, data={"show": options.topic, **found.data}))
