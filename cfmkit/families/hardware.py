"""Parts that join a mechanism of rigid parts: links, pins, guide and screws, sized for the loads of its motion.

Sizes that the specification states are kept; others are the smallest of their series that bear the load. What is
assumed where nothing is stated: links and plates of S235, pins and rods of the same strength, a safety factor of
`DEFAULT_SAFETY` (more where a requirement asks for more), and a guide that carries at least `SIDE_SHARE` of the largest
force across its rod, because no force acts exactly in its line. Friction is in the force only where it is stated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.posed_part import PosedBody
from cfmkit.specs.units import format_short
from cfmkit.stock import MATERIALS_BY_NAME
from cfmkit.stock.joint_strength import eye_that_bears, pin_that_bears, rod_that_guides
from cfmkit.stock.parts_list import ListedPart
from cfmkit.stock.stock_series import SOCKET_SCREWS, pin_length, series_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.specs.spec import Spec
    from cfmkit.stock.material_and_part_spec import Guide, MaterialSpec
    from cfmkit.stock.stock_series import Screw, System

DEFAULT_MATERIAL = "steel-s235"  # of links and plates that state none
DEFAULT_SAFETY = 1.5  # against yield, where `safety_factor` is not above 1
SAFETY_METRICS = ("safety_factor", "link_safety_factor", "spring_safety_factor")
"""Metrics of strength: what a requirement asks of them is asked of pins, shafts and screws, too."""
PIN_STRENGTH = 235e6
"""Yield strength of pins and rods [Pa]: plain carbon steel, EN 10025-2 S235; hardened ones bear more."""
PIN_MODULUS = 210e9  # young's modulus of pins and rods [Pa]: EN 1993-1-1, sec. 3.2.6.
SIDE_SHARE = 0.1  # load across a guide over the largest force on its slider, at least: assumed
SAG_SHARE = 1e-3  # sag of a guide's rod over its span, at most: assumed
LEAST_WALL = 0.25  # wall beside a hole over its diameter, at least
LEAST_SCREW = 3e-3  # thinnest screw of a plate or a ground [m]: thinner ones are hard to handle
CUT_LENGTH = 1e-3  # how much longer than what it joins a pin may be [m]; it is cut where it is longer


@dataclass(frozen=True)
class PartStrength:
    """Material of links and plates, and the stresses that parts may have."""

    name: str
    modulus: float  # [Pa]
    allowable: float  # of links and plates [Pa]
    pins: float  # of pins and rods [Pa]
    assumed: bool  # whether the material is not stated

    @classmethod
    def from_material(cls, material: MaterialSpec | None, safety_factor: float) -> PartStrength:
        """Return that of a stated material, or of the default one where none with a strength is stated."""
        safety = safety_factor if safety_factor > 1.0 else DEFAULT_SAFETY
        allowable = None if material is None else material.allowable(safety)
        if material is None or allowable is None:
            reference = MATERIALS_BY_NAME[DEFAULT_MATERIAL]
            strength = float(reference.yield_strength or 0.0)
            return cls(reference.name, reference.youngs_modulus, strength / safety, PIN_STRENGTH / safety, True)
        return cls(material.name or material.words, material.modulus, allowable, PIN_STRENGTH / safety, False)


def required_safety(spec: Spec) -> float:
    """Return the safety factor of parts that join: that of the mechanism, with what requirements ask beyond it."""
    stated: float = spec.mechanism.safety_factor  # type: ignore[attr-defined]
    least = [entry.min for entry in spec.requirements if entry.metric in SAFETY_METRICS and entry.min is not None]
    return max(stated if stated > 1.0 else DEFAULT_SAFETY, stated * max(map(float, least), default=1.0))


@dataclass(frozen=True)
class Hardware:
    """Parts of a mechanism, numbered in their order, with what of them is drawn."""

    parts: tuple[ListedPart, ...]
    bodies: tuple[PosedBody, ...] = ()  # guide, ground, fasteners: what stands beside what moves
    drawn: tuple[PosedBody, ...] = ()  # all parts as the assembly drawing shows them, the lowest first
    # what rubs, by its block of the mechanism, with the sizes that the block needs beside `friction` [m]
    rubbing: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    faults: tuple[str, ...] = ()  # parts that do not bear their loads, or cannot be made, each in a sentence
    screw_head_height: float = 0.0  # how far heads of screws stand out of the plate or the ground [m]
    slider_excess: float = 0.0  # how much the slider adds to the depth of the layers [m]


def describe_faults(faults: Mapping[str, str]) -> tuple[str, ...]:
    """Return the faults of parts, by the place of each, as sentences."""
    return tuple(f"{place}: {fault}" for place, fault in faults.items())


def with_faults(parts: Iterable[ListedPart], faults: Mapping[str, str]) -> tuple[ListedPart, ...]:
    """Return parts that say what their stated sizes do not bear, by the place of each."""
    return tuple(
        replace(part, data=f"{part.data}; {faults[part.place]}") if part.place in faults else part for part in parts
    )


def pin_sizes(system: System | None) -> tuple[float, ...]:
    """Return the diameters of the series of pins [m], metric ones unless inches are requested."""
    result = series_of("pin", system or "metric")
    return () if result is None else tuple(size for size in result.sizes if size >= 1e-3)


def pin_for(
    force: float, arm: float, thickness: float, strength: PartStrength, system: System | None
) -> tuple[float, bool]:
    """Return the pin that bears a load at an arm [m], and whether there is one: where not, the thickest."""
    sizes = pin_sizes(system)
    result = pin_that_bears(force, arm, thickness, strength.allowable, strength.pins, sizes)
    return (sizes[-1], False) if result is None else (result, True)


def link_width(force: float, thickness: float, hole: float, strength: PartStrength) -> float:
    """Return the width of a link that bears a tension around its holes, in whole millimetres [m]."""
    width = eye_that_bears(force, thickness, hole, strength.allowable, LEAST_WALL * hole)
    return 1e-3 * math.ceil(1e3 * width - 1e-9)


def screw_for(load: float, thickness: float, count: int, strength: PartStrength) -> Screw:
    """Return the smallest screw that is usual in a plate and bears its share of a load."""
    usual = [entry for entry in SOCKET_SCREWS if entry.diameter >= LEAST_SCREW]
    return next((screw for screw in usual if screw_bears(screw, load, thickness, count, strength)), usual[-1])


def screw_bears(screw: Screw, load: float, thickness: float, count: int, strength: PartStrength) -> bool:
    """Return True if so many equal screws in a plate share a load: bearing, and shear of the screw."""
    share = load / count
    shear = share / (0.25 * math.pi * screw.diameter**2)
    return share / (screw.diameter * thickness) <= strength.allowable and shear <= strength.pins / math.sqrt(3.0)


@dataclass(frozen=True)
class GuideRods:
    """Equal rods that guide a slider, in pairs: one on either side of its pin."""

    count: int
    diameter: float  # [m]
    length: float  # between their supports [m]
    bush: float  # length of the slider on them [m]
    load: float  # across all of them [N]
    pressure: float  # of the bushes on the rods, the load over their shadow [Pa]

    def axis_distance(self, pin: float) -> float:
        """Return the distance between the axes of a pair, with walls around the slider's pin of a diameter [m]."""
        return pin + self.diameter + 2.0 * LEAST_WALL * max(pin, self.diameter)

    def slider_width(self, pin: float) -> float:
        """Return the width of a slider with walls around a pair [m]."""
        return self.axis_distance(pin) + self.slider_thickness

    @property
    def slider_thickness(self) -> float:
        """Thickness of a slider with walls around its rods [m]."""
        return (1.0 + 2.0 * LEAST_WALL) * self.diameter

    def bodies(self, ends: FloatArray, pin: float) -> tuple[PosedBody, PosedBody]:
        """Return a pair beside a line (2, 2) [m]."""
        x, y = (ends[1] - ends[0]) / math.dist(*ends)
        aside = 0.5 * self.axis_distance(pin) * np.array([-y, x])
        left, right = (
            PosedBody.line("guide", "held", ends + side * aside, 0.5 * self.diameter) for side in (1.0, -1.0)
        )
        return left, right


