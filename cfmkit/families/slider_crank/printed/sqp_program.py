"""Optimisation problem: a strip that holds a force over the longest travel, or the flattest force over a given one.

The force is computed at Chebyshev points of the root of the travel, where it is smooth down to the steep start, and
interpolated between them, so that the band is kept everywhere and not at a few points. The stress is looked at along
the whole strip, its peaks included, near the end of the travel: it is largest there. Derivatives by the thicknesses
are exact (implicit differentiation); those of the force by the stroke too. The force is proportional to the width, the
stress does not depend on it, unless wide strips are stiffer: then by the width, as by the places of stations, central
differences are taken.

Where the stress of a strip is looked at: at the highest place of every linear piece, near the end of the travel. A
largest stress between samples is missed by them, and an optimiser finds the strip for which they miss most. So the
stress is taken at the top of every piece, where a polynomial through nine samples of one smooth segment is highest.
The slope of the stress along the strip is zero there, or the top stays at an end of the piece: the derivative of the
highest stress is that at the place where it is. It need not be largest at the very end of the travel: at the last
points it is interpolated.
"""

from __future__ import annotations

import itertools
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.designing.objective_and_constraints import DesignProgram, LimitRows, SeenPoint
from cfmkit.elastica import Control, Displacement, PathStatus, gradient, trace
from cfmkit.elastica.results.equilibria_near_known_path import drive_slope, solve_near_known_path
from cfmkit.elastica.results.path import N_PLACES
from cfmkit.errors import InputError
from cfmkit.families.slider_crank.printed.equilibrium_path import FIRST_STEP
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import SLIDER_NODE, STRIP_BEAM, Strip, stations
from cfmkit.numerics.interpolation import differentiation, interpolation

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path
    from cfmkit.families.slider_crank.printed.flexures_as_beam_network import Elasticity
    from cfmkit.specs.evaluable_target_curve import TargetCurve


METRES_PER_MM = 1e-3  # thicknesses and widths are counted in mm

Goal = Literal["stroke", "ripple", "rms"]


@dataclass(frozen=True)
class StripTask:
    """Requirements on the strip."""

    corners: FloatArray  # (k, 2) its centre line [m]
    direction: float  # of the slider's travel [rad]
    material: Elasticity  # with the stress allowed, if there is a limit
    force: float  # wanted of one set [N]
    # start, stroke: ends of the travel over which it is wanted [m]; the stroke is the first guess where it is maximised
    start: float
    stroke: float
    ripple: float  # largest deviation allowed, as a share of the force; of no use where it is minimised
    # longest stroke within the ripple; smallest ripple, or smallest root mean square, over the stroke
    goal: Goal = "stroke"
    longest: float = 0.08  # stroke never exceeded [m]
    shape: TargetCurve | None = None  # force over travel that is wanted, as a share of `force`; None: it is constant
    sets: int = 1  # equal strips that share what the design asks for

    def sum_over_sets(self, force: float) -> float:
        """Return what a design is to ask for where one set has a force [N]."""
        return force * self.sets

    def share(self, travel: Any) -> Any:
        """Return the force that is wanted at travels [m], as a share of `force`."""
        return 1.0 if self.shape is None else self.shape.evaluate(travel)


