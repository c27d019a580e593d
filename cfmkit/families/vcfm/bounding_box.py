"""The box that a mechanism of V-beams and a spring stays in: walls, shuttle and base over travel and preloads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.base import Room
from cfmkit.families.vcfm.pose_outlines import scene

if TYPE_CHECKING:
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.results import Result

POSES = 9
"""Travels of each preload that are looked at: rigid parts move linearly, leaves bulge less than a wall is thick."""


def room(result: Result) -> Room | None:
    """Return the box of a solved mechanism over the travel of its nominal curve and all preloads."""
    if result.state is None:
        return None
    solution: Solution = result.state
    travels = np.linspace(0.0, float(solution.nominal.travel[-1]), POSES)
    preloads = result.spec.at("analysis.preloads")
    boxes = np.array([scene(solution, float(d), float(p)).box for d in travels for p in sorted(set(preloads))])
    (left, bottom), (right, top) = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    mechanism = result.spec.at("mechanism")
    coil = mechanism.springs.outer_diameter or 0.0 if mechanism.springs else mechanism.flexures.width
    depth = max(coil, mechanism.bistable.width)
    # leaves and a spring of leaves; or leaves, bought springs and the plate at their far ends
    parts = 2 + (mechanism.springs.count if mechanism.springs else 0)
    return Room(float(right - left), float(top - bottom), depth, parts, corner=(float(left), float(bottom)))
