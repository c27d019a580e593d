"""Bought springs beside snap-through leaves: their law in every model, their choice, and what is said of them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit import Run
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.families.vcfm import exact_model
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
from cfmkit.results import Status
from cfmkit.stock.springs import CompressionSpring, generic_series

FATIGUE = "mechanism.material.fatigue"
CONFIG = Path(__file__).parents[2] / "configs" / "vcfm_bought_springs.yaml"


@pytest.fixture(scope="module")
def spec():
    return cfmkit.load(CONFIG)


def designed(spec, **changes):
    changes = {f"design.{key}": value for key, value in changes.items()}
    return family("vcfm").design.make(spec.replace({"design.refine": False} | changes), Run())


def test_springs_add_their_rate_and_nothing_below_their_free_length():
    law = Coils(1000.0, 2.0)
    assert law.force(np.array([-1e-3, 0.0, 1e-3])) == pytest.approx([0.0, 0.0, 3.0])
    assert not law.stress(np.array([1e-3])).any()


def test_a_diamond_of_the_same_rate_gives_the_same_curve(spec):
    """The leaves do not know what pushes back."""
    found = cfmkit.analyze(spec)
    rate = found.values["positive_stiffness"].value
    leaf = {"length": "30 mm", "angle": "7 deg", "thickness": "1.5 mm", "width": 0.01, "structure": "diamond"}
    plain = spec.replace({"mechanism.springs": None, "mechanism.positive": leaf, "design": None})
    width = 0.01 * rate / cfmkit.analyze(plain).values["positive_stiffness"].value
    same = cfmkit.analyze(plain.replace({"mechanism.positive.width": width}))
    assert same.curve.effort == pytest.approx(found.curve.effort, rel=1e-9, abs=1e-9)
    assert same.values["constant_force"].value == pytest.approx(found.values["constant_force"].value, rel=1e-9)


def test_the_exact_model_takes_the_springs_as_they_are(spec):
    exact = cfmkit.analyze(spec.replace({"analysis.fidelity": "exact"}))
    springs = spec.mechanism.springs
    assert exact.values["positive_stiffness"].value == pytest.approx(springs.count * springs.rate, rel=1e-12)
    assert exact.values["spring_stress_max"].value is None
    place = exact.curve.motion - 0.002
    middle = int(np.argmin(np.abs(place)))
    pressed = exact.curve.extra["spring_force"].values[middle]
    assert pressed == pytest.approx(springs.count * springs.rate * exact.curve.motion[middle], rel=1e-12)


def test_the_wire_bears_travel_and_preload_together(spec):
    found, springs = cfmkit.analyze(spec), spec.mechanism.springs
    most = 4.888e-3 + 2.0103e-3
    assert found.values["spring_deflection_max"].value == pytest.approx(most, rel=1e-12)
    wound = springs.coil
    assert found.values["wire_stress_max"].value == pytest.approx(wound.stress(springs.rate * most), rel=1e-12)
    columns = {column.name: column.cells() for column in found.tables["parts"]().columns}
    assert list(zip(columns["source"], columns["count"], strict=True)) == [("make", 1), ("buy", 1)]


def test_slack_and_overstretched_springs_are_told(spec):
    pulled = cfmkit.analyze(spec.replace({"analysis.preloads": (0.0, -1e-3)}))
    assert "spring_slack" in {item.name for item in pulled.warnings}
    assert pulled.load_cases[0].motion[0] == 0.0  # the shuttle rests where it was made: slack springs do not pull
    over = cfmkit.analyze(spec.replace({"mechanism.springs.max_elongation": "6 mm"}))
    (reported,) = [item.message for item in over.warnings if item.name == "spring_overstretched"]
    assert "deflected by 6.898 mm, their limit is 6 mm, reached at 3.99 mm of travel" in reported


def test_a_compression_spring_gets_no_shorter_than_its_turns_on_each_other(spec):
    springs = spec.mechanism.springs
    room = springs.free_length - springs.coil.body_length
    pressed = cfmkit.analyze(spec.replace({"analysis.preloads": (0.0, 12e-3)}))
    assert pressed.status is Status.PARTIAL
    assert "its turns touch" in pressed.message
    assert "'mechanism.springs.free_length' of 27.89 mm" in pressed.message
    assert pressed.curve.motion[-1] == pytest.approx(4.888e-3)
    assert room * 0.99 < pressed.load_cases[0].motion[-1] + 12e-3 <= room * (1 + 1e-9)
    closed = cfmkit.analyze(spec.replace({"analysis.preloads": (60e-3,)}))
    assert closed.status is Status.NO_EQUILIBRIUM
    reported = float(re.search(r"free_length'\s+of ([0-9.]+) mm", pressed.message)[1])
    cured = pressed.spec.replace({"mechanism.springs.free_length": f"{reported} mm"})
    assert cfmkit.analyze(cured).status is Status.COMPLETE


def test_a_design_does_not_press_its_own_springs_until_their_turns_touch(spec):
    wire = {"wire": "1 mm", "coil": "10 mm", "turns": 9, "shear_modulus": "72 GPa"}
    springs = {"kind": "compression", "stiffness": "1 N/mm", "free_length": "19 mm", "wound": wire}
    own = spec.replace({"mechanism.springs": springs, "design": None, "requirements": ()})
    own = own.replace({"design": {"force": "5 N", "adjustment": "3 N", "stroke": "4 mm", "refine": False}})
    refused = family("vcfm").design.make(own, Run())
    assert refused.status is Status.INFEASIBLE
    assert "deflected by 8.333 mm, their turns touch at 7 mm" in refused.message
    longer = own.replace({"mechanism.springs.free_length": "21 mm", "analysis.travel": "7.2 mm"})
    made = family("vcfm").design.make(longer, Run())  # the stated travel closes them: what is analysed says so
    assert made.status is Status.COMPLETE
    assert "spring_closed" in {item.name for item in cfmkit.analyze(made.spec).warnings}
    assert made.spec.mechanism.frame == own.mechanism.frame


def test_the_initial_tension_of_extension_springs_carries_a_part_of_the_force(spec):
    rate = generic_series(CompressionSpring)[0].rate
    offer = {"name": "pull", "kind": "extension", "stiffness": f"{rate / 1000} N/mm", "initial_tension": "1 N"}
    hung = spec.replace({"mechanism.springs": {"kind": "extension", "stiffness": "1 N/mm"}})
    found = designed(hung, catalogue=(offer | {"counts": (1, 2)},), rise=None, preload=None, spring_room=None)
    made = found.spec.mechanism
    total = made.springs.count * made.springs.rate
    h = made.bistable.length * np.sin(made.bistable.angle)
    assert total * h + made.springs.count == pytest.approx(11.15, rel=1e-9)
    assert cfmkit.analyze(found.spec).values["constant_force"].value == pytest.approx(11.15, rel=1e-9)


@pytest.mark.parametrize("preloads", [None, ("1 mm", "3 mm")])
@pytest.mark.parametrize("kind", ["extension", "compression"])
def test_a_design_counts_the_life_of_a_spring_as_its_own_analysis_does(spec, kind, preloads):
    """Relaxed springs have no load, whatever their initial tension; a cycle is one at one preload."""
    wire = {"coefficient": "700 MPa", "exponent": -0.1, "ultimate_strength": "1500 MPa"}
    offer = {
        "name": "one",
        "kind": kind,
        "wire": "0.9 mm",
        "coil": "8 mm",
        "turns": 11,
        "counts": (1,),
        "fatigue": wire,
    }
    offer |= {"initial_tension": "4 N"} if kind == "extension" else {}
    analysis = {} if preloads is None else {"preloads": preloads}
    springs = {"kind": kind, "stiffness": "1 N/mm"}
    start = spec.replace({"mechanism.springs": springs, "analysis": analysis, "requirements": ()})
    wanted = {"force": "9 N", "adjustment": "3 N", "stroke": "4 mm", "refine": False, "catalogue": (offer,)}

    def lasting(life):
        return family("vcfm").design.make(start.replace({"design": wanted | {"spring_life": life}}), Run())

    life = cfmkit.analyze(lasting(1e3).spec).values["spring_life"].value
    assert lasting(0.98 * life).status is Status.COMPLETE
    reported = re.search(r"lasts (\S+) of", lasting(1.02 * life).message)
    assert reported is not None
    assert float(reported[1]) == pytest.approx(life, rel=0.01)


@pytest.mark.parametrize("rise", [4.5e-3, 6e-3])
def test_of_generic_springs_the_one_nearest_to_the_largest_rise_is_taken(spec, rise):
    found = designed(spec, rise=rise)
    made = found.spec.mechanism
    h = made.bistable.length * np.sin(made.bistable.angle)
    most = cfmkit.analyze(found.spec).values["spring_deflection_max"].value
    # springs with a rise between this one and the limit are too long, are deflected too far, or would need a guide
    nearer = [
        one
        for one in generic_series(CompressionSpring)
        for count in one.counts
        if h * (1 + 1e-6) < 11.15 / (one.rate * count) <= rise
    ]
    assert h <= rise
    assert all(one.free_length > 30e-3 or min(one.largest, one.unguided) < most for one in nearer)
    assert made.springs.free_length <= 30e-3
    assert made.springs.max_elongation >= most
    assert "the rise of the leaves follows from their rate" in found.message


def test_an_analysis_that_is_stated_for_other_springs_is_told_of(spec):
    stiffer = {"name": "stiffer", "kind": "compression", "stiffness": "1.4 N/mm", "max_elongation": "12 mm"}
    assert "'analysis' is stated for 2.01 mm: leave it out" in designed(spec, catalogue=(stiffer,)).message
    assert "'analysis' is stated" not in designed(spec).message


def test_where_none_fits_the_nearest_three_are_told(spec):
    soft = [
        {"name": f"s{k}", "kind": "compression", "stiffness": f"{k} N/mm", "counts": (1,)} for k in (1, 2, 30, 40, 50)
    ]
    found = designed(spec, catalogue=tuple(soft))
    assert found.status.exit_code == 4
    assert "1 x s2: too soft, they need a rise of 5.575 mm ('design.rise' 4.5 mm)" in found.message
    assert "2 others miss by more" in found.message
    torsion = ({"name": "t", "kind": "torsion", "rate": "1 N*mm/rad"},)
    assert "it lists no spring of the required kind" in designed(spec, catalogue=torsion).message


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"mechanism.springs": None}, "needs 'positive', a spring of leaves, or 'springs' that are bought"),
        ({"mechanism.springs.initial_tension": "1 N"}, "of extension springs; this is of kind 'compression'"),
        ({"analysis.fidelity": "truss"}, "truss laws are for 'diamond'"),
        (
            {"design.catalogue": (), "design.spring_life": 1e5},
            "only to springs picked from a catalogue: give 'catalogue', too",
        ),
        ({"design.preload": "2 mm"}, "give either 'preload' or 'rise'"),
        (
            {"mechanism.positive": {"length": "30 mm", "thickness": "1 mm", "width": "1 mm"}},
            "give either 'positive', a spring of leaves, or 'springs' that are bought",
        ),
        (
            {FATIGUE: {"ultimate_strength": "60 MPa", "points": [[1e3, "80 MPa"], [1e5, "35 MPa"]]}},
            "above 'ultimate_strength'",
        ),
        (
            {FATIGUE: {"ultimate_strength": "60 MPa", "points": [[1e3, "40 MPa"], [1e5, "35 MPa"]], "cycles": 1e6}},
            "at which 'points' end",
        ),
    ],
)
def test_what_contradicts_itself_is_refused(spec, changes, reported):
    with pytest.raises(SpecError, match=reported):
        spec.replace(changes)


def test_a_design_follows_leaves_back_only_as_far_as_a_long_preload_pushes_them(spec, monkeypatch):
    """The springs are pressed by 58 mm, and push leaves with a rise of 4.3 mm back by a few of them."""

    def asked(made, end, back):
        raise RuntimeError(f"{back}")

    monkeypatch.setattr(exact_model, "ExactSampler", asked)
    listed = [{"name": "long", "kind": "compression", "stiffness": "1.302 N/mm", "counts": [2]}]
    with pytest.raises(RuntimeError) as back:
        family("vcfm").design.make(spec.replace({"design.catalogue": listed, "design.adjustment": "150 N"}), Run())
    assert 1e-3 < float(str(back.value)) < 15e-3


def test_a_leaf_is_traced_once_with_whichever_springs_stand_beside_it(spec):
    from cfmkit.families.vcfm.exact_model import ExactSampler

    stiffer = spec.replace({"mechanism.springs.count": 4})
    longer = spec.replace({"mechanism.bistable.length": 1.01 * spec.mechanism.bistable.length})
    one, same, other = (ExactSampler(each, 5e-3, 1e-3) for each in (spec, stiffer, longer))
    assert same.pushed is one.pushed
    assert same.pulled is one.pulled
    assert other.pushed is not one.pushed
    wide = {"mechanism.wide_beams": True, "analysis.fidelity": "exact"}
    assert ExactSampler(spec.replace(wide), 5e-3, 1e-3).pushed is not one.pushed


@pytest.mark.slow
def test_the_refined_design_keeps_force_and_stress_by_the_exact_model(spec):
    found = family("vcfm").design.make(spec, Run())
    exact = cfmkit.analyze(found.spec.replace({"analysis.fidelity": "exact"}))
    assert exact.values["window_force"].value == pytest.approx(11.15, rel=2e-3)
    assert exact.values["travel_stress_max"].value <= 30e6 * 1.0002


def test_leaves_that_relax_beside_springs_that_do_not_have_no_common_law(spec):
    relaxing = {"mechanism.material.relaxation": {"terms": [["20 %", "10 h"]]}}
    assert spec.replace(relaxing).durability is None
    leaf = {"length": "30 mm", "angle": "7 deg", "thickness": "1.5 mm", "width": "10 mm"}
    cut = spec.replace({"mechanism.springs": None, "mechanism.positive": leaf, "design": None})
    assert cut.replace(relaxing).durability.relaxation is not None


# --- drawn -------------------------------------------------------------------------------------------------------


def boxes(bodies, name, pose):
    """Return corners of the boxes around all bodies of a name, from the left, (n, 2, 2) [m]."""
    outlines = [body.outline(pose) for body in bodies if body.name == name]
    return np.array(sorted(([line.min(axis=0), line.max(axis=0)] for line in outlines), key=lambda box: box[0][0]))


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize(("kind", "carrier", "side"), [("compression", "shuttle", -1.0), ("extension", "beam", 1.0)])
def test_bought_springs_are_drawn_side_by_side_between_what_moves_and_their_base(spec, kind, carrier, side, count):
    """Those that are pressed below the shuttle, and shorter at the end; those that are pulled above, and longer."""
    changes = {"kind": kind, "count": count, "wound": None}
    changes = {f"mechanism.springs.{key}": value for key, value in changes.items()}
    changed = spec.replace(changes | {"design": None, "requirements": ()})
    bodies, diameter = family("vcfm").part(cfmkit.analyze(changed)).bodies, changed.mechanism.springs.outer_diameter
    half_wire, lengths = 0.03 * diameter, []
    for pose in (0, -1):
        springs = boxes(bodies, "spring", pose)
        (base,), (moving,) = (boxes(bodies, name, pose) for name in ("base", carrier))
        assert np.ptp(springs[..., 0], axis=1).tolist() == pytest.approx([diameter] * count, rel=0.02)
        assert (springs[1:, 0, 0] > springs[:-1, 1, 0]).all()
        margins = springs[0, 0, 0] - base[0, 0], base[1, 0] - springs[-1, 1, 0]
        assert 0.0 < margins[0] < 0.5 * diameter
        assert margins[0] == pytest.approx(margins[1], rel=1e-6)
        near, far = sorted(side * springs[0, :, 1])
        assert near == pytest.approx((side * moving[:, 1]).max(), abs=1.01 * half_wire)
        assert far == pytest.approx((side * base[:, 1]).min(), abs=1.01 * half_wire)
        lengths.append(far - near)
    deflection = changed.travel + changed.analysis.preloads[-1]
    assert lengths[1] - lengths[0] == pytest.approx(side * deflection, rel=0.02)
