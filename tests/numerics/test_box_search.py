"""The lowest place of a box."""

from __future__ import annotations

import pytest

from cfmkit.numerics.box_search import BoxAxis, lowest


def test_a_box_is_searched_to_its_bounds():
    found = lowest(
        lambda at: (at[0] - 2.0) ** 2 + (at[1] - 1e-4) ** 2, (BoxAxis(0.0, 1.0), BoxAxis(0.0, 1.0, log=True))
    )
    assert found.place[0] == 1.0
    assert found.place[1] == pytest.approx(1e-4, abs=1e-6)
