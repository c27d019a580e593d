"""Springs for the joints of a linkage that was designed for a wish: wound to measure, within the wish's room."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.findings import mm
from cfmkit.families.slider_crank.bounding_box import PLATES, height_of
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.specs.units import format_short
from cfmkit.stock.springs.made_to_measure import extension_spring, shortest_torsion_spring, torsion_spring

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.wishes import Wish
    from cfmkit.stock.springs.helical_spring_formulas import Wound

STILL = 1e-9
"""Share of the slider's travel that is none."""


def wound(spec: SliderCrankSpec, wish: Wish) -> SliderCrankSpec:
    """Return a designed linkage with springs wound to measure of steel wire, which bear its motion.

    A torsion spring is no wider than the crank, or the coupler, is long, so that those of two pins stand beside each
    other, and no deeper than the longer side of the room, or than what the links and those on their other side leave of
    its depth.

    Raises
    ------
    cfmkit.errors.SolutionError
        If there is no such spring for a joint.
    """
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.springs.model import analyze

    solution = analyze(spec.replace({"design": None, "requirements": ()}), Run()).state
    if solution is None:
        return spec
    link, (high, low) = solution.assembly.linkage, solution.extremes.turns
    # a spring at the slider lies beside the coupler and is stretched by a slider that leaves the pivot
    rest = float(solution.assembly.units(np.array([solution.assembly.start])).position[0])
    widest, rates = min(link.crank, link.coupler), spec.mechanism.springs.rates
    turns = {JOINTS[k]: (rates[k], float(max(high[k], -low[k]))) for k in np.flatnonzero(rates)}
    pulled = JOINTS[3] not in turns or low[3] > -STILL * turns[JOINTS[3]][1]
    part = spec.mechanism.part
    deep = room = depth_of_springs(wish, (part.sheet if part else None) or 0.0)
    if wish.depth is not None and "pivot" in turns:
        # that of the pivot is on the other side of the links: first it takes as little as it can
        least = shortest_torsion_spring(*turns["pivot"], widest)
        deep = room - (0.0 if least is None else least.body_length)
    bought: dict[str, Wound] = {}
    for name in sorted(turns, key="pivot".__eq__):
        if name == "pivot" and wish.depth is not None:
            deep = room - max((height_of(other, coil) for other, coil in bought.items()), default=0.0)
        coil = _coil(name, turns[name], deep, rest if pulled else 0.0)
        if coil is None or coil.outer_diameter > (deep if name == "slider" else widest):
            raise SolutionError(_no_spring(name, turns[name], coil))
        bought[name] = coil
    return spec.replace({"mechanism.springs.bought": tuple(_wound_to_measure(name, bought[name]) for name in turns)})


def _coil(name: str, turn: tuple[float, float], deep: float, rest: float) -> Wound | None:
    """Return the slimmest spring of a rate for a joint that can be turned, or stretched from its rest, so far."""
    return extension_spring(*turn, rest) if name == "slider" else torsion_spring(*turn, deep)


def _no_spring(name: str, turn: tuple[float, float], coil: Wound | None) -> str:
    dimension, way = ("stiffness", "length") if name == "slider" else ("rotational_stiffness", "angle")
    reported = f"{format_short(turn[0], dimension, 3)} over {format_short(turn[1], way, 3)}"
    wide = "" if coil is None else f" is {mm(coil.outer_diameter)} wide"
    return f"no spring of steel wire fits at the {name.replace('_', ' ')}: {reported}{wide}"


def _wound_to_measure(name: str, coil: Wound) -> dict[str, Any]:
    reported = f"wound to measure, wire {mm(coil.wire)}, coil {mm(coil.coil)}, {coil.turns:.3g} turns"
    return {"at": name, "name": reported, "wound": {"wire": coil.wire, "coil": coil.coil, "turns": coil.turns}}


def depth_of_springs(wish: Wish, sheet: float) -> float:
    """Return how far springs may stand out from links of a sheet [m], on both sides of them together [m]."""
    return max(wish.room[:2]) if wish.depth is None else wish.depth - PLATES * sheet
