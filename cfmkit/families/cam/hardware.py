"""Braces, pins, shafts, bearings, guide and screws of a cam mechanism, dimensioned for the forces of its travel.

Each roller has a brace on both sides of the plate, pulled from the roller's shaft to the slider's pin, both of which
stand out of the plate by half of plate and brace. Those of both rollers share a side: at the slider's pin each is half
as thick, so that an eye there bears as much as a whole one with all of the pull. The pin moves over the plate: outside
of the braces there is half of the slider on each side, on two rods, with a pin of its own. The springs hook on the ends
of the shafts, beyond these; more than one on a side hook above each other on bars that the shafts carry. Forces are the
largest on both branches; where they diverge at a dead point, the next computed ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.export.contours import OUTLINE_TOLERANCE, Arc
from cfmkit.export.posed_part import PosedBody
from cfmkit.families.cam.outline import CutPlate
from cfmkit.families.cam.part_sizes_and_clearances import (
    BRACE_WIDTH,
    PLATE_THICKNESS,
    stack_height,
    wire_and_coil,
)
from cfmkit.families.findings import mm as length_in_words
from cfmkit.families.findings import newton, rate
from cfmkit.families.hardware import (
    LEAST_WALL,
    GuideRods,
    Hardware,
    PartStrength,
    describe_faults,
    guide_part,
    guide_rods,
    link_width,
    mm,
    pin_for,
    pin_part,
    required_safety,
    screw_bears,
    screw_for,
    screw_part,
    with_faults,
)
from cfmkit.stock.joint_strength import pin_bending, pin_that_bears
from cfmkit.stock.parts_list import ListedPart
from cfmkit.stock.stock_series import BALL_BEARINGS, bearings_of, hole_with_fit, screw_through

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.export.contours import Contour
    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.spec import Mechanism
    from cfmkit.stock.stock_series import Bearing, Screw

BEARING_IN_ROLLER = 0.9  # outside diameter of a bearing over that of the roller around it, at most
SHAFT_IN_ROLLER = 0.7
"""Diameter of a plain shaft over that of the roller around it, and of the pin over the slider's side, at most."""
MAX_BAR_WIDTH = 1.0
"""Width of a bar for springs over half of the rollers' distance at the start, at most: two of them stand in it."""


@dataclass(frozen=True)
class _SizingLoads:
    """Largest forces, thicknesses, and stresses that parts may have: sizes of parts follow from these."""

    mechanism: Mechanism
    strength: PartStrength
    thickness: float  # of plate, rollers and slider [m]
    brace: float  # thickness of a brace [m]
    pull: float  # of both braces of a roller [N]
    press: float  # of a roller on the cam [N]
    force: float  # on the slider [N]
    rods: GuideRods  # of both halves of the slider
    hooks: _Hooks

    @classmethod
    def from_solution(cls, solution: Solution) -> _SizingLoads:
        """Return those of a solved mechanism."""
        spec, loads = solution.assembly.spec, solution.assembly.loads
        mechanism, plate, contact = spec.mechanism, spec.mechanism.plate, spec.mechanism.contact
        strength = PartStrength.from_material(contact.material if contact else None, required_safety(spec))
        thickness = plate.thickness or (contact.width if contact else PLATE_THICKNESS)
        brace = min(thickness, BRACE_WIDTH)
        pull, press, force = (_largest(solution, name) for name in ("brace", "contact", "slider"))
        across, travel = float(np.hypot(abs(loads.sideways[1]), loads.off_plane)), float(np.ptp(solution.travel))
        side = 2.0 * mechanism.roller_radius
        rods = guide_rods(4, across, force, travel, side, mechanism.guide, plate.stock, strength)
        hooks = _make_hooks(solution, brace, rods.slider_thickness)
        return cls(mechanism, strength, thickness, brace, pull, press, force, rods, hooks)

    @property
    def material(self) -> str:
        """Material of plates and links, as the list has it."""
        return self.strength.name + (", assumed" if self.strength.assumed else "")

    @property
    def side(self) -> float:
        """Diameter of a roller, and side of the slider [m]."""
        return 2.0 * self.mechanism.roller_radius

    @property
    def thinnest_shaft(self) -> float:
        """Shaft that bears half of the press at each brace, and the springs of a side beyond it [m]."""
        arm = 0.25 * (self.thickness + self.brace) + self.hooks.pull * self.hooks.arm / max(self.press, 1e-9)
        return pin_for(self.press, arm, self.thickness, self.strength, self.mechanism.plate.stock)[0]


