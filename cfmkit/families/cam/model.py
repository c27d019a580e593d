"""Quasi-static analysis of a cam mechanism: both directions of travel, the closed loop.

A specification with a motion goes to the dynamic model (`cfmkit.families.cam.dynamics`) instead.
Friction opposes the motion, so the way up and the way down have different forces;
the area between them is lost in one cycle. Where the cam is undercut the roller
pivots on its corner, and the curve shows the force that really acts there.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 2 and 3.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import LazySequence
from cfmkit.curves import Column, Curve
from cfmkit.errors import Problem, SpecError
from cfmkit.families.cam.assembly import TRAVEL_RTOL, Assembly, target_force
from cfmkit.families.cam.clearance import smallest, touching
from cfmkit.families.cam.contact_pressure import allowable_stress, stress
from cfmkit.families.cam.findings import finding, left_out, rules_of
from cfmkit.families.cam.hardware import hardware
from cfmkit.families.cam.mechanism_from_spec import assemble, check_first_pose, check_springs, displacement_origin
from cfmkit.families.cam.scalar_results import SCALAR_QUANTITIES, contact_pressure, curve_cut_for
from cfmkit.families.cam.solution import DenseLoop, Solution
from cfmkit.families.cam.statics import forces
from cfmkit.families.findings import mm
from cfmkit.families.no_mechanism import CannotBuild, no_result
from cfmkit.families.rows import fails, findings_of_one, plain_if_equal, values_of_one
from cfmkit.results import Result, Status
from cfmkit.stock.parts_list import parts_tables

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.run_control import Run
    from cfmkit.results import Finding
    from cfmkit.stock.parts_list import ListedPart

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
    loop = DenseLoop(solution)
    short = shortfalls(assembly, float(solution.travel[-1]))
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
        values=values_of_one(SCALAR_QUANTITIES, solution) | smallest(solution),
        warnings=LazySequence(partial(_findings, solution, short)),
        travel=(
            solution.origin + float(solution.travel[0]),
            solution.origin + _requested_travel(solution, bool(short)),
        ),
        valid=(
            (
                max(solution.corner_travel, float(solution.travel[0])) + solution.origin,
                float(solution.travel[-1]) + solution.origin,
            ),
        ),
        target=target_force(spec, assembly),
        target_curve=None if spec.target_curve else curve_cut_for(assembly),
        allowable_stress=allowable_stress(spec.mechanism),
        closed=loop,
        effort_error=solution.effort_error,
        part_efforts=loop.part_efforts,
        tables=parts_tables(partial(_hardware_parts, solution)),
        state=solution,
    )


def _findings(solution: Solution, short: Sequence[Finding]) -> Iterator[Finding]:
    yield from short
    yield from left_out(solution.assembly.spec)
    yield from findings_of_one(rules_of(solution), finding, solution)
    yield from touching(solution)


def with_band(solution: Solution, seed: int) -> Solution:
    """Return a solution with the forces of cams that are cut with errors, where the specification states any."""
    tolerance = solution.assembly.spec.analysis.manufacturing
    if tolerance is None:
        return solution
    from cfmkit.families.cam.manufacturing_scatter import force_band

    return replace(solution, band=force_band(solution.assembly, tolerance, solution.travel, seed))


def _requested_travel(solution: Solution, short: bool) -> float:
    """Return how far the slider was to go [m]; without a request, as far as the flank was to be cut."""
    spec = solution.assembly.spec
    return float(spec.mechanism.profile.stroke or 0.0) if short and not spec.analysis.travel else solution.requested


def _as_run(spec: CamSpec, solution: Solution) -> CamSpec:
    """Return the spec with the defaults of the analysis made explicit."""
    travel = _requested_travel(solution, short=False)
    analysis = spec.analysis.model_copy(update={"travel": travel, "gravity": spec.gravity, "fidelity": "quasi-static"})
    return spec.model_copy(update={"analysis": analysis})


def _hardware_parts(solution: Solution) -> tuple[ListedPart, ...]:
    return tuple(hardware(solution).parts)


def solve(
    assembly: Assembly,  # one mechanism; or several whose numbers are columns
    count: int = 1,  # number of mechanisms
) -> Solution:
    """Return states and forces over the travel that the analysis asks for, as far as the track goes.

    Raises CannotBuild if a stop leaves no travel.
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
    short = asked is not None and fails(reached < asked * (1 - TRAVEL_RTOL))
    if asked is not None and short and travel_between_stops(assembly.spec)[1] <= reached * (1 + TRAVEL_RTOL):
        warnings.append(
            finding(
                "end_stop",
                f"the requested travel is {mm(asked)}, but the slider is stopped at {mm(reached)} "
                "('mechanism.stops.upper')",
            )
        )
    elif assembly.track.turns_back and (short or asked is None):
        warnings.append(
            finding(
                "brace_too_short",
                f"with a brace of {mm(assembly.track.brace_length)} on this cam the slider stops rising after "
                f"{mm(reached)} of travel, before the flank ends, and the force is unbounded there; use a longer "
                "brace ('mechanism.brace_length'), or a cam cut for this one ('mechanism.profile.brace_length')",
            )
        )
    elif asked is not None and short:
        warnings.append(
            finding(
                "outside_profile",
                f"the requested travel is {mm(asked)}, but the profile is cut for {mm(reached)} with these parts; "
                "cut a longer profile ('mechanism.profile.stroke') or request less ('analysis.travel')",
            )
        )
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
        "pressure_angle": Column(loop(solution.pressure_angle), "angle"),
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
        pressed = loop(contact_pressure(solution), contact_pressure(solution, down))
        extra |= {"contact_pressure": Column(pressed, "stress"), "max_stress": Column(stress(pressed), "stress")}
    branch = np.repeat(["load", "unload"], points)
    return Curve(loop(solution.travel) + solution.origin, force, branch, stable, extra)
