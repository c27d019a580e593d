"""Equations of a network whose beams touch something with their sides: places of contacts are unknowns.

A contact at the parameter S of a beam ends an element there. Its rows are the gap g = 0 and the tangency n . t = 0 of
the beam to the obstacle (beside a slope of the thickness: n . t = dr/ds; of beams that shear see `line_tangent.py`).
The change of all residuals with S, at held coefficients of the rotation, is exact for beams of one thickness whose
unloaded angle is a polynomial; else it is a difference of ten digits, of which Newton's method needs fewer. The matrix
is not symmetric: the stationarity f n . t = 0, which would make it so, says nothing where a contact begins.

The number of unstable directions comes from another, symmetric matrix, in which all places are held: with the force f
of a contact and the curvature g'' of its gap along the beam, tangency is a constraint of the stiffness f / g''. So P is
taken at the least gap along the beam, not at a gap that follows a material point.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.contact.edges import find_leading, find_motion, measure_distance
from cfmkit.elastica.contact.equations import EquationsWithNodes, SymmetricRow, open_all_contacts
from cfmkit.elastica.contact.laid_elements import LaidPart, compute_laid_rows
from cfmkit.elastica.contact.line_tangent import line_leaves_normal, measure_compliances, measure_line_tangent
from cfmkit.elastica.contact.terms import contact_contribution
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.equations import LinearEquations
from cfmkit.elastica.mechanics.moving_elements import (
    MOVED_TABLES,
    PLACE_STEP,
    compute_moved_tables,
    copy_moved_tables,
    unloaded_beam_at,
)
from cfmkit.elastica.mechanics.polynomials import shape_functions
from cfmkit.elastica.model.beam_fits import has_polynomial_angle
from cfmkit.numerics.dual_array import COMPLEX_STEP

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation
    from cfmkit.elastica.mechanics.equations import NumpyEquations

SMALLEST_ELEMENT = 1e-9  # of a beam: shorter ones have no equations
NEUTRAL_STIFFNESS = 1e-6  # of the motions [EI/L^3] below which a direction counts as stable: exactly critical ones
SMALLEST_FORCE = 1e-12  # of a contact that begins, in the curvature of its gap over its force


class LinearisedSides(LinearEquations):
    """The equations at some unknowns, and what their stability is counted from."""

    frozen: FloatArray  # (m, m) symmetric, with places of contacts held
    n_laid: int  # elements that lie on obstacles: each has one force


class SideAt(NamedTuple):
    """The side of a beam at a contact: gap, tangency, and their derivatives."""

    gap: float
    tangency: float
    gap_row: FloatArray  # (m,) by x, y of the body and the rotation, and by what moves the edge that it touches
    tangency_row: FloatArray  # (m,)
    hessian: FloatArray  # (m, m) of the gap
    by_place: tuple[float, float]  # of gap and tangency at held x, y and rotation
    unknowns: Any  # (m,)
    curvature: float  # of the gap along the beam
    rises: float  # normal . across, 1 or -1 where it is tangent
    bulge: float  # curvature of the obstacle there
    along: FloatArray  # (2,) along the beam
    frozen_row: FloatArray  # (m,) `tangency_row` by what is unknown while all places and forces of contacts are held


class SlidingEquations(EquationsWithNodes):
    """Equations of a network with contacts of the sides of beams, and of nodes.

    The elements of the equations without contacts are moved to where contacts are.
    """

    @classmethod
    def from_mesh(cls, mesh: Discretisation, ramp: bool, make: Callable[..., NumpyEquations]) -> SlidingEquations:
        """Return the equations of a network; `make` returns those of one whose elements stand still."""
        mesh = copy_moved_tables(mesh)
        return cls(mesh, ramp, plain=make(replace(open_all_contacts(mesh), moving=None), ramp))

    # -- places --------------------------------------------------------------------------------------------------------
    def move_to(self, places: FloatArray) -> bool:
        """Move the elements of the equations without contacts to places; return False where one would vanish."""
        assert self.mesh.moving is not None
        tables = compute_moved_tables(self.mesh, places)
        cuts = tables.pop("moved_cuts")
        if not (cuts[:, 1] - cuts[:, 0] > SMALLEST_ELEMENT).all():
            return False
        self.plain.refill(self.mesh.moving.elements, tables)
        return True

    def find_laid_parts(self, z: FloatArray) -> list[LaidPart]:
        """Return the elements that lie on obstacles; the elements stand at their places."""
        edge = []
        for contact in self.mesh.side_contacts:
            side = contact.laid if contact.closed is not None else int(np.rint(z[contact.flag]))
            if not side:
                continue
            seen = self.side_at(contact, z)
            # of the line on which the middle of the beam lies once the gap is closed
            bulge = seen.bulge / (1 - seen.bulge * seen.gap) if seen.bulge else 0.0
            edge.append(LaidPart(contact.element + (side > 0), contact, -float(np.sign(seen.rises)) * bulge))
        return edge

    def _lay(self, parts: list[LaidPart]) -> None:
        """Take the energy of elements that lie on obstacles out of the equations without contacts."""
        e = self.plain.mesh.elements
        for part in parts:
            rows = np.array([part.element])
            names = [name for name in (*MOVED_TABLES, "length") if getattr(e, name) is not None]
            tables = {name: getattr(e, name)[rows] for name in names}
            for name in ("weight", "ahead", "length"):
                tables[name] = 0.0 * tables[name]
            self.plain.refill(rows, tables)

    def _drop_tension(self, z: FloatArray, parts: list[LaidPart]) -> FloatArray:
        """Return unknowns in which nothing pulls along an obstacle."""
        if not parts:
            return z
        edge = z.copy()
        for part in parts:
            edge[self.mesh.elements.unknowns[part.element, -2:]] = 0.0
        return edge

    def side_at(self, contact: ContactAt, z: FloatArray) -> SideAt:
        """Return the side of a beam at a contact; the elements stand at their places."""
        mesh, item = self.mesh, contact.item
        parameter = float(z[contact.slide])
        x, y, turn, _ = mesh.attachments.unknowns[contact.place]
        place = mesh.attachments.origin[contact.place] + z[[x, y]]
        slope, bend, radius, taper = unloaded_beam_at(self.mesh, contact, parameter)
        angle = slope[0] + float(z[turn])
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        edge, motion = measure_distance(mesh, item, place, z), find_motion(mesh, item, z)  # type: ignore[arg-type]
        normal = np.asarray(edge.normal, float)
        sideways = np.array([normal[1], -normal[0]])
        bulge = float(edge.curvature) * np.outer(sideways, sideways)
        rises = float(normal @ across)
        apart = np.hstack([np.eye(2), np.zeros((2, 1)), -motion.jacobian])  # of the place, as seen from the edge
        turning, hessian = (bulge @ along) @ apart, apart.T @ bulge @ apart
        turning[2] = rises
        if len(motion.unknowns):
            hessian[-1, -1] += normal @ motion.arm
        bent = self._curvature(contact, z, bend)
        side = SideAt(
            float(edge.value) - radius, float(normal @ along) - taper, normal @ apart, turning, hessian,
            (-taper * slope[2], rises * slope[1]), np.append([x, y, turn], motion.unknowns),
            bent * rises + float(along @ bulge @ along), rises, float(edge.curvature), along, turning,
        )  # fmt: skip
        if not line_leaves_normal(mesh.fits.network.beams[item.beam].section):  # type: ignore[union-attr]
            return side
        force, forces = float(z[contact.unknown]), mesh.elements.unknowns[[contact.element, contact.element + 1], -2:]
        compliances = measure_compliances(mesh, item.beam, parameter)  # type: ignore[union-attr]
        at = measure_line_tangent(angle, normal, z[forces[0]] - 0.5 * force * normal, *compliances)
        # by the force before the kink and that of the contact; with all places held by the forces on both sides of it
        leaning, frozen = (bulge @ (at.slope - 0.5 * force * at.by_force)) @ apart, (bulge @ at.slope) @ apart
        leaning[2] = frozen[2] = at.by_turn
        half, turn_by_place = 0.5 * at.by_force, float(at.by_turn) * slope[1]
        return side._replace(
            tangency=float(at.across) - taper, gap_row=np.pad(side.gap_row, (0, 5)), hessian=np.pad(hessian, (0, 5)),
            tangency_row=np.concatenate([leaning, at.by_force, (0.0, 0.0, -half @ normal)]),
            frozen_row=np.concatenate([frozen, half, half, (0.0,)]), by_place=(side.by_place[0], turn_by_place),
            unknowns=np.concatenate([side.unknowns, *forces, (contact.unknown,)]), along=at.slope,
            curvature=bent * float(at.by_turn) + float(at.slope @ bulge @ at.slope),
        )  # fmt: skip

    def _curvature(self, contact: ContactAt, z: FloatArray, unloaded: float) -> float:
        """Return the curvature of the loaded beam at a contact: the mean of both elements that meet there."""
        e, curvatures = self.plain.mesh.elements, list[float]()
        columns = [3, 7, *range(8, self.mesh.degree + 7)]
        for number, end in ((contact.element, 1.0), (contact.element + 1, 0.0)):
            if e.length[number]:  # else it lies on the obstacle
                slopes = shape_functions(self.mesh.degree, np.array([end]))[1][0]
                curvatures.append(float(slopes @ z[e.unknowns[number, columns]]) / float(e.length[number]))
        return unloaded + sum(curvatures) / max(len(curvatures), 1)

    # -- equations -----------------------------------------------------------------------------------------------------
    def linearise(self, free: FloatArray, place: float) -> LinearEquations:
        """Return the equations linearised at some unknowns; not a number where elements vanish."""
        mesh, count, slots = self.mesh, self.plain.n, self.slots
        n, z = self.n, np.asarray(self.values(free, place))
        moved = mesh.base if self.ramp else mesh.rate
        sides = self.mesh.side_contacts
        places = z[[contact.slide for contact in sides]]
        if not self.move_to(places):
            nowhere = LinearisedSides(np.full(n, np.nan), np.eye(n), np.zeros(n))
            nowhere.frozen, nowhere.n_laid = np.eye(n), 0
            return nowhere
        laid = self.find_laid_parts(z)
        self._lay(laid)
        bare = self._drop_tension(z, laid)[mesh.free][:count]
        placed = self.place_among_all(self.plain.linearise(bare, place))
        residual, tangent, change = placed
        for part in laid:
            self._lay_rows(part, z, residual, tangent)
        rows = self.add_nodes(z, placed)
        pressing: dict[int, tuple[SideAt, int]] = {}  # sides that touch by their forces, with their last rows
        for number, contact in enumerate(sides):
            force, slide, flag = slots[contact.unknown], slots[contact.slide], slots[contact.flag]
            tangent[flag, flag] = 1.0
            if contact.closed is not None:
                residual[flag] = z[contact.flag] - contact.laid
            if not self.is_pressing(contact, z):
                residual[force], tangent[force, force], tangent[slide, slide] = -free[force], -1.0, 1.0
                continue
            side, value = self.side_at(contact, z), float(z[contact.unknown])
            inside, rate = slots[side.unknowns] >= 0, moved[side.unknowns]
            indices, press_row, turn_row = slots[side.unknowns][inside], side.gap_row[inside], side.tangency_row[inside]
            leading = find_leading(self.mesh, contact)
            if leading is contact:
                residual[indices] -= value * press_row
                change[indices] -= value * (side.hessian @ rate)[inside]
                tangent[np.ix_(indices, indices)] -= value * side.hessian[np.ix_(inside, inside)]
                tangent[indices, force] -= press_row
                residual[force], change[force] = -side.gap, -side.gap_row @ rate
                tangent[force, indices] -= press_row
                tangent[force, slide] = -side.by_place[0]
                rows.append(SymmetricRow(indices[indices < count], -press_row[indices < count], 0.0))
            else:
                residual[force] = z[leading.unknown] - value
                tangent[force, force], tangent[force, slots[leading.unknown]] = -1.0, 1.0
            residual[slide], change[slide] = side.tangency, side.tangency_row @ rate
            tangent[slide, indices] += turn_row
            tangent[slide, slide] = side.by_place[1]
            tangent[:count, slide] += self._differentiate_by_place(bare, place, z, number, laid)
            pressing[contact.unknown] = side, len(rows)
            bound = any(part.element in (contact.element, contact.element + 1) for part in laid)
            stiffness = 0.0 if bound else -max(side.curvature, 0.0) / max(value, SMALLEST_FORCE)
            rows.append(SymmetricRow(indices[indices < count], side.frozen_row[inside][indices < count], stiffness))
        self.move_to(places)
        at = LinearisedSides(residual, tangent, change)
        at.frozen, at.n_laid = self._frozen(tangent, rows, laid, z), len(laid)
        self._couple_places(at.frozen[count:, count:], pressing, z)
        return at

    def _couple_places(self, pivots: FloatArray, pressing: dict[int, tuple[SideAt, int]], z: FloatArray) -> None:
        """Put the mixed curvature of the gap of two beams, by both places, among the pivots of conditions."""
        for contact in self.mesh.side_contacts:
            leading = find_leading(self.mesh, contact)
            if leading is not contact and contact.unknown in pressing:
                (side, row), (partner, row_of_leading) = pressing[contact.unknown], pressing[leading.unknown]
                mixed = float(partner.tangency_row[3:5] @ side.along) / max(float(z[leading.unknown]), SMALLEST_FORCE)
                pivots[[row, row_of_leading], [row_of_leading, row]] = -mixed

    def _lay_rows(self, part: LaidPart, z: FloatArray, residual: FloatArray, tangent: FloatArray) -> None:
        """Put the equations of an element that lies on an obstacle in the place of those of a free one."""
        indices = self.mesh.elements.unknowns[part.element]
        inner = self.slots[indices[8:]]
        residual[inner] = z[indices[8:]]
        tangent[inner], tangent[:, inner] = 0.0, 0.0
        tangent[inner, inner] = 1.0
        unknowns, rows, slopes = compute_laid_rows(self.mesh, part, z)
        slots = self.slots[unknowns]
        held = slots < 0
        residual[slots[6]] = tangent[slots[6], slots[6]] = 0.0
        residual[slots[7]] = tangent[slots[7], slots[7]] = 0.0
        residual[slots[~held]] += rows[~held]
        tangent[np.ix_(slots[~held], slots[~held])] += slopes[np.ix_(~held, ~held)]

    def is_pressing(self, contact: ContactAt, z: FloatArray) -> bool:
        """Return True if the side of a beam counts as touching: as it was set, or where it has a force."""
        return contact.closed if contact.closed is not None else bool(z[find_leading(self.mesh, contact).unknown] > 0)

    def _differentiate_by_place(
        self, free: FloatArray, place: float, z: FloatArray, number: int, laid: list[LaidPart]
    ) -> FloatArray:
        """Return the change of the residuals without contacts with one of the places."""
        if self._is_plain and not laid:
            return self._differentiate_plain(place, z, number)
        sides, unknown = [], self.mesh.side_contacts[number].slide
        for step in (PLACE_STEP, -PLACE_STEP):
            beside = z.copy()
            beside[unknown] += step
            if not self.move_to(beside[[contact.slide for contact in self.mesh.side_contacts]]):
                return np.full(len(free), np.nan)
            self._lay(laid)
            residual = np.array(self.plain.linearise(free, place).residual)
            for part in laid:
                unknowns, rows, _ = compute_laid_rows(self.mesh, part, beside)
                slots = self.slots[unknowns]
                residual[slots[6:]] = 0.0
                residual[slots[slots >= 0]] += rows[slots >= 0]
            sides.append(residual)
        return np.asarray((sides[0] - sides[1]) / (2 * PLACE_STEP))

    @cached_property
    def _is_plain(self) -> bool:
        """True if all elements that move are of beams of one thickness with a polynomial angle."""
        beams = {self.mesh.elements.beam[number] for number in self.mesh.moving.elements}  # type: ignore[union-attr]
        return all(has_polynomial_angle(self.mesh.fits.network.beams[beam]) for beam in beams)

    def _differentiate_plain(self, place: float, z: FloatArray, number: int) -> FloatArray:
        """Return that change exactly, by complex steps: tables of plain beams may have complex ends."""
        moving: Any = self.mesh.moving
        places = z[moving.places] + 0j
        places[number] += 1j * COMPLEX_STEP
        tables = compute_moved_tables(self.mesh, places)
        del tables["moved_cuts"]
        mesh, changed = self.plain.mesh, dict[str, Any]()
        for name, values in tables.items():
            changed[name] = getattr(mesh.elements, name) + 0j
            changed[name][moving.elements] = values
        moved = replace(mesh, elements=mesh.elements._replace(**changed))
        gradient = energy.gradient(moved, z[: mesh.size], *self.factors(place))
        return np.asarray(gradient[mesh.free].imag / COMPLEX_STEP)

    def _frozen(self, tangent: FloatArray, rows: list[SymmetricRow], laid: list[LaidPart], z: FloatArray) -> FloatArray:
        """Return the symmetric matrix of motions, section forces and conditions with all places held.

        Of an element that lies on an obstacle there is its length, a constraint.
        """
        count = self.plain.n
        whole = np.zeros((count + len(rows), count + len(rows)))
        whole[:count, :count] = tangent[:count, :count]
        for part in laid:
            unknowns, _, slopes = compute_laid_rows(self.mesh, part, z)
            slots = self.slots[unknowns]
            some = slots >= 0
            whole[np.ix_(slots[some], slots[some])] -= slopes[np.ix_(some, some)]
            pulled = np.where(np.arange(8) < 6, slopes[:, 6], 0.0)
            whole[slots[6], slots[some]] += pulled[some]
            whole[slots[some], slots[6]] += pulled[some]
            whole[slots[6], slots[6]] += slopes[6, 6]
            whole[slots[7], slots[7]] = 1.0
        motions = np.flatnonzero(self.plain.mesh.free < self.mesh.n_motions)
        whole[motions, motions] += NEUTRAL_STIFFNESS
        for number, (indices, row, pivot) in enumerate(rows, start=count):
            whole[number, indices] = whole[indices, number] = row
            whole[number, number] = pivot
        return whole

    def count_unstable(self, at: LinearEquations) -> int:
        """Return the number of unstable directions at a held drive, with places of contacts held."""
        assert isinstance(at, LinearisedSides)
        forces = int((self.plain.mesh.free >= self.mesh.n_motions).sum()) - at.n_laid
        return energy.count_negative_pivots(at.frozen) - forces - (len(at.frozen) - self.plain.n)

    # -- gradients -----------------------------------------------------------------------------------------------------
    def gradient(self, free: Any, place: Any) -> Any:
        """Return the gradient by all unknowns, (size,); where they are complex by a difference along that step."""
        if np.iscomplexobj(free) or np.iscomplexobj(place):
            steps, ahead = np.imag(free), float(np.imag(place))
            size = max(float(np.abs(steps).max(initial=0.0)), abs(ahead), np.finfo(float).tiny)
            share = PLACE_STEP / size
            sides = [
                self.gradient(np.real(free) + sign * share * steps, float(np.real(place)) + sign * share * ahead)
                for sign in (1.0, -1.0)
            ]
            return 0.5 * (sides[0] + sides[1]) + 1j * (sides[0] - sides[1]) / (2 * share)
        drive, share = self.factors(place)
        return self.evaluate_gradient(np.asarray(self.values(free, place)), drive, share)

    def gradients(self, z: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the gradients by all unknowns of states (p, size), (p, size)."""
        return np.array([self.evaluate_gradient(*pair) for pair in zip(z, drive, strict=True)]).reshape(z.shape)

    def evaluate_gradient(self, z: FloatArray, drive: float, share: float = 1.0) -> FloatArray:
        """Return the gradient of one state by all unknowns; that by places is zero."""
        self.move_to(z[[contact.slide for contact in self.mesh.side_contacts]])
        laid = self.find_laid_parts(z)
        self._lay(laid)
        total = np.array(self.plain.evaluate(self._drop_tension(z, laid), drive, share)[0])
        for part in laid:
            unknowns, rows, _ = compute_laid_rows(self.mesh, part, z)
            total[self.mesh.elements.unknowns[part.element, -2:]] = 0.0
            np.add.at(total, unknowns, rows)
        for contact in self.mesh.contacts:
            if not z[contact.unknown]:
                continue
            if contact.slide < 0:
                term = contact_contribution(self.mesh, contact, z)
                total[term.unknowns] += term.gradient
                continue
            if (leading := find_leading(self.mesh, contact)) is not contact:
                total[contact.unknown] += z[leading.unknown] - z[contact.unknown]
                continue
            side = self.side_at(contact, z)
            total[side.unknowns] -= z[contact.unknown] * side.gap_row
            total[contact.unknown] -= side.gap
        return total
