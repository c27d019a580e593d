"""The command line: parse, one call, print. One file per verb in `cfmkit.cli.verbs`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def run_command(arguments: Sequence[str]) -> int:
    """Run the program in this process, as a shell does with these arguments; return its exit code."""
    from cfmkit.cli.main import main

    return main(arguments)
