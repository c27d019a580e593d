"""The part of a beam mechanism as a planar solid: numbers of an independent solver, limits, and what is refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from vee_leaf import VEE

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.results import Result, Status
from cfmkit.solid import SolidProblem

CONFIGS = Path(__file__).parents[2] / "configs"
LAN = CONFIGS / "beam_lan2010.yaml"


@cache
def lan(**changes: object) -> Result:
    """Return Lan's part as a solid: some five seconds, the least in which its numbers can be had."""
    law = changes.pop("law", None)
    keys = {f"analysis.solid.{key}": value for key, value in changes.items()}
    keys |= {} if law is None else {"mechanism.material.law": law}
    return cfmkit.analyze(cfmkit.load(LAN).replace({"analysis.fidelity": "solid", **keys}))


def test_lans_part_has_the_force_and_the_peak_stress_of_a_much_finer_mesh():
    """47 334 degrees of freedom, another mesher, another program: force within 6e-4, peak stress within 2 %.

    That part was drawn 0.5 um too thick, and within 5 um: its forces are taken times (1 mm / 1.0005 mm)^3.
    """
    result = lan()
    force = {0.002: 4.94597, 0.006: 9.20436, 0.010: 10.10955, 0.0136: 10.08839, 0.018: 10.80585}
    for place, value in force.items():
        assert np.interp(place, result.curve.motion, result.curve.effort) == pytest.approx(value / 1.0005**3, rel=6e-4)
    metrics = cfmkit.evaluate(result)
    assert metrics["stress_max"].value == pytest.approx(60.65e6, rel=0.02)
    assert abs(result.values["peak_stress_x"].value) == pytest.approx(12.12e-3, abs=0.1e-3)
    assert result.values["peak_stress_y"].value == pytest.approx(25.00e-3, abs=0.1e-3)
    assert {found.name for found in result.warnings} == {"overstressed", "wide_beam"}


@pytest.mark.slow
def test_rubber_like_material_carries_a_little_more():
    """Neo-Hookean against Hooke's law in Green's strain: +0.3 % of force and +5.6 % of peak stress; a coarse mesh."""
    one, other = (lan(error=0.01, poses=9, law=law) for law in ("st-venant-kirchhoff", "neo-hookean"))
    at = int(np.abs(one.curve.motion - 0.0135).argmin())
    assert other.curve.effort[at] / one.curve.effort[at] - 1 == pytest.approx(0.003, abs=0.0015)
    stress = [result.curve.extra["max_stress"].values[at] for result in (one, other)]
    assert stress[1] / stress[0] - 1 == pytest.approx(0.056, abs=0.015)


@pytest.fixture(scope="module")
def snapping() -> dict[str, Result]:
    """A leaf that buckles on its way, as beams and as a solid."""
    spec = cfmkit.loads(VEE)
    return {name: cfmkit.analyze(spec.replace({"analysis.fidelity": name})) for name in ("solid", "reissner")}


def test_a_leaf_that_buckles_follows_its_stable_branch(snapping):
    solid, beams = (snapping[name].curve for name in ("solid", "reissner"))
    assert snapping["solid"].status is Status.COMPLETE
    assert solid.stable.all()
    assert solid.effort.max() == pytest.approx(beams.effort.max(), rel=0.01)
    assert solid.effort.min() == pytest.approx(beams.effort.min(), rel=0.02)
    assert solid.effort == pytest.approx(beams.effort, abs=0.02 * beams.effort.max())


SLIDE = {"kind": "slide", "node": "n3", "direction": "0 deg", "stiffness": "1 N/mm"}
PUSH = {"kind": "point", "node": "n3", "fx": "1 N"}
CONSTANT = "mechanism.loads is not supported: constant loads act on nodes, and keep their direction; leave"


