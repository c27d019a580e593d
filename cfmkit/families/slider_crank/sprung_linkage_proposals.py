"""Linkages with springs of steel wire at their joints that may do what is required: for a torque, or for a force.

Kept proportions at the size that the envelope allows; lengths scale with one factor, the angles stay. Which springs
hold the effort best, of those that can be wound and have their place, `flattest_springs_that_fit` says; they are custom
springs within the envelope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.findings import deg, mm, percent
from cfmkit.families.hardware import PartStrength, guide_rods
from cfmkit.families.proposals import Candidate, FamilyOffer
from cfmkit.families.slider_crank.flattest_springs_that_fit import (
    TRAVEL_RTOL,
    SprungMotion,
    flattest_springs,
    largest_effort,
)
from cfmkit.families.slider_crank.linkage import Linkage, linkage_of
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.hardware import least_sheet, link_loads, links_that_bear
from cfmkit.families.slider_crank.springs.largest_turns_and_forces import MotionExtremes
from cfmkit.families.slider_crank.springs.outline import EYE_SHARE
from cfmkit.families.slider_crank.springs.part import N_SHEETS, height_of
from cfmkit.families.slider_crank.springs.solution import grid_over
from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly, TurnedCrank, assemble
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.specs.units import Place, format_short
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.helical_spring_formulas import YOUNGS_MODULUS
from cfmkit.stock.springs.offers import MAX_INDEX, as_stated, largest_load, shortest_spring, slimmest_spring
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring
from cfmkit.stock.stock_series import series_of

if TYPE_CHECKING:
    from cfmkit.families.proposals import MaterialBlock, Request
    from cfmkit.families.slider_crank.flattest_springs_that_fit import HeldEffort
    from cfmkit.families.slider_crank.springs.hardware import LinkLoads
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring


@dataclass(frozen=True)
class Proportions:
    """A linkage over its crank's length, and its envelope as far as it is known."""

    # stretched, offset: position of the stretched slider, and height of its way, over the crank's length
    stretched: float
    offset: float
    unloaded: float  # crank angle with all springs relaxed [rad]
    reach: float  # largest travel that is of use, over the crank's length


TORQUE_PROPORTIONS = (
    (1.0, 5.0, 0.3, -5.0),
    (1.0, 5.0, 0.3, -9.0),
    (1.0, 2.5, 0.0, -8.0),
    (1.0, 3.0, 0.3, -15.0),
    (1.0, 2.0, 0.5, -25.0),
    (1.0, 1.65, 0.5, -88.0),
    (1.0, 3.7, 0.0, -122.0),
    (1.0, 10.0, 0.0, -82.5),
)
"""For a torque: crank, coupler, offset (over the crank's length) and unloaded angle [deg]; first Li and Hao 2019. The
last three are the flattest of some thousands of random linkages over 40 to 90 deg: their springs are wound up first."""
WOUND_UP = -math.radians(60.0)
"""Unloaded angle below which the torque is constant behind the stretched position, not around it [rad]."""
RELATIVE_SIZES = (0.99, 0.8)
"""Sizes of linkages for a torque over the largest that fits the envelope; smaller ones leave room for wider springs."""
MAX_TORQUE_RATIO = 4.0
"""Torque that springs can hold by the bound over the one required, above which more of it says nothing."""
FLAT_DEVIATION_SHARE, MAX_DEVIATION_SHARE = 0.45, 0.25
"""Deviation over the ripple required that is flat enough: up to it springs for a torque are left out, and those for a
force stay in the first window and the envelope; and the largest deviation that is worth a look."""
MIN_TORQUE_SHARE = 0.9
"""Of the torque required: linkages whose springs hold less by the bound are not designed; it knows some places only."""
LINK_SHARES = (1.0 / 12.0, 1.0 / 9.0, 1.0 / 7.0, 1.0 / 5.5, 1.0 / 4.5)
"""Thickness of links with springs at their pins over the depth required: three quarters to a third are left for the
springs."""
SLIDING_FRICTION = 0.1
"""Friction of plain pins and of a plain guide where none is stated: greased steel, or dry POM on steel; assumed."""
ACROSS_SHARE = 0.6  # load across the guide over the force along it, about: the coupler is inclined
PIN_IN_COIL = 0.9
"""Largest diameter of a pin over the inner one of a torsion spring around it, wound up: makers leave a tenth."""
"""What finishes linkages with springs at their pins."""


