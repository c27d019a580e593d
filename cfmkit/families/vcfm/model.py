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

from cfmkit.arrays import ShortRepr
from cfmkit.curves import Column, Curve
from cfmkit.families.vcfm.bought_parts import parts_of
from cfmkit.families.vcfm.findings import findings_of, spring_closed
from cfmkit.families.vcfm.leaf_laws_from_spec import coils, parts, spring_room
from cfmkit.families.vcfm.leaves.v_beam import VBeam
from cfmkit.families.vcfm.scalar_results import adjustability, readings, values_of
from cfmkit.families.vcfm.solution import Characteristics, LeafSamples, Push, Solution
from cfmkit.numerics.roots import bracketed_root
from cfmkit.numerics.where_condition_ends import last_places
from cfmkit.results import ROUND_OFF, Result, Status
from cfmkit.stock.parts_list import listed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.families.vcfm.leaf_laws_from_spec import Parts
    from cfmkit.families.vcfm.solution import PartSampler
    from cfmkit.families.vcfm.spec import VcfmSpec


MOST_BACK = 20
"""The way from the rest position to the as-made pose has at most so many times the points of the travel: a travel of
some nanometres would take them by the billion."""

LEAST = 5
"""Points below which there is no curve to speak of."""


def analyze(spec: VcfmSpec, run: Run) -> Result:
    """Return the force-displacement curves of a mechanism by closed forms, with everything that is wrong with it.

    Parameters
    ----------
    spec : VcfmSpec
        The mechanism.
    run : Run
        Which metrics are looked at: values and findings that none of them needs are left out.

    Returns
    -------
    Result
        One curve per preload, the nominal one first. PARTIAL if the spring closes within the travel.
    """
    made = parts(spec)
    return result_of(solve(spec, made, LawSampler(made)), run)


