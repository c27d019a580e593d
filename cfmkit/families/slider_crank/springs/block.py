"""Many slider-cranks at once that differ in their springs: the unit curves are the same, and everything is a product.

Metrics are those of the curve at the analysis's points, as for one mechanism; class, drop and
equilibria come from a grid that is sharpened at its turning points; ends of constant bands are
found on the closed form, for all designs side by side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.base import BlockAnswer
from cfmkit.families.refusals import CannotBuild
from cfmkit.families.slider_crank.build import resolve
from cfmkit.families.slider_crank.springs.assembly import assemble
from cfmkit.families.slider_crank.springs.block_bands import edges
from cfmkit.families.slider_crank.springs.block_metrics import CURVE, PLAIN, of_curve
from cfmkit.families.slider_crank.springs.model import (
    RATES,
    asked_motion,
    efforts_inside,
    reference_motion,
    target_of,
    window_of,
)
from cfmkit.families.slider_crank.springs.stiffness import Classified, classify
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.metrics.closed import extremes
from cfmkit.numerics.extrema import Monotone, sharpened

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Block, Measure
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.assembly import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


LEGS = "mechanism.legs"
"""What this model can vary besides `RATES`."""

SLAB = 400_000
"""Values that are worked on together: few enough to stay in a processor's cache."""

NODES, TURN_NODES = 129, 385
"""Places of the grid for less and for more than a quarter turn."""


