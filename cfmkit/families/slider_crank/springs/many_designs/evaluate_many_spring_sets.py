"""Many slider-cranks at once that differ in their springs: the unit curves are the same, and everything is a product.

Metrics are those of the curve at the analysis's points, as for one mechanism; class, drop and
numbers of equilibria come from a grid that is sharpened at its turning points; ends of constant bands are
found on the closed form, for all designs side by side. Metrics that are places, and equilibria, come from the grid of
one mechanism, which is laid once for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.slider_crank.printed.scalar_results import DEFINITIONS as OF_PARTS
from cfmkit.families.slider_crank.springs.bistability_class import (
    Classified,
    classify,
    scale_factors,
    small_angle_number,
)
from cfmkit.families.slider_crank.springs.largest_turns_and_forces import MotionExtremes
from cfmkit.families.slider_crank.springs.link_strength import DEFINITIONS as LINK_DEFINITIONS
from cfmkit.families.slider_crank.springs.link_strength import link_of
from cfmkit.families.slider_crank.springs.many_designs.bands import edges
from cfmkit.families.slider_crank.springs.model import efforts_inside, reference_motion, target_of, window_of
from cfmkit.families.slider_crank.springs.scalar_results import DEFINITIONS
from cfmkit.families.slider_crank.springs.solution import Character, Solution, grid_over
from cfmkit.families.slider_crank.springs.sprung_linkage import mean_effort_per_angle
from cfmkit.metrics.branch_views import ZERO, MeasuringFrame
from cfmkit.metrics.branches_cut_to_window import between_ends
from cfmkit.metrics.continuous_means_and_extremes import extremes, mean
from cfmkit.metrics.ranges_many import (
    BAND_RANGES,
    UNIFORM_POINTS,
    ManyBranches,
    range_95,
    range_95_fraction,
    usable_interval,
    usable_stroke,
)
from cfmkit.metrics.spread import STATIC_BALANCE, ManyWindows, metric_of, metrics_of, static_balance
from cfmkit.numerics.hermite_cubic_turning_points import Monotone, monotone, sharpened
from cfmkit.results import ROUND_OFF
from cfmkit.stock.springs.stress_and_life import WIRE_DEFINITIONS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Measure
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


@dataclass(frozen=True)
class Base:
    """What all designs of a block share.

    Attributes
    ----------
    spec : SliderCrankSpec
        With the motion written out.
    assembly : Assembly
        Its rates do not matter.
    low, high : float
        The motion [rad or m].
    """

    spec: SliderCrankSpec
    assembly: Assembly
    low: float
    high: float

    @property
    def points(self) -> int:
        """Points of the curve."""
        return self.spec.analysis.points

    @cached_property
    def motion(self) -> FloatArray:
        """Where the curve is taken."""
        return np.linspace(self.low, self.high, self.points)

    @cached_property
    def units(self) -> UnitCurves:
        """What unit springs do there."""
        return self.assembly.units(self.motion)

    @cached_property
    def extremes(self) -> MotionExtremes:
        """Largest turns, energies and forces inside, wherever they are."""
        return MotionExtremes(self.assembly, self.low, self.high)

    @property
    def nodes(self) -> tuple[FloatArray, UnitCurves]:
        """The grid of the class, the unloaded position one of its places, and the unit springs there."""
        return self.extremes.nodes

    @cached_property
    def grid(self) -> tuple[FloatArray, UnitCurves]:
        """The grid of one mechanism, and the unit springs there."""
        places = grid_over(self.assembly, self.low, self.high)
        return places, self.assembly.units(places)

    @cached_property
    def bounded(self) -> bool:
        """Whether every spring has an effort all over the grid: a mechanism alone leaves out where it has none."""
        return bool(np.isfinite(self.grid[1].effort).all())

    @cached_property
    def per_degree(self) -> FloatArray:
        """By how much unit springs raise the mean force in the window per degree of the unloaded angle, (4,)."""
        window = window_of(self.spec, self.assembly) or (self.low, self.high)
        return np.asarray(mean_effort_per_angle(self.assembly, window) * np.radians(1.0))

    @cached_property
    def reference(self) -> float:
        """Where the constant band is taken."""
        return reference_motion(self.spec, self.assembly)

    @cached_property
    def band(self) -> float:
        """Half width of the band of the usable stroke, as a fraction."""
        return float(getattr(self.spec.analysis, "band", MeasuringFrame.band))

    def knows(self, measure: Measure) -> bool:
        """Return whether this model has a measure."""
        name, window = measure.name, measure.window
        if self.lacks(name) or name in VALUES:
            return True
        if name in EACH:
            return self.bounded
        if name.startswith("usable_") and self.spec.target_curve is not None:
            return False  # the band lies about the curve: the model of one mechanism knows it
        known = self.spreads(name) or name in (*BAND_RANGES, RMS) or (name in PLACES and self.bounded)
        return known and (window is None or (self.low <= window[0] and window[1] <= self.high))

    def spreads(self, name: str) -> bool:
        """Return whether a metric is one of mean and extremes in a window."""
        return name in metrics_of(self.assembly.drive)

    def lacks(self, name: str) -> bool:
        """Return whether a mechanism with this drive has no such value: its cells are empty."""
        others = OTHER_DRIVE[self.assembly.drive]
        if name in LINK_DEFINITIONS and link_of(self.spec) is None:
            return True
        if name in WIRE_DEFINITIONS and not self.spec.mechanism.springs.bought:
            return True
        if name == "force_per_anchor":
            return self.assembly.drive != "force" or self.spec.mechanism.springs.anchor is None
        return name in NO_LOOP or (name in OF_PARTS and name not in DEFINITIONS) or name.startswith(others)

    def inside(self, window: tuple[float, float] | None) -> FloatArray:
        """Return the unit efforts in a window, (4, k), its ends included."""
        return efforts_inside(self.assembly, self.motion, self.units, window)

    def motion_inside(self, window: tuple[float, float] | None) -> FloatArray:
        """Return the points of the curve in a window, its ends included."""
        if window is None:
            return self.motion
        return np.concatenate([window[:1], self.motion[between_ends(self.motion, *window)], window[1:]])

    def samples_and_grid(self, window: tuple[float, float] | None) -> tuple[FloatArray, FloatArray]:
        """Return the points of the curve in a window and the grid's places between them, increasing; efforts (4, n).

        They are the same for all designs: put in order here, they take a design one product.
        """
        if window not in self._dense:
            samples, units = self.motion_inside(window), self.units.effort if window is None else self.inside(window)
            places, there = self.grid
            between = (places > samples[0]) & (places < samples[-1]) & np.isfinite(there.effort).all(axis=0)
            both = np.concatenate([samples, places[between]])
            order = np.argsort(both, kind="stable")
            self._dense[window] = both[order], np.concatenate([units, there.effort[:, between]], axis=1)[:, order]
        return self._dense[window]

    @cached_property
    def _dense(self) -> dict[tuple[float, float] | None, tuple[FloatArray, FloatArray]]:
        return {}


@dataclass(frozen=True)
class Slab:
    """Some designs of a block.

    Attributes
    ----------
    base : Base
        What they share.
    rates : (m, 4) array
        Of all legs together.
    legs : (m,) array
        How many legs.
    """

    base: Base
    rates: FloatArray
    legs: FloatArray

    @cached_property
    def effort(self) -> FloatArray:
        """Efforts at the points of the curve, (m, n)."""
        return self.rates @ self.base.units.effort

    @cached_property
    def sharp(self) -> FloatArray:
        """Efforts on the grid, with their turning points."""
        places, units = self.base.nodes
        stiffness = units.stiffness.copy()
        stiffness[:, 0] = np.where(np.isfinite(stiffness[:, 0]), stiffness[:, 0], stiffness[:, 1])
        twice = self.base.assembly.drive == "torque"
        return sharpened(places, self.rates @ units.effort, self.rates @ stiffness, twice)

    @cached_property
    def classified(self) -> Classified:
        """Classes, drops and numbers of equilibria."""
        spec, assembly = self.base.spec, self.base.assembly
        curves = Monotone(np.broadcast_to(self.base.nodes[0], self.sharp.shape), self.sharp)
        return classify(curves, assembly.start, spec.analysis.tolerance, window_of(spec, assembly), assembly.rest)

    @cached_property
    def level(self) -> FloatArray:
        """Efforts at the reference; NaN where they are zero but for rounding."""
        level = self.rates @ self.base.assembly.units(np.array([self.base.reference])).effort[:, 0]
        return np.where(np.abs(level) > np.maximum(self.error, ZERO * np.abs(self.sharp).max(axis=1)), level, np.nan)

    @cached_property
    def band(self) -> tuple[FloatArray, FloatArray]:
        """Ends of the constant band around the reference; NaN where there is none."""
        return self.within(self.base.spec.analysis.tolerance)

    def within(self, tolerance: float) -> tuple[FloatArray, FloatArray]:
        """Return the ends of a band around the reference; NaN where there is none."""
        base = self.base
        grid = base.nodes[0]
        if not base.low <= base.reference <= base.high:
            return np.full(len(self.rates), np.nan), np.full(len(self.rates), np.nan)
        return edges(base.assembly, self.rates, (grid, self.sharp), (base.reference, self.level), tolerance)

    def at(self, motion: float, rows: str = "effort") -> FloatArray:
        """Return effort or stiffness of all designs at one place."""
        unit: FloatArray = getattr(self.base.assembly.units(np.array([motion])), rows)[:, 0]
        return self.rates @ np.where(np.isfinite(unit), unit, 0.0)

    def measured(self, measure: Measure) -> FloatArray:
        """Return one measure of all designs; NaN where it is undefined."""
        name = measure.name
        if self.base.lacks(name):
            return np.full(len(self.rates), np.nan)
        if name in VALUES:
            return np.broadcast_to(VALUES[name](self), len(self.rates))
        if name in EACH:
            return np.array([EACH[name](one) for one in self.each], dtype=float)  # None: NaN
        if name in PLACES:
            return PLACES[name](self, measure.window)
        if name == RMS:
            return _rms_to_target(self, measure.window)
        if name in BAND_RANGES:
            low, high = self.within(BAND_RANGES[name])
            return high - low
        return metric_of(name, self.inside(measure.window), target_of(self.base.spec))

    @cached_property
    def error(self) -> FloatArray:
        """Rounding of the sums of springs' efforts, (m,): as `results.round_off` has it."""
        return np.asarray(ROUND_OFF * (self.rates @ np.abs(self.base.units.effort)).max(axis=1))

    def static_balance(self, window: tuple[float, float] | None) -> FloatArray:
        """Return the largest effort in a window over that of one spring of one leg, (m,)."""
        places, units = self.base.samples_and_grid(window)

        def largest(at: FloatArray) -> FloatArray:
            unit = self.base.assembly.forces(at.ravel()).reshape(4, *at.shape).swapaxes(0, 1)
            return np.asarray(np.abs(self.rates[:, :, None] * unit).max(axis=1))

        part, _ = extremes(largest, places[None, :], np.abs(self.rates[:, :, None] * units).max(axis=1))
        return np.asarray(static_balance(self.inside(window).spread, part / self.legs))

    def inside(self, window: tuple[float, float] | None) -> ManyWindows:
        """Return the efforts in a window."""
        if window not in self.cut:
            motion = self.base.motion_inside(window)
            effort = self.effort if window is None else self.rates @ self.base.inside(window)
            self.cut[window] = ManyWindows(motion[None, :], effort, partial(self._extremes, window), self.error)
            self.balance(self.cut[window].mean)
        return self.cut[window]

    def _extremes(
        self, window: tuple[float, float] | None, _motion: FloatArray, _effort: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return largest and smallest efforts between the ends of samples, next to these and to the grid, (m,) each."""
        places, units = self.base.samples_and_grid(window)
        every = np.arange(len(self.rates))
        return extremes(lambda at: self.somewhere(at, every), places[None, :], self.rates @ units)

    @cached_property
    def balanced(self) -> NDArray[np.bool_]:
        """Which designs have a mean effort of rounding in some window that was looked at: its sign decides metrics."""
        return np.zeros(len(self.rates), dtype=bool)

    def balance(self, mean: FloatArray) -> None:
        """Note which means, (m,), are rounding: such designs are left to the model of one."""
        np.logical_or(self.balanced, np.abs(mean) <= self.error, out=self.balanced)

    @cached_property
    def cut(self) -> dict[tuple[float, float] | None, ManyWindows]:
        """What is known of windows."""
        return {}

    def somewhere(self, places: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        """Return the efforts at places of some designs, (r, k)."""
        unit = self.base.assembly.forces(places.ravel()).reshape(4, *places.shape)
        return np.asarray(np.einsum("dj,jdm->dm", self.rates[rows], unit))

    @cached_property
    def curves(self) -> Monotone:
        """Each design's `Character.curve`: efforts on the grid and at their turning points, by the closed form."""
        places, units = self.base.grid
        lost = ~np.isfinite(units.stiffness)
        slope = self.rates @ np.where(lost, 0.0, units.stiffness)
        slope[(self.rates > 0.0) @ lost] = np.nan
        cut = monotone(places, self.rates @ units.effort, slope)
        step = np.diff(places)
        for turn in (1, 2):
            place = cut.place[:, turn::3]
            # What a cell does not have repeats one of its ends, but for rounding.
            inside = (place - places[:-1] > 1e-12 * step) & (places[1:] - place > 1e-12 * step)
            row, cell = np.nonzero(inside)
            cut.value[row, 3 * cell + turn] = self.somewhere(place[row, cell][:, None], row)[:, 0]
        return cut

    @cached_property
    def assemblies(self) -> list[Assembly]:
        """Each design with its own rates."""
        return [replace(self.base.assembly, rates=rates) for rates in self.rates]

    @cached_property
    def factors(self) -> FloatArray:
        """The limits between the classes as factors on the torsion springs, (m, 2); NaN where there is none."""
        found = [scale_factors(one, self.base.low, self.base.high) or (np.nan, np.nan) for one in self.assemblies]
        return np.array([[_finite(factor) for factor in pair] for pair in found])

    @cached_property
    def each(self) -> list[Solution]:
        """Each design as one mechanism has it, with the curve and the unit springs that are known already."""
        base, found = self.base, []
        window = window_of(base.spec, base.assembly)
        for row, (assembly, legs) in enumerate(zip(self.assemblies, self.legs.tolist(), strict=True)):
            character = Character(assembly, base.low, base.high, base.spec.analysis.tolerance, window)
            curve = Monotone(self.curves.place[row : row + 1], self.curves.value[row : row + 1])
            vars(character)["curve"] = curve  # in place of what it would work out
            found.append(Solution(assembly, base.motion, base.units, character, base.reference, legs))
        return found

    def everywhere(self, window: tuple[float, float] | None) -> ManyBranches:
        """Return the curves at every place, over the ends of a window."""
        if window not in self.known:
            count, ends = len(self.rates), window or (self.base.low, self.base.high)
            low, high, pose = (np.full(count, end) for end in (*ends, self.base.reference))
            place, value = self.curves.place, self.curves.value
            self.known[window] = ManyBranches(place, value, low, high, self.somewhere, pose=pose, error=self.error)
        return self.known[window]

    def usable(self, window: tuple[float, float] | None) -> tuple[FloatArray, FloatArray]:
        """Return start and end of the usable stroke; NaN where there is none."""
        base, target = self.base, target_of(self.base.spec)
        if window not in self.usables:
            many = self.everywhere(window)
            ends = window or (base.low, base.high)
            units = [mean(self._unit(k), base.grid[0], *ends) for k in range(4)]
            level = np.full(len(self.rates), target) if target else self.rates @ np.array(units)
            valid = np.full(len(self.rates), base.low)
            start, end = usable_interval([many], level, base.band, valid)
            self.usables[window] = start, end
            self.balance(level)
        return self.usables[window]

    def _unit(self, joint: int) -> Callable[[FloatArray], FloatArray]:
        return lambda places: self.base.assembly.forces(places.ravel())[joint].reshape(places.shape)

    @cached_property
    def known(self) -> dict[tuple[float, float] | None, ManyBranches]:
        """What is known of curves over windows."""
        return {}

    @cached_property
    def usables(self) -> dict[tuple[float, float] | None, tuple[FloatArray, FloatArray]]:
        """What is known of usable strokes."""
        return {}

    @cached_property
    def start_effort(self) -> FloatArray:
        """Effort where the motion is zero."""
        unit = self.base.assembly.forces(np.zeros(1))[:, 0]
        with np.errstate(invalid="ignore"):
            return np.asarray(np.where(self.rates > 0.0, self.rates * unit, 0.0).sum(axis=1))


def _width(slab: Slab) -> FloatArray:
    return slab.band[1] - slab.band[0]


def _within(slab: Slab, motion: float) -> FloatArray:
    inside = slab.base.low <= motion <= slab.base.high
    return slab.at(motion) if inside else np.full(len(slab.rates), np.nan)


def _finite(value: float | None) -> float:
    return np.nan if value is None or not np.isfinite(value) else value


def _nearest(stable: bool, what: str) -> Callable[[Solution], float | None]:
    return lambda one: getattr(one.nearest(stable), what, None)


EACH: dict[str, Callable[[Solution], float | None]] = {
    **{f"snap_through_{place}": _nearest(False, "motion") for place in ("angle", "travel")},
    **{f"second_stable_{place}": _nearest(True, "motion") for place in ("angle", "travel")},
    "energy_barrier": _nearest(False, "energy"),
}
"""Values that are found design by design, on the curves that are known of all."""

PLACES: dict[str, Callable[[Slab, tuple[float, float] | None], FloatArray]] = {
    STATIC_BALANCE: lambda slab, window: slab.static_balance(window),
    "range_95": lambda slab, window: range_95(slab.everywhere(window)),
    "range_95_fraction": lambda slab, window: range_95_fraction(slab.everywhere(window)),
    "usable_stroke": lambda slab, window: usable_stroke(*slab.usable(window)),
    "usable_start": lambda slab, window: slab.usable(window)[0],
    "usable_end": lambda slab, window: slab.usable(window)[1],
}
"""Metrics that are places, and a balance, on curves that are known at every place."""


def _rms_to_target(slab: Slab, window: tuple[float, float] | None) -> FloatArray:
    target, (low, high) = target_of(slab.base.spec), window or (slab.base.low, slab.base.high)
    if not target:
        return np.full(len(slab.rates), np.nan)
    places = low + (high - low) * np.arange(1, UNIFORM_POINTS + 1) / UNIFORM_POINTS
    offset = slab.rates @ slab.base.assembly.forces(places) - target
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", offset, offset) / UNIFORM_POINTS))


RMS = "rms_to_target"

NO_LOOP = frozenset(
    {
        "hysteresis_area",
        *(f"loop_{what}_{kind}" for what in ("energy", "share") for kind in ("pins", "guide")),
    }
)
"""Metrics of two branches: these curves have one."""

OTHER_DRIVE: dict[str, tuple[str, ...]] = {
    "torque": ("constant_travel", "reference_force", "snap_through_travel", "second_stable_travel", "start_force",
               "force_per_degree"),
    "force": ("constant_angle", "reference_torque", "snap_through_angle", "second_stable_angle", "stretched_torque",
              "stretched_stiffness"),
}  # fmt: skip
"""Beginnings of the names of values that a mechanism with a drive does not have."""

VALUES: dict[str, Callable[[Slab], Any]] = {
    "stiffness_class": lambda slab: slab.classified.kind.astype(np.float64),
    "stiffness_drop": lambda s: np.where(np.abs(s.effort).max(axis=1) > s.error, s.classified.drop, np.nan),
    "stable_positions": lambda slab: slab.classified.stable.astype(np.float64),
    "unstable_positions": lambda slab: slab.classified.unstable.astype(np.float64),
    "constant_angle": _width,
    "constant_angle_start": lambda slab: slab.band[0],
    "constant_angle_end": lambda slab: slab.band[1],
    "constant_travel": _width,
    "constant_travel_start": lambda slab: slab.band[0],
    "constant_travel_end": lambda slab: slab.band[1],
    "reference_torque": lambda slab: _within(slab, slab.base.reference),
    "reference_force": lambda slab: _within(slab, slab.base.reference),
    "stretched_torque": lambda slab: slab.at(slab.base.assembly.stretched),
    "stretched_stiffness": lambda slab: slab.at(slab.base.assembly.stretched, "stiffness"),
    "energy_max": lambda slab: slab.base.extremes.energy(slab.rates),
    "coupler_compression_max": lambda slab: -slab.base.extremes.coupler(slab.rates)[1] / slab.legs,
    "guide_force_max": lambda slab: np.abs(slab.base.extremes.guide(slab.rates)).max(axis=0) / slab.legs,
    "start_force": lambda slab: slab.start_effort,
    "force_per_degree": lambda slab: np.where(slab.rates > 0.0, slab.rates * slab.base.per_degree, 0.0).sum(axis=1),
    "force_per_anchor": lambda slab: slab.rates[:, 3],
    "bistable_factor": lambda slab: slab.factors[:, 0],
    "positive_factor": lambda slab: slab.factors[:, 1],
    "small_angle_number": lambda slab: np.array([small_angle_number(one) for one in slab.assemblies], dtype=float),
    "stretched_angle": lambda slab: slab.base.assembly.linkage.stretched_angle,
    "folded_angle": lambda slab: _finite(slab.base.assembly.linkage.folded_angle),
    "unloaded_angle": lambda slab: slab.base.assembly.unloaded,
    "pivot_rotation_max": lambda slab: slab.base.extremes.largest_turns[0],
    "crank_pin_rotation_max": lambda slab: slab.base.extremes.largest_turns[1],
    "slider_pin_rotation_max": lambda slab: slab.base.extremes.largest_turns[2],
    "slider_travel_max": lambda slab: slab.base.extremes.largest_turns[3],
}
"""The family's own values that this model has."""
