"""Stiffness of the driven node across its drive, along a path: what resists when it is pushed off its axis.

With the node's motions along the drive, across it and its rotation, the tangent of the network is condensed to them
(Schur complement); along the drive the node is held, its rotation is left as its support leaves it. What guides the
node across is taken away: the stiffness is that of beams and springs, not of the guide.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics.discretise import without_floor
from cfmkit.elastica.mechanics.march import equations

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.path import EquilibriumPath

LARGEST = 1e13  # motion or force, dimensionless, that follows a unit motion: beyond it the tangent may be singular
RANK = 1e-14  # share of the largest singular value below which one is rounding
OPEN_FORCE = 1e-9  # dimensionless force that may be left where a force is open: rounding leaves 1e-14


def cross_stiffness(path: EquilibriumPath, node: str, direction: float, points: Any = None) -> FloatArray:
    """Return the force across a direction per displacement across it at a node, at points of a path, (p,) [N/m].

    Parameters
    ----------
    path : EquilibriumPath
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
    chosen = slice(None) if points is None else np.asarray(points, dtype=np.int64)
    scales = path.mesh.scales
    return read_only(_condensed_along(path, node, direction)[0][chosen] * scales.force / scales.length)


def poles(path: EquilibriumPath, node: str, direction: float) -> NDArray[np.bool_]:
    """Return between which neighbouring points of a path `cross_stiffness` is unbounded, (p - 1,).

    It is the quotient of two determinants, of which that of the held node is below: where only the latter changes its
    sign, one mode of the part with its node held across passes neutral stability, and the stiffness has a pole.
    """
    value, held = _condensed_along(path, node, direction)
    return np.asarray((held[1:] * held[:-1] < 0) & (value[1:] * value[:-1] < 0))


def _condensed_along(path: EquilibriumPath, node: str, direction: float) -> tuple[FloatArray, FloatArray]:
    """Return the dimensionless stiffness at every point, and the sign of the determinant of all that follows, (p,)."""
    known = path.condensed
    if (node, direction) not in known:
        across, coupled, kept = (np.array(each) for each in zip(*_blocks(path, node, direction), strict=True))
        row, column = coupled[:, 0], coupled[:, 1]
        value = np.full(len(across), np.nan)
        with contextlib.suppress(np.linalg.LinAlgError):
            follow = np.linalg.solve(kept, column[..., None])[..., 0]
            plain = np.abs(follow).max(axis=1, initial=0.0) < LARGEST
            value[plain] = (across - (row * follow).sum(axis=1))[plain]
        for k in np.flatnonzero(np.isnan(value)):
            value[k] = _condensed(float(across[k]), coupled[k], kept[k])
        known[node, direction] = value, np.linalg.slogdet(kept)[0]
    return known[node, direction]


def _blocks(path: EquilibriumPath, node: str, direction: float) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Yield the stiffness across, its coupling (2, k) to what follows, by row and by column, and that of those (k, k).

    The network is the same but for the node, whose axes are turned along the direction and which nothing guides.
    """
    network = path.mesh
    x, y, _ = network.bodies[node]
    frame = network.attachments.frame.copy()
    place = network.attachments.unknowns[:, 0] == x
    old = network.attachments.frame[network.nodes[node]]
    frame[place] = np.cos(direction), np.sin(direction)
    loose = replace(network, attachments=network.attachments._replace(frame=frame))
    loose = without_floor(loose, np.flatnonzero(network.floored))
    cos, sin = frame[place][0] @ old, old[0] * frame[place][0][1] - old[1] * frame[place][0][0]
    kept = network.free[(network.free != x) & (network.free != y)]
    own = equations(loose)
    for k, state in enumerate(path.at.z):
        z = state.copy()
        z[x], z[y] = cos * z[x] + sin * z[y], cos * z[y] - sin * z[x]
        _, hessian = own.evaluate(z, float(path.at.drive[k]))
        yield hessian[y, y], np.stack([hessian[y, kept], hessian[kept, y]]), hessian[np.ix_(kept, kept)]


def _condensed(across: float, coupled: FloatArray, kept: FloatArray) -> float:
    """Return the stiffness of one unknown while others follow it; nan where a force is open.

    So is that along a straight beam that cannot stretch and is held at both ends.
    """
    row, column = coupled
    with contextlib.suppress(np.linalg.LinAlgError):
        follow = np.linalg.solve(kept, column)
        if np.abs(follow).max(initial=0.0) < LARGEST:
            return float(across - row @ follow)
    follow, _, _, _ = np.linalg.lstsq(kept, column, RANK)
    left = np.abs(kept @ follow - column).max(initial=0.0)
    is_open = left > OPEN_FORCE * max(1.0, float(np.abs(column).max(initial=0.0)))
    return float("nan") if is_open else float(across - row @ follow)
