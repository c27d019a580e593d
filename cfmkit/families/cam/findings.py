"""Everything a cam mechanism can suffer from, by name.

The names are stable; the sentences say what the name means. The message that a
run reports carries the numbers that decide and the cure.
"""

from __future__ import annotations

from cfmkit.families.findings import finder

FINDINGS = {
    "brace_too_short": "the roller is, or comes, as far from the axis as the brace is long",
    "path_vertical": "the profile is cut for so much friction that the path turns vertical within the stroke",
    "design_singular": "the profile is cut for so much friction on the way down that the path has no upward start",
    "undercut": "the roller is larger than the path's radius of curvature: the cam starts with a corner",
    "undercut_total": "the roller is so large that nothing of the flank remains",
    "contact_not_single_valued": "while the roller pivots on the corner the contact does not move with the slider",
    "corner_pressure": "on the sharp corner the contact pressure has no bound",
    "overstressed": "the contact pressure exceeds the one at which the material first yields below the surface",
    "up_jam": "friction holds the roller: no force moves the slider up",
    "dead_point": "the slider cannot move the roller at the start: forces other than the springs' diverge",
    "spring_slack": "the springs are shorter than their rest length and carry nothing",
    "spring_overstretched": "the springs are stretched beyond their limit",
    "lift_off": "the contact force is not positive: the roller leaves the cam",
    "slack_cable": "the force on the slider is not positive: a cable would go slack",
    "flanks_collide": "the two flanks cross the axis: no plate is left between them",
    "rollers_collide": "the two rollers touch each other",
    "outside_profile": "the travel asked for is longer than the cut profile allows",
    "inertia_mismatch": "a moment of inertia does not fit the mass and the size of its part",
    "symmetric_model": "the quasi-static model leaves out what makes the two sides differ",
    "friction_left_out": "the nine-coordinate model has no rolling resistance",
    "overwritten": "a value of the profile that the design replaces by its own",
    "plate_incomplete": "there is no room for the tab of the plate, or for its fixing holes",
    "old_word": "a word of the specification that the next version will not know any more",
    "weight_too_large": "the force wanted does not even carry the weight of the moving parts",
    "force_constant_too_small": "the force constant needed is below the one that avoids undercut",
    "registration_weak": "measured points do not say well where the cam lies",
    "width_error": "the measured cam is wider or narrower than the design on both flanks",
    "profile_outliers": "measured points lie so far off that the registration gave them no weight",
    "noise_understated": "neighbouring points differ by more than the stated noise of the measurement explains",
    "noise_overstated": "the stated noise of the measurement is larger than all errors of the profile",
    "part_measured": "the flanks were measured over a part of the travel only",
    "no_spring_fits": "no spring of the catalogue meets the limits",
}

finding = finder(FINDINGS)
"""Return a finding of this family; the name must be one that `FINDINGS` explains."""
