"""Operand of a metric: one branch in its frame of reference.

Everything that several metrics need is computed once, when it is first needed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf, isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.metrics import branches, continuous_means_and_extremes
from cfmkit.metrics.branches import (
    BAND_RTOL,
    WINDOW_RTOL,
    BranchTrace,
    Undefined,
    Window,
    covers,
    restrict,
    traces,
)
from cfmkit.metrics.ranges_many import ManyBranches
from cfmkit.metrics.spread import Spread, level

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve, Kind
    from cfmkit.metrics.fatigue_and_relaxation import Durability
    from cfmkit.results import ClosedForm, WindingPath
    from cfmkit.specs.evaluable_target_curve import TargetCurve


ZERO_EFFORT_SHARE = 1e-9
"""An effort at the reference below this share of the largest is rounding: a band in per cent of it has no width."""
STATED_ERROR = 1e-12
"""Numerical error of a curve whose model states none, in parts of its largest effort: the digits of a file, sums."""


@dataclass(frozen=True)
class MeasuringFrame:
    """References that a curve is measured against."""

    target: float | None = None  # the force or torque it should have [N or N m]
    reference: float | None = None  # motion of the reference pose [m or rad]; default: the centre of the window
    allowable_stress: float | None = None  # [Pa]
    band: float = 0.05  # half width of the force band of ``usable_stroke``, as a fraction
    # intervals of the motion in which the mechanism works as intended; None: everywhere
    valid: tuple[tuple[float, float], ...] | None = None
    load_cases: tuple[Curve, ...] = ()  # whose stress counts beside the curve's own
    # the model at every place, for metrics that are places
    closed: ClosedForm | None = field(default=None, compare=False)
    # points at which windows end between those of the curve, with their stress
    ends: Curve | None = field(default=None, compare=False)
    winding: WindingPath | None = field(default=None, compare=False)  # the model of a branch whose motion turns back
    durability: Durability | None = None  # fatigue and relaxation of the material
    curve: TargetCurve | None = None  # what it should follow where it is not to be constant
    over_motion: bool = False
    """Whether means are over the motion and not over the points: those of a recording stand where its clock put them.
    """
    # numerical error of the effort [N or N m], below which there is nothing to compare with; None: not stated
    effort_error: float | None = None
    # returns the largest effort of one spring or member of a branch at places of its motion (`Result.part_efforts`)
    part_efforts: Callable[[str, FloatArray], FloatArray] | None = field(default=None, compare=False)

    def has_target(self) -> bool:
        """Return True if there is a target that is not zero within the numerical error of the effort."""
        return self.target is not None and abs(self.target) > (self.effort_error or 0.0)

    def needed_target(self) -> float:
        """Return the target, which may not be zero.

        Raises
        ------
        Undefined
            If there is none.
        """
        if self.target is None or not self.has_target():
            reported = "the target is zero" if self.target is not None else "there is no target to compare with"
            raise Undefined(f"{reported}; 'deviation_from_curve' compares with a curve" if self.curve else reported)
        return self.target

    def needed_curve(self, low: float, high: float, kind: Kind) -> TargetCurve:
        """Return the target curve, which must be known between two places [m or rad].

        Raises
        ------
        Undefined
            If there is none, or it does not cover them.
        """
        if self.curve is None:
            raise Undefined("there is no target curve to compare with: give 'design.target' or 'analysis.target'")
        if not self.curve.covers(low, high):
            raise Undefined(f"the target curve covers only {span_text(*self.curve.extent, kind)}")
        return self.curve


class Function(NamedTuple):
    """A branch as a function of the motion: increasing motion, one effort for each."""

    motion: FloatArray
    effort: FloatArray

    def interpolate(self, place: float) -> float:
        """Return the effort at a place, by linear interpolation."""
        return float(np.interp(place, self.motion, self.effort))


@dataclass(frozen=True, eq=False)
class Branch:
    """One branch of a curve, as metrics see it."""

    trace: BranchTrace  # the whole branch, in path order
    kind: Kind  # what its effort is
    frame: MeasuringFrame  # what it is measured against
    window: Window | None = None  # where it is measured; None: everywhere

    @property
    def name(self) -> str:
        """The name of the branch."""
        return self.trace.name

    @property
    def extent(self) -> tuple[float, float]:
        """Smallest and largest motion of the branch."""
        return self.trace.extent

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the window, or of the branch where there is no window."""
        return (self.window.lo, self.window.hi) if self.window else self.extent

    @property
    def ends_on_way(self) -> tuple[float, float]:
        """Ends of the window; without one, of everything: a motion that turns back may do so between two points."""
        return (self.window.lo, self.window.hi) if self.window else (-inf, inf)

    @cached_property
    def _inside(self) -> BranchTrace | str:
        part = self.part(self.window) if self.window else self.trace
        return part if isinstance(part, str) else self._require_finite(part)

    def _require_finite(self, part: BranchTrace) -> BranchTrace | str:
        """Return a part all of whose points have a finite effort."""
        if isfinite(part.effort.sum()):
            return part
        failed = len(part.effort) - int(np.isfinite(part.effort).sum())
        return f"{failed} of {len(part.effort)} points of branch {self.name!r} in the window have no known {self.kind}"

    @property
    def inside(self) -> BranchTrace:
        """The part of the branch in the window.

        Raises
        ------
        Undefined
            If the branch does not cover the window, or has points without equilibrium in it.
        """
        if isinstance(self._inside, str):
            raise Undefined(self._inside)
        return self._inside

    def part(self, window: Window) -> BranchTrace | str:
        """Return the part of the branch in some window, or why there is none."""
        if covers(self.extent, window):
            return self._evaluate_ends(restrict(self.trace, window))
        return f"branch {self.name!r} covers only {self.span(*self.extent)}"

    def _evaluate_ends(self, part: BranchTrace) -> BranchTrace:
        """Return a part whose ends, where they lie between two samples, have effort and stress of the model."""
        model, motion = self.frame.closed, self.trace.motion
        if part is self.trace:
            return part
        if model is None:
            return self._apply_stated_ends(part)
        ends = [end for end in (0, -1) if not (motion == part.motion[end]).any()]
        if not ends:
            return part
        effort = part.effort.copy()
        effort[ends] = model.effort(self.name, part.motion[ends])

        def replace_ends(stress: FloatArray) -> FloatArray:
            stress = stress.copy()
            stress[ends] = model.stress(self.name, part.motion[ends])
            return stress

        return replace(part, effort=effort, read_stress=part.changed_stress(replace_ends))

    def _apply_stated_ends(self, part: BranchTrace) -> BranchTrace:
        """Return a part whose ends have effort and stress of the points that the model has there, if it has some."""
        stated = self.frame.ends
        if stated is None:
            return part
        effort, known = part.effort.copy(), dict[int, int]()
        slack = WINDOW_RTOL * (part.extent[1] - part.extent[0])
        for end in (0, -1):
            at_end = np.flatnonzero((np.abs(stated.motion - part.motion[end]) <= slack) & (stated.branch == self.name))
            if len(at_end) == 1 and not (self.trace.motion == part.motion[end]).any():
                known[end] = int(at_end[0])
        effort[list(known)] = stated.effort[list(known.values())]

        def replace_ends(stress: FloatArray) -> FloatArray:
            if "max_stress" in stated.extra:
                stress = stress.copy()
                stress[list(known)] = stated.extra["max_stress"].values[list(known.values())]
            return stress

        return replace(part, effort=effort, read_stress=part.changed_stress(replace_ends))

    @cached_property
    def beside(self) -> tuple[BranchTrace, ...]:
        """The same branch in the other load cases."""
        return tuple(trace for curve in self.frame.load_cases for trace in traces(curve) if trace.name == self.name)

    @property
    def inside_beside(self) -> tuple[BranchTrace, ...]:
        """Parts in the window of the other load cases, as far as each of them goes."""
        if self.window is None:
            return self.beside
        clipped = (
            (trace, max(trace.extent[0], self.window.lo), min(trace.extent[1], self.window.hi)) for trace in self.beside
        )
        return tuple(restrict(one, Window(low, high)) for one, low, high in clipped if low < high)

    @property
    def _extremes(self) -> tuple[float, float]:
        """Largest and smallest effort in the window: of its points, or of the model next to them."""
        model, path, part = self.frame.closed, self.frame.winding, self.inside
        if path is not None:
            return branches.extremes(path, *self.ends_on_way)
        if model is None:
            return float(part.effort.max()), float(part.effort.min())
        return self._next_to_samples(partial(model.effort, self.name), part.effort, model.peaks)

    def _next_to_samples(
        self, function: Callable[[FloatArray], FloatArray], values: FloatArray, peaks: FloatArray
    ) -> tuple[float, float]:
        """Return the largest and the smallest value of a function of the motion in the window, from its samples on."""
        motion, (low, high) = self.inside.motion, self.ends
        between = (peaks > low) & (peaks < high)
        if between.any():
            heights = function(peaks)
            motion, values = (
                np.concatenate([values_here, more[between]])
                for values_here, more in ((motion, peaks), (values, heights))
            )
            motion, chosen = np.unique(motion, return_index=True)
            motion, values = motion[np.isfinite(values[chosen])], values[chosen][np.isfinite(values[chosen])]
        uneven = bool(between.any()) and len(peaks) < continuous_means_and_extremes.FEW_SAMPLES
        top, bottom = continuous_means_and_extremes.extremes(function, motion[None, :], values[None, :], uneven)
        return float(top[0]), float(bottom[0])

    @cached_property
    def spread(self) -> Spread:
        """Mean and extremes in the window."""
        effort = self.inside.effort
        mean = self.mean_over_motion(effort) if self.frame.over_motion else float(effort.sum()) / len(effort)
        return Spread.from_extremes(mean, *self._extremes, self.error)

    def mean_over_motion(self, values: FloatArray) -> float:
        """Return the mean of values at the points in the window over the motion, by trapezoids."""
        motion = self.inside.motion
        width = float(motion[-1] - motion[0])
        return float(np.trapezoid(values, motion)) / width if width else float(values.mean())

    @cached_property
    def error(self) -> float:
        """Numerical error of the effort [N or N m]."""
        if self.frame.effort_error is not None:
            return self.frame.effort_error
        sizes = np.abs(self.trace.effort)
        return STATED_ERROR * float(sizes.max(initial=0.0, where=np.isfinite(sizes)))

    @property
    def vanishes(self) -> str:
        """Why a share of this effort has no value: it is zero within its numerical error, or changes its sign."""
        if max(map(abs, self._extremes)) > self.error:
            return f"the {self.kind} changes sign or is zero"
        balancer = "; 'static_balance' judges a balancer" if self.frame.part_efforts else ""
        return f"the {self.kind} is zero within its numerical error, {self.error_text}{balancer}"

    @property
    def error_text(self) -> str:
        """The numerical error of the effort with its unit."""
        from cfmkit.specs.units import format_short

        return format_short(self.error, self.kind, 2)

    @property
    def largest_part(self) -> float:
        """Largest effort of one spring or member in the window [N or N m].

        Raises
        ------
        Undefined
            If the model does not know them, or the branch does not cover the window.
        """
        if self.frame.part_efforts is None:
            raise Undefined("the model does not tell what single springs and members do")
        function, model = partial(self.frame.part_efforts, self.name), self.frame.closed
        sizes = function(self.inside.motion)
        if model is None or not np.isfinite(sizes).all():
            return float(sizes.max(initial=0.0, where=np.isfinite(sizes)))
        return self._next_to_samples(function, sizes, model.peaks)[0]

    @cached_property
    def level(self) -> float:
        """Mean effort in the window: over its points, or over the way where the model gives it at every place."""
        model, path = self.frame.closed, self.frame.winding
        self.inside  # noqa: B018  (raises where the window is not covered)
        if path is not None:
            return branches.mean(path, *self.ends_on_way)
        if model is None:
            return float(level(self.spread))
        return continuous_means_and_extremes.mean(partial(model.effort, self.name), model.places, *self.ends)

    @cached_property
    def function(self) -> Function:
        """The whole branch as a function of the motion.

        Raises
        ------
        Undefined
            If it folds back: a many-valued branch is never sorted.
        """
        direction = self.trace.way
        if not direction:
            raise Undefined(f"branch {self.name!r} turns back: its {self.kind} is many-valued")
        return Function(self.trace.motion[::direction], self.trace.effort[::direction])

    @property
    def effort_at_reference(self) -> float:
        """Effort at the reference pose [N or N m].

        Raises
        ------
        Undefined
            If the branch does not reach the reference pose, is many-valued, or has no effort there.
        """
        place, model = self.reference, self.frame.closed
        effort = self.evaluate(place)
        if model is not None:  # an interpolated value may hide that there is no effort
            effort = float(model.effort(self.name, np.array([place]))[0])
        if abs(effort) <= max(self.error, ZERO_EFFORT_SHARE * float(np.nanmax(np.abs(self.function.effort)))):
            raise Undefined(f"the {self.kind} at the reference pose is zero within its numerical error")
        return effort

    @cached_property
    def many(self) -> ManyBranches:
        """The branch as one row, over the window's ends: at every place where the model gives that, else as sampled.

        Raises
        ------
        Undefined
            If it is sampled and folds back.
        """
        if self.closed is not None:
            return self.closed
        motion, effort = self.function
        low, high, pose = (np.array([place]) for place in (*self.ends, self.reference))
        return ManyBranches(motion[None, :], effort[None, :], low, high, pose=pose)

    @cached_property
    def closed(self) -> ManyBranches | None:
        """The branch at every place, where the model gives that: one row, over the window's ends."""
        model = self.frame.closed
        if model is None:
            return None
        places, (low, high) = model.places[None, :], self.ends

        def exact(at: FloatArray, _rows: object = None) -> FloatArray:
            return model.effort(self.name, at)

        excess = None
        if (allowed := self.frame.allowable_stress) is not None:

            def excess(at: FloatArray, _rows: object) -> FloatArray:
                return np.asarray(model.stress(self.name, at) / allowed - (1 + BAND_RTOL))

        ends, pose = (np.array([low]), np.array([high])), np.array([self.reference])
        return ManyBranches(places, exact(places), *ends, exact, excess, pose)

    @property
    def reference(self) -> float:
        """Motion of the reference pose."""
        lo, hi = self.ends
        return (lo + hi) / 2 if self.frame.reference is None else self.frame.reference

    def evaluate(self, place: float) -> float:
        """Return the effort at one place of the branch.

        Raises
        ------
        Undefined
            If the branch does not get there, or is many-valued.
        """
        lo, hi = self.extent
        slack = 1e-9 * (hi - lo)
        if not lo - slack <= place <= hi + slack:
            raise Undefined(f"branch {self.name!r} covers only {self.span(lo, hi)}")
        return self.function.interpolate(place)

    def span(self, lo: float, hi: float) -> str:
        """Return ``2 ... 240 mm`` for messages."""
        return span_text(lo, hi, self.kind)


def span_text(lo: float, hi: float, kind: Kind) -> str:
    """Return an interval of the motion as text in border units, rounded to six digits."""
    from cfmkit.specs.units import border_unit, to_border

    dimension = "length" if kind == "force" else "angle"
    return f"{float(to_border(lo, dimension)):.6g} ... {float(to_border(hi, dimension)):.6g} {border_unit(dimension)}"
