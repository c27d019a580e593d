"""Links, pins and rods: formulas against hand calculations, and sizes that bear."""

import math

import pytest

from cfmkit.stock.joint_strength import (
    SHEAR_SHARE,
    bearing_pressure,
    euler_load,
    eye_that_bears,
    link_stress,
    pin_bending,
    pin_shear,
    pin_that_bears,
    rod_bending,
    rod_sag,
    rod_that_guides,
    shear_out,
)
from cfmkit.stock.stock_series import series_of

PINS = series_of("pin", "metric").sizes


def test_formulas_are_those_of_a_hand_calculation():
    # a link of 12 x 3 mm with a hole of 4 mm: 24 mm2, and (12^3 - 4^3)/12*3/6 = 69.33 mm3
    assert link_stress(200.0, 0.0, 0.012, 0.003, 0.004) == pytest.approx(200 / 24e-6)
    assert link_stress(0.0, 0.3, 0.012, 0.003, 0.004) == pytest.approx(0.3 / (3e-3 * (12e-3**3 - 4e-3**3) / 12 / 6e-3))
    assert bearing_pressure(200.0, 0.004, 0.003) == pytest.approx(200 / 12e-6)
    assert shear_out(200.0, 0.012, 0.003, 0.004) == pytest.approx(200 / (2 * 4e-3 * 3e-3))  # two walls of 4 mm
    assert euler_load(200e9, 0.012, 0.003, 0.1) == pytest.approx(math.pi**2 * 200e9 * (0.012 * 27e-9 / 12) / 0.01)
    section, inertia = math.pi * 4e-3**3 / 32, math.pi * 4e-3**4 / 64
    assert pin_bending(200.0, 0.005, 0.004) == pytest.approx(200 * 0.005 / section)
    assert pin_shear(200.0, 0.004) == pytest.approx(4 / 3 * 200 / (math.pi * 2e-3**2))
    assert rod_bending(20.0, 0.2, 0.004) == pytest.approx(20 * 0.2 / 4 / section)
    assert rod_sag(20.0, 0.2, 0.004, 210e9) == pytest.approx(20 * 0.2**3 / (48 * 210e9 * inertia))


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
