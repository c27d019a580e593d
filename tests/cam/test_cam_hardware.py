"""Links, pins, guides and screws of cams: sizes that bear, lists, and the assembly."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from parts_lists import assert_assembly_has_the_numbers_of_the_list, table

import cfmkit
from cfmkit.families import PIN_STRENGTH, family
from cfmkit.families.cam.hardware import _SizingLoads, _slider_pin, hardware
from cfmkit.stock import series_of


def solved(*changes, name="cam"):
    return cfmkit.analyze(cfmkit.load(f"configs/{name}.yaml", list(changes)))


def listed(result):
    """Return the rows of the parts list by place."""
    return {row["place"]: row for row in table(result)}


def bending_stress(moment: float, diameter: float) -> float:
    """Return the largest stress of a round bar [Pa]."""
    return 32.0 * moment / (math.pi * diameter**3)


@pytest.mark.parametrize("name", ["cam", "cam_friction"])
def test_numbers_of_the_assembly_are_those_of_the_list(name):
    result = solved(name=name)
    assert_assembly_has_the_numbers_of_the_list(result, hardware(result.state))


def test_the_parts_of_a_cam_bear_its_forces():
    result = solved(name="cam_preloaded")
    rows = listed(result)
    pull = max(np.nanmax(np.abs(one.brace)) for one in (result.state.up, result.state.down))
    length, width, thick = (1e-3 * float(size) for size in rows["roller to slider"]["size"][:-3].split(" x "))
    pin = 1e-3 * float(rows["slider pin"]["size"].split(" x ")[0])
    assert pull / ((width - pin) * thick) <= 235e6 / 1.5
    slider = 1e-3 * float(rows["on its guide"]["size"].removesuffix(" mm").split(" x ")[2])
    assert bending_stress(0.5 * pull * (thick + slider), pin) <= PIN_STRENGTH / 1.5
    assert length == pytest.approx(result.spec.mechanism.brace_length + width)
    assert {"steel-s235, assumed" in row["data"] for row in (rows["cam"], rows["roller to slider"])} == {True}
    assert "side load and friction assumed" in rows["guide of the slider"]["data"]


def test_a_stated_pin_that_is_too_thin_is_named_with_one_that_is_not():
    spec = cfmkit.load("configs/cam.yaml", ["mechanism.pins={diameter: 1 mm}"])
    (row,) = [row for row in table(cfmkit.analyze(spec)) if row["place"] == "slider pin"]
    assert "too weak" in row["data"]
    least = row["data"].rpartition("at least ")[2].partition(" (")[0]
    again = cfmkit.analyze(spec.replace({"mechanism.pins.diameter": least}))
    assert not [row for row in table(again) if "too weak" in row["data"] and row["place"] == "slider pin"]


def test_holes_that_turn_on_pins_and_seat_bearings_have_a_fit():
    rows = listed(solved(name="cam_friction"))
    assert "between holes of 6 mm H8 (+0.018) and 8 mm H8 (+0.022)" in rows["roller to slider"]["data"]
    assert "with a hole of 8 mm H8 (+0.022), presses" in rows["on the cam"]["data"]


def test_shafts_and_hook_bars_of_a_cam_bear_the_springs_beyond_the_braces():
    """Half of the press acts at each brace, the springs of a side beyond it and the slider; half above a bar's hole."""
    result = solved(name="studies/cam_bought_parts")
    mechanism = result.spec.mechanism
    springs, stretch = mechanism.springs, result.state.elongation.max()
    outer, side = springs.wound.coil + springs.wound.wire, 0.5 * springs.total * stretch
    press = np.nanmax(result.curve.extra["contact_force"].values)
    rows = listed(result)
    slider = 1e-3 * float(rows["on its guide"]["size"].removesuffix(" mm").split(" x ")[2])
    bending = 0.5 * press * 8e-3 + side * (0.5 * (8e-3 + outer) + slider)
    assert bending_stress(bending, 8e-3) <= PIN_STRENGTH / 1.5
    length = 24 + 2e3 * (outer + slider)
    assert rows["shafts of the rollers"]["size"] in (f"8 x {length:g} mm", f"8 x {5 * math.ceil(length / 5):g} mm")
    bar = rows["springs to the shafts"]
    height, width, thick = (float(side) for side in bar["size"].removesuffix(" mm").split(" x "))
    assert (bar["count"], height, thick) == (4, pytest.approx(2e3 * outer), 8.0)
    section = 1e-9 * thick * (width**3 - 8.0**3) / (6.0 * width)
    assert side * 0.125 * 2.0 * outer / section <= 235e6 / 1.5
    drawn = hardware(result.state).drawn
    bars = [np.ptp(body.outline(), axis=0) for body in drawn if body.name == "hook bar"]
    assert np.allclose(bars, [[1e-3 * width, 2.0 * outer]] * 2)  # those in front hide those behind
    rows_of_springs = [body.outline()[:, 1].mean() for body in drawn if body.name == "spring"]
    assert np.allclose(np.diff(sorted(rows_of_springs)), outer)


