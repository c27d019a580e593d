"""Quasi-static forces in a cam mechanism, per slider position and direction of travel.

Each roller is in equilibrium under the contact force, turned by atan(mu) against the
motion, the springs, the brace and its weight. With p = tan(atan f -+ atan mu), the
slope f of the track so turned (minus on the way up), t = tan(alpha) of the brace,
S the spring force on one roller and w the weight that hangs on it,

    F = 2 (S + w p) / (p - t) + W

[SS, eq. 1, with weight added; W is the weight on the slider]. Without weight this is
F = 4 K D / (p - t): friction is a rotation of the contact normal. The code multiplies
by 1 +- mu f, which on the way down passes through zero where the normal turns past
horizontal: beyond, the springs no longer bring the rollers back and F is negative.

Assumes: the brace's centre of mass at mid-length, so that half of it hangs at each end.

Reference
---------
[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.geometry.profile import brace_tangent
from cfmkit.numerics.roots import bracketed_root

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.profile import Real
    from cfmkit.families.cam.geometry.track import Track
    from cfmkit.families.cam.geometry.track_records import TrackStates, TrackStretch

GRAVITY = 9.81
"""Standard acceleration used throughout [m/s^2]."""

_SHARES = np.sort(np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 40), 1.0 - np.geomspace(1e-6, 0.1, 20)]))
"""Where to look for a jam along a part of the track: mostly it is at the ends."""


@dataclass(frozen=True)
class Loads:
    """What acts on the rollers and the slider.

    Attributes
    ----------
    stiffness : float
        K, the sum of all parallel springs [N/m].
    rest_half_width : float
        Half the distance of the roller axes at which the springs are at rest [m].
    brace_length : float
        [m].
    roller_weight, slider_weight : float
        Weight that hangs on one roller, and on the slider [N].
    """

    stiffness: float
    rest_half_width: float
    brace_length: float
    roller_weight: float = 0.0
    slider_weight: float = 0.0


@dataclass(frozen=True)
class Forces:
    """Forces on one branch, each (n,): on the slider, at a contact, in a brace [N].

    NaN where no finite force holds the mechanism (a jam, or a dead point under load).
    """

    slider: FloatArray
    contact: FloatArray
    brace: FloatArray


def spring_force(states: TrackStates, loads: Loads) -> FloatArray:
    """Return the spring force on one roller [N]; springs do not push."""
    stretch: FloatArray = 2.0 * loads.stiffness * np.maximum(states.x - loads.rest_half_width, 0.0)
    return stretch


def forces(states: TrackStates, loads: Loads, friction: float) -> Forces:
    """Return the forces for one direction of travel [SS, eq. 1].

    Parameters
    ----------
    states : TrackStates
        Where the rollers are.
    loads : Loads
        Springs and weights.
    friction : float
        Rolling friction mu: positive on the way up, negative on the way down.

    Returns
    -------
    Forces
        On the slider, at each contact and in each brace.
    """
    slope, weight = states.slope, loads.roller_weight
    tangent = brace_tangent(states.x, loads.brace_length)
    turn = 1.0 + friction * slope
    lever = slope - friction - tangent * turn
    spring = spring_force(states, loads)
    pull = _over(2.0 * (spring * turn + weight * (slope - friction) if weight else spring * turn), lever)
    along = np.sqrt(1.0 + slope * slope)
    contact = _over(along * (spring + weight * tangent if weight else spring), lever)
    at_rest = np.abs(states.x - loads.rest_half_width) <= 1e-15 * loads.rest_half_width
    idle = np.flatnonzero(at_rest & (np.abs(lever) < 1e-13))
    if idle.size and not weight:
        pull[idle] = _at_dead_point(slope[idle], states.bend[idle], loads, friction)
        contact[idle] = 0.5 * pull[idle] * along[idle] / turn[idle]
    return Forces(pull + loads.slider_weight, contact, 0.5 * pull * np.sqrt(1.0 + tangent * tangent))


def _over(load: FloatArray, lever: FloatArray) -> FloatArray:
    """Return load / lever; 0 for nothing over anything, NaN where there is no leverage to move the load."""
    moves = lever > 0
    force = load / np.where(moves, lever, 1.0)
    return np.where(moves | (load == 0), force, np.nan)


def _at_dead_point(slope: FloatArray, bend: FloatArray, loads: Loads, friction: float) -> FloatArray:
    """Return the limit of 0/0, the ratio of the derivatives.

    At the first point of an ideal profile the springs carry nothing and the slider has
    no leverage on the roller; the force has a limit there, which is the constant force.
    """
    x, brace = loads.rest_half_width, loads.brace_length
    across = (brace - x) * (brace + x)
    turn = 1.0 + friction * slope
    lever_rate = bend * (1.0 - friction * brace_tangent(x, brace)) - brace**2 / across**1.5 * turn
    limit: FloatArray = 4.0 * loads.stiffness * turn / lever_rate
    return limit


def jams(track: Track, friction: float, states: TrackStates | None = None) -> tuple[tuple[float, float], ...]:
    """Return the intervals of the slider's position in which no force moves it up [m].

    There the lever of the slider on a roller, f - mu - tan(alpha) (1 + mu f), is not positive.
    It is looked at in the `states` that are given, if force is known to be missing in one of
    them; else where a stretch of the track begins or ends without it.
    """
    edges: list[float] = []
    jammed = False
    for part in track.stretches():

        def lever(u: Real, part: TrackStretch = part) -> Real:
            _, x, slope = part.at(u)
            # Rounding at a start without any lever is not a jam.
            margin: Real = slope - friction - brace_tangent(x, track.brace_length) * (1.0 + friction * slope) + 1e-12
            return margin

        if states is None and not jammed and lever(part.low) >= 0 and lever(part.high) >= 0:
            continue
        grid = _places(part, states)
        held = lever(grid) < 0
        if held[0] and not jammed:
            edges.append(float(part.at(part.low)[0]) if edges else track.start)
        for k in np.flatnonzero(held[1:] != held[:-1]):
            edges.append(float(part.at(bracketed_root(lever, float(grid[k]), float(grid[k + 1])))[0]))
        jammed = bool(held[-1])
    if jammed:
        edges.append(track.end)
    return tuple(zip(edges[::2], edges[1::2], strict=True))


def _places(part: TrackStretch, states: TrackStates | None) -> FloatArray:
    """Return where to look for a jam on a stretch: its parameters in increasing order."""
    grid = part.low + (part.high - part.low) * _SHARES
    if states is not None:
        known = np.arctan(states.slope[states.on_corner]) if part.on_corner else states.parameter[~states.on_corner]
        grid = np.sort(np.concatenate([known, grid]))
    return np.minimum(np.maximum(grid, part.low), part.high)
