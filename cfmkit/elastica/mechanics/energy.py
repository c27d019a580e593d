"""Gradient and Hessian of the functional of a network, section forces, unstable directions; all dimensionless.

Every function takes z, the values of all unknowns, and two factors: `drive` multiplies what grows with the drive,
`share` (0 to 1) what is constant: displaced supports, constant loads, free lengths, the gap of beams that are forced
into place.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.terms import contact_contribution
from cfmkit.elastica.mechanics.discretise import Attached, BeamElements, ContactAt, Discretisation
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.mechanics.poses import AttachmentPoses, poses
from cfmkit.elastica.mechanics.terms import ENERGY_TERMS
from cfmkit.elastica.mechanics.wide_strip import bending, bending_moment
from cfmkit.numerics.dual_array import DualArray, chain, cos_sin, plain, stack

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.elastica.mechanics.terms import Contribution

SINGULAR_SHIFT = 1e-13  # added to the stiffness of the motions where it is singular to rounding
FLEXIBLE_SHARE = 1e-9  # of the largest flexibility, below which one is that of a constraint: rounding
REAL_SHARE = 1e-9  # imaginary part of an eigenvalue up to which it is real, of its size


class SectionForces:
    """Forces on sections at angles, from forces along x and y, (...) each; all are plain but for `along` and `across`.

    Angles and forces may be dual.
    """

    def __init__(self, angle: Any, h: Any, v: Any) -> None:
        self.arguments = angle, h, v
        self.cos, self.sin = cos_sin(plain(angle))
        self.normal = plain(h) * self.cos + plain(v) * self.sin  # N, along the tangent
        self.shear = plain(v) * self.cos - plain(h) * self.sin  # Q, across it

    @property
    def along(self) -> Any:
        """N with its derivatives."""
        return chain(self.normal, (self.shear, self.cos, self.sin), self.arguments)

    @property
    def across(self) -> Any:
        """Q with its derivatives."""
        return chain(self.shear, (-self.normal, -self.sin, self.cos), self.arguments)


class SectionFields(SectionForces):
    """Forces on sections, and what positions and moments are integrals of, at points of elements, (..., e, q) each.

    Tables of elements may be dual, too. `slope_x`, `slope_y` and `turning` have derivatives then.
    """

    curvature: Any  # phi' by the element's parameter, of `compute_fields`

    def __init__(self, elements: BeamElements, angle: Any, h: Any, v: Any) -> None:
        """Compute the forces; the rest when it is needed."""
        super().__init__(angle, h, v)
        self.all_arguments = *self.arguments, elements.axial, elements.shear
        self.is_dual = any(isinstance(argument, DualArray) for argument in self.all_arguments)
        self.axial, self.slip = plain(elements.axial), plain(elements.shear)

    @property
    def factors(self) -> tuple[Any, Any]:
        """1 + (a - b) N and (a - b) Q."""
        softer = self.axial - self.slip
        return 1 + softer * self.normal, softer * self.shear

    @property
    def slope_x(self) -> Any:
        """dX/ds."""
        return self._slope(self.cos, self.sin)

    @property
    def slope_y(self) -> Any:
        """dY/ds."""
        return self._slope(self.sin, -self.cos)

    def _slope(self, along: Any, across: Any) -> Any:
        """Return the share of dX/ds in a direction that has these shares along the section's tangent and normal."""
        axial, slip = self.axial, self.slip
        value = (1 + axial * self.normal) * along - slip * self.shear * across
        if not self.is_dual:
            return value
        f, g = self.factors
        by_h, by_v = (axial * along * h + slip * across * v for h, v in ((self.cos, self.sin), (self.sin, -self.cos)))
        partials = g * along - f * across, by_h, by_v, self.normal * along, -self.shear * across
        return chain(value, partials, self.all_arguments)

    @property
    def turning(self) -> Any:
        """-dM/ds."""
        f, g = self.factors
        if not self.is_dual:
            return self.shear * f
        by_force = g * self.cos - f * self.sin, g * self.sin + f * self.cos
        by_tables = self.shear * self.normal, -self.shear * self.normal
        partials = g * self.shear - f * self.normal, *by_force, *by_tables
        return chain(self.shear * f, partials, self.all_arguments)


def compute_fields(mesh: Discretisation, z: Any, drive: Any, share: Any = 1.0) -> SectionFields:
    """Return rotations and section forces at the Gauss points, of one state (size,) or of several (n, size)."""
    e, rule = mesh.elements, basis(mesh.degree)
    element_unknowns = z[..., e.unknowns]
    rotation = element_unknowns[..., rotation_columns(mesh.degree)]
    load = line_load(mesh, drive, share)
    h, v = (element_unknowns[..., axis - 2, None] + load[..., axis, None] * e.ahead for axis in (0, 1))
    at = SectionFields(e, e.angle + rotation @ rule.values.T, h, v)
    at.curvature = rotation @ rule.slopes.T
    if e.laid is not None:
        at.normal = np.where(e.laid[..., None], element_unknowns[..., None, -2], at.normal)
        at.shear = np.where(e.laid[..., None], 0.0, at.shear)
    return at


