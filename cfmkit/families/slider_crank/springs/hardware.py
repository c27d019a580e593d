"""Links, pins, guide, ground and screws of a slider-crank with springs: what bears the loads of its motion.

Pins, the guide's rods and the screws of the ground bear what they take. Ground, crank and coupler lie on each other;
the slider lies below the coupler and may be thicker than a link. Heads of screws stand beside what moves; where there
is no place for them, they are sunk into the ground.

Links are as they are drawn, and no rigid lines: each is a bar with a hole at both ends, w wide and s thick. Along it
act an axial force N and a moment that runs linearly between its ends, where the torsion springs take hold. Counted are,
per leg and without friction:

- tension and bending in the section through a hole of diameter d: |N|/((w - d) s) + 6 w |M|/(s (w^3 - d^3));
- shear-out behind a pin, on two planes as long as the wall is thick: R/(s (w - d)), against the yield shear strength of
  von Mises, the allowable stress over sqrt(3);
- bearing of a pin: R/(d s);
- Euler's load out of the plane, the pins as hinges: pi^2 E w s^3/(12 L^2);
- the turn of one end of a link against the other under the moment k q of a torsion spring, all along the link:
  k L/(E I) times the spring's own turn q, I = s w^3/12. The true moment is smaller everywhere but at that end.

Assumes: both links of one sheet, equal pins; no load out of the plane (links lie beside each other, a sheet apart).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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
from cfmkit.families.slider_crank.springs.outline import eye_and_hole
from cfmkit.families.slider_crank.springs.sprung_linkage import coupler_angle, pull_on_coupler
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.specs.units import format_short
from cfmkit.stock.joint_strength import (
    SHEAR_SHARE,
    bearing_pressure,
    euler_load,
    link_stress,
    pin_bending,
    pin_that_bears,
    shear_out,
)
from cfmkit.stock.parts_list import ListedPart
from cfmkit.stock.springs.support_spec import guide_words
from cfmkit.stock.stock_series import ALL_SERIES, hole_with_fit, series_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.solution import Solution
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


STRENGTH_DEFINITIONS = {
    "link_stress_max": (
        "stress",
        "largest tension and bending in crank and coupler, in the section through a pin hole",
    ),
    "pin_bearing_max": ("stress", "largest force on a pin hole over its diameter and the thickness of the link"),
    "link_safety_factor": (
        "factor",
        "allowable stress of the links' material over what they bear: tension with bending, bearing of the pins, "
        "shear-out behind them; and Euler's load over the largest compression",
    ),
    "link_turn_share_max": (
        "ratio",
        "elastic turn of a link under the moment of a torsion spring at its end, over that spring's turn: k L/(E I)",
    ),
}


@dataclass(frozen=True)
class LinkLoads:
    """Loads on crank and coupler of one leg, at n places of the motion; of m mechanisms as rows.

    Rows of every (2, ..., n) array are crank and coupler. Where forces are unbounded there are zeros.
    """

    lengths: tuple[Any, Any]  # crank, coupler [m]
    axial: FloatArray  # (2, ..., n), tension positive [N]
    moment: FloatArray  # (2, ..., n), larger one of both ends, positive [N m]
    pin: FloatArray  # (..., n), force on each pin hole [N]
    springs: tuple[Any, Any]  # stiffest torsion spring at an end of each link [N m/rad]

    @cached_property
    def pin_max(self) -> Any:
        """Largest force on a pin hole [N]."""
        return self.pin.max(axis=-1)


@dataclass(frozen=True)
class LinkBar:
    """Section and material of crank and coupler; of m mechanisms arrays (m,)."""

    width: Any  # [m]
    sheet: Any  # thickness [m]
    hole: Any  # diameter [m]
    modulus: Any  # [Pa]

    def stress(self, loads: LinkLoads) -> Any:
        """Return the largest tension and bending in the section through a hole [Pa]."""
        w, d, s = (np.asarray(size)[..., None] for size in (self.width, self.hole, self.sheet))
        return link_stress(loads.axial, loads.moment, w, s, d).max(axis=(0, -1))

    def bearing(self, loads: LinkLoads) -> Any:
        """Return the largest pressure of a pin [Pa]."""
        return bearing_pressure(loads.pin_max, self.hole, self.sheet)

    def shear_out(self, loads: LinkLoads) -> Any:
        """Return the largest shear stress behind a pin [Pa]."""
        return shear_out(loads.pin_max, self.width, self.sheet, self.hole)

    def turn_share(self, loads: LinkLoads) -> Any:
        """Return the largest elastic turn of a link over that of the torsion spring at its end."""
        bending = self.modulus * self.sheet * self.width**3 / 12.0
        crank, coupler = (rate * length for rate, length in zip(loads.springs, loads.lengths, strict=True))
        return np.maximum(crank, coupler) / bending

    def safety(self, loads: LinkLoads, allowable: Any) -> Any:
        """Return by what all loads may grow, at least 1 where the links bear them; infinite without any."""
        pressed = zip(np.maximum(-loads.axial, 0.0).max(axis=-1), loads.lengths, strict=True)
        used = (
            self.stress(loads) / allowable,
            self.bearing(loads) / allowable,
            self.shear_out(loads) / (SHEAR_SHARE * allowable),
            *(force / euler_load(self.modulus, self.width, self.sheet, length) for force, length in pressed),
        )
        with np.errstate(divide="ignore"):
            return 1.0 / np.max(np.broadcast_arrays(*used), axis=0)


def link_loads(assembly: Assembly, motion: FloatArray, legs: Any) -> LinkLoads:
    """Return what acts on the links of one leg along a motion, (n,) [rad or m]; as rows, (m, n) with `legs` (m,)."""
    units, link = assembly.units(motion), assembly.linkage
    per_leg = 1.0 / np.asarray(legs, dtype=float)[..., None]
    drive = assembly.total(units.effort) if assembly.drive == "force" else np.zeros(1)
    _, at_crank_pin, at_slider_pin, _ = assembly.weigh(units.turn)
    beta, angle = coupler_angle(link, units), units.angle
    pulled, across = pull_on_coupler(assembly, units, drive, beta)
    with np.errstate(divide="ignore", invalid="ignore"):
        at_pivot = link.crank * (-pulled * np.sin(angle) + across * np.cos(angle)) + at_crank_pin
        axial = [pulled * np.cos(link_angle) + across * np.sin(link_angle) for link_angle in (angle, beta)]
        moment = [np.maximum(np.abs(at_crank_pin), np.abs(at_end)) for at_end in (at_pivot, at_slider_pin)]
    loads = np.stack(np.broadcast_arrays(*axial, *moment, np.hypot(pulled, across))) * per_leg
    loads = np.where(np.isfinite(loads).all(axis=0), loads, 0.0)
    shape = assembly.rates.shape[1:2]  # () of one, (m,) of rows
    stiffest = (assembly.rates[k : k + 2].max(axis=0).reshape(shape) * per_leg[..., 0] for k in (0, 1))
    lengths = tuple(np.reshape(length, np.shape(length)[:1]) for length in (link.crank, link.coupler))
    return LinkLoads((lengths[0], lengths[1]), loads[:2], loads[2:4], loads[4], (next(stiffest), next(stiffest)))


def link_of(spec: SliderCrankSpec) -> LinkBar | None:
    """Return the links of a mechanism; None if their material or their thickness is not stated."""
    part, material = spec.mechanism.part, spec.mechanism.material
    if material is None or part is None or part.sheet is None:
        return None
    eye, hole = eye_and_hole(spec)
    return LinkBar(2.0 * eye, part.sheet, 2.0 * hole, material.modulus)


def allowable_of(spec: SliderCrankSpec) -> float | None:
    """Return the allowable stress of the links' material [Pa]; None if no strength is known."""
    material = spec.mechanism.material
    return None if material is None else material.allowable(spec.mechanism.safety_factor)


