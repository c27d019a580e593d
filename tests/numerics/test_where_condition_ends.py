"""Ends of conditions, many at once: as one by one, where excesses jump, have poles or kinks, and in few calls."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from cfmkit.numerics.roots import BRACKET_RTOL, last_places

ROOT = 0.3 + 0.4 * np.arange(12) / 11
CURVES = {
    "smooth": lambda x, at: np.expm1(x - at),
    "steep": lambda x, at: np.tanh(50.0 * (x - at)),
    "a kink": lambda x, at: np.maximum(x - at, 3.0 * (x - at)),
    "a jump": lambda x, at: np.where(x <= at, -0.5, 0.7),
    "lost by not being a number": lambda x, at: np.where(x <= at, x - at - 0.1, np.nan),
    "a flat touch": lambda x, at: (x - at) ** 3,
    "a pole behind which all is well": lambda x, at: np.where(x <= at, -np.inf, 1e-9 / np.maximum(x - at, 1e-300)),
}


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_ends_are_found_to_a_billionth_of_a_step_or_better(name, way):
    def excess(places, ends):
        return CURVES[name](way * places, way * ROOT[ends][:, None] if way > 0 else -ROOT[ends][:, None])

    zero, one = np.zeros((4, 3)), np.ones((4, 3))
    found = last_places(excess, *((zero, one) if way > 0 else (one, zero)))
    # Where the excess is as flat as a cube, rounding hides 1e-5; the condition holds there all the same.
    apart = 1e-4 if name == "a flat touch" else 3 * BRACKET_RTOL
    np.testing.assert_allclose(found.ravel(), ROOT, atol=apart)
    assert (excess(found.reshape(-1, 1), np.arange(12)) <= 1e-14).all()


def test_smooth_ends_take_few_calls_and_only_those_that_are_left():
    rng, sizes = np.random.default_rng(1), []
    rate, root = rng.uniform(0.2, 2.0, 500), rng.uniform(0.01, 0.99, 500)

    def excess(places, ends):
        sizes.append(places.size)
        return np.exp(rate[ends][:, None] * places) - np.exp(rate * root)[ends][:, None]

    found = last_places(excess, np.zeros((100, 5)), np.ones((100, 5))).ravel()
    wanted = [
        brentq(lambda x, k=k: np.exp(rate[k] * x) - np.exp(rate[k] * root[k]), 0, 1, xtol=1e-15) for k in range(500)
    ]
    np.testing.assert_allclose(found, wanted, atol=3 * BRACKET_RTOL)
    assert len(sizes) <= 4
    assert sum(sizes) < 50 * 500


def test_nothing_to_look_for_is_not_looked_at():
    places = np.array([[0.2, 0.4]])
    np.testing.assert_array_equal(last_places(lambda *_: pytest.fail("asked"), places, places), places)


def test_what_is_known_of_both_ends_holds_whatever_the_last_bit():
    start, stop = np.array([[0.1]]), np.array([[0.2]])
    assert last_places(lambda x, _: x * 0 + 1e-17, start, stop) == start
    assert last_places(lambda x, _: x * 0 - 0.1, start, stop)[0, 0] == pytest.approx(0.2, abs=1e-12)
