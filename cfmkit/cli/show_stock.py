"""The page of `cfmkit show stock`: sizes in which sheets, wire, pins, bearings and screws are sold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.documents.document import Field, field

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Section = tuple[str, Sequence[Mapping[str, Any]], tuple[Field, ...]]

TEXT = (
    "Sizes for `part.stock: metric` and `inch`, as far as a text with them was read: sheets by material, bearings by "
    "their bore. Materials that are missing have no series here, and their sheets are not rounded."
)


def stock_page_parts() -> tuple[str, str, tuple[Section, ...], dict[str, list[dict[str, Any]]]]:
    """Return title, text, tables and records of the page."""
    from cfmkit.stock.stock_series import ALL_SERIES

    records = [
        {
            "kind": one.kind,
            "system": one.system,
            "materials": list(one.materials),
            "standard": one.standard,
            "sizes": list(one.sizes),
            "read": one.read,
        }
        for one in ALL_SERIES
    ]
    columns = (
        Field("stock", lambda one: " ".join((one["kind"], *one["materials"])), wraps=True),
        field("system"),
        field("standard", wraps=True),
        Field("sizes [mm]", lambda one: ", ".join(f"{1e3 * size:.6g}" for size in one["sizes"]), wraps=True),
        field("read", "read in", wraps=True),
    )
    return "stock", TEXT, (("", records, columns),), {"stock": records}
