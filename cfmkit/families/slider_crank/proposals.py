"""From a request to slider-cranks worth designing: kept proportions at the size that travel and envelope allow.

Lengths scale with one factor: angles, and the shape of the curve, stay. For a strip the stress decides the thickness
and the force the width, for flexures likewise; both are left to the family's own design. Linkages with springs at their
joints are those of `sprung_linkage_proposals`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import mm
from cfmkit.families.proposals import (
    Candidate,
    FamilyOffer,
    aim_below_stiffening,
    flattest,
    mean_and_stress,
    name_variant,
    take_turns,
)
from cfmkit.families.slider_crank.catalogue_spring_proposals import with_catalogue_springs
from cfmkit.families.slider_crank.printed.outline import drawing
from cfmkit.families.slider_crank.printed.part import PAD_SIZE
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.outline import EYE_SHARE
from cfmkit.families.slider_crank.sprung_linkage_proposals import (
    Proportions,
    explain_overfilled,
    propose_pushed_linkage,
    propose_turned_linkages,
    pushed_analysis,
    rank_by_size,
)
from cfmkit.specs.units import Place, format_short
from cfmkit.stock.material_and_part_spec import MaterialSpec

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.proposals import Request
    from cfmkit.families.run_control import Run


PUSHED_PROPORTIONS = (
    Proportions(100.0 / 54.0, 60.0 / 54.0, 0.542, 38.0 / 54.0),  # Bilancia, Geraci, Berselli 2019
    Proportions(1.6, 1.0, 0.56, 0.8),
    Proportions(2.4, 1.1, 0.43, 0.6),
)
"""For a force at the slider: the published lengths, and two linkages beside them, shorter and longer."""
START_SHARES = (0.04, 0.1)
"""Where the travel begins, over its length: before that the force of an elastic part comes up from zero."""
EARLIEST_START, LATE_START = 0.026, 0.35
"""The same of a travel nearly as long as the reach of the linkage, and of flexures, whose force is level later."""
RELATIVE_SIZES = (1.0, 0.8, 0.6, 0.42, 0.3)  # sizes that are tried, over the largest that the envelope allows
FULL_PADS = 0.054
"""Crank from which on the pads of a printed part are as large as usual [m], that of Bilancia, Geraci, Berselli 2019;
those of smaller parts are smaller in proportion."""
ROUNDED_BOX = 1.0 - 1e-4
"""Share of the envelope that the largest part takes: sizes are rounded, and its outline is known to a few digits."""
PAIR_GAP = (0.1, 4e-3)
"""Between the parts of a mirrored pair: a share of one's height, and a length [m], as they are drawn."""
MAX_WIDTH_RATIO = 3.0
"""So much wider than there is room for a part may seem: the estimate is of one proportion and one run-in."""
PROBABLY_TOO_WIDE = 1.3  # from so much on it comes after all parts that are not, with whatever reserve of strength
FLEXURES_WIDER = 8.0  # about how much wider than a strip flexures of a tenth of its free length have to be
N_STRIP_NODES = 9
"""Thicknesses of a tapered strip: over nearly all of the reach five vary by 2.4 %, nine by 1.7 % in a third more time,
13 by 1.0 % in four times as much."""
SLOW_PROMISE = 10.0  # promise of what takes seconds to design, where everything else takes a part of one
FLEXURE_LENGTH_RATIO = 0.2  # length of a flexure, over the crank's length, as in Bilancia, Geraci, Berselli 2019
MAX_THICKNESS_RATIOS, THICKEST_TAPERED = 0.1, 0.05
"""Largest thickness of a strip, and of a tapered one, over the crank's length: thicker ones hardly bend as lines do."""
MAX_PROPOSALS = 24
TRAVEL_EXTENSION = 1.1  # how far a solid is followed, over its travel, to look for a flatter window
FOLLOWED_TRAVEL_RATIO = 1.02
"""Travel up to which parts of one piece are followed, over the reach of their proportions: nothing ends there."""


def propose(request: Request, run: Run) -> FamilyOffer:
    """Return linkages that fit the envelope, to be given springs, flexures or a strip by the family's design."""
    return propose_turned_linkages(request) if request.kind == "torque" else _propose_for_force(request)


