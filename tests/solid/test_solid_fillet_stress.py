"""Stress fillet by fillet: which arcs of a boundary are fillets, and what fillets.csv says of a part."""

from __future__ import annotations

import math

import numpy as np
import pytest
from vee_leaf import VEE

import cfmkit
from cfmkit.solid.boundary_and_element_sizes import Ring
from cfmkit.solid.stress_along_fillets import FilletStress, arcs

SHORT = {
    "mechanism.part.fillet": "0.3 mm",
    "analysis.travel": "0.3 mm", "analysis.window": ["0.1 mm", "0.3 mm"], "analysis.points": 11,
    "analysis.solid.poses": 3, "analysis.solid.error": 0.1,
}  # fmt: skip


def circle(start: float, end: float, radius: float = 1.0) -> np.ndarray:
    angle = np.linspace(start, end, 10)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


ELL = np.vstack([[(0.0, 0.0), (5.0, 0.0), (5.0, 1.0)], circle(1.5 * math.pi, math.pi) + 2.0, [(1.0, 5.0), (0.0, 5.0)]])
"""An L whose inside corner at (1, 1) is rounded: the centre is at (2, 2)."""


def test_an_arc_that_turns_towards_the_waste_is_a_fillet_with_its_middle():
    (arc,) = arcs(Ring.from_points(ELL, hole=False), 0, 1.0)
    assert arc.turn == pytest.approx(0.5 * math.pi)
    assert arc.center == pytest.approx([2.0, 2.0])
    assert arc.middle == pytest.approx([2.0 - math.sqrt(0.5)] * 2)
    assert arc.ends.tolist() == [pytest.approx([2.0, 1.0]), pytest.approx([1.0, 2.0])]
    assert arc.covers(np.array([[2.0, 1.0], arc.middle, [3.0, 1.0], [1.0, 1.0]])).tolist() == [True, True, False, False]


def test_outside_corners_holes_and_arcs_of_other_radii_are_no_fillets():
    rounded = np.vstack([[(0.0, 0.0), (5.0, 0.0)], circle(0.0, 0.5 * math.pi) + 4.0, [(0.0, 5.0)]])
    round_hole = circle(0.0, 2 * math.pi)[:-1]
    assert not list(arcs(Ring.from_points(rounded, hole=False), 0, 1.0))
    assert not list(arcs(Ring.from_points(round_hole, hole=True), 0, 1.0))
    assert not list(arcs(Ring.from_points(ELL, hole=False), 0, 0.9))
    assert not list(arcs(Ring.from_points(ELL, hole=False), 0, 0.0))


def test_each_fillet_of_a_leaf_has_a_row_and_the_largest_is_the_peak_of_the_window():
    result = cfmkit.analyze(cfmkit.loads(VEE).replace(SHORT))
    table = result.tables["fillets"]()
    assert table["place"] == ("root: leaf", "shuttle: leaf", "shuttle: leaf", "root: leaf")
    assert table["radius"].tolist() == [0.3] * 4
    worst = int(table["max_stress"].argmax())
    assert 1e6 * table["max_stress"][worst] == pytest.approx(cfmkit.evaluate(result)["stress_max"].value, rel=1e-9)
    peak = [1e3 * result.values[f"peak_stress_{axis}"].value for axis in "xy"]
    assert math.dist(peak, (table["x"][worst], table["y"][worst])) < 0.5 * 0.5 * math.pi * 0.3
    assert ((table["displacement"] > 0.1 - 1e-9) & (table["displacement"] < 0.3 + 1e-9)).all()


def test_the_largest_stress_of_a_window_counts_its_ends_where_they_are_no_poses():
    (arc,) = arcs(Ring.from_points(ELL, hole=False), 0, 1.0)
    one = FilletStress(arc, np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 4.0, 2.0, 0.0]))
    assert one.largest(0.0, 3.0) == (4.0, 1.0)
    value, place = one.largest(1.5, 3.0)
    assert 2.0 < value < 4.0
    assert place == 1.5
    assert one.largest(4.0, 5.0) is None