PIN_DIAMETERS = tuple(
    diameter for series in ALL_SERIES if series.standard == "ISO 2338" for diameter in series.sizes if diameter >= 1e-3
)
"""Pins of links [m]: the diameters of ISO 2338 from 1 mm on."""
LARGEST_TURN_SHARE = 0.01  # turn of a link over that of its spring up to which links count as rigid
WIDEST_SHARE = 0.5
"""Largest width of a link over the length of the shorter one: wider ones are plates, and bend as plates do."""
SIZE_MARGIN = 1.001  # sizes are larger by this share than just enough


def links_that_bear(
    loads: LinkLoads,
    sheet: float,  # thickness [m]
    strength: PartStrength,  # of the material, and of its pins
    least: float,  # thinnest wall that the process makes [m]
    widest_pin: float,  # largest diameter of a pin: torsion springs go around it [m]
) -> LinkBar | None:
    """Return the narrowest links of a sheet that bear their loads and stay straight; None if there are none."""
    pin = next((d for d in PIN_DIAMETERS if _pin_bears(d, loads, sheet, strength)), None)
    if pin is None or pin > widest_pin:
        return None
    low, high = pin + 2.0 * max(least, 0.25 * pin), WIDEST_SHARE * min(loads.lengths)

    modulus = strength.modulus

    def bears(width: float) -> bool:
        link = LinkBar(width, sheet, pin, modulus)
        return bool(
            link.safety(loads, strength.allowable) >= SIZE_MARGIN
            and SIZE_MARGIN * link.turn_share(loads) <= LARGEST_TURN_SHARE
        )

    if low > high or not bears(high):
        return None
    if bears(low):
        return LinkBar(low, sheet, pin, modulus)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if bears(middle) else (middle, high)
    return LinkBar(high, sheet, pin, modulus)


