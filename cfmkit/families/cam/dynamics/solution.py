"""Solution of a cam mechanism in motion: its machine, and its forces and speeds over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.arrays import ShortRepr

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.roller_curves_and_motion import Cycloid, Machine, SliderState
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.cam.statics import Assembly


@dataclass(frozen=True, repr=False)
class History(ShortRepr):
    """Forces and speeds of a motion."""

    times: FloatArray  # (n,) [s]
    slider: SliderState  # position, speed and acceleration of the slider
    force: FloatArray  # (n,) on the slider, upwards [N]
    # contact, traction, (2, n): normal and tangential force of the cam on a roller [N]
    contact: FloatArray
    traction: FloatArray
    spin: FloatArray  # (2, n) speed at which a roller turns, positive on the way up [rad/s]
    brace: FloatArray  # (2, n) force that a brace transmits at the roller's axis [N]
    pin: FloatArray  # (2, n) force between brace and slider [N]: the other end of the same, brace inertia between them
    elongation: FloatArray  # (n,) of the springs [m]
    center: NDArray[np.complex128]  # (2, n) axes of the rollers [m]
    on_corner: NDArray[np.bool_]  # (n,) whether a roller pivots on the corner of its cam


@dataclass(frozen=True, repr=False)
class Build(ShortRepr):
    """A mechanism put together for a motion."""

    # right, left: the parts of each side
    right: Assembly
    left: Assembly
    machine: Machine  # what moves
    motion: Cycloid  # how the slider moves
    lift: float  # height of the origin of slider positions above the start of the roller path [m]


@dataclass(frozen=True, repr=False)
class MotionSolution(ShortRepr):
    """A mechanism that went through a motion, as checks, values and pictures need it."""

    spec: CamSpec  # resolved
    build: Build  # the parts
    history: History  # forces and speeds over time
    static: FloatArray  # (n,) force on the slider at rest in the same places [N]
    displacement: FloatArray  # (n,) of the slider, from the origin that the analysis asks for [m]
