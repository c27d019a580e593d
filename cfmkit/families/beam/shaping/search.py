"""One start of the search: a random network, made to meet the limits, then flattened order by order, then widened.

A start begins with beams that bend only, whatever the model of the task: what is flat and within the limits there is
nearly so where beams stretch and shear, too, and is taken on from there in the model of the task.

A flat force and low stress seldom come together in a random network. One that is flat is easy to draw, and the stress
can be brought down while it stays flat: so the limits are met first, with the half band capped, by letting all of them
give way by one amount that is minimised. The other way round ends in stiff springs that meet every limit.

What comes out is judged at many more poses than were searched with. Where force or stress between the poses are not
what the poses say, the search goes on with more of them; what a design is ranked by is what was seen at many poses.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.rounded_and_reported_values import round_within_bounds
from cfmkit.designing.run_many_starts import Clock
from cfmkit.families.beam.shaping.limits import LIMIT_FUNCTIONS
from cfmkit.families.beam.shaping.response import view_closely
from cfmkit.families.beam.shaping.sqp_program import BAND_WEIGHT, Flattest, ForceRatio, Shaping, Widest
from cfmkit.families.beam.shaping.task_and_variables import Variables, candidates
from cfmkit.numerics.sqp import Effort, Optimum, minimize

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.beam.shaping.limits import View
    from cfmkit.families.beam.shaping.response import CloseView
    from cfmkit.families.beam.shaping.task_and_variables import Task


VIOLATION_TOL = 1e-4  # a limit missed by less than this share holds
COORDINATE_DECIMALS, COEFFICIENT_DECIMALS = 7, 6  # decimals of designed coordinates [m] and coefficients [rad]
_MAX_WIDENINGS = 3  # minimisations, each from the last
_MIN_WINDOW_GAIN = 2e-3  # of the end of the window: a gain that is not worth another one
_REPAIRABLE_VIOLATION = 2e-3  # a limit missed by less is repaired afterwards
_GIVEN_UP_SHARE = 0.1  # of the gain is given up where it cannot be
_OBJECTIVE_TOL = 1e-5  # of the objective
_MAX_IDLE_EVALUATIONS = 50  # without a better point: nearly a third of all evaluations came after so many
_START_HALF_BAND = 0.05  # a random network with this half band is flat enough to begin with
_BAND_SHARE = 0.5  # of the band of the widest window: flat enough to be taken on to the model of the task
_NEAR_ROWS = 0.5  # of a limit: of rows that hold by more than this no derivatives are needed
_MAX_BAND_RATIO = 3.0  # times that band: so far from it, what bends only is not taken on
_FAR_START = 0.5  # of the start of the requested window: where the window begins that starts are compared over
_N_WINDOW_POSES = 9  # poses in that window
_MAX_ROUNDS = 6  # towards the limits
_MAX_VIOLATION = 0.1  # of a limit: what bends only and misses one by so much is not taken on in the task's model
_SPRING_HALF_BAND = 0.2  # one with this is a spring, and not looked at further
_FINER_POSE_COUNTS = (33, 65)  # poses in the window where the first 17 do not show what the force does
_BAND_RATIO_TOL = 1.01  # a half band at many poses that is within this and the next of that at few
_OBJECTIVE_ATOL = 1e-4
_BAND_WEIGHT = 20.0  # what a half band beyond that counts against the violation of the limits


@dataclass(frozen=True)
class StartBudget:
    """Effort at one start."""

    drawn: int = 80  # random networks that are looked at
    tries: int = 4  # how many of the best are made to meet the limits until one does
    meeting: int = 12  # steps of one round towards the limits
    flattening: int = 40  # steps of one flattening
    widening: int = 50  # steps of one widening of the window
    clock: Clock = field(default_factory=Clock)  # whether the time is up

    def late(self) -> bool:
        """Return True if the time is up."""
        return self.clock.late()

    def effort(self, steps: int, enough: float = -np.inf, violation: float = VIOLATION_TOL) -> Effort:
        """Return the effort of one minimisation."""
        return Effort(steps, _OBJECTIVE_TOL, violation, self.late, enough, idle=_MAX_IDLE_EVALUATIONS)


@dataclass(frozen=True)
class ShapeCandidate:
    """A design on the way."""

    # x, order, (k,): the design variables and the order of their shapes
    x: FloatArray
    order: int
    start: float  # where the window begins [m]
    objective: float  # half band over the window, or the objective of the paper [1]
    violation: float  # by how much the worst limit is missed, in its own scale [1]
    ending: str  # why the last minimisation ended
    evaluations: int  # traces of the network so far
    points: int = 17  # poses in the window that it was searched with last

    @property
    def feasible(self) -> bool:
        """Whether all limits hold."""
        return self.violation <= VIOLATION_TOL

    def network(self, task: Task) -> Network:
        """Return the network that it is."""
        return Variables(task, self.order).build(self.x)

    def view(self, task: Task) -> View | None:
        """Return it in the poses of its window; None if it cannot be followed."""
        return Shaping(Variables(task, self.order), self.start, Flattest()).view(self.x)


def search_start(task: Task, seed: int, index: int, plan: StartBudget) -> ShapeCandidate | None:
    """Return what a start leads to; None if no random network could be followed over the window.

    The same seed of the run and index of the start give the same answer.
    """
    first, rng = task.first, np.random.default_rng([seed, index])
    begun = _begin_network(first, rng, plan)
    if begun is None and first is not task:  # straight beams that cannot stretch may not be able to move at all
        first, begun = task, _begin_network(task, rng, plan)
    if begun is None:
        return None
    if first is task:
        return polish(task, begun, plan)
    enough = _BAND_SHARE * task.half_band if task.objective == "range" else -np.inf
    design = evaluate_in_model(task, flatten(first, begun, plan, enough))
    is_far_off = task.objective == "range" and design.objective > _MAX_BAND_RATIO * task.half_band
    if design.violation > _MAX_VIOLATION or is_far_off:
        return design
    return polish(task, design if design.feasible else satisfy_limits(task, design, design.order, plan), plan)


def search_far(task: Task, seed: int, index: int, plan: StartBudget) -> ShapeCandidate | None:
    """Return the random network of a start flattened in the finest order at once, over a window that begins farther.

    It begins halfway between rest and the requested window. What is flat over that seldom is the flattest over the
    requested one: order by order a start ends in another family of shapes. None if nothing could be followed.
    """
    task = replace(task, orders=task.orders[-1:], points=_N_WINDOW_POSES)
    first, far = task.first, _FAR_START * task.window[0]
    begun = _begin_network(first, np.random.default_rng([seed, index]), replace(plan, tries=1))
    if begun is None:
        return None
    design = flatten(first, evaluate_in_model(first, replace(begun, start=far)), plan)
    if first is task:
        return design
    design = evaluate_in_model(task, design)
    hopeless = design.violation > _MAX_VIOLATION or design.objective > _MAX_BAND_RATIO * task.half_band
    return design if hopeless else flatten(task, design, plan)


def search_nearer(task: Task, design: ShapeCandidate, plan: StartBudget) -> ShapeCandidate:
    """Return a design that was flattened over a window that begins farther, flattened and widened as any other."""
    far = evaluate_in_model(task, design)
    flat = far.feasible and far.objective <= task.half_band
    return widen(task, polish(task, far if flat else replace(far, start=task.window[0]), plan), plan)


def _begin_network(task: Task, rng: np.random.Generator, plan: StartBudget) -> ShapeCandidate | None:
    """Return a random network that was made to meet the limits, or that misses them least; None without any."""
    best: ShapeCandidate | None = None
    evaluations = plan.drawn
    for first in draw_networks(task, rng, plan)[: plan.tries]:
        candidate = satisfy_limits(task, replace(first, evaluations=evaluations), _coarse(task), plan)
        evaluations = candidate.evaluations
        if best is None or candidate.violation < best.violation:
            best = candidate
        if best.feasible or plan.late():
            break
    if best is None:
        return None
    best = replace(best, evaluations=evaluations)
    return best if best.feasible else satisfy_limits(task, best, task.orders[-1], plan)


def evaluate_in_model(task: Task, design: ShapeCandidate) -> ShapeCandidate:
    """Return a design that was found in another model with objective and limits as they are in that of the task."""
    view = design.view(task)
    if view is None:
        return replace(design, objective=np.inf, violation=np.inf)
    objective = design.objective if task.objective == "paper" else view.half_band
    return replace(design, objective=objective, violation=view.violation, evaluations=design.evaluations + 1)


def polish(task: Task, design: ShapeCandidate, plan: StartBudget) -> ShapeCandidate:
    """Return a design flattened in every order from its own on, as it is at many poses."""

    def again(finer: Task, design: ShapeCandidate) -> ShapeCandidate:
        return _minimise_objective(finer, design, design.order, plan, plan.flattening)

    return verify(task, flatten(task, design, plan), plan, again)


def flatten(task: Task, design: ShapeCandidate, plan: StartBudget, enough: float = -np.inf) -> ShapeCandidate:
    """Return a design flattened in every order from its own on, in each until the half band is small enough."""
    for order in task.orders:
        if order >= design.order and not plan.late():
            design = _minimise_objective(task, design, order, plan, plan.flattening, enough)
    return design


def verify(
    task: Task, design: ShapeCandidate, plan: StartBudget, again: Callable[[Task, ShapeCandidate], ShapeCandidate]
) -> ShapeCandidate:
    """Return a design with objective, window and limits as they are at many poses; one that misses a limit as it is.

    `again` searches on, from a task with more poses and a design.
    """
    if not design.feasible:
        return design
    for points in (*(more for more in _FINER_POSE_COUNTS if more > task.points), None):
        design = round_design(task, design)
        view = view_closely(task, design.network(task))
        design = replace(design, evaluations=design.evaluations + 1)
        if points is None or plan.late() or _shows_all(task, design, view):
            break
        more = again(replace(task, points=points), design)
        design = replace(more, points=points)
        if not design.feasible:
            return design
    return _as_seen(task, design, view)


def _shows_all(task: Task, design: ShapeCandidate, view: CloseView | None) -> bool:
    """Return True if a design is at many poses what it was found to be at those of the search."""
    if view is None or _overstress(task, view) > 0:
        return False
    if task.objective == "paper":
        return True
    if task.objective == "range" and design.objective <= task.half_band:
        return view.widest(task.half_band) <= design.start + _MIN_WINDOW_GAIN * task.window[1]
    return view.half_band(design.start) <= _BAND_RATIO_TOL * design.objective + _OBJECTIVE_ATOL


def _as_seen(task: Task, design: ShapeCandidate, view: CloseView | None) -> ShapeCandidate:
    """Return a design with what was seen at many poses: half band, widest window, stress."""
    if view is None:
        return replace(design, violation=np.inf)
    design = replace(design, violation=max(design.violation, _overstress(task, view)))
    if task.objective == "paper":
        return design
    starts = [design.start]
    if task.objective == "range":
        widest = min(view.widest(task.half_band), task.window[0])  # no less than the window that was requested
        wider = design.start < task.window[0]  # one that was not widened yet is left as flat as it is
        starts = [widest, design.start] if wider and widest < design.start else [max(widest, design.start)]
    for start in starts:  # the mean force is over another window
        moved = None if start == design.start else evaluate_in_model(task, replace(design, start=start))
        violation = design.violation if moved is None else max(design.violation, moved.violation)
        if violation <= VIOLATION_TOL:
            break
    return replace(design, start=start, objective=view.half_band(start), violation=violation)


def _overstress(task: Task, view: CloseView) -> float:
    """Return by which share the stress at many poses exceeds the allowable one; zero where it does not."""
    allowed = task.allowable_stress
    return 0.0 if allowed is None else max(0.0, float(view.stress.max()) / allowed - 1.0)


def round_design(task: Task, design: ShapeCandidate) -> ShapeCandidate:
    """Return a design with coordinates and coefficients that print short."""
    places, bounds = len(task.coordinates), Variables(task, design.order).bounds
    coordinates = round_within_bounds(design.x[:places], bounds[:places], COORDINATE_DECIMALS, task.size)
    coefficients = round_within_bounds(design.x[places:], bounds[places:], COEFFICIENT_DECIMALS)
    return replace(design, x=np.append(coordinates, coefficients))


def draw_networks(task: Task, rng: np.random.Generator, plan: StartBudget) -> list[ShapeCandidate]:
    """Return random networks that can be followed over the window, the most promising first.

    Straight ones; curved ones too where those cannot move, as a single beam that does not stretch.
    """
    networks: list[ShapeCandidate] = []
    for order in dict.fromkeys((0, _coarse(task))):
        variables = Variables(task, order)
        program = Shaping(variables, task.window[0], Flattest())
        for number, x in enumerate(candidates(variables, rng)):
            if number >= plan.drawn or plan.late():
                break
            view = program.view(x)
            if view is not None:
                excess = view.violation if view.half_band < _SPRING_HALF_BAND else np.inf
                networks.append(ShapeCandidate(x, order, task.window[0], view.half_band, excess, "", 1))
        if len(networks) >= plan.tries:
            break

    def rank(network: ShapeCandidate) -> tuple[float, float]:
        excess = _BAND_WEIGHT * max(0.0, network.objective - _START_HALF_BAND)
        return network.violation + excess, network.objective

    return sorted(networks, key=rank)


def _coarse(task: Task) -> int:
    """Return the lowest order that bends a beam, if there is one."""
    return next((order for order in task.orders if order), task.orders[-1])


def satisfy_limits(
    task: Task,
    design: ShapeCandidate,
    order: int,
    plan: StartBudget,
    give: tuple[str, ...] = tuple(LIMIT_FUNCTIONS),
    share: float = 0.5,
) -> ShapeCandidate:
    """Return a design that misses some limits as little as possible, at a half band that is no larger or small enough.

    Given up where a round does not bring what is missed below a share of what it was.
    """
    cap = max(_START_HALF_BAND, 1.1 * design.objective)
    variables, x = Variables(task, design.order).change_order(design.x, max(order, design.order))
    program = Shaping(variables, design.start, Flattest(), give, cap, _NEAR_ROWS)
    for _ in range(_MAX_ROUNDS):
        z = program.begin(x)
        if z is None:
            return design
        optimum = minimize(program, z, program.bounds, plan.effort(plan.meeting, enough=0.0))
        now, before = design_from_optimum(program, optimum, design.evaluations), design.violation
        design = now if now.violation < before else replace(design, evaluations=now.evaluations)
        if design.feasible or not design.violation < share * before or plan.late():
            break
        x = design.x
    return design


def _minimise_objective(
    task: Task, design: ShapeCandidate, order: int, plan: StartBudget, steps: int, enough: float = -np.inf
) -> ShapeCandidate:
    """Return a design with the objective minimised, as far as is enough; the one before where that is better."""
    variables, x = Variables(task, design.order).change_order(design.x, order)
    goal = ForceRatio() if task.objective == "paper" else Flattest()
    program = Shaping(variables, design.start, goal, slopes_below=_NEAR_ROWS)
    z = program.begin(x)
    if z is None:
        return design
    optimum = minimize(program, z, program.bounds, plan.effort(steps, BAND_WEIGHT * enough))
    now = design_from_optimum(program, optimum, design.evaluations)
    worse = design.feasible and not now.feasible
    return replace(design, evaluations=now.evaluations) if worse else now


def design_from_optimum(program: Shaping, optimum: Optimum, before: int = 0) -> ShapeCandidate:
    """Return an optimum as a design; its objective is measured anew, without the help of the goal's own variables."""
    variables, goal = program.variables, program.goal
    x, values = np.split(optimum.z, [variables.count])
    start = goal.window_start(values, program.start)
    view = program.view(x, start)
    violation = np.inf if view is None else view.violation
    objective = optimum.objective if isinstance(goal, ForceRatio) or view is None else view.half_band
    ending, evaluations = optimum.ending.value, before + optimum.evaluations
    return ShapeCandidate(x, variables.order, start, objective, violation, ending, evaluations)


