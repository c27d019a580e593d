"""Scalar results of a slider-crank with springs, beside the constant-force metrics of every family."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.bistability_class import CLASSES, scale_factors, small_angle_number
from cfmkit.families.slider_crank.springs.link_strength import DEFINITIONS as LINK_DEFINITIONS
from cfmkit.families.slider_crank.springs.sprung_linkage import mean_effort_per_angle
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.results import Quantity
from cfmkit.stock.springs.stress_and_life import (
    WIRE_DEFINITIONS,
    SpringInUse,
    in_the_sense_of_the_larger,
    wire_quantities,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.families.slider_crank.springs.spec import Springs


_AT = "the reference (`analysis.reference_angle` or `reference_travel`)"

DEFINITIONS = {
    "stiffness_class": (
        "text",
        "positive, zero, local negative, snap-through (the second stable position lies outside), bistable or "
        "tristable over the motion; a drop of at most twice `analysis.tolerance` counts as zero [LH, sec. 3]",
    ),
    "stiffness_drop": (
        "ratio",
        "largest fall of the effort after a peak, as a fraction of the peak, on the way from the unloaded position; "
        "from 1 on there is a second equilibrium",
    ),
    "stable_positions": ("count", "stable equilibria in the motion, the unloaded position included"),
    "unstable_positions": ("count", "unstable equilibria in the motion; beyond each the mechanism snaps through"),
    "snap_through_angle": ("angle", "crank angle of the first unstable equilibrium from the unloaded position"),
    "snap_through_travel": ("length", "slider travel of the first unstable equilibrium from the unloaded position"),
    "second_stable_angle": ("angle", "crank angle of the next stable equilibrium from the unloaded position"),
    "second_stable_travel": ("length", "slider travel of the next stable equilibrium from the unloaded position"),
    "energy_barrier": ("energy", "energy at the first unstable equilibrium"),
    "constant_angle": ("angle", f"width of the interval around {_AT} with the torque within `analysis.tolerance`"),
    "constant_angle_start": (
        "angle",
        f"start of the interval around {_AT} with the torque within `analysis.tolerance`",
    ),
    "constant_angle_end": ("angle", f"end of the interval around {_AT} with the torque within `analysis.tolerance`"),
    "constant_travel": ("length", f"width of the interval around {_AT} with the force within `analysis.tolerance`"),
    "constant_travel_start": (
        "length",
        f"start of the interval around {_AT} with the force within `analysis.tolerance`",
    ),
    "constant_travel_end": ("length", f"end of the interval around {_AT} with the force within `analysis.tolerance`"),
    "reference_torque": ("torque", f"torque at {_AT}"),
    "reference_force": ("force", f"force at {_AT}"),
    "start_force": ("force", "force that moves the slider from the unloaded position; where stretched, the limit"),
    "stretched_torque": ("torque", "torque in the stretched position"),
    "stretched_stiffness": ("rotational_stiffness", "slope of the torque in the stretched position [LH, eq. 31]"),
    "bistable_factor": (
        "factor",
        "factor on all torsion springs below which the mechanism has a second equilibrium: max(-P/G), G and P the "
        "efforts of the torsion springs and of the slider's spring",
    ),
    "positive_factor": ("factor", "factor on all torsion springs above which the stiffness is positive: max(-P'/G')"),
    "small_angle_number": (
        "factor",
        "K_P kappa^2 phi^2/(2 k), k = K_A + (1 + r1/r2)^2 K_B + (r1/r2)^2 K_C, kappa = r1 (1 + r1/r2)/cos t2, phi the "
        "lead of the unloaded position; for small phi above 4 bistable, 1 zero stiffness, below 1 positive",
    ),
    "loop_energy_pins": ("energy", "energy that the pins dissipate over the window, back and forth"),
    "loop_energy_guide": ("energy", "energy that the slider's guide dissipates over the window, back and forth"),
    "loop_share_pins": ("ratio", "share of the loop's area that the pins dissipate"),
    "loop_share_guide": ("ratio", "share of the loop's area that the slider's guide dissipates"),
    "force_per_anchor": (
        "stiffness",
        "increase of the force per travel of the anchor of the slider's spring; the same over the whole motion, so "
        "that a trim does not change the shape of the curve",
    ),
    "force_per_degree": (
        "force",
        "increase of the mean force in the window per degree of the unloaded angle, at the same positions of the "
        "slider",
    ),
    "stretched_angle": ("angle", "crank angle with crank and coupler in one line, theta_A2 [LH, eq. 13b]"),
    "folded_angle": ("angle", "crank angle with the coupler folded over the crank [LH, eq. 13a, other branch]"),
    "unloaded_angle": ("angle", "crank angle with all springs relaxed, theta_A0"),
    "energy_max": ("energy", "largest energy in the springs"),
    "pivot_rotation_max": ("angle", "largest rotation of the spring at the pivot"),
    "crank_pin_rotation_max": ("angle", "largest rotation of the spring at the crank pin"),
    "slider_pin_rotation_max": ("angle", "largest rotation of the spring at the slider pin"),
    "slider_travel_max": ("length", "largest travel of the slider from the unloaded position"),
    "coupler_compression_max": ("force", "largest compression of the coupler of one leg; negative: only tension"),
    "guide_force_max": ("force", "largest transverse force of the slider of one leg on its guide"),
    **WIRE_DEFINITIONS,
    **LINK_DEFINITIONS,
}


def values_of(solution: Solution) -> Mapping[str, Quantity]:
    """Return the scalar results by name; those that a torque drive, or a force drive, does not have are left out."""
    found = dict(_numbers(solution))
    return {name: Quantity(value, *DEFINITIONS[name], reason) for name, (value, reason) in found.items()} | {
        "stiffness_class": Quantity(float(solution.character.kind), *DEFINITIONS["stiffness_class"], words=CLASSES)
    }


def values_of_wires(springs: Springs, solution: Solution) -> Mapping[str, Quantity]:
    """Return what the wires of bought springs bear over the motion; nothing where they are not known."""
    return wire_quantities(list(_in_use(springs, solution)))


def _in_use(springs: Springs, solution: Solution) -> Iterator[SpringInUse]:
    """Yield the springs that are bought between their smallest and their largest load over the motion."""
    for one in springs.bought:
        joint = JOINTS.index(one.at)
        high, low = (float(ends[joint]) for ends in solution.extremes.turns)
        least, largest = in_the_sense_of_the_larger(high, low)
        # springs of a joint turn alike: each bears its wire's share of the rate, which may be stated
        wound = None if one.wound is None else one.wound.wound(one.kind)
        each = wound.rate * springs.stated_over_wires(one.at) if wound is not None else 0.0
        fatigue = None if one.wound is None or one.wound.fatigue is None else one.wound.fatigue.law
        yield SpringInUse(wound, each * least, each * largest, fatigue, one.life)


def _loop(solution: Solution) -> Iterator[tuple[str, float | None]]:
    """Yield what pins and guide take over the window, and their shares; nothing without friction."""
    if solution.ways is None:
        return
    (forth, back), motion = solution.ways, solution.motion
    low, high = solution.character.window or (float(motion[0]), float(motion[-1]))
    low, high = max(low, float(motion[0])), min(high, float(motion[-1]))
    at = np.concatenate([[low], motion[(motion > low) & (motion < high)], [high]])
    taken = {
        kind: float(np.trapezoid(np.interp(at, motion, forth.lost[kind] + back.lost[kind]), at)) for kind in forth.lost
    }
    area = sum(taken.values())
    for kind, value in taken.items():
        yield f"loop_energy_{kind}", value if np.isfinite(area) else None
        yield f"loop_share_{kind}", value / area if np.isfinite(area) and area > 0 else None


def _trim(solution: Solution) -> Iterator[tuple[str, float | None]]:
    """Yield what the anchor of the slider's spring does, where there is one to be screwed."""
    if solution.anchored and solution.assembly.drive == "force":
        yield "force_per_anchor", float(solution.assembly.rates[3])
    if solution.assembly.drive == "force":
        motion = solution.motion
        window = solution.character.window or (float(motion[0]), float(motion[-1]))
        per_rate = mean_effort_per_angle(solution.assembly, window)
        rates, there = solution.assembly.rates, solution.assembly.rates > 0.0
        bounded = bool(np.isfinite(per_rate[there]).all())  # not where the window reaches a pole of the force
        per_degree = float(np.radians(1.0))
        yield "force_per_degree", float(rates[there] @ per_rate[there]) * per_degree if bounded else None


