"""Specifications of parts that err: a cam with stated tolerances, an arch of which only its process is known."""

from __future__ import annotations

from typing import Any

import cfmkit

TOLERANCES = {"mechanism.springs.stiffness": {"normal": "1.2 %"}, "mechanism.rolling_friction": {"normal": "10 %"}}

TAPERED = """
cfmkit: 1
family: beam
name: tapered
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35, yield_strength: 90 MPa}
  thickness: [[0, 1 mm], [1, 0.6 mm]]
  width: 6 mm
  nodes: {root: {at: [0 mm, 0 mm], support: clamped}, tip: {at: [40 mm, 0 mm], support: guided, direction: 180 deg}}
  beams: {arch: {start: root, end: tip, shape: {kind: polynomial, coefficients: [0.5 rad, -1 rad]}}}
  drive: {kind: displacement, node: tip, direction: 180 deg}
analysis: {travel: 3 mm, points: 11}
design: {rescale: {force: 2 N}, process: wire-edm}
requirements: [{metric: force_max, max: 3 N}]
"""
"""Nothing is assumed of its tapered beams between held nodes."""


def toleranced_cam(**keys: Any) -> Any:
    """Return the published cam with tolerances, and other keys of its block `design`."""
    changes = {"tolerances": TOLERANCES} | keys
    return cfmkit.load("configs/cam.yaml").replace({f"design.{key}": value for key, value in changes.items()})
