"""Solved vcfms as rows: F(x) = F_b(x) + F_p(x + dr), x from the unloaded position, dr the preload of the spring's end.

Of m mechanisms with p preloads each, curves are m p rows, those of one mechanism together and the nominal preload
first; of one mechanism m is 1. Everything that results, findings and studies read is computed here, when it is first
read. Where the leaves are flat they carry nothing and the spring alone decides: F = K_p (h + dr), whatever their
number, width or modulus.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.elastica.model.section import hindered_share
from cfmkit.families.vcfm.curves_in_rows import LeafSamples, PreloadCurve
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
from cfmkit.metrics.curve_rows import CurveRows, RowSamples, StressRows
from cfmkit.metrics.longest_interval_in_band import extremes
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.curves_in_rows import Characteristics, PartSampler, Rows
    from cfmkit.families.vcfm.leaf_laws_from_spec import LeafLaws
    from cfmkit.families.vcfm.leaves.kinds import LeafKind
    from cfmkit.families.vcfm.spec import VcfmSpec

    Ends = tuple[FloatArray, FloatArray]


FLAT_PLACES = 401  # even places of a constant-force window over which its mean is taken
MEAN_PLACES = 201  # even places of the window at which the forces of all preloads are averaged
LIMIT_RTOL = 1e-9
"""A force or a travel beyond its limit by this share is on it: conversions of units and sums leave less."""
N_EVEN_PLACES = 257
"""Places at even steps: the force beyond the peak is smooth, and the leaves' law has no shorter waves."""
CROWDED_SHARES = np.geomspace(1e-6, 1.0, 73)
"""Shares of the travel, and of the way from an end of the constant stiffness, at which more places stand."""


def goes_beyond(travel: FloatArray, end: FloatArray) -> Any:
    """Return whether travels go beyond ends [m], by more than rounding."""
    return travel > end * (1 + LIMIT_RTOL)


def target_of(spec: VcfmSpec) -> float | None:
    """Return the force that the nominal curve is to have [N]: that of the design, more by K_p times its preload.

    None without a design, and where its K_p or a force above zero at that preload is not known.
    """
    design, preload = spec.design, spec.analysis.preloads[0]
    if design is None or design.force is None or not preload:
        return None if design is None else design.force
    if spec.mechanism.springs is not None:
        stiffness = Coils.from_springs(spec.mechanism.springs).stiffness
    else:
        stiffness = design.required_force / design.height if design.height else 0.0
    target = design.force + stiffness * preload
    return target if stiffness and target > 0 else None


