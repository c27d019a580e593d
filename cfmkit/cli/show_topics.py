"""Subjects of `cfmkit show`: topics and families as pages, and everything else by its name.

A page is the answer of the command: records for ``--json``, and the same as tables for people.
"""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from cfmkit import families
from cfmkit.cli.guide import list_terms
from cfmkit.cli.show_materials import materials_page_parts, properties
from cfmkit.cli.show_stock import stock_page_parts
from cfmkit.documents.document import LABEL_TONE, Document, Field, Span, TextLine, Verbatim, field, line, record_table
from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cfmkit.documents.document import Block
    from cfmkit.specs.keys_and_schema import Key

    Record = Mapping[str, Any]
    Section = tuple[str, Sequence[Record], tuple[Field, ...]]
    """Heading, records and what is shown of each."""

    Records = Mapping[str, Sequence[Record]]
    """By every name under which it is found: what there is to say."""


def explain(name: str | None) -> Document:
    """Return what there is to say of a topic, a family, or whatever else has that name; without a name what there is.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is none; the message names the nearest.
    """
    if name is None:
        return overview()
    if name in TOPIC_HEADINGS:
        return TOPIC_HEADINGS[name][1]()
    if name in families.names() or name in families.clashing():
        return family_page(name)
    if (page := find_page(name)) is not None:
        return page
    from cfmkit.specs.yamlio import did_you_mean

    topics = [*TOPIC_HEADINGS, *families.names()]
    by_name = "keys, materials, metrics, values, warnings, units, papers and symbols by their names"
    every = f"there are {', '.join(topics)}, and {by_name}"
    hint = did_you_mean(name, [*topics, *names()]) or every
    raise UsageError(f"there is nothing to show about {name!r}; {hint}")


def list_skipped_families(name: str | None) -> tuple[str, ...]:
    """Return the families of other packages that are missing from a page on all families; none for other pages."""
    whole = name not in {*families.names(), "units", "metrics", "materials", "stock"}
    return families.list_skipped() if whole else ()


def _page(title: str, text: str, sections: Iterable[Section], data: Mapping[str, Sequence[Record]]) -> Document:
    def blocks() -> Iterator[Block]:
        yield TextLine((Span(title, LABEL_TONE), Span(f"  {text}")))
        for section in sections:
            yield from record_table(*section)

    return Document(data, blocks())


BY_NAME = {
    "rolling_friction": "a key of the specification",
    "theta2": "a symbol of the drawings",
    "force_ripple": "a metric",
    "pla": "a material",
    "MPa": "a unit",
    "envelope": "a term",
    "undercut": "a warning or failure",
    "lan-2010": "a paper",
}
"""Examples of what else `explain` finds."""


def overview() -> Document:
    """Return the list of families and topics."""
    mechanisms = [{"name": record.name, "summary": record.summary} for record in families.records()]
    topics = [{"name": name, "summary": summary} for name, (summary, _) in TOPIC_HEADINGS.items()]
    columns = (field("name", ""), field("summary", "", wraps=True))
    by_name = [{"name": name, "summary": what} for name, what in BY_NAME.items()]
    sections = (
        ("families", mechanisms, columns),
        ("topics", topics, columns),
        ("anything else by its name, such as", by_name, columns),
    )
    text = "explains one of these, or a word by its meaning (creep, BOM); `cfmkit show FAMILY --figure` draws a family"
    return _page("cfmkit show", text, sections, {"families": mechanisms, "topics": topics})


def units_page() -> Document:
    """Return the closed list of units, and the dimensions with the unit that files are written in."""
    from cfmkit.specs.units import DIMENSIONS_BY_NAME, unit_table

    names = ("symbol", "name", "dimension", "si", "input_only")
    units = [dict(zip(names, entry, strict=True)) for entry in unit_table()]
    dimensions = [
        {"name": item.name, "unit": item.unit, "description": item.description, "example": item.example}
        for item in DIMENSIONS_BY_NAME.values()
        if item.unit
    ]
    unit_columns = (
        field("symbol", "unit"),
        field("name"),
        Field("measures", lambda unit: unit["dimension"].replace("_", " ")),
        Field("in SI", lambda unit: f"{unit['si']:.12g}"),
        Field("", lambda unit: "input only" if unit["input_only"] else ""),
    )
    dimension_columns = (
        Field("dimension", lambda item: item["name"].replace("_", " ")),
        field("unit", "written in"),
        field("example"),
        field("description", "meaning", wraps=True),
    )
    text = "Case-sensitive; combine with *, / and ^: N*mm/rad, kg/m^3. Zero needs no unit."
    sections = (("units", units, unit_columns), ("dimensions", dimensions, dimension_columns))
    return _page("units", text, sections, {"units": units, "dimensions": dimensions})


