"""Keys of the families in the pages of the documentation."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from cfmkit import families
from cfmkit.specs.keys_and_schema import keys

pytestmark = pytest.mark.lists


DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def site():
    """The module that makes the pages; Sphinx is not needed for them."""
    sys.path.insert(0, str(DOCS))
    try:
        import made_pages
    finally:
        sys.path.remove(str(DOCS))
    return made_pages


@pytest.fixture(scope="module")
def pages(site):
    return site.made()


@pytest.mark.parametrize("name", families.names())
def test_every_key_of_a_family_is_in_its_page_with_its_kind(name, pages):
    page = pages[f"keys_{name.replace('-', '_')}.md"]
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    known = sorted(key.path for key in keys(families.family(name).spec_type))
    shown = sorted(row.split("`")[1] for row in rows)
    assert not [path for path in known if path not in shown]
    assert len([path for path in shown if path in known]) >= len(known)
    for row in rows:
        if row.split("`")[1] in known and "." in row.split("`")[1]:
            assert len(re.findall(r"(?<!\\)\|", row)) == 6, row
