"""Analysis: the force of leaves and spring over the shuttle's travel, for each preload.

F(x) = F_b(x) + F_p(x + dr), x from the as-made pose, dr the preload of the spring's far end. Each curve begins where
the shuttle rests under its preload: pulled back by it, with the leaves in tension. Where the leaves are flat they
carry nothing and the spring alone decides: F = K_p (h + dr), whatever their number, width or modulus.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.curves import Column, Curve
from cfmkit.families.vcfm.checks import findings_of, spring_closed
from cfmkit.families.vcfm.parts import parts, spring_room
from cfmkit.families.vcfm.places import Places
from cfmkit.families.vcfm.samples import LawSampler
from cfmkit.families.vcfm.tables import adjustability, readings
from cfmkit.families.vcfm.values import values_of
from cfmkit.families.vcfm.windows import extreme, flat_window
from cfmkit.metrics.ends import last_places
from cfmkit.numerics.roots import bracketed_root
from cfmkit.results import Result, Status
from cfmkit.specs.units import between

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Run
    from cfmkit.families.vcfm.parts import Parts
    from cfmkit.families.vcfm.samples import Character, Sampler, Samples
    from cfmkit.families.vcfm.spec import VcfmSpec


LEAST = 5
"""Points below which there is no curve to speak of."""


@dataclass(frozen=True)
class Push:
    """One curve: the mechanism at one preload.

    Attributes
    ----------
    preload : float
        Of the spring's far end [m].
    travel : (n,) array
        Of the shuttle from the as-made pose, increasing [m].
    leaves : Samples
        All leaves.
    spring_force, spring_stress : (n,) array
        Of the spring [N, Pa].
    rest : float or None
        Where the shuttle rests [m]; None where nothing holds it short of the end.
    """

    preload: float
    travel: FloatArray
    leaves: Samples
    spring_force: FloatArray
    spring_stress: FloatArray
    rest: float | None

    @cached_property
    def force(self) -> FloatArray:
        """Force on the shuttle [N]."""
        total: FloatArray = np.add(self.leaves.force, self.spring_force)
        return total

    def inside(self, window: tuple[float, float]) -> FloatArray:
        """Return the forces at the samples in a window, its interpolated ends included [N]."""
        low, high = window
        own = self.force[(self.travel > low) & (self.travel < high)]
        ends = np.interp([low, high], self.travel, self.force, left=np.nan, right=np.nan)
        found = np.concatenate([ends[:1], own, ends[1:]])
        known: FloatArray = found[np.isfinite(found)]
        return known


@dataclass(frozen=True)
class Solution:
    """A solved mechanism: its parts, the model used, what characterises it, and one curve a preload."""

    spec: VcfmSpec
    parts: Parts
    sampler: Sampler
    character: Character
    pushes: tuple[Push, ...]

    @property
    def nominal(self) -> Push:
        """The curve of the first preload."""
        return self.pushes[0]

    @cached_property
    def constant_force(self) -> float | None:
        """Force of the spring at the nominal preload where the leaves carry nothing [N]; None if they do carry there.

        Leaves that do not buckle push where they are flat, and so do hybrid ones; a straight beam as the spring has no
        constant stiffness. Then no single number stands for the curve.
        """
        kinds = self.spec.mechanism.positive.structure, self.spec.mechanism.bistable.structure
        place = np.array([self.parts.balance])
        force = float(self.sampler.spring(place + self.nominal.preload)[0][0])
        # leaves with a stated waviness carry a little there, which no flatness tells
        bears = abs(float(self.sampler.leaf_force(place)[0])) > self.spec.analysis.flatness * abs(force) and not (
            np.isfinite(self.character.linear[0]) and kinds[1] != "hybrid"
        )
        return None if bears or kinds[0] == "straight" else force

    @cached_property
    def windows(self) -> tuple[tuple[float, float] | None, ...]:
        """Constant-force window of each curve [m]; None where the force is nowhere positive."""
        return self._flat(self.pushes, self.spec.analysis.flatness)

    def flat_part(self, push: Push, flatness: float) -> tuple[float, float] | None:
        """Return the longest stretch of a curve on which (max - min)/max of the force is within `flatness` [m]."""
        return self._flat((push,), flatness)[0]

    def _flat(self, pushes: tuple[Push, ...], flatness: float) -> tuple[tuple[float, float] | None, ...]:
        """Return `flat_part` of some curves: all together, because calls of the model are what takes the time."""
        most, preload = max(len(push.travel) for push in pushes), np.array([[push.preload] for push in pushes])
        travel = np.stack([np.pad(push.travel, (0, most - len(push.travel)), "edge") for push in pushes])
        force = np.full(travel.shape, np.nan)
        for row, push in zip(force, pushes, strict=True):
            row[: len(push.force)] = push.force

        def force_at(places: FloatArray) -> FloatArray:
            shuttle = self.sampler.leaf_force(places.ravel())
            spring = self.sampler.spring((places + preload).ravel())[0]
            return np.asarray((shuttle + spring).reshape(places.shape))

        ends = zip(*flat_window(travel, force, flatness, force_at), strict=True)
        return tuple((float(low), float(high)) if np.isfinite(low) else None for low, high in ends)

    @cached_property
    def least(self) -> tuple[float, float] | None:
        """Where and how small the nominal force becomes past the peak of the leaves [m, N]; None without one."""
        push, sampler = self.nominal, self.sampler
        falls = np.flatnonzero((np.diff(push.leaves.force) < 0) & (push.travel[:-1] >= 0))
        if not len(falls):
            return None
        step, end = float(push.travel[-1] - push.travel[-2]), float(push.travel[-1])
        # thin leaves have their peak between the first two points: it is looked for, not taken from them
        peak = extreme(sampler.leaf_force, float(push.travel[falls[0]]), step, (max(float(push.travel[0]), 0.0), end))
        beyond = np.flatnonzero(push.travel >= peak)
        lowest = float(push.travel[beyond[push.force[beyond].argmin()]]) if len(beyond) else peak
        place = extreme(lambda travel: -force_of(sampler, travel, push.preload), max(lowest, peak), step, (peak, end))
        return place, float(force_of(sampler, np.array([place]), push.preload)[0])

    def largest_stress(self, push: Push, end: float = np.inf) -> tuple[float, float]:
        """Return the largest stress of leaves and spring of a curve up to a travel [m], that one included, in Pa."""
        before = push.travel <= end
        leaves, spring = push.leaves.stress[before], push.spring_stress[before]
        if push.travel[0] < end < push.travel[-1]:
            place = np.array([end])
            leaves = np.append(leaves, self.sampler.leaves(place).stress)
            spring = np.append(spring, self.sampler.spring(place + push.preload)[1])
        return float(leaves.max(initial=0.0)), float(spring.max(initial=0.0))

    @property
    def window_force(self) -> float | None:
        """Mean of the nominal force over its constant-force window [N]; None where there is none."""
        if self.windows[0] is None or not self.windows[0][1] > self.windows[0][0]:
            return None
        places = np.linspace(*self.windows[0], 401)
        force = force_of(self.sampler, places, self.nominal.preload)
        return float(np.trapezoid(force, places) / (places[-1] - places[0]))

    @property
    def course(self) -> tuple[float, float]:
        """Where the shuttle starts from at the nominal preload, and where it was to go [m]."""
        return float(self.nominal.travel[0]), self.spec.travel

    @property
    def window(self) -> tuple[float, float]:
        """Where forces are compared [m]: the analysis' window, else the linear range, else the longest flat stretch."""
        if self.spec.analysis.window is not None:
            return between(self.spec.analysis.window, self.course)
        low, high = self.character.linear
        if self.is_linear:
            return low, min(high, self.spec.travel)
        return self.windows[0] or (0.0, self.spec.travel)

    @property
    def is_linear(self) -> bool:
        """Whether the leaves buckle within the travel, and so have a range of constant negative stiffness."""
        low = self.character.linear[0]
        return bool(np.isfinite(low) and low < self.spec.travel)

    @property
    def window_is_flat(self) -> bool:
        """Whether `window` is the longest flat stretch itself: flat by what it is, whatever the last digit says."""
        return self.spec.analysis.window is None and not self.is_linear and self.windows[0] is not None


