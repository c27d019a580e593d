"""One figure of several panels: what is beside what, at which width, and what is said of a wrong file."""

import re
from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.cli.main import main
from cfmkit.errors import SpecError, UsageError
from cfmkit.plots.composed_figure import composed
from cfmkit.plots.figure_options import FigureForm
from cfmkit.plots.figure_resizing import FigureLayout
from cfmkit.plots.style import MM, size_mm
from cfmkit.plots.vector_formats import svg
from cfmkit.runs.composed_figure import panels, read
from cfmkit.studies.batch_sources_and_outcomes import files_below
from cfmkit.studies.serial_and_cluster_executors import serial

STUDIES = Path("configs/studies")


@pytest.fixture
def file(tmp_path):
    """Return a function that writes a file of a figure and returns its name."""

    def written(text):
        path = tmp_path / "own.yaml"
        path.write_text(text)
        return str(path)

    return written


def test_panels_stand_side_by_side_with_letters_in_the_width_that_is_given():
    name = str(STUDIES / "figure.yaml")
    asked = read(name, ("width=150 mm",))
    figure = composed(panels(name, asked, serial), asked.columns, FigureForm(width=asked.width))
    assert np.isclose(size_mm(figure)[0], 150)
    assert [[text.get_text() for text in part.texts] for part in figure.subfigs] == [
        ["(a)", "length of the diamond's leaves"],
        ["(b)", "thickness of the diamond's leaves"],
        ["(c)", "angle of the V-beams"],
        ["(d)", "thickness of the V-beams"],
    ]
    lower = [part.bbox.y0 for part in figure.subfigs]
    assert lower[0] == lower[1] > lower[2] == lower[3]
    values = [{text.get_text() for text in part.axes[0].texts} for part in figure.subfigs]
    assert values[0] == {"22 mm", "24 mm", "26 mm", "28 mm"}
    assert values[2] == {"6 deg", "7 deg", "8 deg", "9 deg"}
    inches = figure.subfigs[0].axes[0].get_window_extent().width / figure.dpi
    assert 40 < inches / MM < 60


def test_names_of_axes_stay_below_and_beside_their_axes_in_every_panel(file):
    cam = Path("configs/cam.yaml").resolve()
    name = file(f"panels: [{{run: {cam}, plot: springs}}, {{run: {cam}, plot: loop}}]")
    figure = composed(panels(name, read(name), serial), 2, FigureForm(width=0.174))
    for part in figure.subfigs:
        for ax in part.axes:
            for axis in (ax.xaxis, ax.yaxis):
                axis.get_tightbbox()  # puts the label where it will be drawn
                box = axis.label.get_window_extent()
                assert not axis.label.get_text() or part.bbox.x0 <= box.x0 < box.x1 <= part.bbox.x1
            below = ax.xaxis.label.get_window_extent()
            if ax.xaxis.label.get_text():
                assert abs(below.x0 + below.x1 - ax.bbox.x0 - ax.bbox.x1) < 0.4 * ax.bbox.width


def test_a_diagram_is_stretched_to_the_height_of_its_row_and_keeps_its_margins():
    layout = FigureLayout((80.0, 60.0), [], [(15.0, 12.0, 60.0, 20.0), (15.0, 34.0, 60.0, 20.0)])
    tall = layout.taller(100.0)
    assert tall.size == pytest.approx((80.0, 100.0))
    assert tall.boxes[0] == pytest.approx((15.0, 12.0, 60.0, 40.0))
    assert tall.boxes[1] == pytest.approx((15.0, 54.0, 60.0, 40.0))


def test_a_panel_may_be_the_folder_of_a_run(file, tmp_path):
    assert main(["analyze", "configs/cam.yaml", "-o", str(tmp_path / "run"), "-q", "--no-plots"]) == 0
    name = file("panels: [{run: run, plot: loop}, {run: run, plot: springs}]")
    (loop, springs) = panels(name, read(name), serial)
    direct = cfmkit.api.figures(cfmkit.analyze("configs/cam.yaml"))
    for panel, stem in ((loop, "loop"), (springs, "springs")):
        drawn, expected = panel.make().axes[0], direct[stem]().axes[0]
        assert np.array_equal(drawn.lines[0].get_xydata(), expected.lines[0].get_xydata())


