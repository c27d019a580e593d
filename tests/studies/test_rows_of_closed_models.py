"""Whatever number of a closed model a study varies, with the requirements of the configuration: rows, equal to runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from given_points import GivenPoints
from study_rows import assert_rows_equal_runs, run_point

import cfmkit
from cfmkit.families import Variants, family
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.variants_in_rows import evaluate_rows, points_at_once
from cfmkit.studies.variations import FIXED_BLOCKS, CannotVary, leaf

CLOSED_FIDELITIES = ("quasi-static", "truss", "analytic", "prb")

ENDS_OF_WINDOWS = ("analysis.window.1", "analysis.travel", "analysis.travel.1", "mechanism.profile.stroke")
"""Half of the variants have a curve that ends before a window does: a run of each says so."""


CLOSED = (
    "cam", "cam_balance", "cam_catalogue", "cam_friction", "cam_gravity", "cam_linear", "cam_no_undercut",
    "cam_preloaded", "cam_six_springs", "cam_step", "make_finger", "slider_crank_bilancia2019",
    "slider_crank_bilancia2019_optimum",
    "slider_crank_bought", "slider_crank_friction", "slider_crank_li2019", "slider_crank_li2019_bistable",
    "slider_crank_li2019_from_singularity", "slider_crank_li2019_full_turn", "slider_crank_li2019_prototype",
    "slider_crank_li2019_widest", "slider_crank_rising", "studies/cam_bought_parts", "studies/cam_radius_and_constant",
    "studies/cam_rest_length", "studies/cam_tolerance", "studies/slider_crank_bilancia2019_start",
    "studies/slider_crank_class_map", "studies/slider_crank_li2019_fig10", "studies/slider_crank_li2019_fig11",
    "studies/slider_crank_li2019_fig14", "studies/slider_crank_li2019_fig5", "studies/slider_crank_li2019_fig6",
    "studies/slider_crank_li2019_fig7", "studies/slider_crank_li2019_fig8", "studies/slider_crank_li2019_fig9",
    "studies/slider_crank_li2019_fig9_two", "studies/vcfm_adjustability", "studies/vcfm_fig9_l1",
    "studies/vcfm_fig9_t1", "studies/vcfm_fig9_t2", "studies/vcfm_fig9_theta2", "studies/vcfm_sobol",
    "studies/vcfm_sobol_10_percent", "studies/vcfm_structures", "vcfm_aluminium", "vcfm_bought_springs",
    "vcfm_cosine", "vcfm_ding2022", "vcfm_falling", "vcfm_folded", "vcfm_pa12", "vcfm_pla", "vcfm_pla_adjustable",
    "vcfm_straight", "vcfm_titanium", "vcfm_u_shape",
)  # fmt: skip
"""Configurations whose model is closed."""


def is_closed(spec):
    """Return True if the model of a specification is closed, and no cam is measured."""
    profile = getattr(spec.mechanism, "profile", None)
    measured = profile is not None and profile.file is not None
    return getattr(spec, "fidelity", None) in CLOSED_FIDELITIES and not measured


def own_metrics(spec):
    """Return the metrics that the requirements of a specification name."""
    curve = cfmkit.analyze(spec).curve
    names = [one.metric for one in spec.part_requirements] or [f"{curve.kind}_mean"]
    return metrics_of(spec, dict.fromkeys(names), curve)


def numbers_that_vary(spec):
    """Return the numbers with a fraction that a study of a specification may vary: path -> value."""
    found = {}
    for path, value in spec.leaves():
        if path.split(".")[0] in FIXED_BLOCKS or path in ENDS_OF_WINDOWS or not value:
            continue
        try:
            kind = leaf(type(spec), path).kind
        except CannotVary:
            continue
        if kind in ("quantity", "number"):
            found[path] = float(value)
    return found


def test_no_closed_configuration_is_left_out():
    found = [*Path("configs").glob("*.yaml"), *Path("configs/studies").glob("*.yaml")]
    closed = {str(path.relative_to("configs").with_suffix("")) for path in found if is_closed(cfmkit.load(path))}
    assert closed == set(CLOSED)


@pytest.mark.parametrize("stem", CLOSED)
def test_a_sweep_over_any_number_with_the_requirements_of_its_own_is_solved_in_rows(stem):
    spec = cfmkit.load(f"configs/{stem}.yaml")
    metrics, alone = own_metrics(spec), []
    for path, value in numbers_that_vary(spec).items():
        plan = GivenPoints({path: value * np.array([1.0, 1.0 + 1e-4, 1.0 - 1e-4])})
        study = Study(spec, plan.paths, metrics)
        usable = [run_point(study, plan, k).status.usable for k in range(3)]
        if all(usable) and points_at_once(study, plan) == 1:
            alone.append(path)
    assert alone == []


@pytest.mark.parametrize("stem", CLOSED)
def test_rows_have_the_requirements_that_runs_of_their_own_have(stem):
    spec = cfmkit.load(f"configs/{stem}.yaml")
    numbers, draw = numbers_that_vary(spec), np.random.default_rng(39)
    chosen = draw.choice(sorted(numbers), min(3, len(numbers)), replace=False).tolist()
    plan = GivenPoints({path: numbers[path] * draw.uniform(0.99, 1.01, 5) for path in chosen})
    assert_rows_equal_runs(Study(spec, plan.paths, own_metrics(spec)), plan)


@pytest.mark.parametrize("stem", ["cam_catalogue", "slider_crank_bought", "vcfm_ding2022"])
def test_mechanisms_with_bands_of_their_own_are_solved_together(stem):
    spec = cfmkit.load(f"configs/{stem}.yaml")
    bands = np.array([0.01, 0.02, 0.03])
    study = Study(spec, ("analysis.band",), metrics_of(spec, ("usable_stroke",), cfmkit.analyze(spec).curve))
    plan = GivenPoints({"analysis.band": bands})
    variants = Variants(study.plain, dict(zip(plan.paths, plan.columns, strict=True)), study_variant(study, plan), 3)
    assert [len(members) for members, _ in family(spec.family).rows(variants)] == [3]
    strokes = evaluate_rows(study, plan, 0, 3).values[:, 0]
    assert strokes.tolist() == pytest.approx([run_point(study, plan, k).values[0] for k in range(3)], rel=1e-12)
    assert (np.diff(strokes) > 0).any()


def test_rows_know_the_usable_stroke_of_one_branch_alone():
    needed = {"metric": "usable_stroke[load]", "min": "30 mm"}
    changes = {"mechanism.rolling_friction": 0.02, "analysis.band": 0.08, "requirements": [needed]}
    spec = cfmkit.load("configs/cam.yaml").replace(changes)
    names = ("usable_stroke[load]", "usable_stroke[unload]", "usable_stroke")
    study = Study(spec, ("mechanism.springs.stiffness",), metrics_of(spec, names, cfmkit.analyze(spec).curve))
    plan = GivenPoints({"mechanism.springs.stiffness": 690.0 * np.linspace(0.95, 1.05, 9)})
    together, alone = evaluate_rows(study, plan, 0, 9), [run_point(study, plan, k) for k in range(9)]
    np.testing.assert_allclose(together.values, np.array([one.values for one in alone]), rtol=1e-12)
    assert together.met.tolist() == [list(one.met) for one in alone]
    assert set(together.met.ravel().tolist()) == {True, False}
    assert (together.values[:, 0] > together.values[:, 2]).any()


def study_variant(study, plan):
    """Return the function that makes a variant of a study."""
    return lambda index: study.variant(plan.point(index))


@pytest.mark.parametrize(("stem", "window", "last"), [
    ("slider_crank_rising", ("2 mm", "28 mm"), [0.028, 0.02, 0.0301]),
    ("vcfm_falling", ("1 mm", "4 mm"), [4e-3, 3e-3, 4.2e-3]),
])  # fmt: skip
def test_rows_follow_a_curve_as_runs_of_their_own_do(stem, window, last):
    """With a window beyond the points of the curve, too: there what is measured against it has no value."""
    spec = cfmkit.load(f"configs/{stem}.yaml").replace({"analysis.window": window})
    metrics = metrics_of(spec, (), cfmkit.analyze(spec).curve)
    names = [one.name for one in metrics]
    assert {"deviation_from_curve", "rms_to_curve", "usable_stroke", "usable_start", "usable_end"} <= set(names)
    plan = GivenPoints({"analysis.window.1": np.array(last)})
    study = Study(spec, plan.paths, metrics)
    assert points_at_once(study, plan) > 1
    together = assert_rows_equal_runs(study, plan)
    known = np.isfinite(together.values[:, names.index("deviation_from_curve")])
    assert known.tolist() == [True, True, not np.isfinite(spec.target_curve.extent[1])]


def test_a_row_without_any_equilibrium_has_no_value_and_no_warning_of_numpy():
    """16 mm of preload close the leaves all over the travel."""
    vary = {"analysis.preloads.0": ["0 mm", "16 mm"]}
    table = cfmkit.sweep("configs/vcfm_u_shape.yaml", vary=vary, metrics=["band_range_1pct", "force_mean"]).table
    assert table["status"] == ("complete", "no_equilibrium")
    assert np.isfinite(table["band_range_1pct"]).tolist() == [True, False]
