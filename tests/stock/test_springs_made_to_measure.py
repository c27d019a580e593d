"""Springs of steel wire that are made for a rate and a motion."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.helical_spring_formulas import tensile_strength
from cfmkit.stock.springs.offers import SERIES_SHARES, slimmest_spring, stiffest_rates
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring
from cfmkit.stock.stock_series import series_of


def test_a_spring_of_wire_keeps_its_rate_and_its_stress():
    spring = slimmest_spring(ExtensionSpring, 690.0, 0.132, 0.136)
    assert spring.rate == pytest.approx(690.0, rel=0.01 / spring.turns)
    assert spring.wire in series_of("wire", "metric").sizes
    assert spring.stress(spring.rate * 0.132) <= SERIES_SHARES["shear"] * tensile_strength(spring.wire)
    assert spring.free_length_for(0.132) <= 0.136
    safe = slimmest_spring(ExtensionSpring, 690.0, 0.132, 0.200, safety=2.0)
    assert safe.yield_load() >= 2.0 * safe.rate * 0.132
    assert slimmest_spring(ExtensionSpring, 690.0, 0.132, 0.050) is None


@pytest.mark.parametrize("spring_type", [ExtensionSpring, HelicalTorsionSpring])
def test_the_stiffest_spring_that_fits_is_just_the_last_that_can_be_made(spring_type):
    for deflection, widest, long in [(0.3, 8e-3, 20e-3), (0.02, 5e-3, 60e-3), (1.5, 12e-3, 10e-3)]:
        far = deflection if spring_type.dimension == "angle" else 0.02 * deflection
        rate = float(stiffest_rates(spring_type, np.array([far]), widest, long)[0])
        last, none = (slimmest_spring(spring_type, share * rate, far, long) for share in (0.98, 1.02))
        assert last.outer_diameter <= widest
        assert none is None or none.outer_diameter > widest
