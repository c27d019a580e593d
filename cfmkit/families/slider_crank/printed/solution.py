"""Solution of a printed slider-crank that is pressed, and its force and stress at every travel as polynomials.

A nearly straight chain buckles within a thousandth of its travel: over the logarithm of the travel its force is a row
of Chebyshev polynomials, each on its panel. A panel whose polynomial has not converged is halved, and the chain
is pressed again at the nodes of the halves. Below the first node the force is proportional to the travel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.elastica.results.member_efforts import effort_error
from cfmkit.families.end_stops import NO_STOPS
from cfmkit.families.slider_crank.printed.equilibrium_path import ANALYSIS_TOLERANCE, PressingEnd
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import SLIDER_NODE, STRIP_BEAM, taper_of
from cfmkit.metrics.continuous_means_and_extremes import mean
from cfmkit.numerics.interpolation import nodes_of, resolve_panels
from cfmkit.numerics.roots import bracketed_root

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.end_stops import EndStops
    from cfmkit.families.slider_crank.printed.equilibrium_path import Chain, PressedChain
    from cfmkit.families.slider_crank.printed.flexures_as_beam_network import Elasticity
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.numerics.interpolation import ChebyshevPanels


FIRST_NODE_SHARE = 1e-6
"""Share of the travel at which the first node stands: the force there is about a thousandth of its level."""
INITIAL_PANEL_WIDTH = 1.5
"""Width of a panel at first, in the logarithm of the travel: a path that has no corner is resolved at once."""
COEFFICIENT_RTOL = (1e-8, 1e-7)
"""Size of the last coefficients, relative to the largest, at which force and stress have converged: the force of a good
chain changes by a hundredth over its travel, and a place on it is to be right to a millionth of that."""
MAX_HALVINGS = 12
"""At most so many: the stress has a kink where its place jumps, and a chain without a kink has a sharp corner."""


@dataclass(frozen=True, eq=False, repr=False)
class ChainCurve(ShortRepr):
    """Force and stress of a chain at every travel (a `cfmkit.results.ClosedForm`)."""

    ends: tuple[float, float]  # of the curve [m]
    first: tuple[float, float]  # force [N] and stress [Pa] where it begins
    # force [N], of all legs, and stress [Pa] over the logarithm of the travel [m]
    laws: tuple[ChebyshevPanels, ChebyshevPanels]
    stops: EndStops = NO_STOPS  # of the slider: their forces are no part of the laws

    @cached_property
    def places(self) -> FloatArray:
        """Increasing travels: the nodes, and the ends of their panels [m]."""
        borders = self.laws[0].ends
        nodes = [nodes_of(ends) for ends in pairwise(borders.tolist())]
        places = np.exp(np.sort(np.concatenate([borders, *nodes])))
        places = np.union1d(places, self.stops.marks[self.stops.marks > 0]) if self.stops else places
        low, high = self.ends
        return np.concatenate([[low], places[(places > low) & (places < high)], [high]])

    @property
    def peaks(self) -> FloatArray:
        """All places: a chain without a kink has its peak before the second point of a curve [m]."""
        return self.places

    def effort(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the force of all legs at travels of any shape [N]."""
        return self._evaluate(places, 0)

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of a leg at travels of any shape [Pa]."""
        return self._evaluate(places, 1)

    def _evaluate(self, places: FloatArray, which: int) -> FloatArray:
        law, first = self.laws[which], self.first[which]
        nearest = float(np.exp(law.ends[0]))
        size = np.clip(np.ravel(places), *self.ends)
        evaluated = law.evaluate(np.clip(np.log(np.maximum(size, nearest)), law.ends[0], law.ends[-1]))
        share = np.minimum(size / nearest, 1.0)
        values = np.where(size < nearest, first + (evaluated - first) * share, evaluated)
        if self.stops and which == 0:
            values = values + self.stops.force(size)
        return np.asarray(values.reshape(np.shape(places)))

    def mean(self, window: tuple[float, float]) -> float:
        """Return the mean force in a window of the travel [N]."""
        return mean(lambda places: self._evaluate(places, 0), self.places, *window)

    def first_at(self, level: float, which: int = 0) -> float | None:
        """Return the travel at which the force [N], or the stress [Pa] (1), first reaches a level; None if nowhere."""
        places = self.places
        above = np.flatnonzero(self._evaluate(places, which) >= level)
        if not len(above) or above[0] == 0:
            return float(places[0]) if len(above) else None

        def measure_error(travel: float) -> float:
            return float(self._evaluate(np.array([travel]), which)[0]) - level

        return bracketed_root(measure_error, float(places[above[0] - 1]), float(places[above[0]]))


def course(
    # force [N] and stress [Pa] at increasing travels [m]; None if one of them is not reached
    pressed: Callable[[FloatArray], tuple[FloatArray, FloatArray] | None],
    ends: tuple[float, float],  # of the curve [m]
    first: tuple[float, float],  # force and stress where it begins
) -> ChainCurve | None:
    """Return the course between two travels; None if the chain cannot be pressed to every node."""
    low, high = np.log(max(ends[0], FIRST_NODE_SHARE * ends[1])), np.log(ends[1])

    def values(places: FloatArray) -> FloatArray:
        values_there = pressed(np.exp(places))
        return np.full((2, len(places)), np.nan) if values_there is None else np.array(values_there)

    borders = np.linspace(low, high, int(np.ceil((high - low) / INITIAL_PANEL_WIDTH)) + 1)
    force, stress = resolve_panels(values, borders, COEFFICIENT_RTOL, MAX_HALVINGS)
    whole = np.isfinite(force.coefficients).all() and np.isfinite(stress.coefficients).all()
    return ChainCurve(ends, first, (force, stress)) if whole else None


COMPLETE_ENDINGS = (PressingEnd.COMPLETE, PressingEnd.UNSTABLE)
"""Endings of a path that has all points that were requested."""


@dataclass(frozen=True, repr=False)
class Solution(ShortRepr):
    """A chain with its equilibria; forces of all legs together, stresses of one."""

    chain: Chain  # what is pressed
    pressed: PressedChain  # the outcome
    material: Elasticity  # with the stress allowed
    legs: int  # equal ones on one slider
    window: tuple[float, float]  # where metrics are taken [m]
    side: int = 0  # to which it was to bend, as `Chain.press` takes it
    mirrored: bool = False  # whether a mirrored pair keeps the guide free of load
    spec: SliderCrankSpec | None = None  # None in a search, which has no findings

    @cached_property
    def _at(self) -> Any:
        return self.pressed.path.at_requested

    @property
    def travel(self) -> FloatArray:
        """Slider travel [m]."""
        return self.pressed.travel

    @cached_property
    def force(self) -> FloatArray:
        """Force against the travel, of all legs and the stops [N]."""
        return self.leg_force + self.stops.force(self.travel) if self.stops else self.leg_force

    @cached_property
    def leg_force(self) -> FloatArray:
        """Force against the travel, of all legs [N]."""
        force: FloatArray = self.legs * self.pressed.force
        return force

    @property
    def stops(self) -> EndStops:
        """Stops of the slider."""
        return NO_STOPS if self.spec is None else self.spec.mechanism.end_stops

    @property
    def effort_error(self) -> float:
        """Numerical error of the force of all legs [N]."""
        return self.legs * effort_error(self.pressed.path, ANALYSIS_TOLERANCE)

    @cached_property
    def stable(self) -> Any:
        """Whether the equilibrium is stable while the slider is held, (n,) of bool."""
        return self.pressed.path.stable[self._at]

    @cached_property
    def _slider_reaction(self) -> FloatArray:
        reaction: FloatArray = self.legs * self.pressed.path.reaction(SLIDER_NODE)[self._at]
        return reaction

    @property
    def side_force(self) -> FloatArray:
        """Force of the slider on its guide, across its way [N]."""
        return np.zeros(len(self.travel)) if self.mirrored else -self._slider_reaction[:, 1]

    @property
    def guide_moment(self) -> FloatArray:
        """Moment of the slider on its guide [N m]."""
        return np.zeros(len(self.travel)) if self.mirrored else -self._slider_reaction[:, 2]

    @cached_property
    def _peak_stress(self) -> tuple[FloatArray, FloatArray]:
        peak = self.pressed.path.peak_stress()
        return peak.value[self._at], self._locate_along_chain(peak.beam[self._at], peak.place[self._at])

    @property
    def stress(self) -> FloatArray:
        """Largest stress of the part [Pa]."""
        return self._peak_stress[0]

    @property
    def place(self) -> FloatArray:
        """Place of the largest stress: along the centre line from the clamped end [m]."""
        return self._peak_stress[1]

    def _locate_along_chain(self, beams: FloatArray, shares: FloatArray) -> FloatArray:
        """Return places on beams as lengths along the chain [m]."""
        points = self.chain.points
        marks = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        names = list(self.pressed.path.network.beams)
        if names == [STRIP_BEAM]:
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
    def course(self) -> ChainCurve | None:
        """Force and stress at every travel; None if the chain cannot be followed to places between its points."""
        low, high = float(self.travel[0]), float(self.travel[-1])
        pressed_course = course(self._solve_travels, (low, high), (float(self.leg_force[0]), float(self.stress[0])))
        return None if pressed_course is None else replace(pressed_course, stops=self.stops)

    def _solve_travels(self, travel: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return force [N] and stress [Pa] at other travels than those of the points; None if one is not reached."""
        pressed = self.chain.press(travel, self.side)
        if pressed.ending not in COMPLETE_ENDINGS or len(pressed.travel) < len(travel):
            return None
        solved = replace(self, pressed=pressed)
        return solved.leg_force, solved.stress

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

    def run_in(self, share: float) -> float | None:
        """Return the travel at which the force first reaches a share of its mean [m]; None if nowhere."""
        return self.first_at(share * self.level)

    @cached_property
    def width_ratio(self) -> float:
        """Smallest width over thickness."""
        sections = [beam.section for beam in self.pressed.path.network.beams.values()]
        return min(float(section.width / taper_of(section).values.max()) for section in sections)

    @cached_property
    def thinnest(self) -> float:
        """Smallest thickness [m]."""
        return min(beam.section.thinnest for beam in self.pressed.path.network.beams.values())


def first_at(place: FloatArray, values: FloatArray, level: float) -> float | None:
    """Return where values first reach a level from below, linear between points; None if they do not."""
    above = np.flatnonzero(values >= level)
    if not len(above):
        return None
    k = int(above[0])
    if k == 0:
        return float(place[0])
    share = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(place[k - 1] + share * (place[k] - place[k - 1]))
