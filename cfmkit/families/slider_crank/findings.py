"""Names of the warnings of the slider-crank family, and what they mean: stable, unlike the sentences of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.end_stops import STOP_FINDINGS
from cfmkit.families.findings import Finder, no_design

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.results import Design

SLIDER_CRANK_FINDINGS = {
    "not_assemblable": "crank and coupler do not reach the guide of the slider, or not in the unloaded position",
    "coupler_dead_point": "the motion ends where the coupler is perpendicular to the slider's path",
    "no_full_turn": "a full turn is requested, but the crank cannot make one",
    "out_of_reach": "the slider cannot travel as far as requested",
    "no_spring": "no spring acts on the mechanism",
    "spring_winds_up": "a torsion spring is wound up further with every turn: the torque is not periodic",
    "quartic_minimum": "in the unloaded position the stiffness vanishes: the mechanism has no firm rest",
    "second_stable_outside": "the mechanism snaps through to a stable position outside the motion",
    "class_boundary": "the design is at the limit between two stiffness classes: a manufactured part may be in either",
    "same_position_twice": "the first and the last position are identical, one turn apart",
    "no_zero_stiffness": "no choice of these springs makes the torque constant around the stretched position",
    "reference_zero": "the force or torque at the reference is zero: no band around it exists",
    "reference_outside": "the reference is outside the motion",
    "stretched_outside_window": "the window leaves out the stretched position, around which force or torque is flat",
    "friction_left_out": "the model of a one-piece part neglects specified friction",
    "self_locks": "friction holds the mechanism: no force, however large, moves it",
    "force_unbounded": "the force is unbounded towards the stretched position",
    "stretched_start": "the linkage starts in the stretched position: like a column it buckles to either side",
    "run_in": "the springs are relaxed slightly off the stretched position: the force begins at zero",
    "two_positions": "the position of the slider does not determine on which side of the stretched position the "
    "crank is",
    "effort_changes_sign": "the force or torque changes sign within the window",
    "joint_overrotated": "a spring is deflected beyond its limit",
    "spring_buckles": "a compression spring is pressed beyond the deflection at which it buckles, without a guide",
    "spring_binds_on_pin": "a torsion spring becomes narrower than its pin when it is wound up",
    "infeasible_targets": "no springs meet the targets of the design",
    "spring_at_bound": "a spring rate is at one of its bounds",
    "spring_dropped": "the best rate of a spring is zero: the design omits it",
    "no_spring_fits": "no springs of the catalogue meet the target within the limits",
    "near_optima": "many designs are equally good: a secondary criterion chose among them",
    "window_not_proven": "no wider window was found, but a wider one is not ruled out",
    "straight_start": "the chain is exactly straight: it buckles, and the side is not determined",
    "kink_too_small": "the kink that determines the buckling side is smaller than the process can make",
    "long_run_in": "the kink is so large that the force needs much of the travel to reach its level",
    "meets_itself": "the chain would pass through its own anchor, or cross itself: the curve ends before that",
    "wrong_branch": "the chain bends to the side opposite to the requested one: the force differs",
    "unstable": "the equilibrium is unstable even with the slider held: the chain would snap",
    "limit_point": "there is no equilibrium for a further displacement of the slider",
    **STOP_FINDINGS,
    "self_contact": "the part as a solid touches itself: the curve ends there",
    "not_converged": "a solver did not converge: its last iterate is not reported",
    "branch_begins_late": "the branch against the kink exists only beyond a certain travel",
    "force_negative": "the chain pulls instead of pushing back",
    "overstressed": "the stress exceeds the allowable stress within the travel",
    "wide_beam": "the anticlastic bending of a wide strip or flexure is suppressed: it is stiffer than in beam theory",
    "sharp_corners": "without fillets the stress in inside corners has no value",
    "mesh_coarse": "the force or the largest stress of the solid is not known as closely as requested",
    "too_thin": "a thickness is below the thinnest wall of the process",
    "lateral_buckling": "the part bends out of its plane nearly as easily as in its plane",
    "side_force": "the transverse force on the guide is large: friction in the guide adds to the force",
    "pulled": "the requested travel pulls the chain instead of compressing it",
    "optimizer_stopped": "the optimiser ended without converging: the design is the best one found",
    "target_unreachable": "the target force cannot be reached within the given ranges",
}

finding = Finder(SLIDER_CRANK_FINDINGS)
"""Return a finding of this family; the name must be one that `SLIDER_CRANK_FINDINGS` explains."""


def unreachable(message: str, nearest: Mapping[str, str] | None = None) -> Design:
    """Return the outcome of targets of a part that cannot be met, with the nearest feasible values by path."""
    return no_design(finding("target_unreachable", message), nearest)
