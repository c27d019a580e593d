"""Pictures of studies: which there are, what they mark, and that their bytes repeat."""

from dataclasses import replace

import numpy as np
import pytest

import cfmkit
from cfmkit.plots.study import draw_map, draw_metric, figures
from cfmkit.plots.study_data_and_marks import DrawnScale, StudyCurve, StudyMarks
from cfmkit.plots.style import png

X = np.repeat(np.linspace(1.0, 3.0, 5), 4)
Y = np.tile(np.array([4.0, 3.0, 2.0, 1.0]), 5)


def found(count, shape=(), metric=None, words=()):
    values = X * Y if metric is None else metric
    varied = [
        DrawnScale("mechanism.brace_length", "length", X),
        DrawnScale("analysis.kind", "text" if words else "ratio", Y, words),
    ]
    varied.append(DrawnScale("mechanism.roller_radius", "length", Y[::-1]))
    return StudyMarks(tuple(varied[:count]), (DrawnScale("force_ripple", "ratio", values),), shape, values < 6, 3)


def single():
    x = np.array([3.0, 1.0, 2.0])
    metric = DrawnScale("force_mean[load]", "force", np.array([1.0, np.nan, 2.0]))
    return StudyMarks((DrawnScale("a.b", "length", x),), (metric,), (3,), np.array([True, False, True]), 0)


LINES = [StudyCurve(x, {"load": (np.arange(5.0), x + np.arange(5.0) / 5)}) for x in (3.0, 1.0, 2.0)]


@pytest.mark.parametrize(
    ("case", "lines", "names"),
    [
        (single(), LINES, ["curves", "force_mean_load"]),
        (single(), [], ["force_mean_load"]),
        (found(2, (5, 4)), [], ["force_ripple"]),
        (found(2, (5, 4), words=("a", "b", "c", "d", "e")), [], ["force_ripple"]),
        (found(2), [], ["parallel"]),
        (found(3, (5, 2, 2)), [], ["parallel"]),
    ],
)
def test_the_number_of_parameters_decides_which_pictures_there_are(case, lines, names):
    drawn = figures(case, lines, ("displacement [mm]", "force [N]"))
    assert list(drawn) == names
    for draw in drawn.values():
        assert png(draw()) == png(draw())


def test_a_map_has_each_value_in_its_place_whichever_way_the_parameters_run():
    (draw,) = figures(found(2, (5, 4))).values()
    axes = draw().axes[0]
    mesh = axes.collections[0]
    assert np.array_equal(mesh.get_array(), np.outer(np.linspace(1, 3, 5), [1.0, 2.0, 3.0, 4.0]))


def test_what_misses_a_requirement_is_hatched_and_the_best_point_is_marked():
    (draw,) = figures(found(2, (5, 4))).values()
    axes = draw().axes[0]
    assert any(patch.get_hatch() for patch in axes.patches)
    (star,) = [line for line in axes.lines if line.get_marker() == "*"]
    assert (star.get_xdata()[0], star.get_ydata()[0]) == (Y[3], X[3])


def test_nothing_is_hatched_where_everything_is_met():
    (draw,) = figures(found(2, (5, 4), metric=np.ones(20))).values()
    assert not any(patch.get_hatch() for patch in draw().axes[0].patches)


def test_a_gap_stays_a_gap():
    (draw,) = figures(single()).values()
    assert np.isnan(draw().axes[0].lines[0].get_ydata()).tolist() == [True, False, False]


def test_one_value_and_nothing_but_gaps_can_be_drawn():
    lone = StudyMarks(
        (DrawnScale("a.b", "length", np.array([0.0])),),
        (DrawnScale("m", "ratio", np.array([np.nan])),),
        (1,),
        np.array([False]),
    )
    for draw in figures(lone, LINES[:1], ("x", "y")).values():
        assert png(draw())


def level_lines(values, across=(1.0, 2.0, 4.0, 8.0), down=(1.0, 2.0, 3.0)):
    """Return axes, the heights of the level lines of a map, and their points."""
    x, y = np.tile(across, len(down)), np.repeat(down, len(across))
    varied = (DrawnScale("a.down", "length", y), DrawnScale("a.across", "time", x))
    shape = (len(down), len(across))
    case = StudyMarks(
        varied, (DrawnScale("m", "ratio", np.asarray(values, float).ravel()),), shape, np.ones(x.size, bool)
    )
    (draw,) = figures(case).values()
    axes = draw().axes[0]
    sets = [item for item in axes.collections if hasattr(item, "levels")]
    return axes, [] if not sets else sets[0].levels, [] if not sets else sets[0].allsegs


