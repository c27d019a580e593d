"""Sizes and paths of the parts of a cam mechanism, and how deep they lie beside each other; lengths in metres."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.stock.springs.made_to_measure import extension_spring

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.springs_spec import Springs

PLATE_THICKNESS = 0.008  # thickness of the plate where no `contact.width` says it [m]: that of the contact's example


def roller_path(solution: Solution) -> FloatArray:
    """Return the positions of the right roller's axis over the solution, (n, 2) [m]."""
    return np.column_stack([solution.states.x, solution.states.y])


def pin_path(solution: Solution) -> FloatArray:
    """Return the positions of the slider's pin over the solution, (n, 2) [m]."""
    (x, y), length = roller_path(solution).T, solution.assembly.track.brace_length
    return np.column_stack([0.0 * x, y + np.sqrt((length - x) * (length + x))])


BRACE_WIDTH = 0.010
"""Thickness of a brace where the plate is thicker [m]: it is pulled along, the plate is pressed on its edge."""


def depth_of(
    thick: float,  # of the plate, and of each brace up to `BRACE_WIDTH` [m]
    springs: Springs,  # how many of what stiffness: half of them on either side, above each other
    # stretch, half_width: their largest elongation, and half their length at rest [m]
    stretch: float,
    half_width: float,
    safety: float = 1.0,  # of springs whose wire is not known, against yield
) -> float | None:
    """Return the depth with springs of a known wire, else wound of steel wire [m]; None if no such spring fits."""
    outer = coil_diameter(springs, stretch, half_width, safety)
    return None if outer is None else thick + 2.0 * min(thick, BRACE_WIDTH) + min(count_of(springs), 2) * outer


def coil_diameter(springs: Springs, stretch: float, half_width: float, safety: float = 1.0) -> float | None:
    """Return the outer diameter of each spring, of its known wire or else wound of steel wire [m]; None if none fits.

    `stretch`, `half_width`, `safety`: as of `depth_of`.
    """
    sizes = wire_and_coil(springs, stretch, half_width, safety)
    return None if sizes is None else sum(sizes)


def wire_and_coil(
    springs: Springs, stretch: float, half_width: float, safety: float = 1.0
) -> tuple[float, float] | None:
    """Return the wire's diameter and the mean one of the coil of each spring [m], as `coil_diameter` has them."""
    if springs.wound is not None:
        return springs.wound.wire, springs.wound.coil
    made = extension_spring(springs.total / count_of(springs), stretch, 2.0 * half_width, safety)
    return None if made is None else (made.wire, made.coil)


def stack_height(outer: float, count: int) -> float:
    """Return how high springs of an outer diameter stand above each other, half of them on either side [m].

    >>> stack_height(0.01, 4), stack_height(0.01, 5)
    (0.02, 0.03)
    """
    return outer * ((count + 1) // 2)


def count_of(springs: Springs) -> int:
    """Return how many springs there are."""
    return len(springs.each) if isinstance(springs.each, tuple) else springs.count or 1
