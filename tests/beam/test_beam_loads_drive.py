"""Several loads together as the drive: a force, a moment and a load along the beam, times a common factor."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import CANTILEVER, config
from scipy.integrate import solve_bvp

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.results import Status

RIGIDITY, LENGTH = 0.02, 0.4  # [N m2], [m]
DRIVE = "{kind: loads, node: tip, direction: -90 deg, loads: [LOADS]}"
TEXT = CANTILEVER.replace("{kind: displacement, node: tip, direction: -90 deg}", DRIVE).replace(
    "  travel: 100 mm\n  points: 21", "  factor: FACTOR\n  points: 5"
)
FORCE = "{kind: point, node: tip, fx: -0.1 N, fy: -0.3 N}"
MOMENT = "{kind: point, node: tip, moment: 40 N*mm}"
LINE = "{kind: line, beam: beam, wy: -0.002 N/mm}"


def loaded(*loads, factor=1.0, more=(), follows=False):
    text = TEXT.replace("LOADS", ", ".join(loads)).replace("FACTOR", str(factor))
    for old, new in more:
        assert old in text
        text = text.replace(old, new)
    return cfmkit.analyze(cfmkit.loads(text))


def tip(result, index=-1):
    return result.state.path.motion("tip")[result.state.keep][index]


def test_small_loads_add_up():
    """To the second order of the factor: each alone, and all of them together."""
    apart = sum(tip(loaded(load, factor=1e-5)) for load in (FORCE, MOMENT, LINE))
    together = tip(loaded(FORCE, MOMENT, LINE, factor=1e-5))
    np.testing.assert_allclose(together[1:], apart[1:], rtol=1e-5)
    down = 0.3 * LENGTH**3 / 3 - 0.04 * LENGTH**2 / 2 + 2 * LENGTH**4 / 8
    assert together[1] == pytest.approx(-1e-5 * down / RIGIDITY, rel=1e-5)


def test_large_loads_bend_the_beam_as_its_equations_say():
    """The elastica under all three loads at every factor, solved as a boundary-value problem by collocation."""
    result = loaded(FORCE, MOMENT, LINE, factor=2)
    for point in (1, 2, 3, 4):
        factor = float(result.curve.extra["load_factor"].values[point])
        fx, fy, moment, w = factor * np.array([-0.1, -0.3, 0.04, -2.0])

        def slopes(s, state, fx=fx, fy=fy, w=w):
            turn, bend, _, _ = state
            across = fy + w * (LENGTH - s)
            return np.array([bend / RIGIDITY, fx * np.sin(turn) - across * np.cos(turn), np.cos(turn), np.sin(turn)])

        def ends(start, end, moment=moment):
            return np.array([start[0], end[1] - moment, start[2], start[3]])

        s = np.linspace(0, LENGTH, 101)
        guess = np.array([-2 * factor * s, 0 * s, s, -factor * s * s])
        found = solve_bvp(slopes, ends, s, guess, tol=1e-9, max_nodes=20000)
        assert found.success
        turn, _, x, y = found.y[:, -1]
        np.testing.assert_allclose(tip(result, point), [x - LENGTH, y, turn], atol=2e-8)


def test_the_curve_has_the_reference_times_the_factor_as_its_force():
    result = loaded(FORCE, LINE, factor=2, more=[("direction: -90 deg", "direction: -90 deg, reference: 5 N")])
    np.testing.assert_allclose(result.curve.extra["load_factor"].values, [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(result.curve.force, [0, 2.5, 5, 7.5, 10])
    np.testing.assert_allclose(result.curve.motion, -result.state.path.motion("tip")[result.state.keep][:, 1])


def test_one_load_is_a_drive_by_that_force():
    more = [("-90 deg", "-90 deg, reference: 0.5 N")]
    alone = loaded("{kind: point, node: tip, fy: -0.5 N}", factor=1, more=more)
    drive = "{kind: loads, node: tip, direction: -90 deg, loads: [LOADS]}"
    text = TEXT.replace(drive, "{kind: force, node: tip, direction: -90 deg}").replace("factor: FACTOR", "force: 0.5 N")
    force = cfmkit.analyze(cfmkit.loads(text))
    np.testing.assert_allclose(alone.curve.motion, force.curve.motion, atol=1e-9)
    np.testing.assert_allclose(alone.curve.force, force.curve.force)
    assert alone.values["cross_stiffness"].value == pytest.approx(force.values["cross_stiffness"].value, rel=1e-6)


TOGGLE = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 200 GPa}
  thickness: 1 mm
  width: 10 mm
  axial: true
  nodes:
    left: {at: [0 mm, 0 mm], support: clamped}
    top: {at: [100 mm, RISE mm], support: guided, direction: 90 deg}
  beams: {leg: {start: left, end: top}}
  drive:
    kind: loads
    node: top
    direction: -90 deg
    loads: [{kind: point, node: top, fy: -FORCE N}, {kind: line, beam: leg, wy: -LINE N/mm}]
analysis: {factor: 40, points: 21, through_folds: true}
"""


