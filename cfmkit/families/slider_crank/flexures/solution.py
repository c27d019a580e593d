"""A printed slider-crank, pressed: what its values, findings and pictures need."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.elastica.verification.corotational import recheck as by_elements
from cfmkit.families.slider_crank.flexures.chain import SLIDER, STRIP
from cfmkit.families.slider_crank.flexures.pressing import Ending

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.flexures.chain import Elasticity
    from cfmkit.families.slider_crank.flexures.course import Course
    from cfmkit.families.slider_crank.flexures.pressing import Chain, Pressed

Model = Literal["lumped", "beam"]

FOLLOWED = (Ending.COMPLETE, Ending.UNSTABLE)
"""Endings of a path that has all points that were requested."""

CHECKED = 6
"""Places at which the second opinion is asked for."""


@dataclass(frozen=True)
class SecondOpinion:
    """Largest differences of force and stress by corotational elements, as shares, and how many elements."""

    force: float
    stress: float
    stable: bool
    elements: int


@dataclass(frozen=True)
class Printed:
    """A chain with its equilibria; forces of all legs together, stresses of one.

    Attributes
    ----------
    model : {"lumped", "beam"}
        Which.
    chain : Chain
        What is pressed.
    pressed : Pressed
        The outcome.
    material : Elasticity
        With the stress allowed.
    legs : int
        Equal ones on one slider.
    window : (float, float)
        Where metrics are taken [m].
    checked : bool
        Whether a second opinion was asked for.
    side : int
        To which it was to bend, as `Chain.press` takes it.
    accuracy : float
        Of the path, relative.
    """

    model: Model
    chain: Chain
    pressed: Pressed
    material: Elasticity
    legs: int
    window: tuple[float, float]
    checked: bool = False
    side: int = 0
    accuracy: float = 1e-7

    @cached_property
    def _at(self) -> Any:
        return self.pressed.path.at_asked

    @property
    def travel(self) -> FloatArray:
        """Slider travel [m]."""
        return self.pressed.travel

    @cached_property
    def force(self) -> FloatArray:
        """Force against the travel, of all legs [N]."""
        force: FloatArray = self.legs * self.pressed.force
        return force

    @cached_property
    def stable(self) -> Any:
        """Whether the equilibrium is stable while the slider is held, (n,) of bool."""
        return self.pressed.path.stable[self._at]

    @cached_property
    def _reaction(self) -> FloatArray:
        reaction: FloatArray = self.legs * self.pressed.path.reaction(SLIDER)[self._at]
        return reaction

    @property
    def side_force(self) -> FloatArray:
        """Force of the slider on its guide, across its way [N]."""
        return -self._reaction[:, 1]

    @property
    def guide_moment(self) -> FloatArray:
        """Moment of the slider on its guide [N m]."""
        return -self._reaction[:, 2]

    @cached_property
    def _peak(self) -> tuple[FloatArray, FloatArray]:
        peak = self.pressed.path.peak_stress()
        return peak.value[self._at], self._along(peak.beam[self._at], peak.place[self._at])

    @property
    def stress(self) -> FloatArray:
        """Largest stress of the part [Pa]."""
        return self._peak[0]

    @property
    def place(self) -> FloatArray:
        """Where the stress is largest: along the centre line from the clamped end [m]."""
        return self._peak[1]

    def _along(self, beams: FloatArray, shares: FloatArray) -> FloatArray:
        """Return places on beams as lengths along the chain [m]."""
        points = self.chain.points
        marks = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        names = list(self.pressed.path.layout.network.beams)
        if names == [STRIP]:
            return np.asarray(shares * marks[-1])
        first = {name: (marks[2 * k], marks[2 * k + 1]) for k, name in enumerate(names)}
        return np.array(
            [first[name][0] + u * (first[name][1] - first[name][0]) for name, u in zip(beams, shares, strict=True)]
        )

    @cached_property
    def energy(self) -> FloatArray:
        """Strain energy of all legs [J]."""
        energy: FloatArray = self.legs * self.pressed.path.energy[self._at]
        return energy

    @cached_property
    def course(self) -> Course | None:
        """Force and stress at every travel; None where the chain cannot be followed to places between its points."""
        from cfmkit.families.slider_crank.flexures.course import course

        low, high = float(self.travel[0]), float(self.travel[-1])
        return course(self._at_travels, (low, high), (float(self.force[0]), float(self.stress[0])))

    def _at_travels(self, travel: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return force [N] and stress [Pa] at other travels than those of the points; None where one is not reached."""
        found = self.chain.press(travel, self.side, self.accuracy)
        if found.ending not in FOLLOWED or len(found.travel) < len(travel):
            return None
        other = replace(self, pressed=found)
        return other.force, other.stress

    @cached_property
    def level(self) -> float:
        """Mean force in the window [N]."""
        low, high = max(self.window[0], float(self.travel[0])), min(self.window[1], float(self.travel[-1]))
        if self.course is not None and low < high:
            return self.course.mean((low, high))
        inside = (self.travel >= low) & (self.travel <= high)
        chosen = inside if inside.any() else np.ones(len(self.travel), dtype=bool)
        return float(self.force[chosen].mean())

    def first_at(self, level: float, stress: bool = False) -> float | None:
        """Return the travel at which the force [N], or the stress [Pa], first reaches a level; None if nowhere."""
        if self.course is not None:
            return self.course.first_at(level, int(stress))
        return first_at(self.travel, self.stress if stress else self.force, level)

    @cached_property
    def width_ratio(self) -> float:
        """Smallest width over thickness."""
        ratios = []
        for beam in self.pressed.path.layout.network.beams.values():
            section = beam.section
            thickest = float(
                np.max(section.thickness if isinstance(section.thickness, float) else section.thickness.values)
            )
            ratios.append(float(section.width) / thickest)
        return min(ratios)

    @cached_property
    def thinnest(self) -> float:
        """Smallest thickness [m]."""
        values = []
        for beam in self.pressed.path.layout.network.beams.values():
            given = beam.section.thickness
            values.append(float(np.min(given if isinstance(given, float) else given.values)))
        return min(values)

    @cached_property
    def recheck(self) -> SecondOpinion | None:
        """What corotational elements say; None if they were not asked."""
        if not self.checked:
            return None
        moved = np.flatnonzero(self.travel > 0.0)
        chosen = moved[np.unique(np.linspace(0, len(moved) - 1, CHECKED).astype(int))]
        found = by_elements(self.pressed.path, self._at[chosen])
        force = found.effort / self.pressed.force[chosen] - 1.0
        stress = found.stress / self.stress[chosen] - 1.0
        worst = [float(part[np.abs(part).argmax()]) for part in (force, stress)]
        return SecondOpinion(worst[0], worst[1], bool(found.stable.all()), found.elements)


def first_at(place: FloatArray, values: FloatArray, level: float) -> float | None:
    """Return where values first reach a level from below, linear between points; None where they do not."""
    above = np.flatnonzero(values >= level)
    if not len(above):
        return None
    k = int(above[0])
    if k == 0:
        return float(place[0])
    share = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(place[k - 1] + share * (place[k] - place[k - 1]))
