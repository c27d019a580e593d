"""The registry of families: one line each, imported when first needed; other packages add theirs by entry points."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING

from cfmkit.errors import UsageError
from cfmkit.families import entry_point_plugins
from cfmkit.families.entry_point_plugins import Unusable

if TYPE_CHECKING:
    from cfmkit.families.base import Family

FAMILIES = {
    "beam": "cfmkit.families.beam",
    "cam": "cfmkit.families.cam",
    "slider-crank": "cfmkit.families.slider_crank",
    "vcfm": "cfmkit.families.vcfm",
}
"""Those of this package."""


def names() -> tuple[str, ...]:
    """Return the names of all families, those of other packages last; nothing is imported for it."""
    return (*FAMILIES, *entry_point_plugins.usable_names(FAMILIES))


def clashing() -> tuple[str, ...]:
    """Return the names that more than one other package offers: none of those families can be used."""
    known = names()
    return tuple(dict.fromkeys(one.name for one in entry_point_plugins.offers() if one.name not in known))


def family(name: str) -> Family:
    """Return the family called `name`.

    Raises
    ------
    cfmkit.families.Unusable
        If another package has it, but it cannot be used; the message says why.
    cfmkit.errors.UsageError
        If there is none; the message names the nearest.
    """
    if name in FAMILIES:
        record: Family = import_module(FAMILIES[name]).FAMILY
        return record
    for offer in entry_point_plugins.offers():
        if offer.name == name:
            return entry_point_plugins.record_of(offer, FAMILIES)
    near = get_close_matches(name, names(), n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise UsageError(f"unknown family {name!r}; known are {', '.join(names())}{hint}")


def examined() -> tuple[tuple[entry_point_plugins.InstalledFamily | None, Family | str], ...]:
    """Return every family with the offer of the package it is from, or the reason why it cannot be used.

    Returns
    -------
    tuple of (InstalledFamily or None, Family or str)
        Those of this package come first, without an offer. All others are imported.
    """
    own = tuple((None, family(name)) for name in FAMILIES)
    return own + tuple((offer, _tried(offer)) for offer in entry_point_plugins.offers())


def records() -> tuple[Family, ...]:
    """Return all families that can be used, in the order of `names`; `skipped` says which cannot."""
    return tuple(found for _, found in examined() if not isinstance(found, str))


def skipped() -> tuple[str, ...]:
    """Return one line for each family of another package that cannot be used, with the reason."""
    return tuple(found for _, found in examined() if isinstance(found, str))


def _tried(offer: entry_point_plugins.InstalledFamily) -> Family | str:
    try:
        return entry_point_plugins.record_of(offer, FAMILIES)
    except Unusable as problem:
        return str(problem)


def origin(name: str) -> dict[str, str]:
    """Return what computes a family of another package; empty for those of this package.

    Returns
    -------
    dict
        ``package``, ``version`` and ``content``, the SHA-256 of its files: what is kept for a later run is of these.
    """
    if name in FAMILIES:
        return {}
    offers = entry_point_plugins.offers()
    return next((entry_point_plugins.code_of(offer) for offer in offers if offer.name == name), {})


def origins() -> dict[str, dict[str, str]]:
    """Return what computes each family of another package."""
    offers = entry_point_plugins.offers()
    return {one.name: entry_point_plugins.code_of(one) for one in offers if one.name not in FAMILIES}


__all__ = ["FAMILIES", "Unusable", "clashing", "examined", "family", "names", "origin", "origins", "records", "skipped"]
