"""From a task to a strip: the uniform one first, then more and more thicknesses, each from the one before."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.run_many_starts import UNLIMITED_CLOCK, Clock, OneStart, Stage, from_record, run_stage
from cfmkit.families.findings import mm, mpa, newton, percent
from cfmkit.families.run_control import Run
from cfmkit.families.slider_crank.findings import unreachable
from cfmkit.families.slider_crank.printed.sqp_program import METRES_PER_MM, Form, StripProgram
from cfmkit.numerics.sqp import Effort, Optimum, SearchEnding, minimize
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.printed.sqp_program import State, StripTask


VIOLATION_TOL = 5e-3  # of a constraint that counts as none: 0.005 % of the force, 0.05 % of the stress allowed


def descend(
    program: StripProgram,  # what is minimised
    start: FloatArray,  # (n,): moved into the bounds first
    bounds: FloatArray,  # (n, 2): smallest and largest values
    steps: int = 100,  # at most
    tolerance: float = 1e-6,  # change of the objective that ends the search
    clock: Clock = UNLIMITED_CLOCK,  # when it is late, the search ends, too
) -> Optimum:
    """Return where the steps from a start end."""
    return minimize(
        program,
        start,
        bounds,
        Effort(steps, tolerance, VIOLATION_TOL, clock.late, last=True, patience=MAX_IDLE_EVALUATIONS),
    )


MAX_IDLE_EVALUATIONS = 20
"""Evaluations without a smaller violation after which a search is stuck: two of the solver's line searches."""
N_COARSE_THICKNESSES = 5  # thicknesses of the first tapered strip; then twice as many intervals each time
COARSE_RIPPLE = 0.01  # ripple within which the coarse strip is sought: few thicknesses cannot keep less
START_DEVIATION = 0.15  # standard deviation of the logarithm of the thicknesses that other starts begin with
MIN_BAND_LENGTH = 2e-3  # length of the band that is sought at least [m]
MOST_RIPPLE = 100.0  # largest deviation from the force that a search for the smallest one considers [%]
MAX_BAND_WIDENING, N_NARROWING_STEPS = 0.1, 5
"""Largest share of the force by which a band is widened at first where it is out of reach, and steps back to it."""
INITIAL_THICKNESS = 1e-3  # thickness of one that is searched, at first [m]
_MAX_ROUNDS, _STEP_RTOL = 12, 1e-10
"""Steps at most, of which strips of the shipped specifications need four to six, and how near the last two lie."""


@dataclass(frozen=True)
class FoundStrip:
    """A strip that was found."""

    program: StripProgram  # of the last search
    ranges: FloatArray  # (n, 2): smallest and largest value of every number of its form
    descent: Optimum  # its outcome
    # that of one thickness, within `COARSE_RIPPLE` at least, for comparison; None if it has no equilibrium
    uniform: Optimum | None
    lost: tuple[str, ...] = ()  # why processes died that searched from other starts

    @property
    def values(self) -> FloatArray:
        """Numbers of the form."""
        return self.descent.z[: self.program.form.size]


def uniform_thickness(task: StripTask, width: float, guess: float = INITIAL_THICKNESS) -> float:
    """Return the thickness [m] with which a strip of one thickness has the force, on average of its extremes.

    The force follows the third power of the thickness but for stretching and shear: a few corrections do.
    """
    program = _make_uniform_program(task, width)
    wanted = np.asarray(task.share(program.travel(np.ones(2))))
    level = 0.5 * task.force * (wanted.max() + wanted.min())

    def step(thickness: float) -> float | None:
        state = _press_uniform(program, thickness)
        return None if state is None else float((level / _level(state)) ** (1.0 / 3.0))

    iterated = _iterate_thickness(step, guess)
    return guess if iterated is None else iterated


def uniform_for_stroke(task: StripTask) -> tuple[float, float] | None:
    """Return thickness and width [m] of the strip that has the allowable stress within the travel, and the force.

    The stress does not depend on the width and the force is proportional to it, nearly so in wide strips: first the
    thickness from the stress, then the width from the force. None if there is no stress limit or no equilibrium.
    """
    limit, width = task.material.allowable_stress, 5e-3
    if limit is None:
        return None

    def step(thickness: float) -> float | None:
        nonlocal width
        state = _press_uniform(_make_uniform_program(task, width), thickness)
        if state is None:
            return None
        factor = limit / _peak(state)
        width *= task.force / _level(state)
        width /= factor**3
        return factor

    thickness = _iterate_thickness(step, INITIAL_THICKNESS)
    return None if thickness is None else (thickness, width)


