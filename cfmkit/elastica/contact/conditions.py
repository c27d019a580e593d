"""Conditions under which contacts stay as they are: numbers along a path, by kind, none of which may become negative.

Where one passes zero, a piece of the path ends and the contact changes (`first_change`, `side_changes`):

- gap: of a node that does not touch; force: of a contact that does;
- grip: what is left of the friction of a contact that sticks; slip: how far one has slipped in its sense, which must
  grow;
- touch: least gap of a side to an obstacle, away from where it touches;
- tangent: a pad at the end of a beam touches as long as the beam runs away from the obstacle; then the contact moves
  into the beam;
- end: distance of a contact from the end of its beam;
- spreads: curvature of the gap at a contact; then it parts into two, between which the side lies on the obstacle;
- closes: distance of two such contacts; pinch: of two contacts with different obstacles;
- wraps: curvature of the gap at a clamped end that lies on the obstacle; then the side lies down from there;
- pulls: tension of what lies on a round obstacle, which presses it on; a side that is pushed along it leaves it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.elastica.contact.beam_lines import find_end, list_elements, measure_bend, measure_unloaded_curvature
from cfmkit.elastica.contact.edges import find_mate, measure_distance
from cfmkit.elastica.contact.equations import NO_FRICTION
from cfmkit.elastica.contact.line_tangent import (
    line_leaves_normal,
    measure_compliances,
    measure_line_tangent,
    raise_pad,
)
from cfmkit.elastica.contact.pair_gaps import make_gaps
from cfmkit.elastica.contact.side_gaps import join_sides, search_sides
from cfmkit.elastica.contact.terms import gaps, measure_friction
from cfmkit.elastica.mechanics.elements import smooth_marks
from cfmkit.elastica.mechanics.energy import line_load
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.moving_elements import with_places
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.beam_fits import beam_end_at
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, BeamSide, NodeOnBeam, NodeOnObstacle

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.side_gaps import LoadStage, SideGaps
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation
    from cfmkit.elastica.mechanics.equations import NumpyEquations, SideData
    from cfmkit.elastica.model.contact import Contact, Distance, FrictionState

    Kind = Literal[
        "gap", "force", "grip", "slip",
        "touch", "tangent", "end", "closes", "spreads", "pinch", "wraps", "pulls", "lies",
    ]  # fmt: skip

ON_OBSTACLE = 1e-9  # mean beam lengths, and rad, within which a clamped end lies on an obstacle
STEP_INWARDS = 1e-6  # mean beam lengths
NEW_PLACE = 1e-4  # of a beam from its end, or from another place, at which a contact that moves or parts begins
FORCE_ROUNDING = 1e-10  # share of the largest force, and of one
ROUNDING_OF_KIND = {"gap": 1e-11, "slip": 1e-13, "touch": 1e-11, "tangent": 1e-11, "end": 0.0, "closes": 0.0,
                    "spreads": 1e-9, "pinch": 0.0, "wraps": 1e-9, "pulls": 1e-9}  # fmt: skip
"""By how much each kind of condition may be negative; forces and grips by a share of the largest force."""
PAD_OF_SIDE: dict[type, Any] = {BeamOnObstacle: NodeOnObstacle, BeamOnBeam: NodeOnBeam}
"""Contacts of the node at the end of a beam with what its side may touch, too."""


def step_inwards(item: Any, place: Any, angle: Any, last: bool) -> Any:
    """Return places (..., 2) a little along a beam from its clamped end: there the edge may go on as an arc."""
    if not len(item.outline.length):
        return place
    return place + (-STEP_INWARDS if last else STEP_INWARDS) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


class Condition(NamedTuple):
    """A condition of one kind on a contact, or on one side; "lies" is the state behind "spreads" and "wraps"."""

    kind: Kind
    number: int  # touch, wraps: in `Network.contacts`; else that of the contact in the arrays, of two the first
    item: Any  # a contact of the network
    last: bool = False  # tangent, end, wraps: the last end of the beam
    mark: float = 0.0  # end: parameter of it


@dataclass(frozen=True, eq=False)
class Conditions:
    """All conditions of one set of contacts."""

    mesh: Discretisation
    closed: frozenset[int]  # contacts of the arrays that touch
    friction: Mapping[int, FrictionState] = field(default_factory=dict)  # of closed contacts that rub

    @cached_property
    def all(self) -> tuple[Condition, ...]:
        """The conditions in order: one of each contact of the arrays, by its number, those on sides, on friction."""
        contacts = enumerate(self.mesh.contacts)
        contact_conditions = [
            Condition("force" if k in self.closed else "gap", k, contact.item) for k, contact in contacts
        ]
        rubbing = [
            Condition("slip" if state.sense else "grip", k, self.mesh.contacts[k].item)
            for k, state in sorted(self.friction.items()) if state.sense != NO_FRICTION.sense
        ]  # fmt: skip
        return *contact_conditions, *self._list_side_conditions(), *rubbing

    def find_row(self, kind: str, item: Contact, last: bool | None = None) -> int:
        """Return the number of the first condition of a kind on a contact, at one end of its beam if so requested."""
        return next(
            row for row, condition in enumerate(self.all)
            if condition.kind == kind and condition.item is item and last in (None, condition.last)
        )  # fmt: skip

    def rows_of(self, kind: str) -> list[int]:
        """Return the numbers of the conditions of a kind."""
        return self._rows.get(kind, [])

    @cached_property
    def _rows(self) -> dict[str, list[int]]:
        rows: dict[str, list[int]] = {}
        for row, condition in enumerate(self.all):
            rows.setdefault(condition.kind, []).append(row)
        return rows

    def _list_side_conditions(self) -> Iterator[Condition]:
        mesh, network = self.mesh, self.mesh.fits.network
        sides: list[tuple[int, Any]] = [(k, contact) for k, contact in enumerate(mesh.contacts) if contact.slide >= 0]
        along = {beam: [contact for _, contact in sides if contact.item.beam == beam] for beam in network.beams}
        for number, item in enumerate(network.contacts):
            if not isinstance(item, BeamSide):
                continue
            if not isinstance(item, BeamOnBeam) or item.leads:
                yield Condition("touch", number, item)
            for last in self.roots(item):
                if not along[item.beam] or along[item.beam][-1 if last else 0].item is not item:
                    yield Condition("wraps", number, item, last)
            beam = network.beams[item.beam]
            for k in sorted(self.closed):
                pad: Any = mesh.contacts[k].item
                if isinstance(pad, PAD_OF_SIDE.get(type(item), ())) and pad.name == item.name:
                    for last, node in ((False, beam.start), (True, beam.end)):
                        if pad.node == node and not np.isfinite(pad.stiffness):
                            yield Condition("tangent", k, item, last)
        for k, contact in sides:
            side, on_beam = contact.item, along[contact.item.beam]
            marks = smooth_marks(network.beams[side.beam], mesh.fits[side.beam])
            place, position = mesh.elements.cuts[contact.element, 1], on_beam.index(contact)
            before, after = on_beam[max(position - 1, 0) : position], on_beam[position + 1 : position + 2]
            low, high = max(m for m in marks if m < place), min(m for m in marks if m > place)
            if not any(low < mesh.elements.cuts[neighbour.element, 1] for neighbour in before):
                yield Condition("end", k, side, False, low)
            if not any(high > mesh.elements.cuts[neighbour.element, 1] for neighbour in after):
                yield Condition("end", k, side, True, high)
            if contact.laid and len(side.outline.radius):
                yield Condition("pulls", k, side)
            leads = not isinstance(side, BeamOnBeam) or side.leads
            if leads and not contact.laid and not any(neighbour.item is side for neighbour in before + after):
                yield Condition("spreads", k, side)
        for (k, contact), (_, neighbour) in itertools.pairwise(sides):
            if contact.item.beam == neighbour.item.beam:
                yield Condition("closes" if contact.item is neighbour.item else "pinch", k, contact.item)

    def roots(self, item: BeamSide) -> tuple[bool, ...]:
        """Return which ends of a beam are clamped so that they lie on an obstacle: False the first, True the last."""
        cache, key = self.mesh.fits.cache, (Conditions.roots, item)
        if key not in cache:
            ends = (
                last for last in (False, True) if isinstance(item, BeamOnObstacle) and self._lies_at_end(item, last)
            )
            cache[key] = tuple(ends)
        return cache[key]  # type: ignore[no-any-return]

    def _lies_at_end(self, item: BeamOnObstacle, last: bool) -> bool:
        mesh, network = self.mesh, self.mesh.fits.network
        beam, fitted = network.beams[item.beam], mesh.fits[item.beam]
        name, joint = (beam.end, beam.end_joint) if last else (beam.start, beam.start_joint)
        support = network.nodes[name].support
        if (
            network.is_moved_by_link(name)
            or joint != "rigid"
            or not (support.along and support.across and support.rotation)
        ):
            return False
        marks = smooth_marks(beam, fitted)
        inside = 0.5 * (marks[-2] + marks[-1] if last else marks[0] + marks[1])
        angle = float(np.real(fitted.angle(float(last), inside)))
        edge = item.outline.distance(np.real(np.array(beam_end_at(network, item.beam, int(last)))))
        half = 0.5 * float(np.real(beam.section.thickness_at(float(last), inside)))
        slope = float(edge.normal[0] * np.cos(angle) + edge.normal[1] * np.sin(angle))
        return abs(float(edge.value) - half) < ON_OBSTACLE * mesh.scales.length and abs(slope) < ON_OBSTACLE

    def gaps_of(self, item: BeamSide) -> SideGaps:
        """Return the gaps of a side, with what touches already."""
        if item not in self._gaps:
            mesh, touched, laid = self.mesh, list[int](), list[int]()
            elements, beam = list_elements(mesh, item.beam), mesh.fits.network.beams[item.beam]
            for number, contact in enumerate(mesh.contacts):
                contact_item: Any = contact.item
                if contact_item.name != item.name:
                    continue
                if contact.slide >= 0 and contact_item.beam == item.beam:
                    touched += [contact.element, contact.element + 1]
                elif isinstance(contact_item, NodeOnObstacle | NodeOnBeam) and number in self.closed:
                    touched += [elements[0]] * (contact_item.node == beam.start)
                    touched += [elements[-1]] * (contact_item.node == beam.end)
                if contact.laid and contact_item is item:
                    laid.append(contact.element + (contact.laid > 0))
            touched += [elements[-1] if last else elements[0] for last in self.roots(item)]
            self._gaps[item] = make_gaps(mesh, item, tuple(touched), tuple(laid))
        return self._gaps[item]

    @cached_property
    def _gaps(self) -> dict[BeamSide, SideGaps]:
        return {}

    def roundings(self, values: FloatArray) -> FloatArray:
        """Return by how much the values of conditions (rows, ..., shares) may be negative, (rows, ...)."""
        largest = np.abs(values[list(self.closed)]).max(axis=(0, -1), initial=1.0)
        fixed, shares = (column.reshape(-1, *(1,) * largest.ndim) for column in self._roundings)
        return np.asarray(fixed + shares * largest)

    @cached_property
    def _roundings(self) -> FloatArray:
        """By how much each condition may be negative, and by what share of the largest force, (2, rows)."""
        forces = [condition.kind not in ROUNDING_OF_KIND for condition in self.all]
        return np.array([
            [ROUNDING_OF_KIND.get(condition.kind, 0.0) for condition in self.all], FORCE_ROUNDING * np.array(forces)
        ])  # fmt: skip

    def values(self, z: FloatArray, stage: LoadStage) -> FloatArray:
        """Return the values of all conditions in n states (n, size), (rows, n)."""
        rows, sides = self._touching
        together = None if sides is None else search_sides(self.mesh, sides, z, stage, watch=True)
        values_by_row = {} if together is None else dict(zip(rows, together[:, :, 0].T, strict=True))
        measured = self._equations.measure_nodes(z)
        if measured is not None:
            open_gaps = self.rows_of("gap")
            values_by_row |= {k: measured[k] + raise_pad(self.mesh, self.mesh.contacts[k], z) for k in open_gaps}
        values = np.empty((len(self.all), len(z)))
        for row, condition in enumerate(self.all):
            values[row] = values_by_row[row] if row in values_by_row else self.value(condition, z, stage)
        return values

    @cached_property
    def _equations(self) -> NumpyEquations:
        return equations(self.mesh)

    @cached_property
    def _touching(self) -> tuple[list[int], SideData | None]:
        """Rows of sides that may touch, and these as compiled code takes them; None if some thickness varies."""
        rows = self.rows_of("touch")
        packed = [self.gaps_of(self.all[k].item).packed for k in rows]
        return rows, join_sides(packed) if packed and all(packed) else None  # type: ignore[arg-type]

    def value(self, condition: Condition, z: FloatArray, stage: LoadStage) -> FloatArray:
        """Return the values of a condition in n states, (n,)."""
        return np.asarray(_MEASURE_KIND[condition.kind](self, condition, z, stage))

    def _measure_force(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        return z[:, self.mesh.contacts[condition.number].unknown]

    def _measure_gap(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        contact = self.mesh.contacts[condition.number]
        return np.asarray(gaps(self.mesh, contact, z) + raise_pad(self.mesh, contact, z))

    def _measure_friction(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        return measure_friction(self.mesh, self.mesh.contacts[condition.number], self.friction[condition.number], z)

    def _measure_least_gap(self, condition: Condition, z: FloatArray, stage: LoadStage) -> FloatArray:
        return self.gaps_of(condition.item).least(z, stage, watch=True)

    def _measure_distance(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        contact, following = self.mesh.contacts[condition.number : condition.number + 2]
        return np.asarray(z[:, following.slide] - z[:, contact.slide] - NEW_PLACE)

    def _measure_distance_to_end(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        distance = condition.mark - z[:, self.mesh.contacts[condition.number].slide]
        return np.asarray((distance if condition.last else -distance) - 0.5 * NEW_PLACE)

    def _measure_pull(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        """Return the tension along a round obstacle, positive if it presses the side on."""
        mesh, contact = self.mesh, self.mesh.contacts[condition.number]
        element = contact.element + (contact.laid > 0)
        bulge = condition.item.outline.distance(_find_body_place(mesh, contact, z) * mesh.scales.length).curvature
        return np.asarray(np.sign(bulge) * z[:, mesh.elements.unknowns[element, -2]])

    def _measure_root_curvature(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        """Return the curvature of the gap at an end that lies on the obstacle."""
        mesh, item, side = self.mesh, condition.item, int(condition.last)
        end = find_end(mesh, item.beam, condition.last, z)
        unloaded = measure_unloaded_curvature(mesh, item.beam, np.array([float(side)]), end.element)
        edge = measure_distance(mesh, item, step_inwards(item, end.place, end.angle, condition.last), z)
        return _measure_gap_curvature(measure_bend(mesh, z, end.element, side) + unloaded, end.angle, edge)

    def _measure_leaving(self, condition: Condition, z: FloatArray, stage: LoadStage) -> FloatArray:
        """Return how much the side of a beam runs away from the obstacle from a pad at its end."""
        mesh, pad, beam = self.mesh, self.mesh.contacts[condition.number], condition.item.beam
        end = find_end(mesh, beam, condition.last, z)
        place = poses(mesh.attachments, z, [pad.place]).place[:, 0]
        if isinstance(condition.item, BeamOnBeam):  # there the pad touches the other beam
            away = end.place - place
            normal = away / np.hypot(*away.T)[:, None]
        else:
            normal = measure_distance(mesh, condition.item, place, z).normal
        if line_leaves_normal(mesh.fits.network.beams[beam].section):
            inwards = -1.0 if condition.last else 1.0
            force = z[:, mesh.elements.unknowns[end.element, -2:]] + inwards * 0.5 * z[:, [pad.unknown]] * normal
            if not condition.last:
                loads = line_load(mesh, *stage) * with_places(mesh, z).elements.length[..., None]
                force = force + loads[..., end.element, :]
            compliances = measure_compliances(mesh, beam, float(condition.last))
            along = measure_line_tangent(end.angle, normal, force, *compliances).across
        else:
            along = normal[:, 0] * np.cos(end.angle) + normal[:, 1] * np.sin(end.angle)
        return np.asarray(-along if condition.last else along)

    def _measure_spread(self, condition: Condition, z: FloatArray, _stage: LoadStage) -> FloatArray:
        """Return the curvature of the gap at a contact; of two beams the smaller one of the gap by both places."""
        mesh, contact = self.mesh, self.mesh.contacts[condition.number]
        curvature = self._measure_relative_curvature(contact, z)
        if not isinstance(condition.item, BeamOnBeam):
            return curvature
        mate = find_mate(mesh, condition.item)
        mate_curvature = self._measure_relative_curvature(mate, z)
        apart = _find_body_place(mesh, contact, z) - _find_body_place(mesh, mate, z)
        mixed = 1 / np.hypot(*apart.T)  # but for its sign: both are tangent
        return np.asarray(0.5 * (curvature + mate_curvature) - np.hypot(0.5 * (curvature - mate_curvature), mixed))

    def _measure_relative_curvature(self, contact: ContactAt, z: FloatArray) -> FloatArray:
        """Return the curvature of the gap along a beam at a contact."""
        mesh, item = self.mesh, contact.item
        curvatures = equations(mesh).measure_curvatures(z)
        if curvatures is not None:
            return np.asarray(curvatures[mesh.side_contacts.index(contact)])
        beam: Any = item.beam  # type: ignore[union-attr]
        both = measure_bend(mesh, z, contact.element, 1) + measure_bend(mesh, z, contact.element + 1, 0)
        parameter, inside = z[:, contact.slide], float(mesh.elements.cuts[contact.element].mean())
        angle = np.real(mesh.fits[beam].angle(parameter, inside)) + z[:, mesh.attachments.unknowns[contact.place, 2]]
        bend = 0.5 * both + measure_unloaded_curvature(mesh, beam, parameter, contact.element)
        return _measure_gap_curvature(bend, angle, measure_distance(mesh, item, _find_body_place(mesh, contact, z), z))  # type: ignore[arg-type]


def _find_body_place(mesh: Discretisation, contact: ContactAt, z: FloatArray) -> Any:
    """Return where the body at a contact of a side is in n states, (n, 2)."""
    return mesh.attachments.origin[contact.place] + z[:, mesh.attachments.unknowns[contact.place, :2]]


def _measure_gap_curvature(bend: Any, angle: Any, edge: Distance) -> FloatArray:
    """Return the curvature of the gap along a beam of a curvature and an angle, tangent to an edge."""
    rises = edge.normal[:, 1] * np.cos(angle) - edge.normal[:, 0] * np.sin(angle)
    return np.asarray(bend * rises + edge.curvature * rises**2)


_MEASURE_KIND = {
    "force": Conditions._measure_force,
    "gap": Conditions._measure_gap,
    "grip": Conditions._measure_friction,
    "slip": Conditions._measure_friction,
    "touch": Conditions._measure_least_gap,
    "tangent": Conditions._measure_leaving,
    "end": Conditions._measure_distance_to_end,
    "spreads": Conditions._measure_spread,
    "closes": Conditions._measure_distance,
    "pinch": Conditions._measure_distance,
    "wraps": Conditions._measure_root_curvature,
    "pulls": Conditions._measure_pull,
}
