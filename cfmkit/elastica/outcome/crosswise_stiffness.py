"""Stiffness of the driven node across its drive, along a path: what resists when it is pushed off its axis.

With the node's motions along the drive, across it and its rotation, the tangent of the network is condensed to them
(Schur complement); along the drive the node is held, its rotation is left as its support leaves it. What guides the
node across is taken away: the stiffness is that of beams and springs, not of the guide.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.equilibrium.network_solver import Solver
from cfmkit.elastica.model.drive import Displacement
from cfmkit.elastica.model.network import Network, Support
from cfmkit.elastica.model.network_under_drive import Layout

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.outcome.path import Path

_MANY = 150  # unknowns from which sparse factors are faster; at 380 of them dense ones take 5 times as long
_OPEN = 1e-9  # dimensionless force that may be left where a force is open: rounding leaves 1e-14


def cross_stiffness(path: Path, node: str, direction: float, points: Any = None) -> FloatArray:
    """Return the force across a direction per displacement across it at a node, at points of a path, (p,) [N/m].

    Parameters
    ----------
    path : Path
        The equilibria, driven by a displacement of the node along the direction, or by loads.
    node : str
        A node that no link moves.
    direction : float
        [rad]; along it the node is held.
    points : (p,) int array, optional
        Indices of points of the path; all unless given.

    Returns
    -------
    (p,) array
        Negative where the node would leave sideways; nan where nothing gives way.
    """
    chosen = np.arange(len(path)) if points is None else np.asarray(points, dtype=np.int64)
    found = [_condensed(each, across, kept) for each, across, kept in _tangents(path, node, direction, chosen)]
    scales = path.layout.scales
    return read_only(np.concatenate([np.empty(0), *found]) * scales.force / scales.length)


def poles(path: Path, node: str, direction: float) -> NDArray[np.bool_]:
    """Return between which neighbouring points of a path `cross_stiffness` is unbounded, (p - 1,).

    It is the quotient of two determinants, of which that of the held node is below: where only the latter changes its
    sign, one mode of the part with its node held across passes neutral stability, and the stiffness has a pole.
    """
    every = np.arange(len(path))
    signs, values = [np.empty(0)], [np.empty(0)]
    for stiffness, across, kept in _tangents(path, node, direction, every):
        with np.errstate(invalid="ignore"):  # a tangent beyond numbers has no sign
            signs.append(np.linalg.slogdet(stiffness[:, kept[:, None], kept])[0])
        values.append(_condensed(stiffness, across, kept))
    held, value = np.concatenate(signs), np.concatenate(values)
    return np.asarray((held[1:] * held[:-1] < 0) & (value[1:] * value[:-1] < 0))


def _tangents(
    path: Path, node: str, direction: float, chosen: NDArray[np.int64]
) -> Iterator[tuple[FloatArray, int, NDArray[np.int64]]]:
    """Yield tangents of the released network at points (m, n, n), the unknown across, and those that follow it."""
    layout, solver = path.layout, path.solver
    loose = Solver(_released(layout, node, direction), solver.mesh, solver.tolerance)
    slots = loose.layout.plan.slot
    along, across = (int(slots[loose.layout.first[node] + k]) for k in range(2))
    ys = np.concatenate([_unknowns(path, loose.layout, node), path.points.y[:, solver.n_free :]], axis=1)
    kept = np.array([k for k in range(loose.n) if k not in (along, across)])
    together = 1 if len(kept) >= _MANY else max(1, len(chosen))  # large matrices one by one: all of them fill gigabytes
    for first in range(0, len(chosen), together):
        some = chosen[first : first + together].tolist()
        yield -np.array([loose.tangent_at(ys[k], float(path.points.drive[k]))[0] for k in some]), across, kept


def _released(layout: Layout, node: str, direction: float) -> Layout:
    """Return the layout of the network without what guides a node, whose frame is turned along the direction."""
    network = layout.network
    old = network.nodes[node]
    rotation = old.support.rotation
    support = Support(rotation=rotation, direction=direction, displacement=(0.0, 0.0, old.support.displacement[2]))
    nodes = {**network.nodes, node: replace(old, support=support)}
    loose = Network(nodes, network.beams, network.links, network.springs, network.loads)
    drive = layout.drive
    if isinstance(drive, Displacement):
        drive = replace(drive, direction=direction)
    return Layout(loose, drive, layout)


def _unknowns(path: Path, loose: Layout, node: str) -> FloatArray:
    """Return the values of the free degrees of freedom of a released network at all points, (points, free)."""
    found = np.empty((len(path), loose.plan.n_free))
    first, direction = loose.first[node], float(np.real(loose.direction[node]))
    moved = path.motion(node) / loose.scales.length
    c, s = np.cos(direction), np.sin(direction)
    turned = {first: c * moved[:, 0] + s * moved[:, 1], first + 1: c * moved[:, 1] - s * moved[:, 0]}
    for dof, slot in enumerate(loose.plan.slot.tolist()):
        if slot >= 0:
            found[:, slot] = turned[dof] if dof in turned else path.value(dof)
    return found


def _condensed(stiffness: FloatArray, across: int, kept: Any) -> FloatArray:
    """Return the stiffness (p,) of one unknown while the ones that are kept follow it, from matrices (p, n, n)."""
    row, column = stiffness[:, across, kept], stiffness[:, kept, across]
    blocks = stiffness[:, kept[:, None], kept]
    try:
        if len(kept) < _MANY:
            follow = np.linalg.solve(blocks, column[..., None])[..., 0]
        else:
            follow = np.array([_sparsely(*each) for each in zip(blocks, column, strict=True)])
    except np.linalg.LinAlgError:
        follow = np.array([_followed(*each) for each in zip(blocks, column, strict=True)])
    return np.asarray(stiffness[:, across, across] - (row * follow).sum(axis=1))


def _sparsely(block: FloatArray, column: FloatArray) -> FloatArray:
    """Return how the others follow one in a large network: a beam's unknowns meet those of its neighbours only."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    try:
        return np.asarray(splu(csc_array(block)).solve(column))
    except RuntimeError as error:  # what SuperLU says of a singular matrix
        raise np.linalg.LinAlgError(str(error)) from error


def _followed(block: FloatArray, column: FloatArray) -> FloatArray:
    """Return how the others follow one, where a force may be open: of a straight beam that cannot stretch, held."""
    try:
        return np.asarray(np.linalg.solve(block, column))
    except np.linalg.LinAlgError:
        follow, _, _, _ = np.linalg.lstsq(block, column)
    left = np.abs(block @ follow - column).max(initial=0.0)
    open_force = left > _OPEN * max(1.0, float(np.abs(column).max(initial=0.0)))
    return np.full(len(column), np.nan) if open_force else np.asarray(follow)


__all__ = ["cross_stiffness", "poles"]
