"""From a wish to slider-cranks worth designing: kept proportions at the size that travel and room allow.

Lengths scale with one factor: angles, and the shape of the curve, stay. For springs at pins the rates follow from the
effort. For a strip the stress decides the thickness and the force the width, for flexures likewise; both are left to
the family's own design.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.findings import deg, mm, percent
from cfmkit.families.slider_crank.linkage import Linkage
from cfmkit.families.slider_crank.linkage_from_spec import linkage_of
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.outline import EYE_SHARE
from cfmkit.families.slider_crank.springs_wound_for_wish import depth_of_springs, wound
from cfmkit.families.slider_crank.torque_that_springs_carry import SprungMotion, flattest_springs, largest_torque
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.families.wishes import Candidate, FamilyOffer, called
from cfmkit.specs.units import Place, format_short
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.springs.helical import YOUNGS_MODULUS, tensile_strength
from cfmkit.stock.springs.offer_type_and_generic_series import BENDING_SHARE

if TYPE_CHECKING:
    from cfmkit.families.base import Run
    from cfmkit.families.wishes import Wish


@dataclass(frozen=True)
class Proportions:
    """A linkage over its crank's length, and what of its room is known.

    Attributes
    ----------
    stretched, offset : float
        Position of the stretched slider, and height of its way, over the crank's length.
    unloaded : float
        Crank angle with all springs relaxed [rad].
    reach : float
        Largest travel that is of use, over the crank's length.
    """

    stretched: float
    offset: float
    unloaded: float
    reach: float


PUSHED = (
    Proportions(100.0 / 54.0, 60.0 / 54.0, 0.542, 38.0 / 54.0),  # Bilancia, Geraci, Berselli 2019
    Proportions(1.6, 1.0, 0.56, 0.8),
    Proportions(2.4, 1.1, 0.43, 0.6),
)
"""For a force at the slider: the published lengths, and two linkages beside them, shorter and longer."""

STARTS = (0.04, 0.1)
"""Where the travel begins, over its length: before that the force of an elastic part comes up from zero."""

SIZES = (1.0, 0.8, 0.6, 0.42, 0.3)
"""Sizes that are tried, over the largest that the room allows."""

PADS = (0.031, 0.040)
"""What the pads at both ends of a printed part add across the slider's way and along it [m]: twice their length, and
the corners of the inclined one."""

PAIR_GAP = (0.1, 4e-3)
"""Between the parts of a mirrored pair: a share of one's height, and a length [m], as they are drawn."""

DOUBT = 3.0
"""So much wider than there is room for a part may seem: the estimate is of one proportion and one run-in."""

FLEXURES_WIDER = 8.0
"""About how much wider than a strip flexures of a tenth of its free length have to be."""

NODES = 5
"""Thicknesses of a tapered strip: more of them take longer and are hardly flatter."""

LATER = 10.0
"""Promise of what takes seconds to design, where everything else takes a part of one."""

FLEXURE = 0.2
"""Length of a flexure, over the crank's length, as in Bilancia, Geraci, Berselli 2019."""

