"""The track on which a roller's centre really runs, with the brace and roller that are built in.

On the flank the centre is one roller radius from the cam along the normal; on the corner of an undercut cam the roller
pivots. The slider position is what drives the mechanism, so the track is the part over which the slider rises while the
rollers move out: where another brace or friction makes the slider fall first, that part is passed over (a dead point),
and where the slider would fall again near the end of the brace the track ends.

A `Track` finds its ends when it is made; its formulas take numbers, or columns: `TrackRows` are tracks of one kind.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
from cfmkit.families.cam.geometry.path import RollerPath
from cfmkit.families.cam.geometry.slope_law import Real, brace_tangent
from cfmkit.families.rows import agree, fails, is_column, root_between, rows_of
from cfmkit.numerics.roots import bracketed_root, invert_increasing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray


Reason = Literal["brace", "crossed", "dead"]


class NoTrack(ValueError):
    """The roller cannot run on the cam, because of `reason`.

    "brace": it does not reach from the axis to the track's start; "crossed": the right roller would
    start left of the axis; "dead": the slider does not rise above its start as the rollers move out.
    """

    def __init__(self, reason: Reason, start: float) -> None:
        """Keep the reason and the x of the track's start [m]."""
        self.reason, self.start = reason, start
        super().__init__(reason)


@dataclass(frozen=True, eq=False, repr=False)
class TrackStates(ShortRepr):
    """Positions of the right roller, for each requested slider position."""

    # x, y, (n,): roller centre [m]
    x: FloatArray
    y: FloatArray
    slope: FloatArray  # (n,) dy/dx of the centre's track there
    tangent: FloatArray  # (n,) tan(alpha) of the brace
    on_corner: NDArray[np.bool_]  # (n,) whether the roller pivots on the cam's corner
    parameter: FloatArray  # (n,) path coordinate of the contact on the flank [m]; that of the corner while on it
    compute_bend: Callable[[], FloatArray]

    @cached_property
    def bend(self) -> FloatArray:
        """d2y/dx2 of the centre's track, (n,) [1/m]; it is wanted at dead points alone."""
        return self.compute_bend()

    @cached_property
    def pressure_angle(self) -> FloatArray:
        """Angle between a brace's pull and its roller's motion [rad]; at 90 deg the slider moves nothing."""
        angle: FloatArray = np.arctan2(1.0 + self.slope * self.tangent, self.slope - self.tangent)
        return angle

    def __reduce__(self) -> tuple[Any, ...]:
        # what computes the last array may not be pickled
        return TrackStates, (*self.fields(), partial(np.asarray, self.bend))

    def fields(self) -> tuple[NDArray[Any], ...]:
        """Return the arrays in the order in which the class takes them."""
        return self.x, self.y, self.slope, self.tangent, self.on_corner, self.parameter

    def combine(self, function: Callable[..., Any], *others: TrackStates) -> TrackStates:
        """Return states whose arrays are a function of the arrays of these and of others."""
        states = self, *others
        arrays = (function(*fields) for fields in zip(*(state.fields() for state in states), strict=True))
        x, y, slope, tangent, on_corner, parameter = arrays
        return TrackStates(
            x, y, slope, tangent, on_corner, parameter, lambda: function(*(state.bend for state in states))
        )


@dataclass(frozen=True)
class TrackStretch:
    """A part of the track on which the slider rises."""

    on_corner: bool  # whether the roller pivots on the corner
    # low, high: range of the parameter: the angle of the contact normal on the corner [rad], the path coordinate on the
    # flank [m]
    low: float
    high: float
    at: Callable[[Any], tuple[Any, Any, Any]]  # ``at(parameter) -> (slider position, x, slope of the centre's track)``


N_KNOTS = 65


class Pivot(NamedTuple):
    """A roller that pivots on a corner, of one cam or of many side by side."""

    # x, y: the corner [m]
    x: Any
    y: Any
    # radius, brace: between corner and roller centre, and between that and the slider's pin [m]
    radius: Any
    brace: Any
    # low, high: angles of the contact normal between which it pivots [rad]
    low: Any
    high: Any


