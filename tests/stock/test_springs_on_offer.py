"""Springs that can be bought: formulas of round wire, lists and files, and what designs choose of them."""

from __future__ import annotations

import itertools
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
from cfmkit.families.slider_crank.springs.bought_springs import best_sets
from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal
from cfmkit.families.slider_crank.springs.sprung_linkage import assemble
from cfmkit.specs.data_file_paths import DataSource
from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring
from cfmkit.stock.springs.offer_type_and_generic_series import Miss, generic, nearest
from cfmkit.stock.springs.spec import CatalogueSpring, offers

CONFIGS = Path(__file__).parents[2] / "configs"
WANTED = {"force": "50 N", "stroke": "200 mm", "choose": "catalogue"}


@pytest.mark.parametrize("kind", ["extension", "compression", "torsion"])
def test_the_generic_series_written_as_a_list_is_the_same_series(kind):
    assert offers(tuple(map(CatalogueSpring.from_offer, generic(kind))), kind) == generic(kind)


def chosen(catalogue, **changes):
    parts = {"roller_radius": "8 mm", "rolling_friction": 0.002} | changes
    return design(cam(**parts).replace({"design": WANTED | {"catalogue": catalogue}}))


def test_the_rate_of_a_coil_is_the_twist_of_a_long_straight_wire():
    """Castigliano: the wire of length pi D n carries the torque F D/2, or the bending moment M."""
    d, mean, n, shear, young = 1e-3, 10e-3, 25.0, 72e9, 190e9
    length, polar, plane = math.pi * mean * n, math.pi * d**4 / 32, math.pi * d**4 / 64
    pulled, wound = (HelicalSpring(kind, d, mean, n, shear, young) for kind in ("extension", "torsion"))
    assert pulled.rate == pytest.approx(shear * polar / (length * (mean / 2) ** 2), rel=1e-12)
    assert wound.rate == pytest.approx(young * plane / length, rel=1e-12)


def test_far_from_its_axis_a_coil_is_stressed_as_a_straight_wire():
    wire = 1e-3
    far = HelicalSpring("compression", wire, 1000 * wire, 5.0)
    assert far.stress(1.0) == pytest.approx(16 * 0.5 * far.coil / (math.pi * wire**3), rel=2e-3)
    bent = HelicalSpring("torsion", wire, 1000 * wire, 5.0)
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
    offer = {item.name: item for item in generic("extension")}[springs.name]
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
    pulled = offers(source, "extension")
    assert [(one.name, one.counts) for one in pulled] == [("E-1", (1, 2)), ("E-2", (2,))]
    assert pulled[0].rate == pytest.approx(550.0)
    assert pulled[1].rate == pytest.approx(81.5e9 * 1.25e-3**4 / (8 * 12.5e-3**3 * 40))
    assert offers(source, "torsion")[0].rate == pytest.approx(206e9 * 0.8e-3**4 / (64 * 8e-3 * 5))


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
        offers(DataSource("springs.csv", tmp_path), "extension")
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
        offers(DataSource("springs.csv", tmp_path), "extension")
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
    (one,) = offers(DataSource("springs.csv", tmp_path), "extension")
    assert (one.name, one.rate, one.largest) == ("Feder-1", pytest.approx(550.0), pytest.approx(0.165))


def test_cells_of_a_file_have_the_units_of_its_header(tmp_path):
    (tmp_path / "springs.csv").write_text("name,stiffness [lbf/in],max_elongation [in],life\nA,2,7,1e5\nA,2,7,1e5\n")
    one, same = offers(DataSource("springs.csv", tmp_path), "extension")
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
    assert nearest(misses) == "s1: by 0.1; s3: by 0.2; s2: by 0.3; 1 other misses by more"


def test_a_design_with_the_generic_series_is_written_and_read_again(tmp_path):
    found = chosen("generic")
    again = cfmkit.loads(cfmkit.dumps(found.spec)) if hasattr(cfmkit, "loads") else found.spec
    assert again.mechanism.springs.name == found.spec.mechanism.springs.name
    assert again.design.catalogue == "generic"


