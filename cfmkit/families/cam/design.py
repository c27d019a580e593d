"""Design of a cam from target force and stroke: its force constant A, the springs, and the profile to cut.

The force is F = 4 K A [SS, eq. 1]: of K and A one is given and the other follows, or both come from a catalogue.
Springs that are tight at the start give the path a slope there that a larger roller can follow: the smallest such
preload is chosen where that is requested. A profile that also carries weight is designed for the force that is left
after the slider's own weight; its slope is steeper by c = F' / (F' - 2 w), w the weight that hangs on one roller.

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import isclose
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.findings import finding
from cfmkit.families.cam.geometry.path import reach
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
from cfmkit.families.cam.geometry.slope_law import SlopeLaw, brace_tangent
from cfmkit.families.cam.geometry.slope_law_for_curve import CurveSlopeLaw
from cfmkit.families.cam.mechanism_from_spec import (
    assemble_sides,
    check_start,
    cut_profile,
    loads_of,
    rollers_overlap,
    turns_vertical,
    weights_of,
)
from cfmkit.families.cam.outline import CutPlate
from cfmkit.families.cam.statics import TRAVEL_RTOL, forces
from cfmkit.families.cam.target_curve_limits import check_target, largest_force, target_shape, with_curve
from cfmkit.families.findings import (
    CannotBuild,
    Infeasible,
    format_at_least,
    format_at_most,
    mm,
    newton,
    rate,
    refusals_answered,
)
from cfmkit.results import OVERWRITTEN_FINDING, Design, Finding, Status
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.offers import Miss, describe_nearest
from cfmkit.stock.springs.spec import offers
from cfmkit.stock.springs.stress_and_life import SpringInUse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.families.cam.spec import CamDesign, CamSpec, Mechanism
    from cfmkit.families.cam.springs_spec import Springs
    from cfmkit.families.cam.statics import Loads
    from cfmkit.families.run_control import Run
    from cfmkit.numerics.interpolation import ThroughPoints
    from cfmkit.stock.springs.offers import Offer


@dataclass(frozen=True)
class Choice:
    """A force constant with the springs that go with it."""

    force_constant: float  # [m]
    springs: Springs
    preload: float  # elongation of the springs at the start, with that which stands for their initial tension [m]
    note: str = ""
    active: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Task:
    """A specification with a `design` block, and what its targets ask of springs and profile."""

    spec: CamSpec
    target: CamDesign
    pull: float  # force F' that the springs provide [N]
    factor: float  # slope factor c of the profile

    @classmethod
    def from_spec(cls, spec: CamSpec, target: CamDesign) -> _Task:
        """Return the task; raises Infeasible if the moving parts are too heavy."""
        force = largest_force(target)
        if not target.gravity:
            return cls(spec, target, force, 1.0)
        roller, slider = weights_of(spec.mechanism).along
        least = slider + 2.0 * roller
        if force <= least:
            raise finding.infeasible(
                "weight_too_large",
                f"the moving parts weigh {newton(least)}: a force of {newton(force)} does not even carry them; request "
                "more ('design.force'), or lighten the parts ('mechanism.masses')",
                {"design.force": f"more than {newton(least)}"},
            )
        pull = force - slider
        return cls(spec, target, pull, pull / (pull - 2.0 * roller))

    @property
    def mechanism(self) -> Mechanism:
        """Block `mechanism` of the specification."""
        return self.spec.mechanism

    @property
    def curve(self) -> ThroughPoints | None:
        """The target curve of force in shares of its largest; None if the force is to be constant."""
        # the springs need not carry the weight of the slider where the profile carries weights
        return target_shape(self.target, float(weights_of(self.mechanism).along[1]) if self.target.gravity else 0.0)

    def law(self, force_constant: float, preload: float | None = None) -> SlopeLaw:
        """Return the slope law of a designed profile; the elongation `preload` [m] is the mechanism's unless given."""
        mechanism, target = self.mechanism, self.target
        sizes = force_constant, mechanism.rest_half_width, mechanism.brace_length
        half = 0.5 * (mechanism.effective_preload if preload is None else preload)
        law = SlopeLaw(*sizes, target.friction, self.factor, half)
        if (curve := self.curve) is None:
            return law
        try:
            return with_curve(law, curve, target.stroke)
        except CannotBuild as problem:
            raise Infeasible(problem.finding) from None

    @cached_property
    def smallest(self) -> float | None:
        """The smallest force constant without undercut [m]; None if undercut is accepted, or a preload avoids it."""
        if not self.target.avoid_undercut or self.target.choose == "preload":
            return None
        radius, law = self.mechanism.roller_radius, self.law(self.mechanism.rest_half_width)
        if (smallest := law.smallest_force_constant(radius)) is not None:
            return smallest * (1 + 1e-12)
        flat = SlopeLaw(1e6 * law.brace_length, law.rest_half_width, law.brace_length, law.friction, self.factor)
        largest = mm(float(flat.curvature_radius(law.rest_half_width)))
        raise finding.infeasible(
            "undercut",
            f"no force constant avoids undercut: the {mm(radius)} roller is larger than the radius of "
            f"curvature that the brace alone gives ({largest}); use a smaller roller ('mechanism.roller_radius')",
            {"mechanism.roller_radius": f"less than {largest}"},
        )

    def undercuts(self, law: SlopeLaw) -> bool:
        """Return whether a force constant below `smallest` undercuts: with a preload some small ones do not."""
        if self.smallest is None or law.force_constant >= self.smallest:
            return False
        return not law.constant or not law.preload or law.undercuts(self.mechanism.roller_radius)


