"""Constant-force range, first peak and valley, and stress limit of a solved beam mechanism, for its scalar results.

The range ends at the end d of the window, where the force is F_d, and begins where the force first reaches 0.95 F_d. A
curve whose travel is negative is mirrored first, and its force with it (`AlongMotion`): so places increase, forces that
hold against the motion are positive, and one definition serves both directions. `AlongMotion.to_spec_sign` undoes this.

A traced mechanism has a model between the points of its curve: there results are refined by equilibria that are solved
at them. Of other models cubics through the points decide.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010), sec. 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from cfmkit.elastica.results.observed import Observed
from cfmkit.numerics.interpolation import bisect, crossing, first_extreme, value_at
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.between_points import BetweenPoints
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec

RANGE_BAND = 0.05  # largest difference of the force from F_d in the range, as a share of F_d [Lan, sec. 2].
MAX_REFINEMENTS = 4
"""Most equilibria solved to refine one place; Lan's mechanism (`configs/beam_lan2010.yaml`) needs three."""
PLACE_RTOL = 1e-11  # share of the travel: a place that moves by less is refined enough
EXTREME_STENCIL = 0.1 * np.arange(-2.0, 3.0)
"""Where equilibria are solved around an extreme, as shares of the step of the curve: wide enough that the solver's
error does not move the extreme, and close enough that a polynomial of degree four through them does not either."""


class SolvedMechanism(Observed, Protocol):
    """Solved mechanism of any model: values at the points of its curve; forces are those of all copies."""

    @property
    def spec(self) -> BeamSpec:
        """The specification."""

    @property
    def assembly(self) -> Assembly:
        """The network of beams with its drive and limits."""

    @property
    def effort_error(self) -> float | None:
        """Numerical error of the effort [N or N m]; None: not known."""

    @property
    def accurate(self) -> Any:
        """Whether each point reaches the tolerance, (n,)."""

    @property
    def stable(self) -> Any:
        """Whether each point is a stable equilibrium, (n,)."""

    @property
    def model_between_points(self) -> BetweenPoints | None:
        """The model at every place between the points; None if it would take seconds, or the curve turns back."""

    @property
    def along(self) -> AlongMotion:
        """The curve with its travel made positive."""


def travel_of(solution: SolvedMechanism) -> tuple[float, float]:
    """Return where the motion was to start and to end [m or rad]; under a load, where it did end."""
    start, end = float(solution.motion[0]), float(solution.motion[-1])
    return start, solution.spec.extent if solution.spec.analysis.travel is not None else end


def window_of(solution: SolvedMechanism) -> tuple[float, float]:
    """Return the window of the analysis in places, or the whole travel."""
    window = solution.spec.analysis.window
    if window is not None:
        return window_places(window, travel_of(solution))
    return float(solution.motion.min()), float(solution.motion.max())


