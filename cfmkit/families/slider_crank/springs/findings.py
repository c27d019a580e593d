"""What is wrong, or surprising, about a solved slider-crank with springs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import deg, mm, newton
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.springs.bistability_class import BISTABLE, BOUNDARY, SNAPS, TRISTABLE
from cfmkit.families.slider_crank.springs.bought_spring_limits import bought_spring_faults
from cfmkit.families.slider_crank.springs.sprung_linkage import TURN
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.results import Finding


RUN_IN = 0.02
"""An unloaded position nearer than this to the stretched one [rad] is meant to be stretched, nearly."""


def findings_of(spec: SliderCrankSpec, solution: Solution) -> tuple[Finding, ...]:
    """Return everything that the user must know."""
    if not solution.assembly.rates.any():
        return (finding("no_spring", "no spring has a rate: the mechanism moves freely; set 'mechanism.springs'"),)
    held = _of_friction(solution)
    own = _of_torque(solution) if solution.assembly.drive == "torque" else _of_force(spec, solution)
    return (*held, *_of_class(solution), *own, *_of_band(spec, solution), *_of_limits(spec, solution))


def place(solution: Solution, motion: float) -> str:
    """Return a place of the motion as the user reads it."""
    return format_short(motion, solution.assembly.dimension)


def _of_friction(solution: Solution) -> Iterator[Finding]:
    for name, way in zip(("forth", "back"), solution.ways or (), strict=False):
        held = ~np.isfinite(way.effort)
        if held[1:].any():
            first, last = (place(solution, float(solution.motion[held][end])) for end in (0, -1))
            yield finding(
                "self_locks",
                f"on the way {name} the mechanism self-locks from {first} to {last}: the line of force runs inside "
                "the friction circles of the pins; use pins of smaller diameter or friction ('mechanism.pins'), or "
                "a motion that ends before the stretched position",
            )


def _of_class(solution: Solution) -> Iterator[Finding]:
    found, unstable = solution.character, solution.nearest(False)
    if found.kind == SNAPS and unstable is not None:
        yield finding(
            "second_stable_outside",
            f"at {place(solution, unstable.motion)} the mechanism snaps through, and the motion ends before the "
            "next stable position; extend the motion to find it",
        )
    if abs(found.drop - 1.0) < BOUNDARY:
        side = "has" if found.kind in (SNAPS, BISTABLE, TRISTABLE) else "just misses"
        yield finding(
            "class_boundary",
            f"the lowest {solution.assembly.drive} after the peak is {100 * (1 - found.drop):.2g} % of the peak: the "
            f"mechanism {side} a second equilibrium, and springs a little stiffer or softer change that",
        )
    start = solution.assembly.start
    if found.low <= start <= found.high and _restless(solution):
        yield finding(
            "quartic_minimum",
            "only the slider's spring acts, and it is relaxed in the stretched position: the energy grows with the "
            "fourth power there, and the stiffness at rest is zero; add a torsion spring",
        )


def _restless(solution: Solution) -> bool:
    assembly = solution.assembly
    return assembly.drive == "torque" and not assembly.rates[:3].any() and assembly.linkage.knee(assembly.unloaded) == 0


def _of_torque(solution: Solution) -> Iterator[Finding]:
    assembly, found = solution.assembly, solution.character
    turns = found.high - found.low >= TURN * (1 - 1e-9)
    wound = [name for name, rate in zip(JOINTS[:2], assembly.rates, strict=False) if rate > 0.0]
    if turns and wound:
        yield finding(
            "spring_winds_up",
            f"over a full turn the spring at the {' and at the '.join(name.replace('_', ' ') for name in wound)} is "
            "wound up: the torque differs in the next turn; only springs at slider and slider pin repeat",
        )
    rests = [item.motion for item in found.equilibria if item.stable]
    again = [(a, b) for a in rests for b in rests if a < b and _same_pose(a, b)]
    if again:
        different = sum(not any(_same_pose(a, b) for a in rests if a < b) for b in rests)
        yield finding(
            "same_position_twice",
            f"{deg(again[0][0])} and {deg(again[0][1])} are the same position: the {found.name} curve has "
            f"{different} different stable positions in a full turn",
        )


def _same_pose(first: float, second: float) -> bool:
    """Return whether two crank angles are whole turns apart."""
    return abs(math.remainder(second - first, TURN)) < 1e-6


def _of_force(spec: SliderCrankSpec, solution: Solution) -> Iterator[Finding]:
    assembly, link = solution.assembly, solution.assembly.linkage
    knee = link.knee(assembly.unloaded)
    if knee == 0.0:
        found = solution.character.effort(0.0)
        yield finding(
            "stretched_start",
            f"the linkage starts in the stretched position, where the force is 0/0: its limit is {newton(found)}, "
            "the buckling load of a column; a kink smaller than the part's tolerance determines the side",
        )
        if spec.analysis.side is None:
            yield finding(
                "two_positions",
                "from the stretched position the crank can move to either side, and 'analysis.side' is not stated: "
                "'beyond' is assumed; with an offset the force on the other side differs",
                "analysis.side=before",
            )
    elif math.isnan(assembly.rest) and abs(knee) < RUN_IN and solution.motion[0] <= 0.0:
        yield finding(
            "force_unbounded",
            f"the springs are relaxed {deg(abs(assembly.unloaded - link.stretched_angle))} away, on the far side "
            "of the stretched position: at the stretched position the force is unbounded; leave 'analysis.side' out to "
            "start on the side on which they are relaxed",
        )
    elif abs(knee) < RUN_IN and solution.motion[0] <= 0.0 <= solution.motion[-1]:
        yield from _run_in(solution)
    low = assembly.reach[0]
    span = solution.character.high - solution.character.low
    if abs(knee) >= RUN_IN and solution.character.low < low + 0.01 * span and low < -1e-9 * span:
        yield finding(
            "force_unbounded",
            f"at {mm(low)} of travel crank and coupler are in one line and the springs are not relaxed: no finite "
            "force moves the slider there; choose a motion that does not reach it",
        )


def _run_in(solution: Solution) -> Iterator[Finding]:
    """Yield how far the force needs to come up: to 95 % of what it is in the middle of the motion."""
    motion = np.geomspace(1e-9, 1.0, 400) * float(solution.motion[-1])
    force = solution.assembly.rates @ solution.assembly.units(motion).effort
    there = np.flatnonzero(force >= 0.95 * float(np.interp(0.5 * motion[-1], motion, force)))
    lead = solution.assembly.unloaded - solution.assembly.linkage.stretched_angle
    until = f"within {mm(float(motion[there[0]]))} it reaches 95 %" if len(there) else "it never reaches 95 %"
    kink = abs(math.sin(lead)) * solution.assembly.linkage.crank
    yield finding(
        "run_in",
        f"the springs are relaxed {deg(abs(lead))} off the stretched position, a kink of {mm(kink)} at the crank "
        f"pin: the force begins at zero, and {until} of that at mid-travel; a part made less accurately may bend "
        "to the other side. 'unloaded_offset: 0' starts at the full force",
    )


def _of_band(spec: SliderCrankSpec, solution: Solution) -> Iterator[Finding]:
    found, reference, window = solution.character, solution.reference, solution.character.window
    asked = spec.analysis.reference_angle if solution.assembly.drive == "torque" else spec.analysis.reference_travel
    if asked is not None and not found.low <= reference <= found.high:
        yield finding("reference_outside", f"the reference {place(solution, reference)} is outside the motion")
    elif found.low <= reference <= found.high and solution.band is None:
        yield finding(
            "reference_zero",
            f"at the reference {place(solution, reference)} the {solution.assembly.drive} is zero, and a "
            "band stated in per cent of zero has no width; choose another reference",
        )
    if window is None:
        return
    inside = (solution.motion >= window[0]) & (solution.motion <= window[1])
    effort = solution.effort[inside]
    if inside.any() and effort.min() < 0.0 < effort.max():
        low, high = (format_short(float(end), solution.assembly.drive) for end in (effort.min(), effort.max()))
        yield finding(
            "effort_changes_sign",
            f"in the window the {solution.assembly.drive} changes sign: it goes from {low} to {high}",
        )
    if solution.assembly.drive == "torque" and not window[0] <= solution.assembly.stretched <= window[1]:
        yield finding(
            "stretched_outside_window",
            f"the window {deg(window[0])} to {deg(window[1])} does not contain the stretched position "
            f"{deg(solution.assembly.stretched)}: only around it is the slider's spring certain to give negative "
            "stiffness",
        )


def _of_limits(spec: SliderCrankSpec, solution: Solution) -> Iterator[Finding]:
    for fault, message, cures in bought_spring_faults(spec, solution.extremes.largest_turns):
        yield finding(fault, message, *cures)
    limits = spec.mechanism.limits
    if limits is None:
        return
    for name, value in zip(JOINTS, solution.extremes.largest_turns.tolist(), strict=True):
        limit = getattr(limits, name)
        if limit is not None and value > limit * (1 + 1e-9):
            dimension = "length" if name == "slider" else "angle"
            reported, allowed = format_short(value, dimension), format_short(limit, dimension)
            what = "slider's spring" if name == "slider" else f"spring at the {name.replace('_', ' ')}"
            yield finding("joint_overrotated", f"the {what} is deflected by {reported}; its limit is {allowed}")
