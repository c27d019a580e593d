"""The page on adding a family shows the code that there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "adding_a_family.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(?:py|toml)\n# (\S+)\n(.*?)^```", PAGE, re.M | re.S)


def test_the_page_shows_code_of_every_room():
    shown = {Path(name).name for name, _ in BLOCKS}
    files = {path.name for path in (ROOT / "plugins" / "oblique" / "cfmkit_oblique").glob("*.py")}
    assert files | {"pyproject.toml"} == shown


@pytest.mark.parametrize(("name", "code"), BLOCKS)
def test_what_the_page_shows_stands_in_the_file(name, code):
    text = (ROOT / name).read_text(encoding="utf-8")
    for part in code.split("\n\n") if name.endswith(".toml") else [code]:
        assert part.strip("\n") in text
