"""Formulas of x are computed, and nothing but formulas."""

import numpy as np
import pytest

from cfmkit.specs.formula_of_x import formula


@pytest.mark.parametrize(
    ("text", "expected"),
    [("2", 2.0), ("x**2 - 1", 3.0), ("-x + max(x, 3)", 1.0), ("sin(pi*x/4)", 1.0), ("sqrt(abs(-x*2))", 2.0)],
)
def test_formulas_are_computed(text, expected):
    np.testing.assert_allclose(formula(text)(np.full(3, 2.0)), expected)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x +", "is not a formula"),
        ("", "is not a formula"),
        ("y*2", "'y' is unknown here"),
        ("__import__('os')", "is unknown here"),
        ("x.real", "is unknown here"),
        ("[x]", "is unknown here"),
        ("sin(x, x)", "takes 1 value"),
        ("True", "is unknown here"),
        ("'a'", "is unknown here"),
        ("x" * 600, "at most 500"),
    ],
)
def test_anything_else_is_refused(text, words):
    with pytest.raises(ValueError, match=words.replace("(", r"\(")):
        formula(text)
