"""Limit points of Lee's frame and of the deep arch against elastica integrated by another program, to 1e-7.

The frame: S.-L. Lee, F. S. Manuel, E. C. Rossow, J. Eng. Mech. Div. 94 (1968) 521, members inextensible. The arch:
D. A. DaDeppo, R. Schmidt, J. Appl. Mech. 42 (1975) 896. Here both are solved by shooting with scipy for a given travel
of the loaded point; the limits of the load are the extremes of a polynomial through such points.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import cfmkit.elastica as el


def traced(network: el.Network, most: float) -> el.Path:
    load = el.Loading((el.PointLoad("tip", fy=-1.0),), np.array([most]))
    path = el.trace(network, load, el.Control(through_folds=True, tolerance=1e-8))
    assert path.status is el.PathStatus.COMPLETE
    return path


def frame() -> el.Network:
    section = el.Section(720.0, 3.0, 2.0, axial=False)
    nodes = {
        "a": el.Node(0, 0, el.PINNED_SUPPORT),
        "corner": el.Node(0, 120),
        "tip": el.Node(24, 120),
        "b": el.Node(120, 120, el.PINNED_SUPPORT),
    }
    beams = {
        "column": el.Beam("a", "corner", section),
        "left": el.Beam("corner", "tip", section),
        "right": el.Beam("tip", "b", section),
    }
    return el.Network(nodes, beams)


def arch() -> el.Network:
    foot, top = 100 * np.sin(np.radians(107.5)), 100 * np.cos(np.radians(107.5))
    section, half = el.Section(12e6, 1.0, 1.0, axial=False), el.arc(-np.radians(107.5))
    nodes = {
        "a": el.Node(-foot, top, el.PINNED_SUPPORT),
        "tip": el.Node(0, 100),
        "b": el.Node(foot, top, el.CLAMPED_SUPPORT),
    }
    return el.Network(nodes, {"left": el.Beam("a", "tip", section, half), "right": el.Beam("tip", "b", section, half)})


def carried(state: Any, length: float, bend: float, force: tuple[float, float], rigidity: float) -> Any:
    """Integrate x, y, angle and moment along a piece with the curvature `bend` at rest."""
    h, v = force

    def slopes(s: float, y: Any) -> list[float]:
        c, n = np.cos(y[2]), np.sin(y[2])
        return [c, n, bend + y[3] / rigidity, h * n - v * c]

    return solve_ivp(slopes, (0, length), state, "DOP853", rtol=1e-11, atol=1e-10).y[:, -1]


def frame_gaps(z: Any, travel: float) -> list[float]:
    """By the turn at a, its force on the frame (h, v as on the section behind) and the load."""
    turn, h, v, load = z
    state = carried([0, 0, np.pi / 2 + turn, 0], 120, 0.0, (h, v), 1440.0)
    state[2] -= np.pi / 2
    state = tip = carried(state, 24, 0.0, (h, v), 1440.0)
    end = carried(state, 96, 0.0, (h, v + load), 1440.0)
    return [end[0] - 120, end[1] - 120, end[3], tip[1] - 120 + travel]


def arch_gaps(z: Any, travel: float) -> list[float]:
    turn, h, v, load = z
    half, foot, top = np.radians(107.5), *(100 * f(np.radians(107.5)) for f in (np.sin, np.cos))
    tip = carried([-foot, top, half + turn, 0], 100 * half, -0.01, (h, v), 1e6)
    end = carried(tip, 100 * half, -0.01, (h, v + load), 1e6)
    return [end[0] - foot, end[1] - top, 100 * (end[2] + half), tip[1] - 100 + travel]


def limit(path: el.Path, gaps: Any, beam: str, window: tuple[float, float]) -> float:
    """Return the extreme of the load over a window of travel that the path passes, solved for anew at seven places."""
    travel = -path.motion("tip")[:, 1]
    places = np.mean(window) + 0.5 * np.ptp(window) * np.cos(np.pi * (np.arange(7) + 0.5) / 7)
    event = min(path.events, key=lambda e: float(np.abs(travel[np.abs(path.drive - e.drive).argmin()] - places).min()))
    near = int(np.abs(path.drive - event.drive).argmin())
    guess = np.array([path.motion("a")[near, 2], *path.end_force(beam, 0)[near, :2], path.drive[near]])
    scale, loads = np.abs(guess), []
    for place in places[np.argsort(np.abs(places - travel[near]))]:
        found = root(lambda z, place=place: gaps(z * scale, place), guess / scale, tol=1e-12)
        assert np.abs(found.fun).max() < 1e-7
        guess = found.x * scale
        loads.append((place, guess[3]))
    curve = np.polynomial.Chebyshev.fit(*np.array(loads).T, 6)
    tops = curve.deriv().roots()
    tops = tops[(np.abs(tops.imag) < 1e-9) & (tops.real > window[0]) & (tops.real < window[1])].real
    assert len(tops) == 1
    return float(curve(tops[0]))


def test_lee_s_frame_snaps_and_regains_where_its_elastica_does() -> None:
    """18.55 and -9.27 EI/L^2 in the paper; exactly 18.5587 and -9.4213."""
    path = traced(frame(), 2.5)
    assert [event.kind for event in path.events] == ["limit point", "limit point"]
    top, low = (event.drive for event in path.events)
    assert limit(path, frame_gaps, "column", (48.6, 49.4)) == pytest.approx(top, rel=1e-7)
    assert limit(path, frame_gaps, "column", (58.0, 58.8)) == pytest.approx(low, rel=1e-7)
    assert top / 0.1 == pytest.approx(18.55, abs=0.01)


def test_deep_arch_snaps_and_regains_where_its_elastica_does() -> None:
    """8.97 EI/R^2 in the paper, at 1.13 to 1.14 radii of travel."""
    path = traced(arch(), 920.0)
    assert [event.kind for event in path.events] == ["limit point", "limit point"]
    top, low = (event.drive for event in path.events)
    assert limit(path, arch_gaps, "left", (113.0, 115.0)) == pytest.approx(top, rel=1e-7)
    assert limit(path, arch_gaps, "left", (122.0, 124.0)) == pytest.approx(low, rel=1e-7)
    assert top / 100 == pytest.approx(8.97, abs=0.005)
    deflection = -path.motion("tip")[:, 1]
    assert deflection[np.abs(path.drive - top).argmin()] / 100 == pytest.approx(1.135, abs=0.01)
