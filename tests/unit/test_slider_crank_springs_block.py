"""Blocks of slider-cranks have the numbers that one has; studies know words as results."""

from __future__ import annotations

import numpy as np
import pytest
from slider_crank import config

import cfmkit
from cfmkit import api
from cfmkit.families.base import Block, Measure
from cfmkit.families.slider_crank.springs.many_designs.metrics_and_findings_of_block import analyze_block
from cfmkit.plots.study import draw_map, draw_metric
from cfmkit.plots.study_data_to_draw import DrawnScale, StudyMarks
from cfmkit.plots.style import png
from cfmkit.studies.choose_metrics_to_note import metrics_of
from cfmkit.studies.plan import grid, zipped
from cfmkit.studies.point_evaluation import Study
from cfmkit.studies.varied_axes import axes, wishes
from cfmkit.studies.vectorised_blocks import evaluate_block, measures

NAMES = {
    "li2019": (
        "stiffness_class", "stable_positions", "unstable_positions", "stiffness_drop", "constant_angle",
        "constant_angle_start", "constant_angle_end", "reference_torque", "stretched_torque", "stretched_stiffness",
        "energy_max", "torque_mean", "torque_sd", "torque_max", "torque_min", "torque_ripple", "half_band",
        "deviation_from_mean", "band_range_05pct", "band_range_1pct", "band_range_5pct",
    ),
    "bilancia2019": (
        "stiffness_class", "stiffness_drop", "constant_travel", "constant_travel_end", "reference_force",
        "force_ripple", "half_band", "band_range_1pct",
    ),
}  # fmt: skip
RATES = {"li2019": (0.002, 0.002, 0.3, 100.0), "bilancia2019": (0.0283, 0.0354, 0.0354, 0.5)}
PATHS = tuple(f"mechanism.springs.{name}" for name in ("pivot", "crank_pin", "slider_pin", "slider"))


@pytest.mark.parametrize("name", NAMES)
def test_a_block_has_the_numbers_of_single_runs(name):
    spec, count = config(name), 25
    rng = np.random.default_rng(3)
    spread = rng.uniform(0.0, 1.3, (4, count)) if name == "li2019" else rng.uniform(0.9, 1.1, (4, count))
    values = {path: rate * row for path, rate, row in zip(PATHS, RATES[name], spread, strict=True)}
    window = spec.analysis.window and tuple(map(float, spec.analysis.window))
    found = analyze_block(spec, Block(values, tuple(Measure(item, window) for item in NAMES[name]), count))
    assert found.done.all()
    kinds = set()
    for index in range(count):
        single = cfmkit.analyze(spec.replace({path: float(row[index]) for path, row in values.items()}))
        wanted = api.evaluate(single, NAMES[name])
        kinds.add(wanted["stiffness_class"].word)
        for item, measured in zip(NAMES[name], found.values, strict=True):
            value = wanted[item].value
            got = measured["load"][index]
            loose = 1e-5 if item == "stiffness_drop" else 1e-14
            assert got == pytest.approx(np.nan if value is None else value, rel=1e-8, abs=loose, nan_ok=True), item
    assert len(kinds) >= 3


def test_a_sweep_measures_the_usable_stroke_about_a_target_curve():
    """Blocks know bands about a level only; they had 6.1 mm."""
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
    varied = {"mechanism.springs.pivot": ["0.045 N*m/rad", "0.05 N*m/rad"]}
    found = cfmkit.sweep(spec.replace(asked), vary=varied, metrics=["force_mean[load]", "force_mean"])
    named, plain = (found.table[name] for name in ("force_mean_load", "force_mean"))
    np.testing.assert_array_equal(named, plain)
    assert np.isfinite(named).all()


