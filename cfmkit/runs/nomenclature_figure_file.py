"""The drawing of a family with its dimensions named, as a file."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from cfmkit.errors import UsageError, visible

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.plots.dimensions import DrawingSymbol

FORMATS = (".png", ".svg", ".pdf")


@dataclass(frozen=True)
class FamilyDrawing:
    """What a family shows of itself.

    Attributes
    ----------
    family : str
        Its name.
    dimensions : tuple of DrawingSymbol
        Symbols of the drawing, the keys that set them, and what they are.
    figure : callable
        Draws it.
    """

    family: str
    dimensions: tuple[DrawingSymbol, ...]
    figure: Callable[[], Figure]


def scheme(name: str | None) -> FamilyDrawing:
    """Return the drawing of a family.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is no such family, or it has no drawing.
    """
    from cfmkit.families import family, records

    drawn = [record.name for record in records() if record.scheme]
    if name is None:
        raise UsageError(f"--figure needs a family: {', '.join(drawn)}")
    record = family(name)
    if record.scheme is None:
        raise UsageError(f"the family {visible(name)!r} has no drawing; there are {', '.join(drawn)}")
    module = import_module(record.scheme)
    return FamilyDrawing(record.name, module.DIMENSIONS, module.figure)


def drawn(found: FamilyDrawing, kind: str) -> bytes:
    """Return a drawing as the content of a file.

    Parameters
    ----------
    found : FamilyDrawing
        What to draw.
    kind : str
        The ending of the file: one of `FORMATS`.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is none of them.
    """
    from cfmkit.plots.style import png
    from cfmkit.plots.vector_formats import pdf, svg

    writers: dict[str, Callable[[Figure], bytes]] = {".png": png, ".svg": svg, ".pdf": pdf}
    if kind.lower() not in writers:
        raise UsageError(f"a figure ends with {', '.join(FORMATS)}, not {visible(kind)!r}")
    return writers[kind.lower()](found.figure())
