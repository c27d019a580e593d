"""Pages that `cfmkit docs` shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cfmkit.cli import guide
from cfmkit.errors import UsageError

pytestmark = pytest.mark.lists


DOCS = Path(__file__).parents[2] / "docs"


LINKS = re.compile(r"\]\((?!https?:)([^)#\s]+)")


def test_the_documentation_comes_with_the_package_and_its_links_lead_to_files():
    found = guide.pages()
    assert [one.name for one in found][:5] == ["index", "tutorial", "howto", "suggest", "make_one"]
    assert {one.name for one in found} == {path.stem for path in DOCS.glob("*.md")}
    page, own = (path.read_text("utf-8") for path in (guide.page("docs/cam.md#friction").path, DOCS / "cam.md"))
    assert page in (own, own.replace("](../cfmkit/", "](../"))  # as it is in a checkout, and in a wheel
    with pytest.raises(UsageError, match="did you mean 'vcfm'"):
        guide.page("vcmf")
    for one in found:
        links = [link for link in LINKS.findall(one.text) if not link.startswith("made/")]
        around = DOCS, one.path.parent  # an installed page is beside its package
        assert [link for link in links if not any((folder / link).is_file() for folder in around)] == [], one.name
