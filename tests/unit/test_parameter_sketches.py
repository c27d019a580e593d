"""Drawings of the families with their dimensions named."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cfmkit import families
from cfmkit.cli.main import main
from cfmkit.runs.nomenclature_figure_file import drawn, scheme
from cfmkit.specs.keys_and_schema import keys

DRAWN = [record.name for record in families.records() if record.scheme]
every_drawing = pytest.mark.parametrize("name", DRAWN)


def test_the_families_of_the_package_are_drawn():
    assert {"cam", "beam", "vcfm", "slider-crank"} <= set(DRAWN)


@every_drawing
def test_every_symbol_stands_in_the_drawing_and_the_table(name):
    found = scheme(name)
    figure = found.figure()
    texts = [text.get_text() for ax in figure.axes for text in ax.texts]
    table = [text.get_text() for text in figure.texts]
    for one in found.dimensions:
        assert one.symbol in table
        assert any(
            re.search(rf"(?<!\w){re.escape(part)}(?!\w)", text)
            for part in re.split(r", | \.\.\. ", one.symbol)
            for text in texts
        ), one


@every_drawing
def test_keys_in_the_table_are_keys_of_the_specification(name):
    known = {
        re.sub(r"\.<\w+>", ".NAME", key.path).replace("{}", "NAME") for key in keys(families.family(name).spec_type)
    }
    for one in scheme(name).dimensions:
        first = one.key.split(",")[0].split(":")[0]
        if "." in first and " " not in first:
            assert any(path == first or path.startswith((f"{first}.", f"{first}[")) for path in known), (
                first,
                sorted(known)[:400],
            )


@every_drawing
def test_no_text_leaves_the_page(name):
    figure = scheme(name).figure()
    figure.canvas.draw()
    page = figure.bbox
    for text in [*figure.texts, *(text for ax in figure.axes for text in ax.texts)]:
        box = text.get_window_extent()
        inside = (box.x0 - page.x0, page.x1 - box.x1, box.y0 - page.y0, page.y1 - box.y1)
        assert min(inside) >= 0, text.get_text()


def test_a_drawing_is_the_same_bytes_twice():
    for kind in (".png", ".svg", ".pdf"):
        assert drawn(scheme("cam"), kind) == drawn(scheme("cam"), kind)


def test_show_writes_the_drawing_and_replaces_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["show", "cam", "--figure"]) == 0
    assert (tmp_path / "cam.png").read_bytes().startswith(b"\x89PNG")
    assert "mechanism.brace_length" in capsys.readouterr().out
    assert main(["show", "cam", "--figure"]) == 7
    assert main(["show", "cam", "--figure", "mine.svg"]) == 0
    assert "brace_length" in (tmp_path / "mine.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["show", "--figure"], "needs a family: "),
        (["show", "cam", "--figure", "x.jpg"], "ends with .png, .svg, .pdf"),
        (["show", "oblique", "--figure"], "has no drawing"),
        (["show", "cma", "--figure"], "cam"),
    ],
)
def test_what_cannot_be_drawn_is_told_in_one_line(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["beam", "cam", "slider-crank", "vcfm"])
def test_the_drawing_in_the_docs_says_what_show_figure_says(name):
    # texts, not bytes: another matplotlib may draw the same lines in other words of SVG
    shown = Path(__file__).parents[2] / "docs" / "images" / f"{name.replace('-', '_')}_dimensions.svg"
    texts = [
        re.findall(r"<text[^>]*>([^<]*)<", text) for text in (shown.read_text(), drawn(scheme(name), ".svg").decode())
    ]
    assert texts[0] == texts[1]
    assert texts[0]
