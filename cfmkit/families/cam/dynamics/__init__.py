"""Dynamics of a cam mechanism: forces for a given motion of its slider, on two sides without symmetry.

`inverse` is the usual method; `nine_coordinate_multibody`, the paper's formulation, the other one ("multibody").
"""

from __future__ import annotations

from cfmkit.families.cam.dynamics.force_of_given_motion import analyze
from cfmkit.families.cam.dynamics.inverse import MotionResponse, respond, statics
from cfmkit.families.cam.dynamics.machine_from_spec import build

__all__ = ["MotionResponse", "analyze", "build", "respond", "statics"]
