"""Many cams solved together have the numbers that a run of each has."""

from __future__ import annotations

import numpy as np
import pytest
from study_rows import assert_rows_equal_runs, run_point, study_of

import cfmkit
from cfmkit.families import Variants, family
from cfmkit.results import Status
from cfmkit.studies.engine import Work, run
from cfmkit.studies.journal import Journal
from cfmkit.studies.plan import Draw, sample_axes
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.row_blocks_for_journal import join_rows
from cfmkit.studies.serial_and_cluster_executors import Lost
from cfmkit.studies.variants_in_rows import evaluate_rows, points_at_once
from cfmkit.studies.variations import axes, collect_variations

solve_rows = family("cam").rows

SPEC = cfmkit.load("configs/cam.yaml").replace({"analysis.points": 61})

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
"""Some of these cams do not exist, some are jammed, some end early."""


def config(stem):
    return cfmkit.load(f"configs/{stem}.yaml")


def work(spec=SPEC, ranges=RANGES, count=60, names=()):
    """Return a study of points drawn in ranges, by default with every metric that a sweep notes."""
    plan = sample_axes(axes(spec, collect_variations(ranges), drawn=True), Draw("sobol", count))
    return Work(Study(spec, plan.paths, metrics_of(spec, names, cfmkit.analyze(spec).curve)), plan)


def listed(values):
    """Return a study of points that are given one by one."""
    return Work(*study_of(SPEC, values))


def compare(many):
    """Return the rows of a study, which are runs of their own."""
    return assert_rows_equal_runs(many.study, many.plan)


def members(many):
    """Return which points of a study are rows of a solution, and have a complete curve."""
    values = dict(zip(many.plan.paths, many.plan.block(0, len(many.plan)), strict=True))
    variants = Variants(many.study.plain, values, lambda k: many.study.variant(many.plan.point(k)), len(many.plan))
    with np.errstate(all="ignore"):
        found = [indices[solved.complete] for indices, solved in solve_rows(variants)]
    return set(np.concatenate([[], *found]).astype(int).tolist())


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"analysis.window": None},
        {"mechanism.rolling_friction": 0.0},
        {"analysis.window": ("3.3 mm", "151 mm"), "design": None},
    ],
)
def test_rows_of_cams_that_may_not_exist_or_jam_are_runs_of_their_own(change):
    spec = SPEC.replace(change)
    ranges = {k: v for k, v in RANGES.items() if k not in change and not (spec.design is None and k == "design.force")}
    many = work(spec, ranges, 32)
    assert many.vectorised
    together = compare(many)
    assert together.odd
    assert len(members(many)) > 8


HEAVY = {
    "mechanism.masses": {"slider": "0.068 kg", "brace": "0.077 kg", "roller": "0.38 kg"},
    "analysis.gravity": True,
}
LEANING = {
    "mechanism.masses": HEAVY["mechanism.masses"],
    "mechanism.mounting": {"elevation": "20 deg", "roll": "5 deg"},
}
RUBBING = {
    "mechanism.pins": {"diameter": "6 mm", "friction": 0.1},
    "mechanism.bearings": {"bore": "8 mm", "friction": 0.0015, "dynamic_rating": "3300 N", "static_rating": "60 N"},
    "mechanism.guide": {"friction": 0.05, "drag": "0.1 N"},
}
PRESSED = {"mechanism.contact": {"width": "8 mm"}}
SHARES = {
    "analysis.window": ("2 mm", "100 %"),
    "requirements": [
        {"metric": "deviation_from_target", "max": "5 %", "over": ("2.1 %", "97.7 %")},
        {"metric": "band_range_1pct", "min": "100 mm", "over": ("10 %", "180 mm")},
        {"metric": "force_mean[load]", "min": "49.6 N", "max": "51.8 N", "over": ("5 mm", "235 mm")},
    ],
}
AROUND = {
    "mechanism.rest_half_width": "67 mm:69 mm",
    "mechanism.roller_radius": "15.5 mm:16.5 mm",
    "mechanism.brace_length": "199 mm:201 mm",
    "mechanism.rolling_friction": "0:0.01",
}
BARE = {"mechanism.roller_radius": "8 mm", "mechanism.profile.roller_radius": "8 mm"}
SMALL = AROUND | {"mechanism.roller_radius": "7.5 mm:8.5 mm"}


