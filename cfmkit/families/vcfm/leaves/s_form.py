"""Closed form of an inclined leaf that bends into an S between wall and guided shuttle: force, curvature, bent line.

Large motion, small strain.

The leaf is a beam-column in a frame that turns with its chord: both ends make the angle alpha with the chord, the axial
force P follows from how much shorter the chord is than the leaf, and the shear V from the end slopes. One root,
z = P L^2/(4 E I), says everything: with C = cos q, S = sin(q)/q, q^2 = z,

    1 - l/L = (t/L)^2 z/3 + alpha^2 e(z),   e = (1 + S C - 2 S^2)/(4 (C - S)^2),
    V = 2 E I alpha w(z)/(L l),             w = -2 z S/(C - S),       e = -(dw/dz)/4.

All arguments here are dimensionless: lengths over L, forces over E I/L^2. Against the geometrically exact beam of Ding,
Li and Li (2022), Table I, the force is off by 0.004 N of 2.2 before buckling, and by 0.009 N up to 6 mm.

[A] S. Awtar, A. Slocum, ASME J. Mech. Des. 129 (2007) 625: the beam constraint model, here without truncation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip


POLE_LOAD = 20.190728556426629  # z at which tan q = q: the S form can carry no more
BUCKLING_LOAD = np.pi**2  # z of the buckling form 1 - cos(2 pi s/L), P = 4 pi^2 E I/L^2
MAX_SERIES_LOAD = 0.35  # below this |z| the closed forms cancel and the series is used
NEWTON_STEPS = 60  # at most so many to find z
_STIFFNESS_SERIES = np.array(
    [
        6.0, -2 / 5, -2 / 175, -4 / 7875, -74 / 3031875, -236 / 197071875, -11012 / 186232921875, -6616 / 2261399765625,
        -1.4485013706484022e-10, -7.173272831196296e-12, -3.5526189671387116e-13, -1.759506952822918e-14,
    ]
)  # fmt: skip
_EXTENSION_SERIES = -0.25 * np.arange(1, len(_STIFFNESS_SERIES)) * _STIFFNESS_SERIES[1:]
_SLOPE_SERIES = np.arange(1, len(_EXTENSION_SERIES)) * _EXTENSION_SERIES[1:]
_POLE_BOUND = 20.19  # below e(z) (POLE_LOAD - z)^2 on 0 <= z < POLE, which falls from 40.8 to POLE


@dataclass(frozen=True)
class ChordPose:
    """Chord of a leaf whose shuttle end was moved by u = d/L: length l/L, slope, turn alpha and shortening 1 - l/L."""

    chord: Any
    sine: Any
    cosine: Any
    turn: Any
    shortening: Any


def pose(angle: Any, travel: Any) -> ChordPose:
    """Return the chord of a leaf at `angle` [rad] whose end has travelled u = d/L, without cancellation."""
    s, c = np.sin(angle), np.cos(angle)
    used = travel * (2.0 * s - travel)
    chord = np.sqrt(np.maximum(1.0 - used, c * c))
    return ChordPose(chord, (s - travel) / chord, c / chord, np.arcsin(travel * c / chord), used / (1.0 + chord))


def compliance(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return e(z), the shortening by bending per squared end slope, and its derivative.

    Examples
    --------
    >>> e, slope = compliance(np.array([0.0, np.pi**2]))
    >>> e.round(12).tolist(), float(slope[0].round(9))
    ([0.1, 0.25], 0.005714286)
    """
    q = np.sqrt(np.abs(z))
    with np.errstate(all="ignore"):
        c, s = np.cos(q), np.sin(q) / q
        ds = 0.5 * (c - s) / z
        gap, top = c - s, 1.0 + s * (c - 2.0 * s)
        inverse = 1.0 / gap
        e = 0.25 * top * inverse * inverse
        rate = ds * (c - 4.0 * s) - 0.5 * s * s
        slope = 0.25 * inverse * inverse * (rate + 2.0 * top * inverse * (0.5 * s + ds))
    pulled = z < -MAX_SERIES_LOAD
    if pulled.any():
        e[pulled], slope[pulled] = _tension_compliance(z[pulled])
    is_small = np.abs(z) <= MAX_SERIES_LOAD
    if is_small.any():
        e[is_small], slope[is_small] = _series(z[is_small], _EXTENSION_SERIES), _series(z[is_small], _SLOPE_SERIES)
    return e, slope


