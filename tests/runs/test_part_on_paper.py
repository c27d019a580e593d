"""The drawing of a part on a sheet of paper: tolerances, title block, how it is printed, fastened and stopped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit import Run
from cfmkit.runs.exported_files import (
    assumed_tolerances,
    how_to_fasten,
    how_to_print,
    list_stops,
    part_on_paper,
    stated_tolerances,
    weight_in_words,
)
from cfmkit.runs.run import files, part_of, run_design

CONFIGS = Path(__file__).parents[2] / "configs"


def texts(figure):
    """Return everything that a figure says."""
    return " ".join(text.get_text() for ax in figure.axes for text in ax.texts)


def test_a_design_writes_its_drawing_and_names_its_tolerances():
    spec = cfmkit.load(CONFIGS / "cam.yaml").replace(
        {"design.tolerances": {"mechanism.brace_length": {"normal": "0.1 mm"}}}
    )
    report = run_design(spec, Run())
    assert "figures/drawing.png" in dict(files(report))
    assert "figures/drawing.png" not in dict(files(report, plots=False))
    (line,) = stated_tolerances(report.design.spec)
    assert line == "mechanism.brace_length: normal 0.1 mm"


def test_a_drawing_without_stated_tolerances_names_the_process_that_is_assumed():
    lines = assumed_tolerances(cfmkit.load(CONFIGS / "make_finger.yaml"))
    assert lines[:2] == ("process: fdm, assumed", "thickness +- 0.05 mm (standard deviation)")
    assert lines[-1] == "inside corners from 0.2 mm, walls from 0.4 mm"


def test_a_drawing_with_stated_tolerances_names_the_process_too():
    spec = cfmkit.load(CONFIGS / "studies" / "cam_bought_parts.yaml")
    found = texts(part_on_paper(part_of(spec), spec))
    assert "process: laser, assumed" in found
    assert "kerf 0.2 mm" in found
    assert "mechanism.springs.stiffness: normal 2 %" in found
    assert "position +-" not in found


def test_a_drawing_has_a_title_block_whose_weight_is_volume_times_density():
    spec = cfmkit.load(
        CONFIGS / "slider_crank_li2019.yaml",
        [
            "mechanism.material=steel-s235",
            "mechanism.part.sheet=5 mm",
            "mechanism.pins={diameter: 6 mm}",
            "mechanism.links={width: 20 mm}",
        ],
    )
    drawing = part_of(spec)
    long = sum(one.value for one in drawing.dimensions)
    area = 2 * np.pi * 0.010**2 + 0.020 * long - 4 * np.pi * 0.003**2  # two links with round ends, four holes
    assert weight_in_words(drawing, spec) == f"{1e3 * 7850.0 * 0.005 * area:.3g} g, cut part"
    found = texts(part_on_paper(drawing, spec))
    for word in ("revision", "date", "weight", "scale", "projection", "first angle"):
        assert word in found


def test_the_revision_of_a_drawing_changes_with_a_dimension_and_not_with_a_name():
    def revision(*changes):
        spec = cfmkit.load(CONFIGS / "slider_crank_strip.yaml", changes)
        drawn = [one.get_text() for one in part_on_paper(part_of(spec), spec).axes[1].texts]
        return drawn[drawn.index("revision") + 1]

    assert revision() == revision("name=other") != revision("mechanism.beam.thickness=0.95 mm")


@pytest.mark.parametrize(
    ("material", "process", "laid"),
    [
        ("{name: pla, layers: along}", "fdm", "print lying flat"),
        ("{name: pla, layers: across}", "fdm", "print standing"),
        ("pom", "laser", None),
    ],
)
def test_the_drawing_says_how_to_lay_a_printed_part_and_of_how_many_strands_it_is(material, process, laid):
    changes = (f"mechanism.material={material}", f"mechanism.part={{process: {process}}}")
    thick = (*changes, "mechanism.beam.thickness=0.96 mm", "mechanism.part.stock=metric")
    spec = cfmkit.load(CONFIGS / "slider_crank_strip.yaml", thick)
    lines = how_to_print(part_of(spec), spec)
    if laid is None:
        assert lines == ()
    else:
        assert lines[0].startswith(laid)
        assert lines[1] == "0.96 mm are 2.4 strands of 0.4 mm: whole ones are 0.8 mm (2) or 1.2 mm (3)"


@pytest.mark.parametrize(
    ("name", "stops"),
    [
        ("cam", {"upper": "245 mm"}),
        ("slider_crank_strip", {"end": {"gap": "50 mm"}}),
        ("vcfm_pla", {"end": {"gap": "12 mm"}}),
    ],
)
def test_the_drawing_says_where_a_stop_stands_and_that_there_are_no_holes(name, stops):
    spec = cfmkit.load(CONFIGS / f"{name}.yaml").replace({"mechanism.stops": stops})
    ends = [245e-3] if name == "cam" else [stop.gap for stop in spec.mechanism.stops.values()]
    wanted = [f"{1e3 * end:.6g} mm along the motion from the unloaded pose; not drawn" for end in ends]
    assert [line.partition(": ")[2] for line in list_stops(spec)] == wanted
    assert list_stops(spec.replace({"mechanism.stops": None if name == "cam" else {}})) == ()
    assert bool(how_to_fasten(spec)) == (name != "cam")
    if name != "cam":
        assert how_to_fasten(spec.replace({"mechanism.part.screws": "M3"})) == ()
