"""Natural frequencies about the equilibria of a path, and flutter.

Closed forms: straight beams with their usual ends and end masses, R. D. Blevins, Formulas for Natural Frequency and
Mode Shape (1979), ch. 8; the column that swings ever slower up to Euler's load; Beck's column (1952).
"""

from __future__ import annotations

from typing import Any

import beam_networks
import numpy as np
import pytest
from functional_paths import functional_path
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import cfmkit.elastica as el
from cfmkit.elastica.vibration import NetworkMasses, frequencies
from cfmkit.errors import InputError

MODULUS, WIDTH, THICKNESS, LENGTH, DENSITY = 200e9, 10e-3, 1e-3, 0.1, 7850.0
RIGIDITY = MODULUS * WIDTH * THICKNESS**3 / 12
PER_LENGTH = DENSITY * WIDTH * THICKNESS
UNIT = np.sqrt(RIGIDITY / (PER_LENGTH * LENGTH**4)) / (2 * np.pi)  # [Hz]: of a beam it counts as beta^2 with beta L
TINY = np.array([1e-9])
WHOLE = NetworkMasses({"x": DENSITY})


def beam(end: el.Support = el.FREE_SUPPORT, axial: bool = False, shear: bool = False, pin: bool = False) -> el.Network:
    """Return a straight beam along x from a clamp, or from a pin, to its end."""
    section = el.Section(MODULUS, WIDTH, THICKNESS, axial=axial, shear=shear)
    start = el.PINNED_SUPPORT if pin else el.CLAMPED_SUPPORT
    return el.Network(
        {"root": el.Node(0, 0, start), "tip": el.Node(LENGTH, 0, end)}, {"x": el.Beam("root", "tip", section)}
    )


def under(force: float, net: el.Network, **load: Any) -> el.Path:
    return el.trace(net, el.Loading((el.PointLoad("tip", fx=-1.0, **load),), np.array([force])))


def roots(equation: Any, count: int) -> np.ndarray:
    """Return the first roots of an equation, above zero."""
    places = np.linspace(0.05, 30.0, 4000)
    values = np.array([equation(x) for x in places])
    found = [
        brentq(equation, places[k], places[k + 1], xtol=1e-13) for k in np.flatnonzero(values[1:] * values[:-1] < 0)
    ]
    return np.array(found[:count])


def end_that_slides(rotation: bool = False) -> el.Support:
    return el.Support(across=True, rotation=rotation)


MASS_RATIO = 0.7  # of the mass at the tip to that of the beam
TIP_MASS = NetworkMasses({"x": DENSITY}, {"tip": (MASS_RATIO * PER_LENGTH * LENGTH, 0.0)})
CLOSED_FORMS = {
    "cantilever": (beam(), WHOLE, lambda x: np.cos(x) + 1 / np.cosh(x)),
    "cantilever that stretches": (beam(axial=True), WHOLE, lambda x: np.cos(x) + 1 / np.cosh(x)),
    "mass at its tip": (beam(), TIP_MASS, lambda x: (
        1 / np.cosh(x) + np.cos(x) + MASS_RATIO * x * (np.cos(x) * np.tanh(x) - np.sin(x)))),
    "clamped": (beam(end_that_slides(rotation=True)), WHOLE, lambda x: np.cos(x) - 1 / np.cosh(x)),
    "clamped and pinned": (beam(end_that_slides()), WHOLE, lambda x: np.sin(x) - np.cos(x) * np.tanh(x)),
    "pinned": (beam(end_that_slides(), pin=True), WHOLE, np.sin),
}  # fmt: skip


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_a_straight_beam_has_the_frequencies_of_the_closed_form(name: str) -> None:
    """The drive is a pull so small that it does not stiffen the beam."""
    net, masses, equation = CLOSED_FORMS[name]
    assert frequencies(under(-1e-9, net), masses, 6).free[-1] == pytest.approx(UNIT * roots(equation, 6) ** 2, rel=1e-7)


def test_a_flywheel_on_a_light_beam_turns_and_swings_as_two_masses_do() -> None:
    """The beam weighs next to nothing: two frequencies of its end's stiffness (12, -6; -6, 4) EI/L^n."""
    mass, inertia = 0.5, 2e-3
    stiffness = RIGIDITY * np.array([[12 / LENGTH**3, -6 / LENGTH**2], [-6 / LENGTH**2, 4 / LENGTH]])
    squares = np.linalg.eigvals(stiffness / np.array([[mass], [inertia]]))
    found = frequencies(under(1e-9, beam()), NetworkMasses({"x": 1e-3}, {"tip": (mass, inertia)}), 2).free[-1]
    assert found == pytest.approx(np.sqrt(np.sort(squares)) / (2 * np.pi), rel=1e-6)


