"""Springs that hold a torque or a force over a window, of those of steel wire that fit at the joints of a linkage.

How stiff a spring may be follows from how far the motion turns, or stretches, it and from the room that it has. Within
these limits the rates with the smallest largest deviation are the solution of a linear programme, for every window.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal, minimax
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.offers import stiffest_rates
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly

N_MOTION_PLACES = 91  # places of the motion that are looked at for the largest effort
N_FITTED_PLACES = 49  # places of a window at which rates are fitted
N_WINDOWS, N_NEIGHBOUR_WINDOWS = 21, 9
"""Windows of the whole motion that are compared; and of those between the neighbours of the best."""
PIVOT_ENVELOPE_SHARES = (0.5, 0.3, 0.7)
"""Of the room for springs on both sides of the links, what the pivot's has: the others are on the other side."""
TRAVEL_RTOL = 1e-9  # travels below this share of the slider's travel count as zero
RATE_SHARE = 0.98  # share of the largest rate that is used: coils and turns are rounded


@dataclass(frozen=True)
class SprungMotion:
    """A linkage that is to hold a torque, or a force, with springs."""

    assembly: Assembly  # its motion is the crank's angle [rad] or the slider's travel [m]; its rates do not matter
    # low, high: motions between which the effort may be held
    low: float
    high: float
    length: float  # of the motion, over which it is held
    widest: float  # largest outer diameter of a torsion spring [m]
    deep: float  # room for springs out of the plane, on both sides of the links together [m]
    shared: bool = False  # whether the pivot's spring and the others have to share that room
    safety: float = 1.0  # of springs, against yield

    @property
    def goes_so_far(self) -> bool:
        """Whether the motion is as long as the window."""
        return self.length <= (self.high - self.low) * (1.0 + 1e-9)

    @property
    def depths(self) -> tuple[tuple[float, float], ...]:
        """Room out of the plane that the pivot's spring and the others may have [m], as it may be shared."""
        if not self.shared:
            return ((self.deep, self.deep),)
        return tuple((share * self.deep, (1.0 - share) * self.deep) for share in PIVOT_ENVELOPE_SHARES)

    def largest_rates(self, places: FloatArray, since: int = 0) -> FloatArray:
        """Return the largest rates of springs that bear the motion up to each place [N m/rad, the last N/m].

        A spring at the slider can only be stretched, from where it is at rest.

        Parameters
        ----------
        places : (n,) array
            Motions from where all springs are relaxed on, increasing.
        since : int
            The first of them that is wanted.

        Returns
        -------
        (m, 4, n - since) array
            For each of the `depths`.
        """
        units = self.assembly.units(places)
        turns = np.maximum.accumulate(np.abs(units.turn), axis=1)
        pushed = (np.minimum.accumulate(units.turn[3]) < -TRAVEL_RTOL * turns[3])[since:]
        rest, turns = float(units.position[0]), turns[:, since:]
        deep = np.array([(below, above, above) for below, above in self.depths])[:, :, None]
        # all depths in one call: there are few places, and a call takes longer than they do
        alike = np.broadcast_to(turns[:3], (len(deep), *turns[:3].shape))
        pins = stiffest_rates(
            HelicalTorsionSpring, alike.ravel(), self.widest, (deep + np.zeros_like(alike)).ravel(), self.safety
        )
        wide = deep[:, 2] + np.zeros_like(turns[3])
        slider = stiffest_rates(ExtensionSpring, np.tile(turns[3], len(deep)), wide.ravel(), rest, self.safety).reshape(
            wide.shape
        )
        return np.concatenate([pins.reshape(alike.shape), np.where(pushed, 0.0, slider)[:, None]], axis=1)


@dataclass(frozen=True)
class HeldEffort:
    """Springs that hold a torque or a force over a window."""

    begin: float  # motion at which the window begins
    # rates, upper, (4,): rates at the joints, and the largest that fit [N m/rad, the last N/m]
    rates: FloatArray
    upper: FloatArray
    deviation: float  # largest one from the effort, as a share


