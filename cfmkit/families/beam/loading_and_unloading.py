"""Force curves with hysteresis: branch `load` of the forward travel, branch `unload` of the return."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import LazyMapping, read_only
from cfmkit.curves import Column, Curve

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.elastica.results.between_points import BetweenPoints
    from cfmkit.elastica.results.path import ContactEvent
    from cfmkit.families.beam.solution import Solution

SAME_PLACE = 1e-9  # share of the range within which an event is at a point


def split_at_reversal(path: Path, count: int) -> tuple[Path, Path | None]:
    """Return the path up to the last of `count` requested values, and the rest, the return; None if it ends before."""
    turns = np.flatnonzero(path.requested == count - 1)
    if not len(turns) or turns[0] == len(path) - 1:
        return path, None
    turn, last = int(turns[0]), len(path)
    places = list(_points_of_events(path))
    events = path.contact_events
    load, unload = path.take(np.arange(turn + 1)), path.take(np.arange(turn, last))
    # what is requested on the way back is numbered as on the way there
    numbers = np.where(unload.requested >= count, 2 * (count - 1) - unload.requested, unload.requested)
    return (
        replace(load, contact_events=tuple(events[k] for k, point in enumerate(places) if point < turn)),
        replace(
            unload,
            contact_events=tuple(events[k] for k, point in enumerate(places) if point >= turn),
            requested=read_only(numbers, np.int64),
        ),
    )


def _points_of_events(path: Path) -> Iterator[int]:
    """Yield the point at which each event of a contact is."""
    marked, number = np.flatnonzero(path.changes_contact), 0
    event: ContactEvent
    for event in path.contact_events:
        near = SAME_PLACE * float(np.ptp(path.drive))
        while number < len(marked) - 1 and abs(path.drive[marked[number]] - event.drive) > near:
            number += 1
        yield int(marked[number])


def join_branches(load: Curve, unload: Curve) -> Curve:
    """Return one curve of both branches, in the order in which the mechanism goes through them."""

    def column(name: str) -> Column:
        there, back = load.extra[name], unload.extra[name]
        return Column(np.concatenate([there.values, back.values]), there.dimension)

    return Curve(
        np.concatenate([load.motion, unload.motion]),
        np.concatenate([load.effort, unload.effort]),
        np.repeat(["load", "unload"], [len(load.motion), len(unload.motion)]),
        np.concatenate([load.stable, unload.stable]),
        LazyMapping(load.extra, column),
        load.kind,
    )


def equilibria_of_both_branches(solution: Solution) -> BothBranches | None:
    """Return the equilibria between the points of both branches; None unless both cover the same motion."""
    there = solution.model_between_points
    back = None if solution.back is None else solution.back.model_between_points
    if there is None or back is None:
        return None
    first, second = (np.array([way.own_points[0], way.own_points[-1]]) for way in (there, back))
    return BothBranches({"load": there, "unload": back}) if np.allclose(first, second, rtol=0, atol=1e-12) else None


@dataclass(frozen=True, eq=False)
class BothBranches:
    """Effort and stress of both branches at every place (a `cfmkit.results.ClosedForm`)."""

    ways: dict[str, BetweenPoints]

    @property
    def places(self) -> FloatArray:
        """The points of both branches, and extremes between them, increasing [m or rad]."""
        return np.unique(np.concatenate([way.places for way in self.ways.values()]))

    @property
    def peaks(self) -> FloatArray:
        """Places of extremes of the effort between two points, and of corners, (m,) [m or rad]."""
        return np.unique(np.concatenate([way.peaks for way in self.ways.values()]))

    def effort(self, branch: str, places: FloatArray, /) -> FloatArray:
        """Return the effort of a branch at places of any shape [N or N m]."""
        return self.ways[branch].effort(branch, places)

    def stress(self, branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of a branch at places of any shape [Pa]."""
        return self.ways[branch].stress(branch, places)
