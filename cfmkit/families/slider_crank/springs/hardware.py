"""Links, pins, guide, ground and screws of a slider-crank with springs, dimensioned for the loads of its motion.

Links are as they are drawn; their pins, the guide's rods and the screws of the ground bear what they take. Ground,
crank and coupler lie on each other; the slider lies below the coupler and may be thicker than a link. Heads of screws
stand beside what moves; where there is no place for them, they are sunk into the ground.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.posed_part import PosedBody, rectangle, screw_positions
from cfmkit.families.findings import mm as length_in_words
from cfmkit.families.findings import newton
from cfmkit.families.hardware import (
    DEFAULT_MATERIAL,
    GuideRods,
    Hardware,
    PartStrength,
    describe_faults,
    guide_part,
    guide_rods,
    mm,
    pin_for,
    pin_part,
    required_safety,
    screw_for,
    screw_part,
    with_faults,
)
from cfmkit.families.slider_crank.springs.link_strength import link_loads
from cfmkit.families.slider_crank.springs.outline import eye_and_hole
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES
from cfmkit.specs.units import format_short
from cfmkit.stock.joint_strength import link_stress, pin_that_bears
from cfmkit.stock.parts_list import ListedPart
from cfmkit.stock.springs.guides import guide_words
from cfmkit.stock.stock_series import hole_with_fit, series_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.link_strength import LinkLoads
    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.families.slider_crank.unit_springs import UnitCurves

N_LOADS = 201  # places of the motion at which loads are computed
N_SCREWS = 4  # of the ground
GROUND_SCREWS = "ground to its base"  # place of these screws
LEAST_GROUND = 4.0  # least width of the ground, in heads of its screws: two of them, each a head from the edge


def hardware(spec: SliderCrankSpec, solution: Solution) -> Hardware:
    """Return the parts of a solved mechanism, of all legs together."""
    mechanism, legs = spec.mechanism, spec.mechanism.sets
    strength = PartStrength.from_material(mechanism.material, required_safety(spec))
    motion = np.linspace(float(solution.motion[0, 0]), float(solution.motion[0, -1]), N_LOADS)
    loads = link_loads(solution.assembly, motion, solution.legs[:1, 0])
    eye, hole = eye_and_hole(spec)
    system = mechanism.part.stock if mechanism.part else None
    stated = mechanism.part.sheet if mechanism.part else None
    sheet = stated or _sheet(loads, 2.0 * eye, 2.0 * hole, strength, system)
    load, pin = float(np.max(loads.pin_max)), 2.0 * hole
    least, bears = pin_for(load, sheet, sheet, strength, system)
    faults = {}
    if pin_that_bears(load, sheet, sheet, strength.allowable, strength.pins, (pin,)) is None:
        cure = f"use at least {length_in_words(least)} ('mechanism.pins.diameter')" if bears else "use thicker links"
        faults["joints"] = f"too weak for {newton(load)} in links of {length_in_words(sheet)}: {cure}"
    across, force, travel, rod_at = _guide_loads(spec, solution)
    rods = guide_rods(2, across, force, travel, 2.0 * eye, mechanism.guide, system, strength)
    screw = screw_for(load * legs, sheet, N_SCREWS, strength)
    ends = rod_at + np.array([[-0.5 * rods.bush, 0.0], [0.5 * rods.bush, 0.0]])
    margin = np.array([eye, max(eye, 0.5 * rods.slider_width(pin))])
    low, high = np.minimum(ends.min(axis=0) - margin, -eye), np.maximum(ends.max(axis=0) + margin, eye)
    spare = 0.5 * np.maximum(LEAST_GROUND * screw.head - (high - low), 0.0)
    low, high = low - spare, high + spare
    ground, moving = rectangle(*low, *high), tuple(_drawn_bodies(spec, solution, eye, pin))
    places, reached = screw_positions(ground, moving, screw.head)
    if not reached and sheet < screw.countersunk_height:
        faults[GROUND_SCREWS] = (
            f"below what moves, and a ground of {length_in_words(sheet)} is too thin for countersunk heads: use links "
            f"of {length_in_words(screw.countersunk_height)} ('mechanism.part.sheet')"
        )
    bodies = (
        PosedBody.polygon("ground", "held", ground),
        *rods.bodies(ends, pin),
        *(PosedBody.line("screw", "held", at[None], 0.5 * screw.diameter) for at in places),
    )
    parts = (
        *_parts(spec, solution, strength, (sheet, 2.0 * eye, pin), load, rods),
        ListedPart(
            "carries pivot and guide",
            "ground",
            1,
            _describe_strength(strength),
            "make",
            mm(*(high - low), sheet),
            "",
            "ground",
        ),
        guide_part(rods, pin, mechanism.guide is None),
        screw_part(GROUND_SCREWS, len(places), screw, sheet, "screw", countersunk=not reached),
    )
    rubbing = {"pins": {"diameter": pin}, "guide": {}}
    heads, thicker = screw.head_height if reached else 0.0, max(rods.slider_thickness - sheet, 0.0)
    drawn = (*bodies, *moving)
    return Hardware(with_faults(parts, faults), bodies, drawn, rubbing, describe_faults(faults), heads, thicker)


def _drawn_bodies(spec: SliderCrankSpec, solution: Solution, eye: float, pin: float) -> Iterator[PosedBody]:
    """Yield links, slider, springs and pins as the assembly shows them, the lowest first."""
    rates, pins = solution.assembly.rates, joints(solution, solution.unit_spring_curves)
    for name, k in (("crank", 0), ("coupler", 1)):
        yield PosedBody.line(name, "free", np.stack(pins[k : k + 2], axis=1), eye, round=True)
    corners = eye * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    yield PosedBody.polygon("slider", "driven", pins[2][:, None] + corners)
    for joint, name, rate in zip(pins, JOINT_NAMES, rates[:3], strict=False):
        if np.any(rate > 0.0):
            coils = [0.5 * coil.outer_diameter for coil in spec.mechanism.springs.coils_at(name)]
            yield PosedBody.line(f"spring-{name}", "free", joint[:, None], max(coils, default=0.8 * eye))
        yield PosedBody.line("joint", "free", joint[:, None], 0.5 * pin)


def joints(solution: Solution, units: UnitCurves) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pivot, crank pin and slider pin in all poses, (p, 2) each [m]."""
    link, angle, slid = solution.assembly.linkage, np.atleast_2d(units.angle)[0], np.atleast_2d(units.position)[0]
    pin = link.crank * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.zeros_like(pin), pin, np.column_stack([slid, np.full(slid.size, link.offset)])