@lru_cache(maxsize=64)
def rotation_columns(degree: int) -> Any:
    """Return which of an element's unknowns are coefficients of its rotation: own rotations of both ends, bubbles."""
    return read_only([3, 7, *range(8, degree + 7)], np.int64)


def line_load(mesh: Discretisation, drive: Any, share: Any = 1.0) -> Any:
    """Return the line load on the elements, (..., e, 2), at one drive or several (n,)."""
    line = mesh.elements.line
    return share * line[..., 0, :] + np.asarray(drive)[..., None, None] * line[..., 1, :]


def gradient(mesh: Discretisation, z: Any, drive: Any, share: Any = 1.0) -> Any:
    """Return the gradient of the functional by all unknowns, (size,); complex where z or the arrays are."""
    element_rows, kind = element_gradients(mesh, z, drive, share)
    parts = [evaluate_term(mesh, acting, z, drive, share) for acting in mesh.acting]
    total = np.zeros(mesh.size, np.result_type(kind, *(part.gradient for part in parts)))
    np.add.at(total, mesh.elements.unknowns, element_rows)
    for part in parts:
        np.add.at(total, part.unknowns, part.gradient)
    return total


def evaluate_term(
    mesh: Discretisation, acting: Attached | ContactAt, z: Any, drive: Any, share: Any = 1.0
) -> Contribution:
    """Return the term of a spring, a load or a contact in one state."""
    if isinstance(acting, ContactAt):
        return contact_contribution(mesh, acting, z)
    return ENERGY_TERMS[type(acting.item)](mesh, acting, z, share, drive)


def _end_poses(mesh: Discretisation, z: Any) -> tuple[AttachmentPoses, AttachmentPoses]:
    """Return the poses of the first and of the last ends of all elements."""
    return tuple(poses(mesh.attachments, z, mesh.elements.ends[:, side]) for side in (0, 1))  # type: ignore[return-value]


def element_gradients(mesh: Discretisation, z: Any, drive: Any, share: Any) -> tuple[Any, Any]:
    """Return the gradients of the elements by their unknowns, (..., e, degree + 9), and their type.

    Of one state (size,) or of several (n, size).
    """
    parts = dict(element_forces(mesh, z, drive, share))
    e, kind = mesh.elements, np.result_type(*parts.values())
    shape = np.broadcast_shapes(*(part.shape[:-1] for part in parts.values()))
    gradients = np.zeros((*shape, e.unknowns.shape[1]), kind)
    for columns, part in parts.items():
        gradients[..., list(columns)] = part
    return gradients, kind


def element_forces(mesh: Discretisation, z: Any, drive: Any, share: Any) -> Iterator[tuple[tuple[int, ...], Any]]:
    """Yield columns of the elements' unknowns (c,), and the gradients of the elements by them, (..., e, c).

    The arrays of the network, and the unknowns, may be dual.
    """
    e, rule, at = mesh.elements, basis(mesh.degree), compute_fields(mesh, z, drive, share)
    start, end = _end_poses(mesh, z)
    last = z[..., e.unknowns[:, -2:]]
    first = last + line_load(mesh, drive, share) * e.length[..., None]
    bend = e.weight * bending_moment(e, at.curvature)
    turned = bend @ rule.slopes - (e.weight * at.turning) @ rule.values
    reach = stack([(e.weight * at.slope_x).sum(axis=-1), (e.weight * at.slope_y).sum(axis=-1)])
    count = e.unknowns.shape[1]
    yield tuple(rotation_columns(mesh.degree).tolist()), turned
    yield (0, 1, 2), -start.generalised_forces(first)
    yield (4, 5, 6), end.generalised_forces(last)
    yield (count - 2, count - 1), end.place - start.place - reach - (1.0 - share) * e.gap


