"""A slider-crank with springs put together: linkage, rates, the motion that it can run through, the forces inside.

An `Assembly` is one mechanism, or m mechanisms as rows (`stacked`): then numbers that differ are columns (m, 1), rates
are (4, m, 1), and places are (m, n), or (1, n) for all. Numbers that are equal in all stay plain, so that what
mechanisms of one linkage have in common is computed once.

The coupler is in equilibrium under the forces at its ends and the moments of the springs at crank pin and
slider pin; the slider passes on its own spring's force and what drives it.

The trim by the unloaded angle: what turning it does to the effort while the slider's places are kept. Whoever turns
the crank angle at which the springs are relaxed (the anchors of the torsion springs, or the block that a strip is
clamped in) deflects all springs by the same at every place: an effort q q' becomes (q + dq) q'. Unlike the anchor of
the slider's spring, that adds most where a joint turns most per travel.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.guide_friction import FRICTIONLESS_GUIDE, GuideFriction
from cfmkit.families.rows import stack
from cfmkit.families.slider_crank.linkage import unloaded_linkage
from cfmkit.families.slider_crank.unit_springs import SliderPath, UnitCurves, crank_efforts, curves_along_crank, path_of
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.families.slider_crank.linkage import Linkage
    from cfmkit.families.slider_crank.spec import Mechanism, SliderCrankSpec


Ends = tuple[float, float]
FULL_TURN = 2.0 * math.pi
SHORT_OF_END = 1e-3  # share of an arc that a motion stays away from its ends, where efforts are unbounded
MIN_END_SHARE = 1e-6
"""Nearer to such an end, as a share of the way to it, the last digits of the motion decide the effort's."""


@dataclass(frozen=True)
class Rubbing:
    """Friction in a slider-crank."""

    pin: float = 0.0  # friction couple per load of each pin, mu d/2 [m]
    guide: GuideFriction = FRICTIONLESS_GUIDE
    mirrored: bool = False  # whether a mirrored pair keeps the guide free of load

    @property
    def is_present(self) -> bool:
        """Whether anything rubs."""
        return bool(self.pin) or self.guide.is_present