def _sheet(loads: LinkLoads, width: float, hole: float, strength: PartStrength, system: Any) -> float:
    """Return the thinnest sheet of links as wide as drawn that bears tension and bending [m]."""
    series = series_of("sheet", system or "metric", strength.name) or series_of("sheet", "metric", DEFAULT_MATERIAL)
    assert series is not None
    worst = [float(np.max(link_stress(loads.axial, loads.moment, width, sheet, hole))) for sheet in series.sizes]
    bearing = (size for size, stress in zip(series.sizes, worst, strict=True) if stress <= strength.allowable)
    return next(bearing, series.sizes[-1])


def _describe_strength(strength: PartStrength) -> str:
    return strength.name + (", assumed" if strength.assumed else "")


def _guide_loads(spec: SliderCrankSpec, solution: Solution) -> tuple[float, float, float, Any]:
    """Return loads across the guide and along it [N], the slider's travel [m], and both ends of its pin's way [m]."""
    slid = np.atleast_2d(solution.unit_spring_curves.position)[0]
    coupler, guide = (np.ravel(entry) for entry in solution.reactions)
    across, pulled = (float(np.abs(entry[np.isfinite(entry)]).max(initial=0.0)) for entry in (guide, coupler))
    legs, offset = spec.mechanism.sets, float(solution.assembly.linkage.offset)
    at = np.array([[float(slid.min()), offset], [float(slid.max()), offset]])
    return across * legs, pulled * legs, float(np.ptp(slid)), at


def _tallest_spring(spec: SliderCrankSpec, solution: Solution) -> float:
    """Return how much of a pin its torsion springs take, wound up [m]; zero where no wire is known."""
    turns = solution.extremes.largest_turns[:, 0]
    heights = dict.fromkeys(JOINT_NAMES[:3], 0.0)
    for entry in spec.mechanism.springs.bought:
        if entry.at in heights and entry.coil is not None:
            turn = float(turns[JOINT_NAMES.index(entry.at)])
            heights[entry.at] += entry.count * entry.coil.body_length_wound_up(turn)
    return max(heights.values())


def _parts(
    spec: SliderCrankSpec,
    solution: Solution,
    strength: PartStrength,
    sizes: tuple[float, float, float],
    load: float,
    rods: GuideRods,
) -> Iterator[ListedPart]:
    """Yield links, slider, pins and springs."""
    mechanism, legs, link = spec.mechanism, spec.mechanism.sets, solution.assembly.linkage
    sheet, width, pin = sizes
    thick = max(sheet, rods.slider_thickness)
    for name, length in (("crank", link.crank), ("coupler", link.coupler)):
        holes = f"{mm(float(length))} between holes of {hole_with_fit(pin, 8)}"
        data = f"{_describe_strength(strength)}; {holes}; geometry/slider-crank.dxf"
        yield ListedPart("link", name, legs, data, "make", mm(float(length) + width, width, sheet), "", name)
    yield ListedPart(
        "on its guide",
        "slider",
        1,
        f"with a hole of {hole_with_fit(pin, 8)} between those of its guide",
        "make",
        mm(width, max(width, rods.slider_width(pin)), thick),
        "",
        "slider",
    )
    long = sheet + thick + _tallest_spring(spec, solution)
    yield pin_part("joints", 3 * legs, pin, long, load, "joint")
    for entry in mechanism.springs.bought:
        value = getattr(mechanism.springs, entry.at)
        rate = format_short(value, "stiffness" if entry.at == "slider" else "rotational_stiffness")
        kind = f"{entry.loaded or ''} spring".strip() if entry.at == "slider" else "torsion spring"
        data = ", ".join([kind, f"{rate} of all in one leg", *guide_words(entry)])
        wound = entry.wound
        size = f"wire {mm(wound.wire)}, coil {mm(wound.coil)}, {wound.turns:g} turns" if wound else ""
        yield ListedPart(
            entry.at.replace("_", " "), entry.name, entry.count * legs, data, "buy", size, "", f"spring-{entry.at}"
        )
    reference = {entry.at for entry in mechanism.springs.bought}
    for name, stiffness in zip(JOINT_NAMES, mechanism.springs.rates, strict=True):
        if stiffness > 0.0 and name not in reference:
            kind = "spring" if name == "slider" else "torsion spring"
            value = format_short(float(stiffness), "stiffness" if name == "slider" else "rotational_stiffness")
            yield ListedPart(
                name.replace("_", " "), "", legs, f"{kind}, {value}, not chosen", "buy", "", "", f"spring-{name}"
            )
