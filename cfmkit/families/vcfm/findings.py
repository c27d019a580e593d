"""Everything a mechanism of snap-through leaves and a preloaded spring can suffer from, by name."""

from __future__ import annotations

from cfmkit.families.findings import finder

FINDINGS = {
    "no_negative_stiffness": "the leaves are too thick for their rise: no negative stiffness anywhere",
    "no_linear_region": "the leaves do not buckle: their negative stiffness is nowhere constant",
    "not_flat": "the positive and the negative stiffness do not cancel: the force is not constant",
    "force_reversal": "the force reaches zero within the window: the mechanism would not return",
    "bistable": "past the peak of the leaves no outward force is left: the mechanism stays in a second stable pose",
    "overload": "the travel goes beyond the linear range, where the force rises steeply",
    "preload_out_of_range": "a preload at which no outward force is left, or nothing holds the shuttle",
    "stroke_unreachable": "the rise is too small for the stroke asked for",
    "asymmetric_buckling": "a shuttle that can turn lets the leaves buckle at half the load",
    "out_of_plane_buckling": "the leaves are so narrow that they would rather buckle out of the plane",
    "overstressed": "the stress exceeds the allowable one",
    "imperfection": "waviness of the leaves as made spoils the flatness",
    "spring_closed": "the preload and the travel press the spring together until its rigid blocks meet",
    "theory_range": "an angle or a travel beyond what the closed forms are good for",
    "unstable_branch": "the force shown is that of an unstable form, which a real leaf leaves",
    "truss_law": "the paper's law of a bar without bending: force and flatness are not those of the mechanism",
    "measured_contradiction": "the reported force and stiffness cannot both hold for these leaves",
    "too_thin": "the design needs a leaf thinner than can be made",
    "envelope": "the design does not fit into the room given",
    "stress_unreachable": "no leaf length brings the exact stress below the one allowed",
}

finding = finder(FINDINGS)
"""Return a finding of this family; the name must be one that `FINDINGS` explains."""
