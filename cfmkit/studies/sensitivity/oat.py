"""One at a time: what happens when a single parameter goes through its range, all others staying nominal.

``low`` and ``high`` are the outputs at the ends of the range, ``swing`` the largest
difference that the range makes, ``slope`` the relative change of the output for a
relative change of the parameter (from end to end): the bars and curves of the papers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.studies.sensitivity.method import Method
from cfmkit.studies.sensitivity.result_types import Analysis, Findings, Index, IndexLine, lines_of

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup

LOW_END_INDEX, HIGH_END_INDEX, SWING_INDEX, SLOPE_INDEX = "at_low_end", "at_high_end", "swing", "normalised_slope"


def sample(
    nominal: FloatArray,  # (d,): values of the parameters
    ends: FloatArray,  # (d, 2): their ranges
    count: int,  # points over each range, both ends included
) -> FloatArray:
    """Return points, (parameters, count, parameters): in the k-th group the k-th parameter varies."""
    points = np.broadcast_to(nominal, (len(nominal), count, len(nominal))).copy()
    for k, (low, high) in enumerate(ends):
        points[k, :, k] = np.linspace(low, high, count)
    return points


def analyze(nominal: FloatArray, ends: FloatArray, outputs: FloatArray, at_nominal: float) -> Analysis:
    """Return what each parameter does to one output; where a point failed, its swing is not stated.

    Parameters
    ----------
    nominal : (d,) array
        Values of the parameters.
    ends : (d, 2) array
        Their ranges.
    outputs : (d, n) array
        NaN where a point failed.
    at_nominal : float
        The output there.
    """
    low, high = outputs[:, 0], outputs[:, -1]
    swing = outputs.max(axis=1) - outputs.min(axis=1)
    gap = np.full(len(low), np.nan)
    return (
        Index(LOW_END_INDEX, low, gap, gap),
        Index(HIGH_END_INDEX, high, gap, gap),
        Index(SWING_INDEX, swing, swing, swing),
        Index(SLOPE_INDEX, _slope(nominal, ends, high - low, at_nominal), gap, gap),
    )


def _slope(nominal: FloatArray, ends: FloatArray, change: FloatArray, at_nominal: float) -> FloatArray:
    """Return (dy/y)/(dx/x); NaN where the nominal value of either is zero: nothing is relative to that."""
    with np.errstate(all="ignore"):
        slope = change / (ends[:, 1] - ends[:, 0]) * nominal / at_nominal
    slope[~np.isfinite(slope) | (nominal == 0.0)] = np.nan
    return np.asarray(slope)


def run(setup: Setup, evaluator: Evaluator) -> Findings:
    """Return what each parameter does through its range."""
    points = sample(setup.values, setup.ends, setup.samples)
    outputs = evaluator.outputs(points, [[path] * setup.samples for path in setup.paths])
    index_lines: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        nominal = float(setup.nominal.values[m])
        analysis = analyze(setup.values, setup.ends, outputs[..., m], nominal)
        index_lines += lines_of(metric, setup.paths, analysis, setup.samples)
    return Findings(setup, evaluator, tuple(index_lines), points=points, outputs=outputs)


SENSITIVITY_METHOD = Method(
    run, lambda samples, parameters, _: samples * parameters, (SWING_INDEX, SLOPE_INDEX), {"": "draw_oat"}
)
