"""Headers of lab files."""

from __future__ import annotations

import pytest

from cfmkit.tables.lab_file import split_header


@pytest.mark.parametrize(
    ("text", "name", "unit"),
    [
        ("Kraft [N]", "Kraft", "N"), ("Kraft (N)", "Kraft", "N"), ("s/mm", "s", "mm"), ("travel in mm", "travel", "mm"),
        ("ratio a/b", "ratio a/b", None), ("Force", "Force", None), ("made in Spain", "made in Spain", None),
    ],
)  # fmt: skip
def test_a_unit_in_a_header_is_told_from_a_name(text, name, unit):
    assert split_header(text) == (name, unit)