@dataclass(frozen=True)
class AlongMotion:
    """Curve of at least one point, mirrored if its travel is negative, with the results that are read from it."""

    solution: SolvedMechanism

    @cached_property
    def sense(self) -> float:
        """Factor of places and forces, 1 or -1, from the specification's signs to these and back."""
        return 1.0 if self.solution.motion[-1] >= self.solution.motion[0] else -1.0

    @cached_property
    def motion(self) -> FloatArray:
        """Places of the points of the curve (n,) [m or rad]; they increase, unless the curve turns back."""
        return np.asarray(self.sense * self.solution.motion)

    @cached_property
    def effort(self) -> FloatArray:
        """Force or torque at the points (n,) [N or N m]."""
        return np.asarray(self.sense * self.solution.effort)

    @cached_property
    def end(self) -> float:
        """The end d of the window, or of the travel [m or rad]."""
        return max(self.sense * end for end in window_of(self.solution))

    @property
    def reaches_end(self) -> bool:
        """Whether the curve does not turn back and has the end of the window on it."""
        x = self.motion
        return bool((np.diff(x) > 0).all() and x[0] <= self.end <= x[-1] * (1 + 1e-12))

    @cached_property
    def knots(self) -> tuple[FloatArray, FloatArray]:
        """Places, increasing, and efforts: of the points, and of extremes between them where the model is known."""
        between = self.solution.model_between_points
        if between is None:
            return self.motion, self.effort
        x, effort = between.knots
        return (x, effort) if self.sense > 0 else (-x[::-1], -effort[::-1])

    @cached_property
    def corners(self) -> FloatArray | None:
        """Places of kinks of the effort [m or rad]; None if the model between the points is not known."""
        between = self.solution.model_between_points
        return None if between is None else np.asarray(self.sense * between.corners)

    def effort_at(self, places: FloatArray) -> FloatArray:
        """Return the effort at places, by the model between the points [N or N m]."""
        assert self.solution.model_between_points is not None
        return np.asarray(self.sense * self.solution.model_between_points.effort("", self.sense * places))

    def stress_at(self, places: FloatArray) -> FloatArray:
        """Return the largest stress at places, by the model between the points [Pa]."""
        assert self.solution.model_between_points is not None
        return self.solution.model_between_points.stress("", self.sense * places)

    def stress_reaches(self, level: float) -> float | None:
        """Return where the largest stress first reaches a level, by the model between the points [m or rad]."""
        assert self.solution.model_between_points is not None
        place = self.solution.model_between_points.stress_reaches(level, self.sense)
        return None if place is None else self.sense * place

    # -- the range that ends at d [Lan, sec. 2]; NaN where a value does not exist ------------------------------------
    @cached_property
    def force_at_end(self) -> float:
        """Force F_d at the end of the window [N]; NaN if the curve turns back, ends before it or has unknown forces."""
        is_complete = len(self.motion) and self.reaches_end and np.isfinite(self.effort).all()
        return value_at(*self.knots, self.end) if is_complete else np.nan

    @cached_property
    def start(self) -> float:
        """Displacement at which the force first reaches 0.95 F_d, where the range begins [m]."""
        if not abs(self.force_at_end) > (self.solution.effort_error or 0.0):  # else 95 % of it are rounding
            return np.nan
        place = self._refine_place(lambda x, force: crossing(x, force / self.force_at_end, 1 - RANGE_BAND))
        return place if place is not None and place <= self.end and self.end > 0 else np.nan

    @cached_property
    def strict_start(self) -> float:
        """Smallest place from which on the force stays within 5 % of its maximum [m]."""
        if np.isnan(self.start) or self.force_at_end <= 0:  # no band lies around the force there
            return np.nan
        return self._refine_place(lambda x, force: find_strict_start(x, force, self.end)) or 0.0

    def fraction(self, start: float) -> float:
        """Return the range that begins at a place, as a share of the travel."""
        return (self.end - start) / self.end

    @cached_property
    def stress_at_end(self) -> float:
        """Largest stress at the end of the window [Pa], beam by beam: the largest of all has kinks."""
        if np.isnan(self.force_at_end):
            return np.nan
        if self.solution.model_between_points is not None:
            return float(self.stress_at(np.array([self.end]))[0])
        return max(value_at(self.motion, value, self.end) for value, _ in self.solution.stresses.values())

    @cached_property
    def stress_limit(self) -> float:
        """Displacement at which the stress first reaches the allowable one [m], beam by beam."""
        allowable = self.solution.assembly.allowable_stress
        if np.isnan(self.force_at_end) or allowable is None:
            return np.nan
        if self.solution.model_between_points is not None:
            limit = self.stress_reaches(allowable)
            return np.nan if limit is None else limit
        reached = [crossing(self.motion, value, allowable) for value, _ in self.solution.stresses.values()]
        return min((place for place in reached if place is not None), default=np.nan)

    def _refine_place(self, find: Callable[[FloatArray, FloatArray], float | None]) -> float | None:
        """Return the place that `find` reads from cubics, refined by equilibria solved there if the model allows it."""
        x, force = self.knots
        place = find(x, force)
        for _ in range(MAX_REFINEMENTS):
            if self.corners is None or place is None or np.abs(x - place).min() <= PLACE_RTOL * (x[-1] - x[0]):
                break
            at = int(np.searchsorted(x, place))
            x, force = np.insert(x, at, place), np.insert(force, at, self.effort_at(np.array([place])))
            place = find(x, force)
        return place

    # -- extremes: place [m] and force [N]; NaN where there is none --------------------------------------------------
    @cached_property
    def peak(self) -> tuple[float, float]:
        """The first local maximum of the force, on a curve that does not turn back."""
        if not len(self.motion) or not (np.diff(self.motion) > 0).all() or not np.isfinite(self.effort).all():
            return np.nan, np.nan
        # before a contact begins there may be no force at all, but for rounding
        x, force = self.knots
        bearing = np.flatnonzero(np.abs(force) > (self.solution.effort_error or 0.0))
        begin = float(x[bearing[0] - 1]) if len(bearing) and bearing[0] > 1 else -np.inf
        return self._refine_extreme(first_extreme(x, force, after=begin, corners=self.corners))

    @cached_property
    def valley(self) -> tuple[float, float]:
        """The first local minimum after that."""
        if np.isnan(self.peak[0]):
            return np.nan, np.nan
        return self._refine_extreme(first_extreme(*self.knots, -1, after=self.peak[0], corners=self.corners))

    def _refine_extreme(self, extreme: tuple[float, float] | None) -> tuple[float, float]:
        """Return an extreme, refined by equilibria solved around it if the model allows it; NaN for None."""
        if extreme is None:
            return np.nan, np.nan
        if self.corners is None or extreme[0] in self.corners:
            return extreme
        place, value = extreme
        clear = np.concatenate([self.motion[[0, -1]], self.corners])
        step = min(float(np.abs(np.diff(self.motion)).max()), float(np.abs(clear - place).min()) / EXTREME_STENCIL[-1])
        for _ in range(2):
            efforts = self.effort_at(place + step * EXTREME_STENCIL)
            powers = np.polynomial.polynomial.polyfit(EXTREME_STENCIL, efforts, 4)
            turns = np.roots(np.polynomial.polynomial.polyder(powers)[::-1])
            real = turns.real[np.isreal(turns)]
            if not len(real) or np.abs(real).min() > EXTREME_STENCIL[-1]:
                return extreme
            at = float(real[np.abs(real).argmin()])
            place, value = place + step * at, float(np.polynomial.polynomial.polyval(at, powers))
        return place, value

    def to_spec_sign(self, value: float) -> float:
        """Return a place or a force with the sign that it has in the specification."""
        return value if self.sense > 0 else 0.0 - value  # not -0


def find_strict_start(x: FloatArray, force: FloatArray, end: float) -> float:
    """Return the smallest c with (max - min) <= `RANGE_BAND` max of the force on c ... end."""
    before = x < end
    values = np.append(force[before], value_at(x, force, end))
    places = np.append(x[before], end)
    tops = np.maximum.accumulate(values[::-1])[::-1]
    bottoms = np.minimum.accumulate(values[::-1])[::-1]
    bad = np.flatnonzero(tops - bottoms > RANGE_BAND * tops)
    if not len(bad):
        return float(places[0])
    last = int(bad[-1])
    top, bottom = float(tops[last + 1]), float(bottoms[last + 1])

    def is_inside_band(place: float) -> bool:
        force_there = value_at(x, force, place)
        return max(top, force_there) - min(bottom, force_there) <= RANGE_BAND * max(top, force_there)

    return bisect(is_inside_band, float(places[last]), float(places[last + 1]))
