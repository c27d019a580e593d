"""The trace on the functional: every case of `tests/cases/networks.jsonl`, and what is right where the file is not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import network_cases
import numpy as np
import pytest
from network_cases import differences, from_json, observe, read_cases

import cfmkit.elastica as el
from cfmkit.elastica.tracing.trace import DegreeAndPieces, raise_attempt, trace, trace_on
from cfmkit.elastica.vibration import frequencies

if TYPE_CHECKING:
    from collections.abc import Mapping

CASES = {case["name"]: case for case in read_cases()}
EVERY = 8
TOLERANCE = 1e-7
LOOSER = {
    "imperfect cosine arch": 1e-5,  # the file's imperfection has a size that is known to 1e-5
    "points next to each other at the end of a branch 1": 1e-5,  # they lie where everything is a root
    "integrals along a coil take any number of steps 1": 1e-6,
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
    path: Any = trace(network, drive, replace(control, tolerance=1e-9))
    monkeypatch.setattr(network_cases, "frequencies", frequencies)
    length = path.mesh.scales.length
    assert differences(observe(path), case["expected"], LOOSER.get(name, TOLERANCE), length) == []


STIFF = el.Section(2e9, 1e-2, 1e-3, axial=False)


def test_a_step_along_the_arc_does_not_lead_to_the_mirror_image() -> None:
    """Bent by 3.5e-5 of its length a column that does not stretch buckles to that side, whatever the steps."""
    net = el.Network(
        {"a": el.Node(0, 0, el.PINNED_SUPPORT), "b": el.Node(0.1, 0, el.slider_support(0.0, True))},
        {"x": el.Beam("a", "b", STIFF)},
    )
    drive = el.Displacement("b", np.pi, np.array([1e-3, 0.015, 0.03]))
    sides = [trace(net, drive, el.Control(imperfection=size)).motion("a")[-1, 2] for size in (3.5e-6, 3.5e-5, -3.5e-6)]
    assert sides[0] == pytest.approx(sides[1], rel=1e-2)
    assert sides[0] == pytest.approx(-sides[2], rel=1e-7)


def test_leaves_on_a_shuttle_that_may_turn_end_at_a_limit_point() -> None:
    """Four V-beams that turn as they buckle: by the arc length their branch is a closed loop that never goes further.

    Behind it the straight path is stable, and has less energy: they jump there.
    """
    case = CASES["leaves on a shuttle that may turn fare alike with any points 1"]
    network, drive = (from_json(case[part]) for part in ("network", "drive"))
    ends = trace(network, drive)
    assert ends.status is el.PathStatus.LIMIT_POINT
    limit = ends.drive[-1]
    assert limit == pytest.approx(6.29445e-3, rel=1e-6)
    loop = trace(network, drive, el.Control(through_folds=True, most_points=150))
    assert loop.status is el.PathStatus.FULL
    assert loop.drive.max() < limit * (1 + 1e-6)
    folds = [event.drive for event in loop.events if event.kind == "limit point"]
    assert sum(abs(fold - limit) < 1e-6 * limit for fold in folds) >= 3  # it comes by again
    straight = trace(network, replace(drive, points=np.array([limit])), el.Control(branch="primary"))
    assert straight.stable[-1]
    assert straight.energy[-1] < ends.energy[-1] - 1e-7


@pytest.mark.parametrize("tolerance", [1e-3, 1e-7])
def test_an_arch_of_two_straight_beams_that_do_not_stretch_buckles_to_the_same_side(tolerance: float) -> None:
    """It is rigid at rest, so that it reaches many critical loads at once; both beams buckle in their first modes."""
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "t": el.Node(0.05, 0.0173, el.slider_support(np.pi / 2)),
        "b": el.Node(0.1, 0, el.PINNED_SUPPORT),
    }
    net = el.Network(nodes, {"x": el.Beam("a", "t", STIFF), "y": el.Beam("t", "b", STIFF)})
    path = trace(net, el.Displacement("t", -np.pi / 2, np.linspace(1e-3, 8e-3, 4)), el.Control(tolerance))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    length = float(np.hypot(0.05, 0.0173))
    bending = 2e9 * 1e-2 * 1e-9 / 12 / length**2
    forces = (4 + 2.0457) * np.pi**2 * bending * 0.0173 / length  # Euler's, clamped, and clamped and pinned
    assert path.effort[path.at_requested][0] == pytest.approx(forces, rel=0.1)


def test_a_path_that_is_raised_is_that_of_its_degree() -> None:
    """Its points and events are corrected on the finer mesh, not followed anew."""
    case = CASES["config: vcfm_pla 2"]
    network, drive = (from_json(case[part]) for part in ("network", "drive"))
    coarse = trace_on(network, drive, el.Control(1e-8), DegreeAndPieces(10))
    coarse = coarse._replace(path=replace(coarse.path, error=1e-5))
    raised = raise_attempt(coarse, DegreeAndPieces(14), el.Control(1e-8))
    assert raised is not None
    anew = trace_on(network, drive, el.Control(1e-8), DegreeAndPieces(14)).path
    both = [path.effort[path.at_requested] for path in (raised.path, anew)]
    np.testing.assert_allclose(both[0], both[1], rtol=0, atol=1e-9 * np.abs(both[1]).max())
    assert [event.drive for event in raised.path.events] == pytest.approx(
        [event.drive for event in anew.events], rel=1e-8
    )
    assert raised.path.branch[-1] == anew.branch[-1]