def _propose_for_force(request: Request) -> FamilyOffer:
    if request.adjustable is not None:
        return FamilyOffer(reason="the force of a slider-crank is fixed by its springs and cannot be adjusted")
    tried = [offer for lengths in PUSHED_PROPORTIONS for offer in _offer_pushed(request, lengths)]
    if candidates := [offer for offer in tried if isinstance(offer, Candidate)]:
        return FamilyOffer(tuple(_vary_by_turns(candidates)))
    reasons = []
    fits = [largest_printed(request.envelope, lengths) for lengths in PUSHED_PROPORTIONS]
    wide = min(
        (strip_width(request, block, proportions) for proportions in fits for block in _materials(request)), default=0.0
    )
    if wide > MAX_WIDTH_RATIO * (request.depth or max(request.envelope)):
        reasons.append(f"a strip would have to be about {mm(wide)} wide")
    largest = max(fits)
    if not _can_be_cut(request, MAX_THICKNESS_RATIOS * largest):
        text = f"strips are made {mm(request.thinnest)} thick at least, too thick for a crank of {mm(largest)}"
        reasons.append(f"{text}, the longest that fits")
    if most := max((offer for offer in tried if isinstance(offer, float)), default=0.0):
        told = format_short(most, "force", 2)
        reasons.append(f"springs of steel wire that fit at the pins hold at most {told} over this travel")
    elif not reasons and (reason := explain_overfilled(request)) is not None:
        reasons.append(reason)
    if reasons:
        return FamilyOffer(reason="; ".join(reasons))
    crank = request.travel * (1.0 + START_SHARES[0]) / PUSHED_PROPORTIONS[0].reach
    box = _pinned_box if request.depth is None else _printed_box
    need = box(PUSHED_PROPORTIONS[0], crank)
    return FamilyOffer(reason=f"a linkage for this travel needs {mm(need[0])} across it and {mm(need[1])} along it")


def _pinned_box(lengths: Proportions, crank: float) -> tuple[float, float]:
    """Return the envelope that a linkage with pins needs across and along the slider's path [m]."""
    across = max(lengths.offset, math.sin(lengths.unloaded)) + 2.0 * EYE_SHARE
    return across * crank, (lengths.stretched + 2.0 * EYE_SHARE) * crank


def _printed_box(lengths: Proportions, crank: float) -> tuple[float, float]:
    """Return the envelope that a strip with its pads needs across and along the slider's path [m]; it moves within."""
    small, large = _boxes_as_drawn(lengths)
    slope, beyond = (large - small) / FULL_PADS, crank - FULL_PADS
    across, along = small * crank / FULL_PADS if beyond <= 0.0 else small + slope * beyond
    return float(across), float(along)


@cache
def _boxes_as_drawn(lengths: Proportions) -> FloatArray:
    """Return the box of the outline of a strip, across and along the slider's path, for two cranks, (2, 2) [m]."""
    boxes = []
    for crank in (FULL_PADS, 2.0 * FULL_PADS):
        beam = {"width": crank, "thickness": 0.01 * crank}
        mechanism = {**_mechanism(lengths, crank), "material": {"name": "pom"}, "beam": beam}
        analysis = {"drive": "force", "fidelity": "beam"}
        drawn = drawing(
            SliderCrankSpec.model_validate({"family": "slider-crank", "mechanism": mechanism, "analysis": analysis})
        )
        extents = np.array([contour.extents for contour in drawn.contours if contour.layer == "cut"])
        along, across = extents[:, 2:].max(axis=0) - extents[:, :2].min(axis=0)
        boxes.append([across, along])
    return np.array(boxes)


def largest_printed(envelope: Sequence[float], lengths: Proportions) -> float:
    """Return the crank's length of the largest strip whose outline fits the first two sides of an envelope [m]."""
    small, large = _boxes_as_drawn(lengths)
    wide = np.array(envelope[:2]) * ROUNDED_BOX
    in_proportion = FULL_PADS * float((wide / small).min())
    if in_proportion <= FULL_PADS:
        return in_proportion
    return FULL_PADS * (1.0 + float(((wide - small) / (large - small)).min()))


