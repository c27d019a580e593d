"""From whatever ended a command (an error, a signal) to an exit code, lines for the user and the JSON document."""

from __future__ import annotations

import re
import signal
import traceback
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar

import typer

from cfmkit import errors
from cfmkit.documents.document import Document, envelope
from cfmkit.errors import ExitCode, OutputError, SpecError, StoppedBySignal, shorten_quotes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.output import Terminal

MAX_EXCERPTS = 10  # problems with the line of the file below them: more are a list to read, not a place to look at

ParserError: type[Exception] = typer.BadParameter.__mro__[1]
"""What the option parser raises; typer does not name it itself."""


class Stopped(StoppedBySignal):
    """The exception of a signal that ended the command, with its exit code and a message on what is finished."""

    # whether the command has opened a journal, in which it keeps what it has finished; the same for all signals
    began: ClassVar[bool] = False
    # the signal that came; libraries that are not written in Python make other exceptions of the one it raises
    last: ClassVar[Stopped | None] = None

    def __init__(self, number: int) -> None:
        """Keep the signal's number."""
        self.exit_code = ExitCode(128 + number)
        self.reported = "interrupted" if number == signal.SIGINT else "terminated"
        super().__init__(self.reported)

    def add(self, text: str) -> None:
        """Add what is left of what was computed, and how to go on."""
        self.reported += f"; {text}"


def go_on(fresh: bool) -> str:
    """Return how a run that keeps what it has finished goes on."""
    return f"run the same command again{' without --fresh' if fresh else ''} to continue"


def report_failure(error: BaseException, terminal: Terminal) -> Document:
    """Report an error to the user, with its traceback if that is wanted; return the answer with its exit code."""
    if terminal.tracebacks:
        terminal.complain("".join(traceback.format_exception(error)).rstrip("\n").split("\n"))
    answer = answer_to(error, terminal.excerpts)
    terminal.complain(answer.complaints)
    return answer


def fail(error: BaseException, terminal: Terminal) -> ExitCode:
    """Report what ended the command; return the exit code."""
    answer = report_failure(error, terminal)
    if terminal.json:
        # What could not be written may be this very output.
        with suppress(OutputError):
            terminal.show_json(envelope(answer))
    return answer.exit_code


def answer_to(error: BaseException, excerpts: bool = False) -> Document:
    """Return the document of an exception: messages, and the faulty lines of the file if `excerpts`."""
    code, lines, entries = code_of(error), list(_lines(error, excerpts)), list(_json_entries(error))
    data = {"message": "; ".join(str(entry["message"]) for entry in entries)}
    return Document(data, exit_code=code, complaints=tuple(lines), errors=tuple(entries))


def code_of(error: BaseException) -> ExitCode:
    """Return the exit code that an exception becomes."""
    if isinstance(error, ParserError):
        return ExitCode.USAGE
    return error.exit_code if isinstance(error, Stopped) else errors.code_of(error)


def _lines(error: BaseException, excerpts: bool) -> Iterator[str]:
    """Yield what standard error shows; faults of a file start with their place, as editors want it."""
    if isinstance(error, SpecError):
        for number, line in enumerate(errors.lines_of(error)):
            yield line
            yield from error.problems[number].excerpt if excerpts and number < MAX_EXCERPTS else ()
        return
    for entry in _json_entries(error):
        yield f"error    {entry['message']}"


def _json_entries(error: BaseException) -> Iterator[dict[str, Any]]:
    if isinstance(error, SpecError):
        for problem in error.problems:
            yield {name: value for name, value in asdict(problem).items() if name != "text"}
    else:
        yield {"message": shorten_quotes(_message_of(error))}


def _message_of(error: BaseException) -> str:
    if isinstance(error, ParserError):
        return _describe_parser_error(error)
    if isinstance(error, Stopped):
        return error.reported
    return errors.sentence_of(error)


_PARSER_WORDS = (
    (r"Value error, ", ""),
    (r"Input should be a valid integer, unable to parse string as an integer", "a whole number is needed"),
    (r"'[^']*' is not a valid integer", "a whole number is needed"),  # typer 0.26
    (r"No such option: --room\b.*", "No such option: --room, it is --envelope now"),
)
"""Patterns of what the library says that checks the types of options, and what to say instead."""
_VALUE_AS_OPTION = (
    r"(No such option: --(?:force|torque|stroke|travel|angle|ripple|envelope|material|stiffness|thickness|length)\b).*",
    r"\1; values of the spec are changed with --set, e.g. --set design.force='60 N'",
)
"""Values of a specification that are given as options, which `suggest` has, to a verb that reads one."""


def _describe_parser_error(error: Any) -> str:
    """Return what is wrong with the command line, and where to look."""
    message = " ".join(error.format_message().split()).rstrip(".")
    for theirs, ours in _PARSER_WORDS:
        message = re.sub(theirs, ours, message)
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "cfmkit"
    if context and "set" in {item.name for item in context.command.params}:
        message = re.sub(*_VALUE_AS_OPTION, message)
    joint = " See" if message.endswith("?") else "; see"
    return f"{message}{joint} '{command} --help'"
