"""Sizes of a proposed mechanism of V-beams and a spring: widths that fit a force, longer leaves, corners, preloads.

At last they are those that its leaves and its spring need as planar solids.
"""

from __future__ import annotations

from math import asin, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.proposals import WINDOW_EXTENSION_SHARE, aim_below_stiffening
from cfmkit.families.run_control import Run
from cfmkit.families.vcfm.exact_model import analyze
from cfmkit.families.vcfm.leaf_laws_from_spec import parts, spring_room
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
from cfmkit.families.vcfm.plane_fem_analysis import SolidSampler
from cfmkit.specs.units import Place

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.proposals import Request
    from cfmkit.families.vcfm.exact_model import ExactSampler
    from cfmkit.families.vcfm.spec import VcfmSpec


def fit_in_window(
    sampler: ExactSampler, at: float, force: float, travel: float
) -> tuple[float, float, float, float] | None:
    """Return what is left of the force around a place, the place and both factors; None if one is not above zero."""
    places: FloatArray = np.linspace(at - 0.5 * travel, at + 0.5 * travel, 61)
    columns = np.column_stack([sampler.leaves(places).force, sampler.spring(places)[0]])
    if not np.isfinite(columns).all():
        return None
    if sampler.coils is None:
        (wide, stiff), *_ = np.linalg.lstsq(columns, np.full(len(places), force), rcond=None)
    else:  # bought springs are as they are
        stiff = 1.0
        (wide,), *_ = np.linalg.lstsq(columns[:, :1], force - columns[:, 1], rcond=None)
    if not (wide > 0.0 and stiff > 0.0):
        return None
    left = np.abs(columns @ np.array([wide, stiff]) / force - 1.0).max()
    return float(left), at, float(wide), float(stiff)


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
    spec: VcfmSpec, request: Request, per_force: float | None = None, known: tuple[float, ...] = (0.0,)
) -> tuple[float, ...]:
    """Return the preloads with which the force is that of the middle and both ends of the adjustment [m].

    `per_force` is the preload for a change of the force [m/N]; None: that of the design, or of its bought springs.
    `known` are those of a mechanism that has them already: without an adjustment they stay.
    """
    design, bought = spec.design, spec.mechanism.springs
    if request.adjustable is None or (len(known) == 1 and (design is None or not design.adjustment)):
        return known
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
