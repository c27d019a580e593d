"""Windows of the motion: shares of the travel follow it, and what lies outside a curve is reported."""

from __future__ import annotations

import pickle

import pytest

import cfmkit
from cfmkit.errors import InputError, SpecError
from cfmkit.results import WINDOW_OUTSIDE
from cfmkit.specs.units import Place, TravelShare, window_places

# (specification, travel, a metric): one of every family and kind of motion
FAMILIES = {
    "cam": ("cam", ("0 mm", "240 mm"), "force_mean"),
    "cam from the slider": ("cam", None, "force_mean"),
    "cam in motion": ("cam_dynamics", None, "force_mean"),
    "beam": ("beam_end_effector", None, "force_mean"),
    "vcfm": ("vcfm_pla", ("0 mm", "4.7 mm"), "force_mean"),
    "crank": ("slider_crank_li2019", ("-5 deg", "14 deg"), "torque_mean"),
    "slider": ("slider_crank_bilancia2019", ("0 mm", "35 mm"), "force_mean"),
    "strip": ("slider_crank_strip", None, "force_mean"),
}
MORE = {"cam from the slider": {"analysis.origin": "slider"}}
WITHOUT = {"requirements": ()}


def spec_of(name, **changes):
    """Return a shipped specification without requirements, changed."""
    path, _, _ = FAMILIES[name]
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return cfmkit.load(f"configs/{path}.yaml").replace(WITHOUT | MORE.get(name, {}) | changes)


def needed(metric, over):
    """Return a requirement on a metric over a window."""
    return ({"metric": metric, "min": "-1e6 " + ("N*mm" if "torque" in metric else "N"), "over": over},)


def known(metrics):
    """Return the values of those metrics that have one."""
    return {name: one.value for name, one in metrics.items() if one.value is not None}


@pytest.mark.parametrize("name", FAMILIES)
def test_shares_of_the_travel_are_the_same_window_in_every_family(name):
    metric = FAMILIES[name][2]
    whole = cfmkit.analyze(spec_of(name, analysis__window=None))
    start, end = whole.curve.motion[0], max(whole.curve.motion, key=lambda place: abs(place - whole.curve.motion[0]))
    dimension = whole.curve.motion_dimension
    places = tuple(Place(start + share * (end - start), dimension) for share in (0.25, 0.75))
    absolute = cfmkit.analyze(
        spec_of(name, analysis__window=tuple(sorted(places)), requirements=needed(metric, places))
    )
    shares = ("25 %", "75 %")
    relative = cfmkit.analyze(spec_of(name, analysis__window=shares, requirements=needed(metric, shares)))
    ours, theirs = cfmkit.evaluate(relative), cfmkit.evaluate(absolute)
    assert ours[metric].value is not None
    assert known(ours) == pytest.approx(known(theirs), rel=1e-9, abs=1e-12, nan_ok=True)
    (found,), (expected,) = relative.requirements, absolute.requirements
    assert found.value == pytest.approx(expected.value, rel=1e-9)
    assert found.over == pytest.approx(expected.over)
    assert [one.name for one in relative.warnings] == [one.name for one in absolute.warnings]


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("place", ["analysis.window", "requirements.0.over"])
def test_a_window_outside_the_travel_is_told_with_its_place_in_every_family(name, place):
    whole = cfmkit.analyze(spec_of(name, analysis__window=None))
    high, dimension = float(whole.curve.motion.max()), whole.curve.motion_dimension
    outside = (Place(high + 0.01, dimension), Place(high + 0.02, dimension))
    changes = {"analysis.window": outside} if place == "analysis.window" else {"analysis.window": None}
    if place != "analysis.window":
        changes["requirements"] = needed(FAMILIES[name][2], outside)
    result = cfmkit.analyze(spec_of(name).replace(changes))
    (reported,) = [one for one in result.warnings if one.name == WINDOW_OUTSIDE]
    assert reported.message.startswith(f"{place}: the window ")
    assert "is not within the curve" in reported.message


def test_a_window_within_the_travel_needs_no_warning():
    result = cfmkit.analyze(cfmkit.load("configs/cam.yaml"))
    assert WINDOW_OUTSIDE not in {one.name for one in result.warnings}


def test_shares_are_of_the_travel_requested_where_a_curve_ends_early():
    shares = ("50 %", "100 %")
    changes = {"analysis.travel": "300 mm", "analysis.window": shares, "requirements": needed("force_mean", shares)}
    result = cfmkit.analyze(spec_of("cam").replace(changes))
    assert result.status.key == "partial"
    (reported,) = [one for one in result.warnings if one.name == WINDOW_OUTSIDE]
    assert "analysis.window and requirements.0.over: the window 150 ... 300 mm" in reported.message
    assert (
        "ends before the requested travel does (0 ... 300 mm): metrics are taken over 150 ... 240 mm"
        in reported.message
    )
    (outcome,) = result.requirements
    assert not outcome.ok


@pytest.mark.parametrize(
    ("name", "window"), [("cam", ("2 deg", "5 deg")), ("crank", ("1 mm", "2 mm")), ("vcfm", ("1 deg", "2 deg"))]
)
@pytest.mark.parametrize("place", ["analysis.window", "requirements.0.over"])
def test_a_window_in_the_wrong_dimension_is_refused(name, window, place):
    changes = {place: window}
    if place != "analysis.window":
        changes = {"requirements": needed(FAMILIES[name][2], window)}
    with pytest.raises(SpecError, match=rf"{place}: the curve runs over an? (length|angle)"):
        spec_of(name).replace(changes)


@pytest.mark.parametrize("window", [("1 %", "101 %"), ("-1 %", "50 %"), ("60 %", "50 %")])
def test_shares_are_of_the_travel_and_increase(window):
    with pytest.raises(SpecError, match=r"0 % to 100 %|must be increasing"):
        spec_of("cam", analysis__window=window)


def test_a_share_is_written_as_it_was_given_and_read_back():
    spec = spec_of("cam", analysis__window=("2 mm", "100 %"), requirements=needed("force_mean", ("1 %", "50 %")))
    text = cfmkit.dumps(spec)
    assert "[2 mm, 100 %]" in text
    assert cfmkit.loads(text) == spec
    assert pickle.loads(pickle.dumps(spec)) == spec


def test_a_share_is_never_a_place_of_the_same_number():
    assert TravelShare(0.1) != Place(0.1)
    assert Place(0.1) != TravelShare(0.1)
    assert TravelShare(0.1) != 0.1
    assert len({TravelShare(0.1): 1, Place(0.1): 2}) == 2


def test_the_travel_may_go_down_and_a_window_without_width_is_refused():
    assert window_places((TravelShare(0.1), TravelShare(1.0)), (0.0, -0.02)) == (-0.02, -0.002)
    with pytest.raises(InputError, match="150 mm and 100 % has no width"):
        window_places((Place(0.15), TravelShare(1.0)), (0.0, 0.15))
