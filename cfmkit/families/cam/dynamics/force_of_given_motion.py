"""Dynamic analysis of a cam mechanism: the force that a given motion of its slider needs, and where the motion ends.

The curve is the force over the slider's displacement, in the order of time, with everything that happens at contacts,
pins and springs beside it. The displacement is that of the quasi-static model, so that the two can be overlaid.

Where a motion stops being one of this mechanism: rollers in each other's way, lifted off, or held by nothing. Each
condition is a margin over time, positive while it holds. The place at which the first of them is lost is found by
bisection of the closed kinematics, so that it does not depend on the number of points.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 4 and 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.curves import Column, Curve
from cfmkit.families.cam.contact_pressure import allowable_stress, stress
from cfmkit.families.cam.dynamics.findings import findings_of, leaves_profile, runs_on_corner
from cfmkit.families.cam.dynamics.inverse import respond, statics
from cfmkit.families.cam.dynamics.machine_from_spec import build, stated_motion
from cfmkit.families.cam.dynamics.nine_coordinate_multibody import CornerContact, NineCoordinates, reactions
from cfmkit.families.cam.dynamics.scalar_results import contact_pressure, slow_force, values_of
from cfmkit.families.cam.dynamics.solution import Build, History, MotionSolution
from cfmkit.families.cam.findings import finding, warn_of_neglected_friction
from cfmkit.families.cam.mechanism_from_spec import displacement_origin, flanks_cross, rollers_overlap
from cfmkit.families.cam.statics import constant_force
from cfmkit.families.findings import CannotBuild, mm, newton, no_result
from cfmkit.results import Result, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.nine_coordinate_multibody import Scheme
    from cfmkit.families.cam.dynamics.roller_curves_and_motion import Cycloid, Machine
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.run_control import Run
    from cfmkit.results import Finding


def analyze(spec: CamSpec, run: Run) -> Result:
    """Return the force that the motion in ``analysis.dynamics`` needs, and everything that is wrong with it.

    Branch ``load`` for a motion upwards, ``unload`` downwards. PARTIAL if the motion leaves the profile, or becomes
    impossible (a roller lifts off); NO_EQUILIBRIUM if the mechanism cannot exist, or the motion lies outside it.
    """
    try:
        parts = build(spec)
        times, missing = _keep_inside(parts, spec)
        end = find_ending(parts, times, _displacement(parts, 0.0))
        if end:
            times, missing = _times_until(end.time, times, spec), (end.finding, *missing)
        moved = _solve_motion(spec, parts, times)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    lost = int((~np.isfinite(moved.history.force)).sum())
    status, message = Status.COMPLETE, ""
    if missing:
        status, message = Status.PARTIAL, missing[0].message
    elif lost:
        status, message = Status.PARTIAL, f"at {lost} of {len(times)} points no finite force moves the slider"
    return Result(
        spec=moved.spec,
        status=status,
        message=message,
        curves=(_curve(moved),),
        values=values_of(moved),
        warnings=(*missing, *findings_of(moved), *warn_of_neglected_friction(spec, "the dynamic model")),
        travel=_requested_ends(parts),
        target=spec.design.force if spec.design else constant_force(parts.right),
        allowable_stress=allowable_stress(spec.mechanism),
        state=moved,
    )


def _keep_inside(parts: Build, spec: CamSpec) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Return the times at which the slider is where the flanks allow it, and what is said if those are not all."""
    dynamics, motion = stated_motion(spec), parts.motion
    times = motion.times(dynamics.points)
    low, high = parts.machine.span
    position, slack = motion.evaluate(times).position, 1e-12 * (high - low)
    inside = (position >= low - slack) & (position <= high + slack)
    if inside.all():
        return times, ()
    warning = leaves_profile(parts, (low, high))
    if inside[:2].sum() < 2:
        raise CannotBuild(warning)
    return times[: int(np.argmin(inside))], (warning,)


def _times_until(end: float, times: FloatArray, spec: CamSpec) -> FloatArray:
    """Return the times before a motion ends, and its end; the nine coordinates are known at even times only."""
    before = times[times < end]
    return before if stated_motion(spec).method == "multibody" else np.append(before, end)