def propose_turned_linkages(request: Request) -> FamilyOffer:
    """Return linkages for a torque at their crank, those whose springs can hold most of it first; or why none can."""
    if (reason := explain_overfilled(request)) is not None:
        return FamilyOffer(reason=reason)
    offers = [
        _offer_turned(request, size, proportions) for size in RELATIVE_SIZES for proportions in TORQUE_PROPORTIONS
    ]
    candidates = sorted((offer for offer in offers if isinstance(offer, Candidate)), key=lambda offer: offer.promise)
    if candidates:
        return FamilyOffer(tuple(candidates))
    return FamilyOffer(reason=_too_weak(request, max(offer for offer in offers if isinstance(offer, float))))


def _too_weak(request: Request, most: float) -> str:
    """Return what is wrong where no springs hold the torque."""
    if not most > 0.0:
        return (
            f"no springs turn a crank in one direction over {deg(request.travel)}: it would pass the stretched or "
            "folded position"
        )
    reported = format_short(most, "torque", 2)
    return f"springs of steel wire that fit at the pins hold at most {reported} over this angle"


def explain_overfilled(request: Request) -> str | None:
    """Return what is wrong where springs at pins would fill more than the envelope, taken as deep as it is wide."""
    thin = HelicalTorsionSpring(1e-3, MAX_INDEX * 1e-3, 1.0)
    stress = float(32.0 * largest_load(thin, request.safety) / (math.pi * thin.wire**3))
    wire = 8.0 * YOUNGS_MODULUS * request.target * request.travel / stress**2
    deep = wire / (request.envelope[0] * request.envelope[1])
    if deep <= (request.depth or max(request.envelope[:2])):
        return None
    return f"the wire of steel springs for this work would fill the envelope to a depth of {mm(deep)}"


def _offer_turned(request: Request, share: float, linkage: tuple[float, float, float, float]) -> Candidate | float:
    """Return a linkage that turns as required around its stretched position, a share of what fits the envelope.

    Or the largest torque that springs can hold, where that is less than what is required [N m].
    """
    crank, coupler, offset, unloaded = linkage
    low = math.radians(unloaded)
    within = _angle_range(request, low)
    angles = np.linspace(low, within[1], 181)
    y = crank * np.sin(angles)
    inside = coupler**2 - (offset - y) ** 2
    if (inside <= 0.0).any():
        return 0.0
    x = np.concatenate([[0.0], crank * np.cos(angles), crank * np.cos(angles) + np.sqrt(inside)])
    sides = np.ptp(x) + 2.0 * EYE_SHARE * crank, np.ptp(np.concatenate([[0.0, offset], y])) + 2.0 * EYE_SHARE * crank
    size = share * min(max(request.envelope[:2]) / max(sides), min(request.envelope[:2]) / min(sides))
    link = Linkage(crank * size, coupler * size, offset * size)
    most = largest_effort(_turning(request, link, low))
    if most < MIN_TORQUE_SHARE * request.low:
        return most
    mechanism = {"crank_length": link.crank, "coupler_length": link.coupler, "offset": link.offset}
    return Candidate(
        "springs at pins",
        _unsprung(mechanism | {"unloaded_angle": low}, {"angle": (low, within[1]), "points": 961}),
        finish=finish,
        promise=-min(most / request.target, MAX_TORQUE_RATIO),
        springs="custom",
    )


def _unsprung(mechanism: dict[str, Any], analysis: dict[str, Any]) -> SliderCrankSpec:
    """Return a linkage that is to be given springs."""
    data = {"family": "slider-crank", "name": "suggested", "mechanism": mechanism, "analysis": analysis}
    return SliderCrankSpec.model_validate(data)


def _angle_range(request: Request, unloaded: float) -> tuple[float, float]:
    """Return between which crank angles a torque may be held [rad]."""
    if unloaded > WOUND_UP:
        return unloaded, unloaded + max(3.0 * request.travel, math.radians(20.0))
    return 0.0, max(1.6 * request.travel, math.radians(60.0))


def _turning(request: Request, link: Linkage, unloaded: float, sheet: float | None = None) -> SprungMotion:
    """Return what springs have to do at the joints of a linkage: up to half a turn from where they are relaxed."""
    low, high = _angle_range(request, unloaded)
    ends = low, min(high, unloaded + math.pi)
    return _sprung(
        request, TurnedCrank(link, unloaded, np.zeros(len(JOINT_NAMES))), ends, min(link.crank, link.coupler), sheet
    )


def _sprung(
    request: Request, assembly: Assembly, ends: tuple[float, float], widest: float, sheet: float | None = None
) -> SprungMotion:
    """Return what springs have to do where the effort may be held between two ends of the motion."""
    deep = depth_of_springs(request, sheets_of_links(request)[0] if sheet is None else sheet)
    return SprungMotion(assembly, *ends, request.travel, widest, deep, request.depth is not None, request.safety)


