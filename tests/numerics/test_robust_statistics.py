"""Spikes of a series."""

from __future__ import annotations

import numpy as np
import pytest
from experiment_support import lossy_loop, reference_case, triangle

from cfmkit.numerics.robust_statistics import spikes


@pytest.mark.parametrize("gap", [0.0, 1.0])
@pytest.mark.parametrize("noise", [0.0, 0.02, 0.5])
def test_no_sample_of_a_sound_recording_is_a_spike(gap, noise):
    for seed in range(3):
        for points in (30, 400):
            case = lossy_loop(triangle(3, points), gap, noise=noise, seed=seed)
            assert not spikes(case.effort).any()
            assert not spikes(case.motion).any()
    assert not spikes(reference_case().effort).any()
    steps = np.repeat([0.0, 50.0, 20.0], 50)
    assert not spikes(steps).any()