LIST = (
    {"name": "T-30", "kind": "torsion", "rate": "30 N*mm/rad", "counts": (1, 2)},
    {"name": "T-35", "kind": "torsion", "rate": "35 N*mm/rad", "counts": (1,)},
    {"name": "T-7", "kind": "torsion", "rate": "7 N*mm/rad", "counts": (1, 2, 3)},
    {"name": "weak", "kind": "torsion", "rate": "33 N*mm/rad", "max_angle": "20 deg", "counts": (1,)},
)


def cranked(**changes):
    given = cfmkit.load(CONFIGS / "slider_crank_bought.yaml")
    spec = given.replace({f"design.{key}": value for key, value in ({"catalogue": LIST} | changes).items()})
    return spec, family("slider-crank").design.make(spec, Run())


def test_of_a_list_the_programme_takes_what_trying_all_of_it_takes():
    """Every joint: nothing, or one of the five combinations of spring and number that are not overwound."""
    spec, found = cranked(tolerance="20 %")
    rates = sorted({0.0, *(float(f"{n * r:.9g}") for r, ns in ((30, (1, 2)), (35, (1,)), (7, (1, 2, 3))) for n in ns)})
    motion = np.linspace(0.001, 0.035, 1001)
    unit = assemble(spec).units(motion).effort[:3] * 1e-3
    deviations = {
        trial: np.abs(np.array(trial) @ unit / 1.5 - 1.0).max() for trial in itertools.product(rates, repeat=3)
    }
    best = min(deviations.values())
    springs = found.spec.mechanism.springs
    got = deviations[tuple(float(f"{1e3 * rate:.9g}") for rate in springs.rates[:3])]
    assert got == pytest.approx(best, rel=1e-9)
    assert {one.name for one in springs.bought} <= {"T-30", "T-35", "T-7"}
    for one in springs.bought:
        rate = {"T-30": 30.0, "T-35": 35.0, "T-7": 7.0}[one.name] * one.count
        assert getattr(springs, one.at) == pytest.approx(rate * 1e-3)


def tried(count, offered, seed, row=None):
    """Return random unit curves as a goal, and the smallest deviations of all sets of what is offered."""
    random, place = np.random.default_rng(seed), np.linspace(0.0, 1.0, 101)
    columns = [
        1 / (0.3 + place),
        np.exp(-random.uniform(0.1, 2) * place),
        -(place ** random.uniform(0.3, 2)),
        place + 1,
    ]
    least = None if row is None else (row, 0.4)
    goal = RateGoal(np.array(columns[:count]).T, np.ones(101), np.full(count, np.inf), least=least)
    sets = np.array(list(itertools.product(*offered)))
    sets = sets if row is None else sets[sets @ row >= 0.4]
    return goal, np.sort(np.abs(sets @ goal.matrix.T - 1.0).max(axis=1))


@pytest.mark.parametrize("seed", range(12))
def test_the_best_sets_of_springs_are_those_of_trying_all_of_them(seed):
    random = np.random.default_rng(100 + seed)
    offered = [np.unique(np.append(0.0, random.uniform(0, 1, random.integers(1, 7)))) for _ in range(4)]
    row = np.array([1.0, 0.5, -0.2, 0.3]) if seed % 3 == 0 else None
    goal, deviations = tried(4, offered, seed, row)
    assert [off for off, _ in best_sets(goal, offered, 3)] == pytest.approx(list(deviations[:3]), rel=1e-12)
    assert best_sets(goal, offered)[0][0] == pytest.approx(deviations[0], rel=1e-12)


def test_of_two_rates_that_are_nearly_equal_the_better_is_taken():
    """20 and 20.004 N mm/rad are the same to three digits."""
    rates = [20.0, 20.004, 20.008, 35.0, 35.01, 45.0, 45.02, 70.0, 70.03, 70.06]
    listed = tuple(
        {"name": f"T-{k}", "kind": "torsion", "rate": f"{rate} N*mm/rad", "counts": (1,)}
        for k, rate in enumerate(rates)
    )
    spec, found = cranked(catalogue=listed, tolerance="30 %")
    unit = assemble(spec).units(np.linspace(0.001, 0.035, 1001)).effort[:3] * 1e-3 / 1.5
    sets = np.array(list(itertools.product([0.0, *rates], repeat=3)))
    best = sets[np.argmin(np.abs(sets @ unit - 1.0).max(axis=1))]
    assert [1e3 * rate for rate in found.spec.mechanism.springs.rates[:3]] == pytest.approx(list(best), rel=1e-9)


