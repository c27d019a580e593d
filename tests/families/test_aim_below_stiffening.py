"""Forces that parts with wide beams are aimed at."""

from __future__ import annotations

import pytest
from suggest_support import request

from cfmkit.families import proposals


@pytest.mark.parametrize(("share", "aim"), [(0.0, 10.0), (0.03, 10.0 / 1.015), (0.05, 1.002 * 9.75)])
def test_a_part_is_aimed_between_its_force_without_and_with_the_stiffening(share, aim, monkeypatch):
    monkeypatch.setattr(proposals, "stiffening", lambda *_: share)
    asked = proposals.aim_below_stiffening(None, request(), None)
    assert asked.target == pytest.approx(aim)
