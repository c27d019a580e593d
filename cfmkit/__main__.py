"""The program ``cfmkit``, also as ``python -m cfmkit``."""

import os
import signal
import sys
from types import FrameType


def entry() -> int:
    """Run the program; a signal that comes before it listens, or after it has finished, ends it without a traceback."""
    _end_at_signals({signal.SIGINT: b"error    interrupted\n", signal.SIGTERM: b"error    terminated\n"})
    from cfmkit.cli import main

    code = main.entry()
    _end_at_signals({signal.SIGINT: b"", signal.SIGTERM: b""})
    return code


def _end_at_signals(messages: dict[signal.Signals, bytes]) -> None:
    def end(number: int, _frame: FrameType | None) -> None:
        os.write(2, messages[signal.Signals(number)])
        os._exit(128 + number)

    for number in messages:
        signal.signal(number, end)


if __name__ == "__main__":
    sys.exit(entry())
