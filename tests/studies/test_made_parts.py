"""Parts drawn from `design.tolerances`: the yield of a design, before and after, and requirements on it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from made_parts import toleranced_cam

import cfmkit
from cfmkit import Run
from cfmkit.cli import run_command
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.specs.units import TravelShare
from cfmkit.studies.parts import drawn_parts
from cfmkit.studies.parts.drawn_parts import analyze_parts, common_errors, yields_of
from cfmkit.studies.parts.parts import Parts
from cfmkit.studies.parts.share import Share, clopper_pearson
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.sensitivity.setup import prepare
from cfmkit.studies.variants_in_rows import evaluate_result

MODULUS = "mechanism.material.youngs_modulus"


def test_parts_whose_travel_ends_before_a_window_have_no_value_and_the_page_says_so():
    """A cam cut for 240 mm ends a few micrometres earlier with a larger roller: half the parts had no value, unsaid."""
    tolerances = {"mechanism.roller_radius": {"normal": "0.05 mm"}}
    to_the_end = {"metric": "force_ripple", "max": "5 %", "over": ("2 mm", "240 mm")}
    design = cfmkit.design("configs/cam.yaml").spec.replace({"design.tolerances": tolerances, "design.samples": 40})
    design = design.replace({"requirements": (to_the_end, *design.requirements[1:])})
    found = yields_of(replace(cfmkit.analyze(design), spec=design), None, Run())
    count, reason = found.lacking
    assert count == 40 - found.after.good > 10
    assert "the window 2 ... 240 mm is not within the curve" in reason
    assert f"{count} have no value for a requirement and count as bad (the first: " in found.sentence()
    shares = [one.model_copy(update={"over": (TravelShare(0.02), TravelShare(1.0))}) for one in design.requirements[:2]]
    of_each = design.replace({"requirements": tuple(shares), "analysis.window": None})
    found = yields_of(replace(cfmkit.analyze(of_each), spec=of_each), None, Run())
    assert (found.lacking, found.after.good) == ((0, ""), 40)


def test_an_error_of_all_springs_is_common_and_a_trim_takes_it_away():
    spec = toleranced_cam(samples=100)
    result = cfmkit.analyze(spec)
    made = Parts.from_design(spec, spec.design, 0)
    assert common_errors(made, result, Run()) == (0,)
    values = made.draw()
    judged = analyze_parts(made, values, result, Run())
    values[:, 0] = made.nominal[0]
    still = analyze_parts(made, values, result, Run())
    # without a weight the force is proportional to the stiffness: the trim is the same as no error
    assert judged.share(judged.trimmed).good == still.share().good > judged.share().good


def test_a_trim_without_a_window_is_to_the_mean_force_over_that_of_a_requirement():
    """At the very start rollers that are too large have no force on the way up."""
    limits = {"metric": "force_mean[load]", "min": "49.6 N", "max": "51.8 N", "over": ["5 mm", "235 mm"]}
    built = {"mechanism.roller_radius": "8 mm", "analysis.window": None, "analysis.travel": "236 mm"}
    scatter = {"mechanism.roller_radius": {"normal": "0.1 mm"}}
    spec = toleranced_cam(tolerances=scatter, samples=30).replace(
        {**built, "analysis.points": 31, "requirements": (limits,)}
    )
    spec = cfmkit.design(spec).spec
    result = cfmkit.analyze(spec)
    made = Parts.from_design(spec, spec.design, 0)
    judged = analyze_parts(made, made.draw(), result, Run())
    assert judged.share(judged.trimmed).good == judged.share().good == 30


def test_a_trim_of_springs_that_are_solved_as_arrays_brings_their_mean_force_to_that_of_the_design():
    tolerances = {f"mechanism.springs.{name}": {"normal": "5 %"} for name in ("pivot", "crank_pin", "slider_pin")}
    spec = cfmkit.load("configs/slider_crank_bought.yaml").replace({"design.tolerances": tolerances})
    made = Parts.from_design(spec, spec.design, 0)
    values = made.draw(40)
    judged = analyze_parts(made, values, cfmkit.analyze(spec), Run())
    goods = []
    for row in values:
        part = cfmkit.analyze(spec.replace(dict(zip(made.paths, row.tolist(), strict=True)), as_made=True)).curve
        force = part.force[(part.motion >= 0.001) & (part.motion <= 0.035)]
        trimmed = force * cfmkit.evaluate(spec, ["force_mean"])["force_mean"].value / force.mean()
        goods.append(np.abs(trimmed / 1.5 - 1.0).max() <= 0.02)
    assert judged.share().good < sum(goods) == pytest.approx(judged.share(judged.trimmed).good, abs=1)


def test_parts_without_a_result_are_bad_and_counted():
    spec = toleranced_cam(samples=20, tolerances={"mechanism.rest_half_width": {"normal": "100 mm"}})
    result = cfmkit.analyze(spec)
    made = Parts.from_design(spec, spec.design, 0)
    values = np.array([[made.nominal[0]], [-0.01]])
    judged = analyze_parts(made, values, result, Run())
    assert judged.failed.tolist() == [False, True]
    assert (judged.share().good, judged.share().failed, judged.share().count) == (1, 1, 2)
    assert "rest_half_width" in judged.why


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"design.tolerances": {"mechanism.no_length": {"normal": "1 mm"}}}, "design.tolerances.'mechanism.no_length'"),
        ({"design.yield": "90 %"}, "design.yield"),
        ({"requirements": ({"metric": "yield", "min": "90 %"},)}, "requirements.0.metric"),
        ({"requirements": ({"metric": "yield", "min": "9 mm"},)}, "requirements.0.min"),
    ],
)
def test_bad_input_is_said_with_its_place(changes, reported):
    spec = cfmkit.load("configs/cam.yaml").replace(changes)
    with pytest.raises(SpecError) as error:
        cfmkit.loads(cfmkit.dumps(spec))
    assert reported in {one.path for one in error.value.problems}


def test_a_tolerance_on_what_the_design_lacks_ends_with_3(tmp_path, capsys):
    text = cfmkit.dumps(toleranced_cam(tolerances={"mechanism.springs.stiffness.*": {"normal": "1 %"}}, samples=20))
    (tmp_path / "cam.yaml").write_text(text)
    assert run_command(["design", str(tmp_path / "cam.yaml"), "-o", str(tmp_path / "out"), "--no-plots", "--json"]) == 3
    assert "design.tolerances" in json.loads(capsys.readouterr().out)["errors"][0]["path"]


@pytest.mark.parametrize("name", ["beam_cantilever", "slider_crank_strip"])
def test_a_study_without_findings_has_the_same_values_and_another_key(name):
    spec = cfmkit.load(f"configs/{name}.yaml").replace({"analysis.points": 15, "requirements": ()})
    known = cfmkit.analyze(spec)
    own = {"beam": "strain_energy_max", "slider-crank": "energy_max"}[spec.family]
    metrics = metrics_of(spec, ["force_mean", "stress_max", "range_95_fraction", own], known.curve)
    full, bare = (Study(spec, (), metrics, findings=findings) for findings in (True, False))
    noted, plain = (evaluate_result(study, known) for study in (full, bare))
    np.testing.assert_array_equal(noted.values, plain.values)
    assert plain.values[0, -1] == known.values[own].value
    assert set(noted.warned) == {one.name for one in known.warnings}
    assert not plain.warned
    assert full.key(()) != bare.key(())


@pytest.mark.parametrize(
    ("name", "module", "what", "column"),
    [
        ("beam_cantilever", "beam", "stress", "max_stress"),
        ("slider_crank_strip", "slider_crank.printed", "energy", "energy"),
    ],
)
def test_values_findings_and_columns_are_computed_when_they_are_read(name, module, what, column, monkeypatch):
    spec = cfmkit.load(f"configs/{name}.yaml").replace({"analysis.points": 15})

    def fail(_self):
        raise AssertionError("somebody has asked for it")

    monkeypatch.setattr(f"cfmkit.families.{module}.solution.Solution.{what}", property(fail))
    result = family(spec.family).analyze(spec, Run())
    assert result.values["allowable_stress"].definition
    assert column in result.curve.extra
    with pytest.raises(AssertionError, match="asked for it"):
        result.curve.extra[column]


def test_a_trim_by_the_force_of_one_branch_leaves_the_perfect_part_as_it_is():
    """Ends of the force had been those of both branches: "0 % after a trim", where a tenth was good before it."""
    requirement = {"metric": "deviation_from_target[load]", "max": "3 %", "over": ("3 mm", "35 mm")}
    spec = cfmkit.design("configs/slider_crank_friction.yaml").spec.replace({"requirements": (requirement,)})
    spec = spec.replace({"design.tolerances": {"mechanism.unloaded_angle": {"normal": "0.3 deg"}}})
    nominal, made = family("slider-crank").analyze(spec, Run()), Parts.from_design(spec, spec.design, 0)
    judged = analyze_parts(made, np.array([made.nominal] * 2), nominal, Run())
    assert judged.met.all()
    assert judged.trimmed.all()


def test_parts_without_common_errors_are_analysed_themselves():
    """They had been followed from those with such errors, which held for some parts and not for others."""
    spec = cfmkit.load("configs/vcfm_pla.yaml")
    tolerances = {"mechanism.bistable.thickness": {"normal": "0.01 mm"}, MODULUS: {"normal": "3 %"}}
    spec = spec.replace({"design.tolerances": tolerances, "design.samples": 60})
    nominal = cfmkit.analyze(spec)
    found, parts = yields_of(nominal, None, Run()), Parts.from_design(spec, spec.design, 0)
    assert found.common == (MODULUS,)
    values = parts.draw()
    values[:, parts.paths.index(MODULUS)] = spec.get_value(MODULUS)
    singly = [cfmkit.analyze(parts.part(one)) for one in values]
    good = sum(all(outcome.ok for outcome in one.requirements) for one in singly)
    assert found.frozen.good == good != found.after.good


def test_the_estimate_and_the_test_plan_draw_the_parts_that_a_study_draws():
    """Each had a generator of its own: three different sets of parts for one design and one seed."""
    spec = cfmkit.load("configs/vcfm_pla.yaml")
    block = {"method": "tolerance", "parameters": {"mechanism.bistable.thickness": {"normal": "0.05 mm"}}, "samples": 5}
    setup = prepare(spec.replace({"sensitivity": block}), seed=3)
    stated = spec.replace({"design.tolerances": {"mechanism.bistable.thickness": {"normal": "0.05 mm"}}})
    parts, whence = Parts.from_expected_errors(stated, 3)
    assert whence == "within design.tolerances"
    assert parts.draw(5).tolist() == setup.parts.draw().tolist()
    assumed = Parts.from_assumed_errors(spec, 3)
    at = assumed.paths.index("mechanism.bistable.thickness")
    assert assumed.parameters[at].spread.deviation == pytest.approx(3e-5)  # what a laser is assumed to hold


def test_failed_parts_count_as_bad_ones():
    share = Share.from_outcomes(np.arange(10) < 5, np.arange(10) >= 8)
    assert (share.good, share.failed, share.count) == (5, 2, 10)
    found = share.as_json()
    assert found["value"] == 0.5
    assert found["clopper_pearson"] == list(clopper_pearson(5, 10))


def test_a_design_that_is_designed_again_has_the_yield_of_its_parts_before_as_well(monkeypatch):
    """Parts as given are not drawn again, and a specification that differs in its description only has as many good."""
    spec = cfmkit.load("configs/cam.yaml").replace({"design.process": "laser", "design.samples": 40})
    nominal = replace(cfmkit.analyze(spec), spec=spec)
    other = yields_of(nominal, spec.replace({"description": "another one"}), Run())
    monkeypatch.setattr(drawn_parts, "_yield_before", None)
    again = yields_of(nominal, spec, Run())
    assert again.before == again.after == other.before
