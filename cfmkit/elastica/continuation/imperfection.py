"""A stated imperfection: beams bent slightly in the form of the first buckling mode, so that no bifurcation is left.

The mode is the null vector at the first bifurcation of the perfect path. The rotations that it gives the sections
are added to the angles of the unloaded shapes, which are then fitted between their nodes as always; the size is the
largest displacement of the mode that they stand for.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.equilibrium.mesh import Mesh
from cfmkit.elastica.equilibrium.uncondensed_system import ExpandedSolver
from cfmkit.elastica.model.network import Network
from cfmkit.elastica.model.shapes import Bent

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.continuation.singular import Singular
    from cfmkit.elastica.continuation.state import PathProblem

_KICK = 1e-5  # of the mode, to difference its states
_DEGREE = 14  # of the polynomials that the rotations are given as,
_PLACES = 32  # from so many places of a beam


def imperfect(network: Network, first: tuple[PathProblem, Singular] | None, size: float) -> tuple[Network, str]:
    """Return the network with a mode of this size [m] in its shapes, and the sentence that names it.

    `first` is the first bifurcation of the primary path of the perfect network, and the problem that it is one of.
    """
    if first is None:
        return network, "none: the perfect path has no bifurcation"
    problem, singular = first
    mesh = problem.mesh
    sampled = Mesh(mesh.segments, max(mesh.steps, -(-_PLACES // mesh.segments)))
    solver = ExpandedSolver(problem.layout, sampled, ramped=problem.ramp)  # the same unknowns, states at more places
    rotation, reach = _mode(solver, singular)
    share = size / (reach * problem.layout.scales.length)
    cut, beams, row = solver.cut, dict(network.beams), 0
    for number, (name, beam) in enumerate(network.beams.items()):
        t: list[float] = []
        for segment in range(cut.beam_segment[number], cut.beam_segment[number + 1]):
            steps = slice(cut.segment_step[segment], cut.segment_step[segment + 1])
            t += [*cut.edges[steps, 0].tolist(), float(cut.edges[steps, 1][-1])]
        turn = np.polynomial.Chebyshev.fit(t, share * rotation[row : row + len(t)], _DEGREE, domain=[0.0, 1.0])
        beams[name] = replace(beam, shape=Bent(beam.shape, tuple(turn.coef.tolist())))
        row += len(t)
    place = singular.spot.drive * problem.unit
    where = f"under {100 * place:.4g} % of the {problem.ramp}" if problem.ramp else f"at {place:.6g}"
    bent = Network(network.nodes, beams, network.links, network.springs, network.loads)
    return bent, f"{size:.6g} m of the buckling mode {where}"


def _mode(solver: ExpandedSolver, singular: Singular) -> tuple[FloatArray, float]:
    """Return the rotations along the segments by the null vector, and its largest displacement, dimensionless."""
    from cfmkit.elastica.kernels import compiled

    spot = singular.spot
    ys = np.stack([solver.shifted(spot.y, spot.drive, kick * singular.null) for kick in (_KICK, -_KICK)])
    states = np.empty((2, len(solver.cut.edges) + solver.n_segments, 7))
    compiled.states(solver.model, solver.n_free, ys, np.full(2, spot.drive), states)
    slope = (states[0] - states[1]) / (2 * _KICK)
    return slope[:, 2], float(np.hypot(slope[:, 0], slope[:, 1]).max())