@refusals_answered
def design(spec: CamSpec, run: Run) -> Design:
    """Return a complete specification whose cam meets the targets of the `design` block, in closed form.

    INFEASIBLE, with the reason and the nearest feasible values, if there is none.
    """
    target = spec.design
    if target is None:
        return Design(None, Status.INVALID, "this spec has no 'design' block: add the targets 'force' and 'stroke'")
    if target.target is not None:
        check_target(target)
    task = _Task.from_spec(spec, target)
    _check_start(task)
    best, *others = _CHOICE_FUNCTIONS[target.choose](task)
    next_best = tuple(partial(_design_next_best, task, choice) for choice in others)
    return replace(_design_choice(task, best), next_best=next_best)


@refusals_answered
def _design_next_best(task: _Task, choice: Choice) -> Design:
    """Return the design with springs that are not the best of the catalogue; a refusal is its outcome."""
    return _design_choice(task, choice)


def _design_choice(task: _Task, choice: Choice) -> Design:
    """Return the design with chosen springs, force constant and preload."""
    law = task.law(choice.force_constant, choice.preload)
    _check_stroke(law, task.target, choice.springs)
    _check_bend(task, law)
    written = _write_profile(task, choice)
    reported = (*_find_overwritten_values(task.spec, written), *_find_missing_plate_features(written))
    return Design(written, Status.COMPLETE, choice.note, active_bounds=choice.active, warnings=reported)


def _check_start(task: _Task) -> None:
    """Raise if no force constant gives a mechanism, none avoids undercut, or the rollers overlap at the start."""
    x0, radius, brace = task.mechanism.rest_half_width, task.mechanism.roller_radius, task.mechanism.brace_length
    try:
        check_start(task.law(x0), (radius, brace))
    except CannotBuild as problem:
        longer = {"mechanism.brace_length": f"more than {mm(x0)}"}
        raise Infeasible(problem.finding, longer if problem.finding.name == "brace_too_short" else None) from None
    _ = task.smallest
    if (gap := 2.0 * (x0 - radius)) < 0:
        raise Infeasible(rollers_overlap(gap), {"mechanism.roller_radius": format_at_most(x0)})


def _choose_constant(task: _Task) -> list[Choice]:
    """Choose A from the springs; where that would undercut, the smallest A that does not, and softer springs."""
    springs, preload = task.mechanism.springs, task.mechanism.effective_preload
    constant = task.pull / (4.0 * springs.total)
    if task.smallest is None or not task.undercuts(task.law(constant)):
        return [Choice(constant, springs, preload)]
    softer = springs.scaled_to(task.pull / (4.0 * task.smallest))
    note = (
        f"to avoid undercut A is raised from {mm(constant)} to {mm(task.smallest)}; the springs must then add up to "
        f"{rate(softer.total)} instead of {rate(springs.total)}"
    )
    return [Choice(task.smallest, softer, preload, note, ("design.avoid_undercut",))]


