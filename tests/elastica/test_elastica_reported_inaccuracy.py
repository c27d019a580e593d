"""A path says where it is not what was requested: points that miss the tolerance, branches that were stepped over."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from network_cases import from_json, read_cases

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
    monkeypatch.setattr(tracing, "_find_first_degree", lambda *_: 5)
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
    assert path.error < 1e-7
    assert np.abs(path.effort).max() < 1e-9


def efforts_and_motions(path: el.Path) -> list[Any]:
    """Return the efforts, and the motions of all nodes in lengths of a beam, at the requested points."""
    length = path.mesh.scales.length
    nodes = [name for name in path.network.nodes if not path.network.is_moved_by_link(name)]
    motions = [path.motion(name)[path.at_requested] / [length, length, 1] for name in nodes]
    return [path.effort[path.at_requested], np.array(motions)]


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.slow), 14])
def test_true_errors_are_below_the_reported_ones_in_95_of_100_paths(every: int) -> None:
    """Of the networks of `tests/cases/networks.jsonl` at three tolerances, against paths at 1e-11."""
    below = []
    for case in list(read_cases())[::every]:
        network, drive, control = (from_json(case[part]) for part in ("network", "drive", "control"))
        exact = el.trace(network, drive, replace(control, tolerance=1e-11))
        if exact.error > 1e-9 or control.imperfection:
            continue
        for tolerance in (1e-3, 1e-5, 1e-7):
            path = el.trace(network, drive, replace(control, tolerance=tolerance))
            if path.status is not exact.status or not len(path.at_requested):
                continue
            pairs = zip(efforts_and_motions(path), efforts_and_motions(exact), strict=True)
            true = max(np.abs(rough - right).max() / np.abs(right).max() for rough, right in pairs if right.any())
            below.append(true <= path.error + exact.error)
    assert len(below) > 800 / every
    assert np.mean(below) >= 0.95


def test_a_path_on_which_nothing_moves_is_accurate() -> None:
    """Its forces and motions are rounding, of which no share is an error."""
    section = el.Section(2e9, 1e-2, 1e-3, axial=False)
    nodes = {
        "base": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "knee": el.Node(0.02, 0.01),
        "top": el.Node(0, 0.03, el.slider_support(np.pi / 2)),
    }
    beams = {"a": el.Beam("base", "knee", section, el.arc(-np.pi / 3)), "b": el.Beam("knee", "top", section)}
    path = el.trace(el.Network(nodes, beams), el.Loading((el.PointLoad("base", fy=1.0),), np.linspace(0.2, 1.0, 5)))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.error < 1e-7
