"""Sizes of a proposed mechanism of V-beams and a spring: widths that fit a force, longer leaves, corners, preloads."""

from __future__ import annotations

from math import asin, sin
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.vcfm.leaf_laws_from_spec import spring_room
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.suggestion_request import Request
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
    return (0.0, *(one for one in ((high - request.target) * per_force, (low - request.target) * per_force) if one))


def widen(spec: VcfmSpec, leaves: float, spring: float) -> VcfmSpec:
    """Return a mechanism whose leaves, and whose spring unless it is bought, are wider by factors."""
    changes = {"mechanism.bistable.width": spec.mechanism.bistable.width * leaves}
    if spec.mechanism.springs is None:
        changes["mechanism.positive.width"] = spec.mechanism.flexures.width * spring
    return spec.replace(changes)