@pytest.mark.parametrize(
    ("config", "said", "changes"),
    [
        ("beam_lee_frame", "mechanism.drive.follows is not supported: its", {"mechanism.drive.follows": True}),
        ("beam_v_bifurcation", "analysis.modes is not supported: it has no masses; leave", {}),
        ("beam_lan2010", "analysis.through_folds is not supported: a motion is followed to its first fold; leave",
         {"analysis.through_folds": True}),
        ("beam_lan2010", CONSTANT, {"mechanism.loads": [PUSH | {"follows": True}]}),
        ("beam_lan2010", CONSTANT, {"mechanism.loads": [{"kind": "line", "beam": "b1", "wx": "1 N/m"}]}),
        ("beam_lan2010", "analysis.loads_first is not supported: constant loads act from the start; leave",
         {"mechanism.loads": [PUSH], "analysis.loads_first": False}),
        ("beam_design_arch",
         "mechanism.loads is not supported: with constant loads the force is not proportional to the width; leave",
         {"mechanism.loads": [PUSH | {"node": "b"}], "design.verify": "solid"}),
        ("beam_lan2010",
         "mechanism.springs is not supported: only the .*; mechanism.beams is not .* must have one width; leave",
         {"mechanism.springs": {"s": SLIDE}, "mechanism.beams.b1.width": "5 mm"}),
        ("beam_lan2010", r"mechanism\.nodes\.n2\.moved is not supported: the part is solved as drawn",
         {"mechanism.nodes.n2.moved": {"along": "1 mm"}}),
        ("beam_lan2010", r"mechanism\.beams\.b3\.start_joint is not supported: the outline is one piece",
         {"mechanism.beams.b3.start_joint": "pin"}),
    ],
)  # fmt: skip
def test_what_a_solid_cannot_be_is_refused_in_one_line(config, said, changes):
    poisson = {"mechanism.material.poisson_ratio": 0.3}
    with pytest.raises(SpecError, match=said) as caught:
        cfmkit.load(CONFIGS / f"{config}.yaml").replace({"analysis.fidelity": "solid", **poisson, **changes})
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(
    ("fillet", "said"),
    [
        ("0 mm", "without fillets the stress in inside corners has no value"),
        ("1e-6 mm", "in the outline, fillets of 1e-06 mm are sharp corners: the stress there has no value"),
    ],
)
def test_a_part_without_fillets_is_solved_and_warns_that_stress_has_no_value(fillet, said):
    result = cfmkit.analyze(
        cfmkit.loads(VEE.replace("0.05 mm", fillet)).replace({"analysis.travel": "1 mm", "analysis.solid.error": 0.1})
    )
    assert [found.message for found in result.warnings if found.name == "sharp_corners"] == [said]


def test_a_part_is_pulled_as_well_as_pressed():
    spec = cfmkit.loads(VEE).replace({"analysis.solid.poses": 3, "analysis.points": 5})
    pulled, turned = (
        cfmkit.analyze(spec.replace(change))
        for change in (
            {"analysis.travel": "-0.5 mm"},
            {"analysis.travel": "0.5 mm", "mechanism.drive.direction": "90 deg"},
        )
    )
    assert pulled.status is turned.status is Status.COMPLETE
    assert pulled.curve.motion == pytest.approx(-turned.curve.motion)
    assert pulled.curve.effort == pytest.approx(-turned.curve.effort, rel=1e-6, abs=1e-9)
    assert pulled.curve.extra["max_stress"].values == pytest.approx(
        turned.curve.extra["max_stress"].values, rel=1e-6, abs=1e-3
    )


def test_a_drive_that_nothing_follows_has_no_curve_and_names_the_keys(monkeypatch):
    # no pose beside the first is ever found
    solve = SolidProblem.solve
    monkeypatch.setattr(
        SolidProblem, "solve", lambda self, start, travel, *_: None if travel else solve(self, start, travel)
    )
    result = cfmkit.analyze(cfmkit.loads(VEE))
    assert result.status is Status.NO_EQUILIBRIUM
    assert "mechanism.nodes.shuttle.support" in result.message


def test_an_incompressible_material_is_refused_where_the_law_has_no_value_for_it():
    with pytest.raises(SpecError, match=r"poisson_ratio below 0\.5"):
        cfmkit.loads(VEE.replace("0.35", "0.5")).replace({"mechanism.material.law": "neo-hookean"})


HAIRPIN = """
cfmkit: 1
family: beam
name: hairpin
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35}
  thickness: 1 mm
  width: 5 mm
  nodes:
    root: {at: [0 mm, 0 mm], support: clamped}
    bend: {at: [40 mm, 0 mm]}
    top: {at: [40 mm, 4 mm]}
    tip: {at: [0 mm, 4 mm], support: guided, direction: 90 deg}
  beams:
    low: {start: root, end: bend}
    side: {start: bend, end: top}
    high: {start: top, end: tip}
  drive: {kind: displacement, node: tip, direction: -90 deg}
  part: {fillet: 0.5 mm, pad: [3 mm, 2 mm]}
analysis: {travel: 6 mm, points: 31, fidelity: solid, solid: {poses: 5, error: 0.1}}
"""


