"""Method `design.optimise`: builds the task, writes the best audited design as a specification, or says what blocks it.

Where no start meets all limits: which of them block, and the nearest values for which there would be a shape.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing import objective_and_constraints as design_limits
from cfmkit.designing.rounded_and_reported_values import find_active_bounds
from cfmkit.designing.run_many_starts import Clock, identity_of
from cfmkit.families.beam.finding_names import finding
from cfmkit.families.beam.network_from_spec import assemble, known_allowable_stresses, thickest_of
from cfmkit.families.beam.shaping.multistart import Explored, explore, rank, scatter_within_tolerances
from cfmkit.families.beam.shaping.report import REISSNER_MODEL, Judged, judge_design, notes_of, search_of, starts_table
from cfmkit.families.beam.shaping.search import VIOLATION_TOL, StartBudget, polish, satisfy_limits, widen
from cfmkit.families.beam.shaping.task_and_variables import (
    BENDING_ONLY,
    STRESS_MARGIN,
    Coordinate,
    Task,
    TaskLimits,
    Variables,
)
from cfmkit.families.findings import percent
from cfmkit.families.rows import with_values
from cfmkit.results import Design, Finding, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from cfmkit.families.beam.shaping.search import ShapeCandidate
    from cfmkit.families.beam.shaping.spec import Optimise
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.families.run_control import Run
    from cfmkit.specs.evaluable_target_curve import TargetCurve


def optimise_shape(spec: BeamSpec, wanted: Optimise, run: Run) -> Design:
    """Return a specification with optimised nodes and shapes, or why there is none."""
    if spec.extent < wanted.window[1] * (1 - 1e-12):
        problem = "analysis.travel ends before design.optimise.window: let it reach the end of the window"
        return Design(None, Status.INVALID, problem)
    spec = with_stretch_and_shear(spec)
    task = task_of(spec, wanted)
    plan = StartBudget(drawn=wanted.drawn, clock=Clock.from_budgets(wanted.time_budget, run.time_budget))
    result = explore(task, plan, (wanted.starts, wanted.widened), identity_of(spec, run.seed), run)
    tables = {"starts": lambda: starts_table(task, result)}
    best = _choose_best(spec, task, result, plan)
    if isinstance(best, Design):
        return replace(best, tables=tables)
    drawn = scatter_within_tolerances(task, best.candidate, wanted.tolerances, run.seed)
    held = held_by(task, best.candidate)
    return Design(
        best.spec,
        Status.COMPLETE,
        _report_search(task, best, result),
        active_bounds=held,
        warnings=_warnings(task, best, result),
        search=search_of(task, best, drawn, result),
        notes=notes_of(best.audit, drawn, wanted.tolerances, held),
        tables=tables,
    )


def with_stretch_and_shear(spec: BeamSpec) -> BeamSpec:
    """Return a specification whose beams stretch and shear, unless it says what its beams do."""
    said = {"axial", "shear"} & spec.mechanism.model_fields_set
    if spec.analysis.fidelity is not None or said:
        return spec
    return spec.replace({"analysis.fidelity": REISSNER_MODEL})


def task_of(spec: BeamSpec, wanted: Optimise) -> Task:
    """Return what is to be shaped; of layers in series one, which moves its share."""
    mechanism, layers = spec.mechanism, spec.mechanism.layers
    if layers > 1:
        spec = with_values(spec, {"mechanism.copies.layers": 1})
    assembly = assemble(spec)
    bends = assemble(spec.replace({"analysis.fidelity": BENDING_ONLY})).network
    curve = spec.design.target.curve() if spec.design is not None and spec.design.target is not None else None
    mean = 0.0 if curve is None else mean_of(curve, wanted.window)
    limits = _limits(wanted, min(known_allowable_stresses(spec).values(), default=None))
    if curve is not None:
        limits = replace(limits, force_target=mean)
    return Task(
        network=assembly.network,
        driven=assembly.driven,
        direction=assembly.direction,
        copies=float(assembly.parallel) if wanted.contact is None else 1.0,
        contact=wanted.contact,
        window=(wanted.window[0] / layers, wanted.window[1] / layers),
        coordinates=tuple(Coordinate(name, axis, *ends) for name, axis, ends in wanted.list_ranges()),
        shaped=wanted.beams if wanted.beams is not None else tuple(mechanism.beams),
        orders=wanted.orders,
        coefficient_limit=wanted.coefficient_limit,
        limits=limits,
        objective=wanted.objective,
        half_band=wanted.half_band,
        compared=None if wanted.compare is None else (wanted.compare[0] / layers, wanted.compare[1] / layers),
        fidelity=spec.fidelity,
        total_stress=spec.stress == "total",
        safety_factor=mechanism.safety_factor,
        layers=layers,
        shape=None if curve is None else curve.scale(1.0 / mean),
        bending_only=None if spec.fidelity == BENDING_ONLY else bends,
    )


def mean_of(curve: TargetCurve, window: tuple[float, float]) -> float:
    """Return the mean of a curve over a window [N]."""
    places = np.linspace(*window, 2001)
    return float(np.trapezoid(curve.evaluate(places), places) / (window[1] - window[0]))


def _limits(wanted: Optimise, allowable_stress: float | None) -> TaskLimits:
    stated, force = wanted.limits, wanted.force
    box, deformed = stated.envelope, stated.deformed_envelope
    return TaskLimits(
        stress=allowable_stress * (1 - STRESS_MARGIN) if stated.stress and allowable_stress else None,
        envelope=None if box is None else (*box.x, *box.y),
        deformed_envelope=None if deformed is None else (*deformed.x, *deformed.y),
        length_ratio=stated.max_length_ratio,
        slenderness=stated.min_slenderness * (1 + STRESS_MARGIN) if stated.min_slenderness else None,
        clearance=stated.clearance,
        opening=stated.joint_opening,
        radius=stated.min_radius,
        force_min=None if force.min is None else force.min * (1 + STRESS_MARGIN),
        force_target=force.target,
        force_tolerance=force.tolerance,
    )


def _choose_best(spec: BeamSpec, task: Task, result: Explored, plan: StartBudget) -> Judged | Design:
    """Return the best design that analysis and audit confirm, or why there is none."""
    candidates = [(candidate, result.audits.get(index)) for index, candidate in rank(task, result.designs)]
    if not candidates:
        some = list(result.shapes.values())
        if not some:
            return _explain_no_design(result, plan)
        if plan.late():
            said = (
                f"none of {len(some)} starts met all limits in the time allowed: increase it "
                "(design.optimise.time_budget), or run again to continue"
            )
            return Design(None, Status.INFEASIBLE, said)
        free = replace(plan, clock=Clock())
        why = find_blocking(task, some, free)
        met = None if why.freed is None else widen(task, polish(task, why.freed, free), free)
        if met is None or not met.feasible:
            missed = "; ".join(f"{name} ({about})" for name, about in why.missed.items())
            said = f"no shape of {len(some)} starts meets all limits; the best misses {missed}"
            return Design(None, Status.INFEASIBLE, said, nearest_feasible=why.nearest)
        candidates = [(met, None)]
    if task.objective == "range" and candidates[0][0].objective > task.half_band:
        flattest = min((candidate for candidate, _ in candidates), key=lambda candidate: candidate.objective)
        said = (
            f"no shape of {len(result.designs)} starts keeps the force within ± {percent(task.half_band)} over the "
            f"requested window (design.optimise.window); the flattest keeps it within ± {percent(flattest.objective)}"
        )
        nearest = {"design.optimise.half_band": f"at least {percent(1.02 * flattest.objective)}"}
        return Design(None, Status.INFEASIBLE, said, nearest_feasible=nearest)
    fallback = None
    for candidate, audit in candidates:
        design = judge_design(spec, task, candidate, audit)
        if not design.faults:
            return design
        fallback = fallback or design
    assert fallback is not None
    return fallback


def _explain_no_design(result: Explored, plan: StartBudget) -> Design:
    if result.lost:
        return Design(None, Status.CRASHED, f"no start was completed: {'; '.join(result.lost)}")
    if result.missing or plan.late():
        said = "the time budget ended before any start led to a design: increase it (design.optimise.time_budget)"
        return Design(None, Status.INFEASIBLE, said)
    said = (
        "no random network could be followed over the window without losing stability or crossing beams: "
        "widen the envelope (design.optimise.limits.envelope) or the ranges of the free nodes (design.optimise.free), "
        "or shorten the window (design.optimise.window)"
    )
    return Design(None, Status.INFEASIBLE, said)


def _report_search(task: Task, design: Judged, result: Explored) -> str:
    """Return what the search did, in one sentence; force and window in it are those of the analysis."""
    best, window, counts = design.candidate, design.window, result.count()
    feasible = counts["starts_within_limits"]
    unsound = feasible - counts["starts_sound"]
    refuted = f", the audit rejects {unsound} of them" if unsound else ""
    reused = f", {result.reused} from the journal" if result.reused else ""
    left = f", {result.missing} not finished in time" if result.missing else ""
    reached = "the analysis has no force at the end of the window"
    if task.shape is not None:
        off = percent(design.miss or 0.0)
        reached = f"force off 'design.target' by at most {off} of its largest value in the window"
    elif design.half_band is not None:
        share = 1 - window[0] / window[1]
        whose = "force" if task.contact is None else f"force of {task.contact!r}"
        reached = f"{whose} within ± {percent(design.half_band)} over {percent(share)} of the travel"
    if task.objective == "paper":
        reached = f"F(a)/F(b) - 1 = {best.objective:.3f}"
    return (
        f"{reached}; {feasible} of {len(result.designs)} starts meet all limits{refuted} ({counts['traces']} "
        f"traces{reused}{left}); the last minimisation {best.ending}"
    )


def _warnings(task: Task, design: Judged, result: Explored) -> tuple[Finding, ...]:
    """Return what analysis and audit hold against the design."""
    out = []
    if design.faults:
        out.append(finding("design_unsound", "the design fails its audit: " + ", ".join(design.faults)))
    if task.objective == "paper":
        out.append(
            finding(
                "objective_ill_posed",
                f"F(a)/F(b) - 1 = {design.candidate.objective:.3f} is bounded by nothing but the limits: a force that "
                "falls from b to a is rewarded; over the window the half band is "
                + (percent(design.half_band) if design.half_band is not None else "not known"),
                "design.optimise.objective=ripple",
            )
        )
    if result.lost:
        out.append(finding("starts_lost", f"some starts were lost: {'; '.join(result.lost)}"))
    elif result.missing:
        said = f"{result.missing} of the starts were not finished in the time budget; run again to continue"
        out.append(finding("search_cut_short", said))
    return tuple(out)


MAX_NEAR_DESIGNS = 3  # designs that are looked at, the ones that miss the limits least
AT_BOUND = 1e-4  # a variable so near to its bound, in units of the size and in rad, is held by it
AT_LIMIT = 2e-3  # a limit that holds by less than this share holds the design


@dataclass(frozen=True)
class Blocked:
    """Why there is no design."""

    missed: Mapping[str, str]  # limit -> by how much the best design misses it, and where
    # path below `design.optimise` or `mechanism` -> value for which the other limits could be met
    nearest: Mapping[str, str]
    freed: ShapeCandidate | None  # a design that meets all limits after all


def find_blocking(task: Task, designs: Iterable[ShapeCandidate], plan: StartBudget) -> Blocked:
    """Return what blocks, judged from the designs that miss the limits least."""
    best = sorted(designs, key=lambda candidate: candidate.violation)[:MAX_NEAR_DESIGNS]
    missed = missed_by(task, best[0])
    nearest: dict[str, str] = {}
    for name in missed:
        gives = [_relax_limits(task, candidate, plan, (name,)) for candidate in best]
        if (met := next((candidate for candidate in gives if candidate.feasible), None)) is not None:
            return Blocked(missed, {}, met)
        nearest |= _list_nearest(task, gives, (name,))
    if not nearest:  # none gives way alone: all that are missed together, by the same share
        gives = [_relax_limits(task, candidate, plan, tuple(missed)) for candidate in best]
        nearest = _list_nearest(task, gives, tuple(missed))
    return Blocked(missed, nearest, None)


def _list_nearest(task: Task, gives: list[ShapeCandidate], names: tuple[str, ...]) -> dict[str, str]:
    """Return what some limits would have to be for the design that misses no others and those least; else nothing."""
    fits = [candidate.violation for candidate in gives if missed_by(task, candidate).keys() <= {*names}]
    slack = 1.02 * min(fits, default=np.inf)
    return {key: value for name in names if fits for key, value in NEAREST_LIMITS[name](task, slack).items()}


def _relax_limits(task: Task, candidate: ShapeCandidate, plan: StartBudget, give: tuple[str, ...]) -> ShapeCandidate:
    """Return a design that meets all limits but some, and misses those as little as possible."""
    others = tuple(set(missed_by(task, candidate)) - set(give)) or give
    rest = satisfy_limits(task, candidate, task.orders[-1], plan, others, 0.9)
    return satisfy_limits(task, rest, task.orders[-1], plan, give, 0.98)


def missed_by(task: Task, candidate: ShapeCandidate) -> dict[str, str]:
    """Return the limits that a design misses, each with its worst place and by how much, the worst first."""
    view = candidate.view(task)
    rows = [] if view is None else design_limits.list_missed_limits(view.list_limits(), VIOLATION_TOL)
    return {row.name: f"{row.about}: missed by {percent(row.by)}" for row in rows}


def held_by(task: Task, candidate: ShapeCandidate) -> tuple[str, ...]:
    """Return the limits and bounds that hold a design, by name and place."""
    variables, view = Variables(task, candidate.order), candidate.view(task)
    at_bound = find_active_bounds(candidate.x, variables.bounds, AT_BOUND)
    held = [f"{name} at its bound" for name, at in zip(variables.names, at_bound, strict=True) if at]
    return (*held, *(design_limits.list_active_rows(view.list_limits(sloped=True), AT_LIMIT) if view else ()))


def _nearest_stress(task: Task, slack: float) -> dict[str, str]:
    factor = task.safety_factor / (1 + slack)
    if factor >= 1:
        return {"mechanism.safety_factor": f"at most {factor:.4g}"}
    strength = (task.allowable_stress or 0.0) * (1 + slack)
    return {"mechanism.material.yield_strength": f"at least {format_short(strength, 'stress')}, without safety factor"}


def _nearest_force(task: Task, slack: float) -> dict[str, str]:
    if task.limits.force_min is not None:
        return {"design.optimise.force.min": f"at most {format_short(task.limits.force_min * (1 - slack), 'force')}"}
    return {"design.optimise.force.tolerance": f"at least {task.limits.force_tolerance + slack:.3g}"}


def _nearest_clearance(task: Task, slack: float) -> dict[str, str]:
    thick = max(thickest_of(beam.section) for beam in task.network.beams.values())
    gap = ((task.limits.clearance or 0.0) + thick) * (1 - slack) - thick
    return {"design.optimise.limits.clearance": f"at most {format_short(max(0.0, gap), 'length')}"}


def _nearest_box(key: str) -> Callable[[Task, float], dict[str, str]]:
    def nearest(task: Task, slack: float) -> dict[str, str]:
        more = format_short(slack * task.size, "length")
        return {f"design.optimise.limits.{key}": f"wider by {more} on the sides that hold"}

    return nearest


def _nearest(
    key: str, value: Callable[[TaskLimits, float], float], sense: str, dimension: str
) -> Callable[..., dict[str, str]]:
    def nearest(task: Task, slack: float) -> dict[str, str]:
        return {f"design.optimise.limits.{key}": f"{sense} {format_short(value(task.limits, slack), dimension)}"}

    return nearest


NEAREST_LIMITS: dict[str, Callable[[Task, float], dict[str, str]]] = {
    "stress": _nearest_stress,
    "envelope": _nearest_box("envelope"),
    "deformed_envelope": _nearest_box("deformed_envelope"),
    "max_length_ratio": _nearest(
        "max_length_ratio", lambda limits, s: 1 / max(1e-3, 1 / (limits.length_ratio or 1.0) - s), "at least", "count"
    ),
    "min_slenderness": _nearest(
        "min_slenderness", lambda limits, s: (limits.slenderness or 0.0) * (1 - s), "at most", "count"
    ),
    "min_radius": _nearest("min_radius", lambda limits, s: (limits.radius or 0.0) * (1 - s), "at most", "length"),
    "clearance": _nearest_clearance,
    "force": _nearest_force,
}
"""For each limit what it would have to be if it gives way by an amount in its own scale."""
