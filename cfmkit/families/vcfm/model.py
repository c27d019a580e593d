"""Analysis of a vcfm by closed forms: force of leaves and spring over travel at each preload, of one mechanism or many.

Each curve begins where the shuttle rests under its preload: pulled back by it, with the leaves in tension.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from cfmkit.arrays import LazySequence, ShortRepr, distinct
from cfmkit.curves import Column, Curve
from cfmkit.families.end_stops import NO_STOPS
from cfmkit.families.rows import SolvedRows, findings_of_one, rows_of, valid, values_of_one, with_values
from cfmkit.families.vcfm.curves_in_rows import (
    LEAST_POINTS,
    Characteristics,
    LeafSamples,
    PartSampler,
    PreloadedRows,
    Rows,
)
from cfmkit.families.vcfm.findings import FINDING_RULES, closed_spring, finding, is_closed
from cfmkit.families.vcfm.leaf_laws_from_spec import parts, spring_room
from cfmkit.families.vcfm.leaves.kinds import stack_laws
from cfmkit.families.vcfm.quantities import ROW_COLUMNS, SCALAR_QUANTITIES, adjustability, readings
from cfmkit.families.vcfm.solution import Solution, target_of
from cfmkit.families.vcfm.surroundings import parts_of
from cfmkit.numerics.roots import last_places
from cfmkit.results import Result, Status
from cfmkit.stock.parts_list import parts_tables

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.end_stops import EndStops
    from cfmkit.families.run_control import Run
    from cfmkit.families.vcfm.curves_in_rows import PreloadCurve
    from cfmkit.families.vcfm.leaf_laws_from_spec import LeafLaws
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.results import Finding


MOST_BACK = 20
"""The way from the rest position to the unloaded position has at most so many times the points of the travel: a travel
of some nanometres would take them by the billion."""
MAX_SAMPLES = 60_000  # samples that are worked on together: few enough to stay in a processor's cache


def analyze(spec: VcfmSpec, _run: Run) -> Result:
    """Return the force-displacement curves of a mechanism by closed forms, with everything that is wrong with it.

    One curve per preload, the nominal one first. PARTIAL if the spring closes within the travel.
    """
    made = parts(spec)
    return result_of(solve(spec, made, LawSampler(made)))


def result_of(solution: Solution) -> Result:
    """Return the curves of one solved mechanism, with everything that is wrong with it.

    PARTIAL if the spring closes within the travel, or a beam cannot be followed to its end.
    """
    spec, nominal = solution.spec, solution.first
    if len(nominal.travel) < LEAST_POINTS:
        closed = (finding("spring_closed", *closed_spring(solution)),) if is_closed(solution).any() else ()
        return Result(spec, Status.NO_EQUILIBRIUM, _shortfall(solution), warnings=closed)
    reason = _shortfall(solution)
    short = nominal.travel[-1] < spec.travel * (1 - 1e-9) or bool(reason)
    stops, pressed = solution.curves.stops, bool(nominal.force[0] > solution.effort_error[0])
    curves = tuple(_curve(push, stops, bool(push.force[0] > solution.effort_error[0])) for push in solution.pushes)
    (low, high), dense = (float(end[0]) for end in solution.linear_range), DenseCurve(solution)
    return Result(
        spec=with_values(spec, {"analysis.travel": spec.travel}),
        status=Status.PARTIAL if short else Status.COMPLETE,
        message=reason if short else "",
        curves=curves,
        values=values_of_one(SCALAR_QUANTITIES, solution)
        | stops.values(nominal.travel, pressed, solution.window_of_one),
        warnings=LazySequence(partial(_findings, solution)),
        travel=(float(nominal.travel[0]), spec.travel),
        valid=((low, min(high, float(solution.reach[0]))),) if solution.is_linear[0] else None,
        target=target_of(spec),
        allowable_stress=spec.mechanism.allowable_stress,
        stress_overrated=float(solution.overrating[0]),
        load_cases=curves[1:],
        closed=dense,
        effort_error=float(solution.effort_error[0]),
        part_efforts=dense.part_efforts,
        tables={
            "adjustability": partial(adjustability, solution),
            "readings": partial(readings, solution),
            **parts_tables(partial(parts_of, spec)),
        },
        state=solution,
    )


def _findings(solution: Solution) -> Iterator[Finding]:
    yield from findings_of_one(FINDING_RULES, finding, solution)
    first = float(solution.first.force[0])
    pressed = first if first > solution.effort_error[0] else 0.0
    for name, message in solution.curves.stops.sentences(solution.first.travel, pressed):
        yield finding(name, message)


def _shortfall(solution: Solution) -> str:
    """Return why a curve ends before the travel does; empty if none does."""
    if solution.sampler.problem:
        return solution.sampler.problem
    if is_closed(solution).any():
        return str(closed_spring(solution)[0])
    return solution.curves.stops.describe_block(float(solution.nominal.ends[1][0]))


def travel_grid(spec: VcfmSpec) -> FloatArray:
    """Return the travels of a curve that starts at the unloaded position [m]."""
    return np.asarray(spec.travel * (np.arange(spec.analysis.points) / (spec.analysis.points - 1.0)))


def solve(spec: VcfmSpec, made: LeafLaws, sampler: PartSampler) -> Solution:
    """Return the curves of one mechanism at all preloads by a model of leaves and spring.

    A preload at which the spring cannot be followed, or is closed, has no curve; a message says so.
    """
    preloads = np.array(spec.analysis.preloads)
    room = np.full(len(preloads), spring_room(spec))
    pushed = PreloadedRows(sampler, preloads[:, None], spec.mechanism.end_stops)
    curves = _curves(pushed, travel_grid(spec)[None, :], room)
    curves.leaves  # noqa: B018  force and stress come of one root, and a curve has both
    is_known = np.isfinite(curves.force)
    if (is_known != curves.is_distinct).any():
        travel, count = _compress_rows(curves.travel, is_known)
        curves = replace(curves, travel=travel, count=count)
    kept = curves.count >= LEAST_POINTS
    kept[0] = True
    return Solution((spec,), made, curves if kept.all() else curves.select_rows(np.flatnonzero(kept)), int(kept.sum()))


def solve_rows(specs: Sequence[VcfmSpec]) -> Iterator[tuple[NDArray[np.intp], SolvedRows[Solution]]]:
    """Yield (indices, mechanisms that are solved together) of those that have closed forms; others are left out."""
    kinds = {index: kind for index, spec in valid(specs) if (kind := _kind(spec)) is not None}
    order = sorted(kinds, key=lambda index: repr(kinds[index]))
    for _, alike in groupby(order, key=lambda index: repr(kinds[index])):
        members = list(alike)
        first = specs[members[0]].analysis
        size = max(1, MAX_SAMPLES // first.points)
        for start in range(0, len(members), size):
            chosen = members[start : start + size]
            solution = _solve_kind([specs[index] for index in chosen])
            complete, slow = _is_complete(solution), solution.parts.leaf.one_by_one
            yield np.array(chosen), SolvedRows(solution, ROW_COLUMNS, FINDING_RULES, complete, slow)


def _is_complete(solution: Solution) -> NDArray[np.bool_]:
    """Return which mechanisms have all of their curves, each up to the end of the travel, (m,)."""
    curves, nominal = solution.curves, solution.nominal
    spring = curves.spring_samples.force.sum(axis=1) + curves.sampler.leaf_force(curves.travel[:, :1])[:, 0]
    is_known = (curves.count >= LEAST_POINTS) & np.isfinite(spring)
    reached = nominal.ends[1] >= solution.travel * (1 - 1e-9)
    finite = np.isfinite(nominal.force).sum(axis=1) == nominal.count
    return np.asarray(solution.split_by_mechanism(is_known).all(axis=1) & reached & finite & ~is_closed(solution))


def _kind(spec: VcfmSpec) -> Hashable | None:
    """Return what mechanisms that are solved together have in common; None if the model of one is not a closed form."""
    analysis = spec.analysis
    if analysis.fidelity not in ("truss", "analytic") or spec.mechanism.stops:
        return None
    stated = analysis.window is None, analysis.measured is None
    settings = analysis.points, len(analysis.preloads), analysis.flatness
    return analysis.fidelity, spec.mechanism.kinds, spec.target_curve, *stated, *settings


def _solve_kind(specs: Sequence[VcfmSpec]) -> Solution:
    """Return mechanisms of one kind as rows."""
    made, count = stack_laws([parts(spec) for spec in specs]), len(specs[0].analysis.preloads)
    preloads = np.concatenate([spec.analysis.preloads for spec in specs])
    mechanism_of_row = np.repeat(np.arange(len(specs)), count)
    grid, room = np.stack([travel_grid(spec) for spec in specs]), np.array([spring_room(spec) for spec in specs])
    made.linear_range  # noqa: B018  once for all preloads
    sampler = LawSampler(made)
    sampler = sampler if count == 1 or len(specs) == 1 else sampler.select_rows(mechanism_of_row)
    pushed = PreloadedRows(sampler, preloads[:, None], NO_STOPS)
    return Solution(tuple(specs), made, _curves(pushed, grid[mechanism_of_row], room[mechanism_of_row]), count)


def _curves(pushed: PreloadedRows, grid: FloatArray, room: FloatArray) -> Rows:
    """Return one curve for each preload, from where the shuttle rests up to where the spring is closed [m]."""
    rest, preload, stops = rests_of(pushed, grid), pushed.preload, pushed.stops
    travel, count = _travels(np.nan_to_num(rest), np.broadcast_to(grid, (len(preload), grid.shape[1])))
    if stops:
        marked = stops.mark_rows(row[:points] for row, points in zip(travel, count, strict=True))
        count = np.array([len(row) for row in marked])
        travel = np.array([np.append(row, np.full(max(count.max(), 1) - len(row), row[-1:])) if len(row) else
                           np.full(max(count.max(), 1), start)
                           for row, start in zip(marked, travel[:, 0], strict=True)])  # fmt: skip
    is_open = (travel + preload <= room[:, None] * (1 + 1e-12)) & (np.arange(travel.shape[1]) < count[:, None])
    return Rows(pushed.sampler, preload, stops, rest, *_compress_rows(travel, is_open))


def _travels(start: FloatArray, grid: FloatArray) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return the travels of curves that start at rest (r,), (r, n), and how many each has [m]."""
    step = np.maximum(grid[:, 1], -start / (MOST_BACK * grid.shape[1]))
    backs = np.where(start < 0, -start / step, 0.0).astype(np.intp)
    number = np.arange(backs.max(initial=0), 0, -1)
    back = -step[:, None] * number
    kept = [
        np.ones((len(start), 1), dtype=bool),
        (number <= backs[:, None]) & (back > (start + 1e-9 * step)[:, None]),
        grid > start[:, None] + 1e-12,
    ]
    return _compress_rows(np.hstack([start[:, None], back, grid]), np.hstack(kept))