def _choose_preload(task: _Task) -> list[Choice]:
    """Choose A from the springs, and the smallest preload with which the roller can follow the path."""
    mechanism, constant = task.mechanism, task.pull / (4.0 * task.mechanism.springs.total)
    half = task.law(constant, 0.0).smallest_preload(mechanism.roller_radius)
    if half is None:
        raise finding.infeasible(
            "undercut",
            f"no preload avoids undercut: cut for a friction of {task.target.friction:g} the path turns vertical "
            f"before its start is wide enough for the {mm(mechanism.roller_radius)} roller; use a smaller roller "
            "('mechanism.roller_radius') or less friction ('design.friction')",
        )
    opened = mechanism.springs.tension_stretch
    preload = max(2.0 * half * (1 + 1e-12), opened)
    note = "no preload is needed: the roller can follow the path with the springs at rest at the start"
    if stretched := preload - opened:
        note = (
            f"to avoid undercut the springs are stretched by {mm(stretched)} at the start: with the same roller "
            f"positions they are at rest at {mm(2.0 * mechanism.rest_half_width - stretched)} between the roller axes"
        )
    return [Choice(constant, mechanism.springs, preload, note)]


def _choose_stiffness(task: _Task) -> list[Choice]:
    """Choose the stiffness from a given A."""
    constant = task.target.force_constant or task.mechanism.profile.force_constant
    if task.smallest is not None and task.undercuts(task.law(constant)):
        raise finding.infeasible(
            "force_constant_too_small",
            f"the force constant {mm(constant)} is below {mm(task.smallest)}, the smallest that avoids undercut "
            "('design.avoid_undercut')",
            {"design.force_constant": format_at_least(task.smallest)},
        )
    springs = task.mechanism.springs.scaled_to(task.pull / (4.0 * constant))
    return [Choice(constant, springs, task.mechanism.effective_preload)]


def _choose_listed_springs(task: _Task) -> list[Choice]:
    """Return the springs and numbers within all limits, the one whose cam has the smallest two-way deviation first."""
    tried = [
        _try_listed_spring(task, item, count)
        for item in offers(task.target.catalogue, ExtensionSpring)
        for count in item.counts
    ]
    fitting = [outcome for outcome in tried if not isinstance(outcome, Miss)]
    if fitting:
        return [choice for _, choice in sorted(fitting, key=lambda pair: pair[0])]
    rejected = [outcome for outcome in tried if isinstance(outcome, Miss)]
    if not rejected:
        none = "the catalogue has no extension spring, which is what pulls the rollers together"
        raise finding.infeasible("no_spring_fits", f"{none} ('design.catalogue')")
    reported = f"no spring of the catalogue fits: {describe_nearest(rejected)}; add others to 'design.catalogue'"
    keys = [key for word, key in _BLOCKING_KEYS.items() if f": {word}" in reported]
    change = ", ".join([*keys, "'design.stroke'"]) + " or 'design.force'"
    raise finding.infeasible("no_spring_fits", f"{reported}, or change {change}")


_CHOICE_FUNCTIONS: dict[str, Callable[[_Task], list[Choice]]] = {
    "force-constant": _choose_constant,
    "stiffness": _choose_stiffness,
    "preload": _choose_preload,
    "catalogue": _choose_listed_springs,
}
"""Functions by the word of `design.choose`: each returns the best choice, then those that are nearly as good."""
_BLOCKING_KEYS = {
    "undercut": "'design.avoid_undercut'",
    "brace too short": "'mechanism.brace_length'",
    "spring overstretched": "their 'max_elongation'",
    "friction": "'mechanism.rolling_friction'",
    "too long": "'mechanism.rest_half_width'",
}
"""Which key blocks a spring of the catalogue that is refused for a reason."""


