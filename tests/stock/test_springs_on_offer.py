"""Springs that can be bought: formulas of round wire, lists and files, and what designs choose of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from cam_support import analyze, cam, design
from pydantic import ValidationError

import cfmkit
from cfmkit.errors import DataError, SpecError
from cfmkit.stock.springs.compression_springs import CompressionSpring
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.kinds import HELICAL_KINDS
from cfmkit.stock.springs.offers import Miss, describe_nearest, generic_series
from cfmkit.stock.springs.spec import CatalogueSpring, DataSource, offers
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring

CONFIGS = Path(__file__).parents[2] / "configs"
WANTED = {"force": "50 N", "stroke": "200 mm", "choose": "catalogue"}


@pytest.mark.parametrize("spring_type", HELICAL_KINDS.values())
def test_the_generic_series_written_as_a_list_is_the_same_series(spring_type):
    assert offers(tuple(map(CatalogueSpring.from_offer, generic_series(spring_type))), spring_type) == generic_series(
        spring_type
    )


def chosen(catalogue, **changes):
    parts = {"roller_radius": "8 mm", "rolling_friction": 0.002} | changes
    return design(cam(**parts).replace({"design": WANTED | {"catalogue": catalogue}}))


def test_the_rate_of_a_coil_is_the_twist_of_a_long_straight_wire():
    """Castigliano: the wire of length pi D n carries the torque F D/2, or the bending moment M."""
    d, mean, n, shear, young = 1e-3, 10e-3, 25.0, 72e9, 190e9
    length, polar, plane = math.pi * mean * n, math.pi * d**4 / 32, math.pi * d**4 / 64
    pulled, wound = (spring_type(d, mean, n, shear, young) for spring_type in (ExtensionSpring, HelicalTorsionSpring))
    assert pulled.rate == pytest.approx(shear * polar / (length * (mean / 2) ** 2), rel=1e-12)
    assert wound.rate == pytest.approx(young * plane / length, rel=1e-12)


def test_far_from_its_axis_a_coil_is_stressed_as_a_straight_wire():
    wire = 1e-3
    far = CompressionSpring(wire, 1000 * wire, 5.0)
    assert far.stress(1.0) == pytest.approx(16 * 0.5 * far.coil / (math.pi * wire**3), rel=2e-3)
    bent = HelicalTorsionSpring(wire, 1000 * wire, 5.0)
    assert bent.stress(1.0) == pytest.approx(32 / (math.pi * wire**3), rel=2e-3)
    assert far.stress(far.rate * far.deflection_at(300e6)) == pytest.approx(300e6, rel=1e-12)


def test_a_spring_that_is_too_long_for_its_place_is_not_chosen():
    short = {"name": "short", "stiffness": "0.55 N/mm", "free_length": "130 mm", "counts": (2,)}
    long = {"name": "long", "stiffness": "0.40 N/mm", "free_length": "136.1 mm", "counts": (2,)}
    found = chosen((short, long))
    assert found.spec.mechanism.springs.name == "short"
    alone = chosen((long,))
    assert alone.spec is None
    assert alone.status.exit_code == 4
    assert "2 x long: too long (136.1 mm relaxed between axes 136 mm apart" in alone.message


def test_a_spring_shorter_than_its_place_is_tight_at_the_start_and_the_cam_is_cut_for_that():
    bought = {
        "name": "tight",
        "stiffness": "0.69 N/mm",
        "free_length": "130 mm",
        "initial_tension": "1.38 N",
        "counts": (2,),
    }
    found = chosen((bought,), rolling_friction=0)
    assert found.spec.mechanism.springs.preload == pytest.approx(0.006)
    assert found.spec.mechanism.profile.preload == pytest.approx(0.006 + 1.38 / 690.0)
    np.testing.assert_allclose(analyze(found.spec).curve.force, 50.0, rtol=1e-9)


def test_the_largest_elongation_is_counted_from_the_free_length():
    base = {"name": "one", "stiffness": "0.69 N/mm", "free_length": "120 mm", "counts": (2,)}
    used = chosen((base,))
    longest = analyze(used.spec).state.elongation.max()
    assert chosen((base | {"max_elongation": f"{longest * 1.0001e3} mm"},)).spec is not None
    refused = chosen((base | {"max_elongation": f"{longest * 0.999e3} mm"},))
    assert refused.spec is None
    assert "spring overstretched (for a stroke of 199" in refused.message


def test_springs_that_only_press_or_turn_are_no_springs_for_a_cam():
    found = chosen(({"name": "press", "kind": "compression", "stiffness": "0.69 N/mm"},))
    assert found.spec is None
    assert "no extension spring" in found.message


def test_the_generic_series_serves_and_says_what_is_bought():
    found = chosen("generic")
    springs, result = found.spec.mechanism.springs, analyze(found.spec)
    offer = {item.name: item for item in generic_series(ExtensionSpring)}[springs.name]
    assert springs.stiffness == offer.rate
    assert offer.stress(result.state.elongation.max()) <= offer.wound.stress(offer.rate * offer.largest) * (1 + 1e-9)
    table = result.tables["parts"]()
    names = ["item", "place", "name", "count", "data", "source", "size", "standard"]
    assert [column.name for column in table.columns] == names
    rows = list(zip(*(column.cells() for column in table.columns), strict=True))
    assert [row[2:4] for row in rows if row[1] == "between the rollers"] == [(springs.name, springs.count)]
    assert [row[0] for row in rows] == list(range(1, len(rows) + 1))


def test_all_parts_are_listed_where_nothing_is_named():
    """Nothing was: plate, braces, rollers, slider, pins, guide and screws are to be made or bought in any case."""
    place, source = (
        next(column.cells() for column in analyze(cam()).tables["parts"]().columns if column.name == key)
        for key in ("place", "source")
    )
    assert {"cam", "roller to slider", "slider pin", "guide of the slider", "plate to its base"} <= set(place)
    assert set(source) == {"make", "buy"}


def test_a_list_may_be_a_file(tmp_path):
    text = "name,kind,stiffness [N/mm],free_length [mm],counts,wire [mm],coil [mm],turns\n"
    text += "E-1,extension,0.55,130,1 2,,,\nT-1,torsion,,,,0.8,8,5\nE-2,,,120,2,1.25,12.5,40\n"
    (tmp_path / "springs.csv").write_text(text, encoding="utf-8")
    source = DataSource("springs.csv", tmp_path)
    pulled = offers(source, ExtensionSpring)
    assert [(one.name, one.counts) for one in pulled] == [("E-1", (1, 2)), ("E-2", (2,))]
    assert pulled[0].rate == pytest.approx(550.0)
    assert pulled[1].rate == pytest.approx(81.5e9 * 1.25e-3**4 / (8 * 12.5e-3**3 * 40))
    assert offers(source, HelicalTorsionSpring)[0].rate == pytest.approx(206e9 * 0.8e-3**4 / (64 * 8e-3 * 5))


@pytest.mark.parametrize(
    ("line", "reported"),
    [
        ("E-1,0.55 mm", "stiffness"),
        ("E-1,-1", "stiffness"),
        ("E-1", "has 1 cells"),
        (",0.55", "name"),
    ],
)
def test_a_fault_of_a_file_is_told_with_its_line(tmp_path, line, reported):
    (tmp_path / "springs.csv").write_text(f"name,stiffness [N/mm]\nE-0,1\n{line}\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"springs\.csv:3") as caught:
        offers(DataSource("springs.csv", tmp_path), ExtensionSpring)
    assert reported in str(caught.value)


@pytest.mark.parametrize(
    ("data", "reported"),
    [
        (b"name,stiffness [N/mm],name\nA,1,B\n", "'name' appears twice"),
        (b"name,stiffness [N/mm]\nA,1\nA,2\n", "csv:3: there are two springs 'A' with different values"),
        (b"name,stiffness [N/mm]\n", "lists no spring"),
        (b"", "lists no spring"),
        (b"\x00\x01\x02name", "is not a text file"),
        (b"name;stiffness [N/mm]\nA;1.000,4\n", "csv:2: stiffness: '1.000,4' has a comma"),
        (b"name,stiffness [N/mm],fatigue\nA,1,x\n", "'fatigue' is not a column"),
        (b"name,stifness,price\nA,1,x\n", "'stifness' is not a column of a list of springs; did you mean 'stiffness'?"),
        (b"name,stiffness [N/mm],limit [mm]\nA,1,3\n", "'limit' is not a column of a list of springs; columns are"),
        (b"stiffness [N/mm]\n1\n", "csv:2: name: missing"),
    ],
)
def test_a_file_that_is_no_list_of_springs_is_refused_in_one_line(tmp_path, data, reported):
    (tmp_path / "springs.csv").write_bytes(data)
    with pytest.raises(DataError) as caught:
        offers(DataSource("springs.csv", tmp_path), ExtensionSpring)
    assert reported in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("name;stiffness [N/mm];max_elongation [mm];Preis [€]\nFeder-1;0,55;165;2,80\n", "utf-8"),
        ("name;stiffness [N/mm];max_elongation [mm];Händler\nFeder-1;0,55;165;Müller\n", "latin-1"),
        ("\n;;\nName;Stiffness (N/mm);Max elongation (mm)\nFeder-1;0,55;165\n", "utf-8-sig"),
        ("name\tstiffness [N/mm]\tmax_elongation [mm]\nFeder-1\t0.55\t165\n", "utf-16"),
        ("name|stiffness [N/mm]|max_elongation [mm]|price\nFeder-1|0.55|165|3\n", "utf-8"),
        ("name,stiffness [N/mm],max_load [N],initial_tension [N]\nFeder-1,0.55,92.75,2\n", "utf-8"),
    ],
)
def test_lists_of_springs_as_makers_and_spreadsheets_write_them(tmp_path, text, encoding):
    (tmp_path / "springs.csv").write_bytes(text.encode(encoding))
    (one,) = offers(DataSource("springs.csv", tmp_path), ExtensionSpring)
    assert (one.name, one.rate, one.largest) == ("Feder-1", pytest.approx(550.0), pytest.approx(0.165))


def test_cells_of_a_file_have_the_units_of_its_header(tmp_path):
    (tmp_path / "springs.csv").write_text("name,stiffness [lbf/in],max_elongation [in],life\nA,2,7,1e5\nA,2,7,1e5\n")
    one, same = offers(DataSource("springs.csv", tmp_path), ExtensionSpring)
    assert one == same
    assert (one.rate, one.largest, one.life) == pytest.approx((2 * 4.4482216152605 / 0.0254, 0.1778, 1e5))


def test_two_different_springs_of_one_name_are_refused_in_a_list():
    pair = ({"name": "A", "stiffness": "1 N/mm"}, {"name": "A", "stiffness": "2 N/mm"})
    with pytest.raises(SpecError, match="two springs 'A' with different values"):
        chosen(pair)


@pytest.mark.parametrize(
    ("block", "reported"),
    [
        ({}, "needs 'stiffness'"),
        ({"kind": "torsion", "stiffness": "1 N/mm"}, "kind 'torsion' has no 'stiffness'"),
        ({"wire": "1 mm", "coil": "10 mm"}, "belong together"),
        (
            {"kind": "compression", "stiffness": "1 N/mm", "free_length": "9 mm", "body_length": "12 mm"},
            "must be larger than its 'body_length'",
        ),
        ({"wire": "1 mm", "coil": "10 mm", "turns": 40, "stiffness": "5 N/mm"}, "times the rate that is stated"),
    ],
)
def test_a_spring_that_contradicts_itself_is_refused(block, reported):
    with pytest.raises(ValidationError, match=reported):
        CatalogueSpring.model_validate({"name": "x"} | block)


@pytest.mark.parametrize(
    ("block", "largest"),
    [
        ({"stiffness": "1 N/mm", "body_length": "12 mm"}, 18.0),
        ({"stiffness": "1 N/mm", "body_length": "12 mm", "max_elongation": "10 mm"}, 10.0),
        ({"wire": "1 mm", "coil": "10 mm", "turns": 16}, 30.0 - 19.0),  # two idle turns close the ends
    ],
)
def test_a_compression_spring_is_not_pressed_beyond_its_turns(block, largest):
    spring = CatalogueSpring.model_validate({"name": "C", "kind": "compression", "free_length": "30 mm"} | block)
    assert spring.offer.largest == pytest.approx(1e-3 * largest)


@pytest.mark.parametrize(("torque", "largest"), [("60 N*mm", 1.2), ("100 N*mm", 0.5 * math.pi)])
def test_a_torsion_spring_is_wound_up_to_its_largest_angle_or_torque(torque, largest):
    ends = {"rate": "50 N*mm/rad", "max_angle": "90 deg", "max_torque": torque}
    assert CatalogueSpring.model_validate({"name": "T", "kind": "torsion"} | ends).offer.largest == largest


def test_of_what_misses_the_nearest_three_are_told():
    misses = [Miss(f"s{k}", share, f"by {share}") for k, share in enumerate((0.5, 0.1, 0.3, 0.2))]
    assert describe_nearest(misses) == "s1: by 0.1; s3: by 0.2; s2: by 0.3; 1 other misses by more"


def test_a_design_with_the_generic_series_is_written_and_read_again(tmp_path):
    found = chosen("generic")
    again = cfmkit.loads(cfmkit.dumps(found.spec)) if hasattr(cfmkit, "loads") else found.spec
    assert again.mechanism.springs.name == found.spec.mechanism.springs.name
    assert again.design.catalogue == "generic"
