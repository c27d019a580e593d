"""Stops and obstacles in beam specifications: results, columns, findings, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import CANTILEVER, CONFIGS, config, solved, value, warned

import cfmkit
from cfmkit.errors import InputError, SpecError
from cfmkit.families.beam.contacts import change_sentences
from cfmkit.families.beam.figures import figures
from cfmkit.results import Status

FLOOR = "work: {kind: line, through: [0 mm, -40 mm], direction: 0 deg, nodes: {tip: 2 mm}}"


def stated(contacts, text=CANTILEVER):
    """Return a specification with blocks of contacts put in front of its drive."""
    return cfmkit.loads(text.replace("  drive:", f"{contacts}  drive:", 1))


def with_floor(line=FLOOR, root="support: guided, direction: 90 deg"):
    """Return a cantilever whose root moves down until the tip meets a floor."""
    text = CANTILEVER.replace("support: clamped", root).replace("node: tip, direction", "node: root, direction")
    return stated(f"  obstacles:\n    {line}\n", text)


def lan(stop):
    """Return Lan's mechanism with 37 points and a stop on its third node."""
    text = (CONFIGS / "beam_lan2010.yaml").read_text(encoding="utf-8").replace("points: 181", "points: 37")
    text = text[: text.index("requirements:")]
    return stated(f"  stops:\n    end: {stop}\n", text)


def test_lans_mechanism_with_a_rigid_stop_has_the_forces_of_a_support_that_is_switched_on():
    """The reference is the same network with the node held there, solved without contact."""
    free = cfmkit.analyze(config("beam_lan2010", "analysis.points=37"))
    moved = free.state.path.motion("n3")[:, 0]
    most = float(moved[np.abs(moved).argmax()])
    direction = "0 deg" if most > 0 else "180 deg"
    spec = lan(f"{{node: n3, direction: {direction}, gap: {0.5 * abs(most) * 1e3!r} mm}}")
    result = cfmkit.analyze(spec)
    path, curve = result.state.path, result.curve
    assert path.contact_events[0].drive * 1e3 == pytest.approx(6.01475345561, rel=1e-7)
    known = {6.5: (4.57681868684, 1.28776693), 9: (5.03033803189, 7.19888203), 18: (5.5600435822, 21.8572635)}
    for place, (force, stop) in known.items():
        row = int(np.abs(curve.displacement - place * 1e-3).argmin())
        assert curve.force[row] / 2 == pytest.approx(force, rel=1e-7)
        assert curve.extra["stop_end_force"].values[row] == pytest.approx(stop, rel=1e-7)


def test_the_curve_has_a_column_of_each_force_and_a_row_at_each_event():
    result = cfmkit.analyze(with_floor())
    force, event = (result.curve.extra[name].values for name in ("work_tip_force", "event"))
    (row,) = np.flatnonzero(event != "")
    assert event[row] == "work tip begins"
    assert result.curve.displacement[row] == pytest.approx(0.038, rel=1e-12)
    assert len(result.curve) == 22
    assert (force[: row + 1] == 0).all()
    assert force[row + 1 :] == pytest.approx(result.curve.force[row + 1 :], rel=1e-12)
    assert result.values["first_contact"].value == pytest.approx(0.038, rel=1e-12)
    assert result.values["contact_force_max"].value == pytest.approx(force.max(), rel=1e-12)


def test_mean_and_ripple_of_a_contact_force_are_those_of_the_curve_in_the_window():
    result = cfmkit.analyze(with_floor().replace({"analysis.window": ["50 mm", "100 mm"]}))
    mean, ripple = (value(result, f"{name}[work]") for name in ("contact_force", "contact_force_ripple"))
    at = np.linspace(0.05, 0.1, 2001)
    force = result.closed.effort("", at)
    assert mean == pytest.approx(np.trapezoid(force, at) / 0.05, rel=1e-7)
    assert ripple == pytest.approx(1 - force.min() / force.max(), rel=1e-9)


