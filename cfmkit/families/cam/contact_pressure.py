"""Pressure of the line contact between a roller and the cam, and whether the material bears it.

Two cylinders of one material press with p0 = sqrt(N E* / (pi b R)), E* = E / (2 (1 - nu^2)), 1/R = 1/r + 1/rho
with rho the radius of the cam where they touch. The material yields first below the surface, where the
largest shear stress is 0.30 p0: at p0 = 1.67 times the yield strength (Tresca). So the stress that is compared
with the allowable one is p0 / 1.67.

Reference
---------
[J] K. L. Johnson, Contact Mechanics (1985), sec. 4.2 and 6.2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
    from cfmkit.families.cam.solution import Assembly
    from cfmkit.families.cam.spec import Contact, Mechanism
    from cfmkit.stock.material_and_part_spec import MaterialSpec


YIELD_PRESSURE = 1.67
"""Pressure at which a line contact first yields, over the yield strength [J, eq. 6.4]."""


def pressure(force: FloatArray, curvature: FloatArray, contact: Contact) -> FloatArray:
    """Return the Hertzian pressure p0 of a line contact [Pa].

    Parameters
    ----------
    force : array
        Contact force [N].
    curvature : array
        Sum of the curvatures of roller and cam, 1/R [1/m].
    contact : Contact
        Width and material.
    """
    return pressure_between(force, curvature, contact.material, contact.width)


def pressure_between(
    force: FloatArray, curvature: FloatArray, solid: MaterialSpec, width: float | FloatArray
) -> FloatArray:
    """Return `pressure` of a contact of some width [m], or of many, between bodies of one material [Pa]."""
    modulus = solid.modulus / (2.0 * (1.0 - solid.poisson**2))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt(force * modulus * curvature / (np.pi * width)))


def flank_curvature(assembly: Assembly, parameter: FloatArray) -> FloatArray:
    """Return 1/R between the roller built in and the flank at path coordinates [1/m]."""
    mechanism = assembly.spec.mechanism
    with np.errstate(divide="ignore", invalid="ignore"):
        cam = assembly.profile.path.law.curvature_radius(parameter) - assembly.profile.roller_radius
        return np.asarray(1.0 / mechanism.roller_radius + 1.0 / (cam + mechanism.profile.offset))


def flank_pressure(assembly: Assembly, states: TrackStates, force: FloatArray) -> FloatArray:
    """Return the pressure where contacts press on the flank as designed [Pa]; NaN on the corner, and without a contact.

    Parameters
    ----------
    assembly : Assembly
        The parts.
    states : TrackStates
        Where the rollers are, (n,).
    force : (n,) array
        At a contact [N].
    """
    contact = assembly.spec.mechanism.contact
    if contact is None:
        return np.full_like(force, np.nan)
    found = pressure(force, flank_curvature(assembly, states.parameter), contact)
    return np.where(states.on_corner, np.nan, found)


def worst(pressures: FloatArray) -> int | None:
    """Return where the largest pressure is; None if there is none."""
    known = np.isfinite(pressures)
    return int(np.argmax(np.where(known, pressures, -np.inf))) if known.any() else None


def allowable_stress(mechanism: Mechanism) -> float | None:
    """Return yield strength over safety factor [Pa]; None without a contact, or where no strength is known."""
    return mechanism.contact.material.allowable(mechanism.safety_factor) if mechanism.contact else None


def stress(pressures: FloatArray) -> FloatArray:
    """Return the stress below the surface that is compared with the yield strength [Pa]."""
    return pressures / YIELD_PRESSURE