def widen(task: Task, design: ShapeCandidate, plan: StartBudget) -> ShapeCandidate:
    """Return the design with the widest window in which the force stays in the wanted band.

    The start of the window is a variable like all others; the window grows from the last design, whose force is flatter
    than it has to be.
    """
    if task.objective != "range" or not (design.feasible and design.objective <= task.half_band):
        return design
    good, task = design, replace(task, points=design.points)
    refuted: list[ShapeCandidate] = []

    def again(finer: Task, design: ShapeCandidate) -> ShapeCandidate:
        refuted.append(design)
        return _repair(finer, design, replace(good, evaluations=design.evaluations), plan)

    wide = verify(task, _widest(task, good, plan), plan, again)
    # what more poses refute keeps the band over a narrower window, which may be wider than what the repair came to
    narrower = (_as_seen(task, shape, view_closely(task, shape.network(task))) for shape in refuted)
    kept = [shape for shape in (good, *narrower, wide) if shape.feasible and shape.objective <= task.half_band]
    widest = min(reversed(kept), key=lambda shape: shape.start)
    return replace(widest, evaluations=wide.evaluations + len(refuted))


def refine(task: Task, design: ShapeCandidate, plan: StartBudget) -> ShapeCandidate:
    """Return a widened design flattened and widened again in every finer order; never one with a narrower window."""
    for order in task.orders:
        if order > design.order and design.objective <= task.half_band and not plan.late():
            flat = _minimise_objective(task, design, order, plan, plan.flattening)
            finer = widen(task, flat, plan)
            wider = finer.feasible and finer.start < design.start
            design = finer if wider else replace(design, evaluations=finer.evaluations)
    return design


