"""Moving parts: two sides, each with its roller's curve, a slider and springs; and how the slider is moved.

One side of the mechanism: the curve of its roller's centre, and which place belongs to a position of the slider. The
curve has two kinds of pieces: the line at a constant distance from the roller path, and, where the cam is undercut, a
circle about the corner before it. Points, tangents and curvature are analytic.

The slider's pin is on the axis at i S, the roller's centre C on its curve, the brace
between them: |C - i S| = L, that is

    S = Im C + sqrt(L^2 - (Re C)^2),

an explicit function of the curve's parameter, which is inverted by Newton's method. The
curve may be turned about the origin (a slider that deviates from the axis of the cam, or
a flank cut at a wrong angle). The side works where the slider rises along the curve.

Complex numbers x + iy [m], x outwards; the left side is mirrored.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import brief
from cfmkit.numerics.roots import FLOAT_EPS, bracketed_root, invert_increasing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.axis_springs import AxisSprings
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import Track

    ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class SideParts:
    """Dimensions and masses of a side, or of both as columns (2, 1), SI units; braces balance at mid-length."""

    brace_length: Any
    brace_mass: Any
    brace_inertia: Any
    roller_radius: Any
    roller_mass: Any
    roller_inertia: Any


@dataclass(frozen=True)
class Machine:
    """Everything that decides the forces of a motion, SI units."""

    # right, left: the left one as its mirror image; they need not be alike
    right: Side
    left: Side
    slider_mass: float  # [kg]
    springs: AxisSprings  # between the axes of the rollers
    gravity: float  # acceleration against the slider's travel up; 0 switches weight off [m/s^2]
    friction: float = 0.0  # rolling resistance over roller radius
    sideways: float = 0.0  # acceleration across the slider's travel, to the right, with which weight acts [m/s^2]

    @cached_property
    def parts(self) -> SideParts:
        """The parts of both sides as columns (2, 1), so that they multiply a row each."""
        columns = np.array([astuple(self.right.parts), astuple(self.left.parts)]).T[..., None]
        return SideParts(*columns)

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest position of the slider that both sides allow [m]."""
        right, left = self.right.span, self.left.span
        return max(right[0], left[0]), min(right[1], left[1])

    def stances(self, position: FloatArray) -> tuple[Stance, Stance]:
        """Return where the right and the left roller are for slider positions within `span` [m].

        Sides with the same geometry are solved once; that changes no number.
        """
        right = self.right.stance(position)
        return right, right if self.left.runs_like(self.right) else self.left.stance(position)


class Moment(NamedTuple):
    """Slider position [m], speed [m/s] and acceleration [m/s^2], each (n,) or a number."""

    position: Any
    speed: Any
    acceleration: Any

    def __repr__(self) -> str:
        """Return the three, each with a short text."""
        return f"Moment{tuple(brief(array) for array in self)}"


@dataclass(frozen=True)
class Cycloid:
    """Cycloidal motion: rest to rest without a jump of acceleration [SS, eq. 17]."""

    start: float  # slider position at the beginning [m]
    stroke: float  # travel, negative for lowering [m]
    time: float  # duration [s]

    def times(self, points: int) -> FloatArray:
        """Return `points` equal steps from beginning to end [s]."""
        return np.linspace(0.0, self.time, points)

    def evaluate(self, times: FloatArray | np.float64) -> Moment:
        """Return position, speed and acceleration at times between 0 and `time` [s].

        Examples
        --------
        >>> middle = Cycloid(0.2, 0.1, 0.5).evaluate(np.array([0.25]))
        >>> [round(float(values[0]), 12) for values in middle]
        [0.25, 0.4, 0.0]
        """
        share = times / self.time
        turn = (2.0 * np.pi) * share
        sine, speed = np.sin(turn), self.stroke / self.time
        position = self.start + self.stroke * (share - sine / (2.0 * np.pi))
        return Moment(position, speed * (1.0 - np.cos(turn)), (2.0 * np.pi * speed / self.time) * sine)