def _offer_pushed(request: Request, lengths: Proportions) -> list[Candidate | float]:
    """Return parts and linkages of some proportions at all sizes that fit.

    Or the largest force that springs at pins can hold, where that is less than what is required [N].
    """
    printed = largest_printed(request.envelope, lengths)
    pinned = min(
        request.envelope[0] / (lengths.offset + 2 * EYE_SHARE),
        request.envelope[1] / (lengths.stretched + 2 * EYE_SHARE),
    )
    pins = explain_overfilled(request) is None
    first, last = _window(request, START_SHARES[0])
    offers: list[Candidate | float] = []
    for size in RELATIVE_SIZES:
        for crank, offer in (
            (size * printed, PrintedSize.strip),
            (size * pair_size(request, lengths), PrintedSize.pair),
        ):
            sizes = [PrintedSize(request, lengths, crank, block) for block in _materials(request)]
            for start in sizes[0].starts():
                offers += filter(None, (offer(part, _window(request, start)) for part in sizes))
        if size in RELATIVE_SIZES[:2]:
            for block in _materials(request):
                offers += PrintedSize(request, lengths, size * printed, block).slow_parts()
        if last <= lengths.reach * size * pinned and pins:
            offers.append(linkage := propose_pushed_linkage(request, lengths, size * pinned, first))
            offers += [with_catalogue_springs(linkage)] if isinstance(linkage, Candidate) else []
    return offers


def _window(request: Request, start: float) -> tuple[float, float]:
    """Return between which travels the force is to be held [m], of a start over their length."""
    return start * request.travel, (1.0 + start) * request.travel * (1.0 + 1e-6)


def _can_be_cut(request: Request, thickest: float) -> bool:
    """Return True if strips up to a thickness, and as wide as there is room for, can be as thin as they are made."""
    return request.thinnest <= min(thickest, request.depth or math.inf)


def pair_size(request: Request, lengths: Proportions) -> float:
    """Return the crank's length of the largest mirrored pair that fits the envelope [m]: two heights and a gap."""
    crank = (request.envelope[0] - PAIR_GAP[1]) / (2.0 + PAIR_GAP[0])
    return largest_printed((crank, request.envelope[1]), lengths) if crank > 0.0 else 0.0


def strip_width(request: Request, block: dict[str, Any], crank: float) -> float:
    """Return about how wide a strip has to be [m]: scaled from one of ABS, 1.5 N over 34 mm with a crank of 54 mm.

    The curvature is as the travel over the square of the crank's length; the stress gives the thickness, and the force
    is as width, modulus, cube of the thickness and curvature over the length.
    """
    material = MaterialSpec.model_validate(block)
    strength = material.allowable(1.0)
    if strength is None:
        return math.inf
    size, scale = crank / 0.054, request.travel / 0.034
    stiffer = material.modulus / 1.8e9
    thicker = request.allowed_stress_share * strength / 42.5e6 / stiffer * size**2 / scale
    return 0.005138 * (request.target / 1.5) * size**3 / (stiffer * thicker**3 * scale)


