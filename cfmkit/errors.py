"""The exceptions of cfmkit with their exit codes, the problem of a specification, and text made safe to print.

::

    CfmError                      70  a bug, if nothing more specific was raised
     |-- UsageError                2  malformed option, missing file
     |-- InputError                3  what the user gave is invalid
     |    |-- SpecError            3  a specification: one Problem per fault, all at once
     |    |-- QuantityError        3  text that is not the number or quantity wanted; also a ValueError
     |    |-- GeometryError        3  an outline that cannot be drawn or cut as it is
     |    `-- DataError            3  a data file
     |-- SolutionError             4  nothing usable came out
     |-- OutputError               7  a file could not be written
     `-- FolderInUse               8  another live run owns the output folder

A solver that stops early is not an exception: it is a `cfmkit.results.Status`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import IntEnum

_LONG_QUOTE = re.compile(r"(?P<quote>['\"])(?P<text>(?:(?!(?P=quote)).){200,})(?P=quote)", re.DOTALL)
EXCERPT_LENGTH = 90  # characters of a line that is shown below a problem: a terminal of 100 has room for them
_LONG_WORD = re.compile(r"\S{400,}")
"""Longer than the paths of files that people have; names of keys, files and options stand without quotes."""


def shorten_quotes(message: str) -> str:
    """Return a message in which whatever somebody gave is quoted only as far as he needs to recognise it."""
    quoted = _LONG_QUOTE.sub(lambda match: f"{match['quote']}{match['text'][:47]}...{match['quote']}", message)
    return _shorten_words(quoted)


def _shorten_words(text: str) -> str:
    return _LONG_WORD.sub(lambda match: f"{match[0][:60]}...{match[0][-20:]}", text)


def visible(text: str) -> str:
    """Return text on one line, escaped where it cannot be seen: no name may command a terminal."""
    return text if text.isprintable() else "".join(char if char.isprintable() else _escape_char(char) for char in text)


def _escape_char(char: str) -> str:
    return f"\\x{ord(char):02x}" if ord(char) < 256 else f"\\u{ord(char):04x}"


class ExitCode(IntEnum):
    """Process exit codes; `cfmkit --help` prints the same list."""

    OK = 0
    USAGE = 2
    INVALID = 3
    NO_SOLUTION = 4
    REQUIREMENT_MISSED = 5
    PARTIAL = 6
    IO = 7
    IN_USE = 8
    BUG = 70
    INTERRUPTED = 130
    TERMINATED = 143


class StoppedBySignal(BaseException):
    """A signal asked the process to end; not an Exception, so that nothing swallows it."""


class CfmError(Exception):
    """Base of every error that cfmkit raises on purpose."""

    exit_code = ExitCode.BUG


class UsageError(CfmError):
    """A command or call that is malformed, or names a file that is not there."""

    exit_code = ExitCode.USAGE


class InputError(CfmError):
    """A value that the user gave is invalid."""

    exit_code = ExitCode.INVALID


@dataclass(frozen=True)
class Problem:
    """One fault of a specification: where it is and what to do about it.

    `source` is a file name or an option such as ``--set``; `line` and `column`
    count from 1 and are 0 where the source has no lines.
    """

    source: str
    line: int
    column: int
    path: str
    message: str
    text: str = field(default="", compare=False, repr=False)  # the line of the source, if it has lines

    def __post_init__(self) -> None:
        """Keep the message short, whatever it quotes."""
        object.__setattr__(self, "message", shorten_quotes(self.message))

    def __str__(self) -> str:
        """Return the one line that the user reads: ``file:line:col: path: message``."""
        place = f"{self.source}:{self.line}:{self.column}" if self.line else self.source
        path = "" if self.source == f"--set {self.path}" else self.path  # said once
        return ": ".join(part for part in (_shorten_words(place), _shorten_words(path), self.message) if part)

    @property
    def excerpt(self) -> tuple[str, ...]:
        """The line of the source and a caret below its column; empty where there is none."""
        if not self.line or not self.text.strip():
            return ()
        start = max(self.column - 1 - EXCERPT_LENGTH // 2, 0) if len(self.text) > EXCERPT_LENGTH else 0
        shown = "".join(char if char.isprintable() else " " for char in self.text[start : start + EXCERPT_LENGTH])
        head = f"{self.line:>5} | "
        caret = " " * max(min(self.column - 1 - start, len(shown)), 0) + "^"
        return f"{head}{shown.rstrip()}", f"{' ' * 5} | {caret}"


class SpecError(InputError):
    """A specification that cannot be used; carries every fault found in it."""

    def __init__(self, problems: tuple[Problem, ...] | list[Problem]) -> None:
        """Keep the problems; the message has one line for each."""
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def __reduce__(self) -> tuple[type[SpecError], tuple[tuple[Problem, ...]]]:
        """Return what pickling needs: worker processes hand these errors back."""
        return type(self), (self.problems,)


class QuantityError(InputError, ValueError):
    """Text that is not the number or quantity that is wanted there, or a value of another kind where a name is."""


class GeometryError(InputError):
    """An outline that cannot be drawn or cut as it is: open, self-crossing, too coarse."""


class DataError(InputError):
    """A data file that cannot be used."""


class SolutionError(CfmError):
    """Nothing usable came out: infeasible, or no equilibrium at all."""

    exit_code = ExitCode.NO_SOLUTION


class OutputError(CfmError):
    """A file could not be written, or a file that is not ours is in the way."""

    exit_code = ExitCode.IO


class FolderInUse(CfmError):
    """Another live run owns the output folder."""

    exit_code = ExitCode.IN_USE


def code_of(error: BaseException) -> ExitCode:
    """Return the exit code that an exception stands for."""
    if isinstance(error, CfmError):
        return error.exit_code
    return ExitCode.IO if isinstance(error, OSError) else ExitCode.BUG


def reason_of(error: Exception) -> str:
    """Return why the system could not do something; names of files keep their capitals."""
    reason = getattr(error, "strerror", None)
    return reason.lower() if reason else str(error)


def sentence_of(error: BaseException) -> str:
    """Return what an exception says to a user, in one line."""
    if isinstance(error, CfmError):
        return " ".join(str(error).split())
    if isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{reason_of(error)}"
    reported = " ".join(f"{type(error).__name__}: {error}".split())
    return f"this is a bug in cfmkit: {reported}; -vv shows where"


def lines_of(error: BaseException) -> tuple[str, ...]:
    """Return what standard error shows of an exception; faults of a file start with their place, as editors want it."""
    if isinstance(error, SpecError):
        return tuple(map(str, error.problems))
    return (f"error    {shorten_quotes(sentence_of(error))}",)
