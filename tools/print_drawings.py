"""Print the dimension drawings of the families: the PNG and the PDF beside each SVG.

    python tools/print_drawings.py     # after a change of cfmkit/families/NAME/dimensions.svg

Chromium prints them (the one on the path, or that of CFMKIT_BROWSER). PNG and PDF carry the SHA-256 of the SVG that
they show: a test finds those that are out of date.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
from pathlib import Path

from PIL import Image, PngImagePlugin
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
PRINT_DPI, SCREEN_DPI = 200, 96


def print_drawing(page: Page, drawing: Path) -> None:
    """Write the PNG and the PDF of one drawing."""
    svg = drawing.read_bytes()
    digest = hashlib.sha256(svg).hexdigest()
    width, height = re.findall(rb'(?:width|height)="([\d.]+mm)"', svg)[:2]
    size = {"width": width.decode(), "height": height.decode()}
    page.set_content(f"<style>body {{margin: 0}} svg {{display: block}}</style>{svg.decode()}")
    pdf = page.pdf(**size, print_background=True, tagged=False)
    drawing.with_suffix(".pdf").write_bytes(pdf + f"% SHA-256 of the SVG: {digest}\n".encode())
    info = PngImagePlugin.PngInfo()
    info.add_text("Source", f"SHA-256 of the SVG: {digest}")
    picture = Image.open(io.BytesIO(page.locator("svg").screenshot())).convert("RGB")
    picture = picture.quantize(128, Image.Quantize.MAXCOVERAGE)  # a third of the bytes
    picture.save(drawing.with_suffix(".png"), optimize=True, pnginfo=info, dpi=(PRINT_DPI, PRINT_DPI))


def main() -> None:
    """Print all drawings."""
    browser = os.environ.get("CFMKIT_BROWSER") or shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        page = running.new_page(device_scale_factor=PRINT_DPI / SCREEN_DPI)
        for drawing in sorted(ROOT.glob("cfmkit/families/*/dimensions.svg")):
            print_drawing(page, drawing)
        running.close()


if __name__ == "__main__":
    main()
