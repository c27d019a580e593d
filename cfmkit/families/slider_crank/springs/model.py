"""Analysis of slider-cranks with springs, one or rows: torque over angle or force over travel; slopes by the rates.

The torque is the derivative of the energy by the crank angle [LH, eq. 10 and 12], the force that
by the slider's travel: what the slider pushes back with while it is moved towards the pivot.

Efforts and energies are linear in the springs' rates, so their derivatives by the rates are exact. A largest or
smallest value changes with the rate as the value does in its place: that the place itself moves is of second order.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import LazySequence, distinct
from cfmkit.curves import Column, Curve
from cfmkit.families.end_stops import STOP_QUANTITIES
from cfmkit.families.findings import CannotBuild, deg, mm, no_result
from cfmkit.families.rows import (
    SolvedRows,
    columns_of_absent_values,
    drop_numbers,
    findings_of_one,
    values_of_one,
    with_values,
)
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.linkage import resolve
from cfmkit.families.slider_crank.printed.scalar_results import SCALAR_DEFINITIONS as OF_PARTS
from cfmkit.families.slider_crank.springs.findings import rules_of
from cfmkit.families.slider_crank.springs.hardware import hardware
from cfmkit.families.slider_crank.springs.largest_turns_and_forces import is_wide
from cfmkit.families.slider_crank.springs.scalar_results import SCALAR_QUANTITIES
from cfmkit.families.slider_crank.springs.solution import ClosedFormEffort, Solution, target_of
from cfmkit.families.slider_crank.springs.sprung_linkage import FULL_TURN, asked_motion, assemble
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES
from cfmkit.metrics.branches import find_between_ends
from cfmkit.numerics.interpolation import bisect
from cfmkit.results import Result, Status
from cfmkit.stock.parts_list import parts_tables

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.rows import Variants
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.results import Finding
    from cfmkit.stock.parts_list import ListedPart


Ends = tuple[float, float]

RATE_KEYS = {f"mechanism.springs.{name}": row for row, name in enumerate(JOINT_NAMES)}
"""Where a specification has the rates, and the rows of the springs."""
ROWS_TOGETHER = 64  # mechanisms that are solved together: few enough for their grids to stay in a processor's cache
ROW_COLUMNS = columns_of_absent_values(OF_PARTS | STOP_QUANTITIES) | dict(SCALAR_QUANTITIES)
"""What studies may ask of rows: of values that only printed parts and stops have their cells are empty."""


def analyze(spec: SliderCrankSpec, _run: Run) -> Result:
    """Return the torque or force curve of a slider-crank, with everything that is wrong with it.

    NO_EQUILIBRIUM if the mechanism cannot be built, PARTIAL if the linkage does not reach all of the requested motion.
    """
    try:
        spec = resolve(spec)
        assembly = assemble(spec)
        solution, shortfalls = solve(spec, assembly)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    stuck, model = _describe_locked(solution), ClosedFormEffort(solution)
    return Result(
        spec=_as_run(spec, assembly),
        status=Status.PARTIAL if shortfalls or stuck else Status.COMPLETE,
        message=shortfalls[0].message if shortfalls else stuck,
        curves=(_curve(solution),),
        values=values_of_one(SCALAR_QUANTITIES, solution),
        warnings=LazySequence(partial(_findings, solution, shortfalls)),
        travel=asked_motion(spec, assembly),
        target=target_of(spec),
        reference=float(solution.reference[0, 0]),
        closed=model,
        effort_error=float(solution.effort_error[0]),
        part_efforts=model.part_efforts,
        tables=parts_tables(partial(_hardware_parts, spec, solution)),
        state=solution,
    )


def _findings(solution: Solution, shortfalls: Sequence[Finding]) -> Iterator[Finding]:
    yield from shortfalls
    said = {item.name for item in shortfalls}
    warnings = findings_of_one(rules_of(solution), finding, solution)
    yield from (item for item in warnings if item.name not in said)


def _hardware_parts(spec: SliderCrankSpec, solution: Solution) -> tuple[ListedPart, ...]:
    return tuple(hardware(spec, solution).parts)


def solve_rows(variants: Variants) -> Iterator[tuple[NDArray[np.intp], SolvedRows[Solution]]]:
    """Yield (indices, mechanisms that are solved together) of those that go through all of the motion."""
    alike: dict[Hashable, list[int]] = {}
    built: dict[int, tuple[SliderCrankSpec, Assembly, Ends]] = {}
    plain = _plain_numbers(variants.spec, variants.as_made)
    kind = repr(_kind(variants.spec)) if plain >= variants.values.keys() else None
    for index, spec in variants.validate_each(plain):
        if spec.fidelity != "prb" or not any(spec.mechanism.springs.rates):
            continue
        try:
            assembly = assemble(spec)
        except CannotBuild:
            continue
        asked = asked_motion(spec, assembly)
        if assembly.clip_motion(*asked) == asked:
            built[index] = spec, assembly, asked
            own_kind = repr(_kind(spec)) if kind is None else kind
            key = own_kind, spec.target_curve, *_friction_kinds(assembly), is_wide(assembly, *asked)
            alike.setdefault(key, []).append(index)
    for members in alike.values():
        for start in range(0, len(members), ROWS_TOGETHER):
            chosen = members[start : start + ROWS_TOGETHER]
            solution = _solution(*zip(*(built[index] for index in chosen), strict=True))
            yield np.array(chosen), SolvedRows(solution, ROW_COLUMNS, rules_of(solution), _is_complete(solution))


def _plain_numbers(spec: SliderCrankSpec, as_made: bool) -> set[str]:
    """Return the numbers for which it is enough to be within bounds of their own."""
    mechanism, springs = spec.mechanism, spec.mechanism.springs
    if mechanism.flexures is not None or mechanism.beam is not None:
        return set()
    lengths = ("crank_length", "coupler_length", "stretched_position", "offset", "unloaded_angle", "unloaded_offset")
    wound = set() if as_made else {spring.at for spring in springs.bought}
    rates = springs.model_fields_set & set(JOINT_NAMES) - wound
    stated = {f"mechanism.{name}" for name in lengths if getattr(mechanism, name) is not None}
    return stated | {f"mechanism.springs.{name}" for name in rates} | {"analysis.tolerance"}


def _kind(spec: SliderCrankSpec) -> tuple[Any, ...]:
    """Return what mechanisms that are solved together have in common: all but the values of numbers."""
    return tuple(map(drop_numbers, (spec.mechanism, spec.analysis, spec.design)))


def _friction_kinds(assembly: Assembly) -> tuple[bool, ...]:
    """Return what rubs: it decides which formulas hold."""
    rubbing = assembly.rubbing
    return rubbing.is_present, rubbing.guide.friction > 0, rubbing.pin > 0


def _solution(specs: Sequence[SliderCrankSpec], assemblies: Sequence[Assembly], motions: Sequence[Ends]) -> Solution:
    """Return mechanisms of one kind over their motions."""
    ends = np.array(motions)
    ends = ends[:1] if (ends == ends[0]).all() else ends
    motion = np.linspace(ends[:, 0], ends[:, 1], specs[0].analysis.points, axis=1)
    return Solution(tuple(specs), tuple(assemblies), motion, ends[:, :1], ends[:, 1:])


def _is_complete(solution: Solution) -> NDArray[np.bool_]:
    """Return which mechanisms have an effort at every point and place of the grid, (m,)."""
    curves = [solution.curve.value, *solution.branch_efforts.values()]
    return np.asarray(np.all([np.isfinite(values).all(axis=1) for values in curves], axis=0))


def solve(spec: SliderCrankSpec, assembly: Assembly) -> tuple[Solution, tuple[Finding, ...]]:
    """Return the solution over what the linkage reaches of the requested motion, and why that is less.

    Raises CannotBuild if it reaches nothing of it.
    """
    asked = asked_motion(spec, assembly)
    start, stop = assembly.clip_motion(*asked)
    short = tuple(_shortfalls(assembly, asked, (start, stop)))
    if short and not start < stop:
        raise CannotBuild(short[0])
    solution = _solution([spec], [assembly], [(start, stop)])
    finite = np.isfinite(solution.unit_spring_curves.effort[assembly.rates > 0.0, 0]).all(axis=0)
    if not finite.all():  # where springs are relaxed in a dead point of the crank: 0/0 in that place alone
        solution = replace(solution, motion=solution.motion[:, finite])
    return solution, short


def _shortfalls(assembly: Assembly, asked: Ends, run: Ends) -> Iterator[Finding]:
    """Yield why the motion that is run through is less than what is requested."""
    reach = assembly.reach
    slack = 1e-9 * (asked[1] - asked[0])
    beyond = asked[0] < reach[0] - slack or asked[1] > reach[1] + slack
    ends = zip(assembly.poles, reach, run, asked, strict=True)
    poles = [(pole, end) for unbound, pole, end, wanted in ends if unbound and end != wanted]
    if assembly.drive == "torque":
        if beyond or poles:
            yield _explain_dead_point(assembly, asked, reach)
        return
    if beyond:
        yield finding(
            "out_of_reach",
            f"from the unloaded position the slider can travel {mm(reach[0])} to {mm(reach[1])}, and {mm(asked[0])} to "
            f"{mm(asked[1])} are requested; change 'analysis.travel'",
        )
    if poles:
        yield find_unbounded(poles)


def _explain_dead_point(assembly: Assembly, asked: Ends, reach: Ends) -> Finding:
    whole = asked[1] - asked[0] >= FULL_TURN * (1 - 1e-9)
    return finding(
        "no_full_turn" if whole else "coupler_dead_point",
        f"the crank reaches {deg(reach[0])} to {deg(reach[1])}, and {deg(asked[0])} to {deg(asked[1])} are "
        f"requested: at the ends the coupler is perpendicular to the guide; reduce 'analysis.angle', or make "
        f"'mechanism.coupler_length' more than {mm(assembly.linkage.crank + abs(assembly.linkage.offset))} "
        "for full turns",
    )


def find_unbounded(poles: Sequence[tuple[float, float]]) -> Finding:
    """Return that the force grows without bound at some travels, and where the curve ends before them [m]."""
    places = " and ".join(mm(pole) for pole, _end in poles)
    ends = " and ".join(mm(end) for _pole, end in poles)
    return finding(
        "force_unbounded",
        f"at {places} of travel crank and coupler are in one line and the springs are not relaxed: no finite force "
        f"moves the slider there; the curve ends before, at {ends}",
        short=f"no finite force moves the slider at {places}; the curve ends at {ends}",
    )


def _as_run(spec: SliderCrankSpec, assembly: Assembly) -> SliderCrankSpec:
    """Return the spec with the defaults of the analysis made explicit."""
    written = {f"analysis.{assembly.motion_name}": asked_motion(spec, assembly), "analysis.fidelity": "prb"}
    return with_values(spec, written)


def _curve(solution: Solution) -> Curve:
    """Return the curve of one mechanism; with friction the way through the motion and back."""
    (assembly,), drive, units = solution.assemblies, solution.drive, solution.unit_spring_curves
    coupler, guide = solution.reactions
    extra = {
        "stiffness": Column(solution.stiffness[0], assembly.stiffness_dimension),
        "energy": Column(solution.energy[0], "energy"),
        **{
            f"{drive}_{name}": Column(row[0], drive)
            for name, row in zip(JOINT_NAMES, solution.spring_efforts, strict=True)
        },
        **({"crank_angle": Column(units.angle[0], "angle")} if drive == "force" else {}),
        "slider_position": Column(units.position[0], "length"),
        **{f"{name}_rotation": Column(row[0], "angle") for name, row in zip(JOINT_NAMES[:3], units.turn, strict=False)},
        "slider_travel": Column(units.turn[3, 0] - assembly.tight, "length"),
        "coupler_force": Column(coupler[0], "force"),
        "guide_force": Column(guide[0], "force"),
    }
    motion = solution.motion[0]
    if solution.friction_branches is None:
        return Curve(motion, solution.effort[0], extra=extra, kind=drive)
    forth, back = solution.friction_branches

    def both(up: FloatArray, down: FloatArray) -> FloatArray:
        return np.concatenate([up.ravel(), down.ravel()[::-1]])

    columns = {name: Column(both(item.values, item.values), item.dimension) for name, item in extra.items()}
    columns["coupler_force"] = Column(both(forth.coupler, back.coupler) / solution.legs[0], "force")
    columns["guide_force"] = Column(both(forth.guide, back.guide) / solution.legs[0], "force")
    columns |= {f"lost_to_{kind}": Column(both(forth.lost[kind], back.lost[kind]), drive) for kind in forth.lost}
    effort, names = both(forth.effort, back.effort), np.repeat(["load", "unload"], len(motion))
    return Curve(both(motion, motion), effort, names, np.isfinite(effort), columns, drive)


def _describe_locked(solution: Solution) -> str:
    """Return what to say of places where friction leaves no equilibrium; empty without any."""
    failed = sum(
        int((~np.isfinite(friction_branch.effort[0, 1:])).sum()) for friction_branch in solution.friction_branches or ()
    )
    points = 2 * solution.motion.shape[1]
    return f"{failed} of {points} points have no equilibrium: friction holds the mechanism" if failed else ""


def gradient(spec: SliderCrankSpec, paths: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return derivatives [SI] of metrics over the window of the analysis by the rates of springs of one leg.

    Paths that are no rate of a spring are left out.
    """
    if spec.fidelity != "prb" or spec.mechanism.pins or spec.mechanism.guide:
        return {}
    try:
        spec = resolve(spec)
        solution, short = solve(spec, assemble(spec))
    except CannotBuild:
        return {}
    if short or not solution.assemblies[0].rates.any():
        return {}
    rate_keys = {path: RATE_KEYS[path] for path in paths if path in RATE_KEYS}
    legs = spec.mechanism.sets
    slopes = dict(_slopes(solution))
    return {name: {path: legs * float(by[row]) for path, row in rate_keys.items()} for name, by in slopes.items()}