def uniform_for_width(task: StripTask, width: float) -> tuple[float, float] | None:
    """Return thickness [m] and largest stress [Pa] of the strip of a width [m] that has the force.

    The force goes nearly with the cube of the thickness. None if there is no equilibrium.
    """
    worst = 0.0

    def step(thickness: float) -> float | None:
        nonlocal worst
        state = _press_uniform(_make_uniform_program(task, width), thickness)
        if state is None:
            return None
        worst = _peak(state)
        return float((task.force / _level(state)) ** (1.0 / 3.0))

    thickness = _iterate_thickness(step, INITIAL_THICKNESS)
    return None if thickness is None else (thickness, worst)


def _iterate_thickness(step: Callable[[float], float | None], guess: float) -> float | None:
    """Return the thickness [m] that steps from a guess lead to, each by a factor; None if there is no factor."""
    thickness = guess
    for _ in range(_MAX_ROUNDS):
        factor = step(thickness)
        if factor is None:
            return None
        thickness *= factor
        if abs(factor - 1.0) < _STEP_RTOL:
            break
    return thickness


def _make_uniform_program(task: StripTask, width: float) -> StripProgram:
    """Return the program of strips of one thickness and of a width [m], over the travel of a task."""
    return StripProgram(replace(task, goal="ripple"), Form(1, width=width))


def _press_uniform(program: StripProgram, thickness: float) -> State | None:
    return program.state(np.array([thickness / METRES_PER_MM, 1.0]))


def _level(state: State) -> float:
    """Return the mean of the extremes of a force [N]."""
    return float(0.5 * (state.force.max() + state.force.min()))


def _peak(state: State) -> float:
    """Return the largest stress at the points of the travel [Pa]: at its end, unless the strip is pressed very far."""
    return float(state.path.peak_stress().value[state.path.at_requested].max())


