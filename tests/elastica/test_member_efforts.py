"""Efforts of the members of a network."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit
from cfmkit.elastica.results import member_efforts


@pytest.mark.parametrize("name", ["beam_lan2010", "beam_end_effector"])
def test_the_efforts_of_all_members_are_that_of_the_drive(name):
    solution = cfmkit.analyze(f"configs/{name}.yaml").state
    here = solution.path.take(solution.keep[1::10])
    free, drive = member_efforts._ways(here)
    works = member_efforts._member_works(here, free, drive).sum(axis=0)
    total = solution.assembly.parallel * works / (drive * here.mesh.scales.drive)
    np.testing.assert_allclose(total, solution.effort[1::10], rtol=1e-7)


STUB = """\
cfmkit: 1
family: beam
name: stub
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 1 mm
  width: 10 mm
  nodes: {wall: {at: [0 mm, 0 mm], support: clamped}, end: {at: [50 mm, 0 mm]}, tip: {at: [50.000001 mm, 0 mm]}}
  beams: {long: {start: wall, end: end}, short: {start: end, end: tip}}
  drive: {kind: displacement, node: tip, direction: 90 deg}
analysis: {travel: 5 mm, points: 7}
"""


def test_a_beam_of_a_nanometre_does_not_make_the_force_of_a_cantilever_zero():
    """3 EI/L^3 times the mean motion, within the stiffening of a deflection of a tenth of the length."""
    found = cfmkit.analyze(cfmkit.loads(STUB))
    linear = 3 * 2e9 * 10e-3 * 1e-3**3 / 12 / 50e-3**3
    assert found.metrics["force_mean"].value == pytest.approx(linear * 2.5e-3, rel=0.01)
    assert found.metrics["force_ripple"].value == pytest.approx(1.0)


def test_a_ring_that_is_turned_without_resistance_has_no_torque():
    """Rounding leaves forces in it, the larger the shorter a beam is."""
    free = STUB.replace("clamped", "pinned").replace("[50.000001 mm, 0 mm]", "[50.000001 mm, 20 mm]")
    free = free.replace("end: tip}}", "end: tip}, back: {start: tip, end: wall}}")
    free = free.replace("displacement, node: tip, direction: 90 deg", "rotation, node: wall").replace("5 mm", "80 deg")
    assert cfmkit.analyze(cfmkit.loads(free)).metrics["torque_mean"].value == 0.0
