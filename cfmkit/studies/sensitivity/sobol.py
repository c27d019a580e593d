"""Sobol indices: the share of the variance that a parameter causes, alone and with others.

SALib draws the points and estimates the indices; drawing and analysing are apart.
Nothing here decides what a missing value means: the outputs must be complete.

Reference
---------
[S] A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.studies.sensitivity.indices import Analysis, Index, unstated_indices

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

FIRST, TOTAL = "first_order", "total_order"
NAMES = (FIRST, TOTAL)
RESAMPLES = 200
"""Bootstrap samples behind an interval."""

CONSTANT = 1e-12
"""An output that varies less than so much of its size does not vary: it has no variance to share out."""

FEWEST = 16
"""Convergence is shown from so many blocks on."""


def problem(count: int) -> dict[str, Any]:
    """Return a unit cube as SALib wants it described."""
    return {"num_vars": count, "names": [str(k) for k in range(count)], "bounds": [[0.0, 1.0]] * count}


def sample(start: int, count: int, parameters: int, seed: int) -> FloatArray:
    """Return blocks of points of the unit cube, (count, parameters + 2, parameters).

    A block is a point A, then A with one coordinate each of a point B, then B. Blocks
    are those of one scrambled sequence: drawing more leaves the first ones as they are.

    Parameters
    ----------
    start, count : int
        Which blocks.
    parameters : int
        Dimension of the cube.
    seed : int
        Of the scrambling.
    """
    from SALib.sample import sobol

    with warnings.catch_warnings():
        # A number of points that is not a power of two is less balanced; the caller says so once.
        warnings.simplefilter("ignore", UserWarning)
        points = sobol.sample(problem(parameters), start + count, calc_second_order=False, seed=seed)
    blocks: FloatArray = np.asarray(points).reshape(start + count, parameters + 2, parameters)[start:]
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
    if varies_not(outputs):
        return unstated_indices(NAMES, count)
    from SALib.analyze import sobol

    # SALib takes a seed of zero for none.
    found = sobol.analyze(
        problem(count), outputs.ravel(), calc_second_order=False, num_resamples=RESAMPLES, seed=seed + 1
    )
    return tuple(_index(name, found[key], found[f"{key}_conf"]) for name, key in zip(NAMES, ("S1", "ST"), strict=True))


def varies_not(outputs: FloatArray) -> bool:
    """Return whether all outputs are the same, but for rounding."""
    return bool(np.ptp(outputs) <= CONSTANT * np.abs(outputs).max())


def _index(name: str, value: Any, reach: Any) -> Index:
    values, reaches = np.asarray(value, dtype=np.float64), np.asarray(reach, dtype=np.float64)
    return Index(name, values, values - reaches, values + reaches)


def stages(count: int) -> list[int]:
    """Return numbers of blocks at which to look whether the indices still change.

    Examples
    --------
    >>> stages(256)
    [16, 32, 64, 128, 256]
    """
    found = [count]
    while found[0] // 2 >= FEWEST:
        found.insert(0, found[0] // 2)
    return found


def convergence(outputs: FloatArray, seed: int) -> list[tuple[int, Analysis]]:
    """Return the indices from the first 16, ..., n/4, n/2, n blocks."""
    return [(size, analyze(outputs[:size], seed)) for size in stages(len(outputs))]
