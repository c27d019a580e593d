"""From a request to V-beams beside a diamond worth designing: the closed forms over rises, leaf lengths and leaf pairs.

The linear region of leaves with rise h and thickness t = h/Q is (4 h/3) sqrt(1 - (pi/Q)^2) long: for a travel, Q
decides the rise. The stress gives the shortest leaf, force and rise the widths. Everything here is the design's own
closed form; what it refuses is not offered.

Other springs and leaves in the place of a designed diamond and its Vs: folded springs, cosine arches, hybrid leaves.
The force is linear in both widths. So a structure needs no design of its own: of all windows as long as the travel
that is taken in which the widths that fit the force best leave the least of it; what is stressed too much gets
longer. Helical springs come from the generic series: those for which there is a place are the catalogue of the
family's own design.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import chain, product
from math import pi, sin, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.findings import Infeasible, mm
from cfmkit.families.proposals import Candidate, FamilyOffer, is_too_wide, name_variant
from cfmkit.families.run_control import Run
from cfmkit.families.vcfm.design import closed_form
from cfmkit.families.vcfm.leaf_laws_from_spec import parts
from cfmkit.families.vcfm.leaves_spec import LEAF_KINDS, SPRING_KINDS
from cfmkit.families.vcfm.proposal_sizes import correct, fit_best_window, lengthen, open_corners, preloads_for, widen
from cfmkit.families.vcfm.spec import VcfmSpec
from cfmkit.specs.units import Place
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.springs.kinds import PRESSED_FIRST
from cfmkit.stock.springs.offers import generic_series
from cfmkit.stock.springs.spec import CatalogueSpring

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.proposals import MaterialBlock, Request
    from cfmkit.families.vcfm.design import DesignSizes
    from cfmkit.families.vcfm.proposal_sizes import WindowFit


RISE_RATIOS = (3.7, 4.0, 4.25, 4.5, 5.5, 7.0)
"""Rise over thickness of the leaves: below 3.63 they are no longer buckled half way, above 7 they are thin and wide."""
LENGTH_RATIOS = (1.04, 1.15, 1.4, 1.8, 2.4)
"""Leaf lengths, over the shortest that the stress allows: longer leaves are wider, and the force flatter."""
PAIR_COUNTS = (2, 1, 3, 4)  # vs that carry the shuttle; one V alone needs a guide
THICKNESS_RATIOS = (1.0, 1.6, 2.4)  # thickness of the diamond's leaves over that of the Vs
REGION_SHARES = (0.8, 0.9, 0.98)
"""Share of the linear region that is used: the exact leaves depart from the line at its ends, which widths correct."""
STRUCTURE_BLOCKS = {
    kind.proposal.name: (block, kind.proposal)
    for block, kinds in (("positive", SPRING_KINDS.values()), ("bistable", LEAF_KINDS.values()))
    for kind in kinds
    if kind.proposal is not None
}
"""Name -> the block that is changed, and what is proposed in place of a designed diamond or its Vs."""
SPRING_ANGLE = 7.0 * pi / 180.0  # of the diamond's leaves, as in Ding, Li and Li 2022
STRESS_MARGIN = 1.03
"""On the stress: the exact model has a little more of it than the closed forms that give the leaf's length."""
DEFAULT_ADJUSTMENT = 0.02  # adjustment, over the force, where none is required: every such mechanism has one
VARIANT_ORDER = {"1 V": 2, "3 Vs": 4, "4 Vs": 5, "2 Vs, catalogue": 7} | {
    block.variant: block.turn for _, block in STRUCTURE_BLOCKS.values()
}
"""Variants by their first words, in the order in which they are tried behind two Vs with a diamond."""
MIN_RISE_RATIO = 0.9
"""Smallest rise over that of the leaves that helical springs may ask for: the nearest of the series is taken."""
WIDE_LAST = 100.0  # promise of designs whose leaves are too wide to curl: they come after all others
TRAVEL_OVER_LINEAR_REGION = 1.2  # end of the travel over that of the linear region: the flattest window may lie farther
SPRING_CLEARANCE_RATIO = 1.2  # room across that a helical spring takes, over its diameter: as they are drawn
MAX_PROPOSALS = 28
"""What finishes what the family's design has made, and what corrects it by its solids."""


