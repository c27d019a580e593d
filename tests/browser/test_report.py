"""Reports in a real browser: the slider moves mechanism and cursor, tables sort and filter, points open."""

from __future__ import annotations

import csv
import json
import os
import re
import shlex
import shutil
from pathlib import Path

import pytest

from cfmkit.cli import run_command

sync_api = pytest.importorskip("playwright.sync_api")
CONFIGS = Path(__file__).parents[2] / "configs"
BROWSER = os.environ.get("CFMKIT_BROWSER") or shutil.which("chromium") or shutil.which("chromium-browser")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(BROWSER is None, reason="no Chromium: install it or name one in CFMKIT_BROWSER"),
]


@pytest.fixture(scope="module")
def browser():
    """Return a running browser."""
    with sync_api.sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield running
        running.close()


@pytest.fixture
def opened(browser):
    """Return what opens a page; it must ask nothing of the network and say nothing in the console."""
    requests, errors = [], []
    page = browser.new_page()
    page.on("request", lambda one: requests.append(one.url))
    page.on("console", lambda one: errors.append(one.text) if one.type == "error" else None)
    page.on("pageerror", lambda one: errors.append(str(one)))

    def go(path):
        page.goto(path.as_uri())
        return page

    yield go
    page.close()
    assert errors == []
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []


def run(*arguments):
    assert run_command([*map(str, arguments), "-q"]) == 0


def test_the_slider_moves_the_mechanism_the_cursor_and_the_text(opened, tmp_path):
    run("analyze", CONFIGS / "slider_crank_bilancia2019.yaml", "-o", tmp_path, "--report", "--no-plots")
    page = opened(tmp_path / "report.html")
    cursor, moment = page.locator(".cursor").last, page.locator("#moment")
    before = cursor.get_attribute("x1"), moment.inner_text(), page.locator(".pose.now").first.inner_html()
    page.locator("#pose").focus()
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    after = cursor.get_attribute("x1"), moment.inner_text(), page.locator(".pose.now").first.inner_html()
    assert float(after[0]) > float(before[0])
    assert after[1] != before[1]
    assert after[2] != before[2]
    assert {one.get_attribute("data-pose") for one in page.locator(".pose.now").all()} == {"6"}


def test_without_scripts_everything_can_be_read(browser, tmp_path):
    run("analyze", CONFIGS / "cam.yaml", "-o", tmp_path, "--report", "--no-plots")
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((tmp_path / "report.html").as_uri())
    assert page.locator("h1").inner_text() == "sanchez-salinas-2022"
    assert page.locator(".pose:visible").count() > 0
    assert not page.locator("#pose").is_visible()
    assert page.locator(".warnings strong").first.is_visible()
    context.close()


def test_points_of_a_sweep_sort_filter_and_open(opened, tmp_path):
    run(
        *("sweep", CONFIGS / "cam.yaml", "--vary", "mechanism.roller_radius=8 mm:12 mm:5"),
        *("--metrics", "force_mean,undercut_travel", "--curves", "--no-plots", "--report", "-o", tmp_path),
    )
    page = opened(tmp_path / "report.html")
    rows = page.locator("#table tbody tr")
    assert rows.count() == 5
    page.locator("#table th").first.click()
    page.locator("#table th").first.click()
    assert rows.first.locator("td").first.inner_text() == "12"
    page.locator("#filter").fill("undercut")
    assert 0 < rows.count() < 5
    page.locator("#filter").fill("")
    page.locator("#sliders input").focus()
    page.keyboard.press("ArrowRight")
    assert rows.count() == 1
    assert page.locator("#point svg polyline").count() == 2


UNNAMED = """() => [
  ...[...document.querySelectorAll("input, button, select")].filter((one) => {
    const label = one.labels && one.labels.length ? one.labels[0].textContent.trim() : "";
    const shown = getComputedStyle(one).display !== "none";
    return shown && !one.getAttribute("aria-label") && !label && !one.textContent.trim();
  }),
  ...[...document.querySelectorAll("[tabindex]")].filter((one) => {
    const heading = document.getElementById(one.getAttribute("aria-labelledby"));
    const cell = ["TH", "TR"].includes(one.tagName);  // they have a role of their own, and are named by their text
    const name = one.getAttribute("aria-label") || (heading || (cell ? one : null))?.textContent.trim();
    return !(cell || one.getAttribute("role")) || !name;
  }),
  ...[...document.querySelectorAll("svg")].filter((one) => {
    return one.getAttribute("role") !== "img" || !one.getAttribute("aria-label");
  }),
].map((one) => one.outerHTML.slice(0, 80))"""
"""What a screen reader has no name for."""

