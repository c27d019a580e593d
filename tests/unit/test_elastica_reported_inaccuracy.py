"""A path says where it is not what was requested: points that miss the tolerance, branches that were stepped over."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.elastica import (
    CLAMPED,
    PINNED,
    Beam,
    Control,
    Displacement,
    Network,
    Node,
    Path,
    PathStatus,
    Rotation,
    Section,
    guided,
    trace,
)
from cfmkit.elastica.continuation import branch_rejoins_path, decisions_after_march, trace_to_tolerance
from cfmkit.elastica.equilibrium.mesh import Mesh

DOWN = -np.pi / 2
BENDING = Displacement("d", DOWN, np.array([1e-3, 10e-3, 20e-3, 30e-3]))


def v_beam() -> Network:
    length, angle = 35e-3, np.radians(7)
    nodes = {"wall": Node(0, 0, CLAMPED), "d": Node(length * np.cos(angle), length * np.sin(angle), guided(np.pi / 2))}
    return Network(nodes, {"v": Beam("wall", "d", Section(1477e6, 6e-3, 1e-3))})


def strip() -> Network:
    nodes = {"a": Node(0, 0, CLAMPED), "d": Node(0.05, 0)}
    return Network(nodes, {"x": Beam("a", "d", Section(2e9, 8e-3, 1e-3))})


def rough(monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a path on one mesh that is too coarse for the tolerance."""
    monkeypatch.setattr(trace_to_tolerance, "_ROUNDS", 1)
    monkeypatch.setattr(trace_to_tolerance, "first_mesh", lambda layout, tolerance: Mesh(2, 1))
    return trace(strip(), BENDING, Control(tolerance=1e-10))


def test_a_path_that_misses_its_tolerance_is_not_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    path = rough(monkeypatch)
    assert path.status is PathStatus.INACCURATE
    assert path.error > 1e-10
    assert f"{path.error:.3g}" in path.message


def test_points_that_miss_the_tolerance_are_marked_and_the_others_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    path = rough(monkeypatch)
    assert path.accurate[0]
    assert not path.accurate[-1]
    monkeypatch.undo()
    exact = trace(strip(), BENDING, Control(tolerance=1e-12))
    wrong = np.abs(path.effort[path.at_requested] - exact.effort[exact.at_requested]) / np.abs(exact.effort).max()
    assert (wrong[path.accurate[path.at_requested]] < 1e-10).all()
    assert wrong[-1] > 1e-11


def test_a_path_within_its_tolerance_marks_every_point_accurate() -> None:
    path = trace(strip(), BENDING)
    assert path.status is PathStatus.COMPLETE
    assert path.accurate.all()


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_a_path_on_which_nothing_bears_a_load_is_as_accurate_as_its_poses(tolerance: float) -> None:
    """A strip on pins is turned by one end: forces are rounding, and no mesh makes them agree."""
    stiff, soft = Section(88e9, 8e-3, 1.2e-3), Section(1.8e9, 8e-3, 0.4e-3)
    nodes = {
        "hinge": Node(0.0186, 0.0337, PINNED),
        "end": Node(0.0185, 0.0788),
        "joint": Node(0.0532, 0.0035),
        "wall": Node(0.0733, 0.0398, CLAMPED),
    }
    beams = {
        "arm": Beam("joint", "hinge", stiff),
        "strip": Beam("end", "hinge", soft, start_joint="pin"),
        "leg": Beam("joint", "wall", stiff),
    }
    path = trace(Network(nodes, beams), Rotation("end", np.array([-0.3, -0.9])), Control(tolerance))
    assert path.status is PathStatus.COMPLETE
    assert path.error < 1e-8
    assert np.abs(path.effort).max() < 1e-9


@pytest.mark.parametrize(
    ("travel", "on_branch"), [((4.0, 5.5, 6.0), 1), ((4.5, 5.0, 6.0), 1), ((4.0, 4.7, 5.0, 6.0), 2)]
)
def test_a_branch_s_end_that_was_stepped_over_is_noticed(
    monkeypatch: pytest.MonkeyPatch, travel: tuple[float, ...], on_branch: int
) -> None:
    """Without a search for the end, long steps pass from the branch to the path that it joins; it is found behind."""
    monkeypatch.setattr(decisions_after_march, "predicted_end", lambda *given: (None, False))
    path = trace(v_beam(), Displacement("d", DOWN, np.array(travel) * 1e-3))
    names = path.branch[path.at_requested]
    assert all(name.startswith("bifurcated") for name in names[:on_branch])
    assert all(name == "primary" for name in names[on_branch:])
    assert path.events[-1].kind == "bifurcation"
    assert path.events[-1].drive == pytest.approx(4.773454576e-3, rel=1e-7)  # as with the search for the end


def test_an_end_that_is_not_found_behind_either_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 4.71 mm one step passes it; from 4.7 mm the steps become short there, and rounding decides what is found."""
    monkeypatch.setattr(decisions_after_march, "predicted_end", lambda *given: (None, False))
    monkeypatch.setattr(branch_rejoins_path, "closed_behind", lambda *given: None)
    path = trace(v_beam(), Displacement("d", DOWN, np.array([4.0, 4.71, 5.0, 6.0]) * 1e-3))
    assert path.branch[path.at_requested][2:].tolist() == ["primary", "primary"]
    assert path.events[-1].kind == "unresolved"
    assert 4.71e-3 < path.events[-1].drive <= 5.0e-3 * (1 + 1e-9)
