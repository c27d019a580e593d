"""The bending law of wide strips [Ashwell 1950]: its limits, energy, derivatives, and what it is in the engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cfmkit.elastica as el
from cfmkit.elastica.mechanics import energy as functional
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.wide_strip import curling_share
from cfmkit.elastica.model.section import curl_hindered

COMPLEX_STEP = 1e-30  # nothing is subtracted: its square vanishes beside one

E, B, T, NU, LENGTH = 2e9, 10e-3, 1e-3, 0.35, 50e-3
PLATE = NU**2 / (1 - NU**2)
TAPER = el.Taper(np.array([0, 0.5, 1]), np.array([T, 0.7 * T, T]))
FINE = el.Control(tolerance=1e-9)


def cantilever(section: el.Section, turn: float = 0.0) -> el.Network:
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(LENGTH, 0)}
    return el.Network(nodes, {"x": el.Beam("a", "b", section, el.arc(turn))})


def strip(wide: bool = True, width: float = B, nu: float = NU) -> el.Section:
    return el.Section(E, width, T, axial=False, poisson_ratio=nu, wide=wide)


def twisted(network: el.Network, moment: float) -> Any:
    return el.trace(network, el.Loading((el.PointLoad("b", 0, 0, 1.0),), np.array([moment])), FINE)


def energy(bend: float, rest: float, width: float = B) -> float:
    """Strain energy per length [J/m] of a strip of curvature `rest` that is bent by `bend` [1/m]."""
    z = 3 * (1 - NU**2) * (width**2 / T) ** 2 * (bend + rest) ** 2
    return float(E * width * T**3 / 24 * bend**2 * (1 + PLATE * curl_hindered(np.array(z))))


def moment(bend: float, rest: float) -> float:
    h = 1e-3 * abs(bend)
    near = [energy(bend + k * h, rest) for k in (-2, -1, 1, 2)]
    return (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / (12 * h)


def test_the_energy_is_the_least_that_any_curling_of_the_section_takes():
    bend = 60.0
    plate = E * T**3 / (12 * (1 - NU**2))
    z, w = np.polynomial.legendre.leggauss(40)
    z, w = 0.5 * B * z, 0.5 * B * w
    even = [np.polynomial.Legendre.basis(2 * k, domain=[-B / 2, B / 2]) for k in range(8)]
    lift, curl = np.array([p(z) for p in even]), np.array([p.deriv(2)(z) for p in even])
    stiff = plate * (curl * w) @ curl.T + E * T * bend**2 * (lift * w) @ lift.T
    push = plate * NU * bend * (curl * w).sum(axis=1)
    least = 0.5 * plate * bend**2 * B - 0.5 * push @ np.linalg.solve(stiff, push)
    assert energy(bend, 0.0) == pytest.approx(least, rel=1e-9)


def test_a_narrow_strip_curls_freely_and_a_very_wide_one_not_at_all():
    assert curl_hindered(np.array([0.0, 1e-12, 1e16])) == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)


def test_the_series_and_the_closed_form_of_the_law_meet():
    below, above = (np.array(curling_share(np.array([z]))).ravel() for z in (1.0 - 1e-12, 1.0))
    assert below == pytest.approx(above, rel=2e-11)
    for z in (0.3, 4.0, 900.0):
        g, first, second = (part[0] for part in curling_share(np.array([z + 1e-30j])))
        assert 1 - g.real == pytest.approx(curl_hindered(np.array(z)), rel=1e-11)
        assert g.imag / 1e-30 == pytest.approx(first.real, rel=1e-11)
        assert first.imag / 1e-30 == pytest.approx(second.real, rel=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.8, -0.8])
def test_a_strip_under_an_end_moment_has_the_curvature_that_its_energy_says(turn):
    found = twisted(cantilever(strip(), turn), 0.1)
    length = float(np.real(found.fits["x"].length))
    bend = float(found.motion("b")[-1, 2]) / length
    assert moment(bend, turn / length) == pytest.approx(0.1, rel=1e-9)
    assert found.energy[-1] == pytest.approx(energy(bend, turn / length) * length, rel=1e-9)


def test_a_strip_without_poissons_ratio_and_a_narrow_one_are_beams():
    for section, near in ((strip(nu=0.0), 1e-12), (strip(width=0.2e-3), 1e-7)):
        usual = el.Section(E, section.width, T, axial=False, poisson_ratio=section.poisson_ratio)
        wide, beam = (twisted(cantilever(one), 5.0 * section.width).motion("b")[-1] for one in (section, usual))
        assert wide == pytest.approx(beam, rel=near)


def strips_and_a_narrow_beam() -> tuple[el.Network, el.Displacement]:
    narrow, wide = el.Section(E, 2e-3, T), el.Section(E, B, T, poisson_ratio=NU, shear=True, wide=True)
    tapered = el.Section(E, B, TAPER, poisson_ratio=NU, wide=True)
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(0.05, 0.03),
        "c": el.Node(0.1, 0, el.CLAMPED_SUPPORT),
        "d": el.Node(0.05, 0, el.CLAMPED_SUPPORT),
    }
    beams = {"x": el.Beam("a", "b", wide, el.arc(0.9)), "y": el.Beam("b", "c", tapered), "z": el.Beam("b", "d", narrow)}
    return el.Network(nodes, beams), el.Displacement("b", 0.3, np.array([0.002, 0.004]))


def test_a_strip_in_a_network_with_narrow_beams_does_the_work_that_it_stores():
    net, drive = strips_and_a_narrow_beam()
    found = el.trace(net, drive, el.Control())
    assert found.status is el.PathStatus.COMPLETE
    x, w = np.polynomial.legendre.leggauss(16)
    places = el.trace(net, el.Displacement("b", 0.3, 0.003 + 0.001 * x), el.Control())
    work = 0.001 * w @ places.effort[places.at_requested]
    before, after = found.energy[found.at_requested]
    assert after - before == pytest.approx(work, rel=1e-6)


@pytest.mark.parametrize("size", [0.01, 0.3, 3.0])
def test_gradient_and_hessian_of_wide_strips_are_derivatives_and_the_same_in_c(size: float):
    """Bent a little, where the law is a series, and much, where it is not."""
    mesh = discretise(*strips_and_a_narrow_beam(), 4, 2)
    z = size * np.random.default_rng(1).standard_normal(mesh.size)
    tangent = functional.hessian(mesh, z, 0.1, 0.6)
    steps = [functional.gradient(mesh, z + 1j * COMPLEX_STEP * unit, 0.1, 0.6).imag for unit in np.eye(mesh.size)]
    largest = float(np.abs(tangent).max())
    assert tangent == pytest.approx(np.stack(steps, axis=1) / COMPLEX_STEP, rel=1e-11, abs=1e-11 * largest)
    own = equations(mesh)
    if isinstance(own, CompiledEquations):
        gradient_in_c, hessian_in_c = own.evaluate(z, 0.1, 0.6)
        assert np.abs(hessian_in_c - tangent).max() < 1e-12 * largest
        known = functional.gradient(mesh, z, 0.1, 0.6)
        assert np.abs(gradient_in_c - known).max() < 1e-12 * np.abs(known).max()


def test_a_tape_that_is_bent_back_ends_where_it_would_snap():
    thin = el.Section(2e11, 25e-3, 0.1e-3, axial=False, poisson_ratio=0.3, wide=True)
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.02, 0)}
    network = el.Network(nodes, {"x": el.Beam("a", "b", thin, el.arc(-5.0))})
    found = el.trace(network, el.Loading((el.PointLoad("b", 0, 0, 1.0),), np.array([0.2])), el.Control())
    assert found.status is not el.PathStatus.COMPLETE
    assert np.isfinite(found.motion("b")).all()