def propose(request: Request, run: Run) -> FamilyOffer:
    """Return mechanisms that the closed forms say are worth designing, the smallest first, for a yield the thickest."""
    if request.kind == "torque":
        return FamilyOffer(reason="leaves that snap through give a force at their shuttle, no torque")
    candidates: list[Candidate] = []
    closest: tuple[float, dict[str, float]] | None = None
    for block in request.materials or ({"name": "pom"},):
        for loose, sizes in _designs(request, dict(block)):
            spec = _with_close_spring(loose, sizes)
            over = _room_over(request, spec, sizes)
            excess = max(over.values())
            if closest is None or excess < closest[0]:
                closest = excess, over
            if excess <= 1.0:
                pairs = spec.mechanism.bistable.half_beams // 2
                variant = name_variant(f"{pairs} V{'s' if pairs > 1 else ', guided'}", request, block)
                # of made parts those with thick leaves are most alike: an error of the thickness counts three times
                thick = min(sizes.leaf.thickness, sizes.spring_leaf.thickness)
                promise = over["across"] * over["along"] if request.stated.min_yield is None else -thick
                promise += WIDE_LAST * _is_too_wide(request, block, sizes)
                candidates.append(Candidate(variant, spec, True, finish, float(promise), correct=correct))
            if (coiled := _offer_coiled(request, block, spec, sizes)) is not None:
                candidates.append(coiled)
    if candidates:
        ranked = sorted(candidates, key=lambda candidate: candidate.promise)
        plain = [candidate for candidate in ranked if candidate.promise < 0.5 * WIDE_LAST] or ranked
        return FamilyOffer(tuple(_vary_by_turns([*plain, *_with_structures(plain)])[:MAX_PROPOSALS]))
    if closest is None:
        return FamilyOffer(
            reason=f"no leaf as thin as {mm(request.thinnest)} or thicker, too wide to buckle out of the plane, has "
            "this travel, force and adjustment within the stress"
        )
    return _explain_no_offer(request, *closest)


def _is_too_wide(request: Request, block: MaterialBlock, sizes: DesignSizes) -> bool:
    """Return True if the Vs or the spring probably cannot curl, and stiffen by more than the band of the request."""
    material = MaterialSpec.model_validate(dict(block))
    strain = request.allowed_stress_share * (material.allowable(1.0) or 0.0) / material.modulus
    return any(
        is_too_wide(request, float(strip.width), float(strip.thickness), strain)
        for strip in (sizes.leaf, sizes.spring_leaf)
    )


