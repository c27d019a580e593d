"""Pictures of a slider-crank: those of its springs, or of its printed part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.families.base import function_named

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.plots.poses_in_one_svg import Moving
    from cfmkit.results import Result


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result of the family, by file stem; empty if nothing was solved."""
    if result.state is None or not result.curves:
        return {}
    made: dict[str, Callable[[], Figure]] = _in_room(result, "figures")
    return made


def moving(result: Result) -> Moving | None:
    """Return the linkage or the part over its motion, for a film; None of a part solved as a solid."""
    made: Moving | None = _in_room(result, "moving")
    return made


def _in_room(result: Result, name: str) -> Any:
    """Return what a function of the room that solved a mechanism draws of it; imported when it is to draw."""
    spec: Any = result.spec
    return function_named(f"cfmkit.families.slider_crank.{spec.built_as}.figures:{name}")(result)
