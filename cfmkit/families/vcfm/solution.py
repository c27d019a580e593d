"""What is known of a solved mechanism: its parts, what a model gives at some travels, and one curve per preload.

Every other file of this family may import these types.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.elastica.model.section import hindered_share
from cfmkit.families.vcfm.leaves.v_beam import VBeam, overrated
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.metrics.longest_interval_in_band import extreme, flat_window
from cfmkit.specs.units import between

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaf_laws_from_spec import Parts
    from cfmkit.families.vcfm.spec import VcfmSpec


@dataclass(frozen=True, repr=False)
class LeafSamples(ShortRepr):
    """All leaves at some travels: force [N], largest stress [Pa], whether stable, whether buckled; (n,) each."""

    force: FloatArray
    stress: FloatArray
    stable: Any
    buckled: Any


@dataclass(frozen=True)
class Characteristics:
    """Stiffness of spring and leaves [N/m], and where the negative one is constant [m] (NaN: nowhere).

    `negative_stiffness` is a size: positive, or zero where there is none.
    """

    positive_stiffness: float
    negative_stiffness: float
    first_stiffness: float
    linear: tuple[float, float]


class PartSampler(Protocol):
    """A model of leaves and spring."""

    @property
    def problem(self) -> str:
        """Why a part could not be followed to the end; empty if all could."""

    @property
    def accuracy(self) -> float:
        """Error of the force, in parts of what leaves and spring bear."""

    @property
    def character(self) -> Characteristics:
        """Stiffnesses and linear range."""

    def leaves(self, travel: FloatArray) -> LeafSamples:
        """Return what all leaves do at some travels [m]."""

    def leaf_force(self, travel: FloatArray) -> FloatArray:
        """Return the force of all leaves alone [N]."""

    def spring(self, compression: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and largest stress [Pa] of the spring at some compressions [m]."""

    def solved(self, travel: FloatArray, preload: float) -> NDArray[np.bool_] | None:
        """Tell at which travels [m] leaves and spring were solved for, not interpolated; None where all are known."""


@dataclass(frozen=True, repr=False)
class Push(ShortRepr):
    """One curve: the mechanism at one preload.

    Attributes
    ----------
    preload : float
        Of the spring's far end [m].
    travel : (n,) array
        Of the shuttle from the as-made pose, increasing [m].
    leaves : LeafSamples
        All leaves.
    spring_force, spring_stress : (n,) array
        Of the spring [N, Pa].
    rest : float or None
        Where the shuttle rests [m]; None where nothing holds it short of the end.
    solved : (n,) array of bool or None
        Where leaves and spring were solved for, not interpolated; None where all is known.
    """

    preload: float
    travel: FloatArray
    leaves: LeafSamples
    spring_force: FloatArray
    spring_stress: FloatArray
    rest: float | None
    solved: NDArray[np.bool_] | None = None

    @cached_property
    def force(self) -> FloatArray:
        """Force on the shuttle [N]."""
        total: FloatArray = np.add(self.leaves.force, self.spring_force)
        return total


