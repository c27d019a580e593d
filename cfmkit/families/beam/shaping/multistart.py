"""All starts of a shape search: runs and ranks them, widens and audits the best, and scatters it within its tolerances.

For the widest window each start is searched twice: over the requested window, and over one that begins farther. Most
starts end in one family of shapes, and what is flattest over the requested window seldom is in another one whose window
can be widened farther.

The audit judges a shape on terms that the search does not use: the stable branch, true gaps and crossings, and what is
left of the constant force when nodes and coefficients are off by their tolerances. Force and stress are judged by the
analysis of the specification that is written.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.run_many_starts import Done, OneStart, Stage, from_record, run_stage
from cfmkit.elastica import Control, Displacement, PathStatus, trace
from cfmkit.elastica.tracing.trace_many import trace_many
from cfmkit.families.beam.network_from_spec import thickest_of
from cfmkit.families.beam.shaping.limits import half_band, pairs
from cfmkit.families.beam.shaping.search import (
    VIOLATION_TOL,
    ShapeCandidate,
    StartBudget,
    refine,
    search_far,
    search_nearer,
    search_start,
    widen,
)
from cfmkit.families.beam.shaping.task_and_variables import Variables, segments_cross

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.families.beam.shaping.limits import Pair
    from cfmkit.families.beam.shaping.spec import Tolerances
    from cfmkit.families.beam.shaping.task_and_variables import Task
    from cfmkit.families.run_control import Run


N_AUDIT_POSES = 61
STRICT_BAND = 0.05  # of the largest force: the strict range is that of `cfmkit analyze`, (max - min) <= 5 % of max
_JOINT_RTOL = 1e-4  # of the chords: lines that end in a joint meet within the error of the path


@dataclass(frozen=True)
class Audit:
    """Whether a mechanism exists as drawn."""

    # complete, stable: whether the whole way is reached, and stable at all poses
    complete: bool
    stable: bool
    crossings: int  # poses, of 61 from rest to the end, at which beams cross
    gap: float | None  # least distance of surfaces away from joints at any pose [m]

    @property
    def sound(self) -> bool:
        """Whether the mechanism exists as drawn, all the way."""
        return self.complete and self.stable and self.crossings == 0


@dataclass(frozen=True)
class Drawn:
    """Networks drawn within the tolerances."""

    # bands, ranges, (n,): half bands and strict shares of those that could be followed
    bands: FloatArray
    ranges: FloatArray
    lost: int  # those that could not


def audit_design(task: Task, design: ShapeCandidate) -> Audit:
    """Return the judgement of a design."""
    at = np.linspace(0.0, task.window[1], N_AUDIT_POSES)
    path = trace(design.network(task), Displacement(task.driven, task.direction, at), Control(tolerance=1e-7))
    return Audit(
        path.status is PathStatus.COMPLETE,
        bool(path.stable.all()),
        sum(has_crossing(task, path, int(k)) for k in path.at_requested),
        _least_gap(task, path),
    )


def band_and_range(at: FloatArray, force: FloatArray, start: float) -> tuple[float, float]:
    """Return (max - min)/(max + min) of a force from `start` on, and the share of its travel that is flat at its end.

    That is the longest share, counted back from the end, over which max - min is at most 5 % of max. Between poses the
    force is a cubic.
    """
    from scipy.interpolate import CubicSpline

    cubic, fine = CubicSpline(at, force), np.linspace(0.0, at[-1], 2001)
    values = cubic(fine)[::-1]
    tops, bottoms = np.maximum.accumulate(values), np.minimum.accumulate(values)
    good = tops - bottoms <= STRICT_BAND * tops
    count = len(good) if good.all() else int(good.argmin())
    return half_band(cubic(np.linspace(start, at[-1], 201))), (count - 1) / (len(fine) - 1)


def scatter_within_tolerances(task: Task, design: ShapeCandidate, spread: Tolerances, seed: int = 0) -> Drawn:
    """Return what is left of the constant force in networks within the tolerances."""
    variables, rng = Variables(task, design.order), np.random.default_rng([seed, 1])
    sizes = np.full(variables.count, spread.coefficients)
    sizes[: len(task.coordinates)] = spread.nodes / task.size
    at = np.linspace(0.0, task.window[1], N_AUDIT_POSES)
    noise = rng.standard_normal((spread.samples, variables.count)) * sizes
    drive = Displacement(task.driven, task.direction, at)
    networks = (variables.build(design.x + error) for error in noise)
    if task.contact is None:  # followed together where they can be
        outcomes = trace_many(networks, drive, Control(tolerance=1e-5))
        forces = [outcome.value.effort for outcome in outcomes if outcome.status == "COMPLETE"]
    else:
        outcomes = trace_many(networks, drive, Control(tolerance=1e-5), partial(_force_at_requested, task))
        forces = [outcome.value for outcome in outcomes if outcome.status == "COMPLETE"]
    shares = np.array([band_and_range(at, force, design.start) for force in forces]).reshape(-1, 2)
    return Drawn(shares[:, 0], shares[:, 1], spread.samples - len(forces))


def _force_at_requested(task: Task, path: Path) -> FloatArray:
    """Return the force that is to be constant at the requested points of a path."""
    force: FloatArray = task.force(path)[path.at_requested]
    return force


def has_crossing(task: Task, path: Path, pose: int) -> bool:
    """Return True if centre lines of different beams cross at a pose, or one crosses itself."""
    lines = {name: path.shape(name, pose) for name in task.network.beams}
    shared = {pair.beams: pair.joints for pair in pairs(task.network)}
    return any(
        lines_cross(lines[first], lines[second], bool(shared[first, second]))
        for first, second in combinations(lines, 2)
    ) or any(lines_cross(line, line, True) for line in lines.values())


def lines_cross(line: FloatArray, second_line: FloatArray, joined: bool) -> bool:
    """Return True if two polylines (n, 2) cross; pieces that share an end, or touch at a common joint, do not."""
    p, q = line[:, 0] + 1j * line[:, 1], second_line[:, 0] + 1j * second_line[:, 1]
    a, b, c, d = p[:-1, None], p[1:, None], q[None, :-1], q[None, 1:]
    hit = segments_cross(a, b, c, d)
    if joined:
        size = abs(p[-1] - p[0]) + abs(q[-1] - q[0])
        gap_of_ends = np.min([abs(u - v) for u in (a, b) for v in (c, d)], axis=0)
        hit &= gap_of_ends > _JOINT_RTOL * size
    return bool(hit.any())


def _least_gap(task: Task, path: Path) -> float | None:
    """Return the least distance of surfaces of different beams, away from where they meet [m]."""
    least = min((_gap_of_pair(task, path, pair) for pair in pairs(task.network) if not pair.alone), default=np.inf)
    return float(least) if np.isfinite(least) else None


def _gap_of_pair(task: Task, path: Path, pair: Pair) -> float:
    sections = [task.network.beams[name].section for name in pair.beams]
    thickness = 0.5 * sum(thickest_of(section) for section in sections)
    wanted = thickness + (task.limits.clearance or 0.0)
    least = np.inf
    for pose in path.at_requested:
        p, q = (path.shape(name, int(pose)) @ [1, 1j] for name in pair.beams)
        distance = abs(p[:, None] - q[None, :])
        away = np.full(distance.shape, np.inf)
        for i, j in pair.joints:
            away = np.minimum(away, _arc_lengths(p, i)[:, None] + _arc_lengths(q, j)[None, :])
        far = task.limits.opening * away >= wanted
        if far.any():
            least = min(least, float(distance[far].min()) - thickness)
    return least


def _arc_lengths(line: FloatArray, end: int) -> FloatArray:
    """Return the way along a line from its first (0) or last (1) point."""
    arc_length = np.append(0.0, np.cumsum(abs(np.diff(line))))
    return arc_length[-1] - arc_length if end else arc_length


_N_REFINED = 3  # of the widest: one in a finer order takes as long as a widening, and others gain little
_N_LEADERS = 3  # of the flattest over a wider window: finishing one takes as long as a start
_STAGE_DURATIONS = {
    "starts": 9.0,
    "widenings": 5.0,
    "starts over a wider window": 4.0,
    "widenings of the flattest of these": 2.0,
    "refinements": 5.0,
}
"""How long the stages of a search for the widest window last, one in units of another; where they are done in turn."""


@dataclass(frozen=True)
class Explored:
    """Results of the starts."""

    designs: dict[int, ShapeCandidate | None]  # number of the start -> the design, None if nothing could be followed
    reused: int  # starts that were noted by a run before
    missing: int  # starts that led to nothing: the time did not suffice, or a process died
    lost: tuple[str, ...] = ()  # why processes died
    # number of the start -> the audit of its design, of those that meet all limits
    audits: Mapping[int, Audit] = field(default_factory=dict)

    @property
    def shapes(self) -> dict[int, ShapeCandidate]:
        """The designs of the starts that led to one."""
        return {index: design for index, design in self.designs.items() if design is not None}

    def count(self) -> dict[str, int]:
        """Return how many starts led to a shape, to one within all limits, to a sound one; and how many traces."""
        shapes = self.shapes.values()
        return {
            "starts": len(shapes),
            "starts_within_limits": sum(design.feasible for design in shapes),
            "starts_sound": sum(audit.sound for audit in self.audits.values()),
            "traces": sum(design.evaluations for design in shapes),
        }


def explore(
    task: Task,
    plan: StartBudget,
    counts: tuple[int, int],  # starts, and how many of the best are widened
    identity: str,  # of everything that decides the outcome of a start but its number
    run: Run,
) -> Explored:
    """Return what all starts lead to, the best of them widened if that is the objective, as far as the time allows."""
    starts, wide = counts
    jobs, started = _Jobs(task, plan, identity, run), task.started
    begun = jobs.run_stage("starts", partial(search_start, started, run.seed, plan=plan), range(starts))
    designs, missing = _found_in(begun), starts - len(begun.records)
    if task.objective == "range":
        best = dict(list(rank(task, designs))[:wide])
        designs |= _found_in(jobs.run_stage("widenings", partial(_go_on, widen, started, best, plan), best))
        distant = partial(search_far, started, run.seed, plan=plan)
        far = _found_in(jobs.run_stage("starts over a wider window", distant, range(starts)))
        leaders = dict(sorted(_keep_within_limits(far), key=lambda item: item[1].objective)[:_N_LEADERS])
        work = partial(_go_on, search_nearer, started, leaders, plan)
        led = _found_in(jobs.run_stage("widenings of the flattest of these", work, leaders))
        designs |= {index: design for index, design in led.items() if _better(task, design, designs.get(index))}
    if task.orders != started.orders:
        widest = dict(list(rank(task, designs))[:_N_REFINED])
        designs |= _found_in(jobs.run_stage("refinements", partial(_go_on, refine, task, widest, plan), widest))
    audits = {index: audit_design(task, design) for index, design in rank(task, designs)}
    return Explored(designs, begun.reused, missing, tuple(jobs.lost), audits)


@dataclass
class _Jobs:
    """Stages of a search one after the other, with progress and why processes died."""

    task: Task
    plan: StartBudget
    identity: str
    run: Run
    lost: list[str] = field(default_factory=list)

    def run_stage(self, what: str, search: Callable[[int], ShapeCandidate | None], numbers: Iterable[int]) -> Done:
        """Return what the jobs of a stage led to; it is called by what its jobs are."""
        numbers = tuple(numbers)
        stage = Stage(OneStart(search, self.plan.clock), numbers, f"{self.identity} {what}")
        begun, ended = _shares(self.task)[what]

        def tell(records: Mapping[int, dict[str, Any]]) -> None:
            designs = [record["found"] for record in records.values() if record["found"]]
            feasible = sum(design["violation"] <= VIOLATION_TOL for design in designs)
            text = f"{len(records)} of {len(numbers)} {what}, {feasible} meet all limits"
            self.run.progress(begun + (ended - begun) * len(records) / max(1, len(numbers)), text)

        outcome = run_stage(stage, self.run, self.plan.clock, tell)
        self.lost += outcome.lost
        return outcome


def _shares(task: Task) -> dict[str, tuple[float, float]]:
    """Return between which shares of the whole search each stage of a task lies."""
    lasts = dict(_STAGE_DURATIONS)
    if task.objective != "range":
        lasts = {"starts": 1.0}
    elif task.orders == task.started.orders:
        del lasts["refinements"]
    ends = np.cumsum([0.0, *lasts.values()]) / sum(lasts.values())
    return dict(zip(lasts, pairwise(ends.tolist()), strict=True))


def _go_on(
    step: Callable[[Task, ShapeCandidate, StartBudget], ShapeCandidate],
    task: Task,
    designs: dict[int, ShapeCandidate],
    plan: StartBudget,
    index: int,
) -> ShapeCandidate:
    """Return what a step makes of the design of a start."""
    return step(task, designs[index], plan)


def _found_in(stage: Done) -> dict[int, ShapeCandidate | None]:
    """Return the designs of a stage by the number of the start; None if nothing could be followed."""
    records = {index: stage.records[index]["found"] for index in sorted(stage.records)}
    return {index: from_record(ShapeCandidate, record) if record else None for index, record in records.items()}


def _better(task: Task, candidate: ShapeCandidate | None, design: ShapeCandidate | None) -> bool:
    """Return True if one design of a start takes the place of the other."""
    if candidate is None or not candidate.feasible:
        return False
    return design is None or not design.feasible or rank_of(task, candidate) < rank_of(task, design)


def rank(task: Task, designs: Mapping[int, ShapeCandidate | None]) -> Iterator[tuple[int, ShapeCandidate]]:
    """Yield the designs that meet all limits, the best first."""
    yield from sorted(_keep_within_limits(designs), key=lambda item: rank_of(task, item[1]))


def _keep_within_limits(designs: Mapping[int, ShapeCandidate | None]) -> list[tuple[int, ShapeCandidate]]:
    return [(index, design) for index, design in designs.items() if design is not None and design.feasible]


def rank_of(task: Task, design: ShapeCandidate) -> tuple[bool, float, float]:
    """Return what orders designs: whether the band is kept and where the window begins, if it counts; the objective."""
    if task.objective != "range":
        return False, 0.0, design.objective
    return design.objective > task.half_band, design.start, design.objective