@dataclass(frozen=True)
class StripSearch:
    """From the number of a start to the strip that it led to, from the uniform one on.

    The first one climbs from the uniform strip, from few thicknesses to all; the others begin with all of them, random.
    """

    task: StripTask
    form: Form
    ranges: FloatArray  # (n, 2): smallest and largest value of every number of the form
    seed: int = 0
    clock: Clock = UNLIMITED_CLOCK  # when it is late, no more is tried
    uniform: Optimum | None = None  # the best strip of one thickness; None if it has no equilibrium

    def find_uniform(self) -> Optimum | None:
        """Return the best strip of one thickness; None if it has no equilibrium."""
        width = self.form.width or float(self.ranges[-1].mean()) * METRES_PER_MM
        first = uniform_thickness(self.task, width, float(self.ranges[0].mean()) * METRES_PER_MM) / METRES_PER_MM
        wide = replace(self.task, ripple=max(self.task.ripple, COARSE_RIPPLE))
        search = StripSearch(wide, Form(1, width=width), self.ranges[:1], clock=self.clock)
        start = search.add_goal(np.array([first]), search.first_goal())
        descent = descend(StripProgram(wide, search.form), start, search.bounds(1), clock=self.clock)
        return None if descent.ending is SearchEnding.NO_ANSWER else descent

    def descend(self, number: int) -> Optimum:
        """Return where the last search of a start ended."""
        if not number:
            return self.climb(_ladder(self.form), 1.0)
        drawn = np.random.default_rng(self.seed).standard_normal((number, self.form.count))[-1]
        return self.climb((self.form.count,), np.exp(START_DEVIATION * drawn))

    def read(self, record: dict[str, Any]) -> FoundStrip:
        """Return the strip of a record."""
        ending = SearchEnding[record["found"]["ending"]]
        return self.make_strip(from_record(Optimum, record["found"] | {"ending": ending}))

    def make_strip(self, descent: Optimum) -> FoundStrip:
        """Return the strip at which a search ended."""
        return FoundStrip(StripProgram(self.task, self.form), self.ranges, descent, self.uniform)

    def climb(self, steps: tuple[int, ...], factors: FloatArray | float) -> Optimum:
        """Return the outcome of one start: every search begins where the one with fewer thicknesses ended."""
        task, form = self.task, self.form
        x, last = self.begin(steps[0])
        x[: steps[0]] *= factors
        for count in steps:
            now = replace(form, count=count)
            n_sizes = len(x) - (form.size - form.count)
            x = np.concatenate([_refine_nodes(x[:n_sizes], count), x[n_sizes:]])
            coarse = count < steps[-1]
            goal = replace(task, ripple=max(task.ripple, COARSE_RIPPLE)) if coarse else task
            effort = (20, 1e-3) if coarse else (100, 1e-9 if task.goal == "rms" else 1e-6)
            start, bounds = self.add_goal(x, last), self.bounds(count)
            descent = descend(StripProgram(goal, now), start, bounds, *effort, self.clock)
            x, last = descent.z[: now.size], descent.z[-1]
        return descent

    def tighten_band(self) -> Optimum | None:
        """Return the outcome of a band that begins as wide as the uniform strip needs it, made narrower in steps.

        Where a band is out of reach of the first strip, the steps towards it get stuck; those within bands do not. None
        where a wide band is missed by more than its own width: a narrower one is not reached from there.
        """
        task, form = self.task, self.form
        x, last = self.begin(form.count)
        missed = 0.0 if self.uniform is None else min(0.01 * self.uniform.violation, MAX_BAND_WIDENING)
        loose = max(task.ripple, COARSE_RIPPLE) + missed
        for ripple in np.geomspace(loose, task.ripple, N_NARROWING_STEPS).tolist():
            program = StripProgram(replace(task, ripple=ripple), form)
            descent = descend(program, np.append(x, last), self.bounds(form.count), clock=self.clock)
            if ripple > task.ripple and 0.01 * descent.violation > ripple:
                return None
            x, last = descent.z[: form.size], descent.z[-1]
        return descent

    def begin(self, count: int) -> tuple[FloatArray, float]:
        """Return the first numbers of a search with so many thicknesses, and the first value of the goal."""
        middle = self.ranges.mean(axis=1)
        if self.uniform is not None and not (self.form.per_piece or self.form.shares):
            middle = np.concatenate([np.full(count, self.uniform.z[0]), middle[self.form.count :]])
        return middle, self.first_goal()

    def first_goal(self) -> float:
        """Return the stroke [cm] or the ripple [%] that a search begins with."""
        if self.task.goal != "stroke":
            return 2.0
        usable = self.uniform if self.uniform is not None and np.isfinite(self.uniform.violation) else None
        return 100.0 * self.task.stroke if usable is None else float(usable.z[-1])

    def add_goal(self, x: FloatArray, goal: float) -> FloatArray:
        """Return the variables of a search: numbers of a form, and what is sought unless that is no variable."""
        return x if self.task.goal == "rms" else np.append(x, goal)

    def bounds(self, count: int) -> FloatArray:
        """Return the bounds of a search with another number of thicknesses, and of its goal."""
        n, task = self.form.count, self.task
        thickness = self.ranges[:n] if count == n else np.tile(self.ranges[0], (count, 1))
        rows = np.concatenate([thickness, self.ranges[n:]])
        if task.goal == "rms":
            return rows
        stroke = [100.0 * (task.start + MIN_BAND_LENGTH), 100.0 * task.longest]
        return np.concatenate([rows, [stroke if task.goal == "stroke" else [1e-3, MOST_RIPPLE]]])


def search(
    task: StripTask,
    form: Form,
    ranges: FloatArray,  # (n, 2): smallest and largest value of every number of the form
    starts: int,  # how many, the uniform strip included
    run: Run,
    identity: str = "",  # of everything that decides the outcome of a start but its number
    clock: Clock = UNLIMITED_CLOCK,  # when it is late, no more is tried
) -> FoundStrip | Design:
    """Return the best strip found, from the uniform one coarse to fine, and from random ones where asked.

    A `Design` says why there is none, where no start was completed.
    """

    def tell(records: Mapping[int, Any]) -> None:
        count = len(records)
        run.progress(count / starts, f"start {count + 1} of {starts}" if count < starts else "done")

    work = StripSearch(task, form, ranges, run.seed, clock)
    work = replace(work, uniform=work.find_uniform())
    means = run if starts > 1 else replace(run, executor=Run().executor)  # one alone is not worth a process
    outcome = run_stage(Stage(OneStart(work.descend, clock), tuple(range(starts)), identity), means, clock, tell)
    if not outcome.records:
        return _explain_no_strip(outcome.lost)
    strips = [_with_its_ripple(work.read(outcome.records[number])) for number in sorted(outcome.records)]
    best = min(strips, key=lambda strip: _rank(strip.descent))
    unsure = not (best.descent.feasible and best.descent.ending is SearchEnding.OPTIMUM)
    if task.goal == "stroke" and unsure and (tightened := work.tighten_band()) is not None:
        best = min((best, work.make_strip(tightened)), key=lambda strip: _rank(strip.descent))
    return replace(best, lost=outcome.lost)