class CurvePoints(NamedTuple):
    """Points of a curve for values of its parameter, each (n,).

    `point` [m], unit `tangent`, `curvature` [1/m] (positive to the left of the tangent),
    and `pace`, the length of curve per unit of the parameter.
    """

    point: ComplexArray
    tangent: ComplexArray
    curvature: FloatArray
    pace: FloatArray


@dataclass(frozen=True)
class Flank:
    """The line at a distance `shift` [m] outwards from the roller path; its parameter is the path coordinate."""

    profile: CamProfile
    shift: float
    ends: tuple[float, float]
    on_corner: bool = False

    def evaluate(self, parameter: FloatArray) -> CurvePoints:
        """Return the points for path coordinates [m]."""
        slope, bend = self.profile.path.law.slopes(parameter)
        square = 1.0 + slope * slope
        length = np.sqrt(square)
        tangent, curvature = (1.0 + 1j * slope) / length, bend / (square * length)
        point = parameter + 1j * self.profile.path.height(parameter)
        if self.shift:
            stretch = 1.0 + self.shift * curvature
            point, curvature, length = point - 1j * self.shift * tangent, curvature / stretch, length * stretch
        return CurvePoints(point, tangent, curvature, length)


@dataclass(frozen=True)
class CornerArc:
    """The circle on which the centre turns about the cam's corner; its parameter is the angle [rad]."""

    corner: complex
    radius: float
    ends: tuple[float, float]
    on_corner: bool = True

    def evaluate(self, parameter: FloatArray) -> CurvePoints:
        """Return the points for angles of the centre as seen from the corner [rad]."""
        toward = np.exp(1j * parameter)
        size = np.full(parameter.shape, self.radius)
        return CurvePoints(self.corner + self.radius * toward, 1j * toward, 1.0 / size, size)


CurvePiece = Flank | CornerArc
"""A smooth piece of a curve between two values of its parameter."""


def pieces_of(track: Track) -> tuple[CurvePiece, ...]:
    """Return the curve of the roller's centre on a cam, from the start of the track to the cam's end."""
    profile = track.profile
    flank = Flank(profile, track.shift, (profile.start, profile.end))
    if profile.corner is None:
        return (flank,)
    corner = complex(*profile.corner.point)
    first = profile.path.law.rest_half_width - corner
    last = flank.evaluate(np.array([profile.start])).point[0] - corner
    return CornerArc(corner, track.radius, (float(np.angle(first)), float(np.angle(last)))), flank


N_KNOTS = 129
GUIDE_KNOTS = 2049
NEWTON_STEPS = 5
"""Estimates by 2049 knots need two at most in the tests; a bracketed search takes over where five are not enough."""


class Stance(NamedTuple):
    """Pose of a side: roller centre [m], tangent and curvature [1/m] of its curve, on the corner or not; all (n,)."""

    center: ComplexArray
    tangent: ComplexArray
    curvature: FloatArray
    on_corner: NDArray[np.bool_]


class NoRise(ValueError):
    """The slider does not rise anywhere on the curve."""


@dataclass(frozen=True)
class RisingStretch:
    """A part of the curve on which the slider rises: piece, ends of the parameter, slider positions there [m]."""

    piece: CurvePiece
    ends: tuple[float, float]
    span: tuple[float, float]


