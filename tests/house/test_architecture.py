"""The direction of imports, who may import what, and the rooms of the families: read off the source."""

from __future__ import annotations

import ast
import re
from dataclasses import fields
from functools import cache
from typing import TYPE_CHECKING

import pytest
from sources import PACKAGE as ROOT
from sources import nodes, parsed, statements

from cfmkit.families import Family

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.lists

LAYERS = (
    ("cli", "__main__"),
    ("api", "runs"),
    ("documents",),
    ("studies", "experiment"),
    ("families",),
    ("designing",),
    ("solid", "plots", "export"),
    ("elastica", "stock"),
    ("metrics",),
    ("results",),
    ("tables", "specs"),
    ("numerics", "store"),
    ("curves",),
    ("arrays", "errors", "lazy_names", "_version"),
)
"""From the top down: a module may import its own layer and those below."""

RANK = {name: len(LAYERS) - rank for rank, layer in enumerate(LAYERS) for name in layer}
SOURCES = sorted(ROOT.rglob("*.py"))


def unit_of(path: Path) -> str:
    """Return the part of the package that a file belongs to."""
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def room_of(path: Path) -> str:
    """Return the folder that a file is in, dotted."""
    return ".".join(path.relative_to(ROOT).parts[:-1])


def type_checking_lines(tree: ast.Module) -> set[int]:
    """Return the lines below ``if TYPE_CHECKING``: they import nothing when the program runs."""
    tests = ((node, node.test) for node in statements(tree) if isinstance(node, ast.If))
    blocks = (node for node, test in tests if isinstance(test, ast.Name) and test.id == "TYPE_CHECKING")
    return {line for block in blocks for line in range(block.lineno, (block.end_lineno or block.lineno) + 1)}


@cache
def imports(path: Path, types: bool = False) -> list[str]:
    """Return the dotted names that a file imports at run time (or also for types only)."""
    tree = parsed(path)
    skipped = set() if types else type_checking_lines(tree)
    found = []
    for node in statements(tree):
        if isinstance(node, ast.Import) and node.lineno not in skipped:
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.lineno not in skipped:
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            found += [f"{node.module}.{alias.name}" for alias in node.names]
    return found


@cache
def top_level_imports(path: Path) -> list[str]:
    """Return what is imported when a file is, not inside a function."""
    body = parsed(path).body
    found = []
    for node in body:
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found.append(node.module or "")
    return found


def targets(path: Path) -> set[str]:
    """Return the parts of the package that a file imports."""
    names = (name.split(".") for name in imports(path))
    return {parts[1] if len(parts) > 1 else "" for parts in names if parts[0] == "cfmkit"}


def test_a_module_imports_its_own_layer_and_those_below():
    placed = [path for path in SOURCES if unit_of(path) != "__init__"]
    assert {unit_of(path) for path in placed} - set(RANK) == set(), "no place among the layers"
    upward = {}
    for path in placed:
        own = unit_of(path)
        above = {target for target in targets(path) - {own, "", "__version__"} if RANK.get(target, 0) > RANK[own]}
        if above:
            upward[str(path.relative_to(ROOT))] = above
    assert upward == {}


def test_the_top_of_the_package_is_short():
    """At most 20 folders and 9 files, so that a reader takes it in at a glance."""
    entries = [entry for entry in ROOT.iterdir() if entry.name != "__pycache__"]
    assert len([entry for entry in entries if entry.is_dir()]) <= 20
    assert len([entry for entry in entries if entry.suffix == ".py"]) <= 9


def test_families_do_not_import_each_other():
    families = sorted(folder for folder in (ROOT / "families").iterdir() if (folder / "__init__.py").exists())
    for folder in families:
        others = {f"cfmkit.families.{other.name}" for other in families if other != folder}
        for path in folder.rglob("*.py"):
            assert not [name for name in imports(path, types=True) for other in others if name.startswith(f"{other}.")]


ALLOWED = {
    "matplotlib": lambda path: unit_of(path) == "plots" or path.name == "figures.py",
    "typer": lambda path: unit_of(path) == "cli",
    "rich": lambda path: unit_of(path) == "cli" or path.parts[-2:] == ("documents", "terminal.py"),
    "pydantic": lambda path: unit_of(path) == "specs" or path.name.endswith("spec.py"),
    "pydantic_core": lambda path: room_of(path) == "specs.units",
    "pint": lambda path: room_of(path) == "specs.units",
    "yaml": lambda path: room_of(path) == "specs.yamlio",
    "ezdxf": lambda path: unit_of(path) == "export",
    "shapely": lambda path: (
        unit_of(path) in ("export", "solid") or path.name in ("strips_and_gaps.py", "report_html.py")
    ),
    "pandas": lambda path: path.name in ("results.py", "sweep_and_sensitivity_api.py"),
}


