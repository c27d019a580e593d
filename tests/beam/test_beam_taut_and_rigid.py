"""Networks of beams that are pulled taut, have no first pose, or are rigid: where the curve ends, and what is named."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest
from beam_support import MM, cantilever, solved, warned

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import InputError
from cfmkit.results import Status


def test_a_travel_that_only_beams_of_several_times_their_length_could_follow_is_refused():
    """It took minutes, for a force of beams that are 200 times as long as they were made."""
    with pytest.raises(
        InputError, match=r"to more than twice their length: from 'eye' .* 35.26 mm .* at most 105.8 mm is possible"
    ):
        solved("beam_v_bifurcation", "analysis.travel=8600 mm")
    near = solved("beam_v_bifurcation", "analysis.travel=40 mm", "analysis.modes=1", "analysis.points=5")
    assert near.status is Status.COMPLETE


TAUT = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 0.5 mm
  width: 10 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: pinned}
    b: {at: [60 mm, 0 mm], support: roller, direction: 0 deg}
  beams:
    s: {start: a, end: b, shape: {kind: arc, sweep: 60 deg}}
  drive: {kind: displacement, node: b, direction: 0 deg}
analysis:
  travel: 8 mm
  points: 61
"""


def test_reactions_are_what_holds_a_node_and_a_force_that_drives_is_a_load():
    """At the same pose: the root bears the force either way, the driven node's column has it under a displacement."""
    moved = TAUT.replace("travel: 8 mm", "travel: 1 mm\n  outputs: {reactions: [a, b]}")
    by_motion = cfmkit.analyze(cfmkit.loads(moved)).curve
    force = float(by_motion.force[-1])
    loaded = moved.replace("kind: displacement", "kind: force").replace("travel: 1 mm", f"force: {force!r} N")
    by_force = cfmkit.analyze(cfmkit.loads(loaded)).curve
    assert by_force.motion[-1] == pytest.approx(1 * MM, rel=1e-5)
    for curve in (by_motion, by_force):
        assert curve.extra["a_fx"].values[-1] == pytest.approx(-force, rel=1e-5)
    assert by_motion.extra["b_fx"].values[-1] == pytest.approx(force, rel=1e-9)
    assert abs(by_force.extra["b_fx"].values).max() < 1e-9 * force


@pytest.mark.parametrize("support", ["pinned", "clamped"])
def test_elastica_that_are_pulled_taut_have_no_limit_point(support):
    result = cfmkit.analyze(cfmkit.loads(TAUT.replace("support: pinned", f"support: {support}")))
    assert result.status is Status.PARTIAL
    assert "the beams are taut at 2." in result.message
    assert "allow stretching ('mechanism.axial: true')" in result.message
    assert "limit point" not in result.message
    (early,) = (item for item in result.warnings if item.name == "ends_early")
    assert early.cures == ("analysis.fidelity=extensible",)
    freed = cfmkit.analyze(result.spec.replace({"analysis.fidelity": "extensible", "mechanism.axial": True}))
    assert freed.curve.motion[-1] == pytest.approx(8 * MM)


def test_elastica_that_are_pulled_taut_after_the_last_point_of_a_coarse_curve_are_said_to_be():
    result = cfmkit.analyze(cfmkit.loads(TAUT.replace("points: 61", "points: 5")))
    assert result.message.startswith("the beams are taut at 2.")
    assert "limit point" not in result.message


def test_straight_beams_on_a_pin_that_are_pulled_into_one_line_are_said_to_be_taut():
    """They bear nothing before: 2 hypot(30, 20) = 72.11 mm is as far as they reach."""
    text = TAUT.replace(
        "s: {start: a, end: b, shape: {kind: arc, sweep: 60 deg}}", "s: {start: a, end: k, end_joint: pin}"
    )
    text = text.replace("  drive:", "    t: {start: k, end: b}\n  drive:").replace("travel: 8 mm", "travel: 25 mm")
    text = text.replace("  beams:", "    k: {at: [30 mm, 20 mm]}\n  beams:")
    result = cfmkit.analyze(cfmkit.loads(text))
    assert result.status is Status.PARTIAL
    assert re.match(r"the beams are taut at 12\.[01]\d* mm \(a to b: 72\.[01]\d* mm of 72\.11 mm\)", result.message)
    pushed = cfmkit.analyze(cfmkit.loads(text.replace("direction: 0 deg}\nanalysis", "direction: 180 deg}\nanalysis")))
    assert "taut" not in pushed.message


def test_elastica_that_a_force_pulls_taut_move_as_far_as_they_are_long():
    drive = (("kind: displacement", "kind: force"), ("travel: 8 mm", "force: 1e6 N"))
    result = cfmkit.analyze(cfmkit.loads(functools.reduce(lambda text, change: text.replace(*change), drive, TAUT)))
    assert result.status is Status.COMPLETE
    assert result.curve.motion[-1] == pytest.approx((20 * np.pi - 60) * MM, rel=1e-5)  # the arc drawn straight


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        (
            (("support: clamped}",
              "support: clamped}\n    end: {at: [400 mm, 9 mm], support: clamped, moved: {along: 9 m}}"),
             ("{start: root, end: tip}", "{start: root, end: tip}\n    more: {start: tip, end: end}")),
            ("mechanism.nodes.end.moved", "mechanism.axial"),
        ),
        (
            (("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: guided, direction: 0 deg}"),
             ("direction: -90 deg", "direction: 0 deg")),
            ("mechanism.drive", "mechanism.nodes.tip.support", "mechanism.axial"),
        ),
    ],
    ids=["moved", "rigid"],
)  # fmt: skip
def test_without_a_first_pose_the_keys_that_may_be_in_the_way_are_named(changes, keys):
    result = cfmkit.analyze(cantilever(*changes))
    assert result.status is Status.NO_EQUILIBRIUM
    assert all(key in result.message for key in keys), result.message
    assert " at 0 m" not in result.message  # a share of the loads is no place of the drive


