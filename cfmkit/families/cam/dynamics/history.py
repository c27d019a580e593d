"""What a motion gives over time, whichever formulation computed it.

Sides are rows: right, left, with x outwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.dynamics.inverse import respond
from cfmkit.families.cam.dynamics.multibody import NineCoordinates
from cfmkit.families.cam.dynamics.reactions import reactions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.machine import Machine
    from cfmkit.families.cam.dynamics.motion import Cycloid, Moment
    from cfmkit.families.cam.dynamics.multibody import Scheme


@dataclass(frozen=True)
class History:
    """Forces and speeds of a motion.

    Attributes
    ----------
    times : (n,) array
        [s].
    moment : Moment
        Position, speed and acceleration of the slider.
    force : (n,) array
        On the slider, upwards [N].
    contact, traction : (2, n) array
        Normal and tangential force of the cam on a roller [N].
    spin : (2, n) array
        Speed at which a roller turns, positive on the way up [rad/s].
    brace : (2, n) array
        Force that a brace transmits at the roller's axis [N].
    pin : (2, n) array
        Force between brace and slider [N]: the other end of the same, brace inertia between them.
    elongation : (n,) array
        Of the springs [m].
    center : (2, n) complex array
        Axes of the rollers [m].
    on_corner : (n,) array of bool
        Whether a roller pivots on the corner of its cam.
    """

    times: FloatArray
    moment: Moment
    force: FloatArray
    contact: FloatArray
    traction: FloatArray
    spin: FloatArray
    brace: FloatArray
    pin: FloatArray
    elongation: FloatArray
    center: NDArray[np.complex128]
    on_corner: NDArray[np.bool_]


def inverse_history(machine: Machine, motion: Cycloid, times: FloatArray) -> History:
    """Return the history by inverse dynamics."""
    found = respond(machine, motion.at(times))
    return History(
        times=times,
        moment=found.moment,
        force=found.force,
        contact=found.contact,
        traction=found.traction,
        spin=found.spin,
        brace=np.abs(found.roller_pin),
        pin=np.abs(found.slider_pin),
        elongation=found.elongation,
        center=found.at.center,
        on_corner=found.on_corner,
    )


def multibody_history(
    machine: Machine, motion: Cycloid, points: int, scheme: Scheme | None = None, first: int | None = None
) -> History:
    """Return the history by the nine-coordinate formulation, without rolling resistance.

    Of `points` equally spaced times over the motion, it is known at the `first` ones where the motion ends early.

    Raises
    ------
    CornerContact
        If a roller runs on the corner of its cam.
    """
    model = NineCoordinates(machine)
    found = model.run(motion, points, scheme, first)
    right, left = reactions(model, found)
    center = np.array([right.center, left.center])
    return History(
        times=found.times,
        moment=motion.at(found.times),
        force=found.force,
        contact=np.array([right.contact, left.contact]),
        traction=np.array([right.traction, left.traction]),
        spin=np.array([right.spin, left.spin]),
        brace=np.abs([right.roller_pin, left.roller_pin]),
        pin=np.abs([right.slider_pin, left.slider_pin]),
        elongation=np.abs(center[0] + center[1].conj()) - machine.rest_length,
        center=center,
        on_corner=np.zeros(len(found.times), dtype=bool),
    )
