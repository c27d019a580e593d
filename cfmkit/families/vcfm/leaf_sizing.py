"""Leaves for a force, a stroke and a rise by closed forms, and the analysis that shows what was requested of them.

The linear region of the leaves is (4 h/3) sqrt(1 - (pi/Q)^2) long: the stroke gives their thickness h/Q, the stress the
shortest length, the stiffness their width.

Leaves and a spring that are as wide as the sheet is thick have no width to choose. A leaf's stiffness goes with
n b t^3/L^3, its stress with t/L^2; t follows from the stroke. So its length follows from the width; where that is
shorter than the stress allows, there are more leaves. A spring's stiffness goes with b t^3/L^3 and its stress with
t/L^2, too: both together give its thickness and length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, ceil, floor, log10, pi, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.findings import format_at_least, format_at_most, mm, mpa
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.leaf_laws_from_spec import spring_room
from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
from cfmkit.families.vcfm.leaves.v_beam import MAX_LEAF_ANGLE, buckled_stress, critical_force, stress_overestimate
from cfmkit.numerics.roots import bracketed_root
from cfmkit.specs.units import format_short
from cfmkit.specs.units.fields import TravelShare

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.findings import Infeasible
    from cfmkit.families.vcfm.exact_model import ExactSampler
    from cfmkit.families.vcfm.spec import VcfmDesign, VcfmSpec


MIN_WIDTH_RATIO = 2.0  # least width of a leaf over its thickness: narrower ones buckle out of the plane
SNAPPING_RISE_RATIO = 3.2  # rise over thickness below which leaves that buckle may do so with a jump
FITTED_REGION_SHARE = 0.84  # part of the linear region over which the widths are fitted to the force
N_RESCALES = 4  # two do for the shipped mechanisms
MAX_ROUNDS = 40
"""Of iterations that end after five, since forces and stresses are powers of the sizes within a few per cent."""
WIDTH_RTOL = 1e-6  # share of the width by which it may be off when sizes are found
MAX_PASSES, FORCE_RTOL = 12, 1e-5
"""Of the exact model for a sheet, and how far its force may then be off: five passes are usual."""
MOST_LEAVES = 1000  # as `mechanism.bistable.half_beams` allows


@dataclass(frozen=True)
class ExactFit:
    """Factors on the widths of leaves and spring that make the exact force flattest, and what is borne then."""

    wide: float
    stiff: float  # 1 of bought springs, which are as they are
    stresses: tuple[float, float]  # largest of leaves and spring, with the whole preload [Pa]


def fit_exact_force(
    spec: VcfmSpec,
    linear_range: tuple[float, float],  # ends of the region in which the stiffness of the leaves is constant [m]
    # preload, back: the whole preload, and how far it pushes the shuttle back at most [m]
    preload: float,
    back: float,
    wanted: Callable[[FloatArray], FloatArray | float],  # force at places [N]
) -> ExactFit:
    """Return the widths with which the exact force is nearest to a wanted one.

    The fit is over the middle 84 % of the linear region, without preload; stresses are those up to its end.

    Raises SolutionError if the exact leaves cannot be followed that far.
    """
    from cfmkit.families.vcfm.exact_model import ExactSampler

    first, last = map(float, linear_range)
    middle, half = 0.5 * (first + last), 0.5 * FITTED_REGION_SHARE * (last - first)
    places = np.linspace(middle - half, middle + half, 101)
    sampler = ExactSampler(spec, last, back)
    if sampler.problem:
        raise SolutionError(sampler.problem)
    wide, stiff = fit_factors(sampler, places, wanted(places))
    end = np.concatenate([[_rest(sampler, preload, (wide, stiff))], np.linspace(0.0, last, 201)])
    stresses = sampler.leaf_stress(end), sampler.spring(np.array([last + preload]))[1]
    return ExactFit(wide, stiff, (float(stresses[0].max()), float(stresses[1].max())))


def fit_factors(sampler: ExactSampler, places: FloatArray, force: FloatArray | float) -> tuple[float, float]:
    """Return the factors on the widths of leaves and spring that make their force at places nearest to a wanted one.

    Bought springs are as they are.
    """
    leaves, spring = sampler.leaf_force(places), sampler.spring(places)[0]
    columns = np.column_stack([leaves, spring] if sampler.coils is None else [leaves])
    fixed = 0.0 if sampler.coils is None else spring
    factors, *_ = np.linalg.lstsq(columns, force - fixed + np.zeros(len(places)), rcond=None)
    wide, stiff = (*factors.tolist(), 1.0)[:2]
    return wide, stiff


def _rest(sampler: ExactSampler, preload: float, factors: tuple[float, float]) -> float:
    """Return where the shuttle rests at a preload with both widths changed by factors [m]."""

    def force(travel: float) -> float:
        place = np.array([travel])
        return float((factors[0] * sampler.leaf_force(place) + factors[1] * sampler.spring(place + preload)[0])[0])

    if not preload:
        return 0.0
    farthest = max(-preload, sampler.pulled.edges[-1])
    return farthest if force(farthest) >= 0 else bracketed_root(force, farthest, 0.0)


def leaf_changes(half_beams: int, leaf: LeafStrip) -> dict[str, object]:
    """Return what writes the number of leaves, and one of them, into a specification."""
    sizes = {key: float(getattr(leaf, key)) for key in ("length", "angle", "thickness", "width")}
    return {f"mechanism.bistable.{key}": value for key, value in ({"half_beams": half_beams} | sizes).items()}


def check_guide(spec: VcfmSpec) -> None:
    """Raise if the shuttle can turn: the leaves would buckle at half the load that they are sized for."""
    if not spec.mechanism.bistable.guided:
        raise finding.infeasible(
            "asymmetric_buckling",
            "the shuttle can turn ('mechanism.bistable.guided: false'), so the leaves buckle at half the load and "
            "the force is not constant: use two Vs at a distance, or a guide",
            {"mechanism.bistable.guided": "true"},
        )


def size_leaf(spec: VcfmSpec, target: VcfmDesign, thickness: float, length: float) -> LeafStrip:
    """Return a leaf as wide as the stiffness wants, F_c/h = n P_cr/X."""
    made, rise = spec.mechanism.material, target.height
    leaf = LeafStrip(length, asin(rise / length), thickness, 1.0, made.modulus, made.poisson)
    width = (
        target.required_force / rise * leaf.reach / (spec.mechanism.bistable.half_beams * float(critical_force(leaf)))
    )
    return replace(leaf, width=float(width))


def thickness_for(target: VcfmDesign) -> float:
    """Return the thickness of leaves whose linear region is as long as the stroke [m].

    Raises Infeasible if the rise is too small for the stroke, or the leaf thinner than can be made.
    """
    rise, stroke, least = target.height, target.stroke, target.min_thickness or 0.0
    free = 1.0 - (0.75 * stroke / rise) ** 2
    if free <= 0:
        # at 98 % of its limit a leaf is a fifth of the rise over pi: thin, but a leaf
        longest = 0.98 * 4.0 * rise / 3.0
        raise finding.infeasible(
            "stroke_unreachable",
            f"a stroke of {mm(stroke)} ('design.stroke') needs leaves with a rise above {mm(0.75 * stroke)}; "
            f"{_name_rise(target)} {mm(rise)}, with which every stroke is shorter than {mm(4.0 * rise / 3.0)}",
            {"design.stroke": format_at_most(longest)}
            if not least
            else {"design.stroke": format_at_most(_stroke_for(rise, least))},
        )
    thickness = rise * sqrt(free) / pi
    if thickness < least:
        raise finding.infeasible(
            "too_thin",
            f"a stroke of {mm(stroke)} from a rise of {mm(rise)} needs leaves of {mm(thickness)}, thinner than "
            f"{mm(least)} ('design.min_thickness')",
            {"design.stroke": format_at_most(_stroke_for(rise, least))},
        )
    return thickness


def _name_rise(target: VcfmDesign) -> str:
    """Return what states the rise of the leaves, up to the number."""
    if target.rise is not None:
        return "'design.rise' is"
    return "'design.force', 'design.adjustment' and 'design.preload' give"


def _stroke_for(rise: float, thickness: float) -> float:
    """Return the linear region of leaves of this thickness [m]; an eighth of the rise's limit where they have none."""
    free = 1.0 - (pi * thickness / rise) ** 2
    if free <= 0:
        raise finding.infeasible(
            "too_thin",
            f"leaves of {mm(thickness)} ('design.min_thickness') with a rise of {mm(rise)} do not buckle at all: "
            f"request a rise above {mm(pi * thickness)}, by 'design.rise' or a longer 'design.preload'",
        )
    return 4.0 * rise / 3.0 * sqrt(free)


