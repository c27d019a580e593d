"""Clearance of beams: a smooth bound of the smallest gap of a pair over the required one, with derivatives.

Beams that meet in a joint come close to each other there. So the gap that is required between two places grows with
the way between them around the joint, up to the full one; that also asks for an angle between beams that meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.beam.build import thickest_of
from cfmkit.families.beam.shaping.response import BeamAtPoses
from cfmkit.numerics.sampled_extremes import soft_least

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.beam.shaping.response import View

SHARPNESS = 25.0
_PLACES = 16


@dataclass(frozen=True)
class Pair:
    """Two beams, or one twice, and the ends (0 or 1 of each) at which they meet."""

    beams: tuple[str, str]
    joints: tuple[tuple[int, int], ...]

    @property
    def alone(self) -> bool:
        """Whether it is one beam with itself."""
        return self.beams[0] == self.beams[1]


def pairs(network: Network) -> list[Pair]:
    """Return all pairs of beams, each beam with itself included."""
    return [_pair(network, *names) for names in combinations_with_replacement(network.beams, 2)]


def _pair(network: Network, first: str, second: str) -> Pair:
    ends = [[network.master_of(end) for end in (network.beams[n].start, network.beams[n].end)] for n in (first, second)]
    joints = [(i, j) for i in (0, 1) for j in (0, 1) if ends[0][i] == ends[1][j]]
    return Pair((first, second), () if first == second else tuple(joints))


def separations(view: View, pair: Pair) -> tuple[FloatArray, Callable[[], FloatArray]]:
    """Return (gap / required gap - 1) of a pair at the poses that are shown (q,), and what makes the derivatives."""
    state, shown = view.response.state, view.poses.shown
    a, b = (thinned(state.lines[name]) for name in pair.beams)
    way, by_way = _way(view, pair)
    wanted = _wanted(view, pair)
    opening = view.response.variables.task.limits.opening
    near = opening * way < wanted
    required = np.where(near, opening * way, wanted)
    i, j = np.nonzero(_compared(pair, way, len(a.place)))
    dx, dy = a.x[shown][:, i] - b.x[shown][:, j], a.y[shown][:, i] - b.y[shown][:, j]
    distance = np.hypot(dx, dy) + 1e-12
    ratio = distance / required[i, j]
    soft, weights = soft_least(ratio, SHARPNESS)

    def slopes() -> FloatArray:
        by = {name: thinned(view.response.slopes.lines[name]) for name in pair.beams}
        share = weights / required[i, j]
        out = []
        for q, pose in enumerate(shown):
            pull = np.stack([share[q] * dx[q] / distance[q], share[q] * dy[q] / distance[q]])
            total = np.zeros(view.response.x.shape)
            for sign, name, index in ((1.0, pair.beams[0], i), (-1.0, pair.beams[1], j)):
                count = by[name].x.shape[1]
                total += sign * np.bincount(index, pull[0], count) @ by[name].x[pose]
                total += sign * np.bincount(index, pull[1], count) @ by[name].y[pose]
            push = np.where(near[i, j], opening * share[q] * ratio[q], 0.0)
            out.append(total - np.tensordot(push, by_way[:, i, j], axes=(0, 1)))
        return np.array(out)

    return soft - 1.0, slopes


def thinned(line: BeamAtPoses) -> BeamAtPoses:
    """Return a line at about 17 of its places: a smooth bound must not depend on how finely the engine cut the beam."""
    step = max(1, (len(line.place) - 1) // _PLACES)
    return BeamAtPoses(line.place[::step], line.x[:, ::step], line.y[:, ::step], line.stress[:, ::step])


def _compared(pair: Pair, way: FloatArray, count: int) -> Any:
    """Return which places are compared: not a joint with itself, and no neighbours on one beam."""
    if pair.alone:
        return np.triu(np.ones((count, count), dtype=bool), 2)
    return way > 1e-9


def _wanted(view: View, pair: Pair) -> float:
    """Return the gap of the centre lines [m]: that of the surfaces and half the thickness of both beams."""
    thickness = sum(0.5 * thickest_of(view.section(name)) for name in pair.beams)
    return float((view.response.variables.task.limits.clearance or 0.0) + thickness)


def _way(view: View, pair: Pair) -> tuple[FloatArray, FloatArray]:
    """Return the way between places of the two beams (r, r) [m], infinite where they do not meet; and (k, r, r)."""
    (first, second), lines = pair.beams, view.response.state.lines
    one, other = view.lengths[first], view.lengths[second]
    u, v = thinned(lines[first]).place[:, None], thinned(lines[second]).place[None, :]
    if pair.alone:
        return abs(u - v) * one.length, abs(u - v) * one.by_length[:, None, None]
    way = np.full((u.size, v.size), np.inf)
    by_way = np.zeros((len(one.by_length), u.size, v.size))
    for end, at in pair.joints:
        p, q = abs(u - end), abs(v - at)
        here = p * one.length + q * other.length
        slope = p * one.by_length[:, None, None] + q * other.by_length[:, None, None]
        shorter = here < way
        way, by_way = np.where(shorter, here, way), np.where(shorter, slope, by_way)
    return way, by_way
