"""The force on a slider between two oblique springs, over its way down from where all springs are relaxed.

With the slider a height h above the flat position, h = h0 in the beginning, and z = x - h0 the way beyond it,

    F = k_v (h0 + z) + 2 k_o z (1 - L0 / sqrt(a^2 + z^2)),    h0 = sqrt(L0^2 - a^2).

There the stiffness is k_v + 2 k_o (1 - L0 / a), which is zero where k_o / k_v = g / (2 (1 - g)), g = a / L0.

Assumes: linear springs, no mass, no friction, a guided slider.

Reference
---------
A. Carrella, M.J. Brennan, T.P. Waters, J. Sound Vib. 301 (2007) 678-689; its displacements and forces are relative.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cfmkit.arrays import FloatArray
from cfmkit.curves import Column, Curve
from cfmkit.families.base import Run
from cfmkit.families.findings import finder, mm, newton, rate
from cfmkit.results import Finding, Quantity, Result, Status, quantities
from cfmkit_oblique.spec import ObliqueSpec

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
finding = finder(FINDINGS)

QUASI_ZERO = 0.01
"""A slope of less than this part of the vertical spring's is as good as zero: springs are not bought closer."""


@dataclass(frozen=True)
class Solution:
    """The mechanism of a specification, for all that is asked about it."""

    spec: ObliqueSpec

    @cached_property
    def height(self) -> float:
        """Of the relaxed slider above the anchors, h0 [m]."""
        part = self.spec.mechanism
        # not sqrt(L0^2 - a^2): springs that are nearly as short as the half span would lose their digits
        return float(np.sqrt((part.oblique.free_length - part.half_span) * (part.oblique.free_length + part.half_span)))

    @property
    def stiffness(self) -> float:
        """Slope of the force in the flat position [N/m]."""
        part = self.spec.mechanism
        excess = (part.oblique.free_length - part.half_span) / part.half_span
        slope = part.vertical.stiffness - 2.0 * part.oblique.stiffness * excess
        # what is left of a difference of equal numbers is rounding
        return 0.0 if abs(slope) < 1e-14 * part.vertical.stiffness else slope

    @property
    def zero_ratio(self) -> float:
        """The ratio of stiffnesses with which that slope is zero."""
        part = self.spec.mechanism
        return 0.5 * part.half_span / (part.oblique.free_length - part.half_span)

    @property
    def travel(self) -> float:
        """How far the slider is to go [m]."""
        return self.spec.analysis.travel or 2.0 * self.height

    @property
    def contact(self) -> tuple[float, str]:
        """Where the slider is when the first coils touch [m], and those of what."""
        one, other, span = self.spec.mechanism.oblique, self.spec.mechanism.vertical, self.spec.mechanism.half_span
        places = [(other.free_length - other.solid_length, "vertical spring")]
        if one.solid_length > span:
            up = float(np.sqrt((one.solid_length - span) * (one.solid_length + span)))
            places.append((self.height - up, "oblique springs"))
        return min(places)

    def oblique_length(self, x: FloatArray) -> FloatArray:
        """Return the length of an oblique spring at displacements [m]."""
        return np.hypot(self.spec.mechanism.half_span, x - self.height)

    def exact(self, x: FloatArray) -> FloatArray:
        """Return the force at displacements [N]."""
        part, z = self.spec.mechanism, x - self.height
        oblique = 2.0 * part.oblique.stiffness * z * (1.0 - part.oblique.free_length / self.oblique_length(x))
        return part.vertical.stiffness * x + oblique

    def cubic(self, x: FloatArray) -> FloatArray:
        """Return the force at displacements to the third order about the flat position [N]."""
        part, z = self.spec.mechanism, x - self.height
        third = part.oblique.stiffness * part.oblique.free_length / part.half_span**3
        return part.vertical.stiffness * self.height + self.stiffness * z + third * z**3


def resolve(spec: ObliqueSpec) -> ObliqueSpec:
    """Return the specification with its travel written out."""
    return spec.model_copy(update={"analysis": spec.analysis.model_copy(update={"travel": Solution(spec).travel})})


def analyze(spec: ObliqueSpec, run: Run) -> Result:
    """Return the force over the displacement, with everything that is wrong with the mechanism."""
    return _result(spec, Solution(spec).exact)


def analyze_cubic(spec: ObliqueSpec, run: Run) -> Result:
    """Return the same by the cubic about the flat position."""
    return _result(spec, Solution(spec).cubic)


def _result(spec: ObliqueSpec, force: Callable[[FloatArray], FloatArray]) -> Result:
    solution = Solution(resolve(spec))
    short = tuple(_touching(solution))
    x = np.linspace(0.0, min(solution.travel, solution.contact[0]), spec.analysis.points)
    extra = {"oblique_length": Column(solution.oblique_length(x), "length")}
    return Result(
        spec=solution.spec,
        status=Status.PARTIAL if short else Status.COMPLETE,
        message=short[0].message if short else "",
        curves=(Curve(x, force(x), np.full(len(x), "load"), np.ones(len(x), dtype=bool), extra),),
        values=_values(solution),
        warnings=(*short, *_slope(solution)),
        travel=(0.0, solution.travel),
        target=spec.design.force if spec.design else None,
        reference=solution.height,
        state=solution,
    )


def _values(solution: Solution) -> dict[str, Quantity]:
    part = solution.spec.mechanism
    # the slope is that of the vertical spring where L^3 = L0 a^2
    soft = np.sqrt(max((part.oblique.free_length * part.half_span**2) ** (2 / 3) - part.half_span**2, 0.0))
    numbers = {
        "plateau_position": solution.height,
        "plateau_force": part.vertical.stiffness * solution.height,
        "plateau_stiffness": solution.stiffness,
        "stiffness_ratio": part.oblique.stiffness / part.vertical.stiffness,
        "zero_stiffness_ratio": solution.zero_ratio,
        "geometry_ratio": part.half_span / part.oblique.free_length,
        "soft_range": 2.0 * float(soft),
    }
    return quantities(DEFINITIONS, numbers)


def _touching(solution: Solution) -> Iterator[Finding]:
    place, which = solution.contact
    if place < solution.travel:
        told = f"the coils of the {which} touch at {mm(place)}, within the travel of {mm(solution.travel)}"
        yield finding("coils_touch", told)


def _slope(solution: Solution) -> Iterator[Finding]:
    part, slope = solution.spec.mechanism, solution.stiffness
    if abs(slope) > QUASI_ZERO * part.vertical.stiffness:
        right = solution.zero_ratio * part.vertical.stiffness
        yield finding(
            "stiff" if slope > 0 else "falling",
            f"the slope at {mm(solution.height)} is {rate(slope)}; oblique springs of {rate(right)} make it zero at "
            f"{newton(part.vertical.stiffness * solution.height)}",
            f"mechanism.oblique.stiffness={right / 1e3!r} N/mm",
        )
