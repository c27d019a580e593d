"""Pressure of the line contact between a roller and the cam, and whether the material bears it.

Two cylinders of one material press with p0 = sqrt(N E* / (pi b R)), E* = E / (2 (1 - nu^2)), 1/R = 1/r + 1/rho
with rho the radius of the cam where they touch. The material yields first below the surface, where the
largest shear stress is 0.30 p0: at p0 = 1.67 times the yield strength (Tresca). So the stress that is compared
with the allowable one is p0 / 1.67.

[J] K. L. Johnson, Contact Mechanics (1985), sec. 4.2 and 6.2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.rows import rows_of

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
    from cfmkit.families.cam.spec import Mechanism
    from cfmkit.families.cam.statics import Assembly
    from cfmkit.stock.material_and_part_spec import MaterialSpec


YIELD_PRESSURE = 1.67  # pressure at which a line contact first yields, over the yield strength [J, eq. 6.4].


def pressure(force: FloatArray, curvature: FloatArray, solid: MaterialSpec, width: float | FloatArray) -> FloatArray:
    """Return the Hertzian pressure p0 of line contacts of some width [m] between bodies of one material [Pa].

    They press with forces [N]; the curvatures of roller and cam add up to `curvature`, 1/R [1/m].
    """
    modulus = solid.modulus / (2.0 * (1.0 - solid.poisson**2))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt(force * modulus * curvature / (np.pi * width)))


def flank_pressure(assembly: Assembly, states: TrackStates, force: FloatArray, rows: Any = None) -> FloatArray:
    """Return the pressure where contacts press on the flank as designed [Pa]; NaN on the corner, and without a contact.

    Of the rollers in some states, (n,) or (k, n), pressed by forces of that shape [N]; `rows`: which mechanisms of the
    assembly these are, (k,); default: all.
    """
    mechanism, profile, contact = assembly.spec.mechanism, assembly.profile, assembly.spec.mechanism.contact
    if contact is None:
        return np.full_like(force, np.nan)
    numbers = profile.path.law, profile.roller_radius, mechanism.roller_radius, mechanism.profile.offset, contact.width
    law, cut_for, built, offset, width = numbers if rows is None else rows_of(numbers, rows)
    with np.errstate(divide="ignore", invalid="ignore"):
        curvature = 1.0 / built + 1.0 / (law.curvature_radius(states.parameter) - cut_for + offset)
    pressures = pressure(force, curvature, contact.material, width)
    return np.where(states.on_corner, np.nan, pressures)


def index_of_largest(pressures: FloatArray) -> int | None:
    """Return where the largest pressure is; None if there is none."""
    is_known = np.isfinite(pressures)
    return int(np.argmax(np.where(is_known, pressures, -np.inf))) if is_known.any() else None


def allowable_stress(mechanism: Mechanism) -> float | None:
    """Return yield strength over safety factor [Pa]; None without a contact, or where no strength is known."""
    return mechanism.contact.material.allowable(mechanism.safety_factor) if mechanism.contact else None


def stress(pressures: FloatArray) -> FloatArray:
    """Return the stress below the surface that is compared with the yield strength [Pa]."""
    return pressures / YIELD_PRESSURE
