"""From a request to cams worth designing: closed forms of size, ripple, undercut and springs over many proportions.

With D = x - x0 the travel is s = D^2/(2A), the springs are stretched by 2D and add up to K = F/(4A) [SS, eq. 1].
Friction makes F/F0 = 1 +- mu (1 + f^2) A/D with the path's slope f = D/A + tan a; the roller fits the path's start if
its radius is below 1/(cos^3 a0/A + 1/l). Where hysteresis is limited, pins of radius r_p at the slider and at the
springs add mu_p r_p (A/(D cos a) + 1)/(l cos a): forces of brace and spring times how far the brace turns.
Without friction a roller presses on the cam with (F/2) sqrt(1 + f^2): half of the force along the travel, f times as
much across it.

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SolutionError
from cfmkit.families.cam.contact_pressure import YIELD_PRESSURE
from cfmkit.families.cam.hardware import BEARING_IN_ROLLER, SHAFT_IN_ROLLER, roller_shaft
from cfmkit.families.cam.model import analyze
from cfmkit.families.cam.part_sizes_and_clearances import BRACE_WIDTH, depth_of, stack_height, wire_and_coil
from cfmkit.families.cam.spec import CamSpec
from cfmkit.families.cam.springs_spec import Springs
from cfmkit.families.findings import mm
from cfmkit.families.hardware import PIN_STRENGTH, PartStrength, guide_rods, pin_for, pin_sizes
from cfmkit.families.proposals import Candidate, FamilyOffer, name_variant
from cfmkit.families.run_control import Run
from cfmkit.metrics import evaluate
from cfmkit.specs.units import Place
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.offers import as_stated, slimmest_spring
from cfmkit.stock.stock_series import BALL_BEARINGS

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.proposals import Request
    from cfmkit.stock.stock_series import Bearing

ROLLING_FRICTION = 0.002
"""Rolling resistance over roller radius: what [SS] measured on steel rollers; assumed for every material."""
SLIDING_FRICTION = 0.1
"""Friction of the plain slider pin, of the springs' hooks and of the guide where none is stated and hysteresis is
required: greased steel; assumed."""
PIN_SHARE = 0.25
"""Diameter of the slider pin and of the pins that springs hook on, over that of a roller, at least: assumed."""
USUAL_PIN_SHARE = 0.3  # the same of usual pins, which are rounded up to their series
PULL_MARGIN, CONTACT_MARGIN = 1.1, 1.1
"""On the pull of a brace, and on the force between roller and cam: friction adds to them."""
N_PROPORTIONS = 60_000  # proportions that are looked at
MAX_PROPOSALS = 16  # designs that are worth trying
TAB_HEIGHT_RATIO, TOP_MARGIN_RATIO, MAX_HOLE_DIAMETER = 0.06, 0.02, 0.0066
"""Height of the plate's tab and of its margin above the flanks over that of the envelope; largest fixing hole [m]."""
PLATE_MIN = 0.002  # thinnest plate [m]
ROLLER_MIN = 0.0015  # smallest radius of a roller [m]: that of the smallest usual ball bearings
THINNEST_SHAFT = 0.001  # of a roller [m]: the thinnest pin that is used
SHAFT_ARM = 0.004
"""About how far from the braces a roller presses on its shaft [m]: half of a plate of 5 mm and of a brace."""
SPRING_COUNTS = (2, 4, 6, 8, 12, 20, 40)
"""Numbers of springs that are tried: an odd one would pull on one side of the plate."""
SPARE_SHARE, SPARE_LENGTH = 0.03, 0.3e-3
"""Of the travel, and [m]: beyond the window where made parts have to be good; holes that lie 0.05 mm off move the end
of the travel by a few times as much."""
RESERVE_SHARES, FLAT_RESERVE = 0.97, 0.9
"""Shares of envelope and ripple that closed forms may use: they leave out the plate's margins, and friction squared."""


