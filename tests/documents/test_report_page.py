"""``report.html``: one file that says what the run's files say, whatever names and texts are in it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import cfmkit
from cfmkit import api
from cfmkit.documents import batch_document, html, html_of_run, html_of_study, run_outcome, sweep_document
from cfmkit.documents.run_document import verdict_of
from cfmkit.errors import ExitCode
from cfmkit.families import family
from cfmkit.families.slider_crank.figures import moving
from cfmkit.plots.figures import moving_of
from cfmkit.plots.poses_in_one_svg import poses
from cfmkit.plots.style import axes_mm, new_figure
from cfmkit.plots.vector_formats import inline, svg
from cfmkit.results import Finding, Result, Status
from cfmkit.runs import suggestion_files
from cfmkit.studies.batch_sources_and_outcomes import Entry

CONFIGS = Path(__file__).parents[2] / "configs"
HOSTILE = "</script><img src=x onerror=alert(1)> \"quoted\" & 'more'"
VOID = {"meta", "input", "br", "wbr", "img", "path", "use", "line", "circle", "link", "hr"}
EXAMPLES = {
    "cam": "cam.yaml",
    "beam": "beam_lan2010.yaml",
    "vcfm": "vcfm_ding2022.yaml",
    "springs": "slider_crank_bilancia2019.yaml",
    "strip": "slider_crank_strip.yaml",
}


class Outline(HTMLParser):
    """What stands in a page: its tags with their attributes, and its text outside of scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text = ""
        self.unbalanced: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if tag in VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.unbalanced.append(tag)

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.text += data


@pytest.fixture(scope="module")
def reports():
    """Return the report on each example, by its name; a few points are enough for a page."""
    specs = {name: cfmkit.load(CONFIGS / file) for name, file in EXAMPLES.items()}
    return {name: run_outcome.report_on(cfmkit.analyze(spec)) for name, spec in specs.items()}


def made(found, command="cfmkit analyze x.yaml"):
    """Return the page of a report as text."""
    drawn = {name: draw() for name, draw in api.figures(found.result).items()}
    return html_of_run.page(found, drawn, command).decode()


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_page_holds_verdict_requirements_metrics_figures_and_film_and_asks_for_nothing(reports, name):
    found = reports[name]
    text = made(found)
    outline = Outline(text)
    assert outline.unbalanced == []
    assert outline.open == []
    assert verdict_of(found) in outline.text
    titles = {attributes.get("title") for _, attributes in outline.tags}
    assert titles >= {one.sentence for one in found.requirements}
    names = {name.partition("[")[0] for name in found.metrics}
    assert all(name in outline.text for name in names)
    assert text.count("<figure") >= len(api.figures(found.result)) + 1
    assert len(set(re.findall(r'data-pose="(\d+)"', text))) > 10
    outside = [
        value
        for _, attributes in outline.tags
        for key, value in attributes.items()
        if key in ("src", "href", "xlink:href", "data", "action") and not (value or "").startswith(("#", "data:"))
    ]
    assert outside == []
    assert "@import" not in text
    assert not re.search(r"url\((?!#)", text)


@pytest.mark.parametrize("name", ["cam", "beam", "springs"])
def test_no_two_parts_of_a_page_have_the_same_id(reports, name):
    ids = [attributes["id"] for _, attributes in Outline(made(reports[name])).tags if "id" in attributes]
    assert len(ids) == len(set(ids))


def test_numbers_that_are_read_in_a_figure_keep_their_digits_on_a_page():
    figure = new_figure(80.0, 60.0)
    ax = axes_mm(figure, (20.0, 20.0, 50.0, 30.0))
    ax.plot([0.0, 0.004], [0.0, 1.0])
    ax.set_title("friction 0.0025, radius 10.125 mm")
    text = Outline(inline(svg(figure), "figure")).text
    assert "friction 0.0025, radius 10.125 mm" in text
    assert "0.002" in text
    assert not re.search(r"\d\.\d{3}[^<>]*>", inline(svg(figure), "figure"))  # those of the drawing are short


