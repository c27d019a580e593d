"""Polynomials through nodes."""

from __future__ import annotations

import numpy as np

from cfmkit.numerics.interpolation import differentiation, interpolation


def test_polynomials_through_nodes_are_exact() -> None:
    nodes, places = np.cos(np.linspace(0, np.pi, 6)), np.linspace(-1, 1, 9)
    np.testing.assert_allclose(interpolation(nodes, places) @ nodes**5, places**5, atol=1e-14)
    np.testing.assert_allclose(differentiation(nodes) @ nodes**5, 5 * nodes**4, atol=1e-13)