def propose(request: Request, run: Run) -> FamilyOffer:
    """Return cams that the closed forms say are worth designing, the smallest and the flattest first."""
    if request.kind == "torque":
        return FamilyOffer(reason="a cam with rollers gives a force at its slider, no torque")
    if request.adjustable is not None:
        return FamilyOffer(reason="the force of a cam is fixed by its springs and cannot be adjusted")
    draw = np.random.default_rng(run.seed).uniform(size=(N_PROPORTIONS, 5)).T
    sizes = _size_proportions(request, draw)
    fitting = sizes["fits"] & sizes["flat"] & sizes["lossless"]
    if not fitting.any():
        return _explain_no_offer(request, sizes)
    chosen = _spread(sizes, np.flatnonzero(fitting))
    candidates: list[Candidate] = []
    for index in chosen:
        made = _candidate(request, {name: float(values[index]) for name, values in sizes.items()})
        candidates += [made, _from_catalogue(made, request)] if made else []
        if len(candidates) >= MAX_PROPOSALS:
            break
    if not candidates:
        depth = "" if request.depth is None else f" within a depth of {mm(request.depth)}"
        text = "no rollers have room between them for steel springs, and around pins and shafts that bear this force"
        return FamilyOffer(reason=f"{text}{depth}")
    return FamilyOffer(tuple(candidates))


def _size_proportions(request: Request, draw: FloatArray) -> dict[str, Any]:
    """Return sizes and measures of many proportions, by name: lengths [m], ratios, and which fit."""
    across, along = request.envelope[:2]
    longest = max(across, along)
    brace = longest * 10.0 ** (-1.3 * draw[0])
    start = brace * (0.02 + 0.9 * draw[1])
    constant = brace * 10.0 ** (-2.0 + 2.0 * draw[2])
    roller = np.minimum(start, brace) * (0.04 + 0.9 * draw[3])
    run_in = request.travel * 10.0 ** (-2.3 + 2.0 * draw[4])
    stroke = run_in + request.travel + spare_stroke(request)
    with np.errstate(invalid="ignore", divide="ignore"):
        end = start + np.sqrt(2.0 * constant * stroke)
        rise = np.sqrt(brace**2 - start**2)
        radius = 1.0 / ((rise / brace) ** 3 / constant + 1.0 / brace)
        places = np.linspace(0.0, 1.0, 9)[:, None] * request.travel + run_in
        stretch = np.sqrt(2.0 * constant * places)
        x = start + stretch
        slope = stretch / constant + x / np.sqrt(brace**2 - x**2)
        loss = ROLLING_FRICTION * (1.0 + slope**2) * constant / stretch
    tab = TAB_HEIGHT_RATIO * along
    width = 2.0 * (end + roller)
    height = stroke + rise + roller + np.maximum(roller, tab)
    contact = 0.5 * np.hypot(1.0, slope.max(axis=0))
    shaft = np.cbrt(32.0 * contact * request.target * SHAFT_ARM * request.safety / (np.pi * PIN_STRENGTH))
    plain = np.zeros(brace.size, dtype=bool)
    with np.errstate(invalid="ignore", divide="ignore"):
        if request.hysteresis is not None:  # rollers on plain shafts rub there, pins at the slider and at the springs
            turning = np.maximum(shaft, THINNEST_SHAFT)
            plain = ~_turn_on_bearings(turning, roller)
            loss *= 1.0 + plain * SLIDING_FRICTION * turning / (2.0 * roller * ROLLING_FRICTION)
            along_travel = np.sqrt(brace**2 - x**2)  # of a brace: l cos a [m]
            pins = SLIDING_FRICTION * USUAL_PIN_SHARE * roller
            loss += pins * (constant * brace / (stretch * along_travel) + 1.0) / along_travel
        ripple = 1.0 - (1.0 + loss.min(axis=0)) / (1.0 + loss.max(axis=0))
        down = 1.0 - (1.0 - loss.max(axis=0)) / (1.0 - loss.min(axis=0))
    least = np.maximum(ROLLER_MIN, 0.5 * shaft / SHAFT_IN_ROLLER)
    exists = (end < 0.97 * brace) & (roller > least) & (roller < 0.99 * radius) & np.isfinite(loss).all(axis=0)
    ripple = np.where(exists, np.maximum(ripple, down), np.inf)
    hysteresis = np.where(exists, 2.0 * loss.mean(axis=0), np.inf)
    return {
        "brace": brace, "start": start, "constant": constant, "roller": roller, "run_in": run_in, "end": end,
        "width": width, "height": height, "ripple": ripple, "hysteresis": hysteresis, "loss": loss.mean(axis=0),
        "there": exists, "contact": contact, "plain": plain,
        "fits": exists & (width < RESERVE_SHARES * across) & (height < RESERVE_SHARES * along),
        "flat": exists & (ripple < FLAT_RESERVE * request.ripple) & (loss.max(axis=0) < 0.2),
        "lossless": exists & (hysteresis < RESERVE_SHARES * (request.hysteresis or np.inf)),
    }  # fmt: skip


