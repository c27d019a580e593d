"""Thin strips that are pulled hard: cut by the tension that the end of the travel brings, right, stable throughout."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import fsolve

import cfmkit.elastica as el

LENGTH, MODULUS, WIDTH = 0.1, 200e9, 0.01
UP = np.pi / 2


def pulled(thickness: float, rise: float, direction: float, travel: float, bow: float = 0.0) -> el.Path:
    """Return the path of a clamped strip whose far end, `rise` higher, is guided along a direction."""
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(LENGTH, rise, el.slider_support(direction))}
    section = el.Section(MODULUS, WIDTH, thickness, axial=True)
    beam = el.Beam("a", "b", section, el.CosineArch(bow, 1.0)) if bow else el.Beam("a", "b", section)
    drive = el.Displacement("b", direction, np.linspace(0, travel, 6)[1:])
    return el.trace(el.Network(nodes, {"x": beam}), drive, el.Control(tolerance=1e-6))


def end_force(thickness: float, drawn: tuple[float, float], moved: tuple[float, float]) -> tuple[float, float]:
    """Return the force on the end of a strip that is straight but for two layers, in which it turns back to its clamps.

    In a layer, at an angle psi to the strip's middle where its tension is F, M^2/2EI + N + N^2/2EA is constant and
    N = F cos psi; what it takes of the length is an integral over psi, exact but for exp(-L sqrt(F/EI)).
    """
    stretching, bending = MODULUS * WIDTH * thickness, MODULUS * WIDTH * thickness**3 / 12
    length, rest = np.hypot(*drawn), np.arctan2(drawn[1], drawn[0])
    unit = stretching * thickness / length

    def short_of(unknown: np.ndarray) -> list[float]:
        force, angle = unknown[0] * unit, unknown[1]

        def rate(psi: float) -> float:
            lost = 2 * force * np.sin(psi / 2) ** 2  # F - N
            return float(np.sqrt(2 / bending * lost * (1 + (2 * force - lost) / (2 * stretching))))

        def along(psi: float) -> float:
            stretch = force / stretching
            return float(((1 + stretch * np.cos(psi)) * np.cos(psi) - 1 - stretch) / rate(psi))

        def across(psi: float) -> float:
            return float((1 + force / stretching * np.cos(psi)) * np.sin(psi) / rate(psi))

        turned = angle - rest
        ahead = length * (1 + force / stretching) + 2 * quad(along, 0, abs(turned))[0]
        aside = -2 * np.sign(turned) * quad(across, 0, abs(turned))[0]
        c, s = np.cos(angle), np.sin(angle)
        place = (ahead * c - aside * s, ahead * s + aside * c)
        return [(place[k] - drawn[k] - moved[k]) / length for k in (0, 1)]

    end = np.add(drawn, moved)
    angle = np.arctan2(end[1], end[0])
    first = stretching * (np.hypot(*end) / length - 1) / unit
    force, angle = fsolve(short_of, [first, rest + 0.999 * (angle - rest)], xtol=1e-11)
    return float(force * unit * np.cos(angle)), float(force * unit * np.sin(angle))


@pytest.mark.parametrize(("thickness", "strain"), [(2e-5, 0.02), (1e-5, 0.03), (8e-6, 0.02)])
def test_a_straight_strip_is_pulled_to_any_strain(thickness: float, strain: float) -> None:
    path = pulled(thickness, 0.0, 0.0, strain * LENGTH)
    assert path.status is el.PathStatus.COMPLETE, path.message
    rounding = 1e-13 * path.effort[-1]  # of places: the first steps are a millionth of a strain
    assert path.effort == pytest.approx(MODULUS * WIDTH * thickness * path.drive / LENGTH, rel=1e-9, abs=rounding)
    assert (path.unstable == 0).all()
    assert path.events == ()


@pytest.mark.parametrize("thickness", [2e-5, 1e-5])
@pytest.mark.parametrize(("rise", "direction", "travel"), [(0.0, UP, 0.025), (0.005, 0.0, 0.003), (0.02, UP, 0.01)])
def test_a_strip_pulled_askew_is_straight_but_for_layers_at_its_clamps(
    thickness: float, rise: float, direction: float, travel: float
) -> None:
    """The clamps stand along the strip as drawn, in which it is at rest."""
    path = pulled(thickness, rise, direction, travel)
    assert path.status is el.PathStatus.COMPLETE, path.message
    moved = (travel * np.cos(direction), travel * np.sin(direction))
    fx, fy = end_force(thickness, (LENGTH, rise), moved)
    assert path.effort[-1] == pytest.approx(fx * np.cos(direction) + fy * np.sin(direction), rel=3e-6)
    assert (path.unstable == 0).all()
    assert path.events == ()


@pytest.mark.parametrize("bow", [1e-5, 1e-3])
def test_a_slightly_bowed_strip_is_pulled_straight_and_stretched(bow: float) -> None:
    """Straightened it is as long as its arc; what is left of the bow bends it by less than the tolerance."""
    thickness, travel = 1e-5, 0.003
    path = pulled(thickness, 0.0, 0.0, travel, bow)
    assert path.status is el.PathStatus.COMPLETE, path.message
    arc = path.fits["x"].length
    assert path.effort[-1] == pytest.approx(MODULUS * WIDTH * thickness * ((LENGTH + travel) / arc - 1), rel=2e-6)
    assert (path.unstable == 0).all()