@dataclass(frozen=True)
class Form:
    """Description of a strip by numbers: thicknesses, then shares that place them, then the width."""

    count: int  # thicknesses; 1: the same everywhere
    # how many stations each straight piece has where their shares vary; empty: evenly spaced, fixed
    per_piece: tuple[int, ...] = ()
    # shares at which stations are fixed, by piece; empty with `per_piece` empty: evenly spaced
    shares: tuple[tuple[float, ...], ...] = ()
    width: float | None = None  # fixed width [m]; None: it varies too

    @property
    def placed(self) -> int:
        """Number of shares that vary."""
        return sum(self.per_piece)

    @property
    def size(self) -> int:
        """Number of numbers that describe the strip."""
        return self.count + self.placed + (self.width is None)

    def places(self, x: FloatArray, corners: FloatArray) -> FloatArray:
        """Return the stations as fractions of the length."""
        if not self.per_piece:
            return stations(corners, self.shares) if self.shares else np.linspace(0.0, 1.0, self.count)
        ends = np.cumsum((0, *self.per_piece))
        shares = np.real(x[self.count : self.count + self.placed])
        return stations(corners, [shares[a:b].tolist() for a, b in itertools.pairwise(ends)])

    def is_ordered(self, x: FloatArray, corners: FloatArray) -> bool:
        """Return whether stations that vary come one after the other."""
        return not self.per_piece or bool((np.diff(self.places(x, corners)) > MIN_STATION_DISTANCE).all())

    def width_of(self, x: FloatArray) -> float:
        """Return the width [m]."""
        return float(np.real(x[-1])) * METRES_PER_MM if self.width is None else self.width

    def strip(self, x: Any, corners: FloatArray) -> Strip:
        """Return the strip that numbers describe: thicknesses and width in mm, shares of the pieces' lengths."""
        thickness = np.asarray(x[: self.count]) * METRES_PER_MM
        if self.count == 1:
            return Strip(corners, self.width_of(x), np.repeat(thickness, 2), np.array([0.0, 1.0]))
        return Strip(corners, self.width_of(x), thickness, self.places(x, corners))


N_FORCE_POINTS, N_BAND_POINTS = 12, 81  # where the force is computed, and where its band is kept
RMS_POINTS = 10  # points of the root mean square, even in the travel, its start left out [B, eq. 14].
PATH_TOLERANCE = 1e-6
MIN_STATION_DISTANCE = 1e-5
"""Least distance of stations, as a share of the length: ranges that overlap must not exchange them."""
_DIFFERENCE_STEP = 1e-5  # of a share, or of the width as a share of itself, for central differences


@dataclass(frozen=True)
class State:
    """A strip pressed to the points of a task."""

    path: Path  # its equilibria
    force: FloatArray  # (p,) [N]
    watched: WatchedStress  # where the stress is looked at

    @cached_property
    def stress(self) -> FloatArray:
        """Stress at the tops of the strip's pieces near the end of the travel, (r,) [Pa]."""
        sections, last = self.path.sections(STRIP_BEAM), self.path.at_requested[-N_STRESS_POINTS:]
        return self.watched.stress(sections.bending_stress[last], sections.axial_stress[last])


