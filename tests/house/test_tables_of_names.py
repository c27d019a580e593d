"""What is added in one place is known everywhere: templates, methods of studies, ways to draw, requests, materials."""

import re

import pytest
from sources import PACKAGE

pytestmark = pytest.mark.lists


def test_families_read_the_modulus_of_a_material_and_how_it_is_cut_in_one_place():
    """What changes with the conditions of an analysis is changed there, and reaches all."""
    twice = re.compile(r"material\.(youngs_modulus|poisson_ratio)\b(?!\")|\.part or \w+\(")
    sources = [path for path in (PACKAGE / "families").rglob("*.py") if not path.name.endswith("spec.py")]
    read = {f"{path.name}: {line.strip()}" for path in sources for line in path.read_text("utf-8").split("\n")
            if twice.search(line) and not re.search(r"[\"'].*material\.youngs_modulus.*[\"']", line)}  # fmt: skip
    assert {line for line in read if '"' not in line} == set()
