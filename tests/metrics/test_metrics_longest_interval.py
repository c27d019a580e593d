"""The longest interval of a curve within a band is that of all that are tried."""

import numpy as np

from cfmkit.metrics.longest_interval_in_band import _levels, _reach, flat_window


def test_the_samples_within_the_band_behind_each_one_are_what_trying_all_gives():
    curves = np.random.default_rng(3).normal(size=(30, 40)).cumsum(axis=1) * 0.1 + 5
    curves[4, 10] = -1.0
    for curve, found in zip(curves, _reach(_levels(curves), 0.05), strict=True):
        for start, reach in enumerate(found.tolist()):
            parts = [curve[start : end + 1] for end in range(start + 1, len(curve))]
            fits = [part.min() > 0 and np.ptp(part) <= 0.05 * part.max() for part in parts]
            assert reach == [*fits, False].index(False)


def test_the_longest_interval_is_that_of_all_that_are_tried():
    places, fine = np.linspace(0.0, 1.0, 40), np.linspace(0.0, 1.0, 20 * 39 + 1)
    curves = np.random.default_rng(3).normal(size=(30, 40)).cumsum(axis=1) * 0.1 + 5
    curves[4, 10], curves[5, 20] = -1.0, np.nan

    def force_at(where):
        return np.stack([np.interp(one, places, curve) for one, curve in zip(where, curves, strict=True)])

    for curve, start, end in zip(curves, *flat_window(places, curves, 0.05, force_at), strict=True):
        force, best = np.nan_to_num(np.interp(fine, places, curve), nan=-1.0), 0
        for i in range(len(fine)):
            top, bottom = np.maximum.accumulate(force[i:]), np.minimum.accumulate(force[i:])
            fits = (bottom > 0) & (top - bottom <= 0.05 * top)
            best = max(best, [*fits.tolist(), False].index(False) - 1)
        assert -1e-9 <= end - start - fine[best] <= 2 * fine[1]
