"""Slider-cranks solved together have the numbers of runs of their own; studies know words as results."""

from __future__ import annotations

import numpy as np
import pytest
from given_points import GivenPoints
from slider_crank import config
from study_rows import assert_rows_equal_runs, study_of

import cfmkit
from cfmkit import api
from cfmkit.families import Variants, family
from cfmkit.studies.plan import zip_axes
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.sensitivity.setup import prepare
from cfmkit.studies.variants_in_rows import points_at_once
from cfmkit.studies.variations import axes, collect_variations

PATHS = tuple(f"mechanism.springs.{name}" for name in ("pivot", "crank_pin", "slider_pin", "slider"))

RATES = {"li2019": (0.002, 0.002, 0.3, 100.0), "bilancia2019": (0.0283, 0.0354, 0.0354, 0.5)}

SPRUNG = (
    "bilancia2019", "bilancia2019_optimum", "bought", "friction", "li2019", "li2019_bistable",
    "li2019_from_singularity", "li2019_full_turn", "li2019_prototype", "li2019_widest", "paper_ranges", "rising",
)  # fmt: skip
"""Configurations with springs at joints."""


def variants(spec, changes):
    """Return a specification with some changes each, of which the family is told nothing."""
    unknown = {"mechanism.legs": np.ones(len(changes))}
    return Variants(spec, unknown, lambda index: spec.replace(changes[index]), len(changes))


def test_the_drop_of_a_swept_stiffness_is_that_of_a_run():
    """A sweep said 0.07010646467436465: it took the turning point of a cubic for that of the force."""
    spec = config("bilancia2019").replace({"requirements": ()})
    found = cfmkit.sweep(spec, vary={PATHS[2]: ["60 N*mm/rad", "61 N*mm/rad"]}, metrics=["stiffness_drop"])
    assert found.table["stiffness_drop"][0] == pytest.approx(0.0701064557532447, rel=1e-12)


@pytest.mark.parametrize("stem", [stem for stem in SPRUNG if stem not in ("paper_ranges", "rising")])
def test_a_sweep_with_every_column_is_solved_in_rows(stem):
    """That of a target curve is not, nor that of a mechanism without springs."""
    spec = config(stem).replace({"requirements": ()})
    lengths = spec.mechanism.crank_length * np.array([0.99, 1.0, 1.01])
    names = [one for one in metrics_of(spec, (), cfmkit.analyze(spec).curves[0]) if one.name not in SINGLE]
    assert len(names) > 40
    plan = GivenPoints({"mechanism.crank_length": lengths})
    assert points_at_once(Study(spec, plan.paths, tuple(names)), plan) > 1


SINGLE = ("hysteresis_area",)
"""Metrics that rows do not know."""


def test_a_sweep_measures_the_usable_stroke_about_a_target_curve():
    """Bands about a level alone had 6.1 mm."""
    spec = cfmkit.load("configs/slider_crank_rising.yaml").replace({"requirements": ()})
    rates = ["21.67859 N*mm/rad", "21.7 N*mm/rad"]
    found = cfmkit.sweep(spec, vary={"mechanism.springs.pivot": rates}, metrics=["usable_stroke"])
    single = api.evaluate(cfmkit.analyze(spec), ["usable_stroke"])["usable_stroke"].value
    assert single > 20e-3
    assert found.table["usable_stroke"][0] == pytest.approx(1e3 * single, rel=1e-12)


def test_a_sweep_knows_the_metrics_of_the_branch_by_its_name():
    """A single run has the branch `load`; requirements and trims of parts ask for it."""
    spec = cfmkit.load("configs/slider_crank_bought.yaml")
    asked = {"requirements": ({"metric": "force_mean[load]", "min": "1.4 N"}, {"metric": "force_max", "min": "1.4 N"})}
    varied = {"mechanism.springs.pivot": ["0.0450 N*m/rad", "0.0452 N*m/rad"]}
    found = cfmkit.sweep(spec.replace(asked), vary=varied, metrics=["force_mean[load]", "force_mean"])
    named, plain = (found.table[name] for name in ("force_mean_load", "force_mean"))
    np.testing.assert_array_equal(named, plain)
    assert np.isfinite(named).all()


@pytest.mark.parametrize(
    ("name", "design"),
    [
        ("li2019", {}),
        ("li2019_bistable", {"design": {"torque": "0.01 N*m", "tolerance": "5 %"}}),
        ("li2019_from_singularity", {}),
        ("li2019_prototype", {}),
        ("bilancia2019", {}),
        ("bilancia2019_optimum", {"design": None}),
        ("li2019_full_turn", {}),
    ],
)
def test_rows_of_springs_and_legs_are_runs_of_their_own(name, design):
    spec, draw = config(name).replace(design), np.random.default_rng(3)
    kind = RATES["bilancia2019" if name.startswith("bilancia") else "li2019"]
    values = {PATHS[row]: draw.choice([0.0, 0.5, 1.2, 3.0], 6) * kind[row] for row in range(4)}
    values[PATHS[3]] += 0.1 * kind[3]
    assert_rows_equal_runs(*study_of(spec, values))


def test_rows_of_different_branches_and_points_are_runs_of_their_own():
    values = {"mechanism.branch": ["left", "right", "left"], "analysis.points": [41, 57, 57]}
    assert_rows_equal_runs(*study_of(config("li2019"), values))


