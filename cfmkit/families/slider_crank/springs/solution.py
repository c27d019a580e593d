"""What is known of a solved slider-crank with springs: curves, equilibria with their stability, class, constant band.

Places are found on a fine grid of its own, cut into monotonic pieces, and sharpened on the
closed form: nothing here depends on the points of the curve.

Reference
---------
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 3, 4.2 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.arrays import Several, ShortRepr
from cfmkit.families.slider_crank.springs.bistability_class import CLASSES, Classified, classify, signs
from cfmkit.families.slider_crank.springs.friction import FrictionBranch, branch
from cfmkit.families.slider_crank.springs.largest_turns_and_forces import MotionExtremes
from cfmkit.families.slider_crank.springs.sprung_linkage import reactions
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.numerics.hermite_cubic_turning_points import Monotone, monotone
from cfmkit.numerics.roots import bracketed_root
from cfmkit.results import round_off

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


GRID = 1025
"""Places of the grid. Efforts between them are cubics; classes change within 1e-9 of where they should."""

SAME = 1e-9
"""An equilibrium so near to the unloaded position, as a share of the motion, is that position."""

NEXT_TO_START = 1e-9
"""Share of the motion at which forces with friction are computed at its start: a stretched start itself is 0/0."""

EDGE = 1.0 + 1e-9
"""An effort on the edge of a band is inside it, whatever the last bits say."""


@dataclass(frozen=True)
class Equilibrium:
    """A place where nothing needs to hold the mechanism.

    Attributes
    ----------
    motion : float
        Crank angle [rad] or slider travel [m].
    stable : bool
        Whether the energy has a minimum there.
    energy : float
        [J].
    """

    motion: float
    stable: bool
    energy: float


def grid_over(assembly: Assembly, low: float, high: float) -> FloatArray:
    """Return the places of the grid over a motion, (n,) [rad or m]."""
    share = np.linspace(0.0, 1.0, GRID)
    if assembly.drive == "force":  # the force runs like the square root of the travel from the stretched place
        share = share**2
    places: FloatArray = low + (high - low) * share
    return places


@dataclass(frozen=True, repr=False)
class Character(ShortRepr):
    """What kind of mechanism it is over an interval of its motion.

    Attributes
    ----------
    assembly : Assembly
        The mechanism.
    low, high : float
        The interval [rad or m].
    tolerance : float
        Half width of a band that counts as constant.
    window : tuple of (float, float) or None
        Where the effort is wanted constant: if it is, the class is zero stiffness even without any fall.
    """

    assembly: Assembly
    low: float
    high: float
    tolerance: float
    window: tuple[float, float] | None = None

    @cached_property
    def curve(self) -> Monotone:
        """The effort on the grid and at its turning points, as one of one curves."""
        units = self.assembly.units(self.grid)
        rates = self.assembly.rates
        cut = monotone(self.grid, _summed(rates, units.effort), _summed(rates, units.stiffness))
        # The cubics say where to look; the values are those of the closed form.
        return Monotone(cut.place, _summed(rates, self.assembly.forces(cut.place[0])))

    @cached_property
    def grid(self) -> FloatArray:
        """Places of the motion, the last of them a little off the ends where an end is a pole."""
        places = grid_over(self.assembly, self.low, self.high)
        effort = self.efforts(places)
        grid: FloatArray = places[np.isfinite(effort)]
        return grid

    @cached_property
    def classified(self) -> Classified:
        """Class, drop and number of equilibria."""
        return classify(self.curve, self.assembly.start, self.tolerance, self.window, self.assembly.rest)

    @property
    def kind(self) -> int:
        """Index of the class in `CLASSES`."""
        return int(self.classified.kind[0])

    @property
    def name(self) -> str:
        """The class in words."""
        return CLASSES[self.kind]

    @property
    def drop(self) -> float:
        """Largest fall after a peak, as a fraction of the peak."""
        return float(self.classified.drop[0])

    def effort(self, motion: float) -> float:
        """Return torque [N m] or force [N] at one place."""
        return float(self.efforts(np.array([motion]))[0])

    def efforts(self, motion: FloatArray) -> FloatArray:
        """Return torque [N m] or force [N] at some places, (n,)."""
        efforts: FloatArray = _summed(self.assembly.rates, self.assembly.forces(motion))[0]
        return efforts

    def stiffness(self, motion: float) -> float:
        """Return the slope of the effort at one place [N m/rad or N/m]."""
        return float(_summed(self.assembly.rates, self.assembly.units(np.array([motion])).stiffness)[0, 0])

    def energy(self, motion: float) -> float:
        """Return the energy in the springs at one place [J]."""
        turn = self.assembly.units(np.array([motion])).turn[:, 0]
        return float(0.5 * self.assembly.rates @ turn**2)

    @cached_property
    def equilibria(self) -> tuple[Equilibrium, ...]:
        """All equilibria in the interval, in order; those at its ends and the unloaded position included."""
        return tuple(
            Equilibrium(place, stable, self.energy(place)) for place, stable in self._roots() if np.isfinite(place)
        )

    def _roots(self) -> Iterator[tuple[float, bool]]:
        place, sign = self.curve.place[0], signs(self.curve, self.assembly.rest)[0]
        known = np.flatnonzero(sign)
        if not len(known):
            return
        first, last = int(known[0]), int(known[-1])
        if first > 0:
            yield self._end(0, first), bool(sign[first] > 0)
        for k in np.flatnonzero(sign[known[:-1]] != sign[known[1:]]).tolist():
            before, after = int(known[k]), int(known[k + 1])
            yield self._between(before, after), bool(sign[after] > 0)
        if last < len(place) - 1:
            yield self._end(-1, last), bool(sign[last] < 0)

    def _end(self, end: int, inner: int) -> float:
        """Return an equilibrium at an end of the interval: the unloaded position itself where that is meant."""
        place = self.curve.place[0]
        close = abs(place[end] - self.assembly.rest) <= abs(place[end] - place[inner])
        return self.assembly.rest if close else float(place[end])

    def _between(self, before: int, after: int) -> float:
        low, high = self.curve.place[0, before], self.curve.place[0, after]
        if low <= self.assembly.rest <= high and after - before > 1:
            return self.assembly.rest
        root = bracketed_root(self.effort, float(low), float(high))
        return self.assembly.rest if abs(root - self.assembly.rest) <= SAME * (self.high - self.low) else root

    def band(self, reference: float, tolerance: float) -> tuple[float, float] | None:
        """Return the interval around a reference in which the effort is within a tolerance of that there.

        None where the effort at the reference is zero, or the reference is outside the interval.
        """
        if not self.low <= reference <= self.high:
            return None
        level = self.effort(reference)
        scale = float(np.abs(self.curve.value).max())
        if not np.isfinite(level) or abs(level) <= 1e-9 * scale:
            return None

        def excess(motion: float) -> float:
            return abs(self.effort(motion) / level - 1.0) - tolerance * EDGE

        place, outside = self.curve.place[0], np.abs(self.curve.value[0] / level - 1.0) > tolerance * EDGE
        left, right = np.flatnonzero(outside & (place < reference)), np.flatnonzero(outside & (place > reference))
        low = self._edge(excess, place[left[-1]], reference) if len(left) else float(place[0])
        high = self._edge(excess, place[right[0]], reference) if len(right) else float(place[-1])
        return low, high

    def _edge(self, excess: Callable[[float], float], outside: float, reference: float) -> float:
        """Return where the band ends between a place outside and its neighbour inside."""
        place = self.curve.place[0]
        inner = place[place > outside].min() if outside < reference else place[place < outside].max()
        inner = min(inner, reference) if outside < reference else max(inner, reference)
        return bracketed_root(excess, float(outside), float(inner))


def _summed(rates: FloatArray, unit: FloatArray) -> FloatArray:
    """Return the sum over the springs that are there, (1, n)."""
    there = rates > 0.0
    if not there.any():
        return np.zeros((1, unit.shape[1]))
    with np.errstate(invalid="ignore"):
        total: FloatArray = rates[None, there] @ unit[there]
    return total


@dataclass(frozen=True, repr=False)
class Solution(ShortRepr):
    """A solved mechanism, as the checks, the scalar values and the pictures need it.

    Attributes
    ----------
    assembly : Assembly
        The parts.
    motion : (n,) array
        Crank angle [rad] or slider travel [m], increasing.
    units : UnitCurves
        What springs of rate 1 do there.
    character : Character
        Equilibria and class over the motion.
    reference : float
        Where the constant band is taken.
    legs : int
        How many share the efforts.
    anchored : bool
        Whether the slider's spring has an anchor that can be screwed.
    """

    assembly: Assembly
    motion: FloatArray
    units: UnitCurves
    character: Character
    reference: float
    legs: int = 1
    anchored: bool = False

    @cached_property
    def energy(self) -> FloatArray:
        """Energy in all springs [J]."""
        energy: FloatArray = 0.5 * self.assembly.rates @ self.units.turn**2
        return energy

    @cached_property
    def shares(self) -> FloatArray:
        """Effort of each spring, (4, n) [N m or N]."""
        return _weighed(self.assembly.rates, self.units.effort)

    @property
    def effort_error(self) -> float:
        """Rounding of the sum of the springs' efforts [N m or N]."""
        return round_off(self.shares)

    def part_efforts(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest effort of one spring of one leg at some places of the motion [N m or N]."""
        shares = _weighed(self.assembly.rates, self.assembly.forces(np.ravel(places)))
        return np.asarray(np.abs(shares).max(axis=0).reshape(np.shape(places)) / self.legs)

    @cached_property
    def ways(self) -> tuple[FrictionBranch, FrictionBranch] | None:
        """The motion with friction, forth and back; None where nothing rubs."""
        if not self.assembly.rubbing.there:
            return None
        return branch(self.assembly, self.motion, 1.0), branch(self.assembly, self.motion, -1.0)

    @cached_property
    def effort(self) -> FloatArray:
        """Torque [N m] or force [N]."""
        effort: FloatArray = self.shares.sum(axis=0)
        return effort

    @cached_property
    def stiffness(self) -> FloatArray:
        """Derivative of the effort by the motion [N m/rad or N/m]."""
        stiffness: FloatArray = _weighed(self.assembly.rates, self.units.stiffness).sum(axis=0)
        return stiffness

    @cached_property
    def reactions(self) -> Several[FloatArray]:
        """Tension in the coupler of one leg, and force of its slider on the guide [N]."""
        drive = self.effort if self.assembly.drive == "force" else np.zeros_like(self.effort)
        coupler, guide = reactions(self.assembly, self.units, drive)
        if self.assembly.rubbing.mirrored:
            guide = np.zeros_like(guide)
        return Several((coupler / self.legs, guide / self.legs))

    @cached_property
    def extremes(self) -> MotionExtremes:
        """Largest turns and energies, and the forces inside without friction, wherever they are."""
        return MotionExtremes(self.assembly, self.character.low, self.character.high)

    @cached_property
    def reaction_extremes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Largest and smallest tension in the coupler of one leg, and of its slider's force on the guide [N].

        NaN where none is known. With friction of both ways.
        """
        if self.ways is None:
            rates = self.assembly.rates[None, :] / self.legs
            (most, least), (up, down) = self.extremes.coupler(rates), self.extremes.guide(rates)
            size = 0.0 if self.assembly.rubbing.mirrored else 1.0
            return (float(most[0]), float(least[0])), (size * float(up[0]), size * float(down[0]))
        return self._rubbed_extremes("coupler"), self._rubbed_extremes("guide")

    def _rubbed_extremes(self, part: Literal["coupler", "guide"]) -> tuple[float, float]:
        """Return extremes of both ways; NaN where friction holds the mechanism somewhere."""
        places, highs, lows = self.extremes.nodes[0].copy(), [], []
        places[0] += NEXT_TO_START * (places[-1] - places[0])
        for way in (1.0, -1.0):

            def force(at: FloatArray, way: float = way) -> FloatArray:
                values: FloatArray = getattr(branch(self.assembly, at.ravel(), way), part) / self.legs
                return values.reshape(at.shape)

            values = force(places)
            if not np.isfinite(values).all():
                return np.nan, np.nan
            high, low = extremes(force, places[None, :], values[None, :], uneven=True)
            highs.append(float(high[0]))
            lows.append(float(low[0]))
        return max(highs), min(lows)

    @cached_property
    def band(self) -> tuple[float, float] | None:
        """The interval around the reference in which the effort is constant; None where there is none."""
        return self.character.band(self.reference, self.character.tolerance)

    def nearest(self, stable: bool) -> Equilibrium | None:
        """Return the equilibrium next to the unloaded position, of one kind; None if there is none."""
        start = self.assembly.start
        others = [item for item in self.character.equilibria if item.stable is stable and item.motion != start]
        return min(others, key=lambda item: abs(item.motion - start), default=None)


@dataclass(frozen=True, repr=False)
class ClosedFormEffort(ShortRepr):
    """The effort at every place of the motion, for metrics that are places.

    Attributes
    ----------
    character : Character
        Of the mechanism over the motion.
    """

    character: Character

    @property
    def places(self) -> FloatArray:
        """Places of a fine grid, and those of the turning points [rad or m]."""
        places: FloatArray = self.character.curve.place[0]
        return places

    @property
    def peaks(self) -> FloatArray:
        """The grid: springs bend the curve on the scale of the linkage, which few points of a curve may miss."""
        return self.character.grid

    def effort(self, branch_name: str, places: FloatArray, /) -> FloatArray:
        """Return torque [N m] or force [N] at places of any shape."""
        assembly = self.character.assembly
        if assembly.rubbing.there:
            way = -1.0 if branch_name == "unload" else 1.0
            return branch(assembly, np.ravel(places), way).effort.reshape(np.shape(places))
        return self.character.efforts(np.ravel(places)).reshape(np.shape(places))

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return zeros: springs have no stress here."""
        return np.zeros(np.shape(places))


def _weighed(rates: FloatArray, unit: FloatArray) -> FloatArray:
    """Return rates times unit curves; a spring that is not there does nothing, even at a pole."""
    with np.errstate(invalid="ignore"):
        product: FloatArray = np.where(rates[:, None] == 0.0, 0.0 * np.isnan(unit), rates[:, None] * unit)
    return product
