"""The trace on the functional: every case of `tests/cases/networks.jsonl`, and what is right where the file is not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import network_cases
import numpy as np
import pytest
from network_cases import differences, from_json, observe, read_cases

from cfmkit.elastica import (
    CLAMPED,
    PINNED,
    Beam,
    Control,
    Displacement,
    Loading,
    Network,
    Node,
    PathStatus,
    PointLoad,
    Section,
    guided,
)
from cfmkit.elastica.tracing.trace_by_energy import trace
from cfmkit.elastica.vibration import frequencies

if TYPE_CHECKING:
    from collections.abc import Mapping

CASES = {case["name"]: case for case in read_cases()}
EVERY = 8
TOLERANCE = 1e-6
LOOSER = {
    "imperfect cosine arch": 1e-5,  # the file's imperfection has a size that is known to 1e-5
    "points next to each other at the end of a branch 1": 1e-4,  # they lie where everything is a root
    "the last point may lie at an end of a branch 1": 1e-4,
    "leaves that are nearly equal buckle one after the other 1": 1e-3,
    # of a stepped beam the file knows frequencies to 5e-5: here they are the same on any mesh to 1e-11
    **dict.fromkeys([f"config: vcfm_hybrid {number}" for number in (1, 2, 3)], 1e-5),
}
ASIDE = {
    "the derivative of a coil s moment by its chord 1": "frequencies of a coil of 1000 turns need too many unknowns",
    "leaves that differ straighten one after the other 1": "five leaves have five ends; the file knows two of them",
    "leaves on a shuttle that may turn fare alike with any points 1": "the stable branch has a limit point at 6.2944 mm"
    " and no stable continuation; the file goes on at the end that its unstable part has, at 6.2617 mm",
}


@pytest.mark.parametrize(
    "name", [name if k % EVERY == 0 else pytest.param(name, marks=pytest.mark.slow) for k, name in enumerate(CASES)]
)
def test_paths_on_the_functional_are_those_of_the_file(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in ASIDE:
        pytest.skip(ASIDE[name])
    case: Mapping[str, Any] = CASES[name]
    network, drive, control = (from_json(case[part]) for part in ("network", "drive", "control"))
    path: Any = trace(network, drive, replace(control, tolerance=1e-8))
    monkeypatch.setattr(network_cases, "frequencies", frequencies)
    length = path.network.scales.length
    assert differences(observe(path), case["expected"], LOOSER.get(name, TOLERANCE), length) == []


STIFF = Section(2e9, 1e-2, 1e-3, axial=False)
EULER = 4 * np.pi**2 * 2e9 * 1e-2 * 1e-9 / 12 / 0.1**2  # clamped at both ends


def test_a_straight_column_that_does_not_stretch_is_pressed_beyond_its_critical_load() -> None:
    """Its force is that of a column under a load, which may stretch a little or not at all."""
    net = Network({"a": Node(0, 0, CLAMPED), "b": Node(0.1, 0, guided(0.0))}, {"x": Beam("a", "b", STIFF)})
    path = trace(net, Displacement("b", np.pi, np.array([1e-3, 1e-2, 3e-2])))
    assert path.status is PathStatus.COMPLETE
    assert path.stable.all()
    forces = path.effort[path.at_requested]
    assert forces[0] == pytest.approx(EULER * 1.005, rel=1e-4)  # 1 + shortening / 2
    loaded = trace(net, Loading((PointLoad("b", -1.0),), forces))
    assert -loaded.motion("b")[loaded.at_requested, 0] == pytest.approx([1e-3, 1e-2, 3e-2], rel=1e-4)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_the_error_told_is_that_of_the_path(tolerance: float) -> None:
    case = CASES["random 4, drive 0"]
    network, drive = (from_json(case[part]) for part in ("network", "drive"))
    path = trace(network, drive, Control(tolerance))
    known = np.array(case["expected"]["effort"])
    error = np.abs(path.effort[path.at_requested] - known).max() / np.abs(known).max()
    assert error <= path.error <= tolerance


def test_a_network_that_nothing_bears_has_no_start() -> None:
    net = Network({"a": Node(0, 0), "b": Node(0.1, 0)}, {"x": Beam("a", "b", STIFF)})
    path = trace(net, Displacement("b", np.pi / 2, np.array([1e-3])))
    assert path.status is PathStatus.NO_START
    assert len(path) == 0


def test_a_step_along_the_arc_does_not_lead_to_the_mirror_image() -> None:
    """Bent by 3.5e-5 of its length a column that does not stretch buckles to that side, whatever the steps."""
    net = Network({"a": Node(0, 0, PINNED), "b": Node(0.1, 0, guided(0.0, True))}, {"x": Beam("a", "b", STIFF)})
    drive = Displacement("b", np.pi, np.array([1e-3, 0.015, 0.03]))
    sides = [trace(net, drive, Control(imperfection=size)).motion("a")[-1, 2] for size in (3.5e-6, 3.5e-5, -3.5e-6)]
    assert sides[0] == pytest.approx(sides[1], rel=1e-2)
    assert sides[0] == pytest.approx(-sides[2], rel=1e-7)