@pytest.mark.parametrize("library", ALLOWED)
def test_a_library_is_imported_only_where_it_belongs(library):
    users = [path for path in SOURCES if any(name.split(".")[0] == library for name in imports(path))]
    assert [str(path.relative_to(ROOT)) for path in users if not ALLOWED[library](path)] == []


@pytest.mark.parametrize("library", ["scipy", "pint", "ezdxf", "shapely", "pandas"])
def test_a_slow_library_is_imported_inside_the_function_that_needs_it(library):
    """Or at the top of `cfmkit.solid`, which as a whole is imported inside the functions that need it."""
    users = [path for path in SOURCES if unit_of(path) != "solid"]
    eager = [path for path in users if any(name.split(".")[0] == library for name in top_level_imports(path))]
    assert eager == []
    assert [path for path in users if any(name.startswith("cfmkit.solid") for name in top_level_imports(path))] == []


def test_the_command_line_starts_without_numpy_and_pydantic():
    light = [path for path in (ROOT / "cli").rglob("*.py") if path.parent.name == "verbs"]
    light += [
        ROOT / "cli" / f"{name}.py"
        for name in (
            "main",
            "commands",
            "options",
            "failures",
            "output",
        )
    ]
    light += [ROOT / "documents" / f"{name}.py" for name in ("document", "terminal")]
    heavy = (
        "numpy",
        "pydantic",
        "rich",
        "yaml",
        "cfmkit.api",
        "cfmkit.specs.spec",
        "cfmkit.metrics",
        "cfmkit.specs.yamlio",
    )
    for path in light:
        assert not [name for name in top_level_imports(path) if name.startswith(heavy)], path


def test_the_record_of_a_family_is_short():
    assert len(fields(Family)) <= 20


def test_no_one_asks_which_family_it_is():
    for path in SOURCES:
        for node in nodes(path):
            if isinstance(node, ast.Compare):
                sides = [node.left, *node.comparators]
                named = any(
                    isinstance(side, ast.Name | ast.Attribute) and "family" in ast.unparse(side) for side in sides
                )
                literal = any(isinstance(side, ast.Constant) and isinstance(side.value, str) for side in sides)
                assert not (named and literal), f"{path}:{node.lineno}: {ast.unparse(node)}"


def longest_function(path: Path) -> tuple[int, str]:
    """Return (lines of code, name) of the longest function in a file, docstring left out."""
    sizes = [(0, "")]
    for node in statements(parsed(path)):
        if isinstance(node, ast.FunctionDef):
            first = node.body[0]
            documented = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
            start = first.end_lineno if documented else node.lineno
            sizes.append(((node.end_lineno or 0) - (start or 0), node.name))
    return max(sizes)


def test_files_and_functions_stay_small():
    """A file is a subject, which may take 500 lines; none is cut in two to stay short."""
    lines = {str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert {name: count for name, count in lines.items() if count > 500} == {}
    longest = {str(path.relative_to(ROOT)): longest_function(path) for path in SOURCES}
    assert {name: found for name, found in longest.items() if found[0] > 60} == {}


@pytest.mark.parametrize("name", ["architecture", "extending"])
def test_the_pages_for_contributors_name_files_that_there_are(name):
    page = (ROOT.parent / "docs" / f"{name}.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"`([a-z_]+(?:/[a-z_]+)*/[a-z_]+\.py)`", page))
    assert len(shown) > 20
    there = [f"/{path.relative_to(ROOT.parent).as_posix()}" for path in (*SOURCES, *ROOT.parent.glob("t*/**/*.py"))]
    assert {name for name in shown if not any(path.endswith(f"/{name}") for path in there)} == set()


def test_kinds_of_drives_shapes_springs_and_loads_are_records_and_not_compared_by_name():
    """A new one is its class, and its name in the union beside it."""
    compared = re.compile(r"\b(drive|shape|spring|load)\.kind (==|!=|in|not in)\b")
    assert [path.name for path in SOURCES if compared.search(path.read_text(encoding="utf-8"))] == []
