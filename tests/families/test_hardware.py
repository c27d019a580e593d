"""Pins, guides and screws: what is assumed, what is bought, and the safety that is asked for."""

import math

import pytest

import cfmkit
from cfmkit.families.hardware import PartStrength, guide_rods, link_width, pin_part, required_safety, screw_for


def test_what_is_not_stated_is_assumed_and_said():
    strength = PartStrength.from_material(None, 1.0)
    assert (strength.name, strength.assumed) == ("steel-s235", True)
    assert strength.allowable == pytest.approx(235e6 / 1.5)
    rods = guide_rods(2, 0.0, 100.0, 0.2, 0.02, None, None, strength)
    assert rods.load == pytest.approx(10.0)
    sag = 5.0 * 0.22**3 / (48 * 210e9 * math.pi * rods.diameter**4 / 64)
    assert sag <= 0.22e-3 < sag / 0.8**4
    assert screw_for(10.0, 0.003, 4, strength).name == "M3"
    assert link_width(34.0, 0.008, 0.005, strength) == pytest.approx(8e-3)


def test_pins_are_bought_in_lengths_of_their_standard_and_cut_or_made_of_a_rod():
    bought, cut, made = (pin_part("pin", 1, 1.5e-3, length, 1.0) for length in (15.5e-3, 14.5e-3, 17e-3))
    assert (bought.source, bought.size, bought.standard) == ("buy", "1.5 x 16 mm", "ISO 2338")
    assert (cut.size, cut.data.endswith(", cut to 14.5 mm")) == ("1.5 x 16 mm", True)
    assert (made.source, made.size, made.standard) == ("make", "1.5 x 17 mm", "")  # ISO 2338 ends at 16 mm
    assert pin_part("pin", 1, 0.25 * 25.4e-3, 0.017, 1.0).standard == "ASME B18.8.2"


@pytest.mark.parametrize(
    ("config", "metric"), [("cam", "safety_factor"), ("slider_crank_bilancia2019", "link_safety_factor")]
)
@pytest.mark.parametrize(
    ("stated", "least", "safety"), [(1, 1, 1.5), (1, 1.5, 1.5), (1.2, 1, 1.2), (1, 3, 3), (2, 1.5, 3)]
)
def test_parts_that_join_have_the_safety_that_a_requirement_asks_for(config, metric, stated, least, safety):
    spec = cfmkit.load(f"configs/{config}.yaml")
    asked = {"mechanism.safety_factor": stated, "requirements": ({"metric": metric, "min": least},)}
    assert required_safety(spec.replace(asked)) == safety
