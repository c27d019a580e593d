"""Names of the warnings of the beam family, and what they mean: stable, unlike the sentences of `findings`."""

from __future__ import annotations

from cfmkit.families.end_stops import STOP_FINDINGS
from cfmkit.families.findings import Finder

BEAM_FINDINGS = {
    "closure_adjusted": "beams were turned and scaled to fit between rounded nodes, or nodes moved to the beams' ends",
    "closure_prestress": "beams are forced into place between rounded nodes: the mechanism is prestressed at rest",
    "self_contact": "the part as a solid touches itself: the curve ends there",
    "ends_early": "the path ends before the requested travel or load",
    "inaccurate": "at some points the tolerance is not reached: no force is reported there",
    "limit_point": "the load has an extremum on the path: under load control the mechanism snaps there",
    "bifurcation": "the path branches: the mechanism leaves the symmetric or straight form",
    "unstable": "a part of the path is not stable: the mechanism would leave it",
    "flutter": "under forces that rotate with their node two natural frequencies coincide: oscillations grow",
    "flutter_not_judged": "forces rotate with their node: stability is checked against divergence, not against flutter",
    "imperfection": "the beams were bent in the first buckling mode, as requested",
    "overstressed": "the stress exceeds the allowable stress within the window",
    "rescale_approximate": "the scaling law for the force is exact only for inextensible beams",
    "rescale_stress": "after scaling, the stress reaches the allowable stress within the window",
    "design_unsound": "the best shape that was found fails its audit",
    "objective_ill_posed": "the objective of the paper rewards a force that falls",
    "starts_lost": "worker processes died, and the starts that they were working on are lost",
    "search_cut_short": "the time budget ended before all starts were finished",
    "surface_out_of_reach": "following the surface requires more displacement than the solved travel",
    "surface_hole": "a part of the surface was not measured: the force there is not known, nor any extreme along it",
    "tip_lifts_off": "the mechanism no longer presses on the surface: the tip lifts off",
    "surface_stress_exceeded": "the stress along the surface exceeds the allowable one",
    "tip_jams": "somewhere the surface is too steep for the friction at the tip",
    "thick_beam": "a beam is short for its thickness: beam theory is inaccurate",
    "wide_beam": "the anticlastic bending of a wide beam is suppressed: it is stiffer than in beam theory",
    "beams_touch": "two beams touch, or cross: contact is not modelled",
    "joined_away_from_nodes": "the part as drawn is one piece where the mechanism has beams, pads or bars apart: they "
    "cross, touch or lie on one another, or fillets fill the gap between them",
    "pins_not_drawn": "beams turn on pins in the mechanism, but are one piece in the drawing",
    "gap_small": "two beams are closer than can be cut",
    "sharp_corners": "without fillets the stress in inside corners has no value: it grows as the mesh gets finer",
    "mesh_coarse": "the force or the largest stress of the solid is not known as closely as requested",
    "feature_small": "a beam is thinner than can be made",
    **STOP_FINDINGS,
    "contact_spreads_between_beams": "two parts begin to lie on each other along a length: the curve ends there",
    "friction_not_unique": "friction leaves several states at a change of contact: the first of them was taken",
    "stability_of_sliding": "a pad slides against friction: whether what slides is stable is not known",
    "near_contact": "a gap nearly closes but stays open: whether there is contact depends on tolerances",
    "obstacle_out_of_reach": "an obstacle is so far from the nodes that may touch it that it plays no part",
    "side_in_obstacle": "the side of a beam that is not in `beams` passes through an obstacle",
}

finding = Finder(BEAM_FINDINGS)  # return a finding of this family; the name must be one that `BEAM_FINDINGS` explains
