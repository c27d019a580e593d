"""``report.html``: one file that says what the run's files say, whatever names and texts are in it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from html_outline import HOSTILE, Outline

import cfmkit
from cfmkit import api
from cfmkit.documents import batch_document, html, report_html, run_outcome, study_documents
from cfmkit.documents.run_document import verdict_of
from cfmkit.errors import ExitCode
from cfmkit.families import family
from cfmkit.results import Finding, Result, Status
from cfmkit.studies import Entry

CONFIGS = Path(__file__).parents[2] / "configs"
EXAMPLES = {
    "cam": "cam.yaml",
    "beam": "beam_lan2010.yaml",
    "vcfm": "vcfm_ding2022.yaml",
    "springs": "slider_crank_bilancia2019.yaml",
    "strip": "slider_crank_strip.yaml",
}


@pytest.fixture(scope="module")
def reports():
    """Return the report on each example, by its name; a few points are enough for a page."""
    specs = {name: cfmkit.load(CONFIGS / file) for name, file in EXAMPLES.items()}
    return {name: run_outcome.report_on(cfmkit.analyze(spec)) for name, spec in specs.items()}


def made(found, command="cfmkit analyze x.yaml"):
    """Return the page of a report as text."""
    drawn = {name: draw() for name, draw in api.figures(found.result).items()}
    return report_html.run_page(found, drawn, command).decode()


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
    text = report_html.run_page(found, drawn).decode()
    data = json.loads(re.search(r'id="film-data" type="application/json">(.*?)</script>', text)[1])
    cursors = np.array(data["cursors"][-1])
    assert len(data["texts"]) == len(cursors)
    assert np.all(np.diff(cursors) > 0)
    motion = family("slider-crank").draw.moving(found.result).motion
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
    drawn = report_html._curves(content, ["r [mm]"], [["5"]])["points"][0]
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
    document = study_documents.sweep_document(spec, summary, {}, ExitCode.OK)
    found = report_html.study_page(document, spec, ["mechanism.roller_radius"], files, "cfmkit sweep")
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
