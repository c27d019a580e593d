"""Random arches and trusses: what becomes of them does not depend on the tolerance, and the forces agree within it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cfmkit.elastica as el

HALF, TOLERANCES = 0.05, (1e-3, 1e-5, 1e-7)


def arch(rng: Any) -> tuple[el.Network, Any]:
    """Return two beams that meet at an apex, of any form and on any supports, and a drive that presses it down."""
    rise = HALF * rng.uniform(0.05, 0.4)
    section = el.Section(2e9, 8e-3, rise / rng.uniform(3, 30), axial=bool(rng.integers(2)))
    forms: list[tuple[Any, Any]] = [
        (el.CosineArch(rise, 0.5), el.CosineArch(-rise, 0.5)),
        (el.Polynomial(), el.Polynomial()),
        (el.arc(-rng.uniform(0.1, 0.8)),) * 2,
    ]
    ends = [el.CLAMPED_SUPPORT if rng.integers(2) else el.PINNED_SUPPORT for _ in range(2)]
    nodes = {
        "a": el.Node(0, 0, ends[0]),
        "t": el.Node(HALF, rise, el.FREE_SUPPORT if rng.integers(2) else el.slider_support(np.pi / 2)),
        "b": el.Node(2 * HALF, 0, ends[1]),
    }
    one, two = forms[int(rng.integers(3))]
    beams = {"x": el.Beam("a", "t", section, one), "y": el.Beam("t", "b", section, two)}
    points = np.linspace(0, 1, int(rng.integers(3, 40)))[1:]
    if rng.integers(3):
        return el.Network(nodes, beams), el.Displacement("t", -np.pi / 2, points * rng.uniform(0.5, 2.4) * rise)
    return el.Network(nodes, beams), el.Loading((el.PointLoad("t", fy=-rng.uniform(0.1, 3)),), points)


LONG = (9, 91)
"""Seeds whose arches wind up and take eight seconds and more."""

RIGID = (25, 73, 83, 86)
"""Seeds of two straight beams that do not stretch under a load: a triangle that does not move, whose forces are known
to a few per cent because places are rounded; whether a step fails or that error is told depends on the tolerance."""


@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=pytest.mark.slow) if seed in LONG else seed for seed in range(100)]
)
def test_an_arch_fares_alike_at_every_tolerance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    network, drive = arch(rng)
    sign: Any = 1 if rng.integers(2) else -1
    paths = [el.trace(network, drive, el.Control(tolerance=tolerance, sign=sign)) for tolerance in TOLERANCES]
    if seed in RIGID:
        assert {path.status for path in paths} <= {el.PathStatus.LOST, el.PathStatus.INACCURATE}
        return
    assert len({path.status for path in paths}) == 1, [path.message for path in paths]
    assert not any(event.kind == "unresolved" for path in paths for event in path.events)
    if paths[0].status is not el.PathStatus.COMPLETE:
        return
    efforts = [path.effort[path.at_requested] for path in paths]
    largest = np.abs(efforts[-1]).max()
    for tolerance, effort in zip(TOLERANCES, efforts, strict=True):
        np.testing.assert_allclose(effort, efforts[-1], rtol=0, atol=20 * tolerance * largest + 1e-12)


def leaf(rng: Any) -> tuple[el.Network, el.Displacement]:
    """Return half a V-beam, slender enough to buckle, and a drive that presses it through."""
    angle = np.radians(rng.uniform(2, 20))
    rise = 35e-3 * np.sin(angle)
    nodes = {
        "w": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "d": el.Node(35e-3 * np.cos(angle), rise, el.slider_support(np.pi / 2)),
    }
    beams = {"v": el.Beam("w", "d", el.Section(1477e6, 6e-3, rise / rng.uniform(3, 15)))}
    points = np.linspace(0, rng.uniform(0.5, 2.3), int(rng.integers(4, 40)))[1:] * rise
    return el.Network(nodes, beams), el.Displacement("d", -np.pi / 2, points)


@pytest.mark.parametrize("seed", range(60))
def test_a_leaf_kept_on_its_path_meets_the_same_bifurcations_at_every_tolerance(seed: int) -> None:
    network, drive = leaf(np.random.default_rng(seed))
    loose, usual, exact = (
        el.trace(network, drive, el.Control(tolerance=tolerance, branch="primary")) for tolerance in (1e-3, 1e-4, 1e-8)
    )
    for path in (loose, usual):
        assert path.status is exact.status
        assert [(e.kind, e.before, e.after) for e in path.events] == [(e.kind, e.before, e.after) for e in exact.events]
        places = [event.drive for event in path.events]
        assert places == pytest.approx([event.drive for event in exact.events], abs=3e-4 * float(drive.points[-1]))


@pytest.mark.parametrize("seed", [59, 61, 86, 126])
def test_a_path_that_meets_no_limit_point_is_the_same_with_permission_to_pass_some(seed: int) -> None:
    """On coarse meshes these stop for a while; then the arc length is tried."""
    network, drive = arch(np.random.default_rng(seed))
    plain, allowed = (
        el.trace(network, drive, el.Control(tolerance=1e-5, through_folds=folds)) for folds in (False, True)
    )
    assert allowed.status is plain.status
    assert allowed.events == plain.events
    np.testing.assert_allclose(allowed.effort[allowed.at_requested], plain.effort[plain.at_requested], rtol=1e-9)