def depth_of_springs(request: Request, sheet: float) -> float:
    """Return how far springs may stand out from links of a sheet [m], on both sides of them together [m]."""
    if request.depth is None:
        return max(request.envelope[:2])
    return request.depth - N_SHEETS * sheet - _slider_excess(request, sheet)


def _slider_excess(request: Request, sheet: float) -> float:
    """Return about how much thicker than a link a slider around its rods is [m]."""
    longest = max(request.envelope[:2])
    pushed = request.kind == "force"
    force, travel = (request.target, request.travel) if pushed else (request.target / (0.25 * longest), 0.5 * longest)
    strength = PartStrength.from_material(None, request.safety)
    rods = guide_rods(2, ACROSS_SHARE * force, force, travel, 0.1 * longest, None, None, strength)
    return max(rods.slider_thickness - sheet, 0.0)


def _pushed_motions(spec: SliderCrankSpec, request: Request, sheet: float | None = None) -> list[SprungMotion]:
    """Return what springs have to do at the pins of a linkage that is pushed, what is wanted most first.

    A window at the beginning of the travel: there the springs turn least. Torsion springs that stay in the envelope
    even where there are two of the widest, then those that stand beside each other.
    """
    assembly = assemble(spec)
    link = assembly.linkage
    # between which travels a force may be held, by the analysis of the candidate
    first, last = (float(end) for end in spec.analysis.window or (0.0, 0.0))
    ends = assembly.units(np.array([0.0, last]))
    high = max(link.offset, *(link.crank * np.sin(ends.angle)))
    beside = min(link.crank, link.coupler)
    inside = min(beside, request.envelope[0] - high, request.envelope[1] - float(ends.position[0]))
    windows = (first, first + request.travel), (first, last)
    return [
        _sprung(request, assembly, window, wide, sheet) for wide in (inside, beside) for window in windows if wide > 0.0
    ]


def sheets_of_links(request: Request) -> tuple[float, ...]:
    """Return of which sheets links may be that have springs at their pins, the thinnest first [m].

    Shares of the depth required; where depth does not matter, shares of the envelope's shorter side. Of a material
    with a series of sheets that begins below the first share all of the series up to the last.
    """
    deep = 0.5 * min(request.envelope[:2]) if request.depth is None else request.depth
    shares = [max(float(f"{share * deep:.2g}"), request.thinnest) for share in LINK_SHARES]
    materials = request.materials or ({"name": "steel-s235"},)
    named = (series_of("sheet", "metric", block.get("name")) for block in materials)
    sold = [size for series in named if series is not None for size in series.sizes if size >= request.thinnest]
    first = max((size for size in sold if size <= shares[0]), default=None)
    return tuple(dict.fromkeys(shares if first is None else (size for size in sold if first <= size <= shares[-1])))


def finish(spec: SliderCrankSpec, request: Request) -> SliderCrankSpec:
    """Return a linkage with the springs that hold the torque or the force best, and with links that bear them.

    The window is as long as is required. The thinnest links that bear the springs' loads are taken: thicker ones leave
    less depth for the springs.

    Raises SolutionError if no springs that fit come near it, or no links bear them.
    """
    sprung, reason, least = None, "", 0.0
    materials = request.materials or ({"name": "steel-s235"},)
    for sheet in sheets_of_links(request):
        if sheet < least:
            continue
        if sprung is None or request.depth is not None:  # where depth does not matter, the same springs fit
            try:
                sprung = _with_springs(spec.replace({"mechanism.part.sheet": sheet}), request, sheet)
            except SolutionError as problem:
                raise SolutionError(reason or str(problem)) from None
        sprung = sprung.replace({"mechanism.part.sheet": sheet})
        for block in materials:
            linked = with_links(sprung, request, block)
            if linked is not None:
                return linked
        least = min(_least_sheet(sprung, request, block) for block in materials)
        reason = f"links neither bear the loads of the springs nor stay straight under them: {mm(least)} thick at least"
    raise SolutionError(reason)