def result_of(solution: Solution, run: Run) -> Result:
    """Return the curves of a solved mechanism, with everything that is wrong with it, if all of it is looked at.

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
        values=values_of(solution, run),
        warnings=findings_of(solution) if run.wanted is None else (),
        travel=solution.course,
        valid=_valid(solution),
        target=_target(spec),
        allowable_stress=spec.mechanism.allowable_stress,
        stress_overrated=solution.overrating,
        load_cases=curves[1:],
        closed=DenseCurve(solution),
        effort_error=solution.effort_error,
        part_efforts=solution.part_efforts,
        tables={"adjustability": partial(adjustability, solution), "readings": partial(readings, solution)}
        | listed(parts_of(spec)),
        state=solution,
    )


def _target(spec: VcfmSpec) -> float | None:
    """Return the force that the nominal curve is to have [N]: that of the design, more by K_p times its preload.

    None without a design, and where its K_p or a force above zero at that preload is not known.
    """
    design, preload = spec.design, spec.analysis.preloads[0]
    if design is None or design.force is None or not preload:
        return None if design is None else design.force
    if spec.mechanism.springs is not None:
        stiffness = coils(spec.mechanism.springs).stiffness
    else:
        stiffness = design.level / design.height if design.height else 0.0
    target = design.force + stiffness * preload
    return target if stiffness and target > 0 else None


def _shortfall(solution: Solution) -> str:
    """Return why a curve ends before the travel does; empty if none does."""
    if solution.sampler.problem:
        return solution.sampler.problem
    return next((found.message for found in spring_closed(solution)), "")


def travel_grid(spec: VcfmSpec) -> FloatArray:
    """Return the travels of a curve that starts at the as-made pose [m]."""
    return np.asarray(spec.travel * (np.arange(spec.analysis.points) / (spec.analysis.points - 1.0)))


def solve(spec: VcfmSpec, made: Parts, sampler: PartSampler) -> Solution:
    """Return the curves at all preloads by a model of leaves and spring."""
    grid = travel_grid(spec)
    room, rests = spring_room(spec), rests_of(sampler, spec.analysis.preloads, grid)
    poses = zip(spec.analysis.preloads, rests, strict=True)
    nominal, *others = (_push(sampler, pose, grid, room) for pose in poses)
    # a preload at which the spring cannot be followed, or is closed, has no curve; a message says so
    pushes = (nominal, *(push for push in others if len(push.travel) >= LEAST))
    return Solution(spec, made, sampler, sampler.character, pushes)


def rests_of(sampler: PartSampler, preloads: Sequence[float], grid: FloatArray) -> tuple[float | None, ...]:
    """Return where the shuttle rests at each preload [m]: the first place without force, from the as-made pose on.

    None where there is none, or where the spring could not be followed so far.
    """
    found: dict[float, float | None] = {preload: 0.0 if preload == 0 else None for preload in preloads}
    for preload in (one for one in preloads if one < 0):
        force = sampler.leaf_force(grid) + sampler.spring(grid + preload)[0]
        beyond = np.flatnonzero(force >= 0)
        if len(beyond) and beyond[0] == 0 and force[0] == 0:
            found[preload] = 0.0  # springs that are bought hang slack: they do not pull
        elif len(beyond) and beyond[0]:
            found[preload] = _balanced(sampler, preload, grid[beyond[0] - 1], grid[beyond[0]])
    pressed = np.array([one for one in preloads if one > 0])
    if len(pressed):
        found |= dict(zip(pressed.tolist(), _pushed_back(sampler, pressed), strict=True))
    return tuple(found[preload] for preload in preloads)


def _pushed_back(sampler: PartSampler, preloads: FloatArray) -> Iterator[float | None]:
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


def _balanced(sampler: PartSampler, preload: float, low: float, high: float) -> float | None:
    """Return where the force vanishes between a place where it is negative and one where it is not, if any."""

    def force(travel: float) -> float:
        place = np.array([travel])
        found = float((sampler.leaf_force(place) + sampler.spring(place + preload)[0])[0])
        # no value: farther back than the leaves were followed, where they pull still harder
        return found if np.isfinite(found) else -1e30

    if force(low) > 0 or force(high) < 0:  # far outside of its range the closed form of arches pulls the wrong way
        return None
    return bracketed_root(force, float(low), float(high))


def rest_of(sampler: PartSampler, preload: float, grid: FloatArray) -> float | None:
    """Return `rests_of` for one preload [m]."""
    return rests_of(sampler, (preload,), grid)[0]


def _push(sampler: PartSampler, pose: tuple[float, float | None], grid: FloatArray, room: float) -> Push:
    preload, rest = pose
    start = rest or 0.0
    if start < 0:
        step = max(grid[1], -start / (MOST_BACK * len(grid)))
        back = -step * np.arange(int(-start / step), 0, -1)
        grid = np.concatenate([back[back > start + 1e-9 * step], grid])
    travel = np.concatenate([[start], grid[grid > start + 1e-12]])
    leaves = sampler.leaves(travel)
    force, stress = sampler.spring(travel + preload)
    known = np.isfinite(leaves.force + force) & (travel + preload <= room * (1 + 1e-12))
    if not known.all():
        travel, force, stress = travel[known], force[known], stress[known]
        leaves = type(leaves)(leaves.force[known], leaves.stress[known], leaves.stable[known], leaves.buckled[known])
    return Push(preload, travel, leaves, force, stress, rest, sampler.solved(travel, preload))


def _as_run(spec: VcfmSpec) -> VcfmSpec:
    """Return the spec with the defaults of the analysis made explicit."""
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
    if push.solved is not None:
        extra["solved"] = Column(np.where(push.solved, "yes", "between"), "text")
    branch = np.full(len(push.travel), "load")
    return Curve(push.travel, push.force, branch, leaves.stable, extra, label={"preload": (push.preload, "length")})


class LawSampler:
    """Samples of closed forms."""

    problem = ""
    accuracy = ROUND_OFF

    def __init__(self, parts: Parts) -> None:
        """Keep the laws."""
        self.parts = parts

    def solved(self, travel: FloatArray, preload: float) -> NDArray[np.bool_] | None:
        """Return None: closed forms know every travel."""

    def leaves(self, travel: FloatArray) -> LeafSamples:
        """Return what all leaves do at some travels [m]."""
        leaf = self.parts.leaf
        force, stress = leaf.state(travel) if isinstance(leaf, VBeam) else (leaf.force(travel), leaf.stress(travel))
        force = self.parts.half_beams * np.asarray(force, dtype=float)
        buckled = np.asarray(leaf.buckled(travel))
        return LeafSamples(force, np.asarray(stress, dtype=float), np.ones(travel.shape, dtype=bool), buckled)

    def leaf_force(self, travel: FloatArray) -> FloatArray:
        """Return the force of all leaves alone [N]."""
        return np.asarray(self.parts.half_beams * np.asarray(self.parts.leaf.force(travel), dtype=float))

    def spring(self, compression: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and largest stress [Pa] of the spring at some compressions [m]."""
        spring = self.parts.spring
        return np.asarray(spring.force(compression)), np.asarray(spring.stress(compression))

    @property
    def character(self) -> Characteristics:
        """Stiffnesses and linear range by the laws."""
        parts = self.parts
        return Characteristics(parts.positive_stiffness, parts.negative_stiffness, parts.first_stiffness, parts.linear)


