"""The source of the package as trees, read once for all tests of a file.

They are millions of objects, which every collection of garbage would walk: `conftest.py` forgets them after the file.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

PACKAGE = Path(__file__).parents[2] / "cfmkit"


@cache
def parsed(path: Path) -> ast.Module:
    """Return the tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of the tree of a file."""
    return tuple(ast.walk(parsed(path)))


def statements(tree: ast.AST) -> Iterator[ast.stmt]:
    """Yield the statements of a tree, those in blocks too; expressions, most of a tree, are not walked."""
    for block in ("body", "orelse", "finalbody", "handlers", "cases"):
        for node in getattr(tree, block, ()):
            if isinstance(node, ast.stmt):
                yield node
            yield from statements(node)


def calls_of(names: tuple[str, ...], folder: Path = PACKAGE) -> Iterator[tuple[Path, ast.Call]]:
    """Yield file and call for all calls of functions by their bare names."""
    for path in sorted(folder.rglob("*.py")):
        if any(f"{name}(" in path.read_text(encoding="utf-8") for name in names):
            for node in nodes(path):
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names:
                    yield path, node


def forget() -> None:
    """Forget all trees."""
    parsed.cache_clear()
    nodes.cache_clear()
