"""From a slider-crank specification to linkage, rates and the motion that is run through."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.families.findings import deg, mm
from cfmkit.families.refusals import CannotBuild
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.linkage import Linkage
from cfmkit.families.slider_crank.unit_springs import (
    UnitCurves,
    along_crank,
    along_slider,
    crank_efforts,
    slider_forces,
)

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.families.slider_crank.spec import Mechanism, SliderCrankSpec

TURN = 2.0 * math.pi

SHORT_OF_END = 1e-3
"""Share of an arc that a motion stays away from its ends, where efforts have no bound."""

CLOSEST = 1e-6
"""Nearer to such an end, as a share of the way to it, the last digits of the motion decide the effort's."""


@dataclass(frozen=True)
class Assembly:
    """A slider-crank put together.

    Attributes
    ----------
    linkage : Linkage
        The lengths, the coupler's written out.
    unloaded : float
        Crank angle with all springs relaxed [rad].
    rates : (4,) array
        Of the springs of all legs together [N m/rad; the last N/m].
    drive : {"torque", "force"}
        What the motion is: the crank's angle or the slider's travel.
    side : int
        Of a force drive: 1 beyond, -1 before the stretched position.
    """

    linkage: Linkage
    unloaded: float
    rates: FloatArray
    drive: Kind = "torque"
    side: int = 1

    def units(self, motion: FloatArray) -> UnitCurves:
        """Return what unit springs do along the motion of the drive."""
        if self.drive == "torque":
            return along_crank(self.linkage, self.unloaded, motion)
        return along_slider(self.linkage, self.unloaded, self.side, motion)

    def forces(self, motion: FloatArray) -> FloatArray:
        """Return the efforts of `units` alone, (4, n)."""
        if self.drive == "torque":
            return crank_efforts(self.linkage, self.unloaded, motion)
        return slider_forces(self.linkage, self.unloaded, self.side, motion)

    @property
    def motion_name(self) -> Literal["angle", "travel"]:
        """What the motion is called in a specification and among the values."""
        return "angle" if self.drive == "torque" else "travel"

    @property
    def dimension(self) -> Literal["angle", "length"]:
        """Dimension of the motion."""
        return "angle" if self.drive == "torque" else "length"

    @property
    def start(self) -> float:
        """The motion in the unloaded position."""
        return self.unloaded if self.drive == "torque" else 0.0

    @property
    def rest(self) -> float:
        """The motion at which the springs are relaxed; NaN on the side of the stretched position where they are not."""
        knee = self.linkage.knee(self.unloaded)
        other_side = self.drive == "force" and self.side * knee < 0.0 and knee != math.pi
        return math.nan if other_side else self.start

    @property
    def reach(self) -> tuple[float, float]:
        """Ends of the motion that the linkage allows [rad or m]; infinite where the crank turns fully."""
        if self.drive == "torque":
            return self.linkage.arc(self.unloaded)
        inward, outward = self.linkage.room(self.unloaded)
        first, last = self._relaxed_ends
        return 0.0 if first else -outward, 0.0 if last else inward

    @property
    def _relaxed_ends(self) -> tuple[bool, bool]:
        """Whether the springs are relaxed at the first, and at the last place that a driven slider can reach."""
        stretched, folded = (self.linkage.knee(self.unloaded) == knee for knee in (0.0, math.pi))
        past = self.linkage.branch * float(self.linkage.slider_position(np.asarray(self.unloaded))) < 0.0
        return (folded, stretched) if past else (stretched, folded)

    @property
    def poles(self) -> tuple[bool, bool]:
        """Whether the effort grows without bound towards the first, and towards the last place of the reach.

        A drive loses its hold in a dead point: nothing but springs that are relaxed there, or that it drives itself,
        give it a finite effort.
        """
        if self.drive == "torque":
            held = bool(self.rates[1:].any())
            first, last = (held and math.isfinite(end) and end != self.unloaded for end in self.reach)
            return first, last
        link, held = self.linkage, bool(self.rates[:3].any())
        ends = link.way(self.unloaded)[::-1]
        first, last = (held and end != 0.0 and not rest for end, rest in zip(ends, self._relaxed_ends, strict=True))
        return first, last

    def within(self, low: float, high: float) -> tuple[float, float]:
        """Return the part of a motion that is within reach, and ends before the efforts grow without bound.

        What keeps off a pole by itself is left as it is. What touches or passes it ends `SHORT_OF_END` of the way
        from the unloaded position before it: there the effort is some thirty times what it is elsewhere.
        """
        (first, last), (at_first, at_last) = self.reach, self.poles
        to_first, to_last = self._ways
        if at_first and low < first + CLOSEST * to_first:
            first += SHORT_OF_END * to_first
        if at_last and high > last - CLOSEST * to_last:
            last -= SHORT_OF_END * to_last
        return max(low, first), min(high, last)

    @property
    def _ways(self) -> tuple[float, float]:
        """How far the motion is from the unloaded position to the first, and to the last place of the reach.

        On the other side of the stretched position the slider gets to the folded one by way of the stretched one,
        the springs turned all the way, however near to it the unloaded position is.
        """
        first, last = self.reach
        ways = [self.start - first, last - self.start]
        if self.drive == "force" and math.isnan(self.rest):
            ends, far = self.linkage.way(self.unloaded)[::-1], self.linkage.stretched_position
            ways = [way if abs(end) == far else last - first for way, end in zip(ways, ends, strict=True)]
        return ways[0], ways[1]

    @property
    def stretched(self) -> float:
        """The motion in the stretched position nearest to the unloaded one."""
        if self.drive == "force":
            first, last = self.reach
            return first if self.linkage.way(self.unloaded)[1] == self.linkage.stretched_position else last
        return self.unloaded - math.remainder(self.unloaded - self.linkage.stretched_angle, TURN)


