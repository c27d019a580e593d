"""Wire classes against printed tables, buckling against its formula, springs on pins, and lines of real catalogues."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from cam_support import analyze, cam, design
from pydantic import ValidationError

import cfmkit
from cfmkit import Run
from cfmkit.errors import DataError, SpecError
from cfmkit.families import family
from cfmkit.stock.springs.compression_springs import CompressionSpring, buckling_deflection
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.helical_spring_formulas import SEAT_FACTORS
from cfmkit.stock.springs.offers import PIN_SHARE, SERIES_SHARES, generic_series, slimmest_spring, stiffest_rates
from cfmkit.stock.springs.spec import CatalogueSpring, DataSource, offers
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring
from cfmkit.stock.springs.wire_materials import MUSIC_WIRE, WIRES_BY_NAME, WireOutOfRange

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize(
    ("name", "young", "shear"),
    [
        ("music-wire", 206, 81.5),  # EN 10270-1
        ("hard-drawn", 206, 81.5),  # EN 10270-1
        ("oil-tempered", 196.5, 77.2),  # Shigley, Table 10-5
        ("chrome-vanadium", 203.4, 77.2),
        ("chrome-silicon", 203.4, 77.2),
        ("stainless-302", 185, 70),  # 1.4310, Gutekunst, Table 1.1
        ("stainless-17-7ph", 195, 73),  # 1.4568
        ("phosphor-bronze", 115, 42),  # CuSn6
        ("beryllium-copper", 120, 47),  # CuBe2
    ],
)
def test_moduli_are_those_of_the_tables(name, young, shear):
    wire = WIRES_BY_NAME[name]
    assert (wire.youngs_modulus, wire.shear_modulus) == (young * 1e9, shear * 1e9)


def test_music_wire_is_within_the_values_that_shigley_prints_by_diameter():
    """Table 10-5 has G = 82.7 to 80.0 GPa and E = 203.4 to 193 GPa from thin to thick wire."""
    assert 80.0e9 <= MUSIC_WIRE.shear_modulus <= 82.7e9
    assert 193e9 <= MUSIC_WIRE.youngs_modulus <= 1.02 * 203.4e9


@pytest.mark.parametrize(
    ("name", "wire", "strength"),
    [  # A of Table 10-4 is the strength at 1 mm; the others are A / d^m by hand
        ("music-wire", 1.0, 2211),
        ("music-wire", 6.5, 1685.4),
        ("hard-drawn", 4.0, 1370.1),
        ("oil-tempered", 2.0, 1629.5),
        ("chrome-vanadium", 1.0, 2005),
        ("chrome-silicon", 2.0, 1831.6),
        ("stainless-302", 1.0, 1867),
        ("stainless-302", 4.0, 1434.1),
        ("stainless-302", 8.0, 1077.4),
        ("phosphor-bronze", 0.4, 1000),
    ],
)
def test_strengths_are_those_of_shigley(name, wire, strength):
    assert WIRES_BY_NAME[name].tensile_strength(1e-3 * wire) == pytest.approx(1e6 * strength, rel=1e-4)


@pytest.mark.parametrize("name", [name for name, wire in WIRES_BY_NAME.items() if wire.strengths])
def test_a_wire_beyond_its_table_is_refused_by_name_and_range(name):
    wire = WIRES_BY_NAME[name]
    for diameter in (0.99 * wire.thinnest, 1.01 * wire.thickest):
        with pytest.raises(WireOutOfRange, match=rf"{name} is listed from .* to {1e3 * wire.thickest:g} mm"):
            wire.tensile_strength(diameter)
        block = {"name": "x", "wire": diameter, "coil": 8 * diameter, "turns": 10, "material": name}
        with pytest.raises(ValidationError, match=f"{name} is listed from"):
            CatalogueSpring.model_validate(block)
    for diameter in (wire.thinnest, wire.thickest):
        assert wire.tensile_strength(diameter) > 0


def test_a_class_without_a_table_has_moduli_but_no_strength():
    with pytest.raises(WireOutOfRange, match="beryllium-copper has no tensile strength"):
        WIRES_BY_NAME["beryllium-copper"].tensile_strength(1e-3)


def test_music_wire_that_is_too_thick_is_refused_and_other_wire_of_that_diameter_is_not():
    thick = {"wire": "8 mm", "coil": "60 mm", "turns": 10}
    with pytest.raises((SpecError, ValidationError), match=r"listed from 0.1 to 6.5 mm .*'material' hard-drawn"):
        cam(springs={"count": 2, "wound": thick})
    hard = cam(springs={"count": 2, "wound": thick | {"material": "hard-drawn"}})
    own = cam(springs={"count": 2, "wound": thick | {"shear_modulus": "81.5 GPa"}})
    assert hard.mechanism.springs.total == pytest.approx(own.mechanism.springs.total, rel=1e-12)


def test_springs_wound_to_measure_keep_to_the_diameters_of_the_table():
    assert slimmest_spring(ExtensionSpring, 1e5, 0.02, 5.0) is None  # 2000 N take 7.2 mm or more
    assert 4e-3 < slimmest_spring(ExtensionSpring, 5e4, 0.02, 5.0).wire <= MUSIC_WIRE.thickest
    (rate,) = stiffest_rates(HelicalTorsionSpring, np.array([1.0]), 1.0, 1.0)
    assert slimmest_spring(HelicalTorsionSpring, 0.98 * rate, 1.0, 1.0).wire <= MUSIC_WIRE.thickest
    assert slimmest_spring(HelicalTorsionSpring, 1.02 * rate, 1.0, 1.0) is None


COIL = {"wire": "1 mm", "coil": "10 mm", "turns": 20}
LINES = [
    # the line of a report; 0.5094 N/mm is 81.5 GPa d^4/(8 D^3 n)
    {"kind": "extension", "stiffness": "0.5094 N/mm", **COIL},
    {"kind": "extension", "stiffness": "0.5094 N/mm", **COIL, "initial_tension": "3.2 N", "free_length": "39 mm"},
    # the same spring of 302 by Shigley's 69 GPa and by a maker's 70 GPa
    {"kind": "extension", "stiffness": "0.431 N/mm", **COIL, "material": "stainless-302"},
    {"kind": "extension", "stiffness": "0.4375 N/mm", **COIL, "material": "stainless-302"},
    # music wire with the 79.3 GPa (11.5 Mpsi) of American makers
    {"kind": "compression", "stiffness": "0.4956 N/mm", **COIL, "outer_diameter": "11 mm"},
    # a torsion spring by Shigley's 10.8 instead of 64/(2 pi), with his 200 GPa, and by EN 13906-3
    {"kind": "torsion", "rate": "58.95 N*mm/rad", **COIL, "turns": 5},
    {"kind": "torsion", "rate": "64.38 N*mm/rad", **COIL, "turns": 5},
]


@pytest.mark.parametrize("line", LINES)
def test_a_correct_line_of_a_catalogue_is_accepted(line):
    spring = CatalogueSpring.model_validate({"name": "real"} | line)
    assert spring.offer.rate == pytest.approx(spring.offer.wound.rate, rel=0.1)


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"stiffness": "0.45 N/mm"}, "1.13 times the rate"),  # of 72 GPa
        ({"stiffness": "0.05094 N/mm"}, "10 times the rate"),
        ({"coil": "11 mm"}, "times the rate"),  # the outer diameter
        ({"material": "stainless-302"}, r"that of music-wire, hard-drawn.* agrees"),
        ({"outer_diameter": "10 mm"}, "'outer_diameter' must be 'coil'"),
        ({"body_length": "10 mm"}, "less than the turns on each other"),
        ({"free_length": "15 mm"}, "less than the turns on each other"),
        ({"kind": "torsion", "stiffness": None, "free_length": "15 mm"}, "less than the turns on each other"),
        ({"material": "spring-steel"}, "Input should be 'music-wire'"),
        ({"kind": "compression", "free_length": "40 mm", "max_elongation": "30 mm"}, "more than 'free_length' leaves"),
        ({"kind": "compression", "guide_rod": "9.5 mm"}, "'guide_rod' must be thinner"),
        ({"kind": "compression", "guide_tube": "10 mm"}, "'guide_tube' must be wider"),
        ({"initial_tension": "20 N"}, "'initial_tension' of 20 N cannot be wound"),
        ({"guide_rod": "7 mm"}, "'guide_rod' is for compression springs"),
        ({"kind": "compression", "initial_tension": "1 N"}, "'initial_tension' is of extension springs"),
    ],
)
def test_a_wrong_line_of_a_catalogue_is_refused(change, reported):
    with pytest.raises(ValidationError, match=reported):
        CatalogueSpring.model_validate({"name": "wrong"} | LINES[0] | change)


def test_a_file_has_columns_for_material_and_guide(tmp_path):
    text = "name,kind,wire [mm],coil [mm],turns,free_length [mm],material,seats,guide_rod [mm]\n"
    (tmp_path / "a.csv").write_text(text + "C,compression,1,8,20,60,stainless-302,fixed-pivoted,6\n")
    (one,) = offers(DataSource("a.csv", tmp_path), CompressionSpring)
    assert (one.wound.material, one.seats, one.guide_rod) == ("stainless-302", "fixed-pivoted", 0.006)
    assert one.rate == pytest.approx(70e9 * 1e-3**4 / (8 * 8e-3**3 * 20))
    (tmp_path / "b.csv").write_text(text + "C,compression,7,50,20,600,,,\n")
    with pytest.raises(DataError, match=r"b\.csv:2: .*music-wire is listed from 0\.1 to 6\.5 mm"):
        offers(DataSource("b.csv", tmp_path), CompressionSpring)


@pytest.mark.parametrize("seats", SEAT_FACTORS)
def test_a_slender_spring_buckles_like_a_soft_column(seats):
    """For L >> D the deflection goes to pi^2 D^2 E/(alpha^2 L (2G + E)) / 2: Euler's load of the spring as a bar."""
    young, shear = 206e9, 81.5e9
    length, coil, alpha = 1.0, 2e-3, SEAT_FACTORS[seats]
    euler = 0.5 * math.pi**2 * coil**2 * young / (alpha**2 * length * (2 * shear + young))
    assert buckling_deflection(length, coil, seats) == pytest.approx(euler, rel=1e-3)


