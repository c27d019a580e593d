"""Everything flexures and strips can suffer from, by name."""

from __future__ import annotations

FINDINGS = {
    "straight_start": "the chain is exactly straight: it buckles, and only chance or a guide says to which side",
    "kink_too_small": "the kink that sends the chain to one side is smaller than the process can make",
    "long_run_in": "the kink is so large that the force needs much of the travel to reach its level",
    "meets_itself": "the chain is pressed through its own anchor, or crosses itself: the curve ends before",
    "wrong_branch": "the chain bends to the other side than asked for: the force is another one",
    "unstable": "the equilibrium is unstable while the slider is held: the chain would jump",
    "limit_point": "the slider cannot be pressed further in equilibrium",
    "not_converged": "a solver gave up: nothing is shown of what it had",
    "branch_begins_late": "the branch to which the kink does not lead exists only beyond some travel",
    "force_negative": "the chain pulls instead of pushing back",
    "overstressed": "the stress exceeds the allowable one within the travel",
    "too_thin": "a thickness is below the thinnest wall of the process",
    "lateral_buckling": "the part is nearly as easily bent out of its plane as in it",
    "side_force": "the slider is pushed across its way: friction in its guide adds to the force",
    "pulled": "the travel asked for pulls the chain instead of pressing it",
    "second_opinion": "corotational elements give another force or stress",
    "optimizer_stopped": "the optimiser ended without converging: the design is the best it saw",
    "target_unreachable": "the force wanted is not reached within the ranges given",
}

THINNEST_RATIO = 2.0
"""Width over thickness below which out-of-plane bending is less than four times as stiff as that in the plane."""

SIDE_SHARE = 0.5
"""Side force over force above which friction in the guide deserves a word."""

RUN_IN_SHARE = 0.1
"""Travel to 98 % of the force, as a share of all, above which the kink is called large."""

CLOSE = 5e-3
"""Difference of the second opinion, as a share, above which it is told."""
