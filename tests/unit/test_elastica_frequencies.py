"""Natural frequencies: beside those of another degree, and closed forms (Blevins 1979, ch. 8; Beck 1952)."""

from __future__ import annotations

from typing import Any

import beam_networks
import numpy as np
import pytest
from functional_paths import functional_path
from scipy.linalg import expm
from scipy.optimize import brentq

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    FREE_SUPPORT,
    PINNED_SUPPORT,
    Beam,
    Control,
    Displacement,
    Loading,
    Network,
    Node,
    PointLoad,
    Rotation,
    Section,
    Support,
    arc,
    slider_support,
    trace,
)
from cfmkit.elastica.mechanics.refine import embed, raise_degree
from cfmkit.elastica.vibration import NetworkMasses, frequencies
from cfmkit.errors import InputError

MODULUS, WIDTH, THICKNESS, LENGTH, DENSITY = 200e9, 10e-3, 1e-3, 0.1, 7850.0
RIGIDITY = MODULUS * WIDTH * THICKNESS**3 / 12
PER_LENGTH = DENSITY * WIDTH * THICKNESS
UNIT = np.sqrt(RIGIDITY / (PER_LENGTH * LENGTH**4)) / (2 * np.pi)
WHOLE = NetworkMasses({"x": DENSITY})


def beam(end: Support = FREE_SUPPORT, axial: bool = False, pin: bool = False) -> Network:
    section = Section(MODULUS, WIDTH, THICKNESS, axial=axial)
    start = PINNED_SUPPORT if pin else CLAMPED_SUPPORT
    return Network({"root": Node(0, 0, start), "tip": Node(LENGTH, 0, end)}, {"x": Beam("root", "tip", section)})


def under(force: float, net: Network, degree: int = 8, **load: Any) -> Any:
    return functional_path(net, Loading((PointLoad("tip", fx=-1.0, **load),), np.array([force])), degree)


def roots(equation: Any, count: int) -> np.ndarray:
    places = np.linspace(0.05, 30.0, 4000)
    values = np.array([equation(x) for x in places])
    changes = np.flatnonzero(values[1:] * values[:-1] < 0)
    return np.array([brentq(equation, places[k], places[k + 1], xtol=1e-13) for k in changes[:count]])


@pytest.mark.parametrize("axial", [False, True])
def test_a_cantilever_has_the_frequencies_of_the_closed_form(axial: bool) -> None:
    betas = roots(lambda x: np.cos(x) + 1 / np.cosh(x), 6)
    found = frequencies(under(1e-9, beam(axial=axial)), WHOLE, 6).free[-1]
    assert found == pytest.approx(UNIT * betas**2, rel=1e-7)


@pytest.mark.parametrize("axial", [False, True])
def test_frequencies_of_a_cantilever_with_a_mass_do_not_depend_on_the_degree(axial: bool) -> None:
    masses = NetworkMasses({"x": DENSITY}, {"tip": (0.7 * PER_LENGTH * LENGTH, 1e-7)})
    net, drive = beam(axial=axial), Loading((PointLoad("tip", fx=-1.0, fy=0.3),), np.array([3.0]))
    old = trace(net, drive, Control(tolerance=1e-10))
    known = frequencies(old, masses, 5, [len(old) - 1], ("tip", np.pi / 2))
    found = frequencies(functional_path(net, drive, 12), masses, 5, hold=("tip", np.pi / 2))
    assert found.free[0] == pytest.approx(known.free[0], rel=1e-7)
    assert found.held[0] == pytest.approx(known.held[0], rel=1e-7)


@pytest.mark.parametrize(("seed", "number"), [(4, 0), (4, 1), (4, 2), (8, 3)])
def test_frequencies_of_networks_with_every_feature_do_not_depend_on_the_degree(seed: int, number: int) -> None:
    """Loads that follow among them: held, free, and whether they flutter."""
    net = beam_networks.network(seed)
    drive = beam_networks.drives(net, seed)[number]
    masses = NetworkMasses(dict.fromkeys(net.beams, 1000.0), {"b": (1e-3, 1e-7), "bb": (5e-4, 0.0)})
    old = trace(net, drive, Control(tolerance=1e-9))
    known = frequencies(old, masses, 4, [len(old) - 1])
    found = frequencies(functional_path(net, drive, 14), masses, 4, [1])
    assert found.free[0] == pytest.approx(known.free[0], rel=1e-6, nan_ok=True)
    assert found.held[0] == pytest.approx(known.held[0], rel=1e-6, nan_ok=True)
    assert (found.flutters[0], found.diverges[0]) == (known.flutters[0], known.diverges[0])


def test_a_rod_swings_along_itself_where_it_stretches() -> None:
    found = frequencies(under(1e-9, beam(Support(across=True, rotation=True), axial=True)), WHOLE, 12).free[-1]
    wanted = np.sqrt(MODULUS / DENSITY) / (4 * LENGTH)
    assert np.abs(found / wanted - 1).min() < 1e-7


def test_a_column_swings_ever_slower_up_to_eulers_load_and_not_beyond() -> None:
    """Of one pinned at both ends omega^2 = omega0^2 (1 - P/Pe)."""
    euler, net = np.pi**2 * RIGIDITY / LENGTH**2, beam(Support(across=True), pin=True)
    for share in (-2.0, 0.5, 0.9, 0.999):
        found = frequencies(under(share * euler, net), WHOLE, 1).free[-1, 0]
        assert found == pytest.approx(np.pi**2 * UNIT * np.sqrt(1 - share), rel=1e-6)


