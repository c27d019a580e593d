"""Numeric leaves of a specification, by their dotted paths."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

ASSUMED_LAW = re.compile(r".*\.(fatigue|relaxation)(?=\.)")
"""Path of a block that a named material has without a word in the file."""


def _contains(data: Any, parts: list[str]) -> bool:
    """Return True if a block is stated at a path."""
    for part in parts:
        if isinstance(data, tuple | list) and part.isdigit() and int(part) < len(data):
            data = data[int(part)]
        elif isinstance(data, Mapping) and part in data:
            data = data[part]
        else:
            return False
    return True


def stated_leaves(everything: Mapping[str, Any], stated: Mapping[str, Any]) -> Iterator[tuple[str, float | int]]:
    """Yield every numeric leaf as (dotted path, value), but for those of laws that a material has by its name alone."""
    for path, value in _leaves(everything, ""):
        law = ASSUMED_LAW.match(path)
        if law is None or _contains(stated, law[0].split(".")):
            yield path, value


def _leaves(value: Any, path: str) -> Iterator[tuple[str, float | int]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _leaves(item, f"{path}.{key}" if path else key)
    elif isinstance(value, tuple | list):
        for index, item in enumerate(value):
            yield from _leaves(item, f"{path}.{index}")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, value
