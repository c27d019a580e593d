"""`design: {optimise: ...}`: from a specification to the task, from the best audited start to a specification."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.beams.beam import fit
from cfmkit.families.beam.build import assemble
from cfmkit.families.beam.findings import finding
from cfmkit.families.beam.shaping.audit import Audit, Spread, audited
from cfmkit.families.beam.shaping.infeasible import blocked, held_by
from cfmkit.families.beam.shaping.multistart import Explored, deadline_of, explored, ranked
from cfmkit.families.beam.shaping.report import notes_of, search_of, starts_table
from cfmkit.families.beam.shaping.search import Found, Plan, improved, widened
from cfmkit.families.beam.shaping.task import Coordinate, Limits, Task
from cfmkit.families.beam.shaping.variables import Variables
from cfmkit.families.beam.words import percent
from cfmkit.results import Design, Finding, Status
from cfmkit.store import origin, stable_hash

if TYPE_CHECKING:
    from cfmkit.families.base import Run
    from cfmkit.families.beam.shaping.spec import Optimise
    from cfmkit.families.beam.spec import BeamSpec

AUDITED = 5
"""Designs that are audited, the best first, until one is sound."""

MARGIN = 2e-3
"""The search asks for so much less stress and slimmer beams: the stress peaks between its poses and places, too."""

_NOT_DECIDING = {"name", "description", "requirements", "sweep", "sensitivity"}
_PLACES, _TURNS = 7, 6  # decimals of designed coordinates [m] and coefficients [rad]


def shaped(spec: BeamSpec, wanted: Optimise, run: Run) -> Design:
    """Return a specification with optimised nodes and shapes, or why there is none.

    Parameters
    ----------
    spec : BeamSpec
        Driven by a displacement.
    wanted : Optimise
        What is to be reached, what may vary, what must hold.
    run : Run
        Seed, progress, time budget, processes, notes.
    """
    if spec.extent < wanted.window[1] * (1 - 1e-12):
        problem = "analysis.travel ends before design.optimise.window: let it reach the end of the window"
        return Design(None, Status.INVALID, problem)
    task = task_of(spec, wanted)
    plan = Plan(drawn=wanted.drawn, deadline=deadline_of(wanted.time_budget, run.time_budget))
    identity = stable_hash([spec.model_dump(mode="json", exclude=_NOT_DECIDING), run.seed, origin()])
    result = explored(task, plan, (wanted.starts, wanted.widened), identity, run)
    spread = Spread(wanted.tolerances.nodes, wanted.tolerances.coefficients, wanted.tolerances.samples, run.seed)
    best = _best(task, result, spread, plan)
    if isinstance(best, Design):
        return replace(best, tables={"starts": lambda: starts_table(task, result)})
    found, audit = best
    held = held_by(task, found)
    return Design(
        written(spec, task, found),
        Status.COMPLETE,
        _told(task, found, result),
        active_bounds=held,
        warnings=_warnings(task, found, audit, result),
        search=search_of(task, found, audit, result),
        notes=notes_of(audit, spread, held),
        tables={"starts": lambda: starts_table(task, result)},
    )


def task_of(spec: BeamSpec, wanted: Optimise) -> Task:
    """Return what is to be shaped; of layers in series one, which moves its share."""
    mechanism = spec.mechanism
    layers = mechanism.copies.layers if mechanism.copies else 1
    if layers > 1 and mechanism.copies:
        one = mechanism.copies.model_copy(update={"layers": 1})
        spec = spec.model_copy(update={"mechanism": mechanism.model_copy(update={"copies": one})})
    assembly = assemble(spec)
    return Task(
        network=assembly.network,
        driven=assembly.driven,
        direction=assembly.direction,
        copies=float(assembly.parallel),
        window=(wanted.window[0] / layers, wanted.window[1] / layers),
        coordinates=tuple(_coordinates(wanted)),
        shaped=wanted.beams if wanted.beams is not None else tuple(mechanism.beams),
        orders=wanted.orders,
        coefficient_limit=wanted.coefficient_limit,
        limits=_limits(wanted, assembly.allowable_stress),
        objective=wanted.objective,
        half_band=wanted.half_band,
        compared=None if wanted.compare is None else (wanted.compare[0] / layers, wanted.compare[1] / layers),
        fidelity=spec.fidelity,
        layers=layers,
    )


def _coordinates(wanted: Optimise) -> list[Coordinate]:
    box = wanted.limits.envelope
    found = []
    for name, node in wanted.free.items():
        both = node.x is None and node.y is None
        for axis, given in enumerate((node.x, node.y)):
            inside = (box.x, box.y)[axis] if both and box is not None else given
            if inside is not None:
                found.append(Coordinate(name, axis, *inside))
    return found


def _limits(wanted: Optimise, allowable_stress: float | None) -> Limits:
    limits, force = wanted.limits, wanted.force
    box, deformed = limits.envelope, limits.deformed_envelope
    return Limits(
        stress=allowable_stress * (1 - MARGIN) if limits.stress and allowable_stress else None,
        envelope=None if box is None else (*box.x, *box.y),
        deformed_envelope=None if deformed is None else (*deformed.x, *deformed.y),
        length_ratio=limits.max_length_ratio,
        slenderness=limits.min_slenderness * (1 + MARGIN) if limits.min_slenderness else None,
        clearance=limits.clearance,
        opening=limits.joint_opening,
        radius=limits.min_radius,
        force_min=None if force.min is None else force.min * (1 + MARGIN),
        force_target=force.target,
        force_tolerance=force.tolerance,
    )


def _best(task: Task, result: Explored, spread: Spread, plan: Plan) -> tuple[Found, Audit] | Design:
    """Return the best design whose audit is sound, or why there is none."""
    candidates = list(ranked(task, result.found))
    if not candidates:
        some = [one for one in result.found.values() if one is not None]
        if not some:
            return _nothing(result, plan)
        if plan.late():
            said = f"none of {len(some)} starts met all limits in the time allowed: give it more, or run again to go on"
            return Design(None, Status.INFEASIBLE, said)
        why = blocked(task, some, replace(plan, deadline=None))
        if why.freed is None:
            missed = "; ".join(f"{name} ({about})" for name, about in why.missed.items())
            said = f"no shape of {len(some)} starts meets all limits; the best misses {missed}"
            return Design(None, Status.INFEASIBLE, said, nearest_feasible=why.nearest)
        free = replace(plan, deadline=None)
        candidates = [(-1, widened(task, improved(task, why.freed, free), free))]
    first = candidates[0][1]
    if task.objective == "range" and first.objective > task.half_band:
        flattest = min((one for _, one in candidates), key=lambda one: one.objective)
        said = (
            f"no shape of {len(result.found)} starts keeps the force within ± {percent(task.half_band)} over the "
            f"window asked for; the flattest keeps it within ± {percent(flattest.objective)}"
        )
        nearest = {"design.optimise.half_band": f"at least {percent(1.02 * flattest.objective)}"}
        return Design(None, Status.INFEASIBLE, said, nearest_feasible=nearest)
    fallback = None
    for _, one in candidates[:AUDITED]:
        rounded = _rounded(task, one)
        audit = audited(Variables(task, one.order), rounded, spread)
        if audit.sound:
            return rounded, audit
        fallback = fallback or (rounded, audit)
    assert fallback is not None
    return fallback


def _nothing(result: Explored, plan: Plan) -> Design:
    if result.lost:
        return Design(None, Status.CRASHED, f"no start came to an end: {'; '.join(result.lost)}")
    if result.missing or plan.late():
        return Design(None, Status.INFEASIBLE, "the time budget ended before any start led to a design: give it more")
    said = (
        "no random network could be followed over the window without losing stability or crossing beams: "
        "widen the envelope or the ranges of the free nodes, or shorten the window"
    )
    return Design(None, Status.INFEASIBLE, said)


def _rounded(task: Task, found: Found) -> Found:
    """Return a design with coordinates and coefficients that print short."""
    places, x = len(task.coordinates), found.x.copy()
    x[:places] = np.round(x[:places] * task.size, _PLACES) / task.size
    x[places:] = np.round(x[places:], _TURNS)
    return replace(found, x=np.clip(x, *Variables(task, found.order).bounds.T))


def written(spec: BeamSpec, task: Task, found: Found) -> BeamSpec:
    """Return the specification with nodes and shapes written out, and the window of the design as its window."""
    variables = Variables(task, found.order)
    network = variables.build(found.x)
    moved = dict.fromkeys(one.node for one in task.coordinates)
    nodes = {name: (_place(network.nodes[name].x), _place(network.nodes[name].y)) for name in moved}
    changes: dict[str, Any] = {f"mechanism.nodes.{name}.at": at for name, at in nodes.items()}
    for name in task.shaped:
        beam = network.beams[name]
        start, end = network.nodes[beam.start], network.nodes[beam.end]
        reach = (
            end.x - start.x + beam.end_offset[0] - beam.start_offset[0],
            end.y - start.y + beam.end_offset[1] - beam.start_offset[1],
        )
        fitted = fit(beam, reach)
        shape = {
            "kind": "polynomial",
            "coefficients": (float(np.real(fitted.rotation)), *(float(c) for c in beam.shape.coefficients[1:])),  # type: ignore[union-attr]
            "length": float(np.real(fitted.length)),
        }
        changes[f"mechanism.beams.{name}.shape"] = shape
    layers = spec.mechanism.copies.layers if spec.mechanism.copies else 1
    begins = round(float(np.ceil(found.start * layers * 1e6)) / 1e6, 6)
    changes["analysis.window"] = (begins, float(task.window[1] * layers))
    return spec.replace(changes)


def _place(value: float) -> float:
    return round(float(value), _PLACES)


def _told(task: Task, found: Found, result: Explored) -> str:
    """Return what the search did, in one sentence."""
    some = [one for one in result.found.values() if one is not None]
    feasible = [one for one in some if one.feasible]
    total = sum(one.evaluations for one in some)
    reused = f", {result.reused} from the journal" if result.reused else ""
    left = f", {result.missing} not done in the time" if result.missing else ""
    share = 1 - found.start / task.window[1]
    reached = f"force within ± {percent(found.objective)} over {percent(share)} of the travel"
    if task.objective == "paper":
        reached = f"F(a)/F(b) - 1 = {found.objective:.3f}"
    return (
        f"{reached}; {len(feasible)} of {len(result.found)} starts meet all limits ({total} traces{reused}{left}); "
        f"the last minimisation {found.ending}"
    )


def _warnings(task: Task, found: Found, audit: Audit, result: Explored) -> tuple[Finding, ...]:
    """Return what the audit holds against the design."""
    out = []
    if not audit.sound:
        faults = [
            "the path ends early" if not audit.complete else "",
            "it is not stable all the way" if not audit.stable else "",
            f"beams cross at {audit.crossings} of the poses" if audit.crossings else "",
        ]
        out.append(finding("design_unsound", "the design fails its audit: " + ", ".join(filter(None, faults))))
    if task.objective == "paper":
        out.append(
            finding(
                "objective_ill_posed",
                f"F(a)/F(b) - 1 = {found.objective:.3f} is bounded by nothing but the limits: a force that falls from "
                f"b to a is rewarded; over the window the half band is "
                + (percent(audit.half_band) if audit.half_band is not None else "not known"),
                "design.optimise.objective=ripple",
            )
        )
    if result.lost:
        out.append(finding("starts_lost", f"some starts were lost: {'; '.join(result.lost)}"))
    elif result.missing:
        said = f"{result.missing} of the starts were not done in the time budget; run again to go on"
        out.append(finding("search_cut_short", said))
    return tuple(out)
