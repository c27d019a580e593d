"""Links, pins, guides and screws: formulas against hand calculations, sizes that bear, lists, and the assembly."""

import itertools
import math

import numpy as np
import pytest

import cfmkit
from cfmkit.export.posed_part import PosedBody, rectangle, screw_positions, swept
from cfmkit.families.cam.hardware import hardware as cam_hardware
from cfmkit.families.hardware import (
    PIN_STRENGTH,
    PartStrength,
    guide_rods,
    link_width,
    pin_part,
    required_safety,
    screw_for,
)
from cfmkit.families.slider_crank.springs.hardware import hardware as crank_hardware
from cfmkit.plots.figure_options import form_of
from cfmkit.plots.style import size_mm
from cfmkit.stock.joint_strength import (
    SHEAR_SHARE,
    bearing_pressure,
    euler_load,
    eye_that_bears,
    link_stress,
    pin_bending,
    pin_shear,
    pin_that_bears,
    rod_bending,
    rod_sag,
    rod_that_guides,
    shear_out,
)
from cfmkit.stock.stock_series import series_of

PINS = series_of("pin", "metric").sizes


def table(result):
    """Return the parts list as one dictionary per line."""
    columns = {column.name: column.cells() for column in result.tables["parts"]().columns}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def test_formulas_are_those_of_a_hand_calculation():
    # a link of 12 x 3 mm with a hole of 4 mm: 24 mm2, and (12^3 - 4^3)/12*3/6 = 69.33 mm3
    assert link_stress(200.0, 0.0, 0.012, 0.003, 0.004) == pytest.approx(200 / 24e-6)
    assert link_stress(0.0, 0.3, 0.012, 0.003, 0.004) == pytest.approx(0.3 / (3e-3 * (12e-3**3 - 4e-3**3) / 12 / 6e-3))
    assert bearing_pressure(200.0, 0.004, 0.003) == pytest.approx(200 / 12e-6)
    assert shear_out(200.0, 0.012, 0.003, 0.004) == pytest.approx(200 / (2 * 4e-3 * 3e-3))  # two walls of 4 mm
    assert euler_load(200e9, 0.012, 0.003, 0.1) == pytest.approx(math.pi**2 * 200e9 * (0.012 * 27e-9 / 12) / 0.01)
    section, inertia = math.pi * 4e-3**3 / 32, math.pi * 4e-3**4 / 64
    assert pin_bending(200.0, 0.005, 0.004) == pytest.approx(200 * 0.005 / section)
    assert pin_shear(200.0, 0.004) == pytest.approx(4 / 3 * 200 / (math.pi * 2e-3**2))
    assert rod_bending(20.0, 0.2, 0.004) == pytest.approx(20 * 0.2 / 4 / section)
    assert rod_sag(20.0, 0.2, 0.004, 210e9) == pytest.approx(20 * 0.2**3 / (48 * 210e9 * inertia))


@pytest.mark.parametrize("force", [1.0, 50.0, 1500.0])
def test_a_chosen_pin_bears_and_the_next_thinner_one_does_not(force):
    found = pin_that_bears(force, 0.008, 0.008, 150e6, 150e6, PINS)
    bears = [
        bearing_pressure(force, d, 0.008) <= 150e6 and pin_bending(force, 0.008, d) <= 150e6
        and pin_shear(force, d) <= SHEAR_SHARE * 150e6
        for d in PINS
    ]  # fmt: skip
    assert found == PINS[bears.index(True)]
    assert pin_that_bears(1e9, 0.008, 0.008, 150e6, 150e6, PINS) is None


def test_an_eye_and_a_rod_that_are_chosen_bear_their_loads():
    width = eye_that_bears(1500.0, 0.004, 0.005, 100e6, 0.001)
    assert link_stress(1500.0, 0.0, width, 0.004, 0.005) <= 100e6 * (1 + 1e-12)
    assert shear_out(1500.0, width, 0.004, 0.005) <= SHEAR_SHARE * 100e6 * (1 + 1e-12)
    found = rod_that_guides(30.0, 0.25, 210e9, 150e6, 1e-3, PINS)
    thinner = PINS[PINS.index(found) - 1]
    assert rod_sag(30.0, 0.25, found, 210e9) <= 0.25e-3 < rod_sag(30.0, 0.25, thinner, 210e9)


