"""Strokes and cycles of a recording: split at reversals, robust against jitter and pauses; cycles that are measured.

A reversal is where the motion turns back by more than a stated part of its range; an encoder that flickers does not.
Where the machine stands (before the start, at a reversal, at the end) many points at one place would weigh on every
mean: they are counted and left out, all but the first and the last of each pause.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import DataError, UsageError
from cfmkit.experiment.corrections_and_low_pass import words_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.reading import Recording

REVERSAL_SHARE = 0.02  # the motion has turned back when it has returned by this part of its range
COMPLETE_STROKE_SHARE = 0.9  # the second stroke of a cycle is complete when it covers this part of the first
SHORT_STROKE_SHARE = 0.1
"""Two strokes of which one covers less than this part of the other are no loop: the machine approached or let go."""
LOAD_BRANCH, UNLOAD_BRANCH = "load", "unload"
_PAUSE_SPEED_SHARE = 0.02  # it stands where it moves at less than this part of its usual speed
_SHORTEST_PAUSE = 12
_REVERSAL_JITTERS = 8.0
"""Standard deviations of the jitter up to a reversal: either end may be off by four, as one value in 16 000 is."""
_MIN_SAMPLES = 4


@dataclass(frozen=True)
class Stroke:
    """One stroke, from one reversal to the next."""

    branch: str  # ``load`` where the motion increases, ``unload`` where it decreases
    # from 1; a cycle is one way up and one way down. 0 for a short first stroke on the way to where cycles start
    cycle: int
    points: NDArray[np.intp]  # (n,) indices into the recording, in its order, pauses left out
    covered: float  # what it covers of the motion [m or rad]


@dataclass(frozen=True)
class Strokes:
    """All strokes of a recording, how many of its points belong to pauses, and which cycles the user chose."""

    strokes: tuple[Stroke, ...]
    pauses: int
    chosen: Cycles | None = None

    @cached_property
    def complete(self) -> tuple[tuple[Stroke, Stroke], ...]:
        """The complete cycles, two strokes each, in their order; incomplete ones only if there is no other."""
        strokes_by_cycle = [[item for item in self.strokes if item.cycle == number] for number in self._cycle_numbers]
        pairs = [
            (pair[0], pair[1])
            for pair in strokes_by_cycle
            if len(pair) == 2 and covered_fraction((pair[0], pair[1])) >= SHORT_STROKE_SHARE
        ]
        return tuple([pair for pair in pairs if covered_fraction(pair) >= COMPLETE_STROKE_SHARE] or pairs)

    @cached_property
    def cycles(self) -> tuple[tuple[Stroke, Stroke], ...]:
        """The complete cycles that are measured: those that the user chose, else those of full travel."""
        if self.chosen is not None:
            return tuple(pair for pair in self.complete if self.chosen.first <= pair[0].cycle <= self.chosen.last)
        full = COMPLETE_STROKE_SHARE * max((travel_of(pair) for pair in self.complete), default=0.0)
        return tuple(pair for pair in self.complete if travel_of(pair) >= full)

    @property
    def shorter(self) -> tuple[tuple[Stroke, Stroke], ...]:
        """The complete cycles that are left out because others go farther, as cycles that seat the parts do."""
        measured_ones = {pair[0].cycle for pair in self.cycles}
        return tuple(pair for pair in self.complete if not (self.chosen or pair[0].cycle in measured_ones))

    @property
    def measured(self) -> tuple[tuple[Stroke, ...], ...]:
        """The strokes that are measured, cycle by cycle; the longest one alone where there is no cycle."""
        return self.cycles or ((max(self.strokes, key=lambda stroke: stroke.covered),),)

    @property
    def _cycle_numbers(self) -> list[int]:
        return sorted({item.cycle for item in self.strokes})


def travel_of(cycle: tuple[Stroke, Stroke]) -> float:
    """Return what the longer stroke of a cycle covers [m or rad]."""
    return max(stroke.covered for stroke in cycle)


@dataclass(frozen=True)
class Cycles:
    """Cycles that the user chose, by their first and last number."""

    first: int
    last: int

    @property
    def text(self) -> str:
        """As it was stated: ``2:5``."""
        return f"{self.first}:{self.last}"


def read_cycles(text: str | None) -> Cycles | None:
    """Return what ``--cycles`` says: ``2:5`` or ``3``; None for None.

    Raises UsageError if it is malformed.
    """
    if text is None:
        return None
    match = re.fullmatch(r"\s*([0-9]{1,9})\s*(?::\s*([0-9]{1,9})\s*)?", text)
    if not match or not 1 <= int(match[1]) <= int(match[2] or match[1]):
        raise UsageError(f"--cycles: {text!r} is not 'first:last'; write e.g. --cycles 2:5, or --cycles 3 for one")
    return Cycles(int(match[1]), int(match[2] or match[1]))


def choose(strokes: Strokes, cycles: Cycles | None, name: str) -> Strokes:
    """Return strokes of which some cycles are measured.

    Raises DataError if one of them is not there, or not complete.
    """
    if cycles is None:
        return strokes
    complete = [pair[0].cycle for pair in strokes.complete]
    missing = [number for number in (cycles.first, cycles.last) if number not in complete]
    if missing:
        said = (
            f"cycles {complete[0]} to {complete[-1]}"
            if len(complete) > 1
            else f"cycle {complete[0]}"
            if complete
            else "no cycle"
        )
        raise DataError(f"{name}: --cycles {cycles.text}: cycle {missing[0]} is not there; {said} can be measured")
    return replace(strokes, chosen=cycles)


def covered_fraction(cycle: tuple[Stroke, Stroke]) -> float:
    """Return the travel of the shorter stroke of a cycle divided by that of the longer one."""
    ways = sorted(stroke.covered for stroke in cycle)
    return ways[0] / ways[1]


def turning_points(
    motion: FloatArray,  # (n,): in the order of time
    threshold: float,  # how far the motion must come back from an extreme for it to be a reversal
) -> list[int]:
    """Return the indices of first point, reversals and last point.

    Examples
    --------
    >>> turning_points(np.array([0.0, 1.0, 0.9, 2.0, 1.0, 0.0]), 0.5)
    [0, 3, 5]
    """
    values, turns = motion.tolist(), [0]
    low = high = 0
    direction = 0
    for index, value in enumerate(values):
        if value > values[high]:
            high = index
        if value < values[low]:
            low = index
        if direction >= 0 and values[high] - value > threshold:
            if direction > 0 or high > low:
                turns.append(high)
            direction, low = -1, index
        elif direction <= 0 and value - values[low] > threshold:
            if direction < 0 or low > high:
                turns.append(low)
            direction, high = 1, index
        if direction > 0:
            low = high
        elif direction < 0:
            high = low
    last = high if direction > 0 else low if direction < 0 else len(values) - 1
    # What follows the last extreme without being a reversal is a pause or the release of the machine.
    return sorted({*turns, last})


def split(
    recording: Recording,  # in the order of time
) -> Strokes:
    """Return the strokes of a recording.

    Raises DataError if no stroke has enough points.
    """
    motion = recording.motion
    extent = float(np.ptp(motion))
    reversal = max(REVERSAL_SHARE * extent, _REVERSAL_JITTERS * jitter_of(motion))
    turns = turning_points(motion, min(reversal, 0.5 * extent))
    standing = pauses(motion, turns)
    pieces = []
    for number, (start, stop) in enumerate(pairwise(turns)):
        inside = np.arange(start + (number > 0), stop + 1)
        pieces.append(inside[~standing[inside]])
    kept = [piece for piece in pieces if len(piece) >= _MIN_SAMPLES]
    if not kept:
        _, moved = words_of(recording.kind)
        raise DataError(
            f"{recording.name}: no stroke has at least {_MIN_SAMPLES} points: the {moved} jumps back and forth, "
            "or the rows are not in the order of time"
        )
    return Strokes(_number_strokes(kept, motion), int(standing.sum()))


def _number_strokes(pieces: Sequence[NDArray[np.intp]], motion: FloatArray) -> tuple[Stroke, ...]:
    """Return strokes with branch and cycle: a cycle starts with every stroke of the first one's direction.

    Where the first stroke is shorter than the next it may be a mere approach: then cycles start with
    the second one's direction if more of them are complete so.
    """
    ups = [bool(motion[piece[-1]] > motion[piece[0]]) for piece in pieces]
    ways = [float(np.ptp(motion[piece])) for piece in pieces]
    cycles_of_strokes = [
        tuple(
            Stroke(LOAD_BRANCH if up else UNLOAD_BRANCH, cycle, piece, covered)
            for up, cycle, piece, covered in zip(
                ups, np.cumsum(np.equal(ups, first)).tolist(), pieces, ways, strict=True
            )
        )
        for first in ups[:2]
    ]
    if len(ways) < 3 or ways[0] >= COMPLETE_STROKE_SHARE * ways[1]:
        return cycles_of_strokes[0]
    return max(cycles_of_strokes, key=_whole_cycles)


def _whole_cycles(strokes: tuple[Stroke, ...]) -> int:
    """Return how many complete cycles some strokes hold."""
    return sum(covered_fraction(cycle) >= COMPLETE_STROKE_SHARE for cycle in Strokes(strokes, 0).complete)


def jitter_of(motion: FloatArray) -> float:
    """Return the standard deviation of the motion's noise, robustly, from its second differences."""
    bends = np.abs(np.diff(motion, 2))
    return 1.4826 * float(np.median(bends)) / 6.0**0.5 if len(bends) else 0.0