@pytest.mark.parametrize(
    ("name", "design", "least"),
    [
        ("li2019", {}, 24),
        ("li2019_bistable", {"design": {"torque": "0.01 N*m", "tolerance": "5 %"}}, 24),
        ("li2019_from_singularity", {}, 24),
        ("li2019_prototype", {}, 24),
        ("bilancia2019", {}, 24),
        ("bilancia2019_optimum", {"design": None}, 24),
        # Over a full turn the mean of springs that repeat themselves is rounding: those stay with the model of one.
        ("li2019_full_turn", {}, 0),
    ],
)
def test_a_sweep_with_every_column_is_done_in_blocks_and_has_the_rows_of_single_runs(name, design, least):
    spec = config(name).replace(design)
    kind = RATES["bilancia2019" if name.startswith("bilancia") else "li2019"]
    units = {2: "N*m/rad", 3: "N/m"}
    lists = {PATHS[row]: [f"{share * kind[row]} {units[row]}" for share in (0.0, 0.5, 1.2, 3.0)] for row in units}
    plan = grid(axes(spec, wishes(lists | {"mechanism.legs": [1, 2]})))
    study = Study(spec, plan.paths, metrics_of(spec, (), cfmkit.analyze(spec).curves[0]))
    assert len(study.metrics) > 50
    rows = evaluate_block(study, plan, 0, len(plan))
    values = dict(zip(plan.paths, plan.block(0, len(plan)), strict=True))
    with np.errstate(all="ignore"):
        assert analyze_block(spec, Block(values, measures(study), len(plan))).done.sum() >= least
    for index in range(len(plan)):
        single = study.evaluate(plan.point(index))
        assert rows.status(index) == (single.status, single.message)
        if single.values:
            assert tuple(rows.met[index].tolist()) == single.met
            for metric, got, value in zip(study.metrics, rows.values[index].tolist(), single.values, strict=True):
                loose = 1e-5 if metric.name == "stiffness_drop" else 1e-13
                wanted = pytest.approx(np.nan if value is None else value, rel=1e-8, abs=loose, nan_ok=True)
                assert got == wanted, (metric.name, plan.point(index))


def test_a_sweep_of_a_mechanism_with_a_screwed_anchor_has_the_force_per_travel_of_it():
    """A design with `anchor_travel` states `anchor: 0 mm`: its studies are done in blocks, as without an anchor."""
    spec = config("bilancia2019", mechanism__springs__anchor="0 mm", mechanism__springs__slider="0.1 N/mm")
    values = {PATHS[3]: np.array([50.0, 80.0]), "mechanism.legs": np.array([1, 2])}
    asked = Block(values, (Measure("force_per_anchor"),), 2)
    found = analyze_block(spec, asked).values[0]["load"]
    for index in range(2):
        single = cfmkit.analyze(spec.replace({path: row[index].item() for path, row in values.items()}))
        assert found[index] == pytest.approx(single.values["force_per_anchor"].value)
    assert found == pytest.approx([50.0, 160.0])
    without = analyze_block(spec.replace({"mechanism.springs.anchor": None}), asked)
    assert np.isnan(without.values[0]["load"]).all()


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
def test_a_block_names_the_warnings_of_single_runs(name, changes, expected):
    spec, count = config(name, **changes), 24
    rng = np.random.default_rng(5)
    kind = "bilancia2019" if name == "bilancia2019" else "li2019"
    # Springs that are not there at all are what some warnings are about.
    spread = rng.uniform(0.0, 1.3, (4, count)) * (rng.random((4, count)) < 0.6)
    spread[3] += 0.1
    values = {path: rate * row for path, rate, row in zip(PATHS, RATES[kind], spread, strict=True)}
    metric = "torque_max" if spec.analysis.drive == "torque" else "force_max"
    found = analyze_block(spec, Block(values, (Measure(metric),), count))
    assert found.done.any()
    for index in np.flatnonzero(found.done):
        single = cfmkit.analyze(spec.replace({path: float(row[index]) for path, row in values.items()}))
        names = {item.name for item in single.warnings}
        assert {name for name, mask in found.warnings.items() if mask[index]} == names, (index, spread[:, index])
    assert expected <= {name for name, mask in found.warnings.items() if mask.any()}


def test_a_block_leaves_what_it_cannot_do():
    spec = config("li2019")
    values = {"mechanism.springs.slider": np.array([100.0, -1.0, np.nan])}
    found = analyze_block(spec, Block(values, (Measure("stiffness_class"),), 3))
    assert found.done.tolist() == [True, False, False]
    other = {"mechanism.crank_length": np.array([0.1])}
    assert analyze_block(spec, Block(other, (Measure("stiffness_class"),), 1)) is None
    assert analyze_block(spec, Block(values, (Measure("stress_max"),), 3)) is None
    # What only a driven slider has is an empty cell, as in the row of one mechanism.
    found = analyze_block(spec, Block(values, (Measure("constant_travel"),), 3))
    assert np.isnan(found.values[0]["load"]).all()


