"""From targets to leaves around bought springs: every spring and number of a catalogue is tried.

The springs decide the stiffness K, so that the rise follows from it: h = (F - F_0)/K, F_0 the initial tension of all of
them, and the preload for an adjustment is dF/K. Leaves are then sized as around a diamond (`leaf_sizing`); of the exact
model only their width is fitted, since nothing of a bought spring can be changed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.findings import Infeasible, mm, mpa, no_design, refusals_answered
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.leaf_laws_from_spec import LeafLaws, room_of_coils
from cfmkit.families.vcfm.leaf_sizing import (
    FORCE_RTOL,
    MAX_PASSES,
    MIN_WIDTH_RATIO,
    N_RESCALES,
    check_guide,
    complete_analysis,
    fit_exact_force,
    leaf_changes,
    leaf_of_sheet,
    next_leaf,
    shortest_leaf,
    size_leaf,
    thickness_for,
)
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
from cfmkit.families.vcfm.leaves.v_beam import MAX_LEAF_ANGLE, VBeam, onset_and_exit
from cfmkit.families.vcfm.model import farthest_back, rests_by_laws
from cfmkit.results import Design, Status
from cfmkit.stock.material_and_part_spec import sheet_of
from cfmkit.stock.springs.kinds import PRESSED_FIRST
from cfmkit.stock.springs.offers import Miss, describe_nearest, guide_rod_for
from cfmkit.stock.springs.spec import block_of, offers
from cfmkit.stock.springs.stress_and_life import SpringInUse
from cfmkit.stock.springs.support_spec import guide_words

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
    from cfmkit.families.vcfm.spec import VcfmDesign, VcfmSpec
    from cfmkit.families.vcfm.surroundings_spec import BoughtSprings
    from cfmkit.stock.springs.offers import Offer

RETURN_TRAVEL_RATIO = 1.5
"""How far back leaves are followed, over where the closed form has the shuttle at rest: their width is still open."""
MAX_TRIED_SPRINGS = 12
"""Springs, the best by the closed forms first, whose leaves are sized by the exact model until some keep the stress."""
PRELOAD_RTOL = 0.01
"""Preloads stated for other springs are reported beyond this: a force that is that far off shows [1]."""


@dataclass(frozen=True)
class LeavesAroundSprings:
    """Leaves around bought springs."""

    springs: BoughtSprings  # as a specification has them
    target: VcfmDesign  # with the rise and the preload that follow from their rate, and the force that is left to it
    leaf: LeafStrip  # one leaf
    linear_range: tuple[float, float]  # where the leaves' stiffness is constant [m]
    half_beams: int  # number of leaves
    listed: bool = False  # whether the springs are from a catalogue, and not those of the mechanism

    @property
    def deflection(self) -> float:
        """Largest one of a spring, with the preload and at the end of the leaves' linear range [m]."""
        return float(self.linear_range[1]) + self.target.preload_stroke

    @property
    def held_springs(self) -> BoughtSprings:
        """The springs as they are to be built: with a rod if they would buckle without a guide.

        What a catalogue offers as a guide is left out if the springs do not need one.
        """
        springs, coil, buckles = self.springs, self.springs.coil, self.deflection > self.springs.unguided
        fields = springs.model_dump(exclude_unset=True)
        if buckles and not springs.is_guided and coil is not None:
            return type(springs).model_validate(fields | {"guide_rod": guide_rod_for(coil)})
        if self.listed and springs.is_guided and not buckles:
            plain = {key: value for key, value in fields.items() if key not in ("guide_rod", "guide_tube")}
            return type(springs).model_validate(plain)
        return springs

    @property
    def label(self) -> str:
        """Number and name."""
        return f"{self.springs.count} x {self.springs.name or 'the spring'}"

    def rank(self, wanted: VcfmDesign) -> tuple[bool, float, float, int]:
        """Return what springs that fit are sorted by: guide, how far below the limit, length of leaves [m], number."""
        below = 0.0
        if wanted.rise is not None:
            below = 1.0 - self.target.height / wanted.rise
        elif wanted.preload is not None:
            below = 1.0 - self.target.preload_stroke / wanted.preload
        return self.held_springs.is_guided, round(below, 6), float(self.leaf.length), self.springs.count


