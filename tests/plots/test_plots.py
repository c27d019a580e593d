"""Pictures of any family look the same everywhere, and what is written on them can be read."""

from __future__ import annotations

import io
import itertools
import os
import struct
import subprocess
import sys
import warnings
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from PIL import Image
from plot_support import axes, data_lines, loop_curve, result_of

from cfmkit import Spec
from cfmkit.families import Family
from cfmkit.plots.axis_labels_and_headings import Heading, axis_label, top_axis, value_text, write_heading
from cfmkit.plots.curves import curve_figure, plot_curve
from cfmkit.plots.figures import figures
from cfmkit.plots.label_placement import Label, place_labels
from cfmkit.plots.style import (
    BAND_GREEN,
    LINE_COLOURS,
    LINE_TAN,
    SPRING_OCHRE,
    TEXT_GREY,
    TEXT_INK,
    TROUBLE_RED,
    new_figure,
    png,
    style,
)
from cfmkit.results import Result, Status

ROOT = Path(__file__).parents[2]


def test_drawing_leaves_the_settings_of_the_session_as_they_were():
    before = dict(matplotlib.rcParams)
    png(curve_figure(result_of()))
    assert dict(matplotlib.rcParams) == before


def test_settings_of_the_session_change_no_picture():
    expected = png(curve_figure(result_of()))
    odd = {"font.size": 20, "lines.linewidth": 9, "axes.facecolor": "red", "savefig.bbox": "tight", "axes.grid": False}
    with matplotlib.rc_context(odd):
        assert png(curve_figure(result_of())) == expected


def test_settings_come_back_when_drawing_fails():
    before = dict(matplotlib.rcParams)
    with pytest.raises(RuntimeError), style():
        raise RuntimeError
    assert dict(matplotlib.rcParams) == before
    with style():
        assert matplotlib.rcParams["axes.grid"]


PROBE = """
import hashlib, sys
import cfmkit
from cfmkit.families import family
from cfmkit.plots.figures import figures
from cfmkit.plots.style import png
result = cfmkit.analyze(cfmkit.load(sys.argv[1]))
for name, draw in sorted(figures(family("cam"), result).items()):
    print(name + ".png", hashlib.sha256(png(draw())).hexdigest())
print("imported", sorted({"matplotlib.pyplot", "scipy", "tkinter", "pandas"} & set(sys.modules)))
"""

USERS_FILE = """
backend: tkagg
figure.facecolor: yellow
font.family: serif
font.size: 30
axes.grid: False
lines.linewidth: 8
savefig.dpi: 30
savefig.bbox: tight
path.sketch: 1, 100, 2
text.parse_math: True
image.cmap: gray
"""


def drawn_in_a_process(folder, seed, **variables):
    folder.mkdir()
    environment = dict(os.environ, PYTHONHASHSEED=seed, **variables)
    command = [sys.executable, "-c", PROBE, str(ROOT / "configs/cam.yaml")]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_two_processes_draw_the_same_bytes_whatever_the_users_matplotlibrc_says(tmp_path):
    plain = drawn_in_a_process(tmp_path / "one", "1")
    (tmp_path / "matplotlibrc").write_text(USERS_FILE)
    odd = drawn_in_a_process(tmp_path / "two", "2", MATPLOTLIBRC=str(tmp_path / "matplotlibrc"))
    assert "loop.png" in plain
    assert plain == odd
    assert plain.endswith("imported []\n")


def chunks(data):
    position = 8
    while position < len(data):
        (size,) = struct.unpack(">I", data[position : position + 4])
        yield data[position + 4 : position + 8].decode(), data[position + 8 : position + 8 + size]
        position += size + 12


def test_a_png_holds_the_picture_only_at_its_print_size():
    found = dict(chunks(png(new_figure(160, 100))))
    assert set(found) == {"IHDR", "pHYs", "IDAT", "IEND"}
    width, height = struct.unpack(">II", found["IHDR"][:8])
    per_metre = struct.unpack(">II", found["pHYs"][:8])
    assert (width / per_metre[0], height / per_metre[1]) == (
        pytest.approx(0.160, abs=2e-4),
        pytest.approx(0.1, abs=2e-4),
    )


def test_a_png_shows_what_the_figure_shows():
    figure = new_figure(40, 30)
    figure.patch.set_facecolor("#123456")
    figure.text(0.5, 0.5, "words", color="white")
    pixels = Image.open(io.BytesIO(png(figure, dpi=100)))
    assert pixels.getpixel((0, 0)) == (0x12, 0x34, 0x56)
    with style():
        figure.dpi = 100
        figure.canvas.draw()
        np.testing.assert_array_equal(np.asarray(pixels), np.asarray(figure.canvas.buffer_rgba())[:, :, :3])