def test_a_rod_swings_along_itself_where_it_stretches() -> None:
    """So short that its first axial mode, sqrt(E/rho)/(4 L), lies below its third bending mode."""
    found = frequencies(under(1e-9, beam(el.Support(across=True, rotation=True), axial=True)), WHOLE, 12).free[-1]
    wanted = np.sqrt(MODULUS / DENSITY) / (4 * LENGTH)
    assert np.abs(found / wanted - 1).min() < 1e-7


def test_a_stubby_beam_has_the_frequencies_of_timoshenko() -> None:
    """Shear and the inertia of sections, as the boundary-value problem has them; slenderness 20."""
    length = 20 * THICKNESS
    section = el.Section(MODULUS, WIDTH, THICKNESS, axial=True, shear=True)
    net = el.Network(
        {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(length, 0)}, {"x": el.Beam("root", "tip", section)}
    )
    path = el.trace(net, el.Loading((el.PointLoad("tip", fx=1.0),), TINY))
    found = frequencies(path, WHOLE, 3).free[-1]
    area, second = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12
    slip = 5 / 6 * MODULUS / 2.6 * area

    def missed(omega: float) -> float:
        def slopes(_: float, state: Any) -> Any:
            y, turn, moment, shear = state.reshape(4, -1)
            bent = moment / (MODULUS * second)
            return np.concatenate(
                [
                    turn + shear / slip,
                    bent,
                    -shear - DENSITY * second * omega**2 * turn,
                    -DENSITY * area * omega**2 * y,
                ]
            )

        start = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0 / length]]).ravel()
        end = solve_ivp(slopes, (0.0, length), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1].reshape(4, 2)
        return float(np.linalg.det(end[2:]))

    for value in 2 * np.pi * found:
        assert missed(value * (1 - 1e-6)) * missed(value * (1 + 1e-6)) < 0


def test_a_column_swings_ever_slower_up_to_eulers_load() -> None:
    """Of one pinned at both ends omega^2 = omega0^2 (1 - P/Pe), exactly."""
    euler = np.pi**2 * RIGIDITY / LENGTH**2
    shares = np.array([-2.0, 0.5, 0.9, 0.999])
    path = el.trace(
        beam(el.Support(across=True), pin=True),
        el.Loading((el.PointLoad("tip", fx=-1.0),), shares[1:] * euler),
        el.Control(branch="primary"),
    )
    found = frequencies(path, WHOLE, 1).free[path.at_requested, 0]
    first = np.pi**2 * UNIT
    assert found == pytest.approx(first * np.sqrt(1 - shares[1:]), rel=1e-6)
    pulled = under(shares[0] * euler, beam(el.Support(across=True), pin=True))
    assert frequencies(pulled, WHOLE, 1).free[-1, 0] == pytest.approx(first * np.sqrt(3), rel=1e-6)


def test_no_frequency_is_told_of_a_column_beyond_eulers_load() -> None:
    euler = np.pi**2 * RIGIDITY / LENGTH**2
    drive = el.Loading((el.PointLoad("tip", fx=-1.0),), np.array([0.9, 1.1]) * euler)
    path = el.trace(beam(el.Support(across=True), pin=True), drive, el.Control(branch="primary"))
    found = frequencies(path, WHOLE, 2)
    assert (np.isfinite(found.free).all(axis=1) == path.stable).all()
    assert not path.stable[-1]


def test_what_nothing_holds_has_a_frequency_of_zero_while_the_drive_is_free() -> None:
    """A beam between two slides, moved as one: held it is clamped at both ends; free it is rigid at first."""
    slides = {
        "root": el.Node(0, 0, el.slider_support(np.pi / 2)),
        "tip": el.Node(LENGTH, 0, el.slider_support(np.pi / 2)),
    }
    section = el.Section(MODULUS, WIDTH, THICKNESS, axial=True)
    path = el.trace(
        el.Network(slides, {"x": el.Beam("root", "tip", section)}), el.Displacement("root", np.pi / 2, np.array([1e-3]))
    )
    found = frequencies(path, WHOLE, 3)
    held = roots(lambda x: np.sin(x) + np.cos(x) * np.tanh(x), 3)
    free = np.array([0.0, np.pi, 2 * np.pi])
    assert found.held[-1] == pytest.approx(UNIT * held**2, rel=1e-6)
    assert found.free[-1] == pytest.approx(UNIT * free**2, rel=1e-6)


