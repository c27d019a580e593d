"""Where a motion stops being one of this mechanism: rollers in each other's way, lifted off, or held by nothing.

Each condition is a margin over time, positive while it holds. The place at which the first of them is
lost is found by bisection of the closed kinematics, so that it does not depend on the number of points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.build import flanks_cross, rollers_overlap
from cfmkit.families.cam.dynamics.inverse import respond
from cfmkit.families.cam.findings import finding
from cfmkit.families.findings import mm, newton
from cfmkit.families.no_mechanism import CannotBuild
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.moving_parts import Machine
    from cfmkit.families.cam.dynamics.solution import Build
    from cfmkit.results import Finding

BISECTIONS = 60
ROUNDING = 1e-9
"""A contact force below zero by this part of the largest is rounding: springs at rest press with nothing."""


@dataclass(frozen=True)
class MotionEnding:
    """When a motion ends before its time [s], and why."""

    time: float
    finding: Finding


def ending(parts: Build, times: FloatArray, origin: float) -> MotionEnding | None:
    """Return where a motion becomes impossible; None where it never does.

    Parameters
    ----------
    parts : Build
        The mechanism and its motion.
    times : (n,) array
        At which it is looked at [s].
    origin : float
        What is added to slider positions to give displacements [m].

    Raises
    ------
    CannotBuild
        If the first pose is impossible already.
    """
    machine, motion = parts.machine, parts.motion
    known = _margins(machine, motion.at(times))
    first: tuple[int, str] | None = None
    for name, margin in known.items():
        lost = margin < -_slack(name, margin, machine)
        if name == "spring_slack":
            lost &= np.maximum.accumulate(~lost)  # springs that are slack from the start on tighten later
        if lost.any() and (first is None or int(np.argmax(lost)) < first[0]):
            first = int(np.argmax(lost)), name
    if first is None:
        return None
    index, name = first
    if not index:
        raise CannotBuild(_said(name, known, machine, "at the first point of the motion"))

    def holds(time: float) -> bool:
        margin = _margins(machine, motion.at(np.array([time])))[name]
        return bool(margin[0] > 0)

    low, high = float(times[index - 1]), float(times[index])
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    place = float(motion.at(np.array([low])).position[0]) + origin
    return MotionEnding(low, _said(name, known, machine, f"at {format_short(low, 'time')} ({mm(place)})"))


def _margins(machine: Machine, moment: tuple[FloatArray, FloatArray, FloatArray]) -> Mapping[str, FloatArray]:
    """Return what must not be negative, by the name of the finding that says so, (n,) each."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found = respond(machine, moment)  # type: ignore[arg-type]
    radius, center = machine.constants.radius, found.at.center
    touching = (center + 1j * radius * found.at.tangent).real
    return {
        "flanks_collide": touching.min(axis=0),
        "rollers_collide": np.abs(center[0] + center[1].conj()) - float(radius.sum()),
        "lift_off": found.contact.min(axis=0),  # NaN where friction holds a roller: no contact is lost there
        "spring_slack": found.elongation,
    }


def _slack(name: str, margin: FloatArray, machine: Machine) -> float:
    if name == "lift_off":
        return ROUNDING * float(np.nanmax(np.abs(margin), initial=0.0))
    return 1e-12 * max(machine.rest_length, 1.0)


def _said(name: str, known: Mapping[str, FloatArray], machine: Machine, when: str) -> Finding:
    worst = float(np.nanmin(known[name]))
    told: dict[str, Callable[[], Finding]] = {
        "flanks_collide": lambda: flanks_cross(worst),
        "rollers_collide": lambda: rollers_overlap(worst, f"{when} and after"),
        "lift_off": lambda: finding(
            "lift_off",
            f"a roller leaves the cam {when}: it would have to be pulled with up to {newton(-worst)} from there on; "
            "use stiffer springs ('mechanism.springs.stiffness'), lighter parts ('mechanism.masses') or a slower "
            "motion ('analysis.dynamics.time')",
        ),
        "spring_slack": lambda: finding(
            "spring_slack",
            f"the springs go slack {when}: they get up to {mm(-worst)} shorter than their rest length and hold the "
            f"rollers no longer; use shorter springs ('mechanism.rest_half_width', here {mm(machine.rest_length / 2)})",
        ),
    }
    return told[name]()
