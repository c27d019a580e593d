"""Links, pins and screws of linkages with springs: strength, lists, the assembly, and the box of what is drawn."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from parts_lists import assert_assembly_has_the_numbers_of_the_list, table

import cfmkit
from cfmkit.export import PosedBody, rectangle, screw_positions, swept
from cfmkit.families import PartStrength, family
from cfmkit.families.slider_crank.springs.figures import draw_as_made, key, moving, scene
from cfmkit.families.slider_crank.springs.hardware import LinkBar, LinkLoads, hardware, links_that_bear


def test_numbers_of_the_assembly_are_those_of_the_list():
    result = cfmkit.analyze(cfmkit.load("configs/slider_crank_bought.yaml"))
    assert_assembly_has_the_numbers_of_the_list(result, hardware(result.spec, result.state))


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


def test_screws_of_the_ground_are_reached_beside_what_moves():
    result = cfmkit.analyze(cfmkit.load("configs/slider_crank_bought.yaml"))
    found = hardware(result.spec, result.state)
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


def test_what_proposals_draw_of_a_linkage_is_what_its_box_counts():
    spring = {"at": "pivot", "name": "wide", "wound": {"wire": "1 mm", "coil": "13 mm", "turns": 8.05}}
    spec = cfmkit.load("configs/slider_crank_bilancia2019.yaml").replace({"mechanism.springs.bought": (spring,)})
    result = cfmkit.analyze(spec)
    room, solution, bounds = family("slider-crank").envelope(result), result.state, []
    for place in solution.motion[0, np.linspace(0, solution.motion.shape[1] - 1, 9).round().astype(int)]:
        ax = Figure().add_axes((0.0, 0.0, 1.0, 1.0))
        draw_as_made(result, key(solution, "", float(place)), ax, scene(result))
        bounds += [one.get_path().transformed(one.get_patch_transform()).get_extents() for one in ax.patches]
        bounds += [one.get_path().transformed(one.get_patch_transform()).get_extents() for one in ax.artists]
        bounds += [one.get_path().get_extents() for one in ax.lines]
    low, high = ([f(one.extents[k] for one in bounds) for k in pair] for f, pair in ((min, (0, 1)), (max, (2, 3))))
    corner = [1e3 * at for at in room.corner]
    assert low == pytest.approx(corner, abs=0.3)
    assert high == pytest.approx([corner[0] + 1e3 * room.along, corner[1] + 1e3 * room.across], abs=0.3)
    assert moving(result).draw_as_made is not None


def loads(axial=0.0, moment=0.0, pin=0.0, rate=0.0, length=0.03):
    return LinkLoads((length, length), np.full((2, 1), axial), np.full((2, 1), moment), np.array([pin]), (rate, rate))


def test_links_bear_what_the_formulas_of_a_bar_with_holes_say():
    link = LinkBar(width=8e-3, sheet=2e-3, hole=2e-3, modulus=2e9)
    assert link.stress(loads(axial=-12.0)) == pytest.approx(12.0 / (6e-3 * 2e-3))
    inertia = 2e-3 * ((8e-3) ** 3 - (2e-3) ** 3) / 12.0
    assert link.stress(loads(moment=0.1)) == pytest.approx(0.1 * 4e-3 / inertia)
    assert link.bearing(loads(pin=20.0)) == pytest.approx(20.0 / (2e-3 * 2e-3))
    assert link.shear_out(loads(pin=20.0)) == pytest.approx(20.0 / (2 * 3e-3 * 2e-3))
    turn = link.turn_share(loads(rate=0.05))
    assert turn == pytest.approx(0.05 * 0.03 / (2e9 * 2e-3 * (8e-3) ** 3 / 12.0))
    euler = math.pi**2 * 2e9 * 8e-3 * (2e-3) ** 3 / 12.0 / 0.03**2
    assert link.safety(loads(axial=-1.0), 1e12) == pytest.approx(euler)


def test_links_are_as_narrow_as_their_loads_allow():
    acting = loads(axial=-12.0, moment=0.05, pin=12.0, rate=0.05)
    strength = PartStrength("x", 2e9, 40e6, 235e6, assumed=False)
    link = links_that_bear(acting, 2e-3, strength, 0.4e-3, 3e-3)
    assert link.safety(acting, 40e6) >= 1.0
    assert 0.0099 < link.turn_share(acting) <= 0.01
    assert links_that_bear(acting, 0.2e-3, strength, 0.4e-3, 3e-3) is None
    assert links_that_bear(acting, 2e-3, strength, 0.4e-3, 0.5e-3) is None


def test_the_thinnest_pins_of_links_are_those_of_1_mm():
    link = links_that_bear(loads(pin=0.1), 2e-3, PartStrength("x", 2e9, 40e6, 235e6, assumed=False), 0.4e-3, 3e-3)
    assert link.hole == 1e-3
