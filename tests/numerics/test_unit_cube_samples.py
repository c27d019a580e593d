"""Samples of the unit cube."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.numerics.unit_cube_samples import SAMPLE_KINDS, SampleKind, sample_unit_cube

pytestmark = pytest.mark.lists


def test_every_way_to_draw_fills_the_unit_cube_evenly(monkeypatch):
    monkeypatch.setitem(SAMPLE_KINDS, "halton", SampleKind("halton", "a Halton sequence", "Halton"))
    for name in SAMPLE_KINDS:
        points = sample_unit_cube(name, 3, 256, 7)
        assert points.shape == (256, 3)
        counts = np.stack([np.histogram(column, 8, (0.0, 1.0))[0] for column in points.T])
        assert np.abs(counts - 32).max() <= 2  # at random some of the 24 bins would miss by ten
        assert np.array_equal(points, sample_unit_cube(name, 3, 256, 7))
        assert not np.array_equal(points, sample_unit_cube(name, 3, 256, np.random.default_rng(7)))
