"""Motions of points of a part and reactions of its supports along the path, between poses by cubics.

At every pose a reading and its derivative along the path are taken; the derivative by central differences along the
path's slope, which is known. The turn of a point is that of the material around it, the rotation of the deformation
gradient's polar decomposition.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.solid.elements import shape_functions, slopes
from cfmkit.solid.rigid_groups import rotation_matrix

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.elements import Elements
    from cfmkit.solid.meshed_part import MeshSolution

DIFFERENCE_STEP = 1e-5
"""Of the central differences, in parts of the travel: their error is its square, below that of the cubics."""
MAX_NEWTON_STEPS = 8  # of Newton's method for a place in a triangle; straight-sided ones take one
TRIANGLE_TOL = 1e-6  # how far beyond a triangle a place may be, in parts of it


def motion(solved: MeshSolution, place: FloatArray, name: str) -> Callable[[FloatArray], FloatArray]:
    """Return the motion of a place (2,) [m] as a function of travels (n,): x, y [m] and turn [rad], (n, 3).

    A place that a rigid piece of that name holds goes with it; any other with the material there. NaN where there is
    none.
    """
    groups = [group.name for group in solved.problem.supports.groups]
    if name in groups:
        number = groups.index(name)
        arm = place - solved.problem.supports.groups[number].center

        def read_group(unknowns: FloatArray, travel: float) -> FloatArray:
            x, y, turn = solved.problem.supports.motions(unknowns, travel)[number]
            return np.array([*(np.array([x, y]) + (rotation_matrix(turn) - np.eye(2)) @ arm), turn])

        return _reading_between(solved, read_group)
    point = MaterialPoint.from_place(solved.problem.elements, place)
    if point is None:
        return lambda travel: np.full((len(travel), 3), np.nan)
    supports = solved.problem.supports
    return _reading_between(
        solved, lambda unknowns, travel: point.motion(supports.evaluate_displacements(unknowns, travel)), turns=True
    )


def reaction(
    solved: MeshSolution, name: str, counted: NDArray[np.bool_] | None = None
) -> Callable[[FloatArray], FloatArray]:
    """Return what holds a rigid piece as a function of travels (n,): force x, y [N], moment about its centre [N m].

    counted: which elements count (m,), those of one half; all where not given. NaN where no piece has the name.
    """
    supports, elements = solved.problem.supports, solved.problem.elements
    groups = [group.name for group in supports.groups]
    if name not in groups:
        return lambda travel: np.full((len(travel), 3), np.nan)
    number = groups.index(name)
    counted_elements = elements if counted is None else elements.only(counted)

    def read(unknowns: FloatArray, travel: float) -> FloatArray:
        forces = counted_elements.forces(supports.evaluate_displacements(unknowns, travel))
        return np.asarray(supports.reactions(unknowns, travel, forces)[number])

    return _reading_between(solved, read)


def _reading_between(
    solved: MeshSolution, read: Callable[[FloatArray, float], FloatArray], turns: bool = False
) -> Callable[[FloatArray], FloatArray]:
    """Return a reading of the part's state as a function of the travel; `turns`: its last value is an angle."""
    from scipy.interpolate import CubicHermiteSpline

    travel = solved.course.travel
    step = DIFFERENCE_STEP * float(np.ptp(travel))
    values, ahead, behind = (
        np.array([read(pose.unknowns + offset * pose.slope, pose.travel + offset) for pose in solved.course.poses])
        for offset in (0.0, step, -step)
    )
    change = ahead - behind
    if turns:  # known but for whole turns
        values[:, 2] = np.unwrap(values[:, 2])
        change[:, 2] = (change[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    rising = np.argsort(travel)
    cubics = CubicHermiteSpline(travel[rising], values[rising], change[rising] / (2.0 * step))
    return lambda places: np.asarray(cubics(places))


@dataclass(frozen=True, eq=False)
class MaterialPoint:
    """A point of the material: its element's nodes (6,), and their shares in its displacement and its slopes."""

    nodes: NDArray[np.int64]  # (6,)
    shares: FloatArray  # (6,)
    gradient: FloatArray  # (6, 2) slopes of the shares in the plane [1/m]

    @classmethod
    def from_place(cls, elements: Elements, place: FloatArray) -> MaterialPoint | None:
        """Return the point at a place (2,) [m]; None if no element is."""
        triangles = elements.mesh.triangles
        corners = elements.mesh.nodes[triangles]  # (m, 6, 2)
        nearest = np.hypot(*(corners[:, :3].mean(axis=1) - place).T).argsort()[:20]
        for nodes, x in zip(triangles[nearest], corners[nearest], strict=True):
            at = np.full(2, 1.0 / 3.0)
            for _ in range(MAX_NEWTON_STEPS):
                jacobian = slopes(at[None])[0].T @ x  # rows: by r, by s
                at = at + np.linalg.solve(jacobian.T, place - shape_functions(at) @ x)
            if min(*at, 1.0 - at.sum()) >= -TRIANGLE_TOL:
                parent = slopes(at[None])[0]
                return cls(nodes, shape_functions(at), parent @ np.linalg.inv(parent.T @ x).T)
        return None

    def motion(self, moved: FloatArray) -> FloatArray:
        """Return x, y [m] and turn [rad], between -pi and pi, at displacements of all nodes (n, 2) [m]."""
        places = moved[self.nodes]
        f = np.eye(2) + places.T @ self.gradient
        return np.array([*(self.shares @ places), np.arctan2(f[1, 0] - f[0, 1], f[0, 0] + f[1, 1])])
