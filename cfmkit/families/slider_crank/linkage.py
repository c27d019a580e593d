"""An eccentric slider-crank: where crank, coupler and slider can be, and the linkage of a specification.

The crank turns about A = (0, 0), carries the coupler at B = r1 (cos t, sin t), and the coupler
ends in the slider C = (x, e), which moves along x.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 2 and 3.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import deg, mm
from cfmkit.families.rows import with_values
from cfmkit.families.slider_crank.findings import finding

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import Mechanism, SliderCrankSpec


STRETCHED_ANGLE_TOL = 1e-12  # an unloaded position so near to the stretched one [rad] is the stretched one


@dataclass(frozen=True)
class Linkage:
    """The four lengths and the way it is put together."""

    # crank, coupler: r1 and r2 [m]
    crank: float
    coupler: float
    offset: float  # e, height of the slider's path above the pivot; either sign [m]
    branch: int = 1  # 1: the slider is to the right of the crank pin, x = r1 cos t + a; -1: to its left

    @property
    def assemblable(self) -> bool:
        """Whether crank and coupler reach the slider's path at all [LH, eq. 1]: this is not a full turn yet."""
        return abs(self.offset) < self.crank + self.coupler

    @property
    def turns_fully(self) -> bool:
        """Whether the crank can go round."""
        return self.crank + abs(self.offset) < self.coupler

    @property
    def stretched_angle(self) -> float:
        """Crank angle at which crank and coupler are stretched into one line [rad] [LH, eq. 13b]."""
        angle = math.asin(self.offset / (self.crank + self.coupler))
        return angle if self.branch > 0 else math.pi - angle

    @property
    def folded_angle(self) -> float | None:
        """Crank angle at which the coupler lies folded over the crank [rad]; None if that cannot be reached.

        [LH, eq. 13a] prints the principal value of the arcsine, which is another position.
        """
        if abs(self.offset) >= abs(self.crank - self.coupler):
            return None
        angle = math.asin(self.offset / (self.crank - self.coupler))
        return math.pi - angle if self.branch > 0 else angle

    @property
    def stretched_position(self) -> float:
        """Distance of the slider along its way from the pivot in the stretched position [m]."""
        reach = self.crank + self.coupler
        return math.sqrt((reach - self.offset) * (reach + self.offset))

    def find_path_ends(self, angle: float) -> tuple[float, float]:
        """Return the ends of the slider's path around the place it has at a crank angle [m], seen to the right.

        Distances along the way from the pivot's foot; of the left branch those of its mirror image. From stretched
        to folded on one side of the foot; where the offset is too large to fold, stretched on either side.
        """
        short, far = self.crank - self.coupler, self.stretched_position
        if abs(self.offset) > abs(short):
            return -far, far
        nearest = math.sqrt((short - self.offset) * (short + self.offset))
        return (nearest, far) if self.branch * self.place(angle) >= 0.0 else (-far, -nearest)

    def room(self, angle: float) -> tuple[float, float]:
        """Return how far the slider is from the ends of its `way` at a crank angle [m], from the low and the high one.

        Next to an end the difference of two places has no digits left; the knee angle psi has: x_s^2 - x^2 is
        4 r1 r2 sin^2(psi/2), and x^2 exceeds that of the folded position by 4 r1 r2 cos^2(psi/2).
        """
        place, half = self.branch * self.place(angle), 0.5 * self.knee(angle)
        square, far = 4.0 * self.crank * self.coupler, self.stretched_position

        def measure_distance(end: float) -> float:
            if end * place <= 0.0:
                return abs(end - place)
            share = math.sin(half) if abs(end) == far else math.cos(half)
            return square * share**2 / abs(end + place)

        low, high = self.find_path_ends(angle)
        return measure_distance(low), measure_distance(high)

    def arc(self, angle: float) -> tuple[float, float]:
        """Return the ends of the crank angles that can be reached from `angle` [rad]; infinite for a full turn.

        At a finite end the coupler stands across the slider's path: a dead point of the slider's drive.
        """
        if self.turns_fully:
            return -math.inf, math.inf
        ends = []
        for height in (self.offset + self.coupler, self.offset - self.coupler):
            if abs(height) <= self.crank:
                base = math.asin(height / self.crank)
                turns = 2.0 * math.pi * np.arange(-2.0, 3.0) + 2.0 * math.pi * round(angle / (2.0 * math.pi))
                ends += [*(base + turns).tolist(), *(math.pi - base + turns).tolist()]
        return max(end for end in ends if end <= angle), min(end for end in ends if end >= angle)

    def reaches(self, angle: float) -> bool:
        """Return whether the linkage can be assembled at a crank angle [rad]."""
        return abs(self.crank * math.sin(angle) - self.offset) <= self.coupler

    def side(self, angle: float) -> int:
        """Return 1 for a crank in the stretched position or beyond it, -1 for one before it."""
        return -1 if self.knee(angle) < 0.0 else 1

    @property
    def travel_direction(self) -> float:
        """Direction in which the slider moves towards the pivot [rad]."""
        return math.pi if self.branch > 0 else 0.0

    def mirror(self) -> Linkage:
        """Return the mirror image about a line across the slider's path: the other branch, with angles pi - t."""
        return Linkage(self.crank, self.coupler, self.offset, -self.branch)

    def coupler_angle(self, angle: FloatArray) -> FloatArray:
        """Return the direction of the coupler from the crank pin to the slider [rad]."""
        lift = self.crank * np.sin(angle) - self.offset
        turn: FloatArray = np.arctan2(-lift, self._run(lift))
        return turn if self.branch > 0 else math.pi - turn

    def slider_position(self, angle: FloatArray) -> FloatArray:
        """Return the slider's x [m] [LH, eq. 7]."""
        lift = self.crank * np.sin(angle) - self.offset
        position: FloatArray = self.crank * np.cos(angle) + self.branch * self._run(lift)
        return position

    def place(self, angle: float) -> float:
        """Return `slider_position` at one crank angle [m]; NaN where the linkage does not reach."""
        return self.crank * math.cos(angle) + self.branch * self._lift_and_run(angle)[1]

    def knee(self, angle: float) -> float:
        """Return the angle from the coupler's direction to the crank's [rad]: 0 where stretched, pi where folded."""
        if abs(math.remainder(angle - self.stretched_angle, 2.0 * math.pi)) <= STRETCHED_ANGLE_TOL:
            return 0.0
        folded = self.folded_angle
        if folded is not None and abs(math.remainder(angle - folded, 2.0 * math.pi)) <= STRETCHED_ANGLE_TOL:
            return math.pi
        lift, run = self._lift_and_run(angle)
        turn = math.atan2(-lift, run)
        return math.remainder(angle - (turn if self.branch > 0 else math.pi - turn), 2.0 * math.pi)

    def _lift_and_run(self, angle: float) -> tuple[float, float]:
        """Return how far the crank pin is above the slider's path, and `_run`, at one crank angle [m]."""
        lift = self.crank * math.sin(angle) - self.offset
        squared = (self.coupler - lift) * (self.coupler + lift)
        return lift, math.sqrt(squared) if squared >= 0.0 else math.nan

    def _run(self, lift: FloatArray) -> FloatArray:
        """Return the length of the coupler along x, not negative [LH, eq. 5a]."""
        with np.errstate(invalid="ignore"):
            run: FloatArray = np.sqrt((self.coupler - lift) * (self.coupler + lift))
        return run


