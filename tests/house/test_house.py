"""The figures of the house: what ties modules into a knot."""

from __future__ import annotations

import ast
import re
import runpy
from pathlib import Path

import pytest

pytestmark = pytest.mark.lists

ROOT = Path(__file__).parents[2]
HOUSE = runpy.run_path(str(ROOT / "tools" / "house.py"))


@pytest.fixture
def package(tmp_path):
    """Make a package of the given files."""

    def make(**files):
        folder = tmp_path / "thing"
        folder.mkdir()
        for name, text in {"__init__": "", **files}.items():
            (folder / f"{name}.py").write_text(text, encoding="utf-8")
        return HOUSE["survey"](folder)

    return make


@pytest.mark.parametrize(
    "way_back",
    [
        "from thing.a import x",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from thing.a import X",
        "def f():\n    import thing.a",
        'MODEL = "thing.a:solve"',
        "from thing import a",
        'def f(name):\n    return look_up(f"thing.{name}:solve")',
        'import thing\ndef f(name):\n    return look_up(f"{thing.__name__}.{name}")',
    ],
)
def test_two_modules_that_need_each_other_in_any_way_are_a_knot(package, way_back):
    assert package(a="import thing.b", b=way_back)["knots"] == [["thing.a", "thing.b"]]


def test_a_long_circle_is_one_knot_and_a_chain_is_none(package):
    chain = {"a": "import thing.b", "b": "import thing.c", "c": "", "d": "import thing.a"}
    assert package(**chain)["knots"] == []
    assert HOUSE["knots"]({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]


def test_a_class_name_in_two_modules_is_reported(package):
    figures = package(a="class Path: ...", b="class Path: ...", c="class Other: ...")
    assert figures["class_names_in_several_modules"] == {"Path": ["thing.a", "thing.b"]}


def test_an_f_string_that_names_no_module_is_no_import(package):
    way_back = 'def f(name, x):\n    return f"thing.{name} is {x}", f"{name}.a", f"thing_{name}.a", f"{x.__name__}.a"'
    assert package(a="import thing.b", b=way_back)["knots"] == []


def test_classes_of_one_name_are_those_that_the_architecture_explains():
    texts = {name: path.read_text("utf-8") for name, path in HOUSE["modules"](ROOT / "cfmkit").items()}
    text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    (told,) = (part for part in text.split("\n\n") if "class names occur in several families" in part)
    named = sorted(re.findall(r"`(\w+)`", told))
    assert list(HOUSE["shared_classes"](texts)) == named
    assert told.startswith({6: "Six", 7: "Seven", 8: "Eight", 9: "Nine"}[len(named)])


def test_the_architecture_states_the_lines_of_every_folder():
    text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    rows = re.findall(r"^\|[^|]*\| (`[^|]*`) \| (\d+\.\d) \|", text, flags=re.MULTILINE)
    for names, stated in rows:
        paths = [ROOT / "cfmkit" / name for name in re.findall(r"`([^`]+)`", names)]
        files = [file for path in paths for file in (path.rglob("*.py") if path.is_dir() else [path])]
        lines = sum(len(file.read_text("utf-8").splitlines()) for file in files) / 1000
        assert float(stated) == pytest.approx(lines, rel=0.15, abs=0.15), names
    folders = {path.name for path in (ROOT / "cfmkit").iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders <= {name.strip("`/") for names, _ in rows for name in names.split(", ")}


def test_every_test_shows_its_claim():
    """It asserts, itself or by a helper named so, wants an exception, or runs a command that must not fail."""
    shown = re.compile(r"\bassert|\braises\(|\bwarns\(|check=True|\bexpect\(")
    files = [*(ROOT / "tests").rglob("test_*.py"), *(ROOT / "plugins").glob("*/tests/test_*.py")]
    functions = (node for file in files for node in ast.parse(file.read_text("utf-8")).body)
    tests = [node for node in functions if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")]
    assert len(tests) > 2000
    assert [test.name for test in tests if not shown.search(ast.unparse(test))] == []