@pytest.mark.parametrize(
    ("changes", "ranges"),
    [
        ({}, {"mechanism.springs.stiffness.0": "0.65 N/mm:0.73 N/mm"}),
        (PRESSED, AROUND | {"mechanism.contact.width": "6 mm:10 mm"}),
        (HEAVY | PRESSED, AROUND | {"mechanism.masses.roller": "0.2 kg:0.5 kg"}),
        (HEAVY, {"mechanism.masses.roller": "0 kg:0.5 kg", "mechanism.springs.stiffness.1": "0.6 N/mm:0.7 N/mm"}),
        (LEANING, AROUND | {"mechanism.mounting.elevation": "10 deg:30 deg"}),
        (RUBBING, {"mechanism.bearings.bore": "6 mm:10 mm", "mechanism.guide.drag": "0.1 N:1 N"}),
        (RUBBING | SHARES, AROUND),
        ({"analysis.travel": None} | SHARES, AROUND),
        (BARE, SMALL),
        (BARE | HEAVY, SMALL),
        (BARE, {"mechanism.rolling_friction": "0:0.01"}),
        (BARE | {"mechanism.profile.friction": 0.002}, {"mechanism.rolling_friction": "0:0.01"}),
        (HEAVY | {"mechanism.profile.slope_factor": 1.05}, AROUND),
        (PRESSED | {"mechanism.profile.offset": "-0.1 mm"}, AROUND),
        ({"mechanism.profile.offset": "0.1 mm", "analysis.origin": "slider-from-cam"}, AROUND),
        ({"mechanism.stops": {"lower": "5 mm", "upper": "100 mm"}, "analysis.travel": None, "requirements": []},
         {"mechanism.stops.upper": "90 mm:110 mm"}),
        ({"mechanism.springs.preload": "60 mm"}, {"mechanism.springs.preload": "50 mm:70 mm"}),
        ({"analysis.path_method": "ode"}, {"mechanism.springs.stiffness.0": "0.65 N/mm:0.73 N/mm"}),
        ({}, {"mechanism.brace_length": "190 mm:260 mm", "mechanism.rolling_friction": "0:0.1"}),
    ],
    ids=(
        "springs", "contact", "weights", "masses", "leaning", "rubbing", "rubbing shares", "stroke", "bare", "heavy",
        "jams", "friction", "carrying", "missing", "left", "stops", "stretched", "ode", "wide",
    ),
)  # fmt: skip
def test_rows_around_a_cut_cam_are_runs_of_their_own(changes, ranges):
    many = work(config("studies/cam_tolerance").replace(changes), ranges, 8)
    assert many.vectorised
    compare(many)
    assert len(members(many)) >= 4


def test_whoever_runs_on_a_corner_is_a_row_too():
    many = listed({"mechanism.roller_radius": [0.0100, 0.0103, 0.0104, 0.0160, 0.0300]})
    assert len(members(many)) == 5
    rows = compare(many)
    corner, peak = (rows.values[:, many.study.names.index(name)] for name in ("undercut_travel", "corner_force_max"))
    assert corner[:2].tolist() == [0.0, 0.0]
    assert (np.diff(corner[1:]) > 0).all()
    # Just undercut, friction holds the roller on its corner, and there is no largest force.
    assert np.isnan(peak).tolist() == [True, True, True, False, False]


def test_rollers_that_overlap_are_analysed_alone():
    many = listed({"mechanism.roller_radius": [0.067, 0.068, 0.0681, 0.150]})
    assert members(many) == {0, 1}
    assert [evaluate_rows(many.study, many.plan, 0, 4).status(k)[0] for k in (2, 3)] == [Status.NO_EQUILIBRIUM] * 2


def test_rows_warn_of_what_each_cam_warns_of():
    spec = SPEC.replace({"mechanism.springs.max_elongation": "130 mm"})
    ranges = RANGES | {"mechanism.rolling_friction": "0:0.3", "mechanism.profile.force_constant": "5 mm:30 mm"}
    rows = compare(work(spec, ranges, 64, ("force_mean",)))
    assert set(rows.warned) >= {"undercut", "up_jam", "spring_overstretched", "slack_cable"}


def test_motions_measured_cams_and_curves_that_no_target_names_are_analysed_alone():
    for spec in (config("cam_dynamics"), config("cam_as_built"), config("cam_balance").replace({"design": None})):
        values = {"mechanism.brace_length": np.full(2, spec.mechanism.brace_length)}
        assert not list(solve_rows(Variants(spec, values, lambda _k, spec=spec: spec, 2))), spec


