"""Efforts that are zero up to rounding: what is relative to them has no value; `static_balance` judges balancers."""

from pathlib import Path

import numpy as np
import pytest
from metrics_support import curve

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import ExitCode
from cfmkit.metrics import MeasuringFrame, Window, known_metrics, measure, requirement_problems
from cfmkit.results import Result, Status

RELATIVE = (
    *("ripple", "half_band", "deviation_from_mean", "range_95", "range_95_fraction"),
    *("band_range_05pct", "band_range_1pct", "band_range_5pct", "usable_stroke", "usable_start"),
)

BALANCER = """\
cfmkit: 1
family: beam
name: balancer
mechanism:
  material: {{youngs_modulus: 200 GPa}}
  thickness: 8 mm
  width: 8 mm
  nodes:
    pivot: {{at: [0 mm, 0 mm], support: pinned}}
    tip: {{at: [100 mm, 0 mm]}}
  beams:
    lever: {{start: pivot, end: tip}}
  springs:
    zfl: {{kind: line, start: tip, ground: [0 mm, 80 mm], stiffness: {rate} N/mm, free_length: 0 mm}}
  loads:
    - {{kind: point, node: tip, fy: -40 N}}
  drive: {{kind: rotation, node: pivot}}
analysis: {{travel: 80 deg, points: 17}}
"""

TRUSS = """\
cfmkit: 1
family: beam
name: truss
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 3 mm
  width: 10 mm
  axial: true
  nodes:
    wall: {at: [-100 mm, 0 mm], support: pinned}
    top: {at: [0 mm, 10 mm], support: guided, direction: 90 deg}
  beams:
    half: {start: wall, end: top, end_joint: pin}
  drive: {kind: displacement, node: top, direction: -90 deg}
  copies: {mirror: [0 mm, 0 mm]}
analysis: {travel: 20 mm, points: 21}
requirements:
  - {metric: range_95_fraction, min: 70 %}
"""


def noise(kind="force"):
    return curve((np.linspace(0, 1, 11), 1e-13 * np.cos(7 * np.linspace(0, 1, 11))), kind=kind)


def test_nothing_is_relative_to_what_is_below_the_error_of_the_curve():
    found = measure(noise(), MeasuringFrame(effort_error=1e-12), Window(0.0, 1.0))
    for name in RELATIVE:
        name = "force_ripple" if name == "ripple" else name
        assert found[name].value is None, name
        assert "zero" in found[name].reason or "usable" in found[name].reason, name
    assert found["force_mean"].value == 0.0
    assert measure(noise(), MeasuringFrame(effort_error=1e-16), Window(0.0, 1.0))["half_band"].value is not None


def test_a_target_below_the_error_is_none():
    found = measure(noise(), MeasuringFrame(target=1e-13, effort_error=1e-12))
    assert "the target is zero" in found["deviation_from_target"].reason


@pytest.mark.parametrize(("rate", "balance"), [(0.5, 0.0), (0.45, 1 / 9), (0.6, 1 / 6)])
def test_static_balance_of_a_spring_balancer(tmp_path, rate, balance):
    """T = (k a - P) L cos t, of the spring k a L cos t: their ratio is 1 - P/(k a)."""
    (tmp_path / "b.yaml").write_text(BALANCER.format(rate=rate), encoding="utf-8")
    found = cfmkit.analyze(cfmkit.load(tmp_path / "b.yaml")).metrics
    assert found["static_balance"].value == pytest.approx(balance, rel=1e-6, abs=1e-9)
    assert (found["torque_ripple"].value is None) == (rate == 0.5)
    if rate == 0.5:
        assert "static_balance" in found["torque_ripple"].reason
        assert found["usable_stroke"].value is None


def test_a_bifurcation_on_the_way_makes_no_balancer():
    """Just there a path has two directions, and the effort of a member came out a hundred times as large."""
    spec = cfmkit.load(Path(__file__).parents[2] / "configs" / "beam_v_bifurcation.yaml")
    found = cfmkit.analyze(spec.replace({"analysis.points": 81}))
    assert found.metrics["static_balance"].value > 1.0


def test_a_truss_that_ends_without_force_misses_its_range(tmp_path, monkeypatch, capsys):
    """It was 100 %, ok, exit 0."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.yaml").write_text(TRUSS, encoding="utf-8")
    assert run_command(["analyze", "t.yaml", "--no-plots"]) == ExitCode.REQUIREMENT_MISSED
    assert "the force at the end is zero within" in " ".join(capsys.readouterr().out.split())
    found = cfmkit.analyze(cfmkit.load("t.yaml"))
    assert found.metrics["half_band"].value is None
    assert found.metrics["range_fraction"].value is None
    assert found.metrics["static_balance"].value == pytest.approx(2.0, rel=1e-6)  # two halves alike


@pytest.mark.parametrize(
    ("config", "path", "values"),
    [
        ("cam", "mechanism.springs.count", (1, 2, 4)),
        ("slider_crank_li2019", "mechanism.springs.pivot", ("0.2 N*m/rad", "0.5 N*m/rad")),
    ],
)
def test_the_balance_of_many_designs_is_that_of_each(config, path, values):
    spec = cfmkit.load(f"configs/{config}.yaml")
    single = [cfmkit.analyze(spec.replace({path: value})).metrics["static_balance"].value for value in values]
    many = cfmkit.sweep(spec, vary={path: list(values)}, metrics=["static_balance"]).table["static_balance"]
    np.testing.assert_allclose(many, single, rtol=1e-6)


def test_a_curve_without_parts_has_no_balance():
    spec = cfmkit.load("configs/cam.yaml")
    assert "static_balance" not in measure(noise(), MeasuringFrame())
    assert Result(spec, Status.COMPLETE).effort_error is None


@pytest.mark.parametrize(
    ("requirement", "said"),
    [
        ({"metric": "force_ripple", "max": "5"}, "5 is 500 %; did you mean 5 %?"),
        ({"metric": "range_95_fraction", "min": "70"}, "did you mean 70 %?"),
        ({"metric": "half_band", "max": "1.5"}, "did you mean 1.5 %?"),
    ],
)
def test_a_share_above_1_is_no_bound(requirement, said):
    spec = cfmkit.load("configs/beam_lan2010.yaml").replace({"requirements": [requirement]})
    (fault,) = requirement_problems(spec.requirements, known_metrics("force"))
    assert said in fault.message


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("analysis.band=5", "did you mean 5 %?"),
        ("requirements.0.max=5", "did you mean 5 %?"),
        ("sensitivity={min_yield: 90, parameters: {mechanism.thickness: {normal: 1 %}}}", "did you mean 90 %?"),
    ],
)
def test_a_share_above_1_is_refused_everywhere(change, said, capsys):
    assert run_command(["check", "configs/beam_lan2010.yaml", "--set", change]) == ExitCode.INVALID
    captured = capsys.readouterr()
    assert said in captured.out + captured.err


def test_a_per_cent_sign_means_what_it_says(capsys):
    change = "requirements=[{metric: force_ripple, max: 150 %}, {metric: safety_factor, min: 2}]"
    assert run_command(["check", "configs/beam_lan2010.yaml", "--set", change]) == ExitCode.OK
