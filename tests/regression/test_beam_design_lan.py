"""Our own numbers on the shape design of Lan's problem: what the search reaches, and what tolerances leave of it."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit
from cfmkit.families.base import Run
from cfmkit.families.beam.shaping.audit import Spread, audited
from cfmkit.families.beam.shaping.design import task_of
from cfmkit.families.beam.shaping.infeasible import missed_by
from cfmkit.families.beam.shaping.search import Found
from cfmkit.families.beam.shaping.variables import Variables
from cfmkit.results import Status
from cfmkit.studies.pool import Pool

CONFIG = "configs/beam_design_lan.yaml"


def test_the_shapes_of_the_config_meet_all_limits_and_pass_the_audit() -> None:
    spec = cfmkit.load(CONFIG)
    task = task_of(spec, spec.design.optimise)
    variables = Variables(task, 3)
    found = Found(variables.read(), 3, 2.22e-3, 0.0, 0.0, "", 0)
    audit = audited(variables, found, Spread(1e-4, 0.02, 40))
    assert missed_by(task, found) == {}
    assert audit.sound
    assert audit.strict == pytest.approx(0.838, abs=2e-3)
    assert audit.stress is not None
    assert audit.stress < 76e6 / 1.58
    assert audit.stiff == pytest.approx(0.075, abs=2e-3)  # stretching and shear cost more than the band is wide
    assert float(np.median(audit.ranges)) == pytest.approx(0.50, abs=0.15)
    assert float(np.median(audit.bands)) == pytest.approx(0.053, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_every_run_of_twenty_starts_holds_the_force_over_two_thirds_of_the_travel(seed: int) -> None:
    """Table 3 of Lan, Wang, Chen (2010) holds it over 47.9 %."""
    spec = cfmkit.load(CONFIG)
    design = cfmkit.design(spec, Run(seed=seed, executor=Pool(2)))
    assert design.status is Status.COMPLETE
    result = cfmkit.analyze(design.spec)
    assert result.values["strict_range_fraction"].value >= 0.68
