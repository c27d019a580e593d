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
