"""Equivalent rates of Li and Hao (2019), section 7, against exact beams: 85 steel, 1 mm x 5 mm, L1 = 38, L2 = 30 mm."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.elastica import Section
from cfmkit.families.slider_crank.flexures.leaves import (
    parallelogram_force,
    parallelogram_rate,
    pinned_beam_rate,
    pinned_beam_rates,
)

SECTION = Section(200e9, 5e-3, 1e-3)
RIGIDITY = 200e9 * 5e-3 * 1e-9 / 12
LONG, SHORT = 38e-3, 30e-3


def test_rates_of_the_prototype() -> None:
    assert pytest.approx(83333.33, abs=5e-3) == RIGIDITY * 1e6
    assert pinned_beam_rate(RIGIDITY, LONG) * 1e3 == pytest.approx(4934.2105, abs=5e-5)
    assert parallelogram_rate(RIGIDITY, SHORT) * 1e-3 == pytest.approx(148.148148, abs=5e-7)


def test_printed_parallelogram_rate_lacks_the_third_power() -> None:
    """48 EI / L2 is a moment [N m], and as a number of N/m a thousandth of what four leaves have."""
    leaves = parallelogram_force(SECTION, SHORT, np.array([1e-5]))[0] / 1e-5
    assert leaves == pytest.approx(parallelogram_rate(RIGIDITY, SHORT), rel=1e-6)
    assert 48 * RIGIDITY / SHORT / leaves == pytest.approx(SHORT**2, rel=1e-6)


def test_parallelogram_stiffens_by_a_tenth_of_a_per_cent_per_millimetre() -> None:
    travel = np.array([1e-3, 2e-3, 3e-3])
    ratio = parallelogram_force(SECTION, SHORT, travel) / travel / parallelogram_rate(RIGIDITY, SHORT)
    np.testing.assert_allclose(ratio - 1, [0.00114, 0.00458, 0.01038], atol=5e-6)


def test_pinned_beam_rate_is_too_large_for_small_rotations() -> None:
    """2.25 EI/L is right at about 43 deg; at rest it is 3 * 0.85^2 EI/L, 3.7 % less, and the prototype turns 11 deg."""
    rest, ten, large = pinned_beam_rates(SECTION, LONG, np.radians([1.0, 10.0, 43.5])) / (RIGIDITY / LONG)
    assert rest == pytest.approx(3 * 0.85**2, abs=3e-4)
    assert rest / 2.25 - 1 == pytest.approx(-0.037, abs=5e-4)
    assert ten == pytest.approx(2.171, abs=1e-3)
    assert large == pytest.approx(2.25, abs=3e-3)
