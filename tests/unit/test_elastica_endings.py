"""How paths end: each status with a network that ends that way, and where; in batches each for itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cfmkit.elastica as el

UP = np.pi / 2
SECTION = el.Section(2e9, 8e-3, 1e-3)
PUSH = el.Loading((el.PointLoad("t", fy=-1.0),), np.linspace(0.05, 2.0, 40))


def arch(rise: float = 0.02) -> el.Network:
    """Return a pinned cosine arch: pushed at its top it sways off before its limit point."""
    nodes = {"a": el.Node(0, 0, el.PINNED_SUPPORT), "t": el.Node(0.1, rise), "b": el.Node(0.2, 0, el.PINNED_SUPPORT)}
    beams = {
        "x": el.Beam("a", "t", SECTION, el.CosineArch(rise, 0.5)),
        "y": el.Beam("t", "b", SECTION, el.CosineArch(-rise, 0.5)),
    }
    return el.Network(nodes, beams)


def strip(**support: Any) -> el.Network:
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "t": el.Node(0.1, 0.0)}
    return el.Network(nodes, {"x": el.Beam("a", "t", SECTION)}, **support)


def test_an_arch_that_sways_off_jumps_at_its_bifurcation() -> None:
    path = el.trace(arch(), PUSH)
    assert path.status is el.PathStatus.JUMPS
    assert [event.kind for event in path.events] == ["bifurcation"]
    assert f"{path.events[0].drive:.6g}" in path.message
    assert path.drive[-1] < path.events[0].drive < path.drive[-1] + 0.05
    assert path.stable.all()


def test_a_path_may_stop_where_stability_is_lost() -> None:
    path = el.trace(arch(), PUSH, el.Control(branch="stop"))
    bifurcation = el.trace(arch(), PUSH).events[0].drive
    assert path.status is el.PathStatus.JUMPS
    assert path.stable[:-1].all()
    assert not path.stable[-1]
    assert path.drive[-2] < bifurcation < path.drive[-1]


def test_on_request_the_same_arch_is_followed_through_bifurcations_and_folds() -> None:
    path = el.trace(arch(), PUSH, el.Control(branch="primary", through_folds=True))
    assert path.status is el.PathStatus.COMPLETE
    assert [event.kind for event in path.events] == ["bifurcation", "limit point", "bifurcation", "limit point"]
    by_travel = el.trace(arch(), el.Displacement("t", -UP, np.linspace(9e-4, 0.036, 118)), el.Control(branch="primary"))
    top, low = path.events[1].drive, path.events[3].drive
    assert by_travel.effort.max() == pytest.approx(top, rel=3e-3)
    assert by_travel.effort.max() <= top * (1 + 1e-9)
    assert by_travel.effort.min() >= low - 1e-9 * top
    assert by_travel.effort.min() == pytest.approx(low, abs=3e-3 * top)


def test_a_turn_beyond_its_limit_point_ends_there() -> None:
    """The end of a pinned arc is turned until the arc snaps; by arc length the limit point is passed."""
    bow = el.Network(
        {"a": el.Node(0, 0, el.PINNED_SUPPORT), "b": el.Node(0.1, 0, el.PINNED_SUPPORT)},
        {"x": el.Beam("a", "b", SECTION, el.arc(1.5))},
    )
    turned = el.Rotation("a", np.linspace(0.1, 3, 30))
    path = el.trace(bow, turned)
    passed = el.trace(bow, turned, el.Control(through_folds=True, most_points=60))
    assert path.status is el.PathStatus.LIMIT_POINT
    assert f"{path.drive[-1]:.6g}" in path.message
    assert passed.events[0].kind == "limit point"
    assert path.drive[-1] == pytest.approx(passed.events[0].drive, rel=1e-5)


def test_a_path_that_goes_far_behind_its_start_has_left_its_range() -> None:
    """Half an arch in its symmetric mode pulls back, after its limit point, nearly as hard as it pushed before."""
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "t": el.Node(0.1, 2e-3, el.slider_support(UP))}
    half = el.Network(nodes, {"x": el.Beam("a", "t", el.Section(1e9, 1e-2, 2e-4), el.CosineArch(2e-3, 0.5))})
    load = el.Loading((el.PointLoad("t", fy=-1.0),), np.array([3e-4, 1e-3]))
    path = el.trace(half, load, el.Control(branch="primary", through_folds=True))
    assert path.status is el.PathStatus.OUTSIDE
    assert "limit point" in [event.kind for event in path.events]
    assert path.drive.max() < 1e-3
    assert path.drive[-1] < -0.5e-3 < path.drive[-2]
    assert f"{path.drive[-1]:.6g}" in path.message


def test_a_path_keeps_to_its_number_of_points() -> None:
    path = el.trace(strip(), el.Displacement("t", UP, np.array([1e-3, 0.05])), el.Control(most_points=2))
    assert path.status is el.PathStatus.FULL
    assert 1 < len(path) <= 4
    assert len(path.at_requested) < 20
    assert f"{path.drive[-1]:.6g}" in path.message


@pytest.mark.parametrize("axial", [True, False])
@pytest.mark.parametrize(("support", "springs"), [
    (el.FREE_SUPPORT, ()), (el.PINNED_SUPPORT, ()), (el.PINNED_SUPPORT, (el.TorsionSpring("a", "t", 1.0, 0.1),)),
])  # fmt: skip
@pytest.mark.parametrize("drive", [
    el.Loading((el.PointLoad("t", fy=1.0),), np.array([1.0])), el.Displacement("t", 0.0, np.array([1e-3])),
])  # fmt: skip
def test_a_network_that_nothing_holds_has_no_start(support: Any, springs: Any, drive: Any, axial: bool) -> None:
    section = el.Section(2e9, 8e-3, 1e-3, axial=axial)
    nodes = {"a": el.Node(0, 0, support), "t": el.Node(0.1, 0)}
    path = el.trace(el.Network(nodes, {"x": el.Beam("a", "t", section)}, springs=springs), drive)
    assert (path.status, len(path)) == (el.PathStatus.NO_START, 0)
    assert "nothing holds the network" in path.message


def test_an_inextensible_arc_is_pulled_until_it_is_taut() -> None:
    section = el.Section(2e9, 8e-3, 1e-3, axial=False)
    bow = el.Network(
        {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "t": el.Node(0.1, 0)}, {"x": el.Beam("a", "t", section, el.arc(0.5))}
    )
    path = el.trace(bow, el.Displacement("t", 0.0, np.linspace(1e-4, 2e-3, 20)), el.Control(tolerance=1e-3))
    straight = 0.1 * (0.25 / np.sin(0.25) - 1)
    assert path.status is not el.PathStatus.COMPLETE
    assert path.drive[-1] < path.fits["x"].length - 0.1 == pytest.approx(straight)
    assert path.drive[-1] == pytest.approx(straight, rel=0.1)


@pytest.mark.parametrize("tolerance", [0.1, 0.05, 1e-3])
def test_a_path_does_not_end_where_its_mesh_is_too_coarse_for_a_beam_drawn_taut(tolerance: float) -> None:
    """A leaf pulled off its wall, and a clamped beam pushed sideways: forces only grow, there is no limit point."""
    leaf = el.Network(
        {"w": el.Node(0, 0, el.CLAMPED_SUPPORT), "d": el.Node(0.0347, 4.87e-3, el.slider_support(UP))},
        {"x": el.Beam("w", "d", el.Section(1477e6, 6e-3, 7e-4))},
    )
    section = el.Section(2e11, 8e-3, 3.46e-3)
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "m": el.Node(0.04, 0), "b": el.Node(0.1, 0, el.CLAMPED_SUPPORT)}
    beam = el.Network(nodes, {"x": el.Beam("a", "m", section), "y": el.Beam("m", "b", section)})
    for network, drive in (
        (leaf, el.Displacement("d", UP, np.linspace(0.1, 1, 10) * 4.87e-3)),
        (beam, el.Displacement("m", UP, np.linspace(2e-3, 0.02, 10))),
    ):
        path, fine = (el.trace(network, drive, el.Control(tolerance=one)) for one in (tolerance, 1e-7))
        assert path.status is el.PathStatus.COMPLETE, path.message
        assert path.effort[-1] == pytest.approx(fine.effort[-1], rel=tolerance)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_batch_keeps_what_each_path_reached_and_why_it_ended(workers: int) -> None:
    """Among them a network that cannot exist and one with a place that is not a number."""
    closed = el.Network(strip().nodes, {"x": el.Beam("a", "t", SECTION, el.arc(2 * np.pi))})
    nowhere = el.Network(
        {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "t": el.Node(float("nan"), 0.0)}, {"x": el.Beam("a", "t", SECTION)}
    )
    networks = [strip(), arch(), closed, nowhere, strip()]
    found = list(el.trace_many(networks, PUSH, workers=workers))
    assert [one.status for one in found] == ["COMPLETE", "JUMPS", "INVALID", "INVALID", "COMPLETE"]
    assert "returns to its start" in found[2].message
    assert found[2].value is None
    alone = el.trace(arch(), PUSH)
    assert found[1].message == alone.message
    np.testing.assert_array_equal(found[1].value.effort, alone.effort[alone.at_requested])
    np.testing.assert_array_equal(found[0].value.effort, found[4].value.effort)
    assert len(found[0].value.drive) == 40


def test_constant_loads_beyond_a_limit_point_say_at_which_share() -> None:
    """The limit load itself is that of the same load as a drive."""
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "t": el.Node(0.1, 4e-3, el.slider_support(UP))}
    half = el.Network(nodes, {"x": el.Beam("a", "t", el.Section(1e9, 1e-2, 1.6e-3), el.CosineArch(4e-3, 0.5))})
    found = el.trace(half, el.Loading((el.PointLoad("t", fy=-1.0),), np.array([10.0])), el.Control(branch="primary"))
    assert found.status is el.PathStatus.LIMIT_POINT
    limit = float(found.drive[-1])
    heavy = el.Network(half.nodes, half.beams, loads=(el.PointLoad("t", fy=-2.5 * limit),))
    path = el.trace(heavy, el.Loading((el.PointLoad("t", fy=-1.0),), np.array([0.1])))
    assert path.status is el.PathStatus.NO_START
    assert "lost at 0.4 of the constant loads" in path.message
