"""Friction of pins and guide in a slider-crank, mirrored pairs and the trim by an anchor: balance and energy."""

from __future__ import annotations

import numpy as np
import pytest
from slider_crank import config

from cfmkit import Run
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.families.slider_crank.springs.sprung_linkage import assemble, turn_unloaded

PINS = {"diameter": "3 mm", "friction": 0.1}
GUIDE = {"friction": 0.1, "drag": "0.01 N"}


def spec(name, **changes):
    return config(name, **{f"mechanism__{key}": value for key, value in changes.items()})


def analyze(one):
    return family("slider-crank").analyze(one, Run())


@pytest.mark.parametrize("name", ["bilancia2019", "li2019"])
@pytest.mark.parametrize("parts", [{"pins": PINS}, {"guide": GUIDE}, {"pins": PINS, "guide": GUIDE}])
def test_both_ways_differ_by_what_pins_and_guide_take(name, parts):
    """The forces follow from the balance of crank and coupler, what is lost from how fast they turn."""
    state = analyze(spec(name, **parts)).state
    forth, back = state.friction_branches
    scale = np.abs(state.effort).max()
    for way, sign in ((forth, 1.0), (back, -1.0)):
        known = np.isfinite(way.effort)
        assert known.sum() >= known.size - 1
        np.testing.assert_allclose(
            (way.effort - state.effort)[known], (sign * sum(way.lost.values()))[known], atol=1e-12 * scale
        )


@pytest.mark.parametrize("branch", ["right", "left"])
def test_the_area_of_the_loop_is_shared_by_pins_and_guide(branch):
    found = analyze(spec("bilancia2019", pins=PINS, guide=GUIDE))
    window = found.spec.analysis.window
    motion, (forth, back) = found.state.motion, found.state.friction_branches
    inside = np.isfinite(forth.effort) & (motion >= 0.001) & (motion <= 0.035)
    area = np.trapezoid((forth.effort - back.effort)[inside], motion[inside])
    assert window is not None
    total = sum(found.values[f"loop_energy_{kind}"].value for kind in ("pins", "guide"))
    assert total == pytest.approx(area, rel=1e-9)


@pytest.mark.parametrize("name", ["bilancia2019", "li2019"])
def test_a_coupler_that_is_pressed_has_a_negative_force_with_friction_as_without(name):
    free, rubbed = analyze(spec(name)), analyze(spec(name, pins=PINS | {"friction": 1e-6}, guide=None))
    points = len(free.curve.motion)
    with_friction = rubbed.curve.extra["coupler_force"].values[:points]
    known = np.isfinite(with_friction)
    alone = free.curve.extra["coupler_force"].values
    np.testing.assert_allclose(with_friction[known], alone[known], atol=1e-4 * np.abs(alone).max())
    assert (alone < 0).any()


def test_the_largest_forces_inside_are_with_friction():
    found = analyze(spec("li2019", pins=PINS, guide=GUIDE))
    coupler, guide = (found.curve.extra[key].values for key in ("coupler_force", "guide_force"))
    assert found.values["coupler_compression_max"].value == pytest.approx(-np.nanmin(coupler), rel=1e-3)
    assert found.values["guide_force_max"].value == pytest.approx(np.nanmax(np.abs(guide)), rel=1e-3)
    plain = analyze(spec("li2019")).values["guide_force_max"].value
    assert abs(found.values["guide_force_max"].value / plain - 1.0) > 1e-3


def test_no_largest_force_is_stated_where_pins_hold_the_mechanism_next_to_its_stretched_position():
    found = analyze(spec("bilancia2019", pins=PINS)).values["coupler_compression_max"]
    assert found.value is None
    assert "unbounded" in found.reason


def test_a_mirrored_pair_has_twice_the_force_and_a_free_guide():
    one, pair = analyze(spec("bilancia2019")), analyze(spec("bilancia2019", copies="mirrored"))
    np.testing.assert_allclose(pair.curve.force, 2.0 * one.curve.force, rtol=1e-12)
    assert one.values["guide_force_max"].value > 0 == pair.values["guide_force_max"].value
    rubs = analyze(spec("bilancia2019", copies="mirrored", guide={"friction": 0.3}))
    np.testing.assert_allclose(rubs.state.friction_branches[0].effort[0], pair.curve.force, rtol=1e-12)