def _slopes(solution: Solution) -> Iterator[tuple[str, FloatArray]]:
    """Yield each metric with its derivatives by the four total rates."""
    drive, (assembly,) = solution.drive, solution.assemblies
    low, high = (float(end[0, 0]) for end in solution.window_or_motion)
    motion = solution.motion[0]
    unit = assembly.forces(np.concatenate([[low], motion[find_between_ends(motion, low, high)], [high]]))
    effort = assembly.rates @ unit
    sign = -1.0 if effort.mean() < 0 else 1.0
    places = np.concatenate([motion, solution.curve.place[0]])
    places = distinct(np.concatenate([[low, high], places[find_between_ends(places, low, high)]]))
    most, least = (_efforts_at_extreme(assembly, places, toward) for toward in (sign, -sign))
    top, bottom = float(assembly.rates @ most), float(assembly.rates @ least)
    yield f"{drive}_mean", unit.mean(axis=1)
    yield f"{drive}_max", most if sign > 0 else least
    yield f"{drive}_min", least if sign > 0 else most
    if top != 0.0:
        yield f"{drive}_ripple", (bottom * most / top - least) / top
    if top + bottom != 0.0:
        yield "half_band", 2.0 * (bottom * most - top * least) / (top + bottom) ** 2
    yield "energy_max", _energies_at_maximum(solution)
    reference = solution.reference[0]
    if solution.low[0, 0] <= reference[0] <= solution.high[0, 0]:
        yield f"reference_{drive}", assembly.units(reference).effort[:, 0]
    if drive == "torque":
        at = assembly.units(solution.stretched_motion[0])
        yield "stretched_torque", at.effort[:, 0]
        yield "stretched_stiffness", at.stiffness[:, 0]


