"""Many cams at once have the numbers that each has alone."""

import numpy as np
import pytest

import cfmkit
from cfmkit.families.base import Block, Measure
from cfmkit.families.cam.many_designs.measures import CYCLES, KNOWN, WINDOWED
from cfmkit.families.cam.many_designs.model import VARIED, analyze_block
from cfmkit.results import Status
from cfmkit.studies import vectorised_blocks
from cfmkit.studies.choose_metrics_to_note import metrics_of
from cfmkit.studies.engine import Work, run
from cfmkit.studies.journal import Journal
from cfmkit.studies.plan import Draw, sampled
from cfmkit.studies.point_evaluation import Study
from cfmkit.studies.row_blocks_for_journal import joined
from cfmkit.studies.serial_and_cluster_executors import Lost
from cfmkit.studies.varied_axes import axes, wishes
from cfmkit.studies.vectorised_blocks import evaluate_block, vectorised

SPEC = cfmkit.load("configs/cam.yaml").replace({"analysis.points": 61})
BRANCHED = sorted(WINDOWED - set(CYCLES))
NAMES = (*BRANCHED, *(f"{name}[unload]" for name in BRANCHED), *sorted(KNOWN - set(BRANCHED)))
RATIOS = ("force_ripple", "half_band", "deviation_from_mean", "deviation_from_target", "friction_half_gap_max")
LENGTHS = ("band_range_05pct", "band_range_1pct", "band_range_5pct", "usable_stroke", "usable_start", "range_95")
DIFFERENCES = {"force_sd": 100.0, "hysteresis_area": 24.0, "jam_travel": 1e-3} | dict.fromkeys(RATIOS, 1.0)
DIFFERENCES |= dict.fromkeys((*LENGTHS, "usable_end", "range_95_fraction"), 1.0) | {"rms_to_target": 100.0}
"""What is a small difference of large numbers is only as exact as those: forces [N], areas [J], ratios, lengths [m]."""
SIZES = np.array([DIFFERENCES.get(name.partition("[")[0], 0.0) for name in NAMES])

RANGES = {
    "mechanism.brace_length": "190 mm:400 mm",
    "mechanism.rest_half_width": "20 mm:100 mm",
    "mechanism.roller_radius": "-1 mm:30 mm",
    "mechanism.rolling_friction": "0:0.004",
    "mechanism.springs.stiffness": "0.3 N/mm:1 N/mm",
    "mechanism.springs.count": [1, 2, 4],
    "mechanism.profile.force_constant": "5 mm:16 mm",
    "design.force": "40 N:60 N",
}


def work(spec=SPEC, ranges=RANGES, count=600, names=NAMES):
    plan = sampled(axes(spec, wishes(ranges), drawn=True), Draw("sobol", count))
    return Work(Study(spec, plan.paths, metrics_of(spec, names)), plan)


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"analysis.window": None},
        {"mechanism.rolling_friction": 0.0},
        {"analysis.window": ("3.3 mm", "151 mm")},
        {"analysis.window": ("10 mm", "240 mm")},
        {"design": None},
    ],
)
def test_a_block_has_the_numbers_of_its_points(change):
    spec = SPEC.replace(change)
    ranges = {k: v for k, v in RANGES.items() if k not in change and not (spec.design is None and k == "design.force")}
    many = work(spec, ranges)
    assert many.vectorised
    together = run(many)
    done = 0
    for k in range(0, 600, 5):
        alone, block = many.study.evaluate(many.plan.point(k)), together.row(k)
        assert block.status(0) == (alone.status, alone.message)
        if alone.status is Status.COMPLETE:
            done += 1
            values = [np.nan if value is None else value for value in alone.values]
            wrong = ~np.isclose(block.values[0], values, rtol=1e-12, atol=1e-12 * SIZES, equal_nan=True)
            assert not wrong.any(), [(NAMES[m], block.values[0, m], values[m]) for m in np.flatnonzero(wrong)]
            assert tuple(block.met[0].tolist()) == alone.met
    assert done > 30


def test_the_closed_form_does_most_of_what_it_is_meant_for():
    many = work(ranges={"mechanism.roller_radius": "6 mm:10 mm", "mechanism.springs.stiffness": "0.3 N/mm:1 N/mm"})
    values = dict(zip(many.plan.paths, many.plan.block(0, 600), strict=True))
    answer = analyze_block(SPEC, Block(values, (Measure("force_mean"),), 600))
    assert answer.done.all()


