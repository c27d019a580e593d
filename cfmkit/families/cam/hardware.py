"""Braces, pins, shafts, bearings, guide and screws of a cam mechanism, dimensioned for the forces of its travel.

A brace hangs beside the plate on each side: it is pulled from its roller's shaft to the slider's pin, both of which
stand out of the plate by half of plate and brace. The springs hook on the ends of the shafts, beyond the braces; more
than one on a side hook above each other on bars that the shafts carry. Forces are the largest on both branches; where
they diverge at a dead point, the next computed ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import OUTLINE_TOLERANCE, Arc
from cfmkit.export.posed_part import PosedBody
from cfmkit.families.cam.outline import plate_contours
from cfmkit.families.cam.part_sizes import (
    BRACE_WIDTH,
    PLATE_THICKNESS,
    coil_diameter,
    count_of,
    pin_path,
    roller_path,
    stack_height,
)
from cfmkit.families.findings import mm as length_in_words
from cfmkit.families.findings import newton, rate
from cfmkit.families.hardware import (
    LEAST_WALL,
    Hardware,
    PartStrength,
    guide_part,
    guide_rod,
    in_sentences,
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
from cfmkit.stock.joint_strength import pin_that_bears
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


def hardware(solution: Solution) -> Hardware:
    """Return the parts of a solved mechanism."""
    spec = solution.assembly.spec
    mechanism = spec.mechanism
    plate, system = mechanism.plate, mechanism.plate.stock
    material = mechanism.contact.material if mechanism.contact else None
    strength = PartStrength.from_material(material, required_safety(spec))
    thick = plate.thickness or (mechanism.contact.width if mechanism.contact else PLATE_THICKNESS)
    brace, arm = min(thick, BRACE_WIDTH), 0.5 * (thick + min(thick, BRACE_WIDTH))
    pull, press, force = (_largest(solution, name) for name in ("brace", "contact", "slider"))
    pin, bears = pin_for(pull, arm, brace, strength, system)
    faults = {} if bears else {"slider pin": f"no pin of the series bears the {newton(pull)} of a brace"}
    if mechanism.pins is not None:
        pin, least = mechanism.pins.diameter, pin
        if pin_that_bears(pull, arm, brace, strength.allowable, strength.pins, (pin,)) is None:
            faults["slider pin"] = (
                f"too weak for the {newton(pull)} of a brace {length_in_words(arm)} beside it: use at least "
                f"{length_in_words(least)} ('mechanism.pins.diameter')"
            )
    hooks = _hooks(solution, brace)
    # half of the press at each brace, and the springs of a side beyond it
    shaft, bearing = _shaft(solution, press, 0.5 * arm + hooks.pull * hooks.arm / max(press, 1e-9), thick, strength)
    for place, diameter in (("slider pin", pin), ("shafts of the rollers", shaft)):
        if diameter > SHAFT_IN_ROLLER * 2.0 * mechanism.roller_radius:
            faults[place] = (
                f"{length_in_words(diameter)} thick for {newton(max(pull, press))}, too thick for a roller and a "
                f"slider of {length_in_words(2.0 * mechanism.roller_radius)}: make them larger"
            )
    sizes = mechanism.envelope
    stated = sizes.brace_width if sizes else 0.0
    width = stated or link_width(pull, brace, max(pin, shaft), strength)
    bar = hooks.bar_width(shaft, strength)
    if bar > MAX_BAR_WIDTH * mechanism.rest_half_width:
        faults["springs to the shafts"] = (
            f"{length_in_words(bar)} wide for springs {length_in_words(hooks.height)} high: use fewer springs"
        )
    across = float(np.hypot(abs(solution.assembly.loads.sideways[1]), solution.assembly.loads.off_plane))
    travel, radius = float(np.ptp(solution.travel)), mechanism.roller_radius
    rod = guide_rod(across, force, travel, 2.0 * radius, mechanism.guide, system, strength)
    holes = [edge for contour in cut_plate(solution)[1:] for edge in contour.edges if isinstance(edge, Arc)]
    count = max(len(holes), 2)
    needed = screw_for(force, thick, count, strength)
    screw = (screw_through(plate.hole_diameter) if holes else None) or needed
    if not screw_bears(screw, force, thick, count, strength):
        faults["plate to its base"] = (
            f"too weak for {newton(force)}: use {needed.name}, with holes of {length_in_words(needed.hole)} "
            "('mechanism.plate.hole_diameter')"
        )
    parts = tuple(_parts(solution, strength, (thick, brace, width), (pin, shaft, bearing), (pull, press), hooks.outer))
    parts = (*parts, *_hook_bars(hooks, bar, shaft, strength))
    parts = (*parts, guide_part(rod, 1, mechanism.guide is None))
    if holes:
        parts = (*parts, screw_part("plate to its base", len(holes), screw, thick, "screw"))
    standing = tuple(_standing(solution, rod.bush, rod.diameter, holes, screw))
    drawn = tuple(_drawn_bodies(solution, standing, (width, pin, shaft)))
    return Hardware(with_faults(parts, faults), standing, drawn, pin, in_sentences(faults))


@dataclass(frozen=True)
class _Hooks:
    """Springs of one side of the plate, which pull at one end of each shaft."""

    pull: float  # of all of them [N]
    arm: float  # from the middle of a brace to their middle, along the shaft [m]
    outer: float  # diameter of a coil [m]
    height: float  # of those above each other [m]; zero if one hooks on the shaft itself
    thickness: float  # of the bar that carries them [m]

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


def _hooks(solution: Solution, brace: float) -> _Hooks:
    springs = solution.assembly.spec.mechanism.springs
    stretch, half_width = float(solution.elongation.max()), solution.assembly.spec.mechanism.rest_half_width
    count, outer = count_of(springs), coil_diameter(springs, stretch, half_width) or 0.0
    share = (count + 1) // 2 / count
    pull = share * (springs.total * stretch + springs.initial_tension * count)
    height = stack_height(outer, count) if count > 2 else 0.0
    return _Hooks(pull, 0.5 * (brace + outer), outer, height, min(brace, outer))


def _hook_bars(hooks: _Hooks, width: float, shaft: float, strength: PartStrength) -> Iterator[ListedPart]:
    """Yield the bars that carry springs above each other, at both ends of both shafts."""
    if hooks.height:
        of = strength.name + (", assumed" if strength.assumed else "")
        data = f"{of}; a hole of {mm(shaft)} in its middle and one for each hook, bears {newton(hooks.pull)}"
        yield ListedPart("springs to the shafts", "hook bar", 4, data, "make", mm(hooks.height, width, hooks.thickness))


def _largest(solution: Solution, name: str) -> float:
    """Return the largest finite force of a kind on both branches [N]."""
    values = np.concatenate([np.ravel(getattr(entry, name)) for entry in (solution.up, solution.down)])
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def cut_plate(solution: Solution) -> tuple[Contour, ...]:
    """Return the outline of the plate and its holes."""
    profile = solution.assembly.track.profile
    return plate_contours((profile, profile), solution.assembly.spec.mechanism.plate)


def _shaft(
    solution: Solution, press: float, arm: float, thick: float, strength: PartStrength
) -> tuple[float, Bearing | None]:
    """Return the diameter of a roller's shaft [m] and its bearing: of the stated bore, or the smallest that bears."""
    mechanism = solution.assembly.spec.mechanism
    least, _ = pin_for(press, arm, thick, strength, mechanism.plate.stock)
    most = BEARING_IN_ROLLER * 2.0 * mechanism.roller_radius
    if mechanism.bearings is not None:
        result = [entry for entry in bearings_of(mechanism.bearings.bore) if entry.outer <= most]
        return mechanism.bearings.bore, next(iter(result), None)
    fitting = sorted(
        (entry for entry in BALL_BEARINGS if entry.bore >= least and entry.outer <= most), key=lambda entry: entry.outer
    )
    return (fitting[0].bore, fitting[0]) if fitting else (least, None)


