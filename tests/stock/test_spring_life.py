"""Stress in the wire of bought springs and what they last: from wire, coil, turns and stated data, never assumed."""

from __future__ import annotations

import math

import pytest
from cam_support import analyze, cam, design
from pydantic import ValidationError

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.kinds import HELICAL_KINDS
from cfmkit.stock.springs.spec import CatalogueSpring
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring

WIRE = {"wire": "1.25 mm", "coil": "12.5 mm", "turns": 40}
RATE = ExtensionSpring(1.25e-3, 12.5e-3, 40.0).rate
BASQUIN = {"coefficient": "1200 MPa", "exponent": -0.1, "ultimate_strength": "1300 MPa"}
"""Made-up numbers, to compare formulas with each other."""


def with_springs(**springs):
    return cam(roller_radius="8 mm", springs=springs)


def test_the_rate_follows_from_the_wire_where_none_is_stated():
    made = with_springs(count=2, wound=WIRE)
    assert made.mechanism.springs.total == pytest.approx(2 * RATE, rel=1e-12)
    thicker = made.replace({"mechanism.springs.wound.wire": 1.26e-3})
    assert thicker.mechanism.springs.total == pytest.approx(2 * RATE * (1.26 / 1.25) ** 4, rel=1e-12)


def test_the_stress_in_the_wire_is_that_of_the_longest_spring():
    found = analyze(with_springs(count=2, wound=WIRE))
    longest = found.values["spring_elongation_max"].value
    c = 10.0
    wahl = (4 * c - 1) / (4 * c - 4) + 0.615 / c
    shear = wahl * 8 * RATE * longest * 12.5e-3 / (math.pi * 1.25e-3**3)
    assert found.values["wire_stress_max"].value == pytest.approx(shear, rel=1e-12)
    assert "spring_life" not in found.values


def test_the_safety_factor_is_that_of_the_turns_or_of_the_loops():
    """Shigley, Table 10-7: 45 % of the tensile strength in shear, 75 % in the bending of loops."""
    values = analyze(with_springs(count=2, wound=WIRE)).values
    strength = 2211e6 / 1.25**0.145
    turns, loops = 0.45 * strength / values["wire_stress_max"].value, 0.75 * strength / values["loop_stress_max"].value
    assert values["spring_safety_factor"].value == pytest.approx(min(turns, loops), rel=1e-12)
    own = analyze(with_springs(count=2, wound=WIRE | {"shear_modulus": "80 GPa"})).values
    assert "spring_safety_factor" not in own  # of a wire of no class nothing is known


def test_torsion_and_compression_springs_have_their_own_shares():
    """Shigley, eq. 10-57 (78 %) and Table 10-6 (45 %)."""
    strength = 2211e6 / 1.25**0.145
    for kind, share in (("torsion", 0.78), ("compression", 0.45)):
        spring = HELICAL_KINDS[kind](1.25e-3, 12.5e-3, 40.0)
        assert spring.stress(spring.yield_load()) == pytest.approx(share * strength, rel=1e-12)


def test_the_life_is_that_of_the_smallest_and_the_largest_load():
    found = analyze(with_springs(count=2, preload="20 mm", wound=WIRE | {"fatigue": BASQUIN}))
    most = found.values["wire_stress_max"].value
    least = most * 20e-3 / found.values["spring_elongation_max"].value
    amplitude, mean = 0.5 * (most - least), 0.5 * (most + least)
    cycles = 0.5 * (amplitude / (1 - mean / 1300e6) / 1200e6) ** (1 / -0.1)
    assert found.values["spring_life"].value == pytest.approx(cycles, rel=1e-9)


def test_without_data_of_the_wire_the_life_is_what_the_maker_states():
    assert analyze(with_springs(stiffness="0.5 N/mm", count=2, life=2e5)).values["spring_life"].value == 2e5


def test_a_stress_that_the_data_do_not_cover_has_no_life_but_a_reason():
    weak = BASQUIN | {"ultimate_strength": "100 MPa"}
    life = analyze(with_springs(count=2, wound=WIRE | {"fatigue": weak})).values["spring_life"]
    assert life.value is None
    assert "above the ultimate strength" in life.reason