def test_values_that_double_have_a_logarithmic_axis_and_a_tick_each():
    axes, _, _ = level_lines(np.arange(12.0))
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    assert axes.get_xticks().tolist() == [1.0, 2.0, 4.0, 8.0]
    even, _, _ = level_lines(np.arange(12.0), across=(1.0, 2.0, 3.0, 4.0))
    assert even.get_xscale() == "linear"


def test_no_level_line_follows_the_lowest_or_highest_value():
    """A plateau at zero has no edge worth a line: where it ends depends on rounding."""
    _, levels, _ = level_lines([[0, 0, 0, 1.0], [0, 0, 0, 2.0], [0, 0, 0, 6.0]])
    assert len(levels) >= 3
    assert min(levels) > 0.1
    assert max(levels) < 5.9


def test_level_lines_on_a_coarse_grid_are_smooth_and_keep_its_values():
    across = np.array([1.0, 2.0, 4.0, 8.0])
    down = np.array([1.0, 2.0, 3.0])
    _, levels, lines = level_lines(np.outer(down, np.log2(across)) + 1.0)
    points = np.concatenate([line for segments in lines for line in segments])
    heights = np.concatenate([np.full(len(line), at) for at, segs in zip(levels, lines, strict=True) for line in segs])
    assert len(points) > 200
    assert np.abs(points[:, 1] * np.log2(points[:, 0]) + 1.0 - heights).max() < 0.05


def test_words_and_gaps_have_no_lines_between_them():
    gap = np.arange(12.0)
    gap[5] = np.nan
    _, levels, lines = level_lines(gap)
    assert len(levels)
    assert any(len(line) for segments in lines for line in segments)
    (draw,) = figures(found(2, (5, 4), words=("a", "b", "c", "d", "e"))).values()
    assert not [item for item in draw().axes[0].collections if hasattr(item, "levels")]


def test_what_is_constant_but_for_rounding_is_one_place_on_its_axis():
    almost = DrawnScale("m", "length", 0.13 * (1 + 1e-15 * np.arange(20)))
    varied = found(3).varied
    (draw,) = figures(StudyMarks(varied, (almost,), (), np.ones(20, bool))).values()
    axes = draw().axes[0]
    assert {line.get_ydata()[3] for line in axes.lines if len(line.get_ydata()) == 4} == {0.5}


def _one_metric(values, dimension):
    x = DrawnScale("a.b", "length", np.linspace(1.0, 2.0, len(values)))
    (draw,) = figures(StudyMarks((x,), (DrawnScale("m", dimension, values),), x.values.shape, x.values > 0, 0)).values()
    figure = draw()
    figure.canvas.draw()
    return figure, figure.axes[0]


@pytest.mark.parametrize("size", [1e-12, -1e-12, 1e-7, 1e-5])
def test_a_metric_that_hardly_varies_has_tick_labels_inside_the_picture(size):
    figure, axes = _one_metric(0.0527913404921 * (1 + size * np.sin(np.arange(9.0))), "ratio")
    left = min(label.get_window_extent().x0 for label in axes.yaxis.get_ticklabels() if label.get_text())
    assert left > axes.yaxis.label.get_window_extent().x1
    assert axes.yaxis.label.get_window_extent().x0 >= 0
    assert figure.bbox.x1 >= axes.bbox.x1


def test_a_metric_that_varies_by_rounding_only_is_a_level_line_on_an_axis_of_its_own_size():
    _, axes = _one_metric(0.0527913404921 * (1 + 1e-12 * np.sin(np.arange(9.0))), "ratio")
    assert len(set(axes.lines[0].get_ydata())) == 1
    assert np.ptp(axes.get_ylim()) > 1e-3
    noise = 1.0 + 1e-13 * np.arange(20.0)
    (draw,) = figures(found(2, (5, 4), metric=noise)).values()
    assert np.ptp(draw().axes[0].collections[0].get_array()) == 0


def test_a_count_has_whole_numbers_on_its_axis():
    for values in (np.array([2.0, 3.0, 2.0]), np.array([2.0, 2.0, 2.0])):
        _, axes = _one_metric(values, "count")
        assert all(float(tick).is_integer() for tick in axes.get_yticks())


def _texts(figure):
    return [text.get_text() for text in figure.texts]


