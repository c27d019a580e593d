"""What a strip is to do, and how it is described by numbers that an optimiser may change."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.families.slider_crank.flexures.chain import Strip, spread

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.flexures.chain import Elasticity

SMALL = 1e-3
"""Thicknesses and widths are counted in mm."""

Goal = Literal["stroke", "ripple", "rms"]


@dataclass(frozen=True)
class Task:
    """What the strip is to do.

    Attributes
    ----------
    corners : (k, 2) array
        Its centre line [m].
    direction : float
        Of the slider's travel [rad].
    material : Elasticity
        With the stress allowed, if there is a limit.
    force : float
        Wanted [N].
    start, stroke : float
        Ends of the travel over which it is wanted [m]; the stroke is the first guess where it is maximised.
    ripple : float
        Largest deviation allowed, as a share of the force; of no use where it is minimised.
    goal : {"stroke", "ripple", "rms"}
        Longest stroke within the ripple; smallest ripple, or smallest root mean square, over the stroke.
    longest : float
        Stroke never exceeded [m].
    """

    corners: FloatArray
    direction: float
    material: Elasticity
    force: float
    start: float
    stroke: float
    ripple: float
    goal: Goal = "stroke"
    longest: float = 0.08


@dataclass(frozen=True)
class Form:
    """How a strip is described by numbers: thicknesses, then shares that place them, then the width.

    Attributes
    ----------
    count : int
        Thicknesses; 1: the same everywhere.
    per_piece : tuple of int
        How many stations each straight piece has where their shares vary; empty: evenly spaced, fixed.
    shares : tuple of tuples
        Shares at which stations are fixed, by piece; empty with `per_piece` empty: evenly spaced.
    width : float or None
        Fixed width [m]; None: it varies too.
    """

    count: int
    per_piece: tuple[int, ...] = ()
    shares: tuple[tuple[float, ...], ...] = ()
    width: float | None = None

    @property
    def placed(self) -> int:
        """How many shares vary."""
        return sum(self.per_piece)

    @property
    def size(self) -> int:
        """How many numbers describe the strip."""
        return self.count + self.placed + (self.width is None)

    def places(self, x: FloatArray, corners: FloatArray) -> FloatArray:
        """Return the stations as fractions of the length."""
        if not self.per_piece:
            return spread(corners, self.shares) if self.shares else np.linspace(0.0, 1.0, self.count)
        ends = np.cumsum((0, *self.per_piece))
        own = np.real(x[self.count : self.count + self.placed])
        return spread(corners, [own[a:b].tolist() for a, b in itertools.pairwise(ends)])

    def width_of(self, x: FloatArray) -> float:
        """Return the width [m]."""
        return float(np.real(x[-1])) * SMALL if self.width is None else self.width

    def strip(self, x: Any, corners: FloatArray) -> Strip:
        """Return the strip that numbers describe: thicknesses and width in mm, shares of the pieces' lengths."""
        thickness = np.asarray(x[: self.count]) * SMALL
        if self.count == 1:
            return Strip(corners, self.width_of(x), np.repeat(thickness, 2), np.array([0.0, 1.0]))
        return Strip(corners, self.width_of(x), thickness, self.places(x, corners))