class _Sizes(NamedTuple):
    """Diameters of slider pin and shafts, what is on a shaft, and widths of braces and of bars for springs [m]."""

    pin: float
    shaft: float
    bearing: Bearing | None
    brace: float
    bar: float


def hardware(solution: Solution) -> Hardware:
    """Return the parts of a solved mechanism."""
    mechanism, loads, faults = solution.assembly.spec.mechanism, _SizingLoads.from_solution(solution), dict[str, str]()
    hooks, rods, side = loads.hooks, loads.rods, loads.side
    pin, (shaft, bearing) = _slider_pin(loads, faults), _shaft(loads, faults)
    for place, diameter in (("slider pin", pin), ("shafts of the rollers", shaft)):
        if diameter > SHAFT_IN_ROLLER * side:
            faults[place] = (
                f"{length_in_words(diameter)} thick for {newton(max(loads.pull, loads.press))}, too thick for a roller "
                f"and a slider of {length_in_words(side)}: make them larger"
            )
    stated = mechanism.envelope.brace_width if mechanism.envelope else 0.0
    width = stated or link_width(loads.pull, loads.brace, max(pin, shaft), loads.strength)
    sizes = _Sizes(pin, shaft, bearing, width, hooks.bar_width(shaft, loads.strength))
    if sizes.bar > MAX_BAR_WIDTH * mechanism.rest_half_width:
        faults["springs to the shafts"] = (
            f"{length_in_words(sizes.bar)} wide for springs {length_in_words(hooks.height)} high: use fewer springs"
        )
    if 0.5 * rods.slider_width(pin) + 0.5 * shaft > mechanism.rest_half_width:
        faults["guide of the slider"] = (
            f"{length_in_words(rods.slider_width(pin))} wide with rods of {length_in_words(rods.diameter)}, in the "
            "way of the rollers' shafts: start farther out ('mechanism.rest_half_width')"
        )
    holes = [edge for contour in cut_plate(solution)[1:] for edge in contour.edges if isinstance(edge, Arc)]
    screw = _screw(loads, len(holes), faults)
    parts = [*_parts(solution, loads, sizes), guide_part(rods, pin, mechanism.guide is None)]
    if holes:
        parts.append(screw_part("plate to its base", len(holes), screw, loads.thickness))
    standing = tuple(_standing(solution, rods, pin, holes, screw))
    drawn = tuple(_drawn_bodies(solution, standing, hooks, sizes))
    rubbing: dict[str, dict[str, float]] = {"pins": {"diameter": pin}, "guide": {}}
    if bearing is None and mechanism.bearings is None:
        rubbing["bearings"] = {"bore": shaft}
    around = *(body for body in drawn if body.name == "brace"), *_box_of_springs(solution, hooks, sizes.bar)
    return Hardware(
        with_faults(parts, faults),
        (*standing, *around),
        drawn,
        rubbing,
        describe_faults(faults),
        screw.head_height if holes else 0.0,
        2.0 * rods.slider_thickness,
    )


def _slider_pin(loads: _SizingLoads, faults: dict[str, str]) -> float:
    """Return the stated slider pin, or the thinnest that bears [m]; faults are added."""
    stated = loads.mechanism.pins
    arm, thin = 0.5 * (loads.brace + loads.rods.slider_thickness), min(loads.brace, loads.rods.slider_thickness)
    pin, bears = pin_for(loads.pull, arm, thin, loads.strength, loads.mechanism.plate.stock)
    if not bears:
        faults["slider pin"] = f"no pin of the series bears the {newton(loads.pull)} of a brace"
    if stated is None:
        return pin
    allowable = loads.strength.allowable, loads.strength.pins
    if pin_that_bears(loads.pull, arm, thin, *allowable, (stated.diameter,)) is None:
        faults["slider pin"] = (
            f"too weak for the {newton(loads.pull)} of a brace {length_in_words(arm)} beside it: use at least "
            f"{length_in_words(pin)} ('mechanism.pins.diameter')"
        )
    return stated.diameter