@pytest.mark.parametrize("rise", [2.5, 6])
def test_where_it_snaps_is_told_as_a_factor_and_as_a_force(rise):
    """Half of Williams' toggle under a force and a load along it: half the factor for twice the loads."""
    text = TOGGLE.replace("RISE", str(rise))
    one, two = (
        cfmkit.analyze(cfmkit.loads(text.replace("FORCE", force).replace("LINE", line)))
        for force, line in (("1", "0.01"), ("2", "0.02"))
    )
    found = one.values["limit_force"].value
    assert found == pytest.approx(2 * two.values["limit_force"].value, rel=1e-6)
    message = next(item.message for item in one.warnings if item.name == "limit_point")
    assert f"{found:.5g} times the loads" in message


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("factor: 1", "force: 1 N", "give 'factor'"),
        ("  factor: 1\n", "", "the key 'factor' is missing"),
        ("factor: 1", "factor: 0", "must not be 0"),
        ("fx: -0.1 N, fy: -0.3 N", "", "every load is zero"),
        (
            FORCE,
            f"{FORCE}, {{kind: point, node: tip, fx: 0.1 N, fy: 0.1 N}}, {{kind: point, node: tip, fy: 0.2 N}}",
            "they cancel",
        ),
        ("kind: point, node: tip", "kind: point, node: top", "there is no node 'top'"),
        ("kind: loads, node: tip", "kind: loads, node: root", "cannot move"),
    ],
)
def test_what_is_wrong_is_said_at_its_place(old, new, reported):
    with pytest.raises(SpecError) as caught:
        loaded(FORCE, factor=1, more=[(old, new)])
    assert reported in str(caught.value)


@pytest.mark.parametrize("rest", ["moment: 1 N*mm", "follows: true"])
def test_loads_that_cancel_but_for_a_moment_or_while_they_turn_drive_the_mechanism(rest):
    opposite = f"{{kind: point, node: tip, fx: 0.1 N, fy: 0.3 N, {rest}}}"
    assert loaded(FORCE, opposite).status is Status.COMPLETE


PLACES = (
    "range_95", "band_range_05pct", "band_range_1pct", "band_range_5pct", "usable_stroke", "usable_start", "usable_end"
)  # fmt: skip
DRIVES = {
    "force": ("{kind: force, node: tip, direction: -90 deg}", "force: 1.25 N"),
    "moment": ("{kind: moment, node: tip}", "moment: 60 N*mm"),
    "loads": (DRIVE.replace("LOADS", f"{FORCE}, {MOMENT}, {LINE}"), "factor: 1"),
}


@pytest.mark.parametrize("kind", DRIVES)
def test_places_on_a_curve_driven_by_a_load_do_not_depend_on_its_points(kind):
    drive, goal = DRIVES[kind]
    found = []
    for points in (31, 961):
        text = CANTILEVER.replace("{kind: displacement, node: tip, direction: -90 deg}", drive)
        text = text.replace("  travel: 100 mm\n  points: 21", f"  {goal}\n  points: {points}")
        metrics = cfmkit.analyze(cfmkit.loads(text)).metrics
        found.append([metrics[name].value for name in PLACES])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8)


@pytest.mark.slow
def test_a_path_that_folds_is_followed_to_its_end_with_many_points():
    """It passes most loads three times: the points that are requested do not use up those of the path."""
    ends = [cfmkit.analyze(config("beam_lee_frame", f"analysis.points={points}")) for points in (121, 1921)]
    assert [end.status for end in ends] == [Status.COMPLETE, Status.COMPLETE]
    assert ends[1].metrics["travel_end"].value == pytest.approx(ends[0].metrics["travel_end"].value, rel=1e-9)
