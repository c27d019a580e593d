"""All pictures of a result, drawn by its family or, where that draws none, by the curve alone."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.families.base import Family
    from cfmkit.plots.mechanism_in_motion import Moving
    from cfmkit.results import Result


def figures(
    family: Family,  # without `draw` there is the curve
    result: Result,  # of any status
) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws each picture of a result, by file stem; empty if there is nothing to draw."""
    if not result.curves:
        return {}
    if family.draw is None:
        from cfmkit.plots.curves import curve_figure

        return {"curve": partial(curve_figure, result)}
    return family.draw.figures(result)


def moving_of(family: Family, result: Result) -> Moving | None:
    """Return a mechanism in motion; None if there is no curve, or its family has no film."""
    if not family.draw or not family.draw.moving or not result.curves:
        return None
    moving = family.draw.moving(result)
    return moving if moving is not None and len(moving.motion) > 1 else None
