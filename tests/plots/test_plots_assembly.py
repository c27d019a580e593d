"""The assembly beside its parts list, or above it where the paper is narrow."""

import itertools

import pytest

import cfmkit
from cfmkit.plots.figure_options import form_of
from cfmkit.plots.style import size_mm


def test_in_one_column_the_parts_list_stands_below_an_assembly_as_wide_as_the_paper():
    result = cfmkit.analyze(cfmkit.load("configs/cam.yaml"))
    figure = form_of(width="84 mm").draw(cfmkit.figures(result)["assembly"])
    picture, listed = (ax.get_position() for ax in figure.axes)
    width, height = size_mm(figure)
    assert width == pytest.approx(84.0)
    assert figure.texts[0].get_text() == f"{result.spec.name}: assembly"  # no name of usual length is cut
    assert picture.width == pytest.approx(1.0)
    assert picture.y0 == pytest.approx(listed.y1)
    assert (picture.height + listed.height) * height > height - 17.0  # heading and margins
    figure.canvas.draw()
    lines = [text.get_window_extent() for text in figure.axes[1].texts]
    assert all(box.x0 >= 0.0 and box.x1 <= figure.bbox.x1 and box.y0 >= 0.0 for box in lines)
    assert all(upper.y0 >= lower.y0 for upper, lower in itertools.pairwise(lines))