HELD = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 0.5 mm
  width: 10 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    b: {at: [60 mm, 0 mm], support: clamped, moved: MOVED}
    c: {at: [60 mm, 30 mm], support: guided, direction: 90 deg}
  beams:
    straight: {start: a, end: b}
    curved: {start: b, end: c, shape: {kind: arc, sweep: 60 deg}}
  drive: {kind: displacement, node: c, direction: -90 deg}
analysis:
  travel: 3 mm
  points: 11
"""


@pytest.mark.parametrize(
    "moved",
    ["{along: -3 mm, across: 2 mm, rotation: 20 deg}", "{along: -6 mm, across: 2 mm}", "{along: -3 mm}"],
)
def test_an_end_of_a_straight_beam_whose_motions_are_all_prescribed_has_a_start(moved):
    """Without stretching the rotations grow with the root of the motion: there is no path to follow from rest."""
    stiff, soft = (
        cfmkit.analyze(cfmkit.loads(HELD.replace("MOVED", moved) + f"  fidelity: {fidelity}\n"))
        for fidelity in ("inextensible", "extensible")
    )
    assert stiff.status is Status.COMPLETE
    assert stiff.curve.stable.all()
    for name in ("straight_force_x", "curved_force_y"):
        np.testing.assert_allclose(stiff.curve.extra[name].values, soft.curve.extra[name].values, rtol=0.02, atol=5e-3)


def test_an_end_that_would_have_to_stretch_its_beam_has_no_start():
    result = cfmkit.analyze(cfmkit.loads(HELD.replace("MOVED", "{along: 2 mm}")))
    assert result.status is Status.NO_EQUILIBRIUM
    assert "mechanism.nodes.b.moved" in result.message


def test_a_straight_strip_pulled_along_itself_names_the_strip_and_a_cure_and_a_pressed_one_buckles():
    text = TAUT.replace(", shape: {kind: arc, sweep: 60 deg}", "").replace("support: pinned", "support: clamped")
    result = cfmkit.analyze(cfmkit.loads(text))
    assert result.status.exit_code == 4
    assert "inextensible beams lie straight along the drive (s)" in result.message
    assert "\n" not in result.message
    (early,) = (item for item in result.warnings if item.name == "ends_early")
    assert early.cures == ("analysis.fidelity=extensible",)
    pressed = cfmkit.analyze(cfmkit.loads(text.replace("direction: 0 deg}\nanalysis", "direction: 180 deg}\nanalysis")))
    assert pressed.status is Status.COMPLETE
    assert "bifurcation" in warned(pressed)
    buckled = cfmkit.analyze(pressed.spec.replace({"analysis.fidelity": "extensible", "mechanism.axial": True}))
    assert pressed.curve.effort[-1] == pytest.approx(buckled.curve.effort[-1], rel=1e-2)


TIED = """\
cfmkit: 1
family: beam
name: tied
mechanism:
  material: {youngs_modulus: 2300 MPa}
  thickness: 1 mm
  width: 5 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    m: {at: [30 mm, 20 mm]}
    b: {at: [60 mm, 0 mm], support: pinned}
    t: {at: [90 mm, 10 mm], support: clamped}
  beams:
    left: {start: a, end: m, shape: {kind: cosine, rise: 1 mm}}
    right: {start: m, end: b}
    spare: {start: t, end: b, end_joint: pin}
  drive: {kind: rotation, node: m}
analysis: {travel: 10 deg, points: 5}
"""


def test_a_straight_beam_between_held_places_changes_nothing():
    """Its force was undetermined, and the whole network was called rigid."""
    alone = re.sub(r"    (spare|t): .*\n", "", TIED)
    one, other = (cfmkit.analyze(cfmkit.loads(text)).curve for text in (TIED, alone))
    np.testing.assert_allclose(one.torque, other.torque, rtol=1e-9, atol=1e-12)
    assert np.abs(one.extra["spare_force_x"].values).max() < 1e-6


def test_beams_that_over_determine_a_network_are_named(tmp_path, monkeypatch, capsys):
    text = TIED.replace(", shape: {kind: cosine, rise: 1 mm}", "")
    text = text.replace("kind: rotation, node: m", "kind: displacement, node: m").replace("10 deg", "1 mm")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tied.yaml").write_text(text, encoding="utf-8")
    assert run_command(["analyze", "tied.yaml", "--no-plots", "--set", "mechanism.drive.direction=90 deg"]) == 4
    page = " ".join(capsys.readouterr().out.split())
    assert "inextensible beams between places that do not move (left, right) hold the network rigid" in page


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("mechanism.nodes={m: {at: [0 mm, 74 mm]}}", "a beam joins two nodes, and there is one: add another"),
        ("mechanism.nodes.m.support=clamped", "'m' cannot turn: its support is 'clamped'; 'pinned' lets it turn"),
        (
            "mechanism.drive={kind: displacement, node: b, direction: 0 deg}",
            "'b' cannot move: its support is 'pinned'; 'guided' with 'direction: 0 deg' or 'free' lets it",
        ),
    ],
)
def test_what_stands_in_the_way_of_a_network_is_said_with_its_cure(tmp_path, capsys, change, said):
    (tmp_path / "tied.yaml").write_text(TIED, encoding="utf-8")
    assert run_command(["check", str(tmp_path / "tied.yaml"), "--set", change]) == 3
    captured = capsys.readouterr()
    assert said in captured.out + captured.err
