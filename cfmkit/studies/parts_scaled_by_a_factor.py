"""Made parts all of whose forces are multiplied by a factor: what is known of them without another analysis.

A trim multiplies the forces of a part. An error of the modulus of a whole part multiplies its forces and its stresses,
where nothing else resists its motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.metrics import split_name
from cfmkit.metrics.requirements import Bounds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.point_evaluation import Metric
    from cfmkit.studies.sensitivity.parameters import Parameter
    from cfmkit.studies.stated_or_assumed_tolerances import DesignTolerances

SCALED = ("force", "torque", "energy")
"""Dimensions of metrics that go with the force."""

SHARES = ("half_band", "force_ripple", "torque_ripple", "deviation_from_mean")
"""Metrics that stay where every force and every stress of a part is multiplied by one factor."""

EXACTLY = 1e-9
"""Share within which force and stress go with an error that multiplies them."""


def once_scaled(
    spec: Spec,
    nominal: Result,
    metrics: Sequence[Metric],
    found: FloatArray,
    met: NDArray[np.bool_],
    factor: FloatArray,
    stresses: bool = False,
) -> NDArray[np.bool_]:
    """Return which requirements parts meet once their forces are multiplied by a factor (n,), and their stresses too.

    Metrics of forces go with the factor and shares of the force stay; a departure from a target follows from the ends
    of the force. Whatever else follows the force in a way of its own is left as it was.
    """
    column, out = 1, met.copy()
    for k, one in enumerate(spec.part_requirements):
        metric, values = metrics[column], found[:, column]
        column += 1
        if split_name(one.metric)[0] == "deviation_from_target":
            ends = found[:, column : column + 2]
            column += 2
            if nominal.target:
                values = np.abs(factor[:, None] * ends / nominal.target - 1.0).max(axis=1)
        elif exponent := power(metric, stresses):
            values = factor**exponent * values
        else:
            continue
        limits = Bounds.of(one, metric.dimension)
        out[:, k] = [limits.met(value) for value in np.where(np.isfinite(values), values, np.inf).tolist()]
        out[~np.isfinite(values), k] = False
    return out


def power(metric: Metric, stresses: bool) -> int:
    """Return with which power of the force, and of the stress, a metric goes."""
    if metric.dimension in SCALED or (stresses and metric.dimension == "stress"):
        return 1
    return -1 if stresses and split_name(metric.name)[0] == "safety_factor" else 0


def goes_with(made: DesignTolerances, members: tuple[int, ...], nominal: Result, run: Run) -> bool:
    """Return whether force and stress everywhere are multiplied by what some parameters are multiplied by."""
    changes = {made.paths[k]: one_sigma(made.parameters[k]) for k in members}
    factors = np.array(list(changes.values())) / made.nominal[list(members)]
    try:
        moved = family(made.spec.family).analyze(made.spec.replace(changes), run)
    except CfmError:
        return False
    if np.ptp(factors) > EXACTLY or not all("max_stress" in one.extra for one in (*nominal.curves, *moved.curves)):
        return False
    before, after = nominal.curve, moved.curve
    pairs = [(before.effort, after.effort), (before.extra["max_stress"].values, after.extra["max_stress"].values)]
    return before.motion.shape == after.motion.shape and all(
        np.allclose(factors[0] * one, other, rtol=0.0, atol=EXACTLY * float(np.abs(other).max()))
        for one, other in pairs
    )


def one_sigma(one: Parameter) -> float:
    """Return the value of a parameter that errs by its standard deviation [SI]."""
    return one.spread.nominal + one.spread.standard_deviation