@pytest.mark.parametrize(
    ("springs", "reported"),
    [
        ({"count": 2}, "missing: give it, or 'wound'"),
        ({"stiffness": "0.9 N/mm", "wound": WIRE}, "times the rate that is stated"),
        ({"wound": WIRE | {"coil": "2 mm"}}, "at least twice the wire's"),
        ({"stiffness": "0.5 N/mm", "life": 0}, "must be > 0"),
    ],
)
def test_springs_that_contradict_themselves_are_refused(springs, reported):
    with pytest.raises((ValidationError, SpecError), match=reported):
        with_springs(**springs)


def test_the_stress_allowed_in_the_wire_limits_the_deflection():
    spring = CatalogueSpring.model_validate({"name": "s", **WIRE, "max_stress": "500 MPa", "initial_tension": "2 N"})
    wound = ExtensionSpring(1.25e-3, 12.5e-3, 40.0)
    assert wound.stress(2.0 + RATE * spring.offer.largest) == pytest.approx(500e6, rel=1e-12)
    with pytest.raises(ValidationError, match="give 'wire', 'coil' and 'turns'"):
        CatalogueSpring.model_validate({"name": "s", "stiffness": "1 N/mm", "max_stress": "500 MPa"})


def test_a_spring_that_yields_too_soon_is_not_chosen():
    wanted = {"force": "50 N", "stroke": "200 mm", "choose": "catalogue", "catalogue": "generic"}
    plain, safe = (
        design(cam(roller_radius="8 mm", design=wanted | more)).spec for more in ({}, {"spring_safety": 1.5})
    )
    factors = [cfmkit.analyze(spec).values["spring_safety_factor"].value for spec in (plain, safe)]
    assert factors[0] < 1.5 <= factors[1]
    with pytest.raises((ValidationError, SpecError), match="picked from a catalogue"):
        cam(design={"force": "50 N", "stroke": "200 mm", "spring_safety": 1.5})


def test_a_spring_that_does_not_last_is_not_chosen():
    wanted = {"force": "50 N", "stroke": "200 mm", "choose": "catalogue", "spring_life": 1e5}
    common = {"stiffness": "0.55 N/mm", "counts": (2,)}
    names = ({"name": "unknown"}, {"name": "short", "life": 9e4}, {"name": "long", "life": 1.1e5})
    spec = cam(roller_radius="8 mm", rolling_friction=0.002)
    found = design(spec.replace({"design": wanted | {"catalogue": tuple(common | one for one in names)}}))
    assert found.spec.mechanism.springs.name == "long"
    assert analyze(found.spec).values["spring_life"].value == 1.1e5
    none = design(spec.replace({"design": wanted | {"catalogue": tuple(common | one for one in names[:2])}}))
    assert none.status.exit_code == 4
    assert "2 x short: lasts 9e+04 of 1e+05 cycles; 2 x unknown: its life is not known" in none.message


CRANK = """
cfmkit: 1
family: slider-crank
name: crank
mechanism:
  crank_length: 54 mm
  coupler_length: 62.6 mm
  offset: 60 mm
  unloaded_angle: 31 deg
  springs:
    bought:
      - {at: pivot, name: a, count: 2, wound: {wire: 0.8 mm, coil: 4.8 mm, turns: 5}}
      - {at: slider_pin, name: b, wound: {wire: 1 mm, coil: 10 mm, turns: 8}, life: 3e4}
analysis: {drive: force, travel: [0 mm, 35 mm]}
"""


def test_rates_at_joints_follow_from_the_wires_and_each_spring_bears_its_own_couple(tmp_path):
    path = tmp_path / "crank.yaml"
    path.write_text(CRANK)
    found = cfmkit.analyze(cfmkit.load(path))
    one, other = HelicalTorsionSpring(0.8e-3, 4.8e-3, 5.0), HelicalTorsionSpring(1e-3, 10e-3, 8.0)
    springs = found.spec.get_value("mechanism.springs")
    assert springs.pivot == pytest.approx(2 * one.rate, rel=1e-12)
    turned = [found.values[f"{name}_rotation_max"].value for name in ("pivot", "slider_pin")]
    stresses = [wound.stress(wound.rate * turn) for wound, turn in zip((one, other), turned, strict=True)]
    assert found.values["wire_stress_max"].value == pytest.approx(max(stresses), rel=1e-12)
    assert found.values["spring_life"].value == 3e4
    with pytest.raises(SpecError, match="wires of 'bought' give"):
        cfmkit.load(path).replace({"mechanism.springs.pivot": "1 N*mm/rad"})


