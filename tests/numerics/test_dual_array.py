"""Dual arrays: the derivatives of what is computed with them are those of differences."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from cfmkit.numerics.dual_array import DualArray, cos_sin, map_analytic, slopes_of, stack

if TYPE_CHECKING:
    from collections.abc import Callable

RNG = np.random.default_rng(3)
A, B = 1 + RNG.random((4, 3)), 1 + RNG.random(3)
DA, DB = RNG.normal(size=(2, 4, 3)), RNG.normal(size=(2, 3))
M, C = RNG.normal(size=(3, 5)), RNG.normal(size=(4, 1))


def exponential(x: Any) -> Any:
    return map_analytic(lambda own: (np.exp(own), own), x)[0] if isinstance(x, DualArray) else np.exp(x)


FORMULAS: dict[str, Callable[[Any, Any], Any]] = {
    "sum": lambda a, b: a + b + C,
    "difference": lambda a, b: 2.0 - b - a - C,
    "product": lambda a, b: C * a * b * 3.0,
    "quotient": lambda a, b: (a / b + C / b) / 7.0,
    "power": lambda a, b: a**3 * b**2,
    "matrix": lambda a, b: (a * b) @ M + (b @ M),
    "rows": lambda a, b: a[1:, :2] * b[..., 1:] + b[None, [0, 2]],
    "reduced": lambda a, b: (a * b).sum(axis=-1) - b.sum(axis=-1),
    "angles": lambda a, b: cos_sin(a)[0] * cos_sin(b)[1],
    "stacked": lambda a, b: stack([a, b + 0.0 * A, C + 0.0 * A]),
    "constant along an axis": lambda a, b: (b[:1] * (1.0 + 0.0 * A)) @ M + a @ M,
    "analytic": lambda a, b: exponential(a * b),
}


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
def test_derivatives_are_those_of_differences(formula: Callable[[Any, Any], Any]) -> None:
    found = formula(DualArray(A, DA), DualArray(B, DB))
    np.testing.assert_array_equal(found.value, formula(A, B))
    assert found.slopes.ndim == found.value.ndim + 1
    for k in (0, 1):
        h = 1e-6
        slope = (formula(A + h * DA[k], B + h * DB[k]) - formula(A - h * DA[k], B - h * DB[k])) / (2 * h)
        np.testing.assert_allclose(found.all_slopes[k], slope, rtol=1e-7, atol=1e-7)


def test_what_is_no_dual_array_has_no_derivatives() -> None:
    assert not slopes_of(A, 2, (4, 3)).any()
    assert slopes_of(DualArray(B, DB), 2, (4, 3)).shape == (2, 4, 3)
