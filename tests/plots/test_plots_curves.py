"""Curves on axes: every point, in the order of its path, with its branch, stability and name."""

from __future__ import annotations

import numpy as np
import pytest
from plot_support import axes, data_lines, loop_curve

from cfmkit.curves import Curve
from cfmkit.plots.curves import CurveLook, plot_curve
from cfmkit.plots.stacked_line_diagrams import Limit, MarkedRange
from cfmkit.plots.style import new_figure, png


def folded():
    share = np.linspace(0.0, 1.0, 100)
    motion, effort = 0.02 * (share + 0.35 * np.sin(2 * np.pi * share)), 5 * np.sin(2.2 * np.pi * share)
    stable = (share < 0.2) | (share > 0.5)
    return Curve(motion, effort, np.repeat("path", 100), stable)


def test_a_many_valued_curve_is_drawn_in_the_order_of_its_path():
    curve, lines = folded(), data_lines(plot_curve(folded(), axes()))
    solid = np.concatenate([line.get_xydata() for line in lines if line.get_linestyle() == "-"])
    expected = np.column_stack([1e3 * curve.motion, curve.effort])[curve.stable]
    np.testing.assert_allclose(solid, expected)


def test_unstable_parts_are_dashed_named_and_joined_to_the_stable_ones():
    ax = plot_curve(folded(), axes())
    (dashed,) = (line for line in data_lines(ax) if line.get_linestyle() == "--")
    curve = folded()
    first, last = np.flatnonzero(~curve.stable)[[0, -1]]
    np.testing.assert_allclose(dashed.get_ydata(), curve.effort[first - 1 : last + 2])
    assert "unstable" in [text.get_text() for text in ax.texts]


def test_gaps_stay_gaps_and_lone_points_are_dots():
    effort = np.array([1.0, 2.0, np.nan, 3.0, np.nan, 4.0, 5.0])
    ax = plot_curve(Curve(np.arange(7) / 1e3, effort, np.repeat("p", 7), np.ones(7, dtype=bool)), axes())
    line, dot = ax.lines
    np.testing.assert_array_equal(line.get_ydata(), effort)
    assert (dot.get_marker(), dot.get_xydata().tolist()) == (".", [[3.0, 3.0]])


def test_branches_have_names_and_arrows_in_their_own_direction():
    ax = plot_curve(loop_curve(gap=0.2), axes())
    assert {"load", "unload"} <= {text.get_text() for text in ax.texts}
    arrows = [item for item in ax.texts if item.get_text() == ""]
    assert [np.sign(item.xy[0] - item.xyann[0]) for item in arrows] == [1, -1]


def test_branches_that_coincide_share_one_name_and_have_no_arrows():
    ax = plot_curve(loop_curve(gap=0.0), axes())
    assert [text.get_text() for text in ax.texts] == ["load and unload"]


def labelled(count, branches=1):
    curve = loop_curve() if branches == 2 else loop_curve().select_branch("load")
    label = ({"preload": (1e-3 * i, "length")} for i in range(count))
    return [
        Curve(curve.motion, curve.effort * (1 + 0.2 * i), curve.branch, curve.stable, label=next(label))
        for i in range(count)
    ]


@pytest.mark.parametrize(("count", "branches"), [(2, 1), (5, 2), (6, 1), (20, 1)])
def test_several_curves_have_their_own_colours_and_are_named_by_their_values(count, branches):
    ax = plot_curve(labelled(count, branches), axes())
    assert len({line.get_color() for line in data_lines(ax)}) == count
    names = {text.get_text() for text in ax.texts if text.get_text().startswith("preload")}
    assert {"preload 0 mm", f"preload {count - 1} mm"} <= names
    assert len(names) == min(count, 7)
    assert ("thin: unload" in {text.get_text() for text in ax.texts}) == (branches == 2)


def test_a_curve_without_any_value_says_so():
    ax = plot_curve(Curve(np.arange(5.0), np.full(5, np.nan), np.repeat("p", 5), np.ones(5, dtype=bool)), axes())
    assert "no point has a finite value" in [text.get_text() for text in ax.texts]
    assert png(ax.figure)


def test_a_pole_does_not_hide_the_rest_of_the_curve():
    motion = np.linspace(1e-6, 1.0, 400)
    ax = plot_curve(Curve(motion, 50.0 + 1e-4 / motion, np.repeat("p", 400), np.ones(400, dtype=bool)), axes())
    assert 50.0 < ax.get_ylim()[1] < 100.0


@pytest.mark.parametrize("effort", [50.0, -50.0])
def test_zero_force_is_on_the_picture(effort):
    curve = Curve(np.arange(5.0), effort + np.arange(5.0), np.repeat("p", 5), np.ones(5, dtype=bool))
    low, high = plot_curve(curve, axes()).get_ylim()
    assert low <= 0 <= high


def test_levels_and_regions_stand_where_they_should():
    look = CurveLook(levels=(Limit(42.0, "theory"),), regions=(MarkedRange(0.0, 0.004, "corner"),))
    ax = plot_curve(loop_curve(), axes(), look)
    (level,) = (line for line in ax.lines if line.get_transform() != ax.transData and len(set(line.get_ydata())) == 1)
    assert set(level.get_ydata()) == {42.0}
    (region,) = (patch for patch in ax.patches if patch.get_gid() == "no-obstacle" and patch.get_alpha() == 0.12)
    assert (region.get_x(), region.get_width()) == (0.0, pytest.approx(4.0))
    assert {"theory", "corner"} <= {text.get_text() for text in ax.texts}


def test_a_word_that_tells_curves_apart_names_their_lines():
    ax = new_figure().add_axes((0.1, 0.1, 0.8, 0.8))
    motion = np.linspace(0, 1, 20)
    branch, stable = np.repeat("load", 20), np.ones(20, bool)
    words = ("fine", "coarse")
    curves = [Curve(motion, motion + k, branch, stable, label={"model": (words[k], "text")}) for k in (0, 1)]
    plot_curve(curves, ax)
    assert {"fine", "coarse"} <= {text.get_text() for text in ax.texts}
