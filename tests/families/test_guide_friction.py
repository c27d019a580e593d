"""Friction of a guide: the force is the root of its balance, as near to jamming as the spec allows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfmkit.families.guide_friction import GuideFriction

FORCES = np.array([-300.0, -2.0, 0.0, 1e-3, 50.0, 4000.0])
ACROSS = np.array([0.0, -30.0, 5.0, 1e-9, 200.0, -7000.0])


@given(
    st.floats(0.0, 1.0), st.floats(0.0, 40.0), st.floats(0.0, 0.999), st.sampled_from([0.0, 12.0, 500.0]),
    st.sampled_from([1.0, -1.0]),
)  # fmt: skip
def test_the_force_balances_its_own_friction(friction, drag, share, off_plane, way):
    """Both ends are loaded by half of what acts across and by the couple of the force itself."""
    tilt = share / friction if friction > 1e-3 else 1.0
    force = GuideFriction(friction, drag, tilt).force(FORCES, ACROSS, off_plane, way)
    ends = (np.hypot(0.5 * (ACROSS + sign * tilt * force), 0.5 * off_plane) for sign in (1.0, -1.0))
    balance = FORCES + way * (drag + friction * sum(ends))
    scale = 1.0 + np.abs(force) + friction * (np.abs(ACROSS) + off_plane)
    assert (np.abs(balance - force) <= 1e-12 * scale).all()


@pytest.mark.parametrize("share", [0.5, 0.96, 0.999])
def test_a_force_beside_the_guide_grows_by_a_geometric_series(share):
    """Nothing else across: F = F0 / (1 - mu tilt); a sum of the first hundred terms is 2 % short at 0.96."""
    found = GuideFriction(0.3, 0.0, share / 0.3).force(np.array([50.0]), np.zeros(1), 0.0, 1.0)
    assert found == pytest.approx(50.0 / (1.0 - share), rel=1e-12)


def test_a_point_without_force_stays_without():
    found = GuideFriction(0.3, 1.0, 0.5).force(np.array([np.nan, 2.0]), np.array([1.0, 1.0]), 3.0, 1.0)
    assert np.isnan(found[0])
    assert np.isfinite(found[1])
