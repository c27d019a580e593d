"""Drives whose points turn round, and paths through limit points: the same events and forces however they are asked."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit.elastica as el

DOWN = -np.pi / 2
RISE = 35e-3 * np.sin(np.radians(8.0))
SECTION = el.Section(2e9, 8e-3, 1e-3)
TOLERANCES = (1e-3, 1e-5, 1e-7)


def leaves(count: int) -> el.Network:
    """Return equal inclined leaves on a guided shuttle: pressed down they buckle, and straighten out beyond."""
    across = 35e-3 * np.cos(np.radians(8.0))
    nodes, beams = {"d": el.Node(0, RISE, el.slider_support(np.pi / 2))}, {}
    for k in range(count):
        nodes[f"w{k}"] = el.Node(across * (-1) ** k, 0, el.CLAMPED_SUPPORT)
        beams[f"b{k}"] = el.Beam(f"w{k}", "d", el.Section(1477e6, 6e-3, 7e-4))
    return el.Network(nodes, beams)


def pressed(points: object, tolerance: float, count: int = 1, **control: object) -> el.Path:
    """Return the path of leaves pressed down by shares of their rise; it must be complete."""
    drive = el.Displacement("d", DOWN, np.asarray(points, dtype=float) * RISE)
    path = el.trace(leaves(count), drive, el.Control(tolerance=tolerance, **control))  # type: ignore[arg-type]
    assert path.status is el.PathStatus.COMPLETE, path.message
    return path


def toggle(shift: float) -> el.Network:
    """Return two clamped bars, one longer by a shift."""
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "t": el.Node(0.1, 0.012),
        "b": el.Node(0.2 + shift, 0, el.CLAMPED_SUPPORT),
    }
    return el.Network(nodes, {"x": el.Beam("a", "t", SECTION), "y": el.Beam("t", "b", SECTION)})


def arch() -> el.Network:
    nodes = {"a": el.Node(0, 0, el.PINNED_SUPPORT), "t": el.Node(0.1, 0.02), "b": el.Node(0.2, 0, el.PINNED_SUPPORT)}
    beams = {
        "x": el.Beam("a", "t", SECTION, el.CosineArch(0.02, 0.5)),
        "y": el.Beam("t", "b", SECTION, el.CosineArch(-0.02, 0.5)),
    }
    return el.Network(nodes, beams)


def loaded(network: el.Network, points: object, tolerance: float, **control: object) -> el.Path:
    load = el.Loading((el.PointLoad("t", fy=-1.0),), np.asarray(points, dtype=float))
    path = el.trace(network, load, el.Control(tolerance=tolerance, through_folds=True, **control))  # type: ignore[arg-type]
    assert path.status is el.PathStatus.COMPLETE, path.message
    return path


def reported(path: el.Path) -> list[tuple[str, int, int]]:
    return [(event.kind, event.before, event.after) for event in path.events]


def places(path: el.Path) -> list[float]:
    return [event.drive for event in path.events]


@pytest.mark.parametrize(("count", "tolerance"), [(1, 1e-5), (1, 1e-7), (2, 1e-7)])
def test_down_and_up_again_passes_the_same_bifurcations(count: int, tolerance: float) -> None:
    down = np.linspace(0.05, 2.1, 15)
    path = pressed(np.concatenate([down, down[::-1][1:], [0]]), tolerance, count)
    names = [("bifurcation", 0, count), ("bifurcation", count, 0)]
    assert reported(path) == names * 2
    first, second, again, last = places(path)
    alone = pressed(down, 1e-9)
    np.testing.assert_allclose([first, last, second, again], np.repeat(places(alone), 2), atol=tolerance * 2.1 * RISE)
    forces = path.effort[path.at_requested]
    np.testing.assert_allclose(forces[:14], forces[15:29][::-1], rtol=0, atol=2 * tolerance * np.abs(forces).max())
    assert path.stable.all()


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("sign", [1, -1])
def test_on_a_branch_the_drive_may_turn_round_as_often_as_it_likes(tolerance: float, sign: int) -> None:
    path = pressed([1, 0.05, 1, 1.5, 0.5, 2, 1, 0], tolerance, sign=sign)
    opened, closed = ("bifurcation", 0, 1), ("bifurcation", 1, 0)
    assert reported(path) == [opened, closed] * 4
    first, last = places(pressed([2.1], 1e-9))
    np.testing.assert_allclose(places(path), [first] * 3 + [last] * 4 + [first], atol=2 * tolerance * RISE)
    at = path.branch[path.at_requested]
    assert [name == "primary" for name in at] == [False, True] * 4
    assert all(name.endswith(f"sign {sign:+d}") for name in at if name != "primary")


def test_a_path_that_ends_in_a_stretch_does_not_begin_the_next() -> None:
    path = el.trace(arch(), el.Loading((el.PointLoad("t", fy=-1.0),), np.array([0.3, 2.0, 0.3])))
    assert path.status is el.PathStatus.JUMPS
    assert path.requested[path.at_requested].tolist() == [0]


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_a_toggle_snaps_and_snaps_back_at_the_limit_points_of_its_force(tolerance: float) -> None:
    """Bars of different length: driven by its travel the toggle has no bifurcation, only a force that falls."""
    travel = el.Displacement("t", DOWN, np.linspace(0, 0.02, 801)[1:])
    force = el.trace(toggle(1e-3), travel, el.Control(tolerance=1e-7)).effort
    first = int((np.diff(force) < 0).argmax())
    top, low = force[first], force[first:].min()
    path = loaded(toggle(1e-3), [0.4, 0.8, 1.5, 0.8, 0.4, 0], tolerance)
    assert reported(path) == [("limit point", a, b) for a, b in ((0, 1), (1, 0), (0, 1), (1, 0))]
    np.testing.assert_allclose(places(path), [top, low, low, top], atol=3e-5)  # of travel in steps
    assert path.requested[path.at_requested].tolist() == [0, 0, 0, 1, 2, 3, 4, 4, 4, 5]
    np.testing.assert_allclose(path.motion("t")[-1], 0, atol=1e-8)


@pytest.mark.parametrize("branch", ["stable", "primary"])
@pytest.mark.parametrize("points", [4, 30])
def test_the_bifurcations_between_limit_points_are_the_same_at_every_tolerance(branch: str, points: int) -> None:
    asked = np.linspace(0, 2, points + 1)[1:]
    paths = [loaded(arch(), asked, tolerance, branch=branch) for tolerance in (*TOLERANCES, 1e-9)]
    kinds = [("bifurcation", 0, 1), ("limit point", 1, 2), ("bifurcation", 2, 1), ("limit point", 1, 0)]
    for path, tolerance in zip(paths, TOLERANCES, strict=False):
        assert reported(path) == kinds
        np.testing.assert_allclose(places(path), places(paths[-1]), atol=2 * tolerance)
