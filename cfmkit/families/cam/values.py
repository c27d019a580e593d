"""Scalar results of a cam mechanism, beside the constant-force metrics of every family."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.built_values import BUILT_DEFINITIONS
from cfmkit.families.cam.contact import flank_pressure
from cfmkit.families.cam.statics import forces
from cfmkit.numerics import sampled
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.build import Assembly
    from cfmkit.families.cam.model import Solution
    from cfmkit.families.cam.statics import Forces

DEFINITIONS = {
    "force_constant": ("length", "A of the cut profile; the force is 4 K A [SS, eq. 1]"),
    "spring_stiffness": ("stiffness", "K, the sum of all parallel springs"),
    "theoretical_force": (
        "force",
        "4 K A, plus the weights that the profile is shaped to carry: without friction, with the parts it is cut for",
    ),
    "undercut_travel": ("length", "travel at the start that runs on a corner of the cam; 0 if the roller fits"),
    "roller_radius_max": ("length", "smallest radius of curvature of the roller path: the largest roller that fits"),
    "force_constant_min": ("length", "smallest force constant whose path the roller can follow"),
    "corner_force_max": (
        "force",
        "largest force on the way up while the roller pivots on the corner; none if friction holds it there",
    ),
    "jam_travel": ("length", "travel at the start over which friction lets no force move the slider up"),
    "spring_elongation_max": ("length", "largest elongation of the springs"),
    "contact_force_max": ("force", "largest contact force between a roller and the cam"),
    "pressure_angle_max": ("angle", "largest angle between a brace's pull and its roller's motion, on the flank"),
    "brace_angle_max": ("angle", "largest angle of a brace from the axis"),
    "friction_half_gap_max": (
        "ratio",
        "largest (up - down)/(up + down) on the flank: set by friction and geometry, no choice of profile removes it",
    ),
    "contact_pressure_max": (
        "stress",
        "largest Hertzian pressure of the line contact on the flank, on the way up; in motion, of both sides",
    ),
    "contact_force_min": ("force", "smallest contact force during a motion: below zero the roller would leave the cam"),
    "brace_force_max": ("force", "largest force of a motion in a brace, at the roller's axis"),
    "roller_speed_max": ("angular_velocity", "largest speed at which a roller turns"),
    "slider_speed_max": ("velocity", "largest speed of the slider"),
    "slider_acceleration_max": ("acceleration", "largest acceleration of the slider"),
    "dead_weight_peak": ("ratio", "largest acceleration over g: what the motion adds to the force of a dead weight"),
    "moving_mass_max": ("mass", "largest mass that, fixed to the slider, would have the same kinetic energy"),
    "force_peak_over_static": ("ratio", "largest F/F_0 - 1 of a motion, F_0 the force at rest in the same place"),
    "force_dip_under_static": ("ratio", "largest 1 - F/F_0 of a motion; above 1 the force changes its sign"),
    "force_peak_over_slow": ("ratio", "largest F/F_1 - 1, F_1 the force of the same motion within 1 s [SS, Fig. 14]"),
    "angle_error_effect": (
        "ratio",
        "static force at the end of the motion over that with flanks at the right angles, less 1 [SS, Fig. 15 and 16]",
    ),
} | BUILT_DEFINITIONS


def values_of(solution: Solution) -> Mapping[str, Quantity]:
    """Return the scalar results by name; None where a value does not exist."""
    assembly = solution.assembly
    law = assembly.profile.path.law
    flank = ~solution.states.on_corner
    numbers: dict[str, float | None] = {
        **design_values(assembly),
        "undercut_travel": solution.corner_travel,
        "roller_radius_max": float(law.curvature_radius(law.rest_half_width)),
        "force_constant_min": law.smallest_force_constant(assembly.profile.roller_radius),
        "corner_force_max": _corner_peak(solution),
        "jam_travel": next((high for low, high in solution.jams if low == 0), 0.0),
        "spring_elongation_max": float(solution.elongation.max()),
        "contact_force_max": largest(solution.up.contact, solution.down.contact),
        "pressure_angle_max": largest(solution.pressure_angle[flank]),
        "brace_angle_max": float(np.arcsin(solution.states.x.max() / assembly.track.brace_length)),
        "friction_half_gap_max": _half_gap(solution, flank),
    }
    if assembly.spec.mechanism.contact:
        numbers["contact_pressure_max"] = largest(contact_pressure(solution)[flank])
    if solution.band is not None:
        shares = solution.band.deviations()
        numbers["manufacturing_force_share"] = float(np.median(shares))
        numbers["manufacturing_force_share_95"] = float(np.quantile(shares, 0.95))
    return {name: Quantity(value, *DEFINITIONS[name]) for name, value in numbers.items()}


def design_values(assembly: Assembly) -> dict[str, float]:
    """Return what the profile and the springs say by themselves, by name."""
    return {
        "force_constant": assembly.profile.path.law.force_constant,
        "spring_stiffness": assembly.loads.stiffness,
        "theoretical_force": constant_force(assembly),
    }


def theoretical_force(solution: Solution) -> float:
    """Return 4 K A and the weights that a weight-carrying profile adds [N]."""
    return constant_force(solution.assembly)


def constant_force(assembly: Assembly) -> float:
    """Return the force that the profile is cut for, with the springs and weights built in [N]."""
    law, loads = assembly.profile.path.law, assembly.loads
    return 4.0 * loads.stiffness * law.force_constant + loads.slider_weight


def contact_pressure(solution: Solution, forces: Forces | None = None) -> FloatArray:
    """Return the pressure of the line contact, on the way up if nothing else is said [Pa]; NaN on the corner."""
    return flank_pressure(solution.assembly, solution.states, (forces or solution.up).contact)


def largest(*arrays: FloatArray) -> float | None:
    """Return the largest finite value of all arrays; None if there is none."""
    finite = [array[np.isfinite(array)] for array in arrays]
    return max((float(array.max()) for array in finite if array.size), default=None)


def _half_gap(solution: Solution, flank: NDArray[np.bool_]) -> float | None:
    up, down = solution.up.slider, solution.down.slider
    usable = flank & np.isfinite(up) & np.isfinite(down) & (up + down > 0)
    return largest(((up - down) / np.where(usable, up + down, 1.0))[usable])


def _corner_peak(solution: Solution) -> float | None:
    """Return the peak force on the corner, from samples refined by a parabola through the highest [N]."""
    assembly = solution.assembly
    corner = min(solution.corner_travel, float(solution.travel[-1]))
    if corner <= 0 or any(low < corner for low, _ in solution.jams):  # next to a jam the force has no bound
        return None
    travel = np.linspace(0.0, corner * (1 - 1e-9), 129)
    states = assembly.track.states(assembly.track.start + travel)
    force = forces(states, assembly.loads, assembly.spec.mechanism.rolling_friction).slider
    top = int(np.argmax(force))
    if not 0 < top < len(force) - 1:
        return float(force[top])
    return float(sampled.largest(travel, force)[0])