def metrics_page() -> Document:
    """Return the metrics that every family has."""
    from cfmkit.metrics import definitions
    from cfmkit.specs.units import border_unit
    from cfmkit.specs.what_yield_metrics_mean import OF_MANY_PARTS

    records = [
        {
            "name": item.name,
            "unit": border_unit(item.dimension),
            "definition": item.definition,
            "per_branch": item.per_branch,
        }
        for item in definitions("force")
    ]
    records += [
        {"name": name, "unit": "1", "definition": about, "per_branch": False} for name, about in OF_MANY_PARTS.items()
    ]
    text = (
        "Evaluated over the requirement's `over`, else analysis.window, else the full travel. Without a branch in "
        "brackets the worst branch counts; force_mean[load] selects one. For torques force_... is called torque_..., "
        "in N*mm over deg. `cfmkit show FAMILY` lists what a family adds."
    )
    return _page("metrics", text, (("", records, METRIC_FIELDS),), {"metrics": records})


def references_page() -> Document:
    """Return the papers behind all families, and their BibTeX."""
    records = references()
    columns = (field("name"), field("family"), field("reference", wraps=True))
    shown = _page("references", "", (("", records, columns),), {})
    bibtex = {record.name: text for record in families.records() if (text := record.bibtex)}
    page = (*shown.body, *(block for text in bibtex.values() for block in (line(""), Verbatim(text.strip() + "\n"))))
    return Document({"references": records, "bibtex": bibtex}, page)


def family_page(name: str) -> Document:
    """Return what a spec of a family may say, what a run can report, and where it comes from."""
    from cfmkit.runs.dimension_drawing import DRAWING_FILE
    from cfmkit.specs.keys_and_schema import keys
    from cfmkit.specs.units import border_unit

    record = families.family(name)
    spec_keys = [asdict(key) for key in keys(record.spec_type)]
    values = [
        {"name": key, "unit": border_unit(dimension), "definition": definition, "per_branch": False}
        for key, (dimension, definition) in record.outputs.values.items()
    ]
    findings = [{"name": key, "meaning": meaning} for key, meaning in record.outputs.findings.items()]
    references = [{"reference": paper.reference} for paper in record.papers]
    sections = (
        *_key_sections(spec_keys),
        ("values beside the metrics", values, METRIC_FIELDS),
        ("warnings and failures", findings, (field("name", ""), field("meaning", "", wraps=True))),
        ("references", references, (field("reference", "", wraps=True),)),
    )
    data = {"keys": spec_keys, "values": values, "findings": findings, "references": references}
    starts = f"`cfmkit new {name}` starts a file" if record.file("template.yaml") else ""
    drawn = f"`cfmkit show {name} --figure` draws it with its dimensions named" if record.file(DRAWING_FILE) else ""
    commands = "; ".join(filter(None, (starts, drawn)))
    return _page(name, f"{record.summary}. {commands}" if commands else record.summary, sections, data)


READ_FIRST = {name: place for place, name in enumerate(("mechanism", "design", "analysis", "requirements"))}
"""Blocks in the order in which a file is written; those of studies come after them."""


def _key_sections(spec_keys: Sequence[Record]) -> list[Section]:
    """Return one table for the keys at the top and one for each block, those within a block after it."""
    blocks: dict[str, list[Record]] = {}
    for key in spec_keys:
        parent, _, name = key["path"].rpartition(".")
        blocks.setdefault(parent, []).append(dict(key) | {"path": name})
    about = {key["path"]: key["description"] for key in spec_keys}
    top = [key for key in blocks.pop("", []) if key["path"] not in {parent.removesuffix("[]") for parent in blocks}]
    sections = [("spec", top)]
    for parent in sorted(blocks, key=_when_read):
        name = parent.removesuffix("[]").removesuffix(".NAME")
        sections.append((f"{parent.removesuffix('[]')}: {about.get(name, '')}", blocks[parent]))
    return [(heading, rows, KEY_FIELDS) for heading, rows in sections]


def _when_read(block: str) -> int:
    """Return the place of a block in the order in which a file is written."""
    return READ_FIRST.get(block.partition(".")[0].removesuffix("[]"), len(READ_FIRST))


def _kind(key: Record) -> str:
    unit = key["example"].partition(" ")[2]
    return f"{key['kind']} [{unit}]" if unit and unit != "%" else str(key["kind"])


def _default(key: Record) -> str:
    return "required" if key["required"] else str(key["default"])