@pytest.mark.parametrize("beside", [0.0, 30.0])
def test_a_shaft_is_no_thicker_than_half_of_the_press_and_the_springs_beside_it_require(beside):
    """In links that bear everything, so that bending decides."""
    loads = _SizingLoads.from_solution(solved(name="studies/cam_bought_parts").state)
    strength = replace(loads.strength, allowable=1e12)
    hooks = replace(loads.hooks, pull=beside, arm=12e-3)
    # thicker ones are sheared off
    slender = [size for size in series_of("pin", "metric").sizes if 1e-3 <= size <= 12e-3]
    for thin, next_size in pairwise(slender):
        moment = PIN_STRENGTH / 1.5 * math.pi * thin**3 / 32.0
        press = (moment - hooks.pull * hooks.arm) / (0.25 * (loads.thickness + loads.brace))
        if press <= 0.0:
            continue
        chosen = [
            replace(loads, press=share * press, strength=strength, hooks=hooks).thinnest_shaft
            for share in (0.999, 1.001)
        ]
        assert chosen == [thin, next_size]


def test_the_pin_of_a_slider_is_no_thicker_than_the_pull_of_a_brace_beside_it_requires():
    loads = _SizingLoads.from_solution(solved().state)
    arm = 0.5 * (loads.brace + loads.rods.slider_thickness)
    for thin, next_size in pairwise([1e-3, 1.2e-3, 1.5e-3, 2e-3]):
        pull = PIN_STRENGTH / 1.5 * math.pi * thin**3 / (32.0 * arm)
        assert [_slider_pin(replace(loads, pull=share * pull), {}) for share in (0.999, 1.001)] == [thin, next_size]


def test_a_slider_has_walls_around_its_rods_which_leave_its_pin_free():
    """Rods of 2.5 mm ran through the pin of sliders that were 2 mm thick."""
    result = solved()
    found = hardware(result.state)
    left, right = (body for body in found.bodies if body.name == "guide")
    (pin,) = (body for body in found.drawn if body.name == "slider pin")
    clear = abs(left.core[0, 0, 0] - right.core[0, 0, 0]) / 2 - left.reach - pin.reach
    assert clear == pytest.approx(0.25 * 2 * max(left.reach, pin.reach))
    assert not found.faults
    # the pin moves over the plate: a half of the slider on either side of it, outside of the braces
    (slider,) = (row for row in table(result) if row["name"] == "slider")
    assert (slider["count"], slider["size"]) == (2, f"32 x 32 x {3e3 * left.reach:g} mm")
    near = solved("mechanism.pins={diameter: 20 mm}", "mechanism.rest_half_width=18 mm")
    (fault,) = [text for text in hardware(near.state).faults if text.startswith("guide of")]
    assert "in the way of the rollers' shafts" in fault


