"""The output folder of a command: the one that is named, or one named after its file and the verb."""

from __future__ import annotations

from pathlib import Path

from cfmkit.errors import UsageError
from cfmkit.runs.specfile import STDIN_PATH


def folder_of(out: str | None, source: str, verb: str) -> str:
    """Return the folder that ``--out`` names, by default ``cfm-out/SOURCE-VERB``.

    UsageError if the name is empty, or the source is standard input and none is given.
    """
    if out is not None:
        if not out.strip():
            raise UsageError("--out is empty; give a folder")
        return out
    if source == STDIN_PATH:
        raise UsageError("standard input has no name; give the output folder with --out")
    return str(Path("cfm-out") / f"{Path(source).stem}-{verb}")