def test_what_nothing_holds_has_a_frequency_of_zero_while_the_drive_is_free() -> None:
    slides = {"root": Node(0, 0, slider_support(np.pi / 2)), "tip": Node(LENGTH, 0, slider_support(np.pi / 2))}
    section = Section(MODULUS, WIDTH, THICKNESS, axial=True)
    net = Network(slides, {"x": Beam("root", "tip", section)})
    found = frequencies(functional_path(net, Displacement("root", np.pi / 2, np.array([1e-3])), 8), WHOLE, 3)
    held = roots(lambda x: np.sin(x) + np.cos(x) * np.tanh(x), 3)
    assert found.held[-1] == pytest.approx(UNIT * held**2, rel=1e-6)
    assert found.free[-1, 0] == 0.0
    assert found.free[-1, 1:] == pytest.approx(UNIT * np.array([np.pi, 2 * np.pi]) ** 2, rel=1e-6)


def test_becks_column_flutters_at_its_load() -> None:
    loads = np.array([10.0, 20.0505, 20.0515]) * RIGIDITY / LENGTH**2
    path = functional_path(beam(), Loading((PointLoad("tip", fx=-1.0, follows=True),), loads), 12)
    found = frequencies(path, WHOLE, 2)
    assert found.flutters.tolist() == [False, False, True]
    assert not found.diverges.any()
    assert np.isnan(found.free[2]).all()


def test_a_network_of_a_higher_degree_is_the_same_network() -> None:
    net = beam_networks.network(5)
    path = functional_path(net, beam_networks.drives(net, 5)[0], 14)
    fine = raise_degree(path.mesh, 18)
    z = embed(path.mesh, fine, path.at.z)
    from cfmkit.elastica.mechanics import energy

    for state, drive in zip(z, path.at.drive, strict=True):
        residual = energy.gradient(fine, state, drive)
        assert np.abs(residual[fine.free]).max() < 1e-4 * np.abs(residual).max()
    assert energy.gradient(fine, z[1], path.at.drive[1]) @ fine.rate == pytest.approx(
        path.residual[1] @ path.mesh.rate, rel=1e-5
    )


def test_masses_must_be_known() -> None:
    path = under(1e-9, beam())
    with pytest.raises(InputError, match="no density is given for the beams x"):
        frequencies(path, NetworkMasses({}), 1)
    with pytest.raises(InputError, match="'there', which is not a node"):
        frequencies(path, NetworkMasses({"x": 1.0}, {"there": (1.0, 0.0)}), 1)
    with pytest.raises(InputError, match="at least one frequency"):
        frequencies(path, WHOLE, 0)


def test_a_stubby_beam_has_the_frequencies_of_timoshenko() -> None:
    """Shear and the inertia of sections, as the boundary-value problem has them; slenderness 20."""
    length = 20 * THICKNESS
    section = Section(MODULUS, WIDTH, THICKNESS, axial=True, shear=True)
    net = Network({"root": Node(0, 0, CLAMPED_SUPPORT), "tip": Node(length, 0)}, {"x": Beam("root", "tip", section)})
    found = frequencies(functional_path(net, Loading((PointLoad("tip", fx=1.0),), np.array([1e-9])), 8), WHOLE, 3)
    area, second = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12
    slip = 5 / 6 * MODULUS / 2.6 * area

    def missed(omega: float) -> float:
        slopes = np.array(
            [
                [0.0, 1.0, 0.0, 1.0 / slip],
                [0.0, 0.0, 1.0 / (MODULUS * second), 0.0],
                [0.0, -DENSITY * second * omega**2, 0.0, -1.0],
                [-DENSITY * area * omega**2, 0.0, 0.0, 0.0],
            ]
        )
        return float(np.linalg.det(expm(slopes * length)[2:, 2:]))

    for value in 2 * np.pi * found.free[-1]:
        assert missed(value * (1 - 1e-6)) * missed(value * (1 + 1e-6)) < 0


def test_a_coil_of_many_turns_has_the_frequencies_of_seven_beams() -> None:
    """The engine before this one had others for a coil of one beam, 1 % too high, and those of 7 beams are right."""
    turns, pieces, section = 5.25, 7, Section(2e9, 1e-2, 1e-4)
    sweep, drive = 2 * np.pi * turns, Rotation("b", np.array([0.5]))
    angles = sweep * (np.arange(pieces + 1) / pieces - 0.5)
    radius = 0.05 / np.sin(sweep / 2)
    places = radius * np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    names = ["a", *(f"m{k}" for k in range(1, pieces)), "b"]
    nodes = {
        name: Node(*place, CLAMPED_SUPPORT if name == "a" else FREE_SUPPORT)
        for name, place in zip(names, (places - places[0]).tolist(), strict=True)
    }
    beams = {f"x{k}": Beam(names[k], names[k + 1], section, arc(sweep / pieces)) for k in range(pieces)}
    chain = trace(Network(nodes, beams), drive, Control(tolerance=1e-9))
    known = frequencies(chain, NetworkMasses(dict.fromkeys(beams, DENSITY)), 3, [len(chain) - 1])
    ends = {"a": Node(0.0, 0.0, CLAMPED_SUPPORT), "b": Node(0.1, 0.0)}
    coil = functional_path(Network(ends, {"x": Beam("a", "b", section, arc(sweep))}), drive, 10)
    found = frequencies(coil, WHOLE, 3)
    assert found.held[0] == pytest.approx(known.held[0], rel=1e-6)
    assert found.free[0] == pytest.approx(known.free[0], rel=1e-6)
