"""Window over which a cam is evaluated from its measured profile, and how much of that window was measured.

`MeasuredCam` is the solved cam as built, with its measured flanks. It is computed over travels that count from its own
start; `MeasuredCam.origin` added to one gives the displacement of the specification. Where a flank was not measured the
force is not known (`MeasuredCam.unmeasured`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.families.cam.solution_of_measured_cam import MeasuredCam


def travel_window(built: MeasuredCam) -> tuple[float, float]:
    """Return the travels at which the window begins and ends, by default the whole travel [m]."""
    window = built.assembly.spec.analysis.window
    if window is None:
        return float(built.travel[0]), float(built.travel[-1])
    low, high = window_places(window, requested_travel(built))
    return low - built.origin, high - built.origin


def large_holes(built: MeasuredCam) -> tuple[tuple[float, float], ...]:
    """Return the intervals of travel in the window that were not measured, unless they are very small [m]."""
    start, stop = travel_window(built)
    inside = ((max(low, start), min(high, stop)) for low, high in built.unmeasured)
    return tuple((low, high) for low, high in inside if high - low > MAX_HOLE_SHARE * (stop - start))


def profile_coverage(built: MeasuredCam) -> float:
    """Return the share of the window that was measured, 0 to 1."""
    start, stop = travel_window(built)
    missing = sum(max(min(high, stop) - max(low, start), 0.0) for low, high in built.unmeasured)
    return 1.0 - missing / (stop - start)


def window_mask(built: MeasuredCam) -> NDArray[np.bool_]:
    """Return which travels lie in ``analysis.window``, (n,); all if there is no window, or if it holds fewer than 3."""
    place, window = built.travel + built.origin, built.assembly.spec.analysis.window
    if window is None:
        return np.ones(len(place), dtype=bool)
    low, high = window_places(window, requested_travel(built))
    inside: NDArray[np.bool_] = (place >= low) & (place <= high)
    return inside if inside.sum() > 2 else np.ones(len(place), dtype=bool)


def requested_travel(built: MeasuredCam) -> tuple[float, float]:
    """Return where the displacement starts and where it was to end [m]."""
    start, end = float(built.travel[0]), built.assembly.spec.analysis.travel or float(built.travel[-1])
    return start + built.origin, end + built.origin
