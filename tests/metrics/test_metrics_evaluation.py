"""Windows, branches, kinds of curves, and what evaluation gives back."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from metrics_support import BARE, LOOP, SAW, curve, reason, value

from cfmkit.curves import Curve
from cfmkit.errors import UsageError
from cfmkit.metrics import MeasuringFrame, Window, as_json, evaluate, measure, restrict, traces
from cfmkit.results import Quantity, Result, Status


def usable(of, frame=BARE):
    return tuple(value(f"usable_{end}", of, frame) for end in ("start", "end", "stroke"))


# -- windows -----------------------------------------------------------------------------------------------------


def part(motion, effort, lo, hi):
    return SimpleNamespace(
        **dict(
            zip(
                ("motion", "effort"),
                restrict(np.array(motion, float), np.array(effort, float), Window(lo, hi)),
                strict=True,
            )
        )
    )


def test_a_window_between_samples_gets_interpolated_ends():
    found = part([0, 1, 2, 3], [0, 10, 20, 30], 0.5, 2.25)
    assert found.motion.tolist() == [0.5, 1, 2, 2.25]
    assert found.effort.tolist() == [5, 10, 20, 22.5]


def test_a_window_between_two_neighbours_is_its_two_ends():
    assert part([0, 10], [0, 100], 4, 6).effort.tolist() == [40, 60]


def test_a_descending_branch_keeps_the_order_of_its_path():
    found = part([3, 2, 1, 0], [30, 20, 10, 0], 0.5, 2.25)
    assert found.motion.tolist() == [2.25, 2, 1, 0.5]
    assert found.effort.tolist() == [22.5, 20, 10, 5]


@pytest.mark.parametrize("n", [7, 50, 481, 1000])
@pytest.mark.parametrize("bits", [-4e-16, 0.0, 4e-16])
def test_samples_on_the_ends_count_once_although_their_last_bits_differ(n, bits):
    motion = np.linspace(0, 0.24, n)
    lo, hi = motion[2] * (1 - bits), motion[-3] * (1 + bits)
    assert len(part(motion, motion, lo, hi).motion) == n - 4


def test_a_window_that_is_the_travel_but_for_the_last_bits_is_covered():
    travel = curve((np.linspace(0.1, 0.3, 5), [1, 2, 3, 4, 5]))
    assert value("force_mean", travel, window=(0.1 - 1e-16, 0.3 + 1e-16)) == 3
    assert "covers" in reason("force_mean", travel, window=(0.1 - 1e-8, 0.3))


def test_a_fold_gives_every_run_inside_the_window():
    found = part([0, 4, 1, 5], [0, 4, 1, 5], 2, 3)
    assert found.motion.tolist() == [2, 3, 3, 2, 2, 3]
    assert np.trapezoid(found.effort, found.motion) == pytest.approx(2.5)


def test_straight_and_folded_branches_are_cut_alike():
    motion, effort = [0, 1, 2, 3], [0, 10, 5, 30]
    straight, folded = part(motion, effort, 0.5, 2.25), part([*motion, 2.9], [*effort, 0], 0.5, 2.25)
    assert straight.motion.tolist() == folded.motion.tolist()
    assert straight.effort == pytest.approx(folded.effort)


def test_a_branch_that_does_not_cover_the_window_has_no_value_and_says_what_it_covers():
    short = curve(([0, 0.1, 0.2], [1, 1, 1]), ([0.2, 0.05], [1, 1]))
    found = measure(short, BARE, Window(0.01, 0.2))
    assert found["force_mean[load]"].value == 1
    assert found["force_mean[unload]"].value is None
    assert found["force_mean"].reason == "branch 'unload' covers only 50 ... 200 mm"


def test_a_window_needs_a_width():
    with pytest.raises(ValueError, match="increasing"):
        Window(1.0, 1.0)


def test_points_without_equilibrium_in_the_window_leave_no_statistics_but_their_number():
    broken = curve(([0, 1, 2, 3], [np.nan, 10, 10, 10]))
    assert "1 of 4 points" in reason("force_mean", broken)
    assert value("force_mean", broken, window=(1, 3)) == 10
    assert usable(broken, MeasuringFrame(target=10.0)) == pytest.approx((1, 3, 2))
    assert value("band_range_5pct", broken, MeasuringFrame(reference=2.0)) == 2
    assert value("range_95", broken) == 2


# -- branches, kinds, reports ------------------------------------------------------------------------------------


def test_one_branch_has_plain_names_only():
    assert all("[" not in name for name in measure(SAW, BARE))


@pytest.mark.parametrize(
    ("metric", "worst"),
    [("force_max", 14), ("force_min", 9), ("force_sd", 2), ("force_ripple", 4 / 13), ("range_95", 0.325)],
)
def test_without_a_branch_the_worst_counts(metric, worst):
    assert value(metric, LOOP) == pytest.approx(worst)


def test_the_worst_mean_is_the_farthest_from_the_target_or_else_the_smallest():
    assert value("force_mean", LOOP) == 11
    assert value("force_mean", LOOP, MeasuringFrame(target=11.4)) == 12
    assert value("force_mean", LOOP, MeasuringFrame(target=11.6)) == 11


def test_branches_that_come_back_later_are_gathered():
    split = Curve([0, 1, 1, 0, 0, 2], [1, 1, 5, 5, 3, 3], ["a", "a", "b", "b", "a", "a"], [True] * 6)
    assert {trace.name: trace.effort.tolist() for trace in traces(split)} == {"a": [1, 1, 3, 3], "b": [5, 5]}


def test_a_torque_curve_has_torque_names_and_angle_units():
    found = measure(curve(([0, 1, 2], [10, 12, 14]), ([2, 1, 0], [13, 11, 9]), kind="torque"), BARE)
    assert not any(name.startswith("force_") for name in found)
    assert found["torque_mean"].dimension == "torque"
    assert found["range_95"].dimension == "angle"
    assert found["hysteresis_area"].dimension == "energy"
    assert "torque" in found["torque_mean"].definition
    assert "{" not in "".join(item.definition for item in found.values())


@pytest.mark.parametrize(
    ("metric", "words"),
    [
        ("deviation_from_target", "no target"),
        ("rms_to_target", "no target"),
        ("hysteresis_area", "'load' and 'unload'"),
        ("stress_max", "max_stress"),
        ("safety_factor", "allowable stress"),
    ],
)
def test_what_is_missing_is_said(metric, words):
    assert words in reason(metric, SAW)


def test_a_many_valued_branch_has_statistics_but_no_ranges():
    fold = curve(([0, 2, 1, 3], [5, 6, 4, 5]))
    assert value("force_max", fold) == 6
    assert "many-valued" in reason("range_95", fold)
    assert "many-valued" in reason("band_range_1pct", fold)


def test_a_force_that_is_zero_throughout_has_no_ripple():
    assert "zero" in reason("force_ripple", curve(([0, 1], [0, 0])))


def test_a_curve_of_one_point_or_none_is_no_error():
    assert value("force_mean", curve(([1], [5]))) == 5
    assert "two points" in reason("force_sd", curve(([1], [5])))
    assert reason("force_mean", curve(([], []))) == "the curve has no points"


def test_json_has_border_units_and_a_reason_for_a_missing_value():
    assert as_json(Quantity(1.5e-3, "length", "d")) == {"value": 1.5, "unit": "mm", "definition": "d"}
    assert as_json(Quantity(0.05, "ratio", "d")) == {"value": 0.05, "unit": "1", "definition": "d"}
    missing = as_json(Quantity(None, "force", "d", "why"))
    assert missing == {"value": None, "unit": "N", "definition": "d", "reason": "why"}


def result(of, **kept):
    return Result(spec=None, status=Status.COMPLETE, curves=(of,), **kept)  # type: ignore[arg-type]


def test_evaluate_adds_the_familys_own_values_and_lets_them_win():
    own = {"contact_force_max": Quantity(7.0, "force", "own"), "stress_max": Quantity(3.0, "stress", "own")}
    found = evaluate(result(LOOP, values=own, target=12.0))
    assert found["contact_force_max"].value == 7
    assert found["stress_max"].value == 3
    assert found["deviation_from_target"].value == pytest.approx(3 / 12)


def test_evaluate_computes_only_the_names_asked_for():
    found = evaluate(result(LOOP), ["force_max[unload]", "force_max"], Window(0, 1))
    assert {name: item.value for name, item in found.items()} == {"force_max[unload]": 11, "force_max": 12}


def test_evaluate_names_a_near_miss():
    with pytest.raises(UsageError, match="did you mean 'force_mean'"):
        evaluate(result(LOOP), ["force_meen"])


def test_a_result_without_a_curve_has_the_familys_values_and_the_reason():
    failed = Result(spec=None, status=Status.NO_EQUILIBRIUM, message="jammed")  # type: ignore[arg-type]
    assert evaluate(failed) == {}
    assert evaluate(failed, ["torque_mean"])["torque_mean"].reason == "jammed"


def test_metrics_need_neither_scipy_nor_pydantic_nor_pint():
    script = "import sys, cfmkit.metrics; print([m for m in ('scipy', 'pydantic', 'pint') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True).stdout.strip() == "[]"