def with_bought_springs(spec: VcfmSpec, target: VcfmDesign) -> Design:
    """Return the design with leaves around springs of the catalogue, or around those of the mechanism.

    Of springs that fit those come first that need no guide against buckling, and of these the one whose rise, or
    preload, comes nearest to the largest that is allowed; if neither is limited, the one with the shortest leaves.
    INFEASIBLE where no spring fits: the message has the nearest three and what they miss.
    """
    check_guide(spec)
    if target.rise is not None:
        thickness_for(target)  # what the largest rise does not allow no spring does
    tried = [_design_around(spec, target, springs, offer) for springs, offer in _choices(spec, target)]
    fitting = sorted(
        (choice for choice in tried if isinstance(choice, LeavesAroundSprings)), key=lambda choice: choice.rank(target)
    )
    missed = [choice for choice in tried if isinstance(choice, Miss)]
    for number, choice in enumerate(fitting[:MAX_TRIED_SPRINGS], 1):
        sized = _fit_width(spec, target, choice) if target.refine else choice
        if isinstance(sized, LeavesAroundSprings):
            others = fitting[number:MAX_TRIED_SPRINGS]
            next_best = tuple(partial(_design_next_choice, spec, target, following) for following in others)
            return replace(_make_design(spec, target, sized), next_best=next_best)
        missed.append(sized)
    none = "it lists no spring of the required kind ('mechanism.springs.kind')"
    reported = f"no spring fits: {describe_nearest(missed) if missed else none}"
    return no_design(
        finding("no_spring_fits", f"{reported} ('{'design.catalogue' if target.catalogue else 'mechanism.springs'}')")
    )


@refusals_answered
def _design_next_choice(spec: VcfmSpec, target: VcfmDesign, choice: LeavesAroundSprings) -> Design:
    """Return the design around springs that are not the best of the catalogue."""
    sized = _fit_width(spec, target, choice) if target.refine else choice
    if isinstance(sized, Miss):
        return no_design(finding("no_spring_fits", describe_nearest([sized])))
    return _make_design(spec, target, sized)


def _choices(spec: VcfmSpec, target: VcfmDesign) -> Iterator[tuple[BoughtSprings, Offer | None]]:
    """Yield springs in their numbers, with their places in the catalogue; without one those of the mechanism."""
    from cfmkit.families.vcfm.surroundings_spec import BoughtSprings

    stated = spec.mechanism.springs
    if not target.catalogue:
        if stated is not None:
            yield stated, None
        return
    spring_types = PRESSED_FIRST if stated is None else (stated.spring_type,)
    for offer in offers(target.catalogue, *spring_types):
        for count in offer.counts:
            block = block_of(
                offer,
                kind=offer.spring_type.kind,
                stiffness=offer.rate,
                count=count,
                initial_tension=offer.initial_tension,
                max_elongation=offer.largest,
                free_length=offer.free_length,
                body_length=None if offer.wound is not None else offer.body_length,
                outer_diameter=offer.outer_diameter,
            )
            yield BoughtSprings.model_validate(block), offer


