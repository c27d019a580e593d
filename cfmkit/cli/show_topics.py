"""Subjects of `cfmkit show`: pages on topics and families, and records of everything that has a name, found by it.

A page is the answer of the command: records for ``--json``, and the same as tables for people.
"""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, NamedTuple

from cfmkit import families
from cfmkit.cli.guide import read_terms
from cfmkit.cli.show_materials import materials_page_parts, properties
from cfmkit.documents.document import (
    Document,
    Field,
    Span,
    TextLine,
    Tone,
    Verbatim,
    field,
    line,
    name_in_words,
    record_table,
)
from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from cfmkit.curves import Kind
    from cfmkit.documents.document import Block
    from cfmkit.specs.keys_and_schema import Key

    Record = Mapping[str, Any]
    Section = tuple[str, Sequence[Record], tuple[Field, ...]]
    """Heading, records and what is shown of each."""


def explain(name: str | None) -> Document:
    """Return what there is to say of a topic, a family, or whatever else has that name; without a name what there is.

    Raises UsageError if there is none; the message names the nearest.
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
    topic_names = names()
    parts = (part for name in topic_names for part in name.split("_"))  # which lead to all names that have them
    hint = did_you_mean(name, [*topics, *topic_names, *parts]) or every
    raise UsageError(f"there is nothing to show about {name!r}; {hint}")


def list_skipped_families(name: str | None) -> tuple[str, ...]:
    """Return the families of other packages that are missing from a page on all families; none for other pages."""
    whole = name not in {*families.names(), "units", "metrics", "materials", "stock"}
    return families.list_skipped() if whole else ()


def _make_page(title: str, text: str, sections: Iterable[Section], data: Mapping[str, Sequence[Record]]) -> Document:
    def blocks() -> Iterator[Block]:
        yield TextLine((Span(title, Tone.LABEL), Span(f"  {text}")))
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
    return _make_page("cfmkit show", text, sections, {"families": mechanisms, "topics": topics})


def units_page() -> Document:
    """Return the closed list of units, and the dimensions with the unit that files are written in."""
    text = "Case-sensitive; combine with *, / and ^: N*mm/rad, kg/m^3. Zero needs no unit."
    data = {kind: TOPIC_KINDS[kind].records() for kind in ("units", "dimensions")}
    return _make_page("units", text, [(kind, data[kind], TOPIC_KINDS[kind].fields) for kind in data], data)


def metrics_page() -> Document:
    """Return the metrics that every family has."""
    text = (
        "Evaluated over the requirement's `over`, else analysis.window, else the full travel. Without a branch in "
        "brackets the worst branch counts; force_mean[load] selects one. For torques force_... is called torque_..., "
        "in N*mm over deg. `cfmkit show FAMILY` lists what a family adds."
    )
    records = _metric_records("force")
    return _make_page("metrics", text, (("", records, METRIC_FIELDS),), {"metrics": records})


def references_page() -> Document:
    """Return the papers behind all families, and their BibTeX."""
    records = references()
    shown = _make_page("references", "", (("", records, TOPIC_KINDS["references"].fields),), {})
    bibtex = {record.name: text for record in families.records() if (text := record.bibtex)}
    page = (*shown.body, *(block for text in bibtex.values() for block in (line(""), Verbatim(text.strip() + "\n"))))
    return Document({"references": records, "bibtex": bibtex}, page)


def stock_page() -> Document:
    """Return the sizes in which sheets, wire, pins, bearings and screws are sold."""
    from cfmkit.stock.stock_series import ALL_SERIES

    records = [asdict(entry) for entry in ALL_SERIES]
    columns = (
        Field("stock", lambda entry: " ".join((entry["kind"], *entry["materials"])), wraps=True),
        field("system"),
        field("standard", wraps=True),
        Field("sizes [mm]", lambda entry: ", ".join(f"{1e3 * size:.6g}" for size in entry["sizes"]), wraps=True),
        field("read", "read in", wraps=True),
    )
    text = (
        "Sizes for `part.stock: metric` and `inch`, as far as a text with them was read: sheets by material, bearings "
        "by their bore. Materials that are missing have no series here, and their sheets are not rounded."
    )
    return _make_page("stock", text, (("", records, columns),), {"stock": records})


def family_page(name: str) -> Document:
    """Return what a spec of a family may say, what a run can report, and where it comes from."""
    from cfmkit.runs.shipped_files import DRAWING_FILE
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
    return _make_page(name, f"{record.summary}. {commands}" if commands else record.summary, sections, data)


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
    for parent in sorted(blocks, key=_position_of_block):
        name = parent.removesuffix("[]").removesuffix(".NAME")
        sections.append((f"{parent.removesuffix('[]')}: {about.get(name, '')}", blocks[parent]))
    return [(heading, rows, KEY_FIELDS) for heading, rows in sections]


def _position_of_block(block: str) -> int:
    """Return the place of a block in the order in which a file is written."""
    return READ_FIRST.get(block.partition(".")[0].removesuffix("[]"), len(READ_FIRST))


def _kind_with_unit(key: Record) -> str:
    unit = key["example"].partition(" ")[2]
    return f"{key['kind']} [{unit}]" if unit and unit != "%" else str(key["kind"])


def _default_or_required(key: Record) -> str:
    return "required" if key["required"] else str(key["default"])


def find_page(name: str) -> Document | None:
    """Return the page on everything that has a name; None if nothing has."""
    sections: list[Section] = []
    for heading, kind in TOPIC_KINDS.items():
        wanted = _keys_for_lookup(heading, name)
        if named := [record for record in kind.records() if not wanted.isdisjoint(kind.names(record))]:
            sections.append((heading, named, kind.fields))
    if not sections and (drawn := _symbol_records(name)):
        sections.append(("symbols", drawn, SYMBOL_FIELDS))
    if not sections:
        return None
    data = {heading: records for heading, records, _ in sections}
    page = _make_page(name, "", sections, data)
    papers = {paper.name: paper.bibtex for record in families.records() for paper in record.papers}
    bibtex = [papers[entry["name"]] for entry in data.get("references", ())]
    more = (block for text in bibtex for block in (line(""), Verbatim(text + "\n")))
    return Document({**data, **({"bibtex": bibtex} if bibtex else {})}, (*page.body, *more))


def _symbol_records(name: str) -> list[Record]:
    """Return what a symbol such as ``theta2`` is in the drawings of the families."""
    from cfmkit.runs.shipped_files import DRAWING_FILE, read_dimensions

    return [
        {"name": row["symbol"], "family": record.name, "key": row["key"], "meaning": row["meaning"]}
        for record in families.records()
        if record.file(DRAWING_FILE)
        for row in read_dimensions(record)
        if name in re.split(r", | \.\.\. ", row["symbol"])
    ]


def names() -> list[str]:
    """Return every name that `find_page` knows, but for the paths of keys and symbols."""
    topic_names = (name for kind in TOPIC_KINDS.values() for record in kind.records() for name in kind.names(record))
    return [name for name in dict.fromkeys(topic_names) if "." not in name]


def references() -> list[dict[str, str]]:
    """Return the papers behind all families: name, family and the reference in full."""
    return [
        {"name": paper.name, "family": record.name, "reference": paper.reference}
        for record in families.records()
        for paper in record.papers
    ]


def _keys_for_lookup(heading: str, name: str) -> set[str]:
    """Return a name as its kind is listed: a metric without its branch, a dimension also by any unit of it."""
    if heading == "metrics":
        return {name.partition("[")[0]}
    return {name.replace(" ", "_"), *_measured_in(name)} if heading == "dimensions" else {name}


def _measured_in(unit: str) -> list[str]:
    """Return the dimensions that a unit such as ``N/mm`` measures; none if it is not a unit."""
    from cfmkit.specs.units import DIMENSIONS_BY_NAME
    from cfmkit.specs.units.table import border_size, is_unit, unit_size

    if not is_unit(unit):
        return []
    powers = unit_size(unit).powers
    return [
        dimension.name
        for dimension in DIMENSIONS_BY_NAME.values()
        if dimension.unit and border_size(dimension.name).powers == powers
    ]


def _term_records() -> list[Record]:
    return [{"name": name, "meaning": meaning} for name, meaning in read_terms().items()]


def _material_records() -> list[Record]:
    from cfmkit.stock import MATERIALS_BY_NAME

    return [asdict(entry) for entry in dict.fromkeys(MATERIALS_BY_NAME.values())]


def _metric_records(effort: Kind | None = None) -> list[Record]:
    """Return the metrics of curves of an effort, or of any, and those of many parts."""
    from cfmkit.metrics import definitions
    from cfmkit.specs.further_metrics import OF_MANY_PARTS
    from cfmkit.specs.units import border_unit

    of_parts = [(name, "ratio", about, False) for name, about in OF_MANY_PARTS.items()]
    of_curves = [(item.name, item.dimension, item.definition, item.per_branch) for item in definitions(effort)]
    return [
        {"name": name, "unit": border_unit(dimension), "definition": definition, "per_branch": per_branch}
        for name, dimension, definition, per_branch in (*of_curves, *of_parts)
    ]


def _value_records() -> list[Record]:
    """Return the values of the families, of the causes that they find in a measured loop, and of recordings."""
    from cfmkit.experiment.recorded_values import define_recorded_values
    from cfmkit.specs.units import border_unit

    every = families.records()
    values_by_source = [(record.name, {**record.outputs.values, **record.outputs.causes}) for record in every]
    values_by_source.append(("recordings", define_recorded_values("torque") | define_recorded_values("force")))
    return [
        {"name": key, "family": name, "unit": border_unit(dimension), "definition": definition}
        for name, values in values_by_source
        for key, (dimension, definition) in values.items()
    ]


def _spec_keys() -> list[Record]:
    """Return the keys of all specifications; equal ones of several families once."""
    from cfmkit.specs.keys_and_schema import keys

    every = families.records()
    families_by_key: dict[Key, list[str]] = {}
    for record in every:
        for key in keys(record.spec_type):
            families_by_key.setdefault(key, []).append(record.name)
    return [
        {"family": "every" if len(of) == len(every) else ", ".join(of)} | asdict(key)
        for key, of in families_by_key.items()
    ]


def _finding_records() -> list[Record]:
    """Return what a run of a family, of a recording or of a study may warn of."""
    from cfmkit.experiment import calibration, correction, findings
    from cfmkit.studies.findings import STUDY_FINDINGS

    findings_by_source = [(record.name, record.outputs.findings) for record in families.records()]
    findings_by_source += [("recordings", findings.RECORDING_FINDINGS), ("calibrate", calibration.CALIBRATION_FINDINGS)]
    findings_by_source += [("correct", correction.CORRECTION_FINDINGS), *STUDY_FINDINGS.items()]
    return [
        {"name": key, "family": name, "meaning": meaning}
        for name, meanings in findings_by_source
        for key, meaning in meanings.items()
    ]


def _unit_records() -> list[Record]:
    from cfmkit.specs.units import unit_table

    keys = ("symbol", "name", "dimension", "si", "input_only")
    return [dict(zip(keys, entry, strict=True)) for entry in unit_table()]


def _dimension_records() -> list[Record]:
    from cfmkit.specs.units import DIMENSIONS_BY_NAME

    keys = ("name", "unit", "description", "example")
    return [{key: getattr(item, key) for key in keys} for item in DIMENSIONS_BY_NAME.values() if item.unit]


class TopicKind(NamedTuple):
    """One kind of things that have names."""

    records: Callable[[], Sequence[Record]]
    fields: tuple[Field, ...]  # what is shown of each
    names: Callable[[Record], Collection[str]] = lambda record: (record["name"],)  # under which it is found


KEY_FIELDS = (
    field("path", "key"),
    Field("value", _kind_with_unit, wraps=True),
    Field("default", _default_or_required),
    Field("meaning", lambda key: "; ".join(filter(None, (key["description"], key["allowed"]))), wraps=True),
)
SYMBOL_FIELDS = (field("name", "symbol"), field("family"), field("key", wraps=True), field("meaning", wraps=True))
METRIC_FIELDS = (field("name", "metric"), field("unit"), field("definition", wraps=True))
TOPIC_KINDS: Mapping[str, TopicKind] = {
    "terms": TopicKind(_term_records, (field("name", "word"), field("meaning", wraps=True))),
    "materials": TopicKind(
        _material_records,
        (field("name", "material"), Field("properties", properties, wraps=True), field("source", wraps=True)),
        lambda record: (record["name"], *record["aliases"]),
    ),
    "metrics": TopicKind(_metric_records, METRIC_FIELDS),
    "values": TopicKind(
        _value_records, (field("name"), field("family"), field("unit"), field("definition", wraps=True))
    ),
    "keys": TopicKind(
        _spec_keys,
        (field("path", "key"), field("family", wraps=True), *KEY_FIELDS[1:]),
        lambda record: {record["path"], record["path"].rpartition(".")[2].removesuffix("[]")},
    ),
    "findings": TopicKind(_finding_records, (field("name"), field("family"), field("meaning", wraps=True))),
    "units": TopicKind(
        _unit_records,
        (
            field("symbol", "unit"),
            field("name"),
            Field("measures", lambda unit: name_in_words(unit["dimension"])),
            Field("in SI", lambda unit: f"{unit['si']:.12g}"),
            Field("", lambda unit: "input only" if unit["input_only"] else ""),
        ),
        lambda record: (record["symbol"], record["name"]),
    ),
    "dimensions": TopicKind(
        _dimension_records,
        (
            Field("dimension", lambda item: name_in_words(item["name"])),
            field("unit", "written in"),
            field("example"),
            field("description", "meaning", wraps=True),
        ),
    ),
    "references": TopicKind(
        references,
        (field("name"), field("family"), field("reference", wraps=True)),
        lambda record: {record["name"], re.sub(r"-[0-9]{4}$", "", record["name"])},
    ),
}
"""Kinds of names that `show` explains, by the heading of each on a page."""
TOPIC_HEADINGS: Mapping[str, tuple[str, Callable[[], Document]]] = {
    "units": ("the units that a spec may use, and those that files are written in", units_page),
    "metrics": ("the constant-force metrics: name, unit, definition", metrics_page),
    "materials": ("the named materials, with scatter and source", lambda: _make_page(*materials_page_parts())),
    "stock": ("sizes of sheets, wire, pins, bearings and screws that are sold", stock_page),
    "references": ("the papers behind the families", references_page),
}
