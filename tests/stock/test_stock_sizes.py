"""Sizes that are sold, and dimensions with the digits that a process can hold."""

import re

import pytest

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import SpecError
from cfmkit.metrics import check
from cfmkit.stock.stock_series import ALL_SERIES, BALL_BEARINGS, SOCKET_SCREWS, bearings_of, screw_through, series_of


@pytest.mark.parametrize("series", ALL_SERIES, ids=lambda one: f"{one.kind}-{one.system}-{'-'.join(one.materials)}")
def test_every_series_increases_and_says_where_it_was_read(series):
    assert all(a < b for a, b in zip(series.sizes, series.sizes[1:], strict=False))
    assert series.standard
    assert len(series.read) > 15
    assert all(series.nearest(size) == size for size in series.sizes)


def test_bearings_and_screws_have_room_for_what_is_in_them():
    assert all(one.bore < one.outer and one.width < one.outer - one.bore for one in BALL_BEARINGS)
    assert all(one.diameter < one.hole < one.head for one in SOCKET_SCREWS)
    assert [one.name for one in bearings_of(0.010)] == ["6000", "16100", "6200", "6300"]
    assert screw_through(0.0055).name == "M5"
    assert screw_through(0.001) is None


@pytest.mark.parametrize(
    ("name", "changes", "path", "nearest"),
    [
        ("vcfm_aluminium", ["part.stock=metric", "part.sheet=6.3 mm"], "part.sheet", "nearest is 5 mm"),
        ("slider_crank_friction", ["part.stock=metric", "pins.diameter=3.3 mm"], "pins.diameter", "nearest is 3 mm"),
        ("slider_crank_friction", ["part.stock=inch", "pins.diameter=3 mm"], "pins.diameter", "nearest is 3.175 mm"),
        ("cam_friction", ["plate.stock=metric", "bearings.bore=11 mm"], "bearings.bore", "nearest is 12 mm"),
    ],
)
def test_a_size_that_is_not_sold_is_refused_in_one_line_with_the_nearest(capsys, name, changes, path, nearest):
    options = [part for change in changes for part in ("--set", f"mechanism.{change}")]
    assert run_command(["check", f"configs/{name}.yaml", *options]) == 3
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert f"mechanism.{path}: no " in line
    assert nearest in line


def test_a_printed_part_is_not_cut_from_a_sheet_and_a_manufactured_one_has_errors():
    changes = ["mechanism.part={stock: metric, sheet: 6.3 mm, process: fdm}"]
    spec = cfmkit.load("configs/slider_crank_strip.yaml", [*changes, "mechanism.beam.width=6.3 mm"])
    assert spec.mechanism.part.sheet == pytest.approx(6.3e-3)
    cut = cfmkit.load("configs/slider_crank_friction.yaml", ["mechanism.part.stock=metric"])
    made = cut.replace({"mechanism.pins.diameter": 1.001 * cut.mechanism.pins.diameter}, as_made=True)
    assert made.mechanism.pins.diameter > cut.mechanism.pins.diameter
    with pytest.raises(SpecError, match="the nearest is"):
        cut.replace({"mechanism.pins.diameter": 1.001 * cut.mechanism.pins.diameter})


def test_a_design_from_stock_is_repeated_for_the_nearest_sheet_and_says_how_the_force_changes():
    spec = cfmkit.load("configs/vcfm_aluminium.yaml", ["mechanism.part.stock=metric"])
    made = cfmkit.design(spec)
    about = made.spec.mechanism
    assert about.bistable.width == about.positive.width == about.part.sheet
    assert series_of("sheet", "metric", "aluminium-7075-t6").holds(about.part.sheet)
    result = cfmkit.analyze(made.spec)
    assert all(one.ok for one in check(result.spec.part_requirements, result))
    (note,) = [text for word, text in made.notes if word == "stock"]
    was, now = (
        cfmkit.evaluate(cfmkit.analyze(one), ["force_mean"])["force_mean"].value
        for one in (cfmkit.design(cfmkit.load("configs/vcfm_aluminium.yaml")).spec, made.spec)
    )
    share = float(re.search(r"\(([-+.\d]+) %\)", note)[1])
    assert share == pytest.approx(100 * (now / was - 1), abs=0.02)
    again = cfmkit.loads(cfmkit.dumps(made.spec))
    assert cfmkit.design(again).spec.mechanism.part.sheet == about.part.sheet


def test_a_sheet_for_which_there_is_no_design_is_infeasible_with_the_reason():
    found = cfmkit.design(cfmkit.load("configs/make_pom_strip.yaml", ["mechanism.part.stock=inch"]))
    assert found.spec is None
    assert "3.175 mm: a strip 3.175 mm wide would have to be" in found.message


@pytest.mark.parametrize("name", ["make_finger", "make_pom_strip", "vcfm_bought_springs", "beam_rescaled"])
def test_what_a_design_chooses_has_the_digits_of_its_process(name):
    """Sixteen digits were written, and analysed, of parts that are made to a twentieth of a millimetre."""
    given = cfmkit.load(f"configs/{name}.yaml")
    made = cfmkit.design(given).spec
    stated = re.findall(r"[\d.]+ (?:mm|deg)", cfmkit.dumps(given))
    new = [text for text in re.findall(r"[\d.]+ (?:mm|deg)", cfmkit.dumps(made)) if text not in stated]
    assert new
    assert max(len(text.split()[0].partition(".")[2]) for text in new) <= 3


def test_rounding_costs_no_requirement_that_was_met():
    given = cfmkit.load("configs/make_pom_strip.yaml")
    free = cfmkit.design(given)
    result = cfmkit.analyze(free.spec)
    tight = given.replace(
        {
            "requirements.1": {
                "metric": "stress_max",
                "max": f"{result.curve.extra['max_stress'].values.max() / 1e6} MPa",
            }
        }
    )
    made = cfmkit.design(tight)
    found = cfmkit.analyze(made.spec)
    assert [one.ok for one in check(found.spec.part_requirements, found)] == [True, True]