def _springs_in_words(mechanism: Mechanism) -> str:
    """Return what the springs between the rollers must be."""
    springs = mechanism.springs
    rates = springs.each if isinstance(springs.each, tuple) else (springs.each,)
    limit = f", up to {length_in_words(springs.max_elongation)}" if springs.max_elongation else ""
    opens = f", initial tension {newton(springs.initial_tension)}" if springs.initial_tension else ""
    tight = f", stretched by {length_in_words(mechanism.preload)} at the start" if mechanism.preload else ""
    reported = " to ".join(dict.fromkeys((rate(min(rates)), rate(max(rates)))))
    return f"extension spring, {reported}{opens}{limit}{tight}"


def _parts(
    solution: Solution,
    strength: PartStrength,
    sizes: tuple[float, float, float],
    pins: tuple[float, float, Bearing | None],
    loads: tuple[float, float],
    coil: float,
) -> Iterator[ListedPart]:
    """Yield plate, braces, rollers, slider, pins, shafts, bearings and springs."""
    mechanism = solution.assembly.spec.mechanism
    (thick, brace, width), (pin, shaft, bearing), (pull, press) = sizes, pins, loads
    x0, y0, x1, y1 = cut_plate(solution)[0].extents
    of = strength.name + (", assumed" if strength.assumed else "")
    radius = mechanism.roller_radius
    yield ListedPart("cam", "cam plate", 1, f"{of}; geometry/cam.dxf", "make", mm(x1 - x0, y1 - y0, thick), "", "plate")
    ends = " and ".join(hole_with_fit(diameter, 8) for diameter in (pin, shaft))
    data = f"{of}; {mm(mechanism.brace_length)} between holes of {ends}, bears {newton(pull)}"
    length = mechanism.brace_length + width
    yield ListedPart("roller to slider", "brace", 2, data, "make", mm(length, width, brace), "", "brace")
    size = f"diameter {mm(2.0 * radius)}, {mm(thick)} wide"
    seat = hole_with_fit(shaft, 8) if bearing is None else f"{hole_with_fit(bearing.outer, 7)} for its bearing"
    data = f"with a hole of {seat}, presses with {newton(press)}"
    yield ListedPart("on the cam", "roller", 2, data, "make", size, "", "roller")
    size = mm(2.0 * radius, 2.0 * radius, thick)
    yield ListedPart("on its guide", "slider", 1, f"with a hole of {hole_with_fit(pin, 8)}", "make", size, "", "slider")
    yield pin_part("slider pin", 1, pin, thick + 2.0 * brace, 2.0 * pull, "slider pin")
    long = thick + 2.0 * brace + min(count_of(mechanism.springs), 2) * coil
    yield pin_part("shafts of the rollers", 2, shaft, long, press, "shaft")
    stated, count = mechanism.bearings, 2 * (mechanism.bearings.per_roller if mechanism.bearings else 1)
    if stated is not None:
        rated = f", C {newton(stated.dynamic_rating)}" if stated.dynamic_rating else ""
        rated += f", C0 {newton(stated.static_rating)}" if stated.static_rating else ""
        name = stated.name or (bearing.name if bearing and stated.kind == "ball" else "")
        size = mm(bearing.bore, bearing.outer, bearing.width) if bearing else f"bore {mm(stated.bore)}"
        data = f"{stated.kind} bearing, bore {length_in_words(stated.bore)}{rated}"
        yield ListedPart("in the rollers", name, count, data, "buy", size, "DIN 625-1" if bearing else "")
    elif bearing is not None:
        size = mm(bearing.bore, bearing.outer, bearing.width)
        yield ListedPart(
            "in the rollers", bearing.name, count, "ball bearing, its life not judged", "buy", size, "DIN 625-1"
        )
    springs = mechanism.springs
    wound = springs.wound
    size = f"wire {mm(wound.wire)}, coil {mm(wound.coil)}, {wound.turns:g} turns" if wound else ""
    data, number = _springs_in_words(mechanism), count_of(springs)
    yield ListedPart("between the rollers", springs.name or "", number, data, "buy", size, "", "spring")