def _widest(task: Task, design: ShapeCandidate, plan: StartBudget) -> ShapeCandidate:
    """Return the widest window at the poses of the search."""
    goal = Widest(task.window[1], task.half_band)
    for _ in range(_MAX_WIDENINGS):
        program = Shaping(Variables(task, design.order), design.start, goal, slopes_below=_NEAR_ROWS)
        z = program.begin(design.x)
        if z is None or plan.late():
            return design
        effort = plan.effort(plan.widening, violation=_REPAIRABLE_VIOLATION)
        wide = design_from_optimum(program, minimize(program, z, program.bounds, effort), design.evaluations)
        now = _repair(task, wide, design, plan)
        gain, design = design.start - now.start, now
        if not gain > _MIN_WINDOW_GAIN * task.window[1]:
            break
    return design


def _repair(task: Task, wide: ShapeCandidate, good: ShapeCandidate, plan: StartBudget) -> ShapeCandidate:
    """Return a design near one that all but meets the limits, that does, at nearly its window; else the good one."""
    start = wide.start
    while start < good.start and not plan.late():
        now = _minimise_objective(task, replace(wide, start=start), wide.order, plan, plan.meeting)
        if now.feasible and now.objective <= task.half_band:
            return now
        wide = replace(wide, evaluations=now.evaluations)
        start += _GIVEN_UP_SHARE * (good.start - start) + _MIN_WINDOW_GAIN * task.window[1]
    return replace(good, evaluations=wide.evaluations)
