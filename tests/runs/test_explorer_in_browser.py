"""The explorer in a real browser: a slider moves, curve and badges follow; YAML is shown and saved."""

from __future__ import annotations

import os
import re
import shutil
import threading
from pathlib import Path

import pytest

import cfmkit
from cfmkit.cli import run_command
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
def page(fresh):
    """Return the page with all values unfolded."""
    fresh.locator("#others summary").click()
    return fresh


@pytest.fixture
def fresh(tmp_path):
    text = (CONFIGS / "cam.yaml").read_text().replace("200 mm", "200.00012345 mm", 1)  # more digits than a field shows
    (tmp_path / "cam.yaml").write_text(text)
    server = ExplorerServer(Explorer.from_file(str(tmp_path / "cam.yaml")))
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
    expect(page.locator("#said")).to_contain_text("mine.yaml")
    page.locator("#reset").click()
    expect(page.locator("#verdict strong")).to_have_text("all 3 requirements met")


def test_a_value_that_is_not_allowed_says_why_and_keys_can_be_found(page):
    expect = sync_api.expect
    field = page.locator('.key[data-path="mechanism.springs.stiffness"] input[type="text"]')
    field.fill("-1")
    field.press("Tab")
    expect(page.locator("#verdict strong")).to_have_text("not valid")
    expect(field).to_have_attribute("aria-invalid", "true")
    wrong = page.locator(f"#{field.get_attribute('aria-describedby').split()[1]}")
    expect(wrong).to_be_visible()
    expect(wrong).to_have_text("-1 N/mm is not allowed: must be > 0")
    field.fill("0.69")
    field.press("Tab")
    expect(wrong).to_be_hidden()
    expect(page.locator("#verdict strong")).to_have_text("all 3 requirements met")
    page.locator("#find").fill("roller radius")
    expect(page.locator('.key[data-path="mechanism.roller_radius"]')).to_be_visible()
    expect(field).to_be_hidden()


def test_the_numbers_of_a_list_and_the_requirements_say_what_they_are(page):
    names = {
        path: page.locator(f'.key[data-path="{path}"] label') for path in ("analysis.window.0", "analysis.window.1")
    }
    assert [one.inner_text() for one in names.values()] == ["from", "to"]
    assert "requirements.0: force_ripple" in page.locator("legend").all_inner_texts()
    assert "Dashed: curve of the file" in page.locator("figcaption").first.inner_text()


def test_what_was_moved_goes_back_to_what_stood_there(page):
    fields = page.locator('.key input[type="text"]')
    before = [one.input_value() for one in fields.all()]
    page.get_by_role("slider", name="mechanism.springs.stiffness").press("ArrowRight")
    assert [one.input_value() for one in fields.all()] != before
    page.locator("#reset").click()
    assert [one.input_value() for one in fields.all()] == before


def test_an_explorer_that_was_stopped_says_so_at_every_button(page):
    page.evaluate("() => { window.fetch = () => Promise.reject(new TypeError('no connection')); }")
    for button in ("#copy", "#command", "#save"):
        page.locator(button).click()
        sync_api.expect(
            page.locator("#said, #yaml").filter(has_text="start cfmkit explore again").first
        ).to_be_visible()


STIFFNESS = '.key[data-path="mechanism.springs.stiffness"] input[type="text"]'


def test_the_values_of_the_largest_influence_come_first_and_the_others_are_folded(fresh):
    page = fresh
    page.wait_for_selector("body[data-ranked]", timeout=60_000)
    leading = page.locator("#leading .key").evaluate_all("rows => rows.map((row) => row.dataset.path)")
    assert len(leading) == 5
    assert {"mechanism.springs.stiffness", "mechanism.springs.count"} <= set(leading)  # the force is in proportion
    assert page.locator("#others").evaluate("part => part.open") is False
    page.locator("#find").fill("points")
    sync_api.expect(page.locator('.key[data-path="analysis.points"]')).to_be_visible()
    page.locator("#find").fill("")
    sync_api.expect(page.locator('.key[data-path="analysis.points"]')).to_be_hidden()


def test_a_field_takes_a_decimal_comma_and_another_unit(page):
    expect, verdict = sync_api.expect, page.locator("#verdict span")
    field = page.locator(STIFFNESS)
    field.fill("0,8")
    field.press("Tab")
    expect(field).to_have_value("0.8")
    expect(verdict).to_contain_text("58.7 N load")
    field.fill("800 N/m")
    field.press("Tab")
    expect(field).to_have_value("800 N/m")
    expect(verdict).to_contain_text("58.7 N load")
    assert page.locator("[aria-invalid]").count() == 0


