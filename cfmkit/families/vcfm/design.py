"""From targets to sizes: closed forms, then one pass of the exact model, then the stress.

With F_c = K h and dF = K dr the rise is h = F_c dr/dF. The stroke gives the thickness, since the linear region is
(4 h/3) sqrt(1 - (pi/Q)^2) long; the stress gives the shortest leaf; K_n = K its width. The spring is as long as its
stress at full travel and preload allows. Forces are exactly linear in the widths, so that the two factors that make the
exact force flattest at F_c are those of a linear least-squares fit: one pass is all there is to do.
"""

from __future__ import annotations

from dataclasses import replace
from math import asin, ceil, cos, floor, log10, sqrt
from typing import TYPE_CHECKING

from cfmkit.families.findings import at_least, mm, mpa
from cfmkit.families.refusals import Infeasible, no_design
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.limits import (
    MARGIN,
    Sizes,
    check_room,
    shortest_leaf,
    thickness_for,
)
from cfmkit.families.vcfm.parts import share_of, spring_room
from cfmkit.families.vcfm.springs import Diamond
from cfmkit.families.vcfm.strip import Strip
from cfmkit.families.vcfm.vbeam import critical_force, onset_and_exit, overrated
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short
from cfmkit.specs.units.windows import Share

if TYPE_CHECKING:
    from cfmkit.families.base import Run
    from cfmkit.families.vcfm.spec import VcfmDesign, VcfmSpec

SQUAT = 2.0
"""Least width of a leaf over its thickness: narrower ones buckle out of the plane."""

ROUNDS = 8
"""Limits met one after the other on the way to what is feasible."""


def design(spec: VcfmSpec, run: Run) -> Design:
    """Return a complete specification that meets the targets of the `design` block.

    Parameters
    ----------
    spec : VcfmSpec
        With a `design` block and an allowable stress.
    run : Run
        Not needed here: nothing is random.

    Returns
    -------
    Design
        INFEASIBLE, with the reason and the nearest feasible values, if there is none.
    """
    found = _attempt(spec)
    nearest, last = dict(found.nearest_feasible), found
    for _ in range(ROUNDS):
        if last.status is not Status.INFEASIBLE or not last.nearest_feasible:
            break
        # what cures one limit may break the next: what is proposed must meet all of them
        last = _attempt(spec.replace({path: {"true": True}.get(value, value) for path, value in nearest.items()}))
        nearest |= last.nearest_feasible
    return replace(found, nearest_feasible=nearest if last.status is Status.COMPLETE else {})


def _attempt(spec: VcfmSpec) -> Design:
    target, allowable = spec.design, spec.mechanism.allowable_stress
    if target is None:
        return Design(None, Status.INVALID, "this spec has no 'design' block: add the targets 'force', 'stroke', ...")
    if allowable is None:
        message = "a design needs the stress that is allowed: add 'mechanism.material.yield_strength'"
        return Design(None, Status.INVALID, message)
    try:
        sizes = closed_form(spec, target)
        active = ["mechanism.material.yield_strength"] if target.leaf_length is None else []
        if target.refine:
            from cfmkit.families.vcfm.refine import refined

            sizes = refined(spec, target, sizes)
            check_width(spec, target, sizes.leaf)
            check_room(target, sizes)
    except Infeasible as problem:
        return no_design(problem.finding, problem.nearest)
    return Design(completed(spec, target, sizes), Status.COMPLETE, active_bounds=tuple(active))


def closed_form(spec: VcfmSpec, target: VcfmDesign) -> Sizes:
    """Return all sizes by closed forms.

    Raises
    ------
    Infeasible
        With the constraint that cannot be met, and the nearest value that can.
    """
    check_guide(spec)
    thickness = thickness_for(target)
    shortest = shortest_leaf(spec, target, thickness)
    length = target.leaf_length or shortest
    if length < shortest * (1 - 1e-9):
        raise Infeasible(
            finding(
                "overstressed",
                f"leaves of {mm(length)} ('design.leaf_length') would be stressed beyond "
                f"{mpa(spec.mechanism.allowable_stress or 0.0)}, or be steeper than 15 deg: the shortest allowed is "
                f"{mm(shortest)}",
            ),
            {"design.leaf_length": at_least(shortest)},
        )
    leaf = sized_leaf(spec, target, thickness, length)
    sizes = Sizes(leaf, spring_side(spec, target, leaf), onset_and_exit(leaf))
    check_width(spec, target, leaf)
    check_room(target, sizes)
    return sizes


def sized_leaf(spec: VcfmSpec, target: VcfmDesign, thickness: float, length: float) -> Strip:
    """Return a leaf as wide as the stiffness wants, F_c/h = n P_cr/X."""
    made, rise = spec.mechanism.material, target.height
    leaf = Strip(length, asin(rise / length), thickness, 1.0, made.modulus, made.poisson)
    width = target.force / rise * leaf.reach / (spec.mechanism.bistable.half_beams * float(critical_force(leaf)))
    return replace(leaf, width=float(width))


