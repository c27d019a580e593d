"""A cam model beside recordings that the model itself made, with known values and stated noise."""

from __future__ import annotations

import numpy as np
import pytest
from cam_support import analyze, cam, fixed
from experiment_support import triangle

import cfmkit
from cfmkit import api
from cfmkit.errors import DataError, SolutionError, UsageError
from cfmkit.experiment.calibration import calibrate
from cfmkit.experiment.comparison import compare
from cfmkit.experiment.curves_and_metrics_of_recording import measure_recording
from cfmkit.experiment.parameters_to_fit import parameters, read_bounds
from cfmkit.experiment.reading import Recording
from cfmkit.metrics import Window

FRICTION, REST = "mechanism.rolling_friction", "mechanism.rest_half_width"
STIFFNESS, CONSTANT = "mechanism.springs.stiffness", "mechanism.profile.force_constant"


def built(friction=0.002, **changes):
    """The published cam as a finished part, measured from 5 to 230 mm."""
    return api.resolve(fixed(cam(analysis__window=("5 mm", "230 mm")), rolling_friction=friction, **changes))


def recording(spec, noise=0.0, seed=0, shift=0.0, drift=0.0, moved=0.0):
    """The model's own loop with normal noise of that standard deviation [N], a constant force and a growing one added.

    `moved` is what the displacement shows at the mechanism's zero [m].
    """
    curve = analyze(spec).curve
    good = np.isfinite(curve.force)
    spread = np.random.default_rng(seed).normal(0.0, noise, int(good.sum())) if noise else 0.0
    force = curve.force[good] + spread + shift + drift * np.linspace(0.0, 1.0, int(good.sum()))
    return measure_recording(Recording("made.csv", curve.motion[good] + moved, force), None)


def test_a_model_has_no_error_beside_its_own_curve():
    spec = built()
    metrics = compare(analyze(spec), recording(spec)).metrics()
    assert all(abs(item.value) < 1e-9 for item in metrics.values())
    assert {"data_rmse", "data_rmse[load]", "data_offset[unload]", "data_error_max[load]"} <= set(metrics)


def test_a_constant_difference_is_the_offset_and_the_root_mean_square():
    spec = built()
    metrics = compare(analyze(spec), recording(spec, shift=0.3)).metrics()
    for branch in ("load", "unload"):
        assert metrics[f"data_offset[{branch}]"].value == pytest.approx(-0.3, abs=1e-9)
        assert metrics[f"data_rmse[{branch}]"].value == pytest.approx(0.3, abs=1e-9)
        assert metrics[f"data_error_max[{branch}]"].value == pytest.approx(-0.3, abs=1e-9)


def test_model_and_measurement_are_compared_where_both_exist():
    spec = built(analysis__travel="100 mm")
    found = compare(analyze(spec), recording(built()), Window(0.02, 0.2))
    assert (found.window.lo, found.window.hi) == pytest.approx((0.02, 0.1))


def test_a_measurement_elsewhere_or_of_another_kind_is_refused():
    spec = built()
    motion = triangle(1) / 1e3
    far = measure_recording(Recording("far.csv", 1.0 + motion, 50 + motion), None)
    with pytest.raises(DataError, match="no travel in common; is the zero of the displacement the same"):
        compare(analyze(spec), far)
    turned = measure_recording(Recording("turned.csv", motion, 50 + motion, kind="torque"), None)
    with pytest.raises(DataError, match="holds a torque curve, but the mechanism has a force curve"):
        compare(analyze(spec), turned)


def test_points_that_are_averaged_are_neighbours_of_one_cycle():
    """The end of a cycle and the start of the next averaged would be a place never passed with that force."""
    motion = triangle(3, 1503, 240.0) / 1e3
    hollow = 50.0 + 0.2e3 * np.abs(motion - 0.1175)
    found = compare(analyze(built()), measure_recording(Recording("hollow.csv", motion, hollow), None))
    for item in found.samples:
        assert len(item.motion) < 2000
        assert item.effort == pytest.approx(50.0 + 0.2e3 * np.abs(item.motion - 0.1175), abs=0.03)


@pytest.mark.parametrize("seed", range(3))
def test_friction_and_rest_length_are_found_within_their_intervals(seed):
    source = recording(built(0.00225, rest_half_width="68.25 mm"), 0.1, seed)
    start = built(0.002)
    found = calibrate(start, source, parameters(start, [FRICTION, REST]))
    half = found.fit.half_widths()
    assert found.warnings == ()
    assert (np.abs(found.fit.values - [0.00225, 0.06825]) < 1.6 * half).all()
    assert found.fit.noise == pytest.approx(0.1, rel=0.1)
    assert found.after.metrics()["data_rmse"].value < 0.3 * found.before.metrics()["data_rmse"].value


