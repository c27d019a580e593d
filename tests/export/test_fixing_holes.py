"""Holes for screws in pads, walls and driven parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shapely import Point, Polygon

import cfmkit
from cfmkit.export.fixing_holes_and_labels import SCREWS_BY_NAME

CONFIGS = Path(__file__).parents[2] / "configs"


def drawn(config, screw):
    return cfmkit.drawing(cfmkit.load(CONFIGS / f"{config}.yaml", [f"mechanism.part.screws={screw}"]))


def holes_of(drawing, diameter):
    boxes = [np.array(contour.extents) for contour in drawing.contours if contour.layer == "cut" and contour.hole]
    return [0.5 * (box[:2] + box[2:]) for box in boxes if np.allclose(box[2:] - box[:2], diameter)]


@pytest.mark.parametrize(
    ("config", "screw", "count"), [("vcfm_pla", "M3", 8), ("make_pom_strip", "M3", 4), ("beam_design_arch", "M1.6", 2)]
)
def test_the_heads_of_screws_lie_within_what_stands_or_is_driven(config, screw, count):
    drawing, size = drawn(config, screw), SCREWS_BY_NAME[screw]
    marks = [
        Polygon(contour.points(1e-6)).buffer(1e-9)
        for contour in drawing.contours
        if contour.layer in ("held", "driven") and contour.closed
    ]
    centers = holes_of(drawing, size.hole)
    assert len(centers) == count
    for center in centers:
        assert any(mark.contains(Point(center).buffer(0.5 * size.head)) for mark in marks)
    gaps = [np.hypot(*(a - b)) for k, a in enumerate(centers) for b in centers[:k]]
    assert min(gaps) >= size.head


def test_pads_that_are_too_small_have_no_holes_and_a_note():
    drawing = drawn("beam_design_arch", "M3")
    assert not holes_of(drawing, SCREWS_BY_NAME["M3"].hole)
    assert "2 of the pads and walls are too small for the head of an M3: no holes there" in drawing.notes


def test_holes_for_screws_do_not_change_what_is_solved():
    """They are in what is held or moved as one."""
    spec = cfmkit.load(CONFIGS / "make_pom_strip.yaml", ["analysis.fidelity=solid", "analysis.points=5"])
    plain, fastened = (cfmkit.analyze(one).curve.force for one in (spec, spec.replace({"mechanism.part.screws": "M3"})))
    assert plain.tolist() == fastened.tolist()
