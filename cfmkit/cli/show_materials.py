"""The page of `cfmkit show materials`: the library, its sources, and what is assumed of how materials last."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from cfmkit.documents.document import Field, field

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cfmkit.stock.materials import LastingData

    Section = tuple[str, Sequence[Mapping[str, Any]], tuple[Field, ...]]

NO_SPREAD = "none stated"  # of a property for which the sources of a material state no range
PAGE_TEXT = (
    "At room temperature, under short-term loads; the ranges are what to expect in practice. What is assumed counts "
    "where a specification names the material and states no 'fatigue' or 'relaxation'. With --json in SI units."
)


def materials_page_parts() -> tuple[str, str, tuple[Section, ...], dict[str, list[dict[str, Any]]]]:
    """Return title, text, tables and records of the page."""
    from cfmkit.stock import MATERIALS_BY_NAME
    from cfmkit.stock.materials import ASSUMED_DATA

    records = [
        {**asdict(item), "assumed": asdict(ASSUMED_DATA[item.name]) if item.name in ASSUMED_DATA else None}
        for item in MATERIALS_BY_NAME.values()
    ]
    columns = (
        field("name", "material", wraps=True),
        Field("E\n[GPa]", lambda item: f"{item['youngs_modulus'] / 1e9:.4g}"),
        Field("from ... to", lambda item: _range(item["scatter"]["youngs_modulus"], 1e9), wraps=True),
        Field("yield_strength\n[MPa]", lambda item: _number(item["yield_strength"], 1e6)),
        Field("from ... to", lambda item: _range(item["scatter"]["yield_strength"], 1e6), wraps=True),
    )
    sources = (
        field("name", "material", wraps=True),
        Field("nu", lambda item: "" if item["poisson_is_assumed"] else f"{item['poisson_ratio']:.4g}"),
        Field("from ... to", lambda item: _spread(item["scatter"]["poisson_ratio"]), wraps=True),
        Field("density\n[kg/m^3]", lambda item: f"{item['density']:.4g}"),
        Field("from ... to", lambda item: _spread(item["scatter"]["density"]), wraps=True),
        field("source", wraps=True),
    )
    lasting = [
        {"name": item["name"], "property": "Poisson ratio", "values": f"{item['poisson_ratio']:.4g}", "source": "none"}
        for item in records
        if item["poisson_is_assumed"]
    ]
    lasting += [row for name, entry in ASSUMED_DATA.items() for row in assumed_rows(name, entry)]
    assumed = (
        field("name", "material", wraps=True),
        field("property", wraps=True),
        field("values", wraps=True),
        field("source", wraps=True),
    )
    sections = (("", records, columns), ("sources", records, sources), ("assumed", lasting, assumed))
    return "materials", PAGE_TEXT, sections, {"materials": records}


def assumed_rows(name: str, entry: LastingData) -> list[dict[str, str]]:
    """Return what is assumed of a material, a row for each property.

    Examples
    --------
    >>> from cfmkit.stock.materials import ASSUMED_DATA
    >>> [row["values"] for row in assumed_rows("pc", ASSUMED_DATA["pc"])]
    ['2.4 GPa at once, 2.2 GPa after 1 h, 1.9 GPa after 1000 h, 23 deg C']
    """
    result: list[tuple[str, str, str]] = []
    if (law := entry.fatigue) is not None:
        amplitudes = ", ".join(f"{amplitude / 1e6:.0f} MPa at {cycles:.0e}" for cycles, amplitude in law.points)
        words = f"{amplitudes}, fully reversed; tensile strength {law.ultimate_strength / 1e6:.0f} MPa"
        result.append(("S-N", words.replace("e+0", "e"), law.source))
    if (creep := entry.relaxation) is not None:
        moduli = ", ".join(
            f"{modulus / 1e9:.3g} GPa {f'after {time / 3600:.0f} h' if time else 'at once'}"
            for time, modulus in creep.points
        )
        result.append(("modulus over time", f"{moduli}, {creep.temperature}", creep.source))
    if entry.loss_factor is not None:
        result.append(("loss factor", f"{entry.loss_factor:g}", f"assumed: {entry.loss_source}; no model uses it"))
    return [
        {"name": name, "property": what, "values": values, "source": source.removeprefix("assumed: ")}
        for what, values, source in result
    ]


def properties(item: Mapping[str, Any]) -> str:
    """Return the numbers of a material in words."""
    from cfmkit.stock.materials import ASSUMED_DATA

    scatter, strength = item["scatter"], item["yield_strength"]
    spread = _spread(scatter["poisson_ratio"])
    reported = [
        f"E = {item['youngs_modulus'] / 1e9:.4g} GPa ({_range(scatter['youngs_modulus'], 1e9)})",
        f"nu = {item['poisson_ratio']:.4g} ({'assumed' if item['poisson_is_assumed'] else spread})",
        f"density {item['density']:.4g} kg/m^3 ({_spread(scatter['density'])})",
    ]
    if strength is not None:
        reported.insert(1, f"yield_strength = {strength / 1e6:.4g} MPa ({_range(scatter['yield_strength'], 1e6)})")
    if item["name"] in ASSUMED_DATA:
        rows = assumed_rows(item["name"], ASSUMED_DATA[item["name"]])
        reported += [f"assumed {row['property']}: {row['values']} ({row['source']})" for row in rows]
    return ", ".join(reported)


def _number(value: float | None, size: float) -> str:
    return "" if value is None else f"{value / size:.4g}"


def _range(ends: Iterable[float] | None, size: float) -> str:
    return "" if ends is None else " ... ".join(f"{end / size:.4g}" for end in ends)


def _spread(ends: Sequence[float] | None) -> str:
    """Return a range, or that its source states none."""
    return NO_SPREAD if ends is None else _range(ends, 1.0)
