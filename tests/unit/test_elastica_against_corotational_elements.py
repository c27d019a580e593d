"""The engine against an independent discretisation: Lan's network and a V-beam.

The other program: straight two-node elements, corotational and linear inside, their energy's gradient by hand and its
derivative by complex steps. Curved beams become polygons with rigid joints: second order in the element length, which
two meshes and Richardson's extrapolation take out. It shares no code with the engine but the fit of the shapes, and
follows its own way from the unloaded pose. `corotational` in tests/support cannot stand in for it: it begins
at the engine's pose and takes supports, links and the drive from the engine's layout.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from corotational import recheck
from lan_2010 import half

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    Beam,
    Control,
    Displacement,
    Network,
    Node,
    Polynomial,
    Section,
    slider_support,
    trace,
)
from cfmkit.elastica.model.beam_fits import BeamFits


@dataclass
class Polygon:
    """Nodes (x, y), elements (i, j), stiffnesses of the elements, held degrees of freedom (3 per node)."""

    nodes: np.ndarray
    elements: np.ndarray
    axial: float
    bending: float
    held: np.ndarray


def _element_forces(model: Polygon, u: np.ndarray) -> np.ndarray:
    """Return the gradient of each element's energy by its six degrees of freedom, (elements, 6), for u like it."""
    i, j = model.elements.T
    reach = model.nodes[j] - model.nodes[i]
    length = np.hypot(*reach.T)
    moved = reach + (u[:, 3:5] - u[:, :2])
    now = np.sqrt(moved[:, 0] ** 2 + moved[:, 1] ** 2)
    c, s = moved[:, 0] / now, moved[:, 1] / now
    c0, s0 = reach[:, 0] / length, reach[:, 1] / length
    # half the chord's turn by its tangent, which holds up to a whole turn either way
    chord = 2 * np.arctan((s * c0 - c * s0) / (1 + c * c0 + s * s0))
    a, b = u[:, 2] - chord, u[:, 5] - chord
    normal = model.axial * (now - length) / length
    k = model.bending / length
    ma, mb = k * (4 * a + 2 * b), k * (2 * a + 4 * b)
    shear = (ma + mb) / now
    fx, fy = normal * c + shear * s, normal * s - shear * c
    return np.stack([-fx, -fy, ma, fx, fy, mb], axis=1)