@pytest.mark.parametrize(
    "typed", ["", "x", "1e999", "NaN", "1,2,3", "1 kg", "<img src=x onerror=alert(1)>", "-", "9" * 400]
)
def test_nonsense_is_answered_below_its_field_and_nothing_breaks(page, typed):
    expect, field = sync_api.expect, page.locator(STIFFNESS)
    field.fill(typed)
    field.press("Tab")
    expect(field).to_have_attribute("aria-invalid", "true")
    wrong = page.locator(f"#{field.get_attribute('aria-describedby').split()[1]}")
    expect(wrong).to_be_visible()
    assert wrong.inner_text().strip()
    assert page.locator("img").count() == 0
    page.locator("#undo").click()
    expect(field).to_have_value("0.69")
    expect(page.locator("#verdict strong")).to_have_text("all 3 requirements met")


def test_steps_are_undone_one_by_one_by_the_button_and_by_the_keyboard(page):
    expect, field = sync_api.expect, page.locator(STIFFNESS)
    for value in ("0.7", "0.8"):
        field.fill(value)
        field.press("Tab")
    page.locator("#undo").click()
    expect(field).to_have_value("0.7")
    page.locator("#undo").focus()
    page.keyboard.press("Control+z")
    expect(field).to_have_value("0.69")
    expect(page.locator("#undo")).to_be_disabled()
    expect(page.locator("#reset")).to_be_disabled()


def test_the_curve_is_zoomed_to_its_window_with_bands_and_is_read_by_pointer_and_keyboard(page):
    expect, reading = sync_api.expect, page.locator("#reading")
    assert page.locator("#curve .band").count() == 2  # ripple and deviation
    numbers = [float(text) for text in page.locator("#curve text[text-anchor=end]").all_text_contents()]
    assert min(numbers) > 40
    page.locator("#zoom").click()
    whole = [float(text) for text in page.locator("#curve text[text-anchor=end]").all_text_contents()]
    assert min(whole) == 0
    page.locator("#zoom").click()
    box = page.locator("#curve").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(reading).to_contain_text("mm: load 50.")
    page.mouse.move(0, 0)
    expect(reading).to_be_empty()
    page.locator("#curve").focus()
    page.keyboard.press("ArrowRight")
    first = reading.inner_text()
    assert "N, unload 49." in first
    page.keyboard.press("ArrowRight")
    assert reading.inner_text() != first


def test_the_rows_are_those_of_the_terminal_page(page, tmp_path, capsys):
    assert run_command(["analyze", str(tmp_path / "cam.yaml"), "--no-plots", "-o", str(tmp_path / "out")]) == 0
    verdict, *lines = (re.split(r"\s{2,}", line.strip()) for line in capsys.readouterr().out.splitlines())
    rows = page.locator("#rows tr").evaluate_all(
        "rows => rows.map((row) => [...row.children].map((cell) => cell.textContent))"
    )
    printed = {label: cells for label, *cells in lines}
    shown = [(label, value, rest) for label, value, *rest in rows if label in printed]
    assert len(shown) > 5
    for label, value, rest in shown:
        assert printed[label][0].startswith(value)
        assert printed[label][1:] == [cell for cell in rest if cell]
    assert page.locator("#verdict").inner_text().split("\n")[0].startswith(verdict[-1])


def test_the_command_can_be_copied_and_gives_the_same(page):
    page.locator(STIFFNESS).fill("0.8")
    page.locator(STIFFNESS).press("Tab")
    page.locator("#command").click()
    sync_api.expect(page.locator("#yaml")).to_contain_text("cam.yaml --set 'mechanism.springs.stiffness=0.8 N/mm'")


def test_on_a_phone_the_curve_stays_in_view_and_nothing_is_wider_than_the_screen(page):
    page.set_viewport_size({"width": 360, "height": 740})
    page.locator('.key[data-path="requirements.0.max"], .key').last.scroll_into_view_if_needed()
    box = page.locator("#curve").bounding_box()
    assert 0 <= box["y"] < 200
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_in_the_dark_texts_have_contrast(page):
    page.emulate_media(color_scheme="dark")
    look = page.evaluate(
        "() => [getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"
    )
    assert look == ["rgb(22, 24, 27)", "rgb(232, 232, 232)"]
    ground = page.locator("#view figure svg").evaluate("part => getComputedStyle(part).backgroundColor")
    assert ground == "rgb(244, 244, 242)"  # a light sheet, on which lines and letters are dark
