"""From targets to sizes: closed forms, then one pass of the exact model, then the stress.

With F_c = K h and dF = K dr the rise is h = F_c dr/dF. The stroke gives the thickness, since the linear region is
(4 h/3) sqrt(1 - (pi/Q)^2) long; the stress gives the shortest leaf; K_n = K its width. The spring is as long as its
stress at full travel and preload allows. Forces are exactly linear in the widths, so that the two factors that make the
exact force flattest at F_c are those of a linear least-squares fit: one pass is all there is to do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, ceil, cos, floor, log10, pi, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import at_least, at_most, mm, mpa
from cfmkit.families.no_mechanism import Infeasible, no_design
from cfmkit.families.vcfm.build import parts, share_of, spring_room
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.leaves.springs import Diamond
from cfmkit.families.vcfm.leaves.strip import Strip
from cfmkit.families.vcfm.leaves.v_beam import STEEP, buckled_stress, critical_force, onset_and_exit, overrated
from cfmkit.families.vcfm.model import LawSampler, rest_of
from cfmkit.numerics.roots import bracketed_root
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short
from cfmkit.specs.units.windows import Share

if TYPE_CHECKING:
    from cfmkit.families.base import Run
    from cfmkit.families.vcfm.exact_model import ExactSampler
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
            sizes = refined(spec, target, sizes)
            check_width(spec, target, sizes.leaf)
            check_room(target, sizes)
    except Infeasible as problem:
        return no_design(problem.finding, problem.nearest)
    return Design(completed(spec, target, sizes), Status.COMPLETE, active_bounds=tuple(active))


def closed_form(spec: VcfmSpec, target: VcfmDesign) -> DesignSizes:
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
    sizes = DesignSizes(leaf, spring_side(spec, target, leaf), onset_and_exit(leaf))
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


def completed(spec: VcfmSpec, target: VcfmDesign, sizes: DesignSizes) -> VcfmSpec:
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
        changes["analysis.preloads"] = (0.0, target.preload_stroke) if target.adjustment else (0.0,)
    if analysis.window is None:
        changes["analysis.window"] = inside
    if analysis.travel is None:
        ends = [float(end) for end in analysis.window or () if not isinstance(end, Share)]
        changes["analysis.travel"] = max([inside[1], *ends])
    if "requirements" not in spec.model_fields_set:
        allowed = f"{100.0 * flat:.6g} %"
        adjusted: list[dict[str, str]] = []
        if target.adjustment:
            most, least = (format_short(target.adjustment * (1.0 + share), "force", 6) for share in (flat, -flat))
            adjusted.append({"metric": "force_change_max", "min": least, "max": most})
        changes["requirements"] = (
            {"metric": "deviation_from_target", "max": allowed},
            {"metric": "force_ripple", "max": allowed},
            *adjusted,
            {"metric": "safety_factor", "min": f"{floor(1e3 * (1.0 - overrated(sizes.leaf.angle))) / 1e3:.3f}"},
        )
    made = written(spec, sizes).replace(changes)
    closing = made.travel + max(target.preload_stroke, *made.analysis.preloads) - spring_room(made)
    if closing <= 0 or "corner" in spec.mechanism.frame.model_fields_set:
        return made
    # higher corners, so that the spring stays open: a rigid part, which no force depends on
    return made.replace({"mechanism.frame.corner": at_least(made.mechanism.frame.corner + 1.1 * closing)})


def written(spec: VcfmSpec, sizes: DesignSizes) -> VcfmSpec:
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


MARGIN = 1.01
"""On that where a leaf length is proposed: the exact model changes widths by less than a percent."""

SNAPPING = 3.2
"""Rise over thickness below which leaves that buckle may do so with a jump."""

ROOM = 1.02
"""On the room that is proposed: the exact stress may lengthen the spring, and so widen it."""


@dataclass(frozen=True)
class DesignSizes:
    """The leaves of a design, and the end of the linear region [m]."""

    leaf: Strip
    side: Strip
    linear: tuple[float, float]


def thickness_for(target: VcfmDesign) -> float:
    """Return the thickness of leaves whose linear region is as long as the stroke [m].

    Raises
    ------
    Infeasible
        If the rise is too small for the stroke, or the leaf thinner than can be made.
    """
    rise, stroke, least = target.height, target.stroke, target.min_thickness or 0.0
    free = 1.0 - (0.75 * stroke / rise) ** 2
    if free <= 0:
        # at 98 % of its limit a leaf is a fifth of the rise over pi: thin, but a leaf
        longest = 0.98 * 4.0 * rise / 3.0
        raise Infeasible(
            finding(
                "stroke_unreachable",
                f"a stroke of {mm(stroke)} ('design.stroke') needs leaves with a rise above {mm(0.75 * stroke)}; "
                f"{_given(target)} {mm(rise)}: with that no stroke reaches {mm(4.0 * rise / 3.0)}",
            ),
            {"design.stroke": at_most(longest)} if not least else {"design.stroke": at_most(_stroke_for(rise, least))},
        )
    thickness = rise * sqrt(free) / pi
    if thickness < least:
        raise Infeasible(
            finding(
                "too_thin",
                f"a stroke of {mm(stroke)} from a rise of {mm(rise)} needs leaves of {mm(thickness)}, thinner than "
                f"{mm(least)} ('design.min_thickness')",
            ),
            {"design.stroke": at_most(_stroke_for(rise, least))},
        )
    return thickness


def _given(target: VcfmDesign) -> str:
    """Return what states the rise of the leaves, up to the number."""
    if target.rise is not None:
        return "'design.rise' is"
    return "'design.force', 'design.adjustment' and 'design.preload' give"


def _stroke_for(rise: float, thickness: float) -> float:
    """Return the linear region of leaves of this thickness [m]; an eighth of the rise's limit where they have none."""
    free = 1.0 - (pi * thickness / rise) ** 2
    if free <= 0:
        raise Infeasible(
            finding(
                "too_thin",
                f"leaves of {mm(thickness)} ('design.min_thickness') with a rise of {mm(rise)} do not buckle at all: "
                f"request a rise above {mm(pi * thickness)}, by 'design.rise' or a longer 'design.preload'",
            )
        )
    return 4.0 * rise / 3.0 * sqrt(free)