def resolve(spec: SliderCrankSpec) -> SliderCrankSpec:
    """Return the spec with the coupler written out: from now on it is a fixed part."""
    mechanism = spec.mechanism
    if mechanism.stretched_position is None:
        return spec
    written = {"coupler_length": coupler_length(mechanism), "stretched_position": None}
    return spec.model_copy(update={"mechanism": mechanism.model_copy(update=written)})


def coupler_length(mechanism: Mechanism) -> float:
    """Return r2 [m], from the stretched position where it is not given [B, eq. 11]."""
    if mechanism.coupler_length is not None:
        return mechanism.coupler_length
    reach = math.hypot(mechanism.stretched_position or 0.0, mechanism.offset)
    if reach <= mechanism.crank_length:
        raise CannotBuild(
            finding(
                "not_assemblable",
                f"pivot and slider pin are {mm(reach)} apart when stretched, and the crank alone is "
                f"{mm(mechanism.crank_length)}: nothing is left for the coupler; make "
                "'mechanism.crank_length' shorter, or 'mechanism.stretched_position' longer",
            )
        )
    return reach - mechanism.crank_length


def linkage_of(mechanism: Mechanism) -> Linkage:
    """Return the linkage of a mechanism.

    Raises
    ------
    CannotBuild
        If crank and coupler do not reach the slider's way.
    """
    branch = 1 if mechanism.branch == "right" else -1
    linkage = Linkage(mechanism.crank_length, coupler_length(mechanism), mechanism.offset, branch)
    if not linkage.assemblable:
        raise CannotBuild(
            finding(
                "not_assemblable",
                f"crank and coupler together are {mm(linkage.crank + linkage.coupler)}, but the slider's way passes "
                f"the pivot at {mm(abs(linkage.offset))}; make the links longer or the "
                "offset smaller: 'mechanism.coupler_length' or 'mechanism.offset'",
            )
        )
    return linkage


def unloaded_angle(mechanism: Mechanism, linkage: Linkage) -> float:
    """Return the crank angle with all springs relaxed [rad].

    Raises
    ------
    CannotBuild
        If the linkage does not reach it.
    """
    given = mechanism.unloaded_angle
    angle = given if given is not None else linkage.stretched_angle + (mechanism.unloaded_offset or 0.0)
    if not linkage.reaches(angle):
        low, high = linkage.arc(linkage.stretched_angle)
        raise CannotBuild(
            finding(
                "not_assemblable",
                f"with the crank at {deg(angle)} the coupler of {mm(linkage.coupler)} does not reach the slider's way; "
                f"'mechanism.unloaded_angle' must be between {deg(low)} and {deg(high)}",
            )
        )
    return angle


def assemble(spec: SliderCrankSpec) -> Assembly:
    """Return the slider-crank put together.

    Raises
    ------
    CannotBuild
        If it cannot exist as described; the finding says why.
    """
    mechanism, analysis = spec.mechanism, spec.analysis
    linkage = linkage_of(mechanism)
    unloaded = unloaded_angle(mechanism, linkage)
    springs = mechanism.springs
    rates = np.array([springs.pivot, springs.crank_pin, springs.slider_pin, springs.slider]) * mechanism.legs
    rates.setflags(write=False)
    return Assembly(linkage, unloaded, rates, analysis.drive, side_of(spec, linkage, unloaded))


def side_of(spec: SliderCrankSpec, linkage: Linkage, unloaded: float) -> int:
    """Return 1 for a crank that is beyond the stretched position when a force drives, -1 for one before it."""
    if spec.analysis.side is not None:
        beyond = 1 if spec.analysis.side == "beyond" else -1
    else:
        beyond = -1 if linkage.knee(unloaded) < 0 else 1
    return beyond


def default_motion(assembly: Assembly) -> tuple[float, float]:
    """Return the motion that is run through where none is asked for: all of it, a full turn at most."""
    low, high = assembly.reach
    if math.isinf(low):
        return assembly.start, assembly.start + TURN
    room = SHORT_OF_END * (high - low)
    if assembly.drive == "force":
        return (0.0, high - room) if high > room else (low + room, 0.0)  # relaxed folded, it can only be pulled
    return low + room, high - room