def test_whoever_runs_on_a_corner_is_done_too():
    radius = np.array([0.0100, 0.0103, 0.0104, 0.0160, 0.0300])
    measures = (Measure("undercut_travel"), Measure("corner_force_max"), Measure("usable_start"))
    answer = analyze_block(SPEC, Block({"mechanism.roller_radius": radius}, measures, 5))
    assert answer.done.all()
    corner, peak, start = (values[""] for values in answer.values)
    assert corner[:2].tolist() == [0.0, 0.0]
    assert (np.diff(corner[1:]) > 0).all()
    alone = [cfmkit.analyze(SPEC.replace({"mechanism.roller_radius": one})) for one in radius]
    peaks = [one.values["corner_force_max"].value for one in alone]
    # Just undercut, friction holds the roller on its corner, and there is no largest force.
    assert [one is None for one in peaks] == [True, True, True, False, False]
    assert np.allclose(peak, [np.nan if one is None else one for one in peaks], rtol=1e-12, equal_nan=True)
    assert (start[2:] >= corner[2:]).all()


def test_an_ordinary_sweep_of_the_published_cam_with_every_column_is_done_in_blocks():
    plan = sampled(axes(SPEC, wishes({"mechanism.rest_half_width": "60 mm:70 mm"}), drawn=True), Draw("sobol", 64))
    sample = cfmkit.analyze(SPEC).curve
    many = Work(Study(SPEC, plan.paths, metrics_of(SPEC, (), sample)), plan)
    assert many.vectorised
    assert len(many.study.metrics) > 40
    values = dict(zip(plan.paths, plan.block(0, 64), strict=True))
    assert analyze_block(SPEC, Block(values, (Measure("usable_stroke"),), 64)).done.all()


def test_rows_do_not_depend_on_how_a_study_is_cut_into_blocks():
    many = work(count=97)
    whole = evaluate_block(many.study, many.plan, 0, 97)
    parts = joined([evaluate_block(many.study, many.plan, k, min(k + 13, 97)) for k in range(0, 97, 13)])
    assert np.array_equal(whole.values, parts.values, equal_nan=True)
    assert (whole.met.tolist(), whole.odd) == (parts.met.tolist(), parts.odd)


def test_rows_are_the_same_whether_curves_are_wanted_or_not(tmp_path):
    plain = work(count=20, names=("force_mean", "usable_stroke"))
    kept = Work(Study(SPEC, plain.plan.paths, plain.study.metrics, curves=True), plain.plan)
    assert kept.vectorised
    without = evaluate_block(plain.study, plain.plan, 0, 20)
    for _ in range(2):
        with Journal(tmp_path / "journal") as journal:
            (rows,) = [rows for _, rows in run(kept, journal=journal).batches()]
        assert np.array_equal(rows.values, without.values, equal_nan=True)
        assert rows.odd == without.odd
        alone = {k: kept.study.evaluate(kept.plan.point(k)).curve for k in range(20)}
        assert rows.curves == {k: curve for k, curve in alone.items() if curve}


@pytest.mark.parametrize(
    "change",
    [
        {"mechanism.profile.friction": 0.002},
        {"mechanism.profile.slope_factor": 1.1},
        {"mechanism.profile.offset": "0.1 mm"},
        {"analysis.gravity": True},
        {"analysis.travel": "100 mm"},
        {"analysis.path_method": "ode"},
        {"analysis.origin": "slider"},
        {"mechanism.springs": ("0.6 N/mm", "0.7 N/mm")},
        {"mechanism.contact.width": "10 mm"},
        {"analysis.manufacturing": {"waviness": "0.02 mm"}},
    ],
)
def test_what_has_no_closed_form_here_is_refused_whole(change):
    spec = SPEC.replace(change)
    block = Block({"mechanism.brace_length": np.array([0.2])}, (Measure("force_mean"),), 1)
    assert analyze_block(SPEC, block) is not None
    assert analyze_block(spec, block) is None


def test_unknown_metrics_and_paths_are_refused_whole():
    brace = {"mechanism.brace_length": np.array([0.2])}
    assert analyze_block(SPEC, Block(brace, (Measure("stress_max"),), 1)) is None
    assert analyze_block(SPEC, Block({"analysis.points": np.array([11])}, (Measure("force_mean"),), 1)) is None


