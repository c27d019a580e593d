"""Pictures of a slider-crank: those of its springs, or of its printed part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.families.deferred_imports import deferred_imports

with deferred_imports():
    from cfmkit.families.slider_crank.printed.figures import figures as figures_of_part
    from cfmkit.families.slider_crank.printed.figures import moving as moving_part
    from cfmkit.families.slider_crank.springs.figures import figures as figures_of_springs
    from cfmkit.families.slider_crank.springs.figures import moving as moving_springs

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.plots.mechanism_in_motion import Moving
    from cfmkit.results import Result


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of a result of the family, by file stem; empty if nothing was solved."""
    if result.state is None or not result.curves:
        return {}
    spec: Any = result.spec
    return (figures_of_springs if spec.built_as == "springs" else figures_of_part)(result)


def moving(result: Result) -> Moving | None:
    """Return the linkage or the part over its motion, for a film; None of a part solved as a solid."""
    spec: Any = result.spec
    return (moving_springs if spec.built_as == "springs" else moving_part)(result)
