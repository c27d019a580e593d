"""One pass of the exact model over a design: widths by linear least squares, then the stress."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import at_least, mm, mpa
from cfmkit.families.refusals import Infeasible
from cfmkit.families.vcfm.design import sized_leaf, written
from cfmkit.families.vcfm.exact import ExactSampler
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.limits import Sizes, followable_stroke
from cfmkit.families.vcfm.model import rest_of
from cfmkit.families.vcfm.parts import parts
from cfmkit.families.vcfm.samples import LawSampler
from cfmkit.numerics.roots import bracketed_root

if TYPE_CHECKING:
    from cfmkit.families.vcfm.spec import VcfmDesign, VcfmSpec

MIDDLE = 0.84
"""Part of the linear region over which the widths are fitted to the force."""

RESCALES = 4


def refined(spec: VcfmSpec, target: VcfmDesign, sizes: Sizes) -> Sizes:
    """Return the sizes with both widths corrected by the exact model, and leaves long enough for its stress.

    Raises
    ------
    Infeasible
        If the exact stress stays above the allowable one.
    """
    allowable = spec.mechanism.allowable_stress or 0.0
    for _ in range(RESCALES):
        sizes, stresses = fit_widths(spec, target, sizes)
        over = [stress / allowable for stress in stresses]
        if max(over) <= 1.0 + 1e-4:
            return sizes
        # stress falls with the square of a length; a leaf that was given stays
        leaf, side = sizes.leaf, sizes.side
        if over[0] > 1.0 + 1e-4:
            if target.leaf_length is not None:
                break
            leaf = sized_leaf(spec, target, leaf.thickness, float(leaf.length) * sqrt(1.0005 * over[0]))
        if over[1] > 1.0 + 1e-4:
            longer = float(side.length) * sqrt(1.0005 * over[1])
            side = replace(side, length=longer, width=side.width * (longer / side.length) ** 3)
        sizes = Sizes(leaf, side, sizes.linear)
    worst = max(stresses)
    raise Infeasible(
        finding(
            "stress_unreachable",
            f"the exact stress of leaves of {mm(float(sizes.leaf.length))} ('design.leaf_length') is {mpa(worst)}, "
            f"{mpa(allowable)} is allowed ('mechanism.material')",
        ),
        {"design.leaf_length": at_least(float(sizes.leaf.length) * sqrt(1.001 * max(over)))},
    )


def fit_widths(spec: VcfmSpec, target: VcfmDesign, sizes: Sizes) -> tuple[Sizes, tuple[float, float]]:
    """Return the sizes with widths that make the exact force flattest, and the exact stress of leaves and spring [Pa].

    The fit is over the middle 84 % of the linear region, without preload; the stress of the leaves is the largest from
    where the whole preload pulls them to the end of that region, that of the spring the one there under that preload.

    Raises
    ------
    Infeasible
        If the exact leaves cannot be followed that far.
    """
    first, last = sizes.linear
    middle, half = 0.5 * (first + last), 0.5 * MIDDLE * (last - first)
    places = np.linspace(middle - half, middle + half, 101)
    full = target.preload_stroke
    made = written(spec, sizes).replace({"analysis.preloads": (0.0, full), "analysis.branch": "stable"})
    back = -(rest_of(LawSampler(parts(made)), full, places) or 0.0)
    sampler = ExactSampler(made, last, 1.2 * back)
    if sampler.problem:
        raise Infeasible(
            finding(
                "no_linear_region",
                f"the exact model does not confirm the 'design.stroke' of {mm(target.stroke)}: {sampler.problem}",
            ),
            followable_stroke(target.height, sizes.leaf),
        )
    leaves, spring = sampler.leaves(places).force, sampler.spring(places)[0]
    wanted = np.full(len(places), target.force)
    (wide, stiff), *_ = np.linalg.lstsq(np.column_stack([leaves, spring]), wanted, rcond=None)
    leaf, side = sizes.leaf, sizes.side
    fitted = Sizes(
        replace(leaf, width=float(leaf.width * wide)), replace(side, width=float(side.width * stiff)), sizes.linear
    )
    end = np.concatenate([[_rest(sampler, full, (wide, stiff))], np.linspace(0.0, last, 201)])
    stresses = float(sampler.leaves(end).stress.max()), float(sampler.spring(np.array([last + full]))[1].max())
    return fitted, stresses


def _rest(sampler: ExactSampler, preload: float, factors: tuple[float, float]) -> float:
    """Return where the shuttle rests at a preload with both widths changed by factors [m]."""

    def force(travel: float) -> float:
        place = np.array([travel])
        return float((factors[0] * sampler.leaf_force(place) + factors[1] * sampler.spring(place + preload)[0])[0])

    farthest = max(-preload, sampler.pulled.edges[-1])
    return farthest if force(farthest) >= 0 else bracketed_root(force, farthest, 0.0)
