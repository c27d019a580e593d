"""A sensitivity study in one process: setup, evaluation, statements, files and pictures."""

from __future__ import annotations

import dataclasses
from collections import Counter
from pathlib import Path

import numpy as np
import plugin_support
import pytest

import cfmkit
from cfmkit import families
from cfmkit.errors import ExitCode, SpecError, UsageError
from cfmkit.families import family
from cfmkit.numerics import SAMPLE_KINDS
from cfmkit.results import Status
from cfmkit.studies.engine import ROW_MISSING, run
from cfmkit.studies.parts.share import Share
from cfmkit.studies.parts.uncertain_values import with_options
from cfmkit.studies.sensitivity import METHOD_NAMES
from cfmkit.studies.sensitivity.evaluation import Evaluator
from cfmkit.studies.sensitivity.method import method_named
from cfmkit.studies.sensitivity.run_and_files import (
    as_json,
    carry_out,
    exit_code,
    is_met_by_interval,
    message,
    outputs,
    yield_ok,
)
from cfmkit.studies.sensitivity.setup import prepare
from cfmkit.studies.summary_and_tables import Summary

CONFIG = Path(__file__).parents[2] / "configs" / "studies" / "cam_tolerance.yaml"
PARAMETERS = {
    "mechanism.rest_half_width": ("67.95 mm", "68.05 mm"),
    "mechanism.springs.stiffness.*": {"uniform": "1 %"},
}


def spec(method="sobol", parameters=PARAMETERS, samples=4, **more):
    block = {"method": method, "parameters": parameters, "samples": samples} | more
    return cfmkit.load(CONFIG).replace({"sensitivity": block})


def study(method="sobol", **more):
    return carry_out(prepare(spec(method, **more)), run)


BROKEN = {"mechanism.rolling_friction": ("-0.001", "0.004"), "mechanism.roller_radius": {"uniform": "0.05 mm"}}


@pytest.mark.parametrize("method", METHOD_NAMES)
def test_a_method_evaluates_as_many_points_as_it_says(method):
    found = study(method)
    setup = found.setup
    assert len(setup.parameters) == 3
    groups = len(setup.together)
    assert found.evaluator.count == setup.record.count_points(setup.samples, 3, groups) > 0
    assert exit_code(found) in (ExitCode.OK, ExitCode.REQUIREMENT_MISSED)
    assert found.unstated == 0
    with pytest.raises(UsageError, match="--max-points"):
        prepare(spec(method), most=found.evaluator.count - 1)
    prepare(spec(method), most=found.evaluator.count)


@pytest.mark.parametrize("method", ["oat", "morris", "sobol", "tolerance"])
def test_a_study_never_states_a_zero_for_a_parameter_whose_samples_failed(method):
    found = study(method, parameters=BROKEN, samples=16)
    assert found.evaluator.failed > 0
    assert exit_code(found) is ExitCode.PARTIAL
    about = [line for line in found.lines if line.parameter == "mechanism.rolling_friction"]
    main = [line for line in about if line.index in ("swing", "mu_star", "total_order", "variance_drop_when_halved")]
    assert main
    assert all(line.value is None for line in main)


@pytest.mark.parametrize("method", ["tolerance", "inverse"])
def test_a_part_that_is_judged_counts_in_the_yield_whatever_metric_has_no_value(monkeypatch, method):
    """One part without a value of a metric left the yield open."""
    whole = study(method, samples=5)
    evaluate = Evaluator.outputs

    def one_missing(self, points, roles):
        outputs = evaluate(self, points, roles)
        outputs[3, 0, 0] = np.nan
        return outputs

    monkeypatch.setattr(Evaluator, "outputs", one_missing)
    found = study(method, samples=5)
    counts = [(one.good, one.failed, one.count) for one in (found.all_met, *found.each_met)]
    assert counts == [(one.good, one.failed, one.count) for one in (whole.all_met, *whole.each_met)]
    if method == "tolerance":
        first = [line.value for line in found.lines if line.metric == found.setup.study.metrics[0].label]
        assert first
        assert first == [None] * len(first)


@pytest.mark.parametrize(
    ("end", "code"),
    [(Status.CRASHED, ExitCode.BUG), (Status.INVALID, ExitCode.INVALID), (Status.NO_EQUILIBRIUM, ExitCode.NO_SOLUTION)],
)
def test_a_study_of_which_nothing_was_solved_ends_with_the_code_of_what_all_have_in_common(end, code):
    """Where every worker was killed, the codes were those of a mechanism without a solution."""
    found = study("oat", samples=2)
    count = found.evaluator.count
    found.evaluator.ends = Counter({end: count})
    summary = Summary(found.setup.study, counts=Counter({end: count}))
    assert (exit_code(found), summary.exit_code(), as_json(found)["status"]) == (code, code, "no_result")
    mixed = Counter({end: count - 1, Status.INFEASIBLE: 1})
    found.evaluator.ends, summary.counts = mixed, mixed
    assert (exit_code(found), summary.exit_code()) == (ExitCode.NO_SOLUTION,) * 2


