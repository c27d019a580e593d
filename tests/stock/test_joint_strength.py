"""Pins, eyes and rods: sizes that bear. The formulas have hand calculations in their docstrings."""

import pytest

from cfmkit.stock.joint_strength import (
    SHEAR_SHARE,
    bearing_pressure,
    eye_that_bears,
    link_stress,
    pin_bending,
    pin_shear,
    pin_that_bears,
    rod_sag,
    rod_that_guides,
    shear_out,
)
from cfmkit.stock.stock_series import series_of

PINS = series_of("pin", "metric").sizes


@pytest.mark.parametrize("force", [1.0, 50.0, 1500.0])
def test_a_chosen_pin_bears_and_the_next_thinner_one_does_not(force):
    found = pin_that_bears(force, 0.008, 0.008, 150e6, 150e6, PINS)
    bears = [
        bearing_pressure(force, d, 0.008) <= 150e6 and pin_bending(force, 0.008, d) <= 150e6
        and pin_shear(force, d) <= SHEAR_SHARE * 150e6
        for d in PINS
    ]  # fmt: skip
    assert found == PINS[bears.index(True)]
    assert pin_that_bears(1e9, 0.008, 0.008, 150e6, 150e6, PINS) is None


def test_an_eye_and_a_rod_that_are_chosen_bear_their_loads():
    width = eye_that_bears(1500.0, 0.004, 0.005, 100e6, 0.001)
    assert link_stress(1500.0, 0.0, width, 0.004, 0.005) <= 100e6 * (1 + 1e-12)
    assert shear_out(1500.0, width, 0.004, 0.005) <= SHEAR_SHARE * 100e6 * (1 + 1e-12)
    found = rod_that_guides(30.0, 0.25, 210e9, 150e6, 1e-3, PINS)
    thinner = PINS[PINS.index(found) - 1]
    assert rod_sag(30.0, 0.25, found, 210e9) <= 0.25e-3 < rod_sag(30.0, 0.25, thinner, 210e9)
