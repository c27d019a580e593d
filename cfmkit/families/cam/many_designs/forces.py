"""Forces and metrics of many cams at all their samples, as arrays: (designs, points).

Each cam carries its roller along s = (x - x0)^2 / 2A with its own brace and roller; the
formulas are those of `geometry`, `statics` and `cfmkit.metrics`, in the same order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from cfmkit.families.cam.findings import overstretched
from cfmkit.families.cam.geometry.slope_law import brace_tangent, drop, rise_rate
from cfmkit.families.cam.many_designs.means_and_extremes_in_window import CutWindows, SampledBranch
from cfmkit.families.cam.model import nodes
from cfmkit.families.cam.solution import ON_CORNER
from cfmkit.families.cam.statics import levers, load_on_contact, load_on_slider, over
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.specs.units import Share

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.ranges_many import ManyBranches
    from cfmkit.specs.units import Ends


@dataclass(frozen=True)
class Designs:
    """One value of everything that decides a cam's forces for each design, (n,) each [SI]."""

    brace: FloatArray
    x0: FloatArray
    radius: FloatArray
    friction: FloatArray
    stiffness: FloatArray
    constant: FloatArray
    stroke: FloatArray
    target: FloatArray
    strongest: FloatArray  # spring of each design [N/m]

    def __len__(self) -> int:
        """Return the number of designs."""
        return len(self.brace)

    def take(self, chosen: Any) -> Designs:
        """Return some of the designs."""
        return Designs(**{name: getattr(self, name)[chosen] for name in self.__dataclass_fields__})

    @cached_property
    def end(self) -> FloatArray:
        """Path coordinate at which the stroke ends [m]."""
        return self.x0 + (2.0 * self.constant * self.stroke) ** 0.5

    @cached_property
    def curvature_radius(self) -> FloatArray:
        """Radius of curvature of the path at its start, where it is smallest [m]."""
        p = brace_tangent(self.x0, self.brace)
        length = 1.0 + p * p
        return length * length**0.5 / rise_rate(self.x0, self.constant, self.brace)

    @cached_property
    def sound(self) -> NDArray[np.bool_]:
        """Whether the closed form holds from the start of the stroke to its end."""
        return self._possible & (self.radius <= self.curvature_radius)

    @cached_property
    def undercut(self) -> NDArray[np.bool_]:
        """Whether the roller starts on a corner and may reach the end of the stroke."""
        return self._possible & (self.radius > self.curvature_radius) & (self.radius < self.brace)

    @cached_property
    def _possible(self) -> NDArray[np.bool_]:
        positive = np.ones(len(self), dtype=bool)
        for value in (self.brace, self.x0, self.radius, self.stiffness, self.constant, self.stroke, self.target):
            positive &= value > 0
        reaches = self.end < self.brace - 2e-9 * (self.brace - self.x0)
        # Rollers that overlap at the start are no mechanism (`existence`).
        fits = (self.radius <= self.brace) & (self.radius <= self.x0)
        starts = self.x0 < self.brace * (1 - 1e-5)
        return positive & reaches & fits & starts & (self.friction >= 0) & (self.friction < 1)


class Pose(NamedTuple):
    """Positions of the rollers, (designs, points) each."""

    stretch: FloatArray  # of the springs on one side [m]
    slope: FloatArray  # of the roller's path
    tangent: FloatArray  # of the brace's angle from the axis


class Begin(NamedTuple):
    """Rollers that leave a corner, (designs, 1) each: force on the way up and down [N], slope of the track, tangent.

    `there` tells which of them leave it on the travel.
    """

    up: FloatArray
    down: FloatArray
    slope: FloatArray
    tangent: FloatArray
    there: NDArray[np.bool_]


@dataclass(frozen=True)
class ForcesOfCams:
    """Force on the slider and at a contact, (designs, points) each [N], and where a lever is missing."""

    slider: FloatArray
    contact: FloatArray | None
    moves: NDArray[np.bool_]