def _turn_on_bearings(shaft: Any, roller: Any, *bearings: Bearing) -> Any:
    """Return whether a ball bearing, or one of those given, fits around shafts and into rollers of some radius [m]."""
    tried = bearings or BALL_BEARINGS
    fits = [(entry.bore >= shaft) & (entry.outer <= BEARING_IN_ROLLER * 2.0 * roller) for entry in tried]
    return np.any(fits, axis=0)


def spare_stroke(request: Request) -> float:
    """Return how much longer than the travel a contour is cut [m].

    Half of made parts end before their own stroke; behind an end stop there is as much of it as before.
    """
    spare = 0.0 if request.stated.min_yield is None else SPARE_SHARE * request.travel + SPARE_LENGTH
    return spare + 2.0 * request.stop_margin


def _spread(sizes: dict[str, Any], fitting: Any) -> list[int]:
    """Return designs that fit, by turns the smallest, the flattest and those with the softest springs."""
    size = (sizes["width"] * sizes["height"])[fitting]
    soft = (sizes["end"] - sizes["start"])[fitting] / sizes["start"][fitting]
    orders = [
        fitting[np.argsort(key)] for key in (size, sizes["ripple"][fitting], soft, size * sizes["ripple"][fitting])
    ]
    return list(dict.fromkeys(int(order[k]) for k in range(min(60, len(fitting))) for order in orders))


def _candidate(request: Request, size: dict[str, float]) -> Candidate | None:
    """Return a design with springs that exist and a plate that bears the rollers; None if the depth is too small."""
    total = request.target / (4.0 * size["constant"])
    stretch = 2.0 * (size["end"] - size["start"])
    press = CONTACT_MARGIN * size["contact"] * request.target
    for block in request.materials or ({"name": "steel-s235"},):
        material = MaterialSpec.model_validate(dict(block))
        if material.yield_strength is None:
            continue
        modulus = material.modulus / (2.0 * (1.0 - material.poisson**2))
        bearable = YIELD_PRESSURE * material.yield_strength / request.safety
        thick = max(PLATE_MIN, press * modulus / (np.pi * size["roller"] * bearable**2))
        if request.hysteresis is not None and not size["plain"]:
            fitting = (entry.width for entry in BALL_BEARINGS if _turn_on_bearings(0.0, size["roller"], entry))
            thick = max(thick, *fitting)
        joints = _Joints.from_size(request, size, press, thick, PartStrength.from_material(material, request.safety))
        pin = joints.slider_pin(request, size)
        depths: dict[int, float] = {}
        for count in SPRING_COUNTS if pin is not None else ():
            springs = Springs(stiffness=total / count, count=count)
            wire = wire_and_coil(springs, stretch, size["start"], request.safety)
            if wire is None:
                continue
            outer = sum(wire)
            depth = depth_of(thick, outer, count) + 2.0 * joints.slider
            if depth > (request.depth or sum(request.envelope)):
                continue
            is_on_bearings = request.hysteresis is not None and not size["plain"]
            if is_on_bearings and not joints.turn_on_bearings(size["roller"], outer, 0.5 * total * stretch):
                continue
            below = 0.5 * stack_height(outer, count) - max(size["roller"], TAB_HEIGHT_RATIO * request.envelope[1])
            if size["height"] + max(below, 0.0) <= request.envelope[1]:
                depths[count] = depth
        if depths:
            # as few springs as there is room for; without a depth they may be as deep as the envelope is wide
            modest = [count for count, depth in depths.items() if request.depth or depth <= max(request.envelope)]
            count = modest[0] if modest else min(depths, key=lambda number: depths[number])
            return _write_candidate(request, size | {"pin": float(pin or 0.0)}, dict(block), thick, count, total)
    return None


