"""Exact derivatives of equilibria by design variables: of the effort by the adjoint, of everything by the tangent.

The functional P depends on a design through the arrays of a `Discretisation` alone. With w, the motion of all unknowns
per unit of what the drive moves while its loads stay,

    dE/dx = w . d(grad P)/dx = d/dx dP(z + s w)/ds   at s = 0,

so that the derivatives of P by its arrays, evaluated at z + i s w, give those of the effort E: no system is solved, for
the tangent is symmetric and w the slope of the path. Loads that grow with the drive, or follow, need one solution a
point, other outputs one for every variable: dz/dx = -K^-1 d(grad P)/dx.

References
----------
[TMM] D. A. Tortorelli, P. Michaleris, Inverse Problems in Engineering 1 (1994) 71: the adjoint.
[SMW] W. Squire, G. Trapp, SIAM Review 40 (1998) 110: complex steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.designs import design_of
from cfmkit.elastica.mechanics.discretise import Attached, ContactAt, Discretisation
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.moving_elements import with_places
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.mechanics.wide_strip import bending
from cfmkit.numerics.dual_array import COMPLEX_STEP, DualArray, cos_sin, slopes_of

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.designs import NetworkDesigns

MAX_TOGETHER = 300_000  # numbers of a table of all designs at some points: 5 MB


@dataclass(frozen=True)
class Equilibria:
    """Points of a path: all unknowns (p, size) and the drive (p,), dimensionless; what is constant is all there."""

    mesh: Discretisation
    z: FloatArray
    drive: FloatArray

    def __post_init__(self) -> None:
        """Move the elements to the places of contacts, which each point has for itself."""
        if self.mesh.moving is not None:
            object.__setattr__(self, "mesh", with_places(self.mesh, self.z))

    @cached_property
    def residual(self) -> FloatArray:
        """Gradient of the functional by all unknowns at every point, (p, size): zero at free ones."""
        return read_only(equations(self.mesh).gradients(self.z, self.drive))


def partials(mesh: Discretisation, z: Any, drive: Any, names: Collection[str]) -> dict[str, Any]:
    """Return the derivatives of the functional by some arrays, (p, ...) each.

    By name those of `Elements`, and `origin`, `arm` and `frame` of the attachments that elements end at.
    """
    e, at, load = mesh.elements, energy.compute_fields(mesh, z, drive), energy.line_load(mesh, drive)
    w, bent = e.weight, bending(e, at.curvature)

    def places_of_starts() -> Any:
        return poses(mesh.attachments, z, e.ends[:, 0]).place

    def differentiate_by_line() -> Any:
        reach = np.stack([(w * e.ahead * slope).sum(axis=-1) for slope in (at.slope_x, at.slope_y)], axis=-1)
        constant, grows = -(places_of_starts() * e.length[:, None] + reach), np.asarray(drive)[..., None, None]
        return np.stack([constant + 0 * grows, constant * grows], axis=-2)

    by_elements: dict[str, Callable[[], Any]] = {
        "weight": lambda: bent.energy - at.normal - (e.axial * at.normal**2 + e.shear * at.shear**2) / 2,
        "rigidity": lambda: w * bent.energy / e.rigidity,
        "rest": lambda: w * bent.by_rest,
        "curl": lambda: w * bent.by_curl,
        "hindrance": lambda: w * bent.by_hindrance,
        "angle": lambda: -w * at.turning,
        "axial": lambda: -w * at.normal**2 / 2,
        "shear": lambda: -w * at.shear**2 / 2,
        "ahead": lambda: -w * (at.slope_x * load[..., :1] + at.slope_y * load[..., 1:]),
        "length": lambda: -(load * places_of_starts()).sum(axis=-1),
        "line": differentiate_by_line,
    }
    if {"origin", "arm", "frame"} & {*names}:
        by_elements |= _differentiate_attachments(mesh, z, load)
    return {name: by_elements[name]() for name in names}


def _differentiate_attachments(mesh: Discretisation, z: Any, load: Any) -> dict[str, Callable[[], Any]]:
    """Return functions for the derivatives by origin, arm and frame, from the forces on both ends of every element."""
    a, e = mesh.attachments, mesh.elements
    last = z[..., e.unknowns[:, -2:]]
    force = np.zeros((*z.shape[:-1], *a.arm.shape), np.result_type(z, load))
    force[..., e.ends[:, 0], :] -= last + load * e.length[..., None]  # no two elements have one start, or one end
    force[..., e.ends[:, 1], :] += last
    x, y, turn = (z[..., a.unknowns[:, k]] for k in range(3))
    fx, fy = force[..., 0], force[..., 1]

    def differentiate_by_arm() -> Any:
        cos, sin = cos_sin(turn)
        return np.stack([cos * fx + sin * fy, cos * fy - sin * fx], axis=-1)

    return {
        "origin": lambda: force,
        "arm": differentiate_by_arm,
        "frame": lambda: np.stack([fx * x + fy * y, fy * x - fx * y], axis=-1),
    }


def effort_motions(at: Equilibria, rates: FloatArray) -> FloatArray:
    """Return w, the motion of all unknowns that the effort of a drive by a motion is the work of, (p, size).

    The slopes of the free unknowns along the path, `rates` (p, n), are w unless loads grow with the drive, or follow.
    """
    mesh, chosen = at.mesh, at.mesh.free
    motions = np.tile(mesh.rate, (len(at.z), 1))
    motions[:, chosen] = rates
    if any(load.grows or load.item.follows for load in mesh.loads) or mesh.elements.line[:, 1].any():
        for k, (z, drive) in enumerate(zip(at.z, at.drive, strict=True)):
            tangent = energy.hessian(mesh, z, drive)
            right = mesh.rate @ tangent[:, chosen]
            motions[k, chosen] = -np.linalg.solve(tangent[np.ix_(chosen, chosen)].T, right)
    return motions


def effort_slopes(
    at: Equilibria,  # under a drive by a motion, of the designs' template
    designs: NetworkDesigns,  # a complex step of `COMPLEX_STEP` in each variable
    rates: FloatArray,  # (p, n): slopes of the free unknowns along the path
) -> FloatArray:
    """Return the derivatives of the effort by variables at points of a path, (p, k) [N or N m]."""
    mesh, motions = at.mesh, effort_motions(at, rates)
    stepped = at.z + 1j * COMPLEX_STEP * motions
    idle = {"gap"} if mesh.elements.line.any() else {"gap", "ahead", "length"}  # the effort does not depend on these
    changes = {
        name: table
        for name, table in (designs.tables | designs.places).items()
        if np.iscomplexobj(table) and name not in idle and table.imag.any()
    }
    by_table = partials(mesh, stepped, at.drive, changes)
    total = np.zeros((len(at.z), designs.count))
    for name, table in changes.items():
        slopes = np.imag(by_table[name]).reshape(len(at.z), -1) / COMPLEX_STEP
        total += slopes @ (table.imag.reshape(designs.count, -1) / COMPLEX_STEP).T
    for k, d, unknowns, slopes in _term_slopes(at, designs, None):
        total[k, d] += slopes @ motions[k, unknowns]
    if designs.held_slopes is not None:
        total += _held_forces(at, motions) @ designs.held_slopes.T
    return np.asarray(total * mesh.scales.moment / mesh.scales.drive)


def _term_slopes(
    at: Equilibria, designs: NetworkDesigns, held: FloatArray | None
) -> Iterator[tuple[int, int, Any, FloatArray]]:
    """Yield point, design, unknowns and derivatives of the gradient by them: of springs, loads, contacts that change.

    Where `held` unknowns move with the variables, (k, size), all of them answer.
    """
    for d in range(designs.count if at.mesh.acting else 0):
        network = design_of(designs, d)
        moved = at.z if held is None else at.z + 1j * COMPLEX_STEP * held[d]
        for acting in network.acting:
            if held is None and not _is_stepped(network, acting):
                continue
            for k, drive in enumerate(at.drive.tolist()):
                part = energy.evaluate_term(network, acting, moved[k], drive)
                yield k, d, part.unknowns, np.imag(part.gradient) / COMPLEX_STEP


def _is_stepped(network: Discretisation, acting: Attached | ContactAt) -> bool:
    """Return True if a number of what acts on attachments, or of these, has a complex step."""
    places = [acting.place] if isinstance(acting, ContactAt) else list(acting.places)
    fields = vars(acting.item).values()
    numbers = [value for value in fields if isinstance(value, complex | tuple | np.ndarray | np.number)]
    arrays = [getattr(network.attachments, name)[places] for name in ("origin", "arm", "frame")]
    return any(bool(np.imag(np.asarray(value)).any()) for value in (*numbers, *arrays))


def _held_forces(at: Equilibria, motions: FloatArray) -> FloatArray:
    """Return the derivatives of the effort by the values of held unknowns, (p, size); zero at free ones."""
    mesh, forces = at.mesh, np.zeros(at.z.shape)
    held = np.setdiff1d(np.arange(mesh.size), mesh.free)
    for k, (z, drive) in enumerate(zip(at.z, at.drive, strict=True)):
        tangent = energy.hessian(mesh, z, drive)
        forces[k, held] = motions[k] @ tangent[:, held]
    return forces


def unknown_slopes(at: Equilibria, designs: NetworkDesigns, forces: FloatArray) -> FloatArray:
    """Return the derivatives of all unknowns by variables, (p, k, size), from those of the gradient (`force_slopes`).

    Raises LinAlgError if a tangent is singular.
    """
    mesh, chosen = at.mesh, at.mesh.free
    system = equations(mesh)
    slopes = np.zeros((len(at.z), designs.count, mesh.size))
    if designs.held_slopes is not None:
        slopes += designs.held_slopes
    for k, (z, drive) in enumerate(zip(at.z, at.drive.tolist(), strict=True)):
        slopes[k][:, chosen] = system.resolve(z[chosen], drive, -forces[k][:, chosen])[0]
    if not np.isfinite(slopes).all():
        raise np.linalg.LinAlgError("the tangent is singular")
    return slopes


def force_slopes(at: Equilibria, designs: NetworkDesigns) -> FloatArray:
    """Return the derivatives of the gradient by variables where free unknowns stay, (p, k, size).

    Held ones move with their support, to which every spring and load at them answers.
    """
    mesh, unknowns = at.mesh, at.mesh.elements.unknowns
    moved: Any = at.z
    stepped, held = dual_arrays(designs), designs.held_slopes
    if held is not None:
        moved = DualArray(at.z, held[:, None])
    totals = np.zeros((len(at.z), designs.count, mesh.size))
    together = max(1, MAX_TOGETHER // (designs.count * mesh.elements.angle.size))
    for first in range(0, len(at.z), together):
        some = slice(first, first + together)
        for columns, force in energy.element_forces(stepped, moved[some], at.drive[some], 1.0):
            change = np.moveaxis(slopes_of(force, designs.count, force.shape), 0, 1)
            for element, rows in enumerate(unknowns[:, list(columns)]):  # all different, unlike those of all elements
                totals[some, :, rows] += change[:, :, element]
    for k, d, rows, slopes in _term_slopes(at, designs, held):
        np.add.at(totals[k, d], rows, slopes)
    return totals


def dual_arrays(designs: NetworkDesigns) -> Discretisation:
    """Return the arrays of the template; those that a variable changes are dual."""
    network = designs.template
    elements, attachments = network.elements, network.attachments
    return replace(
        network,
        elements=elements._replace(**_dual(elements, designs.tables)),
        attachments=attachments._replace(**_dual(attachments, designs.places)),
    )


def _dual(owner: Any, stepped: dict[str, Any]) -> dict[str, Any]:
    """Return the arrays of an owner that have a complex step."""
    changed = {name: array.imag for name, array in stepped.items() if np.iscomplexobj(array) and array.imag.any()}
    return {name: DualArray(getattr(owner, name), steps / COMPLEX_STEP) for name, steps in changed.items()}
