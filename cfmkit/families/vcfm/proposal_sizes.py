"""Sizes of a proposed mechanism of V-beams and a spring: widths that fit a force, longer leaves, corners, preloads.

At last they are those that its leaves and its spring need as planar solids.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.proposals import WINDOW_EXTENSION_SHARE, aim_below_stiffening
from cfmkit.families.run_control import Run
from cfmkit.families.vcfm.exact_model import analyze
from cfmkit.families.vcfm.leaf_laws_from_spec import parts, spring_room
from cfmkit.families.vcfm.leaf_sizing import fit_factors
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
from cfmkit.families.vcfm.plane_fem_analysis import SolidSampler
from cfmkit.specs.units import Place

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.proposals import Request
    from cfmkit.families.vcfm.exact_model import ExactSampler
    from cfmkit.families.vcfm.spec import VcfmSpec


@dataclass(frozen=True)
class WindowFit:
    """Window in which widths fit a force best, and leaves and spring as wide as they are to be."""

    wide: float  # factor on the width of the leaves
    stiff: float  # factor on that of the spring; 1 of bought ones
    end: float  # of the window [m]
    leaf_stress: float  # largest of the leaves up to there [Pa]
    spring_stress: float  # of the spring there, without preload [Pa]
    stiffness: float  # of the spring over the window [N/m]


def fit_best_window(sampler: ExactSampler, centres: Sequence[float], force: float, travel: float) -> WindowFit | None:
    """Return the window as long as a travel around one of some centres [m] that leaves the least of the force [N].

    None if no widths above zero fit.
    """
    fits: list[tuple[float, float, float, float]] = []
    for at in centres:
        places: FloatArray = np.linspace(at - 0.5 * travel, at + 0.5 * travel, 61)
        columns = np.column_stack([sampler.leaf_force(places), sampler.spring(places)[0]])
        if not np.isfinite(columns).all():
            continue
        factors = fit_factors(sampler, places, force)
        if min(factors) > 0.0:
            fits.append((float(np.abs(columns @ np.array(factors) / force - 1.0).max()), at, *factors))
    if not fits:
        return None
    _, at, wide, stiff = min(fits)
    end = at + 0.5 * travel
    at_ends, stresses = sampler.spring(np.array([end - travel, end]))
    leaf_stress = float(sampler.leaf_stress(np.linspace(0.0, end, 201)).max())
    stiffness = stiff * float(at_ends[1] - at_ends[0]) / travel
    return WindowFit(wide, stiff, end, leaf_stress, float(np.max(stresses)), stiffness)


def lengthen(spec: VcfmSpec, factors: list[float]) -> VcfmSpec:
    """Return a mechanism whose leaves of the same rise, and whose spring, are longer by factors."""
    leaf = spec.mechanism.bistable
    rise, length = leaf.length * sin(leaf.angle), leaf.length * factors[0]
    changes = {"mechanism.bistable.length": length, "mechanism.bistable.angle": asin(rise / length)}
    if spec.mechanism.springs is None:
        changes["mechanism.positive.length"] = spec.mechanism.flexures.length * factors[1]
    changes |= {f"mechanism.bistable.{key}": getattr(leaf, key) * factors[0] for key in leaf.kind.lengths}
    return spec.replace(changes)


def open_corners(spec: VcfmSpec, travel: float, preloads: tuple[float, ...]) -> VcfmSpec:
    """Return a mechanism whose corners are so high that its spring stays open: a rigid part, which no force needs."""
    closing = travel + max(preloads) - spring_room(spec)
    higher = {"mechanism.frame.corner": spec.mechanism.frame.corner + 1.1 * closing}
    return spec if closing <= 0.0 else spec.replace(higher)


def preloads_for(
    spec: VcfmSpec, request: Request, per_force: float | None = None, preloads: tuple[float, ...] = (0.0,)
) -> tuple[float, ...]:
    """Return the preloads with which the force is that of the middle and both ends of the adjustment [m].

    `per_force` is the preload for a change of the force [m/N]; None: that of the design, or of its bought springs.
    `preloads` are those of a mechanism that has them already: without an adjustment they stay.
    """
    design, bought = spec.design, spec.mechanism.springs
    if request.adjustable is None or (len(preloads) == 1 and (design is None or not design.adjustment)):
        return preloads
    if per_force is None:
        stroke = design.preload_stroke / design.adjustment if design and design.adjustment else 0.0
        per_force = stroke if bought is None else 1.0 / Coils.from_springs(bought).stiffness
    low, high = request.adjustable
    return (
        0.0,
        *(shift for shift in ((high - request.target) * per_force, (low - request.target) * per_force) if shift),
    )


def widen(spec: VcfmSpec, leaves: float, spring: float) -> VcfmSpec:
    """Return a mechanism whose leaves, and whose spring unless it is bought, are wider by factors."""
    changes = {"mechanism.bistable.width": spec.mechanism.bistable.width * leaves}
    if spec.mechanism.springs is None:
        changes["mechanism.positive.width"] = spec.mechanism.flexures.width * spring
    return spec.replace(changes)


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
    centres = [share * middle for share in WINDOW_CENTRE_RATIOS if share * middle > 0.5 * request.travel]
    if not centres:
        return solid
    farthest = max(centres) + 0.5 * request.travel
    free = {"analysis.travel": farthest, "analysis.window": None, "analysis.preloads": (0.0,)}
    sampler = SolidSampler(solid.replace(free), farthest, 0.0, Run())
    fit = fit_best_window(sampler, centres, request.target, request.travel)
    if fit is None:
        return solid
    last, preloads = fit.end, solid.analysis.preloads
    strength = request.allowed_stress_share * (solid.mechanism.material.allowable(1.0) or np.inf)
    longer = [max(1.0, sqrt(1.02 * fit.leaf_stress / strength)), 1.0]
    if solid.mechanism.springs is None:
        law = parts(solid).spring
        side = fit.spring_stress * law.stress(last + max(preloads)) / law.stress(last)
        longer[1] = max(1.0, sqrt(1.02 * side / strength))
        preloads = preloads_for(spec, request, 1.0 / fit.stiffness, preloads)
    made = lengthen(solid, longer)
    made = widen(made, fit.wide * longer[0] ** 3, fit.stiff * longer[1] ** 3)
    begin = last - request.travel * (1.0 + WINDOW_EXTENSION_SHARE)
    changes = {
        "analysis.window": (Place(begin, "length"), Place(last, "length")), "analysis.travel": last,
        "analysis.preloads": preloads,
    }  # fmt: skip
    return open_corners(made.replace(changes), last, preloads)