@pytest.mark.parametrize(("count", "shape"), [(1, (20,)), (2, (5, 4)), (2, ()), (3, (5, 2, 2))])
def test_every_picture_of_a_sweep_says_whose_it_is_and_what_its_marks_mean(count, shape):
    case = replace(found(count, shape), name="my-cam", best_words="best: smallest force ripple (4 tie)")
    for draw in figures(case).values():
        figure = draw()
        assert any(text.startswith("my-cam: ") for text in _texts(figure))
        (key,) = figure.legends
        assert [text.get_text() for text in key.get_texts()] == [
            "best: smallest force ripple (4 tie)",
            "requirement missed, or not solved",
        ]


def test_a_key_has_only_the_marks_that_occur():
    case = replace(found(2, (5, 4)), meets=np.ones(20, bool), best=None)
    (draw,) = figures(case).values()
    assert not draw().legends


def of_one_parameter(values):
    x = np.linspace(7.0, 9.0, 11)
    varied, metric = DrawnScale("roller_radius", "length", x), DrawnScale("force_mean", "force", values(x))
    return StudyMarks((varied,), (metric,), (11,), np.ones(11, bool))


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        (lambda x: 50.66 + 4e-4 * x, "50.6630"),
        (lambda x: 12345678.0 + x, "12345700"),
        (lambda x: 1e-9 * x, "8e−9"),
        (lambda x: 1e9 * x, "8e9"),
        (lambda x: -2e-5 * x, "−1.6e−4"),
    ],
)
def test_a_tick_is_the_whole_value_however_little_it_varies_and_however_small_it_is(values, shown):
    (draw,) = figures(of_one_parameter(values), [], ("", "")).values()
    figure = draw()
    png(figure)
    axis = figure.axes[0].yaxis
    assert axis.get_offset_text().get_text() == ""
    assert shown in [label.get_text() for label in axis.get_ticklabels()]
    assert axis.get_tightbbox().x0 > -0.2 / 25.4 * figure.dpi


def test_the_colours_of_a_map_that_hardly_varies_have_whole_values():
    case = found(2, (5, 4), metric=50.66 + 1e-4 * X * Y)
    (draw,) = figures(case, [], ("", "")).values()
    figure = draw()
    png(figure)
    bar = figure.axes[1].yaxis
    assert bar.get_offset_text().get_text() == ""
    assert "50.6604" in [label.get_text() for label in bar.get_ticklabels()]


def test_the_ends_of_an_axis_of_parallel_axes_are_told_apart_by_their_numbers():
    case = found(3, (5, 2, 2), metric=50.66 + 1e-4 * X * Y)
    (draw,) = figures(case, [], ("", "")).values()
    texts = [text.get_text() for text in draw().axes[0].texts]
    assert {"50.6601", "50.6612"} <= set(texts)


def test_words_are_drawn_as_regions_and_as_steps():
    x, y = np.repeat([1.0, 2.0, 3.0], 4), np.tile([1.0, 2.0, 3.0, 4.0], 3)
    words = ("positive", "zero", "bistable")
    metric = DrawnScale("stiffness_class", "text", (x > 1.5) * 1.0 + (y > 2.5), words)
    scales = DrawnScale("a.rate", "stiffness", x), DrawnScale("b.rate", "stiffness", y)
    found = StudyMarks(scales, (metric,), (3, 4), np.ones(12, bool))
    figure = draw_map(found, metric)
    assert [text.get_text() for text in figure.axes[1].get_yticklabels()] == list(words)
    assert len(png(figure)) > 1000
    line = StudyMarks((DrawnScale("a.rate", "stiffness", x[::4]),), (), (), np.ones(3, bool))
    steps = DrawnScale("stiffness_class", "text", np.array([0.0, 1.0, 2.0]), words)
    assert [text.get_text() for text in draw_metric(line, steps).axes[0].get_yticklabels()] == list(words)


def test_parameters_of_the_same_last_name_are_told_apart():
    """A map of two structures had 'structure' on both axes."""
    spec = cfmkit.load("configs/vcfm_ding2022.yaml").replace({"requirements": ()})
    vary = {f"mechanism.{part}.width": ["5 mm", "6 mm"] for part in ("bistable", "positive")}
    figure = cfmkit.sweep(spec, vary=vary, metrics=["force_ripple"]).figures["force_ripple"]()
    labels = {label.partition(":")[0] for label in (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel())}
    assert labels == {"bistable.width", "positive.width"}
    title = next(text for text in _texts(figure) if text.startswith("ding-2022: "))
    assert " ".join(title.split()).endswith("force ripple over positive width and bistable width")
