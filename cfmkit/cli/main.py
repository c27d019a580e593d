"""The program ``cfmkit``: parse, one call, print; signals, errors and exit codes of the process."""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
import warnings
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cfmkit._version import __version__
from cfmkit.cli import output as streams
from cfmkit.cli.commands import parse, program
from cfmkit.cli.failures import Stopped, fail
from cfmkit.cli.output import Terminal
from cfmkit.documents.document import envelope
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager
    from types import FrameType

HELP_TEXT = (
    "Design and analysis of constant-force mechanisms, from a YAML spec to a part that can be cut.\n\n"
    "No spec yet? `cfmkit suggest --force '20 N' --travel '5 mm' --envelope 120x80x15mm --material pom` finds "
    "mechanisms that meet these requirements.\n\n"
    "A spec is a YAML file that describes one mechanism. `cfmkit new cam` writes one to start from, `cfmkit examples` "
    "lists ready ones, `cfmkit show` explains families, keys, metrics and units."
)
HELP_EPILOG = (
    "Exit codes: 0 ok, 2 usage, 3 invalid spec or data, 4 no solution, 5 a requirement is missed, 6 partial, "
    "7 input/output, 8 folder in use, 70 a bug, 130 and 143 stopped by a signal."
)
_MADE_BETWEEN_COLLECTIONS = 250_000
"""Objects; the imports of a run make about so many that stay, and looking through them for garbage takes a tenth of a
short run."""


def entry() -> int:
    """Run the program as the whole of a process; return its exit code."""
    _one_thread()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # to look for plugins it reads about every package there is
    gc.set_threshold(_MADE_BETWEEN_COLLECTIONS, 10, 10)
    code = main()
    gc.disable()  # the process ends: nothing more is to be collected
    return code


def _one_thread() -> None:
    """Set the environment so that numerical libraries use one thread, unless the user has set a number.

    Matrices here are small: threads cost more than they bring, five times as much where other programs run.
    """
    from cfmkit.numerics.one_blas_thread import ONE_THREAD

    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)


def main(
    arguments: Sequence[str] | None = None,  # without the program's name; default: those of the process
) -> int:
    """Run the program; return its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    streams.make_tolerant()
    try:
        try:
            return int(_run(words))
        finally:
            streams.flush()
    except Stopped as stop:  # while it was told how the command has ended
        return int(stop.exit_code)


def _run(words: list[str]) -> ExitCode:
    terminal = Terminal.guess(words)
    try:
        _catch_signals()
        if not sys.warnoptions:
            # Libraries warn about their own affairs; what concerns the user is in the results.
            warnings.simplefilter("ignore")
        return _run_command(words, terminal)
    except Stopped as stop:
        return fail(stop, terminal)
    except Exception as error:
        return _report_error(Stopped.last or error, terminal)


def _run_command(words: list[str], terminal: Terminal) -> ExitCode:
    call = parse(program(_accept_global_options, HELP_TEXT, HELP_EPILOG), words)
    if call is None:
        streams.write_output("")
        return ExitCode.OK
    output = replace(
        terminal,
        json=call.options.json,
        quiet=getattr(call.options, "quiet", False),
        verbose=call.options.verbose,
    )
    if output.verbose:
        _log_more()
    Stopped.began = False
    try:
        with _locks_of(call.options):
            answer = call.run(call.options, output)
    except Stopped as stop:
        if hasattr(call.options, "fresh") and not Stopped.began:
            stop.add("nothing was computed yet: run the same command again")
        raise
    hidden = output.json or output.quiet
    output.complain((*answer.complaints, *(answer.quiet_complaints if hidden else ())))
    if output.json:
        output.show_json(envelope(answer))
    elif not output.quiet:
        output.show_page(answer)
    return answer.exit_code


def _locks_of(options: Any) -> AbstractContextManager[None]:
    """Return the context of a verb: in it folders are locked, unless an option says otherwise."""
    if not getattr(options, "no_lock", False):
        return nullcontext()
    from cfmkit.store.lock import disable_locks

    return disable_locks()


def _log_more() -> None:
    """Let the parts of the program say on standard error what they do beside their work: where they keep files."""
    import logging

    teller, log = logging.StreamHandler(), logging.getLogger("cfmkit")
    teller.setFormatter(logging.Formatter("%(message)s"))
    log.handlers, log.propagate = [teller], False
    log.setLevel(logging.INFO)


def _report_error(error: BaseException, terminal: Terminal) -> ExitCode:
    """Report an error; a signal may arrive while that is done."""
    try:
        return fail(error, terminal)
    except Stopped as stop:
        return stop.exit_code
    except Exception as second:
        return fail(second, replace(terminal, json=False))


def _catch_signals() -> None:
    """Turn the first signal into `Stopped`; a second one ends the process at once."""

    def stop(number: int, _frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        Stopped.last = Stopped(number)
        raise Stopped.last

    Stopped.last = None
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, stop)
        sys.unraisablehook = partial(_resend, sys.unraisablehook, stop)


SIGNAL_RESEND_DELAY = 0.02
"""Until a signal that was lost is sent again [s]: a compiler's callbacks are over sooner than anybody notices this."""


def _resend(plain: Callable[[Any], Any], stop: Callable[[int, FrameType | None], None], lost: Any) -> None:
    """Send a signal again where its exception was raised in code that lets none out: callbacks, finalizers."""
    if not isinstance(lost.exc_value, Stopped):
        plain(lost)
        return
    number = lost.exc_value.exit_code - 128
    signal.signal(number, stop)
    timer = threading.Timer(SIGNAL_RESEND_DELAY, os.kill, (os.getpid(), number))
    timer.daemon = True
    timer.start()


def _accept_global_options(
    ctx: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> Any:
    if version:
        streams.write_output(f"cfmkit {__version__}\n")
        raise typer.Exit
    if ctx.invoked_subcommand is None:
        ctx.fail("a command is missing")
