"""The command line: parse, one call, print. One file per verb in `cfmkit.cli.verbs`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def run_command(arguments: Sequence[str]) -> int:
    """Return the exit code of a command that runs in this process: ``cfmkit ARGUMENTS``.

    Parameters
    ----------
    arguments : sequence of str
        Verb and options, as they stand behind ``cfmkit`` on the command line.
    """
    from cfmkit.cli.main import main

    return main(arguments)
