"""The hysteresis loop between the branches, the friction that follows from it, and the repeatability of cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.experiment.value_definitions import define_recorded_values
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.metrics import Window

N_CYCLE_PLACES = 513  # places in the window at which cycles are compared
REVERSED_LOOP_SHARE = 1e-3
"""A loop runs the wrong way round if its area is negative by more than this part of mean force times travel."""


def branch_at(
    curve: Curve,  # whose branch never turns back
    branch: str,  # its name
    places: FloatArray,  # (n,): motion [m or rad], inside what the branch covers
) -> FloatArray:
    """Return the effort of one branch at some places, by linear interpolation."""
    part = curve.select_branch(branch)
    step = 1 if part.motion[-1] >= part.motion[0] else -1
    values: FloatArray = np.interp(places, part.motion[::step], part.effort[::step])
    return values


def loop_area(
    motion: FloatArray,  # (n,): increasing [m or rad]
    # up, down: (n,): effort on each branch there [N or N m]
    up: FloatArray,
    down: FloatArray,
) -> float:
    """Return the area between the branches: the integral of (up - down) over the motion [J].

    Examples
    --------
    >>> loop_area(np.array([0.0, 0.1]), np.array([2.0, 2.0]), np.array([1.0, 1.0]))
    0.1
    """
    return float(np.trapezoid(up - down, motion))


def turned_loop(
    curves: Sequence[Curve],  # one a cycle; a cycle without a way back says nothing
) -> bool:
    """Return whether the loops run the wrong way round, by more than rounding of the forces explains."""
    areas, sizes = [], []
    for curve in curves:
        if len(curve.branches) < 2:
            continue
        up, down = curve.select_branch("load").motion, curve.select_branch("unload").motion
        low, high = max(up.min(), down.min()), min(up.max(), down.max())
        if low < high:
            places = np.linspace(low, high, N_CYCLE_PLACES)
            areas.append(loop_area(places, branch_at(curve, "load", places), branch_at(curve, "unload", places)))
            sizes.append(float(np.abs(curve.effort).mean() * (high - low)))
    return sum(areas) < -REVERSED_LOOP_SHARE * sum(sizes)


def repeatability(curves: Sequence[Curve], window: Window) -> dict[str, Quantity]:
    """Return how far cycles differ: on each branch the root mean square over the window of the SD between cycles.

    Parameters
    ----------
    curves : sequence of Curve
        One a cycle.
    window : Window
        That all of them cover.

    Returns
    -------
    dict of str to Quantity
        ``force_repeatability[load]`` and so on; without a value where there is one cycle only.
    """
    kind = curves[0].kind
    meant = define_recorded_values(kind)[f"{kind}_repeatability"]
    places = np.linspace(window.lo, window.hi, N_CYCLE_PLACES)
    quantities = {}
    for branch in curves[0].branches:
        name = f"{kind}_repeatability[{branch}]"
        if len(curves) < 2:
            quantities[name] = Quantity(None, *meant, "there is one cycle only")
            continue
        forces = np.array([branch_at(curve, branch, places) for curve in curves])
        quantities[name] = Quantity(float(np.sqrt(forces.var(axis=0, ddof=1).mean())), *meant)
    return quantities