def find_page(name: str) -> Document | None:
    """Return the page on everything that has a name; None if nothing has."""
    sections: list[Section] = []
    for kind, (records, fields) in TOPIC_KINDS.items():
        every = records()
        if entries_of_kind := [entry for key in _keys(kind, name) for entry in every.get(key, ())]:
            sections.append((kind, entries_of_kind, fields or SPEC_KEY_FIELDS))
    if not sections and (drawn := _symbols(name)):
        sections.append(("symbols", drawn, SYMBOL_FIELDS))
    if not sections:
        return None
    page = _page(name, "", sections, {kind: entries_of_kind for kind, entries_of_kind, _ in sections})
    papers = {paper.name: paper.bibtex for record in families.records() for paper in record.papers}
    entries = [papers[entry["name"]] for kind, shown, _ in sections if kind == "references" for entry in shown]
    more = (block for text in entries for block in (line(""), Verbatim(text + "\n")))
    return Document({**page.data, **({"bibtex": entries} if entries else {})}, (*page.body, *more))


def _symbols(name: str) -> list[Record]:
    """Return what a symbol such as ``theta2`` is in the drawings of the families."""
    from cfmkit.runs.dimension_drawing import DRAWING_FILE, read_dimensions

    return [
        {"name": row["symbol"], "family": record.name, "key": row["key"], "meaning": row["meaning"]}
        for record in families.records()
        if record.file(DRAWING_FILE)
        for row in read_dimensions(record)
        if name in re.split(r", | \.\.\. ", row["symbol"])
    ]


def names() -> list[str]:
    """Return every name that `find_page` knows, but for the paths of keys and symbols."""
    return [name for records, _ in TOPIC_KINDS.values() for name in records() if "." not in name]


def references() -> list[dict[str, str]]:
    """Return the papers behind all families: name, family and the reference in full."""
    return [
        {"name": paper.name, "family": record.name, "reference": paper.reference}
        for record in families.records()
        for paper in record.papers
    ]


def _keys(kind: str, name: str) -> list[str]:
    """Return a name as its kind is listed: a metric without its branch, a dimension also by any unit of it."""
    if kind == "metrics":
        return [name.partition("[")[0]]
    return [name.replace(" ", "_"), *_measured_in(name)] if kind == "dimensions" else [name]


def _measured_in(unit: str) -> list[str]:
    """Return the dimensions that a unit such as ``N/mm`` measures; none if it is not a unit."""
    from cfmkit.specs.units import DIMENSIONS_BY_NAME
    from cfmkit.specs.units.unit_size import border_size, is_unit, unit_size

    if not is_unit(unit):
        return []
    powers = unit_size(unit).powers
    return [
        dimension.name
        for dimension in DIMENSIONS_BY_NAME.values()
        if dimension.unit and border_size(dimension.name).powers == powers
    ]


def _gather_records(pairs: Iterator[tuple[str, dict[str, Any]]]) -> Records:
    records: dict[str, list[dict[str, Any]]] = {}
    for name, record in pairs:
        records.setdefault(name, []).append(record)
    return records


def _materials() -> Records:
    from cfmkit.stock import MATERIALS_BY_NAME

    return _gather_records(
        (name, asdict(entry)) for entry in MATERIALS_BY_NAME.values() for name in (entry.name, *entry.aliases)
    )


def _metrics() -> Records:
    from cfmkit.metrics import definitions
    from cfmkit.specs.units import border_unit
    from cfmkit.specs.what_yield_metrics_mean import OF_MANY_PARTS

    definitions_of_metrics = [
        (definition.name, border_unit(definition.dimension), definition.definition) for definition in definitions(None)
    ]
    definitions_of_metrics += [(name, "1", about) for name, about in OF_MANY_PARTS.items()]
    return _gather_records(
        (name, {"name": name, "unit": unit, "definition": definition})
        for name, unit, definition in definitions_of_metrics
    )


def _values() -> Records:
    """Return the values of the families, of the causes that they find in a measured loop, and of recordings."""
    from cfmkit.experiment.value_definitions import define_recorded_values
    from cfmkit.specs.units import border_unit

    every = families.records()
    values_by_source = [(record.name, {**record.outputs.values, **record.outputs.causes}) for record in every]
    values_by_source.append(("recordings", define_recorded_values("torque") | define_recorded_values("force")))
    return _gather_records(
        (key, {"name": key, "family": name, "unit": border_unit(dimension), "definition": definition})
        for name, values in values_by_source
        for key, (dimension, definition) in values.items()
    )