def largest_effort(motion: SprungMotion) -> float:
    """Return a bound of the torque or force [N m or N] that can be held over the length; zero where it goes less far.

    Each spring is as stiff as fits, and counts only where it drives.
    """
    if not motion.goes_so_far:
        return 0.0
    places = np.linspace(motion.assembly.start, motion.high, N_MOTION_PLACES)
    first = int(np.searchsorted(places, motion.low))
    window = int(motion.length / (places[1] - places[0]))
    rates = motion.largest_rates(places, first + window)
    drives = np.maximum(motion.assembly.forces(places), 0.0)[:, first:]
    inside = np.lib.stride_tricks.sliding_window_view(drives, window + 1, axis=1)[:, : rates.shape[2]]
    least = np.einsum("dkw,kwp->dwp", rates, inside).min(axis=2)
    return float(np.nanmax(least, initial=0.0))


def flattest_springs(motion: SprungMotion, effort: float, flat: float) -> HeldEffort | None:
    """Return the springs and the window with the smallest largest deviation from a torque or force [N m or N].

    Springs without which the deviation is no larger than `flat` are left out. None if the motion is shorter than the
    window, or no spring can be wound.
    """
    if not motion.goes_so_far:
        return None
    first, last = motion.low, max(motion.high - motion.length, motion.low)
    best = _best_of(motion, effort, np.linspace(first, last, N_WINDOWS))
    if best is None:
        return None
    step = (last - first) / (N_WINDOWS - 1)
    nearer = np.linspace(max(first, best.begin - step), min(last, best.begin + step), N_NEIGHBOUR_WINDOWS)
    finer = best if last == first else _best_of(motion, effort, nearer) or best
    return _drop_needless_springs(motion, effort, min(best, finer, key=lambda window: window.deviation), flat)


def _best_of(motion: SprungMotion, effort: float, begins: FloatArray) -> HeldEffort | None:
    """Return the best springs of the best of some windows, by where they begin; None if there are none."""
    ends = begins + motion.length
    places = np.unique([*np.linspace(motion.assembly.start, ends[-1], N_MOTION_PLACES), *ends])
    largest = RATE_SHARE * motion.largest_rates(places)[:, :, np.searchsorted(places, ends)]
    windows = [
        window
        for k, begin in enumerate(begins.tolist())
        for upper in largest[:, :, k]
        if (window := _fit_window(motion, effort, begin, upper)) is not None
    ]
    return min(windows, key=lambda window: window.deviation, default=None)


def _drop_needless_springs(motion: SprungMotion, effort: float, best: HeldEffort, flat: float) -> HeldEffort:
    """Return a window with as few springs as are flat enough, those left out first that do least."""
    does = best.rates * np.abs(motion.assembly.forces(_window(motion, best.begin))).max(axis=1)
    for k in np.argsort(does).tolist():
        upper = np.where((best.upper > 0.0) & (np.arange(len(does)) != k) & (best.rates > 0.0), best.upper, 0.0)
        fewer = _fit_window(motion, effort, best.begin, upper) if best.rates[k] > 0.0 else None
        if fewer is not None and fewer.deviation <= max(flat, best.deviation):
            best = fewer
    return best


def _window(motion: SprungMotion, begin: float) -> FloatArray:
    return np.linspace(begin, begin + motion.length, N_FITTED_PLACES)


def _fit_window(motion: SprungMotion, effort: float, begin: float, upper: FloatArray) -> HeldEffort | None:
    """Return the best springs below the largest rates for a window; None if there are none."""
    units = motion.assembly.forces(_window(motion, begin))
    if not np.isfinite(units).all() or not upper.any():
        return None
    goal = RateGoal(units.T / effort, np.ones(N_FITTED_PLACES), upper)
    rates = minimax(goal)
    return None if rates is None or not rates.any() else HeldEffort(begin, rates, upper, goal.deviation(rates))