@dataclass(frozen=True)
class PrintedSize:
    """A part of one piece, to be designed for a request: its proportions, size and material."""

    request: Request
    lengths: Proportions
    crank: float  # [m]
    material: dict[str, Any]

    @cached_property
    def width(self) -> float:
        """About how wide a strip has to be [m]."""
        return strip_width(self.request, self.material, self.crank)

    def starts(self, wanted: Sequence[float] = START_SHARES) -> list[float]:
        """Return starts with which the travel is within reach: the wanted ones, or else the earliest."""
        reach = FOLLOWED_TRAVEL_RATIO * self.lengths.reach * self.crank
        fitting, earliest = (
            [start for start in starts if _window(self.request, start)[1] <= reach]
            for starts in (wanted, (EARLIEST_START,))
        )
        return fitting or earliest

    def _fits(self, width: float, thickest: float = MAX_THICKNESS_RATIOS) -> bool:
        """Return True if a width is not much more than there is room for, and up to a thickness strips can be cut."""
        deep = self.request.depth or max(self.request.envelope)
        return width <= MAX_WIDTH_RATIO * deep and _can_be_cut(self.request, thickest * self.crank)

    def _is_doubtful(self, width: float) -> bool:
        return width > PROBABLY_TOO_WIDE * (self.request.depth or math.inf)

    def _candidate(self, kind: str, travel: tuple[float, float], part: dict[str, Any], design: Any) -> Candidate:
        """Return a part with its block `design`, which is to hold the force over a travel."""
        request, small = self.request, self.crank / FULL_PADS
        pads = {} if small >= 1.0 else {"part": {"pad": tuple(small * side for side in PAD_SIZE)}}
        about = {"material": self.material, "safety_factor": 1.01 / request.allowed_stress_share}
        data = {
            "family": "slider-crank",
            "name": "suggested",
            "mechanism": {**_mechanism(self.lengths, self.crank), **pads, **about, **part},
            "design": {"force": request.target, **design},
            "analysis": pushed_analysis(travel),
        }
        return Candidate(
            name_variant(kind, request, self.material),
            SliderCrankSpec.model_validate(data),
            True,
            finish,
            rank_by_size(self.crank, request),
            correct=correct,
        )

    def _strip(self, kind: str, travel: tuple[float, float], width: float) -> Candidate:
        """Return a strip of one thickness, to be sized by stress and force, that needs about a width [m]."""
        least = self.request.thinnest
        thick, wide = (least, MAX_THICKNESS_RATIOS * self.crank), (least, self.request.depth or self.crank)
        shape = {"shape": "uniform", "goal": "ripple", "width": wide, "thickness": thick}
        beam = {"width": wide[1], "thickness": 0.02 * self.crank}
        plain = self._candidate(kind, travel, {"beam": beam}, {"travel": travel, "beam": shape})
        return replace(plain, doubtful=self._is_doubtful(width))

    def strip(self, travel: tuple[float, float]) -> Candidate | None:
        """Return a strip; None if it would be much wider than there is room for."""
        return self._strip("strip", travel, self.width) if self._fits(self.width) else None

    def pair(self, travel: tuple[float, float]) -> Candidate | None:
        """Return a mirrored pair of strips, each half as wide as one strip; the guide of the slider carries nothing."""
        if not self._fits(0.5 * self.width):
            return None
        plain = self._strip("pair of strips", travel, 0.5 * self.width)
        return replace(plain, spec=plain.spec.replace({"mechanism.copies": "mirrored"}))

    def slow_parts(self) -> Iterator[Candidate]:
        """Yield flexures and tapered strips, which take longer to design; they begin late where they can."""
        if FLEXURES_WIDER * self.width <= MAX_WIDTH_RATIO * (self.request.depth or max(self.request.envelope)):
            for start in self.starts((LATE_START, *START_SHARES))[:2]:
                yield self._flexures(_window(self.request, start))
        if self._fits(self.width, THICKEST_TAPERED):
            for start in self.starts()[-1:]:
                yield self._tapered_strip(_window(self.request, start))

    def _tapered_strip(self, travel: tuple[float, float]) -> Candidate:
        """Return a strip of varying thickness, to be searched for the flattest force."""
        plain = self._strip("tapered strip", travel, self.width)
        thick = (max(self.request.thinnest, 0.005 * self.crank), THICKEST_TAPERED * self.crank)
        wide = plain.spec.design.beam.width  # type: ignore[attr-defined]
        shape = {"shape": "even", "nodes": N_STRIP_NODES, "goal": "ripple", "width": wide, "thickness": thick}
        promise = SLOW_PROMISE + abs(self.crank / self.request.envelope[1] - 0.35)
        return replace(plain, spec=plain.spec.replace({"design.beam": shape}), promise=promise)

    def _flexures(self, travel: tuple[float, float]) -> Candidate:
        """Return a chain of links and flexures: first the springs for the force, then flexures of that stiffness."""
        # rates per rad grow with force times length; those of Bilancia et al. 2019 are for 1.5 N at 54 mm
        rate = self.request.target / 1.5 * (self.crank / 0.054)
        rates = {"pivot": 0.028303 * rate, "crank_pin": 0.035379 * rate, "slider_pin": 0.035379 * rate}
        long = FLEXURE_LENGTH_RATIO * self.crank
        flexure = {"length": long, "thickness": 0.09 * long, "width": 2.0 * (0.09 * long)}
        part = {"springs": rates, "flexures": dict.fromkeys(rates, flexure)}
        return self._candidate("flexures", travel, part, {"travel": (0.0, travel[1]), "flexures": {}})


