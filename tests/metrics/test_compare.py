"""Differences of two curves in numbers, and curves that a word tells apart."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.curves import Curve
from cfmkit.metrics import Undefined, Window
from cfmkit.metrics.compare import (
    ComparedSide,
    Difference,
    Differences,
    Points,
    compare,
    counterpart,
    effort_at,
    largest,
    mean,
    overlap,
    rms,
)
from cfmkit.tables import curve_table, read_csv, to_csv

MEASURES = {"d_rms": (rms, "rms of {}"), "d_max": (largest, "largest of {}"), "d_mean": (mean, "mean of {}")}


def line(motion, effort, branch="load", **label):
    points = len(motion)
    names = np.full(points, branch) if isinstance(branch, str) else np.array(branch)
    reported = {name: (value, "text") for name, value in label.items()}
    return Curve(np.array(motion), np.array(effort), names, np.ones(points, bool), label=reported)


def summary(*values, tag=""):
    named = {f"b{k}": Difference(np.array(item, dtype=float), f"reason {k}") for k, item in enumerate(values)}
    return {name: item.value for name, item in summarize(named, tag).items()}


def summarize(curves, tag=""):
    return Differences(curves, np.empty(0), None, ()).summarize(MEASURES, "force", tag)


def test_the_largest_difference_keeps_its_sign():
    assert summary([1.0, -3.0, 2.0]) == {"d_rms": pytest.approx(np.sqrt(14 / 3)), "d_max": -3.0, "d_mean": 0.0}


def test_several_branches_are_told_one_by_one_and_together():
    found = summary([1.0, 1.0], [-1.0, -1.0, -1.0, -1.0], tag="coarse")
    means = {name: value for name, value in found.items() if name.startswith("d_mean")}
    assert means == {"d_mean[coarse]": pytest.approx(-1 / 3), "d_mean[coarse,b0]": 1.0, "d_mean[coarse,b1]": -1.0}


def test_a_gap_leaves_no_number_but_the_reason_of_its_branch():
    values = {"up": Difference(np.ones(3), "none"), "down": Difference(np.array([1.0, np.nan]), "why")}
    found = summarize(values)
    assert found["d_rms[up]"].value == 1.0
    for name in ("d_rms", "d_rms[down]"):
        assert (found[name].value, found[name].reason) == (None, "why")


def test_a_branch_is_found_by_name_and_else_by_direction():
    loop = line([0.0, 1.0, 1.0, 0.0], [1.0, 2.0, 1.5, 0.5], ["out", "out", "back", "back"])
    assert counterpart(loop, "out", -1.0) == "out"
    assert [counterpart(loop, "load", way) for way in (1.0, -1.0)] == ["out", "back"]


def test_nothing_is_read_beyond_the_ends_of_a_branch_whatever_its_direction():
    for motion in ([0.0, 1.0], [1.0, 0.0]):
        found = effort_at(line(motion, motion), "load", np.array([-0.1, 0.25, 1.1]))
        np.testing.assert_array_equal(found, [np.nan, 0.25, np.nan])


def test_a_branch_that_turns_back_is_not_compared():
    with pytest.raises(Undefined, match="many-valued"):
        effort_at(line([0.0, 1.0, 0.5], [0.0, 1.0, 2.0]), "load", np.array([0.7]))


def test_intervals_that_only_touch_have_nothing_in_common():
    assert overlap([(0.0, 1.0), (1.0, 2.0)]) is None
    assert overlap([(0.0, 1.0), (0.2, 2.0)], Window(0.5, 3.0)) == Window(0.5, 1.0)


def test_a_word_that_tells_curves_apart_leads_the_table_without_a_unit():
    curves = (line([0.0, 0.001], [1.0, 2.0], model="fine"), line([0.0], [1.5], model="a coarse one"))
    table = read_csv(to_csv(curve_table(curves)))
    assert table.headers[:2] == ("model", "branch")
    assert list(table["model"]) == ["fine", "fine", "a coarse one"]


def test_two_curves_a_measurement_and_metrics_are_compared_by_one_function():
    fine, coarse = line([0.0, 2.0], [1.0, 3.0]), line([-1.0, 1.0], [1.5, 3.5], "up")
    found = compare(ComparedSide("fine", fine), ComparedSide("coarse", coarse))
    assert found.window == Window(0.0, 1.0)
    np.testing.assert_allclose(found.curves["load"].values, 1.5)
    points = {"load": Points(np.array([0.5, 3.0]), np.array([2.0, 2.0]), "up", np.array([1.0, 0.0]))}
    found = compare(ComparedSide("measured", points=points), ComparedSide("model", coarse))
    np.testing.assert_array_equal(found.curves["load"].values, [1.0, np.nan])
    before, after = {"a": {"value": 2.0, "unit": "N"}, "b": {"value": "x"}}, {"a": {"value": 2.5, "unit": "N"}}
    changes = compare(
        ComparedSide("before", metrics=before), ComparedSide("spec.yaml", metrics=after), tolerance=0.3
    ).changes
    assert [(one.spec, one.name, one.relative, one.beyond) for one in changes] == [
        ("spec.yaml", "a", 0.25, False),
        ("spec.yaml", "b", None, True),
    ]
    assert changes[0].sentence == "a: 2 -> 2.5 N (+25 %)"


def test_what_cannot_be_compared_says_why():
    some, apart = line([0.0, 1.0], [1.0, 1.0]), line([2.0, 3.0], [1.0, 1.0])
    back = line([0.0, 1.0, 0.5], [0.0, 1.0, 2.0])
    for other, why in ((None, "there is no coarse curve"), (apart, "they have no travel in common")):
        found = compare(ComparedSide("fine", some), ComparedSide("coarse", other))
        assert (found.window, found.curves[""].reason) == (None, why)
    assert "many-valued" in compare(ComparedSide("fine", some), ComparedSide("coarse", back)).curves["load"].reason