def _standing(solution: Solution, bush: float, diameter: float, holes: list[Arc], screw: Screw) -> Iterator[PosedBody]:
    """Yield the rod that guides the slider over its way, and the heads of the screws in the plate."""
    heights = pin_path(solution)[:, 1]
    ends = np.array([[0.0, float(heights.min()) - 0.5 * bush], [0.0, float(heights.max()) + 0.5 * bush]])
    yield PosedBody.line("guide", "held", ends, 0.5 * diameter)
    yield from (PosedBody.line("screw", "held", np.array([hole.center]), 0.5 * screw.head) for hole in holes)


def _drawn_bodies(
    solution: Solution, standing: tuple[PosedBody, ...], sizes: tuple[float, float, float]
) -> Iterator[PosedBody]:
    """Yield all parts as the assembly shows them, the lowest first: for braces, slider pin and shafts their widths."""
    width, pin, shaft = sizes
    rollers, pins, radius = roller_path(solution), pin_path(solution), solution.assembly.spec.mechanism.roller_radius
    mirror = np.array([-1.0, 1.0])
    yield from (body for body in standing if body.name == "guide")
    yield PosedBody.polygon("plate", "held", cut_plate(solution)[0].points(OUTLINE_TOLERANCE))
    yield from (body for body in standing if body.name == "screw")
    yield PosedBody.line("spring", "free", np.stack([rollers, rollers * mirror], axis=1), 0.35 * width)
    for side in (np.ones(2), mirror):
        yield PosedBody.line("roller", "contact", (rollers * side)[:, None], radius)
        ends: FloatArray = np.stack([rollers * side, pins], axis=1)
        yield PosedBody.line("brace", "free", ends, 0.5 * width, round=True)
        yield PosedBody.line("shaft", "free", (rollers * side)[:, None], 0.5 * shaft)
    corners = radius * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    yield PosedBody.polygon("slider", "driven", pins[:, None] + corners)
    yield PosedBody.line("slider pin", "driven", pins[:, None], 0.5 * pin)
