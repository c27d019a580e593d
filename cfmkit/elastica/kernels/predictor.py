"""The next point of a path predicted from the last ones, and how far from that it may come to lie."""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.compiler import kernel
from cfmkit.elastica.kernels.dense import copy

MISSED = 0.4  # largest share of a step by which it may miss what the points before it, or its slopes, foretell


@kernel
def _predict(times, past, slopes, count, natural, t, y):
    """Extrapolate the kept points (newest first) to t: by their values, in natural steps by their slopes as well."""
    for k in range(y.shape[0]):
        y[k] = 0.0
    for i in range(count):
        weight, change = 1.0, 0.0
        for j in range(count):
            if j != i:
                weight *= (t - times[j]) / (times[i] - times[j])
                change += 1.0 / (times[i] - times[j])
        along = 0.0
        if natural:  # Hermite's polynomial
            along = (t - times[i]) * weight * weight
            weight *= weight * (1.0 - 2.0 * (t - times[i]) * change)
        for k in range(y.shape[0]):
            y[k] += weight * past[i, k] + along * slopes[i, k]


@kernel
def remember(kept, count, t, y, drive, slope, most):
    """Put a point in front of the kept ones; return how many there are."""
    times, past, slopes = kept
    for i in range(most - 1, 0, -1):
        times[i] = times[i - 1]
        copy(past[i], past[i - 1])
        copy(slopes[i], slopes[i - 1])
    times[0] = t
    for k in range(y.shape[0]):
        past[0, k] = y[k]
    past[0, y.shape[0]] = drive
    copy(slopes[0], slope)
    return min(count + 1, most)


@kernel
def changes(y, other, n_free, n):
    """Return the largest difference of the poses of two states."""
    change = 0.0
    for i in range(y.shape[0]):
        if i < n_free or (i >= n and (i - n) % 6 < 3):
            change = max(change, abs(y[i] - other[i]))
    return change


@kernel
def pulls(y, other, n_free, n):
    """Return the largest change of a force at the end of a beam, relative to the largest force."""
    change, largest = 0.0, 0.0
    for i in range(n_free, n):
        change, largest = max(change, abs(y[i] - other[i])), max(largest, abs(y[i]))
    return change / largest if largest > 0.0 else 0.0


@kernel
def misses(old, new, one, other, ahead, n_free, n):
    """Return by how much the mean slope misses the largest change of a pose: a lot where another path was met."""
    most = 0.0
    for i in range(new.shape[0]):
        if i < n_free or (i >= n and (i - n) % 6 < 3):
            most = max(most, abs(new[i] - old[i] - 0.5 * ahead * (one[i] + other[i])))
    return most


@kernel
def set_border(natural, tangent, weight, n_free, border):
    """Set the bordering row: the drive itself, or the weighted tangent."""
    n = border.shape[0] - 1
    for i in range(n + 1):
        border[i] = 0.0
    if natural:
        border[n] = 1.0
        return
    norm = tangent[n] * tangent[n]
    for i in range(n):
        w = 1.0 if i < n_free else weight
        border[i] = w * tangent[i]
        norm += w * tangent[i] * tangent[i]
    border[n] = tangent[n]
    scale = 1.0 / np.sqrt(norm)
    for i in range(n + 1):
        border[i] *= scale
        tangent[i] *= scale


@kernel
def aim(y, state, border, tangent, paths, natural, goal, ahead):
    """Set the first guess of the next point; return the right side of the bordering row.

    paths: kept points, how many, present parameter, the guess. In natural steps the right side is the drive's value.
    """
    (times, past, slopes), count, t, guess = paths
    n, size = border.shape[0] - 1, y.shape[0]
    _predict(times, past, slopes, count, natural, t + ahead, guess)
    if count == 1 and not natural:
        for i in range(n):
            guess[i] += tangent[i] * ahead
        guess[size] += tangent[n] * ahead
    copy(y, guess)
    if natural:
        state[0] = goal
        return goal
    state[0] = guess[size]
    level = border[n] * past[0, size] + ahead
    for i in range(n):
        level += border[i] * past[0, i]
    return level