EVEN = 257
"""Places at even steps: the force beyond the peak is smooth, and the leaves' law has no shorter waves."""

CROWDED = np.geomspace(1e-6, 1.0, 73)
"""Shares of the travel, and of the way from an end of the constant stiffness, at which more places stand."""


@dataclass(frozen=True, eq=False, repr=False)
class DenseCurve(ShortRepr):
    """The force at the nominal preload (a `cfmkit.results.ClosedForm`), with the stress of all preloads."""

    solution: Solution

    @cached_property
    def places(self) -> FloatArray:
        """Increasing travels of the shuttle [m]."""
        travel = self.solution.nominal.travel
        low, high = float(travel[0]), float(travel[-1])
        marks = [mark for mark in (*self.solution.character.linear, 0.0) if np.isfinite(mark) and low <= mark < high]
        around = [mark + sign * CROWDED * (high - low) for mark in marks for sign in (-1.0, 1.0)]
        grid = np.unique(np.concatenate([np.linspace(low, high, EVEN), marks, *around]))
        return grid[(grid >= low) & (grid <= high)]

    @property
    def peaks(self) -> FloatArray:
        """All places: thin leaves have their peak before the second point of a curve [m]."""
        return self.places

    def effort(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the force at travels of any shape [N]."""
        if places is self.places or (places.base is self.places and places.size == self.places.size):
            return self._known.reshape(places.shape)
        return self._force(places)

    @cached_property
    def _known(self) -> FloatArray:
        """The force at all of `places`, which each metric begins with [N]."""
        return self._force(self.places)

    def _force(self, places: FloatArray) -> FloatArray:
        sampler, travel = self.solution.sampler, np.ravel(places)
        force = sampler.leaf_force(travel) + sampler.spring(travel + self.solution.nominal.preload)[0]
        return np.asarray(force.reshape(np.shape(places)))

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of leaves and spring at travels of any shape, of all preloads there [Pa]."""
        travel = np.ravel(places)
        leaves = self.solution.sampler.leaves(travel).stress
        found = np.max([np.maximum(leaves, self._spring(push, travel)) for push in self.solution.pushes], axis=0)
        return np.asarray(found.reshape(np.shape(places)))

    def own_stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of leaves and spring at travels of any shape, of the nominal preload [Pa]."""
        travel, one = np.ravel(places), self.solution
        found = np.maximum(one.sampler.leaves(travel).stress, self._spring(one.nominal, travel))
        return np.asarray(found.reshape(np.shape(places)))

    def _spring(self, push: Push, travel: FloatArray) -> FloatArray:
        """Return the stress of the spring at a preload, none beyond its curve [Pa]."""
        beyond = (travel < push.travel[0]) | (travel > push.travel[-1])
        return np.where(beyond, 0.0, self.solution.sampler.spring(travel + push.preload)[1])
