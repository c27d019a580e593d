"""Figures on a page of HTML: the digits that are read, and poses of a film."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest
from html_outline import Outline

import cfmkit
from cfmkit.families import family
from cfmkit.plots.figures import moving_of
from cfmkit.plots.mechanism_in_motion import poses
from cfmkit.plots.style import axes_mm, new_figure
from cfmkit.plots.vector_formats import inline, svg


def test_numbers_that_are_read_in_a_figure_keep_their_digits_on_a_page():
    figure = new_figure(80.0, 60.0)
    ax = axes_mm(figure, (20.0, 20.0, 50.0, 30.0))
    ax.plot([0.0, 0.004], [0.0, 1.0])
    ax.set_title("friction 0.0025, radius 10.125 mm")
    text = Outline(inline(svg(figure), "figure")).text
    assert "friction 0.0025, radius 10.125 mm" in text
    assert "0.002" in text
    assert not re.search(r"\d\.\d{3}[^<>]*>", inline(svg(figure), "figure"))  # those of the drawing are short


@pytest.mark.parametrize("name", ["cam", "vcfm_pla", "slider_crank_strip"])
def test_a_pose_of_a_film_is_drawn_as_if_it_stood_alone(name):
    result = cfmkit.analyze(f"configs/{name}.yaml")
    shown = moving_of(family(result.spec.family), result)
    together = [ElementTree.tostring(pose) for pose in poses(shown, (0, 7, 16))]
    assert together == [ElementTree.tostring(pose) for number in (0, 7, 16) for pose in poses(shown, (number,))]
    assert len(set(together)) == 3
