"""Quasi-static analysis of a cam mechanism: both directions of travel, the closed loop.

A specification with a motion goes to the dynamic model (`cfmkit.families.cam.dynamics`) instead.
Friction opposes the motion, so the way up and the way down have different forces;
the area between them is lost in one cycle. Where the cam is undercut the roller
pivots on its corner, and the curve shows the force that really acts there.

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 2 and 3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import isclose
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.curves import Column, Curve
from cfmkit.errors import Problem, SpecError
from cfmkit.families.cam.bought_parts import parts_of
from cfmkit.families.cam.clearance import smallest, touching
from cfmkit.families.cam.contact_pressure import allowable_stress, flank_pressure, stress
from cfmkit.families.cam.findings import finding, findings_of, left_out
from cfmkit.families.cam.mechanism_from_spec import (
    CLOSE,
    assemble,
    check_first_pose,
    check_springs,
    displacement_origin,
)
from cfmkit.families.cam.scalar_results import contact_pressure, curve_cut_for, target_force, values_of
from cfmkit.families.cam.solution import ON_CORNER, Assembly, Solution
from cfmkit.families.cam.statics import Forces, forces
from cfmkit.families.findings import mm
from cfmkit.families.no_mechanism import CannotBuild, no_result
from cfmkit.results import Result, Status
from cfmkit.stock.parts_list import listed

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.run_control import Run
    from cfmkit.results import Finding

UNLIKE = (
    "the quasi-static model is symmetric and would give the force of two right sides: add 'analysis.dynamics' with a "
    "slow motion, or accept that with analysis.fidelity: quasi-static"
)


def analyze(spec: CamSpec, run: Run) -> Result:
    """Return the force-displacement loop of a cam that is moved slowly, with everything that is wrong with it.

    Parameters
    ----------
    spec : CamSpec
        The mechanism; what is left out is derived.
    run : Run
        Its seed, for the parts that are drawn for `analysis.manufacturing`.

    Returns
    -------
    Result
        Branches ``load`` (up) and ``unload`` (down). NO_EQUILIBRIUM if the mechanism cannot
        be built, PARTIAL if the curve ends before the requested travel.

    Raises
    ------
    cfmkit.errors.SpecError
        If the two sides differ and nobody has said that the symmetric model will do.
    """
    if spec.mechanism.profile.file is not None:
        from cfmkit.families.cam.measured_cam_analysis import analyze_built

        return analyze_built(spec)
    left = spec.mechanism.left
    if left is not None and left.moves_differently and spec.analysis.fidelity is None:
        raise SpecError([Problem("", 0, 0, "mechanism.left", UNLIKE)])
    try:
        assembly = assemble(spec)
        check_first_pose(assembly)
        solution = solve(assembly)
        check_springs(solution.elongation, solution.up.contact, assembly.loads.rest_half_width)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    solution = with_band(solution, run.seed)
    shortfalls = _shortfalls(assembly, solution)
    failed = int(np.isnan(solution.up.slider[1:]).sum() + np.isnan(solution.down.slider[1:]).sum())
    warnings = (*shortfalls, *left_out(spec), *findings_of(solution), *touching(solution))
    status, message = Status.COMPLETE, ""
    if shortfalls:
        status, message = Status.PARTIAL, shortfalls[0].message
    elif failed:
        status, message = Status.PARTIAL, f"{failed} of {2 * len(solution.travel)} points have no equilibrium"
    return Result(
        spec=_as_run(assembly.spec, solution),
        status=status,
        message=message,
        curves=(_curve(solution),),
        values={**values_of(solution), **smallest(solution)},
        warnings=warnings,
        travel=(solution.origin + float(solution.travel[0]), solution.origin + _requested(solution, bool(shortfalls))),
        valid=(
            (
                max(solution.corner_travel, float(solution.travel[0])) + solution.origin,
                float(solution.travel[-1]) + solution.origin,
            ),
        ),
        target=target_force(spec, assembly),
        target_curve=None if spec.target_curve else curve_cut_for(assembly),
        allowable_stress=allowable_stress(spec.mechanism),
        closed=DenseLoop(solution),
        effort_error=solution.effort_error,
        part_efforts=DenseLoop(solution).part_efforts,
        tables=listed(parts_of(spec)),
        state=solution,
    )


def with_band(solution: Solution, seed: int) -> Solution:
    """Return a solution with the forces of cams that are cut with errors, where the specification states any."""
    tolerance = solution.assembly.spec.analysis.manufacturing
    if tolerance is None:
        return solution
    from cfmkit.families.cam.manufacturing_scatter import force_band

    return replace(solution, band=force_band(solution.assembly, tolerance, solution.travel, seed))


def _requested(solution: Solution, short: bool) -> float:
    """Return how far the slider was to go [m]; without a request, as far as the flank was to be cut."""
    spec = solution.assembly.spec
    reached, stroke = float(solution.travel[-1]), spec.mechanism.profile.stroke or 0.0
    # the whole stroke but for rounding is the stroke: shares of the travel are then the same places in every run
    return spec.analysis.travel or (stroke if short or isclose(reached, stroke, rel_tol=CLOSE) else reached)


def _as_run(spec: CamSpec, solution: Solution) -> CamSpec:
    """Return the spec with the defaults of the analysis made explicit."""
    travel = _requested(solution, short=False)
    analysis = spec.analysis.model_copy(update={"travel": travel, "gravity": spec.gravity, "fidelity": "quasi-static"})
    return spec.model_copy(update={"analysis": analysis})


def solve(assembly: Assembly) -> Solution:
    """Return states and forces over the travel that the analysis asks for, as far as the track goes."""
    spec, track = assembly.spec, assembly.track
    available = track.end - track.start
    asked = spec.analysis.travel or available
    low, high = stopped(spec)
    travel = np.linspace(low, min(asked, available, high), spec.analysis.points)
    if travel[-1] <= low:
        raise CannotBuild(
            finding("end_stop", f"the lower stop at {mm(low)} leaves no travel ('mechanism.stops.lower')")
        )
    states = track.states(track.start + travel)
    friction = spec.mechanism.rolling_friction
    up = forces(states, assembly.loads, friction)
    down = forces(states, assembly.loads, -friction, -1.0) if friction or assembly.loads.losses else up
    return Solution(assembly, travel, states, up, down, displacement_origin(assembly))


def stopped(spec: CamSpec) -> tuple[float, float]:
    """Return between which travels the stops let the slider move [m]."""
    stops = spec.mechanism.stops
    return (0.0, np.inf) if stops is None else (stops.lower, np.inf if stops.upper is None else stops.upper)


def _shortfalls(assembly: Assembly, solution: Solution) -> tuple[Finding, ...]:
    """Return why the curve ends before what was requested, or before the flank does."""
    found = [assembly.shortfall] if assembly.shortfall else []
    asked, reached = assembly.spec.analysis.travel, float(solution.travel[-1])
    short = asked is not None and reached < asked * (1 - CLOSE)
    if asked is not None and short and stopped(assembly.spec)[1] <= reached * (1 + CLOSE):
        found.append(
            finding(
                "end_stop",
                f"the requested travel is {mm(asked)}, but the slider is stopped at {mm(reached)} "
                "('mechanism.stops.upper')",
            )
        )
    elif assembly.track.turns_back and (short or asked is None):
        found.append(
            finding(
                "brace_too_short",
                f"with a brace of {mm(assembly.track.brace_length)} on this cam the slider stops rising after "
                f"{mm(reached)} of travel, before the flank ends, and the force is unbounded there; use a longer "
                "brace ('mechanism.brace_length'), or a cam cut for this one ('mechanism.profile.brace_length')",
            )
        )
    elif asked is not None and short:
        found.append(
            finding(
                "outside_profile",
                f"the requested travel is {mm(asked)}, but the profile is cut for {mm(reached)} with these parts; "
                "cut a longer profile ('mechanism.profile.stroke') or request less ('analysis.travel')",
            )
        )
    return tuple(found)


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


_SHARES = np.concatenate(
    [np.geomspace(1e-14, 1e-4, 51), np.linspace(0.0, 1.0, 181) ** 2, 1.0 - np.geomspace(1e-9, 0.03, 24)]
)
"""Shares of the travel at which the force is looked at.

