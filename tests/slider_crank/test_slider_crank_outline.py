"""Outlines of legs: compared with the specification."""

from __future__ import annotations

import pytest
from beam_support import config

import cfmkit
from cfmkit.errors import GeometryError
from cfmkit.families.slider_crank.printed.part import Leg


@pytest.mark.parametrize("name", ["lumped", "strip"])
def test_a_leg_that_is_not_drawn_as_specified_is_refused(name, monkeypatch):
    key = "flexures.pivot.thickness" if name == "lumped" else "beam.offset"
    of, other = Leg.contours.fget, config(f"slider_crank_{name}", f"mechanism.{key}=0.5 mm")
    monkeypatch.setattr(Leg, "contours", property(lambda _: of(Leg.from_spec(other, as_printed=True))))
    with pytest.raises(GeometryError, match="thick in the outline"):
        cfmkit.drawing(config(f"slider_crank_{name}"))
