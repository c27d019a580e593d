"""Contacts between parts in beam specifications: results, columns, findings, figures, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import warned

import cfmkit
from cfmkit.errors import InputError, SpecError
from cfmkit.families.beam.figures import figures
from cfmkit.results import Status

TWO_LEAVES = """cfmkit: 1
family: beam
mechanism:
  material: {name: steel-1.4310}
  width: 10 mm
  thickness: 0.5 mm
  nodes:
    root: {at: [0 mm, 10 mm], support: clamped}
    tip: {at: [100 mm, 10 mm]}
    wall: {at: [0 mm, 0 mm], support: clamped}
    end: {at: [130 mm, 0 mm]}
  beams: {upper: {start: root, end: tip}, lower: {start: wall, end: end}}
  contacts:
    - {between: [tip, lower], radius: 1 mm}
  drive: {kind: displacement, node: tip, direction: -90 deg}
analysis: {travel: 30 mm, points: 16}
"""
PAIR = "{between: [tip, lower], radius: 1 mm}"


def stated(pair):
    """Return the text of two leaves with another contact."""
    return TWO_LEAVES.replace(PAIR, pair)


@pytest.fixture(scope="module")
def result():
    return cfmkit.analyze(cfmkit.loads(TWO_LEAVES))


def test_a_pad_on_a_beam_has_columns_of_its_force_and_place_and_a_row_where_it_begins(result):
    force, place, event = (result.curve.extra[name].values for name in ("tip_lower_force", "tip_lower_at", "event"))
    (row,) = np.flatnonzero(event != "")
    assert event[row] == "tip_lower begins"
    assert result.curve.displacement[row] == pytest.approx(8.75e-3, rel=1e-12)
    assert (force[: row + 1] == 0).all()
    assert np.isnan(place[: row + 1]).all()
    assert (force[row + 1 :] > 0).all()
    assert (np.diff(place[row + 1 :]) < 0).all()  # the tip moves inwards
    assert result.values["first_contact"].value == pytest.approx(8.75e-3, rel=1e-12)
    assert result.values["contact_force_max"].value == pytest.approx(force.max(), rel=1e-9)


def test_the_force_of_the_pad_is_what_holds_the_other_leaf(result):
    vertical, across = (result.curve.extra[f"lower_force_{axis}"].values for axis in "yx")
    assert np.abs(across).max() == pytest.approx(0.0, abs=1e-9)  # its end is free
    assert np.abs(vertical).max() == pytest.approx(0.0, abs=1e-9)
    support = result.state.path.end_force("lower", 0)[result.state.keep, :2]
    assert np.hypot(*support.T) == pytest.approx(result.curve.extra["tip_lower_force"].values, abs=1e-9)


def test_the_force_of_the_pad_can_be_a_requirement_by_its_name():
    line = 'requirements:\n  - {metric: "contact_force[tip_lower]", min: 0.1 N}\nanalysis:'
    result = cfmkit.analyze(cfmkit.loads(TWO_LEAVES.replace("analysis:", line)))
    assert result.requirements[0].ok


def test_the_order_of_node_and_beam_is_free_and_a_free_end_has_the_radius_of_half_its_thickness():
    contacts = cfmkit.analyze(cfmkit.loads(stated("{between: [lower, tip]}"))).state.path.network.contacts
    assert [(pad.node, pad.beam, pad.radius) for pad in contacts] == [("tip", "lower", 0.25e-3)]


def test_beams_in_a_stated_contact_do_not_count_as_touching(result):
    said = warned(result)
    assert said["contact_begins"] == "contact begins at 8.75 mm between 'tip' and 'lower'"
    assert "beams_touch" not in said
    plain = cfmkit.analyze(cfmkit.loads(TWO_LEAVES.replace(f"  contacts:\n    - {PAIR}\n", "")))
    assert "state it in 'mechanism.contacts'" in warned(plain)["beams_touch"]


def test_beams_that_pass_through_each_other_beside_the_pad_are_reported():
    """The pad is below the thickness of its own leaf: the leaf itself enters the other one."""
    result = cfmkit.analyze(cfmkit.loads(stated("{between: [tip, lower], radius: 0.05 mm}")))
    assert "beams_touch" in {warning.name for warning in result.warnings}


def test_pads_that_touch_are_drawn(result):
    drawn = {artist.get_gid() for artist in figures(result)["shapes"]().axes[0].get_children()}
    assert {"pad-0-16-0", "side-0-16-0"} <= drawn


def test_a_pad_that_leaves_its_beam_gives_a_partial_result_with_the_reason():
    text = TWO_LEAVES.replace("[130 mm, 0 mm]", "[99 mm, 0 mm]").replace("radius: 1 mm", "radius: 4 mm")
    result = cfmkit.analyze(cfmkit.loads(text))
    assert result.status is Status.PARTIAL
    assert "'tip' on beam 'lower'" in result.message


PAIR_OF_BEAMS = stated("{between: [upper, lower]}").replace("[130 mm, 0 mm]", "[80 mm, 0 mm]")


def test_two_beams_have_one_force_and_a_place_on_each():
    """The end of the shorter one presses on the side of the other: the same as a pad of its node."""
    pair = cfmkit.analyze(cfmkit.loads(PAIR_OF_BEAMS))
    force, upper, lower = (pair.curve.extra[f"upper_lower_{end}"].values for end in ("force", "at_upper", "at_lower"))
    touches = force > 0
    assert touches.sum() > 4
    assert (lower[touches] == 1).all()
    assert np.isnan(upper[~touches]).all()
    pad = cfmkit.analyze(cfmkit.loads(PAIR_OF_BEAMS.replace("[upper, lower]", "[end, upper]")))
    assert force == pytest.approx(pad.curve.extra["end_upper_force"].values, rel=1e-9, abs=1e-12)
    assert upper == pytest.approx(pad.curve.extra["end_upper_at"].values, rel=1e-9, nan_ok=True)
    means = pair.values["contact_force[upper_lower]"].value, pad.values["contact_force[end_upper]"].value
    assert means[0] == pytest.approx(means[1], rel=1e-9)
    (said,) = (warning.message for warning in pair.warnings if warning.name == "contact_begins")
    assert said.endswith("between 'end' and 'upper'")
    assert "beams_touch" not in {warning.name for warning in pair.warnings}
    drawn = {artist.get_gid() for artist in figures(pair)["shapes"]().axes[0].get_children()}
    assert {"pad-5-16-0", "force-5-16-0"} <= drawn


@pytest.mark.parametrize(
    ("support", "sweep", "rows", "place"),
    [
        ("clamped", 0, ["upper_lower wall begins"], 9.5e-3),
        ("pinned", 0, ["upper_lower wall begins"], 9.5e-3),
        ("clamped", 30, ["upper_lower begins", "upper_lower moves"], None),
    ],
)
def test_an_end_that_is_held_is_a_round_pad_on_which_the_other_beam_bends(support, sweep, rows, place):
    """It is a disc of half the thickness; the side of the held leaf may touch before it."""
    text = HELD.replace("held", support).replace("30 deg", f"{sweep} deg")
    result = cfmkit.analyze(cfmkit.loads(text))
    assert result.status is Status.COMPLETE
    events = result.curve.extra["event"].values
    assert [event for event in events if event] == rows
    if place is not None:
        assert result.values["first_contact"].value == pytest.approx(place, rel=1e-12)
    contacts = f"contacts: [{PAIR_OF_HELD}]"
    disc = "obstacles: {disc: {kind: disc, centre: [20 mm, 10 mm], radius: 0.25 mm, beams: [upper]}}"
    alone = cfmkit.analyze(cfmkit.loads(text.replace(contacts, disc)))
    assert result.curve.force[-4:] == pytest.approx(alone.curve.force[-4:], rel=1e-9)


PAIR_OF_HELD = "{between: [upper, lower]}"
HELD = f"""cfmkit: 1
family: beam
mechanism:
  material: {{name: steel-1.4310}}
  width: 10 mm
  thickness: 0.5 mm
  nodes:
    root: {{at: [0 mm, 20 mm], support: guided, direction: 90 deg}}
    tip: {{at: [80 mm, 20 mm]}}
    wall: {{at: [20 mm, 10 mm], support: held}}
    end: {{at: [90 mm, 8 mm], support: guided, direction: 0 deg}}
  beams: {{upper: {{start: root, end: tip, shape: {{kind: arc, sweep: 30 deg}}}}, lower: {{start: wall, end: end}}}}
  contacts: [{PAIR_OF_HELD}]
  drive: {{kind: displacement, node: root, direction: -90 deg}}