def _tension_compliance(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return `compliance` for tension: in terms of t = tanh(r)/r, which never overflows."""
    r = np.sqrt(-z)
    t = np.tanh(r) / r
    sech = 1.0 + z * t * t
    dt = (t - sech) / (-2.0 * z)
    top, gap = sech + t - 2.0 * t * t, 1.0 - t
    rate = t * t + 2.0 * z * t * dt + dt - 4.0 * t * dt
    return 0.25 * top / gap**2, 0.25 * (rate * gap + 2.0 * top * dt) / gap**3


def end_curvature(z: FloatArray) -> FloatArray:
    """Return w(z), the curvature at an end times L per end slope.

    Examples
    --------
    >>> end_curvature(np.array([0.0, np.pi**2])).round(12).tolist()
    [6.0, 0.0]
    """
    q = np.sqrt(np.abs(z))
    with np.errstate(all="ignore"):
        c, s = np.cos(q), np.sin(q) / q
        w = -2.0 * z * s / (c - s)
        t = np.tanh(q) / q
        w = np.where(z < -MAX_SERIES_LOAD, -2.0 * z * t / (1.0 - t), w)
    is_small = np.abs(z) <= MAX_SERIES_LOAD
    if is_small.any():
        w[is_small] = _series(z[is_small], _STIFFNESS_SERIES)
    return w


def _series(z: FloatArray, terms: FloatArray) -> FloatArray:
    """Return the power series with these terms, lowest first: `polyval` without its checks, to the last bit."""
    total: FloatArray = terms[-1] + 0.0 * z
    for term in terms[-2::-1].tolist():
        total *= z
        total += term
    return total


def largest_curvature(z: FloatArray) -> FloatArray:
    """Return the largest curvature times L per end slope: at the ends, or inside where z is above pi^2/4."""
    q = np.sqrt(np.abs(z))
    with np.errstate(all="ignore"):
        inside = 2.0 * q / np.abs(np.cos(q) - np.sin(q) / q)
    return np.where(z > 0.25 * np.pi**2, inside, np.abs(end_curvature(z)))


def axial_root(
    shortening: Any,  # 1 - l/L
    turn: Any,  # alpha [rad]
    stretch: Any,  # (t/L)^2/3 = 4 E I/(E A L^2)
) -> FloatArray:
    """Return z with stretch z + turn^2 e(z) = shortening, element by element."""
    parts = [np.asarray(item, dtype=float) for item in (shortening, np.square(turn), stretch)]
    shape = np.broadcast_shapes(*(item.shape for item in parts))
    m, bend, a = (np.broadcast_to(item, shape).ravel() for item in parts)
    with np.errstate(all="ignore"):
        free = m / a
        bent = POLE_LOAD - np.sqrt(bend * _POLE_BOUND / np.where(m > 0, m, 1.0))
    # at zero the function is bend/10 - m: its sign says on which side the root lies, and what bounds it from the right
    z = np.where(m < 0, free, np.where(0.1 * bend >= m, 0.0, np.minimum(free, bent)))
    z = np.minimum(z, POLE_LOAD * (1.0 - 1e-9))
    for _ in range(NEWTON_STEPS):  # from the right of the root of a convex function none overshoots
        e, slope = compliance(z)
        step = (a * z + bend * e - m) / (a + bend * slope)
        z = np.minimum(z - step, POLE_LOAD * (1.0 - 1e-12))
        if not (np.abs(step) > 1e-11 * (1.0 + np.abs(z))).any():
            break
    return z.reshape(shape)


@dataclass(frozen=True)
class Force:
    """State of a leaf at a pose: force along the motion [E I/L^2], z, and the turn of its chord [rad]."""

    along: Any
    z: Any
    turn: Any

    @property
    def curvature(self) -> Any:
        """Largest curvature times L."""
        return np.abs(self.turn) * largest_curvature(self.z)


def s_force(
    angle: Any,  # of the unloaded leaf [rad]
    slimness: Any,  # t/L
    travel: Any,  # d/L, positive towards the flat pose
) -> Force:
    """Return the force of a leaf in S form."""
    at = pose(angle, travel)
    z = axial_root(at.shortening, at.turn, np.square(slimness) / 3.0)
    along = 4.0 * z * at.sine + 2.0 * at.turn * end_curvature(z) * at.cosine / at.chord
    return Force(along, z, at.turn)


N_LINE_POINTS = 81


def bent_leaf(
    strip: LeafStrip,  # the leaf
    travel: float,  # of its far end towards the flat pose [m]
    critical: float | None = None,  # load of the buckled form; None: it is not buckled
    # whether the far end moves across as it likes, without axial force, as the corner of a diamond does
    free: bool = False,
) -> FloatArray:
    """Return the centre line of a straight leaf bent into an S, buckled under `critical` [N] where that is given."""
    length, angle = float(strip.length), float(strip.angle)
    at = pose(angle, travel / length)
    stretch = (strip.thickness / length) ** 2 / 3.0
    z = 0.0 if free else float(axial_root(at.shortening, at.turn, stretch))
    if critical is not None:
        z = BUCKLING_LOAD
    place = np.linspace(0.0, 1.0, N_LINE_POINTS)
    slope = float(at.turn) * _s_slope(min(z, POLE_LOAD - 0.05), 2.0 * place - 1.0)
    if critical is not None:
        spare = float(at.shortening) - critical / float(strip.axial) - 0.25 * float(at.turn) ** 2
        slope = slope + 2.0 * np.sqrt(max(spare, 0.0)) * np.sin(2.0 * np.pi * place)
    angles = angle - float(at.turn) + slope
    step = length / (N_LINE_POINTS - 1)
    across = float(np.trapezoid(np.cos(angles), dx=step)) if free else float(strip.reach)
    return line_between(angles, np.full(N_LINE_POINTS, step), (across, float(strip.rise) - travel))


def _s_slope(z: float, eta: FloatArray) -> FloatArray:
    """Return the slope to the chord over the end slope, at -1 ... 1 along the leaf."""
    if abs(z) < 1e-6:
        return 0.5 * (3.0 * eta**2 - 1.0)
    q = np.sqrt(complex(z))
    mean = np.sin(q) / q
    return np.asarray(np.real((np.cos(q * eta) - mean) / (np.cos(q) - mean)))


def line_between(angles: FloatArray, steps: FloatArray, end: tuple[float, float]) -> FloatArray:
    """Return the line of these directions and step lengths, its far end brought to its place evenly."""
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    middle = 0.5 * (along[1:] + along[:-1]) * steps[1:, None]
    line = np.concatenate([[[0.0, 0.0]], np.cumsum(middle, axis=0)])
    share = np.linspace(0.0, 1.0, len(line))[:, None]
    shifted: FloatArray = line + share * (np.array(end) - line[-1])
    return shifted
