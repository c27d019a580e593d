"""Curves of two parameters: a panel for each value of the first, a named line for each of the second."""

import numpy as np
import pytest

from cfmkit.plots.study import MOST_PANELS, can_draw_panels, draw_panels, figures
from cfmkit.plots.study_data_and_marks import DrawnScale, StudyCurve, StudyMarks


def study(first, second):
    points = [(i, k) for i in range(first) for k in range(second)]
    x = np.arange(5.0)
    lines = [StudyCurve(float(k), {"load": (x, (i + 1) * x + k)}, float(i)) for i, k in points]
    words = tuple(f"kind {k}" for k in range(second))
    varied = (
        DrawnScale("a.b", "length", np.array([float(i) for i, _ in points])),
        DrawnScale("a.c", "text", np.array([float(k) for _, k in points]), words),
    )
    metric = DrawnScale("force_mean", "force", np.ones(len(points)))
    return StudyMarks(varied, (metric,), (first, second), np.ones(len(points), bool)), lines


def test_every_value_of_the_first_parameter_has_a_panel_with_a_line_for_each_of_the_second():
    found, lines = study(3, 2)
    figure = draw_panels(found, lines, ("displacement [mm]", "force [N]"))
    assert [len(ax.lines) for ax in figure.axes] == [2, 2, 2]
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["b: 0 mm", "b: 1 mm", "b: 2 mm"]
    assert all({"kind 0", "kind 1"} <= {text.get_text() for text in ax.texts} for ax in figure.axes)


@pytest.mark.parametrize(("first", "second", "fit"), [(2, 3, True), (MOST_PANELS + 1, 2, False), (2, 9, False)])
def test_what_cannot_be_told_apart_is_left_to_the_maps(first, second, fit):
    found, lines = study(first, second)
    assert can_draw_panels(found, lines) is fit
    assert ("curves" in figures(found, lines)) is fit