def _system(model: Polygon, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the energy's gradient and its derivative, the latter by complex steps of all elements at once."""
    dofs = (3 * model.elements[:, :, None] + np.arange(3)).reshape(-1, 6)
    local = u.ravel()[dofs]
    gradient, hessian = np.zeros(u.size), np.zeros((u.size, u.size))
    np.add.at(gradient, dofs, _element_forces(model, local))
    for k in range(6):
        tilted = local.astype(complex)
        tilted[:, k] += 1e-30j
        np.add.at(hessian, (dofs, dofs[:, k : k + 1]), _element_forces(model, tilted).imag / 1e-30)
    return gradient, hessian


def solve(model: Polygon, dof: int, values: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """Return the force on a degree of freedom that is moved through values."""
    u = np.zeros((len(model.nodes), 3)) if start is None else start.copy()
    free = np.setdiff1d(np.arange(u.size), np.append(model.held, dof))
    forces = []
    for value in values:
        u.ravel()[dof] = value
        for _ in range(60):
            gradient, hessian = _system(model, u)
            step = np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
            u.ravel()[free] -= step * min(1.0, 0.3 / max(np.abs(step).max(), 1e-300))
            if np.abs(step).max() < 1e-11:
                break
        else:
            raise AssertionError(f"the peer did not converge at {value}")
        forces.append(_system(model, u)[0][dof])
    return np.array(forces)


E, WIDTH, THICK = 2e9, 1e-2, 1e-3


def _polygon(network: Network, drive: Displacement, per_beam: int) -> tuple[Polygon, float]:
    """Return the polygon of a network, in units of 10 mm and of the bending rigidity, and its driven node."""
    fits = BeamFits(network)
    section = Section(E, WIDTH, THICK)
    rigidity = float(section.rigidities(np.array([0.5]), 0.5)[0][0])
    unit = 1e-2
    names = list(network.nodes)
    nodes = [[network.nodes[n].x / unit, network.nodes[n].y / unit] for n in names]
    elements = []
    fine = np.linspace(0, 1, 20001)
    for name, beam in network.beams.items():
        fitted = fits[name]
        angle = fitted.angle(fine, 0.5)
        step = np.diff(fine) * fitted.length / unit
        middle = 0.5 * (angle[1:] + angle[:-1])
        x = np.concatenate([[0], np.cumsum(np.cos(middle) * step)]) + nodes[names.index(beam.start)][0]
        y = np.concatenate([[0], np.cumsum(np.sin(middle) * step)]) + nodes[names.index(beam.start)][1]
        inner = np.linspace(0, 20000, per_beam + 1).astype(int)[1:-1]
        chain = [names.index(beam.start), *range(len(nodes), len(nodes) + len(inner)), names.index(beam.end)]
        nodes += [[x[k], y[k]] for k in inner]
        elements += list(pairwise(chain))
    held = []
    for k, n in enumerate(names):
        support = network.nodes[n].support
        if support == CLAMPED_SUPPORT:
            held += [3 * k, 3 * k + 1, 3 * k + 2]
        elif support.across:
            held += [3 * k, 3 * k + 2]
    axial = 12 * (unit / THICK) ** 2
    return Polygon(np.array(nodes), np.array(elements), axial, 1.0, np.array(held)), rigidity / unit**2


def _compare(network: Network, drive: Displacement, per_beam: int, values: np.ndarray) -> np.ndarray:
    dof = 3 * list(network.nodes).index(drive.node) + 1
    results = []
    for count in (per_beam, 2 * per_beam):
        model, force = _polygon(network, drive, count)
        results.append(-force * solve(model, dof, -values / 1e-2))
    return (4 * results[1] - results[0]) / 3


def test_lan_s_network_agrees_with_corotational_elements() -> None:
    network = half(Section(E, WIDTH, THICK))
    travel = np.arange(1, 14) * 1e-3
    drive = Displacement("n5", -np.pi / 2, travel)
    force = trace(network, drive, Control(tolerance=1e-9)).effort
    other = _compare(network, drive, 10, travel)
    np.testing.assert_allclose(force[-13:], other, atol=1e-4 * np.abs(force).max())


def test_a_v_beam_on_its_stable_branch_agrees_with_corotational_elements() -> None:
    length, angle = 35e-3, np.radians(7)
    nodes = {
        "wall": Node(0, 0, CLAMPED_SUPPORT),
        "d": Node(length * np.cos(angle), length * np.sin(angle), slider_support(np.pi / 2)),
    }
    # a slightly bent beam has no bifurcation: both programs follow the same branch
    network = Network(nodes, {"v": Beam("wall", "d", Section(E, WIDTH, THICK), Polynomial((0.0, 0.02, 0.0)))})
    travel = np.arange(1, 21) * 0.25e-3
    drive = Displacement("d", -np.pi / 2, travel)
    path = trace(network, drive, Control(tolerance=1e-9))
    assert path.stable.all()
    force = path.effort[path.at_requested]
    other = _compare(network, drive, 20, travel)
    np.testing.assert_allclose(force, other, atol=2e-4 * np.abs(force).max())


def test_a_perfect_v_beam_on_its_bifurcated_branch_agrees_with_corotational_elements() -> None:
    """Forces and stability there, and on the symmetric branch that is left."""
    length, angle = 35e-3, np.radians(7)
    nodes = {
        "wall": Node(0, 0, CLAMPED_SUPPORT),
        "d": Node(length * np.cos(angle), length * np.sin(angle), slider_support(np.pi / 2)),
    }
    network = Network(nodes, {"v": Beam("wall", "d", Section(1477e6, 6e-3, THICK))})
    drive = Displacement("d", -np.pi / 2, np.array([0.5e-3, 2e-3, 3e-3, 4e-3, 6e-3]))
    stable = trace(network, drive, Control(tolerance=1e-9))
    symmetric = trace(network, drive, Control(tolerance=1e-9, branch="primary"))
    found, other = recheck(stable, elements=60), recheck(symmetric, elements=60)
    force = stable.effort[stable.at_requested]
    np.testing.assert_allclose(found.effort, force, atol=3e-5 * np.abs(force).max())
    np.testing.assert_allclose(other.effort, symmetric.effort[symmetric.at_requested], atol=3e-5 * np.abs(force).max())
    assert found.stable.all()
    assert other.stable.tolist() == [True, False, False, False, True]