def _with_springs(spec: SliderCrankSpec, request: Request, sheet: float) -> SliderCrankSpec:
    """Return a linkage with the springs that hold the torque or the force best, wound beside links of a sheet [m]."""
    held = _find_springs(spec, request, sheet)
    if held is None or held.deviation > MAX_DEVIATION_SHARE:
        off = "" if held is None else f" nearer than {percent(held.deviation)}"
        raise SolutionError(f"no springs of steel wire that fit at the pins hold this {request.kind}{off}")
    name, dimension = ("angle", "angle") if request.kind == "torque" else ("travel", "length")
    start = float(spec.mechanism.unloaded_angle or 0.0) if request.kind == "torque" else 0.0
    window = held.begin, held.begin + request.travel * (1.0 + 1e-6)
    # the motion is up to the window's end: what the linkage could do beyond it needs no room
    motion = min(start, window[0]), window[1]
    sprung = spec.replace(
        {
            "mechanism.springs": dict(zip(JOINT_NAMES, held.rates.tolist(), strict=True)),
            "analysis.window": tuple(Place(end, dimension) for end in window),
            f"analysis.{name}": motion,
            f"analysis.reference_{name}": 0.5 * sum(window),
        }
    )
    return add_custom_springs(sprung, request)


def with_links(spec: SliderCrankSpec, request: Request, block: MaterialBlock) -> SliderCrankSpec | None:
    """Return a linkage whose links and pins bear its springs, of a material; None if there are none of its sheet.

    Where hysteresis is required, pins and guide rub.
    """
    material, sheet = MaterialSpec.model_validate(dict(block)), spec.mechanism.part.sheet  # type: ignore[union-attr]
    allowable = material.allowable(1.0)
    if allowable is None or sheet is None:
        return None
    loads = _loads(spec)
    widest = min((_hole_of_coil(spec, name, loads_of) for name, loads_of in _turns_of(spec).items()), default=np.inf)
    from_material = PartStrength.from_material(material, request.safety)
    strength = replace(from_material, allowable=min(request.allowed_stress_share * allowable, from_material.allowable))
    link = links_that_bear(loads, sheet, strength, request.thinnest, widest)
    if link is None:
        return None
    changes: dict[str, Any] = {
        "mechanism.material": dict(block), "mechanism.links.width": link.width, "mechanism.pins.diameter": link.hole,
    }  # fmt: skip
    if request.hysteresis is not None:
        changes |= {"mechanism.pins.friction": SLIDING_FRICTION, "mechanism.guide.friction": SLIDING_FRICTION}
    return spec.replace(changes)


def _assemble_with_motion(spec: SliderCrankSpec) -> tuple[Assembly, float, float]:
    """Return a linkage with its springs, and the ends of the motion of its analysis [rad or m]."""
    return assemble(spec), *(spec.analysis.travel or spec.analysis.angle or (0.0, 0.0))


def _loads(spec: SliderCrankSpec) -> LinkLoads:
    """Return what acts on the links over the motion of the analysis."""
    assembly, low, high = _assemble_with_motion(spec)
    return link_loads(assembly, grid_over(assembly, low, high), spec.mechanism.sets)


def _least_sheet(spec: SliderCrankSpec, request: Request, block: MaterialBlock) -> float:
    """Return how thick links of a material have to be at least, if they are as wide as they may be [m]."""
    material = MaterialSpec.model_validate(dict(block))
    allowable = material.allowable(1.0)
    if allowable is None:
        return math.inf
    return least_sheet(_loads(spec), material.modulus, request.allowed_stress_share * allowable)


def _turns_of(spec: SliderCrankSpec) -> dict[str, float]:
    """Return how far each torsion spring that is bought turns from where it is relaxed [rad]."""
    turns = MotionExtremes(*_assemble_with_motion(spec)).largest_turns[:3, 0].tolist()
    bought = {spring.at for spring in spec.mechanism.springs.bought}
    return {name: turn for name, turn in zip(JOINT_NAMES[:3], turns, strict=True) if name in bought}


def _hole_of_coil(spec: SliderCrankSpec, name: str, turn: float) -> float:
    """Return the largest pin that the torsion spring of a joint still turns around when wound up by a turn [m]."""
    return min(
        PIN_IN_COIL * (coil.coil * coil.turns / (coil.turns + turn / (2.0 * math.pi)) - coil.wire)
        for coil in spec.mechanism.springs.coils_at(name)
    )


def _find_springs(spec: SliderCrankSpec, request: Request, sheet: float) -> HeldEffort | None:
    """Return the springs and the window that hold the effort with the smallest deviation; None if no springs fit.

    For a force, candidate motions are tried in order up to the first that is flat enough, and only springs without
    which the deviation does not grow are dropped; for a torque as many as it takes to stay flat enough.
    """
    flat = FLAT_DEVIATION_SHARE * request.ripple
    if request.kind == "torque":
        turning = _turning(request, linkage_of(spec.mechanism), float(spec.mechanism.unloaded_angle or 0.0), sheet)
        return flattest_springs(turning, request.target, flat)
    best: HeldEffort | None = None
    for motion in _pushed_motions(spec, request, sheet):
        held = flattest_springs(motion, request.target, 0.0)
        if held is not None and (best is None or held.deviation < best.deviation):
            best = held
        if best is not None and best.deviation <= flat:
            break
    return best


