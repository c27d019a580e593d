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

from cfmkit.families.findings import mm
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.outline import EYE_SHARE
from cfmkit.families.slider_crank.springs_wound_for_wish import wound
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.families.wishes import Candidate, FamilyOffer, called
from cfmkit.specs.units import Place
from cfmkit.stock.spec import MaterialSpec
from cfmkit.stock.springs.helical import YOUNGS_MODULUS, tensile_strength
from cfmkit.stock.springs.offers_and_generic_series import BENDING_SHARE

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
    found = [_turned(wish, size, one, JOINTS) for size in SHRUNK for one in TURNED]
    # of these the slider goes far: there may be no place for a spring that is stretched so much
    found += [_turned(wish, SHRUNK[0], one, JOINTS[:3]) for one in TURNED if math.radians(one[3]) < WOUND_UP]
    return FamilyOffer(tuple(one for one in found if one is not None))


def _overfilled(wish: Wish) -> str | None:
    """Return what is wrong where springs at pins would fill more than the room, taken as deep as it is wide."""
    wire = wish.target * wish.travel / ENERGY
    deep = wire / (wish.room[0] * wish.room[1])
    if deep <= (wish.depth or max(wish.room[:2])):
        return None
    return f"the wire of steel springs for this work would fill the room to a depth of {mm(deep)}"


def _turned(
    wish: Wish, share: float, linkage: tuple[float, float, float, float], springs: tuple[str, ...]
) -> Candidate | None:
    """Return a linkage that turns as much as is wished around its stretched position, a share of what fits the room."""
    crank, coupler, offset, unloaded = linkage
    low = math.radians(unloaded)
    within = (0.0, max(1.6 * wish.travel, math.radians(60.0)))
    if low > WOUND_UP:
        within = (low, low + max(3.0 * wish.travel, math.radians(20.0)))
    angles = np.linspace(low, within[1], 181)
    y = crank * np.sin(angles)
    inside = coupler**2 - (offset - y) ** 2
    if (inside <= 0.0).any():
        return None
    x = np.concatenate([[0.0], crank * np.cos(angles), crank * np.cos(angles) + np.sqrt(inside)])
    sides = np.ptp(x) + 2.0 * EYE_SHARE * crank, np.ptp(np.concatenate([[0.0, offset], y])) + 2.0 * EYE_SHARE * crank
    size = share * min(max(wish.room[:2]) / max(sides), min(wish.room[:2]) / min(sides))
    data = {
        "family": "slider-crank",
        "name": "suggested",
        "mechanism": {
            "crank_length": crank * size, "coupler_length": coupler * size, "offset": offset * size,
            "unloaded_angle": low, "springs": {}, **_plates(wish),
        },
        "design": {
            "torque": wish.target, "tolerance": min(0.45 * wish.ripple, 0.2),
            "angle_within": within, "springs": springs,
        },
        "analysis": {"angle": (low, within[1]), "points": 961},
    }  # fmt: skip
    spec = SliderCrankSpec.model_validate(data)
    return Candidate("springs at pins", spec, True, "cfmkit.families.slider_crank.proposals_for_wish:finish")


def _plates(wish: Wish) -> dict[str, Any]:
    """Return of which sheet links are, where their depth matters."""
    return {} if wish.depth is None else {"part": {"sheet": max(LINK_SHARE * wish.depth, wish.thinnest)}}


def finish(spec: SliderCrankSpec, wish: Wish) -> SliderCrankSpec:
    """Return a designed linkage that is judged over the middle of the window found, as long as the travel wished."""
    return wound(_in_middle(spec, wish), wish)


def _in_middle(spec: SliderCrankSpec, wish: Wish) -> SliderCrankSpec:
    """Return a designed linkage whose window is the middle of the one found, as long as the travel wished."""
    low, high = (float(end) for end in spec.analysis.window or (0.0, 0.0))
    name = "length" if wish.kind == "force" else "angle"
    spare = 0.5 * max(high - low - wish.travel * (1.0 + 1e-6), 0.0)
    window = low + spare, high - spare
    # the motion is the window: what the linkage could do outside of it needs no room
    keys = {"analysis.window": tuple(Place(end, name) for end in window), "design": None, "requirements": ()}
    start = spec.at("mechanism.unloaded_angle") if name == "angle" else 0.0
    ends = (min(start, window[0]), max(start, window[1]))
    return spec.replace(keys | {"analysis.angle" if name == "angle" else "analysis.travel": ends})


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