def _compress_rows(travel: FloatArray, kept: NDArray[np.bool_]) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return what is kept of each row, its last place repeated, and how much that is."""
    count = kept.sum(axis=1)
    if kept.all():
        return travel, count
    size = max(int(count.max()), 1)
    travel = np.take_along_axis(travel, np.argsort(~kept, axis=1, kind="stable"), 1)[:, :size]
    last = travel[np.arange(len(count)), np.maximum(count - 1, 0)][:, None]
    return np.where(np.arange(size) < count[:, None], travel, last), count


def rests_of(
    pushed: PreloadedRows,
    grid: FloatArray,  # (n,) or (r, n): travels at which a shuttle whose spring is pulled is looked for first [m]
) -> FloatArray:
    """Return where the shuttle rests at each preload, (r,) [m]: the first place without force from the unloaded one on.

    NaN where there is none, or where the spring could not be followed so far.
    """
    preload, (low, high) = pushed.preload[:, 0], pushed.stops.rigid_ends
    grid = np.broadcast_to(grid, (len(preload), np.shape(grid)[-1]))
    rest = np.where(preload == 0, 0.0, np.nan)
    for rows, search in ((np.flatnonzero(preload < 0), _rests_ahead), (np.flatnonzero(preload > 0), _rests_behind)):
        if rows.size:
            chosen = replace(pushed, sampler=pushed.sampler.select_rows(rows), preload=pushed.preload[rows])
            rest[rows] = search(chosen, grid[rows])
    if math.isfinite(low):  # a rigid stop may hold it before it rests
        is_pressed = pushed.force_at(np.full((len(preload), 1), low))[:, 0] > 0
        rest = np.where((preload > 0) & ~(rest > low) & is_pressed, low, rest)
    return np.minimum(rest, high)


def _rests_ahead(pushed: PreloadedRows, grid: FloatArray) -> FloatArray:
    """Return where the shuttle rests at negative preloads, (r,) [m]."""
    force, rows = pushed.force_at(grid), np.arange(len(grid))
    beyond = force >= 0
    first = beyond.argmax(axis=1)
    before = np.maximum(first - 1, 0)
    # springs that are bought hang slack: they do not pull
    slack = beyond[:, 0] & (force[:, 0] == 0)
    some = beyond.any(axis=1) & (first > 0)

    def excess(travel: FloatArray, ends: NDArray[np.intp]) -> FloatArray:
        excess_share = pushed.force_at(travel, ends) / np.abs(force[ends, first[ends]])[:, None]
        # no value: farther back than the leaves were followed, where they pull still harder
        return np.where(np.isfinite(excess_share), excess_share, -1.0)

    low, high = grid[rows, before], grid[rows, first]
    exact = some & (force[rows, first] == 0)
    some &= ~exact
    place = last_places(excess, low[:, None], np.where(some, high, low)[:, None])[:, 0]
    place = _polish_rest(pushed, place, 1e-9 * (high - low))
    return np.where(slack, 0.0, np.where(exact, high, np.where(some, place, np.nan)))


def _rests_behind(pushed: PreloadedRows, _grid: FloatArray) -> FloatArray:
    """Return where the shuttle rests at positive preloads, (r,) [m]."""
    nothing, preload = np.zeros_like(pushed.preload), pushed.preload[:, 0]
    force_unloaded, force_behind = (pushed.force_at(at)[:, 0] for at in (nothing, -pushed.preload))
    # No number unloaded: leaves too thin for the engine could not be moved at all. No number farther back: than they
    # were followed, where they pull still harder. The closed form of arches pulls the wrong way far out of its range.
    rests = (force_unloaded > 0) & ~(force_behind > 0)

    def excess(travel: FloatArray, ends: NDArray[np.intp]) -> FloatArray:
        return -pushed.force_at(travel, ends) / force_unloaded[ends][:, None]

    place = last_places(excess, nothing, np.where(rests, -preload, 0.0)[:, None])[:, 0]
    return np.where(rests, _polish_rest(pushed, place, 1e-9 * preload), np.nan)


def _polish_rest(pushed: PreloadedRows, place: FloatArray, step: FloatArray) -> FloatArray:
    """Return rest positions after one secant more over what is left of their brackets: known to rounding."""
    force_here, force_ahead = (pushed.force_at(at[:, None])[:, 0] for at in (place, place + step))
    with np.errstate(all="ignore"):
        change = force_here * step / (force_ahead - force_here)
    return place - np.where(np.abs(change) < step, change, 0.0)


def rests_by_laws(laws: LeafLaws, preloads: Sequence[float], grid: FloatArray) -> FloatArray:
    """Return `rests_of` one mechanism of closed forms at each preload, (p,) [m]; zero where nothing holds it."""
    return np.nan_to_num(rests_of(PreloadedRows(LawSampler(laws), np.array(preloads)[:, None], NO_STOPS), grid))


def farthest_back(spec: VcfmSpec, preloads: Sequence[float]) -> float:
    """Return how far preloads push the shuttle back by closed forms [m]."""
    return max(0.0, -float(rests_by_laws(parts(spec), preloads, travel_grid(spec)).min()))


def _curve(push: PreloadCurve, stops: EndStops, pressed: bool) -> Curve:
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
    extra |= stops.columns(push.travel, pressed)
    branch = np.full(len(push.travel), "load")
    return Curve(push.travel, push.force, branch, leaves.stable, extra, label={"preload": (push.preload, "length")})


@dataclass(frozen=True)
class LawSampler(PartSampler):
    """Samples of closed forms: of one mechanism, or of one for each row."""

    parts: LeafLaws

    def select_rows(self, rows: Any) -> Self:
        """Return the laws of some rows."""
        return type(self)(rows_of(self.parts, rows))

    def leaves(self, travel: FloatArray) -> LeafSamples:
        """Return what all leaves do at some travels [m]."""
        leaf = self.parts.leaf
        force, stress = leaf.state(travel)
        force = self.parts.half_beams * np.asarray(force, dtype=float)
        buckled = np.asarray(leaf.is_buckled(travel))
        return LeafSamples(force, np.asarray(stress, dtype=float), np.ones(travel.shape, dtype=bool), buckled)

    def leaf_force(self, travel: FloatArray) -> FloatArray:
        """Return the force of all leaves alone [N]."""
        return np.asarray(self.parts.half_beams * np.asarray(self.parts.leaf.force(travel), dtype=float))

    def leaf_stress(self, travel: FloatArray) -> FloatArray:
        """Return the largest stress of the leaves [Pa]."""
        return np.asarray(self.parts.leaf.stress(travel), dtype=float)

    def spring(self, compression: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and largest stress [Pa] of the spring at some compressions [m]."""
        spring = self.parts.spring
        return np.asarray(spring.force(compression)), np.asarray(spring.stress(compression))

    @property
    def character(self) -> Characteristics:
        """Stiffnesses and linear range by the laws."""
        parts = self.parts
        return Characteristics(
            parts.positive_stiffness, parts.negative_stiffness, parts.first_stiffness, parts.linear_range
        )


