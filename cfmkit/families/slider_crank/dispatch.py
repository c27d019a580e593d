"""Springs or a printed part: which of the two rooms designs, draws and outlines a specification."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.contours import TOLERANCE, Arc, Line, Smooth, polygons
from cfmkit.families.base import function_named
from cfmkit.families.slider_crank.linkage_from_spec import resolve

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.export.contours import Contour, Drawing, Edge
    from cfmkit.families.base import Run
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.plots.poses_in_one_svg import Moving
    from cfmkit.results import Design, Result

ROOMS = {"prb": "springs", "lumped": "printed", "beam": "printed", "solid": "printed"}
"""What each fidelity is a model of: flexures and a strip are one model, the chain is another one."""


def _in_room(room: str, name: str) -> Any:
    """Return a function of a room, ``"file:function"``; imported when it is to run."""
    return function_named(f"cfmkit.families.slider_crank.{room}.{name}")


def design(spec: SliderCrankSpec, run: Run) -> Design:
    """Return the design of springs, or of the part that the block `design` asks for."""
    wanted = spec.design
    part = wanted is not None and (wanted.beam is not None or wanted.flexures is not None)
    found: Design = _in_room("printed" if part else "springs", "design:design")(spec, run)
    return found


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result of the family, by file stem; empty if nothing was solved."""
    if result.state is None or not result.curves:
        return {}
    made: dict[str, Callable[[], Figure]] = _in_room(ROOMS[str(result.spec.fidelity)], "figures:figures")(result)
    return made


def moving(result: Result) -> Moving | None:
    """Return the linkage or the part over its motion, for a film; None of a part solved as a solid."""
    made: Moving | None = _in_room(ROOMS[str(result.spec.fidelity)], "figures:moving")(result)
    return made


def drawing(spec: SliderCrankSpec, tolerance: float = TOLERANCE) -> Drawing:
    """Return the outlines of one leg as the fidelity has it: of straight edges and arcs, exact.

    Raises
    ------
    cfmkit.families.findings.CannotBuild
        If it cannot be assembled.
    """
    made: Drawing = _in_room(ROOMS[spec.fidelity], "outline:drawing")(resolve(spec))
    legs = spec.mechanism.legs
    notes = (f"one of {legs} equal legs is drawn: make it {legs} times",) if legs > 1 else ()
    if spec.mechanism.copies == "mirrored":
        made = with_mirror_image(made)
        notes = (*notes, "the pair is drawn: the lower part is the mirror image of the upper one, on the same slider")
    return replace(made, notes=(*notes, *made.notes))


def with_mirror_image(one: Drawing) -> Drawing:
    """Return a drawing with the mirror image of its parts below them, apart from them."""
    heights = np.concatenate(polygons(one.contours, "cut"))[:, 1]
    low, high = float(heights.min()), float(heights.max())
    axis = low - 0.05 * (high - low) - 0.002
    mirrored = tuple(_mirrored(contour, axis) for contour in one.contours)
    return replace(one, contours=(*one.contours, *mirrored))


def _mirrored(contour: Contour, axis: float) -> Contour:
    """Return a contour as seen in a mirror along y = axis [m]."""

    def edge(one: Edge) -> Edge:
        if isinstance(one, Line):
            (a, b), (c, d) = one.start, one.end
            return Line((a, 2.0 * axis - b), (c, 2.0 * axis - d))
        if isinstance(one, Arc):
            x, y = one.center
            return Arc((x, 2.0 * axis - y), one.radius, -one.start, -one.end)
        flip = np.array([1.0, -1.0])
        return Smooth(one.points * flip + np.array([0.0, 2.0 * axis]), one.tangents * flip)

    return replace(contour, edges=tuple(edge(one).reversed() for one in reversed(contour.edges)))
