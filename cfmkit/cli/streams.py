"""Standard output and error that never end a run, not by a closed pipe, nor by a character that cannot be encoded."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from cfmkit.errors import OutputError, reason_of, visible

if TYPE_CHECKING:
    from typing import TextIO


def make_tolerant() -> None:
    """Make both streams escape characters that their encoding lacks; a stream that is closed discards everything."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream := getattr(sys, name), "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def write_output(text: str) -> None:
    """Write to standard output; if the reading process has ended (``| head``) the rest is dropped.

    Raises OutputError if it cannot be written for another reason: a full disk behind a redirection.
    """
    try:
        _write(sys.stdout, text)
    except BrokenPipeError:
        discard_output(sys.stdout)
    except OSError as error:
        discard_output(sys.stdout)
        raise OutputError(f"cannot write standard output: {reason_of(error)}") from None


def write_error(text: str) -> None:
    """Write to standard error, if that is possible; unprintable characters are escaped."""
    try:
        _write(sys.stderr, "\n".join(map(visible, text.split("\n"))))
    except OSError:
        discard_output(sys.stderr)


def flush() -> None:
    """Flush both streams, so that nothing is left that could fail when the interpreter ends."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            discard_output(stream)


def discard_output(stream: TextIO) -> None:
    """Redirect a stream to the null device, with what its buffer still holds."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def can_encode_all(stream: TextIO) -> bool:
    """Return whether the encoding of a stream has every character."""
    return (stream.encoding or "").lower().replace("-", "") == "utf8"


def _write(stream: TextIO, text: str) -> None:
    stream.write(text)
    stream.flush()
