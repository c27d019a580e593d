"""``--set mechanism.springs.0=2 N/mm``: one value of a specification from the command line.

The value is read exactly as in a file; lists and blocks in flow style only. A key that has dots itself stands in
quotes: ``--set 'sensitivity.parameters."mechanism.roller_radius"={normal: 0.1 mm}'``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from cfmkit.errors import UsageError
from cfmkit.specs.units.number_text import shown
from cfmkit.specs.yamlio.paths import dotted
from cfmkit.specs.yamlio.source_text import Fault
from cfmkit.specs.yamlio.tree_builder import DEEPEST, read


@dataclass(frozen=True)
class Option:
    """One parsed option: where the value goes, the value, and what was wrong with its text."""

    path: tuple[str, ...]
    value: Any
    faults: tuple[Fault, ...] = ()

    @property
    def label(self) -> str:
        """How messages name it: ``--set a.b``."""
        return "--set " + dotted(self.path)


_PART = r"""(?:\s*"[^"]+"\s*|\s*'[^']+'\s*|[^."'=]+)"""
_OPTION = re.compile(rf"({_PART}(?:\.{_PART})*)=(.*)", re.DOTALL)


SHORT_FOR = {"material": "name"}
"""Keys whose bare text is short for a block with that one key: ``material: pla`` is ``material: {name: pla}``."""


class NoSuchPlace(Exception):
    """There is no place in the tree where the value could go."""


def parse_option(text: str) -> Option:
    """Return the option that ``a.b=value`` means.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is no ``=``, no path or no value.
    """
    found = _OPTION.fullmatch(text)
    path, equals, value = (found[1], "=", found[2]) if found else text.partition("=")
    parts = [part.strip() for part in re.findall(_PART, path)] if found else []
    example = "write e.g. --set mechanism.springs.count=2"
    if not equals or not value.strip():
        raise UsageError(f"--set {shown(text)}: no value; {example}")
    if not all(parts) or not 0 < len(parts) <= DEEPEST:
        raise UsageError(f"--set {shown(text)}: {shown(path)} is not a dotted path; {example}")
    return _read_value(tuple(_unquoted(part) for part in parts), value.strip())


def _unquoted(part: str) -> str:
    return part[1:-1] if part[0] in "\"'" else part


def _read_value(path: tuple[str, ...], text: str) -> Option:
    reading = read(text)
    faults = tuple(reading.faults)
    if not faults and not reading.broken and isinstance(reading.tree, dict | tuple) and text[0] not in "[{":
        what = (
            "a block; write {key: value}, or quote text" if isinstance(reading.tree, dict) else "a list; write [a, b]"
        )
        faults = (Fault(0, 0, (), f"{shown(text)} would be {what}"),)
    return Option(path, reading.tree, faults)


def with_value(tree: Any, path: tuple[str, ...], value: Any) -> Any:
    """Return a copy of the tree with a value at a path; missing blocks are made.

    Raises
    ------
    NoSuchPlace
        If the path leads through a value, or out of a list.
    """
    head, rest = path[0], path[1:]
    if isinstance(tree, tuple):
        index = _index(head, tree)
        new = with_value(tree[index], rest, value) if rest else value
        return (*tree[:index], new, *tree[index + 1 :])
    if tree is not None and not isinstance(tree, dict):
        raise NoSuchPlace(f"{head!r} is below a value; only blocks and lists have something below them")
    block = dict(tree or {})
    below = block.get(head)
    if rest and head in SHORT_FOR and isinstance(below, str):
        below = {SHORT_FOR[head]: below}
    block[head] = with_value(below, rest, value) if rest else value
    return block


def _index(text: str, items: tuple[Any, ...]) -> int:
    if not re.fullmatch("[0-9]{1,9}", text) or int(text) >= len(items):
        count = f"0 to {len(items) - 1}" if items else "none: the list is empty"
        raise NoSuchPlace(f"{shown(text)} is not an index of this list; there are {count}")
    return int(text)