def followable_stroke(rise: float, leaf: LeafStrip) -> dict[str, str]:
    """Return the stroke from which on exact leaves buckle without a jump; nothing where that is not what is wrong."""
    if rise >= SNAPPING_RISE_RATIO * leaf.thickness:
        return {}
    return {"design.stroke": format_at_least(_stroke_for(rise, rise / SNAPPING_RISE_RATIO))}


def shortest_leaf(spec: VcfmSpec, target: VcfmDesign, thickness: float) -> float:
    """Return the shortest leaf within the allowable stress and 15 deg [m]."""
    made, rise = spec.mechanism.material, target.height
    root = pi * thickness / rise
    u = min(1.0, 2.0 / 3.0 * (1.0 + sqrt(1.0 - root * root)))
    stressed = buckled_stress(rise, thickness, u)
    return max(sqrt(made.modulus / (spec.mechanism.allowable_stress or 1.0) * stressed), rise / sin(MAX_LEAF_ANGLE))


def complete_analysis(spec: VcfmSpec, target: VcfmDesign, linear_range: tuple[float, float], angle: float) -> VcfmSpec:
    """Return a designed mechanism with an analysis that shows what was requested, where the spec states none.

    The window is the linear region by the closed form, as long as the stroke; the travel ends with it, the preloads
    are none and the whole. Required are the force and its adjustment, within `analysis.flatness`, and the stress.
    """
    low, high = (float(end) for end in linear_range)
    # inwards to a thousandth of the stroke: numbers that can be read
    step = 10.0 ** floor(log10(target.stroke) - 3)
    inside = ceil(low / step) * step, floor(high / step) * step
    analysis, flat = spec.analysis, spec.analysis.flatness
    stated_keys = analysis.model_fields_set if "analysis" in spec.model_fields_set else set()
    changes: dict[str, object] = {}
    if "preloads" not in stated_keys:
        changes["analysis.preloads"] = (0.0, target.preload_stroke) if target.adjustment else (0.0,)
    if analysis.window is None:
        changes["analysis.window"] = inside
    if analysis.travel is None:
        ends = [float(end) for end in analysis.window or () if not isinstance(end, TravelShare)]
        changes["analysis.travel"] = max([inside[1], *ends])
    if "requirements" not in spec.model_fields_set:
        allowed = f"{100.0 * flat:.6g} %"
        adjusted: list[dict[str, str]] = []
        if target.adjustment:
            most, least = (format_short(target.adjustment * (1.0 + share), "force", 6) for share in (flat, -flat))
            adjusted.append({"metric": "force_change_max", "min": least, "max": most})
        flat_or_near = ("deviation_from_target", "force_ripple") if target.target is None else ("deviation_from_curve",)
        changes["requirements"] = (
            *({"metric": name, "max": allowed} for name in flat_or_near),
            *adjusted,
            {"metric": "safety_factor", "min": f"{floor(1e3 * (1.0 - stress_overestimate(angle))) / 1e3:.3f}"},
        )
    if target.target is not None:
        changes |= {"design.target": target.target.written_out(target.force), "design.force": None}
    made = spec.replace(changes)
    closing = made.travel + max(target.preload_stroke, *made.analysis.preloads) - spring_room(made)
    if closing <= 0 or made.mechanism.positive is None or "corner" in spec.mechanism.frame.model_fields_set:
        return made
    # higher corners, so that the spring stays open: a rigid part, which no force depends on
    return made.replace({"mechanism.frame.corner": format_at_least(made.mechanism.frame.corner + 1.1 * closing)})


