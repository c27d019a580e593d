"""Functions as rows of Chebyshev polynomials: how short panels become, and where halving ends."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.numerics.interpolation import MAX_PLACES, N_PANEL_NODES, resolve_panels


def test_smooth_functions_and_one_with_a_corner_are_resolved() -> None:
    ends = np.linspace(0.0, 3.0, 3)
    wave, bow = resolve_panels(lambda x: np.array([np.sin(9.0 * x), np.abs(x - 1.234)]), ends, (1e-10, 1e-6), 20)
    x = np.linspace(0.0, 3.0, 401)
    np.testing.assert_allclose(wave.evaluate(x), np.sin(9.0 * x), atol=1e-9)
    np.testing.assert_allclose(bow.evaluate(x), np.abs(x - 1.234), atol=2e-6)


def test_halving_ends_with_noise_that_no_panel_resolves() -> None:
    rng, rounds = np.random.default_rng(0), []

    def noise(x: np.ndarray) -> np.ndarray:
        rounds.append(len(x))
        return 1.0 + 1e-3 * rng.standard_normal((1, len(x)))

    (found,) = resolve_panels(noise, np.array([0.0, 1.0]), (1e-8,), 20)
    assert max(rounds) <= 2 * MAX_PLACES
    assert MAX_PLACES / N_PANEL_NODES < len(found.ends) - 1 <= 2 * MAX_PLACES / N_PANEL_NODES
    assert found.evaluate(np.array([0.3]))[0] == pytest.approx(1.0, abs=0.02)
