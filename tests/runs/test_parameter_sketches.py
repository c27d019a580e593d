"""Dimension drawings of the families: files of their packages, and the table of dimensions in them."""

from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from cfmkit import families
from cfmkit.cli import run_command
from cfmkit.errors import UsageError
from cfmkit.runs.shipped_files import DRAWING_FILE, DRAWING_SUFFIXES, read_dimensions, read_drawing
from cfmkit.specs import keys

OWN = ["beam", "cam", "slider-crank", "vcfm"]
DRAWN = [record.name for record in families.records() if record.file(DRAWING_FILE)]
every_drawing = pytest.mark.parametrize("name", DRAWN)
own_drawings = pytest.mark.parametrize("name", OWN)


def texts(name):
    """Return every text of a drawing, its table left out."""
    root = ElementTree.fromstring(families.family(name).read(DRAWING_FILE))
    return ["".join(text.itertext()) for text in root.iterfind(".//{*}text") if text.get("class") != "row"]


def named_keys(name):
    """Return the dotted keys that a drawing names; ``mechanism.thickness, .width`` names two."""
    whole = " ".join(" ".join(row.values()) for row in read_dimensions(families.family(name)))
    first = re.findall(r"\b(?:mechanism|analysis|design)(?:\.\w+)+", whole)
    siblings = re.findall(r"\b((?:mechanism|analysis|design)(?:\.\w+)*)\.\w+, (\.\w+)", whole)
    return [*first, *(parent + last for parent, last in siblings)]


def unknown_keys(name, known):
    """Return the keys that a drawing names and a specification does not have."""
    return [key for key in named_keys(name) if not any(re.match(rf"{re.escape(key)}(?![\w])", path) for path in known)]


def paths_of(name):
    keys_of_family = keys(families.family(name).spec_type)
    return [re.sub(r"\.<\w+>", ".NAME", key.path).replace("{}", "NAME") for key in keys_of_family]


def test_every_family_of_the_repository_is_drawn():
    assert {*OWN, "oblique"} <= set(DRAWN)


@every_drawing
def test_keys_of_the_drawing_are_keys_of_the_specification(name):
    assert len(named_keys(name)) > 5
    assert unknown_keys(name, paths_of(name)) == []


@every_drawing
def test_a_key_that_is_gone_from_the_specification_is_found(name):
    for gone in set(named_keys(name)):
        left = [path for path in paths_of(name) if not re.match(rf"{re.escape(gone)}(?![\w])", path)]
        assert gone in unknown_keys(name, left)


@every_drawing
def test_every_symbol_of_the_table_stands_in_the_drawing(name):
    drawn = texts(name)
    for row in read_dimensions(families.family(name)):
        for part in re.split(r", | \.\.\. ", row["symbol"]):
            assert any(re.search(rf"(?<!\w){re.escape(part)}(?!\w)", text) for text in drawn), row


@every_drawing
def test_a_drawing_is_small_and_its_text_is_text(name):
    svg = read_drawing(families.family(name))[".svg"]
    assert len(svg) < 20_000
    assert b" id=" not in svg
    assert svg.count(b"<text") > len(read_dimensions(families.family(name)))


@own_drawings
def test_png_and_pdf_show_the_drawing_as_it_is_now(name):
    files = read_drawing(families.family(name))
    assert tuple(files) == DRAWING_SUFFIXES
    digest = hashlib.sha256(files[".svg"]).hexdigest().encode()
    assert files[".png"].startswith(b"\x89PNG")
    assert files[".pdf"].startswith(b"%PDF")
    assert [ending for ending in (".png", ".pdf") if digest not in files[ending]] == []  # tools/print_drawings.py


@pytest.mark.parametrize("ending", DRAWING_SUFFIXES)
def test_show_copies_the_drawing_and_replaces_nothing(tmp_path, monkeypatch, capsys, ending):
    monkeypatch.chdir(tmp_path)
    assert run_command(["show", "cam", "--figure"]) == 0
    assert "mechanism.brace_length" in capsys.readouterr().out
    assert run_command(["show", "cam", "--figure"]) == 7
    assert run_command(["show", "cam", "--figure", f"mine{ending.upper()}"]) == 0
    files = read_drawing(families.family("cam"))
    assert (tmp_path / "cam.png").read_bytes() == files[".png"]
    assert (tmp_path / f"mine{ending.upper()}").read_bytes() == files[ending]


def test_a_family_of_another_package_brings_a_drawing_of_its_own(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run_command(["show", "oblique", "--figure"]) == 0
    assert "mechanism.half_span" in capsys.readouterr().out
    assert "mechanism.half_span" in (tmp_path / "oblique.svg").read_text()
    assert run_command(["show", "oblique", "--figure", "oblique.png"]) == 2
    assert "ends with .svg, not '.png'" in capsys.readouterr().err
    assert run_command(["show", "K_o"]) == 0
    assert "mechanism.oblique.stiffness" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["show", "--figure"], "needs a family: "),
        (["show", "cam", "--figure", "x.jpg"], "ends with .png, .svg, .pdf"),
        (["show", "cma", "--figure"], "cam"),
    ],
)
def test_a_drawing_that_there_is_not_is_refused_in_one_line(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    assert run_command(arguments) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_family_without_a_drawing_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    bare = replace(families.family("cam"), folder="")
    monkeypatch.setattr(families, "family", lambda _: bare)
    assert run_command(["show", "cam", "--figure"]) == 2
    assert "has no drawing; there are " in capsys.readouterr().err


@pytest.mark.parametrize("text", ["no picture", '<svg><text class="row"><tspan>a</tspan></text></svg>'])
def test_a_file_that_is_no_drawing_is_refused_with_its_name(monkeypatch, text):
    monkeypatch.setattr("cfmkit.families.base.Family.read", lambda _record, _name: text)
    with pytest.raises(UsageError, match=r"^cfmkit/families/cam/dimensions\.svg has no rows of"):
        read_dimensions(families.family("cam"))
