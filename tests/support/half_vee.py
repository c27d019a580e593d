"""Half of a V of two beams between a clamp and a guided shuttle, solved as a solid; a node lies on the way."""

from __future__ import annotations

VEE = """
cfmkit: 1
family: beam
name: vee
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35}
  thickness: 0.5 mm
  width: 10 mm
  nodes:
    root: {at: [0 mm, 0 mm], support: clamped}
    middle: {at: [8.2 mm, 1.1 mm]}
    shuttle: {at: [24.6 mm, 3.3 mm], support: guided, direction: 90 deg}
  beams:
    outer: {start: root, end: middle}
    inner: {start: middle, end: shuttle}
  drive: {kind: displacement, node: shuttle, direction: -90 deg}
  part: {fillet: 0.3 mm}
analysis:
  travel: 0.2 mm
  points: 9
  fidelity: solid
  solid: {poses: 3, error: 0.1}
  outputs: {nodes: [middle, shuttle], reactions: [root, shuttle]}
"""