def test_designing_is_done_point_by_point():
    many = work(count=4)
    assert not vectorised(Study(SPEC, many.plan.paths, many.study.metrics, design=True), many.plan)


def test_another_brace_than_the_cam_is_cut_for_is_left_to_the_model_of_one_cam():
    spec = SPEC.replace({"mechanism.profile.brace_length": "200 mm", "mechanism.roller_radius": "8 mm"})
    block = Block({"mechanism.brace_length": np.array([0.19, 0.2])}, (Measure("force_mean"),), 2)
    assert analyze_block(spec, block).done.tolist() == [False, True]


def test_every_path_it_can_vary_exists():
    leaves = {path for path, _ in SPEC.leaves()}
    known = {path for path in VARIED if path in leaves or SPEC.at(path) is not None}
    assert known == set(VARIED)


def test_blocks_are_noted_and_reused_whole(tmp_path):
    many = work(count=5000, names=("force_mean", "force_ripple"))
    with Journal(tmp_path / "journal") as journal:
        first = np.concatenate([rows.values for _, rows in run(many, journal=journal).batches()])
    with Journal(tmp_path / "journal") as journal:
        # blocks of 64: their size is a power of two, so that a study with a few more points has the same ones
        assert len(journal) == 79
        again = run(many, journal=journal)
        assert again.reused == 5000
        assert again.work.step == 64
        assert np.array_equal(np.concatenate([rows.values for _, rows in again.batches()]), first, equal_nan=True)
        assert np.array_equal(again.row(4999).values[0], first[4999], equal_nan=True)


def test_a_block_that_is_lost_costs_only_the_points_that_are_lost_alone():
    many = work(count=40, names=("force_mean",))

    def losing(work, jobs, _stopping):
        for job in jobs:
            lost = job.stop - job.start > 1 or job.start == 7
            yield job, Lost(Status.CRASHED, "it died") if lost else work(job)

    together, alone = run(many, losing), run(many)
    assert together.finished == 40
    assert together.row(7).status(0) == (Status.CRASHED, "it died")
    for k in set(range(40)) - {7}:
        assert np.allclose(together.row(k).values, alone.row(k).values, rtol=1e-12, equal_nan=True)


def test_a_block_warns_of_what_each_cam_warns_of():
    spec = SPEC.replace({"mechanism.springs.max_elongation": "130 mm"})
    ranges = RANGES | {"mechanism.rolling_friction": "0:0.3", "mechanism.profile.force_constant": "5 mm:30 mm"}
    del ranges["design.force"]
    plan = sampled(axes(spec, wishes(ranges), drawn=True), Draw("sobol", 256))
    values = dict(zip(plan.paths, plan.block(0, 256), strict=True))
    with np.errstate(all="ignore"):
        answer = analyze_block(spec, Block(values, (Measure("force_mean"),), 256))
    seen = set()
    for k in np.flatnonzero(answer.done)[:60].tolist():
        alone = cfmkit.analyze(spec.replace(dict(zip(plan.paths, plan.point(k), strict=True))))
        names = list(dict.fromkeys(found.name for found in alone.warnings))
        assert [name for name, warned in answer.warnings.items() if warned[k]] == names, k
        seen |= set(names)
    assert seen >= {"undercut", "up_jam", "spring_overstretched", "slack_cable"}


def test_rollers_that_overlap_are_left_to_the_model_of_one_cam():
    radius = np.array([0.067, 0.068, 0.0681, 0.150])
    answer = analyze_block(SPEC, Block({"mechanism.roller_radius": radius}, (Measure("force_mean"),), 4))
    assert answer.done.tolist() == [True, True, False, False]
    large = work(ranges={"mechanism.roller_radius": "69 mm:150 mm"}, count=8, names=("force_mean",))
    assert {run(large).row(k).status(0)[0] for k in range(8)} == {Status.NO_EQUILIBRIUM}


