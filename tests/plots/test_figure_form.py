"""Figures for print: another width, formats, no headings, a style file; text stays text, bytes repeat."""

import itertools
import re

import numpy as np
import pytest

import cfmkit
from cfmkit import api
from cfmkit.errors import UsageError
from cfmkit.plots import style
from cfmkit.plots.axis_labels_and_headings import Heading, write_heading
from cfmkit.plots.figure_options import DEFAULT_FORM, FigureForm, form_of
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.parts import to_scale

SIZE = style.INCHES_PER_MM


def made(scaled=False):
    figure = style.new_figure(160, 100)
    write_heading(figure, Heading("name", "subject"))
    for left, wide in ((16, 112), (133, 4)):
        ax = style.axes_mm(figure, (left, 14, wide, 76))
    if scaled:
        to_scale(figure.axes[0], (0.0, 0.0, 0.2, 0.1))
    ax.set_xlabel("x")
    return figure


def boxes(figure):
    """Return left, bottom, width and height of every axes [mm]."""
    size = figure.get_size_inches() / SIZE
    return [
        np.array([*(box.p0 * size), *(box.size * size)])
        for box in (ax.get_position(original=True) for ax in figure.axes)
    ]


def tight(figure):
    """Return left, bottom, right and top of everything that is drawn of each axes [mm]."""
    figure.canvas.draw()
    found = [ax.get_tightbbox() for ax in figure.axes]
    return np.array([[box.x0, box.y0, box.x1, box.y1] for box in found]) / figure.dpi / SIZE


def test_another_width_keeps_axes_beside_each_other_and_all_of_them_on_the_paper():
    narrow = form_of(width="84 mm").draw(made)
    width, height = style.size_mm(narrow)
    assert np.isclose(width, 84)
    assert 60 < height < 110
    wide, bar = boxes(narrow)
    assert wide[0] + wide[2] < bar[0]
    assert np.allclose(wide[[1, 3]], bar[[1, 3]])
    assert wide[2] / bar[2] == pytest.approx(112 / 4, rel=0.05)
    extents = tight(narrow)
    assert (extents[:, :2] >= 0).all()
    assert (extents[:, 2:] <= (width, height)).all()
    assert extents[:, 0].min() < 4  # nothing is left free that the numbers do not need
    assert extents[:, 2].max() > 80


def test_what_is_to_scale_changes_by_one_factor_in_both_directions():
    axes, _ = boxes(form_of(width="84 mm").draw(lambda: made(scaled=True)))
    assert axes[2] / axes[3] == pytest.approx(112 / 76, rel=1e-3)


def test_without_titles_the_heading_and_its_room_are_gone():
    with_heading, without = (FigureForm(titles=titles).draw(made) for titles in (True, False))
    assert [text.get_text() for text in with_heading.texts] == ["name: subject"]
    assert without.texts == []
    free = [style.size_mm(one)[1] - tight(one)[:, 3].max() for one in (with_heading, without)]
    assert free[1] < 3.0 < free[0]


def test_what_is_wrong_is_said_without_titles_too():
    def failed():
        figure = style.new_figure()
        style.axes_mm(figure, (16, 14, 120, 70))
        write_heading(figure, Heading("name", "subject", "partial: it ended early"))
        return figure

    assert [text.get_text() for text in FigureForm(titles=False).draw(failed).texts] == ["partial: it ended early"]


@pytest.fixture(scope="module")
def cam():
    return cfmkit.analyze("configs/cam.yaml")


def test_the_same_figure_has_the_same_bytes_in_every_format(cam):
    form = form_of("png,svg,pdf", "84 mm", titles=False)
    loop = {"loop": api.figures(cam)["loop"]}
    first, second = dict(form.files(loop)), dict(form.files(loop))
    assert list(first) == ["figures/loop.png", "figures/loop.svg", "figures/loop.pdf"]
    assert first == second
    assert "displacement [mm]" in first["figures/loop.svg"].decode()
    assert b"/FontFile2" in first["figures/loop.pdf"]
    assert b"/Type3" not in first["figures/loop.pdf"]
    width = re.search(rb'width="([\d.]+)pt"', first["figures/loop.svg"])[1]
    assert np.isclose(float(width), 84 / 25.4 * 72, atol=0.01)


def test_every_figure_can_be_drawn_for_one_column(cam):
    for name, draw in api.figures(cam).items():
        figure = form_of(width="84 mm").draw(draw)
        assert np.isclose(style.size_mm(figure)[0], 84), name
        for box in boxes(figure):
            assert box[2] > 3, name


def test_a_style_file_changes_the_look_and_only_inside(cam, tmp_path):
    file = tmp_path / "own.mplstyle"
    file.write_text("axes.grid: False\nsavefig.dpi: 100\n")
    form = form_of(style=str(file))
    loop = {"loop": api.figures(cam)["loop"]}
    ours, theirs = dict(DEFAULT_FORM.files(loop)), dict(form.files(loop))
    assert ours != theirs
    assert dict(DEFAULT_FORM.files(loop)) == ours