def test_a_part_that_touches_itself_is_a_partial_curve_with_the_place():
    """Two beams 3 mm apart, one of them driven towards the other: pads of 2 mm meet before they do."""
    result = cfmkit.analyze(cfmkit.loads(HAIRPIN))
    assert result.status is Status.PARTIAL
    (reported,) = (found.message for found in result.warnings if found.name == "self_contact")
    assert reported == result.message
    assert reported.startswith("the part touches itself at (")
    assert 1.7e-3 < float(result.curve.motion[-1]) <= 2.0e-3


def test_a_mesh_that_would_be_endless_is_no_result_but_a_sentence(monkeypatch):
    monkeypatch.setattr("cfmkit.solid.mesh.MOST_NODES", 100)
    result = cfmkit.analyze(cfmkit.loads(VEE))
    assert result.status is Status.NO_EQUILIBRIUM
    assert result.message.startswith("the part cannot be meshed: the mesh would have more than 100 nodes")
    assert "mechanism.part" in result.message


COARSE = {
    "analysis.travel": "0.5 mm",
    "analysis.points": 5,
    "analysis.solid.poses": 3,
    "analysis.solid.error": 0.1,
}


@pytest.mark.parametrize(
    ("holes", "said"),
    [
        ("{at: [-0.991 mm, -0.133 mm], diameter: 1.9996 mm}", "is too thin, or its edge too sharply curved, at (-0.85"),
        ("{at: [12 mm, 1.65 mm], diameter: 3 mm}", "the hole round (12 mm, 1.65 mm) is not inside the outline"),
        (
            "{at: [-1 mm, -0.1 mm], diameter: 1 mm}, {at: [-1.2 mm, -0.1 mm], diameter: 1 mm}",
            "crosses itself or touches itself at (-1.1 mm",
        ),
    ],
)
def test_a_part_that_cannot_be_meshed_is_one_line_with_the_place(holes, said):
    result = cfmkit.analyze(
        cfmkit.loads(VEE.replace("fillet: 0.05 mm", f"fillet: 0.05 mm, holes: [{holes}]")).replace(COARSE)
    )
    assert result.status is Status.NO_EQUILIBRIUM
    assert not result.curves
    assert said in result.message
    assert result.message.startswith("the part cannot be meshed: ")
    assert "mechanism.part" in result.message
    assert "\n" not in result.message


def test_a_solver_that_stops_on_the_way_leaves_the_curve_up_to_there(monkeypatch):
    spec = cfmkit.loads(VEE).replace({**COARSE, "analysis.travel": "0.2 mm"})
    whole = cfmkit.analyze(spec)
    solve = SolidProblem.solve

    def stops(self, guess, travel, border=None):
        found = solve(self, guess, travel, border)
        return found if found is not None and found.travel < 0.16e-3 else None

    monkeypatch.setattr(SolidProblem, "solve", stops)
    result = cfmkit.analyze(spec)
    assert result.status is Status.PARTIAL
    assert "ends_early" in {found.name for found in result.warnings}
    assert 0.1e-3 <= float(result.curve.motion[-1]) < 0.16e-3
    count = len(result.curve.motion)
    assert result.curve.effort == pytest.approx(whole.curve.effort[:count], rel=1e-3)


@pytest.mark.parametrize(("fillet", "largest"), [("0.5 mm", 1.0), ("5 mm", 1.0), ("20 mm", 4.0)])
def test_a_part_that_is_mostly_fillets_has_larger_elements_in_its_blocks(fillet, largest):
    spec = cfmkit.load("configs/beam_lan2010.yaml", ["analysis.fidelity=solid", f"mechanism.part.fillet={fillet}"])
    (one,) = family("beam").elastic.solids(spec)
    assert one.part.largest == largest
    if largest > 1.0:
        assert (
            len(one.part.create_mesh().refine()[0].problem.elements.mesh.nodes) < 9000
        )  # 57 725 with elements of one size


BRACED = """
cfmkit: 1
family: beam
name: braced
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35}
  thickness: 1 mm
  width: 6 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    b: {at: [0 mm, 30 mm], support: clamped}
    c: {at: [40 mm, 0 mm]}
    d: {at: [40 mm, 30 mm]}
  beams: {lower: {start: a, end: c}, upper: {start: b, end: d}}
  links: [{master: c, node: d}]
  part: {fillet: 1 mm}
  drive: {kind: displacement, node: c, direction: -90 deg}
analysis: {travel: 2 mm, fidelity: solid, points: 5, solid: {poses: 3, error: 0.1}}
"""


