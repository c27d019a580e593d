"""Six-node triangles in total Lagrangian form: forces, tangent and stresses of all elements at once.

Arrays have the elements, and the points of quadrature in them, last: what is written for one is done for all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.mesh import TriangleMesh
    from cfmkit.solid.plane_stress_law import Law

# Three points inside [Strang, Fix, 1973]: exact to degree two, which is that of the strain energy of a straight-sided
# element where strains are small.
GAUSS_POINTS = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]])
GAUSS_WEIGHTS = np.full(3, 1 / 6)
PARENT_NODES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
"""Where the nodes stand in the parent triangle."""
UPPER_ENTRIES = np.argwhere(np.triu(np.ones((12, 12))))
"""Rows and columns of an element's stiffness on and above the diagonal, (78, 2): it is symmetric."""


def slopes(at: FloatArray) -> FloatArray:
    """Return the derivatives of the shape functions, (points, 6, 2), at places (points, 2) of the parent triangle."""
    r, s = np.asarray(at, float).T
    t = 1 - r - s
    zero = np.zeros_like(r)
    along_r = [1 - 4 * t, 4 * r - 1, zero, 4 * (t - r), 4 * s, -4 * s]
    along_s = [1 - 4 * t, zero, 4 * s - 1, -4 * r, 4 * r, 4 * (t - s)]
    return np.stack([np.stack(along_r, -1), np.stack(along_s, -1)], -1)