def test_a_fit_from_no_friction_finds_it():
    source, start = recording(built(0.003)), built(0.0)
    found = calibrate(start, source, parameters(start, [FRICTION]))
    assert found.fit.values == pytest.approx([0.003], rel=1e-6)


def test_outliers_hardly_move_the_robust_fit():
    source, start = recording(built(0.00225), 0.02), built(0.002)
    effort = np.array(source.recording.effort)
    effort[50::40] += 5.0
    spoilt = measure_recording(Recording("spoilt.csv", source.recording.motion, effort), None)
    errors = {
        loss: abs(calibrate(start, spoilt, parameters(start, [STIFFNESS]), loss).fit.values[0] - 682.5)
        for loss in ("linear", "soft_l1")
    }
    assert errors["soft_l1"] < 0.2 * errors["linear"]


def test_the_built_cam_keeps_its_shape_while_the_rest_length_is_fitted():
    """Else the fit would cut a new cam for every trial, whose force does not depend on the rest length at all."""
    start = api.resolve(cam(analysis__window=("5 mm", "230 mm")))
    source = recording(built(rest_half_width="68.25 mm", friction=0.0))
    found = calibrate(start, source, parameters(start, [REST]))
    assert found.fit.values == pytest.approx([0.06825], rel=1e-7)
    assert found.spec.get_value("mechanism.profile.rest_half_width") == 0.068


def test_stiffness_and_force_constant_cannot_be_told_apart_without_friction_and_are_named():
    start = built(0.0)
    with pytest.raises(SolutionError) as caught:
        calibrate(start, recording(built(0.0)), parameters(start, [STIFFNESS, FRICTION, CONSTANT]))
    assert str(caught.value) == (
        f"the measured curve cannot distinguish {STIFFNESS} and {CONSTANT}: one compensates for the other; "
        "fit only one of them"
    )


def test_with_friction_they_are_told_apart_only_by_it_and_the_fit_says_so():
    start = built()
    found = calibrate(start, recording(built(), 0.1), parameters(start, [STIFFNESS, CONSTANT]))
    assert abs(found.fit.correlation[0, 1]) > 0.999
    assert {item.name for item in found.warnings} == {"weakly_identified"}


def test_a_value_without_effect_is_named():
    start = built()
    with pytest.raises(SolutionError, match=r"does not determine mechanism\.plate\.top_margin"):
        calibrate(start, recording(start), parameters(start, [FRICTION, "mechanism.plate.top_margin"]))


def test_a_fitted_value_on_its_bound_is_reported():
    start, source = built(0.002), recording(built(0.004))
    found = calibrate(start, source, parameters(start, [FRICTION], {FRICTION: (0.001, 0.003)}))
    assert found.fit.values == pytest.approx([0.003], rel=1e-6)
    assert [item.name for item in found.warnings] == ["at_bound"]


@pytest.mark.parametrize(
    ("paths", "complaint"),
    [
        (["mechanism.rolling_frictio"], "did you mean 'mechanism.rolling_friction'"),
        (["mechanism.springs"], "is a block"),
        (["mechanism.springs.count"], "is not a number that varies continuously"),
        (["mechanism.springs.max_elongation"], "has no value to start from; give one with --set"),
        (["requirements.0.max"], "nothing to vary"),
        ([""], "--fit is empty"),
        ([FRICTION, FRICTION], "twice"),
    ],
)
def test_what_cannot_be_fitted_is_a_usage_error(paths, complaint):
    with pytest.raises(UsageError, match=complaint):
        parameters(built(), paths)


def test_the_bounds_of_the_specification_hold_besides_those_of_the_user():
    (found,) = parameters(built(), [FRICTION], {FRICTION: (-1.0, 0.5)})
    assert (found.low, found.high) == (0.0, 0.5)
    (found,) = parameters(built(), [REST])
    assert 0 < found.low < 1e-9
    assert found.high == np.inf


@pytest.mark.parametrize(
    "text", ["a", "mechanism.rolling_friction=1", "mechanism.rest_half_width=1:2", f"{FRICTION}=2:1"]
)
def test_malformed_bounds_are_usage_errors(text):
    with pytest.raises(UsageError, match="--bounds"):
        read_bounds([text], built())