@dataclass(frozen=True, repr=False)
class Solution(ShortRepr):
    """A solved mechanism: its parts, the model used, what characterises it, and one curve per preload."""

    spec: VcfmSpec
    parts: Parts
    sampler: PartSampler
    character: Characteristics
    pushes: tuple[Push, ...]

    @property
    def nominal(self) -> Push:
        """The curve of the first preload."""
        return self.pushes[0]

    @property
    def effort_error(self) -> float:
        """Rounding of the sum of the forces of leaves and spring, or what the path of each is solved to [N]."""
        push = self.nominal
        return self.sampler.accuracy * float((np.abs(push.leaves.force) + np.abs(push.spring_force)).max())

    def part_efforts(self, _branch: str, travel: FloatArray, /) -> FloatArray:
        """Return the largest force of one leaf, or of one spring, at some travels and the nominal preload [N]."""
        places = np.ravel(travel)
        leaf = self.sampler.leaf_force(places) / self.parts.half_beams
        spring = self.sampler.spring(places + self.nominal.preload)[0] / self.springs
        return np.asarray(np.maximum(np.abs(leaf), np.abs(spring)).reshape(np.shape(travel)))

    @property
    def springs(self) -> int:
        """Number of springs side by side: of those that are bought; a flexure spring is one."""
        bought = self.spec.mechanism.springs
        return 1 if bought is None else bought.count

    @cached_property
    def constant_force(self) -> float | None:
        """That of `spring_alone` [N], where the curve is flat at it; None where it only passes through it.

        Leaves that are too stiff for the spring have their flat part at their peak, which is another force; a spring
        that is too stiff for them leaves next to nothing flat.
        """
        alone, flat, part = self.spring_alone, self.window_force, self.windows[0]
        if alone is None or flat is None or part is None:
            return None
        return alone if is_constant(alone, flat, self._flatness, (part, self.window)) else None

    @property
    def _flatness(self) -> float:
        """What (max - min)/max a constant force may have."""
        return self.spec.analysis.flatness

    @cached_property
    def spring_alone(self) -> float | None:
        """Force of the spring at the nominal preload where the leaves carry nothing [N]; None if they do carry there.

        Leaves that do not buckle push where they are flat, and so do hybrid ones; a straight beam as the spring has no
        constant stiffness. Then no single number stands for the curve.
        """
        kinds = self.spec.mechanism.kinds
        place = np.array([self.parts.balance])
        force = float(self.sampler.spring(place + self.nominal.preload)[0][0])
        # leaves with a stated waviness carry a little there, which no flatness tells
        bears = abs(float(self.sampler.leaf_force(place)[0])) > self._flatness * abs(force) and not (
            np.isfinite(self.character.linear[0]) and kinds[1] != "hybrid"
        )
        return None if bears or kinds[0] == "straight" else force

    @property
    def overrating(self) -> float:
        """By what share the model overestimates the stress of the leaves at most, where that is known; else zero."""
        closed = isinstance(self.parts.leaf, VBeam) and self.spec.analysis.fidelity == "analytic"
        return float(overrated(self.parts.strip.angle)) if closed else 0.0

    @property
    def hindered_curling(self) -> Iterator[tuple[str, float, float]]:
        """By what share leaves and spring are too soft at most, as wide strips, and at which travel [m].

        Their curvature is taken from the stress at any preload, as if they were bent to half a sine.
        """
        about = self.spec.mechanism
        if about.wide_beams or self.spec.analysis.fidelity in ("truss", "solid"):
            return
        own, nu = about.material.modulus, about.material.poisson
        travel = np.concatenate([push.travel for push in self.pushes])
        leaves, spring = (
            np.concatenate([np.asarray(one) for one in found])
            for found in zip(*((push.leaves.stress, push.spring_stress) for push in self.pushes), strict=True)
        )
        for name, leaf, stress in (("leaves", about.bistable, leaves), ("spring", about.positive, spring)):
            if leaf is not None:  # a bought spring is none
                worst = int(np.nanargmax(stress))
                curvature = 2.0 * float(stress[worst]) / (own * leaf.thickness)
                yield name, float(hindered_share(leaf.width, leaf.thickness, nu, curvature)), float(travel[worst])

    @cached_property
    def windows(self) -> tuple[tuple[float, float] | None, ...]:
        """Constant-force window of each curve [m]; None where the force is nowhere positive."""
        return self._flat(self.pushes, self._flatness)

    def flat_part(self, push: Push, flatness: float) -> tuple[float, float] | None:
        """Return the longest stretch of a curve on which (max - min)/max of the force is within `flatness` [m]."""
        return self._flat((push,), flatness)[0]

    def _flat(self, pushes: tuple[Push, ...], flatness: float) -> tuple[tuple[float, float] | None, ...]:
        """Return `flat_part` of some curves: all together, because calls of the model are what takes the time."""
        most, preload = max(len(push.travel) for push in pushes), np.array([[push.preload] for push in pushes])
        travel = np.stack([np.pad(push.travel, (0, most - len(push.travel)), "edge") for push in pushes])
        force = np.full(travel.shape, np.nan)
        for row, push in zip(force, pushes, strict=True):
            row[: len(push.force)] = push.force

        def force_at(places: FloatArray) -> FloatArray:
            shuttle = self.sampler.leaf_force(places.ravel())
            spring = self.sampler.spring((places + preload).ravel())[0]
            return np.asarray((shuttle + spring).reshape(places.shape))

        ends = zip(*flat_window(travel, force, flatness, force_at), strict=True)
        return tuple((float(low), float(high)) if np.isfinite(low) else None for low, high in ends)

    @cached_property
    def least(self) -> tuple[float, float] | None:
        """Where and how small the nominal force becomes past the peak of the leaves [m, N]; None without one."""
        push, sampler = self.nominal, self.sampler
        falls = np.flatnonzero((np.diff(push.leaves.force) < 0) & (push.travel[:-1] >= 0))
        if not len(falls):
            return None
        step, end = float(push.travel[-1] - push.travel[-2]), float(push.travel[-1])
        # thin leaves have their peak between the first two points: it is looked for, not taken from them
        peak = extreme(sampler.leaf_force, float(push.travel[falls[0]]), step, (max(float(push.travel[0]), 0.0), end))
        beyond = np.flatnonzero(push.travel >= peak)
        lowest = float(push.travel[beyond[push.force[beyond].argmin()]]) if len(beyond) else peak
        place = extreme(lambda travel: -force_of(sampler, travel, push.preload), max(lowest, peak), step, (peak, end))
        return place, float(force_of(sampler, np.array([place]), push.preload)[0])

    def force_at(self, push: Push, travel: FloatArray) -> FloatArray:
        """Return the force of a curve at some travels, by the model, (n,) [N]; NaN beyond its ends."""
        reached = (travel >= push.travel[0]) & (travel <= push.travel[-1])
        force = np.full(travel.shape, np.nan)
        force[reached] = force_of(self.sampler, travel[reached], push.preload)
        return force

    def inside(self, push: Push, window: tuple[float, float]) -> FloatArray:
        """Return the forces of a curve at its samples in a window and at the window's ends [N]."""
        low, high = window
        own = push.force[(push.travel > low) & (push.travel < high)]
        ends = self.force_at(push, np.array(window))
        found = np.concatenate([ends[:1], own, ends[1:]])
        known: FloatArray = found[np.isfinite(found)]
        return known

    def largest_stress(self, push: Push, end: float = np.inf) -> tuple[float, float]:
        """Return the largest stress of leaves and spring of a curve up to a travel [m], that one included, in Pa."""
        leaves, spring = self.largest_stresses((push,), (end,))[0, 0].tolist()
        return leaves, spring

    def largest_stresses(self, pushes: tuple[Push, ...], ends: tuple[float, ...]) -> FloatArray:
        """Return the same of some curves up to some travels, (curves, travels, 2): together, as calls take the time."""
        owners = [push for push in pushes for _ in ends]
        travels = [_up_to(push.travel, end) for push in pushes for end in ends]
        preload = np.array([[push.preload] for push in owners])
        laws: tuple[Callable[[FloatArray], FloatArray], ...] = (
            lambda places: self.sampler.leaves(places.ravel()).stress.reshape(places.shape),
            lambda places: self.sampler.spring((places + preload).ravel())[1].reshape(places.shape),
        )
        some = np.array([bool(len(travel)) for travel in travels])
        filled = [travel if len(travel) else push.travel[:1] for travel, push in zip(travels, owners, strict=True)]
        most = max(map(len, filled))
        motion = np.stack([np.pad(travel, (0, most - len(travel)), "edge") for travel in filled])
        found = [np.maximum(some * extremes(law, motion, law(motion), uneven=True)[0], 0.0) for law in laws]
        return np.stack(found, axis=-1).reshape(len(pushes), len(ends), 2)

    @cached_property
    def window_force(self) -> float | None:
        """Mean of the nominal force over its constant-force window [N]; None where there is none."""
        if self.windows[0] is None or not self.windows[0][1] > self.windows[0][0]:
            return None
        places = np.linspace(*self.windows[0], FLAT_PLACES)
        force = force_of(self.sampler, places, self.nominal.preload)
        return float(np.trapezoid(force, places) / (places[-1] - places[0]))

    @property
    def course(self) -> tuple[float, float]:
        """Where the shuttle starts from at the nominal preload, and where it was to go [m]."""
        return float(self.nominal.travel[0]), self.spec.travel

    @property
    def window(self) -> tuple[float, float]:
        """Where forces are compared [m]: the analysis' window, else the linear range, else the longest flat stretch."""
        if self.spec.analysis.window is not None:
            return between(self.spec.analysis.window, self.course)
        low, high = self.character.linear
        if self.is_linear:
            return low, min(high, self.spec.travel)
        return self.windows[0] or (0.0, self.spec.travel)

    @property
    def is_linear(self) -> bool:
        """Whether the leaves buckle within the travel, and so have a range of constant negative stiffness."""
        low = self.character.linear[0]
        return bool(np.isfinite(low) and low < self.spec.travel)

    @property
    def window_is_flat(self) -> bool:
        """Whether `window` is the longest flat stretch itself: flat by what it is, whatever the last digit says."""
        return self.spec.analysis.window is None and not self.is_linear and self.windows[0] is not None