def _vary_by_turns(candidates: list[Candidate]) -> list[Candidate]:
    """Return candidates, those of different numbers of Vs by turns."""
    kinds = sorted(dict.fromkeys(candidate.variant for candidate in candidates), key=_turn)
    rows = [[candidate for candidate in candidates if candidate.variant == kind] for kind in kinds]
    # the smallest first, then larger ones, which are flatter; for a yield the thickest, then thinner ones
    turns = [[row[len(row) * part // 8] for part in (0, 4, 2, 6, 1, 7)] for row in rows]
    mixed = [row[k] for k in range(6) for row in turns]
    return [
        candidate
        for number, candidate in enumerate(mixed)
        if all(candidate is not earlier for earlier in mixed[:number])
    ]


def _turn(variant: str) -> int:
    """Return when a variant has its turn: what is most often possible first, then what differs from it most."""
    return next((turn for words, turn in VARIANT_ORDER.items() if variant.startswith(words)), 0)


def _designs(request: Request, material: dict[str, Any]) -> Any:
    """Yield (specification, sizes) of every choice that the closed forms allow."""
    base, adjustment = request.target, DEFAULT_ADJUSTMENT * request.target
    if request.adjustable is not None:
        adjustment = 1.03 * max(request.adjustable[1] - base, base - request.adjustable[0], adjustment)
    for share, slender, pairs, thicker in product(REGION_SHARES, RISE_RATIOS, PAIR_COUNTS, THICKNESS_RATIOS):
        stroke = request.travel / share
        rise = 0.75 * stroke / sqrt(1.0 - (pi / slender) ** 2)
        thin = rise / slender
        block = max(3.0 * thin * max(thicker, 1.0), 0.4 * rise, 1e-3)
        data = {
            "family": "vcfm",
            "name": "suggested",
            "mechanism": {
                "material": material,
                "safety_factor": STRESS_MARGIN / request.allowed_stress_share,
                "positive": {
                    "structure": "diamond", "length": 20.0 * thin * thicker, "angle": SPRING_ANGLE,
                    "thickness": thin * thicker, "width": 5.0 * thin,
                },
                "bistable": {
                    "structure": "v-beam", "half_beams": 2 * pairs, "length": 20.0 * rise, "angle": 0.05,
                    "thickness": thin, "width": 5.0 * thin,
                },
                "frame": {
                    "shuttle_width": 1.3 * block, "block": block, "spacing": 1.2 * rise + 2.0 * thin + 2.0 * block,
                    "corner": 1.2 * block, "clearance": rise + block,
                },
            },
            "design": {"force": base, "adjustment": adjustment, "stroke": stroke, "rise": rise},
        }  # fmt: skip
        yield from _lengths(VcfmSpec.model_validate(data), request)


def _lengths(spec: VcfmSpec, request: Request) -> Any:
    """Yield designs with the shortest leaf and with longer ones; one that is too narrow gets the length it needs."""
    try:
        first = closed_form(spec, spec.design)  # type: ignore[arg-type]
    except Infeasible as problem:
        longer = problem.nearest.get("design.leaf_length") if problem.nearest else None
        if longer is None:
            return
        try:
            spec = spec.replace({"design.leaf_length": longer})
            first = closed_form(spec, spec.design)  # type: ignore[arg-type]
        except Infeasible:
            return
    target = spec.design
    assert target is not None
    for more in LENGTH_RATIOS:
        # a length above zero needs no other check, and validating it took longer than the closed forms
        length = {"leaf_length": float(first.leaf.length) * more}
        made = spec.model_copy(update={"design": target.model_copy(update=length)})
        try:
            sizes = closed_form(made, made.design)  # type: ignore[arg-type]
        except Infeasible:
            continue
        if min(sizes.leaf.thickness, sizes.spring_leaf.thickness) >= request.thinnest:
            yield made, sizes


def _with_close_spring(spec: VcfmSpec, sizes: DesignSizes) -> VcfmSpec:
    """Return a design whose diamond stands close below the leaves if it is so short that it passes between the walls.

    Seen from the shuttle, the lowest leaf falls to the wall by what is left of its rise. The diamond's corners are as
    far below as its leaves rise, less half of what preload and travel compress it by. The corners stay half a block
    below the leaf before and after the travel.
    """
    frame, leaf, spring_leaf, target = spec.mechanism.frame, sizes.leaf, sizes.spring_leaf, spec.design
    corner = float(spring_leaf.reach) + 1.5 * frame.block
    if target is None or corner + frame.block > float(leaf.reach):
        return spec
    share, rise, preload = corner / float(leaf.reach), float(leaf.rise), float(target.preload_stroke)
    end = TRAVEL_OVER_LINEAR_REGION * float(sizes.linear_range[1])
    closest = max(0.5 * preload + share * rise, 0.5 * (preload + end) + share * (rise - end))
    clearance = max(frame.block, closest - float(spring_leaf.rise) - 0.5 * frame.block)
    if clearance >= frame.clearance:
        return spec
    # lengths above zero need no other check
    close = frame.model_copy(update={"clearance": clearance})
    return spec.model_copy(update={"mechanism": spec.mechanism.model_copy(update={"frame": close})})


def _room_over(request: Request, spec: VcfmSpec, sizes: DesignSizes) -> dict[str, float]:
    """Return what a design needs of the envelope over what there is, by side."""
    frame, pairs = spec.mechanism.frame, spec.mechanism.bistable.half_beams // 2
    leaf, spring_leaf = sizes.leaf, sizes.spring_leaf
    halves = leaf.reach + 0.5 * frame.shuttle_width + frame.block, spring_leaf.reach + 1.5 * frame.block
    across = 2.0 * float(max(halves))
    target = spec.design
    corner = max(
        frame.corner,
        float(sizes.linear_range[1]) + (target.preload_stroke if target else 0.0) - 2 * float(spring_leaf.rise),
    )
    along = (
        (pairs - 1) * frame.spacing + 2.0 * frame.clearance + 2.0 * frame.block + 2.0 * float(spring_leaf.rise) + corner
    )
    over = {"across": across / request.envelope[0], "along": along / request.envelope[1]}
    if request.depth is not None:
        over["depth"] = float(max(leaf.width, spring_leaf.width)) / request.depth
    return over


def _offer_coiled(request: Request, block: MaterialBlock, spec: VcfmSpec, sizes: DesignSizes) -> Candidate | None:
    """Return two Vs with helical springs in place of the diamond; None if none of the series fits beside them."""
    frame, parts, leaf = spec.mechanism.frame, spec.mechanism, sizes.leaf
    if parts.bistable.half_beams != 4 or parts.flexures.thickness > parts.bistable.thickness:
        return None  # other numbers of Vs, and the same leaves with a thicker diamond
    across = 2.0 * float(leaf.reach) + frame.shuttle_width + 2.0 * frame.block
    stands = frame.spacing + 2.0 * frame.clearance + frame.block
    if across > request.envelope[0] or (request.depth is not None and leaf.width > request.depth):
        return None
    springs = list(_springs_beside(request, spec, float(sizes.linear_range[1]), request.envelope[1] - stands))
    if not springs:
        return None
    promise = across * (stands + min(spring.free_length or 0.0 for spring in springs))
    promise = promise if request.stated.min_yield is None else -float(leaf.thickness)
    # the spring decides how wide the leaves are: of those for which there is a place, one whose leaves fit the depth
    listed = spec.replace({"design.catalogue": tuple(springs), "design.max_width": request.depth})
    variant = name_variant("2 Vs, catalogue springs", request, block)
    return Candidate(variant, listed, True, finish, float(promise), correct=correct, springs="catalogue")


def _springs_beside(request: Request, spec: VcfmSpec, travel: float, place: float) -> Iterator[CatalogueSpring]:
    """Yield springs of the generic series, in numbers that have about the rate wanted, for a place as long [m]."""
    target = spec.design
    assert target is not None
    softest, preload = target.required_force / target.height, target.preload_stroke
    for spring in chain.from_iterable(map(generic_series, PRESSED_FIRST)):
        wide = spring.outer_diameter or 0.0
        # a pulled spring stands above a shuttle that goes down, and the preload moves its other end up
        long = (spring.free_length or 0.0) + max(spring.spring_type.lengthening, 0.0) * (target.stroke + preload)
        stretched = (spring.largest or 0.0) > MIN_RISE_RATIO * (travel + preload)
        if long > place or wide > (request.depth or np.inf) or not stretched:
            continue
        most = request.envelope[0] / (SPRING_CLEARANCE_RATIO * wide)
        counts = tuple(n for n in spring.counts if softest <= n * spring.rate <= softest / MIN_RISE_RATIO and n <= most)
        if counts:
            yield CatalogueSpring.from_offer(replace(spring, counts=counts))


def _explain_no_offer(request: Request, excess: float, over: dict[str, float]) -> FamilyOffer:
    """Return which side of the envelope is too small for the design that comes nearest."""
    sides = dict(zip(("across", "along", "depth"), request.envelope, strict=False))
    worst = max(over, key=lambda name: over[name])
    words = {"across": "across the travel", "along": "along the travel", "depth": "out of the plane"}[worst]
    return FamilyOffer(reason=f"leaves and spring need {mm(sides[worst] * excess)} {words}")


def _with_structures(candidates: list[Candidate]) -> Iterator[Candidate]:
    """Yield the same with other springs and leaves: of two Vs, a small, a larger and a large one of each structure."""
    plain = [candidate for candidate in candidates if _turn(candidate.variant) == 0]
    chosen = [plain[k] for k in dict.fromkeys(len(plain) * part // 8 for part in (0, 3, 6))] if plain else []
    for name, (_, structure) in STRUCTURE_BLOCKS.items():
        for candidate in chosen:
            yield replace(
                candidate,
                variant=candidate.variant.replace("2 Vs", structure.variant),
                finish=partial(finish_with, name),
            )


def finish_with(name: str, spec: VcfmSpec, request: Request) -> VcfmSpec:
    """Return a designed mechanism with another structure, of `STRUCTURE_BLOCKS`."""
    strength = request.allowed_stress_share * (spec.mechanism.material.allowable(STRESS_MARGIN) or 0.0)
    design = spec.design
    raised = 0.0 if request.adjustable is None or design is None or not design.adjustment else max(request.adjustable)
    forces = request.target, max(raised, request.target)
    made, end, stiffness = with_structure(spec, name, forces, request.travel, strength)
    return _use_flattest_window(made, request, preloads_for(spec, request, 1.0 / stiffness), end)


def finish(spec: VcfmSpec, request: Request) -> VcfmSpec:
    """Return a designed mechanism that is judged by its exact model over the flattest window as long as the travel."""
    window = spec.analysis.window
    return _use_flattest_window(
        spec, request, preloads_for(spec, request), float(window[1]) if window else request.travel
    )


def _use_flattest_window(spec: VcfmSpec, request: Request, preloads: tuple[float, ...], end: float) -> VcfmSpec:
    """Return a mechanism with preloads and the flattest window, looked for up to a little behind an end [m]."""
    from cfmkit.families.proposals import flattest
    from cfmkit.families.vcfm.exact_model import analyze

    wide = end + 0.2 * request.travel
    keys = {"analysis.fidelity": "exact", "analysis.preloads": preloads, "design": None, "mechanism.safety_factor": 1.0}
    free = {"analysis.window": None, "analysis.travel": wide, "requirements": ()}
    made = open_corners(spec.replace(keys | free), wide, preloads)
    window = flattest(analyze(made, Run()), request.travel)
    if window is None:
        return made
    return made.replace(
        {"analysis.window": tuple(Place(end, "length") for end in window), "analysis.travel": window[1]}
    )


WINDOW_CENTRES = np.linspace(0.5, 1.5, 41)
"""Middles of windows that are looked at, over the rise: that of Vs is 1, that of cosine arches 4/3."""
N_LENGTHENINGS = 3  # times that parts are made longer: stress falls a little less than with the square of the length


def with_structure(
    spec: VcfmSpec,  # with a diamond and straight leaves
    name: str,  # of `STRUCTURE_BLOCKS`
    # the one without preload, and the largest, for whose preload the spring is sized, too [N]
    forces: tuple[float, float],
    # travel, strength: [m], [Pa]
    travel: float,
    strength: float,
) -> tuple[VcfmSpec, float, float]:
    """Return a designed mechanism with another structure for a force over a travel.

    With it come where its best window ends [m], and the stiffness of its spring there [N/m].

    Raises SolutionError if no widths above zero fit, or the leaves cannot be followed that far.
    """
    block, structure = STRUCTURE_BLOCKS[name]
    keys = structure.changes(getattr(spec.mechanism, block)).items()
    changes = {f"mechanism.{block}.{key}": value for key, value in keys}
    made = spec.replace({**changes, "design": None, "requirements": (), "mechanism.safety_factor": 1.0})
    made = made.replace({"analysis.fidelity": "exact", "analysis.preloads": (0.0,), "analysis.window": None})
    for _ in range(N_LENGTHENINGS):
        fit = _fit_exact_window(made, forces[0], travel)
        # the exact path ends with the travel: from there on by the closed form
        law, preload = parts(made).spring, (forces[1] - forces[0]) / fit.stiffness
        spring_stress = fit.spring_stress * float(law.stress(fit.end + preload) / law.stress(fit.end))
        over = [stress / strength for stress in (fit.leaf_stress, spring_stress)]
        if max(over) <= 1.0:
            break
        made = lengthen(made, [max(1.0, sqrt(1.02 * overstress)) for overstress in over])
    else:
        fit = _fit_exact_window(made, forces[0], travel)
    return widen(made, fit.wide, fit.stiff), fit.end, fit.stiffness


def _fit_exact_window(spec: VcfmSpec, force: float, travel: float) -> WindowFit:
    """Return the window and the widths with which the exact force departs least from the wanted one."""
    from cfmkit.families.vcfm.exact_model import ExactSampler

    rise = spec.mechanism.bistable.length * sin(spec.mechanism.bistable.angle)
    centres = [share * rise for share in WINDOW_CENTRES if share * rise > 0.51 * travel]
    if not centres:
        raise SolutionError("the leaves are too flat for the travel")
    sampler = ExactSampler(spec, centres[-1] + 0.5 * travel, 0.0)
    while sampler.problem and len(centres) > 1:
        # leaves that cannot be followed so far: windows that end earlier
        centres = centres[: len(centres) // 2]
        sampler = ExactSampler(spec, centres[-1] + 0.5 * travel, 0.0)
    if sampler.problem:
        raise SolutionError(sampler.problem)
    fit = fit_best_window(sampler, centres, force, travel)
    if fit is None:
        raise SolutionError("no widths of this structure give the force over the travel")
    return fit
