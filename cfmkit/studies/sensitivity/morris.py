"""Morris screening: the mean and the scatter of the effects of single steps.

``mu_star`` is the mean size of the change of the output when one parameter crosses its whole range, ``mu`` the mean
with its sign, ``sigma`` the standard deviation: large where the effect is curved or depends on the other parameters.

Reference
---------
[M] M. D. Morris, Technometrics 33 (1991) 161.
[C] F. Campolongo et al., Environ. Model. Softw. 22 (2007) 1509.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.studies.parts.uncertain_values import values_across
from cfmkit.studies.sensitivity.method import Method
from cfmkit.studies.sensitivity.result_types import (
    N_RESAMPLES,
    Analysis,
    Findings,
    Index,
    IndexLine,
    analyze_complete,
    lines_of,
    salib_problem,
)

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup

MU_STAR, MU_INDEX, SIGMA_INDEX = "mu_star", "mu", "sigma"
INDEX_NAMES = (MU_STAR, MU_INDEX, SIGMA_INDEX)
N_GRID_LEVELS = 4  # levels of the grid in each direction; an effect is that of a step over two thirds of the range


def sample(
    # start, count: which trajectories; those of another start are drawn anew
    start: int,
    count: int,
    parameters: int,  # dimension of the cube
    seed: int,  # of the trajectories
) -> FloatArray:
    """Return trajectories on a grid of the unit cube, (count, parameters + 1, parameters).

    From one point to the next a single coordinate changes.
    """
    from SALib.sample import morris

    generator = np.random.default_rng([seed, start])
    points = morris.sample(salib_problem(parameters), count, num_levels=N_GRID_LEVELS, seed=generator)
    return np.asarray(points).reshape(count, parameters + 1, parameters)


def analyze(points: FloatArray, outputs: FloatArray, seed: int) -> Analysis:
    """Return mu*, mu and sigma, mu* with a bootstrap interval.

    Parameters
    ----------
    points : (n, parameters + 1, parameters) array
        Trajectories.
    outputs : (n, parameters + 1) array
        Complete.
    seed : int
        Of the bootstrap.
    """
    from SALib.analyze import morris

    count = points.shape[2]
    indices = morris.analyze(
        salib_problem(count),
        points.reshape(-1, count),
        outputs.ravel(),
        num_resamples=N_RESAMPLES,
        num_levels=N_GRID_LEVELS,
        seed=np.random.default_rng([seed, 1]),
    )
    reach = np.asarray(indices["mu_star_conf"], dtype=np.float64)
    gap = np.full(count, np.nan)
    size, mean, scatter = (np.asarray(indices[name], dtype=np.float64) for name in INDEX_NAMES)
    return (
        Index(MU_STAR, size, np.maximum(size - reach, 0.0), size + reach),
        Index(MU_INDEX, mean, gap, gap),
        Index(SIGMA_INDEX, scatter, gap, gap),
    )


def run(setup: Setup, evaluator: Evaluator) -> Findings:
    """Return size, mean and scatter of the effects."""
    count, seed = len(setup.parameters), setup.seed
    spreads = [parameter.spread for parameter in setup.parameters]

    unit = sample(0, setup.samples, count, seed)
    points = values_across(spreads, unit.reshape(-1, count)).reshape(unit.shape)
    roles = [f"step {k}" for k in range(count + 1)]
    outputs = evaluator.outputs(points, roles)
    low, high = setup.ends.T
    grid = np.rint((points - low) / (high - low) * (N_GRID_LEVELS - 1)) / (N_GRID_LEVELS - 1)
    index_lines: list[IndexLine] = []
    for m, metric in enumerate(setup.study.metrics):
        analysis = analyze_complete(outputs[..., m], lambda kept: analyze(grid, kept, seed), INDEX_NAMES, count)
        index_lines += lines_of(metric, setup.paths, analysis, len(grid))
    return Findings(setup, evaluator, tuple(index_lines), points=points, outputs=outputs)


SENSITIVITY_METHOD = Method(
    run, lambda samples, parameters, _: samples * (parameters + 1), ("mu_star", "sigma"), {"": "draw_morris"}
)
