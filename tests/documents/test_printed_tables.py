"""Tables on a page: what wraps, and that no number loses its end where the page is narrow."""

from __future__ import annotations

import pytest

from cfmkit.documents.document import CellGrid, Document, GridColumn, PageTable
from cfmkit.documents.terminal import page as page_of
from cfmkit.documents.terminal import print_blocks


@pytest.mark.parametrize("width", [40, 60, 108])
def test_no_number_is_cut_on_a_narrow_page(width):
    numbers = ["3.14159265358979", "2.71828182845905", "1.41421356237310", "1.61803398874989"]
    heads = (GridColumn("name", True), *(GridColumn(one, False) for one in "abcd"))
    table = Document(title="t", tables=(PageTable("", heads, (("a row", *numbers),)),))
    for page in (
        print_blocks([CellGrid(heads, [["a row", *numbers]])], width),
        print_blocks(page_of(table, width), width),
    ):
        assert max(map(len, page.split("\n"))) <= width
        kept = "".join(page.split())
        assert all(kept.count(digit) == "".join(numbers).count(digit) for digit in "0123456789.")


def test_where_there_is_room_only_texts_take_several_lines():
    heads = (GridColumn("", True), GridColumn("", False))
    page = print_blocks([CellGrid(heads, [["a text of more than one line on this page", "71.3 x 39.5 mm"]])], 40)
    assert "71.3 x 39.5 mm" in page
