"""Places and extremes of beams do not depend on the number of points, also where the curve folds back."""

from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.metrics import winding_branches

CONFIGS = Path(__file__).parents[2] / "configs"


def numbers(name, *settings):
    result = cfmkit.analyze(cfmkit.load(CONFIGS / f"{name}.yaml", list(settings)))
    return {key: quantity.value for key, quantity in result.metrics.items()}


def test_a_curve_that_folds_back_is_usable_at_the_same_places_however_many_points_it_has():
    lee = "mechanism.material={youngs_modulus: 720 MPa, yield_strength: 30 MPa}"
    for settings in ((), (lee, "analysis.window=[20 mm, 60 mm]")):
        few, many = (numbers("beam_lee_frame", *settings, f"analysis.points={count}") for count in (11, 60))
        for name in ("usable_start", "usable_end", "force_min", "force_max", "force_ripple", "stress_max"):
            assert few[name] == pytest.approx(many[name], rel=1e-6), (name, settings)


def test_the_stress_limit_is_reached_at_the_same_place_however_many_points():
    few, many = (numbers("beam_two_layers", f"analysis.points={count}") for count in (31, 91))
    for name in ("stress_limit_displacement", "usable_end"):
        assert few[name] == pytest.approx(many[name], rel=1e-9), name
    assert few["stress_max"] == pytest.approx(many["stress_max"], rel=1e-7)


def test_a_valley_is_at_the_same_place_however_many_points():
    few, many = (numbers("beam_end_effector", f"analysis.points={count}") for count in (31, 101))
    for name in ("peak_displacement", "valley_displacement"):
        assert few[name] == pytest.approx(many[name], rel=1e-8), name


class Bow:
    """A motion of sin t under an effort of t: it turns at a quarter and at three quarters of the round."""

    ways = np.sort(np.append(np.linspace(0.0, 2.0 * np.pi, 21), [0.5 * np.pi, 1.5 * np.pi]))

    def states(self, ways):
        return np.sin(ways), np.asarray(ways)

    def stress(self, ways):
        return np.asarray(ways) ** 2


def test_the_mean_of_a_winding_branch_is_that_of_its_closed_form():
    # the integral of t |cos t| over the round is 4 pi, that of |cos t| is 4
    assert winding_branches.mean(Bow(), -np.inf, np.inf) == pytest.approx(np.pi, rel=1e-8)
    # in a window of motions from 0 to a half each t has its mirror image pi - t
    assert winding_branches.mean(Bow(), 0.0, 0.5) == pytest.approx(np.pi / 2, rel=1e-8)


def test_what_a_winding_branch_breaks_is_told_in_its_motion():
    ((low, high),) = winding_branches.list_broken_intervals(
        Bow(), lambda ways: np.abs(ways - 0.5 * np.pi) - 0.2 * np.pi
    )[:1]
    assert (low, high) == pytest.approx((0.0, np.sin(0.3 * np.pi)), abs=1e-12)
    assert winding_branches.list_broken_intervals(Bow(), lambda ways: ways - 7.0) == []
    assert winding_branches.extremes(Bow(), 0.6, 2.0) == pytest.approx((np.pi - np.arcsin(0.6), np.arcsin(0.6)))
    assert winding_branches.stress_extremes(Bow(), -2.0, 2.0) == pytest.approx((4 * np.pi**2, 0.0))
