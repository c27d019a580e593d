"""Forces inside a slider-crank: along the coupler, and of the slider on its guide.

The coupler is in equilibrium under the forces at its ends and the moments of the springs at crank pin and
slider pin; the slider passes on its own spring's force and what drives it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.build import Assembly
    from cfmkit.families.slider_crank.linkage import Linkage
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


def reactions(assembly: Assembly, units: UnitCurves, drive: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the force along the coupler and that of the slider on its guide.

    Parameters
    ----------
    assembly : Assembly
        The mechanism; rates of all legs.
    units : UnitCurves
        Along the motion, n places.
    drive : (n,) array
        Force that drives the slider towards the pivot [N]; zero where a torque drives the crank.

    Returns
    -------
    coupler, guide : (n,) array
        Tension in the coupler, and force on the guide across the slider's way (positive
        upwards) [N]; for the rates and the drive given, so of all legs together or of one.
    """
    link, rates, turn = assembly.linkage, assembly.rates, units.turn
    beta = _coupler_angle(link, units)
    along = -rates[3] * turn[3] - link.branch * drive  # force of spring and drive on the slider, along x
    moment = -rates[1] * turn[1] - rates[2] * turn[2]  # of both torsion springs on the coupler
    sine, cosine = np.sin(beta), np.cos(beta)
    with np.errstate(divide="ignore", invalid="ignore"):
        # moments about the crank pin: r2 (cos b Y - sin b X) + moment = 0, X and Y the slider's pull on the coupler
        across = (link.coupler * sine * along - moment) / (link.coupler * cosine)
    coupler: FloatArray = along * cosine + across * sine
    return coupler, -across


def _coupler_angle(link: Linkage, units: UnitCurves) -> FloatArray:
    """Return the direction of the coupler [rad].

    A slider that is driven takes the crank pin past the place where the coupler stands across its way; from there on
    the coupler points to the other side than the branch says.
    """
    beta = link.coupler_angle(units.angle)
    turned = link.branch * (units.position - link.crank * np.cos(units.angle)) < 0.0
    angle: FloatArray = np.where(turned, np.pi - beta, beta)
    return angle
