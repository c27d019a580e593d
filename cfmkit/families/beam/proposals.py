"""Proposals of beam mechanisms for a request: shapes kept as files, rescaled, then refitted by models that stretch.

Beams that only bend follow one curve: with every length in the plane times k, the thickness times q and the width times
b, the force at the k-fold displacement is b q^3/k^2 times as large, the stress q/k times [L, eq. 6]. So a shape that
was followed once tells, for every size, which window of its travel is the flattest, how thick its beams may be and how
wide they must be.

Reference
---------
[L] C.-C. Lan, J.-H. Wang, Y.-H. Chen, IEEE ICRA (2010) 2131, sec. 2.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.resources import files
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.export.posed_part import box
from cfmkit.families.base import BoundingBox
from cfmkit.families.beam.model import analyze
from cfmkit.families.beam.network_from_spec import assemble
from cfmkit.families.beam.part import as_made, part_over_motion
from cfmkit.families.beam.spec import BeamSpec
from cfmkit.families.findings import mm, percent
from cfmkit.families.proposals import (
    Candidate,
    FamilyOffer,
    aim_below_stiffening,
    flattest,
    is_too_wide,
    mean_and_stress,
    name_variant,
    ripples,
    take_turns,
)
from cfmkit.families.run_control import Run
from cfmkit.specs.units import Place
from cfmkit.specs.yamlio import read_document
from cfmkit.stock.material_and_part_spec import MaterialSpec

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.proposals import Request
    from cfmkit.results import Result

SHAPE_FILES = ("lan-2010", "lan-flat", "lan-wide", "lan-tall", "arch", "end-effector-leg")
"""Files of `shapes`: each a complete specification, as the papers or the shape search have it."""
RELATIVE_SIZES = (1.0, 0.96, 0.85, 0.7, 0.55, 0.42, 0.32, 0.24)
"""Sizes that are tried, over the largest that fits the envelope with the pads scaled, too, which they are not."""
ROUNDED_BOX = 1.0 - 2e-4  # share of the envelope that the largest takes: its lengths are rounded
BENDING_STRESS_SHARE = 0.95  # share of the allowable stress by bending alone: what stretching adds is judged afterwards
RIPPLE_SHARES = (0.95, 1.02)
"""Shares of the ripple required that the scaled curve may have: the second where no window has the first."""
DEPTH_SHARE = 0.99
"""Width over the depth that may seem to be needed: stretch and shear make beams softer or stiffer by a per cent."""
MAX_THICKNESS_RATIOS = (1.15, 1.0)
"""Largest thicknesses over that of the shape at the same size: thicker beams would touch, and hardly bend as lines do;
of its own thickness a shape keeps its curve to the last digit, and its pads their share of the envelope."""
MIN_WIDTH_RATIO = 1.0  # least width of a beam over its thickness: narrower ones leave the plane
MAX_PROPOSALS = 24
WIDE_LAST = 100.0  # promise of shapes whose beams are too wide to curl: they come after all others
SAYS_LESS = 1e3
"""Times by which a shape that cannot travel so far misses more: the reason is that of one that can, if there is any."""


@dataclass(frozen=True)
class KeptShape:
    """A shape with its curve, as it was followed once."""

    name: str
    spec: BeamSpec
    # motion, force, stress, (n,): [m], [N], [Pa]
    motion: FloatArray
    force: FloatArray
    stress: FloatArray
    envelope: BoundingBox


@lru_cache(maxsize=1)
def load_kept_shapes() -> tuple[KeptShape, ...]:
    """Return all shapes that are kept, each followed over its travel by the model in its file.

    That is bending alone, whose curve is the same for every thickness, or, where beams are stout, with stretch and
    shear: then the curve is exact where the thickness goes with the size, and a guess elsewhere.
    """
    plain = tuple(_follow_shape(name) for name in SHAPE_FILES)
    return (*plain, *(_stack_two_layers(kept) for kept in plain if kept.spec.mechanism.copies is not None))


def _follow_shape(name: str) -> KeptShape:
    text = files("cfmkit").joinpath(f"families/beam/shapes/{name}.yaml").read_text(encoding="utf-8")
    spec = read_document(text, name).bind(BeamSpec)
    result = analyze(spec, Run())
    part = part_over_motion(result)
    assert part is not None
    curve = result.curve
    return KeptShape(
        name, spec, curve.motion, curve.effort, curve.extra["max_stress"].values, BoundingBox.from_part(part)
    )


def _stack_two_layers(kept: KeptShape) -> KeptShape:
    """Return two of a shape in series: twice the travel at the same force and stress."""
    spec = kept.spec.replace({"mechanism.copies.layers": 2})
    single_height, double_height = (float(box(as_made(assemble(stacked)))[1, 1]) for stacked in (kept.spec, spec))
    space = replace(kept.envelope, along=kept.envelope.along + double_height - single_height)
    return replace(kept, name=f"{kept.name} in two layers", spec=spec, motion=2.0 * kept.motion, envelope=space)


def propose(request: Request, run: Run) -> FamilyOffer:
    """Return rescaled shapes that do what is required as far as bending goes, those that fill the envelope least first.

    For a yield the thickest come first.
    """
    if request.kind == "torque":
        return FamilyOffer(reason="the stored shapes are driven by a displacement: they give a force, no torque")
    if request.adjustable is not None:
        return FamilyOffer(reason="the force of a network of beams cannot be adjusted")
    candidates: list[Candidate] = []
    missed: list[tuple[float, str]] = []
    for kept in load_kept_shapes():
        sides = request.envelope[0] / kept.envelope.across, request.envelope[1] / kept.envelope.along
        largest = ROUNDED_BOX * min(sides)
        for share in RELATIVE_SIZES:
            for block, ratio in product(request.materials or ({"name": "pom"},), MAX_THICKNESS_RATIOS):
                candidate = _rescale_shape(request, kept, share * largest, dict(block), ratio)
                if not isinstance(candidate, Candidate):
                    missed.append(candidate)
                elif not candidates or candidate.spec != candidates[-1].spec:
                    candidates.append(candidate)
    if candidates:
        candidates.sort(key=lambda candidate: candidate.promise)  # the shape of the most promising one first
        return FamilyOffer(tuple(take_turns(candidates)[:MAX_PROPOSALS]))
    return FamilyOffer(reason=min(missed, key=lambda miss: miss[0])[1])


def _rescale_shape(
    request: Request, kept: KeptShape, size: float, block: dict[str, Any], thickest: float
) -> Candidate | tuple[float, str]:
    """Return a shape at a size, up to a thickness over its own, or how far it misses what is required, and why."""
    length = request.travel / size
    low, high = float(kept.motion[0]), float(kept.motion[-1])
    if length > 0.98 * (high - low):
        reason = f"beams that fit this envelope have a constant force over about {mm(0.6 * (high - low) * size)}"
        return SAYS_LESS * length / (high - low), reason
    starts = np.linspace(low, high - length, 200)
    ripple = ripples(kept.motion, kept.force, starts, length)
    ends = np.searchsorted(kept.motion, starts + length).clip(max=len(kept.motion) - 1)
    stress = np.maximum.accumulate(kept.stress)[ends]
    flat_windows = (np.flatnonzero(ripple <= share * request.ripple) for share in RIPPLE_SHARES)
    flat = next((windows for windows in flat_windows if len(windows)), None)
    if flat is None:
        least = float(ripple.min())
        reason = f"the force of beams in this envelope changes by {percent(least)} over the travel"
        return 1.0 + least / request.ripple, reason
    best = int(flat[np.argmin(stress[flat] / 1e3 ** (1 - ripple[flat]))])
    window = float(starts[best]) * size, float(starts[best] + length) * size
    places = np.linspace(starts[best], starts[best] + length, 101)
    curve = float(stress[best]), float(np.interp(places, kept.motion, kept.force).mean())
    return _size_section(request, kept, size, block, window, curve, thickest * size)


def _size_section(
    request: Request,
    kept: KeptShape,
    size: float,
    block: dict[str, Any],
    window: tuple[float, float],
    curve: tuple[float, float],
    thickest: float,
) -> Candidate | tuple[float, str]:
    """Return the shape with its thickness from the stress and its width from the force."""
    material, mechanism = MaterialSpec.model_validate(block), kept.spec.mechanism
    stiffer = material.modulus / mechanism.material.modulus
    thin = float(mechanism.thickness) if isinstance(mechanism.thickness, float) else 0.0
    stress, force = curve
    strength = material.allowable(1.0)
    if strength is None or not force > 0.0:
        return 1e9, "no strength of the material is known"
    thicker = min(BENDING_STRESS_SHARE * request.allowed_stress_share * strength * size / (stress * stiffer), thickest)
    wide = _width(request, kept, size, stiffer, thicker, force)
    if wide < MIN_WIDTH_RATIO * thicker * thin:
        # thinner, so that the same force wants as much width as the beam is thick
        thicker *= (wide / (MIN_WIDTH_RATIO * thicker * thin)) ** 0.25
        wide = _width(request, kept, size, stiffer, thicker, force)
    if thicker * thin < request.thinnest:
        reason = f"beams would be {mm(thicker * thin)} thick, at least {mm(request.thinnest)} needed"
        return request.thinnest / (thicker * thin), reason
    if request.depth is not None and wide > DEPTH_SHARE * request.depth:
        reason = f"the beams would be {mm(wide)} wide, at most {mm(DEPTH_SHARE * request.depth)} fit"
        return wide / request.depth, reason
    spec = _write_shape(kept, size, block, (thicker * thin, wide), window)
    area = size**2 * kept.envelope.across * kept.envelope.along / (request.envelope[0] * request.envelope[1])
    # of made parts those with thick beams are most alike: an error of the thickness counts three times
    promise = area if request.stated.min_yield is None else -thicker * thin
    strain = request.allowed_stress_share * strength / material.modulus
    promise += mechanism.layers - 1.0  # one layer is easier to make than two
    promise += WIDE_LAST * is_too_wide(request, wide, thicker * thin, strain)
    variant = name_variant(f"shape {kept.name}", request, block)
    free = "mechanism.thickness", "mechanism.width"
    return Candidate(variant, spec, False, finish, promise, free, correct)


def _width(request: Request, kept: KeptShape, size: float, stiffer: float, thicker: float, force: float) -> float:
    """Return the width that gives the required force [m]."""
    return float(kept.spec.mechanism.width * request.target / force * size**2 / (stiffer * thicker**3))


def _write_shape(
    kept: KeptShape, size: float, block: dict[str, Any], section: tuple[float, float], window: tuple[float, float]
) -> BeamSpec:
    """Return the shape at a size, with another material and section."""
    data = kept.spec.model_dump(exclude_unset=True) | {"family": "beam", "name": "suggested"}
    mechanism: dict[str, Any] = data["mechanism"]
    for node in mechanism["nodes"].values():
        node["at"] = tuple(size * value for value in node["at"])
    for beam in mechanism["beams"].values():
        if "length" in beam["shape"]:
            beam["shape"]["length"] *= size
    mechanism |= {"material": block, "thickness": section[0], "width": section[1], "safety_factor": 1.0}
    travel = {"travel": Place(window[1], "length"), "window": tuple(Place(end, "length") for end in window)}
    data["analysis"] = {"points": 181, "fidelity": "reissner", **travel}
    return BeamSpec.model_validate(data)


def finish(spec: BeamSpec, request: Request) -> BeamSpec:
    """Return a rescaled shape with the flattest window and the width that its model with stretch and shear wants."""
    made = spec
    for _ in range(2):
        refitted, thinner = _refit(made, request, analyze)
        if refitted is None:
            return made
        made = refitted
        if thinner == 1.0:
            break
    return made


def correct(spec: BeamSpec, request: Request) -> BeamSpec:
    """Return a shape with the flattest window, the thickness and the width that it needs as a solid."""
    from cfmkit.families.beam.plane_fem_analysis import analyze as solve_solid

    solid = spec.replace({"analysis.fidelity": "solid"})
    refitted, _ = _refit(solid, aim_below_stiffening(spec, request, analyze), solve_solid)
    return solid if refitted is None else refitted


def _refit(spec: BeamSpec, request: Request, model: Callable[[BeamSpec, Run], Result]) -> tuple[BeamSpec | None, float]:
    """Return a shape over its flattest window by a model, its force as required, and by what its beams became thinner.

    The force is linear in the width. Where the stress is above the allowable one, the beams get thinner and wider: it
    falls nearly as the thickness. None if the curve is shorter than the travel.
    """
    longer = 1.12 * float(spec.analysis.travel or 0.0)
    free = {"analysis.travel": longer, "analysis.window": None, "requirements": (), "sensitivity": None}
    result = model(spec.replace(free), Run())
    window = flattest(result, request.travel)
    if window is None:
        return None, 1.0
    allowed = request.allowed_stress_share * (spec.mechanism.material.allowable(1.0) or np.inf)
    mean, stress = mean_and_stress(result.curve, window)
    thinner = min(1.0, 0.99 * allowed / stress)
    thickness = float(spec.mechanism.thickness) * thinner  # type: ignore[arg-type]
    changes = {
        "mechanism.thickness": thickness,
        "mechanism.width": spec.mechanism.width * request.target / (mean * thinner**3),
        "analysis.travel": Place(window[1], "length"),
        "analysis.window": tuple(Place(end, "length") for end in window),
        "requirements": (),
    }
    return spec.replace(changes), thinner
