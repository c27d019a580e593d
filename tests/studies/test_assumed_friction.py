"""What a design says of friction that its specification does not state."""

import cfmkit
from cfmkit import Run
from cfmkit.studies.delivered_design import friction_note


def test_rollers_without_ball_bearings_are_said_to_rub_on_their_shafts():
    small = cfmkit.load("configs/cam.yaml", ["mechanism.roller_radius=5 mm"])  # no bearing fits
    assert "plain bearings of the rollers (" in friction_note(cfmkit.analyze(small), Run())


def test_a_design_without_stated_friction_says_what_pins_and_guide_take():
    plain = cfmkit.analyze(cfmkit.load("configs/slider_crank_bilancia2019.yaml"))
    note = friction_note(plain, Run())
    assert "with 0.15 in pins (" in note
    rubbing = cfmkit.load("configs/slider_crank_friction.yaml")
    assert friction_note(cfmkit.analyze(rubbing), Run()) == ""