def analyze(spec: VcfmSpec, run: Run) -> Result:
    """Return the force-displacement curves of a mechanism by closed forms, with everything that is wrong with it.

    Parameters
    ----------
    spec : VcfmSpec
        The mechanism.
    run : Run
        Not needed here: nothing is random.

    Returns
    -------
    Result
        One curve a preload, the nominal one first. PARTIAL if the spring closes within the travel.
    """
    made = parts(spec)
    return result_of(solve(spec, made, LawSampler(made)))


def result_of(solution: Solution) -> Result:
    """Return the curves of a solved mechanism, with everything that is wrong with it.

    PARTIAL if the spring closes within the travel, or a beam cannot be followed to its end.
    """
    spec = solution.spec
    if len(solution.nominal.travel) < LEAST:
        closed = tuple(spring_closed(solution))
        return Result(spec, Status.NO_EQUILIBRIUM, _shortfall(solution), warnings=closed)
    short = solution.nominal.travel[-1] < spec.travel * (1 - 1e-9) or bool(_shortfall(solution))
    status = Status.PARTIAL if short else Status.COMPLETE
    curves = tuple(_curve(push) for push in solution.pushes)
    return Result(
        spec=_as_run(spec),
        status=status,
        message=_shortfall(solution) if short else "",
        curves=curves,
        values=values_of(solution),
        warnings=findings_of(solution),
        travel=solution.course,
        valid=_valid(solution),
        target=spec.design.force if spec.design else None,
        allowable_stress=spec.mechanism.allowable_stress,
        load_cases=curves[1:],
        closed=Places(solution),
        tables={"adjustability": partial(adjustability, solution), "readings": partial(readings, solution)},
        state=solution,
    )


