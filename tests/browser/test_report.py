"""Reports in a real browser: the slider moves mechanism and cursor, tables sort and filter, points open."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from cfmkit.cli.main import main

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
    assert main([*map(str, arguments), "-q"]) == 0


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