@pytest.mark.parametrize(
    ("drive", "load", "direction"),
    [
        (el.Displacement("tip", np.pi / 2, np.array([0.03])), el.PointLoad("tip", fy=1.0), np.pi / 2),
        (el.Rotation("tip", np.array([0.5])), el.PointLoad("tip", moment=1.0), None),
    ],
    ids=["displacement", "rotation"],
)
def test_held_is_the_drive_that_does_not_move_and_free_is_the_load_that_it_left(
    drive: Any, load: el.PointLoad, direction: float | None
) -> None:
    """A cantilever bent by a motion, and by the force that it takes: the same frequencies, named the same."""
    bent = el.trace(beam(), drive)
    pushed = el.trace(beam(), el.Loading((load,), bent.effort[-1:]))
    moved = frequencies(bent, WHOLE, 3, points=[len(bent) - 1])
    loaded = frequencies(pushed, WHOLE, 3, points=[len(pushed) - 1], hold=("tip", direction))
    assert moved.free == pytest.approx(loaded.free, rel=1e-6)
    assert moved.held == pytest.approx(loaded.held, rel=1e-6)


def test_a_curved_thin_arch_keeps_its_frequencies_when_it_is_cut_in_three() -> None:
    """More unknowns, other panels: the same frequencies to 1e-6, in a bent pose."""

    def arch(pieces: int) -> el.Path:
        angles = np.linspace(0.0, 1.2, pieces + 1)
        places = LENGTH * np.stack([np.sin(angles), 1 - np.cos(angles)], axis=1)
        nodes = {
            f"n{k}": el.Node(*place, el.CLAMPED_SUPPORT if k == 0 else el.Support())
            for k, place in enumerate(places.tolist())
        }
        section = el.Section(MODULUS, WIDTH, 0.1 * THICKNESS)
        beams = {f"b{k}": el.Beam(f"n{k}", f"n{k + 1}", section, el.arc(1.2 / pieces)) for k in range(pieces)}
        force = el.PointLoad(f"n{pieces}", fy=2e-3 * RIGIDITY / LENGTH**2)
        return el.trace(el.Network(nodes, beams), el.Loading((force,), np.array([1.0])))

    whole, cut = arch(1), arch(3)
    one = frequencies(whole, NetworkMasses({"b0": DENSITY}), 5, [len(whole) - 1]).free[0]
    other = frequencies(cut, NetworkMasses(dict.fromkeys(("b0", "b1", "b2"), DENSITY)), 5, [len(cut) - 1]).free[0]
    assert one == pytest.approx(other, rel=1e-6)


def test_a_spring_and_a_mass_swing_as_they_should() -> None:
    """A beam without weight to speak of, whose end a spring of ten times its stiffness holds."""
    stiffness = 3 * RIGIDITY / LENGTH**3
    net = beam()
    sprung = el.Network(net.nodes, net.beams, springs=(el.SlideSpring("tip", np.pi / 2, 10 * stiffness),))
    found = frequencies(under(1e-9, sprung), NetworkMasses({"x": 1e-3}, {"tip": (1.0, 0.0)}), 1).free[-1, 0]
    assert found == pytest.approx(np.sqrt(11 * stiffness) / (2 * np.pi), rel=1e-6)


def test_becks_column_flutters_at_its_load() -> None:
    """20.05095 EI/L^2 under a force that turns with the tip: two frequencies meet; it never diverges."""
    loads = np.array([10.0, 20.0, 20.0505, 20.0515, 25.0]) * RIGIDITY / LENGTH**2
    path = el.trace(beam(), el.Loading((el.PointLoad("tip", fx=-1.0, follows=True),), loads))
    assert path.stable.all()
    found = frequencies(path, WHOLE, 2, points=path.at_requested)
    assert found.flutters.tolist() == [False, False, False, True, True]
    assert np.isnan(found.free[3:]).all()
    assert np.isfinite(found.free[:3]).all()
    assert found.free[2, 1] / found.free[2, 0] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("share", [0.2, 0.45])
