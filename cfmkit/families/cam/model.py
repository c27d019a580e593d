"""Quasi-static analysis of cam mechanisms: both directions of travel, the closed loop; one alone, or many as rows.

A specification with a motion goes to the dynamic model (`cfmkit.families.cam.dynamics`) instead.

Friction opposes the motion, so the way up and the way down have different forces; the area between them is lost in one
cycle. Where the cam is undercut the roller pivots on its corner, and the curve shows the force that really acts there.

Cams of a study of one kind are solved together. Mechanisms that differ in what moves neither the roller nor the brace
on the cam (springs, friction, weights, the width of the contact) share one cam and its track, which is found once.
Others have a cam each, or a track of their own on it, and these stand side by side. Each cam is put together as that of
a run is. What no rows have is analysed alone: motions, measured cams, drawn ones, envelopes, cams cut for a curve that
no target names, whatever does not reach the end of the travel, and what cannot be built. Cams that are cut for a curve
and for friction or weights of their own each take a solution of their own.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 2 and 3.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import LazySequence
from cfmkit.curves import Column, Curve
from cfmkit.errors import CfmError, Problem, SpecError
from cfmkit.families.cam.contact_pressure import allowable_stress, stress
from cfmkit.families.cam.findings import finding, rules_of, warn_of_asymmetry
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import select_profiles
from cfmkit.families.cam.hardware import hardware
from cfmkit.families.cam.measured_cam import PROFILE_DEFINITIONS
from cfmkit.families.cam.mechanism_from_spec import assemble, check_first_pose, check_springs, displacement_origin
from cfmkit.families.cam.part_sizes_and_clearances import touching
from cfmkit.families.cam.scalar_results import SCALAR_DEFINITIONS, SCALAR_QUANTITIES, curve_cut_for
from cfmkit.families.cam.solution import Solution
from cfmkit.families.cam.statics import TRAVEL_RTOL, Assembly, forces, target_force
from cfmkit.families.findings import CannotBuild, mm, no_result
from cfmkit.families.rows import (
    RowsDiffer,
    SolvedRows,
    agree,
    columns_of_absent_values,
    drop_numbers,
    fails,
    findings_of_one,
    plain_if_equal,
    rows_of,
    stack,
    valid,
    values_of_one,
    with_values,
)
from cfmkit.results import Result, Status
from cfmkit.stock.parts_list import parts_tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.rows import Variants
    from cfmkit.families.run_control import Run
    from cfmkit.results import Finding
    from cfmkit.specs.units import Ends
    from cfmkit.stock.parts_list import ListedPart

    Rows = NDArray[np.intp]
    Group = tuple[Rows, SolvedRows[Solution]]


STROKE_RTOL = 1e-13
"""Rounding of the travel to the end of a flank that is cut for a stroke: mechanisms side by side have one travel."""
UNEQUAL_SIDES_MESSAGE = (
    "the quasi-static model is symmetric and would give the force of two right sides: add 'analysis.dynamics' with a "
    "slow motion, or accept that with analysis.fidelity: quasi-static"
)


def analyze(spec: CamSpec, run: Run) -> Result:
    """Return the force-displacement loop of a cam that is moved slowly, with everything that is wrong with it.

    Branches ``load`` (up) and ``unload`` (down); the seed of the run draws the parts of `analysis.manufacturing`.
    NO_EQUILIBRIUM if the mechanism cannot be built, PARTIAL if the curve ends before the requested travel. Raises
    `SpecError` if the two sides differ and nobody has said that the symmetric model will do.
    """
    if spec.mechanism.profile.file is not None:
        from cfmkit.families.cam.measured_cam_analysis import analyze_built

        return analyze_built(spec)
    left = spec.mechanism.left
    if left is not None and left.moves_differently and spec.analysis.fidelity is None:
        raise SpecError([Problem("", 0, 0, "mechanism.left", UNEQUAL_SIDES_MESSAGE)])
    try:
        assembly = assemble(spec)
        check_first_pose(assembly)
        solution = solve(assembly)
        check_springs(solution.elongation, solution.up.contact, assembly.loads.rest_half_width)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    solution = with_band(solution, run.seed)
    first, last = solution.travel[[0, -1]].tolist()
    short, requested = shortfalls(assembly, last), solution.requested_travel
    if short and not spec.analysis.travel:  # as far as the flank was to be cut
        requested = float(assembly.spec.mechanism.profile.stroke or 0.0)
    failed = int(np.isnan(solution.up.slider[1:]).sum() + np.isnan(solution.down.slider[1:]).sum())
    status, message = Status.COMPLETE, ""
    if short:
        status, message = Status.PARTIAL, short[0].message
    elif failed:
        status, message = Status.PARTIAL, f"{failed} of {2 * len(solution.travel)} points have no equilibrium"
    return Result(
        spec=_as_run(assembly.spec, solution),
        status=status,
        message=message,
        curves=(_curve(solution),),
        values=values_of_one(SCALAR_QUANTITIES, solution),
        warnings=LazySequence(partial(_findings, solution, short)),
        travel=(solution.origin + first, solution.origin + requested),
        valid=((max(solution.corner_travel, first) + solution.origin, last + solution.origin),),
        target=target_force(spec, assembly),
        target_curve=None if spec.target_curve else curve_cut_for(assembly),
        allowable_stress=allowable_stress(spec.mechanism),
        closed=solution,
        effort_error=solution.effort_error,
        part_efforts=solution.part_efforts,
        tables=parts_tables(partial(_hardware_parts, solution)),
        state=solution,
    )


def _findings(solution: Solution, short: Sequence[Finding]) -> Iterator[Finding]:
    yield from short
    yield from warn_of_asymmetry(solution.assembly.spec)
    yield from findings_of_one(rules_of(solution), finding, solution)
    yield from touching(solution)


def with_band(solution: Solution, seed: int) -> Solution:
    """Return a solution with the forces of cams that are cut with errors, where the specification states any."""
    tolerance = solution.assembly.spec.analysis.manufacturing
    if tolerance is None:
        return solution
    from cfmkit.families.cam.manufacturing_scatter import force_band

    return replace(solution, band=force_band(solution.assembly, tolerance, solution.travel, seed))


def _as_run(spec: CamSpec, solution: Solution) -> CamSpec:
    """Return the spec with the defaults of the analysis made explicit."""
    stated = {"travel": solution.requested_travel, "gravity": spec.gravity, "fidelity": "quasi-static"}
    return spec.model_copy(update={"analysis": spec.analysis.model_copy(update=stated)})


def _hardware_parts(solution: Solution) -> tuple[ListedPart, ...]:
    return hardware(solution).parts


def solve(assembly: Assembly, count: int = 1) -> Solution:
    """Return states and forces over the travel that the analysis asks for, as far as the track goes.

    Of one mechanism, or of `count` whose numbers are columns. Raises CannotBuild if a stop leaves no travel.
    """
    spec, track, loads = assembly.spec, assembly.track, assembly.loads
    low, end = reachable_travel(assembly)
    if fails(end <= low):
        raise finding.cannot_build(
            "end_stop", f"the lower stop at {mm(low)} leaves no travel ('mechanism.stops.lower')"
        )
    travel = np.linspace(low, end, spec.analysis.points, axis=-1)
    travel = travel if travel.ndim == 1 else travel[:, 0]
    states, friction = track.states(track.start + travel), spec.mechanism.rolling_friction
    up = forces(states, loads, friction)
    down = forces(states, loads, -friction, -1.0) if np.any(friction) or loads.losses else up
    return Solution(assembly, travel, states, up, down, displacement_origin(assembly), count=count)


def reachable_travel(assembly: Assembly) -> tuple[Any, Any]:
    """Return where the travel begins, and as far as it goes: to what is asked, the end of the track, or a stop [m]."""
    spec, track = assembly.spec, assembly.track
    stroke, available = spec.mechanism.profile.stroke, track.end - track.start
    assert stroke is not None  # of a resolved spec
    available = np.where(np.abs(available - stroke) <= STROKE_RTOL * stroke, stroke, available)
    low, high = travel_between_stops(spec)
    asked = available if spec.analysis.travel is None else spec.analysis.travel
    return low, plain_if_equal(np.minimum(np.minimum(asked, available), high)[()])


def travel_between_stops(spec: CamSpec) -> tuple[Any, Any]:
    """Return between which travels the stops let the slider move [m]."""
    stops = spec.mechanism.stops
    return (0.0, np.inf) if stops is None else (stops.lower, np.inf if stops.upper is None else stops.upper)


def shortfalls(assembly: Assembly, reached: Any) -> tuple[Finding, ...]:
    """Return why the curve ends, at a travel [m], before what was requested, or before the flank does."""
    warnings = [assembly.shortfall] if assembly.shortfall else []
    asked = assembly.spec.analysis.travel
    is_short = asked is not None and fails(reached < asked * (1 - TRAVEL_RTOL))
    if asked is not None and is_short and travel_between_stops(assembly.spec)[1] <= reached * (1 + TRAVEL_RTOL):
        stopped = f"but the slider is stopped at {mm(reached)} ('mechanism.stops.upper')"
        warnings.append(finding("end_stop", f"the requested travel is {mm(asked)}, {stopped}"))
    elif assembly.track.turns_back and (is_short or asked is None):
        message = (
            f"with a brace of {mm(assembly.track.brace_length)} on this cam the slider stops rising after "
            f"{mm(reached)} of travel, before the flank ends, and the force is unbounded there; use a longer "
            "brace ('mechanism.brace_length'), or a cam cut for this one ('mechanism.profile.brace_length')"
        )
        warnings.append(finding("brace_too_short", message))
    elif asked is not None and is_short:
        message = (
            f"the requested travel is {mm(asked)}, but the profile is cut for {mm(reached)} with these parts; "
            "cut a longer profile ('mechanism.profile.stroke') or request less ('analysis.travel')"
        )
        warnings.append(finding("outside_profile", message))
    return tuple(warnings)


def _curve(solution: Solution) -> Curve:
    """Return the closed loop: up, then down."""

    def loop(up: FloatArray, down: FloatArray | None = None) -> FloatArray:
        return np.concatenate([up, (up if down is None else down)[::-1]])

    up, down, states = solution.up, solution.down, solution.states
    points = len(solution.travel)
    force, contact = loop(up.slider, down.slider), loop(up.contact, down.contact)
    with np.errstate(invalid="ignore"):
        stable = (contact > 0) | (np.isfinite(force) & (loop(solution.elongation) == 0))
    extra = {
        "contact_force": Column(contact, "force"),
        "brace_force": Column(loop(up.brace, down.brace), "force"),
        "spring_elongation": Column(loop(solution.elongation), "length"),
        "pressure_angle": Column(loop(solution.states.pressure_angle), "angle"),
        "roller_x": Column(loop(states.x), "length"),
        "roller_y": Column(loop(states.y), "length"),
        "contact": Column(loop(np.where(states.on_corner, "corner", "flank")), "text"),
    }
    if up.least_contact is not None and down.least_contact is not None:
        extra["contact_force_least"] = Column(loop(up.least_contact, down.least_contact), "force")
    if solution.assembly.loads.losses and up.lost and down.lost:
        shares = {kind: loop(up.lost[kind], down.lost[kind]) for kind in up.lost}
        # an upright flank presses without bound: like its force on the way up, such a share is left out
        shares = {kind: np.where(np.isfinite(share), share, np.nan) for kind, share in shares.items()}
        extra |= {f"lost_to_{kind}": Column(share, "force") for kind, share in shares.items()}
    if solution.assembly.spec.mechanism.contact:
        pressed = loop(solution.contact_pressure(up), solution.contact_pressure(down))
        extra |= {"contact_pressure": Column(pressed, "stress"), "max_stress": Column(stress(pressed), "stress")}
    branch = np.repeat(["load", "unload"], points)
    return Curve(loop(solution.displacement), force, branch, stable, extra)


MAX_SAMPLES_AT_ONCE = 250_000
"""Points that are worked on together: 520 curves of 481 points. A quarter at a time takes half as long again."""
MIN_SHARED_CAMS, MIN_SHARED_UNCHECKED = 8, 400
"""Mechanisms around one cam from which on they are worth a solution of their own: where each other one is validated,
and where bounds of its numbers are enough.
"""
BESIDE_THE_CAM = re.compile(
    r"mechanism\.(rolling_friction|springs\.(stiffness|count)(\.\d+)?|masses\.(slider|brace|roller)|contact\.width)"
    r"|design\.force"
)
"""Paths of what moves neither the roller nor the brace on the cam."""


def solve_rows(variants: Variants) -> Iterator[Group]:
    """Yield (indices, mechanisms that are solved together) of those that go through all of the travel."""
    if _is_left_out(variants.spec):
        return
    plain = _plain_numbers(variants.spec)
    rows = np.flatnonzero(variants.keep_bounds(variants.values.keys() & plain))
    moving = [path for path in variants.values if path not in plain or not BESIDE_THE_CAM.fullmatch(path)]
    is_checked = plain >= set(moving)
    as_columns = partial(_with_columns, variants, tuple(variants.values), variants.spec)
    least = MIN_SHARED_UNCHECKED if is_checked else MIN_SHARED_CAMS
    shared, rest = _group_shared([variants.values[path] for path in moving], rows, least)
    for members in shared:
        if is_checked:
            yield from _solve_alike(members, as_columns)
        elif (first := dict(valid(variants, members[:1].tolist()))) and not _is_left_out(first[members[0]]):
            beside = [path for path in variants.values if path not in moving]
            yield from _solve_alike(members, partial(_with_columns, variants, beside, first[members[0]]))
    if is_checked:
        yield from _solve_alike(rest, as_columns)
        return
    kinds: dict[str, list[int]] = {}
    for row, spec in valid(variants, rest.tolist()):
        if not _is_left_out(spec):
            kinds.setdefault(_kind(spec), []).append(row)
    for alike in kinds.values():
        yield from _solve_alike(np.array(alike), partial(_stack_specs, variants), partial(_windows, variants))


def _is_left_out(spec: CamSpec) -> bool:
    mechanism, analysis = spec.mechanism, spec.analysis
    unnamed_curve = mechanism.profile.curve is not None and spec.target_curve is None  # it grows with the springs
    has_parts_of_single_cams = (
        mechanism.profile.file is not None or mechanism.left is not None or mechanism.envelope is not None
    )
    return (
        spec.fidelity != "quasi-static"
        or analysis.manufacturing is not None
        or unnamed_curve
        or has_parts_of_single_cams
    )


def _plain_numbers(spec: CamSpec) -> set[str]:
    """Return the numbers for which it is enough to be within bounds of their own."""
    mechanism, bounded_keys = spec.mechanism, {"mechanism.brace_length", "mechanism.rolling_friction"}
    springs, profile = mechanism.springs, mechanism.profile
    if springs.wound is None and not springs.initial_tension:
        several = range(len(springs.each)) if isinstance(springs.each, tuple) else ()
        bounded_keys |= {f"mechanism.springs.stiffness.{k}" for k in several} or {"mechanism.springs.stiffness"}
        if not several:
            bounded_keys.add("mechanism.springs.count")
    if mechanism.masses is not None:
        bounded_keys |= {f"mechanism.masses.{name}" for name in ("slider", "brace", "roller")}
    if mechanism.contact is not None:
        bounded_keys.add("mechanism.contact.width")
    if spec.design is not None and spec.design.force is not None:
        bounded_keys.add("design.force")
    lengths = ["force_constant", "stroke", "brace_length"]
    if mechanism.plate.base_width is None:
        lengths += ["rest_half_width", "roller_radius"]
        bounded_keys.add("mechanism.roller_radius")
        if springs.rest_length is None and springs.preload is None:
            bounded_keys.add("mechanism.rest_half_width")
    return bounded_keys | {f"mechanism.profile.{name}" for name in lengths if getattr(profile, name) is not None}


def _group_shared(columns: list[NDArray[Any]], rows: Rows, least: int) -> tuple[list[Rows], Rows]:
    """Return groups of many rows with the same values in all columns, in the order of their first, and other rows."""
    if not columns or not len(rows):
        return [], rows
    if any(column.dtype == object for column in columns):
        table: Any = [repr([column[row] for column in columns]) for row in rows.tolist()]
        _, which, count = np.unique(table, return_inverse=True, return_counts=True)
    else:
        table = np.stack([column[rows].astype(np.float64) for column in columns], axis=1)
        _, which, count = np.unique(table, axis=0, return_inverse=True, return_counts=True)
    which = which.ravel()
    groups = [rows[which == kind] for kind in np.flatnonzero(count >= least)]
    return sorted(groups, key=lambda members: int(members[0])), rows[count[which] < least]


def _with_columns(variants: Variants, paths: Sequence[str], spec: CamSpec, rows: Rows) -> CamSpec:
    """Return a specification with the values of some variants at paths, as columns where they differ."""
    values = {path: variants.values[path][rows].astype(np.float64) for path in paths}
    return with_values(spec, {path: stack(column.tolist()) for path, column in values.items()})


def _stack_specs(variants: Variants, rows: Rows) -> CamSpec:
    """Return variants of one kind as one specification, with columns where numbers differ."""
    specs: list[CamSpec] = [variants[row] for row in rows.tolist()]
    analyses = [spec.analysis.model_copy(update={"window": specs[0].analysis.window}) for spec in specs]
    blocks = {name: stack([getattr(spec, name) for spec in specs]) for name in ("mechanism", "design")}
    return specs[0].model_copy(update=blocks | {"analysis": stack(analyses)})


def _windows(variants: Variants, rows: Rows) -> Sequence[Ends]:
    """Return the window of each of some variants where windows vary; nothing where all have the same, or none."""
    varied = any(path.startswith("analysis.window") for path in variants.values)
    windows = [variants[row].analysis.window for row in rows.tolist()] if varied else []
    return () if None in windows else windows


def _kind(spec: CamSpec) -> str:
    """Return what mechanisms side by side have in common beside the way that their computation takes."""
    analysis = spec.analysis
    settings = analysis.points, analysis.window is None, analysis.origin
    curves = spec.mechanism.profile.curve, spec.target_curve
    return repr((settings, curves, [drop_numbers(block) for block in (spec.mechanism, analysis, spec.design)]))


def _solve_alike(
    rows: Rows, spec_of: Callable[[Rows], CamSpec], windows_of: Callable[[Rows], Sequence[Ends]] = lambda _rows: ()
) -> Iterator[Group]:
    """Yield mechanisms that are put together at once and solved a few at a time; those of another kind apart."""
    if not len(rows):
        return
    try:
        assembly = assemble(spec_of(rows))
        check_first_pose(assembly)
        low, end = reachable_travel(assembly)
        if fails(end <= low) or shortfalls(assembly, end):
            return
        loads, track = assembly.loads, assembly.track
        for value in (assembly.spec.mechanism.rolling_friction, loads.roller_weight, loads.sideways[0]):
            agree(np.not_equal(value, 0.0))
        agree(track.corner_end - track.start > low)
    except RowsDiffer as kinds:
        parts = rows[:, None] if kinds.mask.all() else (rows[kinds.mask], rows[~kinds.mask])
        for part in parts:
            yield from _solve_alike(part, spec_of, windows_of)
        return
    except CfmError:  # whoever analyses it alone says why
        return
    few = max(MAX_SAMPLES_AT_ONCE // assembly.spec.analysis.points, 1)
    for some in np.array_split(np.arange(len(rows)), -(-len(rows) // few)):
        if len(some) == 1 < len(rows):  # numbers in place of columns
            yield from _solve_alike(rows[some], spec_of, windows_of)
            continue
        parcel = assembly
        if len(some) < len(rows):
            profile = select_profiles(assembly.profile, some)
            parcel = replace(rows_of(assembly, some), track=track.select_rows(some), profile=profile)
        windows = windows_of(rows[some])
        yield rows[some], _solve_group(replace(solve(parcel, len(some)), windows=windows), rows[some])


ROW_COLUMNS = columns_of_absent_values(SCALAR_DEFINITIONS | PROFILE_DEFINITIONS) | dict(SCALAR_QUANTITIES)
"""What studies may ask of rows: of values that only motions and measured cams have their cells are empty."""


def _solve_group(solution: Solution, chosen: Rows) -> SolvedRows[Solution]:
    is_known = np.isfinite(solution.up.slider[..., 1:].sum(axis=-1) + solution.down.slider[..., 1:].sum(axis=-1))
    held = solution.elongation.max(axis=-1) >= 0
    held = held if held.all() else held | (solution.up.contact > 0).any(axis=-1)
    complete = np.broadcast_to(is_known & held, len(chosen))
    return SolvedRows(solution, ROW_COLUMNS, LazySequence(partial(rules_of, solution)), complete)
