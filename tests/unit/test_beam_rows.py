"""Beams whose paths are looked at together have the numbers of runs of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from given_points import GivenPoints

import cfmkit
from cfmkit.elastica.results.paths_of_designs import PathsOfDesigns
from cfmkit.families.beam.beams_in_rows import solve_rows
from cfmkit.families.beam.model import solve
from cfmkit.studies.choose_metrics_to_note import metrics_of
from cfmkit.studies.point_evaluation import Study
from cfmkit.studies.variants_in_rows import are_solved_together, evaluate_rows

CONFIGS = Path(__file__).parents[2] / "configs"
BEAMS = sorted(path.stem for path in CONFIGS.glob("beam_*.yaml"))
LAN = "beam_lan2010"
EXTREMES = {"peak_force", "peak_displacement", "valley_force", "valley_displacement"}
"""Places of flat extremes: of what is left in the last digits of forces they keep the root."""


def config(stem, **changes):
    return cfmkit.load(CONFIGS / f"{stem}.yaml").replace({"analysis.points": 25, **changes})


def varied(spec, draw, count):
    """Return some numbers of a specification at random, up to three of them: path -> values around its own."""
    own = {
        path: value
        for path, value in spec.leaves()
        if path.startswith(("mechanism.", "analysis.")) and isinstance(value, float) and value
    }
    chosen = draw.choice(sorted(own), draw.integers(1, 4), replace=False)
    return {path: own[path] * draw.uniform(0.97, 1.03, count) for path in chosen.tolist()}


def check_rows_against_single_runs(spec, values, names=()):
    """Compare the rows of a study with a run of each of its points; return whether they were solved together."""
    plan = GivenPoints(values)
    metrics = metrics_of(spec, names, cfmkit.analyze(spec).curves[0])
    study = Study(spec, plan.paths, metrics)
    together = evaluate_rows(study, plan, 0, len(plan))
    sizes = np.nan_to_num(np.abs(together.values)).max(axis=0)
    kinds = [metric.dimension for metric in metrics]
    for kind in ("force", "torque"):  # a column may vanish: it is the difference of others
        same = [k for k, dimension in enumerate(kinds) if dimension == kind]
        sizes[same] = sizes[same].max(initial=0.0)
    tolerance = np.array([1e-8 if name in EXTREMES else 1e-11 for name in study.names])
    for k in range(len(plan)):
        alone = study.evaluate(plan.point(k))
        assert not alone.bug
        assert together.status(k) == (alone.status, alone.message)
        assert {name for name, mask in together.warned.items() if mask[k]} == set(alone.warnings), plan.point(k)
        if not alone.values:
            continue
        own = np.array([np.nan if value is None else value for value in alone.values])
        off = np.abs(together.values[k] - own)
        wrong = ~((off <= tolerance * sizes) | (np.isnan(own) & np.isnan(together.values[k])))
        assert not [(study.names[m], together.values[k, m], own[m], values) for m in np.flatnonzero(wrong)]
        assert tuple(together.met[k].tolist()) == alone.met
    return are_solved_together(study, plan)


@pytest.mark.parametrize(
    ("stem", "paths"),
    [
        (LAN, ("mechanism.thickness", "mechanism.nodes.n3.at.0", "mechanism.beams.b1.shape.coefficients.1")),
        ("beam_williams_toggle", ("mechanism.thickness", "analysis.travel")),
    ],
)
def test_a_row_of_a_study_is_a_run_of_its_own(stem, paths):
    """With every metric that a sweep notes."""
    spec, draw = config(stem, **{"analysis.window": ("11 %", "78.3 %"), "design": None}), np.random.default_rng(7)
    assert check_rows_against_single_runs(
        spec, {path: spec.get_value(path) * draw.uniform(0.99, 1.01, 3) for path in paths}
    )


@pytest.mark.slow
@pytest.mark.parametrize("number", range(4))
@pytest.mark.parametrize("stem", BEAMS)
def test_every_row_of_a_study_is_a_run_of_its_own(stem, number):
    """With every metric that a sweep notes, whatever is varied; paths that do not go straight on run one by one."""
    changes = {"analysis.window": ("11 %", "78.3 %"), "design": None} if number % 2 else {}
    spec = config(stem, **changes)
    check_rows_against_single_runs(spec, varied(spec, np.random.default_rng(100 + number), 3))


def test_variants_whose_paths_have_events_are_no_rows():
    spec = config("beam_v_bifurcation")
    assert list(solve_rows([spec])) == []


def test_largest_stresses_of_many_paths_are_those_of_each():
    """Of other thicknesses and windows, with and without the axial part."""
    for stress in ("bending", "total"):
        specs = [config(LAN, **{"mechanism.thickness": size, "analysis.stress": stress}) for size in (0.9e-3, 1.1e-3)]
        laws = [solve(spec).model_between_points for spec in specs]
        low, high = np.array([0.0031, 0.0]), np.array([0.0117, 0.018])
        found = PathsOfDesigns(laws).largest_stress(low, high)
        own = [law.largest_stress("", *ends) for law, *ends in zip(laws, low, high, strict=True)]
        assert found == pytest.approx(own, rel=1e-12)