@pytest.mark.parametrize(
    ("given", "reported"),
    [
        ({"formats": "png,jpg"}, "there is no format 'jpg'"),
        ({"formats": " , "}, "there are png, svg, pdf"),
        ({"width": "84"}, "write '84 mm'"),
        ({"width": "5 mm"}, "must be 60 mm"),
        ({"style": "nowhere.mplstyle"}, "cannot be read"),
    ],
)
def test_a_malformed_request_is_refused_in_one_line(given, reported):
    with pytest.raises(UsageError, match=re.escape(reported)):
        form_of(**given)


@pytest.mark.parametrize(
    ("text", "reported"),
    [("font.siz: 4", "font.siz"), ("pdf.fonttype: 3", "not a style file's"), ("font.size: large-ish", "font.size")],
)
def test_a_style_file_that_says_something_wrong_is_refused(text, reported, tmp_path):
    file = tmp_path / "own.mplstyle"
    file.write_text(text)
    with pytest.raises(UsageError, match=re.escape(reported)) as caught:
        form_of(style=str(file))
    assert "\n" not in str(caught.value)


def side_by_side():
    figure = style.new_figure(160, 90)
    write_heading(figure, Heading("name", "subject"))
    for number, left in enumerate((16, 64, 112)):
        ax = style.axes_mm(figure, (left, 14, 43, 56))
        ax.tick_params(labelleft=number == 0)
        ax.set_ylabel("a name that is long [mm]" * (number == 0))
    return figure


def test_boxes_that_would_be_too_narrow_beside_each_other_stand_below_each_other_with_their_own_scales():
    narrow = form_of(width="84 mm").draw(side_by_side)
    found = boxes(narrow)
    assert np.allclose(style.size_mm(narrow)[0], 84)
    assert style.size_mm(narrow)[1] <= 230
    lows = [box[1] for box in found]
    assert lows == sorted(lows, reverse=True)
    assert all(upper[1] > lower[3] for upper, lower in itertools.pairwise(tight(narrow)))
    assert all(label.get_visible() for ax in narrow.axes for label in ax.get_yticklabels())
    wide = form_of(width="140 mm").draw(side_by_side)
    assert len({box[1] for box in boxes(wide)}) == 1


def test_the_unit_of_a_long_axis_name_goes_to_a_line_of_its_own():
    def low():
        figure = style.new_figure(160, 60)
        style.axes_mm(figure, (16, 14, 130, 30)).set_ylabel("a name that is long [mm]")
        style.axes_mm(figure, (16, 50, 130, 8)).set_ylabel("y")
        return figure

    assert form_of(width="84 mm").draw(low).axes[0].get_ylabel() == "a name that is long\n[mm]"


def test_panels_side_by_side_below_a_wide_diagram_stand_below_each_other_in_a_column():
    row = [(17.0 + 47.25 * k, 12.0, 43.5, 30.0) for k in range(3)]

    def drawn():
        figure = style.new_figure(160.0, 100.0)
        for box in (*row, (17.0, 62.0, 138.0, 30.0)):
            style.axes_mm(figure, box)
        for ax in figure.axes[:3]:
            to_scale(ax, (0.0, 0.0, 0.435, 0.3))
        return figure

    extents = tight(form_of(width="84 mm").draw(drawn))
    order = np.argsort(-extents[:, 1])
    assert order.tolist() == [3, 0, 1, 2]
    assert all(extents[above, 1] > extents[below, 3] for above, below in itertools.pairwise(order))
    assert extents[:, 2].max() <= 84.0


def test_a_heading_stays_on_a_narrow_paper():
    figure = style.new_figure(84.0, 60.0)
    write_heading(
        figure, Heading("sanchez-salinas-2022", "force over travel of the shuttle, from the unloaded position")
    )
    (text,) = figure.texts
    assert text.get_window_extent().x1 <= figure.bbox.width
    assert text.get_text() == "force over travel of the shuttle, from the unloaded position"


def test_names_of_axes_and_lines_stay_on_a_narrow_paper_and_off_the_curve():
    result = cfmkit.analyze(cfmkit.load("configs/slider_crank_li2019.yaml"))
    figure = form_of(width="84 mm").draw(api.figures(result)["joints"])
    figure.canvas.draw()
    assert all(ax.yaxis.label.get_window_extent().x0 > 0.0 for ax in figure.axes)


