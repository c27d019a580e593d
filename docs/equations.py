"""Equations as SVG, drawn by matplotlib's mathtext: no script, no font and no LaTeX is fetched or needed."""

from __future__ import annotations

import base64
import io
from html import escape
from typing import TYPE_CHECKING, Any

from docutils import nodes
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from sphinx.application import Sphinx

SIZE = 11.0
"""Height of the letters [pt]."""


FRACTION, LARGE_FRACTION = r"\frac", r"\dfrac"
"""Within a line, and in equations on lines of their own."""


def drawn(formula: str) -> tuple[str, float, float, float]:
    """Return an equation as the address of an SVG, with its width, height and depth below the line [pt]."""
    text = f"${' '.join(formula.split())}$"
    with rc_context({"svg.fonttype": "path", "svg.hashsalt": "equation", "mathtext.fontset": "stix"}):
        figure = Figure(figsize=(12, 2))
        renderer: Any = FigureCanvasAgg(figure).get_renderer()
        shown = figure.text(0, 0, text, fontsize=SIZE)
        box = shown.get_window_extent(renderer)
        _, _, depth = renderer.get_text_width_height_descent(text, shown.get_fontproperties(), ismath=True)
        inches = figure.dpi
        figure.set_size_inches((box.width + 2) / inches, (box.height + 2) / inches)
        shown.set_position((1 / (box.width + 2), (1 + depth) / (box.height + 2)))
        shown.set_verticalalignment("baseline")
        into = io.BytesIO()
        figure.savefig(into, format="svg", transparent=True, metadata={"Date": None})
    points = 72.0 / inches
    address = "data:image/svg+xml;base64," + base64.b64encode(into.getvalue()).decode()
    return address, (box.width + 2) * points, (box.height + 2) * points, (1 + depth) * points


def _image(formula: str) -> str:
    address, width, height, depth = drawn(formula)
    size = f"width:{width:.1f}pt;height:{height:.1f}pt;vertical-align:-{depth:.1f}pt"
    return f'<img class="equation" src="{address}" alt="{escape(formula)}" style="{size}">'


def inline(self: Any, node: nodes.math) -> None:
    """Write an equation within a line."""
    self.body.append(_image(node.astext()))
    raise nodes.SkipNode


def block(self: Any, node: nodes.math_block) -> None:
    """Write equations on lines of their own: ``\\\\\\\\`` parts them."""
    lines = [line for line in node.astext().replace("\\\\", "\n").splitlines() if line.strip()]
    self.body.append(
        "".join(f'<p class="equation">{_image(line.replace(FRACTION, LARGE_FRACTION))}</p>' for line in lines)
    )
    raise nodes.SkipNode


STYLE = """
p.equation { margin: 0.6em 0 0.6em 2em; overflow-x: auto; }
img.equation { max-width: none; }
body[data-theme="dark"] img.equation { filter: invert(1); }
@media (prefers-color-scheme: dark) { body:not([data-theme="light"]) img.equation { filter: invert(1); } }
"""


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathtext", (inline, None), (block, None))
    app.connect("html-page-context", _add_style)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _add_style(_app: Sphinx, _page: str, _template: str, context: dict[str, Any], _doctree: Any) -> None:
    context["metatags"] = context.get("metatags", "") + f"<style>{STYLE}</style>"
