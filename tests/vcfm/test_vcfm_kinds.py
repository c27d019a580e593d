"""Kinds of leaves and springs are records: nothing compares their names."""

from __future__ import annotations

import ast

import pytest
from sources import PACKAGE as ROOT
from sources import nodes

from cfmkit.cli import run_command
from cfmkit.families.vcfm.leaves_spec import LEAF_KINDS, SPRING_KINDS

pytestmark = pytest.mark.lists


def test_no_one_asks_for_a_kind_of_leaf_or_spring_by_its_name():
    """Kinds of the vcfm are records: a new one is its file, and its line in the tables of `leaves_spec`."""
    names = {*LEAF_KINDS, *SPRING_KINDS}
    asked = {}
    for path in (ROOT / "families" / "vcfm").rglob("[!_]*.py"):
        for node in nodes(path):
            sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
            sides += [one for one in node.keys if one is not None] if isinstance(node, ast.Dict) else []
            words = {one.value for side in sides for one in ast.walk(side) if isinstance(one, ast.Constant)}
            if names & words:
                asked[f"{path.name}:{node.lineno}"] = ast.unparse(node)
    assert asked == {}


def test_a_template_lists_the_words_of_a_choice(capsys):
    assert run_command(["new", "vcfm", "--out", "-"]) == 0
    text = capsys.readouterr().out
    assert "{words of" not in text
    assert f"structure: v-beam             # {', '.join(LEAF_KINDS)}\n" in text
    assert f"structure: diamond            # {', '.join(SPRING_KINDS)}\n" in text
