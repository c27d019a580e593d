"""Warnings about solved slider-cranks with springs: predicate and sentence of each finding.

Predicates take the solution of any number of mechanisms, sentences that of one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import deg, mm, newton
from cfmkit.families.rows import FindingRule
from cfmkit.families.slider_crank.springs.bistability_class import (
    BISTABLE_CLASS,
    DROP_TOL,
    SNAP_THROUGH_CLASS,
    TRISTABLE_CLASS,
)
from cfmkit.families.slider_crank.springs.sprung_linkage import FULL_TURN
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.specs.units import format_short
from cfmkit.stock.springs.support_spec import guide_cure, guide_needed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.families.slider_crank.springs.spec import Bought

    Sentence = tuple[Any, ...]
    Rule = FindingRule[Solution]


RUN_IN = 0.02  # an unloaded position nearer than this to the stretched one [rad] is meant to be stretched, nearly
ON_LIMIT = 1 + 1e-9  # a deflection that is beyond its limit by less than this share is on it


def place_text(solution: Solution, motion: float) -> str:
    """Return a place of the motion as the user reads it."""
    return format_short(motion, solution.assemblies[0].dimension)


# --- friction and class ---------------------------------------------------------------------------------------------


def _make_lock_rule(number: int, name: str) -> Rule:
    """Return the rule on places of one of both ways where friction holds the mechanism."""

    def holds(solution: Solution) -> Any:
        return solution.friction_branches is not None and (
            ~np.isfinite(solution.friction_branches[number].effort)[:, 1:]
        ).any(axis=1)

    def sentence(solution: Solution) -> Sentence:
        assert solution.friction_branches is not None
        held = solution.motion[0, ~np.isfinite(solution.friction_branches[number].effort[0])]
        first, last = (place_text(solution, float(held[end])) for end in (0, -1))
        return (
            f"on the way {name} the mechanism self-locks from {first} to {last}: the line of force runs inside "
            "the friction circles of the pins; use pins of smaller diameter or friction ('mechanism.pins'), or "
            "a motion that ends before the stretched position",
        )

    return FindingRule("self_locks", holds, sentence)


def _boundary(solution: Solution) -> Sentence:
    kind, drop = int(solution.stability_classes.kind[0]), float(solution.stability_classes.drop[0])
    side = "has" if kind in (SNAP_THROUGH_CLASS, BISTABLE_CLASS, TRISTABLE_CLASS) else "just misses"
    return (
        f"the lowest {solution.drive} after the peak is {100 * (1 - drop):.2g} % of the peak: the "
        f"mechanism {side} a second equilibrium, and springs a little stiffer or softer change that",
    )


def _knee_angles(solution: Solution) -> FloatArray:
    return solution.column(lambda assembly: assembly.knee)[:, 0]


def _is_restless(solution: Solution) -> Any:
    inside = (solution.low <= solution.start) & (solution.start <= solution.high)
    only_slider = ~solution.assembly.rates.reshape(4, -1)[:3].any(axis=0)
    return (solution.drive == "torque") & inside[:, 0] & only_slider & (_knee_angles(solution) == 0)


# --- driven by a torque ---------------------------------------------------------------------------------------------


def _spring_winds_up(solution: Solution) -> NDArray[np.bool_]:
    """Return where a torque drives a full turn against a spring at the pivot or the crank pin, (m,)."""
    turns = (solution.high - solution.low)[:, 0] >= FULL_TURN * (1 - 1e-9)
    return (solution.drive == "torque") & turns & (solution.assembly.rates.reshape(4, -1)[:2] > 0.0).any(axis=0)


def _describe_winding(solution: Solution) -> Sentence:
    rates = solution.assemblies[0].rates
    wound = [JOINTS_BY_NAME[name].words for name, rate in zip(JOINT_NAMES[:2], rates, strict=False) if rate > 0.0]
    return (
        f"over a full turn the spring at the {' and at the '.join(wound)} is wound up: the torque differs in the next "
        "turn; only springs at slider and slider pin repeat",
    )


def _same_poses(rests: Sequence[float]) -> list[tuple[float, float]]:
    """Return pairs of crank angles that are whole turns apart."""
    return [(a, b) for a in rests for b in rests if a < b and abs(math.remainder(b - a, FULL_TURN)) < 1e-6]


def _has_same_poses(solution: Solution) -> Any:
    again = np.zeros(len(solution), dtype=bool)
    if solution.drive == "torque" and (solution.high - solution.low > FULL_TURN - 2e-6).any():
        rows, places, stable, _ = solution.all_equilibria
        for row in np.unique(rows).tolist():
            again[row] = bool(_same_poses(places[(rows == row) & stable].tolist()))
    return again


def _describe_same_poses(solution: Solution) -> Sentence:
    rests = [equilibrium.motion for equilibrium in solution.equilibria if equilibrium.stable]
    again = _same_poses(rests)
    different = len(set(rests) - {second for _, second in again})
    return (
        f"{deg(again[0][0])} and {deg(again[0][1])} are the same position: the {solution.class_name} curve has "
        f"{different} different stable positions in a full turn",
    )


# --- driven by a force ----------------------------------------------------------------------------------------------


def _starts_stretched(solution: Solution) -> Any:
    return (solution.drive == "force") & (_knee_angles(solution) == 0.0)


def _is_nearly_stretched(solution: Solution) -> Any:
    knee = _knee_angles(solution)
    return (solution.drive == "force") & (knee != 0.0) & (np.abs(knee) < RUN_IN) & (solution.motion[:, 0] <= 0.0)


def _lead(solution: Solution) -> float:
    return solution.assemblies[0].unloaded - solution.assemblies[0].linkage.stretched_angle


def _run_in_end(solution: Solution) -> str:
    """Return where the force has come up, to 95 % of what it is in the middle of the motion."""
    assembly, end = solution.assemblies[0], float(solution.motion[0, -1])
    motion = np.geomspace(1e-9, 1.0, 400) * end
    force = assembly.efforts(motion)
    reaching = np.flatnonzero(force >= 0.95 * float(np.interp(0.5 * end, motion, force)))
    return f"within {mm(float(motion[reaching[0]]))} it reaches 95 %" if len(reaching) else "it never reaches 95 %"


def _describe_run_in(solution: Solution) -> Sentence:
    assembly, lead, until = solution.assemblies[0], _lead(solution), _run_in_end(solution)
    kink = abs(math.sin(lead)) * assembly.linkage.crank
    return (
        f"the springs are relaxed {deg(abs(lead))} off the stretched position, a kink of {mm(kink)} at the crank "
        f"pin: the force begins at zero, and {until} of that at mid-travel; a part made less accurately may bend "
        "to the other side. 'unloaded_offset: 0' starts at the full force",
    )


def _nears_pole(solution: Solution) -> Any:
    if solution.drive != "force":
        return False
    end, span = solution.column(lambda assembly: assembly.reach[0]), solution.high - solution.low
    is_near = (solution.low < end + 0.01 * span) & (end < -1e-9 * span)
    return (np.abs(_knee_angles(solution)) >= RUN_IN) & is_near[:, 0]


# --- reference and window -------------------------------------------------------------------------------------------


def _reaches_reference(solution: Solution) -> Any:
    return ((solution.low <= solution.reference) & (solution.reference <= solution.high))[:, 0]


def _misses_reference(solution: Solution) -> Any:
    asked = getattr(solution.spec.analysis, f"reference_{solution.assembly.motion_name}")
    return (asked is not None) & ~_reaches_reference(solution)


def _describe_reference(solution: Solution) -> str:
    return f"the reference {place_text(solution, float(solution.reference[0, 0]))}"


def _efforts_in_window(solution: Solution) -> tuple[FloatArray, FloatArray]:
    """Return the largest and the smallest effort at the points in the window, (m,); infinite without any."""
    if solution.window is None:
        return np.full(1, -np.inf), np.full(1, np.inf)
    inside = (solution.motion >= solution.window[0]) & (solution.motion <= solution.window[1])
    high, low = (np.where(inside, solution.effort, fill) for fill in (-np.inf, np.inf))
    return high.max(axis=1), low.min(axis=1)


def _changes_sign(solution: Solution) -> Any:
    high, low = _efforts_in_window(solution)
    return (low < 0.0) & (high > 0.0)


def _describe_sign_change(solution: Solution) -> Sentence:
    high, low = (format_short(float(end[0]), solution.drive) for end in _efforts_in_window(solution))
    return (f"in the window the {solution.drive} changes sign: it goes from {low} to {high}",)


def _leaves_out_stretched(solution: Solution) -> Any:
    if solution.window is None or solution.drive != "torque":
        return False
    low, high = solution.window
    return ~((low <= solution.stretched_motion) & (solution.stretched_motion <= high))[:, 0]


def _describe_missing_stretched(solution: Solution) -> Sentence:
    low, high, stretched = (deg(float(at[0, 0])) for at in (*solution.window_or_motion, solution.stretched_motion))
    return (
        f"the window {low} to {high} does not contain the stretched position {stretched}: only around it is the "
        "slider's spring certain to give negative stiffness",
    )


# --- limits of springs ----------------------------------------------------------------------------------------------


def _describe_buckling(spec: SliderCrankSpec, number: int, moved: float) -> Sentence | None:
    """Return how a bought spring buckles that is deflected so far, and what guides it; None if it does not."""
    spring, key = spec.mechanism.springs.bought[number], f"mechanism.springs.bought.{number}"
    if spring.is_guided or not moved > spring.unguided * (1 + 1e-9):
        return None
    return (
        f"{spring.name} buckles when it is deflected by {mm(spring.unguided)} (ends {spring.seats}), and "
        f"is deflected by {mm(moved)}; {guide_needed(spring, spring.coil, key)}",
        *guide_cure(spring.coil, key),
    )


def _describe_binding(spec: SliderCrankSpec, number: int, moved: float) -> Sentence | None:
    """Return how a bought spring that is wound up so far [rad] binds on its pin; None if it does not."""
    spring, pins = spec.mechanism.springs.bought[number], spec.mechanism.pins
    if spring.coil is None or pins is None or not np.isfinite(moved):
        return None
    inside = spring.coil.inner_diameter_at(moved)
    if inside >= pins.diameter:
        return None
    return (
        f"{spring.name} at the {JOINTS_BY_NAME[spring.at].words} is {mm(spring.coil.inner_diameter)} wide inside, "
        f"wound up by {deg(moved)} {mm(max(inside, 0.0))}: it binds on its pin of {mm(pins.diameter)}; use "
        "a wider spring, or a thinner pin ('mechanism.pins.diameter')",
    )


def _rules_on(number: int, spring: Bought) -> Iterator[Rule]:
    """Yield the rules on what the bought spring of a number cannot do."""
    if spring.spring_type.needs_guide:
        yield _make_fault_rule("spring_buckles", _describe_buckling, number, spring)
    if spring.at != "slider":
        yield _make_fault_rule("spring_binds_on_pin", _describe_binding, number, spring)


def _make_fault_rule(name: str, describe_fault: Callable[..., Sentence | None], number: int, spring: Bought) -> Rule:
    """Return the rule on one fault of a bought spring."""

    def fault(solution: Solution, row: int) -> Sentence | None:
        turns = np.broadcast_to(solution.extremes.largest_turns, (4, len(solution)))
        return describe_fault(solution.specs[row], number, float(turns[JOINT_NAMES.index(spring.at), row]))

    return FindingRule(
        name,
        lambda solution: np.array([fault(solution, row) is not None for row in range(len(solution))]),
        lambda solution: fault(solution, 0) or (),
    )


def _make_limit_rule(joint: int) -> Rule:
    """Return the rule on a spring that is deflected beyond its limit."""
    name = JOINT_NAMES[joint]

    def holds(solution: Solution) -> Any:
        limits = solution.settings(lambda spec: getattr(spec.mechanism.limits, name, None))[:, 0]
        if np.isnan(limits).all():
            return False
        return solution.extremes.largest_turns[joint] > limits * ON_LIMIT

    def sentence(solution: Solution) -> Sentence:
        motion, limit = JOINTS_BY_NAME[name].motion, getattr(solution.spec.mechanism.limits, name)
        reported = format_short(float(solution.extremes.largest_turns[joint, 0]), motion)
        what = "slider's spring" if motion == "length" else f"spring at the {JOINTS_BY_NAME[name].words}"
        return (f"the {what} is deflected by {reported}; its limit is {format_short(limit, motion)}",)

    return FindingRule("joint_overrotated", holds, sentence)


FINDING_RULES: tuple[Rule, ...] = (
    _make_lock_rule(0, "forth"),
    _make_lock_rule(1, "back"),
    FindingRule(
        "second_stable_outside",
        lambda solution: (
            (solution.stability_classes.kind == SNAP_THROUGH_CLASS) & (solution.stability_classes.unstable > 0)
        ),
        lambda solution: (
            f"at {place_text(solution, float(solution.nearest(stable=False)[0][0]))} the mechanism snaps through, and "
            "the motion ends before the next stable position; extend the motion to find it",
        ),
    ),
    FindingRule("class_boundary", lambda solution: np.abs(solution.stability_classes.drop - 1.0) < DROP_TOL, _boundary),
    FindingRule(
        "quartic_minimum",
        _is_restless,
        lambda _solution: (
            "only the slider's spring acts, and it is relaxed in the stretched position: the energy grows with the "
            "fourth power there, and the stiffness at rest is zero; add a torsion spring",
        ),
    ),
    FindingRule("spring_winds_up", _spring_winds_up, _describe_winding),
    FindingRule("same_position_twice", _has_same_poses, _describe_same_poses),
    FindingRule(
        "stretched_start",
        _starts_stretched,
        lambda solution: (
            "the linkage starts in the stretched position, where the force is 0/0: its limit is "
            f"{newton(float(solution.frictionless(np.zeros((1, 1)))[0]))}, the buckling load of a column; a kink "
            "smaller than the part's tolerance determines the side",
        ),
    ),
    FindingRule(
        "two_positions",
        lambda solution: _starts_stretched(solution) & (solution.spec.analysis.side is None),
        lambda _solution: (
            "from the stretched position the crank can move to either side, and 'analysis.side' is not stated: "
            "'beyond' is assumed; with an offset the force on the other side differs",
            "analysis.side=before",
        ),
    ),
    FindingRule(
        "force_unbounded",
        lambda solution: _is_nearly_stretched(solution) & np.isnan(solution.rest[:, 0]),
        lambda solution: (
            f"the springs are relaxed {deg(abs(_lead(solution)))} away, on the far side of the stretched position: at "
            "the stretched position the force is unbounded; leave 'analysis.side' out to start on the side on which "
            "they are relaxed",
        ),
    ),
    FindingRule(
        "run_in",
        lambda solution: (
            _is_nearly_stretched(solution) & ~np.isnan(solution.rest[:, 0]) & (solution.motion[:, -1] >= 0.0)
        ),
        _describe_run_in,
        lambda solution: f"the force begins at zero: {_run_in_end(solution)} of that at mid-travel",
    ),
    FindingRule(
        "force_unbounded",
        _nears_pole,
        lambda solution: (
            f"at {mm(solution.assemblies[0].reach[0])} of travel crank and coupler are in one line and the springs are "
            "not relaxed: no finite force moves the slider there; choose a motion that does not reach it",
        ),
        lambda solution: f"no finite force moves the slider at {mm(solution.assemblies[0].reach[0])}",
    ),
    FindingRule(
        "reference_outside",
        _misses_reference,
        lambda solution: (f"{_describe_reference(solution)} is outside the motion",),
    ),
    FindingRule(
        "reference_zero",
        lambda solution: _reaches_reference(solution) & ~solution.has_level,
        lambda solution: (
            f"at {_describe_reference(solution)} the {solution.drive} is zero, and a band stated in per cent of zero "
            "has no width; choose another reference",
        ),
    ),
    FindingRule("effort_changes_sign", _changes_sign, _describe_sign_change),
    FindingRule("stretched_outside_window", _leaves_out_stretched, _describe_missing_stretched),
)
"""Findings of every mechanism, the gravest first."""
NO_SPRING: Rule = FindingRule(
    "no_spring",
    lambda _solution: True,
    lambda _solution: ("no spring has a rate: the mechanism moves freely; set 'mechanism.springs'",),
)


def rules_of(solution: Solution) -> tuple[Rule, ...]:
    """Return every finding of an analysis, the gravest first: those of its springs, too."""
    if not solution.assemblies[0].rates.any():
        return (NO_SPRING,)
    springs = solution.spec.mechanism.springs.bought
    return (
        *FINDING_RULES,
        *(rule for number, spring in enumerate(springs) for rule in _rules_on(number, spring)),
        *(_make_limit_rule(joint) for joint in range(4)),
    )
