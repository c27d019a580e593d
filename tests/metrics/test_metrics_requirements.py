"""Requirements: what is refused before a run, and what becomes of each after it."""

import numpy as np
import pytest

import cfmkit
from cfmkit.curves import Curve
from cfmkit.errors import SpecError
from cfmkit.metrics import check, definitions, requirement_problems, values_of_family
from cfmkit.results import Quantity, Result, Status

REQUIREMENT = type(cfmkit.load("configs/cam.yaml").requirements[0])
OWN = values_of_family({"spring_elongation": ("length", "largest elongation of the springs")})


def require(**entry):
    plain = {key: tuple(item) if isinstance(item, list) else item for key, item in entry.items()}
    return REQUIREMENT.model_validate(plain)


def result(kind="force", **kept):
    motion = np.array([0, 0.1, 0.2, 0.2, 0.1, 0])
    effort = np.array([50, 51, 50.5, 50, 49.5, 49])
    loop = Curve(motion, effort, ["load"] * 3 + ["unload"] * 3, [True] * 6, kind=kind)
    return Result(spec=None, status=Status.COMPLETE, curves=(loop,), **kept)  # type: ignore[arg-type]


def outcome(of=None, **entry):
    return check([require(**entry)], of or result())[0]


def problems(kind="force", **entry):
    return [
        (item.path, item.message) for item in requirement_problems([require(**entry)], definitions(kind, OWN), kind)
    ]


@pytest.mark.parametrize(
    ("entry", "place", "words"),
    [
        ({"metric": "force_riple", "max": "5 %"}, "metric", "did you mean 'force_ripple'?"),
        ({"metric": "spring_elongaton", "max": "5 mm"}, "metric", "did you mean 'spring_elongation'?"),
        ({"metric": "qqq", "max": 1}, "metric", "`cfmkit show metrics` lists them"),
        ({"metric": "torque_mean", "max": "5 N"}, "metric", "on a force curve; did you mean 'force_mean'?"),
        ({"metric": "hysteresis_area[load]", "max": "5 N*mm"}, "metric", "does not refer to a single branch"),
        ({"metric": "spring_elongation[load]", "max": "5 mm"}, "metric", "does not refer to a single branch"),
        ({"metric": "force_ripple", "max": "5 N"}, "max", "'5 N' is a force; a ratio is needed"),
        ({"metric": "force_mean", "min": "5"}, "min", "no unit"),
        ({"metric": "usable_stroke", "min": "5 deg"}, "min", "a length is needed"),
        ({"metric": "force_mean", "min": "6 N", "max": "5 N"}, "max", "'max' (5 N) is below 'min' (6 N)"),
        ({"metric": "force_mean", "min": "6 N", "over": ["1 deg", "2 deg"]}, "over", "is a length, not an angle"),
        ({"metric": "force_mean", "min": "6 N", "over": ["0 mm", "2 deg"]}, "over", "one end is a length"),
        (
            {"metric": "spring_elongation", "max": "6 mm", "over": ["1 mm", "2 mm"]},
            "over",
            "not measured over a window",
        ),
    ],
)
def test_a_requirement_that_cannot_be_meant_is_refused_where_it_stands(entry, place, words):
    ((path, message),) = problems(**entry)
    assert path == f"requirements.0.{place}"
    assert words in message


@pytest.mark.parametrize(
    "entry",
    [
        {"metric": "force_ripple[load]", "max": "5 %", "over": ["2 mm", "0.2 m"]},
        {"metric": "force_ripple", "max": 0.05},
        {"metric": "usable_stroke[unload]", "min": "20 cm"},
        {"metric": "hysteresis_area", "max": "0.3 J"},
        {"metric": "spring_elongation", "max": "140 mm"},
        {"metric": "force_mean", "min": "5 N", "max": "5 N"},
    ],
)
def test_a_sensible_requirement_passes(entry):
    assert problems(**entry) == []


def test_torque_curves_have_their_own_names_and_angles():
    assert problems("torque", metric="torque_mean", min="5 N*mm", over=["1 deg", "2 deg"]) == []
    assert "did you mean 'torque_mean'" in problems("torque", metric="force_mean", min="5 N")[0][1]
    assert "an angle is needed" in problems("torque", metric="usable_stroke", min="5 mm")[0][1]


def test_before_the_kind_of_curve_is_known_either_kind_of_metric_may_be_meant():
    assert problems(None, metric="torque_mean", min="5 N*mm") == problems(None, metric="force_mean", min="5 N") == []
    assert problems(None, metric="range_95", min="5 deg") == problems(None, metric="range_95", min="5 mm") == []
    assert problems(None, metric="range_95", min="5 N")


def test_validation_reports_every_fault_of_every_requirement_at_once():
    wrong = (
        require(metric="force_ripple", max="5 N"),
        require(metric="xyz", max=1),
        require(metric="half_band", max=1),
    )
    faults = requirement_problems(wrong, definitions("force"))
    assert [problem.path for problem in faults] == ["requirements.0.max", "requirements.1.metric"]


