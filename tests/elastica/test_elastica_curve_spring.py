"""A spring with a curve of forces: an energy term beside those of the engine."""

from __future__ import annotations

import numpy as np
import pytest
from functional_paths import functional_path

import cfmkit.elastica as el
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.curve_spring import CurveSpring
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.equations import NumpyEquations
from cfmkit.elastica.mechanics.march import equations
from cfmkit.errors import InputError

STRIP = el.Section(2e9, 1e-2, 1e-3)
CURVE = CurveSpring("tip", np.pi / 2, (-5e-3, 0.0, 5e-3, 1e-2, 2e-2), (-2.0, 0.0, 1.0, 1.1, 6.0))


def leaf(*springs: object, arm: bool = False) -> el.Network:
    """Return a guided leaf; with an arm the spring acts at the arm's end."""
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(0.1, 0, el.slider_support(np.pi / 2)),
        "tip": el.Node(0.11 if arm else 0.1, 0),
    }
    return el.Network(nodes, {"x": el.Beam("a", "b", STRIP)}, (el.Link("b", "tip"),), springs)  # type: ignore[arg-type]


def test_the_force_of_the_spring_adds_to_that_of_the_leaf() -> None:
    """Node and spring move alike: the efforts differ by the curve, on it and beyond its end."""
    drive = el.Displacement("b", np.pi / 2, np.array([2e-3, 7e-3, 1.5e-2, 2.2e-2]))
    bare, sprung = functional_path(leaf(), drive, 10), functional_path(leaf(CURVE), drive, 10)
    forces = [CURVE.evaluate(u)[1] for u in drive.points]
    assert sprung.effort - bare.effort == pytest.approx(forces, rel=1e-9)
    energies = [CURVE.evaluate(u)[0] for u in drive.points]
    assert sprung.energy - bare.energy == pytest.approx(energies, rel=1e-7)


def test_a_straight_curve_is_a_linear_spring() -> None:
    straight = CurveSpring("tip", 0.3, (-1e-2, 0.0, 1e-2), (-0.8, 0.0, 0.8))
    load = el.Loading((el.PointLoad("b", fy=1.0),), np.array([0.5]))
    linear = functional_path(leaf(el.SlideSpring("tip", 0.3, 80.0), arm=True), load, 10)
    curved = functional_path(leaf(straight, arm=True), load, 10)
    assert curved.motion("tip") == pytest.approx(linear.motion("tip"), rel=1e-9, abs=1e-13)
    assert isinstance(equations(linear.mesh), NumpyEquations)
    assert type(equations(curved.mesh)) is NumpyEquations


def test_gradient_and_hessian_are_the_derivatives_of_the_energy() -> None:
    network = discretise(leaf(CURVE, arm=True), el.Loading((el.PointLoad("b", fy=1.0),), np.array([0.5])), 4)
    (spring,) = network.springs
    from cfmkit.elastica.mechanics.terms import ENERGY_TERMS

    for seed in range(6):
        z = 0.1 * np.random.default_rng(seed).standard_normal(network.size)
        term = ENERGY_TERMS[CurveSpring](network, spring, z, 1.0, 0.0)
        for k, unknown in enumerate(term.unknowns):
            stepped = z + 1e-30j * np.eye(network.size)[unknown]
            moved = ENERGY_TERMS[CurveSpring](network, spring, stepped, 1.0, 0.0)
            assert moved.energy.imag / 1e-30 == pytest.approx(term.gradient[k], rel=1e-10, abs=1e-12)
            assert moved.gradient.imag / 1e-30 == pytest.approx(term.hessian[:, k], rel=1e-10, abs=1e-10)
        tangent = energy.hessian(network, z, 0.3)
        assert tangent == pytest.approx(tangent.T, abs=1e-9)


@pytest.mark.parametrize("shift", [-3e-2, 0.0, 3e-2])
def test_the_energy_of_the_spring_is_the_work_from_no_displacement_on(shift: float) -> None:
    """Its curve may be measured on one side of it alone."""
    spring = CurveSpring("tip", 0.0, tuple(shift + u for u in CURVE.displacement), CURVE.force)
    assert spring.evaluate(0.0)[0] == pytest.approx(0.0, abs=1e-18)
    nodes, weights = np.polynomial.legendre.leggauss(4)  # exact for cubics
    for end in (-4e-2, -3e-2, 2e-2, 4.5e-2):
        places = np.unique([0.0, end, *(u for u in spring.displacement if min(0.0, end) < u < max(0.0, end))])
        half, middle = 0.5 * np.diff(places), 0.5 * (places[1:] + places[:-1])
        forces = [[spring.evaluate(u)[1] for u in m + h * nodes] for h, m in zip(half, middle, strict=True)]
        work = np.sign(end) * half @ np.array(forces) @ weights
        assert spring.evaluate(end)[0] == pytest.approx(work, rel=1e-10, abs=1e-15)


@pytest.mark.parametrize(("displacement", "force"), [((0.0, 1.0), (1.0,)), ((0.0,), (1.0,)), ((0.0, 0.0), (0.0, 1.0))])
def test_a_curve_must_increase_and_be_whole(displacement: tuple[float, ...], force: tuple[float, ...]) -> None:
    with pytest.raises(InputError):
        CurveSpring("tip", 0.0, displacement, force)
