"""Slender columns and strips: one mode from rest to 60 % of their length, and tension without any.

References
----------
[TG] S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability, 2nd ed., 1961.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from scipy.special import ellipe, ellipk

import cfmkit.elastica as el
from cfmkit.elastica.mechanics.compiled_module import WITHOUT_C_VARIABLE

RNG = np.random.default_rng(0)


def strip(slenderness: float, ends: str, axial: bool = True) -> tuple[el.Network, float]:
    """A straight strip of 100 mm, and its bending rigidity; pinned, or clamped and guided."""
    thickness = 0.1 * math.sqrt(12) / slenderness
    start, end = (
        (el.PINNED_SUPPORT, el.Support(False, True, False))
        if ends == "pinned"
        else (el.CLAMPED_SUPPORT, el.slider_support(0.0))
    )
    section = el.Section(2e9, 10e-3, thickness, axial=axial)
    nodes = {"a": el.Node(0, 0, start), "b": el.Node(0.1, 0, end)}
    return el.Network(nodes, {"strip": el.Beam("a", "b", section)}), 2e9 * 10e-3 * thickness**3 / 12


@pytest.mark.parametrize("slenderness", [100, 1000, 3000, 10000])
@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_a_strip_in_pure_tension_is_stable(slenderness: float, ends: str) -> None:
    network, _ = strip(slenderness, ends)
    path = el.trace(network, el.Displacement("b", 0.0, np.linspace(0, 1e-3, 11)), el.Control(tolerance=1e-6))
    assert path.status is el.PathStatus.COMPLETE
    assert not path.unstable.any()
    thickness = 0.1 * math.sqrt(12) / slenderness
    assert path.effort[-1] == pytest.approx(2e9 * 10e-3 * thickness * 0.01, rel=1e-9)


def elastica(shortening: float) -> tuple[float, float]:
    """Return a pinned inextensible column's force over its critical one, and its end's angle [TG, sec. 2.7]."""
    m = brentq(lambda m: 2 * ellipe(m) / ellipk(m) - 1 - (1 - shortening), 1e-12, 0.99)
    return float((2 * ellipk(m) / np.pi) ** 2), 2 * math.asin(math.sqrt(m))


def shot(slenderness: float, share: float, ends: str, shortening: float, axial: bool = True) -> float:
    """Return the force [N] of a strip that is bent in its first mode, by shooting: solve_ivp knows nothing of the mesh.

    share: of the thickness; shortening: of the distance between the ends, over its length.
    """
    _, rigidity = strip(slenderness, ends)
    thickness, waves = 0.1 * math.sqrt(12) / slenderness, 1 if ends == "pinned" else 2
    size = share * thickness if ends == "pinned" else 0.5 * share * thickness  # of the wave: 1 - cos is 2 at its top
    s = np.linspace(0, 1, 4001)
    sloped = size * waves * np.pi / 0.1 * (np.cos(np.pi * s) if waves == 1 else np.sin(2 * np.pi * s))
    length = 0.1 / np.trapezoid(np.cos(sloped), s)
    stretch = 1 / (2e9 * 10e-3 * thickness) if axial else 0.0

    def slopes(place: float, state: Any, push: float) -> list[float]:
        angle = size * waves * np.pi / 0.1 * (math.cos(np.pi * place) if waves == 1 else math.sin(2 * np.pi * place))
        c, sine = math.cos(angle + state[0]), math.sin(angle + state[0])
        longer = 1 - push * c * stretch
        return [length * state[1] / rigidity, -push * length * longer * sine, length * longer * c]

    def missed(unknown: Any) -> list[float]:
        push = unknown[1] * rigidity / 0.01
        start = [unknown[0], 0.0, 0.0] if waves == 1 else [0.0, unknown[0] * rigidity / 0.1, 0.0]
        end = solve_ivp(slopes, (0, 1), start, method="DOP853", rtol=1e-10, atol=1e-13, args=(push,)).y[:, -1]
        return [end[1] * 0.1 / rigidity if waves == 1 else end[0], end[2] / 0.1 - (1 - shortening)]

    ratio, angle = elastica(shortening)
    push = ratio * (waves * np.pi) ** 2
    curve = 2 * math.sin(0.5 * angle) * math.sqrt(push)  # the largest curvature: M^2 = 2 P B (1 - cos angle)
    found = root(missed, [angle if waves == 1 else curve, push], tol=1e-10)
    assert found.success
    return float(found.x[1] * rigidity / 0.01)


@pytest.mark.parametrize("slenderness", [100, 300, 1000, 3000, 5000])
@pytest.mark.parametrize("share", [0.001, 0.03, 0.3])
@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_a_slender_column_keeps_to_its_first_mode(slenderness: float, share: float, ends: str) -> None:
    """Slightly bent in its first mode and pressed to 60 % of its length: nothing happens on the way."""
    network, _ = strip(slenderness, ends)
    thickness = 0.1 * math.sqrt(12) / slenderness
    pressed = el.Displacement("b", np.pi, np.linspace(0, 0.06, 41))
    path = el.trace(network, pressed, el.Control(imperfection=share * thickness))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert not path.unstable.any()
    assert path.events == ()
    for point in (4, 16, 40):
        expected = shot(slenderness, share, ends, pressed.points[point] / 0.1)
        assert path.effort[path.at_requested[point]] == pytest.approx(expected, rel=5e-4)


@pytest.mark.parametrize("slenderness", [100, 700, 5000])
@pytest.mark.parametrize("share", [0.001, 0.01, 0.3])
@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_a_slender_column_that_does_not_stretch_leaves_its_nearly_rigid_start(
    slenderness: float, share: float, ends: str
) -> None:
    """Bent by as little as 7e-7 of its length, it hardly moves before its critical force; a force leads there, too."""
    network, _ = strip(slenderness, ends, axial=False)
    bow = share * 0.1 * math.sqrt(12) / slenderness
    control = el.Control(imperfection=bow)
    pressed = el.trace(network, el.Displacement("b", np.pi, np.linspace(0, 0.06, 5)), control)
    assert pressed.status is el.PathStatus.COMPLETE, pressed.message
    assert not pressed.unstable.any()
    assert pressed.events == ()
    forces = pressed.effort[pressed.at_requested]
    # its ends come nearer by some bow^2 / length in all before the critical force: one rounding of a place of that
    rounded = np.finfo(np.float64).eps * 0.1 / (bow**2 / 0.1)
    assert abs(forces[0]) < max(1e-5, rounded) * forces[1]
    expected = shot(slenderness, share, ends, 0.15, axial=False)
    assert forces[1] == pytest.approx(expected, rel=5e-5)
    loaded = el.trace(network, el.Loading((el.PointLoad("b", -1.0),), forces[1:]), control)
    assert loaded.status is el.PathStatus.COMPLETE, loaded.message
    moved = loaded.motion("b")[loaded.at_requested, 0]
    np.testing.assert_allclose(moved, -pressed.drive[pressed.at_requested][1:], rtol=2e-4)


@pytest.mark.parametrize("share", [2.5e-4, 5e-4, 1e-3])
@pytest.mark.parametrize("engine", ["C if there is one", "numpy"])
def test_a_nearly_rigid_start_does_not_depend_on_rounding(
    engine: str, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bow of 2e-7 of the length or more: rounding of places over the bow's square is a small force."""
    if engine == "numpy":
        monkeypatch.setenv(WITHOUT_C_VARIABLE, "1")
    network, rigidity = strip(5000, "pinned", axial=False)
    control = el.Control(imperfection=share * 0.1 * math.sqrt(12) / 5000)
    pressed = el.trace(network, el.Displacement("b", np.pi, np.array([0.015])), control)
    assert pressed.status is el.PathStatus.COMPLETE, pressed.message
    ratio, _ = elastica(0.15)
    assert pressed.effort[-1] == pytest.approx(ratio * np.pi**2 * rigidity / 0.01, rel=1e-5)


@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_a_straight_column_that_does_not_stretch_is_rigid_until_it_buckles_whichever_way_it_points(ends: str) -> None:
    """The sine of its angle is not exact: that is no imperfection."""
    network, _ = strip(100, ends, axial=False)
    x, y = 0.1 * math.cos(0.3), 0.1 * math.sin(0.3)
    free = el.slider_support(0.3, rotates=ends == "pinned")
    askew = el.Network({"a": network.nodes["a"], "b": el.Node(x, y, free)}, network.beams)
    forces = []
    for column, angle in ((network, math.pi), (askew, math.pi + 0.3)):
        assert (
            el.trace(column, el.Displacement("b", angle - math.pi, np.array([1e-3]))).status is el.PathStatus.NO_START
        )
        pressed = el.trace(column, el.Displacement("b", angle, np.array([1e-3])))
        assert pressed.status is el.PathStatus.COMPLETE
        assert [(event.kind, event.drive < 1e-9) for event in pressed.events] == [("bifurcation", True)]
        forces.append(pressed.effort[-1])
    assert forces == pytest.approx([shot(100, 1e-6, ends, 0.01, axial=False)] * 2, rel=1e-6)