def followable_stroke(rise: float, leaf: Strip) -> dict[str, str]:
    """Return the stroke from which on exact leaves buckle without a jump; nothing where that is not what is wrong."""
    if rise >= SNAPPING * leaf.thickness:
        return {}
    return {"design.stroke": at_least(_stroke_for(rise, rise / SNAPPING))}


def shortest_leaf(spec: VcfmSpec, target: VcfmDesign, thickness: float) -> float:
    """Return the shortest leaf within the allowable stress and 15 deg [m]."""
    made, rise = spec.mechanism.material, target.height
    root = pi * thickness / rise
    u = min(1.0, 2.0 / 3.0 * (1.0 + sqrt(1.0 - root * root)))
    stressed = buckled_stress(rise, thickness, u)
    return max(sqrt(made.modulus / (spec.mechanism.allowable_stress or 1.0) * stressed), rise / sin(STEEP))


def check_room(target: VcfmDesign, sizes: DesignSizes) -> None:
    """Raise if the design needs more room than there is."""
    spans = {"leaves": 2.0 * float(sizes.leaf.reach), "spring": 2.0 * float(sizes.side.reach)}
    widths = {"leaves": sizes.leaf.width, "spring": sizes.side.width}
    for path, limit, found in (("max_span", target.max_span, spans), ("max_width", target.max_width, widths)):
        name = max(found, key=lambda key: found[key])
        if limit is not None and found[name] > limit * (1 + 1e-9):
            words = "across the motion" if path == "max_span" else "out of the plane"
            verb = "need" if name == "leaves" else "needs"
            raise Infeasible(
                finding("envelope", f"the {name} {verb} {mm(found[name])} {words}, 'design.{path}' gives {mm(limit)}"),
                {f"design.{path}": at_least(ROOM * found[name])},
            )


MIDDLE = 0.84
"""Part of the linear region over which the widths are fitted to the force."""

RESCALES = 4


def refined(spec: VcfmSpec, target: VcfmDesign, sizes: DesignSizes) -> DesignSizes:
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
        sizes = DesignSizes(leaf, side, sizes.linear)
    worst = max(stresses)
    raise Infeasible(
        finding(
            "stress_unreachable",
            f"the exact stress of leaves of {mm(float(sizes.leaf.length))} ('design.leaf_length') is {mpa(worst)}, "
            f"{mpa(allowable)} is allowed ('mechanism.material')",
        ),
        {"design.leaf_length": at_least(float(sizes.leaf.length) * sqrt(1.001 * max(over)))},
    )


def fit_widths(spec: VcfmSpec, target: VcfmDesign, sizes: DesignSizes) -> tuple[DesignSizes, tuple[float, float]]:
    """Return the sizes with widths that make the exact force flattest, and the exact stress of leaves and spring [Pa].

    The fit is over the middle 84 % of the linear region, without preload; the stress of the leaves is the largest from
    where the whole preload pulls them to the end of that region, that of the spring the one there under that preload.

    Raises
    ------
    Infeasible
        If the exact leaves cannot be followed that far.
    """
    from cfmkit.families.vcfm.exact_model import ExactSampler

    first, last = sizes.linear
    middle, half = 0.5 * (first + last), 0.5 * MIDDLE * (last - first)
    places = np.linspace(middle - half, middle + half, 101)
    full = target.preload_stroke
    made = written(spec, sizes).replace(
        {"analysis.preloads": (0.0, full) if full else (0.0,), "analysis.branch": "stable"}
    )
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
    fitted = DesignSizes(
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

    if not preload:
        return 0.0
    farthest = max(-preload, sampler.pulled.edges[-1])
    return farthest if force(farthest) >= 0 else bracketed_root(force, farthest, 0.0)