def _numbers(solution: Solution) -> Iterator[tuple[str, tuple[float | None, str]]]:
    """Yield names with values, or the reason why there is none."""
    for name, value in (
        *_positions(solution),
        *_band(solution),
        *_pose(solution),
        *_extremes(solution),
        *_loop(solution),
        *_trim(solution),
    ):
        reason = "" if value is not None else _WHY.get(name.removesuffix("_start").removesuffix("_end"), "")
        yield name, (value, reason)


_WHY = {
    "snap_through_angle": "there is no unstable equilibrium",
    "snap_through_travel": "there is no unstable equilibrium",
    "energy_barrier": "there is no unstable equilibrium",
    "second_stable_angle": "there is no second stable equilibrium in the motion",
    "second_stable_travel": "there is no second stable equilibrium in the motion",
    "constant_angle": "the reference is outside the motion, or the torque there is zero",
    "constant_travel": "the reference is outside the motion, or the force there is zero",
    "stiffness_drop": "the effort is zero within its numerical error",
    "bistable_factor": "it needs torsion springs and a spring at the slider",
    "positive_factor": "it needs torsion springs and a spring at the slider",
    "small_angle_number": "the unloaded position is the stretched one, or there is no torsion spring",
    "folded_angle": "the coupler cannot fold over the crank",
    "coupler_compression_max": "friction holds the mechanism in a part of its motion, next to which forces are "
    "unbounded",
    "guide_force_max": "friction holds the mechanism in a part of its motion, next to which forces are unbounded",
}