def test_buckling_is_the_formula_of_en_13906_1():
    """s_K = L0 0.5/(1 - G/E) (1 - sqrt(1 - (1 - G/E)/(0.5 + G/E) (pi D/(nu L0))^2)), written as the standard has it."""
    g = 81.5 / 206
    for length, nu, seats in ((20.1e-3, 0.5, "fixed-fixed"), (30e-3, 1.0, "pivoted-pivoted")):
        root = math.sqrt(1 - (1 - g) / (0.5 + g) * (math.pi * 3e-3 / (nu * length)) ** 2)
        spring = CompressionSpring(0.5e-3, 3e-3, 16.0)
        assert spring.unguided_deflection(length, spring, None, seats) == pytest.approx(
            length * 0.5 / (1 - g) * (1 - root), rel=1e-12
        )


def test_a_spring_is_stable_up_to_the_slenderness_of_shigley():
    """L0 < 2.63 D/alpha for steel [eq. 10-13, with 30 and 11.5 Mpsi]; with 206 and 81.5 GPa 2.58."""
    american = (30.0, 11.5)
    assert buckling_deflection(2.62 / 0.5, 1.0, moduli=american) == math.inf
    assert buckling_deflection(2.64 / 0.5, 1.0, moduli=american) < 5.28
    assert buckling_deflection(2.58 / 0.5, 1.0) == math.inf
    assert buckling_deflection(2.59 / 0.5, 1.0) < 5.18