def add_custom_springs(spec: SliderCrankSpec, request: Request) -> SliderCrankSpec:
    """Return a designed linkage with custom springs of steel wire, which bear its motion.

    A torsion spring is no wider than the crank, or the coupler, is long, so that those of two pins stand beside each
    other, and no deeper than the longer side of the envelope, or than what the links and those on their other side
    leave of its depth.

    Raises SolutionError if there is no such spring for a joint.
    """
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.springs.model import analyze

    solution = analyze(spec.replace({"design": None, "requirements": ()}), Run()).state
    if solution is None:
        return spec
    link, (high, low) = solution.assembly.linkage, (turns[:, 0] for turns in solution.extremes.turns)
    # a spring at the slider lies beside the coupler and is stretched by a slider that leaves the pivot
    rest = float(solution.assembly.units(np.array([solution.assembly.start])).position[0])
    widest, rates = min(link.crank, link.coupler), spec.mechanism.springs.rates
    turns = {JOINT_NAMES[k]: (rates[k], float(max(high[k], -low[k]))) for k in np.flatnonzero(rates)}
    pulled = JOINT_NAMES[3] not in turns or low[3] > -TRAVEL_RTOL * turns[JOINT_NAMES[3]][1]
    part, pin = spec.mechanism.part, spec.mechanism.pins.diameter if spec.mechanism.pins else 0.0
    deep = room = depth_of_springs(request, (part.sheet if part else None) or 0.0)
    if request.depth is not None and "pivot" in turns:
        # that of the pivot is on the other side of the links: first it takes as little as it can
        least = shortest_spring(HelicalTorsionSpring, *turns["pivot"], widest, request.safety, pin)
        deep = room - (0.0 if least is None else least.room_for(turns["pivot"][1]))
    bought: dict[str, HelicalSpring] = {}
    for name in sorted(turns, key="pivot".__eq__):
        if name == "pivot" and request.depth is not None:
            deep = room - max((height_of(joint, coil, turns[joint][1]) for joint, coil in bought.items()), default=0.0)
        if name == "slider":
            coil = slimmest_spring(ExtensionSpring, *turns[name], rest if pulled else 0.0, request.safety)
        else:
            coil = slimmest_spring(HelicalTorsionSpring, *turns[name], deep, request.safety, pin)
        if coil is None or coil.outer_diameter > (deep if name == "slider" else widest):
            raise SolutionError(_explain_no_spring(name, turns[name], coil))
        bought[name] = coil
    # the rates are those of the wires
    return spec.replace({"mechanism.springs": {"bought": [{"at": name, **as_stated(bought[name])} for name in turns]}})


def _explain_no_spring(name: str, turn: tuple[float, float], coil: HelicalSpring | None) -> str:
    joint = JOINTS_BY_NAME[name]
    reported = f"{format_short(turn[0], joint.rate, 3)} over {format_short(turn[1], joint.motion, 3)}"
    wide = "" if coil is None else f" is {mm(coil.outer_diameter)} wide"
    return f"no spring of steel wire fits at the {joint.words}: {reported}{wide}"


def propose_pushed_linkage(request: Request, lengths: Proportions, crank: float, first: float) -> Candidate | float:
    """Return a linkage with springs at its pins, for a force from some travel on.

    Or the largest force that springs can hold, where that is less than what is required [N].
    """
    mechanism = {
        "crank_length": crank,
        "stretched_position": lengths.stretched * crank,
        "offset": lengths.offset * crank,
    }
    spec = _unsprung(mechanism | {"unloaded_offset": 4e-4}, pushed_analysis((first, lengths.reach * crank)))
    most = 0.0
    for motion in _pushed_motions(spec, request):
        most = max(most, largest_effort(motion))
        if most >= MIN_TORQUE_SHARE * request.low:  # what more there is does not matter
            break
    else:
        return most
    return Candidate("springs at pins", spec, finish=finish, promise=rank_by_size(crank, request), springs="custom")


def pushed_analysis(travel: tuple[float, float]) -> dict[str, Any]:
    """Return the block `analysis` of a slider that is pushed up to the end of a window of its travel [m]."""
    return {
        "drive": "force", "travel": (0.0, travel[1]), "window": tuple(Place(end, "length") for end in travel),
        "points": 241,
    }  # fmt: skip


def rank_by_size(crank: float, request: Request) -> float:
    """Return how soon a size is tried: the largest first, which is the flattest and needs the least depth."""
    return -crank / request.envelope[1]
