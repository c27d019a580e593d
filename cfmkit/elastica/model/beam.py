"""A beam between two nodes (shape, section, joints, closure), and the fit of its shape between them (`Fit`).

Closure: nodes and shapes that are given rounded do not fit exactly. "rotscale" turns each shape and scales it so
that it does, and reports by how much; "raw" keeps shape and length and forces the beam into place, prestressed.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.arrays import distinct
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import STRAIGHT_SHAPE, FittedShape, Shape, direction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.elastica.model.section import Section

Joint = Literal["rigid", "pin"]
Closure = Literal["rotscale", "raw"]

PARAMETER_TOL = 1e-12  # parameters of a shape that differ by less count as one place
_ANGLE_TOL = 1e-9  # [rad] an angle that is no corner; [1] a share of the complex step that is rounding
_N_PANELS = 8  # of a smooth piece at least
_MAX_PANEL_TURN = (
    2.0  # mean turn of a panel [rad] up to which twelve nodes integrate its sine and cosine to about 1e-12
)
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)
BEAM_QUADRATURE = (
    ((np.arange(_N_PANELS)[:, None] + 0.5 * (1 + _GAUSS_NODES)) / _N_PANELS).ravel(),
    np.tile(0.5 * _GAUSS_WEIGHTS / _N_PANELS, _N_PANELS),
)
"""Places and weights of the quadrature over a whole smooth beam, parameter from 0 to 1."""
_JOINT_KINDS = ("rigid", "pin")


@dataclass(frozen=True)
class Beam:
    """A beam from node `start` to node `end`.

    Offsets are rigid arms from a node to the beam's end, as they lie before any load; they turn with the node.
    """

    start: str
    end: str
    section: Section
    shape: Shape = STRAIGHT_SHAPE
    closure: Closure = "rotscale"  # how the shape is fitted between its ends
    start_joint: Joint = "rigid"  # "pin": the end does not turn with the node
    end_joint: Joint = "rigid"
    start_offset: tuple[float, float] = (0.0, 0.0)  # [m]
    end_offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if self.closure not in ("rotscale", "raw"):
            raise InputError(f"closure must be 'rotscale' or 'raw', got {self.closure!r}")
        if self.start_joint not in _JOINT_KINDS or self.end_joint not in _JOINT_KINDS:
            wrong = self.end_joint if self.start_joint in _JOINT_KINDS else self.start_joint
            raise InputError(f"a joint is 'rigid' or 'pin', got {wrong!r}")
        if self.start == self.end:
            raise InputError(f"a beam needs two different nodes, got {self.start!r} twice")


@dataclass(frozen=True)
class Fit:
    """Rotation and scale that fit a shape between its ends."""

    rotation: Any  # turn of the shape [rad]; as given plus this is as used
    scale: Any  # factor on the shape's size [1]
    gap: float  # distance between the far end of the shape as given and its node [m]
    length: Any  # arc length as used [m]
    course: FittedShape  # the shape before it is turned and scaled

    def angle(self, t: Any, inside: float) -> Any:
        """Return the reference angle [rad] as used."""
        return self.course.angle(t, inside) + self.rotation

    def speed(self, t: Any, inside: float) -> Any:
        """Return ds/dt [m] as used."""
        return self.course.speed(t, inside) * self.scale

    def arc(self, t: Any) -> Any:
        """Return the fractions of the arc length at parameters of any shape."""
        if self.course.uniform:
            return t
        edges, lengths = self._arcs
        values = np.atleast_1d(np.asarray(t, dtype=float))
        panel = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
        half = 0.5 * (values - edges[panel])
        places = edges[panel][..., None] + half[..., None] * (1 + _GAUSS_NODES)
        piece = np.searchsorted(self.course.breaks, edges[panel], side="right") - 1
        middles = 0.5 * (self.course.breaks[1:] + self.course.breaks[:-1])
        arc_lengths = lengths[panel]
        for number in distinct(piece):
            in_piece = piece == number
            arc_lengths[in_piece] += (self.course.speed(places[in_piece], middles[number]) * _GAUSS_WEIGHTS).sum(
                axis=-1
            ) * half[in_piece]
        return (arc_lengths / lengths[-1]).reshape(np.shape(t))[()]

    @cached_property
    def _arcs(self) -> tuple[Any, Any]:
        """Edges of panels over the parameter, and the arc lengths there before scaling."""
        edges, steps = [np.zeros(1)], [np.zeros(1)]
        for left, right in itertools.pairwise(self.course.breaks.tolist()):
            marks = np.linspace(left, right, _N_PANELS + 1)
            half = 0.5 * (marks[1] - marks[0])
            t = (marks[:-1] + half)[:, None] + half * _GAUSS_NODES
            edges.append(marks[1:])
            steps.append((self.course.speed(t, 0.5 * (left + right)) * _GAUSS_WEIGHTS).sum(axis=1) * half)
        return np.concatenate(edges), np.cumsum(np.concatenate(steps))

    def parameter(self, fraction: float) -> float:
        """Return t at a fraction of the arc length."""
        if self.course.uniform or fraction in (0.0, 1.0):
            return fraction
        if fraction not in self._parameters:
            from cfmkit.numerics.roots import bracketed_root

            self._parameters[fraction] = bracketed_root(lambda t: float(np.real(self.arc(t))) - fraction, 0.0, 1.0)
        return self._parameters[fraction]

    @property
    def turn(self) -> float:
        """By how much the angle turns along the unloaded shape, to and fro added up, corners left out [rad]."""
        return sum(_turn_of(self.course, left, right) for left, right in itertools.pairwise(self.course.breaks))

    @cached_property
    def _parameters(self) -> dict[float, float]:
        """Parameters that were requested, by the fraction."""
        return {}


def fit(
    beam: Beam,  # may hold complex steps
    reach: Any,  # may hold them too
    real_fit: Fit | None = None,  # the same fit without complex steps: it may know the parameters of the stations
) -> Fit:
    """Return the beam's shape fitted to the vector `reach` between its ends, (dx, dy) [m].

    Raises InputError if the ends coincide, or the shape closes on itself.
    """
    dx, dy = reach
    distance = (dx * dx + dy * dy) ** 0.5
    if not np.real(distance) > 0:
        raise InputError(f"the ends of the beam {beam.start}-{beam.end} coincide")
    course = beam.shape.course(distance)
    (cx, cy), length = _chord_and_length(course)
    shape_chord = (cx * cx + cy * cy) ** 0.5
    if not np.real(shape_chord) > 1e-9 * np.real(length):
        raise InputError(f"the shape of the beam {beam.start}-{beam.end} returns to its start: it cannot be fitted")
    gap = float(np.hypot(np.real(dx - cx), np.real(dy - cy)))
    if beam.closure == "raw":
        return _fix_breaks(Fit(0.0, 1.0, gap, length, course), beam, real_fit)
    rotation = direction(dx * cx + dy * cy, dy * cx - dx * cy)
    scale = distance / shape_chord
    return _fix_breaks(Fit(rotation, scale, gap, length * scale, course), beam, real_fit)


def _fix_breaks(fitted: Fit, beam: Beam, real_fit: Fit | None) -> Fit:
    """Return a fit over a parameter in which complex steps move neither the shape's breaks nor the section's stations.

    Elements end there (`cfmkit.elastica.mechanics.discretise`). A station keeps its fraction u of the arc length: where
    the arc length changes along the shape's own parameter t, or u does, it moves there by
    dt = (du - d(arc)) / (d(arc)/dt).
    """
    thickness = beam.section.thickness
    if not (np.iscomplexobj(fitted.length) or (isinstance(thickness, Taper) and np.iscomplexobj(thickness.stations))):
        return fitted
    breaks = np.real(fitted.course.breaks)
    if np.iscomplexobj(fitted.course.breaks):
        fitted = replace(fitted, course=fitted.course.reparametrize(breaks, fitted.course.breaks))
    stations = beam.section.stations[1:-1]
    if not len(stations) or (fitted.course.uniform and not np.iscomplexobj(thickness.stations)):  # type: ignore[union-attr]
        return fitted
    marks, steps = breaks, np.zeros(len(breaks))
    for station in stations.tolist():
        t = (real_fit or fitted).parameter(station)
        ahead = _station_step(beam, station) - np.imag(fitted.arc(t))
        step = float(ahead * np.real(fitted.length) / np.real(fitted.speed(t, t)))
        k = int(np.searchsorted(marks, t - PARAMETER_TOL))
        if marks[k] > t + PARAMETER_TOL:
            marks, steps = np.insert(marks, k, t), np.insert(steps, k, step)
        elif not _has_corner(fitted.course, t):
            steps[k] = step
        elif _has_step(beam.section, station) and abs(step) > _ANGLE_TOL * _step_changes(fitted.course):
            raise InputError(
                f"a corner of the beam {beam.start}-{beam.end} and a step of its thickness move past each other: "
                "no derivative there"
            )
    return replace(fitted, course=fitted.course.reparametrize(marks, marks + 1j * steps))


def _has_corner(course: FittedShape, t: float) -> bool:
    """Return True if the angle jumps at the break at t; the ends count as corners."""
    k = int(np.abs(course.breaks - t).argmin())
    if k in (0, len(course.breaks) - 1):
        return True
    before, after = 0.5 * (course.breaks[k - 1 : k + 1] + course.breaks[k : k + 2])
    return bool(abs(np.real(course.angle(t, after) - course.angle(t, before))) > _ANGLE_TOL)


def _has_step(section: Section, station: float) -> bool:
    """Return True if the thickness jumps at a station."""
    thickness = section.thickness
    return isinstance(thickness, Taper) and bool(np.ptp(thickness.values[thickness.stations.real == station].real) > 0)


def _station_step(beam: Beam, station: float) -> float:
    """Return the imaginary step of a station of a taper."""
    taper: Any = beam.section.thickness
    steps = np.imag(taper.stations[np.real(taper.stations) == station])
    if np.ptp(steps) > 0:
        raise InputError(
            f"both stations of a step in the thickness of the beam {beam.start}-{beam.end} must move alike: "
            "no derivative there"
        )
    return float(steps[0])


def _step_changes(course: FittedShape) -> float:
    """Return by how much complex steps change angle and, relatively, speed at the middles of a course's pieces."""
    middles = (0.5 * (course.breaks[1:] + course.breaks[:-1])).tolist()
    angles = [abs(np.imag(course.angle(t, t))) for t in middles]
    return float(max(*angles, *(abs(np.imag(course.speed(t, t)) / np.real(course.speed(t, t))) for t in middles)))


