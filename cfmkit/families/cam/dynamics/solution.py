"""What is known of a cam mechanism that went through a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.arrays import ShortRepr

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.roller_curves_and_motion import Cycloid, Machine, Moment
    from cfmkit.families.cam.solution import Assembly
    from cfmkit.families.cam.spec import CamSpec


@dataclass(frozen=True, repr=False)
class History(ShortRepr):
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


@dataclass(frozen=True, repr=False)
class Build(ShortRepr):
    """A mechanism put together for a motion.

    Attributes
    ----------
    right, left : Assembly
        The parts of each side.
    machine : Machine
        What moves.
    motion : Cycloid
        How the slider moves.
    lift : float
        Height of the origin of slider positions above the start of the roller path [m].
    """

    right: Assembly
    left: Assembly
    machine: Machine
    motion: Cycloid
    lift: float


@dataclass(frozen=True, repr=False)
class MotionSolution(ShortRepr):
    """A mechanism that went through a motion, as checks, values and pictures need it.

    Attributes
    ----------
    spec : CamSpec
        Resolved.
    build : Build
        The parts.
    history : History
        Forces and speeds over time.
    static : (n,) array
        Force on the slider at rest in the same places [N].
    displacement : (n,) array
        Of the slider, from the origin that the analysis asks for [m].
    """

    spec: CamSpec
    build: Build
    history: History
    static: FloatArray
    displacement: FloatArray
