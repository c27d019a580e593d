"""Names of metrics: on a torque curve those of forces are accepted; branches that a family cannot have are refused."""

import json

import pytest

import cfmkit
from cfmkit.errors import SpecError, UsageError
from cfmkit.metrics import METRIC_TABLE, check, definitions, known_metrics, metrics_by_name, other_name
from cfmkit.metrics.definition import Definition
from cfmkit.metrics.metric_definitions import refuse_namesakes

TORQUE = cfmkit.load("configs/slider_crank_li2019.yaml")
CAM = cfmkit.load("configs/cam.yaml").replace({"analysis.points": 41})
STIFFNESS = "mechanism.springs.slider"


def with_requirements(*entries):
    return TORQUE.replace({"requirements": entries})


def test_every_force_metric_has_its_torque_metric():
    torque = {item.name for item in definitions("torque")}
    renamed = {other_name(item.name) for item in definitions("force")}
    assert renamed == torque


@pytest.mark.parametrize("name", ["force_mean", "force_ripple", "force_max", "force_min", "force_sd"])
def test_a_force_name_on_a_torque_curve_means_the_torque(name):
    result = cfmkit.analyze(TORQUE)
    other = cfmkit.evaluate(result, [name, other_name(name)])
    assert result.curve.kind == "torque"
    assert other[name] == other[other_name(name)]
    assert other[name].value is not None


def test_two_metrics_of_one_name_are_refused():
    with pytest.raises(UsageError, match="two metrics are called 'force_mean': one of them needs another name"):
        refuse_namesakes((*METRIC_TABLE, Definition("force_mean", "effort", "another mean")))


def test_other_names_are_not_listed_twice():
    assert not [name for name in cfmkit.evaluate(cfmkit.analyze(TORQUE)) if name.startswith("force_")]
    assert "force_mean" not in {item.name for item in definitions("torque")}
    assert {item.name for item in known_metrics("force")} == {item.name for item in definitions("force")}


def test_a_torque_name_on_a_force_curve_is_refused():
    with pytest.raises(UsageError, match="did you mean 'force_ripple'"):
        cfmkit.evaluate(cfmkit.analyze(CAM), ["torque_ripple"])


def test_a_value_of_the_family_goes_before_another_name():
    own = Definition("force_mean", "force", "of its own", scope="value")
    assert metrics_by_name("torque", (own,))["force_mean"] is not own
    assert metrics_by_name("torque", (own,))["force_mean"].definition == own.definition


def test_requirements_take_either_name_with_bounds_of_a_torque():
    spec = with_requirements(
        {"metric": "force_mean", "min": "1 N*mm"},
        {"metric": "torque_mean", "min": "1 N*mm"},
        {"metric": "force_ripple", "max": "500 %", "over": ("1 deg", "10 deg")},
    )
    text = cfmkit.dumps(spec)
    outcomes = check(cfmkit.loads(text).requirements, cfmkit.analyze(spec))
    assert outcomes[0].value == outcomes[1].value
    assert outcomes[2].value is not None
    assert json.loads(json.dumps(outcomes[0].as_json()))["unit"] == "N*mm"


def test_a_bound_of_a_force_on_a_torque_is_refused_once_the_curve_is_known():
    spec = with_requirements({"metric": "force_mean", "min": "1 N"})
    with pytest.raises(SpecError, match="is a force"):
        _ = cfmkit.analyze(spec).requirements
