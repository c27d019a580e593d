"""Pictures of oblique springs: the force with its plateau, and the mechanism to scale."""

from collections.abc import Callable
from functools import partial

from matplotlib.figure import Figure

from cfmkit.plots import parts
from cfmkit.plots.axis_labels_and_headings import Heading, value_text
from cfmkit.plots.curves import CurveLook, curve_figure
from cfmkit.plots.stacked_line_diagrams import Limit
from cfmkit.plots.style import apply_style
from cfmkit.results import Result
from cfmkit_oblique.model import Solution


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result, by file stem."""
    return {"loop": partial(loop, result), "mechanism": partial(mechanism, result)}


def loop(result: Result) -> Figure:
    """Return the force over the displacement, with the force of the plateau."""
    force = result.values["plateau_force"].value or 0.0
    level = Limit(force, f"oblique springs flat: {value_text(force, 'force')}")
    return curve_figure(result, CurveLook(levels=(level,)), "force over travel of the slider")


@apply_style
def mechanism(result: Result) -> Figure:
    """Return the mechanism to scale: relaxed, with the oblique springs flat, and at the end."""
    solution: Solution = result.state
    span, base = solution.part.half_span, solution.height - solution.part.vertical.free_length
    end = float(result.curve.motion[-1])
    places = {"relaxed": 0.0, "flat": min(solution.height, end), "end": end}
    box = (-1.3 * span, min(base, solution.height - end) - 0.2 * span, 1.3 * span, solution.height + 0.6 * span)
    titles = [f"{name}: {value_text(place, 'length')}" for name, place in places.items()]
    figure, panels = parts.poses(Heading.from_result(result, "mechanism to scale"), box, titles)
    for ax, place in zip(panels, places.values(), strict=True):
        at = (0.0, solution.height - place)
        for name, anchor in (("left", (-span, 0.0)), ("right", (span, 0.0)), ("base", (0.0, base))):
            parts.spring(ax, anchor, at, 0.12 * span, f"spring-{name}")
            parts.contact(ax, anchor, f"anchor-{name}")
        parts.slider(ax, at, 0.12 * span)
        parts.force_arrow(ax, (at[0], at[1] + 0.5 * span), (at[0], at[1] + 0.1 * span))
    return figure
