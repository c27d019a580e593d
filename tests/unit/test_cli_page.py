"""What a page consists of, and how a terminal prints it."""

from types import SimpleNamespace

import pytest

from cfmkit.cli.output import Terminal
from cfmkit.cli.page_block_types import (
    BLANK,
    CellGrid,
    GridColumn,
    JsonText,
    Paragraph,
    Span,
    TextLine,
    Verbatim,
    Written,
    columns,
    command_line,
    field,
    listed,
    title,
    whole_line,
)


@pytest.fixture
def printed(monkeypatch, capsys):
    """What a terminal of 40 columns, or as many as are given, prints of blocks."""

    def show(*blocks, width=40):
        monkeypatch.setenv("COLUMNS", str(width))
        Terminal().show(*blocks)
        return capsys.readouterr().out

    return show


def test_a_name_of_several_lines_stays_on_one(printed):
    assert printed(title(SimpleNamespace(family="cam", name="as\n  built"), "")) == "cam  as built\n"


def test_two_texts_stand_at_the_ends_of_a_line_and_never_touch(printed):
    assert printed(TextLine((Span("left"),), "right")) == "left" + 31 * " " + "right\n"
    assert printed(TextLine((Span(34 * "l"),), "right")).split() == [34 * "l", "right"]


def test_what_stands_at_the_far_end_goes_only_where_that_is_allowed(printed):
    assert printed(TextLine((Span(34 * "l"),), "right", droppable=True)) == 34 * "l" + "\n"


def test_a_paragraph_stands_in_from_its_word_and_cuts_nothing(printed):
    path = "/a/" + 50 * "b"
    assert printed(Paragraph("warning", f"the file {path} is there")) == (
        f"warning  the file\n         {path}\n         is there\n"
    )
    assert printed(Paragraph("first", "")) == "first\n"


def test_a_line_that_is_copied_keeps_its_length(printed):
    assert printed(whole_line("cfmkit analyze ", 60 * "x")) == f"cfmkit analyze {60 * 'x'}\n"


def test_a_table_has_heads_only_where_one_says_something(printed):
    rows = [("a", Span("b"))]
    assert printed(CellGrid(columns(True, True), rows)) == "a   b\n"
    assert printed(CellGrid((GridColumn(""), GridColumn("raw")), rows)) == "    raw\na   b\n"


def test_cells_are_folded_and_never_cut(printed):
    cell = 30 * "abc"
    assert "".join(printed(CellGrid(columns(True), [(cell,)])).split()) == cell
    assert "\N{HORIZONTAL ELLIPSIS}" not in printed(CellGrid(columns(False, False), [(cell, cell)]))


def test_records_are_listed_below_their_heading_and_not_at_all_where_there_are_none(printed):
    assert printed(*listed("units", [{"name": "mm"}], (field("name", ""),))) == "\nunits\n  mm\n"
    assert list(listed("units", [], (field("name"),))) == []


def test_text_and_data_are_printed_as_they_are(printed):
    assert printed(BLANK, Verbatim("a  \nb"), JsonText({"c": 1})) == '\na  \nb{\n  "c": 1\n}\n'


def test_of_each_folder_two_files_are_named_and_all_of_them_on_request():
    written = Written("out/", ("curve.csv", "geometry/a.dxf", "geometry/b.dxf", "geometry/c.dxf", "figures/l.png"))
    assert written.block(False).text == "out/  curve.csv geometry/{a.dxf,b.dxf,...} figures/l.png"
    assert written.block(True).text.endswith("geometry/a.dxf geometry/b.dxf geometry/c.dxf figures/l.png")


def test_a_command_line_is_quoted_for_a_shell_and_stays_on_one_line():
    assert command_line("cfmkit", "new", "a b", "c\nd") == "cfmkit new 'a b' $'c\\x0ad'"
