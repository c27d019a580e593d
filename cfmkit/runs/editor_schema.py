"""The JSON schema of specifications with the names of metrics, and the line by which an editor finds it.

`cfmkit.specs` knows keys and units; which metrics there are, and of which branches, only the families say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.metrics import known_metrics, values_of_family
from cfmkit.specs.keys_and_schema import schema as plain_schema
from cfmkit.specs.yamlio.base_file import BASE_KEY
from cfmkit.store import atomic_write
from cfmkit.tables.csv_and_json import json_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from cfmkit.families.base import Family

SCHEMA_LINE_START = "# yaml-language-server: $schema="
"""How the line begins by which the YAML language server, and so most editors, finds a schema."""


def schema(
    records: Iterable[Family],  # one: its specifications alone; several: any of theirs
) -> dict[str, Any]:
    """Return the schema of the specifications of some families; metrics are a closed list of names."""
    families = {record.name: record for record in records}
    schema = plain_schema({name: record.spec_type for name, record in families.items()})
    for choice in schema.get("oneOf", [schema]):
        _allow_base(choice)
    for title, block in schema.get("$defs", {}).items():
        prefix, dot, name = title.rpartition(".")
        names = [*metric_names(families[prefix] if dot else next(iter(families.values())))]
        properties = block.get("properties", {})
        if name in ("Requirement", "PartRequirement") and "metric" in properties:
            properties["metric"] = _close_names(properties["metric"], names)
        elif name in ("Sweep", "Sensitivity") and "items" in properties.get("metrics", {}):
            properties["metrics"] = properties["metrics"] | {
                "items": _close_names(properties["metrics"]["items"], names)
            }
    return schema


def _allow_base(choice: dict[str, Any]) -> None:
    """Let a specification name a base, which may have its other blocks: an editor cannot know what it says."""
    choice["properties"] = choice.get("properties", {}) | {BASE_KEY: BASE_SCHEMA}
    if required := choice.pop("required", None):
        choice["anyOf"] = [{"required": [BASE_KEY]}, {"required": required}]


BASE_SCHEMA = {"type": "string", "description": "another specification, whose values those of this file override"}


def metric_names(record: Family) -> Iterator[str]:
    """Yield what a requirement of a family may name: every metric and value, those of a branch with its name."""
    for item in known_metrics(None, values_of_family(record.outputs.values)):
        yield item.name
        if item.scope == "branch" and len(record.outputs.branches) > 1:
            yield from (f"{item.name}[{branch}]" for branch in record.outputs.branches)


def _close_names(node: dict[str, Any], names: list[str]) -> dict[str, Any]:
    """Return the schema of a metric's name: one of the known names, or one with brackets."""
    kept = {key: value for key, value in node.items() if key != "type"}
    return kept | {"anyOf": [{"enum": names}, {"type": "string", "pattern": r"^[a-z0-9_]+\[.+\]$"}]}


def file_name(record: Family) -> str:
    """Return what the file of a family's schema is called beside a specification.

    Examples
    --------
    >>> from cfmkit.families import family
    >>> file_name(family("cam"))
    'cfmkit-cam.schema.json'
    """
    return f"cfmkit-{record.name}.schema.json"


def with_line(text: str, record: Family) -> str:
    """Return a specification that tells editors where its schema is."""
    if text.startswith(SCHEMA_LINE_START):
        return text
    return f"{SCHEMA_LINE_START}{file_name(record)}\n{text}"


def content(record: Family) -> bytes:
    """Return the file of a family's schema."""
    return json_bytes(schema([record]))


def write_schema(spec: Path, record: Family) -> Path:
    """Write the schema of a family beside a specification; one of another version holds nothing of the user's."""
    target = spec.with_name(file_name(record))
    atomic_write(target, content(record))
    return target
