"""Equivalent rates of the flexures of a constant-torque mechanism, and how far exact beams agree with them.

The joint at the slider is a beam clamped in the slider and pinned to the crank: a rigid link on a torsion spring at a
characteristic pivot. The slider's own spring is a parallelogram of leaves. [LH] prints K_P = 48 EI / L2, which has
the dimension of a moment: it is 48 EI / L2^3, four guided leaves of 12 EI / L2^3 each.

Reference
---------
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 7.
[H] L. L. Howell, Compliant Mechanisms (2001), sec. 5.4: the pseudo-rigid-body model of a pinned beam.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import (
    CLAMPED,
    Beam,
    Control,
    Displacement,
    Loading,
    Network,
    Node,
    PointLoad,
    Section,
    Support,
    trace,
)

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

CHARACTERISTIC = 0.85
"""Where the pivot of a pinned beam is, as a share of its length from the pinned end [LH, sec. 7]."""

LEAVES = 4
"""Leaves that a parallelogram moves in parallel."""


def pinned_beam_rate(rigidity: float, length: float) -> float:
    """Return the torsion rate of a beam that is clamped at one end and pinned at the other: 2.25 EI/L [LH, sec. 7].

    Examples
    --------
    >>> round(pinned_beam_rate(0.0833333333, 0.038) * 1e3, 4)
    4934.2105
    """
    return 2.25 * rigidity / length


def parallelogram_rate(rigidity: float, length: float) -> float:
    """Return the rate of a parallelogram of four leaves: 48 EI/L^3, as it is meant in [LH, sec. 7].

    Examples
    --------
    >>> round(parallelogram_rate(0.0833333333, 0.030) * 1e-3, 6)
    148.148148
    """
    return 48.0 * rigidity / length**3


def pinned_beam_rates(section: Section, length: float, angles: FloatArray) -> FloatArray:
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
    network = Network(
        {"root": Node(0.0, 0.0, CLAMPED), "pin": Node(length, 0.0)}, {"leaf": Beam("root", "pin", section)}
    )
    bending = float(np.real(section.rigidities(np.array([0.5]), 0.5)[0][0]))
    force = 8.0 * bending / length**2 * np.linspace(0.01, 1.0, 200)
    path = trace(network, Loading((PointLoad("pin", fy=1.0),), force), Control(tolerance=1e-9))
    at = path.at_asked
    moved = path.motion("pin")[at]
    arm = CHARACTERISTIC * length
    angle = np.arctan2(moved[:, 1], arm + moved[:, 0])
    rate = path.drive[at] * (arm + moved[:, 0]) / angle
    return np.asarray(np.interp(angles, angle, rate))


def parallelogram_force(section: Section, length: float, travel: FloatArray) -> FloatArray:
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
    network = Network(
        {"root": Node(0.0, 0.0, CLAMPED), "stage": Node(length, 0.0, Support(rotation=True))},
        {"leaf": Beam("root", "stage", section)},
    )
    path = trace(network, Displacement("stage", 0.5 * np.pi, travel), Control(tolerance=1e-9))
    force: FloatArray = LEAVES * path.effort[path.at_asked]
    return force
