"""What is assumed of how materials last: from where, when it counts, and when it does not."""

import json
from pathlib import Path

import pytest

from cfmkit.cli import run_command
from cfmkit.stock import MATERIALS_BY_NAME
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.materials import ASSUMED_DATA, steel

CONFIGS = Path(__file__).parents[2] / "configs"
STEELS = ("steel-1.4310", "steel-304", "steel-s235")


def test_only_materials_of_the_library_are_assumed_to_last():
    assert set(ASSUMED_DATA) <= set(MATERIALS_BY_NAME)


@pytest.mark.parametrize("name", ASSUMED_DATA)
def test_each_assumption_says_that_it_is_one_and_from_where(name):
    one = ASSUMED_DATA[name]
    for law in filter(None, (one.fatigue, one.relaxation)):
        assert law.source.startswith("assumed: ")
        assert len(law.source) <= 300
    assert (one.loss_factor is None) == (not one.loss_source)


def test_the_points_of_a_steel_are_those_of_a_hand_calculation():
    """304: 515 MPa are 74.7 kpsi, so f = 1.06 - 0.209 + 0.0385 = 0.889; k_a = 4.51 * 515^-0.265 = 0.862."""
    (first, knee, last) = steel(515e6, "x").points
    assert first == (1e3, pytest.approx(0.889 * 515e6, rel=2e-3))
    assert knee == (1e6, pytest.approx(0.5 * 0.862 * 515e6, rel=3e-3))
    assert last == (1e9, knee[1])


@pytest.mark.parametrize("name", STEELS)
def test_the_limit_of_a_steel_is_within_its_spread(name):
    law = ASSUMED_DATA[name].fatigue
    assert law.spread[0] < law.points[-1][1] < law.spread[1]


@pytest.mark.parametrize(("name", "kept"), [("pom", 0.456), ("pa66", 0.386), ("pc", 0.792)])
def test_a_creeping_plastic_keeps_the_share_of_its_data_sheet_after_a_thousand_hours(name, kept):
    lasting = MaterialSpec(name=name).durability
    assert lasting.relaxation.ratio(3.6e6) == pytest.approx(kept, abs=1e-3)
    assert lasting.fatigue is None
    assert len(lasting.assumed) == 1


def test_what_a_specification_states_replaces_what_is_assumed():
    stated = {"points": (("0 h", "2 GPa"), ("1000 h", "1 GPa")), "source": "own test"}
    lasting = MaterialSpec(name="pom", relaxation=stated).durability
    assert lasting.relaxation.ratio(3.6e6) == pytest.approx(0.5)
    assert lasting.assumed == ()


def test_null_says_that_nothing_is_to_be_assumed():
    assert MaterialSpec(name="pom", relaxation=None).durability is None
    assert MaterialSpec(name="steel-304", fatigue=None).durability is None


def test_own_values_without_a_name_have_no_assumed_data():
    assert MaterialSpec(youngs_modulus="2 GPa").durability is None


def test_what_is_assumed_is_not_written_into_a_specification():
    assert MaterialSpec(name="steel-304").model_dump(exclude_unset=True) == {"name": "steel-304"}


def test_an_analysis_reports_the_force_after_a_hold_and_that_its_creep_is_assumed(tmp_path, capsys):
    assert run_command(["analyze", str(CONFIGS / "make_pom_strip.yaml"), "--no-plots", "-v", "-o", str(tmp_path)]) == 0
    assert "durability" in (page := capsys.readouterr().out)
    assert "Hostaform C 9021" in page
    metrics = json.loads((tmp_path / "metrics.json").read_text())["metrics"]
    kept = metrics["force_after[1000 h]"]["value"] / metrics["force_mean"]["value"]
    assert kept == pytest.approx(1300 / 2850, rel=1e-6)


def test_the_page_says_what_is_assumed(capsys):
    assert run_command(["show", "materials", "--json"]) == 0
    shown = capsys.readouterr().out
    assert "Hostaform C 9021" in shown
    assert run_command(["show", "steel-304"]) == 0
    assert "assumed S-N" in capsys.readouterr().out