AROUND = {
    "mechanism.rest_half_width": "67 mm:69 mm",
    "mechanism.roller_radius": "15.5 mm:16.5 mm",
    "mechanism.brace_length": "199 mm:201 mm",
    "mechanism.rolling_friction": "0:0.01",
}
BUILT_NAMES = ("force_mean", "force_mean[unload]", "force_sd", "force_max", "force_min", "force_ripple", "half_band",
               "deviation_from_target", "rms_to_target", "hysteresis_area", "theoretical_force", "undercut_travel",
               "spring_elongation_max", "contact_force_max", "pressure_angle_max", "brace_angle_max")  # fmt: skip


@pytest.mark.parametrize("changes", [{}, {"analysis.points": 241}, {"mechanism.profile.force_constant": "16 mm"}])
def test_one_cut_cam_with_other_parts_is_done_in_blocks_with_the_numbers_of_each(changes):
    spec = cfmkit.load("configs/studies/cam_tolerance.yaml").replace({"analysis.window": ("5 mm", "235 mm")} | changes)
    ranges = AROUND | {"mechanism.springs.stiffness.0": "0.65 N/mm:0.73 N/mm"}
    many = work(spec, ranges, 60, BUILT_NAMES)
    assert many.vectorised
    values = dict(zip(many.plan.paths, many.plan.block(0, 60), strict=True))
    answer = analyze_block(spec, Block(values, (Measure("force_mean", (5e-3, 235e-3)),), 60))
    # Without a corner the start of a cam with other parts is a dead point or a jam: those are left to the model of one.
    assert answer.done.sum() >= (25 if spec.mechanism.profile.force_constant < 0.01 else 1)
    together = run(many)
    for k in range(60):
        alone, block = many.study.evaluate(many.plan.point(k)), together.row(k)
        assert block.status(0) == (alone.status, alone.message)
        expected = [np.nan if value is None else value for value in alone.values]
        # At a dead point the place of a roller is known to half the digits of the slider's only.
        close = 1e-12 if spec.mechanism.profile.force_constant < 0.01 else 1e-7
        np.testing.assert_allclose(block.values[0], expected, rtol=close, atol=1e-13, err_msg=str(k))
        assert tuple(block.met[0].tolist()) == alone.met
        if answer.done[k]:
            found = cfmkit.analyze(spec.replace(dict(zip(many.plan.paths, many.plan.point(k), strict=True)))).warnings
            warned = [name for name, where in answer.warnings.items() if where[k]]
            assert warned == list(dict.fromkeys(item.name for item in found))


BARE = {"mechanism.roller_radius": "8 mm", "mechanism.profile.roller_radius": "8 mm"}
SMALL = AROUND | {"mechanism.roller_radius": "7.5 mm:8.5 mm"}
WINDOW = {"analysis.window": ("5 mm", "235 mm")}
HEAVY = {
    "mechanism.masses": {"slider": "0.068 kg", "brace": "0.077 kg", "roller": "0.38 kg"},
    "analysis.gravity": True,
}
SHARES = {
    "analysis.window": ("2 mm", "100 %"),
    "requirements": [
        {"metric": "deviation_from_target", "max": "5 %", "over": ("2.1 %", "97.7 %")},
        {"metric": "band_range_1pct", "min": "100 mm", "over": ("10 %", "180 mm")},
        {"metric": "force_mean[load]", "min": "49.6 N", "max": "51.8 N", "over": ("5 mm", "235 mm")},
    ],
}
PRESSED = {"mechanism.contact": {"width": "8 mm"}}