def _displacement(parts: Build, position: Any) -> Any:
    """Return the displacement that the analysis asks for at slider positions [m]."""
    return position + parts.lift - parts.right.track.start + displacement_origin(parts.right)


def _solve_motion(spec: CamSpec, parts: Build, times: FloatArray) -> MotionSolution:
    low, high = parts.machine.span
    upward = parts.motion.stroke > 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        history = _compute_history(spec, parts, times)
        static = statics(parts.machine, np.clip(history.slider.position, low, high), upward).force
    displacement = _displacement(parts, history.slider.position)
    return MotionSolution(_with_explicit_defaults(spec, parts), parts, history, static, displacement)


def _requested_ends(parts: Build) -> tuple[float, float]:
    """Return where the motion was to start and to end [m]."""
    start, end = _displacement(parts, parts.motion.evaluate(parts.motion.times(2)).position).tolist()
    return start, end


def _compute_history(spec: CamSpec, parts: Build, times: FloatArray) -> History:
    if stated_motion(spec).closed:
        return inverse_history(parts.machine, parts.motion, times)
    try:
        return multibody_history(parts.machine, parts.motion, stated_motion(spec).points, first=len(times))
    except CornerContact:
        warning = runs_on_corner(parts)
        raise CannotBuild(warning) from None


def _with_explicit_defaults(spec: CamSpec, parts: Build) -> CamSpec:
    """Return the spec with the defaults of the analysis made explicit."""
    resolved, masses = parts.right.spec, spec.mechanism.masses
    analysis = spec.analysis.model_copy(update={"fidelity": "dynamic", "gravity": spec.gravity})
    changes: dict[str, object] = {"analysis": analysis}
    if masses is not None:
        side = parts.machine.right.parts
        written = {"brace_inertia": side.brace_inertia, "roller_inertia": side.roller_inertia}
        mechanism = resolved.mechanism.model_copy(update={"masses": masses.model_copy(update=written)})
        changes["mechanism"] = mechanism
    return resolved.model_copy(update=changes)


