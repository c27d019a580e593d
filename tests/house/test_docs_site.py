"""Pages of the documentation site that are made from the package; the site itself is built by .ci/run."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import pytest

from cfmkit import families
from cfmkit.cli import guide
from cfmkit.errors import UsageError
from cfmkit.runs.examples import example
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


def test_every_command_is_in_its_page(pages):
    from cfmkit.cli.commands import names

    for verb in names():
        assert f"## cfmkit {verb}\n" in pages["commands.md"]
    assert "Traceback" not in pages["commands.md"]
    assert "--set" in pages["commands.md"]


def test_every_public_name_is_in_the_page_on_python(pages):
    import cfmkit

    for name in cfmkit.__all__:
        assert name == "__version__" or f":: cfmkit.{name}\n" in pages["python.md"]


def test_the_gallery_names_examples_that_are_there(site):
    for name, _, _ in site.GALLERY:
        assert example(name).path.is_file()


def test_every_page_is_in_the_index_or_is_put_there(site):
    from types import SimpleNamespace

    pages = {path.stem for path in DOCS.glob("*.md")}
    source = [(DOCS / "index.md").read_text()]
    site.others(SimpleNamespace(env=SimpleNamespace(found_docs=pages)), "index", source)
    assert pages - {"index"} <= set(source[0].split())
    assert "OTHERS" not in source[0]


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


@pytest.mark.parametrize(
    ("url", "reported"),
    [
        ("", "[no links](`cfmkit docs cam`)"),
        ("https://example.org/us/cfmkit/", "[cam](https://example.org/us/cfmkit/blob/main/docs/cam.md)"),
    ],
)
def test_the_description_of_a_wheel_has_no_link_that_leads_nowhere(monkeypatch, url, reported):
    setuptools = pytest.importorskip("setuptools")
    given = {}
    monkeypatch.setenv("CFMKIT_URL", url)
    monkeypatch.setattr(setuptools, "setup", lambda **options: given.update(options))
    runpy.run_path(str(DOCS.parent / "setup.py"))
    assert LINKS.findall(given["long_description"]) == []
    assert reported.replace("[no links]", "cam ") in given["long_description"]
    assert bool(given["project_urls"]) == bool(url)
    assert all(one.startswith("https://example.org/us/cfmkit") for one in given["project_urls"].values())
