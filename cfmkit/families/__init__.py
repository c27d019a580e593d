"""The registry of families: one line each, imported when first asked for."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING

from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from cfmkit.families.base import Family

FAMILIES = {
    "beam": "cfmkit.families.beam",
    "cam": "cfmkit.families.cam",
    "slider-crank": "cfmkit.families.slider_crank",
    "vcfm": "cfmkit.families.vcfm",
}


def names() -> tuple[str, ...]:
    """Return the names of all families."""
    return tuple(FAMILIES)


def family(name: str) -> Family:
    """Return the family called `name`.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is none; the message names the nearest.
    """
    if name not in FAMILIES:
        near = get_close_matches(name, FAMILIES, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise UsageError(f"unknown family {name!r}; known are {', '.join(FAMILIES)}{hint}")
    record: Family = import_module(FAMILIES[name]).FAMILY
    return record
