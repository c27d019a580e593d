"""Parts near a design: how numbers of it move with its errors, to first order, by central differences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.robust_design import SIGMA_STEP
from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.base import function_named

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Sampled
    from cfmkit.specs.spec import Spec

MOST_LOOKS, MOST_ANALYSES = 24, 12
"""Parts that are looked at the quick way, or analysed, for an estimate: some tenths of a second on any machine."""


def most_parts(spec: Spec, by_looks: bool = True) -> int:
    """Return how many parts near a design may be solved for an estimate that nobody requested.

    `by_looks`: whether the numbers can be had the quick way, where the family has one.
    """
    return MOST_LOOKS if by_looks and family(spec.family).sampled is not None else MOST_ANALYSES


def step_of(deviation: float) -> float:
    """Return the error at which a part is solved for its derivative, of an error's standard deviation."""
    return SIGMA_STEP * deviation


def exact_slopes(spec: Spec, places: FloatArray, paths: Sequence[str]) -> dict[str, Sampled]:
    """Return the derivatives of effort and stress at places, by those values of a design by which they are known."""
    quick = family(spec.family).sampled_slopes
    try:
        found = None if quick is None else function_named(quick)(spec, places, tuple(paths))
    except CfmError:
        return {}
    return {} if found is None else dict(found.by)


def slopes(
    numbers: Callable[[Spec], FloatArray | None], spec: Spec, steps: Mapping[str, tuple[float, float]]
) -> tuple[FloatArray, ...] | None:
    """Return the derivatives of numbers of a part by the values of a specification, (numbers,) for each.

    Parameters
    ----------
    numbers : callable
        Specification -> its numbers; None if a part has none.
    spec : Spec
        Of the design.
    steps : mapping of str to (float, float)
        Path of a value -> the value, and by how much it is moved to either side [SI].

    Returns
    -------
    tuple of arrays, or None
        In the order of `steps`; None if a part has no numbers.
    """
    found = []
    for path, (middle, step) in steps.items():
        above, below = numbers(spec.replace({path: middle + step})), numbers(spec.replace({path: middle - step}))
        if above is None or below is None or not (np.isfinite(above).all() and np.isfinite(below).all()):
            return None
        found.append((above - below) / (2.0 * step))
    return tuple(found)
