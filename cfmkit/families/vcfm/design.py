"""Design of a vcfm, a variable constant-force mechanism: sizes of its leaves and its spring for a force and a stroke.

In such a mechanism [D] n V-shaped leaves that buckle, with negative stiffness, stand beside a spring of positive
stiffness (a diamond of four leaves, or of two); the preload of the spring adjusts the constant force. The specification
with the targets goes in; one with all sizes comes out, or the limit that cannot be met with the nearest feasible value.
The sizes of one leaf are called `leaf`, those of one leaf of the spring `spring_leaf`.

Symbols: F_c constant force, dF its increase by the preload dr, K stiffness of the spring, K_n negative stiffness of all
leaves, h rise of a leaf, t its thickness, Q = h/t.

1. Closed forms. F_c = K h and dF = K dr, so the rise is h = F_c dr/dF. The stroke gives the thickness, since the region
   of constant stiffness is (4 h/3) sqrt(1 - (pi/Q)^2) long, the stress the shortest leaf, K_n = K the width of the
   leaves. The spring is as long as its stress at full travel and preload allows.
2. The exact model. Forces are linear in both widths, so a linear least-squares fit gives the two factors that make the
   exact force flattest at F_c. If a sheet fixes the widths, lengths and numbers are found in a few passes
   (`leaf_sizing`).
3. Lengths are increased if the exact stress is too large.

[D] B. Ding, X. Li, Y. Li, Robotica (2022), variable constant-force compliant mechanism; the theory is in
    docs/theory_vcfm.md.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, replace
from functools import partial
from math import cos, sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.findings import format_at_least, mm, mpa, newton, no_design, refusals_answered
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.leaf_laws_from_spec import share_of
from cfmkit.families.vcfm.leaf_sizing import (
    FORCE_RTOL,
    MAX_PASSES,
    MIN_WIDTH_RATIO,
    N_RESCALES,
    check_guide,
    complete_analysis,
    fit_exact_force,
    followable_stroke,
    leaf_changes,
    leaf_of_sheet,
    next_leaf,
    next_spring_leaf,
    shortest_leaf,
    size_leaf,
    spring_leaf_of_sheet,
    stress_unreachable,
    thickness_for,
)
from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Diamond
from cfmkit.families.vcfm.leaves.v_beam import onset_and_exit
from cfmkit.families.vcfm.leaves_around_bought_springs import with_bought_springs
from cfmkit.families.vcfm.model import farthest_back
from cfmkit.results import Design, Status
from cfmkit.stock.material_and_part_spec import sheet_of

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.families.vcfm.spec import VcfmDesign, VcfmSpec
    from cfmkit.specs.evaluable_target_curve import TargetCurve


MAX_ROUNDS = 8  # most limits that are met one after the other until the nearest feasible values meet all of them


def design(spec: VcfmSpec, run: Run) -> Design:
    """Return a complete specification that meets the targets of the `design` block.

    INFEASIBLE, with the reason and the nearest feasible values, if there is none.
    """
    outcome = _design_from_targets(spec)
    nearest, last = dict(outcome.nearest_feasible), outcome
    for _ in range(MAX_ROUNDS):
        if last.status is not Status.INFEASIBLE or not last.nearest_feasible:
            break
        # what cures one limit may break the next: what is proposed must meet all of them
        last = _design_from_targets(
            spec.replace({path: {"true": True}.get(value, value) for path, value in nearest.items()})
        )
        nearest |= last.nearest_feasible
    return replace(outcome, nearest_feasible=nearest if last.status is Status.COMPLETE else {})


@refusals_answered
def _design_from_targets(spec: VcfmSpec) -> Design:
    target, allowable = spec.design, spec.mechanism.allowable_stress
    if target is None:
        return Design(None, Status.INVALID, "this spec has no 'design' block: add the targets 'force', 'stroke', ...")
    if target.catalogue or spec.mechanism.springs is not None:
        return with_bought_springs(spec, target)
    if allowable is None:
        message = "a design needs an allowable stress: add 'mechanism.material.yield_strength'"
        return Design(None, Status.INVALID, message)
    if target.required_force <= 0:
        message = f"the target curve is {newton(target.required_force)} in the middle of the leaves' linear region"
        return no_design(finding("target_curve", f"{message}: it must be above 0 there ('design.target')"))
    sizes = closed_form(spec, target)
    active = ["mechanism.material.yield_strength"] if target.leaf_length is None else []
    if target.refine:
        sizes = refine_sizes(spec, target, sizes)
        check_width(spec, target, sizes.leaf)
        check_room(target, sizes)
    made = complete_analysis(write_sizes(spec, sizes), target, sizes.linear_range, sizes.leaf.angle)
    return Design(made, Status.COMPLETE, active_bounds=tuple(active))


def closed_form(spec: VcfmSpec, target: VcfmDesign) -> DesignSizes:
    """Return all sizes by closed forms.

    Raises Infeasible with the constraint that cannot be met, and the nearest value that can.
    """
    check_guide(spec)
    thickness = thickness_for(target)
    shortest = shortest_leaf(spec, target, thickness)
    length = target.leaf_length or shortest
    if length < shortest * (1 - 1e-9):
        raise finding.infeasible(
            "overstressed",
            f"leaves of {mm(length)} ('design.leaf_length') would be stressed beyond "
            f"{mpa(spec.mechanism.allowable_stress or 0.0)}, or be steeper than 15 deg: the shortest allowed is "
            f"{mm(shortest)}",
            {"design.leaf_length": format_at_least(shortest)},
        )
    sheet, count = sheet_of(spec.mechanism.part), spec.mechanism.bistable.half_beams
    if sheet is None:
        leaf = size_leaf(spec, target, thickness, length)
    else:
        count, leaf = leaf_of_sheet(spec, target, thickness, length, sheet)
    spring_leaf = size_spring_leaf(spec, target, leaf, spec.mechanism.flexures.thickness)
    if sheet is not None:
        size, least = partial(size_spring_leaf, spec, target, leaf), target.min_thickness or 0.0
        spring_leaf = spring_leaf_of_sheet(size, spring_leaf, least, sheet)
    sizes = DesignSizes(leaf, spring_leaf, onset_and_exit(leaf), count)
    check_width(spec, target, leaf)
    check_room(target, sizes)
    return sizes


def size_spring_leaf(spec: VcfmSpec, target: VcfmDesign, leaf: LeafStrip, thickness: float) -> LeafStrip:
    """Return a leaf of the spring, as long as its stress at the end of the linear region and full preload requires."""
    material, spring = spec.mechanism.material, spec.mechanism.flexures
    deflection = 0.5 * (float(onset_and_exit(leaf)[1]) + target.preload_stroke)
    e, tilt = material.modulus, spring.angle
    length = sqrt(3.0 * e * thickness * deflection * cos(tilt) / (spec.mechanism.allowable_stress or 1.0))
    unit = LeafStrip(length, tilt, thickness, 1.0, e, material.poisson)
    stiffness = target.required_force / target.height
    return replace(unit, width=float(stiffness / Diamond(unit, share_of(spring)).stiffness))


def check_width(spec: VcfmSpec, target: VcfmDesign, leaf: LeafStrip) -> None:
    """Raise Infeasible, with a long enough leaf, if leaves are below twice as wide as thick: they buckle sideways."""
    if leaf.width >= MIN_WIDTH_RATIO * leaf.thickness:
        return

    def wide_enough(steps: int) -> bool:
        width = float(size_leaf(spec, target, leaf.thickness, leaf.length * LENGTH_STEP**steps).width)
        return width >= LENGTH_MARGIN * MIN_WIDTH_RATIO * float(leaf.thickness)

    # widths grow with lengths
    longer = leaf.length * LENGTH_STEP ** bisect_left(range(MOST_STEPS), True, key=wide_enough)
    raise finding.infeasible(
        "out_of_plane_buckling",
        f"leaves of {mm(leaf.length)} would be {mm(leaf.width)} wide and {mm(leaf.thickness)} thick: below twice the "
        f"thickness they buckle out of the plane; a 'design.leaf_length' of {format_at_least(longer)} is enough",
        {"design.leaf_length": format_at_least(longer)},
    )


def write_sizes(spec: VcfmSpec, sizes: DesignSizes) -> VcfmSpec:
    """Return the spec with the sizes written into its mechanism."""
    spring_leaf = {
        f"mechanism.positive.{key}": float(getattr(sizes.spring_leaf, key)) for key in ("length", "thickness", "width")
    }
    return spec.replace(leaf_changes(sizes.half_beams, sizes.leaf) | spring_leaf)


LENGTH_MARGIN = 1.01
"""Margin on the least width when a leaf length is proposed: the exact model changes widths by less than a percent."""
LENGTH_STEP, MOST_STEPS = 1.002, 10_000
"""Factor from one leaf length to the next until leaves are wide enough, and the most lengths tried."""
ENVELOPE_MARGIN = 1.02
"""Margin on an envelope that is proposed: the exact stress may lengthen the spring, and so widen it."""


@dataclass(frozen=True)
class DesignSizes:
    """Sizes that a design writes into the mechanism."""

    leaf: LeafStrip  # one leaf
    spring_leaf: LeafStrip  # one leaf of the spring
    linear_range: tuple[float, float]  # ends of the region in which the stiffness of the leaves is constant [m]
    half_beams: int  # number of leaves


def check_room(target: VcfmDesign, sizes: DesignSizes) -> None:
    """Raise if the design needs more room than there is."""
    spans = {"leaves": 2.0 * float(sizes.leaf.reach), "spring": 2.0 * float(sizes.spring_leaf.reach)}
    widths = {"leaves": sizes.leaf.width, "spring": sizes.spring_leaf.width}
    for path, limit, needed in (("max_span", target.max_span, spans), ("max_width", target.max_width, widths)):
        name = max(needed, key=lambda key: needed[key])
        if limit is not None and needed[name] > limit * (1 + 1e-9):
            words = "across the motion" if path == "max_span" else "out of the plane"
            verb = "need" if name == "leaves" else "needs"
            raise finding.infeasible(
                "envelope",
                f"the {name} {verb} {mm(needed[name])} {words}, 'design.{path}' allows {mm(limit)}",
                {f"design.{path}": format_at_least(ENVELOPE_MARGIN * needed[name])},
            )


def refine_sizes(spec: VcfmSpec, target: VcfmDesign, sizes: DesignSizes) -> DesignSizes:
    """Return the sizes with both widths corrected by the exact model, and leaves long enough for its stress.

    From a sheet, whose widths stay, lengths and number are corrected instead.

    Raises Infeasible if the exact stress stays above the allowable one.
    """
    if (sheet := sheet_of(spec.mechanism.part)) is not None:
        return _refine_for_sheet(spec, target, sizes, sheet)
    allowable = spec.mechanism.allowable_stress or 0.0
    for _ in range(N_RESCALES):
        sizes, stresses = fit_widths(spec, target, sizes)
        over = [stress / allowable for stress in stresses]
        if max(over) <= 1.0 + 1e-4:
            return sizes
        # stress falls with the square of a length; a leaf that was given stays
        leaf, spring_leaf = sizes.leaf, sizes.spring_leaf
        if over[0] > 1.0 + 1e-4:
            if target.leaf_length is not None:
                break
            leaf = size_leaf(spec, target, leaf.thickness, float(leaf.length) * sqrt(1.0005 * over[0]))
        if over[1] > 1.0 + 1e-4:
            longer = float(spring_leaf.length) * sqrt(1.0005 * over[1])
            wider = spring_leaf.width * (longer / spring_leaf.length) ** 3
            spring_leaf = replace(spring_leaf, length=longer, width=wider)
        sizes = replace(sizes, leaf=leaf, spring_leaf=spring_leaf)
    worst = max(stresses)
    raise finding.infeasible(
        "stress_unreachable",
        f"the exact stress of leaves of {mm(float(sizes.leaf.length))} ('design.leaf_length') is {mpa(worst)}, "
        f"{mpa(allowable)} is allowed ('mechanism.material')",
        {"design.leaf_length": format_at_least(float(sizes.leaf.length) * sqrt(1.001 * max(over)))},
    )


def _refine_for_sheet(spec: VcfmSpec, target: VcfmDesign, sizes: DesignSizes, sheet: float) -> DesignSizes:
    """Return the sizes for which the widths that the exact model wants are the sheet."""
    allowable, least = spec.mechanism.allowable_stress or 0.0, target.min_thickness or 0.0
    for _ in range(MAX_PASSES):
        fitted, stresses = fit_widths(spec, target, sizes)
        wide, stiff = fitted.leaf.width / sheet, fitted.spring_leaf.width / sheet
        over = [stress / allowable for stress in stresses]
        if max(over) <= 1.0 + 1e-4 and max(abs(wide - 1.0), abs(stiff - 1.0)) <= FORCE_RTOL:
            return sizes
        count, leaf = next_leaf(sizes.half_beams, sizes.leaf, wide, over[0], target.height)
        spring_leaf = next_spring_leaf(sizes.spring_leaf, stiff, over[1], least)
        sizes = DesignSizes(leaf, spring_leaf, onset_and_exit(leaf), count)
    raise stress_unreachable(sizes.leaf, max(stresses), allowable)


def fit_widths(spec: VcfmSpec, target: VcfmDesign, sizes: DesignSizes) -> tuple[DesignSizes, tuple[float, float]]:
    """Return the sizes with widths that make the exact force flattest, and the exact stress of leaves and spring [Pa].

    Raises Infeasible if the exact leaves cannot be followed that far.
    """
    full, curve = target.preload_stroke, target.curve
    made = write_sizes(spec, sizes).replace(
        {"analysis.preloads": (0.0, full) if full else (0.0,), "analysis.branch": "stable"}
    )
    wanted = partial(_follow_curve, curve) if curve is not None else lambda _places: target.required_force
    try:
        fit = fit_exact_force(made, sizes.linear_range, full, 1.2 * farthest_back(made, (full,)), wanted)
    except SolutionError as error:
        raise finding.infeasible(
            "no_linear_region",
            f"the exact model does not confirm the 'design.stroke' of {mm(target.stroke)}: {error}",
            followable_stroke(target.height, sizes.leaf),
        ) from None
    leaf, spring_leaf = sizes.leaf, sizes.spring_leaf
    wider = replace(leaf, width=leaf.width * fit.wide), replace(spring_leaf, width=spring_leaf.width * fit.stiff)
    return replace(sizes, leaf=wider[0], spring_leaf=wider[1]), fit.stresses


def _follow_curve(curve: TargetCurve, places: FloatArray) -> FloatArray:
    """Return the forces of a curve at places in the linear region [N].

    Raises Infeasible if the curve does not cover them, or is not above zero there.
    """
    low, high = float(places[0]), float(places[-1])
    if not curve.covers(low, high):
        first, last = curve.extent
        raise finding.infeasible(
            "target_curve",
            f"the linear region of the leaves is {mm(low)} to {mm(high)}, and the target curve goes from "
            f"{mm(first)} to {mm(last)}; give it points there ('design.target')",
        )
    if curve.extremes(low, high)[0] <= 0:
        raise finding.infeasible(
            "target_curve",
            f"the target curve is not above zero from {mm(low)} to {mm(high)}, the linear region of the leaves "
            "('design.target')",
        )
    return np.asarray(curve.evaluate(places))