def test_findings_say_where_contacts_begin_and_what_passes_through():
    disc = "work: {kind: disc, centre: [320 mm, -60 mm], radius: 20 mm, nodes: {tip: 1 mm}}"
    said = warned(cfmkit.analyze(with_floor(disc)))
    assert said["side_in_obstacle"].startswith("the side of beam 'beam' passes through 'work' from 40 mm on")
    said = warned(cfmkit.analyze(with_floor()))
    assert said["contact_begins"] == "contact begins at 38 mm between 'tip' and 'work'"


def test_a_blocked_drive_is_a_partial_result_that_says_by_what():
    result = cfmkit.analyze(stated("  stops: {end: {node: tip, direction: -90 deg, gap: 30 mm}}\n"))
    assert result.status is Status.PARTIAL
    assert result.message == "the drive is blocked by stop 'end' at 30 mm"
    assert result.curve.displacement[-1] == pytest.approx(0.03, rel=1e-12)
    assert [finding.name for finding in result.warnings if finding.name in ("blocked", "ends_early")] == ["blocked"]


def test_a_stop_with_two_sides_has_one_signed_column():
    text = CANTILEVER.replace("support: clamped", "support: guided, direction: 90 deg")
    text = text.replace("node: tip, direction: -90 deg", "node: root, direction: 90 deg")
    two_sided = stop("node: tip, direction: -90 deg, gap: [20 mm, 5 mm], stiffness: 3 N/mm")
    force = cfmkit.analyze(stated(two_sided, text)).curve.extra["stop_s_force"].values
    assert force[-1] < 0
    assert force.max() == 0.0


def test_a_rotation_that_is_stopped_has_a_moment():
    text = CANTILEVER.replace("kind: displacement, node: tip, direction: -90 deg", "kind: moment, node: tip")
    lock = stop("node: tip, rotation: true, gap: 40 deg, stiffness: 1 N*m/rad", "lock")
    result = cfmkit.analyze(stated(lock, text.replace("travel: 100 mm", "moment: 100 N*mm")))
    column = result.curve.extra["stop_lock_force"]
    angle = 0.1 * 0.4 / 0.02  # of the free leaf [rad]
    yields = (angle - np.radians(40)) / (1 / 1.0 + 0.4 / 0.02)  # the leaf has 0.05 N m/rad
    assert column.dimension == "torque"
    assert column.values[-1] == pytest.approx(yields, rel=1e-9)


def stop(text, name="s"):
    return f"  stops: {{{name}: {{{text}}}}}\n"


def body(text):
    return f"  obstacles: {{o: {{{text}}}}}\n"


WALL = "kind: line, through: [0 mm, -50 mm], direction: 0 deg"
CORNER = "kind: polyline, points: [[0 mm, -50 mm], [9 mm, -50 mm], [9 mm, -90 mm]]"
DISC = "kind: disc, centre: [400 mm, -10 mm], radius: 12 mm, nodes: {tip: 1 mm}"
HOLE = "kind: hole, centre: [400 mm, 0 mm], radius: 2 mm, nodes: {tip: 3 mm}"