def test_a_column_under_a_load_that_turns_in_part_diverges_where_bolotin_says(share: float) -> None:
    """A share stays tangential: divergence at cos(q L) = -share/(1 - share), with q^2 = P/EI; none beyond a half."""
    critical = np.arccos(-share / (1 - share)) ** 2 * RIGIDITY / LENGTH**2
    loads = (el.PointLoad("tip", fx=-share, follows=True), el.PointLoad("tip", fx=share - 1.0))
    drive = el.Loading(loads, np.array([0.5, 0.999, 1.001, 1.05]) * critical)
    path = el.trace(beam(), drive, el.Control(branch="primary"))
    found = frequencies(path, WHOLE, 2, points=path.at_requested)
    assert found.diverges.tolist() == [False, False, True, True]
    assert not found.flutters.any()
    assert np.isnan(found.free[2:]).all()
    assert found.free[1, 0] < 0.1 * found.free[0, 0]


@pytest.mark.parametrize("slenderness", [1000, 10000])
def test_a_strip_pulled_taut_swings_as_a_stiff_string(slenderness: float) -> None:
    """n/2l sqrt(T/m) (1 + 2 e + (4 + n^2 pi^2/2) e^2) with e = sqrt(EI/T)/l, of its stretched length [Morse 1948]."""
    thick, strain = LENGTH / slenderness, 1e-3
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(LENGTH, 0, el.slider_support(0.0))}
    net = el.Network(nodes, {"x": el.Beam("root", "tip", el.Section(MODULUS, WIDTH, thick))})
    path = el.trace(net, el.Displacement("tip", 0.0, np.array([strain * LENGTH])))
    found = frequencies(path, WHOLE, 3, [len(path) - 1]).held[0]
    length, pull = LENGTH * (1 + strain), float(path.effort[-1])
    mass = DENSITY * WIDTH * thick / (1 + strain)
    e, n = np.sqrt(MODULUS * WIDTH * thick**3 / 12 / pull) / length, np.arange(1, 4)
    wanted = n / (2 * length) * np.sqrt(pull / mass) * (1 + 2 * e + (4 + n**2 * np.pi**2 / 2) * e**2)
    # what the series leaves out is of third order, some n^2 pi^2 times e^3; the stretch of the section adds 1e-6
    assert found == pytest.approx(wanted, rel=200 * e**3 + 2e-6)


def test_masses_must_be_known_and_positive() -> None:
    path = under(1e-9, beam())
    with pytest.raises(InputError, match="no density is given for the beams x"):
        frequencies(path, NetworkMasses({}), 1)
    with pytest.raises(InputError, match="'there', which is not a node"):
        frequencies(path, NetworkMasses({"x": 1.0}, {"there": (1.0, 0.0)}), 1)
    with pytest.raises(InputError, match="must be positive"):
        NetworkMasses({"x": 0.0})
    with pytest.raises(InputError, match="must not be negative"):
        NetworkMasses({"x": 1.0}, {"tip": (-1.0, 0.0)})
    with pytest.raises(InputError, match="at least one frequency"):
        frequencies(path, WHOLE, 0)


def test_what_would_take_too_many_unknowns_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cfmkit.elastica.vibration.MAX_UNKNOWNS", 20)
    with pytest.raises(InputError, match="unknowns, more than 20: the beams have too many windings or too much"):
        frequencies(under(1e-9, beam()), WHOLE, 3)


@pytest.mark.parametrize(("seed", "number"), [(4, 0), (4, 1), (4, 2), (8, 3)])
def test_frequencies_of_networks_with_every_feature_do_not_depend_on_the_degree(seed: int, number: int) -> None:
    """Loads that follow among them: held, free, and whether they flutter."""
    net = beam_networks.network(seed)
    drive = beam_networks.drives(net, seed)[number]
    masses = NetworkMasses(dict.fromkeys(net.beams, 1000.0), {"b": (1e-3, 1e-7), "bb": (5e-4, 0.0)})
    old = el.trace(net, drive, el.Control(tolerance=1e-9))
    known = frequencies(old, masses, 4, [len(old) - 1])
    found = frequencies(functional_path(net, drive, 14), masses, 4, [1])
    assert found.free[0] == pytest.approx(known.free[0], rel=1e-6, nan_ok=True)
    assert found.held[0] == pytest.approx(known.held[0], rel=1e-6, nan_ok=True)
    assert (found.flutters[0], found.diverges[0]) == (known.flutters[0], known.diverges[0])