def test_what_is_not_stated_is_assumed_and_said():
    strength = PartStrength.from_material(None, 1.0)
    assert (strength.name, strength.assumed) == ("steel-s235", True)
    assert strength.allowable == pytest.approx(235e6 / 1.5)
    rods = guide_rods(2, 0.0, 100.0, 0.2, 0.02, None, None, strength)
    assert rods.load == pytest.approx(10.0)
    assert rod_sag(5.0, 0.22, rods.diameter, 210e9) <= 0.22e-3 < rod_sag(5.0, 0.22, 0.8 * rods.diameter, 210e9)
    assert screw_for(10.0, 0.003, 4, strength).name == "M3"
    assert link_width(34.0, 0.008, 0.005, strength) == pytest.approx(8e-3)


def test_the_parts_of_a_cam_bear_its_forces():
    result = cfmkit.analyze(cfmkit.load("configs/cam_preloaded.yaml"))
    rows = {row["place"]: row for row in table(result)}
    pull = max(np.nanmax(np.abs(one.brace)) for one in (result.state.up, result.state.down))
    length, width, thick = (1e-3 * float(size) for size in rows["roller to slider"]["size"][:-3].split(" x "))
    pin = 1e-3 * float(rows["slider pin"]["size"].split(" x ")[0])
    assert link_stress(pull, 0.0, width, thick, pin) <= 235e6 / 1.5
    slider = 1e-3 * float(rows["on its guide"]["size"].removesuffix(" mm").split(" x ")[2])
    assert pin_bending(pull, 0.5 * (thick + slider), pin) <= PIN_STRENGTH / 1.5
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


def test_numbers_of_the_assembly_are_those_of_the_list():
    for name, of in (("cam", cam_hardware), ("cam_friction", cam_hardware), ("slider_crank_bought", None)):
        result = cfmkit.analyze(cfmkit.load(f"configs/{name}.yaml"))
        found = of(result.state) if of else crank_hardware(result.spec, result.state)
        drawn = {body.name for body in found.drawn}
        assert {part.body for part in found.parts if part.body} <= drawn
        assert all(part.body for part in found.parts if part.place == "in the rollers" and part.standard)
        figure = cfmkit.figures(result)["assembly"]()
        shown = {text.get_gid(): text.get_text() for ax in figure.axes for text in ax.texts if text.get_gid()}
        wanted = {f"item-{k}": str(k) for k, part in enumerate(found.parts, start=1) if part.body}
        assert shown == wanted
        assert len(table(result)) == len(found.parts)


def test_holes_that_turn_on_pins_and_seat_bearings_have_a_fit():
    rows = {
        row["place"] + (row["name"] or ""): row
        for row in table(cfmkit.analyze(cfmkit.load("configs/cam_friction.yaml")))
    }
    assert "between holes of 6 mm H8 (+0.018) and 8 mm H8 (+0.022)" in rows["roller to sliderbrace"]["data"]
    assert "with a hole of 8 mm H8 (+0.022), presses" in rows["on the camroller"]["data"]


def test_pins_of_a_linkage_are_as_long_as_two_sheets_and_the_springs_around_them():
    result = cfmkit.analyze(cfmkit.load("configs/slider_crank_bought.yaml"))
    (pins,) = (row for row in table(result) if row["place"] == "joints")
    springs, turns = result.spec.mechanism.springs, result.state.extremes.largest_turns[:, 0]
    joints = ("pivot", "crank_pin", "slider_pin")
    heights = [
        2 * coil.wire * (coil.turns + 1.0 + turns[k] / (2.0 * np.pi))
        for k, name in enumerate(joints)
        for coil in springs.coils_at(name)
    ]
    sheet = float(
        next(row for row in table(result) if row["name"] == "crank")["size"].split(" x ")[2].removesuffix(" mm")
    )
    slider = float(next(row for row in table(result) if row["name"] == "slider")["size"].split(" x ")[2][:-3])
    needed = sheet + max(sheet, slider) + 1e3 * max(heights)
    assert 15.0 < needed < 16.0  # the next pin of ISO 2338, less than a millimetre longer, is not cut
    assert (pins["size"], "cut" in pins["data"]) == ("3 x 16 mm", False)


