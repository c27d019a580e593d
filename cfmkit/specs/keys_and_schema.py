"""Keys of a specification, read off its models: the JSON schema for editors, and a list with bounds and defaults.

Defaults and bounds are as they are written in YAML: text with units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from cfmkit.specs.units.fields import UnitField
from cfmkit.specs.units.quantities import format_quantity
from cfmkit.specs.units.table import UNITLESS_DIMENSIONS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from pydantic import BaseModel

    from cfmkit.specs.spec import Spec

SCHEMA_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_NO_VALUE = object()
_BOUND_NAMES = ("gt", "ge", "lt", "le")
_KIND_WORDS = {
    "string": "text",
    "integer": "whole number",
    "number": "number",
    "boolean": "true or false",
    "object": "block",
}


@dataclass(frozen=True)
class Key:
    """One key."""

    path: str  # dotted; ``[]`` stands for the items of a list, ``.NAME`` for those of a block whose names are free
    kind: str  # what is written there: ``length``, ``text``, ``block``, or the words of a closed choice
    example: str  # of a quantity, with its unit; else empty
    allowed: str  # bounds, with units; empty where there are none
    default: str  # as it would be written; empty where there is none
    required: bool  # whether the block needs it
    description: str  # what it means


def schema(
    # families by name, each with the model of its specifications; their order is kept
    models: Mapping[str, type[Spec]],
) -> dict[str, Any]:
    """Return the JSON schema of one family's specifications, or of any one of several."""
    schemas = {name: json_schema(model) for name, model in models.items()}
    if len(schemas) == 1:
        return {"$schema": SCHEMA_DIALECT} | next(iter(schemas.values()))
    shared = {
        f"{name}.{key}": _rename_references(block, name)
        for name, schema in schemas.items()
        for key, block in _block_schemas(schema)
    }
    choices = [
        {key: value for key, value in _rename_references(schema, name).items() if key != "$defs"}
        for name, schema in schemas.items()
    ]
    return {"$schema": SCHEMA_DIALECT, "title": "cfmkit specification", "oneOf": choices, "$defs": shared}


