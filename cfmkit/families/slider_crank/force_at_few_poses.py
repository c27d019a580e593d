"""Force and stress of a printed slider-crank at a few travels, in a part of the time of its analysis: for searches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.bounds_and_rounding import around
from cfmkit.families.base import Sampled
from cfmkit.families.findings import CannotBuild
from cfmkit.families.slider_crank.linkage_from_spec import linkage_of, resolve, unloaded_angle
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import elasticity
from cfmkit.families.slider_crank.printed.design import DEFAULT_THICKNESS
from cfmkit.families.slider_crank.printed.equilibrium_path import PressingEnd
from cfmkit.families.slider_crank.printed.model import chain_of
from cfmkit.families.slider_crank.printed.solution import Solution
from cfmkit.stock.spec import sheet_of

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


def sampled(spec: SliderCrankSpec, places: FloatArray) -> Sampled | None:
    """Return force and stress at travels; None of springs, and where the chain has no equilibrium at one of them.

    Parameters
    ----------
    spec : SliderCrankSpec
        With flexures or a strip.
    places : (p,) array
        Increasing travels [m].
    """
    if spec.fidelity in ("prb", "solid") or spec.analysis.side is not None or places[0] < 0:
        return None
    try:
        spec = resolve(spec)
        linkage = linkage_of(spec.mechanism)
        chain = chain_of(spec, linkage, unloaded_angle(spec.mechanism, linkage))
    except CannotBuild:
        return None
    pressed = chain.press(places, 0, spec.analysis.accuracy)
    if pressed.ending is not PressingEnd.COMPLETE:
        return None
    model = "lumped" if spec.fidelity == "lumped" else "beam"
    ends = float(places[0]), float(places[-1])
    solution = Solution(model, chain, pressed, elasticity(spec.mechanism), spec.mechanism.sets, ends, False)  # type: ignore[arg-type]
    return Sampled({"load": np.asarray(solution.force)}, np.asarray(solution.stress)[None])


def free(given: SliderCrankSpec, designed: SliderCrankSpec) -> dict[str, tuple[float, float]]:
    """Return thicknesses and width of a designed strip with the ranges of `design.beam`; of springs, their rates.

    The width of a strip from a sheet stays.

    Parameters
    ----------
    given : SliderCrankSpec
        With the `design` block.
    designed : SliderCrankSpec
        What came out.
    """
    wanted, beam = given.design.beam if given.design else None, designed.mechanism.beam
    if wanted is None or beam is None:
        return _rates(given, designed)
    found: dict[str, tuple[float, float]] = {}
    if isinstance(beam.thickness, tuple):
        ranges = wanted.thicknesses or (wanted.thickness or DEFAULT_THICKNESS,) * len(beam.thickness)
        if len(ranges) == len(beam.thickness):
            found |= {f"mechanism.beam.thickness.{k}": ends for k, ends in enumerate(ranges)}
    else:
        found["mechanism.beam.thickness"] = wanted.thickness or DEFAULT_THICKNESS
    if isinstance(wanted.width, tuple) and sheet_of(designed.mechanism.part) is None:
        found["mechanism.beam.width"] = wanted.width
    return {path: (float(low), float(high)) for path, (low, high) in found.items() if low < high}


def _rates(given: SliderCrankSpec, designed: SliderCrankSpec) -> dict[str, tuple[float, float]]:
    """Return the rates that a design chose, up to their limits; those of bought springs stay."""
    design, springs = given.design, designed.mechanism.springs
    if design is None or design.catalogue or springs.bought:
        return {}
    found = {}
    for joint in design.springs:
        rate, most = getattr(springs, joint), getattr(design.max_rates, joint, None)
        if rate > 0:
            found[f"mechanism.springs.{joint}"] = around(float(rate), high=most)
    return {path: ends for path, ends in found.items() if ends[0] < ends[1]}


def errors(spec: SliderCrankSpec) -> dict[str, str]:
    """Return which values a process errs in: how thick a strip comes out everywhere; of links, where holes lie.

    Springs are bought: their rates are no matter of the process.
    """
    mechanism = spec.mechanism
    if mechanism.beam is not None:
        return {"mechanism.beam.offset": "thickness"} if spec.fidelity == "beam" else {}
    if mechanism.flexures is not None:
        return {}
    given = {name: getattr(mechanism, name) for name in ("crank_length", "stretched_position", "offset")}
    return {f"mechanism.{name}": "position" for name, value in given.items() if isinstance(value, float)}