def least_sheet(loads: LinkLoads, modulus: float, allowable: float) -> float:
    """Return a thickness below which not even the widest links stay straight and bear their bending [m]."""
    widest = LinkBar(WIDEST_SHARE * min(loads.lengths), 1.0, 0.0, modulus)  # both go with one over the thickness
    return float(max(widest.turn_share(loads) / LARGEST_TURN_SHARE, widest.stress(loads) / allowable))


def _pin_bears(diameter: float, loads: LinkLoads, sheet: float, strength: PartStrength) -> bool:
    """Return True if a pin bears its load: in its hole, and bent between two links, whose middles are a sheet apart."""
    pressure = bearing_pressure(loads.pin_max, diameter, sheet)
    bent = pin_bending(loads.pin_max, sheet, diameter)
    return bool(SIZE_MARGIN * pressure <= strength.allowable and SIZE_MARGIN * bent <= strength.pins)


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
        screw_part(GROUND_SCREWS, len(places), screw, sheet, countersunk=not reached),
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
            heights[entry.at] += entry.count * entry.coil.room_for(turn)
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
        joint, wound = JOINTS_BY_NAME[entry.at], entry.wound
        rate = format_short(getattr(mechanism.springs, entry.at), joint.rate)
        kind = f"{entry.loaded or ''} spring".strip() if joint.motion == "length" else "torsion spring"
        data = ", ".join([kind, f"{rate} of all in one leg", *guide_words(entry)])
        size = f"wire {mm(wound.wire)}, coil {mm(wound.coil)}, {wound.turns:g} turns" if wound else ""
        count, name = entry.count * legs, f"spring-{entry.at}"
        yield ListedPart(joint.words, entry.name, count, data, "buy", size, "", name)
    listed = {entry.at for entry in mechanism.springs.bought}
    for joint, stiffness in zip(JOINTS_BY_NAME.values(), mechanism.springs.rates, strict=True):
        if stiffness > 0.0 and joint.name not in listed:
            kind = "spring" if joint.motion == "length" else "torsion spring"
            data = f"{kind}, {format_short(stiffness, joint.rate)}, not chosen"
            yield ListedPart(joint.words, "", legs, data, "buy", "", "", f"spring-{joint.name}")
