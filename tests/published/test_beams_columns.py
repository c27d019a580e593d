"""Columns pressed together far beyond their critical load: the end is moved, not loaded.

Reference
---------
S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability, 2nd ed., 1961, sec. 2.7: with k the sine of half the angle at
the ends, P = (2 K(k)/pi)^2 P_cr and the ends approach by 2 (1 - E(k)/K(k)) L.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from cfmkit.beams import CLAMPED, PINNED, Beam, Control, Displacement, Network, Node, PathStatus, Section, guided, trace

LENGTH = 0.1
APPROACH = np.linspace(0.02, 0.5, 13)


def elastica(approach: float) -> float:
    """Return the load of a pinned column over the critical one, for the approach of its ends over its length."""
    m = brentq(lambda m: 2 * (1 - ellipe(m) / ellipk(m)) - approach, 1e-9, 0.9)
    return float((2 * ellipk(m) / np.pi) ** 2)


def column(slenderness: float, clamped: bool) -> tuple[Network, float]:
    """Return a column whose far end is guided along it, and its critical load [N]."""
    section = Section(2e9, 1e-2, LENGTH * np.sqrt(12) / slenderness)
    ends = (CLAMPED, guided(0.0)) if clamped else (PINNED, guided(0.0, rotates=True))
    nodes = {"a": Node(0, 0, ends[0]), "b": Node(LENGTH, 0, ends[1])}
    rigidity = 2e9 * 1e-2 * section.thickness**3 / 12  # type: ignore[operator]
    return Network(nodes, {"x": Beam("a", "b", section)}), (4 if clamped else 1) * np.pi**2 * rigidity / LENGTH**2


@pytest.mark.parametrize("imperfection", [0.0, 1e-5 * LENGTH, 1e-3 * LENGTH])
@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("slenderness", [100, 400])
def test_a_column_is_followed_far_beyond_its_critical_load(
    slenderness: float, clamped: bool, imperfection: float
) -> None:
    """The first point asked for lies far behind the bifurcation: 20 to 300 times the critical approach."""
    network, critical = column(slenderness, clamped)
    path = trace(network, Displacement("b", np.pi, APPROACH * LENGTH), Control(imperfection=imperfection))
    assert path.status is PathStatus.COMPLETE, path.message
    assert path.stable[path.at_asked].all()
    ratio = path.effort[path.at_asked] / critical
    expected = [elastica(one) for one in APPROACH]  # a clamped column is four quarters of which two are a pinned one
    shortening = 20.0 / slenderness**2 * (4 if clamped else 1)  # of the axis, which the elastica has not
    np.testing.assert_allclose(ratio, expected, rtol=shortening + 20 * imperfection / LENGTH)