CONTRAST = """() => {
  const light = (colour) => {
    const linear = (one) => one <= 0.03928 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4;
    const [r, g, b] = colour.match(/[0-9.]+/g).map((one) => linear(one / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const paper = light(getComputedStyle(document.body).backgroundColor);
  return Math.min(...[...document.querySelectorAll("p, td, th, dt, dd, li, h1, h2, summary, figcaption, code")]
    .filter((one) => one.offsetParent && !one.closest("svg"))
    .map((one) => light(getComputedStyle(one).color))
    .map((ink) => (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05)));
}"""
"""The smallest contrast of a text with the page [WCAG 2, sec. 1.4.3: 4.5 or more]."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Return the pages of a run, of a sweep with curves and of a batch, by what they are."""
    root = tmp_path_factory.mktemp("pages")
    vary = (
        "--vary",
        "mechanism.roller_radius=8 mm:12 mm:3",
        "--vary",
        "mechanism.springs.stiffness=[0.6 N/mm, 0.69 N/mm]",
    )
    run("analyze", CONFIGS / "cam.yaml", "-o", root / "run", "--report", "--no-plots")
    run(
        "sweep",
        CONFIGS / "cam.yaml",
        *vary,
        "--report",
        "-j",
        "1",
        "-o",
        root / "sweep",
    )
    run("batch", CONFIGS / "cam.yaml", "-o", root / "batch", "--report", "--no-plots", "-j", "1")
    return {name: root / name / "report.html" for name in ("run", "sweep", "batch")}


@pytest.mark.parametrize("name", ["run", "sweep", "batch"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_can_be_read_by_everybody_on_a_desk_a_telephone_and_paper(browser, pages, name, scheme):
    context = browser.new_context(color_scheme=scheme, viewport={"width": 380, "height": 800})
    page = context.new_page()
    page.goto(pages[name].as_uri())
    assert page.evaluate(UNNAMED) == []
    assert page.evaluate(CONTRAST) >= 4.5
    assert page.evaluate("document.documentElement.scrollWidth") <= 380
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 720, "height": 1000})
    right = (
        "Math.max(...[...document.querySelectorAll('table, svg, pre')].map((one) => one.getBoundingClientRect().right))"
    )
    assert page.evaluate(right) <= 720
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.locator("button:visible, input:visible").count() == 0
    context.close()


def test_tables_sort_and_points_open_from_the_keyboard(opened, pages):
    page = opened(pages["sweep"])
    head, rows = page.locator("#table th").first, page.locator("#table tbody tr")
    head.focus()
    for key, order, first in (("Enter", "ascending", "8"), ("Space", "descending", "12")):
        page.keyboard.press(key)
        assert head.get_attribute("aria-sort") == order
        assert rows.first.locator("td").first.inner_text() == first
    rows.first.focus()
    page.keyboard.press("Space")
    spec = CONFIGS / "cam.yaml"
    assert f"cfmkit analyze {spec} --set 'mechanism.roller_radius=12 mm'" in page.locator("#point").inner_text()
    assert page.locator("#point").evaluate("one => one.getBoundingClientRect().top < innerHeight")
    assert rows.first.get_attribute("class") == "pick chosen"
    assert page.locator("#less").is_disabled()
    assert page.locator("#more").is_disabled()
    page.locator("#filter").fill("(.*[")
    assert rows.count() == 0
    assert page.locator("#count").inner_text().startswith("0 to 0 of 0")


def test_the_command_of_a_point_computes_that_point(opened, tmp_path):
    changed = ["--set", "mechanism.rolling_friction=0.003", "--fidelity", "quasi-static"]
    vary = ["--vary", "mechanism.roller_radius=8 mm:9 mm:4", "--metrics", "force_mean"]
    run("sweep", CONFIGS / "cam.yaml", *changed, *vary, "--report", "--no-plots", "-o", tmp_path / "sweep")
    page = opened(tmp_path / "sweep" / "report.html")
    page.locator("#table tbody tr").nth(1).click()
    _, *command = shlex.split(page.locator("#point code").inner_text())
    run(*command, "--no-plots", "-o", tmp_path / "point")
    row = list(csv.DictReader((tmp_path / "sweep" / "results.csv").read_text().splitlines()))[1]
    assert f"mechanism.roller_radius={row['mechanism.roller_radius [mm]']} mm" in command
    point = json.loads((tmp_path / "point" / "metrics.json").read_text())["metrics"]
    assert float(row["force_mean [N]"]) == pytest.approx(point["force_mean"]["value"], rel=1e-12)


def test_names_of_branches_stand_above_the_curves(opened, tmp_path):
    run(
        *("sweep", CONFIGS / "cam.yaml", "--vary", "mechanism.roller_radius=[8 mm, 9 mm]", "--curves"),
        *("--metrics", "force_mean", "--report", "--no-plots", "-o", tmp_path),
    )
    page = opened(tmp_path / "report.html")
    page.locator("#table tbody tr").first.click()
    lines = [one.bounding_box()["y"] for one in page.locator("#point polyline").all()]
    for name in ("load", "unload"):
        box = page.locator("#point text", has_text=re.compile(f"^{name}$")).bounding_box()
        assert box["y"] + box["height"] <= min(lines)
