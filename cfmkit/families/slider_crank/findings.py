"""Everything a slider-crank can suffer from, by name.

The names are stable; the sentences say what the name means. The message that a
run reports carries the numbers that decide and the cure.
"""

from __future__ import annotations

from cfmkit.families.findings import finder

FINDINGS = {
    "not_assemblable": "crank and coupler do not reach the slider's way, or not in the unloaded position",
    "coupler_dead_point": "the motion ends where the coupler stands perpendicular to the slider's path",
    "no_full_turn": "a full turn is requested, but the crank cannot make one",
    "out_of_reach": "the slider cannot travel as far as requested",
    "no_spring": "no spring acts on the mechanism",
    "spring_winds_up": "a torsion spring is wound up turn after turn: the torque does not repeat itself",
    "quartic_minimum": "in the unloaded position the stiffness vanishes: the mechanism has no firm rest",
    "second_stable_outside": "the mechanism snaps through to a stable position outside the motion",
    "class_boundary": "the design is on the border of two stiffness classes: a manufactured part may be of either",
    "same_position_twice": "the first and the last position are the same one, a turn apart",
    "no_zero_stiffness": "no choice of these springs makes the torque constant around the stretched position",
    "reference_zero": "the force or torque at the reference is zero: no band around it exists",
    "reference_outside": "the reference is outside the motion",
    "stretched_outside_window": "the window leaves out the stretched position, around which force or torque is flat",
    "friction_left_out": "the model of a one-piece part leaves out friction that is specified",
    "self_locks": "friction holds the mechanism: no force, however large, moves it",
    "force_unbounded": "towards the stretched position the force grows without bound",
    "stretched_start": "the linkage starts stretched: it gives way at once, to either side, like a column",
    "run_in": "the springs are relaxed slightly off the stretched position: the force begins at zero",
    "two_positions": "the slider's place does not say on which side of the stretched line the crank is",
    "effort_changes_sign": "the force or torque changes sign within the window",
    "joint_overrotated": "a spring is deflected beyond its limit",
    "infeasible_targets": "no springs meet the targets of the design",
    "spring_at_bound": "a spring rate is at one of its bounds",
    "spring_dropped": "the best rate of a spring is zero: the design does without it",
    "no_spring_fits": "no springs of the catalogue hold the target within the limits",
    "near_optima": "many designs are equally good: a secondary criterion chose among them",
    "window_not_proven": "no wider window was found, but a wider one is not ruled out",
    "straight_start": "the chain is exactly straight: it buckles, and only chance or a guide decides to which side",
    "kink_too_small": "the kink that sends the chain to one side is smaller than the process can make",
    "long_run_in": "the kink is so large that the force needs much of the travel to reach its level",
    "meets_itself": "the chain is pressed through its own anchor, or crosses itself: the curve ends before",
    "wrong_branch": "the chain bends to the side opposite to the requested one: the force differs",
    "unstable": "the equilibrium is unstable while the slider is held: the chain would jump",
    "limit_point": "the slider cannot be pressed further in equilibrium",
    "self_contact": "the part as a solid touches itself: the curve ends there",
    "not_converged": "a solver did not converge: its last iterate is not reported",
    "branch_begins_late": "the branch to which the kink does not lead exists only beyond some travel",
    "force_negative": "the chain pulls instead of pushing back",
    "overstressed": "the stress exceeds the allowable one within the travel",
    "wide_beam": "strip or flexures are so wide that they cannot curl across: they are stiffer than beam theory says",
    "sharp_corners": "without fillets the stress in inside corners has no value",
    "mesh_coarse": "results on two meshes of the part differ by more than the limit",
    "too_thin": "a thickness is below the thinnest wall of the process",
    "lateral_buckling": "the part bends out of its plane nearly as easily as in it",
    "side_force": "the slider is pushed across its way: friction in its guide adds to the force",
    "pulled": "the requested travel pulls the chain instead of pressing it",
    "second_opinion": "corotational elements give a different force or stress",
    "optimizer_stopped": "the optimiser ended without converging: the design is the best it saw",
    "target_unreachable": "the target force cannot be reached within the given ranges",
}

finding = finder(FINDINGS)
"""Return a finding of this family; the name must be one that `FINDINGS` explains."""
