"""Warnings about a motion of a cam mechanism."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.contact_pressure import index_of_largest
from cfmkit.families.cam.dynamics.machine_from_spec import slender_rod, solid_cylinder
from cfmkit.families.cam.dynamics.scalar_results import contact_pressure
from cfmkit.families.cam.findings import find_overstress, finding
from cfmkit.families.cam.mechanism_from_spec import directions
from cfmkit.families.findings import mm, newton
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.families.cam.dynamics.solution import Build, MotionSolution
    from cfmkit.results import Finding


ROLLER_SHARE = (0.25, 2.0)
"""Moment of inertia of a roller over that of a solid cylinder: below, its mass would lie within half the
radius; above, outside of the roller (a thin ring has 2)."""
BRACE_SHARE = (0.1, 3.0)  # the same for a brace over a slender rod: 3 has all its mass at the ends
INVERSE_OPTION = "analysis.dynamics.method=inverse"  # as ``--set`` takes it


def findings_of(moved: MotionSolution) -> tuple[Finding, ...]:
    """Return every finding about a motion, the gravest first."""
    checks = (_overpressure, _slack_cable, _jams, _corner, _spring_limits, _odd_inertias, _no_friction, _no_weight)
    return tuple(warning for check in checks for warning in check(moved))


def leaves_profile(parts: Build, span: tuple[float, float]) -> Finding:
    """Return what to say about a motion that leaves the profile."""
    ends = sorted((parts.motion.start, parts.motion.start + parts.motion.stroke))
    return finding(
        "outside_profile",
        f"the requested motion of the slider is from {mm(ends[0])} to {mm(ends[1])}, but profile and braces allow only"
        f" {mm(span[0])} to {mm(span[1])} (heights above 'analysis.dynamics.origin'; change "
        "'slider_position' or 'stroke' there)",
    )


def runs_on_corner(parts: Build) -> Finding:
    """Return what to say about a motion on the corner that the nine-coordinate model cannot describe."""
    above = max(side.turned_track.corner_end - side.height for side in (parts.machine.right, parts.machine.left))
    return finding(
        "undercut",
        "on the corner of the cam the contact is not a function of its height, as the nine-coordinate model needs: "
        f"start above {mm(above)} ('analysis.dynamics.slider_position'), or use 'analysis.dynamics.method: inverse'",
        INVERSE_OPTION,
    )


def _overpressure(moved: MotionSolution) -> Iterator[Finding]:
    pressed = contact_pressure(moved)
    top = index_of_largest(pressed)
    reported = (
        None
        if top is None
        else find_overstress(moved.spec.mechanism, float(pressed[top]), f"at {_instant(moved, top)}")
    )
    if reported:
        yield reported


def _slack_cable(moved: MotionSolution) -> Iterator[Finding]:
    force = moved.history.force
    lost = force <= 0
    if lost.any():
        yield finding(
            "slack_cable",
            f"the force falls to {newton(float(np.nanmin(force)))}; it is not positive "
            f"{_span_text(moved, lost)}: a cable would go slack",
        )


def _jams(moved: MotionSolution) -> Iterator[Finding]:
    lost = ~np.isfinite(moved.history.force)
    if not lost.any():
        return
    if moved.build.machine.friction and moved.build.motion.stroke > 0:
        yield finding("up_jam", f"a roller self-locks {_span_text(moved, lost)}: no force moves the slider there")
    else:
        yield finding(
            "dead_point", f"the slider has no leverage on a roller {_span_text(moved, lost)}: the force is unbounded"
        )


def _corner(moved: MotionSolution) -> Iterator[Finding]:
    corner = moved.history.on_corner
    if corner.any():
        yield finding("undercut", f"a roller pivots on the corner of its cam {_span_text(moved, corner)}")


def _spring_limits(moved: MotionSolution) -> Iterator[Finding]:
    elongation, limit = moved.history.elongation, moved.spec.mechanism.springs.max_elongation
    slack = elongation < -1e-12
    if slack.any():
        yield finding(
            "spring_slack",
            f"the springs are up to {mm(-float(elongation.min()))} shorter than their rest length "
            f"{_span_text(moved, slack)}: they carry no force there",
        )
    if limit and elongation.max() > limit * (1 + 1e-9):
        over = elongation > limit
        yield finding(
            "spring_overstretched",
            f"the springs are stretched by {mm(float(elongation.max()))}, their limit is {mm(limit)}, "
            f"exceeded {_span_text(moved, over)}",
        )


def _odd_inertias(moved: MotionSolution) -> Iterator[Finding]:
    machine = moved.build.machine
    sides = ((machine.right, "right"), (machine.left, "left"))
    alike = machine.left.parts == machine.right.parts
    for side, name in sides[: 1 if alike else 2]:
        parts = side.parts
        whose = "a" if alike else f"the {name}"
        yield from _mismatch(
            f"{whose} roller",
            parts.roller_inertia,
            solid_cylinder(parts.roller_mass, parts.roller_radius),
            ROLLER_SHARE,
        )
        yield from _mismatch(
            f"{whose} brace", parts.brace_inertia, slender_rod(parts.brace_mass, parts.brace_length), BRACE_SHARE
        )


def _mismatch(what: str, stated: float, expected: float, allowed: tuple[float, float]) -> Iterator[Finding]:
    low, high = allowed
    if stated and not low * expected <= stated <= high * expected:
        body, size = ("solid cylinder", "radius") if "roller" in what else ("slender rod", "length")
        share = f"{stated / expected:.3g} times" if expected else "more than"
        yield finding(
            "inertia_mismatch",
            f"the moment of inertia of {what}, {format_short(stated, 'inertia')}, does not fit its mass and {size}: "
            f"it is {share} that of a {body}, {format_short(expected, 'inertia')}; check unit and decimal point",
            short=f"the moment of inertia of {what} is {share} that of a {body}",
        )


def _no_friction(moved: MotionSolution) -> Iterator[Finding]:
    dynamics = moved.spec.analysis.dynamics
    if dynamics and dynamics.method == "multibody" and moved.spec.mechanism.rolling_friction:
        yield finding(
            "friction_left_out",
            "the nine-coordinate model has no rolling resistance: 'mechanism.rolling_friction' = "
            f"{moved.spec.mechanism.rolling_friction:g} is neglected; 'analysis.dynamics.method: inverse' includes it",
            INVERSE_OPTION,
        )


def _no_weight(moved: MotionSolution) -> Iterator[Finding]:
    dynamics, spec = moved.spec.analysis.dynamics, moved.spec
    if dynamics and dynamics.method == "multibody" and spec.gravity and directions(spec.mechanism.mounting)[1]:
        yield finding(
            "friction_left_out",
            "the nine-coordinate model neglects the weight across the slider's travel, which 'mechanism.mounting' "
            "implies; 'analysis.dynamics.method: inverse' includes it",
            INVERSE_OPTION,
        )


def _span_text(moved: MotionSolution, where: NDArray[np.bool_]) -> str:
    """Return ``from 0.07 s (171.8 mm) to 0.09 s (195 mm)``: first and last of the marked points."""
    first, last = np.flatnonzero(where)[[0, -1]]
    ends = [_instant(moved, int(index)) for index in (first, last)]
    many = "" if where[first : last + 1].all() else ", with gaps"
    return f"at {ends[0]}" if first == last else f"from {ends[0]} to {ends[1]}{many}"


def _instant(moved: MotionSolution, index: int) -> str:
    return f"{format_short(float(moved.history.times[index]), 'time')} ({mm(float(moved.displacement[index]))})"