def _screw(loads: _SizingLoads, holes: int, faults: dict[str, str]) -> Screw:
    """Return the screw that goes through the holes of the plate, or one that bears; faults are added."""
    count = max(holes, 2)
    needed = screw_for(loads.force, loads.thickness, count, loads.strength)
    screw = (screw_through(loads.mechanism.plate.hole_diameter) if holes else None) or needed
    if not screw_bears(screw, loads.force, loads.thickness, count, loads.strength):
        faults["plate to its base"] = (
            f"too weak for {newton(loads.force)}: use {needed.name}, with holes of {length_in_words(needed.hole)} "
            "('mechanism.plate.hole_diameter')"
        )
    return screw


@dataclass(frozen=True)
class _Hooks:
    """Springs of one side of the plate, which pull at one end of each shaft."""

    pull: float  # of all of them [N]
    arm: float  # from the middle of a brace to their middle, along the shaft [m]
    outer: float  # diameter of a coil [m]
    loop: float  # inside of a loop [m]
    height: float  # of those above each other [m]; zero if one hooks on the shaft itself
    thickness: float  # of the bar that carries them [m]

    def seat(self, shaft: float) -> float:
        """Return the diameter of the shafts' ends where springs hook on them [m]: as thick as goes into the loops."""
        return shaft if self.height or self.loop >= shaft else 1e-4 * math.floor(1e4 * self.loop + 1e-6)

    def places(self, count: int) -> FloatArray:
        """Return how far above the shaft each spring of one side hooks, of so many in all (n,) [m]."""
        rows = (count + 1) // 2 if self.height else 1
        half = 0.5 * max(self.height - self.outer, 0.0)
        return np.linspace(-half, half, rows) if rows > 1 else np.zeros(1)

    def bar_width(self, hole: float, strength: PartStrength) -> float:
        """Return the width of a bar around a shaft's hole that bears the upper and lower springs [m]; zero for none.

        The resultant of each half acts at a quarter of the height.
        """
        if not self.height:
            return 0.0
        moment, width = 0.125 * self.pull * self.height, hole
        while 6.0 * moment * width > strength.allowable * self.thickness * (width**3 - hole**3):
            width += 1e-3
        return max(width, hole * (1.0 + 2.0 * LEAST_WALL))


def _make_hooks(solution: Solution, brace: float, slider: float) -> _Hooks:
    springs = solution.assembly.spec.mechanism.springs
    stretch, half_width = float(solution.elongation.max()), solution.assembly.spec.mechanism.rest_half_width
    count, (wire, coil) = springs.number, wire_and_coil(springs, stretch, half_width) or (0.0, math.inf)
    outer = wire + coil if wire else 0.0
    share = (count + 1) // 2 / count
    pull = share * (springs.total * stretch + springs.initial_tension * count)
    height = stack_height(outer, count) if count > 2 else 0.0
    return _Hooks(pull, 0.5 * (brace + outer) + slider, outer, coil - wire, height, min(brace, outer))


def _largest(solution: Solution, name: str) -> float:
    """Return the largest finite force of a kind on both branches [N]."""
    values = np.concatenate([np.ravel(getattr(entry, name)) for entry in (solution.up, solution.down)])
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def cut_plate(solution: Solution) -> tuple[Contour, ...]:
    """Return the outline of the plate and its holes."""
    profile = solution.assembly.track.profile
    return CutPlate((profile, profile), solution.assembly.spec.mechanism.plate).contours


def roller_shaft(solution: Solution) -> tuple[float, Bearing | None]:
    """Return the diameter of the rollers' shafts [m] and the ball bearing on each; None if the roller turns on it."""
    return _shaft(_SizingLoads.from_solution(solution), {})


def _shaft(loads: _SizingLoads, faults: dict[str, str]) -> tuple[float, Bearing | None]:
    """Return the stated shaft of a roller or the thinnest that bears [m], and its ball bearing; faults are added."""
    least, most, stated = loads.thinnest_shaft, BEARING_IN_ROLLER * loads.side, loads.mechanism.bearings
    if stated is None:
        inside = [entry for entry in BALL_BEARINGS if entry.outer <= most and entry.width <= loads.thickness]
        fitting = [entry for entry in inside if entry.bore >= least]
        bearing = min(fitting, key=lambda entry: entry.outer, default=None)
        shaft = bearing.bore if bearing else least
    else:
        bearings = bearings_of(stated.bore) if stated.kind != "plain" else ()
        shaft, bearing = stated.bore, next((entry for entry in bearings if entry.outer <= most), None)
        if shaft < least * (1 - 1e-9):
            faults["shafts of the rollers"] = (
                f"too weak for {newton(loads.press)} and the springs: use at least {length_in_words(least)} "
                "('mechanism.bearings.bore')"
            )
    hooks = loads.hooks
    if pin_bending(hooks.pull, 0.5 * hooks.outer, hooks.seat(shaft)) > loads.strength.pins:
        faults["between the rollers"] = (
            f"their loops, {length_in_words(hooks.loop)} inside, do not go over shafts of {length_in_words(shaft)}, "
            f"and ends turned to that break under {newton(hooks.pull)}: use wider coils, or more springs"
        )
    return shaft, bearing


