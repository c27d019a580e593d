"""By how much the force of a part rises because the anticlastic bending of its wide beams is suppressed.

In a planar solid, in plane stress, it is free. Beam models know both: with `mechanism.wide_beams` they are as stiff
as the curvature makes them. The ratio of both means over the window is what a solid misses; what clamped ends add is
left out (docs/beam.md, wide beams).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError
from cfmkit.families.run_control import Run
from cfmkit.metrics import mean_effort

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.families.suggestion_request import Request
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

WIDE_BEAMS_KEY = "mechanism.wide_beams"
BAND_MARGIN = 1.002  # how far inside its band a force is aimed at: the next solution is that of a part a little wider
PER_SQUARE = 0.007
"""Stiffening over 2 (b/t)^2 sigma/E, b^2 K/t at the largest stress: 0.0026 to 0.0075 of POM leaves and networks
whose stiffening was computed; the real one ends at 1/(1 - nu^2) - 1."""


def is_too_wide(request: Request, width: float, thickness: float, strain: float) -> bool:
    """Return True if leaves of a width and a thickness [m] probably stiffen by more than the band of a request.

    `strain`: the largest bending strain. An estimate, by which candidates are put in order; `stiffening` decides.
    """
    return PER_SQUARE * 2.0 * (width / thickness) ** 2 * strain > request.high / request.low - 1.0


def stiffening(spec: Spec, model: Callable[[Any, Run], Result]) -> float:
    """Return by what share the mean force over the window rises, by a model of beams; 0 if that does not know it."""
    try:
        means = [
            mean_effort(model(spec.replace({WIDE_BEAMS_KEY: wide, "requirements": ()}), Run()))
            for wide in (False, True)
        ]
    except CfmError:
        return 0.0
    narrow, wide = means
    return 0.0 if not narrow or not wide else max(wide / narrow - 1.0, 0.0)


def aim_below_stiffening(spec: Spec, request: Request, model: Callable[[Any, Run], Result]) -> Request:
    """Return a request whose force is in the band without and with the stiffening of a part, or as near as can be."""
    share = stiffening(spec, model)
    lowest, highest = BAND_MARGIN * request.low, request.high / (BAND_MARGIN * (1.0 + share))
    return replace(request, target=max(min(request.target / (1.0 + 0.5 * share), highest), lowest))
