"""A stated imperfection: a network bent slightly in its first buckling mode, so that no bifurcation is left.

The rotations that the mode gives the sections are added to the angles of the unloaded shapes, and the nodes, with the
rigid arms on them, are moved as it moves them; the shapes are then fitted between them as always. Springs are as long
before any load as they were said to be. The size is the largest displacement of the unloaded centre lines, to first
order.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.polynomials import integrals, shape_functions
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.drive import Displacement
from cfmkit.elastica.model.shapes import Bent

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network
    from cfmkit.numerics.continuation.path import PathEvent

POLYNOMIAL_DEGREE = 14  # of the polynomials that the rotations are given as
N_ELEMENT_PLACES = 65  # of an element at which they and displacements are taken
NO_DRIVE = 1e-9  # share of the range below which the network buckles before the drive moves it


class Buckling(NamedTuple):
    """The first bifurcation of a perfect network."""

    problem: NetworkProblem
    event: PathEvent
    what: str  # of which constant things a share is followed; empty: the drive


def bend(network: Network, drive: Drive, buckling: Buckling | None, size: float) -> tuple[Network, str]:
    """Return the network with a mode of this size [m] in its shapes, and the sentence that names it."""
    if buckling is None:
        return network, "none: the perfect path has no bifurcation"
    problem, event, _ = buckling
    mode = np.zeros(problem.mesh.size)
    mode[problem.mesh.free] = problem.orient(event.modes)
    share = size / _largest_displacement(network, problem, mode)
    nodes, turns = dict(network.nodes), {}
    for name, node in network.nodes.items():
        (dx, dy), turns[name] = _node_motion(problem, name, share * mode)
        nodes[name] = replace(node, x=node.x + dx, y=node.y + dy)
    beams = {}
    for name, beam in network.beams.items():
        added = tuple(_rotations(problem, name, share * mode).coef.tolist())
        first, last = (
            _turn_arm(offset, turns[node])
            for offset, node in ((beam.start_offset, beam.start), (beam.end_offset, beam.end))
        )
        beams[name] = replace(beam, shape=Bent(beam.shape, added), start_offset=first, end_offset=last)
    bent = replace(network, nodes=nodes, beams=beams)
    return bent, f"{size:.6g} m of the buckling mode {_describe_place(drive, buckling)}"


def _describe_place(drive: Drive, buckling: Buckling) -> str:
    problem, event, what = buckling
    if what:
        return f"under {100 * event.drive:.4g} % of the {what}"
    place = event.drive * problem.mesh.scales.drive
    mesh, equilibrium = problem.mesh, event.nearest
    if equilibrium is not None and mesh.rate.any() and abs(place) < NO_DRIVE * float(np.abs(drive.points).max()):
        residual = energy.gradient(mesh, problem.values(equilibrium.x, equilibrium.drive), equilibrium.drive)
        force = float(residual @ mesh.rate) * mesh.scales.moment / mesh.scales.drive
        return f"under {abs(force):.4g} {'N' if isinstance(drive, Displacement) else 'N m'}"
    return f"at {place:.6g}"


def _node_motion(problem: NetworkProblem, name: str, change: FloatArray) -> tuple[FloatArray, float]:
    """Return displacement [m] and rotation [rad] of a node, to first order from rest."""
    mesh = problem.mesh
    at = poses(mesh.attachments, np.zeros(mesh.size), [mesh.nodes[name]])
    moved = at.jacobian[0] @ change[at.unknowns[0, :3]] * mesh.scales.length
    return moved, float(change[at.unknowns[0, 3]])


def _rotations(problem: NetworkProblem, beam: str, mode: FloatArray) -> Chebyshev:
    """Return the rotations of a beam's sections in a mode, over the parameter of its shape [rad]."""
    mesh, places, values = problem.mesh, [], []
    shares = (1 - np.cos(np.pi * np.arange(N_ELEMENT_PLACES) / (N_ELEMENT_PLACES - 1))) / 2
    shapes, _ = shape_functions(mesh.degree, shares)
    columns = energy.rotation_columns(mesh.degree)
    for number, name in enumerate(mesh.elements.beam):
        if name == beam:
            left, right = mesh.elements.cuts[number]
            places.append(left + (right - left) * shares)
            values.append(shapes @ mode[mesh.elements.unknowns[number, columns]])
    return Chebyshev.fit(np.concatenate(places), np.concatenate(values), POLYNOMIAL_DEGREE, domain=[0.0, 1.0])


def _largest_displacement(network: Network, problem: NetworkProblem, mode: FloatArray) -> float:
    """Return the largest displacement of the unloaded lines in a mode [m]; beams are turned and scaled to fit."""
    largest = 0.0
    for name, beam in network.beams.items():
        fitted, turn = problem.mesh.fits[name], _rotations(problem, name, mode)
        ends = []
        for node, offset in ((beam.start, beam.start_offset), (beam.end, beam.end_offset)):
            (dx, dy), rotation = _node_motion(problem, node, mode)
            ends.append(complex(dx, dy) + 1j * rotation * complex(*offset))
        places, moved = [np.zeros(1, complex)], [np.zeros(1, complex)]
        breaks = np.real(fitted.course.breaks)
        for left, right in zip(breaks[:-1].tolist(), breaks[1:].tolist(), strict=True):
            shares = (1 + np.polynomial.legendre.leggauss(N_ELEMENT_PLACES)[0]) / 2
            to_places = integrals(shares, np.linspace(0, 1, N_ELEMENT_PLACES)) * (right - left)
            t, inside = left + (right - left) * shares, 0.5 * (left + right)
            rate = np.real(fitted.speed(t, inside)) * np.exp(1j * np.real(fitted.angle(t, inside)))
            for rates, along in ((rate + 0.0 * t, places), (1j * turn(t) * rate, moved)):
                along.append(along[-1][-1] + to_places @ rates)
        place, change = np.concatenate(places), np.concatenate(moved)
        gap = 0.0 if beam.closure == "raw" else (ends[1] - ends[0] - change[-1]) / place[-1]
        largest = max(largest, float(np.abs(ends[0] + change + gap * place).max()), abs(ends[1]))
    return largest


def _turn_arm(arm: tuple[float, float], angle: float) -> tuple[float, float]:
    """Return a rigid arm [m] turned by an angle [rad]."""
    turned = complex(*arm) * np.exp(1j * angle)
    return turned.real, turned.imag
