"""Requirements on pictures: the band is where the requirement is, and says whether it is kept."""

from __future__ import annotations

import numpy as np
import pytest
from plot_support import axes, band_boxes, flipped, loop_curve, result_of

from cfmkit.curves import Curve
from cfmkit.plots.bands_from_requirements import bands_of, limits_on
from cfmkit.plots.curves import CurveLook, choose_enlarged_range, curve_figure, plot_curve
from cfmkit.plots.style import BAND_GREEN, TROUBLE_RED
from cfmkit.results import Quantity

UP = 50.0 * 1.02
"""Largest force on the way up [N]; from 20 to 100 mm it falls from 0.996 to 0.964 of that."""


@pytest.mark.parametrize(
    ("requirement", "low", "high"),
    [
        ({"metric": "force_ripple", "max": "5 %"}, 0.95 * 0.996 * UP, 0.996 * UP),
        ({"metric": "half_band", "max": "2 %"}, 0.98 * 0.98 * UP, 1.02 * 0.98 * UP),
        ({"metric": "deviation_from_mean[load]", "max": "2 %"}, 0.98 * 0.98 * UP, 1.02 * 0.98 * UP),
        ({"metric": "deviation_from_target", "max": "3 %"}, 48.5, 51.5),
        ({"metric": "force_min", "min": "40 N"}, 40.0, None),
        ({"metric": "force_max[unload]", "max": "55 N"}, None, 55.0),
    ],
)
def test_the_band_is_drawn_where_the_requirement_is(requirement, low, high):
    result = result_of(requirement | {"over": (0.02, 0.1)})
    ax = plot_curve(result, axes())
    ((left, bottom, right, top),) = band_boxes(ax)
    assert (left, right) == (pytest.approx(20.0), pytest.approx(100.0))
    assert bottom == pytest.approx(ax.get_ylim()[0] if low is None else low)
    assert top == pytest.approx(ax.get_ylim()[1] if high is None else high)


def test_the_band_of_a_ripple_is_that_of_the_branch_named_or_the_worst():
    curve = loop_curve()
    wavy = np.where(curve.branch == "unload", 1.0 + 0.03 * np.sin(400 * curve.motion), 1.0)
    result = result_of(
        {"metric": "force_ripple", "max": "5 %", "over": (0.02, 0.1)},
        {"metric": "force_ripple[load]", "max": "5 %", "over": (0.02, 0.1)},
        curve=Curve(curve.motion, curve.effort * wavy, curve.branch, curve.stable),
    )
    worst, load = bands_of(result)
    assert (worst.text.split()[1], load.text.split()[1]) == ("(unload)", "(load)")
    assert load.high == pytest.approx(0.996 * UP)
    assert worst.high < load.high


@pytest.mark.parametrize(("limit", "met", "color"), [("5 %", True, BAND_GREEN), ("1 %", False, TROUBLE_RED)])
def test_a_band_says_in_words_and_colour_whether_it_is_kept(limit, met, color):
    result = result_of({"metric": "force_ripple", "max": limit, "over": (0.02, 0.1)})
    ax = plot_curve(result, axes())
    (band,) = bands_of(result)
    assert band.met is met
    assert ("missed" in band.text) is not met
    assert "3.21 %" in band.text
    (name,) = (text for text in ax.texts if text.get_text() == band.text)
    assert name.get_color() == color


def test_the_band_of_a_negative_force_lies_below_zero():
    (band,) = bands_of(result_of({"metric": "force_ripple", "max": "5 %", "over": (0.02, 0.1)}, curve=flipped()))
    assert (band.low, band.high) == (pytest.approx(-0.996 * UP), pytest.approx(-0.95 * 0.996 * UP))


def test_a_band_about_the_target_stays_where_the_curve_ends_early_and_has_no_value():
    result = result_of({"metric": "deviation_from_target", "max": "3 %", "over": (0.02, 0.2)})
    (band,) = bands_of(result)
    assert (band.start, band.stop, band.low) == (0.02, 0.2, pytest.approx(48.5))
    assert band.text.endswith("no value")
    ((_, _, right, _),) = band_boxes(plot_curve(result, axes()))
    assert right == pytest.approx(200.0)


def test_requirements_that_do_not_bound_the_force_draw_no_band():
    result = result_of(
        {"metric": "hysteresis_area", "max": "5 N*mm"},
        {"metric": "force_mean", "min": "5 N"},
        {"metric": "force_ripple", "min": "1 %"},
        {"metric": "deviation_from_target", "max": "3 %"},
        target=None,
    )
    assert bands_of(result) == ()


def test_requirements_on_a_value_of_the_family_are_limits_in_its_diagram():
    values = {"stretch_max": Quantity(0.15, "length", "")}
    (limit,) = limits_on(result_of({"metric": "stretch_max", "max": "140 mm"}, values=values), "stretch_max")
    assert (limit.value, limit.text, limit.trouble) == (0.14, "required ≤ 140 mm", True)


def test_the_band_gets_a_panel_of_its_own_that_shows_all_of_it():
    result = result_of({"metric": "force_ripple", "max": "5 %", "over": (0.02, 0.1)})
    upper, lower = curve_figure(result).axes
    ((_, low, _, high),) = band_boxes(lower)
    assert upper.get_xlim() == pytest.approx(lower.get_xlim())
    assert lower.get_ylim()[0] < low < high < lower.get_ylim()[1]
    assert np.ptp(lower.get_ylim()) < 0.5 * np.ptp(upper.get_ylim())
    assert upper.get_ylim()[0] == 0


def test_a_curve_that_shows_well_on_its_own_has_one_panel():
    motion = np.linspace(0.0, 0.1, 50)
    curve = Curve(motion, 500 * motion, np.repeat("p", 50), np.ones(50, dtype=bool))
    result = result_of(curve=curve, target=None)
    assert choose_enlarged_range(result, CurveLook()) is None
    assert len(curve_figure(result).axes) == 1


def test_rounding_errors_are_not_enlarged():
    motion = np.linspace(0.0, 0.1, 50)
    effort = 50.0 * (1 + 1e-14 * np.sin(1000 * motion))
    curve = Curve(motion, effort, np.repeat("p", 50), np.ones(50, dtype=bool))
    detail = choose_enlarged_range(result_of(curve=curve), CurveLook())
    assert detail is not None
    assert detail[1] == (pytest.approx(49.9), pytest.approx(50.1))
