"""Points that cover the unit cube evenly, and the ways to draw them by name (Latin hypercube, Sobol, ...)."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


@dataclass(frozen=True)
class SampleKind:
    """A way to draw points."""

    name: str  # as users write it
    phrase: str  # what is drawn
    engine: str  # class of `scipy.stats.qmc`


SAMPLE_KINDS: dict[str, SampleKind] = {
    kind.name: kind
    for kind in (
        SampleKind("lhs", "a Latin hypercube", "LatinHypercube"),
        SampleKind("sobol", "a Sobol sequence", "Sobol"),
    )
}  # every way to draw points, in the order of the documentation; a new one is its line here


def list_phrases() -> str:
    """Return what is drawn, as a list in words."""
    *others, last = (kind.phrase for kind in SAMPLE_KINDS.values())
    return f"{', '.join(others)} or {last}"


def sample_unit_cube(
    name: str,  # one of `SAMPLE_KINDS`
    # dimension, count: of the cube, and number of points
    dimension: int,
    count: int,
    seed: int,  # of the permutations or the scrambling
) -> FloatArray:
    """Return points of the unit cube, (count, dimension)."""
    import numpy as np
    from scipy.stats import qmc

    engine: Any = getattr(qmc, SAMPLE_KINDS[name].engine)(dimension, seed=np.random.default_rng(seed))
    with warnings.catch_warnings():
        # A Sobol sequence that is not a power of two long is less balanced, not wrong.
        warnings.simplefilter("ignore", UserWarning)
        points: FloatArray = engine.random(count)
    return points