def resolve(spec: SliderCrankSpec) -> SliderCrankSpec:
    """Return the spec with the coupler written out: from now on it is a fixed part."""
    mechanism = spec.mechanism
    if mechanism.stretched_position is None:
        return spec
    written = {"mechanism.coupler_length": coupler_length(mechanism), "mechanism.stretched_position": None}
    return with_values(spec, written)


def coupler_length(mechanism: Mechanism) -> float:
    """Return r2 [m], from the stretched position where it is not given [B, eq. 11]."""
    if mechanism.coupler_length is not None:
        return mechanism.coupler_length
    reach = math.hypot(mechanism.stretched_position or 0.0, mechanism.offset)
    if reach <= mechanism.crank_length:
        raise finding.cannot_build(
            "not_assemblable",
            f"pivot and slider pin are {mm(reach)} apart when stretched, and the crank alone is "
            f"{mm(mechanism.crank_length)}: no length is left for the coupler; make "
            "'mechanism.crank_length' shorter, or 'mechanism.stretched_position' longer",
        )
    return reach - mechanism.crank_length


def linkage_of(mechanism: Mechanism) -> Linkage:
    """Return the linkage of a mechanism.

    Raises CannotBuild if crank and coupler do not reach the slider's path.
    """
    branch = 1 if mechanism.branch == "right" else -1
    linkage = Linkage(mechanism.crank_length, coupler_length(mechanism), mechanism.offset, branch)
    if not linkage.assemblable:
        raise finding.cannot_build(
            "not_assemblable",
            f"crank and coupler together are {mm(linkage.crank + linkage.coupler)}, but the slider's path passes "
            f"the pivot at {mm(abs(linkage.offset))}; make the links longer or the "
            "offset smaller: 'mechanism.coupler_length' or 'mechanism.offset'",
        )
    return linkage


def unloaded_linkage(mechanism: Mechanism) -> tuple[Linkage, float]:
    """Return the linkage of a mechanism, and the crank angle with all springs relaxed [rad].

    Raises CannotBuild if crank and coupler do not reach the slider's path, or not at that angle.
    """
    linkage, angle = linkage_of(mechanism), mechanism.unloaded_angle
    if angle is None:
        angle = linkage.stretched_angle + (mechanism.unloaded_offset or 0.0)
    if not linkage.reaches(angle):
        low, high = linkage.arc(linkage.stretched_angle)
        raise finding.cannot_build(
            "not_assemblable",
            f"with the crank at {deg(angle)} the coupler of {mm(linkage.coupler)} does not reach the slider's "
            f"path; 'mechanism.unloaded_angle' must be between {deg(low)} and {deg(high)}",
        )
    return linkage, angle
