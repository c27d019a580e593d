"""Extremes next to samples and other places of many curves: those of one sorted list of both."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.metrics.continuous_means_and_extremes import extremes, extremes_of_all


def draw_curve(draw, n, k):
    """Return samples, places between their ends and a wave: with places at samples, at each other and at both ends."""
    motion = np.sort(draw.uniform(0.0, 1.0, n))
    places = np.concatenate([draw.uniform(motion[0], motion[-1], k), draw.choice(motion, 2), motion[[0, 0, -1]]])
    frequency, phase, slope = draw.uniform(0.5, 9.0), draw.uniform(0.0, 6.0), draw.choice([0.0, -3.0, 3.0])

    def wave(x):
        return np.sin(frequency * x + phase) + slope * x

    return motion, np.sort(np.append(places, places[:2])), wave


@pytest.mark.parametrize(("n", "k"), [(200, 12), (200, 300), (40, 5), (97, 4), (2, 3), (3, 1)])
def test_extremes_of_samples_and_places_are_those_of_all_of_them_in_one_order(n, k):
    draw = np.random.default_rng([n, k])
    for _ in range(60):
        motion, places, wave = draw_curve(draw, n, k)
        together = np.unique(np.concatenate([motion, places]))[None, :]
        expected = extremes(wave, together, wave(together))
        # two rows: the second has its last sample repeated, as rows of several lengths have
        rows = np.append(motion, motion[-1])[None, :].repeat(2, axis=0)
        samples = rows, wave(rows), np.array([n - 1, n - 1])
        both = places[None, :].repeat(2, axis=0)
        found = extremes_of_all(wave, samples, both, wave(both), False)
        for whole, part in zip(expected, found, strict=True):
            assert part.tolist() == [whole[0], whole[0]]