def test_shafts_and_hook_bars_of_a_cam_bear_the_springs_beyond_the_braces():
    """Half of the press acts at each brace, the springs of a side beyond it and the slider; half above a bar's hole."""
    result = cfmkit.analyze(cfmkit.load("configs/studies/cam_bought_parts.yaml"))
    mechanism = result.spec.mechanism
    springs, stretch = mechanism.springs, result.state.elongation.max()
    outer, side = springs.wound.coil + springs.wound.wire, 0.5 * springs.total * stretch
    press = np.nanmax(result.curve.extra["contact_force"].values)
    rows = {row["place"]: row for row in table(result)}
    slider = 1e-3 * float(rows["on its guide"]["size"].removesuffix(" mm").split(" x ")[2])
    bending = 0.5 * press * 8e-3 + side * (0.5 * (8e-3 + outer) + slider)
    assert 32.0 * bending / (math.pi * 8e-3**3) <= PIN_STRENGTH / 1.5
    length = 24 + 2e3 * (outer + slider)
    assert rows["shafts of the rollers"]["size"] in (f"8 x {length:g} mm", f"8 x {5 * math.ceil(length / 5):g} mm")
    bar = rows["springs to the shafts"]
    height, width, thick = (float(side) for side in bar["size"].removesuffix(" mm").split(" x "))
    assert (bar["count"], height, thick) == (4, pytest.approx(2e3 * outer), 8.0)
    section = 1e-9 * thick * (width**3 - 8.0**3) / (6.0 * width)
    assert side * 0.125 * 2.0 * outer / section <= 235e6 / 1.5
    drawn = cam_hardware(result.state).drawn
    bars = [np.ptp(body.outline(), axis=0) for body in drawn if body.name == "hook bar"]
    assert np.allclose(bars, [[1e-3 * width, 2.0 * outer]] * 2)  # those in front hide those behind
    rows_of_springs = [body.outline()[:, 1].mean() for body in drawn if body.name == "spring"]
    assert np.allclose(np.diff(sorted(rows_of_springs)), outer)


def test_pins_are_bought_in_lengths_of_their_standard_and_cut_or_made_of_a_rod():
    bought, cut, made = (pin_part("pin", 1, 1.5e-3, length, 1.0) for length in (15.5e-3, 14.5e-3, 17e-3))
    assert (bought.source, bought.size, bought.standard) == ("buy", "1.5 x 16 mm", "ISO 2338")
    assert (cut.size, cut.data.endswith(", cut to 14.5 mm")) == ("1.5 x 16 mm", True)
    assert (made.source, made.size, made.standard) == ("make", "1.5 x 17 mm", "")  # ISO 2338 ends at 16 mm
    assert pin_part("pin", 1, 0.25 * 25.4e-3, 0.017, 1.0).standard == "ASME B18.8.2"


def test_a_slider_has_walls_around_its_rods_which_leave_its_pin_free():
    """Rods of 2.5 mm ran through the pin of sliders that were 2 mm thick."""
    result = cfmkit.analyze(cfmkit.load("configs/cam.yaml"))
    found = cam_hardware(result.state)
    left, right = (body for body in found.bodies if body.name == "guide")
    (pin,) = (body for body in found.drawn if body.name == "slider pin")
    clear = abs(left.core[0, 0, 0] - right.core[0, 0, 0]) / 2 - left.reach - pin.reach
    assert clear == pytest.approx(0.25 * 2 * max(left.reach, pin.reach))
    assert not found.faults
    # the pin moves over the plate: a half of the slider on either side of it, outside of the braces
    (slider,) = (row for row in table(result) if row["name"] == "slider")
    assert (slider["count"], slider["size"]) == (2, f"32 x 32 x {3e3 * left.reach:g} mm")
    near = cfmkit.load("configs/cam.yaml", ["mechanism.pins={diameter: 20 mm}", "mechanism.rest_half_width=18 mm"])
    (fault,) = [text for text in cam_hardware(cfmkit.analyze(near).state).faults if text.startswith("guide of")]
    assert "in the way of the rollers' shafts" in fault


