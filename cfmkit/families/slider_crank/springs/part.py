"""Geometry of a slider-crank with springs over its motion: links with eyes at their pins, and springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.posed_part import PosedBody, PosedPart
from cfmkit.families.slider_crank.springs.hardware import hardware, joints
from cfmkit.families.slider_crank.springs.outline import eye_and_hole
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.hardware import Hardware
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.families.slider_crank.springs.spec import Springs
    from cfmkit.families.slider_crank.unit_springs import UnitCurves
    from cfmkit.results import Result
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring

N_SHEETS = 3  # sheets above each other: crank, coupler, and the ground that carries the pivot and the slider's path


def part_over_motion(result: Result) -> PosedPart:
    """Return links and pins, and springs whose wire is known, over the motion of the curve."""
    spec: Any = result.spec
    solution: Solution = result.state
    rates = solution.assembly.rates
    joining = hardware(spec, solution)
    depth, why = _depth(spec, rates, solution.extremes.largest_turns[:, 0], joining)
    return PosedPart(
        (*bodies(spec, solution, solution.unit_spring_curves), *joining.bodies),
        direction=0.0,
        depth=depth,
        pieces=3 + _count_springs(spec.mechanism.springs, rates),
        assumed=f"links {2e3 * eye_and_hole(spec)[0]:.3g} mm wide; {_describe_coils(spec.mechanism.springs)}{why}",
        rubbing=joining.rubbing,
        faults=joining.faults,
    )


def _count_springs(springs: Springs, rates: FloatArray) -> int:
    """Return how many springs there are: one for each rate that none is listed for."""
    listed = {name: sum(spring.count for spring in springs.bought if spring.at == name) for name in JOINT_NAMES}
    return sum(listed[name] or 1 for name, rate in zip(JOINT_NAMES, rates, strict=True) if rate)


def bodies(spec: SliderCrankSpec, solution: Solution, units: UnitCurves) -> Iterator[PosedBody]:
    """Yield links and springs where the joints are, the slider's spring as far as it stands out around its pin."""
    pins, (half, _) = joints(solution, units), eye_and_hole(spec)
    for name, k in (("crank", 0), ("coupler", 1)):
        yield PosedBody.line(name, "driven" if k == 0 else "free", np.stack(pins[k : k + 2], axis=1), half, round=True)
    for pin, names in zip(pins, (("pivot",), ("crank_pin",), ("slider_pin", "slider")), strict=True):
        sizes = [0.5 * coil.outer_diameter for name in names for coil in spec.mechanism.springs.coils_at(name)]
        yield PosedBody.line("spring", "free", pin[:, None], max([half, *sizes]))


def _depth(spec: SliderCrankSpec, rates: FloatArray, turns: FloatArray, joining: Hardware) -> tuple[float | None, str]:
    """Return the depth of links and springs [m], and what of it is taken; None, and why, where a part has no size.

    Crank and coupler lie above each other, the crank on the ground, and the slider, which may be thicker, below the
    coupler. The pivot's spring is below, all others are above: they stand beside each other and the heads of screws.
    Several springs of a joint lie above each other.
    """
    springs, part = spec.mechanism.springs, spec.mechanism.part
    if part is None or part.sheet is None:
        return None, "; the depth of links is not known (mechanism.part.sheet)"
    high = {}
    for name, turn in ((name, turn) for name, rate, turn in zip(JOINT_NAMES, rates, turns, strict=True) if rate):
        wound = [(spring.coil, spring.count) for spring in springs.bought if spring.at == name and spring.coil]
        if not wound:
            return None, f"; the spring at the {JOINTS_BY_NAME[name].words} has no size"
        high[name] = sum(count * height_of(name, coil, float(turn)) for coil, count in wound)
    below, above = high.pop("pivot", 0.0), max(high.values(), default=0.0)
    links = (N_SHEETS - 1) * part.sheet + joining.slider_excess
    why = f"; {N_SHEETS} sheets and the springs on both sides of them"
    return below + part.sheet + max(links + above, joining.screw_head_height), why


def height_of(name: str, coil: HelicalSpring, turn: float) -> float:
    """Return how far the spring of a joint stands out from the links [m]: lying beside the coupler, or at a pin.

    There it is longest when it is wound up by `turn` [rad].
    """
    return coil.outer_diameter if name == "slider" else coil.room_for(turn)


def _describe_coils(springs: Springs) -> str:
    coils = [coil for name in JOINT_NAMES[:3] for coil in springs.coils_at(name)]
    if not coils:
        return "springs at pins have no size"
    wide, long = (1e3 * max(getattr(coil, name) for coil in coils) for name in ("outer_diameter", "body_length"))
    return f"torsion springs up to {wide:.3g} mm wide and {long:.3g} mm deep"