def pauses(
    motion: FloatArray,  # (n,): in the order of time
    turns: Sequence[int],  # first point, reversals, last point
) -> NDArray[np.bool_]:
    """Return which points belong to pauses, the first and the last of each not counted."""
    steps = np.abs(np.diff(motion))
    jitter = jitter_of(motion) * 6.0**0.5
    travelled = float(np.abs(np.diff(motion[np.asarray(turns)])).sum())
    # Jitter makes single steps long: the usual step is what the strokes need, pauses aside.
    usual = max(float(np.percentile(steps, 75)) if jitter == 0 else 0.0, travelled / len(motion))
    span = int(max(_SHORTEST_PAUSE, np.ceil(4.0 * jitter / (_PAUSE_SPEED_SHARE * usual)))) if usual else _SHORTEST_PAUSE
    marked = np.zeros(len(motion), dtype=bool)
    if span >= len(motion) // 4:
        return marked
    return _paused_points(motion, span, max(_PAUSE_SPEED_SHARE * usual * span, 4.0 * jitter))


def _paused_points(motion: FloatArray, span: int, slack: float) -> NDArray[np.bool_]:
    """Return the points inside stretches of `span` steps over which the motion stays within `slack`."""
    shifted = [motion[part * span // 4 : len(motion) - span + part * span // 4] for part in range(5)]
    still = np.max(shifted, axis=0) - np.min(shifted, axis=0) <= slack
    cover = np.zeros(len(motion) + 1, dtype=int)
    np.add.at(cover, np.flatnonzero(still), 1)
    np.add.at(cover, np.flatnonzero(still) + span + 1, -1)
    inside = np.cumsum(cover[:-1]) > 0
    edges = inside & ~(np.r_[False, inside[:-1]] & np.r_[inside[1:], False])
    marked: NDArray[np.bool_] = inside & ~edges
    return marked
