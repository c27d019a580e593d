"""Pictures of oblique springs: the force with its plateau, and the mechanism to scale."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cfmkit.plots import parts
from cfmkit.plots.curves import CurveLook
from cfmkit.plots.line_diagram import Limit
from cfmkit.plots.loop_figure import loop_figure
from cfmkit.plots.style import new_figure, styled
from cfmkit.plots.text import Heading, value_text, write_heading

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.results import Result
    from cfmkit_oblique.model import Solution


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result, by file stem."""
    return {"loop": partial(loop, result), "mechanism": partial(mechanism, result)}


def loop(result: Result) -> Figure:
    """Return the force over the displacement, with the force of the plateau."""
    force = result.values["plateau_force"].value or 0.0
    level = Limit(force, f"oblique springs flat: {value_text(force, 'force')}")
    return loop_figure(result, CurveLook(levels=(level,)), "force over travel of the slider")


@styled
def mechanism(result: Result) -> Figure:
    """Return the mechanism to scale: relaxed, with the oblique springs flat, and at the end."""
    solution: Solution = result.state
    part, heading = solution.spec.mechanism, Heading.of(result, "mechanism to scale")
    span, base = part.half_span, solution.height - part.vertical.free_length
    end = float(result.curve.motion[-1])
    places = {"relaxed": 0.0, "flat": min(solution.height, end), "end": end}
    box = (-1.3 * span, min(base, solution.height - end) - 0.2 * span, 1.3 * span, solution.height + 0.6 * span)
    slender = (box[3] - box[1]) / (box[2] - box[0])
    size = (min(43.5, 120.0 / slender), min(43.5 * slender, 120.0))
    figure = new_figure(160.0, 10.0 + size[1] + parts.TITLE + heading.height_mm)
    write_heading(figure, heading)
    titles = [f"{name}: {value_text(place, 'length')}" for name, place in places.items()]
    panels = parts.panels(figure, size, titles)
    for ax, place in zip(panels, places.values(), strict=True):
        at = (0.0, solution.height - place)
        for name, anchor in (("left", (-span, 0.0)), ("right", (span, 0.0)), ("base", (0.0, base))):
            parts.spring(ax, anchor, at, 0.12 * span, f"spring-{name}")
            parts.contact(ax, anchor, f"anchor-{name}")
        parts.slider(ax, at, 0.12 * span)
        parts.force_arrow(ax, (at[0], at[1] + 0.5 * span), (at[0], at[1] + 0.1 * span))
        parts.to_scale(ax, box)
        ax.tick_params(labelleft=ax is panels[0])
    panels[0].set_ylabel("y [mm]")
    return figure