def test_a_sweep_of_a_mechanism_with_a_screwed_anchor_has_the_force_per_travel_of_it():
    """A design with `anchor_travel` states `anchor: 0 mm`."""
    spec = config("bilancia2019", mechanism__springs__anchor="0 mm", mechanism__springs__slider="0.1 N/mm")
    spec = spec.replace({"requirements": ()})
    vary = {PATHS[3]: ["0.05 N/mm", "0.08 N/mm"], "mechanism.legs": [1, 2]}
    found = cfmkit.sweep(spec, vary=vary, metrics=["force_per_anchor"])
    assert found.table["force_per_anchor"] == pytest.approx([0.05, 0.1, 0.08, 0.16])
    without = cfmkit.sweep(spec.replace({"mechanism.springs.anchor": None}), vary=vary, metrics=["force_per_anchor"])
    assert np.isnan(without.table["force_per_anchor"]).all()


def test_there_is_no_band_about_a_place_without_effort():
    """With the slider's spring alone the torque in the stretched position is zero; interpolation would hide it."""
    springs = {"mechanism.springs.slider_pin": 0.0, "mechanism.springs.slider": "1 N/cm"}
    bands = api.evaluate(cfmkit.analyze(config("li2019_prototype").replace(springs)), ["band_range_5pct"])
    assert bands["band_range_5pct"].value is None
    assert "zero" in bands["band_range_5pct"].reason


@pytest.mark.parametrize(
    ("name", "changes", "expected"),
    [
        ("li2019", {}, {"reference_zero"}),
        ("li2019", {"analysis__window": ["8 deg", "13 deg"]}, {"stretched_outside_window"}),
        ("li2019_full_turn", {}, {"spring_winds_up"}),
        ("li2019_from_singularity", {}, set()),
        ("li2019", {"analysis__angle": ["-5 deg", "8 deg"]}, {"second_stable_outside"}),
        ("li2019", {"analysis__window": ["-4 deg", "13 deg"]}, {"effort_changes_sign"}),
        ("bilancia2019", {}, set()),
        ("bilancia2019", {"analysis__reference_travel": "0 mm"}, set()),
    ],
)
def test_rows_have_the_warnings_of_single_runs(name, changes, expected):
    spec, count = config(name, **changes), 8
    rng = np.random.default_rng(5)
    kind = "bilancia2019" if name == "bilancia2019" else "li2019"
    # Springs that are not there at all are what some warnings are about.
    spread = rng.uniform(0.0, 1.3, (4, count)) * (rng.random((4, count)) < 0.6)
    spread[3] += 0.1
    spread[:3, 0] = 0.0
    values = {path: rate * row for path, rate, row in zip(PATHS, RATES[kind], spread, strict=True)}
    assert expected <= set(assert_rows_equal_runs(*study_of(spec, values)).warned)


def test_what_cannot_be_solved_in_rows_is_left_out():
    spec = config("li2019")
    changes = ({}, {PATHS[3]: 0.0, PATHS[2]: 0.0}, {"mechanism.offset": 1.0}, {"mechanism.crank_length": 3.0}, {})
    found = [indices.tolist() for indices, _ in family("slider-crank").rows(variants(spec, changes))]
    assert found == [[0, 4]]


def test_the_map_has_the_thresholds_to_six_digits():
    """Along an axis of the plane the class changes between neighbours 1e-6 apart."""
    spec = config("li2019", mechanism__springs={"slider": "1 N/cm"})
    fold, per_degree = 0.1489334776, 180 / np.pi * 1e-2
    rates = fold * per_degree * (1 + np.linspace(-1e-6, 1e-6, 5))
    ((_, found),) = family("slider-crank").rows(variants(spec, [{PATHS[2]: rate} for rate in rates.tolist()]))
    words = [
        family("slider-crank").outputs.words["stiffness_class"][int(kind)] for kind in found.value("stiffness_class")
    ]
    assert words[:2] == ["bistable"] * 2
    assert words[3:] == ["local negative"] * 2


def test_words_are_metrics_without_a_range():
    (metric,) = metrics_of(config("li2019"), ["stiffness_class"])
    assert metric.words[4] == "bistable"
    assert (
        api.evaluate(cfmkit.analyze(config("li2019_bistable")), ["stiffness_class"])["stiffness_class"].word
        == "bistable"
    )


def test_lists_side_by_side_may_repeat_a_value_but_not_a_set():
    spec = config("li2019")
    lists = {PATHS[0]: ("0 N*mm/rad", "1 N*mm/rad", "1 N*mm/rad"), PATHS[1]: ("1 N*mm/rad", "0 N*mm/rad", "1 N*mm/rad")}
    assert len(zip_axes(axes(spec, collect_variations(lists), joint=True))) == 3
    with pytest.raises(cfmkit.SpecError, match="appears twice"):
        axes(spec, collect_variations(lists))
    twice = {path: (*values, values[0]) for path, values in lists.items()}
    with pytest.raises(cfmkit.UsageError, match="number 4 repeats number 1"):
        zip_axes(axes(spec, collect_variations(twice), joint=True))


def test_a_sensitivity_of_a_word_is_refused():
    block = {"metrics": ("stiffness_class",), "parameters": {"mechanism.springs.slider": ("0.09 N/mm", "0.11 N/mm")}}
    with pytest.raises(cfmkit.SpecError, match="is a word"):
        prepare(config("li2019", sensitivity=block))


def test_rows_whose_sliders_reach_equally_far_are_runs_of_their_own():
    """From the stretched position the travel is twice its length, whatever the offset."""
    spec = cfmkit.load("configs/studies/slider_crank_bilancia2019_start.yaml")
    study, plan = study_of(spec, {"mechanism.offset": np.array([0.059, 0.0595, 0.0604])})
    assert points_at_once(study, plan) > 1
    assert_rows_equal_runs(study, plan)
