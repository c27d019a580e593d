"""The page on adding a family shows the code that there is."""

from __future__ import annotations

import ast
import re
from importlib.util import find_spec
from pathlib import Path

import pytest

pytestmark = pytest.mark.lists

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "adding_a_family.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(?:py|toml|xml)\n(?:#|<!--) (\S+)(?: -->)?\n(.*?)^```", PAGE, re.M | re.S)


def test_the_page_shows_code_of_every_room():
    shown = {Path(name).name for name, _ in BLOCKS}
    files = {path.name for path in (ROOT / "plugins" / "oblique" / "cfmkit_oblique").glob("*.py")} - {"__init__.py"}
    assert files | {"pyproject.toml", "dimensions.svg"} == shown


@pytest.mark.parametrize(("name", "code"), BLOCKS)
def test_what_the_page_shows_stands_in_the_file(name, code):
    text = (ROOT / name).read_text(encoding="utf-8")
    for part in code.split("\n\n") if name.endswith(".toml") else [code]:
        assert part.strip("\n") in text


def covered():
    """Return the modules that the version of the interface covers, as the page lists them."""
    listed = re.search(r"covers the record and the modules that families use:\n([^.]*(?:\.\w[^.]*)*)\.\n", PAGE)[1]
    names = [name for name in re.findall(r"`([\w.]+)`", listed) if name != "Run"]
    return {f"cfmkit.{name.removeprefix('cfmkit.')}" for name in names}


def test_the_example_uses_only_modules_that_the_version_of_the_interface_covers():
    modules = covered()
    assert all(find_spec(name) for name in modules)
    used = {
        node.module
        for path in (ROOT / "plugins" / "oblique" / "cfmkit_oblique").glob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "cfmkit"
    }
    assert len(used) > 10
    inside = {name for name in used for module in modules if name == module or name.startswith(f"{module}.")}
    assert used - inside == set()


def test_run_has_one_home():
    import cfmkit

    assert cfmkit.Run.__module__ in covered()
