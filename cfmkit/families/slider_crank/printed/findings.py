"""Warnings about printed slider-cranks: when each is raised, and its sentence with numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import hindered_curling
from cfmkit.families.findings import describe_wide_beam, format_at_most, mm, mpa, newton, wide_beam_in_short
from cfmkit.families.rows import FindingRule
from cfmkit.families.slider_crank.printed.scalar_results import stress_stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.families.slider_crank.printed.solution import Solution
    from cfmkit.families.slider_crank.spec import Mechanism, SliderCrankSpec


THINNEST_RATIO = 2.0
"""Width over thickness below which out-of-plane bending is less than four times as stiff as that in the plane."""
SIDE_SHARE = 0.5  # side force over force above which friction in the guide deserves a word
RUN_IN_SHARE = 0.1  # travel to 98 % of the force, as a share of all, above which the kink is called large


def left_out_friction(spec: SliderCrankSpec) -> str:
    """Return what to say of specified friction: a part of one piece has no pins, and its guide is ideal here."""
    stated = [f"'mechanism.{name}'" for name in ("pins", "guide") if getattr(spec.mechanism, name) is not None]
    applies = "applies" if len(stated) == 1 else "apply"
    if not stated:
        return ""
    return (
        f"{' and '.join(stated)} {applies} only to the model with springs: the force of a one-piece part is computed "
        "without friction"
    )


Sentence = tuple[Any, ...]  # message, then cures


def _mechanism(solution: Solution) -> Mechanism:
    assert solution.spec is not None
    return solution.spec.mechanism


def _too_large_stress(solution: Solution) -> Sentence:
    limit, place, worst = solution.material.allowable_stress, stress_stroke(solution), int(solution.stress.argmax())
    assert limit is not None
    return (
        f"beyond {mm(place)} of travel the stress exceeds the allowable {mpa(limit)}; it reaches "
        f"{mpa(float(solution.stress[worst]))} at {mm(float(solution.travel[worst]))}, "
        f"{mm(float(solution.place[worst]))} along the part from its clamped end",
        f"analysis.travel=[{mm(float(solution.travel[0]))}, {format_at_most(place)}]",
    )


def _pulls(solution: Solution) -> NDArray[np.bool_]:
    """Return at which points the chain pulls the slider, (n,)."""
    moved = solution.travel > 0.01 * solution.travel[-1]
    return np.asarray(moved & (solution.force < 0))


def _is_straight(solution: Solution) -> bool:
    return solution.chain.side == 0


def _kink_size(solution: Solution) -> float:
    return abs(solution.chain.kink)


def _process_limits(solution: Solution) -> tuple[float, float]:
    """Return the resolution of the process in the plane, and its thinnest wall [m]; 0 if not stated."""
    position, thinnest = _mechanism(solution).resolved
    return position or 0.0, thinnest or 0.0


def _has_long_run_in(solution: Solution) -> bool:
    run_in, off = solution.run_in(0.98), _kink_size(solution)
    is_long = run_in is not None and run_in > RUN_IN_SHARE * solution.travel[-1]
    return not _is_straight(solution) and is_long and off > 1e-3 * solution.chain.length


def _hindered_share(solution: Solution) -> tuple[float, str]:
    """Return by what share of its energy a part that is solved as a narrow one is too soft, and where."""
    if _mechanism(solution).wide_beams:
        return 0.0, ""
    share = hindered_curling(solution.pressed.path).share[solution.pressed.path.at_requested]
    worst = int(share.argmax())
    return float(share[worst]), f"at {mm(float(solution.travel[worst]))}"


def _side_share(solution: Solution) -> tuple[int, float, float]:
    """Return the point with the largest side force, this force [N], and its share of the force there."""
    worst = int(np.abs(solution.side_force).argmax())
    side = float(abs(solution.side_force[worst]))
    return worst, side, side / max(float(abs(solution.force[worst])), 1e-300)


def _burdens_guide(solution: Solution) -> bool:
    worst, _, share = _side_share(solution)
    return share > SIDE_SHARE and bool(solution.travel[worst] > 0)


def _burdened_guide(solution: Solution) -> Sentence:
    _, side, share = _side_share(solution)
    return (
        f"the guide carries up to {newton(side)} across the travel, {100 * share:.0f} % of the force: friction of 0.1 "
        f"there changes it by {newton(0.1 * side)}; a mirrored pair on one slider cancels it",
        "mechanism.copies=mirrored",
    )


def _describe_burden_in_short(solution: Solution) -> str:
    _, side, share = _side_share(solution)
    return f"{newton(side)} on the guide, {100 * share:.0f} % of the force"


def _left_out_friction(solution: Solution) -> str:
    assert solution.spec is not None
    return left_out_friction(solution.spec)


FINDING_RULES: tuple[FindingRule[Solution], ...] = (
    FindingRule(
        "overstressed",
        lambda solution: bool(stress_stroke(solution) < solution.travel[-1]),
        _too_large_stress,
        lambda solution: f"{mpa(float(solution.stress.max()))} beyond {mm(stress_stroke(solution))} of travel",
    ),
    FindingRule(
        "force_negative",
        lambda solution: _pulls(solution).any(),
        lambda solution: (
            f"from {mm(float(solution.travel[_pulls(solution)][0]))} on the chain pulls the slider towards the pivot",
        ),
    ),
    FindingRule(
        "straight_start",
        _is_straight,
        lambda solution: (
            f"the chain is exactly straight: it carries {newton(float(solution.force[1]))} before it buckles, and a "
            "deviation of 0.1 um determines the side; state a kink of 0.25 to 0.5 mm with 'mechanism.unloaded_offset'",
        ),
    ),
    FindingRule(
        "kink_too_small",
        lambda solution: not _is_straight(solution) and _kink_size(solution) < _process_limits(solution)[0],
        lambda solution: (
            f"the kink of {mm(_kink_size(solution))} that determines the buckling side is smaller than the process can "
            f"make ({mm(_process_limits(solution)[0])}): the part may bend to the other side, with another force; 0.25 "
            "to 0.5 mm is safe",
        ),
        lambda solution: f"kink of {mm(_kink_size(solution))}, {mm(_process_limits(solution)[0])} can be made",
    ),
    FindingRule(
        "long_run_in",
        _has_long_run_in,
        lambda solution: (
            f"with a kink of {mm(_kink_size(solution))} the force needs {mm(solution.run_in(0.98) or 0.0)} of travel "
            "to reach 98 % of its level; a smaller kink shortens it",
        ),
    ),
    FindingRule(
        "too_thin",
        lambda solution: solution.thinnest < _process_limits(solution)[1],
        lambda solution: (
            f"the thinnest place is {mm(solution.thinnest)}, the process needs at least "
            f"{mm(_process_limits(solution)[1])}",
        ),
    ),
    FindingRule(
        "lateral_buckling",
        lambda solution: solution.width_ratio < THINNEST_RATIO,
        lambda solution: (
            f"the width is {solution.width_ratio:.3g} times the largest thickness: out of its plane the part bends "
            "nearly as easily as in it; guide it between plates, or make it wider",
        ),
    ),
    FindingRule(
        "wide_beam",
        lambda solution: bool(describe_wide_beam(*_hindered_share(solution))),
        lambda solution: (describe_wide_beam(*_hindered_share(solution)), "mechanism.wide_beams=true"),
        lambda solution: wide_beam_in_short(_hindered_share(solution)[0]),
    ),
    FindingRule("side_force", _burdens_guide, _burdened_guide, _describe_burden_in_short),
    FindingRule(
        "friction_left_out",
        lambda solution: bool(_left_out_friction(solution)),
        lambda solution: (_left_out_friction(solution),),
    ),
)
"""Everything worth a warning, the gravest first."""