def _with_its_ripple(strip: FoundStrip) -> FoundStrip:
    """Return a strip with the ripple that it has, where a search for the smallest one ended with a smaller number.

    Such a search may stop on its way; no ripple is too large for it, and the strip is one.
    """
    descent, program = strip.descent, strip.program
    if program.task.goal != "ripple" or descent.feasible or (seen := program.evaluate(descent.z, False)) is None:
        return strip
    z = descent.z.copy()
    z[-1] -= min(float(rows.values.min()) for rows in seen.rows if rows.name == "band")
    if z[-1] > MOST_RIPPLE or (answer := program.values(z)) is None:
        return strip
    return replace(strip, descent=replace(descent, z=z, objective=answer[0], constraints=answer[1]))


def _explain_no_strip(lost: tuple[str, ...]) -> Design:
    """Return why no start led to anything."""
    if lost:
        return Design(None, Status.CRASHED, f"no start was completed: {'; '.join(lost)}")
    return unreachable("the time budget ended before any start led to a strip: increase it")


def _rank(descent: Optimum) -> tuple[bool, float]:
    return not descent.feasible, descent.objective if descent.feasible else descent.violation


def _ladder(form: Form) -> tuple[int, ...]:
    """Return the numbers of thicknesses that are gone through."""
    if form.per_piece or form.shares or form.count <= N_COARSE_THICKNESSES:
        return (form.count,)
    count, steps = N_COARSE_THICKNESSES, [N_COARSE_THICKNESSES]
    while 2 * count - 1 < form.count:
        count = 2 * count - 1
        steps.append(count)
    return (*steps, form.count)


def _refine_nodes(values: FloatArray, count: int) -> FloatArray:
    """Return thicknesses on more nodes, the same strip."""
    old = np.linspace(0.0, 1.0, len(values))
    return values if len(values) == count else np.interp(np.linspace(0.0, 1.0, count), old, values)


def infeasible(strip: FoundStrip) -> Design:
    """Return what the nearest strip misses, and the target that it would meet."""
    descent, program, task = strip.descent, strip.program, strip.program.task
    if descent.ending is SearchEnding.NO_ANSWER:
        why = "the first strip has no equilibrium over 'design.travel'; reduce it, or for other ranges in 'design.beam'"
        return unreachable(f"the search could not begin: {why}")
    if descent.ending is SearchEnding.OUT_OF_TIME:
        return unreachable("the time budget ended before a strip met its targets: increase it")
    state = program.state(descent.z)
    if state is None:
        return unreachable(f"the search {descent.ending.value}; change 'design.travel' or 'design.beam'")
    low, high = float(state.force.min()), float(state.force.max())
    level, missed, nearest = 0.5 * (low + high), [], {}
    ratio, limit = state.force / task.force - task.share(program.travel(descent.z)), task.material.allowable_stress
    off = float(np.abs(ratio).max())
    if off > program.ripple(descent.z):
        missed.append(f"is up to {percent(off)} off the force")
        flat = task.shape is None and high - low <= 2.0 * level * program.ripple(descent.z)
        name = "design.force" if flat else "design.tolerance"
        nearest[name] = newton(task.sum_over_sets(level)) if flat else format_short(off, "ratio")
    worst = float(state.stress.max())
    if limit is not None and worst > limit * (1.0 + 0.1 * VIOLATION_TOL):
        missed.append(f"has a stress of {mpa(worst)}")
        nearest["allowable stress"] = mpa(worst)
    text = (
        f"no strip within the ranges keeps the force, the band and the stress: from {mm(task.start)} to "
        f"{mm(program.stroke(descent.z))} the nearest {' and '.join(missed)} ({descent.ending.value}); change "
        "'design.force', 'design.travel' or the ranges in 'design.beam'"
    )
    return unreachable(text, nearest)