def test_the_map_has_the_thresholds_to_six_digits():
    """Along an axis of the plane the class changes between neighbours 1e-6 apart."""
    spec = config("li2019", mechanism__springs={"slider": "1 N/cm"})
    fold, per_degree = 0.1489334776, 180 / np.pi * 1e-2
    rates = fold * per_degree * (1 + np.linspace(-1e-6, 1e-6, 5))
    found = analyze_block(spec, Block({PATHS[2]: rates}, (Measure("stiffness_class"),), 5))
    words = [api.family("slider-crank").words["stiffness_class"][int(kind)] for kind in found.values[0]["load"]]
    assert words[:2] == ["bistable"] * 2
    assert words[3:] == ["local negative"] * 2


def test_words_are_metrics_without_a_range():
    (metric,) = metrics_of(config("li2019"), ["stiffness_class"])
    assert metric.words[4] == "bistable"
    assert (
        api.evaluate(cfmkit.analyze(config("li2019_bistable")), ["stiffness_class"])["stiffness_class"].word
        == "bistable"
    )


def test_words_are_drawn_as_regions_and_as_steps():
    x, y = np.repeat([1.0, 2.0, 3.0], 4), np.tile([1.0, 2.0, 3.0, 4.0], 3)
    words = ("positive", "zero", "bistable")
    metric = DrawnScale("stiffness_class", "text", (x > 1.5) * 1.0 + (y > 2.5), words)
    scales = DrawnScale("a.rate", "stiffness", x), DrawnScale("b.rate", "stiffness", y)
    found = StudyMarks(scales, (metric,), (3, 4), np.ones(12, bool))
    figure = draw_map(found, metric)
    assert [text.get_text() for text in figure.axes[1].get_yticklabels()] == list(words)
    assert len(png(figure)) > 1000
    line = StudyMarks((DrawnScale("a.rate", "stiffness", x[::4]),), (), (), np.ones(3, bool))
    steps = DrawnScale("stiffness_class", "text", np.array([0.0, 1.0, 2.0]), words)
    assert [text.get_text() for text in draw_metric(line, steps).axes[0].get_yticklabels()] == list(words)


def test_lists_side_by_side_may_repeat_a_value_but_not_a_set():
    spec = config("li2019")
    lists = {PATHS[0]: ("0 N*mm/rad", "1 N*mm/rad", "1 N*mm/rad"), PATHS[1]: ("1 N*mm/rad", "0 N*mm/rad", "1 N*mm/rad")}
    assert len(zipped(axes(spec, wishes(lists), joint=True))) == 3
    with pytest.raises(cfmkit.SpecError, match="appears twice"):
        axes(spec, wishes(lists))
    twice = {path: (*values, values[0]) for path, values in lists.items()}
    with pytest.raises(cfmkit.UsageError, match="number 4 repeats number 1"):
        zipped(axes(spec, wishes(twice), joint=True))


def test_a_sensitivity_of_a_word_is_refused():
    from cfmkit.studies.sensitivity.setup import prepare

    block = {"metrics": ("stiffness_class",), "parameters": {"mechanism.springs.slider": ("0.09 N/mm", "0.11 N/mm")}}
    with pytest.raises(cfmkit.SpecError, match="is a word"):
        prepare(config("li2019", sensitivity=block))


def test_a_block_takes_windows_that_are_shares_of_the_travel():
    spec = config("bilancia2019").replace({"analysis.window": ("10 %", "77 %"), "requirements": []})
    block = Block({PATHS[1]: np.array([0.03, 0.04])}, (Measure("force_mean", spec.analysis.window),), 2)
    found = analyze_block(spec, block)
    assert found.done.all()
    alone = [cfmkit.analyze(spec.replace({PATHS[1]: rate})) for rate in (0.03, 0.04)]
    expected = [api.evaluate(one, ["force_mean"])["force_mean"].value for one in alone]
    assert found.values[0]["load"].tolist() == pytest.approx(expected, rel=1e-12)
