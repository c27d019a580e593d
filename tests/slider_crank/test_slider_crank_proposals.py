"""Proposals of `suggest` with slider-cranks: strips that fit, and springs at the pins."""

from __future__ import annotations

import re

import pytest
from suggest_support import proposal_of, propose, request, request_of

import cfmkit
from cfmkit import Run
from cfmkit.errors import SolutionError
from cfmkit.families import family
from cfmkit.families.slider_crank.flattest_springs_that_fit import flattest_springs, largest_effort
from cfmkit.families.slider_crank.linkage import linkage_of
from cfmkit.families.slider_crank.proposals import PUSHED_PROPORTIONS, PrintedSize, largest_printed
from cfmkit.families.slider_crank.springs.hardware import hardware as crank_hardware
from cfmkit.families.slider_crank.sprung_linkage_proposals import _turning, add_custom_springs
from cfmkit.stock.springs import WIRES_BY_NAME


@pytest.mark.parametrize("crank", [0.02, 0.05, 0.12])
@pytest.mark.parametrize("lengths", PUSHED_PROPORTIONS)
def test_the_largest_strip_of_some_proportions_just_fits_its_room(lengths, crank):
    """Pads of small parts are smaller, those of large ones are not larger: the box is that of the finished drawing."""
    keys = {"force": "0.5 N", "travel": "2 mm", "envelope": "[1 m, 1 m, 5 mm]"}
    spec = PrintedSize(request(**keys), lengths, crank, {"name": "pom"}).strip((1e-4, 0.05 * crank)).spec
    width = {"mechanism.beam.width": 4e-3, "mechanism.beam.thickness": 0.01 * crank}
    box = family("slider-crank").envelope(cfmkit.analyze(spec.replace({"design": None, **width})))
    assert largest_printed((box.across, box.along), lengths) == pytest.approx(crank, rel=2e-4)
    assert largest_printed((2.0 * box.across, box.along), lengths) == pytest.approx(crank, rel=2e-4)


@pytest.mark.parametrize("materials", ["pla", "[pla, pom, abs]"])
def test_what_takes_long_to_design_is_offered_behind_everything_else(materials):
    keys = {"force": "1.8 N", "travel": "12.8 mm", "envelope": "[99.5 mm, 155 mm, 7 mm]", "material": materials}
    offer = family("slider-crank").propose(request_of(keys), Run())
    kinds = [one.variant.partition(",")[0] for one in offer.candidates]
    assert {"strip", "springs at pins", "tapered strip"} <= set(kinds)
    assert "tapered strip" not in kinds[: -kinds.count("tapered strip")]


@pytest.mark.parametrize("depth", ["", ", 12 mm"])
def test_the_room_that_a_refusal_names_is_enough(depth):
    def offer_within(across, along):
        return propose("slider-crank", request(force="0.01 N", envelope=f"[{across} mm, {along} mm{depth}]"))

    refusal = offer_within(4.0, 4.0).reason
    across, along = map(float, re.search(r"needs ([\d.]+) mm across it and ([\d.]+) mm along it", refusal).groups())
    assert offer_within(1.001 * across, 1.001 * along).candidates
    assert not offer_within(0.5 * across, 0.5 * along).candidates


def test_springs_at_pins_hold_no_more_energy_than_steel_wire_in_the_room():
    keys = {"torque": "5 N*m", "angle": "10 deg", "ripple": "2 %"}
    small, large = (request_of(keys | {"envelope": room}) for room in ("[5 mm, 5 mm]", "[50 mm, 250 mm]"))
    propose = family("slider-crank").propose
    assert "fill the envelope" in propose(small, Run()).reason
    assert propose(large, Run()).candidates


def pinned(force_or_torque, room):
    asked = request_of(force_or_torque | {"ripple": "2 %", "envelope": room})
    offer = propose("slider-crank", asked)
    assert offer.candidates, offer.reason
    return [proposal_of("slider-crank", one, asked) for one in offer.candidates[5:8]]


@pytest.mark.parametrize("torque", ["100 N*mm", "1 N*m"])
def test_springs_at_pins_are_of_wire_that_bears_the_motion_and_fit_the_room(torque):
    found = [one for one in pinned({"torque": torque, "angle": "5 deg"}, "[60 mm, 200 mm]") if one.good]
    assert found
    for one in found:
        mechanism, values = one.spec.mechanism, cfmkit.analyze(one.spec).values
        wires = [spring.wound for spring in mechanism.springs.bought]
        assert values["wire_stress_max"].value <= 0.6 * max(
            WIRES_BY_NAME["music-wire"].tensile_strength(wire.wire) for wire in wires
        ) * (1.0 + 1e-9)
        coils = [spring.wound for spring in mechanism.springs.bought if spring.at != "slider"]
        assert max(coil.coil + coil.wire for coil in coils) <= min(mechanism.crank_length, one.numbers["across"])
        for coil in mechanism.springs.coils_at("slider"):
            assert coil.body_length + 2.0 * (coil.coil - coil.wire) < one.numbers["along"]