@pytest.mark.parametrize("name", ["cam", "vcfm", "strip"])
def test_a_pose_of_a_film_is_drawn_as_if_it_stood_alone(reports, name):
    result = reports[name].result
    shown = moving_of(family(result.spec.family), result)
    together = [ElementTree.tostring(pose) for pose in poses(shown, (0, 7, 16))]
    assert together == [ElementTree.tostring(pose) for number in (0, 7, 16) for pose in poses(shown, (number,))]
    assert len(set(together)) == 3


def test_the_same_report_gives_the_same_bytes(reports):
    assert made(reports["strip"]) == made(reports["strip"])


def test_hostile_names_messages_and_commands_are_text(reports):
    spec = reports["strip"].result.spec.replace({"name": HOSTILE})
    result = replace(reports["strip"].result, spec=spec, warnings=(Finding("odd", HOSTILE, (f"design.x={HOSTILE}",)),))
    text = made(run_outcome.report_on(result), command=f"cfmkit analyze '{HOSTILE}'")
    outline = Outline(text)
    assert outline.unbalanced == []
    assert not any("onerror" in attributes for _, attributes in outline.tags)
    assert outline.text.count(HOSTILE) >= 3


def test_the_cursor_stands_at_the_motion_of_each_pose(reports):
    found = reports["springs"]
    drawn = {name: draw() for name, draw in api.figures(found.result).items()}
    text = html_of_run.page(found, drawn).decode()
    data = json.loads(re.search(r'id="film-data" type="application/json">(.*?)</script>', text)[1])
    cursors = np.array(data["cursors"][-1])
    assert len(data["texts"]) == len(cursors)
    assert np.all(np.diff(cursors) > 0)
    motion = moving(found.result).motion
    line = np.polynomial.Polynomial.fit(motion, cursors, 1)
    np.testing.assert_allclose(line(motion), cursors, atol=0.02)  # the axis is linear; places are rounded to 0.01 pt
    assert data["texts"][-1].startswith("displacement 35 mm, force 1.5")


def test_a_mechanism_without_a_curve_has_a_page_that_says_why(reports):
    spec = reports["cam"].result.spec
    text = made(run_outcome.report_on(Result(spec, Status.NO_EQUILIBRIUM, "the roller holds nothing")))
    assert "no equilibrium" in text
    assert "the roller holds nothing" in text
    assert "No figure was drawn" in text


def swept(tmp_path, **more):
    """Return the files of a small sweep, as the verb writes them."""
    from cfmkit.cli import run_command

    arguments = ["sweep", str(CONFIGS / "cam.yaml"), "--vary", "mechanism.roller_radius=8 mm:10 mm:3", "--report"]
    arguments += ["-o", str(tmp_path / "out"), "--curves", "--metrics", "force_mean", "-q", "--no-plots"]
    assert run_command(arguments) == 0
    return tmp_path / "out"


def test_curves_of_a_page_have_the_points_that_their_drawing_needs():
    x = np.linspace(0, 10, 2001)
    force = np.where(x < 1, 20 * x, 20 + 0.1 * (x - 1) ** 2)
    own = "\n".join(f"5,load,{a},{b}" for a, b in zip(x, force, strict=True))
    back = "\n".join(f"5,unload,{a},{b}" for a, b in ((10, 3), (0, 3), (10, 3)))
    content = f"r [mm],branch,displacement [mm],force [N]\n{own}\n{back}\n".encode()
    drawn = html_of_study._curves(content, ["r [mm]"], [["5"]])["points"][0]
    assert 5 < len(drawn["load"][0]) < 60
    assert 1.0 in drawn["load"][0]
    apart = np.abs(np.interp(x, *drawn["load"]) - force)
    assert apart.max() < 0.001 * force.max()
    assert drawn["unload"] == [[10, 0, 10], [3, 3, 3]]


def test_a_sweep_has_a_page_with_its_points_and_curves(tmp_path):
    out = swept(tmp_path)
    text = (out / "report.html").read_text()
    data = json.loads(re.search(r'id="study-data" type="application/json">(.*?)</script>', text)[1])
    table = cfmkit.sweep(
        CONFIGS / "cam.yaml", vary={"mechanism.roller_radius": "8 mm:10 mm:3"}, metrics=["force_mean"]
    ).table
    assert data["head"][0] == "mechanism.roller_radius [mm]"
    assert data["columns"][0] == [8, 9, 10]
    np.testing.assert_allclose(data["columns"][1], table["force_mean"], rtol=1e-5)
    assert set(data["curves"]["points"]) == {"0", "1", "2"}
    assert set(data["curves"]["points"]["0"]) == {"load", "unload"}
    assert Outline(text).unbalanced == []
    assert "report.html" in json.loads((out / "manifest.json").read_text())["files"]