def test_of_the_generic_series_what_buckles_comes_with_a_rod_that_fits():
    series = generic_series(CompressionSpring)
    for one in series:
        limit = buckling_deflection(one.free_length, one.wound.coil)
        assert (one.guide_rod is not None) == (limit < one.largest)
        if one.guide_rod is not None:
            assert 0.85 * one.wound.inner_diameter < one.guide_rod < 0.951 * one.wound.inner_diameter
    assert 0 < sum(one.guide_rod is None for one in series) < len(series)


def test_loops_of_the_generic_series_are_below_what_shigley_allows_in_bending():
    """[Shigley, eq. 10-34] with the mean radius of a full loop D/2: sigma_A = F (K_A 16 D/(pi d^3) + 4/(pi d^2))."""
    for one in generic_series(ExtensionSpring):
        d, c = one.wound.wire, one.wound.index
        curved = (4 * c * c - c - 1) / (4 * c * (c - 1))
        load = one.rate * one.largest
        stress = load * (curved * 16 * one.wound.coil / (math.pi * d**3) + 4 / (math.pi * d**2))
        assert stress < 0.75 * MUSIC_WIRE.tensile_strength(d)
        assert one.stress(one.largest) == pytest.approx(SERIES_SHARES["shear"] * MUSIC_WIRE.tensile_strength(d))


