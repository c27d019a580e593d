"""A stated imperfection: a network bent slightly in its first buckling mode, so that no bifurcation is left.

The mode is the null vector at the first bifurcation of the perfect path, or, where a motion cannot begin since straight
beams do not stretch, of the path under a force or moment in its place. The rotations that it gives the sections
are added to the angles of the unloaded shapes, and the nodes, with the rigid arms on them, are moved as it moves them;
the shapes are then fitted between them as always. Springs are as long before any load as they were said to be. The size
is the largest displacement of the unloaded centre lines, to first order.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.equilibrium.mesh import Mesh
from cfmkit.elastica.equilibrium.uncondensed_solver import ExpandedSolver
from cfmkit.elastica.model.network import Network
from cfmkit.elastica.model.shapes import Bent

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.critical_points import Singular
    from cfmkit.elastica.continuation.path_and_moves import PathProblem
    from cfmkit.elastica.model.beam import Fit

_KICK = 1e-5  # of the mode, to difference its states
_DEGREE = 14  # of the polynomials that the rotations are given as
_PLACES = 32  # of a beam that these polynomials are made from
_PANELS = 512  # of a smooth piece: the trapezoidal rule then knows the displacement of a whole wave to 1.3e-5


def imperfect(
    network: Network, first: tuple[PathProblem, Singular] | None, size: float, unit: str = ""
) -> tuple[Network, str]:
    """Return the network with a mode of this size [m] in its shapes, and the sentence that names it.

    `first` is the first bifurcation of the primary path of the perfect network, and the problem that it is one of.
    `unit` is that of the load at which it is, where the drive is a motion that cannot begin before the network buckles.
    """
    if first is None:
        return network, "none: the perfect path has no bifurcation"
    problem, singular = first
    mode = _Mode(problem, singular)
    share = size / mode.reach()
    nodes = dict(network.nodes)
    for name, node in network.nodes.items():
        step = share * mode.nodes[name][0]
        nodes[name] = replace(node, x=node.x + step.real, y=node.y + step.imag)
    beams = {}
    for name, beam in network.beams.items():
        turn = share * mode.turns[name]
        arms = [
            _turned(offset, share * mode.nodes[node][1])
            for offset, node in ((beam.start_offset, beam.start), (beam.end_offset, beam.end))
        ]
        shape = Bent(beam.shape, tuple(turn.coef.tolist()))
        beams[name] = replace(beam, shape=shape, start_offset=arms[0], end_offset=arms[1])
    place = singular.spot.drive * problem.unit
    where = f"under {place:.4g} {unit}" if unit else f"at {place:.6g}"
    if problem.ramp:
        where = f"under {100 * place:.4g} % of the {problem.ramp}"
    bent = Network(nodes, beams, network.links, network.springs, network.loads)
    return bent, f"{size:.6g} m of the buckling mode {where}"


class _Mode:
    """A buckling mode: what it does to nodes and sections, for one unit of the null vector.

    Attributes
    ----------
    nodes : dict
        Displacement (as a complex number) and rotation of every node [m, rad].
    turns : dict
        Rotations of every beam's sections over its parameter [rad].
    """

    def __init__(self, problem: PathProblem, singular: Singular) -> None:
        """Difference the unknowns to either side of the singular point."""
        self.layout = problem.layout
        mesh, spot = problem.mesh, singular.spot
        sampled = Mesh(mesh.segments, max(mesh.steps, -(-_PLACES // mesh.segments)))
        solver = ExpandedSolver(self.layout, sampled, ramped=problem.ramp)  # the same unknowns, states at more places
        ys = np.stack([solver.shifted(spot.y, spot.drive, kick * singular.null) for kick in (_KICK, -_KICK)])
        drives = np.full(2, spot.drive)
        self.nodes: dict[str, tuple[complex, float]] = {}
        for name in self.layout.network.nodes:
            there, back = self.layout.motion(name, lambda dof: solver.degree(dof, ys, drives))
            x, y, rotation = ((there - back) / (2 * _KICK)).tolist()
            self.nodes[name] = complex(x, y), rotation
        self.turns = self._rotations(solver, ys, drives)

    def _rotations(
        self, solver: ExpandedSolver, ys: FloatArray, drives: FloatArray
    ) -> dict[str, np.polynomial.Chebyshev]:
        """Return the rotations along the beams."""
        from cfmkit.elastica.kernels import compiled

        cut, row, turns = solver.cut, 0, {}
        states = np.empty((2, len(cut.edges) + solver.n_segments, 7))
        compiled.states(solver.model, solver.n_free, ys, drives, states)
        rotation = (states[0, :, 2] - states[1, :, 2]) / (2 * _KICK)
        for number, name in enumerate(self.layout.network.beams):
            t: list[float] = []
            for segment in range(cut.beam_segment[number], cut.beam_segment[number + 1]):
                steps = slice(cut.segment_step[segment], cut.segment_step[segment + 1])
                t += [*cut.edges[steps, 0].tolist(), float(cut.edges[steps, 1][-1])]
            own = rotation[row : row + len(t)]
            turns[name] = np.polynomial.Chebyshev.fit(t, own, _DEGREE, domain=[0.0, 1.0])
            row += len(t)
        return turns

    def reach(self) -> float:
        """Return the largest displacement of the unloaded centre lines [m]."""
        largest = 0.0
        for name, beam in self.layout.network.beams.items():
            (start, turned), (end, far) = self.nodes[beam.start], self.nodes[beam.end]
            start += 1j * turned * complex(*beam.start_offset)
            end += 1j * far * complex(*beam.end_offset)
            place, moved = _course(self.layout.fits[name], self.turns[name])
            gap = 0.0 if beam.closure == "raw" else (end - start - moved[-1]) / place[-1]  # turned, scaled to fit
            largest = max(largest, float(np.abs(start + moved + gap * place).max()), abs(end))
        return largest


def _course(fitted: Fit, turn: np.polynomial.Chebyshev) -> tuple[FloatArray, FloatArray]:
    """Return places along a beam from its start and how far small rotations of its sections move them, complex [m]."""
    place, moved = [np.zeros(1, complex)], [np.zeros(1, complex)]
    for left, right in itertools.pairwise(fitted.course.breaks.tolist()):
        t, inside = np.linspace(left, right, _PANELS + 1), 0.5 * (left + right)
        rate = fitted.speed(t, inside) * np.exp(1j * fitted.angle(t, inside))
        for rates, along in ((rate, place), (1j * turn(t) * rate, moved)):
            steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(t)
            along.append(along[-1][-1] + np.cumsum(steps))
    return np.concatenate(place), np.concatenate(moved)


def _turned(arm: tuple[float, float], angle: float) -> tuple[float, float]:
    """Return a rigid arm [m] turned by an angle [rad]."""
    turned = complex(*arm) * np.exp(1j * angle)
    return turned.real, turned.imag