def _shortfall(solution: Solution) -> str:
    """Return why a curve ends before the travel does; empty if none does."""
    if solution.sampler.problem:
        return solution.sampler.problem
    return next((found.message for found in spring_closed(solution)), "")


def travel_grid(spec: VcfmSpec) -> FloatArray:
    """Return the travels of a curve that starts at the as-made pose [m]."""
    return np.asarray(spec.travel * (np.arange(spec.analysis.points) / (spec.analysis.points - 1.0)))


def solve(spec: VcfmSpec, made: Parts, sampler: Sampler) -> Solution:
    """Return the curves at all preloads by a model of leaves and spring."""
    grid = travel_grid(spec)
    room, rests = spring_room(spec), rests_of(sampler, spec.analysis.preloads, grid)
    poses = zip(spec.analysis.preloads, rests, strict=True)
    nominal, *others = (_push(sampler, pose, grid, room) for pose in poses)
    # a preload at which the spring cannot be followed, or is closed, has no curve; a message says so
    pushes = (nominal, *(push for push in others if len(push.travel) >= LEAST))
    return Solution(spec, made, sampler, sampler.character, pushes)


def force_of(sampler: Sampler, travel: FloatArray, preload: float) -> FloatArray:
    """Return the force on the shuttle at some travels and a preload [N]."""
    return np.asarray(sampler.leaf_force(travel) + sampler.spring(travel + preload)[0])


def rests_of(sampler: Sampler, preloads: Sequence[float], grid: FloatArray) -> tuple[float | None, ...]:
    """Return where the shuttle rests at each preload [m]: the first place without force, from the as-made pose on.

    None where there is none, or where the spring could not be followed so far.
    """
    found: dict[float, float | None] = {preload: 0.0 if preload == 0 else None for preload in preloads}
    for preload in (one for one in preloads if one < 0):
        force = sampler.leaf_force(grid) + sampler.spring(grid + preload)[0]
        beyond = np.flatnonzero(force >= 0)
        if len(beyond) and beyond[0]:
            found[preload] = _balanced(sampler, preload, grid[beyond[0] - 1], grid[beyond[0]])
    pressed = np.array([one for one in preloads if one > 0])
    if len(pressed):
        found |= dict(zip(pressed.tolist(), _pushed_back(sampler, pressed), strict=True))
    return tuple(found[preload] for preload in preloads)


