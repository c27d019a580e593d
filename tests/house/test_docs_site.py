"""Pages of the documentation site that are made from the package; the site itself is built by .ci/run."""

from __future__ import annotations

import re
import runpy

import pytest
from site_pages import DOCS, load_site, read_pages
from sources import PACKAGE

import cfmkit

pytestmark = pytest.mark.lists


@pytest.fixture(scope="module")
def site():
    return load_site()


@pytest.fixture(scope="module")
def pages():
    return read_pages()


def test_every_command_is_in_its_page(pages):
    verbs = [path.stem for path in (PACKAGE / "cli" / "verbs").glob("*.py") if path.stem != "__init__"]
    assert len(verbs) > 15
    for verb in verbs:
        assert f"## cfmkit {verb}\n" in pages["commands.md"]
    assert "Traceback" not in pages["commands.md"]
    assert "--set" in pages["commands.md"]


def test_every_public_name_is_in_the_page_on_python(pages):
    for name in cfmkit.__all__:
        assert name == "__version__" or f":: cfmkit.{name}\n" in pages["python.md"]


def test_the_gallery_names_examples_that_are_there(site):
    known = {one.name for one in cfmkit.examples()}
    assert {name for name, _, _ in site.GALLERY} <= known


def test_every_page_is_in_the_index_or_is_put_there(site):
    from types import SimpleNamespace

    pages = {path.stem for path in DOCS.glob("*.md")}
    source = [(DOCS / "index.md").read_text()]
    site.others(SimpleNamespace(env=SimpleNamespace(found_docs=pages)), "index", source)
    assert pages - {"index"} <= set(source[0].split())
    assert "OTHERS" not in source[0]


LINKS = re.compile(r"\]\((?!https?:)([^)#\s]+)")


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
