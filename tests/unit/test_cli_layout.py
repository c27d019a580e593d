"""The lines that pages are made of."""

from types import SimpleNamespace

from rich.text import Text

from cfmkit.cli.layout import across, title


def test_a_name_of_several_lines_stays_on_one():
    assert title(SimpleNamespace(family="cam", name="as\n  built")).plain == "cam  as built"


def test_two_texts_stand_at_the_ends_of_a_line_and_never_touch():
    assert across(Text("left"), "right", 20).plain == "left           right"
    assert across(Text("left"), "right", 8).plain == "left  right"