def _springs_in_words(mechanism: Mechanism, hooks: _Hooks, shaft: float) -> str:
    """Return what the springs between the rollers must be, and how long: the insides of loops lie beyond the axes."""
    springs = mechanism.springs
    limit = f", up to {length_in_words(springs.max_elongation)}" if springs.max_elongation else ""
    opens = f", initial tension {newton(springs.initial_tension)}" if springs.initial_tension else ""
    tight = f", stretched by {length_in_words(mechanism.preload)} at the start" if mechanism.preload else ""
    reported = " to ".join(dict.fromkeys((rate(min(springs.rates)), rate(max(springs.rates)))))
    relaxed = 2.0 * mechanism.springs_rest + springs.tension_stretch
    where = "between the axes of the bars' holes" if hooks.height else "between the axes of the shafts"
    inside = "" if hooks.height else f" ({mm(relaxed + hooks.seat(shaft))} inside the loops)"
    return f"extension spring, {reported}{opens}{limit}{tight}, relaxed {mm(relaxed)} {where}{inside}"


def _parts(solution: Solution, loads: _SizingLoads, sizes: _Sizes) -> Iterator[ListedPart]:
    """Yield plate, braces, rollers, slider, pins, shafts, bearings, springs, and the bars that these hook on."""
    mechanism, thick, brace, hooks = loads.mechanism, loads.thickness, loads.brace, loads.hooks
    (pin, shaft, bearing, width, bar), half, stated = sizes, loads.rods.slider_thickness, mechanism.bearings
    of = loads.material
    x0, y0, x1, y1 = cut_plate(solution)[0].extents
    yield ListedPart("cam", "cam plate", 1, f"{of}; geometry/cam.dxf", "make", mm(x1 - x0, y1 - y0, thick), "", "plate")
    ends = " and ".join(hole_with_fit(diameter, 8) for diameter in (pin, shaft))
    data = (
        f"{of}; {mm(mechanism.brace_length)} between holes of {ends}, bears {newton(0.5 * loads.pull)}; half as thick "
        "at the slider, beside that of the other roller"
    )
    length = mechanism.brace_length + width
    yield ListedPart("roller to slider", "brace", 4, data, "make", mm(length, width, brace), "", "brace")
    size = f"diameter {mm(loads.side)}, {mm(thick)} wide"
    seat = hole_with_fit(shaft, 8) if bearing is None else f"{hole_with_fit(bearing.outer, 7)} for its bearing"
    data = f"with a hole of {seat}, presses with {newton(loads.press)}"
    yield ListedPart("on the cam", "roller", 2, data, "make", size, "", "roller")
    data = f"half, outside of the braces, with a hole of {hole_with_fit(pin, 8)} between those of its guide"
    size = mm(max(loads.side, loads.rods.slider_width(pin)), loads.side, half)
    yield ListedPart("on its guide", "slider", 2, data, "make", size, "", "slider")
    yield pin_part("slider pin", 2, pin, brace + half, loads.pull, "slider pin")
    long = thick + 2.0 * (brace + half) + min(mechanism.springs.number, 2) * hooks.outer
    shafts = pin_part("shafts of the rollers", 2, shaft, long, loads.press, "shaft")
    end = hooks.seat(shaft)
    yield shafts if end == shaft else replace(shafts, data=f"{shafts.data}, ends turned to {mm(end)} for the loops")
    count = 2 * (stated.per_roller if stated else 1)
    if stated is not None and stated.kind != "plain":
        rated = f", C {newton(stated.dynamic_rating)}" if stated.dynamic_rating else ""
        rated += f", C0 {newton(stated.static_rating)}" if stated.static_rating else ""
        name = stated.name or (bearing.name if bearing and stated.kind == "ball" else "")
        size = mm(bearing.bore, bearing.outer, bearing.width) if bearing else f"bore {mm(stated.bore)}"
        data = f"{stated.kind} bearing, bore {length_in_words(stated.bore)}{rated}"
        standard, body = ("DIN 625-1", "bearing") if bearing else ("", "")
        yield ListedPart("in the rollers", name, count, data, "buy", size, standard, body)
    elif stated is None and bearing is not None:
        size = mm(bearing.bore, bearing.outer, bearing.width)
        data = "ball bearing, its life not judged"
        yield ListedPart("in the rollers", bearing.name, count, data, "buy", size, "DIN 625-1", "bearing")
    springs, wound = mechanism.springs, mechanism.springs.wound
    size = f"wire {mm(wound.wire)}, coil {mm(wound.coil)}, {wound.turns:g} turns" if wound else ""
    data, number = _springs_in_words(mechanism, hooks, shaft), springs.number
    yield ListedPart("between the rollers", springs.name or "", number, data, "buy", size, "", "spring")
    if hooks.height:  # springs above each other, at both ends of both shafts
        holes = f"a hole of {mm(shaft)} in its middle and one for each hook, bears {newton(hooks.pull)}"
        size = mm(hooks.height, bar, hooks.thickness)
        data = f"{of}; {holes}"
        yield ListedPart("springs to the shafts", "hook bar", 4, data, "make", size, body="hook bar")