def _try_listed_spring(task: _Task, item: Offer, count: int) -> tuple[float, Choice] | Miss:
    """Return the deviation of both ways and the choice of one spring of a catalogue, or why it does not fit.

    Between axes that are farther apart than its free length a spring is stretched at the start; its initial tension
    acts like more of that.
    """
    from cfmkit.families.cam.springs_spec import Springs

    label, target, mechanism = f"{count} x {item.name}", task.target, task.mechanism
    opened = item.initial_tension / item.rate
    preload = mechanism.preload + opened
    if item.free_length is not None:
        room = 2.0 * mechanism.rest_half_width
        if item.free_length > room * (1 + 1e-9):
            text = f"too long ({mm(item.free_length)} relaxed between axes {mm(room)} apart at the start)"
            return Miss(label, item.free_length / room - 1.0, text)
        preload = room - item.free_length + opened
    springs = Springs.from_offer(item, count)
    constant = task.pull / (4.0 * springs.total)
    law = task.law(constant, preload)
    if task.smallest is not None and task.undercuts(law):
        text = f"undercut (A = {mm(constant)} < {mm(task.smallest)})"
        return Miss(label, task.smallest / constant - 1.0, text)
    try:
        _check_stroke(law, target, springs)
    except Infeasible as problem:
        reached = _stroke_of(law, target, springs)
        text = f"{problem.finding.name.replace('_', ' ')} (for a stroke of {mm(reached)})"
        return Miss(label, target.stroke / max(reached, 1e-9) - 1.0, text)
    most = 2.0 * (reach(law, target.stroke)[1] - law.rest_half_width) + preload
    use = SpringInUse.from_offer(item, preload - opened, most - opened)
    if weak := use.why_too_weak(target.spring_life, target.spring_safety):
        return Miss(label, *weak)
    rest = mechanism.rest_half_width - 0.5 * preload
    gap = two_way_gap(law, target, loads_of(task.spec, springs.total, rest), mechanism.rolling_friction)
    if gap == float("inf"):
        return Miss(label, float("inf"), "friction holds the roller")
    return gap, Choice(constant, springs, preload, f"{label} of the catalogue: A = {mm(constant)}")


def _check_bend(task: _Task, law: SlopeLaw) -> None:
    """Raise where a roller cannot follow a path that may be bent most behind its start: of a curve, or with weights."""
    if law.constant and law.slope_factor >= 1:
        return
    path, end = reach(law, task.target.stroke)
    try:
        cut_profile(path, task.mechanism.roller_radius, end)
    except CannotBuild as problem:
        raise Infeasible(
            problem.finding, {"mechanism.roller_radius": format_at_most(law.tightest(end)[1] * (1 - 1e-6))}
        ) from None


def _stroke_of(law: SlopeLaw, target: CamDesign, springs: Springs) -> float:
    """Return the travel up to which geometry and springs hold out [m]."""
    path, end = reach(law, target.stroke)
    limit = springs.max_elongation
    if limit:
        end = min(end, law.rest_half_width + 0.5 * (limit + springs.tension_stretch) - law.preload)
    return max(float(path.travel(end)), 0.0) if end > law.rest_half_width else 0.0


def two_way_gap(law: SlopeLaw, target: CamDesign, loads: Loads, friction: float) -> float:
    """Return the largest |F/F0 - 1| of both directions over the stroke, the first fiftieth left out.

    Of a cam cut for a slope law with a rolling friction; infinite if friction holds the roller somewhere.
    """
    path, end = reach(law, target.stroke)
    x = np.linspace(law.rest_half_width, end, 801)
    x = x[path.travel(x) >= 0.02 * target.stroke]
    tangent, on_flank = brace_tangent(x, loads.brace_length), np.zeros(len(x), dtype=bool)
    states = TrackStates(x, np.zeros_like(x), law.slope(x), tangent, on_flank, x, lambda: law.slopes(x)[1])
    ways = np.stack([forces(states, loads, direction * friction, direction).slider for direction in (1.0, -1.0)])
    if not np.isfinite(ways).all():
        return float("inf")
    carried = loads.slider_weight if target.gravity else 0.0
    wanted = law.shape.evaluate(path.travel(x)) if isinstance(law, CurveSlopeLaw) else 1.0
    return float(np.abs((ways - carried) / (4.0 * loads.stiffness * law.force_constant) - wanted).max())