def test_designing_is_done_point_by_point():
    many = work(count=4, names=("force_mean",))
    assert points_at_once(Study(SPEC, many.plan.paths, many.study.metrics, design=True), many.plan) == 1


def test_rows_do_not_depend_on_how_a_study_is_cut_into_blocks():
    many = work(count=41)
    whole = evaluate_rows(many.study, many.plan, 0, 41)
    parts = join_rows([evaluate_rows(many.study, many.plan, k, min(k + 13, 41)) for k in range(0, 41, 13)])
    np.testing.assert_allclose(whole.values, parts.values, rtol=1e-9, atol=1e-12)
    assert (whole.met.tolist(), whole.odd) == (parts.met.tolist(), parts.odd)


def test_rows_are_the_same_whether_curves_are_wanted_or_not(tmp_path):
    plain = work(count=20, names=("force_mean", "usable_stroke"))
    kept = Work(Study(SPEC, plain.plan.paths, plain.study.metrics, curves=True), plain.plan)
    assert kept.vectorised
    without = evaluate_rows(plain.study, plain.plan, 0, 20)
    for _ in range(2):
        with Journal(tmp_path / "journal") as journal:
            (rows,) = [rows for _, rows in run(kept, journal=journal).batches()]
        assert np.array_equal(rows.values, without.values, equal_nan=True)
        assert rows.odd == without.odd
        alone = {k: run_point(kept.study, kept.plan, k).curve for k in range(20)}
        assert rows.curves == {k: curve for k, curve in alone.items() if curve}


def test_blocks_are_noted_and_reused_whole(tmp_path):
    ranges = {"mechanism.springs.stiffness": "0.3 N/mm:1 N/mm"}
    many = work(ranges=ranges, count=5000, names=("force_mean", "force_ripple"))
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


def test_shares_of_the_travel_are_those_of_each_stroke():
    shares = {"analysis.window": ("1 %", "95 %"), "requirements": []}
    many = work(SPEC.replace(shares), {"mechanism.profile.stroke": "150 mm:245 mm"}, 8)
    assert len(members(many)) == 8
    compare(many)


@pytest.mark.parametrize("name", [None, "mechanism.roller_radius"])
def test_cams_whose_windows_differ_are_solved_together_each_over_its_own(name):
    spec = SPEC.replace(
        {"mechanism.bearings": {"bore": "5 mm", "friction": 0.002}, "analysis.window": ("3 mm", "90 %")}
    )
    values = {"analysis.window.0": np.linspace(0.002, 0.03, 12)}
    if name is not None:
        values[name] = spec.get_value(name) * np.linspace(0.99, 1.0, 12)
    study, plan = study_of(spec, values)
    variants = Variants(spec, values, lambda k: study.variant(plan.point(k)), 12)
    assert sum(len(rows) for rows, _ in solve_rows(variants) if len(rows) > 3) == 12
    assert_rows_equal_runs(study, plan, step=4)


def test_a_window_that_some_travels_leave_no_width_is_refused_as_each_mechanism_refuses_it():
    spec = config("studies/cam_tolerance").replace(
        {"analysis.travel": None, "analysis.window": ("240 mm", "100 %"), "requirements": []}
    )
    ranges = {"mechanism.springs.stiffness.0": "0.65 N/mm:0.73 N/mm"}
    plan = sample_axes(axes(spec, collect_variations(ranges), drawn=True), Draw("sobol", 4))
    many = Work(Study(spec, plan.paths, metrics_of(spec, ("force_mean",))), plan)
    assert {run(many).row(k).status(0) for k in range(4)} == {
        (alone.status, alone.message) for alone in (run_point(many.study, many.plan, k) for k in range(4))
    }


@pytest.mark.parametrize("path", ["brace_length", "roller_radius", "profile.offset"])
def test_rows_that_are_solved_a_few_at_a_time_are_runs(path, monkeypatch):
    """Two rows a parcel: the last of five was a bug of the whole sweep, and others had the cams of the first parcel."""
    monkeypatch.setattr("cfmkit.families.cam.model.MAX_SAMPLES_AT_ONCE", 2 * 61 + 1)
    start, step = {"brace_length": (0.2, 0.01), "roller_radius": (0.01, 1e-3), "profile.offset": (-1e-3, 1e-4)}[path]
    many = listed({f"mechanism.{path}": [start + step * k for k in range(5)]})
    assert len(compare(many)) == 5
    assert members(many) == set(range(5))