def _standing(solution: Solution, rods: GuideRods, pin: float, holes: list[Arc], screw: Screw) -> Iterator[PosedBody]:
    """Yield the rods that guide the slider over its way, and the heads of the screws in the plate."""
    heights = solution.pin_path[:, 1]
    ends = np.array([[0.0, float(heights.min()) - 0.5 * rods.bush], [0.0, float(heights.max()) + 0.5 * rods.bush]])
    yield from rods.bodies(ends, pin)
    yield from (PosedBody.line("screw", "held", np.array([hole.center]), 0.5 * screw.head) for hole in holes)


def _box_of_springs(solution: Solution, hooks: _Hooks, bar: float) -> Iterator[PosedBody]:
    """Yield the box of the springs, as high as those on one side above each other, with their loops or hook bars."""
    if hooks.outer:
        beyond, half = 0.5 * (bar or hooks.outer), 0.5 * max(hooks.height, hooks.outer)
        x, y = solution.roller_path.T + np.array([[beyond], [0.0]])
        corners = np.stack([[-x, y - half], [x, y - half], [x, y + half], [-x, y + half]])
        yield PosedBody.polygon("springs", "free", corners.transpose(2, 0, 1))


def _drawn_bodies(
    solution: Solution, standing: tuple[PosedBody, ...], hooks: _Hooks, sizes: _Sizes
) -> Iterator[PosedBody]:
    """Yield all parts as the assembly shows them, the lowest first (guide and slider are outside of the braces)."""
    rollers, pins, mechanism = solution.roller_path, solution.pin_path, solution.assembly.spec.mechanism
    radius = mechanism.roller_radius
    mirror = np.array([-1.0, 1.0])
    yield PosedBody.polygon("plate", "held", cut_plate(solution)[0].points(OUTLINE_TOLERANCE))
    yield from (body for body in standing if body.name == "screw")
    thick = min(0.35 * sizes.brace, 0.5 * hooks.outer)
    for place in hooks.places(mechanism.springs.number):
        hook = rollers + np.array([0.0, place])
        yield PosedBody.line("spring", "free", np.stack([hook, hook * mirror], axis=1), thick)
    for side in (np.ones(2), mirror):
        yield PosedBody.line("roller", "contact", (rollers * side)[:, None], radius)
        if sizes.bearing is not None:
            yield PosedBody.line("bearing", "free", (rollers * side)[:, None], 0.5 * sizes.bearing.outer)
        ends: FloatArray = np.stack([rollers * side, pins], axis=1)
        yield PosedBody.line("brace", "free", ends, 0.5 * sizes.brace, round=True)
        if hooks.height:
            tall = np.array([[0.0, -0.5], [0.0, 0.5]]) * hooks.height
            yield PosedBody.line("hook bar", "free", (rollers * side)[:, None] + tall, 0.5 * sizes.bar)
        yield PosedBody.line("shaft", "free", (rollers * side)[:, None], 0.5 * sizes.shaft)
    yield from (body for body in standing if body.name == "guide")
    corners = radius * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    yield PosedBody.polygon("slider", "driven", pins[:, None] + corners)
    yield PosedBody.line("slider pin", "driven", pins[:, None], 0.5 * sizes.pin)
