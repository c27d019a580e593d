"""Keys of the families in the pages of the documentation."""

from __future__ import annotations

import re

import pytest
from site_pages import read_pages

from cfmkit import families
from cfmkit.specs.keys_and_schema import keys

pytestmark = pytest.mark.lists


@pytest.mark.parametrize("name", families.names())
def test_every_key_of_a_family_is_in_its_page_with_its_kind(name):
    page = read_pages()[f"keys_{name.replace('-', '_')}.md"]
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    known = sorted(key.path for key in keys(families.family(name).spec_type))
    shown = sorted(row.split("`")[1] for row in rows)
    assert not [path for path in known if path not in shown]
    assert len([path for path in shown if path in known]) >= len(known)
    for row in rows:
        if row.split("`")[1] in known and "." in row.split("`")[1]:
            assert len(re.findall(r"(?<!\\)\|", row)) == 6, row
