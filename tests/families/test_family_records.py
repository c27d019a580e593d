"""The record of a family is complete, and its functions are in the file that every family has them in."""

from __future__ import annotations

import ast
from importlib import import_module

import pytest
from sources import PACKAGE as ROOT
from sources import parsed

from cfmkit import families
from cfmkit.families import family
from cfmkit.families.deferred_imports import load_deferred
from cfmkit.specs.units import DIMENSIONS_BY_NAME

pytestmark = pytest.mark.lists


ROOMS = {
    "design.make": "design",
    "draw.figures": "figures",
    "outline": "outline",
    "propose": "proposals",
    "part": "part",
    "free": "redesign_variables_and_process_errors",
    "errors": "redesign_variables_and_process_errors",
    "sample": "force_at_few_poses",
    "elastic.solids": "plane_fem_analysis",
}
"""Field of a family's record -> the file that every family has it in."""


@pytest.mark.parametrize("name", ["beam", "cam", "slider-crank", "vcfm"])
def test_every_family_has_the_same_rooms(name):
    record, folder = family(name), f"cfmkit.families.{name.replace('-', '_')}"
    homes = {}
    for field in ROOMS:
        above, _, last = field.rpartition(".")
        part = getattr(record, above) if above else record
        if part is not None and getattr(part, last) is not None:
            homes[field] = load_deferred(getattr(part, last)).__module__
    assert len(homes) > 6
    inner = {field: home.removeprefix(f"{folder}.").removeprefix("printed.") for field, home in homes.items()}
    assert inner == {field: ROOMS[field] for field in homes}
    assert record.folder == folder.replace(".", "/")
    assert all(record.file(name) for name in ("dimensions.svg", "template.yaml", "references.bib"))
    for room in ("spec", "findings"):
        assert (ROOT / "families" / folder.rpartition(".")[2] / f"{room}.py").exists()


every_family = pytest.mark.parametrize("name", families.names())


def tables_of_modules():
    """Yield (path, name, module, tree) of every table at the top of a module that takes entries of others."""
    for path in sorted((ROOT / "families").rglob("*.py")):
        for statement in parsed(path).body:
            if not isinstance(statement, ast.Assign | ast.AnnAssign) or not isinstance(statement.value, ast.Dict):
                continue
            if None in statement.value.keys:
                module = ".".join(("cfmkit", *path.relative_to(ROOT).with_suffix("").parts))
                yield pytest.param(module, statement.value, id=f"{module}:{statement.lineno}")


@pytest.mark.parametrize(("module", "table"), [*tables_of_modules()])
def test_no_entry_of_a_table_takes_the_place_of_another(module, table):
    names = []
    for key, value in zip(table.keys, table.values, strict=True):
        source = ast.unparse(value if key is None else key)
        known = eval(source, vars(import_module(module)))
        names += list(known) if key is None else [known]
    assert len(names) > 3
    assert [name for name in dict.fromkeys(names) if names.count(name) > 1] == []


@pytest.mark.lists
@every_family
def test_what_a_family_says_about_itself_is_complete(name):
    record = families.family(name)
    assert record.summary
    assert record.papers
    assert all(DIMENSIONS_BY_NAME[dimension] and definition for dimension, definition in record.outputs.values.values())
    assert all(record.outputs.findings.values())
    parts = [record, *filter(None, (record.design, record.draw, record.elastic))]
    functions = [value for part in parts for value in vars(part).values() if callable(value)]
    assert len(functions) > 6
    assert all(callable(load_deferred(function)) for function in (*functions, *record.models.values()))