def _compare_with_slow(moved: MotionSolution) -> FloatArray:
    """Return the force over that of the same motion within one second [SS, Fig. 14]; NaN where that is zero."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = moved.history.force / slow_force(moved)
    return np.where(np.isfinite(ratio), ratio, np.nan)


def _curve(moved: MotionSolution) -> Curve:
    history, slider = moved.history, moved.history.slider
    extra = {
        "time": Column(history.times, "time"),
        "speed": Column(slider.speed, "velocity"),
        "acceleration": Column(slider.acceleration, "acceleration"),
        "static_force": Column(moved.static, "force"),
        "force_over_slow": Column(_compare_with_slow(moved), "ratio"),
    }
    sides = (
        ("contact_force", history.contact, "force"),
        ("traction", history.traction, "force"),
        ("brace_force", history.brace, "force"),
        ("slider_pin_force", history.pin, "force"),
        ("roller_speed", history.spin, "angular_velocity"),
    )
    for name, rows, dimension in sides:
        extra |= {f"{name}_{side}": Column(row, dimension) for side, row in zip(("right", "left"), rows, strict=True)}
    extra["spring_elongation"] = Column(history.elongation, "length")
    extra["contact"] = Column(np.where(history.on_corner, "corner", "flank"), "text")
    if moved.spec.mechanism.contact:
        pressed = contact_pressure(moved)
        extra |= {"contact_pressure": Column(pressed, "stress"), "max_stress": Column(stress(pressed), "stress")}
    branch = np.full(len(history.times), "load" if moved.build.motion.stroke > 0 else "unload")
    with np.errstate(invalid="ignore"):
        stable = (history.contact[0] > 0) & (history.contact[1] > 0)
    return Curve(moved.displacement, history.force, branch, stable, extra)


def inverse_history(machine: Machine, motion: Cycloid, times: FloatArray) -> History:
    """Return the history by inverse dynamics."""
    response = respond(machine, motion.evaluate(times))
    return History(
        times=times,
        slider=response.slider,
        force=response.force,
        contact=response.contact,
        traction=response.traction,
        spin=response.spin,
        brace=np.abs(response.roller_pin),
        pin=np.abs(response.slider_pin),
        elongation=response.elongation,
        center=response.at.center,
        on_corner=response.on_corner,
    )


def multibody_history(
    machine: Machine, motion: Cycloid, points: int, scheme: Scheme | None = None, first: int | None = None
) -> History:
    """Return the history by the nine-coordinate formulation, without rolling resistance.

    Of `points` equally spaced times over the motion, it is known at the `first` ones where the motion ends early.

    Raises CornerContact if a roller runs on the corner of its cam.
    """
    model = NineCoordinates(machine)
    trajectory = model.run(motion, points, scheme, first)
    center, contact, traction, roller_pin, slider_pin, spin = reactions(model, trajectory)
    return History(
        times=trajectory.times,
        slider=motion.evaluate(trajectory.times),
        force=trajectory.force,
        contact=contact,
        traction=traction,
        spin=spin,
        brace=np.abs(roller_pin),
        pin=np.abs(slider_pin),
        elongation=machine.springs.elongation(np.abs(center[0] + center[1].conj())),
        center=center,
        on_corner=np.zeros(len(trajectory.times), dtype=bool),
    )


N_BISECTIONS = 60  # they leave 1e-18 of a step in time: less than rounding
CONTACT_FORCE_RTOL = 1e-9
"""A contact force below zero by this part of the largest is rounding: springs at rest press with nothing."""


@dataclass(frozen=True)
class MotionEnding:
    """When a motion ends before its time [s], and why."""

    time: float
    finding: Finding


def find_ending(parts: Build, times: FloatArray, origin: float) -> MotionEnding | None:
    """Return where a motion becomes impossible; None if it never does.

    It is looked at at times (n,) [s]; `origin` added to a slider position gives the displacement [m].
    Raises CannotBuild if the first pose is impossible already.
    """
    machine, motion = parts.machine, parts.motion
    margins = _margins(machine, motion.evaluate(times))
    first: tuple[int, str] | None = None
    for name, margin in margins.items():
        lost = margin < -_margin_tolerance(name, margin, machine)
        if name == "spring_slack":
            lost &= np.maximum.accumulate(~lost)  # springs that are slack from the start on tighten later
        if lost.any() and (first is None or int(np.argmax(lost)) < first[0]):
            first = int(np.argmax(lost)), name
    if first is None:
        return None
    index, name = first
    if not index:
        raise CannotBuild(_describe_ending(name, margins, machine, "at the first point of the motion"))

    def holds(time: float) -> bool:
        margin = _margins(machine, motion.evaluate(np.array([time])))[name]
        return bool(margin[0] > 0)

    low, high = float(times[index - 1]), float(times[index])
    for _ in range(N_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    place = float(motion.evaluate(np.array([low])).position[0]) + origin
    return MotionEnding(low, _describe_ending(name, margins, machine, f"at {format_short(low, 'time')} ({mm(place)})"))


def _margins(machine: Machine, slider: tuple[FloatArray, FloatArray, FloatArray]) -> Mapping[str, FloatArray]:
    """Return what must not be negative, by the name of the finding that says so, (n,) each."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        response = respond(machine, slider)  # type: ignore[arg-type]
    radius, center = machine.parts.roller_radius, response.at.center
    touching = (center + 1j * radius * response.at.tangent).real
    return {
        "flanks_collide": touching.min(axis=0),
        "rollers_collide": np.abs(center[0] + center[1].conj()) - float(radius.sum()),
        "lift_off": response.contact.min(axis=0),  # NaN where friction holds a roller: no contact is lost there
        "spring_slack": response.elongation,
    }


def _margin_tolerance(name: str, margin: FloatArray, machine: Machine) -> float:
    if name == "lift_off":
        return CONTACT_FORCE_RTOL * float(np.nanmax(np.abs(margin), initial=0.0))
    return 1e-12 * max(machine.springs.rest_length, 1.0)


def _describe_ending(name: str, margins: Mapping[str, FloatArray], machine: Machine, when: str) -> Finding:
    worst = float(np.nanmin(margins[name]))
    reported: dict[str, Callable[[], Finding]] = {
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
            f"the springs go slack {when}: they become up to {mm(-worst)} shorter than their rest length and hold the "
            "rollers no longer; use shorter springs ('mechanism.rest_half_width', here "
            f"{mm(machine.springs.rest_length / 2)})",
        ),
    }
    return reported[name]()
