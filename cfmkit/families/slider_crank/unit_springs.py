"""Effort of a unit spring at each joint of a slider-crank: over the crank's angle, or over the slider's travel.

Torsion springs at pivot A, crank pin B and slider pin C, an extension spring at the slider, all
relaxed in one position, but for the anchor of the slider's spring, which may be moved. Energy, effort and stiffness are
linear in the four rates, so everything here is per unit rate. beta is the coupler's direction: the crank pin turns by
beta - t, the slider pin by beta.

One linkage, with plain numbers, takes places of any shape; m linkages as rows, with columns (m, 1), take places that
are (m, n), or (1, n) for all.

Assumes: rigid massless links, no friction, linear springs.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 2.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from cfmkit.arrays import ShortRepr

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.linkage import Linkage


@dataclass(frozen=True)
class Joint:
    """A joint that may have a spring, with the dimensions of its motion and of the spring's rate."""

    name: str  # in a specification
    motion: Literal["angle", "length"] = "angle"
    rate: Literal["rotational_stiffness", "stiffness"] = "rotational_stiffness"

    @property
    def words(self) -> str:
        """Name in a sentence."""
        return self.name.replace("_", " ")


_ALL_JOINTS = Joint("pivot"), Joint("crank_pin"), Joint("slider_pin"), Joint("slider", "length", "stiffness")
JOINTS_BY_NAME = {joint.name: joint for joint in _ALL_JOINTS}
JOINT_NAMES = tuple(JOINTS_BY_NAME)
"""Where the springs are: A, B, C, and the slider; rows of every (4, n) array here."""


@dataclass(frozen=True, repr=False)
class UnitCurves(ShortRepr):
    """Efforts of a spring of rate 1 at each joint along the motion, n places.

    Rows are those of `JOINT_NAMES`; the last row has a length [m] in the place of an angle [rad].
    """

    angle: FloatArray  # (..., n), of the crank [rad]
    position: FloatArray  # (..., n), the slider's x [m]
    turn: FloatArray  # (4, ..., n), q: how far each joint has turned, or the slider moved, from the unloaded position
    effort: FloatArray  # (4, ..., n), q q', the derivative of q^2/2 by the motion
    stiffness: FloatArray  # (4, ..., n), (q q')'


