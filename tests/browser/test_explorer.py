"""The explorer in a real browser: a slider moves, curve and badges follow; YAML is shown and saved."""

from __future__ import annotations

import os
import shutil
import threading
from pathlib import Path

import pytest

import cfmkit
from cfmkit.runs.explorer import Explorer
from cfmkit.runs.explorer_server import ExplorerServer

sync_api = pytest.importorskip("playwright.sync_api")
CONFIGS = Path(__file__).parents[2] / "configs"
BROWSER = os.environ.get("CFMKIT_BROWSER") or shutil.which("chromium") or shutil.which("chromium-browser")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(BROWSER is None, reason="no Chromium: install it or name one in CFMKIT_BROWSER"),
]


@pytest.fixture
def page(tmp_path):
    text = (CONFIGS / "cam.yaml").read_text().replace("200 mm", "200.00012345 mm", 1)  # more digits than a field shows
    (tmp_path / "cam.yaml").write_text(text)
    server = ExplorerServer(Explorer.of(str(tmp_path / "cam.yaml")))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    errors, urls = [], []
    with sync_api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        opened = browser.new_page()
        opened.on("request", lambda one: urls.append(one.url))
        opened.on("console", lambda one: errors.append(one.text) if one.type == "error" else None)
        opened.on("pageerror", lambda one: errors.append(str(one)))
        file = server.write_redirect().as_uri()
        opened.goto(file)
        opened.wait_for_url(server.address)
        yield opened
        browser.close()
    server.shutdown()
    server.server_close()
    thread.join()
    assert errors == []
    assert [url for url in urls if not url.startswith(f"http://127.0.0.1:{server.server_port}/")] == [file]


def test_a_slider_moves_and_the_curve_and_the_badges_follow(page, tmp_path):
    expect = sync_api.expect
    curve, badges = page.locator("#curve path.now").first, page.locator("#badges li")
    before = curve.get_attribute("d")
    assert badges.count() == len(cfmkit.load(tmp_path / "cam.yaml").requirements)
    assert page.locator("#badges li.bad").count() == 0
    slider = page.get_by_role("slider", name="mechanism.springs.stiffness")
    slider.focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
    expect(page.locator("#curve path.before").first).to_be_attached()
    expect(curve).not_to_have_attribute("d", before)
    page.keyboard.press("End")
    expect(page.locator("#verdict strong")).to_have_text("1 of 3 requirements missed")
    assert page.locator("#badges li.bad").count() > 0
    expect(page.locator("#mechanism svg")).to_be_visible()
    styled = "e => [...e.querySelectorAll('[data-style]')].every((part) => part.style.length > 0)"
    assert page.locator("#mechanism").evaluate(styled)
    page.locator("#copy").click()
    expect(page.locator("#yaml")).to_contain_text("stiffness:")
    page.locator("#name").fill("mine.yaml")
    page.locator("#save").click()
    expect(page.locator("#said")).to_have_text("saved as mine.yaml")
    saved = cfmkit.load(tmp_path / "mine.yaml").mechanism.springs.stiffness
    assert saved > cfmkit.load(tmp_path / "cam.yaml").mechanism.springs.stiffness
    page.locator("#save").click()
    expect(page.locator("#said")).to_contain_text("in the way")
    page.locator("#reset").click()
    expect(page.locator("#verdict strong")).to_have_text("all 3 requirements met")


def test_a_value_that_is_not_allowed_says_why_and_keys_can_be_found(page):
    expect = sync_api.expect
    field = page.locator('.key[data-path="mechanism.springs.stiffness"] input[type="text"]')
    field.fill("-1")
    field.press("Tab")
    expect(page.locator("#verdict strong")).to_have_text("not valid")
    expect(page.locator("#verdict span")).to_contain_text("stiffness")
    page.locator("#find").fill("roller radius")
    expect(page.locator('.key[data-path="mechanism.roller_radius"]')).to_be_visible()
    expect(field).to_be_hidden()


def test_the_numbers_of_a_list_and_the_requirements_say_what_they_are(page):
    names = {
        path: page.locator(f'.key[data-path="{path}"] label') for path in ("analysis.window.0", "analysis.window.1")
    }
    assert [one.inner_text() for one in names.values()] == ["from", "to"]
    assert "requirements.0: force_ripple" in page.locator("legend").all_inner_texts()
    assert page.locator("figcaption").first.inner_text().startswith("dashed: as in the file")


def test_what_was_moved_goes_back_to_what_stood_there(page):
    fields = page.locator('.key input[type="text"]')
    before = [one.input_value() for one in fields.all()]
    page.get_by_role("slider", name="mechanism.springs.stiffness").press("ArrowRight")
    assert [one.input_value() for one in fields.all()] != before
    page.locator("#reset").click()
    assert [one.input_value() for one in fields.all()] == before


def test_an_explorer_that_was_stopped_says_so_at_every_button(page):
    page.evaluate("() => { window.fetch = () => Promise.reject(new TypeError('no connection')); }")
    for button in ("#copy", "#save"):
        page.locator(button).click()
        sync_api.expect(
            page.locator("#said, #yaml").filter(has_text="start cfmkit explore again").first
        ).to_be_visible()
