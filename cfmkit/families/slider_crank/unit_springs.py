"""What a unit spring at each joint of a slider-crank gives: over the crank's angle, or over the slider's travel.

Torsion springs at pivot A, crank pin B and slider pin C, an extension spring at the slider, all
relaxed in one position. Energy, effort and stiffness are linear in the four rates, so
everything here is per unit rate. beta is the coupler's direction: the crank pin
turns by beta - t, the slider pin by beta.

Assumes: rigid massless links, no friction, linear springs.

Reference
---------
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 2.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.linkage import Linkage

JOINTS = ("pivot", "crank_pin", "slider_pin", "slider")
"""Where the springs are: A, B, C, and the slider; rows of every (4, n) array here."""


@dataclass(frozen=True, repr=False)
class UnitCurves(ShortRepr):
    """What a spring of rate 1 at each joint gives along the motion, n places.

    Rows are those of `JOINTS`; the last row has a length [m] in the place of an angle [rad].

    Attributes
    ----------
    angle : (n,) array
        Crank angle [rad].
    position : (n,) array
        The slider's x [m].
    turn : (4, n) array
        q: how far each joint has turned, or the slider moved, from the unloaded position.
    effort : (4, n) array
        q q', the derivative of q^2/2 by the motion.
    stiffness : (4, n) array
        (q q')'.
    bend : (4, n) array or None
        (q q')''; None where it was not requested.
    """

    angle: FloatArray
    position: FloatArray
    turn: FloatArray
    effort: FloatArray
    stiffness: FloatArray
    bend: FloatArray | None = None


def along_crank(linkage: Linkage, unloaded: float, angle: FloatArray, bend: bool = False) -> UnitCurves:
    """Return the unit curves over the crank angle: effort is a torque at the crank [LH, eq. 10].

    Differences from the unloaded position are formed without cancellation. NaN where the
    linkage does not reach; infinite where the coupler stands across the slider's path.

    Parameters
    ----------
    linkage : Linkage
        Must be assemblable.
    unloaded : float
        Crank angle at which all springs are relaxed [rad].
    angle : (n,) array
        Crank angles [rad], any number of turns.
    bend : bool
        Whether the second derivative of the effort is wanted, too.
    """
    r1, r2 = linkage.crank, linkage.coupler
    angle = np.asarray(angle, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        turn, position = _turns(linkage, unloaded, angle)
        sine, cosine = np.sin(angle), np.cos(angle)
        first, rise, level = _first(linkage, position, sine, cosine)
        _, _, b1, _ = first
        b2 = (r1 * sine / r2 + rise * b1**2) / level
        x2 = -r1 * cosine - r2 * (level * b1**2 + rise * b2)
        second = np.stack([np.zeros_like(angle), b2, b2, x2])
        effort = turn * first
        stiffness = first**2 + turn * second
        if not bend:
            return UnitCurves(angle, position, turn, effort, stiffness)
        b3 = (r1 * cosine / r2 + level * b1**3 + 3.0 * rise * b1 * b2) / level
        x3 = r1 * sine + r2 * (rise * b1**3 - 3.0 * level * b1 * b2 - rise * b3)
        third = np.stack([np.zeros_like(angle), b3, b3, x3])
        return UnitCurves(angle, position, turn, effort, stiffness, 3.0 * first * second + turn * third)


def crank_efforts(linkage: Linkage, unloaded: float, angle: FloatArray) -> FloatArray:
    """Return the efforts of `along_crank`, (4, n), to the last bit, without anything else."""
    angle = np.asarray(angle, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        turn, position = _turns(linkage, unloaded, angle)
        first, _, _ = _first(linkage, position, np.sin(angle), np.cos(angle))
        turn *= first
    return turn


def _first(
    linkage: Linkage, position: FloatArray, sine: FloatArray, cosine: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the derivatives of q by the crank angle, (4, n), and sine and cosine of the coupler's angle."""
    r1, r2 = linkage.crank, linkage.coupler
    rise = (linkage.offset - r1 * sine) / r2  # sin beta
    level = linkage.branch * np.abs((position - r1 * cosine) / r2)  # cos beta, with the sign of the branch
    first = np.empty((4, *np.shape(sine)))
    first[0], first[2] = 1.0, -r1 * cosine / (r2 * level)
    first[1] = first[2] - 1.0
    first[3] = -r1 * sine - r2 * rise * first[2]
    return first, rise, level


def _turns(linkage: Linkage, unloaded: float, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return q of the four joints, (4, n), and the slider's x."""
    r1, r2, e = linkage.crank, linkage.coupler, linkage.offset
    half = 0.5 * (angle - unloaded)
    middle = 0.5 * (angle + unloaded)
    swing = 2.0 * r1 * np.sin(half)
    lift0 = r1 * math.sin(unloaded) - e
    rise = swing * np.cos(middle)  # u - u0
    lift = lift0 + rise
    run0 = math.sqrt(max((r2 - lift0) * (r2 + lift0), 0.0))
    run = np.sqrt((r2 - lift) * (r2 + lift))
    shorter = rise * (lift + lift0) / (run + run0)  # a0 - a
    coupler = -linkage.branch * np.arctan2(rise * run0 + lift0 * shorter, run * run0 + lift * lift0)
    travel = -swing * np.sin(middle) - linkage.branch * shorter
    turn = np.empty((4, *np.shape(angle)))
    turn[0], turn[2], turn[3] = 2.0 * half, coupler, travel
    turn[1] = coupler - turn[0]
    return turn, r1 * np.cos(angle) + linkage.branch * run


def along_slider(linkage: Linkage, unloaded: float, side: int, travel: FloatArray) -> UnitCurves:
    """Return the unit curves over the slider's travel towards the pivot: effort is a force at the slider [B, eq. 2-7].

    Everything is written in the knee angle psi between crank and coupler, which the travel
    gives without cancellation: x_s^2 - x^2 = 4 r1 r2 sin^2(psi/2), x_s the stretched position. x has a sign:
    beyond the pivot's foot the same travel leads away from the pivot. Where the springs are relaxed in the
    stretched or the folded position, the effort at its 0/0 is the limit; otherwise it grows without bound towards
    both. NaN where the linkage does not reach, and as the stiffness at those positions.

    Parameters
    ----------
    linkage : Linkage
        Must be assemblable.
    unloaded : float
        Crank angle at which all springs are relaxed [rad].
    side : int
        1: the crank is beyond the stretched position (psi > 0), -1: before it.
    travel : (n,) array
        From the unloaded position [m]; positive to the left on the right branch, to the right on the left one:
        towards the pivot from where the linkage is stretched.
    """
    if linkage.branch < 0:
        mirror = along_slider(linkage.mirrored(), math.pi - unloaded, -side, travel)
        angle, position = math.pi - mirror.angle, -mirror.position
        return UnitCurves(angle, position, -mirror.turn, mirror.effort, mirror.stiffness)
    travel = np.asarray(travel, dtype=np.float64)
    path = _path(linkage, unloaded, side)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        state = path.at(travel)
        effort, stiffness = path.efforts(state)
    effort, stiffness = (np.where(path.beyond(travel), np.nan, item) for item in (effort, stiffness))
    return UnitCurves(unloaded + state.turn[0], state.position, state.turn, effort, stiffness)


def slider_forces(linkage: Linkage, unloaded: float, side: int, travel: FloatArray) -> FloatArray:
    """Return the force of a unit spring at each joint, (4, n): `along_slider` without anything else, and faster."""
    if linkage.branch < 0:
        return slider_forces(linkage.mirrored(), math.pi - unloaded, -side, travel)
    travel = np.asarray(travel, dtype=np.float64)
    path = _path(linkage, unloaded, side)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found = path.forces(path.at(travel))
    found[:, path.beyond(travel)] = np.nan
    return found


@dataclass(frozen=True)
class _SliderState:
    """Places on the slider's path: knee angle, x, q of the four joints, and sine and cosine of the knee angle."""

    knee: FloatArray
    position: FloatArray
    turn: FloatArray
    sine: FloatArray
    cosine: FloatArray


NEARLY_FOLDED = 0.99
"""Above this share of sin(psi/2) the knee angle is computed from its cosine, which keeps the digits next to pi."""

NEAR_FOOT = 0.01
"""Below this share of the stretched position squared, x0 squared as a difference has lost digits."""


_VIEWS = np.array([1.0, 0.0, 1.0])[:, None]
"""Whether the spring at pivot, crank pin and slider pin turns with the line from pivot to slider pin."""


class _SliderPath:
    """The way of the slider of a linkage on one side of the stretched position.

    The slider may be on either side of the pivot's foot, and may pass it where the offset is
    too large for the links to fold: x has a sign, and the knee angle keeps its own.
    """

    def __init__(self, linkage: Linkage, unloaded: float, side: int) -> None:
        knee = linkage.knee(unloaded)
        self.linkage, self.side = linkage, side
        self.start = side * math.pi if knee == math.pi else knee  # folded is on either side
        xs, place = linkage.stretched_position, float(linkage.slider_position(np.asarray(unloaded)))
        self.gap = 4.0 * linkage.crank * linkage.coupler * math.sin(0.5 * self.start) ** 2
        square = max(xs**2 - self.gap, 0.0)
        self.x0 = place if square < NEAR_FOOT * xs**2 else math.copysign(math.sqrt(square), place)
        self.inward, self.outward = linkage.room(unloaded)
        self.phi0, self.chi0 = _shares(linkage, np.sin(self.start), np.cos(self.start))

    def beyond(self, travel: FloatArray) -> NDArray[np.bool_]:
        """Return whether the slider cannot get there."""
        slack = 1e-12 * abs(self.x0)
        found: NDArray[np.bool_] = (travel > self.inward + slack) | (travel < -self.outward - slack)
        return found

    def _to_stretched(self, travel: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distances from the stretched positions on either side, x_s - x and x_s + x, without cancellation.

        The product of both is x_s^2 - x^2.
        """
        xs = self.linkage.stretched_position
        if self.x0 >= 0.0:
            return np.maximum(self.gap / (xs + self.x0) + travel, 0.0), xs + (self.x0 - travel)
        return xs + (travel - self.x0), np.maximum(self.gap / (xs - self.x0) - travel, 0.0)

    def at(self, travel: FloatArray) -> _SliderState:
        """Return the state at some travels."""
        link = self.linkage
        position = self.x0 - travel
        ahead, behind = self._to_stretched(travel)
        share = np.sqrt(ahead * behind / (4.0 * link.crank * link.coupler))
        other = math.cos(0.5 * self.start) ** 2 - travel * (self.x0 + position) / (4.0 * link.crank * link.coupler)
        folding = math.pi - 2.0 * np.arcsin(np.sqrt(np.minimum(np.maximum(other, 0.0), 1.0)))
        knee = self.side * np.where(share > NEARLY_FOLDED, folding, 2.0 * np.arcsin(np.minimum(share, 1.0)))
        e = link.offset
        view = np.arctan2(e * travel, position * self.x0 + e * e)  # how far the direction from A to C has turned
        sine, cosine = np.sin(knee), np.cos(knee)
        phi, chi = _shares(link, sine, cosine)
        turn = np.empty((4, *np.shape(travel)))
        turn[0], turn[1] = view + phi - self.phi0, self.start - knee
        turn[2], turn[3] = view - (chi - self.chi0), -travel
        return _SliderState(knee, position, turn, sine, cosine)

    def forces(self, state: _SliderState) -> FloatArray:
        """Return q q' by the travel, (4, n)."""
        link = self.linkage
        d2, by_knee = self._by_knee(state.cosine)
        lever = state.position / (link.crank * link.coupler)  # psi' = lever / sin psi
        ratio = state.turn[:3] / state.sine
        if self.start == 0.0 or abs(self.start) == math.pi:  # 0/0 where relaxed: the limit is that of the slopes
            ratio = np.where(state.knee == self.start, by_knee / np.cos(self.start), ratio)
        effort = np.empty_like(state.turn)
        effort[:3] = state.turn[:3] * _VIEWS * (link.offset / d2) + ratio * by_knee * lever
        effort[3] = -state.turn[3]
        return effort

    def _by_knee(self, cosine: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the squared distance of the pins at both ends, and what the first three q do by the knee angle."""
        r1, r2 = self.linkage.crank, self.linkage.coupler
        d2 = r1 * r1 + r2 * r2 + 2.0 * r1 * r2 * cosine
        found = np.empty((3, *np.shape(cosine)))
        found[0], found[1], found[2] = r2 * (r2 + r1 * cosine) / d2, -1.0, -r1 * (r1 + r2 * cosine) / d2
        return d2, found

    def efforts(self, state: _SliderState) -> tuple[FloatArray, FloatArray]:
        """Return q q' and (q q')' by the travel, (4, n) each."""
        link, knee, x = self.linkage, state.knee, state.position
        r1, r2, e = link.crank, link.coupler, link.offset
        sine, cosine = state.sine, state.cosine
        d2, by_knee = self._by_knee(cosine)
        view1, view2 = e / d2, 2.0 * e * x / d2**2
        lever = x / (r1 * r2)
        bend = r1 * r2 * (r2**2 - r1**2) * sine / d2**2
        bends = np.stack([bend, np.zeros_like(knee), bend])
        knee1 = lever / sine
        knee2 = (-1.0 / (r1 * r2) - knee1**2 * cosine) / sine
        first = _VIEWS * view1 + by_knee * knee1
        second = _VIEWS * view2 + bends * knee1**2 + by_knee * knee2
        stiffness = first**2 + state.turn[:3] * second
        stiffness[:, (sine == 0.0) | (np.abs(knee) == math.pi)] = np.nan
        return self.forces(state), np.vstack([stiffness, np.ones_like(knee)[None]])


@lru_cache(maxsize=8)
def _path(linkage: Linkage, unloaded: float, side: int) -> _SliderPath:
    """Return the way of the slider: places are solved for on one and the same again and again."""
    return _SliderPath(linkage, unloaded, side)


def _shares(linkage: Linkage, sine: FloatArray, cosine: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angles of crank and coupler from the line pivot to slider pin: they add up to the knee's."""
    r1, r2 = linkage.crank, linkage.coupler
    return np.arctan2(r2 * sine, r1 + r2 * cosine), np.arctan2(r1 * sine, r2 + r1 * cosine)