def test_loops_of_springs_go_over_the_ends_of_shafts_or_are_a_fault():
    """The list says how long a spring is inside its loops: the axes at rest, and the shaft inside the loops."""
    loaded = cfmkit.load("configs/cam.yaml")
    rest = 2e3 * loaded.mechanism.springs_rest
    wound = "mechanism.springs={{wound: {{wire: {wire}, coil: {coil}, turns: 100}}, count: 2}}"
    for wire, coil, end in (
        ("1 mm", "9 mm", ""),
        ("1 mm", "5 mm", "ends turned to 4 mm"),
        ("0.3 mm", "1 mm", "too weak"),
    ):
        spec = cfmkit.load("configs/cam.yaml", [wound.format(wire=wire, coil=coil)])
        result = cfmkit.analyze(spec)
        rows = {row["place"]: row for row in table(result)}
        inside = float(coil[:-3]) - float(wire[:-3])
        shaft = float(rows["shafts of the rollers"]["size"].split()[0])
        seat = min(shaft, inside)
        assert f"({rest + seat:.6g} mm inside the loops)" in rows["between the rollers"]["data"]
        faults = [text for text in cam_hardware(result.state).faults if "do not go over" in text]
        bends = pin_bending(float(result.state.elongation.max()) * spec.mechanism.springs.total / 2,
                            0.5e-3 * (float(coil[:-3]) + float(wire[:-3])), 1e-3 * seat)  # fmt: skip
        assert bool(faults) == (bends > PIN_STRENGTH / 1.5) == (end == "too weak")
        if end.startswith("ends"):
            assert end in rows["shafts of the rollers"]["data"]


