"""Curves of leaves and a preloaded spring as rows: the model's samples, force and stress along each, where it is flat.

Curves are (r, n) arrays, one preload of one mechanism a row, from where the shuttle rests to the end of its travel.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.rows import rows_of
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.metrics.longest_interval_in_band import flat_window
from cfmkit.results import ROUND_OFF

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.end_stops import EndStops

    Ends = tuple[FloatArray, FloatArray]
    Law = Callable[[FloatArray], FloatArray]


LEAST_POINTS = 5  # points below which there is no curve to speak of


@dataclass(frozen=True, repr=False)
class LeafSamples(ShortRepr):
    """All leaves at some travels: force [N], largest stress [Pa], whether stable, whether buckled; of one shape."""

    force: FloatArray
    stress: FloatArray
    stable: Any
    buckled: Any


@dataclass(frozen=True)
class Characteristics:
    """Stiffness of spring and leaves [N/m], and where the negative one is constant [m] (NaN: nowhere).

    `negative_stiffness` is a size: positive, or zero where there is none. Of several mechanisms, columns (m, 1).
    """

    positive_stiffness: Any
    negative_stiffness: Any
    first_stiffness: Any
    linear_range: tuple[Any, Any]


class PartSampler(ABC):
    """A model of leaves and spring: at travels of any shape of one mechanism, or (r, n) of r mechanisms."""

    is_traced: ClassVar[bool] = False
    """Whether it follows leaves along their branches: with their waviness, and a shuttle that turns."""
    problem: str = ""
    """Why a part could not be followed to the end; empty if all could."""
    accuracy: float = ROUND_OFF
    """Error of the force, in parts of what leaves and spring bear."""

    @property
    @abstractmethod
    def character(self) -> Characteristics:
        """Stiffnesses and linear range."""

    @abstractmethod
    def leaves(self, travel: FloatArray) -> LeafSamples:
        """Return what all leaves do at some travels [m]; NaN beyond what was reached."""

    @abstractmethod
    def spring(self, compression: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and largest stress [Pa] of the spring at some compressions [m]."""

    def leaf_force(self, travel: FloatArray) -> FloatArray:
        """Return the force of all leaves alone [N]."""
        return self.leaves(travel).force

    def leaf_stress(self, travel: FloatArray) -> FloatArray:
        """Return the largest stress of the leaves [Pa]."""
        return self.leaves(travel).stress

    def find_solved(self, _travel: FloatArray, _preload: float) -> NDArray[np.bool_] | None:
        """Return at which travels [m] leaves and spring were solved for, not interpolated; None if all are known."""
        return None

    def select_rows(self, _rows: Any) -> Self:
        """Return the model of some of the rows; all may be curves of one mechanism."""
        return self


@dataclass(frozen=True, repr=False)
class PreloadCurve(ShortRepr):
    """One curve of one mechanism: what figures draw and sentences name."""

    preload: float  # of the spring's far end [m]
    travel: FloatArray  # of the shuttle from the unloaded position, increasing, (n,) [m]
    leaves: LeafSamples  # all of them, (n,) each
    spring_force: FloatArray  # (n,) [N]
    spring_stress: FloatArray  # (n,) [Pa]
    rest: float | None  # where the shuttle rests [m]; None if nothing holds it short of the end
    stop_force: FloatArray | None = None  # of elastic stops, (n,) [N]; None without any
    solved: NDArray[np.bool_] | None = None  # where parts were solved for, not interpolated; None if all is known

    @cached_property
    def force(self) -> FloatArray:
        """Force on the shuttle [N]."""
        total: FloatArray = np.add(self.leaves.force, self.spring_force)
        return total if self.stop_force is None else total + self.stop_force


@dataclass(frozen=True, eq=False, repr=False)
class PreloadedRows(ShortRepr):
    """Mechanisms under preloads, one preload of one mechanism a row: their force at any travel."""

    sampler: PartSampler
    preload: FloatArray  # (r, 1) [m]
    stops: EndStops  # of all shuttles

    def force_at(self, places: FloatArray, rows: Any = None) -> FloatArray:
        """Return the force at some travels of each row, or of some rows, (k, m), by the model [N]."""
        sampler, preload = self.sampler, self.preload
        if rows is not None:
            sampler, preload = sampler.select_rows(rows), preload[rows]
        total = np.asarray(sampler.leaf_force(places) + sampler.spring(places + preload)[0])
        return total + self.stops.force(places) if self.stops else total


