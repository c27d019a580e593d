"""The box that a slider-crank stays in: a printed part with its pads, or links and pins with their springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.base import Room
from cfmkit.families.run_control import Run
from cfmkit.families.slider_crank.outline import drawing
from cfmkit.families.slider_crank.springs.outline import eye_and_hole
from cfmkit.families.slider_crank.unit_springs import JOINTS

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.spec import Springs
    from cfmkit.results import Result
    from cfmkit.stock.springs.helical_spring_formulas import Wound

POSES = 13
"""Places of the motion at which a printed part is looked at."""

PLATES = 3
"""Sheets above each other: crank, coupler, and the ground that carries the pivot and the slider's path."""


def room(result: Result) -> Room | None:
    """Return the box of a solved mechanism, along the slider's path and across it; None if nothing was solved.

    A part that was solved as a solid moves as its beams do, to a fraction of a thickness.
    """
    spec: Any = result.spec
    if result.state is not None and spec.fidelity == "solid":
        from cfmkit.families.slider_crank.printed.model import analyze

        result = analyze(spec.replace({"analysis.fidelity": spec.piece, "requirements": ()}), Run())
    if result.state is None:
        return None
    return _linkage(result) if result.spec.fidelity == "prb" else _part(result)


def _part(result: Result) -> Room:
    """Return the box of a printed part: as it is cut, and as its centre line moves; legs lie above each other.

    A mirrored pair is drawn apart from each other, and so needs a little less than is said.
    """
    spec: Any = result.spec
    solution = result.state
    path = solution.pressed.path
    boxes = np.array([contour.extents for contour in drawing(spec).contours if contour.layer == "cut"])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    chosen = np.unique(np.linspace(0, len(solution.travel) - 1, POSES).astype(int))
    names = list(path.network.beams)
    poses = [np.concatenate([path.shape(name, int(path.at_requested[k])) for name in names]) for k in chosen]
    points, half = np.concatenate(poses), 0.5 * _thickest(spec)
    # the slider's pad moves with the end of the part
    ends, rest = np.array([pose[-1] for pose in poses]), poses[0][-1]
    pad = np.array([high[0] - rest[0] if rest[0] > 0.0 else low[0] - rest[0], 0.0])
    moved = np.concatenate([points - half, points + half, ends + pad])
    low, high = np.minimum(low, moved.min(axis=0)), np.maximum(high, moved.max(axis=0))
    parts, corner = spec.mechanism, (float(low[0]), float(low[1]))
    depth = parts.legs * _widest(spec)
    return Room(float(high[1] - low[1]), float(high[0] - low[0]), depth, parts.sets, "", corner, True)


def _thickest(spec: SliderCrankSpec) -> float:
    parts = spec.mechanism
    if spec.fidelity == "beam" and parts.beam is not None:
        return float(np.max(parts.beam.thickness))
    return max(one.thickness for one in parts.flexures.all) if parts.flexures else 0.0


def _widest(spec: SliderCrankSpec) -> float:
    parts = spec.mechanism
    if spec.fidelity == "beam" and parts.beam is not None:
        return parts.beam.width
    return max(one.width for one in parts.flexures.all) if parts.flexures else 0.0


def radii_at_pins(spec: Any) -> tuple[float, float, float]:
    """Return how far links and springs reach around pivot, crank pin, and the slider with its pin [m]."""
    half, _ = eye_and_hole(spec)
    at = ("pivot",), ("crank_pin",), ("slider_pin", "slider")
    found = [[coil.outer_diameter for name in names for coil in spec.mechanism.springs.coils_at(name)] for names in at]
    first, second, third = (max([half, *(0.5 * one for one in sizes)]) for sizes in found)
    return first, second, third


def _linkage(result: Result) -> Room:
    """Return the box of links and pins, and of springs whose wire is known, over the motion of the curve."""
    spec: Any = result.spec
    solution, springs = result.state, spec.mechanism.springs
    link, units = solution.assembly.linkage, solution.units
    half, _ = eye_and_hole(spec)
    around = radii_at_pins(spec)
    pivot, turned = np.zeros((1, 2)), link.crank * np.column_stack([np.cos(units.angle[0]), np.sin(units.angle[0])])
    slid = np.column_stack([units.position[0], np.full(units.position.size, link.offset)])
    pins = list(zip((pivot, turned, slid), around, strict=True))
    low = np.min([pin.min(axis=0) - radius for pin, radius in pins], axis=0)
    high = np.max([pin.max(axis=0) + radius for pin, radius in pins], axis=0)
    along, across = high - low
    count = int(np.count_nonzero(solution.assembly.rates))
    depth, why = _depth(spec, solution.assembly.rates, solution.extremes.largest_turns[:, 0])
    reported = f"links {2e3 * half:.3g} mm wide; {_sizes(springs)}{why}"
    return Room(float(across), float(along), depth, 3 + count, reported, (float(low[0]), float(low[1])), True)


def _depth(spec: SliderCrankSpec, rates: np.ndarray, turns: np.ndarray) -> tuple[float | None, str]:
    """Return the depth of links and springs [m], and what of it is taken; None, and why, where a part has no size.

    Crank and coupler lie above each other, the crank on the ground. The pivot's spring is below, all others are above:
    they stand beside each other.
    """
    springs, part = spec.mechanism.springs, spec.mechanism.part
    if part is None or part.sheet is None:
        return None, "; the depth of links is not known (mechanism.part.sheet)"
    high = {}
    for name, turn in ((name, turn) for name, rate, turn in zip(JOINTS, rates, turns, strict=True) if rate):
        coils = springs.coils_at(name)
        if not coils:
            return None, f"; the spring at the {name.replace('_', ' ')} has no size"
        high[name] = max(height_of(name, coil, float(turn)) for coil in coils)
    below, above = high.pop("pivot", 0.0), max(high.values(), default=0.0)
    return PLATES * part.sheet + below + above, f"; {PLATES} sheets and the springs on both sides of them"


def height_of(name: str, coil: Wound, turn: float) -> float:
    """Return how far the spring of a joint stands out from the links [m]: lying beside the coupler, or at a pin.

    There it is longest when it is wound up by `turn` [rad].
    """
    return coil.outer_diameter if name == "slider" else coil.body_length_wound_up(turn)


def _sizes(springs: Springs) -> str:
    found = [coil for name in JOINTS[:3] for coil in springs.coils_at(name)]
    if not found:
        return "springs at pins have no size"
    wide, long = (1e3 * max(getattr(one, name) for one in found) for name in ("outer_diameter", "body_length"))
    return f"torsion springs up to {wide:.3g} mm wide and {long:.3g} mm deep"
