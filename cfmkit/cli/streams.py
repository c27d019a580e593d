"""Standard output and error that never end a run: a reader that has left, an encoding that cannot say it."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from cfmkit.errors import OutputError, reason_of, visible

if TYPE_CHECKING:
    from typing import TextIO


def prepare() -> None:
    """Let both streams say whatever they are given, escaped where their encoding cannot; closed ones say nothing."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream := getattr(sys, name), "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def write_output(text: str) -> None:
    """Write to standard output; where its reader has left (``| head``) the rest is dropped.

    Raises OutputError if it cannot be written for another reason: a full disk behind a redirection.
    """
    try:
        _write(sys.stdout, text)
    except BrokenPipeError:
        silence(sys.stdout)
    except OSError as error:
        silence(sys.stdout)
        raise OutputError(f"cannot write standard output: {reason_of(error)}") from None


def complain(text: str) -> None:
    """Write to standard error, if that is possible; what cannot be seen is escaped."""
    try:
        _write(sys.stderr, "\n".join(map(visible, text.split("\n"))))
    except OSError:
        silence(sys.stderr)


def settle() -> None:
    """Leave nothing in the buffers that could fail when the interpreter ends."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            silence(stream)


def silence(stream: TextIO) -> None:
    """Send what a stream still holds, and all that follows, nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def speaks_utf8(stream: TextIO) -> bool:
    """Return whether a stream takes every character."""
    return (stream.encoding or "").lower().replace("-", "") == "utf8"


def _write(stream: TextIO, text: str) -> None:
    stream.write(text)
    stream.flush()