def _pushed_back(sampler: Sampler, preloads: FloatArray) -> Iterator[float | None]:
    """Yield where the shuttle rests at positive preloads [m]: all are solved for together."""

    def force(travel: FloatArray, compression: FloatArray) -> FloatArray:
        return np.asarray(
            (sampler.leaf_force(travel.ravel()) + sampler.spring(compression.ravel())[0]).reshape(travel.shape)
        )

    there, behind = force(0.0 * preloads, preloads), force(-preloads, 0.0 * preloads)
    # No number as made: leaves too thin for the engine could not be moved at all. No number farther back: than they
    # were followed, where they pull still harder. The closed form of arches pulls the wrong way far out of its range.
    rests = (there > 0) & ~(behind > 0)

    def excess(travel: FloatArray, ends: NDArray[np.intp]) -> FloatArray:
        return -force(travel, travel + preloads[ends][:, None]) / there[ends][:, None]

    places = last_places(excess, 0.0 * preloads[:, None], np.where(rests, -preloads, 0.0)[:, None])[:, 0]
    # One secant more over what is left of the brackets: rests are known to rounding.
    step = 1e-9 * preloads
    here, ahead = (force(at, at + preloads) for at in (places, places + step))
    with np.errstate(all="ignore"):
        change = here * step / (ahead - here)
    places = places - np.where(np.abs(change) < step, change, 0.0)
    yield from (place if some else None for place, some in zip(places.tolist(), rests.tolist(), strict=True))


def _balanced(sampler: Sampler, preload: float, low: float, high: float) -> float | None:
    """Return where the force vanishes between a place where it is negative and one where it is not, if any."""

    def force(travel: float) -> float:
        place = np.array([travel])
        found = float((sampler.leaf_force(place) + sampler.spring(place + preload)[0])[0])
        # no value: farther back than the leaves were followed, where they pull still harder
        return found if np.isfinite(found) else -1e30

    if force(low) > 0 or force(high) < 0:  # far outside of its range the closed form of arches pulls the wrong way
        return None
    return bracketed_root(force, float(low), float(high))


def rest_of(sampler: Sampler, preload: float, grid: FloatArray) -> float | None:
    """Return `rests_of` for one preload [m]."""
    return rests_of(sampler, (preload,), grid)[0]


def _push(sampler: Sampler, pose: tuple[float, float | None], grid: FloatArray, room: float) -> Push:
    preload, rest = pose
    start = rest or 0.0
    if start < 0:
        step = grid[1]
        back = -step * np.arange(int(-start / step), 0, -1)
        grid = np.concatenate([back[back > start + 1e-9 * step], grid])
    travel = np.concatenate([[start], grid[grid > start + 1e-12]])
    leaves = sampler.leaves(travel)
    force, stress = sampler.spring(travel + preload)
    known = np.isfinite(leaves.force + force) & (travel + preload <= room * (1 + 1e-12))
    if not known.all():
        travel, force, stress = travel[known], force[known], stress[known]
        leaves = type(leaves)(leaves.force[known], leaves.stress[known], leaves.stable[known], leaves.buckled[known])
    return Push(preload, travel, leaves, force, stress, rest)


def _as_run(spec: VcfmSpec) -> VcfmSpec:
    """Return the spec with what the analysis fell back on written out."""
    analysis = spec.analysis.model_copy(update={"travel": spec.travel})
    return spec.model_copy(update={"analysis": analysis})


def _valid(solution: Solution) -> tuple[tuple[float, float], ...] | None:
    low, high = solution.character.linear
    return ((low, min(high, solution.spec.travel)),) if np.isfinite(low) and low < solution.spec.travel else None


def _curve(push: Push) -> Curve:
    leaves = push.leaves
    extra = {
        "bistable_force": Column(leaves.force, "force"),
        "spring_force": Column(push.spring_force, "force"),
        "bistable_stress": Column(leaves.stress, "stress"),
        "spring_stress": Column(push.spring_stress, "stress"),
        "max_stress": Column(np.maximum(leaves.stress, push.spring_stress), "stress"),
        "leaf_form": Column(np.where(leaves.buckled, "buckled", "bent"), "text"),
    }
    branch = np.full(len(push.travel), "load")
    return Curve(push.travel, push.force, branch, leaves.stable, extra, label={"preload": (push.preload, "length")})