FLAT_PLACES = 401
"""Even places of a constant-force window over which its mean is taken."""

ROUNDING = 1e-9
"""A force or a travel beyond its limit by this share is on it: conversions of units and sums leave less."""


def goes_beyond(travel: FloatArray | float, end: FloatArray | float) -> Any:
    """Return whether a travel goes beyond an end [m], by more than rounding."""
    return np.asarray(travel > end * (1 + ROUNDING))


def leaves_plane(width: FloatArray | float, thickness: FloatArray | float) -> Any:
    """Return whether leaves buckle out of the plane first: narrower than twice their thickness."""
    return np.asarray(width < 2.0 * thickness)


def is_constant(alone: Any, flat: Any, flatness: float, ranges: tuple[tuple[Any, Any], tuple[Any, Any]]) -> Any:
    """Return whether the force of the spring alone is the force of a curve.

    Parameters
    ----------
    alone, flat : float or array
        Force of the spring where the leaves carry nothing, mean of the flat part of the curve [N].
    flatness : float
        By how much forces that count as one differ, as a share of the larger.
    ranges : tuple
        From where to where the curve is flat, and where it is judged [m]: at least half of that is to be flat.
    """
    (start, end), (low, high) = ranges
    common = np.minimum(end, high) - np.maximum(start, low)
    return (np.abs(alone - flat) <= flatness * np.maximum(alone, flat)) & (common >= 0.5 * (high - low))


def force_of(sampler: PartSampler, travel: FloatArray, preload: float) -> FloatArray:
    """Return the force on the shuttle at some travels and a preload [N]."""
    return np.asarray(sampler.leaf_force(travel) + sampler.spring(travel + preload)[0])


def _up_to(travel: FloatArray, end: float) -> FloatArray:
    """Return the places of a curve up to a travel, that one included where the curve goes beyond it."""
    within = travel[travel <= end]
    return np.append(within, end) if travel[0] < end < travel[-1] else within
