"""What `cfmkit show` can explain: each topic as records for JSON, and as a table for people."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from cfmkit import families
from cfmkit.cli import lookup
from cfmkit.cli.pages import Column, Page, Section, field
from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    Record = Mapping[str, Any]


def page(name: str | None) -> Page:
    """Return the page on a topic, a family, or whatever else has that name; without a name the list of topics.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is none; the message names the nearest.
    """
    if name is None:
        return overview()
    if name in TOPICS:
        return TOPICS[name][1]()
    if name in families.names() or name in families.clashing():
        return family_page(name)
    if (found := lookup.found(name)) is not None:
        return found
    from cfmkit.specs.yamlio import did_you_mean

    known = [*TOPICS, *families.names()]
    every = f"there are {', '.join(known)}, and materials, metrics, values, warnings, units and papers by their names"
    hint = did_you_mean(name, [*known, *lookup.names()]) or every
    raise UsageError(f"there is nothing to show about {name!r}; {hint}")


def skipped(name: str | None) -> tuple[str, ...]:
    """Return the families of other packages that a page cannot tell of; none where it tells of no family or one."""
    whole = name not in {*families.names(), "units", "metrics", "materials"}
    return families.skipped() if whole else ()


def overview() -> Page:
    """Return the list of families and topics."""
    mechanisms = [{"name": record.name, "summary": record.summary} for record in families.records()]
    topics = [{"name": name, "summary": summary} for name, (summary, _) in TOPICS.items()]
    columns = (field("name", ""), field("summary", "", wraps=True))
    sections = (Section("families", mechanisms, columns), Section("topics", topics, columns))
    return Page("cfmkit show", "explains one of these:", sections, {"families": mechanisms, "topics": topics})


def units_page() -> Page:
    """Return the closed list of units, and the dimensions with the unit that files are written in."""
    from cfmkit.specs.units import DIMENSIONS, unit_table

    names = ("symbol", "name", "dimension", "si", "input_only")
    units = [dict(zip(names, entry, strict=True)) for entry in unit_table()]
    dimensions = [
        {"name": item.name, "unit": item.unit, "description": item.description, "example": item.example}
        for item in DIMENSIONS.values()
        if item.unit
    ]
    unit_columns = (
        field("symbol", "unit"),
        field("name"),
        Column("measures", lambda unit: unit["dimension"].replace("_", " ")),
        Column("in SI", lambda unit: f"{unit['si']:.12g}"),
        Column("", lambda unit: "input only" if unit["input_only"] else ""),
    )
    dimension_columns = (
        Column("dimension", lambda item: item["name"].replace("_", " ")),
        field("unit", "written in"),
        field("example"),
        field("description", "meaning", wraps=True),
    )
    text = "Case-sensitive; combine with *, / and ^: N*mm/rad, kg/m^3. Zero needs no unit."
    sections = (Section("units", units, unit_columns), Section("dimensions", dimensions, dimension_columns))
    return Page("units", text, sections, {"units": units, "dimensions": dimensions})


def metrics_page() -> Page:
    """Return the metrics that every family has."""
    from cfmkit.metrics import definitions
    from cfmkit.specs.units import border_unit

    records = [
        {
            "name": item.name,
            "unit": border_unit(item.dimension),
            "definition": item.definition,
            "per_branch": item.per_branch,
        }
        for item in definitions("force")
    ]
    text = (
        "Over the requirement's `over`, else analysis.window, else the full travel. Without a branch the worst one "
        "counts; force_mean[load] picks one. On a torque curve force_... is called torque_..., in N*mm over deg. "
        "`cfmkit show FAMILY` lists what a family adds."
    )
    return Page("metrics", text, (Section("", records, METRIC_COLUMNS),), {"metrics": records})


def materials_page() -> Page:
    """Return the material library."""
    from cfmkit.stock import MATERIALS

    records = [asdict(item) for item in MATERIALS.values()]
    columns = (
        field("name", "material", wraps=True),
        Column("E\n[GPa]", lambda item: f"{item['youngs_modulus'] / 1e9:.4g}"),
        Column("from ... to", lambda item: _range(item["scatter"]["youngs_modulus"], 1e9), wraps=True),
        Column("yield_strength\n[MPa]", lambda item: _number(item["yield_strength"], 1e6)),
        Column("from ... to", lambda item: _range(item["scatter"]["yield_strength"], 1e6), wraps=True),
    )
    text = "At room temperature, for short loads; the ranges are what to expect in practice. In SI under --json."
    sources = (
        field("name", "material", wraps=True),
        field("poisson_ratio", "nu"),
        Column("density\n[kg/m^3]", lambda item: f"{item['density']:.4g}"),
        field("source", wraps=True),
    )
    sections = (Section("", records, columns), Section("sources", records, sources))
    return Page("materials", text, sections, {"materials": records})


def references_page() -> Page:
    """Return the papers behind all families."""
    records = lookup.references()
    columns = (field("name"), field("family"), field("reference", wraps=True))
    return Page("references", "", (Section("", records, columns),), {"references": records})


def family_page(name: str) -> Page:
    """Return what a spec of a family may say, what a run can report, and where it comes from."""
    from cfmkit.specs.keys import keys
    from cfmkit.specs.units import border_unit

    record = families.family(name)
    known = [asdict(key) for key in keys(record.spec_type)]
    values = [
        {"name": key, "unit": border_unit(dimension), "definition": definition, "per_branch": False}
        for key, (dimension, definition) in record.values.items()
    ]
    findings = [{"name": key, "meaning": meaning} for key, meaning in record.findings.items()]
    references = [{"reference": reference} for reference in record.references]
    sections = (
        *_key_sections(known),
        Section("values beside the metrics", values, METRIC_COLUMNS),
        Section("warnings and failures", findings, (field("name", ""), field("meaning", "", wraps=True))),
        Section("references", references, (field("reference", "", wraps=True),)),
    )
    data = {"keys": known, "values": values, "findings": findings, "references": references}
    return Page(name, record.summary, sections, data)


def _key_sections(known: Sequence[Record]) -> list[Section]:
    """Return one table for the keys at the top and one for each block."""
    blocks: dict[str, list[Record]] = {}
    for key in known:
        head, dot, rest = key["path"].partition(".")
        blocks.setdefault(head.removesuffix("[]") if dot else "", []).append(dict(key) | {"path": rest or head})
    about = {key["path"]: key["description"] for key in known}
    top = [key for key in blocks.pop("", []) if key["path"] not in blocks]
    named = {f"{head}: {about.get(head, '')}": rows for head, rows in blocks.items()}
    return [Section(heading, rows, KEY_COLUMNS) for heading, rows in ({"spec": top} | named).items()]


def _number(value: float | None, size: float) -> str:
    return "" if value is None else f"{value / size:.4g}"


def _range(ends: Iterable[float] | None, size: float) -> str:
    return "" if ends is None else " ... ".join(f"{end / size:.4g}" for end in ends)


def _kind(key: Record) -> str:
    unit = key["example"].partition(" ")[2]
    return f"{key['kind']} [{unit}]" if unit and unit != "%" else str(key["kind"])


def _default(key: Record) -> str:
    return "required" if key["required"] else str(key["default"])


KEY_COLUMNS = (
    field("path", "key"),
    Column("value", _kind, wraps=True),
    Column("default", _default),
    Column("meaning", lambda key: "; ".join(filter(None, (key["description"], key["allowed"]))), wraps=True),
)
METRIC_COLUMNS = (field("name", "metric"), field("unit"), field("definition", wraps=True))

TOPICS: Mapping[str, tuple[str, Callable[[], Page]]] = {
    "units": ("the units that a spec may use, and those that files are written in", units_page),
    "metrics": ("the constant-force metrics: name, unit, definition", metrics_page),
    "materials": ("the named materials, with scatter and source", materials_page),
    "references": ("the papers behind the families", references_page),
}
