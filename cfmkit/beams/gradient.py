"""Exact derivatives of a path's outputs by design variables: implicit differentiation, complex steps of the geometry.

At an equilibrium R(z, x) = 0, so dz/dx = -(dR/dz)^-1 dR/dx. The tangent dR/dz is there; dR/dx comes from the network
built with one design variable moved by an imaginary step, which is exact to rounding: no step size to choose.
Design variables may change shapes, sections, materials, node positions, offsets and links, through any function that
builds the network and accepts complex numbers; not springs, loads, supports or the number of anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import read_only
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.beams.expanded import ExpandedSolver
    from cfmkit.beams.kernels.model import Model
    from cfmkit.beams.network import Network
    from cfmkit.beams.path import Path
    from cfmkit.curves import FloatArray

_STEP = 1e-30
_FIXED = ("spring_value", "load_value", "line_load", "base")


@dataclass(frozen=True)
class Gradient:
    """Derivatives at chosen points of a path by every design variable.

    Attributes
    ----------
    points : (p,) int array
        Indices of the points.
    effort : (p, k) array
        Derivatives of `Path.effort` [N or N m, per unit of the variable].
    motion : mapping
        Node -> (p, 3, k) derivatives of its displacement and rotation, for nodes that no link moves.
    """

    points: Any
    effort: FloatArray
    motion: dict[str, FloatArray]


def gradient(path: Path, build: Callable[[Any], Network], variables: Any, points: Any = None) -> Gradient:
    """Return the derivatives of a path's effort and node motions by design variables.

    Parameters
    ----------
    path : Path
        A path of ``build(variables)`` under a displacement or rotation.
    build : callable
        From the design variables (real or complex) to the network.
    variables : (k,) array
        Where to differentiate: the variables that the path was traced for.
    points : sequence of int, optional
        Points of the path; all those asked for by default.

    Raises
    ------
    cfmkit.errors.InputError
        If the drive is a load, if a force turns with its node, or if a variable changes what cannot be varied here.
    """
    from cfmkit.beams.expanded import ExpandedSolver

    layout = path.layout
    if layout.driven is None:
        raise InputError("derivatives need a displacement or a rotation as the drive")
    if any(row[3] for row in layout.load_rows):
        raise InputError("derivatives are not available where a force turns with its node")
    solver = ExpandedSolver(layout, path.solver.mesh, path.solver.tolerance)
    chosen = np.asarray(path.at_asked if points is None else points)
    states = _States.at(solver, np.array([solver.expand(y) for y in path.points.y[chosen]]), path.points.drive[chosen])
    x = np.asarray(variables, dtype=float)
    by_x = np.stack([states.residual_slope(model) for model in _tilted(solver, build, x)], axis=-1)
    slopes, force = _solved(states, by_x)
    dof, sense = layout.driven
    unit = layout.scales.moment if dof % 3 == 2 else layout.scales.force
    motion = {name: read_only(_motion(solver, name, slopes)) for name in layout.masters}
    return Gradient(read_only(chosen, np.int64), read_only(-sense * unit * force), motion)


def _tilted(solver: ExpandedSolver, build: Callable[[Any], Network], x: FloatArray) -> Iterator[Model]:
    """Yield the arrays of the network with each variable in turn moved by an imaginary step."""
    from cfmkit.beams.discretise import assemble_model, table
    from cfmkit.beams.layout import Layout

    plain = assemble_model(solver.layout, solver.cut, solver.table)
    for k in range(len(x)):
        moved = x.astype(complex)
        moved[k] += 1j * _STEP
        layout = Layout(build(moved), solver.layout.drive, solver.layout)
        values = table(layout, solver.cut, solver.table).astype(complex)
        model = assemble_model(layout, solver.cut, values)
        for name in _FIXED:
            now, was = getattr(model, name), getattr(plain, name)
            if now.shape != was.shape or np.any(np.imag(now)) or not _same(np.real(now), was):
                raise InputError(f"design variable {k} changes springs, loads or supports: no derivative by it here")
        yield model


def _same(now: Any, was: Any) -> bool:
    """Tell whether two arrays agree but for rounding."""
    return bool((np.abs(now - was) <= 1e-9 * np.abs(was)).all())


def _solved(states: _States, by_x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return dz/dx (p, n, k) and the derivatives of the residual force on the driven degree of freedom (p, k)."""
    solver = states.solver
    driven, sense = solver.layout.driven or (0, 1.0)
    dofs, n = solver.n_dofs, solver.n
    rows = np.concatenate([by_x[:, :dofs][:, solver.model.slot >= 0], by_x[:, dofs:]], axis=1)
    slopes = -np.linalg.solve(states.tangent[:, :n, :n], rows)
    # the tangent is symmetric: the drive's column holds how the driven force follows the unknowns
    follows = np.einsum("pi,pik->pk", states.tangent[:, :n, n], slopes)
    return slopes, sense * follows + by_x[:, driven]