def test_springs_at_pins_stay_within_the_depth_required():
    """Ground, crank and coupler are of one sheet; the pivot's spring is below them and all others are above.

    All of them are longest when they are wound up. The slider may be thicker than the crank beside it.
    """
    keys = {"torque": "100 N*mm", "angle": "60 deg", "ripple": "5 %", "envelope": "[150 mm, 150 mm, 16 mm]"}
    asked = request_of(keys | {"safety": "1"})
    offered = propose("slider-crank", asked).candidates
    tried = (proposal_of("slider-crank", one, asked) for one in offered)
    one = next(one for one in tried if one.good)
    springs, solved = one.spec.mechanism.springs, cfmkit.analyze(one.spec)
    turned = solved.values
    high = {
        at: springs.coils_at(at)[0].room_for(turned[f"{at}_rotation_max"].value)
        for at in ("pivot", "crank_pin", "slider_pin")
        if springs.coils_at(at)
    }
    layers = 3.0 * one.spec.mechanism.part.sheet + crank_hardware(one.spec, solved.state).slider_excess
    assert one.numbers["depth"] == pytest.approx(layers + high.pop("pivot", 0.0) + max(high.values()))
    assert 14e-3 < one.numbers["depth"] <= 16e-3


def torque_offer(torque, angle, room, safety="1"):
    keys = {"torque": torque, "angle": angle, "ripple": "5 %", "envelope": room, "safety": safety}
    asked = request_of(keys)
    return asked, propose("slider-crank", asked)


def test_a_torque_whose_springs_are_wider_than_the_linkage_is_refused():
    """The wire of springs for this work fills a hundredth of the room; but no coil of it goes between the pins."""
    assert not any(one.good for one in pinned({"torque": "5 N*m", "angle": "10 deg"}, "[50 mm, 100 mm]"))
    _, refused = torque_offer("5 N*m", "10 deg", "[20 mm, 40 mm]")
    assert not refused.candidates
    assert refused.reason.startswith("springs of steel wire that fit at the pins hold at most")


def test_an_angle_that_no_crank_turns_with_its_springs_is_refused_before_any_design():
    _, refused = torque_offer("100 N*mm", "200 deg", "[300 mm, 300 mm]")
    assert not refused.candidates
    assert "no springs turn a crank in one direction over 200 deg" in refused.reason


def test_springs_for_a_torque_are_the_flattest_of_those_that_fit():
    """The flattest of any size would be too long for this depth."""
    asked, offer = torque_offer("100 N*mm", "60 deg", "[150 mm, 150 mm, 16 mm]")
    made = [proposal_of("slider-crank", one, asked) for one in offer.candidates[:4]]
    good = [one for one in made if one.good]
    assert good, [one.missed or one.message for one in made]
    assert max(one.numbers["depth"] for one in good) <= asked.depth


def test_springs_with_a_safety_of_one_and_a_half_need_more_depth():
    made = {}
    for depth in (14, 20):
        asked, offer = torque_offer("100 N*mm", "60 deg", f"[150 mm, 150 mm, {depth} mm]", safety="1.5")
        made[depth] = [proposal_of("slider-crank", one, asked) for one in offer.candidates]
    assert not any(one.good for one in made[14])
    good = [one for one in made[20] if one.good]
    assert good
    assert min(cfmkit.analyze(one.spec).values["spring_safety_factor"].value for one in good) >= 1.5


def test_more_torque_than_the_bound_is_held_by_no_springs():
    asked, offer = torque_offer("100 N*mm", "60 deg", "[150 mm, 150 mm, 18 mm]")
    parts = offer.candidates[0].spec.mechanism
    motion = _turning(asked, linkage_of(parts), parts.unloaded_angle)
    bound = largest_effort(motion)
    assert flattest_springs(motion, 0.3 * bound, 0.0).deviation < 0.05
    assert flattest_springs(motion, 1.2 * bound, 0.0).deviation > 0.1


def pinned_for_force(force, room):
    keys = {"force": force, "travel": "20 mm", "ripple": "5 %", "envelope": room, "material": "steel-s235"}
    asked = request_of(keys)
    offer = propose("slider-crank", asked)
    return asked, offer, [one for one in offer.candidates if one.variant == "springs at pins"]


def test_springs_for_a_force_are_the_flattest_of_those_that_fit():
    """The flattest of any size are stiffer at the crank pin than any that is wound for this motion and this depth."""
    asked, _, offered = pinned_for_force("200 N", "[150 mm, 200 mm, 43 mm]")
    free = offered[0].spec.replace(
        {"design": {"force": "200 N", "travel": ["0.8 mm", "20.8 mm"], "springs": ["pivot", "crank_pin", "slider_pin"]}}
    )
    with pytest.raises(SolutionError, match="no spring of steel wire fits at the crank pin"):
        add_custom_springs(family("slider-crank").design.make(free, Run()).spec, asked)
    made = (proposal_of("slider-crank", one, asked) for one in offered[:4])
    best = next(one for one in made if one.good)  # the first ones need more room for guide and ground
    assert best.numbers["depth"] <= asked.depth


def test_a_force_that_no_springs_at_the_pins_hold_is_refused_with_the_largest_that_they_do():
    _, offer, offered = pinned_for_force("1.2 kN", "[150 mm, 200 mm, 40 mm]")
    assert not offered
    assert "springs of steel wire that fit at the pins hold at most" in offer.reason


def test_a_torque_over_a_quarter_of_a_turn_is_held_by_springs_that_are_wound_up_first():
    asked = request_of(
        {"torque": "5 N*m", "angle": "90 deg", "ripple": "3 %", "envelope": "[150 mm, 700 mm]", "safety": "1"}
    )
    offered = propose("slider-crank", asked).candidates
    assert any(proposal_of("slider-crank", one, asked).good for one in offered[5:])