def json_schema(spec_type: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON schema of a specification, with defaults and bounds as text with units."""
    schema: dict[str, Any] = _with_units(spec_type.model_json_schema())
    return schema


def _with_units(node: Any) -> Any:
    """Return a schema whose SI defaults and bounds are text."""
    if isinstance(node, list):
        return [_with_units(item) for item in node]
    if not isinstance(node, dict):
        return node
    result = {key: _with_units(item) for key, item in node.items()}
    if "default" in node:
        result["default"] = _default_as_written(node, node["default"])
    if isinstance(name := node.get("x-dimension"), str):
        _bounds_as_text(result, name)
    return result


def _default_as_written(node: dict[str, Any], value: Any) -> Any:
    """Return a default as it would be written where `node` describes the value."""
    if isinstance(value, list):
        inner: dict[str, Any] = node.get("items") or next(iter(node.get("prefixItems", ())), {})
        return [_default_as_written(inner, item) for item in value]
    choices = (node, *node.get("anyOf", ()))
    dimension = next((choice["x-dimension"] for choice in choices if "x-dimension" in choice), None)
    if (
        not isinstance(value, int | float)
        or isinstance(value, bool)
        or dimension is None
        or dimension in UNITLESS_DIMENSIONS
    ):
        return value
    return format_quantity(value, dimension.split(" ")[0])


def _bounds_as_text(node: dict[str, Any], dimension: str) -> None:
    bounds = {name: node.pop(name) for name in _BOUND_NAMES if name in node}
    if bounds:
        node["x-allowed"] = UnitField((dimension.split(" ")[0],)).limits(bounds)


def keys(model: type[Spec]) -> tuple[Key, ...]:
    """Return every key that a specification of a family may have, in the order of its model."""
    whole = json_schema(model)
    return tuple(_keys_below(whole, dict(_block_schemas(whole)), ""))


def _block_schemas(whole: dict[str, Any]) -> Iterable[tuple[str, Any]]:
    blocks: dict[str, Any] = whole.get("$defs", {})
    return blocks.items()


def _rename_references(node: Any, prefix: str) -> Any:
    """Return a schema whose references point to definitions with a prefix."""
    if isinstance(node, list):
        return [_rename_references(item, prefix) for item in node]
    if not isinstance(node, dict):
        return node
    start = "#/$defs/"
    result = {key: _rename_references(value, prefix) for key, value in node.items()}
    if isinstance(target := node.get("$ref"), str) and target.startswith(start):
        result["$ref"] = f"{start}{prefix}.{target.removeprefix(start)}"
    return result


def _keys_below(block: dict[str, Any], blocks: dict[str, Any], path: str) -> Iterator[Key]:
    required = block.get("required", ())
    for name, node in block.get("properties", {}).items():
        key_path = f"{path}.{name}" if path else name
        key = _make_key(key_path, node, blocks, name in required)
        if path and "const" in node and not key.description:
            # the one word that makes a block the kind it is means what the block means
            key = replace(key, description=block.get("description", ""))
        yield key
        for inner, marker in _inner_blocks(node, blocks):
            yield from _keys_below(inner, blocks, key_path + marker)


def _inner_blocks(node: dict[str, Any], blocks: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield the blocks that may stand at a node, with ``[]`` if they stand in a list."""
    for member in _member_schemas(node, blocks):
        if "properties" in member:
            yield member, ""
        elif "items" in member:
            yield from ((item, "[]") for item in _member_schemas(member["items"], blocks) if "properties" in item)
        elif isinstance(named := member.get("additionalProperties"), dict):
            yield from ((item, ".NAME") for item in _member_schemas(named, blocks) if "properties" in item)


def _member_schemas(node: dict[str, Any], blocks: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what a node may be, references followed, nothing (null) left out."""
    if "$ref" in node:
        return [blocks[node["$ref"].rpartition("/")[2]]]
    choices = node.get("anyOf") or node.get("oneOf") or node.get("allOf")
    if choices:
        return [member for choice in choices for member in _member_schemas(choice, blocks)]
    return [] if node.get("type") == "null" else [node]


def _make_key(path: str, node: dict[str, Any], blocks: dict[str, Any], required: bool) -> Key:
    members = _member_schemas(node, blocks)
    quantities = [member for member in members if "x-dimension" in member]
    default = node.get("default", _NO_VALUE)
    return Key(
        path,
        " or ".join(dict.fromkeys(_kind_in_words(member, blocks) for member in members)),
        next((quantity["examples"][0] for quantity in quantities if quantity.get("examples")), ""),
        "; ".join(dict.fromkeys(filter(None, map(_describe_allowed, members)))),
        _default_text(default) if default not in (_NO_VALUE, None, "", []) else "",
        required,
        node.get("description") or next((member["description"] for member in members if "description" in member), ""),
    )


def _kind_in_words(node: dict[str, Any], blocks: dict[str, Any]) -> str:
    if "x-dimension" in node:
        return str(node["x-dimension"]).replace("_", " ")
    if "enum" in node or "const" in node:
        return " | ".join(map(str, node.get("enum") or [node["const"]]))
    if "properties" in node:
        return "block"
    if node.get("type") == "array":
        return f"list of {_items_in_words(node, blocks)}"
    kind = node.get("type", "value")
    return "number or text" if isinstance(kind, list) else _KIND_WORDS.get(kind, "value")


def _items_in_words(node: dict[str, Any], blocks: dict[str, Any]) -> str:
    inner = node.get("prefixItems") or [node.get("items", {})]
    kinds = dict.fromkeys(_kind_in_words(member, blocks) for item in inner for member in _member_schemas(item, blocks))
    count = f"{len(inner)} x " if "prefixItems" in node else ""
    return count + " or ".join(kinds)


def _describe_allowed(node: dict[str, Any]) -> str:
    if "x-allowed" in node:
        return str(node["x-allowed"])
    if node.get("type") == "array":
        return _describe_allowed(node.get("items", {}))
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    return " and ".join(f"{sign} {node[word]:g}" for word, sign in signs.items() if word in node)


def _default_text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(map(_default_text, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)