@pytest.mark.parametrize(
    ("contacts", "place", "says"),
    [
        (stop("node: top, direction: 0 deg, gap: 1 mm"), "stops.s", "there is no node 'top'"),
        (stop("node: tip, direction: 0 deg, gap: -1 mm"), "stops.s", "must be >= 0"),
        (stop("node: tip, direction: 0 deg, gap: 1 deg"), "stops.s", "length"),
        (stop("node: tip, rotation: true, gap: 1 mm"), "stops.s", "angle"),
        (stop("node: tip, direction: 0 deg, gap: 1 mm, friction: 2"), "stops.s", "must be >= 0 and < 2"),
        (stop("node: tip, rotation: true, gap: 1 deg, friction: 0.2"), "stops.s", "friction"),
        (stop("node: tip, gap: 1 mm"), "stops.s", "direction"),
        (stop("node: root, direction: 0 deg, gap: 1 mm"), "stops.s.node", "is clamped: it reaches no stop"),
        (body(f"{WALL}, beams: [beam], friction: 0.2"), "obstacles.o",
         "friction along a beam's flank is not modelled: state 'nodes', or leave out 'friction'"),
        (stop("node: tip, direction: 0 deg, gap: 1 mm, friction: 0.2") + body(WALL), "obstacles.o",
         "flanks of beams beside contacts with friction are not modelled"),
        (body(DISC), "obstacles.o", "the pad of node 'tip' lies 3 mm inside it before any load"),
        (body(HOLE), "obstacles.o", "its hollow of 2 mm is too tight for the pad of 'tip', radius 3 mm"),
        (body(f"{CORNER}, fillet: 10 mm"), "obstacles.o", "the sides allow a fillet of at most 9 mm"),
        (body(CORNER), "obstacles.o", "'fillet', the radius of its corners, is missing"),
        (body(f"{WALL}, beams: [baem]"), "obstacles.o", "baem"),
        (body(f"{WALL}, beams: [beam], stiffness: 1 N/mm"), "obstacles.o", "rigid"),
        (body(WALL.replace("line", "lin")), "obstacles.o", "line"),
        (stop("node: tip, direction: 0 deg, gap: 1 mm", "o") + body(WALL), "obstacles.o", "a stop has the same name"),
    ],
)  # fmt: skip
def test_a_contact_that_cannot_be_is_refused_with_its_place(contacts, place, says):
    with pytest.raises(SpecError) as caught:
        stated(contacts)
    assert place in str(caught.value)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("analysis:\n  modes: 1", "natural frequencies are not known with contacts"),
        ("design:\n  rescale: {force: 5 N}\nanalysis:", "do not scale with them"),
        ("analysis:\n  fidelity: solid", "mechanism.stops is not supported"),
        ('requirements:\n  - {metric: "contact_force[wall]", max: 1 N}\nanalysis:', "there are: s"),
        ("requirements:\n  - {metric: contact_force, max: 1 N}\nanalysis:",
         "needs the name of a stop, an obstacle or a contact"),
    ],
)  # fmt: skip
def test_what_is_not_possible_with_contacts_is_refused(more, says):
    text = CANTILEVER.replace("analysis:", more).replace("2.4 GPa", "2.4 GPa, density: 1000 kg/m^3")
    with pytest.raises(SpecError, match="(?s)" + says.replace("[", r"\[")):
        stated("  stops: {s: {node: tip, direction: -90 deg, gap: 9 mm}}\n", text)


def test_the_shipped_stop_keeps_the_leaf_below_its_allowable_stress():
    stopped = solved("beam_stop")
    free = solved("beam_stop", "mechanism.stops={}")
    allowable = stopped.allowable_stress
    assert stopped.curve.extra["max_stress"].values.max() < allowable < free.curve.extra["max_stress"].values.max()


def test_obstacles_stops_and_touching_pads_are_drawn():
    gripper = {"obstacle-work-0", "hatch-work-0", "touch-0-71"}
    for name, parts in (("beam_gripper", gripper), ("beam_stop", {"stop-bumper-0-0"})):
        figure = figures(solved(name))["shapes"]()
        drawn = {artist.get_gid() for artist in figure.axes[0].get_children()}
        assert parts <= drawn


def test_forces_of_contacts_are_arrows_in_one_scale_and_events_are_ticks():
    """Arrows go from the centre of the disc outwards, as long as the forces; the tick is where contact begins."""
    result = solved("beam_gripper")
    forces = result.curve.extra["work_tip_force"].values
    ax = figures(result)["shapes"]().axes[0]
    arrows = {
        text.get_gid(): np.subtract(text.xyann, text.xy) for text in ax.texts if "force" in (text.get_gid() or "")
    }
    pads = {gid: artist.get_xydata()[0] for artist in ax.lines if (gid := artist.get_gid() or "").startswith("touch-0")}
    assert len(arrows) == len(pads) == 3
    poses = [int(gid.split("-")[2]) for gid in arrows]
    lengths = [np.hypot(*arrow) for arrow in arrows.values()]
    assert np.divide(lengths, lengths[-1]) == pytest.approx(forces[poses] / forces[poses[-1]])
    for pose, arrow in zip(poses, arrows.values(), strict=True):
        outwards = pads[f"touch-0-{pose}"] - np.array([14.0, -16.0])
        assert -arrow / np.hypot(*arrow) == pytest.approx(outwards / np.hypot(*outwards))
    (ticks,) = (line for line in figures(result)["curve"]().axes[0].lines if line.get_gid() == "events")
    assert ticks.get_xdata() == pytest.approx([1e3 * result.values["first_contact"].value])


