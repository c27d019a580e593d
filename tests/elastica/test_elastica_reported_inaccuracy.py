"""A path says where it is not what was requested: points that miss the tolerance, branches that were stepped over."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit.elastica as el
import cfmkit.elastica.tracing.trace as tracing

DOWN = -np.pi / 2
BENDING = el.Displacement("d", DOWN, np.array([1e-3, 10e-3, 20e-3, 30e-3]))


def strip() -> el.Network:
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "d": el.Node(0.05, 0)}
    return el.Network(nodes, {"x": el.Beam("a", "d", el.Section(2e9, 8e-3, 1e-3))})


def rough(monkeypatch: pytest.MonkeyPatch) -> el.Path:
    """Return a path of one degree that is too low for the tolerance."""
    monkeypatch.setattr(tracing, "MAX_ROUNDS", 1)
    monkeypatch.setattr(tracing, "_first_degree", lambda *_: 5)
    return el.trace(strip(), BENDING, el.Control(tolerance=1e-10))


def test_a_path_that_misses_its_tolerance_is_not_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    path = rough(monkeypatch)
    assert path.status is el.PathStatus.INACCURATE
    assert path.error > 1e-10
    assert f"{path.error:.3g}" in path.message


def test_points_that_miss_the_tolerance_are_marked_and_the_others_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    path = rough(monkeypatch)
    assert path.accurate[0]
    assert not path.accurate[-1]
    monkeypatch.undo()
    exact = el.trace(strip(), BENDING, el.Control(tolerance=1e-12))
    wrong = np.abs(path.effort[path.at_requested] - exact.effort[exact.at_requested]) / np.abs(exact.effort).max()
    assert (wrong[path.accurate[path.at_requested]] < 1e-10).all()
    assert wrong[-1] > 1e-11


def test_a_path_within_its_tolerance_marks_every_point_accurate() -> None:
    path = el.trace(strip(), BENDING)
    assert path.status is el.PathStatus.COMPLETE
    assert path.accurate.all()


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_a_path_on_which_nothing_bears_a_load_is_as_accurate_as_its_poses(tolerance: float) -> None:
    """A strip on pins is turned by one end: forces are rounding, and no mesh makes them agree."""
    stiff, soft = el.Section(88e9, 8e-3, 1.2e-3), el.Section(1.8e9, 8e-3, 0.4e-3)
    nodes = {
        "hinge": el.Node(0.0186, 0.0337, el.PINNED_SUPPORT),
        "end": el.Node(0.0185, 0.0788),
        "joint": el.Node(0.0532, 0.0035),
        "wall": el.Node(0.0733, 0.0398, el.CLAMPED_SUPPORT),
    }
    beams = {
        "arm": el.Beam("joint", "hinge", stiff),
        "strip": el.Beam("end", "hinge", soft, start_joint="pin"),
        "leg": el.Beam("joint", "wall", stiff),
    }
    path = el.trace(el.Network(nodes, beams), el.Rotation("end", np.array([-0.3, -0.9])), el.Control(tolerance))
    assert path.status is el.PathStatus.COMPLETE
    assert path.error < 1e-8
    assert np.abs(path.effort).max() < 1e-9