SIGHT = {
    "any": np.eye(3),
    "without green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "without red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "without blue": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
"""Machado et al. 2009, severity 1, on linear RGB."""


def linear(color):
    code = np.array([int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def lightness_and_hue(rgb):
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(np.maximum(to_xyz @ np.clip(rgb, 0, 1) / np.array([0.9505, 1.0, 1.089]), 0.008856))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("sight", SIGHT)
def test_line_colours_differ_for_every_kind_of_colour_vision(sight):
    seen = [lightness_and_hue(np.array(SIGHT[sight]) @ linear(color)) for color in LINE_COLOURS]
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 30


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize("other", [*(line for line in LINE_COLOURS if line != LINE_TAN), TEXT_GREY])
def test_springs_differ_from_the_lines_beside_them_for_every_kind_of_colour_vision(sight, other):
    spring, beside = (lightness_and_hue(np.array(SIGHT[sight]) @ linear(color)) for color in (SPRING_OCHRE, other))
    assert np.linalg.norm(spring - beside) > (28 if other == TEXT_GREY else 30)  # what is grey is dashed, too


@pytest.mark.parametrize("color", [*LINE_COLOURS, SPRING_OCHRE, BAND_GREEN, TROUBLE_RED, TEXT_GREY, TEXT_INK])
def test_every_colour_of_text_stands_out_from_paper(color):
    luminance = np.array([0.2126, 0.7152, 0.0722]) @ linear(color)
    assert 1.05 / (luminance + 0.05) > 3.0


def test_axis_labels_carry_units():
    force, torque = plot_curve(loop_curve(), axes()), plot_curve(loop_curve("torque"), axes())
    assert (force.get_xlabel(), force.get_ylabel()) == ("displacement [mm]", "force [N]")
    assert (torque.get_xlabel(), torque.get_ylabel()) == ("angle [deg]", "torque [N*mm]")
    assert axis_label("max_stress", "stress") == "max stress [MPa]"


def test_torque_curves_are_drawn_in_degrees_and_newton_millimetres():
    line = data_lines(plot_curve(loop_curve("torque"), axes()))[0]
    assert line.get_xdata()[-1] == pytest.approx(np.degrees(0.1))
    assert line.get_ydata()[-1] == pytest.approx(1e3 * loop_curve().effort[200])


@pytest.mark.parametrize(
    ("value", "dimension", "text"),
    [
        (0.0113969, "length", "11.4 mm"),
        (-0.5, "force", "−0.5 N"),
        (0.0187, "ratio", "1.87 %"),
        (1e-15, "ratio", "< 0.01 %"),
    ],
)
def test_values_on_pictures_are_short_and_have_units(value, dimension, text):
    assert value_text(value, dimension) == text


def width_of(text):
    box = text.get_window_extent()
    return box.x0, box.x1


@pytest.mark.parametrize("name", ["short", "a name that goes on " * 10, "$x^2 & {", "恒力机构", "two\nlines"])
def test_headings_stay_on_the_paper_on_one_line_and_keep_their_subject(name):
    figure = new_figure()
    write_heading(figure, Heading(name, "the subject", "a note that says at length what is wrong " * 5))
    title, note = figure.texts
    assert title.get_text().endswith(": the subject")
    assert "\n" not in title.get_text()
    assert note.get_text().startswith("a note that says")
    for text in (title, note):
        low, high = width_of(text)
        assert low >= 0
        assert high <= figure.bbox.width - 3 / 25.4 * figure.dpi + 1
    assert png(figure)


def test_a_name_with_dollar_signs_is_written_as_it_is():
    figure = new_figure()
    write_heading(figure, Heading("$5 and $6", "subject"))
    assert figure.texts[0].get_text() == "$5 and $6: subject"
    assert not figure.texts[0].get_parse_math()


def test_letters_that_the_font_lacks_alarm_nobody():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert png(curve_figure(result_of(name="恒力机构")))


def test_a_run_that_did_not_complete_says_so_above_the_picture():
    figure = curve_figure(result_of(status=Status.PARTIAL, message="the cable ran out"))
    assert "partial: the cable ran out" in [text.get_text() for text in figure.texts]
    assert len(curve_figure(result_of()).texts) == 1


def test_the_second_axis_writes_each_value_where_it_belongs():
    ax = axes()
    ax.set_xlim(0.0, 10.0)
    places = np.linspace(0.0, 10.0, 200)
    top_axis(ax, places, places**2, "square [1]")
    top = ax.figure.axes[1]
    shown = {float(text.get_text()): place for text, place in zip(top.get_xticklabels(), top.get_xticks(), strict=True)}
    assert len(shown) >= 5
    for value, place in shown.items():
        assert place == pytest.approx(np.sqrt(value), abs=0.05)


def boxes_of(texts):
    return [text.get_window_extent() for text in texts]


def test_names_avoid_lines_and_each_other_and_stay_inside():
    ax = axes()
    ax.set_xlim(0, 10)
    ax.set_ylim(0, 10)
    x = np.linspace(0, 10, 100)
    lines = [np.column_stack([x, 5 + slope * (x - 5)]) for slope in (-0.9, -0.2, 0.3, 0.8)]
    for line in lines:
        ax.plot(*line.T)
    texts = place_labels(ax, [Label(f"a line with number {i}", "k", line) for i, line in enumerate(lines)])
    boxes = boxes_of(texts)
    assert len(boxes) == 4
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    for box, line in itertools.product(boxes, lines):
        assert not box.count_contains(ax.transData.transform(line))
    for box in boxes:
        assert ax.bbox.x0 <= box.x0 < box.x1 <= ax.bbox.x1
        assert ax.bbox.y0 <= box.y0 < box.y1 <= ax.bbox.y1


def test_a_name_stands_nearest_to_its_own_line():
    ax = axes()
    ax.set_xlim(0, 10)
    ax.set_ylim(0, 10)
    x = np.linspace(0, 10, 100)
    low, high = (np.column_stack([x, np.full(100, y)]) for y in (3.0, 6.0))
    for line in (low, high):
        ax.plot(*line.T)
    text, other = place_labels(ax, [Label("low", "k", low), Label("high", "k", high)])
    ends = [ax.transData.inverted().transform(item.get_window_extent().get_points())[:, 1] for item in (text, other)]
    assert abs(ends[0].mean() - 3.0) < 1.0
    assert abs(ends[1].mean() - 6.0) < 1.0


def test_no_name_stands_where_lines_run_together():
    ax = axes()
    ax.set_xlim(-1, 10)
    ax.set_ylim(-1, 10)
    x = np.linspace(0, 9, 100)
    lines = [np.column_stack([x, slope * x]) for slope in (0.3, 0.4)]
    for line in lines:
        ax.plot(*line.T)
    texts = place_labels(ax, [Label(name, "k", line, prefer=0.0) for name, line in zip("ab", lines, strict=True)])
    left = [ax.transData.inverted().transform(box.get_points())[0, 0] for box in boxes_of(texts)]
    assert min(left) > 1.0


def test_no_leader_runs_through_another_name():
    ax = axes()
    ax.set_xlim(0, 10)
    ax.set_ylim(0, 10)
    end = np.array([[6.0, 5.0]])
    ax.plot([0.0, 6.0], [5.0, 5.0])
    texts = place_labels(ax, [Label(f"model {i}", "k", end, toward=(1.0, 0.0)) for i in range(3)])
    leaders = [line for line in ax.lines if line.get_transform() == ax.transAxes]
    assert len(leaders) == 2
    for line in leaders:
        ends = ax.transAxes.transform(line.get_xydata())
        places = ends[0] + np.linspace(0.05, 1.0, 50)[:, None] * (ends[1] - ends[0])
        assert not any(box.count_contains(places) for box in boxes_of(texts))


def test_what_lies_outside_the_axes_gets_no_name():
    ax = axes()
    ax.set_xlim(0, 1)
    ax.set_ylim(0, 1)
    assert (
        place_labels(ax, [Label("far", "k", np.array([[5.0, 5.0], [6.0, 6.0]])), Label("", "k", np.zeros((1, 2)))])
        == []
    )


def test_a_family_without_pictures_of_its_own_still_gets_its_curve():
    family = Family("any", "", Spec, {"only": lambda spec, run: result_of()})
    found = figures(family, result_of())
    assert list(found) == ["curve"]
    assert png(found["curve"]()).startswith(b"\x89PNG")


def test_nothing_solved_is_nothing_drawn():
    family = Family("any", "", Spec, {"only": lambda spec, run: result_of()})
    assert figures(family, Result(result_of().spec, Status.INFEASIBLE)) == {}


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("lost", ["HOME", "XDG_CACHE_HOME"])
def test_pictures_need_no_folder_of_the_user_that_can_be_written(tmp_path, named, lost):
    """A service account has none: matplotlib complained on standard error and listed all fonts in every run."""
    program = (
        "import os, cfmkit.plots.style as look; figure = look.new_figure(); figure.text(0, 0, 'a'); look.png(figure); "
        "print(os.environ['MPLCONFIGDIR'])"
    )
    hidden = {"XDG_CONFIG_HOME", "XDG_CACHE_HOME", "MPLCONFIGDIR"}
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    environment |= {"HOME": str(tmp_path), "TMPDIR": str(tmp_path), lost: "/dev/null"}
    environment |= {"MPLCONFIGDIR": str(tmp_path / "own")} if named else {}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    kept = Path(done.stdout.strip())
    assert kept == (tmp_path / "own" if named else tmp_path / f"cfmkit-fonts-{os.getuid()}")
    assert "Matplotlib" not in done.stderr
    assert list(kept.glob("fontlist*"))