def _spec_keys() -> Records:
    """Return the keys of all specifications by path and by last name; equal ones of several families once."""
    from cfmkit.specs.keys_and_schema import keys

    every = families.records()
    families_by_key: dict[Key, list[str]] = {}
    for record in every:
        for key in keys(record.spec_type):
            families_by_key.setdefault(key, []).append(record.name)

    def yield_names() -> Iterator[tuple[str, dict[str, Any]]]:
        for key, of in families_by_key.items():
            reported = {"family": "every" if len(of) == len(every) else ", ".join(of)} | asdict(key)
            for name in {key.path, key.path.rpartition(".")[2].removesuffix("[]")}:
                yield name, reported

    return _gather_records(yield_names())


def _findings() -> Records:
    """Return what a run of a family, of a recording or of a study may warn of."""
    from cfmkit.experiment import calibration, correction, findings
    from cfmkit.studies.findings import STUDY_FINDINGS

    findings_by_source = [(record.name, record.outputs.findings) for record in families.records()]
    findings_by_source += [("recordings", findings.RECORDING_FINDINGS), ("calibrate", calibration.CALIBRATION_FINDINGS)]
    findings_by_source += [("correct", correction.CORRECTION_FINDINGS), *STUDY_FINDINGS.items()]
    return _gather_records(
        (key, {"name": key, "family": name, "meaning": meaning})
        for name, meanings in findings_by_source
        for key, meaning in meanings.items()
    )


def _units() -> Records:
    from cfmkit.specs.units import unit_table

    keys = ("symbol", "name", "dimension", "si", "input_only")
    entries = [dict(zip(keys, entry, strict=True)) for entry in unit_table()]
    return _gather_records((str(unit[key]), unit) for unit in entries for key in ("symbol", "name"))


def _dimensions() -> Records:
    from cfmkit.specs.units import DIMENSIONS_BY_NAME

    return _gather_records(
        (
            dimension.name,
            {
                "name": dimension.name,
                "unit": dimension.unit,
                "meaning": dimension.description,
                "example": dimension.example,
            },
        )
        for dimension in DIMENSIONS_BY_NAME.values()
        if dimension.unit
    )


def _references() -> Records:
    entries = references()
    return _gather_records(
        (name, reference)
        for reference in entries
        for name in {reference["name"], re.sub(r"-[0-9]{4}$", "", reference["name"])}
    )


_METRIC_FIELDS = (field("name"), field("family"), field("unit"), field("definition", wraps=True))
TOPIC_KINDS: Mapping[str, tuple[Callable[[], Records], tuple[Field, ...]]] = {
    "terms": (list_terms, (field("name", "word"), field("meaning", wraps=True))),
    "materials": (
        _materials,
        (field("name", "material"), Field("properties", properties, wraps=True), field("source", wraps=True)),
    ),
    "metrics": (_metrics, (field("name"), field("unit"), field("definition", wraps=True))),
    "values": (_values, _METRIC_FIELDS),
    "keys": (_spec_keys, ()),
    "findings": (_findings, (field("name"), field("family"), field("meaning", wraps=True))),
    "units": (
        _units,
        (
            field("symbol", "unit"),
            field("name"),
            Field("measures", lambda unit: str(unit["dimension"]).replace("_", " ")),
            Field("in SI", lambda unit: f"{unit['si']:.12g}"),
        ),
    ),
    "dimensions": (
        _dimensions,
        (field("name"), field("unit", "written in"), field("example"), field("meaning", wraps=True)),
    ),
    "references": (_references, (field("name"), field("family"), field("reference", wraps=True))),
}
"""What is known by name: a heading, the records, and what is shown of each."""

KEY_FIELDS = (
    field("path", "key"),
    Field("value", _kind, wraps=True),
    Field("default", _default),
    Field("meaning", lambda key: "; ".join(filter(None, (key["description"], key["allowed"]))), wraps=True),
)
SPEC_KEY_FIELDS = (field("path", "key"), field("family", wraps=True), *KEY_FIELDS[1:])
SYMBOL_FIELDS = (field("name", "symbol"), field("family"), field("key", wraps=True), field("meaning", wraps=True))
METRIC_FIELDS = (field("name", "metric"), field("unit"), field("definition", wraps=True))

TOPIC_HEADINGS: Mapping[str, tuple[str, Callable[[], Document]]] = {
    "units": ("the units that a spec may use, and those that files are written in", units_page),
    "metrics": ("the constant-force metrics: name, unit, definition", metrics_page),
    "materials": ("the named materials, with scatter and source", lambda: _page(*materials_page_parts())),
    "stock": ("sizes of sheets, wire, pins, bearings and screws that are sold", lambda: _page(*stock_page_parts())),
    "references": ("the papers behind the families", references_page),
}
