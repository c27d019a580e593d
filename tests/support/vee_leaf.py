"""One leaf of a V-beam as a planar solid, pressed until it buckles: the smallest part that has all there is."""

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
    shuttle: {at: [24.6 mm, 3.3 mm], support: guided, direction: 90 deg}
  beams:
    leaf: {start: root, end: shuttle}
  drive: {kind: displacement, node: shuttle, direction: -90 deg}
  part: {fillet: 0.05 mm}
analysis: {travel: 5 mm, points: 51, fidelity: solid, solid: {poses: 11, error: 0.1}}
"""