@dataclass(frozen=True, repr=False)
class Assembly(ShortRepr, ABC):
    """A slider-crank put together, or several as rows; the motion that can be run through is that of one."""

    drive: ClassVar[Kind]  # the effort that drives it, as `analysis.drive` says it
    # of the motion: its name in a specification and among the values, its dimension, and what it is in words
    motion_name: ClassVar[Literal["angle", "travel"]]
    dimension: ClassVar[Literal["angle", "length"]]
    motion_words: ClassVar[str]
    stiffness_dimension: ClassVar[Literal["rotational_stiffness", "stiffness"]]  # of the effort by the motion
    also_stacked: ClassVar[tuple[str, ...]] = ()  # attributes beside the fields (`cfmkit.families.rows.stack`)

    linkage: Linkage  # the lengths, the coupler's written out
    unloaded: float  # crank angle with all springs relaxed [rad]
    rates: FloatArray  # (4,), of the springs of all legs together [N m/rad; the last N/m]
    side: int = 1  # of a slider that is pushed: 1 beyond, -1 before the stretched position
    anchor: float = 0.0  # how far the anchor of the slider's spring is screwed beyond where that is relaxed [m]
    rubbing: Rubbing = Rubbing()  # friction of its pins and guide; efforts of `units` and `forces` are without

    @abstractmethod
    def units(self, motion: FloatArray) -> UnitCurves:
        """Return what unit springs do along the motion of the drive."""

    @abstractmethod
    def forces(self, motion: FloatArray) -> FloatArray:
        """Return the efforts of `units` alone, (4, n)."""

    @property
    @abstractmethod
    def start(self) -> float:
        """The motion in the unloaded position."""

    @property
    @abstractmethod
    def rest(self) -> float:
        """The motion at which the springs are relaxed; NaN on the side of the stretched position where they are not."""

    @property
    @abstractmethod
    def stretched_motion(self) -> float:
        """The motion in the stretched position nearest to the unloaded one."""

    @property
    @abstractmethod
    def reach(self) -> Ends:
        """Ends of the motion that the linkage allows [rad or m]; infinite where the crank turns fully."""

    @property
    @abstractmethod
    def poles(self) -> tuple[bool, bool]:
        """Whether the effort grows without bound towards the first, and towards the last place of the reach.

        A drive loses its hold in a dead point: nothing but springs that are relaxed there, or that it drives itself,
        give it a finite effort.
        """

    @abstractmethod
    def default_motion(self) -> Ends:
        """Return the motion that is run through where none is requested: all of it, a full turn at most."""

    @abstractmethod
    def default_reference(self, low: float, high: float) -> float:
        """Return where the constant band is taken in a motion unless somebody states it."""

    @abstractmethod
    def spread(self, share: FloatArray) -> FloatArray:
        """Return even shares of a motion as those of a grid on which efforts are smooth."""

    @property
    def tight(self) -> float:
        """Contribution of the anchor to the deflection of the slider's spring, along the slider's path [m]."""
        return -self.linkage.branch * self.anchor + 0.0  # no minus before a zero

    def rates_over(self, unit: FloatArray) -> FloatArray:
        """Return the rates with as many axes as unit curves (4, ..., n)."""
        return self.rates.reshape(*self.rates.shape, *[1] * (unit.ndim - self.rates.ndim))

    def weigh(self, unit: FloatArray) -> FloatArray:
        """Return rates times unit curves; a spring that is not there does nothing, even at a pole."""
        rates = self.rates_over(unit)
        with np.errstate(invalid="ignore"):
            return np.where(rates == 0.0, 0.0, rates * unit)

    def total(self, unit: FloatArray) -> FloatArray:
        """Return the sum of rates times unit curves over the springs that are there, (..., n)."""
        if unit.ndim == 3 and unit.shape[1] == 1 and np.isfinite(unit).all():  # of one linkage: a product
            return np.asarray(self.rates.reshape(4, -1).T @ unit[:, 0])
        rates = self.rates_over(unit)
        rated = [(rate, row) for rate, row in zip(rates, unit, strict=True) if rate.any()]
        sums = np.zeros(np.broadcast_shapes(rates.shape[1:], unit.shape[1:]))
        with np.errstate(invalid="ignore"):
            for rate, row in rated:
                sums += rate * row if rate.all() else np.where(rate == 0.0, 0.0, rate * row)
        return sums

    def efforts(self, motion: FloatArray) -> FloatArray:
        """Return torque [N m] or force [N] at some places."""
        return self.total(self.forces(motion))

    @cached_property
    def knee(self) -> float:
        """The knee angle in the unloaded position [rad]."""
        return self.linkage.knee(self.unloaded)

    def clip_motion(self, low: float, high: float) -> tuple[float, float]:
        """Return the part of a motion that is within reach, and ends before the efforts grow without bound.

        What keeps off a pole by itself is left as it is. What touches or passes it ends `SHORT_OF_END` of the way
        from the unloaded position before it: there the effort is some thirty times what it is elsewhere.
        """
        (first, last), (at_first, at_last) = self.reach, self.poles
        to_first, to_last = self._ways
        if at_first and low < first + MIN_END_SHARE * to_first:
            first += SHORT_OF_END * to_first
        if at_last and high > last - MIN_END_SHARE * to_last:
            last -= SHORT_OF_END * to_last
        return max(low, first), min(high, last)

    @property
    def _ways(self) -> Ends:
        """Distances of the motion from the unloaded position to the first, and to the last place of the reach."""
        first, last = self.reach
        return self.start - first, last - self.start


class TurnedCrank(Assembly):
    """A slider-crank that a torque drives over the crank's angle."""

    drive = "torque"
    motion_name = "angle"
    dimension = "angle"
    motion_words = "crank angle"
    stiffness_dimension = "rotational_stiffness"

    def units(self, motion: FloatArray) -> UnitCurves:
        """Return what unit springs do along the crank's angle."""
        return curves_along_crank(self.linkage, self.unloaded, motion, self.anchor)

    def forces(self, motion: FloatArray) -> FloatArray:
        """Return the efforts of `units` alone, (4, n)."""
        return crank_efforts(self.linkage, self.unloaded, motion, self.anchor)

    @property
    def start(self) -> float:
        """The unloaded angle."""
        return self.unloaded

    @property
    def rest(self) -> float:
        """The angle at which the springs are relaxed; NaN if an anchor tightens one."""
        return math.nan if self.anchor else self.unloaded

    @property
    def stretched_motion(self) -> float:
        """The crank angle in the stretched position nearest to the unloaded one."""
        return self.unloaded - math.remainder(self.unloaded - self.linkage.stretched_angle, FULL_TURN)

    @cached_property
    def reach(self) -> Ends:
        """Ends of the angle; infinite where the crank turns fully."""
        return self.linkage.arc(self.unloaded)

    @property
    def poles(self) -> tuple[bool, bool]:
        """Whether the torque grows without bound towards either end of the arc."""
        held = bool(self.rates[1:].any())
        first, last = (held and math.isfinite(end) and end != self.unloaded for end in self.reach)
        return first, last

    def default_motion(self) -> Ends:
        """Return a full turn, or the arc that the crank can turn, less a little at either end."""
        low, high = self.reach
        if math.isinf(low):
            return self.start, self.start + FULL_TURN
        room = SHORT_OF_END * (high - low)
        return low + room, high - room

    def default_reference(self, low: float, high: float) -> float:
        """Return the stretched position, or the middle of a motion that it is not in."""
        return self.stretched_motion if low <= self.stretched_motion <= high else 0.5 * (low + high)

    def spread(self, share: FloatArray) -> FloatArray:
        """Return the shares as they are."""
        return share


