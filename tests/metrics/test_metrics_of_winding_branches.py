"""Branches that wind: their mean, extremes and broken intervals are those of their closed form."""

import numpy as np
import pytest

from cfmkit.metrics import branches


class Bow:
    """A motion of sin t under an effort of t: it turns at a quarter and at three quarters of the round."""

    ways = np.sort(np.append(np.linspace(0.0, 2.0 * np.pi, 21), [0.5 * np.pi, 1.5 * np.pi]))

    def states(self, ways):
        return np.sin(ways), np.asarray(ways)

    def stress(self, ways):
        return np.asarray(ways) ** 2


def test_the_mean_of_a_winding_branch_is_that_of_its_closed_form():
    # the integral of t |cos t| over the round is 4 pi, that of |cos t| is 4
    assert branches.mean(Bow(), -np.inf, np.inf) == pytest.approx(np.pi, rel=1e-8)
    # in a window of motions from 0 to a half each t has its mirror image pi - t
    assert branches.mean(Bow(), 0.0, 0.5) == pytest.approx(np.pi / 2, rel=1e-8)


def test_what_a_winding_branch_breaks_is_told_in_its_motion():
    ((low, high),) = branches.list_broken_intervals(Bow(), lambda ways: np.abs(ways - 0.5 * np.pi) - 0.2 * np.pi)[:1]
    assert (low, high) == pytest.approx((0.0, np.sin(0.3 * np.pi)), abs=1e-12)
    assert branches.list_broken_intervals(Bow(), lambda ways: ways - 7.0) == []
    assert branches.extremes(Bow(), 0.6, 2.0) == pytest.approx((np.pi - np.arcsin(0.6), np.arcsin(0.6)))
    assert branches.stress_extremes(Bow(), -2.0, 2.0) == pytest.approx((4 * np.pi**2, 0.0))
