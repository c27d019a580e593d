"""Motions of nodes and reactions of supports of a part as a solid: what `analysis.outputs` adds to its curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from half_vee import VEE

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.solid.boundary_and_element_sizes import Ring
from cfmkit.solid.elements import Elements
from cfmkit.solid.mesh import mesh
from cfmkit.solid.plane_stress_law import SaintVenantKirchhoff
from cfmkit.solid.point_motions_and_reactions import MaterialPoint

if TYPE_CHECKING:
    from cfmkit.results import Result

FORCES = ("fx", "fy", "m")


def columns(result: Result, node: str, names: tuple[str, ...]) -> np.ndarray:
    return np.array([result.curve.extra[f"{node}_{name}"].values for name in names])


@pytest.fixture(scope="module")
def vee() -> dict[str, Result]:
    spec = cfmkit.loads(VEE)
    mirrored = {"mechanism.copies": {"mirror": ["24.6 mm", "3.3 mm"]}}
    return {
        "solid": cfmkit.analyze(spec),
        "beams": cfmkit.analyze(spec.replace({"analysis.fidelity": "reissner"})),
        "mirrored": cfmkit.analyze(spec.replace(mirrored)),
    }


def test_reactions_of_a_solid_are_in_equilibrium_at_poses_and_between_them(vee):
    root, shuttle = (columns(vee["solid"], node, FORCES) for node in ("root", "shuttle"))
    largest = np.abs(root[:2]).max()
    assert root[:2] + shuttle[:2] == pytest.approx(np.zeros((2, 9)), abs=1e-6 * largest)
    x, y = 24.6e-3, 3.3e-3 - vee["solid"].curve.motion
    moment = np.abs(root[2] + shuttle[2] + x * shuttle[1] - y * shuttle[0]) / np.abs(root[2]).max()
    assert moment.max() < 2e-3  # a product of two cubics between poses
    assert moment[vee["solid"].curve.extra["solved"].values == "yes"].max() < 1e-6
    assert -shuttle[1] == pytest.approx(vee["solid"].curve.effort, abs=1e-6 * largest)


def test_a_driven_node_goes_with_its_drive_and_a_free_one_as_that_of_beams(vee):
    motion = vee["solid"].curve.motion
    moved = columns(vee["solid"], "shuttle", ("x", "y", "rotation"))
    assert moved == pytest.approx(np.array([0 * motion, -motion, 0 * motion]), abs=1e-12)
    solid, beams = (columns(vee[name], "middle", ("x", "y", "rotation")) for name in ("solid", "beams"))
    for one, other in zip(solid, beams, strict=True):
        assert one == pytest.approx(other, abs=0.02 * np.abs(other).max())


def test_reactions_of_a_slender_leaf_are_those_of_the_beam(vee):
    for node in ("root", "shuttle"):
        solid, beams = (columns(vee[name], node, FORCES) for name in ("solid", "beams"))
        for one, other in zip(solid, beams, strict=True):
            assert one == pytest.approx(other, abs=0.03 * np.abs(other).max())


def test_reactions_of_a_mirrored_part_are_those_of_the_half_that_is_described(vee):
    """On the axis, too, where the halves press on each other beside the node; a half alone has fillets at its pad."""
    one = vee["mirrored"]
    shuttle = columns(one, "shuttle", FORCES)
    assert -2.0 * shuttle[1] == pytest.approx(one.curve.effort, abs=5e-4 * np.abs(one.curve.effort).max())
    alone = columns(vee["solid"], "shuttle", FORCES)
    for half, whole in zip(shuttle[:2], alone[:2], strict=True):
        assert half == pytest.approx(whole, abs=2e-3 * np.abs(whole).max())


def test_halves_of_a_part_bear_alike_however_they_are_described(vee):
    """Where two beams meet at an angle, the section half way between is held: moments of halves differed by 20 %."""
    spec = cfmkit.loads(VEE)
    whole = cfmkit.analyze(
        spec.replace(
            {
                "mechanism.nodes.other": {"at": ["49.2 mm", "0 mm"], "support": "clamped"},
                "mechanism.beams.image": {"start": "other", "end": "shuttle"},
                "analysis.outputs.reactions": ["root", "other"],
            }
        )
    )
    described = columns(vee["mirrored"], "root", FORCES)
    left, right = columns(whole, "root", FORCES), columns(whole, "other", FORCES)
    for first, second, own in zip(left, np.array([[-1.0], [1.0], [-1.0]]) * right, described, strict=True):
        assert first == pytest.approx(own, abs=1e-3 * np.abs(own).max())
        assert second == pytest.approx(own, abs=1e-3 * np.abs(own).max())


def test_the_material_around_a_point_tells_its_motion_and_its_turn():
    """A square that is turned by 2 rad about its corner, and moved: every point does the same."""
    grid = mesh((Ring.from_points(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), False),), 0.3)
    elements = Elements(grid, SaintVenantKirchhoff(1.0, 0.3), np.ones(len(grid.triangles)))
    turn = np.array([[np.cos(2.0), -np.sin(2.0)], [np.sin(2.0), np.cos(2.0)]])
    moved = grid.nodes @ (turn - np.eye(2)).T + [0.1, 0.2]
    for place in ((0.37, 0.81), (0.0, 0.5), (1.0, 1.0)):
        point = MaterialPoint.from_place(elements, np.array(place))
        assert point.motion(moved) == pytest.approx([*((turn - np.eye(2)) @ place + [0.1, 0.2]), 2.0], abs=1e-12)
    assert MaterialPoint.from_place(elements, np.array([1.1, 0.5])) is None


def test_a_stiffness_across_is_refused_of_a_solid():
    with pytest.raises(SpecError, match=r"analysis\.outputs\.cross_stiffness is not supported"):
        cfmkit.loads(VEE).replace({"analysis.outputs.cross_stiffness": True})


def test_reactions_are_read_off_solved_poses_only():
    spec = cfmkit.loads(VEE)
    for reactions in (["root"], []):
        (part,) = family("beam").elastic.solids(spec.replace({"analysis.outputs.reactions": reactions}))
        assert part.every_pose == bool(reactions)