@dataclass(frozen=True)
class _Joints:
    """Thicknesses and loads that pins and shafts of a candidate join."""

    strength: PartStrength
    press: float  # of a roller on the cam [N]
    thick: float  # of the plate [m]
    slider: float  # of half of the slider around the rods that guide it [m]

    @classmethod
    def from_size(
        cls, request: Request, size: dict[str, float], press: float, thick: float, strength: PartStrength
    ) -> _Joints:
        """Return those of a candidate's sizes."""
        travel = size["run_in"] + request.travel + spare_stroke(request)
        rods = guide_rods(4, 0.0, PULL_MARGIN * request.target, travel, 2.0 * size["roller"], None, None, strength)
        return cls(strength, press, thick, rods.slider_thickness)

    @property
    def brace(self) -> float:
        """Thickness of a brace [m]."""
        return min(self.thick, BRACE_WIDTH)

    def slider_pin(self, request: Request, size: dict[str, float]) -> float | None:
        """Return the slider's pin, for the pull of a brace at the end of the travel [m].

        None if it, or the shaft of a roller, is too thick for roller and slider.
        """
        rise = np.sqrt(size["brace"] ** 2 - size["end"] ** 2)
        pull = PULL_MARGIN * 0.5 * request.target * size["brace"] / float(rise)
        arm, thin = 0.5 * (self.brace + self.slider), min(self.brace, self.slider)
        pin, pin_bears = pin_for(pull, arm, thin, self.strength, None)
        shaft, shaft_bears = pin_for(self.press, 0.5 * (self.thick + self.brace), self.thick, self.strength, None)
        least, most = PIN_SHARE * 2.0 * size["roller"], SHAFT_IN_ROLLER * 2.0 * size["roller"]
        handy = next((entry for entry in pin_sizes(None) if entry >= least), pin)
        return max(pin, handy) if pin_bears and shaft_bears and max(pin, shaft) <= most else None

    def turn_on_bearings(self, roller: float, outer: float, pull: float) -> bool:
        """Return whether ball bearings fit around shafts that bear the springs of a side, too, of a pull [N]."""
        arm = 0.25 * (self.thick + self.brace) + (0.5 * (self.brace + outer) + self.slider) * pull / self.press
        shaft, bears = pin_for(self.press, arm, self.thick, self.strength, None)
        return bears and bool(_turn_on_bearings(shaft, roller))


def with_wire(spec: CamSpec, request: Request) -> CamSpec:
    """Return a designed cam whose springs have wire, coil and turns: the slimmest that fit between the rollers.

    They are those that its depth counts with (`part.depth_of`).
    """
    springs, solution = spec.mechanism.springs, analyze(spec, Run()).state
    if springs.wound is not None or solution is None:
        return with_bearings(spec, request)
    stretch, length = float(solution.elongation.max()), 2.0 * spec.mechanism.rest_half_width
    coil = slimmest_spring(ExtensionSpring, springs.total / springs.number, stretch, length, request.safety)
    if coil is None:
        return with_bearings(spec, request)
    stated = {"count": springs.count, "preload": springs.preload} if springs.preload else {"count": springs.count}
    return with_bearings(spec.replace({"mechanism.springs": {**stated, **as_stated(coil)}}), request)


def with_bearings(spec: CamSpec, request: Request) -> CamSpec:
    """Return a cam whose rollers turn as its parts list has them, if friction counts: on ball bearings, or on shafts.

    What ball bearings take is in the rolling friction, which was measured with them.
    """
    solution = analyze(spec, Run()).state if request.hysteresis is not None else None
    if solution is None:
        return spec
    shaft, bearing = roller_shaft(solution)
    if bearing is not None:
        return spec.replace({"mechanism.bearings": {"bore": bearing.bore, "name": bearing.name}})
    return spec.replace({"mechanism.bearings": {"bore": shaft, "friction": SLIDING_FRICTION, "kind": "plain"}})


