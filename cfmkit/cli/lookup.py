"""One thing by its name, for `cfmkit show NAME`: a material, metric, value or warning of a family, unit or paper."""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from cfmkit import families
from cfmkit.cli.pages import Column, Page, Section, field

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    Records = Mapping[str, Sequence[Mapping[str, Any]]]
    """By every name under which it is found: what there is to say."""


def found(name: str) -> Page | None:
    """Return the page on everything that has a name; None if nothing has."""
    sections = {}
    for kind, (records, columns) in _KINDS.items():
        every = records()
        known = [one for key in _keys(kind, name) for one in every.get(key, ())]
        if known:
            sections[kind] = Section(kind, known, columns)
    if not sections:
        return None
    return Page(name, "", tuple(sections.values()), {kind: section.records for kind, section in sections.items()})


def names() -> list[str]:
    """Return every name that `found` knows."""
    return [name for records, _ in _KINDS.values() for name in records()]


def references() -> list[dict[str, str]]:
    """Return the papers behind all families: name, family and the reference in full."""
    return [
        {"name": _tag(text), "family": record.name, "reference": text}
        for record in families.records()
        for text in record.references
    ]


def _tag(reference: str) -> str:
    """Return the first author's family name and the year: ``lan-2010``."""
    author = reference.partition(",")[0].split()[-1].lower()
    years = re.findall(r"\b(?:19|20)[0-9]{2}\b", reference)
    return "-".join([author, *years[:1]])


def _keys(kind: str, name: str) -> list[str]:
    """Return a name as its kind is listed: a metric without its branch, a dimension also by any unit of it."""
    if kind == "metrics":
        return [name.partition("[")[0]]
    return [name.replace(" ", "_"), *_measured_in(name)] if kind == "dimensions" else [name]


def _measured_in(unit: str) -> list[str]:
    """Return the dimensions that a unit such as ``N/mm`` measures; none if it is no unit."""
    from cfmkit.specs.units import DIMENSIONS
    from cfmkit.specs.units.registry import border_size, is_unit, unit_size

    if not is_unit(unit):
        return []
    powers = unit_size(unit).powers
    return [one.name for one in DIMENSIONS.values() if one.unit and border_size(one.name).powers == powers]


def _gathered(pairs: Iterator[tuple[str, dict[str, Any]]]) -> Records:
    known: dict[str, list[dict[str, Any]]] = {}
    for name, record in pairs:
        known.setdefault(name, []).append(record)
    return known


def _materials() -> Records:
    from cfmkit.stock import MATERIALS

    return _gathered((name, asdict(one)) for one in MATERIALS.values() for name in (one.name, *one.aliases))


def _metrics() -> Records:
    from cfmkit.metrics import definitions
    from cfmkit.specs.units import border_unit

    return _gathered(
        (one.name, {"name": one.name, "unit": border_unit(one.dimension), "definition": one.definition})
        for one in definitions(None)
    )


def _values() -> Records:
    from cfmkit.specs.units import border_unit

    return _gathered(
        (key, {"name": key, "family": record.name, "unit": border_unit(dimension), "definition": definition})
        for record in families.records()
        for key, (dimension, definition) in record.values.items()
    )


def _findings() -> Records:
    return _gathered(
        (key, {"name": key, "family": record.name, "meaning": meaning})
        for record in families.records()
        for key, meaning in record.findings.items()
    )


def _units() -> Records:
    from cfmkit.specs.units import unit_table

    keys = ("symbol", "name", "dimension", "si", "input_only")
    each = [dict(zip(keys, entry, strict=True)) for entry in unit_table()]
    return _gathered((str(unit[key]), unit) for unit in each for key in ("symbol", "name"))


def _dimensions() -> Records:
    from cfmkit.specs.units import DIMENSIONS

    return _gathered(
        (one.name, {"name": one.name, "unit": one.unit, "meaning": one.description, "example": one.example})
        for one in DIMENSIONS.values()
        if one.unit
    )


def _references() -> Records:
    each = references()
    return _gathered((name, one) for one in each for name in {one["name"], re.sub(r"-[0-9]{4}$", "", one["name"])})


def _property(item: Mapping[str, Any]) -> str:
    """Return the numbers of a material in words."""
    scatter, strength = item["scatter"], item["yield_strength"]
    told = [
        f"E = {item['youngs_modulus'] / 1e9:.4g} GPa ({_ends(scatter['youngs_modulus'], 1e9)})",
        f"nu = {item['poisson_ratio']:.4g}",
        f"density {item['density']:.4g} kg/m^3",
    ]
    if strength is not None:
        told.insert(1, f"yield_strength = {strength / 1e6:.4g} MPa ({_ends(scatter['yield_strength'], 1e6)})")
    return ", ".join(told)


def _ends(ends: Sequence[float], size: float) -> str:
    return " ... ".join(f"{end / size:.4g}" for end in ends)


_ABOUT = (field("name"), field("family"), field("unit"), field("definition", wraps=True))
_KINDS: Mapping[str, tuple[Callable[[], Records], tuple[Column, ...]]] = {
    "materials": (
        _materials,
        (field("name", "material"), Column("properties", _property, wraps=True), field("source", wraps=True)),
    ),
    "metrics": (_metrics, (field("name"), field("unit"), field("definition", wraps=True))),
    "values": (_values, _ABOUT),
    "findings": (_findings, (field("name"), field("family"), field("meaning", wraps=True))),
    "units": (
        _units,
        (
            field("symbol", "unit"),
            field("name"),
            Column("measures", lambda unit: str(unit["dimension"]).replace("_", " ")),
            Column("in SI", lambda unit: f"{unit['si']:.12g}"),
        ),
    ),
    "dimensions": (
        _dimensions,
        (field("name"), field("unit", "written in"), field("example"), field("meaning", wraps=True)),
    ),
    "references": (_references, (field("name"), field("family"), field("reference", wraps=True))),
}
"""What is known by name: a heading, the records, and what is shown of each."""
