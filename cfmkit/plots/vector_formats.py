"""Figures as text that can be printed and searched: SVG and PDF, the same bytes for the same figure.

Text stays text (TrueType fonts are embedded in PDF, and named in SVG), no date and no random name is written.
"""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any

import matplotlib

from cfmkit.plots.style import apply_style, png

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

_WRITER_SETTINGS: Any = {
    "svg.fonttype": "none",  # letters, not their outlines
    "svg.hashsalt": "cfmkit",  # names of markers and clips by content, not at random
    "pdf.fonttype": 42,  # TrueType: Type 3 is refused by journals, and cannot be searched everywhere
    "pdf.compression": 6,
}
_FONT_FALLBACKS = "'DejaVu Sans', Verdana, Geneva, sans-serif"
"""Where the font of the figures is missing: those of nearly the same widths."""


@apply_style
def svg(figure: Figure) -> bytes:
    """Return a figure as SVG, with its text as text."""
    written = _vector_bytes(figure, "svg", {"Date": None, "Creator": None, "Format": None, "Type": None})
    seen: set[str] = set()

    def keep_first(match: re.Match[str]) -> str:
        """Return a name, nothing if it was there before: an id twice is no valid document."""
        is_kept = match[1] in seen
        seen.add(match[1])
        return "" if is_kept else match[0]

    text = written.decode().replace("'DejaVu Sans'", _FONT_FALLBACKS)
    return re.sub(r' id="([^"]*)"', keep_first, text).encode()


@apply_style
def pdf(figure: Figure) -> bytes:
    """Return a figure as PDF, with its fonts embedded."""
    return _vector_bytes(figure, "pdf", {"CreationDate": None})


def write_figure(figure: Figure, kind: str) -> bytes:
    """Return a figure as a file of the kind ``png``, ``svg`` or ``pdf``."""
    return {"png": png, "svg": svg, "pdf": pdf}[kind](figure)


def _vector_bytes(figure: Figure, kind: str, metadata: dict[str, None]) -> bytes:
    into = io.BytesIO()
    with matplotlib.rc_context(_WRITER_SETTINGS):
        figure.savefig(into, format=kind, metadata=metadata)
    return into.getvalue()


def inline(
    drawn: bytes,  # what `svg` returns
    name: str,  # of letters, digits, ``-`` and ``_``
) -> str:
    """Return an SVG as a part of a page: without its prologue, its names led by another so that they meet no others.

    To a screen reader it is one picture of that name, not a hundred shapes.
    """
    text = drawn.decode()
    label = re.sub("[-_]+", " ", name).strip()
    role = "group" if "<a " in text else "img"  # what is inside of one picture cannot be reached by a keyboard
    text = text[text.index("<svg") :].replace("<svg", f'<svg role="{role}" aria-label="{label}"', 1)
    text = re.sub(r"<style.*?</style>", "", text, flags=re.DOTALL)  # it would hold for the whole page
    text = re.sub(r' id="([^"]*)"', rf' id="{name}-\1"', text)
    text = re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{name}-", text)
    # Coordinates of two decimals [pt]: 4 um of print, below what any screen or printer shows. Numbers that can be read
    # stay: those of a drawing stand in tags. Digits are cut off, not rounded: that takes a seventh of the time.
    return re.sub(r"<[^>]*>", lambda tag: re.sub(r"(?<=\.\d\d)\d+", "", tag[0]), text)


def first_picture(makers: Mapping[str, Callable[[], Figure]]) -> str:
    """Return the first of some figures as a part of a page; nothing where there is none."""
    name, draw = next(iter(makers.items()), ("", None))
    return "" if draw is None else inline(svg(draw()), name)