def test_the_outline_of_a_mirrored_pair_holds_every_part_twice():
    from cfmkit.export import polygons
    from cfmkit.families.slider_crank.outline import drawing

    one, pair = (drawing(spec("strip", copies=copies)) for copies in ("single", "mirrored"))
    assert len(pair.contours) == 2 * len(one.contours)
    first, second = polygons(pair.contours)[0], polygons(pair.contours[len(one.contours) :])[0]
    np.testing.assert_allclose(np.sort(first[:, 0]), np.sort(second[:, 0]), atol=1e-12)
    assert np.ptp(np.sort(first[:, 1]) + np.sort(second[:, 1])[::-1]) < 1e-12
    assert second[:, 1].max() < first[:, 1].min()


def test_near_the_stretched_position_thick_pins_hold_the_mechanism():
    found = analyze(spec("bilancia2019", pins={"diameter": "20 mm", "friction": 0.3}))
    assert not found.status.usable or found.status.name == "PARTIAL"
    assert "self_locks" in {item.name for item in found.warnings}
    assert "friction" in found.message


SLIDER, ANCHOR = {"mechanism.springs.slider": "0.05 N/mm"}, "mechanism.springs.anchor"


def test_an_anchor_adds_a_force_that_is_the_same_everywhere():
    given = spec("bilancia2019").replace({"mechanism.springs.slider": "0.05 N/mm", "mechanism.springs.anchor": "0 mm"})
    plain, tight = analyze(given), analyze(given.replace({"mechanism.springs.anchor": "4 mm"}))
    np.testing.assert_allclose(tight.curve.force - plain.curve.force, 0.2, rtol=1e-9)
    assert plain.values["force_per_anchor"].value == pytest.approx(50.0)


@pytest.mark.parametrize("anchor", ["5 mm", "-5 mm"])
@pytest.mark.parametrize("name", ["bilancia2019", "li2019"])
def test_the_travel_of_the_slider_is_counted_without_the_anchor(name, anchor):
    plain, tight = (analyze(spec(name).replace(dict(SLIDER, **more))) for more in ({}, {ANCHOR: anchor}))
    travels = [one.curve.extra["slider_travel"].values for one in (plain, tight)]
    np.testing.assert_allclose(travels[1], travels[0], rtol=0.0, atol=1e-14)
    most = [one.values["slider_travel_max"].value for one in (plain, tight)]
    assert most[1] == pytest.approx(most[0], rel=1e-9)
    assert most[0] == pytest.approx(np.abs(travels[0]).max(), rel=1e-3)


def test_a_torque_with_a_tight_spring_is_the_change_of_its_energy():
    given = spec("li2019").replace({"mechanism.springs.slider": "0.1 N/mm", "mechanism.springs.anchor": "-7 mm"})
    curve, state = analyze(given).curve, analyze(given).state
    slope = np.gradient(state.energy[0], state.motion[0], edge_order=2)
    np.testing.assert_allclose(slope[5:-5], curve.torque[5:-5], atol=2e-5 * np.abs(curve.torque).max())
    stiffness = np.gradient(curve.torque, state.motion[0], edge_order=2)
    np.testing.assert_allclose(stiffness[5:-5], state.stiffness[0, 5:-5], atol=2e-4 * np.abs(state.stiffness).max())


@pytest.mark.parametrize("way", ["load", "unload"])
def test_springs_that_make_up_for_their_own_friction_hold_the_force_better_than_those_that_do_not(way):
    given = config("friction")
    found = family("slider-crank").design.make
    deviations = {}
    for branch in (None, way):
        made = found(given.replace({"design.branch": branch}), Run())
        force = analyze(made.spec).curve.select_branch(way)
        inside = (force.displacement >= 0.003) & (force.displacement <= 0.035)
        deviations[branch] = np.abs(force.force[inside] / 3.0 - 1.0).max()
    assert deviations[way] < 0.8 * deviations[None]