@pytest.fixture(scope="module")
def vcfm():
    return cfmkit.load(CONFIGS / "vcfm_bought_springs.yaml")


SLENDER = {
    "kind": "compression",
    "count": 2,
    "free_length": "20.1 mm",
    "wound": {"wire": "0.5 mm", "coil": "3 mm", "turns": 16},
}
"""What the config had: two springs that buckle at 6.03 mm, and are pressed by 6.9 mm."""


def buckles(spec, **changes):
    springs = SLENDER | changes
    found = cfmkit.analyze(spec.replace({"mechanism.springs": springs, "design": None, "requirements": ()}))
    return [one for one in found.warnings if one.name == "spring_buckles"]


def test_a_spring_that_buckles_is_reported_with_the_rod_that_cures_it(vcfm):
    (one,) = buckles(vcfm)
    assert "buckles when it is deflected by 6.026 mm (ends fixed-fixed), and is deflected by 6.898 mm" in one.message
    assert one.cures == ("mechanism.springs.guide_rod=2.25 mm",)
    assert not buckles(vcfm, guide_rod="2.25 mm")
    assert not buckles(vcfm, guide_tube="4 mm")
    assert not buckles(vcfm, wound={"wire": "0.8 mm", "coil": "6 mm", "turns": 8})
    assert buckles(vcfm, seats="pivoted-pivoted", wound={"wire": "0.8 mm", "coil": "6 mm", "turns": 8})


def test_a_guide_with_much_clearance_is_none(vcfm):
    """A rod of 1 mm in a spring of 2.5 mm was accepted: it lets the spring bow by 0.75 mm."""
    (one,) = buckles(vcfm, guide_rod="1.9 mm")
    assert "the guide stated is too loose (a rod from 2 mm, a tube up to 4.2 mm)" in one.message
    assert one.cures == ("mechanism.springs.guide_rod=2.25 mm",)
    assert not buckles(vcfm, guide_rod="2 mm")
    assert buckles(vcfm, guide_tube="4.3 mm")
    assert not buckles(vcfm, guide_tube="4.2 mm")
    assert not buckles(vcfm, guide_rod="1.9 mm", guide_tube="4.2 mm")


def test_the_loops_of_extension_springs_have_a_stress_of_their_own():
    """In full loops bending is far above the shear in the turns, which alone was reported."""
    spec = cfmkit.load(CONFIGS / "studies/cam_bought_parts.yaml")
    values = cfmkit.analyze(spec).values
    wire = spec.mechanism.springs.wound
    load = math.pi * wire.wire**3 / (8 * wire.coil) * values["wire_stress_max"].value
    index = wire.coil / wire.wire
    load /= (4 * index - 1) / (4 * index - 4) + 0.615 / index
    bending = (4 * index**2 - index - 1) / (4 * index * (index - 1)) * 16 * load * wire.coil / (math.pi * wire.wire**3)
    assert values["loop_stress_max"].value == pytest.approx(bending + 4 * load / (math.pi * wire.wire**2), rel=1e-9)
    assert "loop_stress_max" not in cfmkit.analyze(cfmkit.load(CONFIGS / "vcfm_bought_springs.yaml")).values


