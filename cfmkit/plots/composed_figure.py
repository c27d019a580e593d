"""One figure of several panels, each drawn as if it stood alone at that width, with a letter above it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cfmkit.errors import UsageError
from cfmkit.plots.figure_resizing import laid_out, noted
from cfmkit.plots.style import MM, NORMAL, is_to_scale, size_mm, styled, with_settings

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.plots.figure_options import FigureForm

GAP = 4.0
"""Between panels that stand beside each other [mm], about two letters."""

STRIP = 5.0
"""Above each panel, for its letter [mm]: a line of text."""

NARROWEST = 50.0
"""Of a panel [mm]: in less, the numbers of a map's axis stand on each other (looked at from 40 to 85 mm)."""


@dataclass(frozen=True)
class DrawnPanel:
    """One panel: what draws it, and what stands beside its letter."""

    make: Callable[[], Figure]
    label: str = ""


def composed(panels: Sequence[DrawnPanel], columns: int, form: FigureForm) -> Figure:
    """Return panels as one figure, from left to right and then down.

    Parameters
    ----------
    panels : sequence of DrawnPanel
        At least one.
    columns : int
        Beside each other.
    form : FigureForm
        With the width of the whole.

    Raises
    ------
    cfmkit.errors.UsageError
        If panels would be too narrow to read.
    """
    columns = min(columns, len(panels))
    width = (form.width or 0.174) * 1e3
    cell = (width - GAP * (columns - 1)) / columns
    if cell < NARROWEST:
        fitting = int((width + GAP) // (NARROWEST + GAP))
        raise UsageError(
            f"columns: {columns} panels beside each other in {width:g} mm are {cell:.0f} mm wide each, and one needs "
            f"{NARROWEST:g} mm; allowed are at most {fitting}, or a larger width"
        )
    with with_settings(form.settings, titles=False):
        return _composed(panels, columns, cell)


@styled
def _composed(panels: Sequence[DrawnPanel], columns: int, cell: float) -> Figure:
    layouts, to_scale = [], []
    for panel in panels:
        figure, layout = noted(panel.make)
        to_scale.append(is_to_scale(figure))
        layouts.append(layout.stretched(cell, titles=False, to_scale=to_scale[-1]))
    rows = [range(start, min(start + columns, len(panels))) for start in range(0, len(panels), columns)]
    heights = [max(layouts[k].size[1] for k in row) + STRIP for row in rows]
    widths = [cell, *(size for _ in range(columns - 1) for size in (GAP, cell))]
    whole = Figure(figsize=(sum(widths) * MM, sum(heights) * MM))
    FigureCanvasAgg(whole)
    grid = whole.add_gridspec(len(rows), len(widths), width_ratios=widths, height_ratios=heights)
    for number, row in enumerate(rows):
        for place, k in enumerate(row):
            if not to_scale[k]:  # a diagram beside a taller one is as tall
                layouts[k] = layouts[k].taller(heights[number] - STRIP)
            part = whole.add_subfigure(grid[number, 2 * place])
            layouts[k].host, layouts[k].above = part, STRIP
            laid_out(panels[k].make, layouts[k])
            across, up = size_mm(part)
            letter = f"({chr(ord('a') + k)})"
            look: dict[str, Any] = {"va": "top", "ha": "left", "size": NORMAL + 0.5}
            written = part.text(1.0 / across, 1.0 - 1.0 / up, letter, weight="bold", **look)
            beside = 1.0 + written.get_window_extent().width / part.dpi / MM + 1.5
            part.text(beside / across, 1.0 - 1.0 / up, panels[k].label, **look)
    return whole
