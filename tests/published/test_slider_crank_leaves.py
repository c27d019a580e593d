"""Equivalent rates of Li and Hao (2019), section 7, against exact beams: 85 steel, 1 mm x 5 mm, L1 = 38, L2 = 30 mm.

The joint at the slider is a beam clamped in the slider and pinned to the crank: a rigid link on a torsion spring at a
characteristic pivot [H]. The slider's own spring is a parallelogram of leaves. [LH] prints K_P = 48 EI / L2, which has
the dimension of a moment: it is 48 EI / L2^3, four guided leaves of 12 EI / L2^3 each.

Reference
---------
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 7.
[H] L. L. Howell, Compliant Mechanisms (2001), sec. 5.4: the pseudo-rigid-body model of a pinned beam.
"""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit.elastica as el

SECTION = el.Section(200e9, 5e-3, 1e-3)
RIGIDITY = 200e9 * 5e-3 * 1e-9 / 12
LONG, SHORT = 38e-3, 30e-3


CHARACTERISTIC = 0.85
"""Where the pivot of a pinned beam is, as a share of its length from the pinned end [LH, sec. 7]."""

LEAVES = 4
"""Leaves that a parallelogram moves in parallel."""


def pinned_beam_rate(rigidity: float, length: float) -> float:
    """Return the torsion rate of a beam that is clamped at one end and pinned at the other: 2.25 EI/L [LH, sec. 7]."""
    return 2.25 * rigidity / length


def parallelogram_rate(rigidity: float, length: float) -> float:
    """Return the rate of a parallelogram of four leaves: 48 EI/L^3, as it is meant in [LH, sec. 7]."""
    return 48.0 * rigidity / length**3


def pinned_beam_rates(section: el.Section, length: float, angles: np.ndarray) -> np.ndarray:
    """Return the secant torsion rate of an exact pinned beam at rotations of its pseudo-rigid link [N m/rad].

    The end is loaded across the unloaded beam; the rate is the moment of that force about the
    characteristic pivot over the angle of the pseudo-rigid link.

    Parameters
    ----------
    section : Section
        Of the beam.
    length : float
        [m].
    angles : (n,) array
        Rotations of the link at which the rate is wanted, increasing [rad].
    """
    network = el.Network(
        {"root": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT), "pin": el.Node(length, 0.0)},
        {"leaf": el.Beam("root", "pin", section)},
    )
    bending = float(np.real(section.rigidities(np.array([0.5]), 0.5)[0][0]))
    force = 8.0 * bending / length**2 * np.linspace(0.01, 1.0, 200)
    path = el.trace(network, el.Loading((el.PointLoad("pin", fy=1.0),), force), el.Control(tolerance=1e-9))
    at = path.at_requested
    moved = path.motion("pin")[at]
    arm = CHARACTERISTIC * length
    angle = np.arctan2(moved[:, 1], arm + moved[:, 0])
    rate = path.drive[at] * (arm + moved[:, 0]) / angle
    return np.asarray(np.interp(angles, angle, rate))


def parallelogram_force(section: el.Section, length: float, travel: np.ndarray) -> np.ndarray:
    """Return the force of four exact guided leaves over their common travel, free to shorten [N].

    Parameters
    ----------
    section : Section
        Of one leaf.
    length : float
        [m].
    travel : (n,) array
        Across the leaves, increasing [m].
    """
    network = el.Network(
        {"root": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT), "stage": el.Node(length, 0.0, el.Support(rotation=True))},
        {"leaf": el.Beam("root", "stage", section)},
    )
    path = el.trace(network, el.Displacement("stage", 0.5 * np.pi, travel), el.Control(tolerance=1e-9))
    force: np.ndarray = LEAVES * path.effort[path.at_requested]
    return force


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
