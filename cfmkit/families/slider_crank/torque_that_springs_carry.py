"""Springs that hold a torque over an angle, of those of steel wire that fit at the joints of a linkage.

How stiff a spring may be follows from how far the motion turns, or stretches, it and from the room that it has. Within
these limits the rates with the smallest largest deviation are the solution of a linear programme, for every window.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.fit_rates import RateGoal, minimax
from cfmkit.families.slider_crank.unit_springs import along_crank, crank_efforts
from cfmkit.stock.springs.made_to_measure import stiffest

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.linkage import Linkage

PLACES = 91
"""Angles of the motion that are looked at for the largest torque."""

FITTED = 49
"""Angles of a window at which rates are fitted."""

WINDOWS, NEARER = 21, 9
"""Windows of the whole motion that are compared; and of those between the neighbours of the best."""

SHARES = (0.5, 0.3, 0.7)
"""Of the room for springs on both sides of the links, what the pivot's has: the others are on the other side."""

STILL = 1e-9
"""Share of the slider's travel that is none."""

RESERVE = 0.999
"""Share of the largest rate that is used: it is known to a few digits."""


@dataclass(frozen=True)
class SprungMotion:
    """A linkage that is to hold a torque with springs.

    Attributes
    ----------
    link : Linkage
    start, low, high : float
        Crank angles: where all springs are relaxed, and between which the torque may be held [rad].
    angle : float
        Over which it is held [rad].
    deep : float
        Room for springs out of the plane, on both sides of the links together [m].
    shared : bool
        Whether the pivot's spring and the others have to share that room.
    """

    link: Linkage
    start: float
    low: float
    high: float
    angle: float
    deep: float
    shared: bool = False

    @property
    def turns_so_far(self) -> bool:
        """Whether the motion is as long as the window."""
        return self.angle <= (self.high - self.low) * (1.0 + 1e-9)

    @property
    def depths(self) -> tuple[tuple[float, float], ...]:
        """Room out of the plane that the pivot's spring and the others may have [m], as it may be shared."""
        if not self.shared:
            return ((self.deep, self.deep),)
        return tuple((share * self.deep, (1.0 - share) * self.deep) for share in SHARES)

    def largest_rates(self, places: FloatArray) -> FloatArray:
        """Return the largest rates of springs that bear the motion up to each place [N m/rad, the last N/m].

        Torsion springs are no wider than the crank, or the coupler, is long; a spring at the slider can only be
        stretched, from where it is at rest.

        Parameters
        ----------
        places : (n,) array
            Crank angles from `start` on, increasing [rad].

        Returns
        -------
        (m, 4, n) array
            For each of the `depths`.
        """
        units = along_crank(self.link, self.start, places)
        turns = np.maximum.accumulate(np.abs(units.turn), axis=1)
        pushed = np.minimum.accumulate(units.turn[3]) < -STILL * turns[3]
        widest, rest = min(self.link.crank, self.link.coupler), float(units.position[0])
        found = []
        for below, above in self.depths:
            pins = [stiffest("torsion", turns[k], widest, above if k else below) for k in range(3)]
            found.append([*pins, np.where(pushed, 0.0, stiffest("extension", turns[3], above, rest))])
        return np.array(found)


@dataclass(frozen=True)
class HeldTorque:
    """Springs that hold a torque over a window.

    Attributes
    ----------
    begin : float
        Where the window begins [rad].
    rates, upper : (4,) array
        Rates at the joints, and the largest that fit [N m/rad, the last N/m].
    deviation : float
        Largest one from the torque, as a share.
    """

    begin: float
    rates: FloatArray
    upper: FloatArray
    deviation: float


def largest_torque(motion: SprungMotion) -> float:
    """Return a bound of the torque [N m] that can be held over the angle; zero where the motion is shorter.

    Each spring is as stiff as fits, and counts only where it drives.
    """
    if not motion.turns_so_far:
        return 0.0
    places = np.linspace(motion.start, motion.high, PLACES)
    first = int(np.searchsorted(places, motion.low))
    window = int(motion.angle / (places[1] - places[0]))
    rates = motion.largest_rates(places)[:, :, first + window :]
    drives = np.maximum(crank_efforts(motion.link, motion.start, places), 0.0)[:, first:]
    inside = np.lib.stride_tricks.sliding_window_view(drives, window + 1, axis=1)[:, : rates.shape[2]]
    least = np.einsum("dkw,kwp->dwp", rates, inside).min(axis=2)
    return float(np.nanmax(least, initial=0.0))


def flattest_springs(motion: SprungMotion, torque: float, flat: float) -> HeldTorque | None:
    """Return the springs and the window with the smallest largest deviation from a torque [N m].

    Springs without which the deviation is no larger than `flat` are left out. None where the motion is shorter than the
    angle, or no spring can be wound.
    """
    if not motion.turns_so_far:
        return None
    first, last = motion.low, max(motion.high - motion.angle, motion.low)
    best = _best_of(motion, torque, np.linspace(first, last, WINDOWS))
    if best is None:
        return None
    step = (last - first) / (WINDOWS - 1)
    nearer = np.linspace(max(first, best.begin - step), min(last, best.begin + step), NEARER)
    found = best if last == first else _best_of(motion, torque, nearer) or best
    return _of_fewer(motion, torque, min(best, found, key=lambda one: one.deviation), flat)


def _best_of(motion: SprungMotion, torque: float, begins: FloatArray) -> HeldTorque | None:
    """Return the best springs of the best of some windows, by where they begin; None where there are none."""
    ends = begins + motion.angle
    places = np.unique([*np.linspace(motion.start, ends[-1], PLACES), *ends])
    largest = RESERVE * motion.largest_rates(places)[:, :, np.searchsorted(places, ends)]
    found = [
        one
        for k, begin in enumerate(begins.tolist())
        for upper in largest[:, :, k]
        if (one := _fitted(motion, torque, begin, upper)) is not None
    ]
    return min(found, key=lambda one: one.deviation, default=None)


def _of_fewer(motion: SprungMotion, torque: float, best: HeldTorque, flat: float) -> HeldTorque:
    """Return a window with as few springs as are flat enough, those left out first that do least."""
    does = best.rates * np.abs(crank_efforts(motion.link, motion.start, _window(motion, best.begin))).max(axis=1)
    for k in np.argsort(does).tolist():
        upper = np.where((best.upper > 0.0) & (np.arange(len(does)) != k) & (best.rates > 0.0), best.upper, 0.0)
        fewer = _fitted(motion, torque, best.begin, upper) if best.rates[k] > 0.0 else None
        if fewer is not None and fewer.deviation <= max(flat, best.deviation):
            best = fewer
    return best


def _window(motion: SprungMotion, begin: float) -> FloatArray:
    return np.linspace(begin, begin + motion.angle, FITTED)


def _fitted(motion: SprungMotion, torque: float, begin: float, upper: FloatArray) -> HeldTorque | None:
    """Return the best springs below the largest rates for a window; None where there are none."""
    effort = crank_efforts(motion.link, motion.start, _window(motion, begin))
    if not np.isfinite(effort).all() or not upper.any():
        return None
    goal = RateGoal(effort.T / torque, np.ones(FITTED), upper)
    rates = minimax(goal)
    return None if rates is None or not rates.any() else HeldTorque(begin, rates, upper, goal.deviation(rates))
