"""The trim by the unloaded angle: what turning it does to the effort while the slider's places are kept.

Whoever turns the crank angle at which the springs are relaxed (the anchors of the torsion springs, or the block that a
strip is clamped in) deflects all springs by the same at every place: an effort q q' becomes (q + dq) q'. Unlike the
anchor of the slider's spring, that adds most where a joint turns most per travel.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.assembly import Assembly

STEP = 1e-5
"""Of the angle [rad]: the effort is a quadratic of q at most, so that central differences are off by rounding alone."""

PLACES = 201
"""Of the window, over which the change of the effort is averaged."""


def turned(assembly: Assembly, angle: float) -> tuple[Assembly, float]:
    """Return an assembly whose unloaded angle is turned by some angle [rad], and by how much its travel is less there.

    Travel is counted from the unloaded position: the same place has a travel smaller by the second value [m]; 0 where
    a torque drives, whose motion is the crank's angle itself.
    """
    other = replace(assembly, unloaded=assembly.unloaded + angle)
    if assembly.drive == "torque":
        return other, 0.0
    link = assembly.linkage
    before, after = (float(link.slider_position(np.asarray(one.unloaded))) for one in (assembly, other))
    return other, link.branch * (before - after)


def effort_per_angle(assembly: Assembly, motion: FloatArray) -> FloatArray:
    """Return by how much unit efforts rise per unloaded angle, (4, n), [N m or N, per rate and rad]."""
    rows = []
    for step in (STEP, -STEP):
        other, less = turned(assembly, step)
        rows.append(other.forces(motion - less))
    change: FloatArray = (rows[0] - rows[1]) / (2.0 * STEP)
    return change


def mean_effort_per_angle(assembly: Assembly, window: tuple[float, float]) -> FloatArray:
    """Return the mean of `effort_per_angle` over a window, (4,)."""
    found: FloatArray = effort_per_angle(assembly, np.linspace(*window, PLACES)).mean(axis=1)
    return found
