"""Strength of the links of springs at pins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cfmkit.families import PartStrength
from cfmkit.families.slider_crank.springs.hardware import LinkBar, LinkLoads, links_that_bear


def loads(axial=0.0, moment=0.0, pin=0.0, rate=0.0, length=0.03):
    return LinkLoads((length, length), np.full((2, 1), axial), np.full((2, 1), moment), np.array([pin]), (rate, rate))


def test_links_bear_what_the_formulas_of_a_bar_with_holes_say():
    link = LinkBar(width=8e-3, sheet=2e-3, hole=2e-3, modulus=2e9)
    assert link.stress(loads(axial=-12.0)) == pytest.approx(12.0 / (6e-3 * 2e-3))
    inertia = 2e-3 * ((8e-3) ** 3 - (2e-3) ** 3) / 12.0
    assert link.stress(loads(moment=0.1)) == pytest.approx(0.1 * 4e-3 / inertia)
    assert link.bearing(loads(pin=20.0)) == pytest.approx(20.0 / (2e-3 * 2e-3))
    assert link.shear_out(loads(pin=20.0)) == pytest.approx(20.0 / (2 * 3e-3 * 2e-3))
    turn = link.turn_share(loads(rate=0.05))
    assert turn == pytest.approx(0.05 * 0.03 / (2e9 * 2e-3 * (8e-3) ** 3 / 12.0))
    euler = math.pi**2 * 2e9 * 8e-3 * (2e-3) ** 3 / 12.0 / 0.03**2
    assert link.safety(loads(axial=-1.0), 1e12) == pytest.approx(euler)


def test_links_are_as_narrow_as_their_loads_allow():
    acting = loads(axial=-12.0, moment=0.05, pin=12.0, rate=0.05)
    strength = PartStrength("x", 2e9, 40e6, 235e6, assumed=False)
    link = links_that_bear(acting, 2e-3, strength, 0.4e-3, 3e-3)
    assert link.safety(acting, 40e6) >= 1.0
    assert 0.0099 < link.turn_share(acting) <= 0.01
    assert links_that_bear(acting, 0.2e-3, strength, 0.4e-3, 3e-3) is None
    assert links_that_bear(acting, 2e-3, strength, 0.4e-3, 0.5e-3) is None


def test_the_thinnest_pins_of_links_are_those_of_1_mm():
    link = links_that_bear(loads(pin=0.1), 2e-3, PartStrength("x", 2e9, 40e6, 235e6, assumed=False), 0.4e-3, 3e-3)
    assert link.hole == 1e-3