def test_bounds_are_read_with_their_units():
    assert read_bounds([f"{REST}=60 mm:7 cm"], built()) == {REST: (0.06, 0.07)}


def test_bounds_of_the_recordings_zeros_are_read_with_their_units():
    assert read_bounds(["data.drift=-1 N:2 N"], built()) == {"data.drift": (-1.0, 2.0)}
    with pytest.raises(UsageError, match=r"data\.drift=1 mm:2 mm"):
        read_bounds(["data.drift=1 mm:2 mm"], built())


@pytest.mark.parametrize("noise", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("paths", [[REST], [REST, FRICTION]])
def test_a_tare_that_is_not_fitted_spoils_the_rest_length_and_the_fit_says_so(paths, noise):
    """0.4 N on the sensor give a rest half width of 68.01 mm instead of 68.25 mm."""
    source, start = recording(built(0.00225, rest_half_width="68.25 mm"), noise, shift=0.4), built(0.00225)
    found = calibrate(start, source, parameters(start, paths))
    assert found.fit.values[0] == pytest.approx(0.06801, abs=0.00004)
    (finding,) = found.warnings
    assert finding.name == "lack_of_fit"
    assert finding.message.endswith("too: data.force_offset, data.displacement_offset, data.drift")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("name", "made"),
    [("force_offset", {"shift": 0.4}), ("drift", {"drift": 0.5}), ("displacement_offset", {"moved": 1e-3})],
)
def test_zeros_of_the_recording_are_fitted_beside_the_mechanism(name, made, seed):
    source, start = recording(built(0.00225, rest_half_width="68.25 mm"), 0.05, seed, **made), built(0.002)
    chosen = parameters(start, [REST, FRICTION, f"data.{name}"], None, source.recording)
    found = calibrate(start, source, chosen)
    truth = [0.06825, 0.00225, *made.values()]
    assert (np.abs(found.fit.values - truth) < 1.6 * found.fit.half_widths()).all()
    assert "lack_of_fit" not in {item.name for item in found.warnings}
    assert found.after.metrics()["data_rmse"].value == pytest.approx(0.05, rel=0.1)
    assert [item.get_value("mechanism.rolling_friction") for item in (found.spec,)] == [found.fit.values[1]]


def test_vibration_that_the_sampling_resolves_is_no_lack_of_fit():
    """Ten samples a period: successive residuals are alike, but not over the travel."""
    truth = built(0.00225, rest_half_width="68.25 mm")
    source = recording(truth, 0.02)
    shaken = source.recording.effort + 0.2 * np.sin(np.arange(len(source.recording)) * 2 * np.pi / 10.3)
    source = measure_recording(Recording("shaken.csv", source.recording.motion, shaken), None)
    found = calibrate(built(), source, parameters(built(), [REST, FRICTION]))
    assert found.warnings == ()


@pytest.mark.parametrize(
    ("path", "kind", "complaint"),
    [
        (
            "data.tare",
            "force",
            "there is no 'data.tare'; a recording has data.force_offset, data.displacement",
        ),
        ("data.force_offset", "torque", "a recording has data.torque_offset, data.angle_offset, data.drift"),
    ],
)
def test_what_a_recording_does_not_have_is_a_usage_error(path, kind, complaint):
    motion = triangle(1) / 1e3
    with pytest.raises(UsageError, match=complaint):
        parameters(built(), [path], None, Recording("made.csv", motion, 50 + motion, kind=kind))


def test_python_calibrates_from_a_recording_with_bounds_as_text_or_numbers():
    case = recording(built(0.00225), 0.05).recording
    one, other = (
        cfmkit.calibrate(built(0.002), case, [FRICTION], bounds={FRICTION: ends})
        for ends in ("0.001:0.003", (0.001, 0.003))
    )
    assert one.fit.values == pytest.approx([0.00225], abs=2e-5)
    assert one.fit.values == other.fit.values
    assert one.spec.get_value(FRICTION) == one.fit.values[0]
    with pytest.raises(UsageError, match="there is no 'least'; there are linear, soft_l1, huber, cauchy"):
        cfmkit.calibrate(built(), case, FRICTION, loss="least")


def lossy(spec, gap=1.0, thin=1):
    """The loop of a cam without friction, with a constant loss added; of the way back only every `thin`-th point."""
    curve = analyze(spec).curve
    load = curve.select_branch("load")
    motion = np.concatenate([load.motion, load.motion[::-1][::thin]])
    way = np.repeat([1.0, -1.0], [len(load.motion), len(load.motion[::thin])])
    effort = np.interp(motion, load.motion, load.effort) + 0.5 * gap * way
    good = np.isfinite(effort)
    return measure_recording(Recording("lossy.csv", motion[good], effort[good]), None)