def _design_around(
    spec: VcfmSpec, target: VcfmDesign, springs: BoughtSprings, offer: Offer | None
) -> LeavesAroundSprings | Miss:
    """Return the leaves around some springs by closed forms, or what the springs miss."""
    label, law = f"{springs.count} x {springs.name or 'the spring'}", Coils.from_springs(springs)
    left = target.required_force - law.tension
    if left <= 0:
        return Miss(label, law.tension / target.required_force, "their initial tension alone is more than the force")
    rise, preload = left / law.stiffness, (target.adjustment or 0.0) / law.stiffness
    reachable = 4.0 * rise / 3.0
    ratios = [
        (
            target.stroke / reachable * (1 + 2e-9),
            f"too stiff, a rise of {mm(rise)} gives less than {mm(reachable)} of stroke",
        ),
        *(
            (value / limit, f"too soft, they need a {name} of {mm(value)} ('design.{name}' {mm(limit)})")
            for name, value, limit in (("rise", rise, target.rise), ("preload", preload, target.preload))
            if limit is not None
        ),
    ]
    if springs.free_length is not None and target.spring_room is not None:
        reported = f"too long, {mm(springs.free_length)} relaxed ('design.spring_room' {mm(target.spring_room)})"
        ratios.append((springs.free_length / target.spring_room, reported))
    worst, reported = max(ratios)
    if worst > 1 + 1e-9:
        return Miss(label, worst - 1.0, reported)
    own_target = target.model_copy(update={"force": left, "rise": rise, "preload": preload or None})
    try:
        thickness = thickness_for(own_target)
        shortest = shortest_leaf(spec, own_target, thickness)
    except Infeasible as problem:
        return Miss(label, 1.0, problem.finding.message)
    length = max(target.leaf_length or 0.0, shortest)
    if target.leaf_length is not None and shortest > target.leaf_length * (1 + 1e-9):
        return Miss(
            label, shortest / target.leaf_length - 1.0, f"leaves of at least {mm(shortest)} ('design.leaf_length')"
        )
    sheet, count = sheet_of(spec.mechanism.part), spec.mechanism.bistable.half_beams
    if sheet is not None:
        try:
            count, leaf = leaf_of_sheet(spec, own_target, thickness, length, sheet)
        except Infeasible as problem:
            return Miss(label, 1.0, problem.finding.message)
    else:
        leaf = _size_wide_leaf(spec, own_target, thickness, length)
    leaves = LeavesAroundSprings(springs, own_target, leaf, onset_and_exit(leaf), count, offer is not None)
    return _find_miss(spec, target, leaves, offer) or leaves


def _size_wide_leaf(spec: VcfmSpec, own_target: VcfmDesign, thickness: float, length: float) -> LeafStrip:
    """Return a leaf that does not buckle out of the plane: a longer one has to be wider. A stated length stays."""
    leaf = size_leaf(spec, own_target, thickness, length)
    while leaf.width < MIN_WIDTH_RATIO * leaf.thickness and own_target.leaf_length is None:
        length *= 1.02
        leaf = size_leaf(spec, own_target, thickness, length)
    return leaf


def _find_miss(spec: VcfmSpec, target: VcfmDesign, leaves: LeavesAroundSprings, offer: Offer | None) -> Miss | None:
    """Return what springs miss with the leaves around them; None if they fit."""
    springs, leaf = leaves.springs, leaves.leaf
    most, held = leaves.deflection, leaves.held_springs
    limits = (
        ("deflected by", most, springs.max_elongation, "they allow"),
        ("deflected by", most, room_of_coils(springs), "their turns touch at"),
        ("deflected by", most, np.inf if held.is_guided else held.unguided, "without a guide they buckle at"),
        ("between the walls", 2.0 * float(leaf.reach), target.max_span, "'design.max_span' is"),
        ("wide leaves", float(leaf.width), target.max_width, "'design.max_width' is"),
        (
            "thick leaves, buckling out of the plane",
            MIN_WIDTH_RATIO * leaf.thickness,
            float(leaf.width),
            "their width is",
        ),
    )
    for words, needed, limit, allowed in limits:
        if needed is not None and limit is not None and needed > limit * (1 + 1e-9):
            return Miss(
                leaves.label, needed / limit - 1.0 if limit else 1.0, f"{words} {mm(needed)}, {allowed} {mm(limit)}"
            )
    if leaf.angle > MAX_LEAF_ANGLE * (1 + 1e-9):
        return Miss(leaves.label, float(leaf.angle) / MAX_LEAF_ANGLE - 1.0, "leaves steeper than 15 deg")
    life, safety = target.spring_life, target.spring_safety
    if offer is not None and (life is not None or safety is not None):
        weak = [
            miss
            for use in _list_springs_in_use(spec, leaves, offer)
            if (miss := use.why_too_weak(life, safety)) is not None
        ]
        return Miss(leaves.label, *max(weak)) if weak else None
    return None


def _list_springs_in_use(spec: VcfmSpec, leaves: LeavesAroundSprings, offer: Offer) -> Iterator[SpringInUse]:
    """Yield a spring between rest and the end of the travel at each preload, by the closed form of the leaves."""
    springs, end = leaves.springs, max(float(leaves.linear_range[1]), spec.analysis.travel or 0.0)
    laws = LeafLaws(VBeam(leaves.leaf), Coils.from_springs(springs), leaves.half_beams)
    stated = "analysis" in spec.model_fields_set and "preloads" in spec.analysis.model_fields_set
    preloads = (*{*(spec.analysis.preloads if stated else (0.0,)), leaves.target.preload_stroke},)
    rests = rests_by_laws(laws, preloads, np.linspace(0.0, end, 101)).tolist()
    for preload, rest in zip(preloads, rests, strict=True):
        least, most = (springs.load(place + preload) for place in (rest, end))
        yield SpringInUse(offer.wound, least, most, offer.fatigue, offer.life)


