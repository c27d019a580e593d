"""What is wrong with a solved cam mechanism: each failure mode, found and put into numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.contact import overstressed, worst
from cfmkit.families.cam.findings import finding
from cfmkit.families.cam.values import contact_pressure
from cfmkit.families.findings import mm

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.model import Solution
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.results import Finding


def findings_of(solution: Solution) -> tuple[Finding, ...]:
    """Return every finding about a solved mechanism, the gravest first."""
    checks = (_undercut, _jam, _dead_point, _springs, _contact, _pressure)
    return tuple(found for check in checks for found in check(solution))


def left_out(spec: CamSpec) -> tuple[Finding, ...]:
    """Return what to say where the two sides differ: the quasi-static model is symmetric."""
    errors, found = spec.mechanism.errors, []
    if errors and (errors.slider_deviation or errors.flank_angle):
        found.append("'mechanism.errors'")
    if spec.mechanism.left:
        found.append("'mechanism.left'")
    if not found:
        return ()
    verb = "counts" if len(found) == 1 else "count"
    message = (
        f"the quasi-static model is symmetric: {' and '.join(found)} {verb} in the dynamic model only; "
        "give 'analysis.dynamics' a slow motion to see the effect"
    )
    return (finding("symmetric_model", message),)


def _undercut(solution: Solution) -> Iterator[Finding]:
    profile, corner = solution.assembly.track.profile, solution.corner_travel
    if not profile.corner or not corner:
        return
    law = profile.path.law
    radius, missing = float(law.curvature_radius(law.rest_half_width)), max(-_offset(solution), 0.0)
    roller = f"the {mm(profile.roller_radius - missing)} roller"
    roller += f", with {mm(missing)} of the flank missing," if missing else ""
    cure = law.smallest_force_constant(profile.roller_radius)
    larger = f" or A >= {mm(cure)}" if cure else ""
    fits = f"a roller <= {mm(radius - missing)}" if radius > missing else "less missing material"
    yield finding(
        "undercut",
        f"{roller} is larger than the path's smallest radius of curvature "
        f"({mm(radius)}, at the start); the first {mm(corner)} run on a corner, without the constant force. "
        f"Use {fits}{larger}",
        *(["design.avoid_undercut=true"] if cure and solution.assembly.spec.design else []),
    )
    yield finding(
        "contact_not_single_valued",
        f"for the first {mm(corner)} of travel the contact stays on the corner at x = {mm(profile.corner.point[0])}, "
        f"y = {mm(profile.corner.point[1])}: a profile x(y) measured by the roller's height is not single-valued there",
    )
    if solution.assembly.spec.mechanism.contact:
        yield finding(
            "corner_pressure",
            f"on a sharp corner the contact pressure has no bound: it is reported from {mm(corner)} of travel on",
        )


def _offset(solution: Solution) -> float:
    return solution.assembly.spec.mechanism.profile.offset


def _jam(solution: Solution) -> Iterator[Finding]:
    friction = solution.assembly.spec.mechanism.rolling_friction
    for low, high in solution.jams:
        yield finding(
            "up_jam",
            f"on the way up friction ({friction:g}) holds the roller from {mm(low)} to {mm(high)} of travel: "
            "no force moves the slider there; use less friction, or start beyond",
        )


def _dead_point(solution: Solution) -> Iterator[Finding]:
    track, loads = solution.assembly.track, solution.assembly.loads
    if track.dead_point < track.start - 1e-9 * track.brace_length:
        yield finding(
            "dead_point",
            "at the start the slider must go down before the rollers move out, by "
            f"{mm(track.start - track.dead_point)}: the brace is too short for this profile",
        )
    elif np.isnan(solution.up.slider[0]) or np.isnan(solution.down.slider[0]):
        cause = "weight" if loads.roller_weight else "spring pretension or friction"
        yield finding(
            "dead_point",
            f"at the start the slider has no lever on the rollers: the force from {cause} has no bound there; "
            "state a window that begins later, or avoid it with a gravity-compensated profile",
        )


def _travel_at(solution: Solution, elongation: float) -> float:
    """Return the travel at which the springs are stretched by so much [m]."""
    track, rest = solution.assembly.track, solution.assembly.loads.rest_half_width
    return min(track.slider_at(rest + 0.5 * elongation) - track.start, float(solution.travel[-1]))


def _springs(solution: Solution) -> Iterator[Finding]:
    slack = solution.elongation < -1e-12
    if slack.any():
        last = _travel_at(solution, 0.0)
        yield finding(
            "spring_slack",
            f"the springs are shorter than their rest length for the first {mm(last)} of travel, by up to "
            f"{mm(-float(solution.elongation.min()))}: they carry nothing there",
        )
    limit = solution.assembly.spec.mechanism.springs.max_elongation
    longest = float(solution.elongation[-1])
    if limit and longest > limit * (1 + 1e-9):
        past = _travel_at(solution, limit)
        yield finding(
            "spring_overstretched",
            f"the springs are stretched by {mm(longest)}, their limit is {mm(limit)}, reached at {mm(past)} of travel",
        )


def _contact(solution: Solution) -> Iterator[Finding]:
    # Springs that pull keep the rollers on the cam as long as nothing accelerates: the contact force is positive.
    for way, state in (("up", solution.up), ("down", solution.down)):
        slack = (solution.elongation > 0) & (state.slider <= 0)
        if slack.any():
            yield finding(
                "slack_cable",
                f"on the way {way} the force on the slider is not positive from {_where(solution.travel, slack)} "
                "of travel: a cable would go slack",
            )


def _pressure(solution: Solution) -> Iterator[Finding]:
    pressed = contact_pressure(solution)
    if (top := worst(pressed)) is not None:
        place = f"at {mm(float(solution.travel[top]))} of travel"
        if told := overstressed(solution.assembly.spec.mechanism, float(pressed[top]), place):
            yield told


def _where(travel: FloatArray, mask: NDArray[np.bool_]) -> str:
    hits = np.flatnonzero(mask)
    return f"{mm(float(travel[hits[0]]))} to {mm(float(travel[hits[-1]]))}"