@pytest.mark.parametrize(("good", "met"), [(93, False), (95, True)])
def test_failed_parts_count_as_bad_in_a_yield_and_are_counted(good, met):
    found = study("tolerance", samples=4, min_yield="95 %")
    parts = np.arange(100)
    share = Share.from_outcomes(parts < good, (parts >= good) & (parts < good + 5))
    found = dataclasses.replace(found, all_met=share)
    assert (yield_ok(found), is_met_by_interval(found)) == (met, False)
    sentence = as_json(found)["requirements"][-1]["sentence"]
    outcome = "ok" if met else "missed"
    assert sentence == f"yield {good} % (5 of 100 parts failed), required >= 95 %: {outcome}"


def test_the_engine_gives_the_values_of_a_single_analysis():
    found = study("oat", samples=3)
    setup = found.setup
    for k, path in enumerate(setup.paths):
        for value, numbers in zip(found.points[k, :, k], found.outputs[k], strict=True):
            result = cfmkit.analyze(setup.study.spec.replace({path: float(value)}))
            met = [outcome.ok for outcome in result.requirements]
            assert numbers[-len(met) :].tolist() == [float(one) for one in met]
            outcomes = [outcome.value for outcome in result.requirements]
            np.testing.assert_allclose(numbers[0], outcomes[0], rtol=1e-9)


def test_metrics_are_those_of_the_requirements_over_their_windows():
    setup = prepare(spec())
    assert [one.label for one in setup.study.metrics] == [
        "deviation_from_target over 5 ... 235 mm",
        "force_mean_load over 5 ... 235 mm",
    ]
    nominal = [outcome.value for outcome in setup.nominal.outcomes]
    np.testing.assert_allclose(setup.nominal.values, nominal, rtol=1e-12)


def test_a_family_that_knows_its_gradient_is_asked_for_it(monkeypatch):
    record = family("cam")
    asked = []

    def gradient(_spec, paths):
        asked.append(tuple(paths))
        return {"theoretical_force": dict.fromkeys(paths, 3.0)}

    known = dataclasses.replace(record, gradient=gradient)
    monkeypatch.setattr("cfmkit.studies.sensitivity.local.family", lambda name: known)
    found = study("local", metrics=("theoretical_force",))
    assert asked == [found.setup.paths]
    assert found.evaluator.count == 0
    assert {line.value for line in found.lines if line.index == "gradient" and line.unit == "N/mm"} == {3.0 / 1000}
    mixed = study("local", metrics=("theoretical_force", "force_ripple"))
    assert mixed.evaluator.count > 0
    assert {line.value for line in mixed.lines if line.index == "gradient" and line.unit == "N/mm"} == {3.0 / 1000}


def test_an_interrupted_study_states_nothing_but_keeps_its_rows():
    def stops(work):
        records = run(work)
        records._places[work.step :] = ROW_MISSING  # what was under way when it was ended: whole jobs
        done.append(work.step)
        return records

    done = []
    found = carry_out(prepare(spec(samples=32)), stops)
    assert found.interrupted
    assert exit_code(found) is ExitCode.INTERRUPTED
    written = {name: data if isinstance(data, bytes) else b"".join(data) for name, data in outputs(found)}
    assert "indices.csv" not in written
    assert done[0] < found.setup.record.count_points(32, 3, 2)
    assert len(written["results.csv"].splitlines()) == 1 + done[0]
    assert message(found).endswith("run the same command again to continue")
    assert message(dataclasses.replace(found, fresh=True)).endswith(
        "run the same command again without --fresh to continue"
    )
    assert as_json(found)["status"] == "interrupted"


