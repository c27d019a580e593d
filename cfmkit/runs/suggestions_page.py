"""``report.html`` of what came of a wish: the proposals side by side, with links to the page of each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from cfmkit.runs.run_page import NAME, identifier, part, template
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.figure import Figure

TONES = {"complete": "good", "partial": "warn"}
"""Which colour the verdict has, by how the search ended; another end is bad."""

SHARES = ("ripple", "hysteresis", "yield")
"""Numbers of a proposal that are shares."""


def page(
    told: Mapping[str, Any], texts: Mapping[str, str], drawn: Mapping[str, Figure], unit: str, command: str
) -> bytes:
    """Return the page of a search.

    Parameters
    ----------
    told : mapping
        What metrics.json says.
    texts : mapping of str to str
        The specification of each proposal, by its folder.
    drawn : mapping of str to Figure
        The pictures, by their names.
    unit : str
        Of the mean force or torque.
    command : str
        How the search was started.
    """
    from cfmkit.plots.vector_formats import inline, svg

    columns = (*_COLUMNS, *(("yield",) if "yield" in told["wish"] else ()))
    rows = [
        (one, [_cell(one, name, unit) for name in columns], quote(f"{one['folder']}/{NAME}"), texts[one["folder"]])
        for one in told["proposals"]
    ]
    text: str = template("suggestions.html.j2").render(
        told=told,
        tone=TONES.get(told["status"], "bad"),
        wish=_listed(told["wish"]),
        heads=[f"mean [{unit}]", *(name.replace("_", " ") for name in columns[1:])],
        rows=rows,
        silent=[(one, _listed(one["nearest"])) for one in told["families"] if not one["proposals"]],
        pictures={name: inline(svg(figure), identifier(name)) for name, figure in drawn.items()},
        command=command,
        style=part("report.css"),
    )
    return text.encode()


_COLUMNS = ("mean", "ripple", "across", "along", "depth", "hysteresis", "safety_factor", "parts", "life")


def _cell(one: Mapping[str, Any], name: str, unit: str) -> str:
    value = one.get(name)
    if value is None:
        return ""
    if name in SHARES:
        return format_short(value, "ratio", 3)
    return f"{value:.4g}" + (" mm" if name in ("across", "along", "depth") else "")


def _listed(said: Mapping[str, Any]) -> str:
    """Return keys and values in words."""
    return ", ".join(f"{key.replace('_', ' ')} {_words(value)}" for key, value in said.items())


def _words(value: Any) -> str:
    return " x ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


__all__ = ["NAME", "page"]
