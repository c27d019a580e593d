"""How far a curve between solved poses can be trusted, by poses in between; more poses where it cannot.

Between poses the effort is a cubic through efforts and stiffnesses. Where such a cubic over two neighbouring intervals
misses the pose between them most, a pose is solved in the middle of an interval and the cubic compared with it, until
that difference is small. Halving an interval reduces a smooth curve's error sixteen times [deBoor, ch. IV].

Reference
---------
[deBoor] C. de Boor, A Practical Guide to Splines, Springer 1978.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.solid.path_following import advanced

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.solid.equilibrium import Balance, SolidProblem
    from cfmkit.solid.path_following import PosePath

ALLOWED = 5e-4
"""Difference of cubic and pose, in parts of the largest effort, below which poses are dense enough."""
HALVED = 16.0
"""Factor by which half an interval has less error."""
CHECKS = 3
"""Intervals that must be below `ALLOWED`, one after the other, those with the largest estimates first."""
SHORTEST = 2.0**-10
"""Intervals are not halved below this part of the travel: there the curve has a corner, which is a pose."""


def refined(problem: SolidProblem, course: PosePath) -> tuple[PosePath, float]:
    """Return a path with poses added where the curve needs them, and what the curve is off between poses.

    Parameters
    ----------
    problem : SolidProblem
    course : PosePath
        At most as many poses are added as it has.

    Returns
    -------
    PosePath
        With the poses that were solved for the check.
    float
        Largest difference between cubic and pose of the last checks, in parts of the largest effort: intervals with
        the largest estimated error were checked. NaN where fewer than three poses are known.
    """
    if len(course.poses) < 3:
        return course, float("nan")
    size = max(abs(pose.effort) for pose in course.poses)
    if size == 0.0:
        return course, 0.0
    off: list[float] = []
    skipped: set[float] = set()
    for _ in range(len(course.poses)):
        found = _checked(problem, course, skipped)
        if found is None:
            break
        course, difference = found
        off.append(difference / size)
        if len(off) >= CHECKS and max(off[-CHECKS:]) <= ALLOWED:
            break
    return course, max(off[-CHECKS:], default=float("nan"))


def _checked(problem: SolidProblem, course: PosePath, skipped: set[float]) -> tuple[PosePath, float] | None:
    """Return the path with a pose in the middle of its worst interval, and how far the curve was from it [N or N m]."""
    travel = course.travel
    span = abs(travel[-1] - travel[0])
    corners = course.bifurcations
    estimates = _estimates(course.poses)
    # of estimates that are equal but for rounding, the first along the path: the same part gets the same poses
    ranks = np.round(estimates / max(float(estimates.max()), 1e-300), 3)
    for k in np.argsort(-ranks, kind="stable"):
        low, high = sorted(travel[k : k + 2].tolist())
        cornered = any(low <= place <= high for place in corners)
        if cornered or high - low < SHORTEST * span or low in skipped:
            continue
        first = course.poses[k]
        pose = advanced(problem, first, 0.5 * (low + high), course.poses[k - 1] if k else None)
        if pose is None or pose.unstable > first.unstable:
            skipped.add(low)
            continue
        difference = abs(float(course.effort(np.array([pose.travel]))[0]) - pose.effort)
        return replace(course, poses=(*course.poses[: k + 1], pose.kept(), *course.poses[k + 1 :])), difference
    return None


def _estimates(poses: tuple[Balance, ...]) -> FloatArray:
    """Return what the cubic of each interval may be off, (k - 1,) [N or N m]: the larger value of its two ends."""
    from scipy.interpolate import CubicHermiteSpline

    missed = np.zeros(len(poses))
    for k in range(1, len(poses) - 1):
        ends = sorted((poses[k - 1], poses[k + 1]), key=lambda pose: pose.travel)
        x, y, slope = np.array([(pose.travel, pose.effort, pose.stiffness) for pose in ends]).T
        missed[k] = abs(float(CubicHermiteSpline(x, y, slope)(poses[k].travel)) - poses[k].effort) / HALVED
    return np.asarray(np.maximum(missed[:-1], missed[1:]))
