"""Causes of the departure of a measured loop: profile, friction, rest length of the springs.

The area between the branches is proportional to the rolling friction, whatever moves both of them together; the line
midway between them is not moved by friction, but by springs that are longer or shorter than stated, -d/D of the force
for d on either side. So the loop gives the friction and the midline the rest length, one after the other until neither
changes. The errors of a measured profile need no fit: the model has them. What is left is unexplained.

`calibrate` fits the same values with intervals, and others.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.measured_cam import MeasuredCam, Sides, root_mean_square
from cfmkit.families.cam.solution import Solution
from cfmkit.results import Quantity, quantities

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import MeasuredLoop
    from cfmkit.families.cam.statics import Loads
    from cfmkit.results import Result

DEVIATION_DEFINITIONS = {
    "data_friction": (
        "ratio",
        "rolling friction whose loop has the measured area, over the displacements that are compared",
    ),
    "data_rest_error": (
        "length",
        "by how much the springs' rest length must exceed the stated one to explain the measured midline",
    ),
    "data_off_design": ("force", "root mean square of the measured force less that of the design without friction"),
    "data_by_profile": ("force", "root mean square contribution of the measured errors of the profile"),
    "data_by_friction": ("force", "root mean square contribution of the friction that gives the measured loop area"),
    "data_by_rest_length": ("force", "root mean square contribution of the springs' rest length, its error included"),
    "data_unexplained": ("force", "root mean square of the remainder"),
}
_MAX_ROUNDS = 12
_DIFFERENCE_STEP = 1e-6  # of friction, and of the rest half width [m], for derivatives


def attribute_deviation(result: Result, loop: MeasuredLoop) -> Mapping[str, Quantity]:
    """Return causes of a measured loop's deviation from a quasi-static model, by name; empty for a model in time."""
    state = result.state
    if not isinstance(state, MeasuredCam | Solution):
        return {}
    sides, designed = _sides(state, loop.places - state.origin)
    loads, mechanism = state.assembly.loads, state.assembly.spec.mechanism
    drawn = mechanism.springs_rest_as_cut
    friction, rest = _explain_loop(sides, loads, loop)
    design = designed.forces(loads, 0.0, drawn)[0]
    on_track = sides.forces(loads, 0.0, drawn)[0]
    smooth = sides.forces(loads, 0.0, rest)[0]
    up, down = (sides.forces(loads, direction * friction, rest)[0] for direction in (1.0, -1.0))
    numbers = {
        "data_friction": friction,
        "data_rest_error": 2.0 * (rest - loads.rest_half_width),
        "data_off_design": root_mean_square(loop.up - design, loop.down - design),
        "data_by_profile": root_mean_square(on_track - design),
        "data_by_friction": root_mean_square(up - smooth, down - smooth),
        "data_by_rest_length": root_mean_square(smooth - on_track),
        "data_unexplained": root_mean_square(loop.up - up, loop.down - down),
    }
    if not np.isfinite(list(numbers.values())).all():
        why = "no friction and rest length of this model give the measured loop"
        return {name: Quantity(None, *DEVIATION_DEFINITIONS[name], why) for name in DEVIATION_DEFINITIONS}
    return quantities(DEVIATION_DEFINITIONS, numbers)


def _sides(state: MeasuredCam | Solution, travel: FloatArray) -> tuple[Sides, Sides]:
    """Return both sides at some travels: as built, and as designed."""
    track = state.assembly.track
    states = track.states(track.start + travel)
    designed = Sides((states.x, states.x), (states.slope, states.slope))
    if isinstance(state, Solution):
        return designed, designed
    x, slope = (
        tuple(np.interp(travel, state.travel, side) for side in pair) for pair in (state.sides.x, state.sides.slope)
    )
    return Sides((x[0], x[1]), (slope[0], slope[1])), designed


def _explain_loop(sides: Sides, loads: Loads, loop: MeasuredLoop) -> tuple[float, float]:
    """Return the friction that has the measured area, and the rest half width [m] that has the measured midline."""
    friction, rest = 0.0, loads.rest_half_width
    area, middle = np.trapezoid(loop.up - loop.down, loop.places), 0.5 * (loop.up + loop.down)
    for _ in range(_MAX_ROUNDS):
        size = friction or _DIFFERENCE_STEP
        up, down = (sides.forces(loads, direction * size, rest)[0] for direction in (1.0, -1.0))
        new = float(size * area / np.trapezoid(up - down, loop.places))
        slope = (
            _middle(sides, loads, new, rest + _DIFFERENCE_STEP) - _middle(sides, loads, new, rest)
        ) / _DIFFERENCE_STEP
        step = float(slope @ (middle - _middle(sides, loads, new, rest)) / (slope @ slope))
        done = abs(new - friction) <= 1e-12 and abs(step) <= 1e-12
        friction, rest = new, rest + step
        if done or not np.isfinite(friction + rest):
            break
    return friction, rest


def _middle(sides: Sides, loads: Loads, friction: float, rest: float) -> FloatArray:
    """Return the line midway between the branches [N]."""
    up, down = (sides.forces(loads, direction * friction, rest)[0] for direction in (1.0, -1.0))
    middle: FloatArray = 0.5 * (up + down)
    return middle
