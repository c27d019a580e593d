"""Many slider-cranks at once that differ in their springs: their requested values and their findings.

Of the findings only the names are known, as `findings` has them of one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.base import BlockAnswer
from cfmkit.families.no_mechanism import CannotBuild
from cfmkit.families.slider_crank.linkage_from_spec import resolve
from cfmkit.families.slider_crank.springs.bistability_class import (
    BOUNDARY,
    SNAPS,
)
from cfmkit.families.slider_crank.springs.findings import findings_of
from cfmkit.families.slider_crank.springs.many_designs.evaluate_many_spring_sets import EACH, PLACES, Base, Slab
from cfmkit.families.slider_crank.springs.model import (
    RATES,
    asked_motion,
    solve,
    target_of,
    window_of,
)
from cfmkit.families.slider_crank.springs.solution import GRID
from cfmkit.families.slider_crank.springs.sprung_linkage import TURN, assemble
from cfmkit.families.slider_crank.unit_springs import JOINTS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Block
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


LEGS = "mechanism.legs"
"""What this model can vary besides `RATES`."""

SLAB = 400_000
"""Values that are worked on together: few enough to stay in a processor's cache."""


def analyze_block(spec: SliderCrankSpec, block: Block) -> BlockAnswer | None:
    """Return what is requested about many sets of springs; None where something else is varied or requested.

    Parameters
    ----------
    spec : SliderCrankSpec
        What is varied.
    block : Block
        The variants and the measures.
    """
    if (
        spec.mechanism.pins
        or spec.mechanism.guide
        or spec.mechanism.copies != "single"
        or spec.mechanism.springs.anchor
    ):
        return None
    base = _base(spec) if set(block.values) <= {*RATES, LEGS} else None
    if base is None:
        return None
    block = block.in_places(asked_motion(base.spec, base.assembly))
    if not all(base.knows(measure) for measure in block.measures):
        return None

    rates, legs, done = _rates(spec, block)
    warnings = {name: done.copy() for name in of_linkage(base)}
    # named as the one branch of a single analysis is: a metric may ask for it
    values = tuple({"load": np.full(block.size, np.nan)} for _ in block.measures)
    dense = any(measure.name in PLACES or measure.name in EACH for measure in block.measures)
    size = max(1, SLAB // (3 * GRID if dense else base.points))
    chosen = np.flatnonzero(done)
    for start in range(0, len(chosen), size):
        rows = chosen[start : start + size]
        slab = Slab(base, rates[rows], legs[rows])
        for window in {one.window for one in block.measures if base.spreads(one.name)}:
            slab.inside(window)
        if slab.balanced.any():
            done[rows[slab.balanced]] = False
            rows = rows[~slab.balanced]
            slab = Slab(base, rates[rows], legs[rows])
        if not len(rows):
            continue
        for measure, found in zip(block.measures, values, strict=True):
            found["load"][rows] = slab.measured(measure)
        for name, warned in of_springs(slab):
            warnings.setdefault(name, np.zeros(block.size, dtype=bool))[rows] = warned
        done[rows[undecided(slab) | slab.balanced]] = False
    target = target_of(spec)
    targets = None if target is None else np.full(block.size, target)
    return BlockAnswer(done, values, targets, base.assembly.drive, warnings)


def _rates(spec: SliderCrankSpec, block: Block) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return the rates of all legs together, (n, 4), how many legs, and which are valid and not all zero."""
    springs = spec.mechanism.springs
    rates = np.tile([getattr(springs, name) for name in JOINTS], (block.size, 1)).astype(np.float64)
    for path, values in block.values.items():
        if path in RATES:
            rates[:, RATES[path]] = np.asarray(values, dtype=np.float64)
    legs = np.asarray(block.values.get(LEGS, np.full(block.size, spec.mechanism.legs)), dtype=np.float64)
    done = np.isfinite(rates).all(axis=1) & (rates >= 0.0).all(axis=1) & rates.any(axis=1)
    done &= (rates[rates > 0].min(initial=1.0) >= 1e-30) & (rates <= 1e30).all(axis=1) & (legs >= 1) & (legs <= 1000)
    return rates * legs[:, None], legs, done


def _base(spec: SliderCrankSpec) -> Base | None:
    """Return what a block shares; None where the linkage cannot be built, or does not reach all of the motion."""
    mechanism = spec.mechanism
    if any(part is not None for part in (mechanism.flexures, mechanism.beam, mechanism.limits)):
        return None
    if spec.analysis.fidelity not in (None, "prb"):
        return None
    try:
        spec = resolve(spec)
        assembly = assemble(spec)
    except CannotBuild:
        return None
    low, high = asked_motion(spec, assembly)
    base = Base(spec, assembly, low, high)
    whole = (
        replace(assembly, rates=np.ones(4)).within(low, high) == (low, high) and np.isfinite(base.units.effort).all()
    )
    return base if whole and np.isfinite(base.nodes[1].effort).all() else None


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
