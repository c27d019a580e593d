"""A request for a constant force, and what a family answers to it: types only, SI throughout.

A family's ``propose(request, run)`` looks at scaling laws, which takes milliseconds, and names designs that are worth
trying; the caller designs them, analyses each with its exact model and keeps those that do what is required.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from cfmkit.families.end_stops_spec import BEFORE_STOP
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.processes import MIN_METAL_MODULUS

if TYPE_CHECKING:
    from cfmkit.specs.spec import Spec

MaterialBlock = Mapping[str, Any]

Springs = Literal["catalogue", "custom"]  # springs as they are sold, or made to a wire, a coil and a number of turns

STRENGTH_SHARE = 0.8
"""Share of the strength that is used where made parts have to be good: sources scatter moduli by 10 % and more."""
ASSUMED_STRAINS = {"plastic": (0.015, 0.04), "metal": (0.003, 0.006)}
"""Strains that designs use of a material whose strength is not stated: about those of PLA and aluminium at yield, then
what published mechanisms of printed plastic are bent to. The stress of what comes of it is not judged."""
STOP_MARGIN_SHARE = 0.03
"""Free way behind the travel, over the travel, at which an end stop stands: so far off may it be made and not shorten
the travel. For parts of a few millimetres that is a tenth of one, the usual tolerance of a cut length."""


@dataclass(frozen=True)
class Request:
    """Requirements of a mechanism that is to be suggested."""

    kind: Literal["force", "torque"]  # what is to be constant: over a travel, or over an angle
    target: float  # how large [N or N m]; of a band, its middle
    # low, high: ends of the band in which every force has to lie, or, where only a number is required, of what the mean
    # may be
    low: float
    high: float
    banded: bool  # whether a band is required
    travel: float  # over which it is constant [m or rad]
    ripple: float  # largest (max - min)/max over the travel
    envelope: tuple[float, ...]  # across and along the travel, and out of the plane [m]
    materials: tuple[MaterialBlock, ...] = ()  # `mechanism.material` of each one allowed; empty: whatever is usual
    adjustable: tuple[float, float] | None = None  # between which forces it is to be adjusted [N]
    hysteresis: float | None = None  # largest loss of a cycle over its work
    # presses that it has to survive; judged where the material has fatigue data, whose allowable stress counts
    cycles: int | None = None
    thinnest: float = 2e-5  # thinnest leaf that the process makes [m]
    springs: Springs | None = None  # that it may be put together with; None: either
    safety: float = 1.0  # least strength over stress, of everything whose stress is known
    good_parts: float | None = None  # least share of manufactured parts that meet all of it
    # by which tolerances they are made; None: those of the process that is usual for the material
    process: str | None = None
    overload: float | None = None  # that an end stop behind the travel has to bear [N]; None: it needs no stop
    # share of what the safety factor leaves that designs by beams may use: solids have more stress, in fillets
    reserve: float = 1.0

    @property
    def depth(self) -> float | None:
        """Space out of the plane [m]; None if it does not matter."""
        return self.envelope[2] if len(self.envelope) > 2 else None

    @property
    def strength_used(self) -> float:
        """The share of the strength that designs may use: made parts are thicker and stiffer than drawn.

        Up to an end stop the stress rises at most about as the motion does.
        """
        up_to_stop = 1.0 if self.overload is None else 1.0 + STOP_MARGIN_SHARE
        return self.reserve * (1.0 if self.good_parts is None else STRENGTH_SHARE) / (self.safety * up_to_stop)

    @property
    def stop_margin(self) -> float:
        """Way from the end of the travel to the end stop [m]; zero if none is required."""
        return 0.0 if self.overload is None else max(round(STOP_MARGIN_SHARE * self.travel, 6), 2.0 * BEFORE_STOP)

    @property
    def with_strengths(self) -> tuple[Request, ...]:
        """The request with a strength of every material, assumed where unknown: laws size parts by their stress."""
        levels = zip(*map(_with_strengths, self.materials), strict=True)
        made = [replace(self, materials=blocks) for blocks in levels] or [self]
        return tuple(made if made[0] != made[-1] else made[:1])

    def allows(self, candidate: Candidate) -> bool:
        """Return whether a candidate has springs of the kind that is required, and a stop where one is."""
        is_of_kind = None in (candidate.springs, self.springs) or candidate.springs == self.springs
        return is_of_kind and (self.overload is None or bool(candidate.spec.end_stop_changes(1.0)))

    def stated_material(self, block: MaterialBlock) -> MaterialBlock:
        """Return the material of a candidate as the request states it: without a strength that was only assumed."""
        return next((stated for stated in self.materials if block in _with_strengths(stated)), block)


def _with_strengths(block: MaterialBlock) -> tuple[MaterialBlock, MaterialBlock]:
    """Return a material with the strengths that designs may use: its own twice, or two that are assumed."""
    material = MaterialSpec.model_validate(dict(block))
    if material.yield_strength is not None:
        return block, block
    low, high = ASSUMED_STRAINS["metal" if material.modulus > MIN_METAL_MODULUS else "plastic"]
    return {**block, "yield_strength": low * material.modulus}, {**block, "yield_strength": high * material.modulus}


@dataclass(frozen=True)
class Candidate:
    """A design that is worth trying."""

    variant: str  # which of the family's, in a few words
    spec: Spec  # complete, or with a block `design` that the family's own design completes
    design: bool = False  # whether it is to be designed
    # ``"module:function"``, ``function(spec, request) -> spec``: what makes the designed one the one that is judged,
    # its window and travel written out; ``"module:function:word"``, ``function(word, spec, request)``. Empty: nothing
    # has to be done
    finish: str = ""
    promise: float = 0.0  # the smaller, the sooner it is worth a try
    # paths of values of one that is not designed, which may move where made parts miss a yield
    free: tuple[str, ...] = ()
    # ``"module:function"``, ``function(spec, request) -> spec``: solves the part by the finest model of the family and
    # returns it with that model, its window, thicknesses and widths corrected by what was found. Empty: it is judged by
    # that model as it is
    correct: str = ""
    reserve: float = 1.0  # `Request.reserve` that it was proposed for, and is designed with
    springs: Springs | None = None  # that it is put together with; None if it needs none
    doubtful: bool = False  # whether its laws say that it probably does not fit: it comes after those that do


def name_variant(variant: str, request: Request, block: MaterialBlock) -> str:
    """Return what a variant is called: with its material where the request allows several.

    Examples
    --------
    >>> request = Request("force", 1.0, 1.0, 1.0, False, 1.0, 0.1, (1.0, 1.0), ({"name": "pla"}, {"name": "pom"}))
    >>> name_variant("2 Vs", request, request.materials[1])
    '2 Vs, pom'
    """
    name = block.get("name") if len(request.materials) > 1 else None
    return f"{variant}, {name}" if name else variant


@dataclass(frozen=True)
class FamilyOffer:
    """Candidates of a family for a request."""

    # worth being made, the most promising first; empty where the request is out of reach
    candidates: tuple[Candidate, ...] = ()
    reason: str = ""  # why there are none
