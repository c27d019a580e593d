"""Targets of a design for the springs, for one choice of lengths: positions, goal and allowed range."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import Infeasible
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal
from cfmkit.families.slider_crank.springs.friction import branch
from cfmkit.families.slider_crank.springs.sprung_linkage import assemble, mean_effort_per_angle
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import CrankDesign, SliderCrankSpec
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly


FREE_LENGTH_KEYS = ("crank_length", "offset", "unloaded_offset")  # lengths that a design may choose
N_PROBES = 721  # places at which the limits of the joints are looked at
N_REFINEMENTS = 3
"""Times that they are looked at, each between two neighbours of the last: a window may end where a limit is reached."""
N_WINDOW_PLACES = 1001  # places of a window over which the largest deviation is kept


@dataclass(frozen=True)
class SpringTask:
    """A design that is wanted of a mechanism with certain lengths."""

    spec: SliderCrankSpec  # with the lengths; its springs do not matter
    assembly: Assembly  # the same put together; its rates do not matter
    # (4,) springs of one leg whose friction is compensated, from the round before; None: none is
    rates: FloatArray | None = None

    @property
    def wanted(self) -> CrankDesign:
        """The block `design`."""
        design = self.spec.design
        assert design is not None
        return design

    @cached_property
    def allowed(self) -> tuple[float, float]:
        """Ends of the motion that linkage and joint limits allow around the unloaded position [rad or m]."""
        low, high = replace(self.assembly, rates=np.ones(len(JOINT_NAMES))).clip_motion(*self.assembly.reach)
        start = self.assembly.start
        if self.assembly.drive == "torque":
            low, high = max(low, start - math.pi), min(high, start + math.pi)
        else:
            low = max(low, 0.0)
        limits = self.spec.mechanism.limits
        if limits is None:
            return low, high
        most = np.array([getattr(limits, name) or math.inf for name in JOINT_NAMES])
        return self._farthest(low, most), self._farthest(high, most)

    @property
    def searched(self) -> tuple[float, float]:
        """Ends of the motion in which the widest window is looked for [rad or m]."""
        low, high = self.allowed
        within = self.wanted.within
        return (low, high) if within is None else (max(low, within[0]), min(high, within[1]))

    def _farthest(self, end: float, most: FloatArray) -> float:
        """Return the last place from the unloaded position towards an end up to which no joint is moved too far."""
        good = self.assembly.start
        for _ in range(N_REFINEMENTS):
            places = np.linspace(good, end, N_PROBES)
            turn = self.assembly.units(places).turn
            bad = np.flatnonzero(~(np.abs(turn) <= most[:, None] * (1 + 1e-12)).all(axis=0))
            if not len(bad):
                return end
            good, end = float(places[max(bad[0] - 1, 0)]), float(places[bad[0]])
        return good

    def places(self, window: tuple[float, float], count: int | None = None) -> FloatArray:
        """Return where the goal is looked at: at the `points` of the design, or on more places.

        Where the force has to begin at zero, the first of the design's intervals is left out.

        Raises Infeasible if places even in the crank's angle are wanted, and the crank turns back.
        """
        low, high = window
        points, start = self.wanted.points, self.assembly.start
        runs_in = self.assembly.drive == "force" and low <= start and self.assembly.reach[0] < -1e-15
        share = np.linspace(1.0 / points if runs_in else 0.0, 1.0, count or points + (not runs_in))
        if self.wanted.spacing == "even" or self.assembly.drive == "torque":
            return low + (high - low) * share
        angle = self.assembly.units(np.linspace(low, high, N_PROBES)).angle
        if np.ptp(np.sign(np.diff(angle))) > 0.0:
            text = "the crank turns back within the window, where the coupler is perpendicular to the guide"
            cure = "set 'design.spacing: even', or change the window"
            raise Infeasible(finding("infeasible_targets", f"{text}: {cure}", "design.spacing=even"))
        return self._travels(angle[0] + (angle[-1] - angle[0]) * share, high)

    def _travels(self, angle: FloatArray, last: float) -> FloatArray:
        """Return the travels at crank angles, of the two that each allows: those that lead up to a last one."""
        link = self.assembly.linkage
        start, position = link.place(self.assembly.unloaded), link.slider_position(angle)
        away: FloatArray = link.branch * (start - position)
        mirrored: FloatArray = link.branch * (start - (2.0 * link.crank * np.cos(angle) - position))
        return away if abs(away[-1] - last) <= abs(mirrored[-1] - last) else mirrored

    def goal(self, window: tuple[float, float], count: int | None = None) -> RateGoal | None:
        """Return the goal over a window; None if the linkage does not get there with finite efforts."""
        places = self.places(window, count)
        effort = self.assembly.units(places).effort
        if not np.isfinite(effort).all():
            return None
        legs, target = self.spec.mechanism.sets, self.wanted.size
        curve = self.wanted.curve
        followed = np.ones(len(places)) if curve is None else np.asarray(curve.evaluate(places)) / target
        goal = RateGoal(
            effort.T * (legs / target),
            followed - self._evaluate_friction(places),
            self._upper(),
            lower=self._lower(),
            least=self._least(window),
        )
        return goal if self.wanted.stiffness is None else self._sloping(goal, places)

    def _evaluate_friction(self, places: FloatArray) -> FloatArray | float:
        """Return what friction adds to the effort with the springs of the last round, over the target."""
        wanted = self.wanted.branch
        if self.rates is None or wanted is None or not self.assembly.rubbing.is_present:
            return 0.0
        rubbed = replace(self.assembly, rates=self.rates * self.spec.mechanism.sets)
        ways = {"load": (1.0,), "unload": (-1.0,), "mean": (1.0, -1.0)}[wanted]
        units = rubbed.units(places)
        free = rubbed.rates @ units.effort
        added = sum(branch(rubbed, units, direction).effort - free for direction in ways) / len(ways)
        if not np.isfinite(added).all():
            text = "friction holds the mechanism within the window: the line of force runs through its pins"
            raise finding.infeasible("self_locks", f"{text}; use thinner pins ('mechanism.pins'), or another window")
        return np.asarray(added / self.wanted.size)

    def _lower(self) -> FloatArray | None:
        """Return the smallest rates: that of the slider's spring whose anchor is to adjust the force."""
        wanted = self.wanted
        if wanted.adjustment is None or wanted.anchor_travel is None:
            return None
        least = wanted.adjustment / wanted.anchor_travel / self.spec.mechanism.sets
        return np.array([0.0, 0.0, 0.0, least])

    def _least(self, window: tuple[float, float]) -> tuple[FloatArray, float] | None:
        """Return what each rate adds to the mean force as the unloaded angle is turned all the way, and the least sum.

        It is turned in the sense in which springs at all joints raise the force.
        """
        wanted = self.wanted
        if wanted.adjustment is None or wanted.angle_travel is None:
            return None
        row = mean_effort_per_angle([self.assembly], *window)[:, 0] * (wanted.angle_travel * self.spec.mechanism.sets)
        used = np.array([name in wanted.springs for name in JOINT_NAMES])
        share = row / np.maximum(np.abs(self.assembly.forces(np.array(window))).max(axis=1), 1e-300)
        return row * (1.0 if share[used].sum() >= 0 else -1.0), wanted.adjustment

    def _sloping(self, goal: RateGoal, places: FloatArray) -> RateGoal:
        """Return a goal that is a line through the stretched position."""
        wanted, at = self.wanted, self.assembly.stretched_motion
        slope = (wanted.stiffness or 0.0) / wanted.size
        line = goal.wanted + slope * (places - at)
        if not wanted.hold_stiffness:
            return replace(goal, wanted=line)
        row = self.assembly.units(np.array([at])).stiffness[:, 0] * (self.spec.mechanism.sets / wanted.size)
        return replace(goal, wanted=line, held=(row, slope))

    def _upper(self) -> FloatArray:
        """Return the largest rates, 0 for springs that are not used."""
        most, used = self.wanted.max_rates, self.wanted.springs
        caps = [None if most is None else getattr(most, name) for name in JOINT_NAMES]
        limits = [math.inf if cap is None else cap for cap in caps]
        return np.array([limit if name in used else 0.0 for name, limit in zip(JOINT_NAMES, limits, strict=True)])

    def rotation(self, window: tuple[float, float]) -> float:
        """Return the largest rotation of a joint that may have a spring, up to the end of the window [rad]."""
        ends = min(self.assembly.start, window[0]), max(self.assembly.start, window[1])
        turn = np.abs(self.assembly.units(np.linspace(*ends, N_PROBES)).turn[:3])
        used = [k for k, name in enumerate(JOINT_NAMES[:3]) if name in self.wanted.springs]
        return float(turn[used].max()) if used else 0.0


def with_lengths(spec: SliderCrankSpec, lengths: dict[str, float]) -> SliderCrankSpec:
    """Return the spec with lengths chosen by the design written into the mechanism."""
    if not lengths:
        return spec
    written: dict[str, float | None] = dict(lengths)
    if "unloaded_offset" in lengths:
        written["unloaded_angle"] = None
    return spec.model_copy(update={"mechanism": spec.mechanism.model_copy(update=written)})


def task_of(spec: SliderCrankSpec) -> SpringTask:
    """Return the design of a specification, put together for its own drive, whatever the analysis says.

    Raises CannotBuild if the mechanism cannot exist.
    """
    design = spec.design
    assert design is not None
    return SpringTask(spec, assemble(spec, design.drive))
