"""The force on a slider between two oblique springs, over its way down from where all springs are relaxed.

With the slider a height h above the flat position, h = h0 in the beginning, and z = x - h0 the way beyond it,

    F = k_v (h0 + z) + 2 k_o z (1 - L0 / sqrt(a^2 + z^2)),    h0 = sqrt(L0^2 - a^2).

There the stiffness is k_v + 2 k_o (1 - L0 / a), which is zero where k_o / k_v = g / (2 (1 - g)), g = a / L0.

Assumes: linear springs, no mass, no friction, a guided slider.

Reference
---------
A. Carrella, M.J. Brennan, T.P. Waters, J. Sound Vib. 301 (2007) 678-689; its displacements and forces are relative.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cfmkit.arrays import FloatArray
from cfmkit.curves import Column, Curve
from cfmkit.families.findings import Finder, mm, newton, rate
from cfmkit.families.run_control import Run
from cfmkit.results import Finding, Result, Status, quantities
from cfmkit_oblique.spec import Mechanism, ObliqueSpec

DEFINITIONS = {
    "plateau_position": ("length", "displacement at which the oblique springs lie flat"),
    "plateau_force": ("force", "force there, carried by the vertical spring alone"),
    "plateau_stiffness": ("stiffness", "slope of the force there"),
    "stiffness_ratio": ("factor", "stiffness of one oblique spring over that of the vertical one"),
    "zero_stiffness_ratio": ("factor", "the same ratio for which the slope is zero where the oblique springs lie flat"),
    "geometry_ratio": ("ratio", "half span over free length: cosine of the oblique springs' first inclination"),
    "soft_range": ("length", "displacements around there at which the slope is below the vertical spring's stiffness"),
}
FINDINGS = {
    "stiff": "the slope where the oblique springs lie flat is above zero: the oblique springs are too soft",
    "falling": "the slope where the oblique springs lie flat is below zero: the force falls, and may snap through",
    "coils_touch": "a spring is compressed to its solid length within the travel: the curve ends there",
    "no_room": "the requested range needs a slider that starts higher above the anchors than is allowed",
}
finding = Finder(FINDINGS)

QUASI_ZERO = 0.01
"""A slope of less than this part of the vertical spring's is as good as zero: springs are not bought closer."""


@dataclass(frozen=True)
class Solution:
    """The mechanism of a specification, for all that is asked about it."""

    spec: ObliqueSpec

    @property
    def part(self) -> Mechanism:
        """What is solved."""
        return self.spec.mechanism

    @cached_property
    def height(self) -> float:
        """Of the relaxed slider above the anchors, h0 [m]."""
        return self._height_at(self.part.oblique.free_length)

    @property
    def stiffness(self) -> float:
        """Slope of the force in the flat position [N/m]."""
        excess = (self.part.oblique.free_length - self.part.half_span) / self.part.half_span
        slope = self.part.vertical.stiffness - 2.0 * self.part.oblique.stiffness * excess
        # what is left of a difference of equal numbers is rounding
        return 0.0 if abs(slope) < 1e-14 * self.part.vertical.stiffness else slope

    @property
    def zero_ratio(self) -> float:
        """The ratio of stiffnesses with which that slope is zero."""
        return 0.5 * self.part.half_span / (self.part.oblique.free_length - self.part.half_span)

    @property
    def travel(self) -> float:
        """How far the slider is to go [m]."""
        return self.spec.analysis.travel or 2.0 * self.height

    @property
    def contact(self) -> tuple[float, str]:
        """Where the slider is when the first coils touch [m], and those of what."""
        vertical = self.part.vertical.free_length - self.part.vertical.solid_length, "vertical spring"
        if self.part.oblique.solid_length <= self.part.half_span:
            return vertical
        return min(vertical, (self.height - self._height_at(self.part.oblique.solid_length), "oblique springs"))

    def _height_at(self, length: float) -> float:
        """Return the slider's height above the anchors where the oblique springs have a length [m]."""
        # not sqrt(L^2 - a^2): springs that are nearly as short as the half span would lose their digits
        return float(np.sqrt((length - self.part.half_span) * (length + self.part.half_span)))

    def oblique_length(self, x: FloatArray) -> FloatArray:
        """Return the length of an oblique spring at displacements [m]."""
        return np.hypot(self.part.half_span, x - self.height)

    def exact(self, x: FloatArray) -> FloatArray:
        """Return the force at displacements [N]."""
        push = 1.0 - self.part.oblique.free_length / self.oblique_length(x)
        return self.part.vertical.stiffness * x + 2.0 * self.part.oblique.stiffness * (x - self.height) * push

    def cubic(self, x: FloatArray) -> FloatArray:
        """Return the force at displacements to the third order about the flat position [N]."""
        z, third = x - self.height, self.part.oblique.stiffness * self.part.oblique.free_length / self.part.half_span**3
        return self.part.vertical.stiffness * self.height + self.stiffness * z + third * z**3


def resolve(spec: ObliqueSpec) -> ObliqueSpec:
    """Return the specification with its travel written out."""
    return spec.model_copy(update={"analysis": spec.analysis.model_copy(update={"travel": Solution(spec).travel})})


def analyze(force: Callable[[Solution, FloatArray], FloatArray], spec: ObliqueSpec, run: Run) -> Result:
    """Return the force over the displacement, with everything that is wrong with the mechanism."""
    solution = Solution(resolve(spec))
    place, short = solution.contact[0], solution.contact[0] < solution.travel
    x = np.linspace(0.0, min(solution.travel, place), spec.analysis.points)
    extra = {"oblique_length": Column(solution.oblique_length(x), "length")}
    warnings = tuple(_findings(solution))
    return Result(
        spec=solution.spec,
        status=Status.PARTIAL if short else Status.COMPLETE,
        message=warnings[0].message if short else "",
        curves=(Curve(x, force(solution, x), extra=extra),),
        values=quantities(DEFINITIONS, _numbers(solution)),
        warnings=warnings,
        travel=(0.0, solution.travel),
        target=spec.design.force if spec.design else None,
        reference=solution.height,
        state=solution,
    )


def _numbers(solution: Solution) -> dict[str, float]:
    part = solution.part
    # the slope is that of the vertical spring where L^3 = L0 a^2
    soft = np.sqrt(max((part.oblique.free_length * part.half_span**2) ** (2 / 3) - part.half_span**2, 0.0))
    return {
        "plateau_position": solution.height,
        "plateau_force": part.vertical.stiffness * solution.height,
        "plateau_stiffness": solution.stiffness,
        "stiffness_ratio": part.oblique.stiffness / part.vertical.stiffness,
        "zero_stiffness_ratio": solution.zero_ratio,
        "geometry_ratio": part.half_span / part.oblique.free_length,
        "soft_range": 2.0 * float(soft),
    }


def _findings(solution: Solution) -> Iterator[Finding]:
    (place, which), slope, vertical = solution.contact, solution.stiffness, solution.part.vertical.stiffness
    if place < solution.travel:
        reported = f"the coils of the {which} touch at {mm(place)}, within the travel of {mm(solution.travel)}"
        yield finding("coils_touch", reported)
    if abs(slope) > QUASI_ZERO * vertical:
        right = solution.zero_ratio * vertical
        reported = (
            f"the slope at {mm(solution.height)} is {rate(slope)}; oblique springs of {rate(right)} make it zero at "
            f"{newton(vertical * solution.height)}"
        )
        yield finding(
            "stiff" if slope > 0 else "falling", reported, f"mechanism.oblique.stiffness={right / 1e3!r} N/mm"
        )
