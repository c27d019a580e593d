"""Pictures of cams that are not as designed: measured errors, errors to be expected, what they do to the force."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.diagram import Diagram, Scale, Series, diagram_figure
from cfmkit.plots.loop import loop_figure
from cfmkit.plots.style import BLUE, OCHRE, PURPLE, VERMILLION
from cfmkit.plots.text import Heading

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.built import Built
    from cfmkit.families.cam.model import Solution
    from cfmkit.results import Result

PLACES = 400


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a measured cam, by file stem."""
    return {
        "loop": partial(loop_figure, result, None, "force over travel, with the measured profile"),
        "profile": partial(profile, result),
        "shares": partial(shares, result),
    }


def profile(result: Result) -> Figure:
    """Return the errors of both flanks over the height, along the normal and in x."""
    built: Built = result.state
    low = max(float(points[0, 1]) for points in built.registration.points)
    high = min(float(points[-1, 1]) for points in built.registration.points)
    heights = np.linspace(low, high, PLACES)
    kinds = (("error along the normal", built.registration.errors), ("error in x", built.across))
    diagrams = []
    for name, errors in kinds:
        right, left = (_over_height(built, side, values, heights) for side, values in enumerate(errors))
        series = [Series(right, "right", BLUE, prefer=0.3), Series(left, "left", VERMILLION, prefer=0.7)]
        diagrams.append(Diagram(heights, Scale("height on the cam", "length"), Scale(name, "length"), series))
    return diagram_figure(Heading.of(result, "measured profile less design, positive outside"), diagrams)


def _over_height(built: Built, side: int, values: FloatArray, heights: FloatArray) -> FloatArray:
    used = built.registration.used[side]
    y = built.registration.points[side][used, 1]
    order = np.argsort(y, kind="stable")
    found: FloatArray = np.interp(heights, y[order], values[used][order])
    return found


def shares(result: Result) -> Figure:
    """Return what rest length, profile and friction add to the force of the design."""
    built: Built = result.state
    parts = built.shares
    series = [
        Series(parts["profile"], "profile", BLUE, prefer=0.3),
        Series(parts["friction_up"], "friction, up", VERMILLION, prefer=0.6),
        Series(parts["friction_down"], "friction, down", PURPLE, prefer=0.6),
    ]
    if np.abs(parts["rest"]).max() > 0:
        series.append(Series(parts["rest"], "rest length", OCHRE, prefer=0.8))
    over = built.travel + built.origin
    diagram = Diagram(over, Scale("displacement", "length"), Scale("force added to the design's", "force"), series)
    return diagram_figure(Heading.of(result, "where the force comes from"), [diagram])


def band_figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws the forces of cams that are cut with errors; nothing where none are stated."""
    return {} if result.state.band is None else {"manufacturing": partial(manufacturing, result)}


def manufacturing(result: Result) -> Figure:
    """Return the band of forces, without friction, of cams that are cut with the stated errors."""
    solution: Solution = result.state
    band, over = solution.band, solution.travel + solution.origin
    assert band is not None
    shown = solution.travel >= solution.corner_travel + 0.005 * solution.travel[-1]
    lines = ((0.975, "97.5 % of the cams are below", VERMILLION), (0.5, "half", BLUE), (0.025, "2.5 %", VERMILLION))
    series = [Series(band.quantile(share)[shown], name, color, prefer=0.7) for share, name, color in lines]
    one = Series(band.forces[0][shown], "one of them", PURPLE, prefer=0.3)
    scales = Scale("displacement", "length"), Scale("force without friction", "force", zero=False)
    diagram = Diagram(over[shown], *scales, [*series, one])
    median = 100 * float(np.median(band.deviations()))
    subject = f"cams cut with errors, {median:.2g} % SD along the travel"
    return diagram_figure(Heading.of(result, subject), [diagram])