def test_a_page_of_a_large_sweep_keeps_what_was_varied_and_says_what_is_left_out():
    spec = cfmkit.load(CONFIGS / "cam.yaml")
    metrics = ",".join(f"m{k} [N]" for k in range(60))
    rows = "\n".join(f"{k},{','.join('0.123456789' for _ in range(60))},complete," for k in range(10_000))
    files = {
        "results.csv": f"mechanism.roller_radius [mm],{metrics},status,message\n{rows}\n".encode(),
        "metrics.json": b'{"status": "complete", "message": "", "metrics": {}}',
    }
    summary = {
        "points": {"total": 10_000},
        "requirements": [],
        "best": None,
        "range": {},
        "metrics": {},
        "warnings": [],
    }
    document = sweep_document.document_of(spec, summary, {}, ExitCode.OK)
    found = html_of_study.page(document, spec, ["mechanism.roller_radius"], files, "cfmkit sweep")
    assert len(found) < 5e6
    assert b"more columns are in results.csv" in found
    assert b'"mechanism.roller_radius [mm]"' in found


def test_a_batch_links_the_page_of_each_and_escapes_what_it_says():
    entries = (
        Entry("a/<b>.yaml", "b c", "analyze", "cam", HOSTILE, "complete", written=True),
        Entry(
            "missed.yaml", "missed", "design", "cam", "m", "complete", code=ExitCode.REQUIREMENT_MISSED, written=True
        ),
        Entry("bad.yaml", "bad", status="invalid", code=ExitCode.INVALID, message=HOSTILE),
    )
    document = batch_document.document_of(entries, ExitCode.INVALID)
    text = html.page(document, command="cfmkit batch .").decode()
    outline = Outline(text)
    assert [attributes["href"] for tag, attributes in outline.tags if tag == "a"] == [
        "b%20c/report.html",
        "missed/report.html",
    ]
    assert outline.unbalanced == []
    assert HOSTILE in outline.text
    assert "MISSED" in outline.text
    assert "1 invalid" in outline.text


def test_a_request_has_a_page_with_every_proposal_and_why_there_are_no_more():
    one = {
        "family": "cam", "variant": HOSTILE, "mean": 20.0, "ripple": 0.0123, "hysteresis": None, "safety_factor": 1.7,
        "across": 80.0, "along": 90.5, "depth": None, "parts": 12, "life": None, "stiffening": None,
        "folder": "1-cam-a b", "misses": [], "notes": [HOSTILE], "model": "quasi-static", "unjudged": [HOSTILE],
        "warnings": [HOSTILE], "verdict": "meets", "yield": None,
    }  # fmt: skip
    reported = {
        "status": "complete", "message": "1 meets the requirements",
        "suggest": {"force": "20 N", "envelope": ["1 mm", "2 mm"]},
        "proposals": [one], "unjudged": [], "order": ["size"],
        "near_misses": [one | {"family": "beam", "variant": "b", "misses": ["ripple 9 % > 5 %"], "verdict": "fails"}],
        "families": [{"family": "vcfm", "proposals": 0, "reason": HOSTILE, "nearest": {"travel": "4 mm"}}],
        "warnings": [{"name": "search_cut_short", "message": HOSTILE}],
    }  # fmt: skip
    texts = {"1-cam-a b": f"name: {HOSTILE}"}
    text = suggestion_files.page(reported, ExitCode.OK, texts, {}, HOSTILE).decode()
    outline = Outline(text)
    assert outline.unbalanced == []
    assert {tag for tag, _ in outline.tags}.isdisjoint({"script", "img"})
    assert [attributes["href"] for tag, attributes in outline.tags if tag == "a"] == ["1-cam-a%20b/report.html"]
    for part in ("20 N, envelope 1 mm x 2 mm", "1.2 %", "80x90.5 mm", "ripple 9 % > 5 %", "travel 4 mm", HOSTILE):
        assert part in outline.text, part