class PushedSlider(Assembly):
    """A slider-crank that a force drives over the slider's travel, which is counted from the unloaded position."""

    drive = "force"
    motion_name = "travel"
    dimension = "length"
    motion_words = "travel of the slider"
    stiffness_dimension = "stiffness"
    also_stacked = ("path",)

    @cached_property
    def path(self) -> SliderPath:
        """The way of the slider."""
        return path_of(self.linkage, self.unloaded, self.side, self.anchor)

    def units(self, motion: FloatArray) -> UnitCurves:
        """Return what unit springs do along the travel."""
        return self.path.units(motion)

    def forces(self, motion: FloatArray) -> FloatArray:
        """Return the efforts of `units` alone, (4, n)."""
        return self.path.unit_forces(motion)

    @property
    def start(self) -> float:
        """No travel."""
        return 0.0

    @property
    def rest(self) -> float:
        """The travel at which the springs are relaxed; NaN on the side of the stretched position where they are not."""
        return math.nan if self._is_beyond or self.anchor else 0.0

    @property
    def _is_beyond(self) -> bool:
        """Whether it moves on the other side of the stretched position than the unloaded one."""
        return self.side * self.knee < 0.0 and self.knee != math.pi

    @property
    def stretched_motion(self) -> float:
        """The travel in the stretched position."""
        first, last = self.reach
        return first if self.linkage.find_path_ends(self.unloaded)[1] == self.linkage.stretched_position else last

    @cached_property
    def reach(self) -> Ends:
        """Ends of the travel."""
        inward, outward = self.linkage.room(self.unloaded)
        first, last = self._relaxed_ends
        return 0.0 if first else -outward, 0.0 if last else inward

    @cached_property
    def _relaxed_ends(self) -> tuple[bool, bool]:
        """Whether the springs are relaxed at the first, and at the last place that a driven slider can reach."""
        stretched, folded = (self.knee == knee for knee in (0.0, math.pi))
        past = self.linkage.branch * self.linkage.place(self.unloaded) < 0.0
        return (folded, stretched) if past else (stretched, folded)

    @property
    def poles(self) -> tuple[bool, bool]:
        """Whether the force grows without bound towards either end of the travel."""
        link, held = self.linkage, bool(self.rates[:3].any())
        ends = link.find_path_ends(self.unloaded)[::-1]
        first, last = (held and end != 0.0 and not rest for end, rest in zip(ends, self._relaxed_ends, strict=True))
        return first, last

    @property
    def _ways(self) -> Ends:
        """Distances from the unloaded position to the first, and to the last place of the reach.

        On the other side of the stretched position the slider gets to the folded one by way of the stretched one,
        the springs turned all the way, however near to it the unloaded position is.
        """
        first, last = self.reach
        if not math.isnan(self.rest):
            return super()._ways
        ends, far = self.linkage.find_path_ends(self.unloaded)[::-1], self.linkage.stretched_position
        to_first, to_last = (
            arc if abs(end) == far else last - first for arc, end in zip(super()._ways, ends, strict=True)
        )
        return to_first, to_last

    def default_motion(self) -> Ends:
        """Return all travel inward less a little; relaxed folded, it can only be pulled."""
        low, high = self.reach
        room = SHORT_OF_END * (high - low)
        return (0.0, high - room) if high > room else (low + room, 0.0)

    def default_reference(self, low: float, high: float) -> float:
        """Return the middle of a motion."""
        return 0.5 * (low + high)

    def spread(self, share: FloatArray) -> FloatArray:
        """Return their squares: the force runs like the square root of the travel from the stretched place."""
        return share**2


ASSEMBLY_BY_DRIVE: dict[Kind, type[Assembly]] = {kind.drive: kind for kind in (TurnedCrank, PushedSlider)}


def assemble(spec: SliderCrankSpec, drive: Kind | None = None) -> Assembly:
    """Return the slider-crank put together, for the drive of its analysis or another one.

    Raises CannotBuild if it cannot exist as described; the finding says why.
    """
    mechanism, analysis = spec.mechanism, spec.analysis
    linkage, unloaded = unloaded_linkage(mechanism)
    springs = mechanism.springs
    rates = np.array(springs.rates) * mechanism.sets
    rates.setflags(write=False)
    return ASSEMBLY_BY_DRIVE[drive or analysis.drive](
        linkage,
        unloaded,
        rates,
        analysis.side_sign or linkage.side(unloaded),
        springs.anchor or 0.0,
        _rubbing(mechanism),
    )


