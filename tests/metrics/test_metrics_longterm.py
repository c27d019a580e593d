"""Cycles to failure and the force after a hold."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.metrics.branches import Undefined
from cfmkit.metrics.fatigue_and_relaxation import FatigueLaw, RelaxationLaw
from cfmkit.metrics.metric_definitions import words

CONFIGS = Path(__file__).parents[2] / "configs"
POINTS = ((1e3, 25e6), (1e6, 8e6))
FATIGUE = {"points": [[1000, "25 MPa"], [1000000, "8 MPa"]], "ultimate_strength": "45 MPa"}
PRONY = {"terms": [["20 %", "10 h"], ["15 %", "500 h"]], "hold": ["1 h", "1000 h"]}


def metrics(name="vcfm_pla", **changes):
    """Return the metrics of an example whose material also has `changes`."""
    material = "mechanism.material"
    spec = cfmkit.load(CONFIGS / f"{name}.yaml")
    return cfmkit.analyze(spec.replace({f"{material}.{key}": value for key, value in changes.items()})).metrics


def test_life_by_goodman_and_the_straight_line_in_logarithms():
    law = FatigueLaw(POINTS, None, 45e6)
    amplitude, mean = 10e6, 10e6
    reverse = amplitude / (1 - mean / 45e6)
    share = np.log(25e6 / reverse) / np.log(25 / 8)
    assert law.life(mean + amplitude, mean - amplitude) == pytest.approx(1e3 * 1e3**share, rel=1e-12)


def test_basquin_s_line_is_turned_round_exactly():
    law = FatigueLaw((), (100e6, -0.1), 80e6)
    cycles = 12345.0
    assert law.life(law.strength(cycles)) == pytest.approx(cycles, rel=1e-9)


@given(st.floats(1.1e3, 9e5))
def test_the_strength_of_a_number_of_cycles_lasts_them(cycles):
    law = FatigueLaw(POINTS, None, 45e6)
    assert law.life(law.strength(cycles)) == pytest.approx(cycles, rel=1e-9)


def test_a_life_is_never_said_to_be_longer_than_what_was_shown():
    law = FatigueLaw(POINTS, None, 45e6)
    assert law.life(1e6) == pytest.approx(1e6)
    with pytest.raises(Undefined, match="fewer than 1000 cycles"):
        law.life(44e6)
    with pytest.raises(Undefined, match="mean stress"):
        law.life(100e6, 50e6)
    with pytest.raises(Undefined, match="does not change"):
        law.life(5e6, 5e6)


def test_the_force_follows_the_modulus():
    found = metrics(relaxation=PRONY)
    share = 1 - 0.2 * (1 - np.exp(-100)) - 0.15 * (1 - np.exp(-2))
    assert found["force_after[1000 h]"].value == pytest.approx(found["force_mean"].value * share, rel=1e-12)
    assert found["force_after[1 h]"].value > found["force_after[1000 h]"].value
    assert "fatigue_life" in found  # with the reason why it has no value
    assert found["fatigue_life"].value is None


def test_points_of_the_modulus_are_met_and_not_left():
    law = RelaxationLaw((), ((0.0, 2e9), (3600.0, 1.5e9), (3.6e6, 1e9)))
    assert law.ratio(3600.0) == pytest.approx(0.75)
    assert law.ratio(3600.0 * 1000**0.5) == pytest.approx(0.625)
    with pytest.raises(Undefined, match="end at 1000 h"):
        law.ratio(4e6)


def test_a_first_point_at_the_start_falls_to_the_next_one_at_once_and_meets_it():
    law = RelaxationLaw((), ((0.0, 2e9), (3600.0, 1.5e9), (3.6e6, 1e9)))
    assert law.ratio(0.0) == 1.0
    assert 0.75 < law.ratio(1800.0) < 0.76
    assert law.ratio(3599.999) == pytest.approx(0.75, rel=1e-6)


def test_the_time_of_a_hold_is_no_branch_in_words():
    """It had been said "force after on 1000 h"."""
    assert words("force_after[1000 h]") == "force after 1000 h"
    assert words("torque_after[30 min]") == "torque after 30 min"
    assert words("force_mean[load]") == "force mean on load"


def test_a_material_that_says_nothing_of_use_has_no_such_metrics():
    assert not {"fatigue_life", "force_after[1000 h]"} & set(metrics())


def test_requirements_on_life_and_hold_are_judged():
    wanted = [{"metric": "fatigue_life", "min": 1e4}, {"metric": "force_after[30 min]", "min": "11.1 N"}]
    spec = cfmkit.load(CONFIGS / "vcfm_pla.yaml")
    spec = spec.replace({"mechanism.material.fatigue": FATIGUE, "mechanism.material.relaxation": PRONY})
    life, hold = cfmkit.analyze(spec.replace({"requirements": wanted})).requirements
    assert life.ok
    assert not hold.ok
    assert "force_after[30 min]" in json.dumps(hold.as_json())


@pytest.mark.parametrize(
    ("metric", "words"),
    [
        ("force_after[1000 mm]", "time"),
        ("force_after[0 h]", "above 0"),
        ("force_after[soon]", "soon"),
        ("fatigue_lif", "fatigue_life"),
    ],
)
def test_holds_that_are_no_times_are_refused(metric, words):
    text = (CONFIGS / "vcfm_pla.yaml").read_text()
    text = text[: text.index("requirements:")] + f"requirements:\n  - {{metric: '{metric}', min: 1}}\n"
    with pytest.raises(SpecError, match=words):
        cfmkit.loads(text)


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ({"fatigue": {"ultimate_strength": "60 MPa"}}, "either 'points' or"),
        ({"fatigue": {**FATIGUE, "coefficient": "100 MPa", "exponent": -0.1}}, "either 'points' or"),
        ({"fatigue": {"coefficient": "100 MPa", "ultimate_strength": "60 MPa"}}, "belong together"),
        ({"fatigue": {**FATIGUE, "points": [[1e6, "8 MPa"], [1e3, "25 MPa"]]}}, "increasing"),
        ({"relaxation": {}}, "either 'terms' or 'points'"),
        ({"relaxation": {"terms": [["60 %", "1 h"], ["40 %", "2 h"]]}}, "less than 100 %"),
        ({"relaxation": {"points": [["0 h", "1 GPa"], ["1 h", "2 GPa"]]}}, "do not rise"),
    ],
)
def test_data_that_cannot_be_are_refused_in_one_line(block, words):
    spec = cfmkit.load(CONFIGS / "vcfm_pla.yaml")
    with pytest.raises(SpecError, match=words):
        spec.replace({f"mechanism.material.{key}": value for key, value in block.items()})


def test_cycles_that_a_part_is_to_last_lower_the_allowable_stress():
    spec = cfmkit.load(CONFIGS / "vcfm_pla.yaml")
    lasting = spec.replace({"mechanism.material.fatigue": {**FATIGUE, "cycles": 100000}})
    law = FatigueLaw(POINTS, None, 45e6)
    assert lasting.mechanism.allowable_stress == pytest.approx(law.strength(1e5))
    assert lasting.mechanism.allowable_stress < spec.mechanism.allowable_stress
    assert spec.replace({"mechanism.material.fatigue": FATIGUE}).mechanism.allowable_stress == pytest.approx(30e6)


@pytest.mark.parametrize("name", ["beam_lan2010", "slider_crank_strip"])
def test_other_families_have_them_too(name):
    found = metrics(
        name, fatigue={"coefficient": "500 MPa", "exponent": -0.1, "ultimate_strength": "100 MPa"}, relaxation=PRONY
    )
    assert found["fatigue_life"].value > 0
    assert 0 < found["force_after[1000 h]"].value < found["force_mean"].value


@pytest.mark.parametrize("points", [25, 201])
def test_a_life_is_that_of_the_stress_that_the_page_states(points):
    spec = cfmkit.load(CONFIGS / "vcfm_ding2022.yaml").replace(
        {"mechanism.material": {"youngs_modulus": "1.477 GPa", "yield_strength": "30 MPa", "fatigue": FATIGUE}}
    )
    spec = spec.replace({"analysis.points": points, "analysis.preloads": ["0 mm"], "analysis.window": ["0 mm", "4 mm"]})
    found = cfmkit.analyze(spec).metrics
    law = FatigueLaw(POINTS, None, 45e6)
    assert found["fatigue_life"].value == pytest.approx(law.life(found["stress_max"].value), rel=1e-6)


@pytest.mark.parametrize("preloads", [("0 mm", "7.5 mm"), ("7.5 mm", "0 mm")])
def test_the_life_of_several_load_cases_is_the_shortest_of_any_one(preloads):
    """No cycle goes from the least stress without a preload to the largest with one."""
    law = {"coefficient": "150 MPa", "exponent": -0.1, "ultimate_strength": "100 MPa"}
    given = cfmkit.load(CONFIGS / "vcfm_ding2022.yaml").replace(
        {"mechanism.material.fatigue": law, "analysis.window": ("0.92 mm", "4.75 mm"), "analysis.measured": None}
    )

    def life(*asked):
        return cfmkit.analyze(given.replace({"analysis.preloads": asked})).metrics["fatigue_life"].value

    assert life(*preloads) == pytest.approx(min(life(one) for one in preloads), rel=1e-6)