@dataclass(frozen=True, eq=False, repr=False)
class Rows(PreloadedRows):
    """Curves of one model, one preload of one mechanism a row."""

    rest: FloatArray  # (r,) where the shuttle rests [m]; NaN if nothing holds it short of the end
    travel: FloatArray  # (r, n), increasing; after the end of a row its last place is repeated [m]
    count: NDArray[np.intp]  # (r,) points of each row

    def select_rows(self, rows: Any) -> Rows:
        """Return some of the curves, with what is known of them."""
        columns = (self.preload, self.rest, self.travel, self.count)
        preload, *others = (column[rows] for column in columns)
        chosen = Rows(self.sampler.select_rows(rows), preload, self.stops, *others)
        for name in ("leaves", "leaf_force", "spring_samples"):
            if name in self.__dict__:
                chosen.__dict__[name] = rows_of(self.__dict__[name], rows)
        return chosen

    @cached_property
    def leaves(self) -> LeafSamples:
        """All leaves at the points, (r, n) each: force and stress come of one root."""
        return self.sampler.leaves(self.travel)

    @cached_property
    def leaf_force(self) -> FloatArray:
        """Force of all leaves alone at the points, (r, n) [N]."""
        return self.leaves.force if "leaves" in self.__dict__ else self.sampler.leaf_force(self.travel)

    @cached_property
    def spring_samples(self) -> SpringSamples:
        """The spring at the points, (r, n) each."""
        return SpringSamples(*self.sampler.spring(self.travel + self.preload))

    @cached_property
    def is_distinct(self) -> NDArray[np.bool_]:
        """Which points are not repeated last ones, (r, n)."""
        return np.asarray(np.arange(self.travel.shape[1]) < self.count[:, None])

    @cached_property
    def force(self) -> FloatArray:
        """Force on the shuttle at the points, (r, n) [N]; NaN after the end of a row."""
        total = self.leaf_force + self.spring_samples.force
        return np.where(self.is_distinct, total + self.stops.force(self.travel) if self.stops else total, np.nan)

    @property
    def ends(self) -> Ends:
        """First and last travel of each row, (r,) [m]."""
        return self.travel[:, 0], self.travel[:, -1]

    def evaluate_within_ends(self, places: FloatArray) -> FloatArray:
        """Return the same, NaN beyond the ends of a row [N]."""
        first, last = (end[:, None] for end in self.ends)
        inside = (places >= first) & (places <= last)
        return np.where(inside, self.force_at(np.where(inside, places, first)), np.nan)

    def extremes_inside(self, window: Ends) -> Ends:
        """Return the largest and the smallest force at the points in windows and at their ends, (r,) each [N].

        Minus and plus infinity where the curve does not reach there.
        """
        low, high = (end[:, None] for end in window)
        force_inside = np.where((self.travel > low) & (self.travel < high), self.force, np.nan)
        force = np.hstack([force_inside, self.evaluate_within_ends(np.hstack([low, high]))])
        is_known = np.isfinite(force)
        return np.where(is_known, force, -np.inf).max(axis=1), np.where(is_known, force, np.inf).min(axis=1)

    def flat_parts(self, flatness: float) -> Ends:
        """Return from where to where (max - min)/max of the force is longest within `flatness` [m]; NaN: nowhere."""
        return flat_window(self.travel, self.force, flatness, self.force_at)

    def leaf_stress(self, end: FloatArray | float = np.inf) -> FloatArray:
        """Return the largest stress of the leaves up to travels, (r,) or one, these included [Pa]."""
        return self._largest(self.sampler.leaf_stress, lambda: self.leaves.stress, end)

    def spring_stress(self, end: FloatArray | float = np.inf) -> FloatArray:
        """Return the same of the spring, (r,) [Pa]."""
        law: Law = lambda places: self.sampler.spring(places + self.preload)[1]  # noqa: E731
        return self._largest(law, lambda: self.spring_samples.stress, end)

    def _largest(self, law: Law, samples: Callable[[], FloatArray], end: FloatArray | float) -> FloatArray:
        """Return the largest value of a law of the travel that is not negative, up to some ends."""
        last = np.broadcast_to(np.reshape(end, (-1, 1)), (len(self.travel), 1))
        motion = np.minimum(self.travel, np.maximum(last, self.travel[:, :1]))
        values = law(motion) if (self.travel > motion).any() else samples()
        count = np.minimum((self.travel < last).sum(axis=1) + 1, self.count)
        top = extremes(law, motion, values, uneven=True, last=count - 1)[0]
        return np.where(motion[:, 0] <= last[:, 0], np.maximum(top, 0.0), 0.0)


@dataclass(frozen=True, repr=False)
class SpringSamples(ShortRepr):
    """A spring at some compressions: force [N] and largest stress [Pa], of one shape."""

    force: FloatArray
    stress: FloatArray
