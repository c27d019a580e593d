"""Springs or a printed part: which of the two rooms designs, draws and outlines a specification."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cfmkit.export.geometry import TOLERANCE
from cfmkit.families.base import function_named
from cfmkit.families.slider_crank.build import resolve

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.export.geometry import Drawing
    from cfmkit.families.base import Run
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.plots.moving import Moving
    from cfmkit.results import Design, Result

ROOMS = {"prb": "springs", "lumped": "printed", "beam": "printed"}
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
    made: dict[str, Callable[[], Figure]] = _in_room(ROOMS[str(result.spec.fidelity)], "draw:figures")(result)
    return made


def moving(result: Result) -> Moving:
    """Return the linkage or the part over its motion, for a film."""
    made: Moving = _in_room(ROOMS[str(result.spec.fidelity)], "draw:moving")(result)
    return made


def drawing(spec: SliderCrankSpec, tolerance: float = TOLERANCE) -> Drawing:
    """Return the outlines of one leg as the fidelity has it: of straight edges and arcs, exact.

    Raises
    ------
    cfmkit.families.refusals.CannotBuild
        If it cannot be assembled.
    """
    made: Drawing = _in_room(ROOMS[spec.fidelity], "outline:drawing")(resolve(spec))
    legs = spec.mechanism.legs
    often = (f"one of {legs} equal legs is drawn: make it {legs} times",) if legs > 1 else ()
    return replace(made, notes=(*often, *made.notes))
