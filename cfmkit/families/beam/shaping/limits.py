"""The limits of a task, clearance included, as rows that must be at least zero, all of order one, with derivatives.

Clearance of beams: a smooth bound of the smallest gap of a pair over the required one, with derivatives. Beams that
meet in a joint come close to each other there. So the gap that is required between two places grows with the way
between them around the joint, up to the full one; that also asks for an angle between beams that meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.beam.network_from_spec import thickest_of
from cfmkit.families.beam.shaping.response import BeamAtPoses
from cfmkit.numerics.sampled_extremes import largest, soft_least

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.designing.objective_and_constraints import LimitRows
    from cfmkit.elastica import Network
    from cfmkit.families.beam.shaping.response import View


SIDES = {
    "stress": ("left side", "right side"),
    "left": ("left side, tension", "left side, compression"),
    "right": ("right side, tension", "right side, compression"),
    "x": ("right", "left"),
    "y": ("top", "bottom"),
}


def stress(view: View) -> list[LimitRows]:
    """Signed extremes of the stress of each beam at every pose but rest, against the allowable stress."""
    task = view.response.variables.task
    allowed = task.limits.stress
    if allowed is None:
        return []
    parts = ("left", "right") if task.total_stress else ("stress",)
    return [_extremes(view, "stress", part, slice(1, None), (allowed, allowed), allowed) for part in parts]


def envelope(view: View) -> list[LimitRows]:
    """Extremes of the centre lines before loading."""
    return _inside(view, "envelope", view.response.variables.task.limits.envelope, slice(0, 1))


def deformed_envelope(view: View) -> list[LimitRows]:
    """Extremes of the centre lines at every pose."""
    return _inside(view, "deformed_envelope", view.response.variables.task.limits.deformed_envelope, slice(None))


def _inside(view: View, name: str, box: tuple[float, float, float, float] | None, which: slice) -> list[LimitRows]:
    size = view.response.variables.task.size
    if box is None:
        return []
    ends = {"x": (box[1], -box[0]), "y": (box[3], -box[2])}
    return [_extremes(view, name, axis, which, most, size) for axis, most in ends.items()]


def _extremes(view: View, name: str, what: str, which: slice, most: tuple[float, float], unit: float) -> LimitRows:
    """Return (most - largest value along each beam) / unit at some poses, of the value and of its negative."""
    lines = view.response.state.lines
    found = [np.zeros(0)] * len(lines)
    by: list[FloatArray] = []
    for number, (beam, line) in enumerate(lines.items()):
        values = getattr(line, what)[which]
        top, _, weights = largest(line.place, np.stack([values, -values]))
        found[number] = (np.array(most)[:, None] - top) / unit
        if view.sloped:
            weights[1] *= -1
            slopes = getattr(view.response.slopes.lines[beam], what)[which]
            by.append(-np.matmul(weights.transpose(1, 0, 2), slopes).transpose(1, 0, 2) / unit)
    values = np.concatenate([one.ravel() for one in found])
    sides = SIDES[what]

    def about() -> list[str]:
        at = view.poses.at[which]
        return [f"{beam}, {side}, at {1e3 * pose:.4g} mm" for beam in lines for side in sides for pose in at]

    return view.rows(name, values, lambda: np.concatenate([one.reshape(-1, one.shape[-1]) for one in by]), about)


def length_ratio(view: View) -> list[LimitRows]:
    """Length over chord of the beams whose shape varies."""
    task = view.response.variables.task
    if task.limits.length_ratio is None:
        return []
    least = 1.0 / task.limits.length_ratio
    many = {name: one for name, one in view.lengths.items() if name in task.shaped}
    values = np.array([one.straightness - least for one in many.values()])
    slopes = np.array([one.by_straightness for one in many.values()])
    return [view.rows("max_length_ratio", values, lambda: slopes, lambda: list(many))]


def slenderness(view: View) -> list[LimitRows]:
    """Length over the largest thickness of every beam."""
    task = view.response.variables.task
    if task.limits.slenderness is None:
        return []
    many = view.lengths
    least = np.array([task.limits.slenderness * thickest_of(view.section(name)) for name in many])
    values = np.array([one.length for one in many.values()]) / least - 1.0
    slopes = np.array([one.by_length for one in many.values()]) / least[:, None]
    return [view.rows("min_slenderness", values, lambda: slopes, lambda: list(many))]


def radius(view: View) -> list[LimitRows]:
    """Signed extremes of the curvature of the beams whose shape varies, before loading."""
    variables = view.response.variables
    least = variables.task.limits.radius
    if least is None or variables.order == 0:
        return []
    u = np.linspace(0, 1, 17)
    powers = np.arange(1, variables.order + 1) * u[:, None] ** np.arange(variables.order)
    found = []
    for row, name in enumerate(variables.task.shaped):
        first = len(variables.task.coordinates) + variables.order * row
        one = view.lengths[name]
        turn = powers @ view.response.x[first : first + variables.order]
        for sign in (1.0, -1.0):
            value, _, weights = largest(u, sign * turn)
            slopes = least * value / one.length**2 * one.by_length
            slopes[first : first + variables.order] -= sign * least / one.length * (weights @ powers)
            values = np.atleast_1d(1.0 - least * value / one.length)
            found.append(
                view.rows("min_radius", values, lambda slopes=slopes: slopes, lambda name=name: [name])  # type: ignore[misc]
            )
    return found


def clearance(view: View) -> list[LimitRows]:
    """Gap of every pair of beams, and of every beam with itself, before loading and under load."""
    task = view.response.variables.task
    if task.limits.clearance is None:
        return []
    found = []
    for pair in pairs(task.network):
        value, slopes = separations(view, pair)

        def about(pair: Pair = pair) -> list[str]:
            both = " and ".join(dict.fromkeys(pair.beams))
            return [f"{both}, at {1e3 * at:.4g} mm" for at in view.poses.at[view.poses.shown]]

        found.append(view.rows("clearance", value, slopes, about))
    return found


def force(view: View) -> list[LimitRows]:
    """Mean force over the window, against a least value and a target."""
    limits, weights = view.response.variables.task.limits, view.poses.mean
    mean = float(weights @ view.response.state.force)
    rows: list[tuple[float, float, str]] = []
    if limits.force_min is not None:
        rows.append((mean / limits.force_min - 1.0, 1.0 / limits.force_min, "least mean"))
    if limits.force_target is not None:
        target, share = limits.force_target, limits.force_tolerance
        rows.append((mean / target - 1.0 + share, 1.0 / target, "target, from below"))
        rows.append((1.0 - mean / target + share, -1.0 / target, "target, from above"))
    if not rows:
        return []

    def slopes() -> FloatArray:
        return np.outer([factor for _, factor, _ in rows], weights @ view.response.slopes.force)

    values = np.array([value for value, _, _ in rows])
    return [view.rows("force", values, slopes, lambda: [about for _, _, about in rows])]


LIMITS: dict[str, Callable[[View], list[LimitRows]]] = {
    "stress": stress,
    "envelope": envelope,
    "deformed_envelope": deformed_envelope,
    "max_length_ratio": length_ratio,
    "min_slenderness": slenderness,
    "min_radius": radius,
    "clearance": clearance,
    "force": force,
}
"""All limits by name."""


SHARPNESS = 25.0
_PLACES = 16


@dataclass(frozen=True)
class Pair:
    """Two beams, or one twice, and the ends (0 or 1 of each) at which they meet."""

    beams: tuple[str, str]
    joints: tuple[tuple[int, int], ...]

    @property
    def alone(self) -> bool:
        """Whether it is one beam with itself."""
        return self.beams[0] == self.beams[1]


def pairs(network: Network) -> list[Pair]:
    """Return all pairs of beams, each beam with itself included."""
    return [_pair(network, *names) for names in combinations_with_replacement(network.beams, 2)]


def _pair(network: Network, first: str, second: str) -> Pair:
    ends = [[network.master_of(end) for end in (network.beams[n].start, network.beams[n].end)] for n in (first, second)]
    joints = [(i, j) for i in (0, 1) for j in (0, 1) if ends[0][i] == ends[1][j]]
    return Pair((first, second), () if first == second else tuple(joints))


def separations(view: View, pair: Pair) -> tuple[FloatArray, Callable[[], FloatArray]]:
    """Return (gap / required gap - 1) of a pair at the poses that are shown (q,), and what makes the derivatives."""
    state, shown = view.response.state, view.poses.shown
    a, b = (thinned(state.lines[name]) for name in pair.beams)
    way, by_way = _way(view, pair)
    wanted = _wanted(view, pair)
    opening = view.response.variables.task.limits.opening
    near = opening * way < wanted
    required = np.where(near, opening * way, wanted)
    i, j = np.nonzero(_compared(pair, way, len(a.place)))
    dx, dy = a.x[shown][:, i] - b.x[shown][:, j], a.y[shown][:, i] - b.y[shown][:, j]
    distance = np.hypot(dx, dy) + 1e-12
    ratio = distance / required[i, j]
    soft, weights = soft_least(ratio, SHARPNESS)

    def slopes() -> FloatArray:
        by = {name: thinned(view.response.slopes.lines[name]) for name in pair.beams}
        share = weights / required[i, j]
        out = []
        for q, pose in enumerate(shown):
            pull = np.stack([share[q] * dx[q] / distance[q], share[q] * dy[q] / distance[q]])
            total = np.zeros(view.response.x.shape)
            for sign, name, index in ((1.0, pair.beams[0], i), (-1.0, pair.beams[1], j)):
                count = by[name].x.shape[1]
                total += sign * np.bincount(index, pull[0], count) @ by[name].x[pose]
                total += sign * np.bincount(index, pull[1], count) @ by[name].y[pose]
            push = np.where(near[i, j], opening * share[q] * ratio[q], 0.0)
            out.append(total - np.tensordot(push, by_way[:, i, j], axes=(0, 1)))
        return np.array(out)

    return soft - 1.0, slopes


def thinned(line: BeamAtPoses) -> BeamAtPoses:
    """Return a line at about 17 of its places: a smooth bound must not depend on how finely the engine cut the beam."""
    step = max(1, (len(line.place) - 1) // _PLACES)
    return BeamAtPoses(line.place[::step], line.x[:, ::step], line.y[:, ::step], line.stress[:, ::step])


def _compared(pair: Pair, way: FloatArray, count: int) -> Any:
    """Return which places are compared: not a joint with itself, and no neighbours on one beam."""
    if pair.alone:
        return np.triu(np.ones((count, count), dtype=bool), 2)
    return way > 1e-9


def _wanted(view: View, pair: Pair) -> float:
    """Return the gap of the centre lines [m]: that of the surfaces and half the thickness of both beams."""
    thickness = sum(0.5 * thickest_of(view.section(name)) for name in pair.beams)
    return float((view.response.variables.task.limits.clearance or 0.0) + thickness)


def _way(view: View, pair: Pair) -> tuple[FloatArray, FloatArray]:
    """Return the way between places of the two beams (r, r) [m], infinite where they do not meet; and (k, r, r)."""
    (first, second), lines = pair.beams, view.response.state.lines
    one, other = view.lengths[first], view.lengths[second]
    u, v = thinned(lines[first]).place[:, None], thinned(lines[second]).place[None, :]
    if pair.alone:
        return abs(u - v) * one.length, abs(u - v) * one.by_length[:, None, None]
    way = np.full((u.size, v.size), np.inf)
    by_way = np.zeros((len(one.by_length), u.size, v.size))
    for end, at in pair.joints:
        p, q = abs(u - end), abs(v - at)
        here = p * one.length + q * other.length
        slope = p * one.by_length[:, None, None] + q * other.by_length[:, None, None]
        shorter = here < way
        way, by_way = np.where(shorter, here, way), np.where(shorter, slope, by_way)
    return way, by_way
