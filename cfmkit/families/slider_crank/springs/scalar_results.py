"""Scalar results of slider-cranks with springs, beside the constant-force metrics of every family, each by its name.

A quantity is a dimension, a definition, and a function of the solution of any number of mechanisms.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.rows import ScalarQuantity, quantity_of_each
from cfmkit.families.slider_crank.springs.bistability_class import CLASS_NAMES, small_angle_number
from cfmkit.families.slider_crank.springs.hardware import STRENGTH_DEFINITIONS as LINK_DEFINITIONS
from cfmkit.families.slider_crank.springs.hardware import LinkBar, LinkLoads, allowable_of, link_loads, link_of
from cfmkit.families.slider_crank.springs.solution import grid_over
from cfmkit.families.slider_crank.springs.sprung_linkage import mean_effort_per_angle
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.stock.springs.stress_and_life import (
    WIRE_DEFINITIONS,
    SpringInUse,
    orient_to_larger,
    wire_quantities,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.results import Quantity

    Function = Callable[[Solution], Any]


_REFERENCE_TEXT = "the reference (`analysis.reference_angle` or `reference_travel`)"
NO_UNSTABLE = "there is no unstable equilibrium"
NO_SECOND = "there is no second stable equilibrium in the motion"
NO_FACTOR = "it needs torsion springs and a spring at the slider"
HELD_TEXT = "friction holds the mechanism in a part of its motion, next to which forces are unbounded"


def _quantity_of_drive(
    drive: str, dimension: str, definition: str, function: Function, reason: str
) -> ScalarQuantity[Solution]:
    """Return a quantity that only mechanisms with one kind of drive have."""
    return ScalarQuantity(dimension, definition, function, reason, lambda solution: solution.drive == drive)


def _quantity_of_equilibrium(name: str, words: str, stable: bool) -> dict[str, ScalarQuantity[Solution]]:
    """Return where the next equilibrium of a kind is, over the motion of either drive."""
    text, reason = f"of the {words} equilibrium from the unloaded position", NO_SECOND if stable else NO_UNSTABLE

    def place(solution: Solution) -> FloatArray:
        return solution.nearest(stable)[0]

    return {
        f"{name}_angle": _quantity_of_drive("torque", "angle", f"crank angle {text}", place, reason),
        f"{name}_travel": _quantity_of_drive("force", "length", f"slider travel {text}", place, reason),
    }


def _quantity_of_band(drive: str, motion: str, dimension: str) -> dict[str, ScalarQuantity[Solution]]:
    """Return width, start and end of the constant band over the motion of one kind of drive."""
    reason = f"the reference is outside the motion, or the {drive} there is zero"
    within = f"of the interval around {_REFERENCE_TEXT} with the {drive} within `analysis.tolerance`"
    functions: dict[str, Function] = {
        "": lambda solution: solution.band[1] - solution.band[0],
        "start": lambda solution: solution.band[0],
        "end": lambda solution: solution.band[1],
    }
    return {
        f"constant_{motion}_{end}".rstrip("_"): _quantity_of_drive(
            drive, dimension, f"{end or 'width'} {within}", function, reason
        )
        for end, function in functions.items()
    }


def _wires(solution: Solution) -> Iterator[Mapping[str, Quantity]]:
    """Yield the largest stress in the wire of bought springs, and their shortest life, of each mechanism."""
    return (wire_quantities(_list_springs_in_use(solution, number)) for number in range(len(solution)))


def _list_springs_in_use(solution: Solution, number: int) -> list[SpringInUse]:
    """Return the bought springs of a mechanism between their smallest and their largest load over the motion."""
    springs, in_use = solution.specs[number].mechanism.springs, []
    for spring in springs.bought:
        joint = JOINT_NAMES.index(spring.at)
        high, low = (float(np.broadcast_to(ends[joint], len(solution))[number]) for ends in solution.extremes.turns)
        least, largest = orient_to_larger(high, low)
        # springs of a joint turn alike: each bears its wire's share of the rate, which may be stated
        rate = 0.0 if spring.coil is None else spring.coil.rate * springs.stated_over_wires(spring.at)
        in_use.append(spring.put_under(rate * least, rate * largest))
    return in_use


def _quantity_of_links(
    name: str, function: Callable[[LinkBar, LinkLoads, FloatArray], Any]
) -> ScalarQuantity[Solution]:
    """Return what the links bear over the motion; mechanisms whose links are not described do not name it."""

    def read(solution: Solution) -> Any:
        bars = [link_of(spec) for spec in solution.specs]
        numbers = [(bar.width, bar.sheet, bar.hole, bar.modulus) for bar in bars if bar is not None]
        allowable = np.array([allowable_of(spec) for spec in solution.specs], dtype=float)
        motion = grid_over(solution.assembly, solution.low, solution.high)
        loads = link_loads(solution.assembly, motion, solution.legs[:, 0])
        return function(LinkBar(*np.array(numbers).T), loads, allowable)

    return ScalarQuantity(
        *LINK_DEFINITIONS[name],
        read,
        "no strength of the material is known",
        lambda solution: link_of(solution.spec) is not None and bool(solution.assemblies[0].rates.any()),
    )


def _lost_energy(solution: Solution, kind: str) -> FloatArray:
    """Return what pins or guide take over the window, back and forth, (m,) [J]."""
    assert solution.friction_branches is not None
    (forth, back), motion = solution.friction_branches, solution.broadcast(solution.motion)
    lost = solution.broadcast(forth.lost[kind] + back.lost[kind])
    low, high = (np.broadcast_to(end, (len(solution), 1)) for end in solution.window_or_motion)
    low, high = np.maximum(low, motion[:, :1]), np.minimum(high, motion[:, -1:])
    energies = []
    for places, first, last, values in zip(motion, low, high, lost, strict=True):
        at = np.concatenate([first, places[(places > first) & (places < last)], last])
        energies.append(np.trapezoid(np.interp(at, places, values), at))
    return np.array(energies)


def _quantity_of_loop(name: str, dimension: str, definition: str) -> dict[str, ScalarQuantity[Solution]]:
    """Return what pins and guide take, as an energy or as shares of it."""

    def read(kind: str, solution: Solution) -> FloatArray:
        lost = {part: _lost_energy(solution, part) for part in ("pins", "guide")}
        area = lost["pins"] + lost["guide"]
        share = np.where(area > 0, lost[kind] / area, np.nan)
        return np.where(np.isfinite(area), lost[kind] if dimension == "energy" else share, np.nan)

    return {
        f"{name}_{kind}": ScalarQuantity(
            dimension,
            definition.format(words),
            partial(read, kind),
            "friction holds the mechanism in a part of its motion",
            lambda solution: solution.friction_branches is not None,
        )
        for kind, words in (("pins", "the pins dissipate"), ("guide", "the slider's guide dissipates"))
    }


def _force_per_degree(solution: Solution) -> FloatArray:
    per_rate = mean_effort_per_angle(solution.assemblies, *solution.window_or_motion)
    rates = solution.assembly.rates.reshape(4, -1)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.radians(1.0) * np.where(rates > 0.0, rates * per_rate, 0.0).sum(axis=0))


def _effort_drop(solution: Solution) -> FloatArray:
    is_there = np.abs(solution.effort).max(axis=1) > solution.effort_error
    return np.where(is_there, solution.stability_classes.drop, np.nan)


def _quantity_of_turn(joint: int) -> ScalarQuantity[Solution]:
    return ScalarQuantity(
        "angle",
        f"largest rotation of the spring at the {JOINTS_BY_NAME[JOINT_NAMES[joint]].words}",
        lambda solution: solution.extremes.largest_turns[joint],
    )


def _slider_travel(solution: Solution) -> Any:
    high, low = (ends[3] - np.ravel(solution.assembly.tight) for ends in solution.extremes.turns)
    return np.maximum(np.abs(high), np.abs(low))


def _guide_force(solution: Solution) -> FloatArray:
    up, down = solution.reaction_extremes[1]
    return np.maximum(np.abs(up), np.abs(down))


SCALAR_QUANTITIES: Mapping[str, ScalarQuantity[Solution]] = {
    "stiffness_class": ScalarQuantity(
        "text",
        "positive, zero, local negative, snap-through (the second stable position lies outside), bistable or "
        "tristable over the motion; a drop of at most twice `analysis.tolerance` counts as zero [LH, sec. 3]",
        lambda solution: solution.stability_classes.kind,
        words=CLASS_NAMES,
    ),
    "stiffness_drop": ScalarQuantity(
        "ratio",
        "largest fall of the effort after a peak, as a fraction of the peak, on the way from the unloaded position; "
        "from 1 on there is a second equilibrium",
        _effort_drop,
        "the effort is zero within its numerical error",
    ),
    "stable_positions": ScalarQuantity(
        "count",
        "stable equilibria in the motion, the unloaded position included",
        lambda solution: solution.stability_classes.stable,
    ),
    "unstable_positions": ScalarQuantity(
        "count",
        "unstable equilibria in the motion; beyond each the mechanism snaps through",
        lambda solution: solution.stability_classes.unstable,
    ),
    **_quantity_of_equilibrium("snap_through", "first unstable", stable=False),
    **_quantity_of_equilibrium("second_stable", "next stable", stable=True),
    "energy_barrier": ScalarQuantity(
        "energy",
        "energy at the first unstable equilibrium",
        lambda solution: solution.nearest(stable=False)[1],
        NO_UNSTABLE,
    ),
    **_quantity_of_band("torque", "angle", "angle"),
    **_quantity_of_band("force", "travel", "length"),
    **{
        f"reference_{drive}": _quantity_of_drive(
            drive,
            drive,
            f"{drive} at {_REFERENCE_TEXT}",
            lambda solution: solution.level,
            "the reference is outside the motion",
        )
        for drive in ("torque", "force")
    },
    "start_force": _quantity_of_drive(
        "force",
        "force",
        "force that moves the slider from the unloaded position; where stretched, the limit",
        lambda solution: solution.frictionless(np.zeros((1, 1))),
        "the force is unbounded there",
    ),
    "stretched_torque": _quantity_of_drive(
        "torque",
        "torque",
        "torque in the stretched position",
        lambda solution: solution.frictionless(solution.stretched_motion),
        "the torque is unbounded there",
    ),
    "stretched_stiffness": _quantity_of_drive(
        "torque",
        "rotational_stiffness",
        "slope of the torque in the stretched position [LH, eq. 31]",
        lambda solution: solution.assembly.total(solution.assembly.units(solution.stretched_motion).stiffness)[:, 0],
        "the torque is unbounded there",
    ),
    "bistable_factor": ScalarQuantity(
        "factor",
        "factor on all torsion springs below which the mechanism has a second equilibrium: max(-P/G), G and P the "
        "efforts of the torsion springs and of the slider's spring",
        lambda solution: solution.scale_factors[0],
        NO_FACTOR,
    ),
    "positive_factor": ScalarQuantity(
        "factor",
        "factor on all torsion springs above which the stiffness is positive: max(-P'/G')",
        lambda solution: solution.scale_factors[1],
        NO_FACTOR,
    ),
    "small_angle_number": ScalarQuantity(
        "factor",
        "K_P kappa^2 phi^2/(2 k), k = K_A + (1 + r1/r2)^2 K_B + (r1/r2)^2 K_C, kappa = r1 (1 + r1/r2)/cos t2, phi the "
        "lead of the unloaded position; for small phi above 4 bistable, 1 zero stiffness, below 1 positive",
        lambda solution: solution.column(small_angle_number),
        "the unloaded position is the stretched one, or there is no torsion spring",
    ),
    **_quantity_of_loop("loop_energy", "energy", "energy that {} over the window, back and forth"),
    **_quantity_of_loop("loop_share", "ratio", "share of the loop's area that {}"),
    "force_per_anchor": ScalarQuantity(
        "stiffness",
        "increase of the force per travel of the anchor of the slider's spring; the same over the whole motion, so "
        "that a trim does not change the shape of the curve",
        lambda solution: solution.assembly.rates[3],
        applies=lambda solution: solution.drive == "force" and solution.spec.mechanism.springs.anchor is not None,
    ),
    "force_per_degree": _quantity_of_drive(
        "force",
        "force",
        "increase of the mean force in the window per degree of the unloaded angle, at the same positions of the "
        "slider",
        _force_per_degree,
        "the force is unbounded in the window",
    ),
    "stretched_angle": ScalarQuantity(
        "angle",
        "crank angle with crank and coupler in one line, theta_A2 [LH, eq. 13b]",
        lambda solution: solution.column(lambda assembly: assembly.linkage.stretched_angle),
    ),
    "folded_angle": ScalarQuantity(
        "angle",
        "crank angle with the coupler folded over the crank [LH, eq. 13a, other branch]",
        lambda solution: solution.column(lambda assembly: assembly.linkage.folded_angle),
        "the coupler cannot fold over the crank",
    ),
    "unloaded_angle": ScalarQuantity(
        "angle",
        "crank angle with all springs relaxed, theta_A0",
        lambda solution: solution.column(lambda assembly: assembly.unloaded),
    ),
    "energy_max": ScalarQuantity("energy", "largest energy in the springs", lambda solution: solution.extremes.energy),
    **{f"{name}_rotation_max": _quantity_of_turn(joint) for joint, name in enumerate(JOINT_NAMES[:3])},
    "slider_travel_max": ScalarQuantity(
        "length", "largest travel of the slider from the unloaded position", _slider_travel
    ),
    "coupler_compression_max": ScalarQuantity(
        "force",
        "largest compression of the coupler of one leg; negative: only tension",
        lambda solution: -solution.reaction_extremes[0][1],
        HELD_TEXT,
    ),
    "guide_force_max": ScalarQuantity(
        "force", "largest transverse force of the slider of one leg on its guide", _guide_force, HELD_TEXT
    ),
    **{name: quantity_of_each(name, about, _wires) for name, about in WIRE_DEFINITIONS.items()},
    "link_stress_max": _quantity_of_links("link_stress_max", lambda bar, loads, _allowable: bar.stress(loads)),
    "pin_bearing_max": _quantity_of_links("pin_bearing_max", lambda bar, loads, _allowable: bar.bearing(loads)),
    "link_safety_factor": _quantity_of_links("link_safety_factor", LinkBar.safety),
    "link_turn_share_max": _quantity_of_links(
        "link_turn_share_max", lambda bar, loads, _allowable: bar.turn_share(loads)
    ),
}
"""Every scalar result, in the order in which they are shown."""
SCALAR_DEFINITIONS = {name: quantity.about for name, quantity in SCALAR_QUANTITIES.items()}
"""Name -> dimension and definition."""
