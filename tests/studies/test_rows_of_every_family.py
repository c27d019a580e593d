"""A row of a study, solved together with others, is what a run of its own gives: for every family."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from study_rows import assert_rows_equal_runs, study_of, vary_numbers

import cfmkit
from cfmkit.studies.variants_in_rows import points_at_once

CONFIGS = Path(__file__).parents[2] / "configs"
SPREADS = {"beam": 0.03, "cam": 0.1, "slider-crank": 0.1, "vcfm": 0.25}
"""How far numbers are varied, and which families are solved in rows."""
SOLVED_IN_ROWS = [
    *sorted(path.stem for path in CONFIGS.glob("beam_*.yaml")),
    *(f"cam{name}" for name in ("", "_catalogue", "_friction", "_gravity", "_no_undercut", "_preloaded",
                                "_six_springs")),
    *(f"studies/cam_{name}" for name in ("bought_parts", "radius_and_constant", "rest_length", "tolerance")),
    *(f"slider_crank_{name}" for name in ("bilancia2019", "bilancia2019_optimum", "bought", "friction", "li2019",
                                          "li2019_bistable", "li2019_from_singularity", "li2019_full_turn",
                                          "li2019_prototype", "li2019_widest", "paper_ranges", "rising")),
    *(f"vcfm_{name}" for name in ("aluminium", "bought_springs", "cosine", "ding2022", "folded", "pa12", "pla",
                                  "pla_adjustable", "straight", "titanium", "u_shape")),
]  # fmt: skip
"""Configurations that are in closed form, or traced and without events."""
QUICK = (
    "cam", "cam_friction", "cam_gravity", "studies/cam_tolerance",
    "slider_crank_bilancia2019", "slider_crank_bought", "slider_crank_friction", "slider_crank_li2019_prototype",
    "vcfm_bought_springs", "vcfm_ding2022", "vcfm_pla_adjustable", "vcfm_u_shape",
)  # fmt: skip


def assert_rows_of_study(stem: str, seed: int, window: bool) -> None:
    """Compare rows with runs of a configuration of which some numbers vary; beams do as far as paths are traced."""
    spec = cfmkit.load(CONFIGS / f"{stem}.yaml")
    if window:
        spec = spec.replace({"analysis.window": ("11 %", "78.3 %"), "design": None})
    beam = spec.family == "beam"
    if beam:
        spec = spec.replace({"analysis.points": 25})
    study, plan = study_of(spec, vary_numbers(spec, np.random.default_rng(seed), 3, SPREADS[spec.family]))
    assert len(study.metrics) > 20
    assert_rows_equal_runs(study, plan, rtol=1e-11 if beam else 1e-12, flat=1e-8 if beam else 1e-12)


@pytest.mark.parametrize("stem", QUICK)
def test_a_row_of_a_study_is_a_run_of_its_own(stem: str) -> None:
    """Whatever is varied, with every metric that a sweep notes."""
    assert_rows_of_study(stem, 7, window=False)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(6))
@pytest.mark.parametrize("stem", SOLVED_IN_ROWS)
def test_every_row_of_a_study_is_a_run_of_its_own(stem: str, number: int) -> None:
    """Paths of beams that do not go straight on are run one by one."""
    assert_rows_of_study(stem, 100 + number, window=bool(number % 2))


@pytest.mark.parametrize(
    ("stem", "paths"),
    [
        ("lan2010", ("mechanism.thickness", "mechanism.nodes.n3.at.0", "mechanism.beams.b1.shape.coefficients.1")),
        ("williams_toggle", ("mechanism.thickness", "analysis.travel")),
        ("williams_toggle", ("analysis.band",)),
    ],
)
def test_rows_of_beams_are_solved_together_and_are_runs_of_their_own(stem: str, paths: tuple[str, ...]) -> None:
    changes = {"analysis.points": 25, "analysis.window": ("11 %", "78.3 %"), "design": None}
    spec, draw = cfmkit.load(CONFIGS / f"beam_{stem}.yaml").replace(changes), np.random.default_rng(7)
    study, plan = study_of(spec, {path: spec.get_value(path) * draw.uniform(0.99, 1.01, 3) for path in paths})
    assert points_at_once(study, plan) > 1
    assert_rows_equal_runs(study, plan, rtol=1e-11, flat=1e-8)
