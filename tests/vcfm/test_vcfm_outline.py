"""Outlines of leaves: compared with the specification."""

from __future__ import annotations

import pytest
from beam_support import config

import cfmkit
from cfmkit.errors import GeometryError
from cfmkit.families.vcfm import outline


@pytest.mark.parametrize(("which", "words"), [(0, "beam 'leaf' is"), (1, "beam 'spring' is"), (2, "encloses")])
def test_leaves_that_are_not_drawn_as_specified_are_refused(which, words, monkeypatch):
    """The outline of other leaves, of another spring, or of thicker walls: each is compared with the specification."""
    keys = (
        "mechanism.bistable.thickness=1.014 mm",
        "mechanism.positive.thickness=1.505 mm",
        "mechanism.part.frame={wall: 7 mm}",
    )
    contours = outline._contours
    other = config("vcfm_pla", keys[which])
    monkeypatch.setattr(outline, "_contours", lambda _: contours(other))
    with pytest.raises(GeometryError, match=words):
        cfmkit.drawing(config("vcfm_pla"))