def guide_rods(
    count: int,  # of rods that share the load
    # across, force: largest loads across the guide and along it [N]
    across: float,
    force: float,
    # travel, bush: of the slider, and its length where `guide` states none [m]
    travel: float,
    bush: float,
    guide: Guide | None,  # as stated
    system: System | None,  # of their diameter
    strength: PartStrength,  # of the rods
) -> GuideRods:
    """Return the rods for a load across them, at least a share of the force along them, over a travel."""
    length = bush if guide is None or guide.length is None else guide.length
    couple = 0.0 if guide is None else 2.0 * force * guide.offset / length  # at each end of the bushes
    load = max(across + couple, SIDE_SHARE * force)
    span, sizes = travel + length, pin_sizes(system)
    result = rod_that_guides(load / count, span, PIN_MODULUS, strength.pins, SAG_SHARE, sizes)
    diameter = sizes[-1] if result is None else result
    return GuideRods(count, diameter, span, length, load, load / (count * diameter * length))


def mm(*sizes: float) -> str:
    """Return sizes as a list writes them: ``6 x 40 mm``."""
    return " x ".join(f"{1e3 * size:.3f}".rstrip("0").rstrip(".") for size in sizes) + " mm"


def pin_part(place: str, count: int, diameter: float, length: float, load: float, body: str = "") -> ListedPart:
    """Return a pin of the list: bought as long as what it joins or cut to that, or made of a rod if none is so long."""
    series = next(
        (entry for entry in (series_of("pin", "metric"), series_of("pin", "inch")) if entry and entry.holds(diameter)),
        None,
    )
    bought = pin_length(diameter, length) if series and series.system == "metric" else None
    data = f"pin, diameter {format_short(diameter, 'length')}, bears {format_short(load, 'force', 3)}"
    if bought is not None and bought > length + CUT_LENGTH:
        data += f", cut to {mm(length)}"
    if series is not None and (bought is not None or series.system == "inch"):
        return ListedPart(place, "", count, data, "buy", mm(diameter, bought or length), series.standard, body)
    return ListedPart(place, "", count, f"{data}, of a rod", "make", mm(diameter, length), "", body)


def screw_part(place: str, count: int, screw: Screw, grip: float, countersunk: bool = False) -> ListedPart:
    """Return screws of the list that reach through a grip [m] and as deep as they are thick."""
    length = screw.length(grip + screw.diameter)
    kind, standard = ("countersunk", "ISO 10642") if countersunk else ("cap", "ISO 4762")
    return ListedPart(
        place, f"{screw.name} x {1e3 * length:g}", count, f"hexagon socket {kind} screw, hole {mm(screw.hole)}", "buy",
        mm(screw.diameter, length), f"{standard}, holes ISO 273", "screw",
    )  # fmt: skip


def guide_part(rods: GuideRods, pin: float, assumed: bool) -> ListedPart:
    """Return the guides of the list beside a pin, with what is assumed of them."""
    said = ", side load and friction assumed" if assumed else ""
    data = (
        f"rod for the slider, {mm(rods.axis_distance(pin))} beside the other, "
        f"{format_short(rods.load, 'force', 3)} across all, "
        f"{format_short(rods.pressure, 'stress', 3)} in the bushes{said}"
    )
    return ListedPart(
        "guide of the slider", "guide", rods.count, data, "make", mm(rods.diameter, rods.length), "", "guide"
    )