def test_a_node_on_a_link_is_moved_over_its_whole_section():
    """One node of the mesh had been moved, whose turn nothing resists: there was no equilibrium."""
    spec = cfmkit.loads(BRACED)
    (one,) = family("beam").elastic.solids(spec)
    solved = one.part.create_mesh().refine()[0].follow_stops([0.0, 1e-3, 2e-3])
    (driven,) = (group for group in solved.problem.supports.groups if group.name == "c")
    at = solved.problem.elements.mesh.nodes[driven.nodes]
    assert np.ptp(at[:, 1]) == pytest.approx(1e-3, abs=0.15e-3)
    assert solved.course.travel[-1] == 2e-3
    beams = cfmkit.analyze(spec.replace({"analysis.fidelity": "reissner"})).curve.effort[-1]
    assert 1.0 < solved.course.poses[-1].effort / beams < 1.2


@pytest.mark.slow
def test_a_leaf_is_followed_past_both_of_its_bifurcations():
    """Where its branch joins the other path again, the path had been lost on this mesh, which rounds the corner."""
    (one,) = family("beam").elastic.solids(cfmkit.loads(VEE))
    course = one.part.create_mesh().follow_stops([0.0, 2e-3, 4e-3, 4.4e-3]).course
    assert course.ending.name == "COMPLETE"
    assert all(pose.unstable == 0 for pose in course.poses)
    # on meshes of 5381 and 16840 nodes: 0.26404 and 0.26403, and 4.1165 mm
    assert course.bifurcations == pytest.approx([0.26404e-3, 4.1165e-3], rel=1e-3)
    sides = [np.sign(course.poses[k].stiffness) for k in (0, 6, -1)]
    assert sides == [1.0, -1.0, 1.0]


def test_the_moving_part_of_each_stage_in_series_is_a_piece_of_its_own():
    spec = cfmkit.load("configs/beam_two_layers.yaml", ["analysis.fidelity=solid", "mechanism.copies.layers=3"])
    (one,) = family("beam").elastic.solids(spec)
    heights = {place.name: np.concatenate(place.shapes)[:, 1] for place in one.part.places}
    for below, stage in enumerate(("n5", "n5.2", "n5.3")):
        assert 39e-3 + below * 46e-3 < heights[stage].min()
        assert heights[stage].max() < 47e-3 + below * 46e-3
    bars = [len(place.shapes) for place in one.part.places if place.name in heights and place.name[-1] != "'"]
    assert max(bars) == 2  # a pad and the bar to the other half


@pytest.mark.slow
def test_stages_in_series_share_the_travel_and_carry_one_force():
    spec = cfmkit.load("configs/beam_two_layers.yaml", ["analysis.fidelity=solid"])
    (one,) = family("beam").elastic.solids(spec)
    solved = one.part.create_mesh(1.5e-3).follow_stops([0.0, 1e-3])
    last, supports = solved.course.poses[-1], solved.problem.supports
    names = [group.name for group in supports.groups]
    first = supports.motions(last.unknowns, 1e-3)[names.index("n5")]
    assert 0.35e-3 < -first[1] < 0.5e-3  # the bars below the second stage give a little, too
    held = supports.reactions(last.unknowns, 1e-3, solved.problem.elements.forces(solved.evaluate_displacements(last)))
    ground = sum(held[k, 1] for k, name in enumerate(names) if name.rstrip("'") in ("n1", "n2"))
    assert ground == pytest.approx(last.effort, rel=1e-6)


@pytest.mark.slow
def test_the_error_of_a_loose_target_contains_what_a_tight_one_finds():
    """A leaf across its bifurcation: its force at every point, and the place and the force at which it buckles."""
    spec = cfmkit.loads(VEE.replace("travel: 5 mm", "travel: 0.6 mm"))
    coarse, fine = (cfmkit.analyze(spec.replace({"analysis.solid.error": error})) for error in (0.1, 1e-4))
    off = np.abs(coarse.curve.effort - fine.curve.effort).max() / fine.curve.effort.max()
    assert off < coarse.values["mesh_force_error"].value
    assert fine.values["mesh_force_error"].value <= 1e-4 < coarse.values["mesh_force_error"].value
    for name in ("critical_force", "bifurcation_displacement"):
        one, other = (result.values[name].value for result in (coarse, fine))
        assert one == pytest.approx(other, rel=coarse.values["critical_error"].value)