def widen_plate(spec: CamSpec, request: Request) -> CamSpec:
    """Return a designed cam whose plate bears its rollers: the pressure goes with the root of force over thickness."""
    if spec.mechanism.springs.number % 2:
        raise SolutionError("an odd number of springs of the catalogue would pull on one side of the plate")
    springs = spec.mechanism.springs
    if springs.wound is not None:  # the rate is that of the wire
        spec = spec.replace({"mechanism.springs": springs.model_dump(exclude_unset=True, exclude={"stiffness"})})
    result = analyze(spec.replace({"analysis.window": None}), Run())  # all of the travel counts
    factor = evaluate(result, ["safety_factor"])["safety_factor"].value
    if factor is None or factor >= request.safety or spec.mechanism.contact is None:
        return with_bearings(spec, request)
    width = spec.mechanism.contact.width * CONTACT_MARGIN * (request.safety / factor) ** 2
    return with_bearings(spec.replace({"mechanism.contact.width": width}), request)


def _from_catalogue(made: Candidate, request: Request) -> Candidate:
    """Return the same proportions with springs of the generic series; from these the force constant follows."""
    spec = made.spec.replace(
        {"design.choose": "catalogue", "design.catalogue": "generic", "design.spring_safety": request.safety}
    )
    return replace(
        made,
        variant=re.sub(r"^\d+ springs?", "catalogue springs", made.variant),
        spec=spec,
        finish=widen_plate,
        springs="catalogue",
    )


def _write_candidate(
    request: Request, size: dict[str, float], material: dict[str, Any], thick: float, count: int, total: float
) -> Candidate:
    along = request.envelope[1]
    begin = float(f"{size['run_in']:.6g}")
    stroke = begin + request.travel
    longer = stroke + spare_stroke(request)
    mechanism = {
        "brace_length": size["brace"],
        "rest_half_width": size["start"],
        "roller_radius": size["roller"],
        "springs": {"stiffness": total / count, "count": count},
        "rolling_friction": ROLLING_FRICTION,
        "profile": {"force_constant": size["constant"], "stroke": longer},
        "plate": {
            "base_height": TAB_HEIGHT_RATIO * along,
            "top_margin": min(TOP_MARGIN_RATIO * along, 0.5 * size["roller"]),
            "hole_diameter": min(MAX_HOLE_DIAMETER, 0.4 * TAB_HEIGHT_RATIO * along),
        },
        "contact": {"width": thick, "material": material},
    }
    if request.hysteresis is not None:
        mechanism |= {
            "pins": {"diameter": size["pin"], "friction": SLIDING_FRICTION},
            "guide": {"friction": SLIDING_FRICTION},
        }
    data = {
        "family": "cam",
        "name": "suggested",
        "mechanism": mechanism,
        "design": {"force": request.target, "stroke": longer},
        "analysis": {"window": (Place(begin, "length"), Place(stroke, "length"))},
    }
    spec = CamSpec.model_validate(data)
    area = size["width"] * size["height"] / (request.envelope[0] * request.envelope[1])
    variant = name_variant(f"{count} spring{'s' if count > 1 else ''}", request, material)
    promise = area + size["ripple"] / request.ripple
    return Candidate(variant, spec, design=True, finish=with_wire, promise=promise, springs="custom")


def _explain_no_offer(request: Request, sizes: dict[str, Any]) -> FamilyOffer:
    """Return why no proportions fit."""
    if not sizes["there"].any():
        return FamilyOffer(reason="no cam of this travel has a path that its roller can follow within such an envelope")
    flat = sizes["flat"] & sizes["lossless"]
    if not flat.any():
        return FamilyOffer(reason="with the friction of the rollers, ripple or loss is larger than required")
    scale = (
        np.maximum(sizes["width"] / request.envelope[0], sizes["height"] / request.envelope[1])[flat].min()
        / RESERVE_SHARES
    )
    need = " x ".join(mm(side * float(scale)) for side in request.envelope[:2])
    return FamilyOffer(reason=f"the rollers, the braces and the slider's travel need an envelope of about {need}")