def test_without_its_wire_a_spring_is_judged_by_its_outer_diameter(vcfm):
    known = {"kind": "compression", "count": 2, "stiffness": "1.3 N/mm", "free_length": "40 mm", "wound": None}
    assert buckles(vcfm, **known, outer_diameter="3.5 mm")
    assert not buckles(vcfm, **known, outer_diameter="9 mm")
    assert not buckles(vcfm, **known)


def test_no_shipped_config_presses_a_spring_until_it_buckles(vcfm):
    springs = vcfm.mechanism.springs
    farthest = cfmkit.analyze(vcfm).values["spring_deflection_max"].value
    assert farthest <= springs.unguided or springs.is_guided


@pytest.mark.slow
def test_a_design_takes_springs_that_stand_alone_before_those_that_need_a_rod(vcfm):
    stands = {"name": "stands", "kind": "compression", "wire": "1 mm", "coil": "8 mm", "turns": 8, "counts": (1,)}
    buckling = {"name": "buckles", "kind": "compression", "wire": "0.5 mm", "coil": "3 mm", "turns": 16, "counts": (2,)}
    listed = (stands | {"free_length": "27 mm"}, buckling | {"free_length": "20.1 mm"})

    def made(*catalogue):
        wanted = {"design.catalogue": catalogue, "design.refine": False, "design.rise": "4.6 mm", "requirements": ()}
        return family("vcfm").design.make(vcfm.replace(wanted), Run())

    assert made(*listed).spec.mechanism.springs.name == "stands"
    alone = made(listed[1])
    assert alone.spec.mechanism.springs.guide_rod == pytest.approx(0.00225)
    assert "guided on a rod of 2.25 mm" in alone.message
    held = made(listed[1] | {"guide_tube": "4 mm"})
    assert held.spec.mechanism.springs.guide_tube == pytest.approx(0.004)
    assert held.spec.mechanism.springs.guide_rod is None


def test_a_torsion_spring_becomes_narrower_and_longer_as_its_wire_is_conserved():
    spring = HelicalTorsionSpring(1e-3, 10e-3, 5.0)
    turned = math.radians(120)
    turns = 5.0 + 120 / 360
    mean = spring.inner_diameter_at(turned) + spring.wire
    assert math.pi * mean * turns == pytest.approx(math.pi * spring.coil * spring.turns, rel=1e-12)
    assert spring.room_for(turned) == pytest.approx((turns + 1) * spring.wire, rel=1e-12)


@pytest.mark.parametrize(("pin", "binds"), [("4.2 mm", False), ("4.3 mm", True)])
def test_a_spring_that_is_wound_up_must_fit_over_its_pin(pin, binds):
    """Relaxed both pins fit into 4.41 mm; wound up by 81.43 deg the spring is 4.271 mm wide inside."""
    spec = cfmkit.load(CONFIGS / "slider_crank_bought.yaml")
    found = cfmkit.analyze(spec.replace({"mechanism.pins": {"diameter": pin}, "design": None, "requirements": ()}))
    reported = [one.message for one in found.warnings if one.name == "spring_binds_on_pin"]
    assert bool(reported) == binds
    assert all("at the crank pin is 4.41 mm wide inside, wound up by 81.43 deg 4.271 mm" in one for one in reported)


@pytest.mark.slow
def test_a_design_takes_springs_that_fit_over_the_pins():
    spec = cfmkit.load(CONFIGS / "slider_crank_bought.yaml").replace({"mechanism.pins": {"diameter": "5 mm"}})
    found = family("slider-crank").design.make(spec, Run())
    result = cfmkit.analyze(found.spec)
    assert "spring_binds_on_pin" not in {one.name for one in result.warnings}
    for one in found.spec.mechanism.springs.bought:
        turned = result.values[f"{one.at}_rotation_max"].value
        assert PIN_SHARE * one.coil.inner_diameter_at(turned) >= 5e-3


