"""Other springs and leaves in the place of a designed diamond and its Vs: folded springs, cosine arches, hybrid leaves.

The force is linear in both widths. So a structure needs no design of its own: of all windows as long as the travel
that is taken in which the widths that fit the force best leave the least of it; what is stressed too much gets longer.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, sin, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SolutionError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.exact_model import ExactSampler
    from cfmkit.families.vcfm.spec import VcfmSpec

STRUCTURES: dict[str, dict[str, Any]] = {
    "folded spring": {"mechanism.positive.structure": "folded", "mechanism.positive.angle": 0.0},
    "cosine arches": {"mechanism.bistable.structure": "cosine"},
    "hybrid leaves": {"mechanism.bistable.structure": "hybrid"},
}
"""Name -> what is changed of a designed mechanism."""

FLEXURE = 0.2
"""Length of each flexure of a hybrid leaf over that of the leaf: as in Ding, Li and Li 2022, a little longer."""

HIGHER = 1.6
"""Rise of hybrid leaves over that of straight ones for the same travel."""

CENTRES = np.linspace(0.5, 1.5, 41)
"""Middles of windows that are looked at, over the rise: that of Vs is 1, that of cosine arches 4/3."""

ROUNDS = 3
"""Times that parts are made longer: stress falls a little less than with the square of the length."""


@dataclass(frozen=True)
class _Fit:
    """The best window of a structure: what both widths are to be multiplied by, the stresses [Pa] and the end [m]."""

    wide: float
    stiff: float
    stresses: tuple[float, float]
    end: float


def with_structure(spec: VcfmSpec, name: str, force: float, travel: float, strength: float) -> tuple[VcfmSpec, float]:
    """Return a designed mechanism with another structure for a force over a travel, and where its best window ends [m].

    Parameters
    ----------
    spec : VcfmSpec
        With a diamond and straight leaves.
    name : str
        Of `STRUCTURES`.
    force, travel, strength : float
        [N], [m], [Pa].

    Raises
    ------
    cfmkit.errors.SolutionError
        If no widths above zero fit, or the leaves cannot be followed that far.
    """
    changes: dict[str, Any] = dict(STRUCTURES[name])
    leaf = spec.mechanism.bistable
    if changes.get("mechanism.bistable.structure") == "hybrid":
        # their force falls over a smaller share of the rise
        changes["mechanism.bistable.flexure_length"] = FLEXURE * leaf.length
        changes["mechanism.bistable.angle"] = asin(min(HIGHER * sin(leaf.angle), 0.25))
    made = spec.replace({**changes, "design": None, "requirements": (), "mechanism.safety_factor": 1.0})
    made = made.replace({"analysis.fidelity": "exact", "analysis.preloads": (0.0,), "analysis.window": None})
    found = _fitted(made, force, travel)
    for _ in range(ROUNDS):
        over = [stress / strength for stress in found.stresses]
        if max(over) <= 1.0:
            break
        made = _longer(made, [max(1.0, sqrt(1.02 * one)) for one in over])
        found = _fitted(made, force, travel)
    made = _wider(made, found)
    return made, found.end


def _fitted(spec: VcfmSpec, force: float, travel: float) -> _Fit:
    """Return the window and the widths with which the force departs least from the wanted one."""
    from cfmkit.families.vcfm.exact_model import ExactSampler

    rise = spec.mechanism.bistable.length * sin(spec.mechanism.bistable.angle)
    centres = [one * rise for one in CENTRES if one * rise > 0.51 * travel]
    if not centres:
        raise SolutionError("the leaves are too flat for the travel")
    end = max(centres) + 0.5 * travel
    sampler = ExactSampler(spec, end, 0.0)
    while sampler.problem and len(centres) > 1:
        # leaves that cannot be followed so far: windows that end earlier
        centres = centres[: len(centres) // 2]
        end = centres[-1] + 0.5 * travel
        sampler = ExactSampler(spec, end, 0.0)
    if sampler.problem:
        raise SolutionError(sampler.problem)
    tried = [one for one in (_in_window(sampler, at, force, travel) for at in centres) if one is not None]
    if not tried:
        raise SolutionError("no widths of this structure give the force over the travel")
    _, at, wide, stiff = min(tried)
    last = at + 0.5 * travel
    leaf = float(sampler.leaves(np.linspace(0.0, last, 201)).stress.max())
    return _Fit(wide, stiff, (leaf, float(sampler.spring(np.array([last]))[1].max())), last)


def _in_window(
    sampler: ExactSampler, at: float, force: float, travel: float
) -> tuple[float, float, float, float] | None:
    """Return what is left of the force around a place, the place and both factors; None where one is not above zero."""
    places: FloatArray = np.linspace(at - 0.5 * travel, at + 0.5 * travel, 61)
    columns = np.column_stack([sampler.leaves(places).force, sampler.spring(places)[0]])
    if not np.isfinite(columns).all():
        return None
    (wide, stiff), *_ = np.linalg.lstsq(columns, np.full(len(places), force), rcond=None)
    if not (wide > 0.0 and stiff > 0.0):
        return None
    left = np.abs(columns @ np.array([wide, stiff]) / force - 1.0).max()
    return float(left), at, float(wide), float(stiff)


def _wider(spec: VcfmSpec, fit: _Fit) -> VcfmSpec:
    parts = spec.mechanism
    return spec.replace(
        {
            "mechanism.bistable.width": parts.bistable.width * fit.wide,
            "mechanism.positive.width": parts.flexures.width * fit.stiff,
        }
    )


def _longer(spec: VcfmSpec, factors: list[float]) -> VcfmSpec:
    """Return a mechanism whose leaves of the same rise, and whose spring, are longer by factors."""
    leaf, spring = spec.mechanism.bistable, spec.mechanism.flexures
    rise, length = leaf.length * sin(leaf.angle), leaf.length * factors[0]
    changes = {
        "mechanism.bistable.length": length,
        "mechanism.bistable.angle": asin(rise / length),
        "mechanism.positive.length": spring.length * factors[1],
    }
    if leaf.flexure_length is not None:
        changes["mechanism.bistable.flexure_length"] = leaf.flexure_length * factors[0]
    return spec.replace(changes)