EXTENSION = {"name": "E", "kind": "extension", "stiffness": "0.02 N/mm", "max_elongation": "50 mm", "counts": (1, 2)}


def test_springs_that_are_picked_let_the_force_be_trimmed():
    """A trim by the anchor needs a slider spring of at least its share of the force; it was left out of the choice."""
    asked = {"springs": ["pivot", "crank_pin", "slider_pin", "slider"], "adjustment": "0.2 N", "anchor_travel": "5 mm"}
    _, found = cranked(catalogue=(*LIST, EXTENSION), tolerance="60 %", **asked)
    assert found.spec.mechanism.springs.slider == pytest.approx(40.0)
    _, soft = cranked(catalogue=(*LIST, EXTENSION | {"counts": (1,)}), tolerance="60 %", **asked)
    assert soft.spec is None
    assert "stiff enough for 'design.adjustment' within 'design.anchor_travel'" in soft.message


def test_a_slider_spring_that_is_longer_than_its_place_is_not_picked():
    asked = {"springs": ["pivot", "crank_pin", "slider_pin", "slider"], "tolerance": "60 %", "adjustment": "0.1 N"}
    asked |= {"anchor_travel": "5 mm", "spring_room": "40 mm"}
    long, short = (EXTENSION | {"name": name, "free_length": free} for name, free in (("L", "41 mm"), ("S", "39 mm")))
    _, found = cranked(catalogue=(*LIST, long, short), **asked)
    assert [one.name for one in found.spec.mechanism.springs.bought if one.at == "slider"] == ["S"]
    _, none = cranked(catalogue=(*LIST, long), **asked)
    assert "L at the slider: too long, 41 mm relaxed ('design.spring_room' 40 mm)" in none.message


def deviation(spec):
    """Return the largest deviation from 1.5 N over the window."""
    unit = assemble(spec).units(np.linspace(0.001, 0.035, 1001)).effort
    return np.abs(spec.mechanism.springs.rates @ unit / 1.5 - 1.0).max()


def test_free_lengths_are_chosen_for_the_springs_that_can_be_had():
    """With rates of any value another crank is best."""
    ends = {"crank_length": ["50 mm", "58 mm"], "tolerance": "30 %"}
    spec, found = cranked(**ends)
    any_rate = family("slider-crank").design.make(spec.replace({"design.catalogue": None}), Run())
    crank = any_rate.spec.mechanism.crank_length
    other = spec.replace({"mechanism.crank_length": crank, "design.crank_length": None})
    off = [deviation(one.spec) for one in (found, family("slider-crank").design.make(other, Run()))]
    assert off[0] < off[1]


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"travel": None}, "are picked for a window"),
        ({"objective": "least-squares"}, "remove 'objective'"),
        ({"slack": "1 %"}, "'slack' needs freely chosen rates"),
        ({"catalogue": None, "spring_room": "40 mm"}, "'spring_room' applies only to springs picked"),
    ],
)
def test_what_a_catalogue_does_not_go_with_is_refused(changes, reported):
    with pytest.raises(SpecError, match=reported):
        cranked(**changes)


def test_a_spring_that_the_window_overwinds_is_not_taken_however_well_it_would_fit():
    only = ({"name": "weak", "kind": "torsion", "rate": "33 N*mm/rad", "max_angle": "20 deg", "counts": (1,)},)
    _, found = cranked(catalogue=only)
    assert found.spec is None
    assert found.status.exit_code == 4
    assert "it allows 20 deg" in found.message


def test_where_no_set_keeps_the_tolerance_the_nearest_three_are_told():
    _, found = cranked(tolerance="0.01 %")
    assert found.spec is None
    assert found.message.count("off by") == 3
    shares = [float(text.split("%")[0]) for text in found.message.split("off by ")[1:]]
    assert shares == sorted(shares)


def test_a_pair_needs_every_spring_twice():
    spec, _ = cranked()
    pair = spec.replace({"mechanism.copies": "mirrored"})
    tables = [family("slider-crank").analyze(one, Run()).tables["parts"]() for one in (spec, pair)]
    columns = [{column.name: column.cells() for column in table.columns} for table in tables]
    counts = [
        [count for count, data in zip(one["count"], one["data"], strict=True) if "torsion" in data] for one in columns
    ]
    assert counts == [[2, 2, 2], [4, 4, 4]]
