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
    record: Mapping[str, Any], texts: Mapping[str, str], drawn: Mapping[str, Figure], unit: str, command: str
) -> bytes:
    """Return the page of a search.

    Parameters
    ----------
    record : mapping
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

    columns = (*_COLUMNS, *(("yield",) if "yield" in record["wish"] else ()))
    rows = [
        (one, [_cell(one, name, unit) for name in columns], quote(f"{one['folder']}/{NAME}"), texts[one["folder"]])
        for one in record["proposals"]
    ]
    text: str = template("suggestions.html.j2").render(
        told=record,
        tone=TONES.get(record["status"], "bad"),
        wish=_listed(record["wish"]),
        heads=[f"mean [{unit}]", *(name.replace("_", " ") for name in columns[1:])],
        rows=rows,
        silent=[(one, _listed(one["nearest"])) for one in record["families"] if not one["proposals"]],
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


def _listed(pairs: Mapping[str, Any]) -> str:
    """Return keys and values in words.

    Examples
    --------
    >>> _listed({"force": "10 N", "ripple": 0.03, "room": ["80 mm", "60 mm"], "adjustable": ["8 N", "12 N"]})
    'force 10 N, ripple 3 %, room 80 mm x 60 mm, adjustable 8 N to 12 N'
    >>> _listed({"material": [{"name": "pla"}, {"name": "pom"}], "prefer": ["size", "ripple"]})
    'material pla or pom, prefer size, ripple'
    """
    return ", ".join(f"{key.replace('_', ' ')} {_words(key, value)}" for key, value in pairs.items())


JOINED = {"room": " x ", "material": " or ", "prefer": ", "}
"""What stands between the values of a key that has several; else they are the two ends of a band."""


def _words(key: str, value: Any) -> str:
    if isinstance(value, list | tuple):
        return JOINED.get(key, " to ").join(_words(key, one) for one in value)
    if isinstance(value, dict):
        return str(value.get("name") or _listed(value))
    return format_short(value, "ratio", 3) if key in SHARES and isinstance(value, float | int) else str(value)


__all__ = ["NAME", "page"]
