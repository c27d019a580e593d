"""How paths end: each status with a network that ends that way, and where; in batches each for itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    FREE_SUPPORT,
    PINNED_SUPPORT,
    Beam,
    Control,
    CosineArch,
    Displacement,
    Loading,
    Network,
    Node,
    PathStatus,
    PointLoad,
    Rotation,
    Section,
    TorsionSpring,
    arc,
    slider_support,
    trace,
    trace_many,
)

UP = np.pi / 2
SECTION = Section(2e9, 8e-3, 1e-3)
PUSH = Loading((PointLoad("t", fy=-1.0),), np.linspace(0.05, 2.0, 40))


def arch(rise: float = 0.02) -> Network:
    """Return a pinned cosine arch: pushed at its top it sways off before its limit point."""
    nodes = {"a": Node(0, 0, PINNED_SUPPORT), "t": Node(0.1, rise), "b": Node(0.2, 0, PINNED_SUPPORT)}
    beams = {"x": Beam("a", "t", SECTION, CosineArch(rise, 0.5)), "y": Beam("t", "b", SECTION, CosineArch(-rise, 0.5))}
    return Network(nodes, beams)


def strip(**support: Any) -> Network:
    nodes = {"a": Node(0, 0, CLAMPED_SUPPORT), "t": Node(0.1, 0.0)}
    return Network(nodes, {"x": Beam("a", "t", SECTION)}, **support)


def test_an_arch_that_sways_off_jumps_at_its_bifurcation() -> None:
    path = trace(arch(), PUSH)
    assert path.status is PathStatus.JUMPS
    assert [event.kind for event in path.events] == ["bifurcation"]
    assert f"{path.events[0].drive:.6g}" in path.message
    assert path.drive[-1] < path.events[0].drive < path.drive[-1] + 0.05
    assert path.stable.all()


def test_a_path_may_stop_where_stability_is_lost() -> None:
    path = trace(arch(), PUSH, Control(branch="stop"))
    bifurcation = trace(arch(), PUSH).events[0].drive
    assert path.status is PathStatus.JUMPS
    assert path.stable[:-1].all()
    assert not path.stable[-1]
    assert path.drive[-2] < bifurcation < path.drive[-1]


def test_on_request_the_same_arch_is_followed_through_bifurcations_and_folds() -> None:
    path = trace(arch(), PUSH, Control(branch="primary", through_folds=True))
    assert path.status is PathStatus.COMPLETE
    assert [event.kind for event in path.events] == ["bifurcation", "limit point", "bifurcation", "limit point"]
    by_travel = trace(arch(), Displacement("t", -UP, np.linspace(9e-4, 0.036, 118)), Control(branch="primary"))
    top, low = path.events[1].drive, path.events[3].drive
    assert by_travel.effort.max() == pytest.approx(top, rel=3e-3)
    assert by_travel.effort.max() <= top * (1 + 1e-9)
    assert by_travel.effort.min() >= low - 1e-9 * top
    assert by_travel.effort.min() == pytest.approx(low, abs=3e-3 * top)


def test_a_turn_beyond_its_limit_point_ends_there() -> None:
    """The end of a pinned arc is turned until the arc snaps; by arc length the limit point is passed."""
    bow = Network(
        {"a": Node(0, 0, PINNED_SUPPORT), "b": Node(0.1, 0, PINNED_SUPPORT)}, {"x": Beam("a", "b", SECTION, arc(1.5))}
    )
    turned = Rotation("a", np.linspace(0.1, 3, 30))
    path = trace(bow, turned)
    passed = trace(bow, turned, Control(through_folds=True, most_points=60))
    assert path.status is PathStatus.LIMIT_POINT
    assert f"{path.drive[-1]:.6g}" in path.message
    assert passed.events[0].kind == "limit point"
    assert path.drive[-1] == pytest.approx(passed.events[0].drive, rel=1e-5)


def test_a_path_that_goes_far_behind_its_start_has_left_its_range() -> None:
    """Half an arch in its symmetric mode pulls back, after its limit point, nearly as hard as it pushed before."""
    nodes = {"a": Node(0, 0, CLAMPED_SUPPORT), "t": Node(0.1, 2e-3, slider_support(UP))}
    half = Network(nodes, {"x": Beam("a", "t", Section(1e9, 1e-2, 2e-4), CosineArch(2e-3, 0.5))})
    load = Loading((PointLoad("t", fy=-1.0),), np.array([3e-4, 1e-3]))
    path = trace(half, load, Control(branch="primary", through_folds=True))
    assert path.status is PathStatus.OUTSIDE
    assert "limit point" in [event.kind for event in path.events]
    assert path.drive.max() < 1e-3
    assert path.drive[-1] < -0.5e-3 < path.drive[-2]
    assert f"{path.drive[-1]:.6g}" in path.message


def test_a_path_keeps_to_its_number_of_points() -> None:
    path = trace(strip(), Displacement("t", UP, np.array([1e-3, 0.05])), Control(most_points=2))
    assert path.status is PathStatus.FULL
    assert 1 < len(path) <= 4
    assert len(path.at_requested) < 20
    assert f"{path.drive[-1]:.6g}" in path.message


@pytest.mark.parametrize("axial", [True, False])
@pytest.mark.parametrize(("support", "springs"), [
    (FREE_SUPPORT, ()), (PINNED_SUPPORT, ()), (PINNED_SUPPORT, (TorsionSpring("a", "t", 1.0, 0.1),)),
])  # fmt: skip
@pytest.mark.parametrize("drive", [
    Loading((PointLoad("t", fy=1.0),), np.array([1.0])), Displacement("t", 0.0, np.array([1e-3])),
])  # fmt: skip
def test_a_network_that_nothing_holds_has_no_start(support: Any, springs: Any, drive: Any, axial: bool) -> None:
    section = Section(2e9, 8e-3, 1e-3, axial=axial)
    nodes = {"a": Node(0, 0, support), "t": Node(0.1, 0)}
    path = trace(Network(nodes, {"x": Beam("a", "t", section)}, springs=springs), drive)
    assert (path.status, len(path)) == (PathStatus.NO_START, 0)
    assert "nothing holds the network" in path.message


def test_an_inextensible_arc_is_pulled_until_it_is_taut() -> None:
    section = Section(2e9, 8e-3, 1e-3, axial=False)
    bow = Network({"a": Node(0, 0, CLAMPED_SUPPORT), "t": Node(0.1, 0)}, {"x": Beam("a", "t", section, arc(0.5))})
    path = trace(bow, Displacement("t", 0.0, np.linspace(1e-4, 2e-3, 20)), Control(tolerance=1e-3))
    straight = 0.1 * (0.25 / np.sin(0.25) - 1)
    assert path.status is not PathStatus.COMPLETE
    assert path.drive[-1] < path.fits["x"].length - 0.1 == pytest.approx(straight)
    assert path.drive[-1] == pytest.approx(straight, rel=0.1)


@pytest.mark.parametrize("tolerance", [0.1, 0.05, 1e-3])
def test_a_path_does_not_end_where_its_mesh_is_too_coarse_for_a_beam_drawn_taut(tolerance: float) -> None:
    """A leaf pulled off its wall, and a clamped beam pushed sideways: forces only grow, there is no limit point."""
    leaf = Network(
        {"w": Node(0, 0, CLAMPED_SUPPORT), "d": Node(0.0347, 4.87e-3, slider_support(UP))},
        {"x": Beam("w", "d", Section(1477e6, 6e-3, 7e-4))},
    )
    section = Section(2e11, 8e-3, 3.46e-3)
    nodes = {"a": Node(0, 0, CLAMPED_SUPPORT), "m": Node(0.04, 0), "b": Node(0.1, 0, CLAMPED_SUPPORT)}
    beam = Network(nodes, {"x": Beam("a", "m", section), "y": Beam("m", "b", section)})
    for network, drive in (
        (leaf, Displacement("d", UP, np.linspace(0.1, 1, 10) * 4.87e-3)),
        (beam, Displacement("m", UP, np.linspace(2e-3, 0.02, 10))),
    ):
        path, fine = (trace(network, drive, Control(tolerance=one)) for one in (tolerance, 1e-7))
        assert path.status is PathStatus.COMPLETE, path.message
        assert path.effort[-1] == pytest.approx(fine.effort[-1], rel=tolerance)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_batch_keeps_what_each_path_reached_and_why_it_ended(workers: int) -> None:
    """Among them a network that cannot exist and one with a place that is not a number."""
    closed = Network(strip().nodes, {"x": Beam("a", "t", SECTION, arc(2 * np.pi))})
    nowhere = Network({"a": Node(0, 0, CLAMPED_SUPPORT), "t": Node(float("nan"), 0.0)}, {"x": Beam("a", "t", SECTION)})
    networks = [strip(), arch(), closed, nowhere, strip()]
    found = list(trace_many(networks, PUSH, workers=workers))
    assert [one.status for one in found] == ["COMPLETE", "JUMPS", "INVALID", "INVALID", "COMPLETE"]
    assert "returns to its start" in found[2].message
    assert found[2].value is None
    alone = trace(arch(), PUSH)
    assert found[1].message == alone.message
    np.testing.assert_array_equal(found[1].value.effort, alone.effort[alone.at_requested])
    np.testing.assert_array_equal(found[0].value.effort, found[4].value.effort)
    assert len(found[0].value.drive) == 40


def test_constant_loads_beyond_a_limit_point_say_at_which_share() -> None:
    """The limit load itself is that of the same load as a drive."""
    nodes = {"a": Node(0, 0, CLAMPED_SUPPORT), "t": Node(0.1, 4e-3, slider_support(UP))}
    half = Network(nodes, {"x": Beam("a", "t", Section(1e9, 1e-2, 1.6e-3), CosineArch(4e-3, 0.5))})
    found = trace(half, Loading((PointLoad("t", fy=-1.0),), np.array([10.0])), Control(branch="primary"))
    assert found.status is PathStatus.LIMIT_POINT
    limit = float(found.drive[-1])
    heavy = Network(half.nodes, half.beams, loads=(PointLoad("t", fy=-2.5 * limit),))
    path = trace(heavy, Loading((PointLoad("t", fy=-1.0),), np.array([0.1])))
    assert path.status is PathStatus.NO_START
    assert "lost at 0.4 of the constant loads" in path.message
