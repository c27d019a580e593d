"""The page of `cfmkit show stock`: sizes in which sheets, wire, pins, bearings and screws are sold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.documents.document import Field, field

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Section = tuple[str, Sequence[Mapping[str, Any]], tuple[Field, ...]]

PAGE_TEXT = (
    "Sizes for `part.stock: metric` and `inch`, as far as a text with them was read: sheets by material, bearings by "
    "their bore. Materials that are missing have no series here, and their sheets are not rounded."
)


def stock_page_parts() -> tuple[str, str, tuple[Section, ...], dict[str, list[dict[str, Any]]]]:
    """Return title, text, tables and records of the page."""
    from cfmkit.stock.stock_series import ALL_SERIES

    records = [
        {
            "kind": entry.kind,
            "system": entry.system,
            "materials": list(entry.materials),
            "standard": entry.standard,
            "sizes": list(entry.sizes),
            "read": entry.read,
        }
        for entry in ALL_SERIES
    ]
    columns = (
        Field("stock", lambda entry: " ".join((entry["kind"], *entry["materials"])), wraps=True),
        field("system"),
        field("standard", wraps=True),
        Field("sizes [mm]", lambda entry: ", ".join(f"{1e3 * size:.6g}" for size in entry["sizes"]), wraps=True),
        field("read", "read in", wraps=True),
    )
    return "stock", PAGE_TEXT, (("", records, columns),), {"stock": records}
