"""Types of a suggestion (request, candidate, a family's offer), and what families share: flattest window, stiffening.

A family's ``propose(request, run)`` looks at scaling laws, which takes milliseconds, and names designs that are worth
trying; the caller designs them, analyses each with its exact model and keeps those that do what is required. SI
throughout.

Stiffening: the force of a part rises because the anticlastic bending of its wide beams is suppressed. In a planar
solid, in plane stress, that is free. Beam models know both, with and without `mechanism.wide_beams`. The ratio of both
means over the window is what a solid misses; what clamped ends add is left out (docs/beam.md, wide beams).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families.end_stops_spec import BEFORE_STOP
from cfmkit.families.run_control import Run
from cfmkit.metrics import mean_effort
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.processes import MIN_METAL_MODULUS, PROCESSES_BY_NAME

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.families.request_spec import Springs, SuggestBlock
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec


MaterialBlock = Mapping[str, Any]

STRENGTH_SHARE = 0.8
"""Share of the strength that is used where made parts have to be good: sources scatter moduli by 10 % and more."""
ASSUMED_STRAINS = {"plastic": (0.015, 0.04), "metal": (0.003, 0.006)}
"""Strains that designs use of a material whose strength is not stated: about those of PLA and aluminium at yield, then
what published mechanisms of printed plastic are bent to. The stress of what comes of it is not judged."""
STOP_MARGIN_SHARE = 0.03
"""Free way behind the travel, over the travel, at which an end stop stands: so far off may it be made and not shorten
the travel. For parts of a few millimetres that is a tenth of one, the usual tolerance of a cut length."""


THINNEST_LEAF = 2e-5  # of no stated process [m]


class Refinement(Protocol):
    """A function that makes one specification of another for a request."""

    def __call__(self, spec: Any, request: Request, /) -> Spec:
        """Return the specification; raises CfmError if there is none."""


@dataclass(frozen=True)
class Request:
    """Requirements of a mechanism that is to be suggested.

    What a search relaxes, or designs aim at, is a field; every other key is read from `stated`.
    """

    stated: SuggestBlock = field(repr=False)  # the block as it is written
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
    thinnest: float = THINNEST_LEAF  # thinnest leaf that the process makes [m]
    safety: float = 1.0  # least strength over stress, of everything whose stress is known
    # share of what the safety factor leaves that designs by beams may use: solids have more stress, in fillets
    reserve: float = 1.0

    @classmethod
    def from_block(cls, block: SuggestBlock) -> Request:
        """Return what a block requests."""
        low, high = block.ends
        value: Any = block.force if block.force is not None else block.torque
        banded = isinstance(value, tuple)
        return cls(
            stated=block,
            kind="force" if block.force is not None else "torque",
            target=_middle(low, high) if banded else value,
            low=low,
            high=high,
            banded=banded,
            travel=float(block.travel if block.travel is not None else block.angle or 0.0),
            ripple=block.ripple,
            envelope=block.envelope,
            materials=tuple(map(block.state_for_cycles, block.materials)),
            adjustable=block.adjustable,
            hysteresis=block.hysteresis,
            thinnest=PROCESSES_BY_NAME[block.process].least_feature if block.process else THINNEST_LEAF,
            safety=block.safety,
        )

    @property
    def depth(self) -> float | None:
        """Space out of the plane [m]; None if it does not matter."""
        return self.envelope[2] if len(self.envelope) > 2 else None

    @property
    def allowed_stress_share(self) -> float:
        """Stress that designs may have, in parts of the strength: the reserve over the safety factor.

        Less where a yield is required, as made parts are thicker and stiffer than drawn, and where an end stop follows,
        up to which the stress rises at most about as the motion does.
        """
        up_to_stop = 1.0 if self.stated.overload is None else 1.0 + STOP_MARGIN_SHARE
        return self.reserve * (1.0 if self.stated.min_yield is None else STRENGTH_SHARE) / (self.safety * up_to_stop)

    @property
    def stop_margin(self) -> float:
        """Way from the end of the travel to the end stop [m]; zero if none is required."""
        return (
            0.0 if self.stated.overload is None else max(round(STOP_MARGIN_SHARE * self.travel, 6), 2.0 * BEFORE_STOP)
        )

    @property
    def with_strengths(self) -> tuple[Request, ...]:
        """The request with a strength of every material, assumed where unknown: laws size parts by their stress."""
        levels = zip(*map(_with_strengths, self.materials), strict=True)
        made = [replace(self, materials=blocks) for blocks in levels] or [self]
        return tuple(made if made[0] != made[-1] else made[:1])

    def allows(self, candidate: Candidate) -> bool:
        """Return whether a candidate has springs of the kind that is required, and a stop where one is."""
        is_of_kind = None in (candidate.springs, self.stated.springs) or candidate.springs == self.stated.springs
        return is_of_kind and (self.stated.overload is None or bool(candidate.spec.end_stop_changes(1.0)))

    def stated_material(self, block: MaterialBlock) -> MaterialBlock:
        """Return the material of a candidate as the request states it: without a strength that was only assumed."""
        return next((stated for stated in self.materials if block in _with_strengths(stated)), block)


def _middle(low: float, high: float) -> float:
    """Return what designs in a band aim at: the middle, of a band over more than an octave that of its logarithm."""
    return math.sqrt(low * high) if high > 2.0 * low else 0.5 * (low + high)


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
    # makes the designed one the one that is judged, its window and travel written out; None if nothing has to be done
    finish: Refinement | None = None
    promise: float = 0.0  # the smaller, the sooner it is worth a try
    # paths of values of one that is not designed, which may move where made parts miss a yield
    free: tuple[str, ...] = ()
    # solves the part by the finest model of the family and returns it with that model, its window, thicknesses and
    # widths corrected by what was found; None if it is judged by that model as it is
    correct: Refinement | None = None
    reserve: float = 1.0  # `Request.reserve` that it was proposed for, and is designed with
    springs: Springs | None = None  # that it is put together with; None if it needs none
    doubtful: bool = False  # whether its laws say that it probably does not fit: it comes after those that do


def name_variant(variant: str, request: Request, block: MaterialBlock) -> str:
    """Return what a variant is called: with its material where the request allows several.

    Examples
    --------
    >>> from cfmkit.runs import read_request
    >>> keys = {"force": "1 N", "travel": "1 mm", "envelope": "[9 mm, 9 mm]", "material": "[pla, pom]"}
    >>> request = Request.from_block(read_request(None, keys))
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


