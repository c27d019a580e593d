"""The stress that strips are optimised by: its peaks between the samples, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from flexure_support import ABS, MM, WIDTH, corners

from cfmkit.families.slider_crank.printed.sqp_program import Form, StripProgram, StripTask

TASK = StripTask(corners(), np.pi, ABS, 1.5, 1 * MM, 20 * MM, 0.01, "stroke", 60 * MM)
EVEN, PLACED = Form(9, width=WIDTH), Form(12, per_piece=(2,) * 5, width=WIDTH)


def random_strip(form: Form, seed: int) -> np.ndarray:
    """Return the numbers of a strip whose thicknesses scatter by a tenth, pressed by 3 cm."""
    rng = np.random.default_rng(seed)
    thickness = 0.98 * np.exp(0.1 * rng.standard_normal(form.count))
    shares = np.tile([0.3, 0.7], form.placed // 2) + 0.1 * rng.uniform(-1, 1, form.placed)
    return np.concatenate([thickness, shares, [3.0]])


@pytest.mark.parametrize("form", [EVEN, PLACED], ids=["even", "placed"])
@pytest.mark.parametrize("seed", range(4))
def test_the_stress_that_is_optimised_is_that_of_the_analysis(form: Form, seed: int) -> None:
    """Even samples alone are up to 2 % below the peak between them."""
    state = StripProgram(TASK, form).state(random_strip(form, seed))
    assert state is not None
    peak = state.path.peak_stress().value[state.path.at_requested[-1]]
    assert state.stress.max() == pytest.approx(peak, rel=1e-7)


@pytest.mark.parametrize("form", [EVEN, PLACED], ids=["even", "placed"])
def test_the_derivatives_of_the_peaks_are_those_of_differences(form: Form) -> None:
    z = random_strip(form, 0)
    program = StripProgram(TASK, form)
    slopes = program.slopes(z)
    assert slopes is not None
    count, step = len(program.state(z).stress), 1e-4  # type: ignore[union-attr]
    for k in range(len(z)):
        sides = [program.values(z + side * step * np.eye(len(z))[k]) for side in (-1, 1)]
        low, high = (side[1][-count:] for side in sides if side is not None)
        np.testing.assert_allclose(
            slopes[1][-count:, k], (high - low) / (2 * step), atol=2e-4 * np.abs(slopes[1]).max()
        )
