"""Bought parts of a mechanism of snap-through leaves: its springs, where they are no structure of leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import mm, newton, rate
from cfmkit.families.hardware import mm as exact
from cfmkit.stock.parts_list import ListedPart
from cfmkit.stock.springs.guides import guide_cure, guide_needed, guide_words

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.families.vcfm.surroundings_spec import BoughtSprings


def parts_of(spec: VcfmSpec) -> tuple[ListedPart, ...]:
    """Return the leaves, and their spring: made, or bought."""
    mechanism, springs = spec.mechanism, spec.mechanism.springs
    material, leaves, flexures = mechanism.material.words, mechanism.bistable, mechanism.positive
    data = f"{leaves.half_beams} {leaves.structure}, {material}; geometry/vcfm.dxf"
    made = [ListedPart("shuttle, leaves and walls", "leaves", 1, data, "make", f"{exact(leaves.width)} deep")]
    if flexures is not None:
        data = f"{flexures.structure}, {material}; geometry/vcfm.dxf"
        made.append(ListedPart("below the shuttle", "spring", 1, data, "make", f"{exact(flexures.width)} deep"))
    return (*made, *([] if springs is None else [_list_springs(springs)]))


def _list_springs(springs: BoughtSprings) -> ListedPart:
    """Return the bought springs of the list."""
    data = [f"{springs.kind} spring, {rate(springs.rate)}"]
    if springs.initial_tension:
        data.append(f"initial tension {newton(springs.initial_tension)}")
    if springs.max_elongation:
        data.append(f"up to {mm(springs.max_elongation)}")
    if springs.free_length:
        data.append(f"{mm(springs.free_length)} relaxed")
    size = ""
    if wire := springs.wound:
        size = f"wire {exact(wire.wire)}, coil {exact(wire.coil)}, {wire.turns:g} turns"
        data.append(f"wire {mm(wire.wire)}, mean coil {mm(wire.coil)}, {wire.turns:g} turns")
    data += guide_words(springs)
    place = "below the shuttle" if springs.kind == "compression" else "above the shuttle"
    return ListedPart(place, springs.name or "", springs.count, ", ".join(data), "buy", size)


def _worst(solution: Solution) -> tuple[FloatArray, FloatArray]:
    """Return the largest preload of each mechanism and the deflection at the end of its travel, (m,) each [m]."""
    preload = solution.split_by_mechanism(solution.curves.preload[:, 0])
    rows, most = np.arange(len(preload)), preload.argmax(axis=1)
    last = solution.split_by_mechanism(solution.curves.ends[1])
    return preload[rows, most], (last + preload)[rows, most]


def is_overstretched(solution: Solution) -> Any:
    """Return which mechanisms deflect bought springs beyond their limit, (m,)."""
    limits = solution.column(
        lambda spec: (None if spec.mechanism.springs is None else spec.mechanism.springs.max_elongation) or None
    )
    return _worst(solution)[1] > limits * (1 + 1e-9)


def overstretching(solution: Solution) -> tuple[Any, ...]:
    """Return by how much the springs of one mechanism are deflected, and where they reach their limit."""
    springs, (preload, most) = solution.spec.mechanism.springs, (float(value[0]) for value in _worst(solution))
    limit = springs.max_elongation if springs is not None and springs.max_elongation else 0.0
    place = f"at {mm(limit - preload)} of travel" if limit > preload else "by the preload alone"
    return (
        f"with a preload of {mm(preload)} the springs are deflected by {mm(most)}, their limit is "
        f"{mm(limit)}, reached {place} ('mechanism.springs.max_elongation')",
    )


def buckles(solution: Solution) -> Any:
    """Return which mechanisms press springs without a guide so far that they buckle, (m,)."""
    limits = solution.column(
        lambda spec: None if spec.mechanism.springs is None or spec.mechanism.springs.is_guided
        else spec.mechanism.springs.unguided
    )  # fmt: skip
    return _worst(solution)[1] > limits * (1 + 1e-9)


def buckling(solution: Solution) -> tuple[Any, ...]:
    """Return how far the springs of one mechanism are pressed, and what guides them."""
    springs, (preload, most) = solution.spec.mechanism.springs, (float(value[0]) for value in _worst(solution))
    assert springs is not None
    return (
        f"a spring of {mm(springs.free_length or 0.0)} buckles when it is deflected by {mm(springs.unguided)} "
        f"(ends {springs.seats}), and is deflected by {mm(most)} with a preload of {mm(preload)}; "
        f"{guide_needed(springs, springs.coil, 'mechanism.springs')}",
        *guide_cure(springs.coil, "mechanism.springs"),
    )