def _vary_by_turns(candidates: list[Candidate]) -> list[Candidate]:
    """Return as many candidates as are offered, of different kinds by turns; what takes long to design comes last."""
    # cut before what takes long goes to the end, or none of that would be left
    return sorted(take_turns(candidates)[:MAX_PROPOSALS], key=lambda candidate: candidate.promise >= SLOW_PROMISE)


def _materials(request: Request) -> list[dict[str, Any]]:
    return [dict(block) for block in request.materials] or [{"name": "pom"}]


def _mechanism(lengths: Proportions, crank: float) -> dict[str, Any]:
    """Return the linkage of a printed part."""
    return {
        "crank_length": crank, "stretched_position": lengths.stretched * crank, "offset": lengths.offset * crank,
        "unloaded_angle": lengths.unloaded,
    }  # fmt: skip


def correct(spec: SliderCrankSpec, request: Request) -> SliderCrankSpec:
    """Return a part over its flattest window, with the thicknesses and the widths that it needs as a solid.

    The force is linear in the widths, the stress falls nearly as the thickness.
    """
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.printed.model import analyze
    from cfmkit.families.slider_crank.printed.plane_fem_analysis import analyze as solve_solid

    request = aim_below_stiffening(spec, request, analyze)
    solid = spec.replace({"analysis.fidelity": "solid", "requirements": (), "sensitivity": None})
    _, end = solid.analysis.travel or (0.0, 0.0)
    result = solve_solid(
        solid.replace({"analysis.travel": (0.0, TRAVEL_EXTENSION * end), "analysis.window": None}), Run()
    )
    flat_window, material = flattest(result, request.travel), solid.mechanism.material
    if flat_window is None or material is None:
        return solid
    allowed = request.allowed_stress_share * (material.allowable(1.0) or np.inf)
    mean, stress = mean_and_stress(result.curve, flat_window)
    thinner = min(1.0, 0.99 * allowed / stress)
    window = tuple(Place(place, "length") for place in flat_window)
    changes: dict[str, Any] = {"analysis.travel": (0.0, flat_window[1]), "analysis.window": window}
    return solid.replace(changes | _scale_sections(solid, thinner, request.target / (mean * thinner**3)))


def _scale_sections(spec: SliderCrankSpec, thinner: float, wider: float) -> dict[str, Any]:
    """Return the thicknesses and widths of a strip, or of flexures, times two factors, by their paths."""
    strip = spec.mechanism.beam
    if strip is not None and spec.piece == "beam":
        thick = strip.thickness
        many = tuple(thinner * thickness for thickness in thick) if isinstance(thick, tuple) else thinner * thick
        return {"mechanism.beam.thickness": many, "mechanism.beam.width": wider * strip.width}
    names = "pivot", "crank_pin", "slider_pin"
    sizes: dict[str, Any] = {name: getattr(spec.mechanism.flexures, name) for name in names}
    thicknesses = {f"mechanism.flexures.{name}.thickness": thinner * size.thickness for name, size in sizes.items()}
    return thicknesses | {f"mechanism.flexures.{name}.width": wider * size.width for name, size in sizes.items()}


def finish(spec: SliderCrankSpec, request: Request) -> SliderCrankSpec:
    """Return a designed part whose widths, in which force is linear, give exactly the mean that is required."""
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.printed.model import analyze

    # the rates for which flexures were sized are not theirs
    rates: dict[str, Any] = {"mechanism.springs": {}} if spec.mechanism.flexures else {}
    made = spec.replace({"design": None, "requirements": (), "mechanism.safety_factor": 1.0, **rates})
    result = analyze(made, Run())
    if not result.curves:
        return made
    low, high = (float(end) for end in made.analysis.window or (0.0, 0.0))
    inside = (result.curve.motion >= low) & (result.curve.motion <= high)
    mean = float(np.mean(result.curve.effort[inside])) if inside.any() else 0.0
    if not mean > 0.0:
        return made
    factor = request.target / mean
    return made.replace(_scale_sections(made, 1.0, factor))