def _check_stroke(law: SlopeLaw, target: CamDesign, springs: Springs) -> None:
    """Raise if the geometry, the friction designed for or the springs end before the stroke."""
    path, end = reach(law, target.stroke)
    reached = float(path.travel(end))
    if reached < target.stroke * (1 - TRAVEL_RTOL):
        name = "path_vertical" if turns_vertical(law, end) else "brace_too_short"
        if reached <= 0:  # friction on the way down, or weights that help, are so large that the slider never rises
            name = "design_singular"
        raise finding.infeasible(
            name,
            f"with A = {mm(law.force_constant)} the stroke ends at {mm(reached)} of {mm(target.stroke)} "
            "('design.stroke')",
            {"design.stroke": format_at_most(reached)},
        )
    limit = springs.max_elongation
    elongation = 2.0 * (end - law.rest_half_width + law.preload) - springs.tension_stretch
    if limit and elongation > limit:
        shorter = _stroke_of(law, target, springs)
        raise finding.infeasible(
            "spring_overstretched",
            f"at full stroke the springs would be stretched by {mm(elongation)}, their limit is {mm(limit)} "
            f"('mechanism.springs.max_elongation'); the stroke they allow is {mm(shorter)}",
            {"design.stroke": format_at_most(shorter)},
        )


_SOURCE_KEYS = {
    "friction": "design.friction",
    "preload": "mechanism.springs.preload",
    "slope_factor": "design.gravity",
    "curve": "design.target",
    "offset": "",
    "file": "",
    "noise": "",
}
"""What decides a value of a designed profile that does not follow the mechanism's of the same name."""


def _find_overwritten_values(spec: CamSpec, written: CamSpec) -> Iterator[Finding]:
    """Yield what to say about values of the profile that the user gave and the design replaces."""
    stated, new = spec.mechanism.profile, written.mechanism.profile
    # What the design is for, its force constant and stroke, is meant to be replaced.
    for name in sorted(stated.model_fields_set - {"force_constant", "stroke"}):
        old, now = getattr(stated, name), getattr(new, name)
        if old is not None and old != now and not (isinstance(old, float) and isclose(old, now or 0.0, rel_tol=1e-12)):
            values = [
                f"{item:g}" if name in ("friction", "slope_factor") else _length_text(item) for item in (old, now)
            ]
            source = _SOURCE_KEYS.get(name, f"mechanism.{name}")
            yield Finding(
                OVERWRITTEN_FINDING,
                f"'mechanism.profile.{name}' ({values[0]}) is replaced by {values[1]}: the designed profile "
                + (f"follows '{source}'; change that one" if source else "is as drawn, without errors of cutting"),
            )


def _length_text(value: object) -> str:
    return mm(value) if isinstance(value, float) else "none" if value is None else str(value)


def _find_missing_plate_features(spec: CamSpec) -> Iterator[Finding]:
    """Yield what the plate lacks for want of room."""
    try:
        sides = assemble_sides(spec)
    except CannotBuild:
        return
    for note in CutPlate((sides[0].profile, sides[1].profile), spec.mechanism.plate).notes:
        yield finding("plate_incomplete", note)


def _write_profile(task: _Task, choice: Choice) -> CamSpec:
    """Return the spec with the designed profile written out, so that it is a fixed part from now on."""
    mechanism, target = task.mechanism, task.target
    profile: dict[str, Any] = {
        "force_constant": choice.force_constant,
        "friction": target.friction,
        "slope_factor": task.factor,
        "stroke": target.stroke,
        "brace_length": mechanism.brace_length,
        "rest_half_width": mechanism.rest_half_width,
        "roller_radius": mechanism.roller_radius,
    }
    springs = choice.springs.model_dump(exclude_none=True, exclude_unset=True)
    for stated in ("preload", "rest_length"):  # what the file says is replaced by what was chosen, nothing included
        springs.pop(stated, None)
    if choice.preload:
        profile["preload"] = choice.preload
        if stretched := max(choice.preload - choice.springs.tension_stretch, 0.0):
            springs["preload"] = stretched
    changes: dict[str, Any] = {"mechanism.profile": profile, "mechanism.springs": springs}
    if (shape := task.curve) is not None and target.target is not None:
        points = tuple(zip(shape.places, shape.values, strict=True))
        profile["curve"] = {"points": points, "interpolation": "smooth" if shape.smooth else "linear"}
        changes["design.target"] = target.target.written_out(target.force)
        changes["design.force"] = None
    return task.spec.replace(changes)