def _turn_of(course: FittedShape, left: Any, right: Any) -> float:
    """Return by how much the angle turns between two neighbouring breaks, to and fro added up [rad].

    The angle itself, unlike its sine, shows at a few places how far it runs.
    """
    places = np.linspace(np.real(left), np.real(right), _N_PANELS * len(_GAUSS_NODES))
    angles = np.broadcast_to(np.real(course.angle(places, float(np.real(0.5 * (left + right))))), places.shape)
    return float(np.abs(np.diff(angles)).sum())


def _chord_and_length(course: FittedShape) -> tuple[tuple[Any, Any], Any]:
    """Return the integrals of (cos, sin) of the angle and of the speed over a whole course."""
    x: Any = 0.0
    y: Any = 0.0
    length: Any = 0.0
    for left, right in itertools.pairwise(course.breaks):
        inside = float(np.real(0.5 * (left + right)))
        count = max(_N_PANELS, ceil(_turn_of(course, left, right) / _MAX_PANEL_TURN))
        panels = np.linspace(left, right, count + 1)
        half = 0.5 * (panels[1] - panels[0])
        t = ((panels[:-1] + half)[:, None] + half * _GAUSS_NODES).ravel()
        weights = np.tile(half * _GAUSS_WEIGHTS, count)
        speed, angle = course.speed(t, inside) * weights, course.angle(t, inside)
        x = x + (speed * np.cos(angle)).sum()
        y = y + (speed * np.sin(angle)).sum()
        length = length + speed.sum()
    return (x, y), length
