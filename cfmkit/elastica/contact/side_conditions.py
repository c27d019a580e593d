"""Conditions on a piece of a path of the sides of beams, each a number that must not become negative.

touch: the least gap of a side to an obstacle, away from where it touches. tangent: a pad at the end of a beam touches
as long as the beam runs away from the obstacle; then the contact moves into the beam. end: the way of a contact to the
end of its beam. spreads: the curvature of the gap at a contact; then it parts into two, between which the side lies on
the obstacle. closes: the way between two of these.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.elastica.contact.side_gaps import SideGaps, Stage
from cfmkit.elastica.mechanics.element_tables import smooth_marks
from cfmkit.elastica.mechanics.moving_elements import PLACE_STEP
from cfmkit.elastica.mechanics.polynomials import shape_functions
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.contact import BeamOnObstacle, NodeOnObstacle

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import ContactAt, Discretisation

NEW_PLACE = 1e-4  # of a beam from its end, or from another place, at which a contact that moves or parts begins
ROUNDINGS = {"touch": 1e-11, "tangent": 1e-11, "end": 0.0, "closes": 0.0, "spreads": 1e-9, "pinch": 0.0}
"""By how much each kind of condition may be negative."""


class SideCondition(NamedTuple):
    """A condition, and what it is of."""

    kind: Literal["touch", "tangent", "end", "closes", "spreads", "pinch"]
    number: int  # touch: in `Network.contacts`; else that of the contact in the arrays, of two the first
    item: BeamOnObstacle
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
        sides = [(k, one) for k, one in enumerate(mesh.contacts) if one.slide >= 0]
        for number, item in enumerate(mesh.fits.network.contacts):
            if not isinstance(item, BeamOnObstacle):
                continue
            yield SideCondition("touch", number, item)
            beam = mesh.fits.network.beams[item.beam]
            for k in sorted(self.closed):
                pad = mesh.contacts[k].item
                if isinstance(pad, NodeOnObstacle) and pad.name == item.name and not np.isfinite(item.stiffness):
                    for last, node in ((False, beam.start), (True, beam.end)):
                        if pad.node == node and not np.isfinite(pad.stiffness):
                            yield SideCondition("tangent", k, item, last)
        for k, one in sides:
            item: Any = one.item
            marks = smooth_marks(mesh.fits.network.beams[item.beam], mesh.fits[item.beam])
            place = float(mesh.elements.cuts[one.element, 1])
            low, high = max(m for m in marks if m < place), min(m for m in marks if m > place)
            before, after = ([other for _, other in sides if other.item.beam == item.beam  # type: ignore[union-attr]
                              and (other.element > one.element) == above and other is not one]
                             for above in (False, True))  # fmt: skip
            if not any(low < mesh.elements.cuts[other.element, 1] for other in before):
                yield SideCondition("end", k, item, False, low)
            if not any(high > mesh.elements.cuts[other.element, 1] for other in after):
                yield SideCondition("end", k, item, True, high)
            if not any(other.item is item for other in before[-1:] + after[:1]):
                yield SideCondition("spreads", k, item)
        for (k, one), (_, other) in itertools.pairwise(sides):
            if one.item.beam == other.item.beam:  # type: ignore[union-attr]
                kind: Literal["closes", "pinch"] = "closes" if one.item is other.item else "pinch"
                yield SideCondition(kind, k, one.item)  # type: ignore[arg-type]

    def gaps_of(self, item: BeamOnObstacle) -> SideGaps:
        """Return the gaps of a side, with what touches already."""
        if item not in self._gaps:
            mesh, touched = self.mesh, list[int]()
            own = [k for k, name in enumerate(mesh.elements.beam) if name == item.beam]
            beam = mesh.fits.network.beams[item.beam]
            for number, one in enumerate(mesh.contacts):
                if one.item.name != item.name:
                    continue
                if one.slide >= 0 and one.item is item:
                    touched += [one.element, one.element + 1]
                elif isinstance(one.item, NodeOnObstacle) and number in self.closed:
                    touched += [own[0]] * (one.item.node == beam.start) + [own[-1]] * (one.item.node == beam.end)
            self._gaps[item] = SideGaps(mesh, item, tuple(touched))
        return self._gaps[item]

    @cached_property
    def _gaps(self) -> dict[BeamOnObstacle, SideGaps]:
        return {}

    @cached_property
    def roundings(self) -> FloatArray:
        """By how much each may be negative."""
        return np.array([ROUNDINGS[one.kind] for one in self.all])

    def values(self, z: FloatArray, stage: Stage) -> FloatArray:
        """Return the values of all conditions in n states (n, size), (conditions, n)."""
        return np.array([self.value(one, z, stage) for one in self.all]).reshape(len(self.all), len(z))

    def value(self, one: SideCondition, z: FloatArray, stage: Stage) -> FloatArray:
        """Return the values of a condition in n states, (n,)."""
        if one.kind == "touch":
            return self.gaps_of(one.item).least(z, stage)
        contact = self.mesh.contacts[one.number]
        if one.kind == "tangent":
            return self._run_away(contact, one, z)
        if one.kind == "spreads":
            return self._relative_curvature(contact, z)
        if one.kind in ("closes", "pinch"):
            following = self.mesh.contacts[one.number + 1]
            return np.asarray(z[:, following.slide] - z[:, contact.slide] - NEW_PLACE)
        return np.asarray((one.mark - z[:, contact.slide]) * (1.0 if one.last else -1.0) - 0.5 * NEW_PLACE)

    def _run_away(self, pad: ContactAt, one: SideCondition, z: FloatArray) -> FloatArray:
        """Return how much the side of a beam runs away from the obstacle from a pad at its end."""
        mesh = self.mesh
        own = [k for k, name in enumerate(mesh.elements.beam) if name == one.item.beam]
        element, side = (own[-1], 1) if one.last else (own[0], 0)
        fitted = mesh.fits[one.item.beam]
        inside = float(mesh.elements.cuts[element].mean())
        angle = float(np.real(fitted.angle(float(side), inside))) + z[:, mesh.elements.unknowns[element, 3 + 4 * side]]
        place = poses(mesh.attachments, z, [pad.place]).place[:, 0]
        normal = one.item.outline.distance(place * mesh.scales.length).normal
        along = normal[:, 0] * np.cos(angle) + normal[:, 1] * np.sin(angle)
        return np.asarray(-along if one.last else along)

    def _relative_curvature(self, contact: ContactAt, z: FloatArray) -> FloatArray:
        """Return the curvature of the gap along a beam at a contact."""
        mesh, item = self.mesh, contact.item
        moved, fitted = mesh.with_places(z).elements, mesh.fits[item.beam]  # type: ignore[union-attr]
        inside = float(mesh.elements.cuts[contact.element].mean())
        columns = [3, 7, *range(8, mesh.degree + 7)]
        total = np.zeros(len(z))
        for number, end in ((contact.element, 1.0), (contact.element + 1, 0.0)):
            slopes = shape_functions(mesh.degree, np.array([end]))[1][0]
            total += (
                z[:, moved.unknowns[number, columns]]
                @ slopes
                / np.reshape(moved.length, (-1, len(moved.beam)))[:, number]
            )
        parameter, length = z[:, contact.slide], mesh.scales.length
        speed = np.real(fitted.speed(parameter, inside)) / length
        angles = [np.real(fitted.angle(parameter + step, inside)) for step in (PLACE_STEP, 0.0, -PLACE_STEP)]
        bend = 0.5 * total + (angles[0] - angles[2]) / (2 * PLACE_STEP) / speed
        x, y, turn, _ = mesh.attachments.unknowns[contact.place]
        found = item.outline.distance((mesh.attachments.origin[contact.place] + z[:, [x, y]]) * length)  # type: ignore[union-attr]
        angle = angles[1] + z[:, turn]
        rises = found.normal[:, 1] * np.cos(angle) - found.normal[:, 0] * np.sin(angle)
        return np.asarray(bend * rises + found.curvature * length * rises**2)