@dataclass(frozen=True)
class Side:
    """One side, turned by `angle` about the point at `height` above the start of the roller path."""

    parts: SideParts  # brace and roller
    pieces: tuple[CurvePiece, ...]  # the curve of the roller's centre, before it is turned
    angle: float = 0.0  # counter-clockwise, as seen on the right side [rad]
    height: float = 0.0  # of the origin of all positions above the start of the roller path [m]

    @cached_property
    def turn(self) -> complex:
        """Factor that turns a point."""
        return cmath.exp(1j * self.angle)

    def rotate(self, places: CurvePoints) -> CurvePoints:
        """Return points of the curve about the origin of all positions."""
        point, tangent, curvature, pace = places
        if self.height:
            point = point - 1j * self.height
        if self.angle:
            point, tangent = point * self.turn, tangent * self.turn
        return CurvePoints(point, tangent, curvature, pace)

    def evaluate(self, piece: CurvePiece, parameter: FloatArray) -> tuple[CurvePoints, FloatArray]:
        """Return the turned points of a piece and the positions of the slider that belong to them [m]."""
        places = self.rotate(piece.evaluate(parameter))
        return places, places.point.imag + self._drop(places)

    def _drop(self, places: CurvePoints) -> FloatArray:
        """Return how far the rollers' axes are below the slider [m]."""
        x, length = places.point.real, self.parts.brace_length
        return np.asarray(np.sqrt((length - x) * (length + x)))

    def rate(self, places: CurvePoints) -> FloatArray:
        """Return the derivative of the slider's position by the parameter."""
        tangent = places.tangent
        return places.pace * (tangent.imag - tangent.real * places.point.real / self._drop(places))

    @cached_property
    def stretches(self) -> tuple[RisingStretch, ...]:
        """The parts of the curve on which the slider rises, one after the other.

        Raises NoRise if there is none.
        """
        stretches: list[RisingStretch] = []
        for piece in self.pieces:
            ends = self._rising(piece)
            if ends is None:
                stretches = []
                continue
            if ends[0] > piece.ends[0]:
                stretches = []
            span = self.evaluate(piece, np.array(ends))[1]
            stretches.append(RisingStretch(piece, ends, (float(span[0]), float(span[1]))))
            if ends[1] < piece.ends[1]:
                break
        if not stretches:
            raise NoRise
        return tuple(stretches)

    def _rising(self, piece: CurvePiece) -> tuple[float, float] | None:
        """Return between which values of the parameter the slider rises; None if nowhere."""
        low, high = piece.ends
        knots = low + (high - low) * np.linspace(0.0, 1.0, N_KNOTS) ** 2
        with np.errstate(invalid="ignore", divide="ignore"):
            rising = self.rate(self.rotate(piece.evaluate(knots))) > 0
        if not rising.any():
            return None
        first = int(np.argmax(rising))
        stop = first + int(np.argmin(rising[first:])) if not rising[first:].all() else 0

        def rate(u: float) -> float:
            return float(self.rate(self.rotate(piece.evaluate(np.array([u]))))[0])

        begin = bracketed_root(rate, float(knots[first - 1]), float(knots[first])) if first else low
        return begin, self._end(piece, float(knots[stop - 1]), float(knots[stop])) if stop else high

    def _end(self, piece: CurvePiece, low: float, high: float) -> float:
        """Return where the slider stops rising, or the brace is too short for the curve, whichever is first."""

        def steepness(u: float) -> float:
            places = self.rotate(piece.evaluate(np.array([u])))
            x, tangent = float(places.point.real[0]), places.tangent[0]
            across = (self.parts.brace_length - x) * (self.parts.brace_length + x)
            return float(tangent.imag) * math.sqrt(max(across, 0.0)) - float(tangent.real) * x

        return bracketed_root(steepness, low, high)

    def runs_like(self, side: Side) -> bool:
        """Return whether the other side has the same geometry (its masses may differ)."""
        return (
            self.pieces is side.pieces
            and (self.angle, self.height) == (side.angle, side.height)
            and self.parts.brace_length == side.parts.brace_length
        )

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest position of the slider [m]."""
        return self.stretches[0].span[0], self.stretches[-1].span[1]

    def stance(self, slider: FloatArray) -> Stance:
        """Return where the roller is for slider positions within `span` [m]."""
        if len(self.stretches) == 1 or slider.min() >= self.stretches[-1].span[0]:
            return self._solve_stance(self.stretches[-1], slider)
        edges = [stretch.span[0] for stretch in self.stretches[1:]]
        which = np.searchsorted(edges, slider, side="right")
        whole = Stance(*(np.empty(slider.shape, dtype=kind) for kind in (complex, complex, float, bool)))
        for index in np.unique(which):
            on_stretch = which == index
            for target, values in zip(
                whole, self._solve_stance(self.stretches[index], slider[on_stretch]), strict=True
            ):
                target[on_stretch] = values
        return whole

    def _solve_stance(self, stretch: RisingStretch, slider: FloatArray) -> Stance:
        piece, (low, high) = stretch.piece, stretch.ends
        u = self._guides[stretch.span].parameter(slider)
        for _ in range(NEWTON_STEPS):
            places, value = self.evaluate(piece, u)
            error = value - slider
            if np.abs(error).max() <= 8.0 * FLOAT_EPS * abs(stretch.span[1]):
                break
            with np.errstate(divide="ignore", invalid="ignore"):
                u = np.minimum(np.maximum(u - error / self.rate(places), low), high)
        else:
            u = invert_increasing(lambda v: self._rise(piece, v), slider, stretch.ends, u)
            places = self.evaluate(piece, u)[0]
        return Stance(places.point, places.tangent, places.curvature, np.full(slider.shape, piece.on_corner))

    def _rise(self, piece: CurvePiece, parameter: FloatArray) -> tuple[FloatArray, FloatArray]:
        places, value = self.evaluate(piece, parameter)
        return value, self.rate(places)

    @cached_property
    def _guides(self) -> dict[tuple[float, float], FirstGuess]:
        """First estimates on each stretch."""
        return {stretch.span: self._guide(stretch) for stretch in self.stretches}

    def _guide(self, stretch: RisingStretch) -> FirstGuess:
        low, high = stretch.ends
        knots = np.linspace(low, high, GUIDE_KNOTS)
        slider, rate = self._rise(stretch.piece, knots)
        foot = stretch.span[0] - _rise_before(knots[1] - low, slider[:3] - stretch.span[0])
        root = np.sqrt(np.maximum(slider - foot, 0.0))
        return FirstGuess.from_points(foot, root, knots, 2.0 * root / np.where(rate > 0, rate, np.inf))


@dataclass(frozen=True)
class FirstGuess:
    """Estimates of the curve's parameter from the slider's position: a cubic Hermite spline over a square root.

    Near a dead point the slider rises with the square of the parameter, so that the
    parameter is smooth over the square root of the rise above `foot` [m].
    """

    foot: float
    roots: FloatArray
    cubics: FloatArray

    @classmethod
    def from_points(cls, foot: float, roots: FloatArray, parameters: FloatArray, slopes: FloatArray) -> FirstGuess:
        """Return the spline through parameters with given slopes over increasing roots."""
        width = np.diff(roots)
        secant = np.diff(parameters) / np.where(width > 0, width, 1.0)
        begin, end = (np.where(part > 0, part, secant) for part in (slopes[:-1], slopes[1:]))
        bow = (begin + end - 2.0 * secant) / np.where(width > 0, width, 1.0) ** 2
        bend = (secant - begin) / np.where(width > 0, width, 1.0) - bow * width
        return cls(foot, roots, np.array([parameters[:-1], begin, bend, bow, roots[:-1]]))

    def parameter(self, slider: FloatArray) -> FloatArray:
        """Return estimates for slider positions [m]."""
        root = np.sqrt(np.maximum(slider - self.foot, 0.0))
        start, slope, bend, bow, base = self.cubics[:, np.searchsorted(self.roots[1:-1], root)]
        step = root - base
        estimate: FloatArray = start + step * (slope + step * (bend + step * bow))
        return estimate


def _rise_before(step: float, rises: FloatArray) -> float:
    """Return how far the slider would have risen since the dead point before a stretch begins [m].

    `rises` are those at the first three of equidistant parameters, from the first on.
    """
    curvature = (rises[2] - 2.0 * rises[1]) / step**2
    rate = (2.0 * rises[1] - 0.5 * rises[2]) / step
    return float(0.5 * rate * rate / curvature) if curvature > 0 else 0.0
