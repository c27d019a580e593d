"""An edge as a curve over a parameter, extended a little or moved to its right, from which pieces are cut."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.contours import Arc, Edge, Line, Smooth
from cfmkit.numerics.arc_chains import cubic, slope

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

ANGLE_TOL = 1e-6  # arcs whose angles differ by less are the same [rad]


@dataclass(frozen=True, eq=False)
class TracedEdge:
    """An edge over a parameter that counts the lines of its polygon; or the edge moved into the waste on its right."""

    edge: Edge
    z: NDArray[np.complex128]
    moved: float = 0.0

    @classmethod
    def from_edge(cls, edge: Edge, sagitta: float) -> TracedEdge:
        """Return an edge whose polygon is within `sagitta` [m] of it, a smooth one with its own points."""
        if isinstance(edge, Line):
            return cls(edge, np.array(edge.ends))
        if isinstance(edge, Smooth):
            return cls(edge, np.asarray(edge.points @ np.array([1, 1j])))
        step = min(2.0 * math.acos(max(1.0 - sagitta / edge.radius, 0.0)), math.radians(10.0))
        count = max(math.ceil(abs(edge.end - edge.start) / step), 2)
        angle = np.linspace(edge.start, edge.end, count + 1)
        return cls(edge, complex(*edge.center) + edge.radius * np.exp(1j * angle))

    @property
    def corners(self) -> FloatArray:
        """Corners of its polygon (n, 2) [m]."""
        return xy(self.z)

    @cached_property
    def tangents(self) -> NDArray[np.complex128]:
        """Unit tangents at the corners."""
        if isinstance(self.edge, Smooth):
            return np.asarray(self.edge.tangents @ np.array([1, 1j]))
        return np.array([self.ahead(float(k)) for k in range(len(self.z))])

    def shift_right(self, distance: float) -> TracedEdge:
        """Return the curve that runs at a distance [m] on the right."""
        return TracedEdge(self.edge, self.z - 1j * distance * self.tangents, distance)

    def locate(self, u: float) -> complex:
        """Return the point at a parameter, a little beyond the ends as well."""
        return self.foot(u) - 1j * self.moved * self.ahead(u) if self.moved else self.foot(u)

    def foot(self, u: float) -> complex:
        """Return the point of the edge itself."""
        edge, count = self.edge, len(self.z) - 1
        if isinstance(edge, Line):
            start, end = edge.ends
            return start + u * (end - start)
        if isinstance(edge, Arc):
            angle = edge.start + (edge.end - edge.start) * u / count
            return complex(*edge.center) + edge.radius * complex(math.cos(angle), math.sin(angle))
        return complex(cubic(*self._select_piece(u))[0])

    def ahead(self, u: float) -> complex:
        """Return the unit tangent."""
        edge = self.edge
        if isinstance(edge, Line):
            along = edge.ends[1] - edge.ends[0]
        elif isinstance(edge, Arc):
            angle = edge.start + (edge.end - edge.start) * u / (len(self.z) - 1)
            along = complex(-math.sin(angle), math.cos(angle)) * (1.0 if edge.end > edge.start else -1.0)
        elif u == int(u) and 0 <= u < len(self.z):
            along = complex(*edge.tangents[int(u)])
        else:
            along = complex(slope(*self._select_piece(u))[0])
        return along / abs(along)

    def _select_piece(self, u: float) -> tuple[Any, ...]:
        """Return ends and tangents of the piece of a smooth edge that holds a parameter, and the share there."""
        assert isinstance(self.edge, Smooth)
        k = min(max(int(u), 0), len(self.z) - 2)
        (a, b), (s, t) = self.edge.points[k : k + 2] @ [1, 1j], self.edge.tangents[k : k + 2] @ [1, 1j]
        return a, s, b, t, np.array([u - k])

    def part(self, first: float, last: float, start: complex, end: complex) -> Edge:
        """Return the edge between two parameters, from a place to a place that are there."""
        edge = self.edge
        if isinstance(edge, Line):
            return Line(pair(start), pair(end))
        if isinstance(edge, Arc):
            count = len(self.z) - 1
            low, high = (edge.start + (edge.end - edge.start) * u / count for u in (first, last))
            if abs(high - low - (edge.end - edge.start)) < ANGLE_TOL:
                return edge
            return Arc(edge.center, edge.radius, low, high)
        inner = np.arange(math.floor(first) + 1, math.ceil(last))
        inner = inner[(inner > first + 0.05) & (inner < last - 0.05)]
        points = np.vstack([pair(start), edge.points[inner], pair(end)])
        ends = [pair(self.ahead(first)), pair(self.ahead(last))]
        return Smooth(points, np.vstack([ends[0], edge.tangents[inner], ends[1]]))


def pair(point: complex) -> tuple[float, float]:
    """Return a complex number as two."""
    return float(point.real), float(point.imag)


def xy(points: NDArray[np.complex128]) -> FloatArray:
    """Return complex numbers (n,) as points (n, 2)."""
    return np.column_stack([points.real, points.imag])
