"""Flattest window of a given length on a curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.results import Result

N_WINDOWS = 400  # windows that are compared, evenly over the curve
WINDOW_EXTENSION_SHARE = 1e-6
"""A window is made longer by this share of its length: to write it down must not make it shorter."""


def flattest(result: Result, length: float) -> tuple[float, float] | None:
    """Return the ends of the window of a length [m or rad] with the smallest ripple of its worst branch.

    Of the nominal curve; None if it is shorter, or has no force.
    """
    if not result.curves:
        return None
    curve = result.curve
    motion = np.asarray(curve.motion)
    low, high = float(motion.min()), float(motion.max())
    length = length * (1.0 + WINDOW_EXTENSION_SHARE)
    if not high - low >= length:
        return None
    starts = np.linspace(low, high - length, N_WINDOWS)
    worst = np.zeros(N_WINDOWS)
    for branch in curve.branches:
        part = curve.select_branch(branch)
        order = np.argsort(part.motion, kind="stable")
        worst = np.maximum(worst, ripples(part.motion[order], part.effort[order], starts, length))
    best = int(np.argmin(worst))
    return (float(starts[best]), float(starts[best]) + length) if np.isfinite(worst[best]) else None


def ripples(places: FloatArray, effort: FloatArray, starts: FloatArray, length: float) -> FloatArray:
    """Return (max - min)/max over windows of a length that begin at some places; infinite where the effort ends."""
    ends = np.interp([starts, starts + length], places, effort)
    outside = (places <= starts[:, None]) | (places >= starts[:, None] + length)
    highest = np.maximum(ends.max(axis=0), np.where(outside, -np.inf, effort).max(axis=1))
    lowest = np.minimum(ends.min(axis=0), np.where(outside, np.inf, effort).min(axis=1))
    is_known = np.isfinite(highest) & np.isfinite(lowest) & (highest > 0.0)
    return np.where(is_known, 1.0 - lowest / np.where(is_known, highest, 1.0), np.inf)
