"""The JSON schema of a specification, for editors: as it is written in YAML, with units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.specs.units.fields import UnitField
from cfmkit.specs.units.quantities import format_quantity
from cfmkit.specs.units.table import UNITLESS

if TYPE_CHECKING:
    from pydantic import BaseModel

_BOUNDS = ("gt", "ge", "lt", "le")


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
        result["default"] = _default(node, node["default"])
    if isinstance(name := node.get("x-dimension"), str):
        _bounds_as_text(result, name)
    return result


def _default(node: dict[str, Any], value: Any) -> Any:
    """Return a default as it would be written where `node` describes the value."""
    if isinstance(value, list):
        inner: dict[str, Any] = node.get("items") or next(iter(node.get("prefixItems", ())), {})
        return [_default(inner, item) for item in value]
    choices = (node, *node.get("anyOf", ()))
    dimension = next((one["x-dimension"] for one in choices if "x-dimension" in one), None)
    if not isinstance(value, int | float) or isinstance(value, bool) or dimension is None or dimension in UNITLESS:
        return value
    return format_quantity(value, dimension.split(" ")[0])


def _bounds_as_text(node: dict[str, Any], dimension: str) -> None:
    bounds = {name: node.pop(name) for name in _BOUNDS if name in node}
    if bounds:
        node["x-allowed"] = UnitField((dimension.split(" ")[0],)).limits(bounds)