def _efforts_at_extreme(assembly: Assembly, places: FloatArray, sign: float) -> FloatArray:
    """Return the unit efforts (4,) where the effort times a sign is largest, next to the places too.

    An extreme moves with the rates, but the effort does not change with its place there: its derivatives are these.
    """
    largest = int(np.argmax(sign * (assembly.rates @ assembly.forces(places))))
    low, high = places[max(largest - 1, 0)], places[min(largest + 1, len(places) - 1)]

    def falls(place: float) -> bool:
        return sign * float(assembly.rates @ assembly.units(np.array([place])).stiffness[:, 0]) <= 0.0

    at = places[largest]
    if not falls(low) and falls(high):
        at = bisect(falls, float(low), float(high))
    return np.asarray(assembly.units(np.array([at])).effort[:, 0])


def _energies_at_maximum(solution: Solution) -> FloatArray:
    """Return the energies of unit springs (4,) where the energy is largest: at an end, or where no effort is left."""
    (assembly,), (low, high) = solution.assemblies, solution.ends
    inner = [equilibrium.motion for equilibrium in solution.equilibria if low < equilibrium.motion < high]
    energy = 0.5 * assembly.units(np.array([low, *inner, high])).turn ** 2
    return np.asarray(energy[:, int(np.argmax(assembly.rates @ energy))])
