"""Force and stress of a printed slider-crank at a few travels, in a part of the time of its analysis: for searches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.base import Sampled
from cfmkit.families.findings import CannotBuild
from cfmkit.families.slider_crank.linkage import resolve
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import chain_of, elasticity
from cfmkit.families.slider_crank.printed.equilibrium_path import PressingEnd
from cfmkit.families.slider_crank.printed.solution import Solution

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


def sample_poses(
    spec: SliderCrankSpec,  # with flexures or a strip
    places: FloatArray,  # (p,): increasing travels [m]
    paths: Sequence[str] = (),  # of values by which slopes are wanted; none are known
) -> Sampled | None:
    """Return force and stress at travels; None of springs, and where the chain has no equilibrium at one of them."""
    if spec.fidelity in ("prb", "solid") or spec.analysis.side is not None or places[0] < 0:
        return None
    if places[-1] > spec.mechanism.end_stops.rigid_ends[1]:
        return None
    try:
        spec = resolve(spec)
        chain = chain_of(spec)
    except CannotBuild:
        return None
    pressed = chain.press(places)
    if pressed.ending is not PressingEnd.COMPLETE:
        return None
    ends = float(places[0]), float(places[-1])
    solution = Solution(chain, pressed, elasticity(spec.mechanism), spec.mechanism.sets, ends, spec=spec)
    return Sampled({"load": np.asarray(solution.force)}, np.asarray(solution.stress)[None])