def test_the_spring_of_an_adjustment_is_stiff_enough_for_its_screw():
    given = config("friction")
    made = family("slider-crank").design.make(
        given.replace({"design.adjustment": "0.9 N", "design.anchor_travel": "10 mm"}), Run()
    )
    springs = made.spec.mechanism.springs
    assert 2 * springs.slider * 0.010 >= 0.9 * (1 - 1e-12)
    assert springs.anchor == 0.0


def test_the_unloaded_angle_trims_the_mean_force_by_what_is_stated():
    given = spec("bilancia2019").replace({"analysis.window": ["3 mm", "30 mm"]})
    assembly = assemble(given)
    places = np.linspace(0.003, 0.030, 2001)
    means = []
    for turn in (0.002, -0.002):
        other, less = turn_unloaded(assembly, turn)
        # the same place of the slider is as far from the other position at rest
        at_rest = [one.linkage.slider_position(np.asarray(one.unloaded)) for one in (assembly, other)]
        assert less == pytest.approx(float(at_rest[0] - at_rest[1]) * assembly.linkage.branch, abs=1e-15)
        means.append((other.rates @ other.forces(places - less)).mean())
    slope = (means[0] - means[1]) / 0.004
    found = analyze(given).values["force_per_degree"].value
    assert found == pytest.approx(slope * np.radians(1.0), rel=2e-3)


def test_springs_are_chosen_that_the_unloaded_angle_can_trim_by_what_is_wanted():
    given = config("bought")
    given = given.replace({"design.catalogue": None, "design.tolerance": None, "mechanism.springs": {}})
    plain = family("slider-crank").design.make(given, Run())
    reached = abs(analyze(plain.spec).values["force_per_degree"].value)
    wanted = {"design.adjustment": 1.2 * reached, "design.angle_travel": "1 deg"}
    trimmed = family("slider-crank").design.make(given.replace(wanted), Run())
    assert abs(analyze(trimmed.spec).values["force_per_degree"].value) >= 1.2 * reached * (1 - 1e-6)
    capped = wanted | {"design.max_rates": {name: "10 N*mm/rad" for name in ("pivot", "crank_pin", "slider_pin")}}
    refused = family("slider-crank").design.make(given.replace(capped), Run())
    assert refused.status.exit_code == 4
    assert "when the unloaded angle is turned by 1 deg" in refused.message


@pytest.mark.parametrize(
    ("block", "reported"),
    [
        ({"angle_travel": "1 deg"}, "apply only to an 'adjustment'"),
        ({"adjustment": "1 N"}, "needs either 'anchor_travel' or 'angle_travel'"),
        ({"adjustment": "1 N", "angle_travel": "1 deg", "anchor_travel": "1 mm"}, "needs either"),
        ({"adjustment": "1 N", "anchor_travel": "1 mm"}, "add 'slider' to 'springs'"),
    ],
)
def test_a_trim_that_contradicts_itself_is_refused(block, reported):
    given = config("bought")
    with pytest.raises(SpecError, match=reported):
        given.replace({f"design.{key}": value for key, value in block.items()})


def test_where_the_guide_holds_the_slider_no_torque_moves_it_and_energy_is_kept_elsewhere():
    """The coupler stands so steeply across the way that the guide's friction outgrows what pushes the slider along."""
    springs = {"pivot": 0.05, "slider_pin": 0.15, "slider": 30.0}
    given = spec("friction").replace({
        "mechanism.copies": "single", "mechanism.springs": springs, "mechanism.offset": 0.004, "design": None,
        "mechanism.pins": {"diameter": "2.5 mm", "friction": 0.18}, "mechanism.guide": {"friction": 0.2},
        "requirements": (), "analysis": {"drive": "torque", "points": 201, "angle": ["0.85 rad", "1.3 rad"]},
    })  # fmt: skip
    state = analyze(given).state
    free = state.effort
    for sign, one in zip((1.0, -1.0), state.friction_branches, strict=True):
        moves = np.isfinite(one.effort)
        lost = sum(one.lost.values())[moves]
        np.testing.assert_allclose(sign * (one.effort - free)[moves], lost, atol=1e-9 * np.abs(one.effort[moves]).max())
    assert not np.isfinite(state.friction_branches[0].effort).all()
