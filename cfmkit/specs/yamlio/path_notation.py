"""Paths into a specification: keys and indices, written ``requirements.0.max``."""

from __future__ import annotations

import re
from typing import Any

from cfmkit.specs.units.strict_decimal_number import quote

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
