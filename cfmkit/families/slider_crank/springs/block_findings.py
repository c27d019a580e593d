"""The names of the findings of many slider-cranks that differ in their springs, as `checks` has those of one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.assembly import TURN
from cfmkit.families.slider_crank.springs.findings import findings_of
from cfmkit.families.slider_crank.springs.model import solve, window_of
from cfmkit.families.slider_crank.springs.stiffness import BOUNDARY, SNAPS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.families.slider_crank.springs.block import Base, Slab


ROUNDING = 1e-9
"""Share of the largest effort that counts for nothing."""

OF_SPRINGS = (
    "second_stable_outside",
    "class_boundary",
    "quartic_minimum",
    "spring_winds_up",
    "same_position_twice",
    "reference_zero",
    "effort_changes_sign",
)
"""Findings that depend on the rates; all others are of the linkage and the motion, and of all designs or none."""


def of_linkage(base: Base) -> tuple[str, ...]:
    """Return the findings that all designs of a block share."""
    solution, short = solve(base.spec, replace(base.assembly, rates=np.ones(4)))
    found = (*short, *findings_of(base.spec, solution))
    return tuple(dict.fromkeys(item.name for item in found if item.name not in OF_SPRINGS))


def of_springs(slab: Slab) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield the findings that depend on the rates, and which designs have them; see `undecided` for one more."""
    base, rates, found = slab.base, slab.rates, slab.classified
    assembly, torque = base.assembly, base.assembly.drive == "torque"
    yield "second_stable_outside", np.asarray((found.kind == SNAPS) & (found.unstable > 0))
    yield "class_boundary", np.asarray(np.abs(found.drop - 1.0) < BOUNDARY)
    if torque and base.low <= assembly.start <= base.high and assembly.linkage.knee(assembly.unloaded) == 0:
        yield "quartic_minimum", np.asarray(~rates[:, :3].any(axis=1))
    if torque and base.high - base.low >= TURN * (1 - 1e-9):
        yield "spring_winds_up", np.asarray((rates[:, :2] > 0.0).any(axis=1))
        yield "same_position_twice", _at_rest(slab, base.low) & _at_rest(slab, base.high)
    if base.low <= base.reference <= base.high:
        yield "reference_zero", np.isnan(slab.level)
    window = window_of(base.spec, assembly)
    if window is not None:
        inside = slab.effort[:, (base.motion >= window[0]) & (base.motion <= window[1])]
        if inside.shape[1]:
            yield "effort_changes_sign", np.asarray((inside.min(axis=1) < 0.0) & (inside.max(axis=1) > 0.0))


def _at_rest(slab: Slab, motion: float) -> NDArray[np.bool_]:
    """Return which designs have a stable equilibrium at an end of the motion."""
    nothing = np.abs(slab.at(motion)) <= ROUNDING * np.abs(slab.sharp).max(axis=1)
    return np.asarray(nothing & (slab.at(motion, "stiffness") > 0.0))


def undecided(slab: Slab) -> NDArray[np.bool_]:
    """Return which designs may rest twice in one position inside the motion, which goes over more than a turn."""
    turns = slab.base.assembly.drive == "torque" and slab.base.high - slab.base.low > TURN * (1 + 1e-9)
    return np.asarray((slab.classified.stable > 1) & turns)
