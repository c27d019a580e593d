"""The drawing of a part: to scale, with its main dimensions, its holes and what it is made of."""

from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.plots.workshop_drawing import PAPER_SCALES, drawing_figure, holes, length_in_words

CONFIGS = Path(__file__).parents[2] / "configs"
EXAMPLES = ("cam", "vcfm_ding2022", "beam_lan2010", "slider_crank_li2019", "slider_crank_strip", "slider_crank_lumped")


def texts(figure):
    """Return everything that a figure says."""
    return " ".join(text.get_text() for ax in figure.axes for text in ax.texts)


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_part_is_drawn_to_a_scale_of_paper_with_its_dimensions(name):
    drawing = cfmkit.drawing(cfmkit.load(CONFIGS / f"{name}.yaml"))
    figure = drawing_figure(drawing, name)
    ax = figure.axes[0]
    width = np.ptp(ax.get_xlim())
    scale = figure.get_size_inches()[0] * 25.4 * ax.get_position().width / width
    assert min(abs(scale / one - 1) for one in (*PAPER_SCALES, *(1 / one for one in PAPER_SCALES))) < 1e-9
    found = texts(figure)
    assert "overall" in found
    assert "sheet" in found
    for one in drawing.dimensions:
        assert length_in_words(one.value, 3) in found
    x0, y0, x1, y1 = drawing.extents
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert left < 1e3 * x0 < 1e3 * x1 < right
    assert low < 1e3 * y0 < 1e3 * y1 < high


def test_holes_are_given_from_the_lower_left_corner_of_the_plate():
    drawing = cfmkit.drawing(cfmkit.load(CONFIGS / "cam.yaml"))
    found = list(holes(drawing))
    assert [round(one.diameter * 1e3, 6) for one in found] == [6.6] * 4
    x0, _, x1, _ = drawing.extents
    assert found[0].x + found[1].x == pytest.approx(x1 - x0)  # symmetric
    assert found[0].y == pytest.approx(0.020)  # half of a tab of 40 mm
    assert "6.6 mm (M6)   89.256, 20 mm" in texts(drawing_figure(drawing, "cam"))


def test_what_a_leaf_measures_is_what_its_drawing_says():
    spec = cfmkit.load(CONFIGS / "vcfm_ding2022.yaml")
    span, rise = (
        {one.name: one.value for one in cfmkit.drawing(spec).dimensions}[name] for name in ("span of a leaf", "rise h")
    )
    assert np.hypot(span, rise) == pytest.approx(spec.mechanism.bistable.length, rel=1e-12)
    assert np.arctan2(rise, span) == pytest.approx(spec.mechanism.bistable.angle, rel=1e-12)


def test_the_holes_of_links_are_those_of_their_pins():
    spec = cfmkit.load(CONFIGS / "slider_crank_bought.yaml").replace(
        {"mechanism.pins": {"diameter": "6 mm", "friction": 0.1}}
    )
    drawing = cfmkit.drawing(spec)
    assert [one.diameter for one in holes(drawing)] == pytest.approx([0.006] * 4)
    assert dict(drawing.facts)["links"] == "12 mm wide, ends round"


def test_numbers_of_holes_stand_clear_of_every_line():
    from matplotlib.path import Path as Line

    drawing = cfmkit.drawing(cfmkit.load(CONFIGS / "slider_crank_bought.yaml"))
    figure = drawing_figure(drawing, "links")
    figure.canvas.draw()
    ax = figure.axes[0]
    cut = [Line(line.get_xydata()) for line in ax.lines if line.get_gid() == "cut"]
    numbers = [text for text in ax.texts if text.get_text() in list("1234")]
    assert len(numbers) == 4
    for text in numbers:
        box = text.get_window_extent().transformed(ax.transData.inverted())
        assert not any(line.intersects_bbox(box.shrunk(0.9, 0.9), filled=False) for line in cut)


@pytest.mark.parametrize(
    ("name", "across"), [("beam_lan2010", 69e-3), ("beam_two_layers", 69e-3), ("vcfm_ding2022", None)]
)
def test_a_drawing_says_how_far_apart_the_clamps_are(name, across):
    spec = cfmkit.load(CONFIGS / f"{name}.yaml")
    found = {one.name: one.value for one in cfmkit.drawing(spec).dimensions}
    if across is None:  # a leaf on each side of the shuttle
        across = 2 * found["span of a leaf"] + found["shuttle"]
    assert found["across clamps"] == pytest.approx(across, rel=1e-12)


def test_one_clamp_is_at_no_distance_from_another():
    assert [one.name for one in cfmkit.drawing(cfmkit.load(CONFIGS / "beam_cantilever.yaml")).dimensions] == [
        "tip from root"
    ]


@pytest.mark.parametrize("name", ["beam_lan2010", "beam_design_lan", "vcfm_ding2022", "slider_crank_lumped"])
def test_the_overall_size_of_a_part_with_fillets_is_that_of_its_material(name):
    """Circles that fillets are arcs of lie in the waste: they counted, and the size and the datum of holes were off."""
    drawing = cfmkit.drawing(cfmkit.load(CONFIGS / f"{name}.yaml").replace({"mechanism.part.fillet": "0.4 mm"}))
    points = np.concatenate([one.points(1e-9) for one in drawing.contours if one.layer == "cut"])
    assert drawing.extents == pytest.approx((*points.min(axis=0), *points.max(axis=0)), abs=2e-9)


@pytest.mark.parametrize("name", ["vcfm_titanium", "slider_crank_strip", "slider_crank_tapered", "beam_lan2010"])
def test_the_thickness_on_which_the_force_depends_is_drawn_across_its_beam(name):
    """It was said in words at most: the force goes with its cube."""
    drawing = cfmkit.drawing(cfmkit.load(CONFIGS / f"{name}.yaml"))
    drawn = [one.get_text() for one in drawing_figure(drawing, name).axes[0].texts if one.get_gid() == "thickness"]
    wanted = {one.thickness for one in drawing.sections}
    assert {f"t {length_in_words(min(wanted), 3)}", f"t {length_in_words(max(wanted), 3)}"} <= set(drawn)
    assert len(drawn) == len(set(drawn))