def leaves_for(have: int, wanted: float, sheet: float) -> int:
    """Return the number of leaves that is no smaller than one that is wanted, whole Vs more than there are.

    Raises Infeasible if a mechanism cannot have as many.
    """
    count = have + 2 * max(0, ceil((wanted - have) / 2.0 - 1e-9))
    if count > MOST_LEAVES:
        reported = f"from a sheet of {mm(sheet)} ('mechanism.part.sheet') {count} leaves would have to be cut"
        raise finding.infeasible("envelope", f"{reported}, {MOST_LEAVES} at most: use a thicker sheet")
    return count


def leaf_of_sheet(
    spec: VcfmSpec,
    target: VcfmDesign,
    thickness: float,  # in the plane [m]
    shortest: float,  # shortest leaf within the stress [m]
    sheet: float,  # their width [m]
) -> tuple[int, LeafStrip]:
    """Return how many leaves the sheet needs, and one of them.

    Raises Infeasible if the sheet is so thin that leaves would buckle out of the plane, or that there would be too
    many.
    """
    if sheet < MIN_WIDTH_RATIO * thickness:
        least = format_at_least(MIN_WIDTH_RATIO * thickness)
        paths = ("part.sheet", "bistable.width", *(["positive.width"] if spec.mechanism.positive else []))
        raise finding.infeasible(
            "out_of_plane_buckling",
            f"leaves of {mm(thickness)} from a sheet of {mm(sheet)} ('mechanism.part.sheet') would buckle out of "
            f"the plane: below twice the thickness they do; a sheet of {least} is enough",
            {f"mechanism.{path}": least for path in paths},
        )
    leaf, have = size_leaf(spec, target, thickness, shortest), spec.mechanism.bistable.half_beams
    count = leaves_for(have, have * leaf.width / sheet, sheet)
    for _ in range(MAX_ROUNDS):
        wide = leaf.width * have / count / sheet
        if abs(wide - 1.0) < WIDTH_RTOL:
            break
        leaf = size_leaf(spec, target, thickness, float(leaf.length) * wide ** (-1.0 / 3.0))
    return count, replace(leaf, width=sheet)


