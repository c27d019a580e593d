"""Stages in series: what is judged of a stack is judged of the node that is driven, the moving part of the last stage."""

from __future__ import annotations

import pytest

import cfmkit
from cfmkit.errors import InputError
from cfmkit.results import Status

STACK = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 2 GPa}
  axial: true
  thickness: 0.5 mm
  width: 10 mm
  nodes: {root: {at: [0 mm, 0 mm], support: clamped}, top: {at: [10 mm, 1 mm], support: guided, direction: 90 deg}}
  beams: {beam: {start: root, end: top}}
  drive: {kind: displacement, node: top, direction: 90 deg}
  copies: {layers: 8, layer_pitch: 5 mm}
analysis: {travel: 40 mm, points: 5}
"""


def test_a_travel_that_each_stage_makes_an_eighth_of_tears_no_beams():
    """Before, the whole travel was compared with the length of one stage: 30 mm were possible."""
    spec = cfmkit.loads(STACK)
    assert cfmkit.analyze(spec).status is Status.COMPLETE
    with pytest.raises(InputError, match=r"a travel of at most 241\.2 mm is possible"):
        cfmkit.analyze(spec.replace({"analysis.travel": "250 mm"}))