def take_turns(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return candidates of all variants by turns, the most promising of each first; variants keep their order."""
    rows: dict[str, list[Candidate]] = {candidate.variant: [] for candidate in candidates}
    for candidate in sorted(candidates, key=lambda candidate: candidate.promise):
        rows[candidate.variant].append(candidate)
    return [candidate for turn in zip_longest(*rows.values()) for candidate in turn if candidate is not None]


N_WINDOWS = 400  # windows that are compared, evenly over the curve
WINDOW_EXTENSION_SHARE = 1e-6
"""A window is made longer by this share of its length: to write it down must not make it shorter."""


def flattest(result: Result, length: float) -> tuple[float, float] | None:
    """Return the ends of the window of a length [m or rad] with the smallest ripple of its worst branch.

    Of the nominal curve; None if it is shorter, or has no force.
    """
    if not result.curves:
        return None
    curve = result.curve
    motion = np.asarray(curve.motion)
    low, high = float(motion.min()), float(motion.max())
    length = length * (1.0 + WINDOW_EXTENSION_SHARE)
    if not high - low >= length:
        return None
    starts = np.linspace(low, high - length, N_WINDOWS)
    worst = np.zeros(N_WINDOWS)
    for branch in curve.branches:
        part = curve.select_branch(branch)
        order = np.argsort(part.motion, kind="stable")
        worst = np.maximum(worst, ripples(part.motion[order], part.effort[order], starts, length))
    best = int(np.argmin(worst))
    return (float(starts[best]), float(starts[best]) + length) if np.isfinite(worst[best]) else None


def mean_and_stress(curve: Curve, window: tuple[float, float]) -> tuple[float, float]:
    """Return the mean effort in a window [N or N m], and the largest stress up to its end [Pa]."""
    mean = float(np.interp(np.linspace(*window, 101), curve.motion, curve.effort).mean())
    stress = np.maximum.accumulate(curve.extra["max_stress"].values)
    return mean, float(np.interp(window[1], curve.motion, stress))


def ripples(places: FloatArray, effort: FloatArray, starts: FloatArray, length: float) -> FloatArray:
    """Return (max - min)/max over windows of a length that begin at some places; infinite where the effort ends."""
    ends = np.interp([starts, starts + length], places, effort)
    outside = (places <= starts[:, None]) | (places >= starts[:, None] + length)
    highest = np.maximum(ends.max(axis=0), np.where(outside, -np.inf, effort).max(axis=1))
    lowest = np.minimum(ends.min(axis=0), np.where(outside, np.inf, effort).min(axis=1))
    is_known = np.isfinite(highest) & np.isfinite(lowest) & (highest > 0.0)
    return np.where(is_known, 1.0 - lowest / np.where(is_known, highest, 1.0), np.inf)


WIDE_BEAMS_KEY = "mechanism.wide_beams"
BAND_MARGIN = 1.002  # how far inside its band a force is aimed at: the next solution is that of a part a little wider
PER_SQUARE = 0.007
"""Stiffening over 2 (b/t)^2 sigma/E, b^2 K/t at the largest stress: 0.0026 to 0.0075 of POM leaves and networks
whose stiffening was computed; the real one ends at 1/(1 - nu^2) - 1."""


def is_too_wide(request: Request, width: float, thickness: float, strain: float) -> bool:
    """Return True if leaves of a width and a thickness [m] probably stiffen by more than the band of a request.

    `strain`: the largest bending strain. An estimate, by which candidates are put in order; `stiffening` decides.
    """
    return PER_SQUARE * 2.0 * (width / thickness) ** 2 * strain > request.high / request.low - 1.0


def stiffening(spec: Spec, model: Callable[[Any, Run], Result]) -> float:
    """Return by what share the mean force over the window rises, by a model of beams; 0 if that does not know it."""
    try:
        means = [
            mean_effort(model(spec.replace({WIDE_BEAMS_KEY: wide, "requirements": ()}), Run()))
            for wide in (False, True)
        ]
    except CfmError:
        return 0.0
    narrow, wide = means
    return 0.0 if not narrow or not wide else max(wide / narrow - 1.0, 0.0)


def aim_below_stiffening(spec: Spec, request: Request, model: Callable[[Any, Run], Result]) -> Request:
    """Return a request whose force is in the band without and with the stiffening of a part, or as near as can be."""
    share = stiffening(spec, model)
    lowest, highest = BAND_MARGIN * request.low, request.high / (BAND_MARGIN * (1.0 + share))
    return replace(request, target=max(min(request.target / (1.0 + 0.5 * share), highest), lowest))
