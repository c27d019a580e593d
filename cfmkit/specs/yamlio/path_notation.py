"""Paths into a specification: keys and indices, written ``requirements.0.max``, and values that are set there."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from cfmkit.specs.block import Model, keys_of
from cfmkit.specs.units.fields import DimensionedFloat
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.specs.units.windows import TravelShare

Path = tuple[str | int, ...]


def parse_indices(path: tuple[str, ...], tree: Any) -> Path:
    """Return a path with list indices as numbers, as far as the tree has lists there."""
    result: list[str | int] = []
    for part in path:
        inside = isinstance(tree, tuple) and part.isdecimal() and int(part) < len(tree)
        key: str | int = int(part) if inside else part
        tree = tree[key] if inside else tree.get(part) if isinstance(tree, dict) else None
        result.append(key)
    return tuple(result)


def to_dotted(path: Path) -> str:
    """Return a path as ``requirements.0.max``; odd keys are quoted."""
    return ".".join(
        part if isinstance(part, str) and re.fullmatch(r"[\w-]{1,60}", part) else _quote_key(part) for part in path
    )


def _quote_key(part: str | int) -> str:
    return str(part) if isinstance(part, int) else quote(part)


SHORT_FOR = {"material": "name"}
"""Keys whose bare text is short for a block with that one key: ``material: pla`` is ``material: {name: pla}``."""


class NoSuchPlace(KeyError):
    """There is no place in a specification where a value could go."""

    def __str__(self) -> str:
        """Return the sentence without quotes."""
        return str(self.args[0])


def with_value(tree: Any, path: Sequence[str], value: Any) -> Any:
    """Return a copy of a specification, read or not, with a value at a path; missing blocks are made.

    Raises NoSuchPlace if the path leads through a value, or out of a list.
    """
    head, rest = path[0], path[1:]
    if isinstance(tree, tuple | list):
        index = _parse_index(head, tree)
        new = with_value(tree[index], rest, value) if rest else _keep_dimension(tree[index], value)
        return (*tree[:index], new, *tree[index + 1 :])
    if isinstance(tree, Model):
        tree = keys_of(tree)
    if tree is not None and not isinstance(tree, Mapping):
        raise NoSuchPlace(f"{head!r} is below a value; only blocks and lists have something below them")
    block = dict(tree or {})
    below = block.get(head)
    if rest and head in SHORT_FOR and isinstance(below, str):
        below = {SHORT_FOR[head]: below}
    block[head] = with_value(below, rest, value) if rest else _keep_dimension(below, value)
    return block


def _keep_dimension(before: Any, value: Any) -> Any:
    """Return a value; a number in SI that replaces an angle, say, is an angle, too. Of a share it cannot be known."""
    if isinstance(before, DimensionedFloat) and not isinstance(before, TravelShare) and type(value) is float:
        return type(before)(value, before.dimension)
    return value


def _parse_index(text: str, items: Sequence[Any]) -> int:
    if not re.fullmatch("[0-9]{1,9}", text) or int(text) >= len(items):
        count = f"0 to {len(items) - 1}" if items else "none: the list is empty"
        raise NoSuchPlace(f"{quote(text)} is not an index of this list; there are {count}")
    return int(text)