@dataclass(frozen=True, eq=False, repr=False)
class DenseCurve(ShortRepr):
    """The force of one mechanism at the nominal preload (a `cfmkit.results.ClosedForm`), with the stress of all."""

    solution: Solution

    @cached_property
    def places(self) -> FloatArray:
        """Increasing travels of the shuttle [m]."""
        return distinct(self.solution.dense)

    @property
    def peaks(self) -> FloatArray:
        """All places: thin leaves have their peak before the second point of a curve [m]."""
        return self.places

    def effort(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the force at travels of any shape [N]."""
        if places is self.places or (places.base is self.places and places.size == self.places.size):
            return self._known.reshape(places.shape)
        return _evaluate_at(self.solution.nominal.force_at, places)

    @cached_property
    def _known(self) -> FloatArray:
        """The force at all of `places`, which each metric begins with [N]."""
        return _evaluate_at(self.solution.nominal.force_at, self.places)

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of leaves and spring at travels of any shape, of all preloads there [Pa]."""
        return _evaluate_at(self.solution.stress, places)

    def own_stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of leaves and spring at travels of any shape, of the nominal preload [Pa]."""
        return _evaluate_at(partial(self.solution.stress, alone=True), places)

    def part_efforts(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest force of one leaf, or of one spring, at travels of any shape [N]."""
        return _evaluate_at(self.solution.part_efforts, places)


def _evaluate_at(law: Callable[[FloatArray], FloatArray], places: FloatArray) -> FloatArray:
    """Return a law of places (1, n) at places of any shape."""
    return law(np.reshape(places, (1, -1))).reshape(np.shape(places))