analysis: {{travel: 24 mm, points: 13}}
"""


BULGE = (
    stated("{between: [upper, lower]}")
    .replace("{start: root, end: tip}", "{start: root, end: tip, shape: {kind: arc, sweep: 57.3 deg}}")
    .replace("tip: {at: [100 mm, 10 mm]}", "tip: {at: [95.41 mm, 19.57 mm]}")
    .replace("travel: 30 mm", "travel: 60 mm")
)


def test_two_beams_that_begin_to_nest_give_a_partial_result_with_the_reason():
    result = cfmkit.analyze(cfmkit.loads(BULGE))
    force, upper, lower = (result.curve.extra[f"upper_lower_{end}"].values for end in ("force", "at_upper", "at_lower"))
    assert result.status is Status.PARTIAL
    said = warned(result)
    assert "contact of 'upper' on 'lower' spreads along a length" in said["contact_spreads_between_beams"]
    assert "contact begins at" in said["contact_begins"]
    assert force[-1] > 0
    assert 0.3 < lower[-1] < upper[-1] < 1
    drawn = {artist.get_gid() for artist in figures(result)["shapes"]().axes[0].get_children()}
    assert any(name and name.startswith("side-0-") for name in drawn)
    assert any(name and name.startswith("side-1-") for name in drawn)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("{start: wall, end: end}", "{start: wall, end: tip}", "both beams are at node 'tip'"),
        ("{start: wall, end: end}", "{start: wall, end: end, end_offset: [0 mm, 1 mm]}", "beam 'lower' ends beside a"),
        (
            "{start: wall, end: end}", "{start: wall, end: end, thickness: [[0, 1 mm], [1, 2 mm]]}",
            "the thickness of beam 'lower' varies: give a node that touches, and a beam",
        ),
    ],
)  # fmt: skip
def test_two_beams_that_cannot_be_in_contact_are_refused(old, new, says):
    with pytest.raises(SpecError, match=says):
        cfmkit.loads(PAIR_OF_BEAMS.replace(old, new))


def test_two_beams_that_cross_at_rest_are_refused_with_depth_and_place():
    text = PAIR_OF_BEAMS.replace("[80 mm, 0 mm]", "[80 mm, 20 mm]")
    with pytest.raises(InputError, match=r"beams 'upper' and 'lower' overlap by 0\.5 mm at 40% of 'upper' at rest"):
        cfmkit.analyze(cfmkit.loads(text))


@pytest.mark.parametrize(
    ("pair", "says"),
    [
        ("{between: [top, lower]}", "there is no node or beam 'top'; nodes are root, tip, wall, end; beams are upper"),
        ("{between: [upper, upper]}", "contact of beam 'upper' with itself is not modelled"),
        ("{between: [upper, lower], radius: 1 mm}", "two beams touch with half their thickness: leave it out"),
        ("{between: [tip, end]}", "these are two nodes: one must be a beam"),
        ("{between: [end, lower]}", "node 'end' is an end of beam 'lower'"),
        ("{between: [root, lower]}", "no beam ends freely at node 'root': state the radius of its round pad"),
        ("{between: [tip]}", "item 2 of the list is missing"),
        ("{between: [tip, lower], radius: -1 mm}", "must be >= 0"),
        ("{between: [tip, lower], radus: 1 mm}", "radius"),
        (f"{PAIR}\n    - {PAIR}", "its column 'tip_lower_force' has the name of another one"),
    ],
)
def test_a_contact_that_cannot_be_is_refused_with_its_place(pair, says):
    with pytest.raises(SpecError) as caught:
        cfmkit.loads(stated(pair))
    assert "contacts" in str(caught.value)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("analysis: {", "analysis: {fidelity: solid, ", "mechanism.contacts is not supported"),
        ("analysis: {", "analysis: {modes: 1, ", "natural frequencies are not known with contacts"),
        ("  drive:", "  copies: {layers: 2}\n  drive:", "contact is not supported with stages in series"),
        ("direction: -90 deg}", "direction: -90 deg}\ndesign: {rescale: {force: 5 N}}", "do not scale with them"),
        (
            "  drive:", "  stops: {s: {node: tip, direction: 0 deg, gap: 1 mm, friction: 0.2}}\n  drive:",
            "flanks of beams beside contacts with friction are not modelled",
        ),
        ("  drive:", "  stops: {tip_lower: {node: tip, direction: 0 deg, gap: 1 mm}}\n  drive:", "has its name"),
    ],
)  # fmt: skip
def test_what_is_not_possible_with_contacts_is_refused(old, new, says):
    with pytest.raises(SpecError, match="(?s)" + says):
        cfmkit.loads(TWO_LEAVES.replace(old, new))


def test_a_pad_that_overlaps_a_beam_at_rest_is_refused_with_depth_and_place():
    with pytest.raises(InputError, match=r"'tip' overlaps beam 'lower' by 0\.25 mm at 77% of its length"):
        cfmkit.analyze(cfmkit.loads(stated("{between: [tip, lower], radius: 10 mm}")))