@pytest.mark.parametrize("thin", [1, 7])
@pytest.mark.parametrize("loss", ["soft_l1", "linear", "cauchy"])
def test_a_model_without_losses_is_fitted_to_the_mean_of_the_branches(thin, loss):
    """A way back with few points had hardly counted, and a robust loss took one branch for outliers."""
    truth, start = built(0.0), built(0.0)
    source = lossy(truth, 3.0, thin)
    found = calibrate(start.replace({STIFFNESS: 700.0}), source, parameters(start, [STIFFNESS]), loss)
    assert found.fit.values[0] == pytest.approx(truth.get_value(STIFFNESS), rel=1e-4)
    width = found.after.window.hi - found.after.window.lo
    values = found.after.loss()
    assert values["data_loss"].value == pytest.approx(3.0 * width, rel=1e-3)
    assert values["data_half_gap"].value == pytest.approx(1.5, rel=1e-3)
    assert [item.branch for item in found.after.samples] == ["mean"]
    assert {item.branch for item in found.after.branches} == {"load", "unload"}
    assert found.after.metrics()["data_rmse"].value < 5e-3


def test_a_model_whose_friction_is_fitted_is_fitted_to_both_branches_though_it_starts_from_none():
    found = calibrate(built(0.0), recording(built(0.003)), parameters(built(0.0), [FRICTION]))
    assert found.after.branches == ()
    assert found.fit.values == pytest.approx([0.003], rel=1e-6)


def test_a_fit_counts_the_way_and_not_the_samples():
    """A rig that dwells over one part of the travel: a model that is wrong there by 1 N over a third of the way."""
    spec = built(0.0)
    load = analyze(spec).curve.select_branch("load")
    places = np.concatenate([np.linspace(0.006, 0.08, 4000)[:-1], np.linspace(0.08, 0.229, 200)])
    effort = np.interp(places, load.motion, load.effort) + np.where(places < 0.08, 1.0, 0.0)
    dense = measure_recording(Recording("dense.csv", places, effort), None)
    even = np.linspace(0.006, 0.229, 2000)
    plain = np.interp(even, load.motion, load.effort) + np.where(even < 0.08, 1.0, 0.0)
    uniform = measure_recording(Recording("even.csv", even, plain), None)
    one, other = (calibrate(spec, item, parameters(spec, [STIFFNESS]), "linear").fit for item in (dense, uniform))
    assert one.values[0] == pytest.approx(other.values[0], rel=2e-4)
    errors = [compare(analyze(spec), item).metrics() for item in (dense, uniform)]
    for name in ("data_rmse", "data_offset"):
        assert errors[0][name].value == pytest.approx(errors[1][name].value, rel=2e-2)


def test_an_interval_stays_within_the_bounds_and_what_is_unknown_is_said_so():
    from cfmkit.experiment.calibration import table
    from cfmkit.experiment.measurement_and_calibration_outputs import calibration_lines

    start, source = built(0.0002), recording(built(0.0002), 2.0)
    few = measure_recording(Recording("few.csv", source.recording.motion[::40], source.recording.effort[::40]), None)
    found = calibrate(start, few, parameters(start, [FRICTION]))
    (record,) = table(found)
    assert record["low_95"] >= 0.0
    assert found.fit.half_widths()[0] > 0.0002
    said = dict(calibration_lines(found, few.recording))["fitted"]
    assert said == f"{FRICTION} cannot be determined from this recording"
    assert any("cannot be determined from this recording" in item.message for item in found.warnings)
    assert not any("%" in item.message for item in found.warnings if item.name == "weakly_identified")


def test_errors_over_a_hole_have_no_value_and_the_fit_uses_what_there_is():
    spec = built(0.00225)
    whole = recording(spec).recording
    keep = (whole.motion < 0.08 + 1e-9) | (whole.motion > 0.14 - 1e-9)
    source = measure_recording(Recording("hole.csv", whole.motion[keep], whole.effort[keep]), None)
    found = calibrate(built(0.002), source, parameters(built(), [FRICTION]))
    assert found.fit.values[0] == pytest.approx(0.00225, rel=1e-4)
    assert all(item.value is None for item in found.after.metrics().values())
    assert all("not recorded: 80" in item.reason for item in found.after.metrics().values())
    assert all(item.value is None for item in found.after.loss().values())
