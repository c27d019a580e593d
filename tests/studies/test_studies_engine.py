"""A study point by point: failures become rows, rows are reused by content, executors agree."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from journal_support import damage_a_record

import cfmkit
from cfmkit.errors import OutputError, UsageError
from cfmkit.families import FindingRule, Variants, family
from cfmkit.results import Finding, Status
from cfmkit.store import origin
from cfmkit.studies.engine import Work, compact, run
from cfmkit.studies.journal import Journal
from cfmkit.studies.plan import grid
from cfmkit.studies.point_evaluation import Study, metrics_of, sample_curve
from cfmkit.studies.pool import Pool
from cfmkit.studies.row_blocks_for_journal import ResultRows, squeeze, unsqueeze
from cfmkit.studies.summary_and_tables import Objective, Summary, results_csv
from cfmkit.studies.sweep_request_and_files import SweepRequest, prepare
from cfmkit.studies.variations import axes, collect_variations, parse_variation
from cfmkit.tables import read_csv

SPEC = cfmkit.load("configs/cam.yaml").replace({"analysis.points": 41})
FRICTION = "mechanism.profile.friction=[0, 0.001]"
BRACE = "mechanism.brace_length=[60 mm, 200 mm, 100 m, -1 mm]"


def work(*options, spec=SPEC, names=("force_mean", "force_mean[load]", "theoretical_force"), **more):
    plan = grid(axes(spec, [parse_variation(option) for option in options]))
    return Work(Study(spec, plan.paths, metrics_of(spec, names), **more), plan)


def statuses(records):
    return [rows.status(k)[0] for _, rows in records.batches() for k in range(len(rows))]


def values(records):
    return np.concatenate([rows.values for _, rows in records.batches()])


def test_whatever_fails_at_a_point_is_a_row_without_values():
    records = run(work(BRACE))
    assert statuses(records) == [Status.NO_EQUILIBRIUM, Status.COMPLETE, Status.COMPLETE, Status.INVALID]
    assert np.isnan(values(records)).all(axis=1).tolist() == [True, False, False, True]
    message = records.row(3).status(0)[1]
    assert message == "mechanism.brace_length: -1 mm is not allowed: must be > 0"


def test_a_bug_is_a_crashed_row_with_its_traceback_and_is_not_kept(monkeypatch, tmp_path):
    record = family("cam")

    def broken(spec, run):
        if spec.mechanism.profile.friction:
            raise ZeroDivisionError("oops")
        return record.analyze(spec, run)

    for module in ("point_evaluation", "variants_in_rows"):
        monkeypatch.setattr(
            f"cfmkit.studies.{module}.family",
            lambda _name: dataclasses.replace(record, models={"quasi-static": broken}, rows=None),
        )
    with Journal(tmp_path / "journal") as journal:
        records = run(work(FRICTION), journal=journal)
        assert statuses(records) == [Status.COMPLETE, Status.CRASHED]
        assert "a bug in cfmkit: ZeroDivisionError: oops" in records.row(1).status(0)[1]
        assert records.bugs == 1
        assert "in broken" in records.bug
    with Journal(tmp_path / "journal") as journal:
        assert len(journal) == 1


def test_a_point_has_the_numbers_that_analyze_and_evaluate_give():
    records = run(work("mechanism.roller_radius=[8 mm, 16 mm]"))
    for k, radius in enumerate((0.008, 0.016)):
        result = cfmkit.analyze(SPEC.replace({"mechanism.roller_radius": radius}))
        expected = cfmkit.evaluate(result, ["force_mean", "force_mean[load]", "theoretical_force"])
        assert records.row(k).values[0] == pytest.approx([one.value for one in expected.values()], rel=1e-12)


def test_requirements_are_checked_at_every_point():
    spec = cfmkit.load("configs/cam.yaml")
    met = np.concatenate([rows.met for _, rows in run(work("mechanism.springs.count=[1, 2]", spec=spec)).batches()])
    assert met.shape == (2, len(spec.requirements))
    expected = [cfmkit.analyze(spec.replace({"mechanism.springs.count": k})).requirements for k in (1, 2)]
    assert met.tolist() == [[outcome.ok for outcome in outcomes] for outcomes in expected]


def test_the_best_point_is_the_farthest_from_both_bounds_over_the_window_of_the_requirement():
    """Of a band the point on its lower bound was the best; of a metric noted twice the first, whatever its window."""
    band = {"metric": "force_mean", "min": "40 N", "max": "60 N", "over": ("10 mm", "100 mm")}
    spec = SPEC.replace({"requirements": (band,)})
    plan = work("mechanism.springs.count=[1, 2]").plan
    metrics = metrics_of(spec, ("force_mean", "force_mean[load]"))
    study = Study(spec, plan.paths, (*metrics, dataclasses.replace(metrics[0], over=spec.requirements[0].over)))
    found = Summary(study)
    numbers = np.array([[50.0, 50.0, 40.0], [40.0, 50.0, 53.0], [41.0, 50.0, 52.0], [50.0, 50.0, 70.0]])
    found.add(np.arange(3), ResultRows(numbers[:3], np.ones((3, 1), dtype=bool), {}))
    found.add(np.arange(3, 4), ResultRows(numbers[3:], np.zeros((1, 1), dtype=bool), {}))
    assert (found.best, found.ties, found.best_by) == (2, 1, ("force_mean", "most central"))
    one_sided = spec.replace({"requirements": (band | {"max": None},)})
    assert Summary(dataclasses.replace(study, spec=one_sided))._goal == Objective(2, True)


def test_designing_at_each_point_gives_the_designed_mechanism():
    records = run(work("design.force=[40 N, 60 N]", names=("theoretical_force", "force_constant"), design=True))
    assert values(records)[:, 0] == pytest.approx([40.0, 60.0], rel=1e-12)
    assert values(records)[:, 1] == pytest.approx([40 / (4 * 1380), 60 / (4 * 1380)], rel=1e-12)


def test_a_point_is_designed_as_the_design_verb_does_it(monkeypatch):
    """Points had neither the widths of `design.verify` nor the margins of `design.yield`, and no word of it."""
    spec = cfmkit.load("configs/slider_crank_bought.yaml").replace({"design.yield": "90 %", "analysis.points": 21})

    def margins(given, design, _run):
        assert getattr(given.design, "yield") == 0.9
        return dataclasses.replace(design, spec=design.spec.replace({"mechanism.crank_length": 0.0401}))

    def as_solid(_given, design, _run):
        return dataclasses.replace(design, spec=design.spec.replace({"mechanism.offset": 0.0003}))

    monkeypatch.setattr("cfmkit.studies.parts.redesign.with_design_margins", margins)
    monkeypatch.setattr("cfmkit.studies.delivered_design.verify_by_solid", as_solid)
    spec = spec.replace({"design.verify": "solid"})
    made = cfmkit.design(spec).spec
    assert (made.mechanism.crank_length, made.mechanism.offset) == (0.0401, 0.0003)
    study = prepare(spec, SweepRequest(collect_variations({"mechanism.offset": ["0 mm", "0.1 mm"]}), design=True)).study
    assert study.solve(spec).spec.mechanism == made.mechanism


def test_a_design_that_fails_is_a_row():
    records = run(work("design.stroke=[240 mm, 2 m]", design=True))
    assert statuses(records) == [Status.COMPLETE, Status.INFEASIBLE]


def test_designing_needs_a_family_that_can(monkeypatch):
    stiff = dataclasses.replace(family("cam"), design=None)
    monkeypatch.setattr("cfmkit.studies.engine.family", lambda _name: stiff)
    with pytest.raises(UsageError, match="cannot be designed"):
        run(work("design.force=[40 N]", design=True))


def test_a_pool_gives_the_rows_of_one_process(tmp_path):
    many = work(BRACE, "mechanism.profile.friction=0:0.002:6", names=())
    alone, together = run(many), run(many, Pool(2))
    assert np.array_equal(values(alone), values(together), equal_nan=True)
    assert [alone.row(k).status(0) for k in range(24)] == [together.row(k).status(0) for k in range(24)]


def test_rows_are_reused_by_content_not_by_order(tmp_path):
    with Journal(tmp_path / "journal") as journal:
        first = values(run(work("mechanism.profile.friction=[0.001, 0.002, 0.003]", design=True), journal=journal))
    with Journal(tmp_path / "journal") as journal:
        records = run(work("mechanism.profile.friction=[0.003, 0.004, 0.001]", design=True), journal=journal)
        assert records.reused == 2
        assert values(records)[[0, 2]].tolist() == first[[2, 0]].tolist()


@pytest.mark.parametrize(
    "change",
    [
        {"spec": SPEC.replace({"mechanism.roller_radius": 0.015})},
        {"spec": SPEC.replace({"analysis.points": 51})},
        {"spec": SPEC.replace({"requirements.0.max": "4 %"})},
        {"names": ("force_mean",)},
        {"design": True},
        {"curves": True},
        {"seed": 1},
    ],
)
def test_whatever_decides_a_row_makes_it_new(tmp_path, change):
    option = "mechanism.springs.max_elongation=[130 mm, 140 mm]"
    with Journal(tmp_path / "journal") as journal:
        run(work(option), journal=journal)
    with Journal(tmp_path / "journal") as journal:
        assert run(work(option), journal=journal).reused == 2
        assert run(work(option, **change), journal=journal).reused == 0


@pytest.mark.parametrize("changed", ["content", "numpy"])
def test_rows_of_other_code_are_computed_again(tmp_path, monkeypatch, changed):
    with Journal(tmp_path / "journal") as journal:
        run(work(FRICTION), journal=journal)
    monkeypatch.setattr("cfmkit.studies.point_evaluation.origin", lambda: origin() | {changed: "another"})
    with Journal(tmp_path / "journal") as journal:
        assert run(work(FRICTION), journal=journal).reused == 0


def test_a_second_writer_in_the_folder_changes_no_number(tmp_path):
    other = "mechanism.profile.friction=[0.005, 0.006, 0.007]"
    with Journal(tmp_path / "journal") as first, Journal(tmp_path / "journal") as second:

        def disturbed(work_of, jobs, _stopping):
            for job in jobs:
                run(work(other), journal=second)
                yield job, work_of(job)

        found = run(work(FRICTION), disturbed, first)
        assert values(found).tolist() == values(run(work(FRICTION))).tolist()


def warnings(records):
    return list(read_csv(table(records))["warnings"])


def test_the_table_names_the_warnings_of_each_point(tmp_path):
    expected = []
    for friction in (0.0, 0.004):
        result = Study(SPEC, ("mechanism.profile.friction",), (), design=True).solve(
            SPEC.replace({"mechanism.profile.friction": friction})
        )
        expected.append("; ".join(sorted({item.name for item in result.warnings})))
    assert "undercut" in expected[0]
    for reused in (0, 2):  # computed, and from the journal
        with Journal(tmp_path / "journal") as journal:
            records = run(work("mechanism.profile.friction=[0, 0.004]", design=True), journal=journal)
            assert (warnings(records), records.reused) == (expected, reused)


def test_the_warnings_of_rows_are_theirs_and_those_of_single_analyses(monkeypatch, tmp_path):
    record = family("cam")

    def rows(variants):
        friction = variants.values["mechanism.profile.friction"]
        some = np.flatnonzero(friction < 0.0025)
        for indices, solved in record.rows(Variants(SPEC, {}, lambda _k: SPEC, len(some))):
            own = friction[some[indices]]
            rules = (
                FindingRule("high_pressure_angle", lambda _solution, own=own: own > 0.0015, str),
                FindingRule("undercut", lambda _solution, own=own: own > 0.0005, str),
            )
            yield some[indices], dataclasses.replace(solved, rules=rules)

    def single(spec, run):
        found = record.analyze(spec, run)
        return dataclasses.replace(found, warnings=(Finding("odd", "no matter"), Finding("odd", "again")))

    fake = dataclasses.replace(record, models={"quasi-static": single}, rows=rows)
    monkeypatch.setattr("cfmkit.studies.variants_in_rows.family", lambda _name: fake)
    monkeypatch.setattr("cfmkit.studies.engine.points_at_once", lambda *_: 64)
    monkeypatch.setattr("cfmkit.studies.point_evaluation.family", lambda _name: fake)
    some = work("mechanism.profile.friction=[0, 0.001, 0.002, 0.003]", names=("theoretical_force",))
    expected = [None, "undercut", "high_pressure_angle; undercut", "odd"]
    for reused in (0, 4):
        with Journal(tmp_path / "journal") as journal:
            records = run(some, journal=journal)
            assert (warnings(records), records.reused) == (expected, reused)


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (300, 7), (5, 0)])
def test_numbers_come_back_from_the_journal_bit_for_bit(shape):
    random = np.random.default_rng(1)
    odd = np.array([np.nan, np.inf, -np.inf, -0.0, 5e-324, 1e308, 0.1])
    smooth = np.sin(np.linspace(0.0, 1.0, shape[0]))[:, None] * np.arange(1, shape[1] + 1)
    for table in (smooth, random.normal(size=shape), random.choice(odd, shape)):
        back = unsqueeze(squeeze(table), *shape)
        assert back.tobytes() == np.ascontiguousarray(table).tobytes()


def test_numbers_of_neighbours_in_a_grid_take_little_room():
    grid = np.sin(np.linspace(0.0, 1.0, 4000))[:, None] * np.arange(1.0, 5.0)
    assert len(squeeze(grid)) < grid.nbytes / 3


def test_the_journal_of_a_finished_study_holds_it_alone_and_serves_a_wider_one(tmp_path):
    path = tmp_path / "journal"
    names = tuple(item.name for item in metrics_of(SPEC, ()))
    ranges = {count: f"mechanism.springs.max_elongation=130 mm:{129 + count} mm:{count}" for count in (300, 301)}
    with Journal(path) as journal:
        run(work("mechanism.springs.max_elongation=[99 mm]", design=True, names=names), journal=journal)
    with Journal(path) as journal:
        records = run(work(ranges[300], design=True, names=names), journal=journal)
        before, held = table(records), len(journal)
        compact(journal, [records])
        assert (held, len(journal)) == (301, 300)
    assert path.stat().st_size < len(before)
    with Journal(path) as journal:
        again = run(work(ranges[300], design=True, names=names), journal=journal)
        assert (again.reused, table(again), journal.damaged) == (300, before, 0)
        last = again.row(299).values.tobytes()
        compact(journal, [again])
        assert len(journal) == 300
    with Journal(path) as journal:
        wider = run(work(ranges[301], design=True, names=names), journal=journal)
        assert (wider.reused, wider.row(299).values.tobytes()) == (300, last)


def test_a_journal_that_cannot_be_made_small_stays_as_it_is(tmp_path, monkeypatch):
    path = tmp_path / "journal"
    with Journal(path) as journal:
        records = run(work(FRICTION, design=True), journal=journal)
        journal.add("0" * 32, "of another study")

        (first, _) = records.noted_keys()

        def first_keys():
            yield first
            raise OutputError("no space")

        monkeypatch.setattr(records, "noted_keys", first_keys)
        compact(journal, [records])
    with Journal(path) as journal:
        assert len(journal) == 3
        assert run(work(FRICTION, design=True), journal=journal).reused == 2


def table(records):
    return b"".join(results_csv(records))


def test_a_new_name_changes_nothing(tmp_path):
    with Journal(tmp_path / "journal") as journal:
        run(work(FRICTION), journal=journal)
    with Journal(tmp_path / "journal") as journal:
        renamed = SPEC.replace({"name": "other", "sweep": {"vary": {"mechanism.roller_radius": "1 mm:2 mm:3"}}})
        assert run(work(FRICTION, spec=renamed), journal=journal).reused == 2


def test_rows_from_the_journal_are_the_rows_that_were_computed(tmp_path):
    many = work(BRACE, FRICTION, names=(), curves=True)
    with Journal(tmp_path / "journal") as journal:
        fresh = run(many, journal=journal)
        new = [fresh.row(k) for k in range(8)]
    with Journal(tmp_path / "journal") as journal:
        again = run(many, journal=journal)
        for k in range(8):
            old = again.row(k)
            assert np.array_equal(old.values, new[k].values, equal_nan=True)
            assert (old.met.tolist(), old.odd, old.curves) == (new[k].met.tolist(), new[k].odd, new[k].curves)
        assert again.reused == 8


def test_a_record_with_a_wrong_number_is_computed_again(tmp_path):
    place = tmp_path / "journal"
    with Journal(place) as journal:
        first = run(work(FRICTION, design=True), journal=journal)
        before = values(first)
    damage_a_record(place, next(first.noted_keys()))
    with Journal(place) as journal:
        second = run(work(FRICTION, design=True), journal=journal)
        assert (journal.damaged, second.reused) == (1, 1)
        assert np.array_equal(values(second), before)


def test_a_stopped_study_has_the_rows_that_were_finished():
    class Soon:
        count = 0

        def total(self, points): ...

        def add_finished(self, points, failed, reused):
            self.count += points

        def stopping(self):
            return self.count >= 3

    records = run(work("mechanism.springs.max_elongation=90 mm:100 mm:11", design=True), monitor=Soon())
    assert records.finished == 3
    assert [index.tolist() for index, _ in records.batches()] == [[0, 1, 2]]


def test_the_default_columns_are_every_metric_that_such_a_curve_can_have():
    option = parse_variation("mechanism.brace_length=[60 mm, 200 mm]")
    lost = SPEC.replace({"mechanism.brace_length": 0.06})
    curve = sample_curve(lost, grid(axes(lost, [option])), design=False)
    assert curve is not None
    names = [one.name for one in metrics_of(SPEC, (), curve)]
    assert {"force_ripple", "hysteresis_area", "theoretical_force", "corner_force_max"} <= set(names)
    assert not {"stress_max", "safety_factor"} & set(names)
    assert not any("[" in name for name in names)


@pytest.mark.parametrize("name", ["force_riple", "torque_mean", "hysteresis_area[load]"])
def test_an_unknown_metric_is_refused(name):
    with pytest.raises(UsageError, match=r"no metric|does not refer to a single branch"):
        metrics_of(SPEC, (name,))


def test_small_blocks_are_computed_together_and_noted_one_by_one(tmp_path):
    many = work("mechanism.roller_radius=6 mm:10 mm:60", "mechanism.rolling_friction=0:0.003:60", names=("force_mean",))
    assert (many.vectorised, many.step, many.together) == (True, 64, 512)
    finer = dataclasses.replace(many.study, spec=many.study.spec.replace({"analysis.points": 100_000}))
    assert (
        dataclasses.replace(many, study=finer).together == 256
    )  # of slow ones as many as leave a dozen processes some
    jobs = []

    def noting(work, queue, _stopping):
        for job in queue:
            jobs.append((job.start, job.stop))
            yield job, work(job)

    with Journal(tmp_path / "journal") as journal:
        first = values(run(many, noting, journal))
    assert [stop - start for start, stop in jobs] == 7 * [512] + [16]
    with Journal(tmp_path / "journal") as journal:
        assert len(journal) == 57
        again = run(many, journal=journal)
        assert again.reused == 3600
        assert np.array_equal(values(again), first)
    # Of a study with one value more, whose last blocks are other ones, only these are computed.
    jobs.clear()
    more = work("mechanism.roller_radius=6 mm:10 mm:60", "mechanism.rolling_friction=0:0.003:60", names=("force_mean",))
    more = dataclasses.replace(more, plan=more.plan.part(0, 3590))
    with Journal(tmp_path / "journal") as journal:
        assert run(more, noting, journal).reused == 3584
    assert jobs == [(3584, 3590)]


@pytest.mark.parametrize(("structure", "most"), [("v-beam", 512), ("cosine", 40)])
def test_a_task_of_leaves_that_are_searched_for_is_small(structure, most):
    """So that Ctrl-C and a kill lose seconds."""
    spec = cfmkit.load("configs/vcfm_ding2022.yaml").replace({"mechanism.bistable.structure": structure})
    assert work("mechanism.bistable.thickness=0.7 mm:1.3 mm:480", spec=spec, names=("force_mean",)).together == most


def test_a_study_knows_a_data_file_by_its_content(tmp_path):
    (tmp_path / "synthetic").mkdir()
    (tmp_path / "cam.yaml").write_bytes(Path("configs/cam_as_built.yaml").read_bytes())
    points = Path("configs/synthetic/cam_flanks.csv").read_text()

    def key(points):
        (tmp_path / "synthetic/cam_flanks.csv").write_text(points)
        return Study(cfmkit.load(tmp_path / "cam.yaml"), ("mechanism.rolling_friction",), ()).key((0.002,))

    assert key(points) == key(points) != key(points[::-1].replace("1", "2", 1)[::-1])