def test_a_name_that_would_cover_its_line_is_broken():
    figure = style.new_figure(84.0, 60.0)
    ax = style.axes_mm(figure, (17.0, 12.0, 60.0, 30.0))
    across = np.linspace(0.0, 1.0, 60)
    points = np.column_stack([across, 0.5 + 0.45 * np.sin(7.0 * across)])
    ax.plot(*points.T)
    ax.set_xlim(0, 1)
    ax.set_ylim(0, 1)
    (text,) = place_labels(ax, [Label("a name of four words, rather long", "black", points)])
    box = text.get_window_extent()
    dots = ax.transData.transform(points)
    inside = (dots > [box.x0, box.y0]) & (dots < [box.x1, box.y1])
    assert not inside.all(axis=1).any()


def test_notes_and_names_below_axes_stay_on_a_narrow_paper():
    def drawn():
        figure = style.new_figure()
        ax = style.axes_mm(figure, (60.0, 20.0, 95.0, 60.0))
        ax.set_xlabel("change of the yield when the tolerance is halved,\n95 % interval [percentage points]")
        figure.text(
            0.02, 0.9, "200 parts;  mean 50.758, sd 0.553;  95 % in 49.623 ... 51.863;  94.0 % within limits", size=8
        )
        return figure

    figure = form_of(width="84 mm").draw(drawn)
    figure.canvas.draw()
    for text in (figure.axes[0].xaxis.label, *figure.texts):
        box = text.get_window_extent()
        assert box.x0 >= 0.0
        assert box.x1 <= figure.bbox.width


def test_a_plain_figure_has_lines_their_names_and_axes_but_no_bands_notes_or_heading(cam):
    draw = api.figures(cam)["loop"]
    full, plain = draw(), form_of(plain=True).draw(draw)
    assert len(full.axes) == 2
    (ax,) = plain.axes
    assert plain.texts == []
    assert sorted(text.get_text() for text in ax.texts if text.get_text()) == ["load", "unload"]
    assert [one for one in ax.get_children() if one.get_gid() == "band"] == []
    assert any(one.get_gid() == "band" for one in full.axes[1].get_children())
    assert len(ax.lines) == 2
    springs = form_of(plain=True).draw(api.figures(cam)["springs"])
    assert len(springs.axes[0].lines) == 1


@pytest.mark.parametrize("name", ["contact", "curvature", "mechanism", "undercut"])
def test_every_plain_figure_can_be_drawn_for_one_column(cam, name):
    figure = form_of(plain=True, width="84 mm").draw(api.figures(cam)[name])
    assert figure.texts == []
    assert (tight(figure)[:, 2] <= 84.0).all()


def test_the_colours_of_poses_are_named_in_one_column_too():
    result = cfmkit.analyze("configs/beam_lan2010.yaml")
    for width in ("84 mm", "60 mm"):
        figure = form_of(width=width).draw(api.figures(result)["shapes"])
        figure.canvas.draw()
        key = [text for text in figure.axes[0].texts if text.get_text().endswith(" mm")]
        assert [text.get_text() for text in key] == ["4.5 mm", "9 mm", "13.5 mm", "18 mm"]
        assert len({text.get_color() for text in key}) == 4
        written = [text.get_window_extent() for text in [*key, *figure.texts]]
        assert all(box.x0 >= 0 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1 for box in written)
        assert not any(one.overlaps(other) for k, one in enumerate(written) for other in written[:k])


def test_the_curve_of_an_earlier_run_is_drawn_beside_the_new_one(cam, tmp_path):
    from cfmkit.tables import curve_table, to_csv

    folder = tmp_path / "before"
    folder.mkdir()
    earlier = cfmkit.analyze(cfmkit.load("configs/cam.yaml", ["mechanism.springs.stiffness=0.6 N/mm"]))
    (folder / "curve.csv").write_bytes(to_csv(curve_table(earlier.curves)))
    figure = form_of(overlay=str(folder)).draw(api.figures(cam)["loop"])
    drawn = [line for line in figure.axes[1].lines if line.get_gid() == "earlier"]
    assert len(drawn) == 2
    np.testing.assert_allclose(drawn[0].get_ydata(), earlier.curve.select_branch("load").effort)
    assert "earlier: before" in [text.get_text() for text in figure.axes[1].texts]
    assert [line for line in api.figures(cam)["loop"]().axes[1].lines if line.get_gid() == "earlier"] == []


def test_an_overlay_that_is_none_is_refused_in_one_line(cam, tmp_path):
    with pytest.raises(UsageError, match=re.escape("there is no curve.csv; name the folder of a design or analysis")):
        form_of(overlay=str(tmp_path))
    (tmp_path / "curve.csv").write_text("a,b\n1,2\n")
    with pytest.raises(UsageError, match="is not a curve of cfmkit"):
        form_of(overlay=str(tmp_path))
    (tmp_path / "curve.csv").write_text("branch,angle [deg],torque [N*mm],stable\nload,0,0,true\nload,1,2,true\n")
    with pytest.raises(UsageError, match="a curve of torque, and this one is of force"):
        form_of(overlay=str(tmp_path)).draw(api.figures(cam)["loop"])