def pivot_angle(slider: FloatArray, pivot: Pivot) -> FloatArray:
    """Return the angle of the contact normal on the corner [rad], from a triangle of known sides."""
    rise, brace, radius = slider - pivot.y, pivot.brace, pivot.radius
    side = np.hypot(pivot.x, rise)
    along = ((radius - brace) * (radius + brace) + side * side) / (2.0 * side)
    square = (brace - side + radius) * (brace + side - radius) * (side + radius - brace) * (side + radius + brace)
    off = np.sqrt(np.maximum(square, 0.0)) / (2.0 * side)
    turn = np.arctan2(off * rise - along * pivot.x, -(along * rise + off * pivot.x))
    return np.asarray(np.minimum(np.maximum(turn, pivot.low), pivot.high))


class Track:
    """The track of a roller's centre on a given cam, with the roller and the brace built in [m].

    Material left on the flank beyond the profile, an `offset` >= 0 [m], rounds a corner. Missing material is not an
    offset: it is the cam cut for a larger roller (`flank_from_roller_path.cut_cam`). Raises NoTrack if the roller
    cannot run on the cam.
    """

    is_turned = False  # whether the flank is not where it was to be cut
    n_guide_knots = 65

    def __init__(self, profile: CamProfile, roller_radius: float, brace_length: float, offset: float = 0.0) -> None:
        """Find the ends of the track."""
        self.profile, self.brace_length = profile, brace_length
        self.radius = roller_radius + offset
        self.shift = self.radius - profile.roller_radius
        self._corner_point = profile.corner.point if profile.corner else (0.0, 0.0)
        x_first = profile.offset_points(profile.start, self.shift)[0]
        self._pivots = self._pivot_range()
        begins = self._corner_point[0] + self.radius * np.sin(self._pivots[0]) if profile.corner else x_first
        if fails(np.minimum(x_first, begins) <= 0):
            raise NoTrack("crossed", begins)
        if fails(np.maximum(x_first, begins) >= brace_length * (1 - 1e-6)):
            raise NoTrack("brace", max(x_first, begins))
        law, self._begins = profile.path.law, begins
        self._is_shifted = agree(np.not_equal(self.shift, 0.0))
        self._follows_law = not (self._is_shifted or self.is_turned) and agree(np.equal(brace_length, law.brace_length))
        self._is_ideal = self._follows_law and law.is_ideal
        self._set_limits(x_first)

    def _pivot_range(self) -> tuple[Any, Any]:
        """Return the angles of the contact normal between which the roller turns about the corner [rad]."""
        xc, yc = self._corner_point
        law = self.profile.path.law
        return np.arctan2(law.rest_half_width - xc, yc), np.arctan(law.slope(self.profile.start))

    def _set_limits(self, x_first: Any) -> None:
        """Set the slider positions at which pieces begin and end."""
        pivots = self.profile.corner is not None
        at_corner, rate = self._evaluate_corner(self._pivots[0]) if pivots else self._evaluate_flank(self.profile.start)
        # Positions of the slider [m], as heights above the path's first point. The dead point is the lowest that the
        # track can hold, below the start only where the slider has to fall before it can rise; at `corner_end` the
        # roller leaves the corner (the start if there is none, or it is passed over). `turns_back`: the track ends
        # because the slider would fall beyond, before the flank does.
        self.start = self.dead_point = at_corner
        if pivots and agree(self._evaluate_corner(self._pivots[1])[1] > 0):
            self.flank_range, self.turns_back = self._find_rising_part(skip=False)
            self.corner_end = self._evaluate_flank(self.flank_range[0])[0]
            self.dead_point = at_corner if agree(rate >= 0) else self._collinear_position()
        else:
            self.flank_range, self.turns_back = self._find_rising_part(skip=True)
            low = self._evaluate_flank(self.flank_range[0])[0]
            self.dead_point, self.corner_end = low if agree(low < self.start) else self.start, self.start
        self.end = self._evaluate_flank(self.flank_range[1])[0]
        if fails(self.end - self.start <= 1e-11 * self.brace_length):
            raise NoTrack("dead", x_first)

    def _collinear_position(self) -> Any:
        """Return the slider position at which brace and roller are in line over the corner [m]."""
        xc, yc = self._corner_point
        across = self.brace_length - self.radius
        return yc + ((across - xc) * (across + xc)) ** 0.5

    def _find_rising_part(self, skip: bool) -> tuple[tuple[Any, Any], bool]:
        """Return the path coordinates between which the slider rises on the flank, and whether it falls beyond.

        With `skip`, a part at the beginning on which it falls is left out.
        """
        low, high = self.profile.start, self._brace_limit()
        if self._follows_law and self.profile.path.law.always_rises:
            return (low, high), False
        knots = low + (high - low) * np.linspace(0.0, 1.0, N_KNOTS)
        rising = self._evaluate_flank(knots)[1] > 0
        rising[..., :1] |= not skip or self._evaluate_flank(low)[1] >= -1e-12
        if fails(~rising.any(axis=-1)):
            raise NoTrack("dead", low)
        first = np.argmax(rising, axis=-1)[..., None]
        fallen = ~rising & (np.arange(N_KNOTS) > first)
        falls = np.argmax(fallen, axis=-1)[..., None]
        knots = np.broadcast_to(knots, rising.shape)
        begins, turns_back = agree(_flat(first) > 0), agree(_flat(falls) > 0)

        def rate(u: Any) -> Any:
            return self._evaluate_flank(u)[1]

        def turn(knot: Any) -> Any:
            before, after = (np.take_along_axis(knots, at, axis=-1) for at in (knot - 1, knot))
            return root_between(rate, _flat(before), _flat(after))

        return (turn(first) if begins else low, turn(falls) if turns_back else high), turns_back

    def _brace_limit(self) -> Any:
        """Return the largest path coordinate at which the brace still reaches the axis [m]."""
        low, high = self.profile.start, self.profile.end

        def margin(u: Any) -> Any:
            return self.brace_length * (1 - 1e-12) - self._axis_distance(u)

        return high if agree(margin(high) >= 0) else root_between(margin, low, high)

    def _axis_distance(self, u: Any) -> Any:
        """Return how far the roller's centre is from the slider's axis [m]."""
        return self.profile.offset_points(u, self.shift)[0]

    def _slider_position(self, x: Real, y: Real | float) -> Real:
        return y + ((self.brace_length - x) * (self.brace_length + x)) ** 0.5

    def _evaluate_flank(self, u: Real) -> tuple[Real, Real]:
        """Return slider position and its derivative along the flank."""
        law = self.profile.path.law
        if self._follows_law:
            return self._slider_position(u, self.profile.path.height(u)), law.slope(u) - brace_tangent(
                u, law.brace_length
            )
        x, y = self.profile.offset_points(u, self.shift)
        rate = (law.slope(u) - brace_tangent(x, self.brace_length)) * (1.0 + self.shift / law.curvature_radius(u))
        return self._slider_position(x, y), rate

    def _evaluate_corner(self, turn: float) -> tuple[float, float]:
        """Return slider position, and the sign of its derivative, while the roller pivots on the corner."""
        slider, x, slope = self._corner_piece(turn)
        return slider, slope - brace_tangent(x, self.brace_length)

    def states(self, slider: FloatArray) -> TrackStates:
        """Return the roller's states at slider positions between `start` and `end`, of any shape [m]."""
        on_corner = slider < self.corner_end
        if not on_corner.any():
            return self._flank_states(slider)
        corner = self._corner_states(slider[on_corner])
        if on_corner.all():
            return corner.combine(lambda field: field.reshape(slider.shape))
        return corner.combine(partial(_join, on_corner), self._flank_states(slider[~on_corner]))

    def _flank_states(self, slider: FloatArray) -> TrackStates:
        law, u = self.profile.path.law, self._flank_parameter(slider)
        x = u + self.shift * self.profile.normal(u)[0] if self._is_shifted else u
        height = self._slider_position(x, 0.0)
        # Where the path is nearly vertical y follows from the slider far better than from x.
        y, tangent = slider - height, x / height
        slope = law.slope(u, tangent if self._follows_law else None)
        return TrackStates(x, y, slope, tangent, np.zeros(slider.shape, dtype=bool), u, partial(self._flank_bend, u))

    def _flank_bend(self, u: FloatArray) -> FloatArray:
        law = self.profile.path.law
        bend: FloatArray = law.slopes(u)[1]
        return bend / (1.0 + self.shift / law.curvature_radius(u)) if self._is_shifted else bend

    def _corner_states(self, slider: FloatArray, rows: Any = None) -> TrackStates:
        """Return states on the corner, of some rows: with the centre and the slider's pin it is a triangle."""
        lengths = *self.pivot, self.start, self.dead_point, self.profile.start
        *sides, start, dead_point, contact = lengths if rows is None else rows_of(lengths, rows)
        pivot = Pivot(*sides)
        first = (slider <= start) & (dead_point == start)
        turn = np.where(first, pivot.low, self._turn_on_corner(slider, pivot))
        sin, cos = np.sin(turn), np.cos(turn)
        x, y = pivot.x + pivot.radius * sin, pivot.y - pivot.radius * cos
        always, tangent = np.ones(slider.shape, dtype=bool), self._brace_tangent(x, y, pivot.brace)
        contacts = np.broadcast_to(contact, slider.shape)
        return TrackStates(x, y, sin / cos, tangent, always, contacts, lambda: 1.0 / (pivot.radius * cos * cos * cos))

    def _turn_on_corner(self, slider: FloatArray, pivot: Pivot) -> FloatArray:
        return pivot_angle(slider, pivot)

    def _brace_tangent(self, x: Any, _y: Any, brace_length: Any) -> Any:
        return brace_tangent(x, brace_length)

    @property
    def pivot(self) -> Pivot:
        """The roller on the cam's corner: place of the corner, radius, brace, and the angles of the turn about it."""
        return Pivot(*self._corner_point, self.radius, self.brace_length, *self._pivots)

    @property
    def first_x(self) -> Any:
        """The x of the roller's centre at the start of the track [m]."""
        if agree(self.dead_point < self.start):  # the track begins where the slider is back at its start
            return _flat(self.states(np.atleast_1d(self.start)).x)
        return self._begins

    def select_rows(self, _rows: Any) -> Track:
        """Return the track itself: what many mechanisms share is the same for all of them."""
        return self

    def stretches(self) -> Iterator[TrackStretch]:
        """Yield the parts of the track on which the slider rises, in order, from `start` on."""
        passed, start = agree(self.start > self.dead_point), np.atleast_1d(self.start)
        on_corner = agree(self.corner_end > self.start)
        if on_corner:
            low = _flat(np.arctan(self._corner_states(start).slope)) if passed else self._pivots[0]
            yield TrackStretch(True, low, self._pivots[1], self._corner_piece)
        low, high = self.flank_range
        if passed and not on_corner:
            low = _flat(self._flank_parameter(start))
        yield TrackStretch(False, low, high, self._flank_piece)

    def slider_at(self, x: float) -> float:
        """Return the slider position with the roller's centre at `x` [m], or at the nearer end of the track."""
        for part in self.stretches():

            def measure_excess(u: float, part: TrackStretch = part) -> float:
                return float(part.at(u)[1]) - x

            if measure_excess(part.low) >= 0 or measure_excess(part.high) >= 0:
                place = (
                    part.low if measure_excess(part.low) >= 0 else bracketed_root(measure_excess, part.low, part.high)
                )
                return float(part.at(place)[0])
        return self.end

    def _corner_piece(self, turn: Real) -> tuple[Real, Real, Real]:
        """Return slider position, x and slope where the contact normal on the corner is turned by an angle [rad]."""
        xc, yc = self._corner_point
        sin, cos = np.sin(turn), np.cos(turn)
        x = xc + self.radius * sin
        return self._slider_position(x, yc - self.radius * cos), x, sin / cos

    def _flank_piece(self, u: Real) -> tuple[Real, Real, Real]:
        x, y = self.profile.offset_points(u, self.shift) if self._is_shifted else (u, self.profile.path.height(u))
        return self._slider_position(x, y), x, self.profile.path.law.slope(u)

    def _flank_parameter(self, slider: FloatArray) -> FloatArray:
        """Return the path coordinate of the contact on the flank."""
        law = self.profile.path.law
        low, high = self.flank_range
        if self._is_ideal:
            travel = np.maximum(slider - self._slider_position(law.rest_half_width, 0.0), 0.0)
            return np.minimum(np.maximum(law.position(travel), low), high)
        zero, places, excess = self._guide
        root = np.sqrt(np.maximum(slider - zero, 0.0))
        guess = law.position(root * root) + self._interpolate(root, places, excess)
        return invert_increasing(self._evaluate_flank, slider, self.flank_range, guess)

    @staticmethod
    def _interpolate(at: FloatArray, places: FloatArray, values: FloatArray) -> FloatArray:
        return np.interp(at, places, values)

    @cached_property
    def _guide(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """First estimates: a slider position, square roots of the travel from it, and path coordinates less ideal ones.

        The difference from the ideal profile is smooth and small, so that straight lines do.
        """
        low, high = self.flank_range
        knots = low + (high - low) * np.linspace(0.0, 1.0, self.n_guide_knots)
        slider = self._evaluate_flank(knots)[0]
        zero = np.minimum(self.start, slider[..., :1])
        root = np.sqrt(np.maximum(slider - zero, 0.0))
        return zero, root, knots - self.profile.path.law.position(root * root)


class TurnedTrack(Track):
    """The track on a flank that is turned by an angle [rad] about a point of the axis at a height [m].

    States are those in the frame of the flank as it was to be cut; slider positions are along the axis.
    """

    is_turned, n_guide_knots = True, 1025

    def __init__(self, track: Track, angle: float, height: float) -> None:
        """Find the ends of the track."""
        self.angle, self.turn, self.height = angle, cmath.exp(1j * angle), height
        super().__init__(track.profile, track.radius, track.brace_length)

    def turn_about(self, x: Any, y: Any) -> Any:
        """Return turned points as complex numbers x + iy [m]."""
        return (x + 1j * (y - self.height)) * self.turn + 1j * self.height

    def _axis_distance(self, u: Any) -> Any:
        return self.turn_about(*self.profile.offset_points(u, self.shift)).real

    def _slider_position(self, x: Any, y: Any) -> Any:
        at = self.turn_about(x, y)
        return super()._slider_position(at.real, at.imag)

    def _evaluate_flank(self, u: Any) -> tuple[Any, Any]:
        line = self.profile.parallel(u, self.shift)
        at, direction = self.turn_about(line.x, line.y), (1.0 + 1j * line.slope) * self.turn
        drop = ((self.brace_length - at.real) * (self.brace_length + at.real)) ** 0.5
        return at.imag + drop, (direction.imag - direction.real * at.real / drop) * line.stretch

    def _evaluate_corner(self, turn: float) -> tuple[Any, Any]:
        xc, yc = self._corner_point
        at = self.turn_about(xc + self.radius * np.sin(turn), yc - self.radius * np.cos(turn))
        direction = cmath.exp(1j * turn) * self.turn
        rate = direction.imag - direction.real * brace_tangent(at.real, self.brace_length)
        return super()._slider_position(at.real, at.imag), rate

    def _collinear_position(self) -> Any:
        corner = self.turn_about(*self._corner_point)
        across = self.brace_length - self.radius
        return corner.imag + ((across - corner.real) * (across + corner.real)) ** 0.5

    def _flank_states(self, slider: FloatArray) -> TrackStates:
        u = self._flank_parameter(slider)
        line = self.profile.parallel(u, self.shift)
        tangent = self._brace_tangent(line.x, line.y, self.brace_length)
        bend, on_corner = line.curvature * line.length**3 / line.stretch, np.zeros(slider.shape, dtype=bool)
        return TrackStates(line.x, line.y, line.slope, tangent, on_corner, u, lambda: bend)

    def _turn_on_corner(self, slider: FloatArray, pivot: Pivot) -> FloatArray:
        corner, ends = self.turn_about(pivot.x, pivot.y), (pivot.low + self.angle, pivot.high + self.angle)
        turned = Pivot(corner.real, corner.imag, pivot.radius, pivot.brace, *ends)
        return pivot_angle(slider, turned) - self.angle

    def _brace_tangent(self, x: Any, y: Any, brace_length: Any) -> Any:
        return brace_tangent(self.turn_about(x, y).real, brace_length)


def track_of(profile: CamProfile, roller_radius: Any, brace_length: Any, offset: Any = 0.0) -> Track:
    """Return the track of one mechanism, or, where a number is a column (m, 1), tracks side by side.

    Raises NoTrack if the roller cannot run on the cam; RowsDiffer if that is so of some rows, or if they take different
    ways.
    """
    lengths = roller_radius, brace_length, offset, profile.roller_radius, profile.end
    several = is_column(*lengths, *profile.path.law.numbers)
    return (TrackRows if several else Track)(profile, roller_radius, brace_length, offset)


def _flat(values: NDArray[Any]) -> Any:
    """Return a column as it is, the one value of an array (1,) as a number."""
    return values if values.ndim > 1 else values[0].item()


def _join(on_corner: NDArray[np.bool_], corner: NDArray[Any], flank: NDArray[Any]) -> NDArray[Any]:
    """Return values of which some are on the corner; those on the flank are given where the others are not, or all."""
    if flank.ndim > 1:
        joined = np.array(np.broadcast_to(flank, on_corner.shape))
    else:
        joined = np.empty(on_corner.shape, dtype=flank.dtype)
        joined[~on_corner] = flank
    joined[on_corner] = corner.ravel()
    return joined


def select_profiles(profile: CamProfile, rows: Any) -> CamProfile:
    """Return some of the cams of one kind side by side."""
    law, radius, end, corner = rows_of((profile.path.law, profile.roller_radius, profile.end, profile.corner), rows)
    return CamProfile(RollerPath(law, end), radius, end, corner)


class TrackRows(Track):
    """Tracks of one kind side by side: numbers that differ are columns (m, 1), slider positions are (m, n)."""

    def select_rows(self, rows: Any) -> TrackRows:
        """Return some of the tracks."""
        chosen, values = object.__new__(TrackRows), dict(vars(self))
        chosen.profile = select_profiles(values.pop("profile"), rows)
        vars(chosen).update({name: rows_of(value, rows) for name, value in values.items()})
        return chosen

    def states(self, slider: FloatArray) -> TrackStates:
        """Return the rollers' states at slider positions of each track, (m, n) [m]."""
        on_corner = slider < self.corner_end
        if not on_corner.any():
            return self._flank_states(slider)
        few = self._corner_states(slider[on_corner][:, None], np.nonzero(on_corner)[0])
        return few.combine(partial(_join, on_corner), self._flank_states(np.maximum(slider, self.corner_end)))

    @staticmethod
    def _interpolate(at: FloatArray, places: FloatArray, values: FloatArray) -> FloatArray:
        if places.ndim == 1:  # what differs in these tracks does not move them
            return np.interp(at, places, values)
        return np.stack([np.interp(*row) for row in zip(at, places, values, strict=True)])
