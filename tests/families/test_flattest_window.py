"""Ripples of many windows at once are those of each window by itself."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.families.proposals import ripples


def ripple_of(places, effort, start, length):
    inside = effort[(places > start) & (places < start + length)]
    values = np.concatenate([np.interp([start, start + length], places, effort), inside])
    if not np.isfinite(values).all() or values.max() <= 0.0:
        return np.inf
    return 1.0 - values.min() / values.max()


@pytest.mark.parametrize("seed", range(20))
def test_each_window_has_the_ripple_of_its_samples_and_ends(seed):
    draw = np.random.default_rng(seed)
    places, effort = np.sort(draw.uniform(size=60)), draw.normal(0.6, 0.5, size=60)
    effort[draw.integers(60)] = np.nan if seed % 2 else 1.0
    starts, length = np.linspace(places[0], places[-1] - 0.3, 25), 0.3
    alone = [ripple_of(places, effort, start, length) for start in starts]
    np.testing.assert_array_equal(ripples(places, effort, starts, length), alone)