@dataclass(frozen=True)
class _States:
    """Equilibria with what does not depend on the design variable: tangents, chains of segments, turned arms.

    The first axis of all arrays is the point.
    """

    solver: ExpandedSolver
    y: FloatArray
    drive: FloatArray
    tangent: FloatArray
    relations: FloatArray
    values: FloatArray  # of the degrees of freedom

    @classmethod
    def at(cls, solver: ExpandedSolver, y: FloatArray, drive: FloatArray) -> _States:
        """Linearise at equilibria."""
        m, tangents, relations = solver.model, [], []
        for state, at in zip(y, drive, strict=True):
            solver.tangent_at(state, float(at))
            tangents.append(solver.scratch[0][: solver.n].copy())
            relations.append(solver.scratch[6].copy())
        values = np.where(m.slot >= 0, y[:, m.slot], m.base + drive[:, None] * m.rate)
        return cls(solver, y, drive, np.array(tangents), np.array(relations), values)

    def residual_slope(self, model: Model) -> FloatArray:
        """Return the derivatives of all residuals by the variable `model` is tilted in, at fixed unknowns, (p, r)."""
        solver, m = self.solver, self.solver.model
        out = np.zeros((len(self.y), solver.n_dofs + 3 * solver.n_beams))
        last = self._ends(model)
        shift, swing = self._places(model)
        a, b = m.beam_end.T
        push = -last[..., [4, 5, 3]]  # what the end force's change asks of the eliminated start force
        closure = last[..., :3] + np.einsum("psij,psj->psi", self.relations[:, :, 1], push)
        closure[..., :2] += shift[:, a] - shift[:, b]
        out[:, solver.n_dofs :] = closure.reshape(len(self.y), -1)
        self._add(out, a, np.einsum("psij,psj->psi", self.relations[:, :, 2], push))
        parts = self.y[:, solver.n :].reshape(len(self.y), -1, 6)
        end = self.y[:, solver.n_free : solver.n].reshape(len(self.y), -1, 3)
        _scatter(out, m.place_dof[a, 2], _lever(swing[:, a], parts[..., 3:5]))
        _scatter(out, m.place_dof[b, 2], -_lever(swing[:, b], end[..., :2]))
        return out

    def _ends(self, model: Model) -> FloatArray:
        """Return the derivatives of the states at the ends of all segments, (p, s, 7)."""
        from cfmkit.beams.kernels import entry

        solver, m = self.solver, self.solver.model
        plain = m._replace(table=model.table, line_load=m.line_load.astype(complex))
        rows = np.empty((len(self.y), len(solver.cut.edges) + solver.n_segments, 7), dtype=complex)
        for y, drive, out in zip(self.y.astype(complex), self.drive.astype(complex), rows, strict=True):
            entry.states(plain, solver.n_free, y, drive, out)
        ends = m.segment_step[1:] + np.arange(solver.n_segments)
        return rows[:, ends].imag / _STEP

    def _places(self, model: Model) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives of all places and of their arms, turned with their nodes, (p, places, 2)."""
        count, whole = len(model.place_dof), len(self.solver.model.place_dof)
        shift, swing = np.zeros((len(self.y), whole, 2)), np.zeros((len(self.y), whole, 2))
        origin, arm = np.imag(model.place_origin) / _STEP, np.imag(model.place_arm) / _STEP
        swing[:, :count] = _turned(arm, self.values[:, self.solver.model.place_dof[:count, 2]])
        shift[:, :count] = origin + swing[:, :count]
        return shift, swing

    def _add(self, out: FloatArray, places: Any, force: FloatArray) -> None:
        """Add forces and moments (p, n, 3) at places to the forces on their degrees of freedom."""
        m = self.solver.model
        a, b, arm, pose = m.place_dof[places].T
        fc, fs = m.place_frame[places].T
        _scatter(out, a, fc * force[..., 0] + fs * force[..., 1])
        _scatter(out, b, fc * force[..., 1] - fs * force[..., 0])
        _scatter(out, arm, _lever(_turned(m.place_arm[places], self.values[:, arm]), force))
        _scatter(out, pose, force[..., 2])


def _scatter(out: FloatArray, columns: Any, values: FloatArray) -> None:
    """Add values (p, n) to columns of `out`, of which some occur more than once."""
    for k, column in enumerate(columns.tolist()):
        out[:, column] += values[:, k]


def _turned(arm: FloatArray, angle: FloatArray) -> FloatArray:
    """Return vectors (n, 2) turned by angles (p, n)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * arm[:, 0] - s * arm[:, 1], s * arm[:, 0] + c * arm[:, 1]], axis=-1)


def _lever(arm: FloatArray, force: FloatArray) -> FloatArray:
    """Return the moments of forces on arms, (..., 2) each."""
    moments: FloatArray = arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0]
    return moments


def _motion(solver: ExpandedSolver, name: str, slopes: FloatArray) -> FloatArray:
    """Return the derivatives of a node's motion in global axes and SI, (p, 3, k)."""
    layout = solver.layout
    first, frame, length = layout.first[name], layout.direction[name], layout.scales.length
    slots = solver.model.slot[first : first + 3]
    along, across, turn = (slopes[:, k] if k >= 0 else np.zeros_like(slopes[:, 0]) for k in slots)
    c, s = np.cos(frame), np.sin(frame)
    return np.stack([(c * along - s * across) * length, (s * along + c * across) * length, turn], axis=1)