Pairs = tuple[tuple[str, float | None], ...]


def _positions(solution: Solution) -> Pairs:
    """Return drop and equilibria."""
    found, place = solution.character, solution.assembly.motion_name
    unstable, stable = solution.nearest(False), solution.nearest(True)
    return (
        ("stiffness_drop", found.drop if float(np.abs(solution.effort).max()) > solution.effort_error else None),
        ("stable_positions", float(found.classified.stable[0])),
        ("unstable_positions", float(found.classified.unstable[0])),
        (f"snap_through_{place}", None if unstable is None else unstable.motion),
        (f"second_stable_{place}", None if stable is None else stable.motion),
        ("energy_barrier", None if unstable is None else unstable.energy),
    )


def _band(solution: Solution) -> Pairs:
    """Return the constant band around the reference."""
    drive, found = solution.assembly.drive, solution.character
    name = f"constant_{solution.assembly.motion_name}"
    low, high = solution.band or (None, None)
    width = None if low is None or high is None else high - low
    inside = found.low <= solution.reference <= found.high
    level = found.effort(solution.reference) if inside else None
    return (
        (name, width),
        (f"{name}_start", low),
        (f"{name}_end", high),
        (f"reference_{drive}", level),
    )


def _pose(solution: Solution) -> Pairs:
    """Return what belongs to the stretched position, and the limits of the classes."""
    assembly, found = solution.assembly, solution.character
    factors = scale_factors(assembly, found.low, found.high) or (None, None)
    finite = tuple(value if value is not None and np.isfinite(value) else None for value in factors)
    special: Pairs = (("start_force", found.effort(0.0)),)
    if assembly.drive == "torque":
        at = assembly.stretched
        special = (("stretched_torque", found.effort(at)), ("stretched_stiffness", found.stiffness(at)))
    return (
        *special,
        ("bistable_factor", finite[0]),
        ("positive_factor", finite[1]),
        ("small_angle_number", small_angle_number(assembly)),
        ("stretched_angle", assembly.linkage.stretched_angle),
        ("folded_angle", assembly.linkage.folded_angle),
        ("unloaded_angle", assembly.unloaded),
    )


def _extremes(solution: Solution) -> Pairs:
    """Return the largest loads and motions, wherever they are."""
    found, assembly = solution.extremes, solution.assembly
    turn = found.largest_turns
    coupler, guide = solution.reaction_extremes
    return (
        ("energy_max", float(found.energy(assembly.rates[None, :])[0])),
        ("pivot_rotation_max", float(turn[0])),
        ("crank_pin_rotation_max", float(turn[1])),
        ("slider_pin_rotation_max", float(turn[2])),
        ("slider_travel_max", max(abs(float(ends[3]) - assembly.tight) for ends in found.turns)),
        ("coupler_compression_max", _known(-coupler[1])),
        ("guide_force_max", _known(max(abs(guide[0]), abs(guide[1])))),
    )


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