def _write_design(spec: VcfmSpec, leaves: LeavesAroundSprings) -> VcfmSpec:
    """Return the spec with springs and leaves written into its mechanism."""
    springs = leaves.held_springs.model_dump(exclude_unset=True)
    changes = {"mechanism.positive": None, "mechanism.springs": springs}
    return spec.replace(changes | leaf_changes(leaves.half_beams, leaves.leaf))


def _fit_width(spec: VcfmSpec, target: VcfmDesign, sized: LeavesAroundSprings) -> LeavesAroundSprings | Miss:
    """Return the leaves with the width that makes the exact force flattest, long enough for their exact stress."""
    allowable, preload = spec.mechanism.allowable_stress or 0.0, sized.target.preload_stroke
    worst, sheet = np.inf, sheet_of(spec.mechanism.part)
    for _ in range(N_RESCALES if sheet is None else MAX_PASSES):
        made = _write_design(spec, sized).replace({"analysis.preloads": (0.0,), "analysis.branch": "stable"})
        # leaves are followed as far as the spring can push them, not through all of a long preload
        back = min(preload, RETURN_TRAVEL_RATIO * farthest_back(made, (preload,)))
        try:
            fit = fit_exact_force(made, sized.linear_range, preload, back, lambda _places: target.required_force)
        except SolutionError as error:
            return Miss(sized.label, 1.0, f"the exact model does not confirm the stroke: {error}")
        fitted = replace(sized, leaf=replace(sized.leaf, width=sized.leaf.width * fit.wide))
        worst = fit.stresses[0] / allowable
        if sheet is not None:
            if worst <= 1.0 + 1e-4 and abs(fit.wide - 1.0) <= FORCE_RTOL:
                return _find_miss(spec, target, sized, None) or sized
            count, leaf = next_leaf(sized.half_beams, sized.leaf, fit.wide, worst, sized.target.height)
            sized = replace(sized, leaf=leaf, linear_range=onset_and_exit(leaf), half_beams=count)
            continue
        if worst <= 1.0 + 1e-4:
            return _find_miss(spec, target, fitted, None) or fitted
        if target.leaf_length is not None:
            break
        # stress falls with the square of a length
        longer = size_leaf(spec, sized.target, sized.leaf.thickness, float(sized.leaf.length) * sqrt(1.0005 * worst))
        sized = replace(sized, leaf=longer, linear_range=onset_and_exit(longer))
    return Miss(
        sized.label, worst - 1.0, f"the exact stress of the leaves is {mpa(worst * allowable)} of {mpa(allowable)}"
    )


def _make_design(spec: VcfmSpec, target: VcfmDesign, leaves: LeavesAroundSprings) -> Design:
    """Return the design with an analysis that shows what was requested."""
    own_target = leaves.target
    note = f"{leaves.label}: the rise of the leaves follows from their rate, {mm(own_target.height)}"
    if own_target.preload_stroke:
        note += f", the preload for the adjustment is {mm(own_target.preload_stroke)}"
        stated = max((abs(preload) for preload in spec.analysis.preloads), default=0.0)
        if (
            "analysis" in spec.model_fields_set
            and abs(stated - own_target.preload_stroke) > PRELOAD_RTOL * own_target.preload_stroke
        ):
            note += f"; 'analysis' is stated for {mm(stated)}: leave it out to see these springs at their own preload"
    if (words := guide_words(leaves.held_springs)) and leaves.deflection > leaves.springs.unguided:
        note += f"; {' and '.join(words)}: alone they would buckle when deflected by {mm(leaves.springs.unguided)}"
    made = complete_analysis(
        _write_design(spec, leaves),
        own_target.model_copy(update={"force": target.force}),
        leaves.linear_range,
        leaves.leaf.angle,
    )
    active = ("design.catalogue",) if target.catalogue else ("mechanism.springs",)
    return Design(made, Status.COMPLETE, note, active_bounds=active)
