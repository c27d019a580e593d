"""A proposed mechanism of V-beams and a spring, with the sizes that its leaves and its spring need as planar solids."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.flattest_window import WINDOW_EXTENSION_SHARE
from cfmkit.families.run_control import Run
from cfmkit.families.stiffening_of_wide_beams import aim_below_stiffening
from cfmkit.families.vcfm.exact_model import analyze
from cfmkit.families.vcfm.leaf_laws_from_spec import parts
from cfmkit.families.vcfm.plane_fem_analysis import SolidSampler
from cfmkit.families.vcfm.proposal_sizes import fit_in_window, lengthen, open_corners, preloads_for, widen
from cfmkit.specs.units import Place

if TYPE_CHECKING:
    from cfmkit.families.suggestion_request import Request
    from cfmkit.families.vcfm.spec import VcfmSpec

WINDOW_CENTRE_RATIOS = np.linspace(0.9, 1.1, 21)
"""Middles of windows of a solid that are looked at, over that of its beams."""


def correct(spec: VcfmSpec, request: Request) -> VcfmSpec:
    """Return a mechanism with the window, the widths and, where the stress needs it, the lengths of its solids.

    The force is linear in both widths: of windows around the present one that is taken in which the widths that fit the
    force best leave the least of it. Longer leaves of the same rise are stressed less, as one over the length squared;
    their force falls with its cube.
    """
    request = aim_below_stiffening(spec, request, analyze)
    solid = spec.replace({"analysis.fidelity": "solid", "requirements": (), "sensitivity": None})
    window = solid.analysis.window
    middle = 0.5 * (float(window[0]) + float(window[1])) if window else 0.5 * spec.travel
    ends = [
        share * middle + 0.5 * request.travel for share in WINDOW_CENTRE_RATIOS if share * middle > 0.5 * request.travel
    ]
    if not ends:
        return solid
    free = {"analysis.travel": max(ends), "analysis.window": None, "analysis.preloads": (0.0,)}
    sampler = SolidSampler(solid.replace(free), max(ends), 0.0, Run())
    tried = [fit_in_window(sampler, end - 0.5 * request.travel, request.target, request.travel) for end in ends]
    fitted = [fit for fit in tried if fit is not None]
    if not fitted:
        return solid
    _, at, wide, stiff = min(fitted)
    last = at + 0.5 * request.travel
    leaf = float(sampler.leaves(np.linspace(0.0, last, 201)).stress.max())
    preloads, largest = solid.analysis.preloads, max(solid.analysis.preloads)
    force, stress = sampler.spring(np.array([last - request.travel, last]))
    rate = stiff * float(force[1] - force[0]) / request.travel
    strength = request.strength_used * (solid.mechanism.material.allowable(1.0) or np.inf)
    longer = [max(1.0, sqrt(1.02 * leaf / strength)), 1.0]
    if solid.mechanism.springs is None:
        law = parts(solid).spring
        side = float(np.max(stress) * law.stress(last + largest) / law.stress(last))
        longer[1] = max(1.0, sqrt(1.02 * side / strength))
        preloads = preloads_for(spec, request, 1.0 / rate, preloads)
    made = lengthen(solid, longer)
    made = widen(made, wide * longer[0] ** 3, stiff * longer[1] ** 3)
    begin = last - request.travel * (1.0 + WINDOW_EXTENSION_SHARE)
    changes = {
        "analysis.window": (Place(begin, "length"), Place(last, "length")), "analysis.travel": last,
        "analysis.preloads": preloads,
    }  # fmt: skip
    return open_corners(made.replace(changes), last, preloads)