def _rubbing(mechanism: Mechanism) -> Rubbing:
    pins = mechanism.pins
    return Rubbing(
        pin=0.5 * pins.diameter * pins.friction if pins else 0.0,
        guide=GuideFriction.from_guide(mechanism.guide),
        mirrored=mechanism.copies == "mirrored",
    )


def asked_motion(spec: SliderCrankSpec, assembly: Assembly) -> tuple[float, float]:
    """Return the motion that the analysis asks for [rad or m]."""
    asked: tuple[float, float] | None = getattr(spec.analysis, assembly.motion_name)
    return asked or assembly.default_motion()


def window_of(spec: SliderCrankSpec, assembly: Assembly) -> tuple[float, float] | None:
    """Return the window in which the effort is wanted constant, if the analysis states one [rad or m]."""
    window = spec.analysis.window
    return None if window is None else window_places(window, asked_motion(spec, assembly))


def reference_motion(spec: SliderCrankSpec, assembly: Assembly) -> float:
    """Return where the constant band is taken: as asked, else the stretched position, or half way of a force."""
    asked: float | None = getattr(spec.analysis, f"reference_{assembly.motion_name}")
    return assembly.default_reference(*asked_motion(spec, assembly)) if asked is None else asked


def reactions(assembly: Assembly, units: UnitCurves, drive: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the tension in the coupler, and the force on the guide across the slider's path (positive upwards) [N].

    `drive`: force that drives the slider towards the pivot, (n,) [N]; zero where a torque drives the crank. Both are
    (n,), for the rates and the drive given, so of all legs together or of one.
    """
    beta = coupler_angle(assembly.linkage, units)
    along, across = pull_on_coupler(assembly, units, drive, beta)
    coupler: FloatArray = along * np.cos(beta) + across * np.sin(beta)
    return coupler, -across


def pull_on_coupler(
    assembly: Assembly, units: UnitCurves, drive: FloatArray, beta: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the slider's pull on a coupler that points to beta [rad], along the slider's path and across it [N]."""
    link, turns = assembly.linkage, assembly.rates_over(units.turn) * units.turn
    along = -turns[3] - link.branch * drive
    with np.errstate(divide="ignore", invalid="ignore"):
        # moments about the crank pin: r2 (cos b Y - sin b X), X and Y the pull, balance both torsion springs
        across = (link.coupler * np.sin(beta) * along + turns[1] + turns[2]) / (link.coupler * np.cos(beta))
    return along, across


def coupler_angle(link: Linkage, units: UnitCurves) -> FloatArray:
    """Return the direction of the coupler [rad].

    A slider that is driven takes the crank pin past the place where the coupler stands across its way; from there on
    the coupler points to the other side than the branch says.
    """
    beta = link.coupler_angle(units.angle)
    turned = link.branch * (units.position - link.crank * np.cos(units.angle)) < 0.0
    angle: FloatArray = np.where(turned, np.pi - beta, beta)
    return angle


DIFFERENCE_STEP = 1e-5
"""Of the angle [rad]: the effort is a quadratic of q at most, so that central differences are off by rounding alone."""
N_WINDOW_PLACES = 201  # of the window, over which the change of the effort is averaged


def turn_unloaded(assembly: Assembly, angle: float) -> tuple[Assembly, float]:
    """Return an assembly whose unloaded angle is turned by some angle [rad], and by how much its travel is less there.

    Travel is counted from the unloaded position: the same place has a travel smaller by the second value [m]; 0 where
    a torque drives, whose motion is the crank's angle itself.
    """
    turned = replace(assembly, unloaded=assembly.unloaded + angle)
    if assembly.drive == "torque":
        return turned, 0.0
    link = assembly.linkage
    before, after = (link.place(assembly_of_two.unloaded) for assembly_of_two in (assembly, turned))
    return turned, link.branch * (before - after)


def mean_effort_per_angle(
    assemblies: Sequence[Assembly],  # each of one mechanism
    # low, high: float or (m, 1): the windows over which the means are taken [rad or m]
    low: Any,
    high: Any,
) -> FloatArray:
    """Return by how much unit efforts rise per unloaded angle, (4, m), [N m or N, per rate and rad]."""
    places = np.linspace(np.reshape(low, -1), np.reshape(high, -1), N_WINDOW_PLACES, axis=1)
    rows = []
    for step in (DIFFERENCE_STEP, -DIFFERENCE_STEP):
        others, less = zip(*(turn_unloaded(assembly, step) for assembly in assemblies), strict=True)
        rows.append(stack(others).forces(places - np.reshape(less, (-1, 1))))
    with np.errstate(invalid="ignore"):  # at the end of the reach some efforts are unbounded
        change = (rows[0] - rows[1]) / (2.0 * DIFFERENCE_STEP)
    return np.asarray(change.mean(axis=-1))