With friction it rises from zero to its constant value within nanometres: nodes stand at even shares of the logarithm
there, at even steps of the springs' stretch beyond, and close together before the end, where a brace may come near
horizontal.
"""

_SORTED = np.sort(_SHARES)
_ON_CORNER = np.concatenate([np.geomspace(1e-9, 0.02, 30), np.linspace(0.0, 1.0, 61)])
"""The same on a corner, where it rises within a tenth of a millimetre."""


def nodes(total: FloatArray, corner: FloatArray) -> FloatArray:
    """Return travels so dense that the force hides nothing between two of them, (d, n), increasing [m].

    Parameters
    ----------
    total, corner : (d,) array
        Travel of each cam, and that at which its roller leaves the corner; 0 without one [m].
    """
    if not corner.any():
        return np.asarray(total[:, None] * _SORTED)
    on_corner = np.minimum(corner, total)[:, None] * _ON_CORNER
    return np.sort(np.concatenate([total[:, None] * _SHARES, on_corner], axis=1), axis=1)


@dataclass(frozen=True, eq=False, repr=False)
class DenseLoop(ShortRepr):
    """The loop of a solved mechanism at every place (a `cfmkit.results.ClosedForm`)."""

    solution: Solution

    @cached_property
    def places(self) -> FloatArray:
        """Increasing displacements [m]."""
        solution = self.solution
        low = float(solution.travel[0])
        grid = low + nodes(solution.travel[-1:] - low, np.array([max(solution.corner_travel - low, 0.0)]))[0]
        return np.asarray(grid + solution.origin)

    @cached_property
    def peaks(self) -> FloatArray:
        """Places all over the corner of an undercut cam, where the force has a peak between two samples [m]."""
        corner = min(self.solution.corner_travel, float(self.solution.travel[-1]))
        return np.asarray(corner * ON_CORNER + self.solution.origin) if corner > 0 else np.empty(0)

    def effort(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the force on the way up or down at displacements of any shape [N]."""
        return np.asarray(self._at(branch, places)[1].slider.reshape(np.shape(places)))

    def stress(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the stress below the contact at displacements of any shape [Pa]; NaN on the corner."""
        states, found = self._at(branch, places)
        pressed = flank_pressure(self.solution.assembly, states, found.contact)
        return np.asarray(stress(pressed).reshape(np.shape(places)))

    def part_efforts(self, branch: str, places: FloatArray) -> FloatArray:
        """Return the force of the strongest spring on the slider, without any weight, at displacements [N]."""
        assembly, springs = self.solution.assembly, self.solution.assembly.spec.mechanism.springs
        strongest = max(springs.each) if isinstance(springs.each, tuple) else springs.each
        alone = replace(assembly.loads, roller_weight=0.0, slider_weight=0.0, sideways=(0.0, 0.0), off_plane=0.0)
        unweighted = DenseLoop(replace(self.solution, assembly=replace(assembly, loads=alone)))
        return np.asarray(strongest / assembly.loads.stiffness * np.abs(unweighted.effort(branch, places)))

    def _at(self, branch: str, places: FloatArray) -> tuple[TrackStates, Forces]:
        """Return where the rollers are at displacements, and the forces there, as one row."""
        solution = self.solution
        track, friction = solution.assembly.track, solution.assembly.spec.mechanism.rolling_friction
        travel = np.clip(np.ravel(places) - solution.origin, 0.0, solution.travel[-1])
        states = track.states(track.start + travel)
        way = 1.0 if branch == "load" else -1.0
        return states, forces(states, solution.assembly.loads, way * friction, way)