class Slab:
    """Some sound designs at all their samples; each quantity is computed when it is first needed.

    Parameters
    ----------
    designs : Designs
        Sound ones.
    points : int
        Samples on each branch.
    contacts : bool
        Whether contact forces are wanted.
    band : float
        Half width of the force band of the usable stroke, as a fraction.
    """

    own: ClassVar[Mapping[str, Callable[[Any], FloatArray]]] = {}
    """Values of the family that are not those of `measures.SCALARS`."""

    def __init__(self, designs: Designs, points: int, contacts: bool, band: float = 0.05) -> None:
        """Remember what is asked."""
        self.designs, self.points, self.contacts, self.band = designs, points, contacts, band
        self.usable: tuple[FloatArray, FloatArray] | None = None
        self.cut_windows: dict[tuple[str, Any], CutWindows] = {}
        self.known: dict[Any, ManyBranches] = {}

    @cached_property
    def travel(self) -> FloatArray:
        """Travel of the slider [m]."""
        cams = self.designs
        at_end, at_start = (
            (cams.brace - cams.end) * (cams.brace + cams.end),
            (cams.brace - cams.x0) * (cams.brace + cams.x0),
        )
        height = (cams.end - cams.x0) ** 2 / (2.0 * cams.constant) - drop(cams.end, cams.x0, cams.brace)
        total = (height + at_end**0.5) - at_start**0.5
        return total[:, None] * (np.arange(self.points) / (self.points - 1.0))

    @cached_property
    def stretch(self) -> FloatArray:
        """x - x0 [m]."""
        return (2.0 * self.designs.constant[:, None] * self.travel) ** 0.5

    @cached_property
    def half_width(self) -> FloatArray:
        """x of the right roller's centre [m]."""
        return self.designs.x0[:, None] + self.stretch

    @cached_property
    def tangent(self) -> FloatArray:
        """Tangent of the brace's angle from the axis."""
        return brace_tangent(self.half_width, self.designs.brace[:, None])

    @cached_property
    def slope(self) -> FloatArray:
        """Slope of the path."""
        return self.stretch / self.designs.constant[:, None] + self.tangent

    @cached_property
    def up(self) -> ForcesOfCams:
        """Forces on the way up."""
        return self._forces(self.designs.friction)

    @cached_property
    def down(self) -> ForcesOfCams:
        """Forces on the way down."""
        return self._forces(-self.designs.friction) if self.designs.friction.any() else self.up

    def _forces(self, friction: FloatArray) -> ForcesOfCams:
        """Return the forces of one direction, as `statics.forces` does without weight."""
        cams, mu = self.designs, friction[:, None]
        turn, lever = levers(self.slope, self.tangent, mu)
        spring = 2.0 * cams.stiffness[:, None] * self.stretch
        slider = 2.0 * load_on_slider(turn, self.slope, mu, spring) / lever
        contact = load_on_contact(self.slope, self.tangent, spring) / lever if self.contacts else None
        # At the first sample the springs are at rest: no force, or without friction its limit, 4 K A.
        ideal = friction == 0
        limit = 4.0 * cams.stiffness * cams.constant
        slider[:, 0] = np.where(ideal, limit, 0.0)
        if contact is not None:
            contact[:, 0] = np.where(ideal, 0.5 * limit * (1.0 + self.slope[:, 0] ** 2) ** 0.5, 0.0)
        return ForcesOfCams(slider, contact, np.asarray((lever[:, 1:] > 0).all(axis=1)))

    @cached_property
    def places(self) -> FloatArray:
        """Travels at which metrics that are places look at the force, (designs, n) [m]."""
        return nodes(self.travel[:, -1], self.corner_travel)

    @cached_property
    def everywhere(self) -> tuple[FloatArray, FloatArray]:
        """Force at `places` on the way up, and on the way down [N]."""
        pose = self.pose(self.places, np.arange(len(self.designs)))
        return force_at(self.designs, pose, 1.0), force_at(self.designs, pose, -1.0)

    def exact(self, branch: str, travel: FloatArray) -> FloatArray:
        """Return the force of a branch at travels of each design, (designs, m) [N]; NaN where there is none."""
        return self.somewhere(1.0 if branch == "load" else -1.0, travel, np.arange(len(self.designs)))

    def somewhere(self, way: float | FloatArray, travel: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        """Return the force at travels of some designs, (r, m) [N]; NaN where friction holds a roller.

        Parameters
        ----------
        way : float or (r, 1) array
            1 on the way up, -1 on the way down.
        travel : (r, m) array
            [m].
        rows : (r,) array of int
            Which designs.
        """
        return force_at(self.designs.take(rows), self.pose(travel, rows), way)

    def pose(self, travel: FloatArray, rows: NDArray[np.intp]) -> Pose:
        """Return how the rollers stand at travels of some designs, (r, m) [m]."""
        cams, travel = self.designs.take(rows), np.minimum(np.maximum(travel, 0.0), self.travel[rows, -1:])
        stretch = (2.0 * cams.constant[:, None] * travel) ** 0.5
        tangent = brace_tangent(cams.x0[:, None] + stretch, cams.brace[:, None])
        return Pose(stretch, stretch / cams.constant[:, None] + tangent, tangent)

    @cached_property
    def flank(self) -> NDArray[np.bool_]:
        """Whether the roller runs on the flank, which broadcasts to (designs, points)."""
        return np.ones((1, 1), dtype=bool)

    @cached_property
    def corner_travel(self) -> FloatArray:
        """Travel at which the roller leaves the cam's corner [m]; 0 where it starts on the flank."""
        return np.zeros(len(self.designs))

    @cached_property
    def begin(self) -> Begin | None:
        """States of rollers that leave the corner; None if there is none."""
        if not self.corner_travel.any():
            return None
        rows, corner = np.arange(len(self.designs)), self.corner_travel[:, None]
        there = (corner > 0) & (corner <= self.travel[:, -1:])
        _, slope, tangent = self.pose(corner, rows)
        up, down = (self.somewhere(way, corner, rows) for way in (1.0, -1.0))
        return Begin(up, down, slope, tangent, there)

    @property
    def allowable_stress(self) -> float:
        """Allowed stress of contacts [Pa]; NaN: no limit."""
        return np.nan

    def stressed(self, _branch: str, _window: Any) -> FloatArray:
        """Return the largest stress of a branch inside a window [Pa]; NaN where there is none."""
        return np.full(len(self.designs), np.nan)

    def excess(self, _way: float) -> Callable[[FloatArray, NDArray[np.intp]], FloatArray] | None:
        """Return by what share the stress exceeds what is allowed, ``excess(travel, rows)``; None: it is not judged."""
        return None

    @property
    def held_on_corner(self) -> NDArray[np.bool_]:
        """Whether friction lets no force move the slider up somewhere on the corner."""
        return np.zeros(len(self.designs), dtype=bool)

    @cached_property
    def corner_peak(self) -> FloatArray:
        """Largest force on the way up on the corner [N]; NaN without one, and next to a jam."""
        rows, corner = np.arange(len(self.designs)), np.minimum(self.corner_travel, self.travel[:, -1])[:, None]
        if not corner.any():
            return np.full(len(rows), np.nan)
        travel = np.concatenate([np.zeros_like(corner), corner * ON_CORNER], axis=1)
        found = self.somewhere(1.0, travel, rows)
        known = np.isfinite(found)
        peak = np.full(len(rows), np.nan)
        # A start without any force does not count.
        for counts, first in ((known.all(axis=1), 0), (known[:, 1:].all(axis=1) & ~known[:, 0], 1)):
            if (some := np.flatnonzero(counts & (corner[:, 0] > 0) & ~self.held_on_corner)).size:
                exact = partial(self._on_rows, some)
                peak[some] = extremes(exact, travel[some, first:], found[some, first:], uneven=True)[0]
        return peak

    def _on_rows(self, rows: NDArray[np.intp], travel: FloatArray) -> FloatArray:
        return self.somewhere(1.0, travel, rows)

    @cached_property
    def jam_travel(self) -> FloatArray:
        """Travel at the start over which friction lets no force move the slider up [m].

        There is no leverage until s/A (1 - mu t) = mu (1 + t^2), s the stretch and t the brace's tangent.
        """
        cams, mu = self.designs, self.designs.friction
        stretch = np.zeros(len(cams))
        for _ in range(8):
            tangent = brace_tangent(cams.x0 + stretch, cams.brace)
            # Rounding at a start without any lever is not a jam, as in `statics.jams`.
            stretch = np.maximum(cams.constant * (mu * (1.0 + tangent * tangent) - 1e-12) / (1.0 - mu * tangent), 0.0)
        return np.where(mu > 0, stretch * stretch / (2.0 * cams.constant), 0.0)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Whether a force was found at every sample."""
        return self.up.moves & self.down.moves

    def warned(self, max_elongation: float | None) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yield the findings that `findings.findings_of` has of such cams, in its order: name, and which designs."""
        corner = self.corner_travel > 0
        yield from (("undercut", corner), ("contact_not_single_valued", corner), ("up_jam", self.jammed))
        if max_elongation:
            yield "spring_overstretched", overstretched(2.0 * self.stretch[:, -1], max_elongation)
        forces = (self.up, self.down) if self.designs.friction.any() else (self.up,)
        slack = [((self.stretch > 0) & (one.slider <= 0)).any(axis=1) for one in forces]
        yield "slack_cable", np.logical_or.reduce(slack)

    @property
    def jammed(self) -> NDArray[np.bool_]:
        """Whether friction lets no force move the slider up somewhere on the travel."""
        return self.jam_travel > 0

    @cached_property
    def peaks(self) -> FloatArray | None:
        """Travels next to which a force has a peak that the samples miss, (designs, k) [m]; None if it has none."""
        corner = np.minimum(self.corner_travel, self.travel[:, -1])
        return corner[:, None] * ON_CORNER if corner.any() else None

    @property
    def requested(self) -> FloatArray:
        """Travel of which windows may be shares, (d,) [m]."""
        return self.designs.stroke

    def ends(self, window: Ends | None) -> tuple[FloatArray, FloatArray] | None:
        """Return where a window starts and ends on the travel of each design, (d,) each [m]; None: all of it."""
        if window is None:
            return None
        whole = np.ones(len(self.designs))
        first, second = (float(end) * (self.requested if isinstance(end, Share) else whole) for end in window)
        return np.minimum(first, second), np.maximum(first, second)

    def inside(self, branch: str, window: Ends | None) -> CutWindows:
        """Return the forces of one branch inside a window."""
        if (branch, window) not in self.cut_windows:
            sampled = self._loading if branch == "load" else self._unloading
            self.cut_windows[branch, window] = CutWindows(sampled, self.ends(window))
        return self.cut_windows[branch, window]

    @cached_property
    def _loading(self) -> SampledBranch:
        return SampledBranch(self.travel, self.up.slider, partial(self.somewhere, 1.0), self.peaks)

    @cached_property
    def _unloading(self) -> SampledBranch:
        return SampledBranch(self.travel, self.down.slider, partial(self.somewhere, -1.0), self.peaks)


def force_at(cams: Designs, pose: Pose, way: float | FloatArray) -> FloatArray:
    """Return the force on the slider on the way up (1) or down (-1) [N]; NaN where friction holds a roller."""
    mu, (stretch, slope, tangent) = way * cams.friction[:, None], pose
    turn, lever = levers(slope, tangent, mu)
    spring = 2.0 * cams.stiffness[:, None] * np.maximum(stretch, 0.0)
    force = over(2.0 * load_on_slider(turn, slope, mu, spring), lever)
    if not mu.all():
        # A start without friction has no leverage and no load: the limit is the constant force.
        limit = (stretch == 0) & (mu == 0) & (np.abs(lever) < 1e-13)
        force = np.where(limit, 4.0 * cams.stiffness[:, None] * cams.constant[:, None], force)
    return force
