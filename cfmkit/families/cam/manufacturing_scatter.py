"""Forces of many cams with drawn errors, without friction: the band in which the force of one that is cut will lie.

Waviness is a sum of waves of equal power between the stated wavelength and the length of the flank, with random phases.
The roller is taken to touch every point of the flank, which holds for waves longer than its size makes it bridge.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, fig. 13.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.geometry.flank_from_roller_path import BuiltFlank, DesignFlank, arc_lengths
from cfmkit.families.cam.measured_cam import Sides
from cfmkit.families.cam.measured_cam_analysis import track_over_slider
from cfmkit.families.cam.solution import ForceBand

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.spec import Manufacturing
    from cfmkit.families.cam.statics import Assembly
    from cfmkit.numerics.rigid_point_registration import CurveFrame


N_WAVES = 24
N_PLACES = 1600


@dataclass(frozen=True)
class DrawnError:
    """The error of one flank that was drawn, with its derivatives over the arc length of the design."""

    amplitude: float  # of each wave [m]
    # number, phase, (k,): wave numbers [rad/m] and phases
    number: FloatArray
    phase: FloatArray
    offset: float  # [m]
    angle: float  # about the origin, positive where the cam grows wider towards the top [rad]
    nominal: CurveFrame  # the design at `arc`
    arc: FloatArray  # (n,) [m]

    @property
    def low(self) -> float:
        """First arc length [m]."""
        return float(self.arc[0])

    @property
    def high(self) -> float:
        """Last arc length [m]."""
        return float(self.arc[-1])

    def evaluate(self, places: FloatArray, derivative: int = 0) -> FloatArray:
        """Return the error [m] or one of its first two derivatives at the arc lengths of the design."""
        power = self.number**derivative
        turn = power * np.cos(np.multiply.outer(places, self.number) + self.phase + 0.5 * np.pi * derivative)
        still = self.offset if derivative == 0 else 0.0
        return np.asarray(self.amplitude * turn.sum(axis=1) + still + self.angle * self._lever(derivative))

    def _lever(self, derivative: int) -> FloatArray:
        """Return the normal displacement per angle, and its derivatives along the flank."""
        at = self.nominal
        along = (at.points * at.tangents).sum(axis=1)
        beside = (at.points * at.normals).sum(axis=1)
        return np.asarray((along, 1.0 - at.curvature * beside, np.zeros_like(along))[derivative])


def force_band(assembly: Assembly, tolerance: Manufacturing, travel: FloatArray, seed: int) -> ForceBand:
    """Return the forces at travels (n,) [m] of cams that are cut with errors of those standard deviations."""
    generator = np.random.default_rng(seed)
    flank = DesignFlank(assembly.profile, 1.0)
    arc = arc_lengths(flank)
    places = np.linspace(0.0, float(arc[1][-1]), N_PLACES)
    nominal = flank.frame(np.interp(places, arc[1], arc[0]))
    slider = assembly.track.start + travel
    loads = assembly.loads

    def side() -> tuple[FloatArray, FloatArray]:
        error = _draw_error(generator, tolerance, nominal, places)
        built = BuiltFlank(flank, error, arc).frame(places)  # type: ignore[arg-type]
        return _track(assembly, built, slider)

    forces = np.empty((tolerance.samples, len(travel)))
    for row in forces:
        (right_x, right), (left_x, left) = side(), side()
        row[:] = Sides((right_x, left_x), (right, left)).forces(loads, 0.0, loads.rest_half_width)[0]
    states = assembly.track.states(slider)
    designed = Sides((states.x, states.x), (states.slope, states.slope))
    return ForceBand(travel, forces, designed.forces(loads, 0.0, loads.rest_half_width)[0])


def _draw_error(
    generator: np.random.Generator, tolerance: Manufacturing, nominal: CurveFrame, places: FloatArray
) -> DrawnError:
    longest = float(places[-1])
    shortest = min(tolerance.wavelength, longest)
    lengths = np.exp(generator.uniform(np.log(shortest), np.log(longest), N_WAVES))
    return DrawnError(
        tolerance.waviness * (2.0 / N_WAVES) ** 0.5,
        2.0 * np.pi / lengths,
        generator.uniform(0.0, 2.0 * np.pi, N_WAVES),
        tolerance.offset * float(generator.normal()),
        tolerance.angle * float(generator.normal()),
        nominal,
        places,
    )


def _track(assembly: Assembly, built: CurveFrame, slider: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x [m] and slope of the roller's centre, a radius away from every point of the flank; NaN outside."""
    mechanism = assembly.spec.mechanism
    centers = built.points + mechanism.roller_radius * built.normals
    track = track_over_slider(centers, built, np.zeros(len(centers)), mechanism.brace_length)
    x, slope = (np.interp(slider, track.slider, of, left=np.nan, right=np.nan) for of in (track.x, track.slope))
    return x, slope