def curves_along_crank(
    linkage: Linkage,  # must be assemblable
    unloaded: float,  # crank angle at which all springs are relaxed [rad]
    angle: FloatArray,  # (n,): crank angles [rad], any number of turns
    anchor: float = 0.0,  # how far the anchor of the slider's spring is moved beyond where that is relaxed [m]
) -> UnitCurves:
    """Return the unit curves over the crank angle: effort is a torque at the crank [LH, eq. 10].

    Differences from the unloaded position are formed without cancellation. NaN where the
    linkage does not reach; infinite where the coupler stands across the slider's path.
    """
    r1, r2 = linkage.crank, linkage.coupler
    angle = np.asarray(angle, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        turn, position = _turns(linkage, unloaded, angle, anchor)
        sine, cosine = np.sin(angle), np.cos(angle)
        first, rise, level = _differentiate_turns(linkage, position, sine, cosine)
        _, _, b1, _ = first
        b2 = (r1 * sine / r2 + rise * b1**2) / level
        x2 = -r1 * cosine - r2 * (level * b1**2 + rise * b2)
        second = np.stack([np.zeros_like(b2), b2, b2, x2])
        return UnitCurves(angle, position, turn, turn * first, first**2 + turn * second)


def crank_efforts(linkage: Linkage, unloaded: float, angle: FloatArray, anchor: float = 0.0) -> FloatArray:
    """Return the efforts of `curves_along_crank`, (4, n), to the last bit, without anything else."""
    angle = np.asarray(angle, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        turn, position = _turns(linkage, unloaded, angle, anchor)
        first, _, _ = _differentiate_turns(linkage, position, np.sin(angle), np.cos(angle))
        turn *= first
    return turn


def _differentiate_turns(
    linkage: Linkage, position: FloatArray, sine: FloatArray, cosine: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the derivatives of q by the crank angle, (4, n), and sine and cosine of the coupler's angle."""
    r1, r2 = linkage.crank, linkage.coupler
    rise = (linkage.offset - r1 * sine) / r2  # sin beta
    level = linkage.branch * np.abs((position - r1 * cosine) / r2)  # cos beta, with the sign of the branch
    first = np.empty((4, *np.shape(level)))
    first[0], first[2] = 1.0, -r1 * cosine / (r2 * level)
    first[1] = first[2] - 1.0
    first[3] = -r1 * sine - r2 * rise * first[2]
    return first, rise, level


def _turns(linkage: Linkage, unloaded: float, angle: FloatArray, anchor: float) -> tuple[FloatArray, FloatArray]:
    """Return q of the four joints, (4, n), and the slider's x."""
    r1, r2, e = linkage.crank, linkage.coupler, linkage.offset
    half = 0.5 * (angle - unloaded)
    middle = 0.5 * (angle + unloaded)
    swing = 2.0 * r1 * np.sin(half)
    lift0 = r1 * np.sin(unloaded) - e
    rise = swing * np.cos(middle)  # u - u0
    lift = lift0 + rise
    run0 = np.sqrt(np.maximum((r2 - lift0) * (r2 + lift0), 0.0))
    run = np.sqrt((r2 - lift) * (r2 + lift))
    shorter = rise * (lift + lift0) / (run + run0)  # a0 - a
    coupler = -linkage.branch * np.arctan2(rise * run0 + lift0 * shorter, run * run0 + lift * lift0)
    travel = -swing * np.sin(middle) - linkage.branch * shorter
    turn = np.empty((4, *np.shape(coupler)))
    turn[0], turn[2], turn[3] = 2.0 * half, coupler, travel - linkage.branch * anchor
    turn[1] = coupler - turn[0]
    return turn, r1 * np.cos(angle) + linkage.branch * run


def curves_along_slider(
    linkage: Linkage,  # must be assemblable
    unloaded: float,  # crank angle at which all springs are relaxed [rad]
    side: int,  # 1: the crank is beyond the stretched position (psi > 0), -1: before it
    # (n,): from the unloaded position [m]; positive to the left on the right branch, to the right on the left one:
    # towards the pivot from where the linkage is stretched
    travel: FloatArray,
) -> UnitCurves:
    """Return the unit curves over the slider's travel towards the pivot: effort is a force at the slider [B, eq. 2-7].

    Everything is written in the knee angle psi between crank and coupler, which the travel
    gives without cancellation: x_s^2 - x^2 = 4 r1 r2 sin^2(psi/2), x_s the stretched position. x has a sign:
    beyond the pivot's foot the same travel leads away from the pivot. Where the springs are relaxed in the
    stretched or the folded position, the effort at its 0/0 is the limit; otherwise it grows without bound towards
    both. NaN where the linkage does not reach, and as the stiffness at those positions.
    """
    return path_of(linkage, unloaded, side).units(travel)


@dataclass(frozen=True)
class _SliderState:
    """Places on the slider's path: knee angle, x, q of the four joints, and sine and cosine of the knee angle."""

    knee: FloatArray
    position: FloatArray
    turn: FloatArray
    sine: FloatArray
    cosine: FloatArray


class _Slopes(NamedTuple):
    """Derivatives at places on the slider's path."""

    d2: FloatArray  # squared distance of the pins at both ends
    lever: FloatArray  # psi' sin(psi) of the knee angle psi, by the travel
    knee1: FloatArray  # psi'
    by_knee: FloatArray  # (3, n), what the first three q do by the knee angle with the line between the pins at rest
    first: FloatArray  # (3, n), q' by the travel


NEARLY_FOLDED = 0.99
"""Above this share of sin(psi/2) the knee angle is computed from its cosine, which keeps the digits next to pi."""
NEAR_FOOT = 0.01  # below this share of the stretched position squared, x0 squared as a difference has lost digits


@dataclass(frozen=True)
class SliderPath:
    """The way of the slider of a linkage on one side of the stretched position.

    The slider may be on either side of the pivot's foot, and may pass it where the offset is
    too large for the links to fold: x has a sign, and the knee angle keeps its own.
    """

    linkage: Linkage  # of the right branch
    is_mirrored: bool  # whether that is the mirror image of the linkage that is meant
    unloaded: float  # crank angle of `linkage` [rad]
    side: int
    anchor: float  # how far the anchor of the slider's spring is moved beyond where that is relaxed [m]
    start: float  # knee angle in the unloaded position [rad]
    stretched: float  # x_s [m]
    gap: float  # x_s^2 - x_0^2 [m^2]
    x0: float  # x in the unloaded position [m]
    inward: float  # largest travel, and largest travel backwards [m]
    outward: float

    @classmethod
    def from_linkage(cls, linkage: Linkage, unloaded: float, side: int, anchor: float) -> SliderPath:
        """Return the way of the slider of one linkage."""
        if linkage.branch < 0:
            return replace(cls.from_linkage(linkage.mirror(), math.pi - unloaded, -side, anchor), is_mirrored=True)
        knee = linkage.knee(unloaded)
        start = side * math.pi if knee == math.pi else knee  # folded is on either side
        xs, place = linkage.stretched_position, linkage.place(unloaded)
        gap = 4.0 * linkage.crank * linkage.coupler * math.sin(0.5 * start) ** 2
        square = max(xs**2 - gap, 0.0)
        x0 = place if square < NEAR_FOOT * xs**2 else math.copysign(math.sqrt(square), place)
        return cls(linkage, False, unloaded, side, anchor, start, xs, gap, x0, *linkage.room(unloaded))

    @cached_property
    def _unloaded_shares(self) -> tuple[FloatArray, FloatArray]:
        """`_shares` in the unloaded position, to the last bit [rad]: nothing has turned there."""
        _, sine, cosine = self._find_knee(0.0)
        return _shares(self.linkage, np.copysign(sine, self.start), cosine)  # on its own side of the stretched position

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def units(self, travel: FloatArray) -> UnitCurves:
        """Return the unit curves at some travels."""
        travel = np.asarray(travel, dtype=np.float64)
        state, beyond = self.evaluate(travel), self.is_unreachable(travel)
        effort, stiffness = self.efforts(state)
        if beyond.any():  # of several linkages it may be one row for all
            effort, stiffness = (np.where(beyond, np.nan, curves) for curves in (effort, stiffness))
        angle = self.unloaded + state.turn[0]
        if self.is_mirrored:
            return UnitCurves(math.pi - angle, -state.position, -state.turn, effort, stiffness)
        return UnitCurves(angle, state.position, state.turn, effort, stiffness)

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def unit_forces(self, travel: FloatArray) -> FloatArray:
        """Return the force of a unit spring at each joint: that of `units` without anything else, and faster."""
        travel = np.asarray(travel, dtype=np.float64)
        forces, beyond = self.forces(self.evaluate(travel)), self.is_unreachable(travel)
        return np.where(beyond, np.nan, forces) if beyond.any() else forces

    def is_unreachable(self, travel: FloatArray) -> NDArray[np.bool_]:
        """Return whether the slider cannot get there."""
        slack = 1e-12 * np.abs(self.x0)
        is_beyond: NDArray[np.bool_] = (travel > self.inward + slack) | (travel < -self.outward - slack)
        return is_beyond

    def _square_to_stretched(self, travel: Any) -> Any:
        """Return x_s^2 - x^2, the product of both distances from the stretched positions, without cancellation."""
        xs, x0 = self.stretched, np.abs(self.x0)
        outward = np.where(np.asarray(self.x0) >= 0.0, travel, -travel)
        return np.maximum(self.gap / (xs + x0) + outward, 0.0) * (xs + (x0 - outward))

    def evaluate(self, travel: FloatArray) -> _SliderState:
        """Return the state at some travels."""
        e, position = self.linkage.offset, self.x0 - travel
        knee, sine, cosine = self._find_knee(travel)
        view = np.arctan2(e * travel, position * self.x0 + e * e)  # how far the direction from A to C has turned
        phi, chi = _shares(self.linkage, sine, cosine)
        turn = np.empty((4, *np.shape(knee)))
        turn[0], turn[1] = view + phi - self._unloaded_shares[0], self.start - knee
        turn[2], turn[3] = view - (chi - self._unloaded_shares[1]), -travel - self.anchor
        return _SliderState(knee, position, turn, sine, cosine)

    def _find_knee(self, travel: Any) -> tuple[Any, Any, Any]:
        """Return the knee angle at some travels, its sine and its cosine."""
        squared_span = 4.0 * self.linkage.crank * self.linkage.coupler  # x^2 stretched less that folded
        square = self._square_to_stretched(travel) / squared_span
        share = np.sqrt(square)  # sin(psi/2)
        knee = 2.0 * np.arcsin(np.minimum(share, 1.0))
        sine, cosine = 2.0 * share * np.sqrt(1.0 - square), 1.0 - 2.0 * square
        if (is_folding := share > NEARLY_FOLDED).any():
            rest = np.cos(0.5 * self.start) ** 2 - travel * (self.x0 + (self.x0 - travel)) / squared_span
            folding = math.pi - 2.0 * np.arcsin(np.sqrt(np.minimum(np.maximum(rest, 0.0), 1.0)))
            pairs = (folding, knee), (np.sin(folding), sine), (np.cos(folding), cosine)
            knee, sine, cosine = (np.where(is_folding, *pair) for pair in pairs)
        return self.side * knee, self.side * sine, cosine

    def forces(self, state: _SliderState) -> FloatArray:
        """Return q q' by the travel, (4, n)."""
        return self._forces(state, self._slopes(state))

    def _forces(self, state: _SliderState, slopes: _Slopes) -> FloatArray:
        effort = np.empty_like(state.turn)
        np.multiply(state.turn[:3], slopes.first, out=effort[:3])
        relaxed = (np.equal(self.start, 0.0) | np.equal(np.abs(self.start), math.pi)) & (state.knee == self.start)
        if relaxed.any():  # 0/0: the limit is that of the slopes
            limit = slopes.by_knee**2 * slopes.lever / np.cos(self.start)
            effort[:3] = np.where(relaxed, limit, effort[:3])
        effort[3] = -state.turn[3]
        return effort

    def _slopes(self, state: _SliderState) -> _Slopes:
        link, cosine = self.linkage, state.cosine
        r1, r2 = link.crank, link.coupler
        d2 = r1 * r1 + r2 * r2 + 2.0 * r1 * r2 * cosine
        lever = state.position / (r1 * r2)
        knee1 = lever / state.sine
        by_knee = np.empty((3, *np.shape(cosine)))
        by_knee[0], by_knee[1], by_knee[2] = r2 * (r2 + r1 * cosine) / d2, -1.0, -r1 * (r1 + r2 * cosine) / d2
        first = by_knee * knee1
        first[::2] += link.offset / d2  # these turn with the line from pivot to slider pin, too
        return _Slopes(d2, lever, knee1, by_knee, first)

    def efforts(self, state: _SliderState) -> tuple[FloatArray, FloatArray]:
        """Return q q' and (q q')' by the travel, (4, n) each."""
        r1, r2, e = self.linkage.crank, self.linkage.coupler, self.linkage.offset
        sine, slopes = state.sine, self._slopes(state)
        square, knee_square = slopes.d2 * slopes.d2, slopes.knee1 * slopes.knee1
        second = slopes.by_knee * ((-1.0 / (r1 * r2) - knee_square * state.cosine) / sine)
        second[::2] += (r1 * r2 * (r2**2 - r1**2) * sine * knee_square + 2.0 * e * state.position) / square
        stiffness = np.empty_like(state.turn)
        stiffness[:3], stiffness[3] = slopes.first**2 + state.turn[:3] * second, 1.0
        stiffness[:3, (sine == 0.0) | (np.abs(state.knee) == math.pi)] = np.nan
        return self._forces(state, slopes), stiffness


@lru_cache(maxsize=8)
def path_of(linkage: Linkage, unloaded: float, side: int, anchor: float = 0.0) -> SliderPath:
    """Return the way of the slider: places are solved for on one and the same again and again."""
    return SliderPath.from_linkage(linkage, unloaded, side, anchor)


def _shares(linkage: Linkage, sine: FloatArray, cosine: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angles of crank and coupler from the line pivot to slider pin: they add up to the knee's."""
    r1, r2 = linkage.crank, linkage.coupler
    return np.arctan2(r2 * sine, r1 + r2 * cosine), np.arctan2(r1 * sine, r2 + r1 * cosine)