def test_the_same_faults_stop_a_check_of_a_result():
    with pytest.raises(SpecError, match="did you mean 'force_sd'"):
        outcome(metric="force_sdd", max="1 N")


def test_a_bound_holds_for_the_worst_branch_whichever_side_it_is_on():
    assert outcome(metric="force_max", max="50.9 N").value == 51
    assert outcome(metric="force_mean", min="49.6 N").value == pytest.approx(49.5)
    assert not outcome(metric="force_mean", min="49.6 N").ok
    assert outcome(metric="force_mean", max="50 N").value == pytest.approx(50.5)
    assert outcome(metric="force_mean[load]", min="50 N").ok


def test_with_two_bounds_the_branch_closest_to_one_of_them_is_reported():
    assert outcome(metric="force_mean", min="49.4 N", max="51 N").value == pytest.approx(49.5)
    assert outcome(metric="force_mean", min="40 N", max="50.6 N").value == pytest.approx(50.5)


def test_a_value_on_its_bound_is_within_it():
    assert outcome(metric="usable_stroke", min="200 mm").ok
    assert outcome(metric="force_max", max="51 N").ok
    assert not outcome(metric="force_max", max="50.9999999 N").ok
    assert 0.3 - 0.1 < 0.2
    assert outcome(result(values={"gap": Quantity(0.3 - 0.1, "length", "d")}), metric="gap", min="200 mm").ok


SENTENCES = {
    "force ripple 1.603 % over 20 ... 180 mm, allowed <= 5 %: ok": (
        {"metric": "force_ripple", "max": "5 %", "over": ["20 mm", "180 mm"]}, {}),
    "force mean on unload 49.5 N over the full travel, required 50 N ... 52 N: missed": (
        {"metric": "force_mean[unload]", "min": "50 N", "max": "52 N"}, {}),
    # a miss too small for four digits is shown with more
    "gap 50.0004 mm, allowed <= 50 mm: missed": (
        {"metric": "gap", "max": "50 mm"}, {"gap": Quantity(0.0500004, "length", "d")}),
    # a ratio is shown as its bound is written
    "factor 1.5, required >= 0.8: ok": ({"metric": "factor", "min": 0.8}, {"factor": Quantity(1.5, "ratio", "d")}),
    "factor 150 %, required >= 120 %: ok": (
        {"metric": "factor", "min": "120 %"}, {"factor": Quantity(1.5, "ratio", "d")}),
    "gap: no value (the roller fits), allowed <= 1 mm: missed": (
        {"metric": "gap", "max": "1 mm"}, {"gap": Quantity(None, "length", "d", "the roller fits")}),
}  # fmt: skip


@pytest.mark.parametrize("sentence", SENTENCES)
def test_the_sentence_of_a_requirement(sentence):
    entry, values = SENTENCES[sentence]
    assert outcome(result(values=values), **entry).sentence == sentence


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"metric": "force_mean", "min": "1 N", "over": ["0 mm", "300 mm"]}, "branch 'load' covers only 0 ... 200 mm"),
        ({"metric": "deviation_from_target", "max": "5 %"}, "there is no target"),
        ({"metric": "force_mean[up]", "min": "1 N"}, "there is no branch 'up'; there are 'load', 'unload'"),
    ],
)
def test_a_metric_without_a_value_misses_its_requirement_and_says_why(entry, words):
    found = outcome(**entry)
    assert not found.ok
    assert found.value is None
    assert words in found.sentence
    assert found.sentence.endswith(": missed")


def test_without_a_curve_every_requirement_is_missed_for_the_reason_of_the_run():
    failed = Result(spec=None, status=Status.NO_EQUILIBRIUM, message="jammed")  # type: ignore[arg-type]
    assert "no value (jammed)" in outcome(failed, metric="force_mean", min="1 N").sentence


def test_an_outcome_for_a_file_is_in_border_units():
    record = outcome(metric="usable_stroke", min="10 cm", over=["20 mm", "180 mm"]).as_json()
    assert record["value"] == pytest.approx(200)
    assert (record["min"], record["max"], record["unit"]) == (pytest.approx(100), None, "mm")
    assert (record["over"], record["over_unit"], record["ok"]) == ([20.0, 180.0], "mm", True)
    ripple = outcome(metric="force_ripple", max="5 %").as_json()
    assert (ripple["max"], ripple["unit"], ripple["over"], ripple["over_unit"]) == (0.05, "1", None, None)


def test_windows_of_a_torque_curve_are_reported_in_degrees():
    turn = outcome(result("torque"), metric="torque_mean", min="1 N*mm", over=["1 deg", "5 deg"])
    assert turn.as_json()["over"] == [pytest.approx(1), pytest.approx(5)]
    assert "over 1 ... 5 deg" in turn.sentence