def test_a_spring_wound_to_measure_fits_over_its_pin():
    free, around = (
        slimmest_spring(HelicalTorsionSpring, 0.05, 1.0, 0.05),
        slimmest_spring(HelicalTorsionSpring, 0.05, 1.0, 0.05, pin=6e-3),
    )
    assert PIN_SHARE * free.inner_diameter_at(1.0) < 6e-3
    assert PIN_SHARE * around.inner_diameter_at(1.0) >= 6e-3
    assert around.rate == pytest.approx(0.05, rel=0.005 / around.turns)


CRANK = {
    "crank_length": "54 mm",
    "stretched_position": "100 mm",
    "offset": "60 mm",
    "unloaded_angle": "0.542 rad",
    "springs": {
        "bought": (
            {
                "at": "slider",
                "name": "pushed",
                "loaded": "compression",
                "free_length": "80 mm",
                "wound": {"wire": "0.5 mm", "coil": "6 mm", "turns": 30},
            },
        )
    },
}


def test_a_compression_spring_at_the_slider_buckles_too():
    analysis = {"drive": "force", "travel": ("0 mm", "35 mm")}
    data = {"family": "slider-crank", "name": "x", "mechanism": CRANK, "analysis": analysis}
    spec = family("slider-crank").spec_type.model_validate(data)
    (one,) = [one for one in cfmkit.analyze(spec).warnings if one.name == "spring_buckles"]
    assert one.cures == ("mechanism.springs.bought.0.guide_rod=4.95 mm",)
    cured = spec.replace({"mechanism.springs.bought.0.guide_rod": 4.95e-3})
    assert "spring_buckles" not in {one.name for one in cfmkit.analyze(cured).warnings}


def test_initial_tension_is_no_elongation():
    """126 mm long between axes 136 mm apart: 10 mm at the start, and 2 (x - x0) more; 2 N at 0.4 N/mm would be 5."""
    bought = {"name": "T", "stiffness": "0.4 N/mm", "free_length": "126 mm", "initial_tension": "2 N", "counts": (2,)}
    spec = cam(roller_radius="8 mm", rolling_friction=0.0)
    wanted = {"force": "50 N", "stroke": "200 mm", "choose": "catalogue", "catalogue": (bought,)}
    found = design(spec.replace({"design": wanted}))
    springs, result = found.spec.mechanism.springs, analyze(found.spec)
    assert (springs.preload, springs.initial_tension) == pytest.approx((0.010, 2.0))
    assert found.spec.mechanism.profile.preload == pytest.approx(0.015)
    np.testing.assert_allclose(result.curve.force, 50.0, rtol=1e-9)
    opened = result.curve.extra["spring_elongation"].values
    x = result.curve.extra["roller_x"].values
    np.testing.assert_allclose(opened, 0.010 + 2.0 * (x - 0.068), rtol=1e-9)
    longest = result.values["spring_elongation_max"].value
    assert longest == pytest.approx(opened.max())
    # the work of the springs is that of the slider
    gained = 2 * (2.0 * (longest - 0.010) + 0.5 * 400.0 * (longest**2 - 0.010**2))
    assert gained == pytest.approx(50.0 * 0.2, rel=1e-6)
    # a limit just above the elongation holds, one between it and the sum does not
    assert design(
        spec.replace({"design": wanted | {"catalogue": (bought | {"max_elongation": 1.0001 * longest},)}})
    ).spec
    short = bought | {"max_elongation": 0.999 * longest}
    assert "spring overstretched" in design(spec.replace({"design": wanted | {"catalogue": (short,)}})).message


def test_what_pulls_with_initial_tension_moves_as_what_is_stretched_more():
    tight = cam(springs={"stiffness": "0.4 N/mm", "count": 2, "preload": "10 mm", "initial_tension": "2 N"})
    same = cam(springs={"stiffness": "0.4 N/mm", "count": 2, "preload": "15 mm"})
    one, other = analyze(tight), analyze(same)
    np.testing.assert_allclose(one.curve.force, other.curve.force, rtol=1e-12)
    less = other.values["spring_elongation_max"].value - one.values["spring_elongation_max"].value
    assert less == pytest.approx(0.005)