@dataclass(frozen=True, eq=False, repr=False)
class Solution(ShortRepr):
    """Solved mechanisms that differ in numbers only: their specifications, their laws and all of their curves."""

    specs: tuple[VcfmSpec, ...]
    parts: LeafLaws  # of one mechanism with plain numbers, of several with columns (m, 1)
    curves: Rows
    preloads: int  # curves of each mechanism

    def __len__(self) -> int:
        """Return the number of mechanisms."""
        return len(self.specs)

    def column(self, read: Callable[[VcfmSpec], float | None]) -> FloatArray:
        """Return a number of each specification, (m,); NaN for None."""
        return np.array([read(spec) for spec in self.specs], dtype=float)

    def spread_over_mechanisms(self, value: Any) -> FloatArray:
        """Return what laws give, a number or a column, as (m,)."""
        return np.broadcast_to(np.ravel(value), len(self))

    def split_by_mechanism(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return what is known of each curve, (m p, ...), as (m, p, ...)."""
        return values.reshape(len(self), self.preloads, *values.shape[1:])

    # --- of one mechanism -------------------------------------------------------------------------------------------

    @property
    def spec(self) -> VcfmSpec:
        """The specification of the first mechanism: words and settings are the same in all."""
        return self.specs[0]

    @property
    def fidelity(self) -> str:
        """The model that was requested."""
        return self.spec.analysis.fidelity

    @property
    def leaf_kind(self) -> LeafKind:
        """Record of the kind of the leaves."""
        return self.spec.mechanism.bistable.kind

    @property
    def sampler(self) -> PartSampler:
        """The model of leaves and spring."""
        return self.curves.sampler

    @cached_property
    def pushes(self) -> tuple[PreloadCurve, ...]:
        """The curves of the first mechanism, the nominal one first."""
        return tuple(self._make_preload_curve(row) for row in range(self.preloads))

    @property
    def first(self) -> PreloadCurve:
        """The nominal curve of the first mechanism."""
        return self.pushes[0]

    def _make_preload_curve(self, row: int) -> PreloadCurve:
        curves, size = self.curves, int(self.curves.count[row])
        leaves = LeafSamples(*(column[row, :size] for column in vars(curves.leaves).values()))
        force, stress = (column[row, :size] for column in vars(curves.spring_samples).values())
        travel, preload, rest = curves.travel[row, :size], float(curves.preload[row, 0]), float(curves.rest[row])
        rest_or_none = None if np.isnan(rest) else rest
        stopped = curves.stops.force(travel) if curves.stops else None
        return PreloadCurve(
            preload, travel, leaves, force, stress, rest_or_none, stopped, curves.sampler.find_solved(travel, preload)
        )

    # --- what characterises each mechanism, (m,) --------------------------------------------------------------------

    @cached_property
    def nominal(self) -> Rows:
        """The curves of the first preload, one for each mechanism."""
        return self.curves if self.preloads == 1 else self.curves.select_rows(slice(None, None, self.preloads))

    @cached_property
    def character(self) -> Characteristics:
        """Stiffnesses and linear ranges."""
        return self.nominal.sampler.character

    @cached_property
    def linear_range(self) -> Ends:
        """Range of constant negative stiffness, from and to [m]; NaN where it nowhere is."""
        first, last = map(self.spread_over_mechanisms, self.character.linear_range)
        return first, last

    @cached_property
    def travel(self) -> FloatArray:
        """Requested travels of the shuttles [m]."""
        return self.column(lambda spec: spec.travel)

    @cached_property
    def reach(self) -> FloatArray:
        """Ends of the travels, or where the first stop is reached [m]."""
        return np.minimum(self.travel, self.curves.stops.free_end)

    @cached_property
    def allowable_stress(self) -> FloatArray:
        """Yield strength over safety factor [Pa]; NaN where no strength is known."""
        return self.column(lambda spec: spec.mechanism.allowable_stress)

    @cached_property
    def target(self) -> FloatArray:
        """Force that the nominal curve is to have [N]; NaN if none is known (`target_of`)."""
        return self.column(target_of)

    @cached_property
    def effort_error(self) -> FloatArray:
        """Rounding of the sum of the forces of leaves and spring, or what the path of each is solved to [N]."""
        curves = self.nominal
        return np.asarray(
            self.sampler.accuracy * (np.abs(curves.leaf_force) + np.abs(curves.spring_samples.force)).max(axis=1)
        )

    def part_efforts(self, travel: FloatArray) -> FloatArray:
        """Return the largest force of one leaf, or of one spring, at travels (m, n) and the nominal preload [N]."""
        curves = self.nominal
        leaf = np.abs(curves.sampler.leaf_force(travel)) / self.parts.half_beams
        count = self.column(lambda spec: 1 if spec.mechanism.springs is None else spec.mechanism.springs.count)
        spring = np.abs(curves.sampler.spring(travel + curves.preload)[0]) / count[:, None]
        return np.asarray(np.maximum(leaf, spring))

    @cached_property
    def flat(self) -> Ends:
        """From where to where the nominal force is constant [m]; NaN where it is nowhere positive."""
        return self.nominal.flat_parts(self._flatness)

    @property
    def _flatness(self) -> float:
        """Largest (max - min)/max of a force that counts as constant."""
        return self.spec.analysis.flatness

    @cached_property
    def is_linear(self) -> NDArray[np.bool_]:
        """True where the leaves buckle within the travel, and so have a range of constant negative stiffness."""
        return np.isfinite(self.linear_range[0]) & (self.linear_range[0] < self.reach)

    @cached_property
    def window(self) -> Ends:
        """Range of forces to compare [m]: the analysis' window, else the linear range, else the longest flat part."""
        if self.spec.analysis.window is not None:
            starts = self.nominal.ends[0].tolist()
            stated = [
                (spec.analysis.window, (start, spec.travel)) for spec, start in zip(self.specs, starts, strict=True)
            ]
            low, high = np.array([window_places(ends, travel) for ends, travel in stated if ends is not None]).T
            return low, high
        if self.is_linear.all():  # nothing flat needs to be looked for
            return self.linear_range[0], np.minimum(self.linear_range[1], self.reach)
        some, (first, last) = np.isfinite(self.flat[0]), self.linear_range
        return (
            np.where(self.is_linear, first, np.where(some, self.flat[0], 0.0)),
            np.where(self.is_linear, np.minimum(last, self.reach), np.where(some, self.flat[1], self.reach)),
        )

    @property
    def window_of_one(self) -> tuple[float, float]:
        """The window of the first mechanism [m]."""
        low, high = self.window
        return float(low[0]), float(high[0])

    @property
    def window_is_flat(self) -> NDArray[np.bool_]:
        """True where `window` is the longest flat part itself: flat by definition, whatever the last digit is."""
        if self.spec.analysis.window is not None or self.is_linear.all():
            return np.zeros(len(self), dtype=bool)
        return ~self.is_linear & np.isfinite(self.flat[0])

    @cached_property
    def window_force(self) -> FloatArray:
        """Mean of the nominal force over its longest flat part [N]; NaN where there is none."""
        (low, high), curves = self.flat, self.nominal
        with np.errstate(all="ignore"):
            places = np.linspace(low, high, FLAT_PLACES, axis=1)
            is_known = np.isfinite(low)[:, None]
            force = curves.force_at(np.where(is_known, places, curves.travel[:, :1]))
            mean = np.trapezoid(np.where(is_known, force, np.nan), places, axis=1) / (places[:, -1] - places[:, 0])
        return np.where(high > low, mean, np.nan)

    @cached_property
    def spring_alone(self) -> FloatArray:
        """Force of the spring at the nominal preload where the leaves carry nothing [N]; NaN if they do carry there.

        Leaves that do not buckle push where they are flat, and so do hybrid ones; a straight beam as the spring has no
        constant stiffness. Then no single number stands for the curve.
        """
        about, curves = self.spec.mechanism.positive, self.nominal
        place = self.spread_over_mechanisms(self.parts.balance)[:, None]
        force = curves.sampler.spring(place + curves.preload)[0][:, 0]
        # leaves with a stated waviness carry a little there, which no flatness tells
        buckles = np.isfinite(self.linear_range[0]) & self.leaf_kind.buckles
        bears = (np.abs(curves.sampler.leaf_force(place)[:, 0]) > self._flatness * np.abs(force)) & ~buckles
        return np.where(bears | (about is not None and not about.kind.is_linear), np.nan, force)

    @cached_property
    def constant_force(self) -> FloatArray:
        """That of `spring_alone` [N], where the curve is flat at it; NaN where it only passes through it.

        Leaves that are too stiff for the spring have their flat part at their peak, which is another force; a spring
        that is too stiff for them leaves next to nothing flat: at least half of the window is to be.
        """
        (start, end), (low, high), alone = self.flat, self.window, self.spring_alone
        with np.errstate(all="ignore"):
            common = np.minimum(end, high) - np.maximum(start, low)
            is_same_force = np.abs(alone - self.window_force) <= self._flatness * np.maximum(alone, self.window_force)
            return np.where(is_same_force & (common >= 0.5 * (high - low)), alone, np.nan)

    @cached_property
    def least(self) -> Ends:
        """Place and value of the smallest nominal force past the peak of the leaves [m, N]; NaN without one."""
        curves, rows = self.nominal, np.arange(len(self))
        travel, (first, end) = curves.travel, curves.ends
        falls = (np.diff(curves.leaf_force, axis=1) < 0) & (travel[:, :-1] >= 0) & curves.is_distinct[:, 1:]
        some = falls.any(axis=1)
        step = (travel[rows, curves.count - 1] - travel[rows, curves.count - 2])[:, None]
        # thin leaves have their peak between the first two points: it is looked for, not taken from them
        nearest = travel[rows, falls.argmax(axis=1)]
        peak = extremes(curves.sampler.leaf_force, nearest, step, (np.maximum(first, 0.0), end))
        beyond = curves.is_distinct & (travel >= peak[:, None])
        lowest = travel[rows, np.where(beyond, curves.force, np.inf).argmin(axis=1)]
        lowest = np.where(beyond.any(axis=1), lowest, peak)
        pull = lambda places: -curves.force_at(places)  # noqa: E731  what is smallest is pulled back most
        place = extremes(pull, np.maximum(lowest, peak), step, (peak, end))
        force = curves.force_at(place[:, None])[:, 0]
        return np.where(some, place, np.nan), np.where(some, force, np.nan)

    @cached_property
    def leaf_rows(self) -> Rows:
        """Curves that go wherever the leaves go at any preload: of each mechanism one, or all where some end early."""
        first, last = (self.split_by_mechanism(end) for end in self.curves.ends)
        if (last != last[:, :1]).any():
            return self.curves
        return self.curves.select_rows(np.arange(len(self)) * self.preloads + first.argmin(axis=1))

    def leaf_stress(self, end: FloatArray | float = np.inf) -> FloatArray:
        """Return the largest stress of the leaves up to travels, (m,) or one, over all preloads, (m,) [Pa]."""
        ends = np.repeat(np.broadcast_to(end, len(self)), len(self.leaf_rows.travel) // len(self))
        return np.asarray(self.leaf_rows.leaf_stress(ends).reshape(len(self), -1).max(axis=1))

    @cached_property
    def travel_leaf_stress(self) -> FloatArray:
        """Largest stress of the leaves over the whole travel, over all preloads, (m,) [Pa]."""
        return self.leaf_stress()

    @cached_property
    def travel_spring_stress(self) -> FloatArray:
        """Largest stress of the spring over the whole travel at each preload, (m, p) [Pa]."""
        return self.split_by_mechanism(self.curves.spring_stress())

    @property
    def overrating(self) -> FloatArray:
        """By what share the model overestimates the stress of the leaves at most, where that is known; else zero."""
        return self.spread_over_mechanisms(self.parts.leaf.overrating if self.fidelity == "analytic" else 0.0)

    @cached_property
    def hindered_curling(self) -> dict[str, Ends]:
        """By what share leaves and spring are too soft at most, as wide strips, and at which travel [m].

        Their curvature is taken from the stress at any preload, as if they were bent to half a sine.
        """
        about, curves = self.spec.mechanism, self.curves
        if about.wide_beams or self.spec.analysis.fidelity in ("truss", "solid"):
            return {}
        nu, shares = self.column(lambda spec: spec.mechanism.material.poisson), {}
        modulus = self.column(lambda spec: spec.mechanism.material.modulus)
        leaves = ("leaves", "bistable", self.leaf_rows, self.leaf_rows.leaves.stress)
        for name, key, rows, samples in (leaves, ("spring", "positive", curves, curves.spring_samples.stress)):
            if getattr(about, key) is None:  # a bought spring is none
                continue
            sizes = [getattr(spec.mechanism, key) for spec in self.specs]
            width, thickness = (np.array([getattr(strip, size) for strip in sizes]) for size in ("width", "thickness"))
            stress = np.where(rows.is_distinct, samples, -np.inf).reshape(len(self), -1)
            worst = np.nanargmax(stress, axis=1)[:, None]
            curvature = 2.0 * np.take_along_axis(stress, worst, 1)[:, 0] / (modulus * thickness)
            share = np.asarray(hindered_share(width, thickness, nu, curvature))
            shares[name] = share, np.take_along_axis(rows.travel.reshape(len(self), -1), worst, 1)[:, 0]
        return shares

    @cached_property
    def window_forces(self) -> FloatArray:
        """Force of each curve at even places of the mechanism's window, (m, p, MEAN_PLACES) [N]; NaN beyond it."""
        places = np.linspace(*self.window, MEAN_PLACES, axis=1)
        leaves = self.nominal.sampler.leaf_force(places)[:, None]
        spring = self.curves.sampler.spring(np.repeat(places, self.preloads, axis=0) + self.curves.preload)[0]
        first, last = (self.split_by_mechanism(end)[..., None] for end in self.curves.ends)
        inside = (places[:, None] >= first) & (places[:, None] <= last)
        force = leaves + self.split_by_mechanism(spring)
        if self.curves.stops:
            force = force + self.curves.stops.force(places)[:, None]
        return np.where(inside, force, np.nan)

    # --- the nominal curves, as metrics see them --------------------------------------------------------------------

    @cached_property
    def dense(self) -> FloatArray:
        """Increasing travels of each shuttle, (m, q), so dense that the force hides nothing between two [m]."""
        low, high = (end[:, None] for end in self.nominal.ends)
        grid = [np.linspace(low[:, 0], high[:, 0], N_EVEN_PLACES, axis=1)]
        grid += [np.clip(np.full_like(low, place), low, high) for place in self.curves.stops.marks]
        with np.errstate(all="ignore"):
            for mark in (*(end[:, None] for end in self.linear_range), np.zeros_like(low)):
                crowd = np.hstack([mark, mark - CROWDED_SHARES * (high - low), mark + CROWDED_SHARES * (high - low)])
                inside = (mark >= low) & (mark < high) & (crowd >= low) & (crowd <= high)
                grid.append(np.where(inside, crowd, low))
        return np.sort(np.hstack(grid), axis=1)

    def stress(self, places: FloatArray, rows: Any = None, alone: bool = False) -> FloatArray:
        """Return the largest stress of leaves and spring at travels of all mechanisms, or of some, (k, n) [Pa].

        Of all preloads whose curves go there; `alone`: of the nominal one.
        """
        curves, count = (self.nominal, 1) if alone else (self.curves, self.preloads)
        chosen = np.arange(len(self)) if rows is None else rows
        curve_numbers = (chosen[:, None] * count + np.arange(count)).ravel()
        travel, (first, last) = np.repeat(places, count, axis=0), (end[curve_numbers, None] for end in curves.ends)
        spring = curves.sampler.select_rows(curve_numbers).spring(travel + curves.preload[curve_numbers])[1]
        spring = np.where((travel < first) | (travel > last), 0.0, spring).reshape(len(chosen), count, -1)
        return np.asarray(np.maximum(self.nominal.sampler.select_rows(chosen).leaf_stress(places), spring.max(axis=1)))

    def _stress_samples(self) -> list[RowSamples]:
        """Return the largest stress of leaves and spring at the points of each preload, the nominal one first [Pa]."""
        curves, every = self.curves, [slice(k, None, self.preloads) for k in range(self.preloads)]
        stress = np.maximum(curves.leaves.stress, curves.spring_samples.stress)
        return [
            RowSamples(curves.travel[curve_numbers], stress[curve_numbers], curves.count[curve_numbers])
            for curve_numbers in every
        ]

    @property
    def branches(self) -> dict[str, CurveRows]:
        """The nominal curves by branch, as metrics see them."""
        curves = self.nominal
        low, high = (np.where(self.is_linear, *ends) for ends in zip(self.linear_range, curves.ends, strict=True))
        rows_of_curves = CurveRows(
            RowSamples(curves.travel, curves.force, curves.count),
            lambda: self.dense,
            curves.force_at,
            self.effort_error,
            self.target,
            np.array([spec.analysis.band for spec in self.specs]),
            (low, np.minimum(high, self.reach)),
            self.part_efforts,
            StressRows(self._stress_samples, self.stress, self.allowable_stress),
            followed=self.spec.target_curve,
        )
        return {"load": rows_of_curves}
