"""What is said while the engine is compiled: one line, which grows where somebody watches."""

from __future__ import annotations

import logging
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_PARTS = {
    "solver": "equilibria and paths",
    "states": "states along beams",
    "complex_states": "states along beams, complex",
    "slopes": "derivatives of equilibria",
    "row_slopes": "derivatives of states",
    "held_slopes": "derivatives of forces",
}
_LASTS = {"solver": "about 12 s", "slopes": "about 8 s"}
_TELLER = logging.getLogger("cfmkit.elastica")


@contextmanager
def reported(name: str) -> Iterator[Callable[[float], None]]:
    """Say that a door is compiled; yield what shows, on a terminal, the share that is done."""
    text = f"compiling the beam engine, once: {_PARTS[name]}, {_LASTS.get(name, 'a moment')}"
    if sys.stderr is None or not sys.stderr.isatty():
        _TELLER.warning(text)
        yield lambda _share: None
        return

    def show(share: float) -> None:
        sys.stderr.write(f"\r{text}: {100 * share:.0f} %")
        sys.stderr.flush()

    show(0.0)
    try:
        yield show
    finally:
        sys.stderr.write("\r" + " " * (len(text) + 7) + "\r")
        sys.stderr.flush()
