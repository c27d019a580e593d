"""All pictures of a result, drawn by its family or, where that draws none, by the curve alone."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.families.base import Family
    from cfmkit.plots.poses_in_one_svg import Moving
    from cfmkit.results import Result


def figures(
    family: Family,  # its `draw` names the module with ``figures(result)``; without one there is the curve
    result: Result,  # of any status
) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws each picture of a result, by file stem; empty if there is nothing to draw."""
    if not result.curves:
        return {}
    if family.draw is None:
        from cfmkit.plots.curve_with_enlarged_band import curve_figure

        return {"curve": partial(curve_figure, result)}
    makers: Mapping[str, Callable[[], Figure]] = import_module(family.draw).figures(result)
    return makers


def moving_of(family: Family, result: Result) -> Moving | None:
    """Return a mechanism in motion; None if there is no curve, or its family has no film."""
    if not family.draw or not result.curves:
        return None
    draw = getattr(import_module(family.draw), "moving", None)  # optional: a family may have figures without a film
    found: Moving | None = draw(result) if draw else None
    return found if found is not None and len(found.motion) > 1 else None
