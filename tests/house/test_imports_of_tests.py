"""Tests import the inside of no package but their own: what others need of a package, its `__init__` offers."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from sources import PACKAGE, parsed

pytestmark = pytest.mark.lists

TESTS = Path(__file__).parents[1]
FAMILIES = ("beam", "cam", "slider_crank", "vcfm")
OPEN_FOLDERS = {
    "browser",
    "cam",
    "cli",
    "contract",
    "documents",
    "experiment",
    "export",
    "house",
    "metrics",
    "plots",
    "regression",
    "runs",
    "slider_crank",
    "specs",
    "stock",
    "store",
    "studies",
}
"""Folders that still import the inside of other packages."""


def package_of(module: str) -> str:
    """Return the package at the top that a module is of; each family is one."""
    parts = module.split(".")
    return ".".join(parts[: 3 if parts[1:2] == ["families"] and parts[2:3] and parts[2] in FAMILIES else 2])


def owned_package(folder: str) -> str:
    """Return the package whose inside a folder of tests may import."""
    return f"cfmkit.families.{folder}" if folder in FAMILIES else f"cfmkit.{folder}"


def is_inner(name: str) -> bool:
    """Return True if a dotted name is a module that lies in a folder of `cfmkit`, and no package."""
    path = PACKAGE.parent.joinpath(*name.split("."))
    return len(path.relative_to(PACKAGE.parent).parts) > 2 and path.with_suffix(".py").exists()


def inner_modules(path: Path) -> list[str]:
    """Return the modules below the `__init__` of a package that a file imports, as written in each import."""
    imported: list[str] = []
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            imported += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            imported += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return [name for name in imported if name.startswith("cfmkit.") and is_inner(name)]


def test_tests_import_the_inside_of_their_own_package_alone():
    foreign: dict[str, list[str]] = {}
    for path in sorted(TESTS.rglob("*.py")):
        folder = path.relative_to(TESTS).parts[0]
        names = [name for name in inner_modules(path) if package_of(name) != owned_package(folder)]
        foreign.setdefault(folder, []).extend(f"{path.name}: {name}" for name in names)
    assert {folder: names for folder, names in foreign.items() if names and folder not in OPEN_FOLDERS} == {}


def test_helpers_of_a_package_serve_its_own_tests_alone():
    """What lies in `tests/PACKAGE/support` may import the inside of that package: others would, by way of it."""
    homes = {path.stem: path.parents[1].name for path in TESTS.glob("*/support/*.py")}
    borrowed = []
    for path in TESTS.rglob("*.py"):
        folder = path.relative_to(TESTS).parts[0]
        modules = [node.module for node in ast.walk(parsed(path)) if isinstance(node, ast.ImportFrom)]
        borrowed += [f"{path.name}: {name}" for name in modules if homes.get(name or "", folder) != folder]
    assert borrowed == []
