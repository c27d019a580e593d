"""The mechanism as the support of an end-effector: contact force while its tip follows a surface [Lan, sec. IV].

The carrier moves along x; the tip is guided along the drive and follows the heights, so that the mechanism is displaced
by the preload plus the height. With a slope angle a and friction m the axial force F of the mechanism is held by the
normal force N: F = N (cos a - m sin a) on the way along x, and the carrier is pushed back by N (sin a + m cos a).

Assumes: slow motion, a sharp tip that stays on the surface, guides without friction.

Reference
---------
[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010), sec. IV and Fig. 14.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import Column, Curve
from cfmkit.families.beam.findings import finding
from cfmkit.numerics.cubic import values_at
from cfmkit.results import Quantity
from cfmkit.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.curves import FloatArray
    from cfmkit.families.beam.model import Solution
    from cfmkit.families.beam.surface.spec import Surface
    from cfmkit.results import Finding

DEFINITIONS = {
    "tip_force_min": ("force", "smallest axial force of the tip along the surface"),
    "tip_force_max": ("force", "largest axial force of the tip along the surface"),
    "tip_force_band": ("ratio", "(max - min)/max of the axial force along the surface"),
    "surface_relief": ("length", "largest height of the surface less the smallest"),
    "contact_force_max": ("force", "largest normal force between tip and surface"),
    "lateral_force_max": ("force", "largest force against the motion along the surface"),
    "surface_reach": ("length", "how far along the surface the mechanism can follow it"),
}


@dataclass(frozen=True)
class Ride:
    """What happens along a surface, as far as the mechanism can follow it.

    Attributes
    ----------
    place, height, displacement : (n,) array
        Along the surface, of it, and of the mechanism [m].
    force, contact, lateral : (n,) array
        Axial force of the tip, normal force on the surface, force against the motion [N].
    stress : (n,) array
        Largest stress in the mechanism [Pa].
    stable : (n,) array of bool
        Whether the mechanism is stable there.
    missing : str
        Why it ends before the surface does; empty if it does not.
    """

    place: FloatArray
    height: FloatArray
    displacement: FloatArray
    force: FloatArray
    contact: FloatArray
    lateral: FloatArray
    stress: FloatArray
    stable: Any
    missing: str = ""


def profile(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return places along a surface and its heights [m].

    Raises
    ------
    cfmkit.errors.DataError
        If the file cannot be used.
    """
    given = surface.profile
    if given.kind == "file":
        from pathlib import Path

        from cfmkit.tables.labpoints import read_profile

        return read_profile(getattr(given.file, "path", Path(given.file)))
    from cfmkit.numerics.formula import formula

    x = np.linspace(0.0, given.length, given.points)
    return x, formula(given.height)(x * 1e3) * 1e-3


def ride(solution: Solution) -> Ride | None:
    """Return what happens along the surface of the analysis; None where there is no surface."""
    surface = solution.spec.analysis.surface
    if surface is None:
        return None
    place, height = profile(surface)
    displacement = surface.preload + height
    x = solution.motion
    inside = np.isfinite(displacement) & (displacement >= x.min() - 1e-15) & (displacement <= x.max() * (1 + 1e-12))
    count = len(place) if inside.all() else int(np.argmin(inside))
    missing = ""
    if count < len(place):
        missing = (
            f"the surface asks for a displacement of {format_short(float(displacement[count]), 'length')} at "
            f"{format_short(float(place[count]), 'length')}, the mechanism is solved for "
            f"{format_short(float(x.min()), 'length')} to {format_short(float(x.max()), 'length')}"
        )
    slope = np.gradient(height, place)[:count]
    place, height, displacement = place[:count], height[:count], displacement[:count]
    force = values_at(x, solution.effort, displacement)
    cos = 1.0 / np.hypot(1.0, slope)
    with np.errstate(divide="ignore"):
        contact = force / np.maximum(cos - surface.friction * slope * cos, 0.0)
    lateral = contact * (slope * cos + surface.friction * cos)
    stress = np.interp(displacement, x, solution.stress)
    stable = np.interp(displacement, x, solution.stable) == 1
    return Ride(place, height, displacement, force, contact, lateral, stress, stable, missing)


def curve_of(found: Ride) -> Curve:
    """Return the contact along the surface as a curve over the way along it."""
    extra = {
        "surface_height": Column(found.height, "length"),
        "mechanism_displacement": Column(found.displacement, "length"),
        "contact_force": Column(found.contact, "force"),
        "lateral_force": Column(found.lateral, "force"),
        "max_stress": Column(found.stress, "stress"),
    }
    branch = np.repeat(["surface"], len(found.place))
    return Curve(found.place, found.force, branch, found.stable, extra, label={"over": ("surface", "text")})


def values_along(found: Ride) -> Mapping[str, Quantity]:
    """Return the scalar results of a ride by name."""
    numbers: dict[str, float | None] = dict.fromkeys(DEFINITIONS)
    if len(found.place):
        low, high = float(found.force.min()), float(found.force.max())
        numbers = {
            "tip_force_min": low,
            "tip_force_max": high,
            "tip_force_band": (high - low) / high if high > 0 else None,
            "surface_relief": float(np.ptp(found.height)),
            "contact_force_max": float(found.contact.max()) if np.isfinite(found.contact).all() else None,
            "lateral_force_max": float(found.lateral.max()) if np.isfinite(found.lateral).all() else None,
            "surface_reach": float(found.place[-1] - found.place[0]),
        }
    return {name: Quantity(value, *DEFINITIONS[name]) for name, value in numbers.items()}


def findings_along(found: Ride) -> Iterator[Finding]:
    """Yield what is wrong with a ride."""
    if found.missing:
        yield finding("surface_out_of_reach", found.missing)
    if len(found.force) and found.force.min() <= 0:
        place = float(found.place[int(found.force.argmin())])
        yield finding("tip_lifts_off", f"the tip is not pressed on the surface at {format_short(place, 'length')}")
    if not np.isfinite(found.contact).all():
        place = float(found.place[int(np.argmin(np.isfinite(found.contact)))])
        yield finding("tip_jams", f"the slope at {format_short(place, 'length')} is too steep for the friction")
