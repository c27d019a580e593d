"""Stiffness of a driven node against motions across its drive, at each point of an equilibrium path [N/m].

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
from cfmkit.elastica.mechanics.discretise import make_inextensible
from cfmkit.elastica.mechanics.march import equations

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.equations import NumpyEquations
    from cfmkit.elastica.results.path import EquilibriumPath

MAX_FLEXIBILITY = (
    1e13  # motion or force, dimensionless, that follows a unit motion: beyond it the tangent may be singular
)
RANK_RTOL = 1e-14  # share of the largest singular value below which one is rounding
OPEN_FORCE = 1e-9  # dimensionless force that may be left where a force is open: rounding leaves 1e-14


def cross_stiffness(path: EquilibriumPath, node: str, direction: float, points: Any = None) -> FloatArray:
    """Return the force across a direction per displacement across it at a node, at points of a path, (p,) [N/m].

    The path is driven by a displacement of the node, which no link moves, along the direction [rad], or by loads. The
    stiffness is negative where the node would leave sideways, nan where nothing gives way.
    """
    chosen = slice(None) if points is None else np.asarray(points, dtype=np.int64)
    scales = path.mesh.scales
    return read_only(_compute_along_path(path, node, direction)[0][chosen] * scales.force / scales.length)


def poles(path: EquilibriumPath, node: str, direction: float) -> NDArray[np.bool_]:
    """Return between which neighbouring points of a path `cross_stiffness` is unbounded, (p - 1,).

    It is the quotient of two determinants, of which that of the held node is below: where only the latter changes its
    sign, one mode of the part with its node held across passes neutral stability, and the stiffness has a pole.
    """
    value, held = _compute_along_path(path, node, direction)
    return np.asarray((held[1:] * held[:-1] < 0) & (value[1:] * value[:-1] < 0))


def _compute_along_path(path: EquilibriumPath, node: str, direction: float) -> tuple[FloatArray, FloatArray]:
    """Return the dimensionless stiffness at every point, and the sign of the determinant of all that follows, (p,).

    The network is the same but for the node, whose axes are turned along the direction and which nothing guides.
    """
    if (node, direction) in path.cross_stiffnesses:
        return path.cross_stiffnesses[node, direction]
    mesh = path.mesh
    x, y, _ = mesh.bodies[node]
    frame = mesh.attachments.frame.copy()
    place = mesh.attachments.unknowns[:, 0] == x
    old, new = mesh.attachments.frame[mesh.nodes[node]], np.array([np.cos(direction), np.sin(direction)])
    frame[place] = new
    kept = mesh.free[(mesh.free != x) & (mesh.free != y)]
    loose = replace(mesh, attachments=mesh.attachments._replace(frame=frame), free=np.sort(np.append(kept, y)))
    loose = make_inextensible(loose, np.flatnonzero(mesh.floored))
    cos, sin = new @ old, old[0] * new[1] - old[1] * new[0]
    condensed = np.empty((len(path), 2))
    for k, (state, drive) in enumerate(zip(path.at.z, path.at.drive.tolist(), strict=True)):
        z = state.copy()
        z[x], z[y] = cos * z[x] + sin * z[y], cos * z[y] - sin * z[x]
        condensed[k] = _condense(equations(replace(loose, base=z - drive * mesh.rate)), z, drive, y)
    path.cross_stiffnesses[node, direction] = read_only(condensed[:, 0]), read_only(condensed[:, 1])
    return path.cross_stiffnesses[node, direction]


def _condense(system: NumpyEquations, z: FloatArray, drive: float, across: int) -> tuple[float, float]:
    """Return the stiffness of one unknown while all others follow it, and the sign of the determinant of those.

    nan where a force is open, as that along a straight beam that cannot stretch and is held at both ends.
    """
    free = system.mesh.free
    push = (free == across).astype(float)
    if not system.follows:  # else no directions are counted
        with contextlib.suppress(np.linalg.LinAlgError):
            (moved,), unstable = system.resolve(z[free], drive, push[None])
            give = float(push @ moved)
            if np.abs(moved).max() < MAX_FLEXIBILITY * abs(give):
                return 1.0 / give, (-1.0) ** (unstable - (give < 0))
    rest = push == 0
    tangent = system.linearise(z[free], drive).tangent
    (row,), column, kept = tangent[~rest][:, rest], tangent[rest][:, ~rest][:, 0], tangent[np.ix_(rest, rest)]
    stiffness, sign = float(tangent[~rest, ~rest][0]), float(np.linalg.slogdet(kept)[0])
    with contextlib.suppress(np.linalg.LinAlgError):
        follow = np.linalg.solve(kept, column)
        if np.abs(follow).max(initial=0.0) < MAX_FLEXIBILITY:
            return stiffness - float(row @ follow), sign
    follow, _, _, _ = np.linalg.lstsq(kept, column, RANK_RTOL)
    left = np.abs(kept @ follow - column).max(initial=0.0)
    is_open = left > OPEN_FORCE * max(1.0, float(np.abs(column).max(initial=0.0)))
    return float("nan") if is_open else stiffness - float(row @ follow), sign
