"""Records of a roller's track: its states, its parts, and why there may be none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray

Reason = Literal["brace", "crossed", "dead"]


class NoTrack(ValueError):
    """The roller cannot run on the cam, because of `reason`.

    "brace": it does not reach from the axis to the track's start; "crossed": the right roller would
    start left of the axis; "dead": the slider does not rise above its start as the rollers move out.
    """

    def __init__(self, reason: Reason, start: float) -> None:
        """Keep the reason and the x of the track's start [m]."""
        self.reason, self.start = reason, start
        super().__init__(reason)


@dataclass(frozen=True)
class TrackStates:
    """Where the right roller is, for each requested slider position.

    Attributes
    ----------
    x, y : (n,) array
        Roller centre [m].
    slope : (n,) array
        dy/dx of the centre's track there.
    bend : (n,) array
        d2y/dx2 of the centre's track there [1/m].
    on_corner : (n,) array of bool
        Whether the roller pivots on the cam's corner.
    parameter : (n,) array
        Path coordinate of the contact on the flank [m]; that of the corner while on it.
    """

    x: FloatArray
    y: FloatArray
    slope: FloatArray
    bend: FloatArray
    on_corner: NDArray[np.bool_]
    parameter: FloatArray

    def fields(self) -> tuple[NDArray[Any], ...]:
        """Return the arrays in the order in which the class takes them."""
        return self.x, self.y, self.slope, self.bend, self.on_corner, self.parameter


@dataclass(frozen=True)
class TrackStretch:
    """A part of the track on which the slider rises.

    Attributes
    ----------
    on_corner : bool
        Whether the roller pivots on the corner.
    low, high : float
        Range of the parameter: the angle of the contact normal on the corner [rad], the path
        coordinate on the flank [m].
    at : callable
        ``at(parameter) -> (slider position, x, slope of the centre's track)``.
    """

    on_corner: bool
    low: float
    high: float
    at: Callable[[Any], tuple[Any, Any, Any]]
