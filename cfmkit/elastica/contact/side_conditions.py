"""Conditions under which the sides of beams touch as they do: numbers along a path, none of which may become negative.

Where one passes zero, a piece of the path ends and the contact changes (`side_changes`):

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
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.elastica.contact.edges import find_mate, measure_distance
from cfmkit.elastica.contact.line_tangent import line_leaves_normal, measure_compliances, measure_line_tangent
from cfmkit.elastica.contact.pair_gaps import make_gaps
from cfmkit.elastica.contact.side_gaps import join_sides, search_sides
from cfmkit.elastica.mechanics.contact_arrays import side_contacts
from cfmkit.elastica.mechanics.elements import smooth_marks
from cfmkit.elastica.mechanics.energy import line_load
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.moving_elements import PLACE_STEP, lengths_at, with_places
from cfmkit.elastica.mechanics.polynomials import shape_functions
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.beam_fits import beam_end_at
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle, BeamSide, NodeOnBeam, NodeOnObstacle

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.side_gaps import LoadStage, SideGaps
    from cfmkit.elastica.mechanics.contact_unknowns import ContactAt
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.mechanics.equations import SideData

ON_OBSTACLE = 1e-9  # mean beam lengths, and rad, within which a clamped end lies on an obstacle
STEP_INWARDS = 1e-6  # mean beam lengths
NEW_PLACE = 1e-4  # of a beam from its end, or from another place, at which a contact that moves or parts begins
ROUNDING_OF_KIND = {"touch": 1e-11, "tangent": 1e-11, "end": 0.0, "closes": 0.0, "spreads": 1e-9, "pinch": 0.0,
             "wraps": 1e-9, "pulls": 1e-9}  # fmt: skip
"""By how much each kind of condition may be negative."""
PAD_OF_SIDE: dict[type, Any] = {BeamOnObstacle: NodeOnObstacle, BeamOnBeam: NodeOnBeam}
"""Contacts of the node at the end of a beam with what its side may touch, too."""


def step_inwards(item: Any, place: Any, angle: Any, last: bool) -> Any:
    """Return places (..., 2) a little along a beam from its clamped end: there the edge may go on as an arc."""
    if not len(item.outline.length):
        return place
    return place + (-STEP_INWARDS if last else STEP_INWARDS) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


class SideCondition(NamedTuple):
    """A condition of one kind on one side or contact; "lies" is the state behind "spreads" and "wraps"."""

    kind: Literal["touch", "tangent", "end", "closes", "spreads", "pinch", "wraps", "pulls", "lies"]
    number: int  # touch: in `Network.contacts`; else that of the contact in the arrays, of two the first
    item: BeamSide
    last: bool = False  # tangent, end: the last end of the beam
    mark: float = 0.0  # end: parameter of it


@dataclass(frozen=True, eq=False)
class SideConditions:
    """All conditions on the sides of beams with one set of contacts."""

    mesh: Discretisation
    closed: frozenset[int]  # contacts of the arrays that touch

    @cached_property
    def all(self) -> tuple[SideCondition, ...]:
        """The conditions in order."""
        return tuple(self._find())

    def _find(self) -> Iterator[SideCondition]:
        mesh = self.mesh
        sides = [(k, contact) for k, contact in enumerate(mesh.contacts) if contact.slide >= 0]
        for number, item in enumerate(mesh.fits.network.contacts):
            if not isinstance(item, BeamSide):
                continue
            if not isinstance(item, BeamOnBeam) or item.leads:
                yield SideCondition("touch", number, item)
            beam = mesh.fits.network.beams[item.beam]
            elements = [contact for _, contact in sides if contact.item.beam == item.beam]  # type: ignore[union-attr]
            for last in self.roots(item):
                if not elements or elements[-1 if last else 0].item is not item:
                    yield SideCondition("wraps", number, item, last)
            for k in sorted(self.closed):
                pad: Any = mesh.contacts[k].item
                if isinstance(pad, PAD_OF_SIDE.get(type(item), ())) and pad.name == item.name:
                    for last, node in ((False, beam.start), (True, beam.end)):
                        if pad.node == node and not np.isfinite(pad.stiffness):
                            yield SideCondition("tangent", k, item, last)
        for k, contact in sides:
            side: Any = contact.item
            marks = smooth_marks(mesh.fits.network.beams[side.beam], mesh.fits[side.beam])
            place = float(mesh.elements.cuts[contact.element, 1])
            low, high = max(m for m in marks if m < place), min(m for m in marks if m > place)
            before, after = ([neighbour for _, neighbour in sides if neighbour.item.beam == side.beam  # type: ignore[union-attr]
                              and (neighbour.element > contact.element) == above and neighbour is not contact]
                             for above in (False, True))  # fmt: skip
            if not any(low < mesh.elements.cuts[neighbour.element, 1] for neighbour in before):
                yield SideCondition("end", k, side, False, low)
            if not any(high > mesh.elements.cuts[neighbour.element, 1] for neighbour in after):
                yield SideCondition("end", k, side, True, high)
            if contact.laid and len(side.outline.radius):
                yield SideCondition("pulls", k, side)
            if isinstance(side, BeamOnBeam) and not side.leads:
                continue
            if not contact.laid and not any(neighbour.item is side for neighbour in before[-1:] + after[:1]):
                yield SideCondition("spreads", k, side)
        for (k, contact), (_, neighbour) in itertools.pairwise(sides):
            if contact.item.beam == neighbour.item.beam:  # type: ignore[union-attr]
                kind: Literal["closes", "pinch"] = "closes" if contact.item is neighbour.item else "pinch"
                yield SideCondition(kind, k, contact.item)  # type: ignore[arg-type]

    def roots(self, item: BeamSide) -> tuple[bool, ...]:
        """Return which ends of a beam are clamped so that they lie on an obstacle: False the first, True the last."""
        known, key = self.mesh.fits.known, (SideConditions.roots, item)
        if key not in known:
            ends = (last for last in (False, True) if isinstance(item, BeamOnObstacle) and self._lies_at(item, last))
            known[key] = tuple(ends)
        return known[key]  # type: ignore[no-any-return]

    def _lies_at(self, item: BeamOnObstacle, last: bool) -> bool:
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
            mesh, touched = self.mesh, list[int]()
            elements = [k for k, name in enumerate(mesh.elements.beam) if name == item.beam]
            beam = mesh.fits.network.beams[item.beam]
            for number, contact in enumerate(mesh.contacts):
                if contact.item.name != item.name:
                    continue
                if contact.slide >= 0 and contact.item.beam == item.beam:  # type: ignore[union-attr]
                    touched += [contact.element, contact.element + 1]
                elif isinstance(contact.item, NodeOnObstacle | NodeOnBeam) and number in self.closed:
                    touched += [elements[0]] * (contact.item.node == beam.start) + [elements[-1]] * (
                        contact.item.node == beam.end
                    )
            touched += [elements[-1] if last else elements[0] for last in self.roots(item)]
            laid = [
                contact.element + (contact.laid > 0)
                for contact in mesh.contacts
                if contact.laid and contact.item is item
            ]
            self._gaps[item] = make_gaps(mesh, item, tuple(touched), tuple(laid))
        return self._gaps[item]

    @cached_property
    def _gaps(self) -> dict[BeamSide, SideGaps]:
        return {}

    @cached_property
    def roundings(self) -> FloatArray:
        """By how much each may be negative."""
        return np.array([ROUNDING_OF_KIND[condition.kind] for condition in self.all])

    def values(self, z: FloatArray, stage: LoadStage) -> FloatArray:
        """Return the values of all conditions in n states (n, size), (conditions, n)."""
        values = np.empty((len(self.all), len(z)))
        rows, sides = self._touching
        together = None if sides is None else search_sides(self.mesh, sides, z, stage, watch=True)
        for k, condition in enumerate(self.all):
            if together is None or k not in rows:
                values[k] = self.value(condition, z, stage)
            else:
                values[k] = together[:, rows.index(k), 0]
        return values

    @cached_property
    def _touching(self) -> tuple[list[int], SideData | None]:
        """Rows of sides that may touch, and these as compiled code takes them; None if some thickness varies."""
        rows = [k for k, condition in enumerate(self.all) if condition.kind == "touch"]
        packed = [self.gaps_of(self.all[k].item).packed for k in rows]
        return rows, join_sides(packed) if packed and all(packed) else None  # type: ignore[arg-type]

    def value(self, condition: SideCondition, z: FloatArray, stage: LoadStage) -> FloatArray:
        """Return the values of a condition in n states, (n,)."""
        if condition.kind == "touch":
            return self.gaps_of(condition.item).least(z, stage, watch=True)
        if condition.kind == "wraps":
            return self._curvature_at_root(condition, z)
        contact = self.mesh.contacts[condition.number]
        if condition.kind == "pulls":
            return self._pull(contact, z)
        if condition.kind == "tangent":
            return self._run_away(contact, condition, z, stage)
        if condition.kind == "spreads":
            return self._least_curvature(contact, z)
        if condition.kind in ("closes", "pinch"):
            following = self.mesh.contacts[condition.number + 1]
            return np.asarray(z[:, following.slide] - z[:, contact.slide] - NEW_PLACE)
        return np.asarray((condition.mark - z[:, contact.slide]) * (1.0 if condition.last else -1.0) - 0.5 * NEW_PLACE)

    def _pull(self, contact: ContactAt, z: FloatArray) -> FloatArray:
        """Return the tension along a round obstacle, positive if it presses the side on."""
        mesh = self.mesh
        element = contact.element + (contact.laid > 0)
        x, y, _, _ = mesh.attachments.unknowns[contact.place]
        place = mesh.attachments.origin[contact.place] + z[:, [x, y]]
        bulge = contact.item.outline.distance(place * mesh.scales.length).curvature  # type: ignore[union-attr]
        return np.asarray(np.sign(bulge) * z[:, mesh.elements.unknowns[element, -2]])

    def _curvature_at_root(self, condition: SideCondition, z: FloatArray) -> FloatArray:
        """Return the curvature of the gap at an end that lies on the obstacle."""
        mesh, item = self.mesh, condition.item
        elements = [k for k, name in enumerate(mesh.elements.beam) if name == item.beam]
        element, side = (elements[-1], 1) if condition.last else (elements[0], 0)
        fitted = mesh.fits[item.beam]
        inside, at = float(mesh.elements.cuts[element].mean()), np.array([float(side)])
        slopes = shape_functions(mesh.degree, at)[1][0]
        columns = [3, 7, *range(8, mesh.degree + 7)]
        bend = z[:, mesh.elements.unknowns[element, columns]] @ slopes / lengths_at(mesh, z, element)
        speed = float(np.real(fitted.speed(at, inside) + np.zeros(1))[0]) / mesh.scales.length
        sides = [float(np.real(fitted.angle(at + step, inside) + np.zeros(1))[0]) for step in (PLACE_STEP, -PLACE_STEP)]
        bend = bend + (sides[0] - sides[1]) / (2 * PLACE_STEP) / speed
        place = poses(mesh.attachments, z, [int(mesh.elements.ends[element, side])]).place[:, 0]
        angle = 0.5 * sum(sides) + z[:, mesh.elements.unknowns[element, 3 + 4 * side]]
        edge = measure_distance(mesh, item, step_inwards(item, place, angle, condition.last), z)
        rises = edge.normal[:, 1] * np.cos(angle) - edge.normal[:, 0] * np.sin(angle)
        return np.asarray(bend * rises + edge.curvature * rises**2)

    def _run_away(self, pad: ContactAt, condition: SideCondition, z: FloatArray, stage: LoadStage) -> FloatArray:
        """Return how much the side of a beam runs away from the obstacle from a pad at its end."""
        mesh = self.mesh
        elements = [k for k, name in enumerate(mesh.elements.beam) if name == condition.item.beam]
        element, side = (elements[-1], 1) if condition.last else (elements[0], 0)
        fitted = mesh.fits[condition.item.beam]
        inside = float(mesh.elements.cuts[element].mean())
        angle = float(np.real(fitted.angle(float(side), inside))) + z[:, mesh.elements.unknowns[element, 3 + 4 * side]]
        place = poses(mesh.attachments, z, [pad.place]).place[:, 0]
        if isinstance(condition.item, BeamOnBeam):  # there the pad touches the other beam
            away = poses(mesh.attachments, z, [int(mesh.elements.ends[element, side])]).place[:, 0] - place
            normal = away / np.hypot(*away.T)[:, None]
        else:
            normal = measure_distance(mesh, condition.item, place, z).normal
        if line_leaves_normal(mesh.fits.network.beams[condition.item.beam].section):
            inwards = -1.0 if condition.last else 1.0
            force = z[:, mesh.elements.unknowns[element, -2:]] + inwards * 0.5 * z[:, [pad.unknown]] * normal
            if not condition.last:
                force = (
                    force + (line_load(mesh, *stage) * with_places(mesh, z).elements.length[..., None])[..., element, :]
                )
            compliances = measure_compliances(mesh, condition.item.beam, float(side))
            along = measure_line_tangent(angle, normal, force, *compliances).across
        else:
            along = normal[:, 0] * np.cos(angle) + normal[:, 1] * np.sin(angle)
        return np.asarray(-along if condition.last else along)

    def _least_curvature(self, contact: ContactAt, z: FloatArray) -> FloatArray:
        """Return the curvature of the gap at a contact; of two beams the smaller one of the gap by both places."""
        side = self._relative_curvature(contact, z)
        if not isinstance(contact.item, BeamOnBeam):
            return side
        mesh, mate = self.mesh, find_mate(self.mesh, contact.item)
        partner = self._relative_curvature(mate, z)
        places = [
            mesh.attachments.origin[at.place] + z[:, mesh.attachments.unknowns[at.place, :2]] for at in (contact, mate)
        ]
        mixed = 1 / np.hypot(*(places[0] - places[1]).T)  # but for its sign: both are tangent
        return np.asarray(0.5 * (side + partner) - np.hypot(0.5 * (side - partner), mixed))

    def _relative_curvature(self, contact: ContactAt, z: FloatArray) -> FloatArray:
        """Return the curvature of the gap along a beam at a contact."""
        mesh, item = self.mesh, contact.item
        curvatures = equations(mesh).measure_curvatures(z)
        if curvatures is not None:
            return np.asarray(curvatures[side_contacts(mesh).index(contact)])
        fitted = mesh.fits[item.beam]  # type: ignore[union-attr]
        inside = float(mesh.elements.cuts[contact.element].mean())
        columns = [3, 7, *range(8, mesh.degree + 7)]
        total = np.zeros(len(z))
        for number, end in ((contact.element, 1.0), (contact.element + 1, 0.0)):
            slopes = shape_functions(mesh.degree, np.array([end]))[1][0]
            total += z[:, mesh.elements.unknowns[number, columns]] @ slopes / lengths_at(mesh, z, number)
        parameter, length = z[:, contact.slide], mesh.scales.length
        speed = np.real(fitted.speed(parameter, inside)) / length
        angles = [np.real(fitted.angle(parameter + step, inside)) for step in (PLACE_STEP, 0.0, -PLACE_STEP)]
        bend = 0.5 * total + (angles[0] - angles[2]) / (2 * PLACE_STEP) / speed
        x, y, turn, _ = mesh.attachments.unknowns[contact.place]
        edge = measure_distance(mesh, item, mesh.attachments.origin[contact.place] + z[:, [x, y]], z)  # type: ignore[arg-type]
        angle = angles[1] + z[:, turn]
        rises = edge.normal[:, 1] * np.cos(angle) - edge.normal[:, 0] * np.sin(angle)
        return np.asarray(bend * rises + edge.curvature * rises**2)