def spring_leaf_of_sheet(
    # the leaf of some thickness that the stress allows, with the width that its stiffness needs
    sized: Callable[[float], LeafStrip],
    spring_leaf: LeafStrip,  # one of them
    least: float,  # thinnest leaf that can be made [m]
    sheet: float,  # [m]
) -> LeafStrip:
    """Return a leaf of the spring as wide as the sheet is thick."""
    for _ in range(MAX_ROUNDS):
        spring_leaf = sized(float(spring_leaf.thickness) * (spring_leaf.width / sheet) ** (2.0 / 3.0))
        if abs(spring_leaf.width / sheet - 1.0) < WIDTH_RTOL:
            break
    longer = max(1.0, least / float(spring_leaf.thickness))
    return replace(
        spring_leaf, thickness=longer * spring_leaf.thickness, length=longer * spring_leaf.length, width=sheet
    )


def next_leaf(
    have: int,  # number so far
    leaf: LeafStrip,  # with its width, which stays
    stiffer: float,  # factor of the force of all leaves
    over: float,  # its stress over the allowable one
    rise: float,  # of the leaf, which stays [m]
) -> tuple[int, LeafStrip]:
    """Return how many leaves, and one, have a force `stiffer` times as large and keep the stress."""
    count, length = have, float(leaf.length) * stiffer ** (-1.0 / 3.0)
    stressed = over * (leaf.length / length) ** 2
    if stressed > 1.0 + 1e-4:
        # n leaves are longer by the cube root of n, and their stress is lower by its square
        count = leaves_for(have, have * stressed**1.5, float(leaf.width))
        length *= (count / have) ** (1.0 / 3.0)
    return count, replace(leaf, length=length, angle=asin(rise / length))


def next_spring_leaf(spring_leaf: LeafStrip, stiffer: float, over: float, least: float) -> LeafStrip:
    """Return a leaf of the spring `stiffer` times as stiff, with the allowable stress or the least thickness [m].

    `over` is its stress over the allowable one.
    """
    slope = stiffer ** (1.0 / 3.0) * float(spring_leaf.thickness / spring_leaf.length)
    length = max(float(spring_leaf.length) * stiffer ** (1.0 / 3.0) * over, least / slope)
    return replace(spring_leaf, thickness=slope * length, length=length)


def stress_unreachable(leaf: LeafStrip, stress: float, allowable: float) -> Infeasible:
    """Return what is raised where the sizes do not come within the stress [Pa]."""
    reported = f"the exact stress of leaves of {mm(float(leaf.length))} from this sheet is {mpa(stress)}"
    return finding.infeasible("stress_unreachable", f"{reported}, {mpa(allowable)} is allowed ('mechanism.material')")