def test_loops_of_springs_go_over_the_ends_of_shafts_or_are_a_fault():
    """The list says how long a spring is inside its loops: the axes at rest, and the shaft inside the loops."""
    rest = 2e3 * cfmkit.load("configs/cam.yaml").mechanism.springs_rest
    wound = "mechanism.springs={{wound: {{wire: {wire}, coil: {coil}, turns: 100}}, count: 2}}"
    for wire, coil, end in (
        ("1 mm", "9 mm", ""),
        ("1 mm", "5 mm", "ends turned to 4 mm"),
        ("0.3 mm", "1 mm", "too weak"),
    ):
        result = solved(wound.format(wire=wire, coil=coil))
        rows = listed(result)
        inside = float(coil[:-3]) - float(wire[:-3])
        shaft = float(rows["shafts of the rollers"]["size"].split()[0])
        seat = min(shaft, inside)
        assert f"({rest + seat:.6g} mm inside the loops)" in rows["between the rollers"]["data"]
        faults = [text for text in hardware(result.state).faults if "do not go over" in text]
        pull = 0.5 * float(result.state.elongation.max()) * result.spec.mechanism.springs.total
        bends = bending_stress(pull * 0.5e-3 * (float(coil[:-3]) + float(wire[:-3])), 1e-3 * seat)
        assert bool(faults) == (bends > PIN_STRENGTH / 1.5) == (end == "too weak")
        if end.startswith("ends"):
            assert end in rows["shafts of the rollers"]["data"]


def test_ends_of_braces_and_loops_of_springs_are_in_the_box_of_a_cam():
    plain, wide, loops = (
        family("cam").envelope(solved(*changes)).across
        for changes in (
            [],
            ["mechanism.envelope={brace_width: 60 mm}"],
            ["mechanism.springs={wound: {wire: 2 mm, coil: 40 mm, turns: 20}, count: 2}"],
        )
    )
    radius = 1e-3 * 16.0
    assert wide - plain == pytest.approx(2.0 * (30e-3 - radius))
    assert loops - plain == pytest.approx(2.0 * (21e-3 - radius))


def test_heads_of_screws_count_in_the_depth_of_a_cam():
    result = solved("mechanism.plate.hole_diameter=17.5 mm")  # heads of M16 are 16 mm high
    assert hardware(result.state).screw_head_height == pytest.approx(16e-3)
    deep, less = (family("cam").part(each).depth for each in (result, solved()))
    assert deep == pytest.approx(max(less, 0.5 * less + 4e-3 + 16e-3))


def test_rollers_without_ball_bearings_rub_on_their_shafts():
    """Cams 'met' a hysteresis whose rollers turned on plain shafts that were taken to rub nowhere."""
    small = solved("mechanism.roller_radius=5 mm")  # no bearing fits
    assert set(hardware(small.state).rubbing) == {"pins", "guide", "bearings"}
    assert set(hardware(solved().state).rubbing) == {"pins", "guide"}
    # a bearing is no wider than its roller: beside it there are the braces
    thin = solved("mechanism.contact.width=3 mm", "mechanism.plate.thickness=3 mm")
    assert "bearings" in hardware(thin.state).rubbing
    assert "in the rollers" not in listed(solved("mechanism.bearings={bore: 5 mm, friction: 0.1, kind: plain}"))
    with pytest.raises(cfmkit.SpecError, match="of rolling bearings"):
        cfmkit.load("configs/cam.yaml", ["mechanism.bearings={bore: 5 mm, kind: plain, dynamic_rating: 1 kN}"])
    weak = solved("mechanism.bearings={bore: 1 mm}")
    assert any("too weak" in text and "bearings.bore" in text for text in hardware(weak.state).faults)


def test_the_box_of_a_cam_contains_a_guide_as_long_as_stated():
    short, long = (
        family("cam").envelope(solved(f"mechanism.guide.length={length}", name="cam_friction"))
        for length in ("40 mm", "60 mm")
    )
    assert long.along - short.along == pytest.approx(10e-3, abs=1e-9)


def test_pins_of_a_cam_are_thicker_where_a_requirement_asks_for_more_safety():
    """They bore 1.5 times their load whatever `suggest --safety` said."""
    spec, sizes = cfmkit.load("configs/cam.yaml"), []
    for least in (1.5, 6.0):
        result = cfmkit.analyze(spec.replace({"requirements": ({"metric": "safety_factor", "min": least},)}))
        pins = [row["size"] for row in table(result) if row["place"] in ("slider pin", "shafts of the rollers")]
        sizes.append([float(size.split()[0]) for size in pins])
    assert len(sizes[0]) == 2
    assert all(safer > plain for plain, safer in zip(*sizes, strict=True))