def test_a_contact_that_a_constant_load_closes_is_reported_from_the_start():
    text = CANTILEVER.replace("kind: displacement, node: tip, direction: -90", "kind: force, node: tip, direction: 0")
    load = "  loads: [{kind: point, node: tip, fy: -0.1 N}]\n"
    contacts = stop("node: tip, direction: -90 deg, gap: 9 mm", "end") + load
    result = cfmkit.analyze(stated(contacts, text.replace("travel: 100 mm", "force: 0.01 N")))
    (said,) = (finding.message for finding in result.warnings if finding.name == "contact_begins")
    assert said == "closed before the drive moves: stop 'end'"
    assert result.values["first_contact"].value == result.curve.displacement[0]
    free = 3 * 0.02 * 0.009 / 0.4**3  # what bends the leaf by the gap, to first order [N]
    assert result.curve.extra["stop_end_force"].values[0] == pytest.approx(0.1 - free, rel=2e-3)


def test_a_support_that_is_pushed_against_a_rigid_stop_has_no_start():
    text = CANTILEVER.replace("support: clamped}", "support: clamped, moved: {across: -20 mm}}")
    text = text.replace("direction: -90 deg}", "direction: 0 deg}").replace("travel: 100 mm", "travel: 1 mm")
    result = cfmkit.analyze(stated(stop("node: root, direction: -90 deg, gap: 10 mm", "end"), text))
    assert result.status is Status.NO_EQUILIBRIUM
    assert "the drive is blocked by stop 'end' at 0.5 of the constant loads" in result.message


LEAF = """cfmkit: 1
family: beam
mechanism:
  material: {name: steel-1.4310}
  width: 10 mm
  thickness: 0.5 mm
  nodes:
    root: {at: [0 mm, 0 mm], support: clamped}
    tip: {at: [100 mm, 0 mm]}
  beams: {leaf: {start: root, end: tip}}
  obstacles:
    OBSTACLES
  drive: {kind: displacement, node: tip, direction: -90 deg}
analysis: {travel: 30 mm, points: 16}
"""


def over(obstacles):
    """Return a leaf over obstacles."""
    return cfmkit.loads(LEAF.replace("OBSTACLES", obstacles))


def test_the_side_of_a_leaf_has_columns_of_its_force_and_place_and_a_sentence():
    result = cfmkit.analyze(over("pin: {kind: disc, centre: [50 mm, -10 mm], radius: 4.75 mm}"))
    force, first, last = (result.curve.extra[f"pin_leaf_{end}"].values for end in ("force", "from", "to"))
    (row,) = np.flatnonzero(result.curve.extra["event"].values != "")
    assert result.curve.extra["event"].values[row] == "pin leaf begins"
    assert np.isnan(first[:row]).all()
    assert (force[row + 1 :] > 0).all()
    assert first[row + 1 :] == pytest.approx(last[row + 1 :])
    assert (np.diff(first[row + 1 :]) > 0).all()  # it slides outwards
    values = dict(cfmkit.evaluate(result))
    assert values["contact_force[pin]"].value > 0
    assert np.isfinite(values["static_balance"].value)
    assert result.values["contact_force_max"].value == pytest.approx(force.max(), rel=1e-9)
    said = warned(result)
    assert "contact begins at" in said["contact_begins"]
    assert "'leaf' and 'pin'" in said["contact_begins"]
    assert "side_in_obstacle" not in said