TURNED = (
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

SHRUNK = (0.99, 0.8)
"""Sizes of linkages for a torque, over the largest that the room allows: smaller ones leave room for wider springs."""

ENERGY = (BENDING_SHARE * tensile_strength(1e-3)) ** 2 / (8.0 * YOUNGS_MODULUS)
"""What round wire in bending holds at most, over its volume [J/m^3]."""

STRONG = 4.0
"""Torque that springs can hold by the bound over the one wished, above which more of it says nothing."""

FLAT, HOPELESS = 0.45, 0.25
"""Deviation over the ripple wished up to which springs are left out; largest one of a torque that is worth a look."""

WEAK = 0.9
"""Of the torque wished: linkages whose springs hold less by the bound are not designed; it knows some places only."""

LINK_SHARE = 1.0 / 12.0
"""Thickness of links with springs at their pins over the depth wished: three quarters are left for the springs."""

OFFERED = 24

PART = "cfmkit.families.slider_crank.proposals_for_wish:part"
"""What finishes the parts of one piece."""

WOUND = "cfmkit.families.slider_crank.springs_wound_for_wish:wound"
"""What finishes linkages with springs."""


def propose(wish: Wish, run: Run) -> FamilyOffer:
    """Return linkages at sizes that fit the room, to be given springs, flexures or a strip by the family's design."""
    return _of_torque(wish) if wish.kind == "torque" else _of_force(wish)


def _of_torque(wish: Wish) -> FamilyOffer:
    if (reason := _overfilled(wish)) is not None:
        return FamilyOffer(reason=reason)
    found = [_turned(wish, size, one) for size in SHRUNK for one in TURNED]
    candidates = sorted((one for one in found if isinstance(one, Candidate)), key=lambda one: one.promise)
    if candidates:
        return FamilyOffer(tuple(candidates))
    return FamilyOffer(reason=_too_weak(wish, max(one for one in found if isinstance(one, float))))


def _too_weak(wish: Wish, most: float) -> str:
    """Return what is wrong where no springs hold the torque."""
    if not most > 0.0:
        return f"springs drive no crank one way over {deg(wish.travel)}: it would pass where it is stretched or folded"
    reported = format_short(most, "torque", 2)
    return f"springs of steel wire that fit at the pins hold at most {reported} over this angle"


def _overfilled(wish: Wish) -> str | None:
    """Return what is wrong where springs at pins would fill more than the room, taken as deep as it is wide."""
    wire = wish.target * wish.travel / ENERGY
    deep = wire / (wish.room[0] * wish.room[1])
    if deep <= (wish.depth or max(wish.room[:2])):
        return None
    return f"the wire of steel springs for this work would fill the room to a depth of {mm(deep)}"


def _turned(wish: Wish, share: float, linkage: tuple[float, float, float, float]) -> Candidate | float:
    """Return a linkage that turns as much as is wished around its stretched position, a share of what fits the room.

    Or the largest torque that springs can hold, where that is less than what is wished [N m].
    """
    crank, coupler, offset, unloaded = linkage
    low = math.radians(unloaded)
    within = _within(wish, low)
    angles = np.linspace(low, within[1], 181)
    y = crank * np.sin(angles)
    inside = coupler**2 - (offset - y) ** 2
    if (inside <= 0.0).any():
        return 0.0
    x = np.concatenate([[0.0], crank * np.cos(angles), crank * np.cos(angles) + np.sqrt(inside)])
    sides = np.ptp(x) + 2.0 * EYE_SHARE * crank, np.ptp(np.concatenate([[0.0, offset], y])) + 2.0 * EYE_SHARE * crank
    size = share * min(max(wish.room[:2]) / max(sides), min(wish.room[:2]) / min(sides))
    link = Linkage(crank * size, coupler * size, offset * size)
    most = largest_torque(_motion(wish, link, low))
    if most < WEAK * wish.low:
        return most
    data = {
        "family": "slider-crank",
        "name": "suggested",
        "mechanism": {
            "crank_length": link.crank, "coupler_length": link.coupler, "offset": link.offset,
            "unloaded_angle": low, "springs": {}, **_plates(wish),
        },
        "analysis": {"angle": (low, within[1]), "points": 961},
    }  # fmt: skip
    spec = SliderCrankSpec.model_validate(data)
    done = "cfmkit.families.slider_crank.proposals_for_wish:finish"
    return Candidate("springs at pins", spec, finish=done, promise=-min(most / wish.target, STRONG))


def _within(wish: Wish, unloaded: float) -> tuple[float, float]:
    """Return between which crank angles a torque may be held [rad]."""
    if unloaded > WOUND_UP:
        return unloaded, unloaded + max(3.0 * wish.travel, math.radians(20.0))
    return 0.0, max(1.6 * wish.travel, math.radians(60.0))


def _motion(wish: Wish, link: Linkage, unloaded: float) -> SprungMotion:
    """Return what springs have to do at the joints of a linkage: up to half a turn from where they are relaxed."""
    low, high = _within(wish, unloaded)
    deep = depth_of_springs(wish, thickness_of_links(wish))
    return SprungMotion(
        link, unloaded, low, min(high, unloaded + math.pi), wish.travel, deep, shared=wish.depth is not None
    )


def _plates(wish: Wish) -> dict[str, Any]:
    """Return of which sheet links are, where their depth matters."""
    return {} if wish.depth is None else {"part": {"sheet": thickness_of_links(wish)}}


def thickness_of_links(wish: Wish) -> float:
    """Return how thick the links of springs at pins are [m]; zero where their depth does not matter."""
    return 0.0 if wish.depth is None else max(LINK_SHARE * wish.depth, wish.thinnest)


def finish(spec: SliderCrankSpec, wish: Wish) -> SliderCrankSpec:
    """Return a linkage for a torque with the springs that hold it best, over a window as long as the angle wished.

    Raises
    ------
    cfmkit.errors.SolutionError
        If no springs that fit come near it.
    """
    unloaded = float(spec.mechanism.unloaded_angle or 0.0)
    held = flattest_springs(_motion(wish, linkage_of(spec.mechanism), unloaded), wish.target, FLAT * wish.ripple)
    if held is None or held.deviation > HOPELESS:
        off = "" if held is None else f" nearer than {percent(held.deviation)}"
        raise SolutionError(f"no springs of steel wire that fit at the pins hold this torque{off}")
    window = held.begin, held.begin + wish.travel * (1.0 + 1e-6)
    # the motion is up to the window's end: what the linkage could do beyond it needs no room
    motion = min(unloaded, window[0]), window[1]
    sprung = spec.replace(
        {
            "mechanism.springs": dict(zip(JOINTS, held.rates.tolist(), strict=True)),
            "analysis.window": tuple(Place(end, "angle") for end in window),
            "analysis.angle": motion,
            "analysis.reference_angle": 0.5 * sum(window),
        }
    )
    return wound(sprung, wish)


def _of_force(wish: Wish) -> FamilyOffer:
    if wish.adjustable is not None:
        return FamilyOffer(reason="the force of a slider-crank is fixed by its springs and cannot be adjusted")
    found = [one for lengths in PUSHED for one in _pushed(wish, lengths)]
    if found:
        return FamilyOffer(tuple(_varied(found)))
    fits = [printed_size(wish, lengths) for lengths in PUSHED]
    wide = min((strip_width(wish, block, one) for one in fits if one > 0 for block in _materials(wish)), default=0.0)
    if wide > DOUBT * (wish.depth or max(wish.room)):
        return FamilyOffer(reason=f"a strip would have to be about {mm(wide)} wide")
    if (reason := _overfilled(wish)) is not None:
        return FamilyOffer(reason=reason)
    need = _room_for(wish, PUSHED[0], wish.travel * (1.0 + STARTS[0]) / PUSHED[0].reach, pads=wish.depth is not None)
    return FamilyOffer(reason=f"a linkage for this travel needs {mm(need[0])} across it and {mm(need[1])} along it")


def _room_for(wish: Wish, lengths: Proportions, crank: float, pads: bool) -> tuple[float, float]:
    """Return the room that a linkage needs across and along the slider's way [m]."""
    pin = crank * np.sin(lengths.unloaded)
    across = max(lengths.offset * crank, pin) + PADS[0] * pads + 2.0 * EYE_SHARE * crank * (not pads)
    along = lengths.stretched * crank + PADS[1] * pads + 2.0 * EYE_SHARE * crank * (not pads)
    return float(across), float(along)


def printed_size(wish: Wish, lengths: Proportions) -> float:
    """Return the crank's length of the largest part that fits the room [m]; not above zero where the pads do not."""
    return min((wish.room[0] - PADS[0]) / lengths.offset, (wish.room[1] - PADS[1]) / lengths.stretched)


def _pushed(wish: Wish, lengths: Proportions) -> list[Candidate]:
    """Return parts and linkages of some proportions at all sizes that fit."""
    printed = printed_size(wish, lengths)
    pinned = min(wish.room[0] / (lengths.offset + 2 * EYE_SHARE), wish.room[1] / (lengths.stretched + 2 * EYE_SHARE))
    pins = _overfilled(wish) is None
    found = []
    for size in SIZES:
        for start in STARTS:
            travel = start * wish.travel, (1.0 + start) * wish.travel * (1.0 + 1e-6)
            if travel[1] <= lengths.reach * size * printed:
                found += _parts(wish, lengths, size * printed, travel, (size in SIZES[:2], start == STARTS[-1]))
            pair = size * pair_size(wish, lengths)
            if travel[1] <= lengths.reach * pair:
                found += _pairs(wish, lengths, pair, travel)
            if travel[1] <= lengths.reach * size * pinned and pins and start == STARTS[0]:
                found.append(_springs(wish, lengths, size * pinned, travel))
    return found


def _parts(
    wish: Wish, lengths: Proportions, crank: float, travel: tuple[float, float], more: tuple[bool, bool]
) -> list[Candidate]:
    """Return the parts of one size that are not much wider than there is room for; `more`: large ones, late starts."""
    deep = wish.depth or max(wish.room)
    found = []
    for block in _materials(wish):
        wide = strip_width(wish, block, crank)
        if wide <= DOUBT * deep:
            found.append(_strip(wish, block, lengths, crank, travel))
        if more[0] and FLEXURES_WIDER * wide <= DOUBT * deep:
            found.append(_flexures(wish, block, lengths, crank, travel))
        if all(more) and wide <= DOUBT * deep:
            found.append(_tapered(wish, block, lengths, crank, travel))
    return found


def pair_size(wish: Wish, lengths: Proportions) -> float:
    """Return the crank's length of the largest mirrored pair that fits the room [m]: two heights and a gap."""
    one = (wish.room[0] - PAIR_GAP[1]) / (2.0 + PAIR_GAP[0])
    return min((one - PADS[0]) / lengths.offset, (wish.room[1] - PADS[1]) / lengths.stretched)


def _pairs(wish: Wish, lengths: Proportions, crank: float, travel: tuple[float, float]) -> list[Candidate]:
    """Return mirrored pairs of strips, each half as wide as one strip; the guide of the slider carries nothing."""
    found = []
    for block in _materials(wish):
        if 0.5 * strip_width(wish, block, crank) <= DOUBT * (wish.depth or max(wish.room)):
            plain = _strip(wish, block, lengths, crank, travel)
            spec = plain.spec.replace({"mechanism.copies": "mirrored"})
            found.append(replace(plain, variant=plain.variant.replace("strip", "pair of strips"), spec=spec))
    return found


def strip_width(wish: Wish, block: dict[str, Any], crank: float) -> float:
    """Return about how wide a strip has to be [m]: scaled from one of ABS, 1.5 N over 34 mm with a crank of 54 mm.

    The curvature is as the travel over the square of the crank's length; the stress gives the thickness, and the force
    is as width, modulus, cube of the thickness and curvature over the length.
    """
    material = MaterialSpec.model_validate(block)
    strength = material.allowable(1.0)
    if strength is None:
        return math.inf
    size, way = crank / 0.054, wish.travel / 0.034
    stiffer = material.modulus / 1.8e9
    thicker = strength / 42.5e6 / stiffer * size**2 / way
    return 0.005138 * (wish.target / 1.5) * size**3 / (stiffer * thicker**3 * way)


def _varied(found: list[Candidate]) -> list[Candidate]:
    """Return as many candidates as are offered, of different kinds by turns; what takes long to design comes last."""
    kinds = list(dict.fromkeys(one.variant for one in found))
    rows = [sorted((one for one in found if one.variant == kind), key=lambda one: one.promise) for kind in kinds]
    longest = max(map(len, rows))
    by_turns = [row[k] for k in range(longest) for row in rows if k < len(row)]
    # cut before what takes long goes to the end, or none of that would be left
    return sorted(by_turns[:OFFERED], key=lambda one: one.promise >= LATER)


def _materials(wish: Wish) -> list[dict[str, Any]]:
    return [dict(block) for block in wish.materials] or [{"name": "pom"}]


def _mechanism(lengths: Proportions, crank: float) -> dict[str, Any]:
    return {
        "crank_length": crank, "stretched_position": lengths.stretched * crank, "offset": lengths.offset * crank,
        "unloaded_angle": lengths.unloaded,
    }  # fmt: skip


def _rank(crank: float, wish: Wish) -> float:
    """Return how soon a size is tried: the largest first, which is the flattest and needs the least depth."""
    return -crank / wish.room[1]


def _analysis(travel: tuple[float, float]) -> dict[str, Any]:
    return {
        "drive": "force", "travel": (0.0, travel[1]), "window": tuple(Place(end, "length") for end in travel),
        "points": 241,
    }  # fmt: skip


def _strip(
    wish: Wish, material: dict[str, Any], lengths: Proportions, crank: float, travel: tuple[float, float]
) -> Candidate:
    """Return a strip of one thickness, to be sized by stress and force."""
    thick, wide = (wish.thinnest, 0.1 * crank), (wish.thinnest, wish.depth or crank)
    data = {
        "family": "slider-crank",
        "name": "suggested",
        "mechanism": {
            **_mechanism(lengths, crank), "material": material, "safety_factor": 1.01 / wish.strength_used,
            "beam": {"width": wide[1], "thickness": 0.02 * crank},
        },
        "design": {
            "force": wish.target, "travel": travel,
            "beam": {"shape": "uniform", "goal": "ripple", "width": wide, "thickness": thick},
        },
        "analysis": _analysis(travel),
    }  # fmt: skip
    spec = SliderCrankSpec.model_validate(data)
    return Candidate(
        called("strip", wish, material),
        spec,
        True,
        PART,
        _rank(crank, wish),
    )


def _tapered(
    wish: Wish, material: dict[str, Any], lengths: Proportions, crank: float, travel: tuple[float, float]
) -> Candidate:
    """Return a strip of varying thickness, to be searched for the flattest force."""
    plain = _strip(wish, material, lengths, crank, travel)
    thick = (max(wish.thinnest, 0.005 * crank), 0.05 * crank)
    wide = plain.spec.design.beam.width  # type: ignore[attr-defined]
    shape = {"shape": "even", "nodes": NODES, "goal": "ripple", "width": wide, "thickness": thick}
    spec = plain.spec.replace({"design.beam": shape})
    return Candidate(
        called("tapered strip", wish, material), spec, True, plain.finish, LATER + abs(crank / wish.room[1] - 0.35)
    )


def _flexures(
    wish: Wish, material: dict[str, Any], lengths: Proportions, crank: float, travel: tuple[float, float]
) -> Candidate:
    """Return a chain of links and flexures: first the springs for the force, then flexures of that stiffness."""
    scale = crank / 0.054
    rate = wish.target / 1.5 * scale
    long = FLEXURE * crank
    thick = 0.09 * long
    one = {"length": long, "thickness": thick, "width": 2.0 * thick}
    # rates per rad grow with force times length; those of Bilancia et al. 2019 are for 1.5 N at 54 mm
    springs = {"pivot": 0.028303 * rate, "crank_pin": 0.035379 * rate, "slider_pin": 0.035379 * rate}
    data = {
        "family": "slider-crank",
        "name": "suggested",
        "mechanism": {
            **_mechanism(lengths, crank), "material": material, "safety_factor": 1.01 / wish.strength_used,
            "springs": springs,
            "flexures": {"pivot": one, "crank_pin": one, "slider_pin": one},
        },
        "design": {"force": wish.target, "travel": (0.0, travel[1]), "flexures": {}},
        "analysis": _analysis(travel),
    }  # fmt: skip
    spec = SliderCrankSpec.model_validate(data)
    return Candidate(
        called("flexures", wish, material),
        spec,
        True,
        PART,
        _rank(crank, wish),
    )


def part(spec: SliderCrankSpec, wish: Wish) -> SliderCrankSpec:
    """Return a designed part whose widths, in which force is linear, give exactly the mean that is wished."""
    from cfmkit.families.base import Run
    from cfmkit.families.slider_crank.printed.model import analyze

    made = spec.replace({"design": None, "requirements": (), "mechanism.safety_factor": 1.0})
    result = analyze(made, Run())
    if not result.curves:
        return made
    low, high = (float(end) for end in made.analysis.window or (0.0, 0.0))
    inside = (result.curve.motion >= low) & (result.curve.motion <= high)
    mean = float(np.mean(result.curve.effort[inside])) if inside.any() else 0.0
    if not mean > 0.0:
        return made
    factor = wish.target / mean
    if made.fidelity == "beam" and made.mechanism.beam is not None:
        return made.replace({"mechanism.beam.width": made.mechanism.beam.width * factor})
    names = ("pivot", "crank_pin", "slider_pin")
    parts = {name: getattr(made.mechanism.flexures, name).width * factor for name in names}
    return made.replace({f"mechanism.flexures.{name}.width": width for name, width in parts.items()})


def _springs(wish: Wish, lengths: Proportions, crank: float, travel: tuple[float, float]) -> Candidate:
    """Return a linkage with springs at its pins, the flattest that there are."""
    data = {
        "family": "slider-crank",
        "name": "suggested",
        "mechanism": {
            "crank_length": crank, "stretched_position": lengths.stretched * crank, "offset": lengths.offset * crank,
            "unloaded_offset": 4e-4, "springs": {}, **_plates(wish),
        },
        "design": {"force": wish.target, "travel": travel, "springs": ("pivot", "crank_pin", "slider_pin")},
        "analysis": _analysis(travel),
    }  # fmt: skip
    spec = SliderCrankSpec.model_validate(data)
    return Candidate("springs at pins", spec, True, WOUND, _rank(crank, wish))