def spring_side(spec: VcfmSpec, target: VcfmDesign, leaf: Strip) -> Strip:
    """Return a leaf of the diamond: as long as its stress at the end of the linear region and full preload allows."""
    made, positive = spec.mechanism.material, spec.mechanism.positive
    deflection = 0.5 * (float(onset_and_exit(leaf)[1]) + target.preload_stroke)
    e, t, tilt = made.modulus, positive.thickness, positive.angle
    length = sqrt(3.0 * e * t * deflection * cos(tilt) / (spec.mechanism.allowable_stress or 1.0))
    side = Strip(length, tilt, t, 1.0, e, made.poisson)
    return replace(side, width=float(target.force / target.height / Diamond(side, share_of(positive)).stiffness))


def check_guide(spec: VcfmSpec) -> None:
    """Raise if the shuttle can turn: the leaves would buckle at half the load that they are sized for."""
    if not spec.mechanism.bistable.guided:
        raise Infeasible(
            finding(
                "asymmetric_buckling",
                "the shuttle can turn ('mechanism.bistable.guided: false'), so the leaves buckle at half the load and "
                "the force is not constant: use two Vs at a distance, or a guide",
            ),
            {"mechanism.bistable.guided": "true"},
        )


def check_width(spec: VcfmSpec, target: VcfmDesign, leaf: Strip) -> None:
    """Raise if the leaves would rather buckle out of the plane."""
    if leaf.width >= SQUAT * leaf.thickness:
        return
    longer = leaf.length
    while sized_leaf(spec, target, leaf.thickness, longer).width < MARGIN * SQUAT * leaf.thickness:
        longer *= 1.002
    raise Infeasible(
        finding(
            "out_of_plane_buckling",
            f"leaves of {mm(leaf.length)} would be {mm(leaf.width)} wide and {mm(leaf.thickness)} thick: below "
            f"twice the thickness they buckle out of the plane; a 'design.leaf_length' of {at_least(longer)} is enough",
        ),
        {"design.leaf_length": at_least(longer)},
    )


def completed(spec: VcfmSpec, target: VcfmDesign, sizes: Sizes) -> VcfmSpec:
    """Return the designed mechanism with an analysis that shows what was requested, where the spec states none.

    The window is the linear region by the closed form, as long as the stroke; the travel ends with it, the preloads
    are none and the whole. Required are the force and its adjustment, within `analysis.flatness`, and the stress.
    """
    low, high = (float(end) for end in sizes.linear)
    # inwards to a thousandth of the stroke: numbers that can be read
    step = 10.0 ** floor(log10(target.stroke) - 3)
    inside = ceil(low / step) * step, floor(high / step) * step
    analysis, flat = spec.analysis, spec.analysis.flatness
    given = analysis.model_fields_set if "analysis" in spec.model_fields_set else set()
    changes: dict[str, object] = {}
    if "preloads" not in given:
        changes["analysis.preloads"] = (0.0, target.preload_stroke)
    if analysis.window is None:
        changes["analysis.window"] = inside
    if analysis.travel is None:
        ends = [float(end) for end in analysis.window or () if not isinstance(end, Share)]
        changes["analysis.travel"] = max([inside[1], *ends])
    if "requirements" not in spec.model_fields_set:
        most, least = (format_short(target.adjustment * (1.0 + share), "force", 6) for share in (flat, -flat))
        allowed = f"{100.0 * flat:.6g} %"
        changes["requirements"] = (
            {"metric": "deviation_from_target", "max": allowed},
            {"metric": "force_ripple", "max": allowed},
            {"metric": "force_change_max", "min": least, "max": most},
            {"metric": "safety_factor", "min": f"{floor(1e3 * (1.0 - overrated(sizes.leaf.angle))) / 1e3:.3f}"},
        )
    made = written(spec, sizes).replace(changes)
    closing = made.travel + max(target.preload_stroke, *made.analysis.preloads) - spring_room(made)
    if closing <= 0 or "corner" in spec.mechanism.frame.model_fields_set:
        return made
    # higher corners, so that the spring stays open: a rigid part, which no force depends on
    return made.replace({"mechanism.frame.corner": at_least(made.mechanism.frame.corner + 1.1 * closing)})


def written(spec: VcfmSpec, sizes: Sizes) -> VcfmSpec:
    """Return the spec with the sizes written into its mechanism."""
    leaf, side = sizes.leaf, sizes.side
    return spec.replace(
        {
            "mechanism.bistable.length": float(leaf.length),
            "mechanism.bistable.angle": float(leaf.angle),
            "mechanism.bistable.thickness": float(leaf.thickness),
            "mechanism.bistable.width": float(leaf.width),
            "mechanism.positive.length": float(side.length),
            "mechanism.positive.width": float(side.width),
        }
    )