def analyze_block(spec: SliderCrankSpec, block: Block) -> BlockAnswer | None:
    """Return what is asked about many sets of springs; None where something else is varied or asked.

    Parameters
    ----------
    spec : SliderCrankSpec
        What is varied.
    block : Block
        The variants and the measures.
    """
    base = _base(spec) if set(block.values) <= {*RATES, LEGS} else None
    if base is None or not all(base.knows(measure) for measure in block.measures):
        return None
    from cfmkit.families.slider_crank.springs.block_findings import of_linkage, of_springs, undecided

    rates, done = _rates(spec, block)
    warnings = {name: done.copy() for name in of_linkage(base)}
    values = tuple({"": np.full(block.size, np.nan)} for _ in block.measures)
    size = max(1, SLAB // base.points)
    chosen = np.flatnonzero(done)
    for start in range(0, len(chosen), size):
        rows = chosen[start : start + size]
        slab = Slab(base, rates[rows])
        for measure, found in zip(block.measures, values, strict=True):
            found[""][rows] = slab.measured(measure)
        for name, warned in of_springs(slab):
            warnings.setdefault(name, np.zeros(block.size, dtype=bool))[rows] = warned
        done[rows[undecided(slab)]] = False
    target = target_of(spec)
    targets = None if target is None else np.full(block.size, target)
    return BlockAnswer(done, values, targets, base.assembly.drive, warnings)


def _rates(spec: SliderCrankSpec, block: Block) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the rates of all legs together, (n, 4), and which of them are valid and not all zero."""
    springs = spec.mechanism.springs
    rates = np.tile([getattr(springs, name) for name in JOINTS], (block.size, 1)).astype(np.float64)
    for path, values in block.values.items():
        if path in RATES:
            rates[:, RATES[path]] = np.asarray(values, dtype=np.float64)
    legs = np.asarray(block.values.get(LEGS, np.full(block.size, spec.mechanism.legs)), dtype=np.float64)
    done = np.isfinite(rates).all(axis=1) & (rates >= 0.0).all(axis=1) & rates.any(axis=1)
    done &= (rates[rates > 0].min(initial=1.0) >= 1e-30) & (rates <= 1e30).all(axis=1) & (legs >= 1) & (legs <= 1000)
    return rates * legs[:, None], done


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
    def nodes(self) -> tuple[FloatArray, UnitCurves]:
        """The grid of the class, the unloaded position one of its places, and the unit springs there."""
        wide = self.assembly.drive == "torque" and self.high - self.low > 0.5 * np.pi
        share = np.linspace(0.0, 1.0, TURN_NODES if wide else NODES)
        if self.assembly.drive == "force":
            share = share**2
        places = self.low + (self.high - self.low) * share
        if self.low < self.assembly.start < self.high:
            places = np.union1d(places, [self.assembly.start])
        return places, self.assembly.units(places)

    @cached_property
    def reference(self) -> float:
        """Where the constant band is taken."""
        return reference_motion(self.spec, self.assembly)

    def knows(self, measure: Measure) -> bool:
        """Return whether this model has a measure."""
        name = measure.name
        if name in VALUES:
            return _fits(name, self.assembly.drive)
        kind, _, rest = name.partition("_")
        known = (kind == self.assembly.drive and rest in CURVE) or name in PLAIN or name in BANDS
        window = measure.window
        return known and (window is None or (self.low <= window[0] and window[1] <= self.high))

    def inside(self, window: tuple[float, float] | None) -> FloatArray:
        """Return the unit efforts in a window, (4, k), its ends included."""
        return efforts_inside(self.assembly, self.motion, self.units, window)


def _fits(name: str, drive: str) -> bool:
    """Return whether a mechanism with that drive has a value."""
    of_torque = ("constant_angle", "stretched_", "reference_torque")
    others = ("constant_travel", "reference_force") if drive == "torque" else of_torque
    return not name.startswith(others)


def _base(spec: SliderCrankSpec) -> Base | None:
    """Return what a block shares; None where the linkage cannot be built, or does not reach all of the motion."""
    mechanism = spec.mechanism
    if any(part is not None for part in (mechanism.flexures, mechanism.beam, mechanism.limits)):
        return None
    if spec.analysis.fidelity not in (None, "prb"):
        return None
    try:
        spec = resolve(spec)
        assembly = assemble(spec)
    except CannotBuild:
        return None
    low, high = asked_motion(spec, assembly)
    base = Base(spec, assembly, low, high)
    whole = (
        replace(assembly, rates=np.ones(4)).within(low, high) == (low, high) and np.isfinite(base.units.effort).all()
    )
    return base if whole and np.isfinite(base.nodes[1].effort).all() else None


@dataclass(frozen=True)
class Slab:
    """Some designs of a block.

    Attributes
    ----------
    base : Base
        What they share.
    rates : (m, 4) array
        Of all legs together.
    """

    base: Base
    rates: FloatArray

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
        return np.where(np.abs(level) > 1e-9 * np.abs(self.sharp).max(axis=1), level, np.nan)

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
        if name in VALUES:
            return VALUES[name](self)
        if name in BANDS:
            low, high = self.within(BANDS[name])
            return high - low
        return of_curve(name, *self._inside(measure.window))

    def _inside(self, window: tuple[float, float] | None) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
        """Return the efforts in a window, (m, k), and the largest and the smallest of each design, (m,) each."""
        if window not in self.cut:
            base = self.base
            motion = base.motion
            effort = self.effort if window is None else self.rates @ base.inside(window)
            if window is not None:
                motion = np.concatenate([window[:1], motion[(motion > window[0]) & (motion < window[1])], window[1:]])
            self.cut[window] = effort, extremes(self._exact, motion[None, :], effort)
        return self.cut[window]

    @cached_property
    def cut(self) -> dict[tuple[float, float] | None, tuple[FloatArray, tuple[FloatArray, FloatArray]]]:
        """What is known of windows."""
        return {}

    def _exact(self, places: FloatArray) -> FloatArray:
        """Return the efforts at places of each design, (m, k)."""
        unit = self.base.assembly.forces(places.ravel()).reshape(4, *places.shape)
        return np.asarray(np.einsum("dj,jdm->dm", self.rates, unit))


BANDS = {"band_range_05pct": 0.005, "band_range_1pct": 0.01, "band_range_5pct": 0.05}


def _width(slab: Slab) -> FloatArray:
    return slab.band[1] - slab.band[0]


def _within(slab: Slab, motion: float) -> FloatArray:
    inside = slab.base.low <= motion <= slab.base.high
    return slab.at(motion) if inside else np.full(len(slab.rates), np.nan)


VALUES: dict[str, Callable[[Slab], FloatArray]] = {
    "stiffness_class": lambda slab: slab.classified.kind.astype(np.float64),
    "stiffness_drop": lambda slab: slab.classified.drop,
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
    "energy_max": lambda slab: (slab.rates @ (0.5 * slab.base.units.turn**2)).max(axis=1),
}
"""The family's own values that this model has."""
