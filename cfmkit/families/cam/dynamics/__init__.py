"""Dynamics of a cam mechanism: two sides without symmetry, moved by a slider.

`inverse` is the product route, `lagrange_multiplier_check` the paper's formulation and its check.
"""

from __future__ import annotations

from cfmkit.families.cam.dynamics.force_of_given_motion import analyze
from cfmkit.families.cam.dynamics.inverse import MotionResponse, respond, statics
from cfmkit.families.cam.dynamics.machine_from_spec import build

__all__ = ["MotionResponse", "analyze", "build", "respond", "statics"]
