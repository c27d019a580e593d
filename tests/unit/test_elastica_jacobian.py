"""The assembled Jacobian of a network at random states, in equilibrium or not, against differences of high order.

A state is given by the poses of the nodes and the forces at the beams' first ends; from there everything is integrated,
so that the residuals are plain functions of it. The Jacobian counts the forces at the beams' last ends instead: its
columns are multiplied with how these follow.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from beam_networks import drives, network

from cfmkit.elastica.equilibrium.mesh import LOADS, PRESTRESS, Mesh
from cfmkit.elastica.equilibrium.network_solver import Solver
from cfmkit.elastica.kernels import compiled
from cfmkit.elastica.model.network_under_drive import Layout

WEIGHTS = np.array([1, -8, 8, -1]) / 12.0
STEPS = np.array([-2, -1, 1, 2])


def poses(solver: Solver, free: np.ndarray, drive: float) -> np.ndarray:
    """Return x, y and rotation of the beams' first ends, dimensionless."""
    m = solver.model
    values = m.base + drive * m.rate
    values[m.slot >= 0] = free[m.slot[m.slot >= 0]]
    places = m.beam_end[:, 0]
    a, b, arm, turn = values[m.place_dof[places]].T
    (c, s), (ox, oy) = m.place_frame[places].T, m.place_arm[places].T
    x = m.place_origin[places, 0] + c * a - s * b + np.cos(arm) * ox - np.sin(arm) * oy
    y = m.place_origin[places, 1] + s * a + c * b + np.sin(arm) * ox + np.cos(arm) * oy
    return np.stack([x, y, turn], axis=1)


def unfolded(solver: Solver, free: np.ndarray, first: np.ndarray, drive: float) -> np.ndarray:
    """Return the engine's unknowns for the poses of nodes, the forces at first ends (h, v, m) and the drive."""
    m, y = solver.model, np.zeros(solver.size)
    y[: solver.n_free] = free
    parts, last = y[solver.n :].reshape(-1, 6), y[solver.n_free : solver.n].reshape(-1, 3)
    parts[m.beam_segment[:-1], :3], parts[m.beam_segment[:-1], 3:] = poses(solver, free, drive), first
    for _ in range(int(np.diff(m.beam_segment).max())):
        states = np.empty((1, len(solver.cut.edges) + solver.n_segments, 7))
        compiled.states(m, solver.n_free, y[None], np.array([drive]), states)
        ends = states[0, m.segment_step[1:] + np.arange(solver.n_segments)][:, [0, 1, 2, 4, 5, 3]]
        inner = np.setdiff1d(np.arange(solver.n_segments), m.beam_segment[:-1])
        parts[inner] = ends[inner - 1]
    last[:] = ends[m.beam_segment[1:] - 1, 3:]
    return y


def residuals(solver: Solver, y: np.ndarray, drive: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the residuals in the order of the unknowns, and the Jacobian by the unknowns and the drive."""
    compiled.tangent(solver.model, solver.n_free, y.copy(), drive, solver.scratch)
    found, slot = solver.scratch[3], solver.model.slot
    own = np.empty(solver.n)
    own[slot[slot >= 0]] = found[: len(slot)][slot >= 0]
    own[solver.n_free :] = found[len(slot) :]
    return own, solver.scratch[0][: solver.n].copy()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("kind", "ramped"), [(0, ""), (1, ""), (2, ""), (3, ""), (0, PRESTRESS), (3, LOADS)])
def test_the_jacobian_at_random_states_is_the_derivative_of_the_residuals(seed: int, kind: int, ramped: str) -> None:
    """By the unknowns, and by the drive or what takes its place before it begins."""
    net = network(seed)
    solver = Solver(Layout(net, drives(net, seed)[kind]), Mesh(1, 8), ramped=ramped)
    rng = np.random.default_rng(seed)
    state = np.concatenate(
        [0.1 * rng.standard_normal(solver.n_free), rng.standard_normal(3 * solver.n_beams), [rng.uniform(0.01, 0.1)]]
    )

    def at(moved: np.ndarray) -> tuple[Any, Any, Any]:
        y = unfolded(solver, moved[: solver.n_free], moved[solver.n_free : -1].reshape(-1, 3), moved[-1])
        return *residuals(solver, y, moved[-1]), np.append(y[: solver.n], moved[-1])

    residual, jacobian, _ = at(state)
    assert np.abs(residual).max() > 0.01, "the state is meant to be out of equilibrium"
    h = 2e-3
    for column in np.eye(len(state)):
        sides = [at(state + h * step * column) for step in STEPS]
        slope, change = (
            sum(weight * side[part] for weight, side in zip(WEIGHTS, sides, strict=True)) / h for part in (0, 2)
        )
        scale = np.abs(jacobian).max(axis=1) * np.abs(change).max()
        np.testing.assert_allclose((jacobian @ change) / scale, slope / scale, atol=2e-8)


@pytest.mark.parametrize("seed", range(6))
def test_the_size_of_the_determinant_that_a_solution_brings_is_that_of_its_tangent(seed: int) -> None:
    """By Cramer's rule from the factors of the bordered system, whatever the border is."""
    net = network(seed)
    solver = Solver(Layout(net, drives(net, seed)[0]), Mesh(3, 1), 1e-12)
    start = solver.tightened()
    assert start is not None
    found = solver.solve(start.y, 0.02)
    assert found is not None
    expected = np.linalg.slogdet(solver.tangent_at(found.y, found.drive)[0])[1]
    assert found.log_size == pytest.approx(expected, abs=1e-6)
    border = np.random.default_rng(seed).standard_normal(solver.n + 1)
    level = border[:-1] @ found.y[: solver.n] + border[-1] * found.drive
    other = solver.solve(found.y, found.drive, border, level)
    assert other is not None
    assert other.log_size == pytest.approx(expected, abs=1e-6)
