"""Everything a beam mechanism can suffer from, by name.

The names are stable; the sentences say what the name means. The message that a run reports carries the numbers.
"""

from __future__ import annotations

from cfmkit.families.findings import finder

FINDINGS = {
    "closure_adjusted": "beams were turned and scaled to fit between rounded nodes, or nodes moved to the beams' ends",
    "closure_prestress": "beams are forced into place between rounded nodes: the mechanism is prestressed at rest",
    "ends_early": "the path ends before the travel or the load asked for",
    "inaccurate": "at some points the tolerance is not reached: they have no force",
    "limit_point": "the load has an extreme on the path: under a given load the mechanism snaps there",
    "bifurcation": "the path splits: the mechanism leaves the symmetric or straight form",
    "unstable": "a part of the path is not stable: the mechanism would leave it",
    "flutter": "forces turn with their node, and two natural frequencies meet: it swings ever wider",
    "flutter_not_judged": "forces turn with their node: stability is judged against divergence, not against flutter",
    "imperfection": "the beams were bent in the first buckling mode, as asked",
    "overstressed": "the stress exceeds the allowable one within the window",
    "rescale_approximate": "the rule by which forces are scaled is exact only for beams that do not stretch",
    "rescale_stress": "after scaling, the stress reaches the allowable one within the window",
    "design_unsound": "the best shape that was found fails its audit",
    "objective_ill_posed": "the objective of the paper rewards a force that falls",
    "starts_lost": "processes that worked on starts died",
    "search_cut_short": "the time budget ended before all starts were done",
    "surface_out_of_reach": "the surface asks for more displacement than the mechanism is solved for",
    "tip_lifts_off": "the mechanism does not press on the surface any more: the tip leaves it",
    "surface_stress_exceeded": "the stress along the surface exceeds the allowable one",
    "tip_jams": "somewhere the surface is too steep for the friction at the tip",
    "thick_beam": "a beam is short for its thickness: beam theory is rough",
    "beams_touch": "two beams touch, or cross: contact is not modelled",
    "gap_small": "two beams are closer than can be cut",
    "sharp_corners": "without fillets the stress in inside corners has no value: it grows as the mesh gets finer",
    "mesh_coarse": "two meshes of the part differ by more than is wanted",
    "feature_small": "a beam is thinner than can be made",
}

finding = finder(FINDINGS)
"""Return a finding of this family; the name must be one that `FINDINGS` explains."""