def test_a_leaf_that_is_clamped_on_a_drum_wraps_around_it_and_its_stress_stays():
    result = cfmkit.analyze(over("drum: {kind: disc, centre: [0 mm, -150.25 mm], radius: 150 mm, beams: [leaf]}"))
    first, last = (result.curve.extra[f"drum_leaf_{end}"].values for end in ("from", "to"))
    assert first[-1] == 0
    assert 0.05 < last[-1] < 0.9
    bent = 0.5 * 0.5e-3 / 150.25e-3 * result.spec.mechanism.collect_beam_values("material")["leaf"].youngs_modulus
    assert result.curve.extra["max_stress"].values[-1] == pytest.approx(bent, rel=1e-6)
    assert "lies along 'drum'" in warned(result)["contact_begins"]


def test_a_leaf_that_lies_in_an_obstacle_before_any_load_is_refused_with_depth_and_place():
    with pytest.raises(InputError, match=r"'leaf' lies 2\.25 mm inside it at 50% of its length"):
        cfmkit.analyze(over("pin: {kind: disc, centre: [50 mm, -3 mm], radius: 5 mm}"))


def test_pads_alone_leave_the_side_of_a_leaf_out_and_say_so():
    result = cfmkit.analyze(over("pin: {kind: disc, centre: [50 mm, -10 mm], radius: 4.75 mm, nodes: {tip: 1 mm}}"))
    said = warned(result)
    assert "list it in 'beams'" in said["side_in_obstacle"]
    assert "pin_leaf_force" not in result.curve.extra


def test_a_side_that_touches_one_obstacle_is_seen_to_pass_through_another():
    more = "pin: {kind: disc, centre: [50 mm, -10 mm], radius: 4.75 mm, beams: [leaf]}\n"
    more += "    bore: {kind: hole, centre: [99 mm, 0 mm], radius: 30 mm, nodes: {tip: 1 mm}}"
    said = warned(cfmkit.analyze(over(more)))
    assert "passes through 'bore' from 0 mm on, at 0% of its length" in said["side_in_obstacle"]
    assert "'leaf' and 'pin'" in said["contact_begins"]


@pytest.mark.parametrize("count", [5, 6, 8])
def test_of_many_changes_the_first_six_are_told_and_the_others_counted(count):
    solution = cfmkit.analyze(over("pin: {kind: disc, centre: [50 mm, -90 mm], radius: 4.75 mm}")).state
    changes = [f"change {number}" for number in range(count)]
    ((name, text),) = change_sentences(solution, str, changes)
    assert name == "contact_begins"
    assert text == "; ".join(changes[:6] + (["and 2 more changes"] if count > 6 else []))


def test_friction_makes_the_way_back_a_branch_of_its_own_with_hysteresis():
    own = "support: guided, direction: 90 deg"
    lines = (FLOOR.replace("mm}}", f"mm}}, friction: {friction}}}") for friction in (0, 0.3))
    smooth, rough = (cfmkit.analyze(with_floor(line, own)) for line in lines)
    assert smooth.curve.branches == ("load",)
    assert rough.curve.branches == ("load", "unload")
    assert "work_tip_state" not in smooth.curve.extra
    motion, unload = rough.curve.displacement, rough.curve.branch == "unload"
    assert motion[unload][0] == motion[~unload][-1] == motion.max()
    assert motion[unload][-1] == motion[0]
    columns = rough.curve.extra
    force, rubbing = columns["work_tip_force"].values, columns["work_tip_tangential"].values
    assert (np.abs(rubbing) <= 0.3 * force + 1e-9 * force.max()).all()
    slips = columns["work_tip_state"].values == "slip"
    assert np.abs(rubbing)[slips] == pytest.approx(0.3 * force[slips], rel=1e-9)
    marks = [mark for mark in columns["event"].values.tolist() if mark]
    assert "stability_of_sliding" in {warning.name for warning in rough.warnings}
    assert (marks[0], marks[-1]) == ("work tip begins", "work tip ends")
    assert set(marks[1:-1:2]) == {"work tip sticks"}  # where its sliding turns round, and where the drive does
    assert set(marks[2:-1:2]) == {"work tip slips"}
    assert cfmkit.evaluate(rough, ["hysteresis_area"])["hysteresis_area"].value > 0
    assert any("on the way back: 'tip' sticks to 'work'" in finding.message for finding in rough.warnings)