BARE = {"at": "pivot", "name": "bare", "count": 2}
WITH_WIRE = {"at": "pivot", "name": "wound", "wound": {"wire": "0.8 mm", "coil": "4.8 mm", "turns": 5}}


@pytest.mark.parametrize("bought", [(BARE,), (BARE, WITH_WIRE)])
def test_a_bought_spring_of_unknown_rate_is_refused_at_a_joint_without_a_rate(tmp_path, bought):
    """It counted as no spring, and took one beside it whose wire is known with it."""
    path = tmp_path / "crank.yaml"
    path.write_text(CRANK)
    given = cfmkit.load(path)
    with pytest.raises(SpecError, match=r"springs\.pivot: missing: give it, or 'wound' of every spring bought"):
        given.replace({"mechanism.springs.bought": bought})
    stated = given.replace({"mechanism.springs.pivot": "50 N*mm/rad", "mechanism.springs.bought": bought})
    assert stated.mechanism.springs.pivot == pytest.approx(0.05)


FATIGUE = {"coefficient": "2000 MPa", "exponent": -0.1, "ultimate_strength": "2000 MPa"}
TURNED = {
    "mechanism.coupler_length": "200 mm",
    "mechanism.unloaded_angle": "0 deg",
    "analysis": {"drive": "torque", "angle": ["-60 deg", "60 deg"]},
    "mechanism.springs.bought": (WITH_WIRE | {"wound": WITH_WIRE["wound"] | {"fatigue": FATIGUE}},),
}


@pytest.mark.parametrize(
    ("low", "high", "least"), [(-60, 60, -1.0), (-60, 30, -0.5), (-30, 60, -0.5), (0, 60, 0.0), (-60, 0, 0.0)]
)
def test_a_torsion_spring_that_is_turned_both_ways_is_stressed_both_ways(tmp_path, low, high, least):
    """From -60 to 60 deg its stress reverses; the life was that between 0 and 60 deg, 28 times as long."""
    path = tmp_path / "crank.yaml"
    path.write_text(CRANK)
    given = cfmkit.load(path).replace(TURNED | {"analysis.angle": (f"{low} deg", f"{high} deg")})
    wound = HelicalTorsionSpring(0.8e-3, 4.8e-3, 5.0)
    most = wound.stress(wound.rate * math.radians(60.0))
    amplitude, mean = 0.5 * most * (1 - least), 0.5 * most * (1 + least)
    cycles = 0.5 * (amplitude / (1 - mean / 2000e6) / 2000e6) ** (1 / -0.1)
    found = cfmkit.analyze(given).values
    assert found["wire_stress_max"].value == pytest.approx(most, rel=1e-9)
    assert found["spring_life"].value == pytest.approx(cycles, rel=1e-6)


def test_a_wire_bears_its_share_of_the_rate_that_is_stated(tmp_path):
    """As its torque, and as in a catalogue: a stated rate, which may differ from the wire's by 10 %, holds."""
    path = tmp_path / "crank.yaml"
    path.write_text(CRANK)
    given = cfmkit.load(path).replace(TURNED | {"analysis.angle": ("0 deg", "60 deg")})
    wound = HelicalTorsionSpring(0.8e-3, 4.8e-3, 5.0)
    found = cfmkit.analyze(given.replace({"mechanism.springs.pivot": 1.09 * wound.rate})).values
    most = wound.stress(1.09 * wound.rate * math.radians(60.0))
    assert found["wire_stress_max"].value == pytest.approx(most, rel=1e-9)
    amplitude = 0.5 * most / (1 - 0.5 * most / 2000e6)
    assert found["spring_life"].value == pytest.approx(0.5 * (amplitude / 2000e6) ** -10.0, rel=1e-6)
    assert cfmkit.analyze(given).values["wire_stress_max"].value == pytest.approx(most / 1.09, rel=1e-9)
    three = (*given.mechanism.springs.bought, {**WITH_WIRE, "count": 2})
    shared = given.replace({"mechanism.springs.bought": three, "mechanism.springs.pivot": 3 * 1.09 * wound.rate})
    assert cfmkit.analyze(shared).values["wire_stress_max"].value == pytest.approx(most, rel=1e-9)
