"""Stages in series: a stack is judged by the node that is driven, the moving part of its last stage."""

from __future__ import annotations

import math
import re

import pytest
from beam_support import config, value

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
    most = 8 * 3 * math.hypot(10.0, 1.0)  # each of eight stages three times the way from its root
    with pytest.raises(InputError, match=re.escape(f"a travel of at most {most:.4g} mm is possible")):
        cfmkit.analyze(spec.replace({"analysis.travel": "250 mm"}))


def test_a_pole_of_the_stiffness_across_the_drive_counts_where_the_driven_node_is_at_it():
    """The pole at 22 mm was counted in a window around 11 mm, which the first of two stages has moved there."""
    primary = ("analysis.points=41", "analysis.branch=primary")
    before = cfmkit.analyze(config("beam_two_layers", *primary, "analysis.window=[8 mm, 13 mm]"))
    assert value(before, "cross_stiffness") == pytest.approx(4068.04, rel=1e-4)
    around = cfmkit.analyze(config("beam_two_layers", *primary, "analysis.window=[21 mm, 23 mm]"))
    assert value(around, "cross_stiffness") is None
