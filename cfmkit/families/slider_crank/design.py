"""From targets to a slider-crank: springs, and lengths where these may be chosen, or a part that is printed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.deferred_imports import deferred_imports

with deferred_imports():
    from cfmkit.families.slider_crank.printed.design import design as design_part
    from cfmkit.families.slider_crank.springs.design import design as design_springs

if TYPE_CHECKING:
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.results import Design


def design(spec: SliderCrankSpec, run: Run) -> Design:
    """Return the design of springs, or of the part that the block `design` asks for."""
    wanted = spec.design
    part = wanted is not None and (wanted.beam is not None or wanted.flexures is not None)
    return (design_part if part else design_springs)(spec, run)