@pytest.mark.parametrize(
    ("changes", "ranges"),
    [
        ({}, AROUND),
        (WINDOW | PRESSED, AROUND | {"mechanism.contact.width": "6 mm:10 mm"}),
        (HEAVY | PRESSED, AROUND | {"mechanism.masses.roller": "0.2 kg:0.5 kg"}),
        ({"analysis.travel": None, "analysis.window": ("2 mm", "240 mm")}, AROUND),
        ({"analysis.travel": None} | SHARES, AROUND),
        (PRESSED | SHARES, AROUND),
        (WINDOW | BARE, SMALL),
        (WINDOW | BARE | HEAVY, SMALL),
        (WINDOW | BARE, {"mechanism.rolling_friction": "0:0.01"}),
        (WINDOW | BARE | {"mechanism.profile.friction": 0.002}, SMALL),
        (WINDOW | HEAVY | {"mechanism.profile.slope_factor": 1.05}, AROUND),
        (WINDOW | PRESSED | {"mechanism.profile.offset": "-0.1 mm"}, AROUND),
        (WINDOW | {"mechanism.profile.preload": "60 mm", "mechanism.springs.preload": "60 mm"}, AROUND),
        (WINDOW, AROUND | {"mechanism.brace_length": "190 mm:260 mm", "mechanism.rolling_friction": "0:0.1"}),
    ],
    ids=(
        "plain",
        "contact",
        "weights",
        "stroke",
        "shares",
        "shares of a travel",
        "bare",
        "heavy",
        "jams",
        "friction",
        "carrying",
        "offset",
        "stretched",
        "wide",
    ),
)
def test_every_metric_of_one_cut_cam_with_other_parts_is_that_of_each(changes, ranges):
    spec = cfmkit.load("configs/studies/cam_tolerance.yaml").replace(changes)
    plan = sampled(axes(spec, wishes(ranges), drawn=True), Draw("sobol", 16))
    metrics = metrics_of(spec, (), cfmkit.analyze(spec).curve)
    many = Work(Study(spec, plan.paths, metrics), plan)
    assert many.vectorised
    answer = vectorised_blocks._answer(many.study, plan, 0, 16)
    assert answer.done.mean() > 0.8
    together = run(many)
    for k in np.flatnonzero(answer.done).tolist():
        alone = many.study.evaluate(plan.point(k))
        assert alone.status is Status.COMPLETE
        found = cfmkit.analyze(spec.replace(dict(zip(plan.paths, plan.point(k), strict=True)))).warnings
        names = list(dict.fromkeys(item.name for item in found))
        assert [name for name, where in answer.warnings.items() if where[k]] == names
        expected = np.array([np.nan if value is None else value for value in alone.values])
        # Next to a dead point and a jam, half of the digits of the place are lost in the slider's.
        near = (
            {"contact_force_max", "friction_half_gap_max", "jam_travel"} if {"dead_point", "up_jam"} & {*names} else ()
        )
        close = np.where([item.name in near for item in metrics], 1e-6, 1e-11)
        wrong = ~(np.abs(together.row(k).values[0] - expected) <= close * np.abs(expected) + 1e-15)
        wrong &= ~(np.isnan(expected) & np.isnan(together.row(k).values[0]))
        assert not wrong.any(), [
            (metrics[m].name, together.row(k).values[0, m], expected[m]) for m in wrong.nonzero()[0]
        ]


def test_shares_of_the_travel_are_those_of_each_stroke_in_a_block():
    shares = {"analysis.window": ("1 %", "95 %"), "requirements": []}
    many = work(SPEC.replace(shares), {"mechanism.profile.stroke": "150 mm:245 mm"}, 16, BUILT_NAMES)
    answer = vectorised_blocks._answer(many.study, many.plan, 0, 16)
    assert answer.done.all()
    rows = run(many)
    for k in range(16):
        alone = many.study.evaluate(many.plan.point(k)).values
        np.testing.assert_allclose(rows.row(k).values[0], np.array(alone, float), rtol=1e-12, err_msg=str(k))


def test_a_window_that_some_travels_leave_no_width_is_refused_as_each_mechanism_refuses_it():
    spec = cfmkit.load("configs/studies/cam_tolerance.yaml").replace(
        {"analysis.travel": None, "analysis.window": ("240 mm", "100 %"), "requirements": []}
    )
    many = work(spec, {"mechanism.springs.stiffness.0": "0.65 N/mm:0.73 N/mm"}, 4, ("force_mean",))
    assert {run(many).row(k).status(0) for k in range(4)} == {
        (alone.status, alone.message) for alone in (many.study.evaluate(many.plan.point(k)) for k in range(4))
    }


def test_forces_on_the_corner_of_an_undercut_cam_do_not_depend_on_the_number_of_points():
    found = []
    for points in (13, 301, 3001):
        result = cfmkit.analyze(SPEC.replace({"analysis.points": points, "analysis.window": None}))
        metrics = cfmkit.metrics.evaluate(result, ["force_max[load]", "force_max[unload]", "corner_force_max"])
        found.append([quantity.value for quantity in metrics.values()])
    np.testing.assert_allclose(found, np.broadcast_to(found[-1], (3, 3)), rtol=1e-10)
    assert found[0][0] == pytest.approx(found[0][2], rel=1e-12)
