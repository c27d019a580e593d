"""Equations of a network whose beams touch obstacles with their sides: the places of these contacts are unknowns.

A contact at the parameter S of a beam ends an element there. Its rows are the gap g = 0 and the tangency n . t = 0 of
the beam to the obstacle (beside a slope of the thickness: n . t = dr/ds). The change of all residuals with S, at held
coefficients of the rotation, is a difference: of elements that are polynomials it has ten digits, and Newton's method
needs fewer. The matrix is not symmetric: the stationarity f n . t = 0, which would make it so, says nothing where a
contact begins.

The number of unstable directions comes from another, symmetric matrix, in which all places are held: with the force f
of a contact and the curvature g'' of its gap along the beam, tangency is a constraint of the stiffness f / g''. So P is
taken at the least gap along the beam, not at a gap that follows a material point.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.contact.equations import GapBounds, without_contacts
from cfmkit.elastica.contact.terms import press
from cfmkit.elastica.mechanics.equations import LinearEquations, NumpyEquations
from cfmkit.elastica.mechanics.moving_elements import PLACE_STEP, moved_tables
from cfmkit.elastica.mechanics.polynomials import shape_functions

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation

SMALLEST_ELEMENT = 1e-9  # of a beam: shorter ones have no equations
NEUTRAL = 1e-6  # stiffness of the motions [EI/L^3] below which a direction counts as stable: exactly critical ones do
SMALLEST_FORCE = 1e-12  # of a contact that begins, in the curvature of its gap over its force


class SideAt(NamedTuple):
    """The side of a beam at a contact: gap, tangency, and their derivatives."""

    gap: float
    tangency: float
    gap_row: FloatArray  # (3,) by x, y of the body and the rotation
    tangency_row: FloatArray  # (3,)
    hessian: FloatArray  # (3, 3) of the gap
    by_place: tuple[float, float]  # of gap and tangency at held x, y and rotation
    unknowns: Any  # (3,)
    curvature: float  # of the gap along the beam


@dataclass(frozen=True, eq=False)
class SlidingEquations(NumpyEquations):
    """Equations of a network with contacts of the sides of beams, and of nodes."""

    plain: NumpyEquations = field(kw_only=True)  # without contacts; its elements are moved to where contacts are
    watched: GapBounds | None = field(init=False)
    slots: Any = field(init=False)  # (size,) number of every unknown among the free ones, -1 where it is held

    def __post_init__(self) -> None:
        """Number the free unknowns."""
        super().__post_init__()
        slots = np.full(self.mesh.size, -1)
        slots[self.mesh.free] = np.arange(len(self.mesh.free))
        object.__setattr__(self, "slots", slots)
        nodes = tuple(one for one in self.mesh.contacts if one.slide < 0)
        watched = GapBounds(replace(self.mesh, contacts=nodes)) if nodes else None
        object.__setattr__(self, "watched", watched)

    @classmethod
    def of(cls, mesh: Discretisation, ramp: bool, make: Callable[..., NumpyEquations]) -> SlidingEquations:
        """Return the equations of a network; `make` returns those of one whose elements stand still."""
        e = mesh.elements
        if e.weight.ndim > 2:  # of several states: those of the first
            first = {name: getattr(e, name)[0] for name in (*_TABLES, "length") if getattr(e, name) is not None}
            e = e._replace(**first, moved_cuts=None)
        own = e._replace(**{name: np.array(getattr(e, name)) for name in (*_TABLES, "length")
                            if getattr(e, name) is not None})  # fmt: skip
        whole = replace(mesh, elements=own)
        return cls(whole, ramp, plain=make(replace(without_contacts(whole), moving=None), ramp))

    def rebase(self, base: FloatArray) -> SlidingEquations:
        """Return the equations with other values of the unknowns that are held, (size,)."""
        return SlidingEquations(replace(self.mesh, base=base), self.ramp, plain=self.plain.rebase(base))

    # -- places --------------------------------------------------------------------------------------------------------
    @property
    def _sides(self) -> list[ContactAt]:
        return [one for one in self.mesh.contacts if one.slide >= 0]

    def move_to(self, places: FloatArray) -> bool:
        """Move the elements of the equations without contacts to places; return False where one would vanish."""
        assert self.mesh.moving is not None
        tables = moved_tables(self.mesh, places)
        cuts = tables.pop("moved_cuts")
        if not (cuts[:, 1] - cuts[:, 0] > SMALLEST_ELEMENT).all():
            return False
        self.plain.refill(self.mesh.moving.elements, tables)
        return True

    def side_at(self, contact: ContactAt, z: FloatArray) -> SideAt:
        """Return the side of a beam at a contact; the elements stand at their places."""
        mesh, item = self.mesh, contact.item
        length, parameter = mesh.scales.length, float(z[contact.slide])
        x, y, turn, _ = mesh.attachments.unknowns[contact.place]
        place = mesh.attachments.origin[contact.place] + z[[x, y]]
        slope, bend, radius, taper = self._beam_at(contact, parameter)
        angle = slope[0] + float(z[turn])
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        found = item.outline.distance(place * length)  # type: ignore[union-attr]
        normal = np.asarray(found.normal, float)
        sideways = np.array([normal[1], -normal[0]])
        bulge = float(found.curvature) * length * np.outer(sideways, sideways)
        rises = float(normal @ across)
        hessian = np.zeros((3, 3))
        hessian[:2, :2] = bulge
        curvature = self._curvature(contact, z, bend) * rises + float(along @ bulge @ along)
        return SideAt(
            float(found.value) / length - radius, float(normal @ along) - taper, np.append(normal, 0.0),
            np.append(bulge @ along, rises), hessian, (-taper * slope[2], rises * slope[1]), [x, y, turn], curvature,
        )  # fmt: skip

    def _beam_at(self, contact: ContactAt, parameter: float) -> tuple[tuple[float, float, float], float, float, float]:
        """Return the unloaded angle, its slope and ds/dt by the parameter, curvature, half thickness and its slope."""
        mesh, item = self.mesh, contact.item
        beam, fitted = mesh.fits.network.beams[item.beam], mesh.fits[item.beam]  # type: ignore[union-attr]
        inside, step, length = float(mesh.elements.cuts[contact.element].mean()), PLACE_STEP, mesh.scales.length
        t = np.array([parameter - step, parameter, parameter + step])
        angle = np.real(fitted.angle(t, inside)) + 0.0 * t
        speed = float(np.real(fitted.speed(np.array([parameter]), inside) + np.zeros(1))[0]) / length
        along = (fitted.arc(np.clip(t, 0, 1)), float(np.real(fitted.arc(inside))))
        half = 0.5 * (np.real(beam.section.thickness_at(*along)) + 0.0 * t) / length
        turning, tapering = (angle[2] - angle[0]) / (2 * step), float(half[2] - half[0]) / (2 * step)
        return (float(angle[1]), float(turning), speed), float(turning) / speed, float(half[1]), tapering / speed

    def _curvature(self, contact: ContactAt, z: FloatArray, unloaded: float) -> float:
        """Return the curvature of the loaded beam at a contact: the mean of both elements that meet there."""
        e, total = self.plain.mesh.elements, 0.0
        columns = [3, 7, *range(8, self.mesh.degree + 7)]
        for number, end in ((contact.element, 1.0), (contact.element + 1, 0.0)):
            slopes = shape_functions(self.mesh.degree, np.array([end]))[1][0]
            total += float(slopes @ z[e.unknowns[number, columns]]) / float(e.length[number])
        return unloaded + 0.5 * total

    # -- equations -----------------------------------------------------------------------------------------------------
    def linearise(self, free: FloatArray, way: float) -> LinearEquations:
        """Return the equations linearised at some unknowns; not a number where elements vanish."""
        mesh, plain, count, slots = self.mesh, self.plain, self.plain.n, self.slots
        n, z = self.n, np.asarray(self.values(free, way))
        moved = mesh.base if self.ramp else mesh.rate
        sides = self._sides
        places = z[[one.slide for one in sides]]
        if not self.move_to(places):
            return LinearEquations(np.full(n, np.nan), np.eye(n), np.zeros(n))
        at = plain.linearise(free[:count], way)
        residual, change, tangent = np.zeros(n), np.zeros(n), np.zeros((n, n))
        residual[:count], change[:count], tangent[:count, :count] = at.residual, at.change, at.tangent
        rows: list[tuple[Any, FloatArray, float]] = []  # of the symmetric matrix: unknowns, row, pivot
        self._add_nodes(z, moved, residual, change, tangent, rows)
        for number, contact in enumerate(sides):
            force, place = slots[contact.unknown], slots[contact.slide]
            if force < 0:
                continue
            if not self.is_pressing(contact, z):
                residual[force], tangent[force, force], tangent[place, place] = -free[force], -1.0, 1.0
                continue
            side, value = self.side_at(contact, z), float(z[contact.unknown])
            own = slots[side.unknowns]
            residual[own] -= value * side.gap_row
            tangent[np.ix_(own, own)] -= value * side.hessian
            tangent[own, force] -= side.gap_row
            residual[force], residual[place] = -side.gap, side.tangency
            tangent[force, own] -= side.gap_row
            tangent[place, own] += side.tangency_row
            tangent[force, place], tangent[place, place] = -side.by_place[0], side.by_place[1]
            tangent[:count, place] += self._by_place(free[:count], way, places, number)
            rows.append((own, -side.gap_row, 0.0))
            rows.append((own, side.tangency_row, -max(side.curvature, 0.0) / max(value, SMALLEST_FORCE)))
        self.move_to(places)
        return LinearEquations(residual, tangent, change, self._frozen(tangent, rows))

    def is_pressing(self, contact: ContactAt, z: FloatArray) -> bool:
        """Return True if the side of a beam counts as touching: as it was set, or where it has a force."""
        return contact.closed if contact.closed is not None else bool(z[contact.unknown] > 0)

    def _add_nodes(
        self, z: FloatArray, moved: FloatArray, residual: FloatArray, change: FloatArray, tangent: FloatArray,
        rows: list[tuple[Any, FloatArray, float]],
    ) -> None:  # fmt: skip
        """Add the contacts of nodes."""
        if self.watched is None:
            return
        far = self.watched.are_open(z)
        for number, contact in enumerate(self.watched.mesh.contacts):
            slot = self.slots[contact.unknown]
            if far[number] or contact.closed is False:
                if slot >= 0:
                    residual[slot], tangent[slot, slot] = -z[contact.unknown], -1.0
                continue
            term = press(self.mesh, contact, z)
            slots = self.slots[term.unknowns]
            own = slots >= 0
            pushed = slots[own]
            residual[pushed] += term.gradient[own]
            tangent[np.ix_(pushed, pushed)] += term.hessian[np.ix_(own, own)]
            change[pushed] += term.hessian[own] @ moved[term.unknowns]
            rows.append((pushed[pushed != slot], term.hessian[-1, :-1][own[:-1]], float(term.hessian[-1, -1])))

    def _by_place(self, free: FloatArray, way: float, places: FloatArray, number: int) -> FloatArray:
        """Return the change of the residuals without contacts with one of the places."""
        sides = []
        for step in (PLACE_STEP, -PLACE_STEP):
            beside = places.copy()
            beside[number] += step
            if not self.move_to(beside):
                return np.full(len(free), np.nan)
            sides.append(self.plain.linearise(free, way).residual)
        return np.asarray((sides[0] - sides[1]) / (2 * PLACE_STEP))

    def _frozen(self, tangent: FloatArray, rows: list[tuple[Any, FloatArray, float]]) -> FloatArray:
        """Return the symmetric matrix of motions, section forces and conditions with all places held."""
        count = self.plain.n
        whole = np.zeros((count + len(rows), count + len(rows)))
        whole[:count, :count] = tangent[:count, :count]
        motions = np.flatnonzero(self.plain.mesh.free < self.mesh.n_motions)
        whole[motions, motions] += NEUTRAL
        for number, (own, row, pivot) in enumerate(rows, start=count):
            whole[number, own] = whole[own, number] = row
            whole[number, number] = pivot
        return whole

    def count_unstable(self, at: LinearEquations) -> int:
        """Return the number of unstable directions at a held drive, with places of contacts held."""
        from scipy.linalg import lapack

        assert at.frozen is not None
        factors, pivots, _ = lapack.dsytrf(at.frozen, lower=1)
        single = pivots > 0
        negative = int((np.diag(factors)[single] < 0).sum()) + int((~single).sum()) // 2
        forces = int((self.plain.mesh.free >= self.mesh.n_motions).sum())
        return negative - forces - (len(at.frozen) - self.plain.n)

    # -- gradients -----------------------------------------------------------------------------------------------------
    def gradient(self, free: Any, way: Any) -> Any:
        """Return the gradient by all unknowns, (size,); where they are complex by a difference along that step."""
        if np.iscomplexobj(free) or np.iscomplexobj(way):
            steps, ahead = np.imag(free), float(np.imag(way))
            size = max(float(np.abs(steps).max(initial=0.0)), abs(ahead), np.finfo(float).tiny)
            share = PLACE_STEP / size
            sides = [
                self.gradient(np.real(free) + sign * share * steps, float(np.real(way)) + sign * share * ahead)
                for sign in (1.0, -1.0)
            ]
            return 0.5 * (sides[0] + sides[1]) + 1j * (sides[0] - sides[1]) / (2 * share)
        drive, share = self.factors(way)
        return self.evaluate_gradient(np.asarray(self.values(free, way)), drive, share)

    def gradients(self, z: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the gradients by all unknowns of states (p, size), (p, size)."""
        return np.array([self.evaluate_gradient(*pair) for pair in zip(z, drive, strict=True)]).reshape(z.shape)

    def evaluate_gradient(self, z: FloatArray, drive: float, share: float = 1.0) -> FloatArray:
        """Return the gradient of one state by all unknowns; that by places is zero."""
        self.move_to(z[[one.slide for one in self._sides]])
        total = np.array(self.plain.evaluate(z, drive, share)[0])
        for contact in self.mesh.contacts:
            if not z[contact.unknown]:
                continue
            if contact.slide < 0:
                term = press(self.mesh, contact, z)
                total[term.unknowns] += term.gradient
                continue
            side = self.side_at(contact, z)
            total[side.unknowns] -= z[contact.unknown] * side.gap_row
            total[contact.unknown] -= side.gap
        return total


_TABLES = ("angle", "weight", "rigidity", "axial", "shear", "ahead", "rest", "curl", "hindrance")
