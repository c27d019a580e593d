"""The curve that a corrected part is to have: that of a perfect part of its design, at the force that is requested."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.metrics import Undefined, Window, frame_of, window_of
from cfmkit.metrics.compare import effort_at

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

N_PLACES = 65  # places of the window at which the corrected curve is to be the one that was designed
LARGEST_RESCALING = 0.03
"""Deviation of the designed mean from the target up to which it is taken for rounding and removed, too."""


@dataclass(frozen=True)
class AimedCurve:
    """The curve that a corrected part is to have."""

    places: FloatArray  # (n,) [m or rad]
    efforts: tuple[FloatArray, ...]  # (n,) of each curve [N or N m]
    branches: tuple[str, ...]  # whose mean it is

    @property
    def level(self) -> float:
        """Root mean square [N or N m]."""
        return float(np.sqrt(np.mean(np.square(self.efforts))))

    @property
    def mean_effort(self) -> float:
        """Mean of the first curve that is aimed at [N or N m]."""
        return float(np.mean(self.efforts[0]))

    def departure(self, curves: Sequence[Curve]) -> FloatArray:
        """Return by how much curves are above the aim, over its level, (m n,); NaN where they have no value."""
        departure: FloatArray = np.concatenate(
            [
                middle(curve, self.branches, self.places) - effort
                for curve, effort in zip(curves, self.efforts, strict=True)
            ]
        )
        return departure / self.level

    def mean(self, curves: Sequence[Curve]) -> float:
        """Return the mean of the first curve [N or N m]."""
        return float(np.nanmean(middle(curves[0], self.branches, self.places)))


def middle(curve: Curve, branches: Sequence[str], places: FloatArray) -> FloatArray:
    """Return the mean of some branches of a curve at some places; branches that it does not have are left out.

    Raises SolutionError if a branch turns back.
    """
    names = [name for name in branches if name in curve.branches] or list(curve.branches[:1])
    try:
        effort: FloatArray = np.mean([effort_at(curve, name, places) for name in names], axis=0)
    except Undefined:
        raise SolutionError("the force has several values at one place: such a curve is not corrected") from None
    return effort


def analyze_part(spec: Spec) -> Result:
    """Return the result of a part.

    Raises SolutionError if it has no curve.
    """
    result: Result = family(spec.family).analyze(spec, Run())
    if not result.curves:
        raise SolutionError(f"there is no curve to correct: {result.message}")
    return result


def aim_of(nominal: Result) -> AimedCurve:
    """Return the curve that a perfect part of a drawing has, at the force that is requested.

    A target may hold between the branches or on one of them: it holds where it is met.
    """
    curve, target = nominal.curve, frame_of(nominal).target
    window = window_of(nominal) or Window(float(curve.motion.min()), float(curve.motion.max()))
    places = np.linspace(window.lo, window.hi, N_PLACES)
    choices = [curve.branches, *((name,) for name in curve.branches)] if len(curve.branches) > 1 else [curve.branches]
    branches, scale = tuple(choices[0]), 1.0
    if target and nominal.target_curve is None and nominal.spec.target_curve is None and len(nominal.curves) == 1:
        means = [float(np.nanmean(middle(curve, names, places))) for names in choices]
        nearest = min(range(len(choices)), key=lambda k: (round(abs(means[k] / target - 1.0), 3), k))
        branches = tuple(choices[nearest])
        scale = target / means[nearest] if abs(target / means[nearest] - 1.0) <= LARGEST_RESCALING else 1.0
    efforts = [scale * middle(item, branches, places) for item in nominal.curves]
    is_known = np.all(np.isfinite(efforts), axis=0)
    return AimedCurve(places[is_known], tuple(effort[is_known] for effort in efforts), branches)