def test_the_folder_of_a_sweep_is_drawn_from_its_files_as_the_sweep_drew_it(file, tmp_path):
    vary = ("mechanism.roller_radius=8 mm:12 mm:3", "mechanism.springs.stiffness=[0.5 N/mm, 0.7 N/mm]")
    options = ("--metrics", "force_mean,force_ripple", "--curves", "-q", "--figures", "svg", "-j", "1")
    swept = ["sweep", "configs/cam.yaml", "--vary", vary[0], "--vary", vary[1], "-o", str(tmp_path / "run"), *options]
    assert main(swept) == 5
    name = file("panels: [{run: run, plot: curves}, {run: run, plot: force_mean}, {run: run, plot: force_ripple}]")
    for panel, stem in zip(panels(name, read(name), serial), ("curves", "force_mean", "force_ripple"), strict=True):
        assert svg(panel.make()) == (tmp_path / "run" / "figures" / f"{stem}.svg").read_bytes()
    (tmp_path / "run" / "results.csv").write_text("nothing\n")
    with pytest.raises(SpecError, match="cannot be drawn from its files: run it again"):
        panels(name, read(name), serial)


def test_the_key_of_a_panel_stands_below_its_letter_and_inside_the_panel(file, tmp_path):
    vary = ("--vary", "mechanism.roller_radius=8 mm:12 mm:3", "--vary", "mechanism.springs.count=[2, 4]")
    run = str(tmp_path / "run")
    assert main(["sweep", "configs/cam.yaml", *vary, "--metrics", "force_mean", "-q", "--no-plots", "-o", run]) == 0
    name = file("panels: [{run: run, plot: force_mean}, {run: run, plot: force_mean}]")
    figure = composed(panels(name, read(name), serial), 2, FigureForm(width=0.174))
    for part in figure.subfigs:
        letter, key = part.texts[0].get_window_extent(), part.legends[0].get_window_extent()
        assert key.y1 < letter.y0
        assert part.bbox.x0 < key.x0 < key.x1 <= part.bbox.x1
        assert key.y0 > part.axes[0].get_window_extent().y1


def test_panels_too_narrow_to_read_are_refused(file):
    name = file("panels: [{run: a, plot: b}, {run: a, plot: b}]\nwidth: 84 mm")
    asked = read(name)
    with pytest.raises(UsageError, match="are 40 mm wide each, and one needs 50 mm; allowed are at most 1"):
        composed([None, None], asked.columns, FigureForm(width=asked.width))


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("panels: []", "panels"),
        ("panels: [{run: a.yaml}]", "own.yaml:1:10: panels.0: the key 'plot' is missing"),
        ("columns: 2", "the key 'panels' is missing"),
        ("panels: [{run: a.yaml, plot: b}]\nwidth: 174", "width"),
        ("panels: [{run: a.yaml, plot: b}]\nrows: 2", "rows"),
    ],
)
def test_a_malformed_file_is_refused_with_the_place(file, text, reported):
    with pytest.raises(SpecError, match=re.escape(reported)):
        read(file(text))


def test_a_picture_or_a_run_that_does_not_exist_is_said_with_those_that_do(file):
    root = Path("configs").absolute()
    for text, reported in (
        (f"panels:\n  - {{run: {root}/cam.yaml, plot: lop}}", "own.yaml:2:.*did you mean 'loop'"),
        (f"panels:\n  - {{run: {root}/cam.yaml, plot: xyz}}", "there are loop"),
        ("panels:\n  - {run: nowhere.yaml, plot: loop}", "own.yaml:2:.*no such file"),
        (f"panels:\n  - {{run: {root}, plot: loop}}", "is not the folder of a run"),
    ):
        name = file(text)
        with pytest.raises(SpecError, match=reported):
            panels(name, read(name), serial)


def test_a_search_for_specifications_passes_files_of_figures_by():
    found = {Path(name).name for name in files_below(str(STUDIES))}
    assert "vcfm_fig9_l1.yaml" in found
    assert "figure.yaml" not in found