@dataclass
class StripProgram(DesignProgram):
    """Objective and constraints of a task over a form.

    The variables are those of the form, then the stroke [cm] or the ripple [%] where that is the goal.
    """

    task: StripTask
    form: Form
    last_path: Path | None = None
    _last: tuple[FloatArray, State] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Set the fixed places and the matrices that go with them."""
        if self.task.goal == "rms":
            self.spots = np.arange(1, RMS_POINTS + 1) / RMS_POINTS
            self.between = np.eye(RMS_POINTS)
            return
        self.spots = 0.5 * (1.0 - np.cos(np.pi * np.arange(N_FORCE_POINTS) / (N_FORCE_POINTS - 1)))
        dense = 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, N_BAND_POINTS)))
        self.between = interpolation(self.spots, dense)
        self.slope = differentiation(self.spots)

    @property
    def extra(self) -> int:
        """Number of variables beside the form's."""
        return 0 if self.task.goal == "rms" else 1

    def travel(self, z: FloatArray) -> FloatArray:
        """Return the travels at which the force is computed [m]."""
        if self.task.goal == "rms":
            return np.asarray(self.task.start + (self.task.stroke - self.task.start) * self.spots)
        first, last = np.sqrt(self.task.start), np.sqrt(self.stroke(z))
        travel: FloatArray = (first + (last - first) * self.spots) ** 2
        return travel

    def stroke(self, z: FloatArray) -> float:
        """Return the end of the travel [m]."""
        return 0.01 * float(z[-1]) if self.task.goal == "stroke" else self.task.stroke

    def ripple(self, z: FloatArray) -> float:
        """Return the deviation allowed, as a share."""
        return 0.01 * float(z[-1]) if self.task.goal == "ripple" else self.task.ripple

    def network(self, x: Any) -> Network:
        """Return the network of a form's variables."""
        return self.form.strip(x, self.task.corners).network(self.task.material)

    def state(self, z: FloatArray) -> State | None:
        """Return the pressed strip; None if it has no stable equilibrium at all points."""
        if self._last is not None and np.array_equal(self._last[0], z):
            return self._last[1]
        if not self.form.is_ordered(z, self.task.corners):
            return None
        path = self._path(self.network(z[: self.form.size]), self.travel(z))
        if path is None:
            return None
        built = self._build_state(path)
        self.last_path, self._last = path, (z.copy(), built)
        return built

    def _path(self, network: Network, travel: FloatArray) -> Path | None:
        """Return the equilibria near the last ones, else from rest."""
        drive = Displacement(SLIDER_NODE, self.task.direction, travel)
        if self.last_path is not None:
            with suppress(InputError):  # stations that move can change how finely the strip is cut
                path = solve_near_known_path(self.last_path, network, drive)
                if path.status is PathStatus.COMPLETE:
                    return path
        return _trace(network, drive)

    def evaluate(self, z: FloatArray, sloped: bool) -> SeenPoint | None:
        """Return the objective, the rows of the band, and those of the stress."""
        state = self.state(z)
        if state is None:
            return None
        slopes: tuple[FloatArray | None, FloatArray | None] | None = (
            self._derivatives(z, state) if sloped else (None, None)
        )
        if slopes is None:
            return None
        force, stress = slopes
        ratio = state.force / self.task.force - self.task.share(self.travel(z))
        by = None if force is None else force / self.task.force
        objective, slope = self._objective(z, ratio, by)
        return SeenPoint(objective, slope, [*self._band(z, ratio, by), *self._strength(state, stress)])

    def _objective(self, z: FloatArray, ratio: FloatArray, by: FloatArray | None) -> tuple[float, FloatArray | None]:
        """Return the stroke with a minus [cm], the ripple [%], or the mean square; and its derivatives."""
        if self.task.goal == "rms":
            at = self.between @ ratio
            slope = None if by is None else 2e4 / len(self.between) * at @ (self.between @ by)
            return 1e4 * float(np.mean(at**2)), slope
        sign = -1.0 if self.task.goal == "stroke" else 1.0
        slope = np.zeros(len(z))
        slope[-1] = sign
        return sign * float(z[-1]), slope

    def _band(self, z: FloatArray, ratio: FloatArray, by: FloatArray | None) -> list[LimitRows]:
        """Return by how much the force is below the upper edge of its band, and above the lower one [%]."""
        if self.task.goal == "rms":
            return []
        most, off = 100.0 * self.ripple(z), 100.0 * (self.between @ ratio)
        if by is None:
            return [LimitRows("band", most - off), LimitRows("band", most + off)]
        slope = 100.0 * self.between @ by
        upper, lower = -slope, slope.copy()
        if self.task.goal == "ripple":
            upper[:, -1], lower[:, -1] = 1.0, 1.0
        return [LimitRows("band", most - off, upper), LimitRows("band", most + off, lower)]

    def _strength(self, state: State, by: FloatArray | None) -> list[LimitRows]:
        """Return by which share the stress is below the allowable one, ten times: as strict as the band is."""
        limit = self.task.material.allowable_stress
        if limit is None:
            return []
        return [LimitRows("stress", 10.0 * (1.0 - state.stress / limit), None if by is None else -10.0 * by / limit)]

    def _derivatives(self, z: FloatArray, state: State) -> tuple[FloatArray, FloatArray] | None:
        """Return the derivatives of force (p, n) and stress (r, n) by all variables; None if one has none."""
        slopes = self._differentiate_by_form(z, state)
        if slopes is None or not self.extra:
            return slopes
        force, stress = slopes
        last = (
            self._differentiate_by_stroke(z, state)
            if self.task.goal == "stroke"
            else (0.0 * state.force, 0.0 * state.stress)
        )
        return np.column_stack([force, last[0]]), np.column_stack([stress, last[1]])

    def _differentiate_by_form(self, z: FloatArray, state: State) -> tuple[FloatArray, FloatArray] | None:
        """Return the derivatives of force (p, k) and stress (r, k) by the form's variables; None if one has none."""
        form, path, x = self.form, state.path, z[: self.form.size]

        def build(values: Any) -> Network:
            return self.network(np.concatenate([values, x[form.count :]]))

        inner = x[: form.count]
        force = [gradient(path, build, inner).effort]
        last = gradient(path, build, inner, points=path.at_requested[-N_STRESS_POINTS:]).sections(STRIP_BEAM)
        stress = [state.watched.stress(last.bending_stress, last.axial_stress)]
        steps = [(k, _DIFFERENCE_STEP) for k in range(form.count, form.count + form.placed)]
        if form.width is None and self.task.material.wide:
            steps.append((form.size - 1, _DIFFERENCE_STEP * float(x[-1])))
        for k, step in steps:
            by = self._differentiate_by_difference(z, k, step, state)
            if by is None:
                return None
            force.append(by[0][:, None])
            stress.append(by[1][:, None])
        if form.width is None and not self.task.material.wide:
            force.append((state.force / x[-1])[:, None])
            stress.append(np.zeros((len(state.stress), 1)))
        return np.concatenate(force, axis=1), np.concatenate(stress, axis=1)

    def _differentiate_by_difference(
        self, z: FloatArray, k: int, nudge: float, state: State
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return the derivatives by one variable by a difference of neighbouring equilibria; None if there is none.

        It is central, but where only one neighbour has equilibria. Beside a strip with a station at the end of one of
        its segments others are cut into more segments, and are compared with each other.
        """
        drive = Displacement(SLIDER_NODE, self.task.direction, self.travel(z))

        def build_shifted(step: float) -> Network:
            x = z[: self.form.size].copy()
            x[k] += step
            return self.network(x)

        paths = [(0.0, state.path)]
        try:
            paths += [(step, solve_near_known_path(state.path, build_shifted(step), drive)) for step in (-nudge, nudge)]
        except InputError:
            beside = _trace(build_shifted(nudge), drive)
            paths = []
            if beside is not None:
                paths = [
                    (nudge, beside),
                    (2.0 * nudge, solve_near_known_path(beside, build_shifted(2.0 * nudge), drive)),
                ]
        complete = [pair for pair in paths if pair[1].status is PathStatus.COMPLETE]
        if len(complete) < 2:
            return None
        (first, low), (last, high) = complete[-2:]
        before, after = self._build_state(low), self._build_state(high)
        return (after.force - before.force) / (last - first), (after.stress - before.stress) / (last - first)

    def _build_state(self, path: Path) -> State:
        """Return the strip that is pressed along a path."""
        return State(path, path.effort[path.at_requested], stress_places(path, self.spots))

    def _differentiate_by_stroke(self, z: FloatArray, state: State) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives by the stroke in cm: all points move with it, and the stress with its point."""
        travel, at = self.travel(z), state.path.at_requested
        first, last = np.sqrt(self.task.start), np.sqrt(self.stroke(z))
        moves = np.sqrt(travel) / last * self.spots
        by_travel = (
            self.slope[-N_STRESS_POINTS:] * (self.spots / (2.0 * last * (last - first)))[-N_STRESS_POINTS:, None]
        )
        sections = state.path.sections(STRIP_BEAM)
        stress = state.watched.stress(
            *(by_travel @ part[at] for part in (sections.bending_stress, sections.axial_stress))
        )
        return 0.01 * drive_slope(state.path) * moves, 0.01 * stress


def _trace(network: Network, drive: Displacement) -> Path | None:
    """Return the equilibria that are reached from rest; None if one is not, or is not stable."""
    path = trace(network, drive, Control(first_step=FIRST_STEP, tolerance=PATH_TOLERANCE))
    good = path.status is PathStatus.COMPLETE and bool(path.stable[path.at_requested].all())
    return path if good else None


N_STRESS_POINTS, N_STRESS_PLACES = 4, 13
"""Points at which the stress is computed, the last ones, and places from the first to the last of them."""
N_STENCIL_POINTS = 9  # samples of a polynomial: more of them, evenly spaced, swing beyond its ends
_STENCIL_NODES = np.arange(float(N_STENCIL_POINTS))
_SLOPE_WEIGHTS = differentiation(_STENCIL_NODES)
_MAX_NEWTON_STEPS = 8


@dataclass(frozen=True)
class WatchedStress:
    """From bending and axial stress at the samples of the last points to the stress looked at."""

    # bending, axial, (4, r, rows): to the tops of r pieces, with the signs: both add up on the side where they have the
    # same
    bending: FloatArray
    axial: FloatArray
    between: FloatArray  # (13, 4) interpolation between the points

    def stress(self, bending: FloatArray, axial: FloatArray) -> FloatArray:
        """Return the stress (13 r, ...) of stresses (4, rows, ...) at the samples [Pa], or derivatives of theirs."""
        tops = np.array(
            [b @ of + a @ along for b, a, of, along in zip(self.bending, self.axial, bending, axial, strict=True)]
        )
        return np.tensordot(self.between, tops, 1).reshape(-1, *tops.shape[2:])


def stress_places(
    path: Path,  # its equilibria at the requested points
    spots: FloatArray,  # (p,): places of these points in a variable in which the stress is smooth
) -> WatchedStress:
    """Return where the stress of a strip is looked at."""
    sections, last = path.sections(STRIP_BEAM), path.at_requested[-N_STRESS_POINTS:]
    beam = path.network.beams[STRIP_BEAM]
    breaks = np.unique(np.concatenate([beam.shape.course(1.0).breaks, beam.section.stations]))
    breaks = breaks[np.append(True, np.diff(breaks) > 1e-12)]
    place = sections.place[0].reshape(-1, N_PLACES)
    tops = [_tops(sections.bending_stress[k], sections.axial_stress[k], place, breaks) for k in last]
    between = interpolation(spots[-N_STRESS_POINTS:], np.linspace(spots[-N_STRESS_POINTS], spots[-1], N_STRESS_PLACES))
    return WatchedStress(np.array([top[0] for top in tops]), np.array([top[1] for top in tops]), between)


def _tops(bending: FloatArray, axial: FloatArray, place: FloatArray, breaks: FloatArray) -> FloatArray:
    """Return the matrices from the samples' bending and axial stress to the highest of every piece, (2, r, rows).

    The places are given by segment, (segments, samples): a piece has one or more.
    """
    shape: tuple[int, int] = place.shape[0], place.shape[1]
    stress = (np.abs(bending) + np.abs(axial)).reshape(shape)
    lines, best = np.arange(shape[0]), stress.argmax(axis=1)
    first = np.clip(best - N_STENCIL_POINTS // 2, 0, shape[1] - N_STENCIL_POINTS)
    rows = (lines * shape[1] + first)[:, None] + np.arange(N_STENCIL_POINTS)
    bend, pull = (np.sign(part.reshape(shape)[lines, best])[:, None] for part in (bending, axial))
    around = bend * bending[rows] + pull * axial[rows]
    weights = interpolation(_STENCIL_NODES, _top(around, best - first))
    height = (weights * around).sum(axis=1)
    piece = np.searchsorted(breaks, place.mean(axis=1)) - 1
    chosen = [max(np.flatnonzero(piece == k), key=lambda line: height[line]) for k in range(len(breaks) - 1)]
    rows_of_tops = np.zeros((2, len(chosen), len(bending)))
    for sign, matrix in zip((bend, pull), rows_of_tops, strict=True):
        np.put_along_axis(matrix, rows[chosen], (sign * weights)[chosen], axis=1)
    return rows_of_tops


def _top(around: FloatArray, best: Any) -> FloatArray:
    """Return where polynomials through nine values (n, 9) are highest beside their highest value; Newton's method."""
    slope = around @ _SLOPE_WEIGHTS.T
    curve = slope @ _SLOPE_WEIGHTS.T
    low, high = np.maximum(best - 1.0, 0.0), np.minimum(best + 1.0, N_STENCIL_POINTS - 1.0)
    at: FloatArray = 0.5 * (low + high)
    for _ in range(_MAX_NEWTON_STEPS):
        weights = interpolation(_STENCIL_NODES, at)
        rise, bend = (weights * slope).sum(axis=1), (weights * curve).sum(axis=1)
        step = np.where(bend < 0, -rise / np.where(bend < 0, bend, -1.0), np.sign(rise))
        at = np.clip(at + step, low, high)
    return at
