"""Ends of strokes at which the force still passes from one branch to the other: their length, and strokes without them.

Where a motion turns back the force does not jump. The sample at the reversal may hold the force of either branch,
backlash lets the displacement change while the force does not, and what is elastic in the drive lets the force run from
one branch to the other over some way: linearly for a spring with dry friction [P], exponentially for the friction of
[D]. None of that is the force of a branch, and a filter smears it over many samples.

Features that both branches have in common say nothing; what reveals a transition is the gap between the branches, load
less unload: it is smooth along the travel, but closes towards the reversal. So the gap near the end of a stroke is
taken for a straight line less a step, a ramp or an exponential, and the transition is accepted where that explains what
noise does not.

References
----------
[P] L. Prandtl, Z. angew. Math. Mech. 8 (1928) 85-106: a spring in series with dry friction.
[D] P. R. Dahl, AIAA J. 14 (1976) 1675-1682: friction whose slope falls with the force that is left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.experiment.branches import LOAD_BRANCH, UNLOAD_BRANCH, Stroke, Strokes
from cfmkit.numerics.least_squares import correlation_time

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.reading import Recording

GAP_REACH = 0.2
"""Part of the shorter stroke, from its end, over which the gap is looked at; a passage takes half of it at most."""
MIN_CLOSED_SHARE = 0.05  # a passage closes at least this part of the gap: smooth gaps that bend a little are left alone
MIN_SIGNIFICANCE = 5.0
"""A passage is believed where the gap closes by so many standard deviations of what noise and waves would make it."""
END_OF_DECAY = 0.003  # an exponential is over where this part of the gap is still closed
_MIN_SAMPLES = 8
_MAX_SAMPLES = 400
_MIN_SINGLE_SAMPLES = 24
_N_LENGTHS = 120
_LENGTH_RATIO = 1.05  # lengths are tried in steps of some per cent


@dataclass(frozen=True)
class Settled:
    """Strokes without the passages at their ends."""

    strokes: Strokes  # what is left of each
    points: int  # how many points were left out
    # longest passage [m or rad]; 0 where only samples at reversals themselves were left out, which are of no branch on
    # any machine
    length: float


def remove_transitions(recording: Recording, strokes: Strokes) -> Settled:
    """Return strokes without the points next to their ends at which the force passes to the other branch.

    Parameters
    ----------
    recording : Recording
        In the order of time.
    strokes : Strokes
        Of the recording.

    Returns
    -------
    Settled
        A stroke without a neighbour of the other direction stays as it is.
    """
    ends = list(_list_ends(recording, strokes.strokes))
    # Every reversal at one end of the travel is of the same machine: together they show what noise hides in one.
    alike = {side: passage([end for end in ends if end.side == side and end.reversal]) for side in (1.0, -1.0)}
    lengths = [max(passage([end]), alike[end.side] if end.reversal else 0.0) for end in ends]
    shortened = [
        _shorten_stroke(
            recording, stroke, [(e, length) for e, length in zip(ends, lengths, strict=True) if number in e.at]
        )
        for number, stroke in enumerate(strokes.strokes)
    ]
    left_out = sum(len(old.points) - len(new.points) for old, new in zip(strokes.strokes, shortened, strict=True))
    passages = [length for end, length in zip(ends, lengths, strict=True) if length > end.next_sample]
    return Settled(replace(strokes, strokes=tuple(shortened)), left_out, max(passages, default=0.0))


@dataclass(frozen=True)
class End:
    """An end of the travel with the two strokes that meet there, seen from it."""

    at: tuple[int, ...]  # which strokes end here; the first and the last of a recording do so alone
    # place, side: where it is [m or rad], and the sign of the motion away from it
    place: float
    side: float
    # up, down, ((n,), (n,): distance from the end [m or rad], increasing, and effort of the way up and the way down [N
    # or N m]
    up: tuple[FloatArray, FloatArray]
    down: tuple[FloatArray, FloatArray]

    @property
    def reversal(self) -> bool:
        """Whether two strokes end here, and not the recording."""
        return len(self.at) == 2

    @property
    def next_sample(self) -> float:
        """Distance of the first sample that is not at the end itself [m or rad]."""
        beyond = np.concatenate([part[0][part[0] > 0] for part in (self.up, self.down)])
        return float(beyond.min(initial=np.inf))

    @property
    def reach(self) -> float:
        """Distance over which the gap is looked at [m or rad]."""
        return GAP_REACH * min(float(part[0][-1]) for part in (self.up, self.down))


def _list_ends(recording: Recording, strokes: tuple[Stroke, ...]) -> Iterator[End]:
    """Yield the reversals of a recording, and its start and its end where a stroke of the other direction is beside."""
    last = len(strokes) - 1
    pairs = [(k, k + 1, (k, k + 1)) for k in range(last)]
    outer = [(0, 1, (0,)), (last, last - 1, (last,))] if last else []
    for number, neighbour, at in (*pairs, *outer):
        if strokes[number].branch == strokes[neighbour].branch:
            continue
        first = at == (0,)
        side = 1.0 if (strokes[number].branch == LOAD_BRANCH) == first else -1.0
        places = np.concatenate([recording.motion[strokes[k].points] for k in at])
        place = float(places.min() if side > 0 else places.max())
        seen = {strokes[k].branch: _seen_from(recording, strokes[k], place, side) for k in (number, neighbour)}
        up, down = seen[LOAD_BRANCH], seen[UNLOAD_BRANCH]
        if min(len(up[0]), len(down[0])) >= _MIN_SAMPLES:
            yield End(at, place, side, up, down)


def _seen_from(recording: Recording, stroke: Stroke, place: float, side: float) -> tuple[FloatArray, FloatArray]:
    """Return distances from a place, increasing, and the mean effort of a stroke at each."""
    distance = side * (recording.motion[stroke.points] - place)
    places, inverse = np.unique(distance, return_inverse=True)
    return places, np.bincount(inverse, recording.effort[stroke.points]) / np.bincount(inverse)


def _shorten_stroke(recording: Recording, stroke: Stroke, ends: Sequence[tuple[End, float]]) -> Stroke:
    """Return a stroke without the passages at its ends; the whole one where too little would be left."""
    motion = recording.motion[stroke.points]
    keep = np.ones(len(motion), dtype=bool)
    for end, length in ends:
        keep &= end.side * (motion - end.place) >= length
    return replace(stroke, points=stroke.points[keep]) if keep.sum() >= _MIN_SAMPLES else stroke


def passage(
    ends: Sequence[End],  # of one kind; together they are looked at as one
) -> float:
    """Return over which way from ends of the travel the force is not yet, or no more, of one branch [m or rad]."""
    if not ends:
        return 0.0
    reach = min(end.reach for end in ends)
    distance, gap = (np.concatenate(parts) for parts in zip(*(_gap_near_end(end, reach) for end in ends), strict=True))
    order = np.argsort(distance, kind="stable")
    distance, gap, weight = _thin_neighbours(distance[order], gap[order])
    if len(distance) < _MIN_SAMPLES:
        return 0.0
    beyond = gap[distance > 0.5 * reach]
    if not len(beyond):  # a hole in the recording
        return 0.0
    if np.median(beyond) < 0:  # a sign is turned: another finding says so
        gap = -gap
    length, level = 0.0, 0.0
    for _ in range(4):  # what no single shape describes, such as play before elasticity, goes in parts
        rest = distance >= length
        more, level = _fit_passage(distance[rest], gap[rest], weight[rest], reach, level)
        if more <= length:
            return length
        length = more
    return length


def _gap_near_end(end: End, reach: float) -> tuple[FloatArray, FloatArray]:
    """Return distances from an end where both strokes have a force, and the way up less the way down there."""
    distances = [part[0][(part[0] >= 0) & (part[0] <= reach)] for part in (end.up, end.down)]
    if min(map(len, distances)) < _MIN_SAMPLES // 2:
        return np.empty(0), np.empty(0)
    places = np.union1d(*distances)
    # The sample at the reversal belongs to one stroke only: the other one starts a sample further in.
    slack = 1.5 * max(float(np.median(np.diff(part))) for part in distances)
    places = places[places >= max(float(part[0][0]) for part in (end.up, end.down)) - slack]
    return places, np.interp(places, *end.up) - np.interp(places, *end.down)


def _thin_neighbours(places: FloatArray, gap: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return averages over neighbours where there are many; those next to the end stay single."""
    size = max(-(-(len(places) - _MIN_SINGLE_SAMPLES) // _MAX_SAMPLES), 1)
    edges = np.concatenate(
        [np.arange(min(_MIN_SINGLE_SAMPLES, len(places))), np.arange(_MIN_SINGLE_SAMPLES, len(places), size)]
    )
    counts = np.diff(np.append(edges, len(places))).astype(float)
    if not len(counts):
        return places, gap, counts
    return np.add.reduceat(places, edges) / counts, np.add.reduceat(gap, edges) / counts, counts


def _fit_passage(
    distance: FloatArray, gap: FloatArray, weight: FloatArray, reach: float, level: float
) -> tuple[float, float]:
    """Return the length of the passage that explains the gap best, 0 where none does, and the gap beyond it."""
    if len(distance) < _MIN_SAMPLES:
        return 0.0, level
    shapes, lengths = _passage_shapes(distance, reach)
    root = np.sqrt(weight)
    line, _ = np.linalg.qr(np.column_stack([root, root * distance]))
    rest, bent = root * gap, root * shapes
    rest = rest - line @ (line.T @ rest)
    bent = bent - (bent @ line) @ line.T
    power = (bent**2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        closes = np.where(power > 1e-9 * weight.sum(), -(bent @ rest) / power, 0.0)
    gain = np.where(closes > 0, closes**2 * power, 0.0)
    best = int(np.argmax(gain))
    size = float(closes[best])
    left = rest + size * bent[best]
    noise = float(np.sqrt((left @ left) / max(len(distance) - 4, 1)))
    level = level or float(np.median(gap[distance >= 0.5 * float(distance.max())]))
    certain = size * np.sqrt(power[best]) > MIN_SIGNIFICANCE * noise * np.sqrt(correlation_time(left))
    if not certain or not MIN_CLOSED_SHARE * level < size < 2.5 * level:
        return 0.0, level
    decay = float(lengths[best])
    if best < len(lengths) - _N_LENGTHS:
        return _LENGTH_RATIO * decay, level
    small = max(END_OF_DECAY * level, 0.5 * noise)
    return min(decay * max(np.log(size / small), 1.0), 0.5 * reach), level


def _passage_shapes(distance: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
    """Return how far each passage that is tried is from its end at each distance, 1 to 0, and the lengths of all."""
    spacing = max(
        float(distance[min(_MIN_SINGLE_SAMPLES, len(distance)) - 1] - distance[0]) / _MIN_SINGLE_SAMPLES, 1e-6 * reach
    )
    steps = 0.5 * (distance[1:] + distance[:-1])
    steps = steps[steps <= 0.5 * reach]
    lengths = np.geomspace(0.5 * spacing, 0.5 * reach, _N_LENGTHS)
    step = distance[None, :] < steps[:, None]
    ramp = np.maximum(1.0 - distance[None, :] / lengths[:, None], 0.0)
    decays = lengths / 4.0
    exponential = np.exp(-np.minimum(distance[None, :] / decays[:, None], 60.0))
    return np.concatenate([step, ramp, exponential]), np.concatenate([steps, lengths, decays])