def test_ends_of_braces_and_loops_of_springs_are_in_the_box_of_a_cam():
    plain, wide, loops = (
        cfmkit.families.family("cam").envelope(cfmkit.analyze(cfmkit.load("configs/cam.yaml", changes))).across
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
    flat = cfmkit.load("configs/cam.yaml", ["mechanism.plate.hole_diameter=17.5 mm"])  # heads of M16 are 16 mm high
    result = cfmkit.analyze(flat)
    found = cam_hardware(result.state)
    assert found.screw_head_height == pytest.approx(16e-3)
    plain = cfmkit.analyze(cfmkit.load("configs/cam.yaml"))
    deep, less = (cfmkit.families.family("cam").part(one).depth for one in (result, plain))
    assert deep == pytest.approx(max(less, 0.5 * less + 4e-3 + 16e-3))


def test_rollers_without_ball_bearings_rub_on_their_shafts():
    """Cams 'met' a hysteresis whose rollers turned on plain shafts that were taken to rub nowhere."""
    from cfmkit.families.run_control import Run
    from cfmkit.studies.assumed_friction import friction_note

    small = cfmkit.load("configs/cam.yaml", ["mechanism.roller_radius=5 mm"])  # no bearing fits
    result = cfmkit.analyze(small)
    assert set(cam_hardware(result.state).rubbing) == {"pins", "guide", "bearings"}
    assert "plain bearings of the rollers (" in friction_note(result, Run())
    assert set(cam_hardware(cfmkit.analyze(cfmkit.load("configs/cam.yaml")).state).rubbing) == {"pins", "guide"}
    # a bearing is no wider than its roller: beside it there are the braces
    thin = cfmkit.load("configs/cam.yaml", ["mechanism.contact.width=3 mm", "mechanism.plate.thickness=3 mm"])
    assert "bearings" in cam_hardware(cfmkit.analyze(thin).state).rubbing
    plain = cfmkit.load("configs/cam.yaml", ["mechanism.bearings={bore: 5 mm, friction: 0.1, kind: plain}"])
    assert not [row for row in table(cfmkit.analyze(plain)) if row["place"] == "in the rollers"]
    with pytest.raises(cfmkit.SpecError, match="of rolling bearings"):
        cfmkit.load("configs/cam.yaml", ["mechanism.bearings={bore: 5 mm, kind: plain, dynamic_rating: 1 kN}"])
    weak = cfmkit.analyze(cfmkit.load("configs/cam.yaml", ["mechanism.bearings={bore: 1 mm}"]))
    assert any("too weak" in text and "bearings.bore" in text for text in cam_hardware(weak.state).faults)


def test_in_one_column_the_parts_list_stands_below_an_assembly_as_wide_as_the_paper():
    result = cfmkit.analyze(cfmkit.load("configs/cam.yaml"))
    figure = form_of(width="84 mm").draw(cfmkit.figures(result)["assembly"])
    picture, listed = (ax.get_position() for ax in figure.axes)
    width, height = size_mm(figure)
    assert width == pytest.approx(84.0)
    assert figure.texts[0].get_text() == f"{result.spec.name}: assembly"  # no name of usual length is cut
    assert picture.width == pytest.approx(1.0)
    assert picture.y0 == pytest.approx(listed.y1)
    assert (picture.height + listed.height) * height > height - 17.0  # heading and margins
    figure.canvas.draw()
    lines = [text.get_window_extent() for text in figure.axes[1].texts]
    assert all(box.x0 >= 0.0 and box.x1 <= figure.bbox.x1 and box.y0 >= 0.0 for box in lines)
    assert all(upper.y0 >= lower.y0 for upper, lower in itertools.pairwise(lines))


def test_the_box_of_a_cam_contains_a_guide_as_long_as_stated():
    short, long = (
        cfmkit.families.family("cam").envelope(
            cfmkit.analyze(cfmkit.load("configs/cam_friction.yaml", [f"mechanism.guide.length={length}"]))
        )
        for length in ("40 mm", "60 mm")
    )
    assert long.along - short.along == pytest.approx(10e-3, abs=1e-9)


def test_screws_of_the_ground_are_reached_beside_what_moves():
    result = cfmkit.analyze(cfmkit.load("configs/slider_crank_bought.yaml"))
    found = crank_hardware(result.spec, result.state)
    moving = [body for body in found.drawn if body.role != "held"]
    covered = swept(moving)
    from shapely import Point

    places = [body.core[0, 0] for body in found.bodies if body.name == "screw"]
    (screws,) = [row for row in table(result) if row["place"].startswith("ground")]
    assert (screws["name"], screws["standard"]) == ("M3 x 5", "ISO 4762, holes ISO 273")
    assert len(places) == 3  # the crank covers the fourth corner
    assert [row["count"] for row in table(result) if row["place"].startswith("ground")] == [3]
    assert min(covered.distance(Point(*at)) for at in places) > 2e-3
    ground = rectangle(0.0, 0.0, 0.1, 0.05)
    corners, reached = screw_positions(ground, [PosedBody.line("far", "free", np.array([[1.0, 1.0]]), 0.01)], 0.005)
    assert reached
    assert not screw_positions(ground, [PosedBody.polygon("all over", "free", 2.0 * ground)], 0.005)[1]
    assert sorted(map(tuple, np.round(corners, 6))) == [(0.005, 0.005), (0.005, 0.045), (0.095, 0.005), (0.095, 0.045)]


def test_a_design_without_stated_friction_says_what_pins_and_guide_take():
    from cfmkit import Run
    from cfmkit.studies.assumed_friction import friction_note

    plain = cfmkit.analyze(cfmkit.load("configs/slider_crank_bilancia2019.yaml"))
    note = friction_note(plain, Run())
    assert "with 0.15 in pins (" in note
    rubbing = cfmkit.load("configs/slider_crank_friction.yaml")
    assert friction_note(cfmkit.analyze(rubbing), Run()) == ""


@pytest.mark.parametrize(
    ("config", "metric"), [("cam", "safety_factor"), ("slider_crank_bilancia2019", "link_safety_factor")]
)
@pytest.mark.parametrize(
    ("stated", "least", "safety"), [(1, 1, 1.5), (1, 1.5, 1.5), (1.2, 1, 1.2), (1, 3, 3), (2, 1.5, 3)]
)
def test_parts_that_join_have_the_safety_that_a_requirement_asks_for(config, metric, stated, least, safety):
    spec = cfmkit.load(f"configs/{config}.yaml")
    asked = {"mechanism.safety_factor": stated, "requirements": ({"metric": metric, "min": least},)}
    assert required_safety(spec.replace(asked)) == safety


def test_pins_of_a_cam_are_thicker_where_a_requirement_asks_for_more_safety():
    """They bore 1.5 times their load whatever `suggest --safety` said."""
    spec, sizes = cfmkit.load("configs/cam.yaml"), []
    for least in (1.5, 6.0):
        result = cfmkit.analyze(spec.replace({"requirements": ({"metric": "safety_factor", "min": least},)}))
        pins = [row["size"] for row in table(result) if row["place"] in ("slider pin", "shafts of the rollers")]
        sizes.append([float(size.split()[0]) for size in pins])
    assert len(sizes[0]) == 2
    assert all(safer > plain for plain, safer in zip(*sizes, strict=True))
