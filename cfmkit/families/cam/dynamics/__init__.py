"""Dynamics of a cam mechanism: two sides without symmetry, moved by a slider.

`inverse` is the product route, `multibody` the paper's formulation and its check.
"""

from __future__ import annotations

from cfmkit.families.cam.dynamics.model import analyze

__all__ = ["analyze"]