def test_the_parts_of_a_list_and_of_a_batch_are_tightened_together():
    setup = prepare(spec("tolerance", parameters=PARAMETERS | {"mechanism.roller_radius": {"normal": "0.01 mm"}}))
    assert [len(group) for group in setup.together] == [1, 2, 1]
    joint = ({"parameters": ("mechanism.roller_radius", "mechanism.rest_half_width"), "correlation": 0.5},)
    names = ("mechanism.roller_radius", "mechanism.rest_half_width")
    setup = prepare(spec("tolerance", parameters={name: {"normal": "0.01 mm"} for name in names}, correlated=joint))
    assert setup.together == ((0, 1),)
    assert setup.parts.correlation[0, 1] == 0.5


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"correlated": ({"parameters": ("mechanism.rest_half_width",)},)}, "needs at least two parameters"),
        (
            {"correlated": ({"parameters": ("mechanism.brace", "mechanism.rest_half_width")},)},
            "not among the parameters",
        ),
        ({"parameters": PARAMETERS | {"mechanism.springs.stiffness.0": {"uniform": "1 %"}}}, "is a parameter already"),
        ({"parameters": {"mechanism.brace_length.*": {"uniform": "1 %"}}}, "is not a list"),
        ({"parameters": {"mechanism.profile.offset": {"uniform": "1 %"}}}, "of zero is zero"),
        ({"parameters": {"mechanism.brace_length": {"uniform": "0 mm"}}}, "must be > 0"),
        ({"parameters": {"mechanism.brace_length": {"uniform": "1 mm", "normal": "1 mm"}}}, "either"),
        ({"parameters": {"mechanism.brace_length": {"uniform": "1 mm", "truncate": "1 mm"}}}, "tails"),
        ({"parameters": {"requirements.0.max": ("1 %", "2 %")}}, "nothing to vary"),
        ({"method": "morris", "sampling": "lhs"}, "morris has points of its own: 'sampling' is for sobol, tolerance"),
    ],
)
def test_a_block_that_makes_no_sense_is_refused_with_the_reason(more, words):
    with pytest.raises(SpecError, match=words):
        prepare(spec(**{"method": "tolerance"} | more))


@pytest.mark.parametrize("kind", SAMPLE_KINDS)
def test_every_way_to_draw_samples_draws_parts_and_base_samples_evenly(kind):
    parts = prepare(spec("tolerance", samples=64, sampling=kind)).parts
    base_samples = study("sobol", samples=64, sampling=kind).points[:, 0, 0]
    low, high = 0.06795, 0.06805
    for values in (parts.draw()[:, 0], base_samples):
        counts = np.histogram(values, 16, (low, high))[0]
        assert counts.sum() == 64
        assert np.abs(counts - 4).max() <= 1  # at random some of the 16 bins would miss by four
    assert np.array_equal(parts.draw(), prepare(spec("tolerance", samples=64, sampling=kind)).parts.draw())
    scores = parts.unit(64, 0)
    assert not np.array_equal(scores, prepare(spec("tolerance", samples=64)).parts.unit(64, 0))


def test_another_method_chooses_its_own_way_to_draw():
    block = with_options(spec("tolerance", sampling="lhs").sensitivity, {"method": "morris"})
    assert spec().replace({"sensitivity": block}).sensitivity.sampling is None


def test_three_springs_cannot_all_oppose_each_other():
    six = cfmkit.load(CONFIG.parent.parent / "cam_six_springs.yaml")
    block = {
        "method": "tolerance",
        "parameters": {"mechanism.springs.stiffness.*": {"normal": "1 %"}},
        "correlated": ({"parameters": ("mechanism.springs.stiffness.*",), "correlation": -0.5},),
    }
    with pytest.raises(SpecError, match="oppose"):
        prepare(six.replace({"sensitivity": block}))


def test_every_family_takes_a_study_of_its_own_values():
    for name in families.names():
        for path in [*sorted(CONFIG.parent.parent.glob("*.yaml")), *plugin_support.CONFIGS]:
            one = cfmkit.load(path)
            values = {leaf: value for leaf, value in one.leaves() if leaf.startswith("mechanism.")}
            if one.family != name or not values:
                continue
            leaf = next(leaf for leaf, value in values.items() if isinstance(value, float) and value)
            block = {"method": "oat", "samples": 2, "parameters": {leaf: {"uniform": "0.01 %"}}}
            found = carry_out(prepare(one.replace({"sensitivity": block})), run)
            assert found.evaluator.count == 2, path
            break
        else:
            pytest.fail(f"no configuration of {name}")


def test_a_new_block_changes_no_other_result():
    setup = prepare(spec())
    other = prepare(spec(samples=8))
    assert setup.study.identity == other.study.identity


def test_blocks_are_numbered_on_when_more_are_drawn():
    setup = prepare(spec("sobol", parameters=BROKEN))
    evaluator = Evaluator(setup.study, setup.parameters, run)
    points = np.broadcast_to(setup.values, (2, 4, len(setup.values)))
    for _ in range(2):
        evaluator.outputs(points, ["a", "b", "c", "d"])
    assert [piece.blocks.tolist() for piece in evaluator.pieces] == [[1] * 4 + [2] * 4, [3] * 4 + [4] * 4]
    assert evaluator.pieces[0].roles.tolist() == ["a", "b", "c", "d"] * 2


@pytest.mark.parametrize("name", METHOD_NAMES)
def test_a_method_of_sensitivity_has_its_module_and_its_indices(name):
    method = method_named(name)
    assert method.count_points(16, 3, 2) > 0
    assert method.indices
