"""Sobol indices: the share of the variance that a parameter causes, alone and with others.

SALib estimates the indices; drawing and analysing are apart.
Nothing here decides what a missing value means: the outputs must be complete.

Reference
---------
[S] A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.numerics.unit_cube_samples import sample_unit_cube
from cfmkit.studies.parts.uncertain_values import values_at
from cfmkit.studies.sensitivity.method import Method
from cfmkit.studies.sensitivity.result_types import (
    N_RESAMPLES,
    Analysis,
    Findings,
    Index,
    IndexLine,
    analyze_complete,
    is_constant,
    lines_of,
    salib_problem,
    unstated_indices,
)

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup

FIRST_ORDER_INDEX, TOTAL_ORDER_INDEX = "first_order", "total_order"
INDEX_NAMES = (FIRST_ORDER_INDEX, TOTAL_ORDER_INDEX)
MIN_BLOCKS = 16  # convergence is shown from so many blocks on


def sample(
    # start, count: which blocks
    start: int,
    count: int,
    parameters: int,  # dimension of the cube
    seed: int,  # of the scrambling
    kind: str = "sobol",  # one of `SAMPLE_KINDS`
) -> FloatArray:
    """Return blocks of points of the unit cube, (count, parameters + 2, parameters).

    A block is a point A, then A with one coordinate each of a point B, then B [S, table 2, (b)]. Blocks of a sequence
    stay as they are when more are drawn.
    """
    points = sample_unit_cube(kind, 2 * parameters, start + count, seed)[start:]
    blocks = np.repeat(points[:, None, :parameters], parameters + 2, axis=1)
    for k in range(parameters):
        blocks[:, 1 + k, k] = points[:, parameters + k]
    blocks[:, -1] = points[:, parameters:]
    return blocks


def analyze(outputs: FloatArray, seed: int) -> Analysis:
    """Return first and total order indices, with bootstrap intervals.

    Parameters
    ----------
    outputs : (n, parameters + 2) array
        Complete: of the points of `sample`, block by block.
    seed : int
        Of the bootstrap.
    """
    count = outputs.shape[1] - 2
    if is_constant(outputs):
        return unstated_indices(INDEX_NAMES, count)
    from SALib.analyze import sobol

    # SALib takes a seed of zero for none.
    indices = sobol.analyze(
        salib_problem(count), outputs.ravel(), calc_second_order=False, num_resamples=N_RESAMPLES, seed=seed + 1
    )
    return tuple(
        _make_index(name, indices[key], indices[f"{key}_conf"])
        for name, key in zip(INDEX_NAMES, ("S1", "ST"), strict=True)
    )


def _make_index(name: str, value: Any, reach: Any) -> Index:
    values, reaches = np.asarray(value, dtype=np.float64), np.asarray(reach, dtype=np.float64)
    return Index(name, values, values - reaches, values + reaches)


def stages(count: int) -> list[int]:
    """Return numbers of blocks at which to look whether the indices still change.

    Examples
    --------
    >>> stages(256)
    [16, 32, 64, 128, 256]
    """
    counts = [count]
    while counts[0] // 2 >= MIN_BLOCKS:
        counts.insert(0, counts[0] // 2)
    return counts


def convergence(outputs: FloatArray, seed: int) -> list[tuple[int, Analysis]]:
    """Return the indices from the first 16, ..., n/4, n/2, n blocks."""
    return [(size, analyze(outputs[:size], seed)) for size in stages(len(outputs))]


def run(setup: Setup, evaluator: Evaluator) -> Findings:
    """Return the indices, and how they converge."""
    count, seed = len(setup.parameters), setup.seed
    spreads = [parameter.spread for parameter in setup.parameters]

    unit = sample(0, setup.samples, count, seed, setup.sampling)
    points = values_at(spreads, unit.reshape(-1, count)).reshape(unit.shape)
    roles = ["A", *(f"A with {path} of B" for path in setup.paths), "B"]
    outputs = evaluator.outputs(points, roles)
    index_lines: list[IndexLine] = []
    on_the_way: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        for size in stages(len(outputs)):
            solved = outputs[:size, ..., m]
            analysis = analyze_complete(solved, lambda kept: analyze(kept, seed), INDEX_NAMES, count)
            lines = list(lines_of(metric, setup.paths, analysis, size))
            on_the_way += lines
        index_lines += lines
    return Findings(setup, evaluator, tuple(index_lines), tuple(on_the_way), points=points, outputs=outputs)


SENSITIVITY_METHOD = Method(
    run,
    lambda samples, parameters, _: samples * (parameters + 2),
    ("total_order", "first_order"),
    {"": "draw_bars", "_convergence": "draw_convergence"},
)
