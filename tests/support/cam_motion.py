"""The published prototype in motion, and short ways to run it; lengths in mm, forces in N."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from cam_support import cam

from cfmkit.families.cam.dynamics import MotionResponse, build, respond, statics

if TYPE_CHECKING:
    from cfmkit.families.cam import CamSpec

PRINTED_INERTIAS = {"masses__brace_inertia": 2.57e-4, "masses__roller_inertia": 4.61e-6}
"""Of the paper's section 4 [kg m^2]."""
STIFFNESS = {2: 1365.0, 4: 2732.0, 6: 4097.0}
"""Sums of the measured springs of Table 2 [N/m], by number of springs."""


def moving(**changes: Any) -> CamSpec:
    """Return the prototype with weight, lifted from 220 mm by 100 mm within 0.125 s; changes are as for `cam`."""
    motion = {"slider_position": "220 mm", "stroke": "100 mm", "time": "0.125 s"}
    stated = {"analysis__gravity": True, "analysis__dynamics": motion} | PRINTED_INERTIAS
    return cam(**(stated | changes))


def with_springs(count: int, **changes: Any) -> CamSpec:
    """Return `moving` with 2, 4 or 6 of the measured springs."""
    return moving(springs={"stiffness": STIFFNESS[count]}, **changes)


def response(spec: CamSpec, points: int = 4001) -> MotionResponse:
    """Return the direct solution at equally spaced times."""
    parts = build(spec)
    return respond(parts.machine, parts.motion.evaluate(parts.motion.times(points)))


def peak_over_one_second(spec: CamSpec, points: int = 4001) -> float:
    """Return the largest F_T/F_1 - 1 [%] among the points, F_1 the force of the same motion within 1 s (Fig. 14)."""
    slow = response(spec.replace({"analysis.dynamics.time": 1.0}), points)
    return 100.0 * float((response(spec, points).force / slow.force).max() - 1.0)


def change_at_rest(spec: CamSpec, travel: float = 0.1) -> float:
    """Return how much the static force after some travel [m] differs from that with right angles [%]."""
    wrong, right = build(spec), build(spec.replace({"mechanism.errors": {}}))
    place = np.array([wrong.motion.start + travel])
    return 100.0 * float(statics(wrong.machine, place).force[0] / statics(right.machine, place).force[0] - 1.0)


__all__ = ["change_at_rest", "moving", "peak_over_one_second", "response", "with_springs"]