def shape_functions(at: FloatArray) -> FloatArray:
    """Return the shape functions (..., 6) at places (..., 2) of the parent triangle."""
    r, s = np.moveaxis(np.asarray(at, float), -1, 0)
    t = 1.0 - r - s
    return np.stack([t * (2 * t - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * r * t, 4 * r * s, 4 * s * t], -1)


@dataclass(frozen=True)
class Elements:
    """All elements of a mesh, ready for many states."""

    mesh: TriangleMesh
    law: Law
    width: FloatArray  # (m,) out of the plane, by element [m]

    def only(self, chosen: NDArray[np.bool_]) -> Elements:
        """Return some of the elements (m,), on all nodes."""
        return Elements(replace(self.mesh, triangles=self.mesh.triangles[chosen]), self.law, self.width[chosen])

    @cached_property
    def _parent(self) -> tuple[FloatArray, FloatArray]:
        """Slopes of the shape functions in the plane, (6, 2, points x m) [1/m], and the volumes (points x m,) [m3]."""
        return self._map_slopes(GAUSS_POINTS, GAUSS_WEIGHTS)

    @cached_property
    def _at_nodes(self) -> FloatArray:
        """Slopes of the shape functions at the nodes of each element, (6, 2, 6 x m) [1/m]."""
        return self._map_slopes(PARENT_NODES, np.zeros(6))[0]

    def _map_slopes(self, at: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        x = self.mesh.nodes[self.mesh.triangles]  # (m, 6, 2)
        parent = slopes(at)
        jacobian = np.einsum("qai,maj->qmij", parent, x)
        det = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]
        adjugate = np.stack([jacobian[..., 1, 1], -jacobian[..., 0, 1], -jacobian[..., 1, 0], jacobian[..., 0, 0]], -1)
        inverse = adjugate.reshape(jacobian.shape) / det[..., None, None]
        gradient = np.einsum("qai,qmji->ajqm", parent, inverse)
        volume = weights[:, None] * det * self.width
        return np.ascontiguousarray(gradient.reshape(6, 2, -1)), volume.ravel()

    def _evaluate_strain(self, gradient: FloatArray, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the deformation gradient (2, 2, k) and Green's strain (3, k) at points with these slopes."""
        f = self._evaluate_slopes(gradient, moved)
        # from the displacements' slopes, before 1 is added: tiny strains keep their digits
        strain = np.stack(
            [
                f[0, 0] + 0.5 * (f[0, 0] ** 2 + f[1, 0] ** 2),
                f[1, 1] + 0.5 * (f[0, 1] ** 2 + f[1, 1] ** 2),
                f[0, 1] + f[1, 0] + f[0, 0] * f[0, 1] + f[1, 0] * f[1, 1],
            ]
        )
        f[0, 0] += 1.0
        f[1, 1] += 1.0
        return f, strain

    def _evaluate_slopes(self, gradient: FloatArray, moved: FloatArray) -> FloatArray:
        """Return the slopes of displacements (2, 2, k) at points where the shape functions have these."""
        times = gradient.shape[-1] // len(self.mesh.triangles)
        u = np.tile(moved[self.mesh.triangles].transpose(1, 2, 0), times)  # (6, 2, k)
        return np.asarray(np.einsum("aik,ajk->ijk", u, gradient))

    def forces(self, moved: FloatArray) -> FloatArray:
        """Return what holds the nodes in place (n, 2) [N], at displacements (n, 2) [m]."""
        gradient, volume = self._parent
        f, strain = self._evaluate_strain(gradient, moved)
        return self._assemble_forces(_times(f, volume * self.law(strain)[0]))

    def linearize(self, moved: FloatArray) -> tuple[FloatArray, Callable[[FloatArray], FloatArray]]:
        """Return forces (n, 2) [N], and the tangent as a function of a direction (n, 2), in which they change so.

        A product of the tangent and a vector takes a quarter of what it takes to assemble the tangent.
        """
        gradient, volume = self._parent
        f, strain = self._evaluate_strain(gradient, moved)
        stress, modulus, _ = self.law(strain)
        s, d = volume * stress, volume * modulus

        def apply_tangent(direction: FloatArray) -> FloatArray:
            df = self._evaluate_slopes(gradient, direction)
            return self._assemble_forces(_times(df, s) + _times(f, np.einsum("ijk,jk->ik", d, _strain_change(f, df))))

        return self._assemble_forces(_times(f, s)), apply_tangent

    def tangent_energies(self, moved: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return first' K second of every element (m,) [N m], K its tangent at displacements; each (n, 2) [m]."""
        gradient, volume = self._parent
        f, strain = self._evaluate_strain(gradient, moved)
        stress, modulus, _ = self.law(strain)
        df, dg = self._evaluate_slopes(gradient, first), self._evaluate_slopes(gradient, second)
        energy = (df * _times(dg, stress)).sum((0, 1))
        energy += np.einsum("ik,ijk,jk->k", _strain_change(f, df), modulus, _strain_change(f, dg))
        return np.asarray((volume * energy).reshape(len(GAUSS_POINTS), -1).sum(0))

    def _assemble_forces(self, p: FloatArray) -> FloatArray:
        """Return nodal forces (n, 2) [N] from the first Piola-Kirchhoff stress times volume (2, 2, k) [N m]."""
        gradient, _ = self._parent
        forces = np.einsum("ijk,ajk->aik", p, gradient).reshape(6, 2, len(GAUSS_POINTS), -1).sum(2)
        nodes, count = self.mesh.triangles.T.ravel(), len(self.mesh.nodes)
        return np.column_stack([np.bincount(nodes, forces[:, k].ravel(), count) for k in (0, 1)])

    def tangent(self, moved: FloatArray) -> tuple[FloatArray, csc_array]:
        """Return forces (n, 2) [N] and their derivative (2n, 2n) [N/m] with respect to the displacements."""
        gradient, volume = self._parent
        f, strain = self._evaluate_strain(gradient, moved)
        stress, modulus, _ = self.law(strain)
        s, d = volume * stress, volume * modulus
        # B of a node: row 11: F[:,0] g0; row 22: F[:,1] g1; row 12: F[:,0] g1 + F[:,1] g0
        b = np.stack(
            [
                f[:, 0] * gradient[:, None, 0],
                f[:, 1] * gradient[:, None, 1],
                f[:, 0] * gradient[:, None, 1] + f[:, 1] * gradient[:, None, 0],
            ]
        )  # (3, 6, 2, k)
        db = np.stack([d[i, 0] * b[0] + d[i, 1] * b[1] + d[i, 2] * b[2] for i in range(3)])
        pg = np.stack([gradient[:, 0] * s[0] + gradient[:, 1] * s[2], gradient[:, 0] * s[2] + gradient[:, 1] * s[1]], 1)
        points = (len(GAUSS_POINTS), len(self.mesh.triangles))
        b, db = b.reshape(3, 6, 2, *points), db.reshape(3, 6, 2, *points)
        slope, pg = gradient.reshape(6, 2, *points), pg.reshape(6, 2, *points)
        entries = np.empty((len(UPPER_ENTRIES), points[1]))
        first = 0
        for a in range(6):
            spread = np.einsum("jpm,cjpm->cm", slope[a], pg[a:])
            for i in (0, 1):
                row = np.einsum("rpm,rcjpm->cjm", b[:, a, i], db[:, a:])
                row[:, i] += spread
                row = row.reshape(-1, points[1])[i:]  # from its own diagonal on
                entries[first : first + len(row)] = row
                first += len(row)
        return self._assemble_forces(_times(f, s)), self._tangent_pattern.assemble(entries)

    @cached_property
    def _tangent_pattern(self) -> Pattern:
        unknowns = (2 * self.mesh.triangles[:, :, None] + np.arange(2)).reshape(len(self.mesh.triangles), 12).T
        return Pattern.from_entries(
            unknowns[UPPER_ENTRIES[:, 0]].ravel(), unknowns[UPPER_ENTRIES[:, 1]].ravel(), 2 * len(self.mesh.nodes)
        )

    def stress(self, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return Cauchy's stress 11, 22, 12 at the nodes, averaged over the elements that meet there, (3, n) [Pa].

        And the largest difference of an element's stress from it, as the equivalent stress of that, (n,) [Pa].
        """
        f, strain = self._evaluate_strain(self._at_nodes, moved)
        s, _, across = self.law(strain)
        det = (f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]) * across
        full = np.stack([np.stack([s[0], s[2]]), np.stack([s[2], s[1]])])
        sigma = np.einsum("iak,abk,jbk->ijk", f, full, f) / det
        components = np.stack([sigma[0, 0], sigma[1, 1], sigma[0, 1]])
        # the points at nodes come node by node, all elements each
        nodes, count = self.mesh.triangles.T.ravel(), len(self.mesh.nodes)
        met = np.bincount(nodes, minlength=count)
        mean = np.stack([np.bincount(nodes, component, count) / np.maximum(met, 1) for component in components])
        spread = np.zeros(count)
        np.maximum.at(spread, nodes, equivalent(components - mean[:, nodes]))
        return mean, spread

    def evaluate_edge_stress(self, moved: FloatArray, held: NDArray[np.bool_]) -> tuple[FloatArray, NDArray[np.int64]]:
        """Return Cauchy's stress along the free edges at displacements (n, 2) [m], and at which nodes, (k,) each.

        Positive in tension [Pa]. On a free edge nothing acts across, so that it is all there is; nodes that are held
        (n,) are on none.
        """
        mean, _ = self.stress(moved)
        edges = self.mesh.edges[~held[self.mesh.edges].any(axis=1)]
        a, b, m = (self.mesh.nodes + moved)[edges].swapaxes(0, 1)
        stresses, nodes = [], []
        # slopes of the parabola through the three nodes, at its first, last and middle one
        for column, along in ((0, 4 * m - 3 * a - b), (1, 3 * b + a - 4 * m), (2, b - a)):
            c, s = (along / np.hypot(*along.T)[:, None]).T
            xx, yy, xy = mean[:, edges[:, column]]
            stresses.append(c * c * xx + s * s * yy + 2 * c * s * xy)
            nodes.append(edges[:, column])
        return np.concatenate(stresses), np.concatenate(nodes)


def _strain_change(f: FloatArray, df: FloatArray) -> FloatArray:
    """Return the change of Green's strain (3, k) of gradients (2, 2, k) that change so."""
    return np.stack(
        [(f[:, 0] * df[:, 0]).sum(0), (f[:, 1] * df[:, 1]).sum(0), (f[:, 0] * df[:, 1] + f[:, 1] * df[:, 0]).sum(0)]
    )


def _times(f: FloatArray, s: FloatArray) -> FloatArray:
    """Return F S (2, 2, k) of a gradient (2, 2, k) and a symmetric stress (3, k)."""
    return np.stack([f[:, 0] * s[0] + f[:, 1] * s[2], f[:, 0] * s[2] + f[:, 1] * s[1]], 1)


def equivalent(stress: FloatArray) -> FloatArray:
    """Return von Mises' equivalent (k,) [Pa] of plane stresses (3, k); on a free edge it is the stress along it."""
    xx, yy, xy = stress
    return np.asarray(np.sqrt(xx * xx - xx * yy + yy * yy + 3 * xy * xy))


@dataclass(frozen=True)
class Pattern:
    """Indices of the entries of elements in a sparse symmetric matrix."""

    slots: NDArray[np.int64]  # (k,) of each entry among the matrix's different pairs of row and column
    # pairs, indices, starts: the matrix in compressed columns: pair of each of its entries, rows, and where columns
    # start
    pairs: NDArray[np.int64]
    indices: NDArray[np.int32]
    starts: NDArray[np.int32]

    @classmethod
    def from_entries(cls, rows: NDArray[np.int64], columns: NDArray[np.int64], size: int) -> Pattern:
        """Return the pattern of a matrix with entries in these rows and columns, and as many below its diagonal."""
        pairs, slots = np.unique(np.maximum(rows, columns) * size + np.minimum(rows, columns), return_inverse=True)
        above, below = pairs % size * size + pairs // size, pairs
        keys = np.sort(np.concatenate([above, below]))  # column by column
        keys = keys[np.diff(keys, prepend=-1) > 0]
        column, row = keys // size, keys % size
        positions = np.searchsorted(pairs, np.maximum(row, column) * size + np.minimum(row, column))
        starts = np.searchsorted(keys, np.arange(size + 1) * size)
        return cls(slots, positions, row.astype(np.int32), starts.astype(np.int32))

    def assemble(self, entries: FloatArray) -> csc_array:
        """Return the matrix with the sums of the entries (k,), each of its pair."""
        size = len(self.starts) - 1
        data = np.bincount(self.slots, entries.ravel())[self.pairs]
        return csc_array((data, self.indices, self.starts), shape=(size, size))
