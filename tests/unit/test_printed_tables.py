"""Tables on a page: what wraps, and that no number loses its end where the page is narrow."""

from __future__ import annotations

import pytest
from cfmkit.cli.page_block_types import CellGrid, GridColumn

from cfmkit.cli.output import Terminal


@pytest.mark.parametrize("width", [40, 60, 108])
def test_no_number_is_cut_on_a_narrow_page(width, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    numbers = ["3.14159265358979", "2.71828182845905", "1.41421356237310", "1.61803398874989"]
    heads = (GridColumn("name", True), *(GridColumn(one, False) for one in "abcd"))
    page = Terminal()._rendered(CellGrid(heads, [["a row", *numbers]]))
    assert max(map(len, page.split("\n"))) <= width
    kept = "".join(page.split())
    assert all(kept.count(digit) == "".join(numbers).count(digit) for digit in "0123456789.")


def test_where_there_is_room_only_texts_take_several_lines(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    heads = (GridColumn("", True), GridColumn("", False))
    page = Terminal()._rendered(CellGrid(heads, [["a text of more than one line on this page", "71.3 x 39.5 mm"]]))
    assert "71.3 x 39.5 mm" in page