def hessian(mesh: Discretisation, z: Any, drive: Any, share: Any = 1.0) -> Any:
    """Return the Hessian by all unknowns, (size, size): symmetric unless loads follow."""
    e, rule, at = mesh.elements, basis(mesh.degree), compute_fields(mesh, z, drive, share)
    start, end = _end_poses(mesh, z)
    columns, (f, g) = rotation_columns(mesh.degree), at.factors
    blocks = np.zeros((*e.unknowns.shape, e.unknowns.shape[1]))
    bend, turn = e.weight * bending(e, at.curvature).stiffness, e.weight * (at.normal * f - g * at.shear)
    slopes, values = rule.slopes, rule.values
    bending_block = (slopes.T * bend[:, None, :]) @ slopes
    blocks[:, columns[:, None], columns] = bending_block + (values.T * turn[:, None, :]) @ values
    by_force = np.stack([g * at.cos - f * at.sin, g * at.sin + f * at.cos], axis=1) * e.weight[:, None, :]
    coupling = -(by_force @ values)
    for axis in (0, 1):
        blocks[:, columns, axis - 2] = blocks[:, axis - 2, columns] = coupling[:, axis]
    blocks[:, -2:, 0:3], blocks[:, -2:, 4:7] = -start.jacobian, end.jacobian
    blocks[:, 0:3, -2:], blocks[:, 4:7, -2:] = -start.jacobian.transpose(0, 2, 1), end.jacobian.transpose(0, 2, 1)
    blocks[:, -2, -2] = -(e.weight * (e.axial * at.cos**2 + e.shear * at.sin**2)).sum(axis=1)
    blocks[:, -1, -1] = -(e.weight * (e.axial * at.sin**2 + e.shear * at.cos**2)).sum(axis=1)
    blocks[:, -2, -1] = blocks[:, -1, -2] = -(e.weight * (e.axial - e.shear) * at.cos * at.sin).sum(axis=1)
    last = z[e.unknowns[:, -2:]]
    first = last + line_load(mesh, drive, share) * e.length[:, None]
    blocks[:, 2, 2] += (first * start.arm).sum(axis=1)
    blocks[:, 6, 6] -= (last * end.arm).sum(axis=1)
    total = np.zeros((mesh.size, mesh.size))
    np.add.at(total, (e.unknowns[:, :, None], e.unknowns[:, None, :]), blocks)
    for acting in mesh.acting:
        part = evaluate_term(mesh, acting, z, drive, share)
        np.add.at(total, (part.unknowns[:, None], part.unknowns), part.hessian)
    return total


def expand_unknowns(mesh: Discretisation, free: Any, drive: Any, share: Any = 1.0) -> Any:
    """Return all unknowns from the free ones: held ones are displaced by their share, and by the drive."""
    z = share * mesh.base + drive * mesh.rate
    z = z.astype(np.result_type(z, free))
    z[mesh.free] = free
    return z


def count_unstable(mesh: Discretisation, tangent: Any) -> int:
    """Return the number of unstable directions at a held drive from the tangent of the free unknowns [Ha].

    Without loads that follow: the negative pivots of L D L^T less one for every component of a section force. Those
    are maxima of the functional, or constraints with one negative and one positive pivot each; so are forces of
    contacts, those of open ones, too. Under loads that follow: the negative real eigenvalues of the motions' stiffness.
    Where a contact slips the tangent is not symmetric: then 1 where the sign of its determinant says that it has
    passed a limit point, else 0.
    """
    if any(_slips(mesh, contact, tangent) for contact in mesh.contacts if contact.rub >= 0):
        odd = int((mesh.free >= mesh.n_motions).sum()) % 2
        return int(np.linalg.slogdet(tangent)[0] * (-1) ** odd < 0)

    if any(load.item.follows for load in mesh.loads):
        return int(count_divergent(mesh, tangent[None])[0])

    return count_negative_pivots(tangent) - int((mesh.free >= mesh.n_motions).sum())


def count_negative_pivots(matrix: Any) -> int:
    """Return the number of negative pivots of L D L^T of a symmetric matrix."""
    from scipy.linalg import lapack

    factors, pivots, _ = lapack.dsytrf(matrix, lower=1)
    single = pivots > 0
    return int((np.diag(factors)[single] < 0).sum()) + int((~single).sum()) // 2


def _slips(mesh: Discretisation, contact: ContactAt, tangent: Any) -> bool:
    """Return True if a tangent is that of a contact that slips: its tangential force follows the normal one."""
    both = np.searchsorted(mesh.free, [contact.unknown, contact.rub])
    if both[-1] >= len(mesh.free) or (mesh.free[both] != [contact.unknown, contact.rub]).any():
        return False
    return bool(tangent[both[1], both[0]] != 0)


def count_divergent(mesh: Discretisation, tangents: Any) -> Any:
    """Return the number of negative real eigenvalues of the motions' stiffness in tangents (k, n, n), (k,)."""
    moves = np.flatnonzero(mesh.free < mesh.n_motions)
    unit = np.zeros((len(mesh.free), len(moves)))
    unit[moves, np.arange(len(moves))] = 1.0
    inverse = np.linalg.eigvals(np.linalg.solve(tangents, unit)[:, moves])
    size = np.abs(inverse)
    flexible = size > FLEXIBLE_SHARE * size.max(axis=1, keepdims=True, initial=0.0)
    return ((np.abs(inverse.imag) < REAL_SHARE * size) & flexible & (inverse.real < 0)).sum(axis=1)
