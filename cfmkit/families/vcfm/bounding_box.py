"""The box that a mechanism of V-beams and a spring stays in: walls, shuttle and base over travel and preloads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.families.base import Room
from cfmkit.families.vcfm.outline import sizes_of_frame
from cfmkit.families.vcfm.pose_outlines import scene

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.vcfm.curves_in_rows import Push
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.results import Result

POSES = 9
"""Travels of each preload that are looked at: rigid parts move linearly, leaves bulge less than a wall is thick."""


def room(result: Result) -> Room | None:
    """Return the box of a solved mechanism from rest over its travel at all preloads, with its walls as cut."""
    if result.state is None:
        return None
    solution: Solution = result.state
    poses = [(place, push.preload) for push in solution.pushes for place in _travels(push)]
    boxes = np.array([*(scene(solution, *pose).box for pose in poses), *_of_frame(solution)])
    (left, bottom), (right, top) = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    mechanism = result.spec.at("mechanism")
    coil = mechanism.springs.outer_diameter or 0.0 if mechanism.springs else mechanism.flexures.width
    depth = max(coil, mechanism.bistable.width)
    # leaves and a spring of leaves; or leaves, bought springs and the plate at their far ends
    parts = 2 + (mechanism.springs.count if mechanism.springs else 0)
    return Room(float(right - left), float(top - bottom), depth, parts, corner=(float(left), float(bottom)))


def _travels(push: Push) -> list[float]:
    """Return travels of a curve, from as made or, where a preload pushes the shuttle back, from rest on [m]."""
    end = float(push.travel[-1])
    back = [push.rest] if push.rest is not None and push.rest < 0 else []
    return [*back, *np.linspace(0.0, end, POSES).tolist()]


def _of_frame(solution: Solution) -> Iterator[tuple[float, float, float, float]]:
    """Yield the box of walls, stop and ground where their sizes are stated; poses are drawn with plain walls."""
    spec = solution.spec
    if spec.mechanism.part is None or spec.mechanism.part.frame is None:
        return
    try:
        sizes = sizes_of_frame(spec)
    except GeometryError:  # such a part cannot be cut, as its export says
        return
    highest = sizes.wall_top
    if sizes.stopped:
        back = min((push.rest or 0.0 for push in solution.pushes), default=0.0)
        highest = max(highest, sizes.under + sizes.shuttle - min(back, 0.0))
    lowest = sizes.wall_bottom if sizes.floor is None else sizes.floor - sizes.ground
    yield -sizes.out, lowest, sizes.out, highest
