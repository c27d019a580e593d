"""Limits of a shape task (stress, envelope, length, radius, clearance, force ...) as scaled rows >= 0, with slopes.

Clearance of beams: a smooth bound of the smallest gap of a pair over the required one, with derivatives. Beams that
meet in a joint come close to each other there. So the gap that is required between two places grows with the way
between them around the joint, up to the full one; that also asks for an angle between beams that meet.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.objective_and_constraints import LimitRows, find_largest_violation
from cfmkit.families.beam.network_from_spec import thickest_of
from cfmkit.numerics.sampled_extremes import largest, largest_of_three, soft_least

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.beam.shaping.response import BeamSamples, PosePlan, Response
    from cfmkit.families.beam.shaping.task_and_variables import Task


SIDE_NAMES = {
    "stress": ("left side", "right side"),
    "left": ("left side, tension", "left side, compression"),
    "right": ("right side, tension", "right side, compression"),
    "x": ("right", "left"),
    "y": ("top", "bottom"),
}


_REFINEMENT_FACTOR = 3  # a whole number, so that the points at which the force is solved are among the finer ones


@dataclass(frozen=True, eq=False)
class View:
    """A design in the poses of a window that begins at `start` [m], by which objective and limits are evaluated."""

    response: Response
    poses: PosePlan
    start: float
    # derivatives of rows of stress, envelopes and clearance that hold by more than this are left out: no step that can
    # be trusted makes them miss. The rows themselves are all there
    slopes_below: float = np.inf

    @property
    def task(self) -> Task:
        """Task that the design is of."""
        return self.response.variables.task

    @cached_property
    def _limits(self) -> list[PendingRows]:
        return [rows for make in LIMIT_FUNCTIONS.values() for rows in make(self)]

    def list_limits(self, sloped: bool = False) -> list[LimitRows]:
        """Return the rows of all limits, with derivatives if these are wanted."""
        return [limit.compute(sloped) for limit in self._limits]

    @property
    def violation(self) -> float:
        """Largest amount by which a limit is missed, in that limit's own scale [1]; zero if all hold."""
        return find_largest_violation(self.list_limits())

    @cached_property
    def window_force(self) -> FloatArray:
        """Force at many places of the window [N]: the polynomial through its poses.

        Where the force is to follow a curve it is divided by that, so that what is flat follows it.
        """
        return self.interpolate(self.response.force[self.poses.window] * self.levelling)

    def interpolate(self, values: FloatArray) -> FloatArray:
        """Return values at the poses of the window, (j, ...), at many places of it."""
        return np.asarray(_finer(len(self.poses.window)) @ values)

    @property
    def levelling(self) -> FloatArray | float:
        """Factors that make a force level that follows the task's curve, at the poses of the window; 1 without one."""
        curve, places = self.task.shape, self.poses.at[self.poses.window]
        return 1.0 if curve is None else 1.0 / curve.evaluate(places * self.task.layers)

    @property
    def half_band(self) -> float:
        """(max - min)/(max + min) of the force over the window [1]; infinite where the force is negative."""
        return half_band(self.window_force)


def half_band(force: FloatArray) -> float:
    """Return (max - min)/(max + min) of a force; infinite where that is negative."""
    middle = float(force.max() + force.min())
    return float(np.ptp(force)) / middle if middle > 0 else np.inf


@cache
def _finer(count: int) -> FloatArray:
    """Return the matrix from values at Chebyshev-Lobatto points to values at three times as many, in order."""
    from numpy.polynomial import chebyshev

    coarse, fine = (-np.cos(np.linspace(0, np.pi, n)) for n in (count, _REFINEMENT_FACTOR * (count - 1) + 1))
    return np.asarray(chebyshev.chebvander(fine, count - 1) @ np.linalg.inv(chebyshev.chebvander(coarse, count - 1)))


@dataclass(frozen=True)
class PendingRows:
    """Rows of one limit whose derivatives are computed when they are needed."""

    # name, values, about: as of `LimitRows`
    name: str
    values: FloatArray
    slopes: Callable[[], FloatArray]  # returns the derivatives of the rows, (m, k)
    about: Callable[[], list[str]]

    def compute(self, sloped: bool) -> LimitRows:
        """Return the rows with derivatives, or without."""
        slopes = self.slopes().reshape(self.values.size, -1) if sloped else None
        return LimitRows(self.name, self.values.ravel(), slopes, self.about)


def stress(view: View) -> list[PendingRows]:
    """Signed extremes of the stress of each beam at every pose but rest, against the allowable stress."""
    allowed = view.task.limits.stress
    if allowed is None:
        return []
    most = dict.fromkeys(("left", "right") if view.task.total_stress else ("stress",), (allowed, allowed))
    return [_extremes(view, "stress", most, slice(1, None), allowed)]


def envelope(view: View) -> list[PendingRows]:
    """Extremes of the centre lines before loading."""
    return _envelope_rows(view, "envelope", view.task.limits.envelope, slice(0, 1))


def deformed_envelope(view: View) -> list[PendingRows]:
    """Extremes of the centre lines at every pose."""
    return _envelope_rows(view, "deformed_envelope", view.task.limits.deformed_envelope, slice(None))


def _envelope_rows(
    view: View, name: str, box: tuple[float, float, float, float] | None, which: slice
) -> list[PendingRows]:
    if box is None:
        return []
    return [_extremes(view, name, {"x": (box[1], -box[0]), "y": (box[3], -box[2])}, which, view.task.size)]


def _extremes(view: View, name: str, most: dict[str, tuple[float, float]], which: slice, unit: float) -> PendingRows:
    """Return (most - largest value along each beam) / unit at some poses, of some values and of their negatives."""
    samples = view.response.samples
    poses = np.arange(len(view.poses.at))[which]
    columns = np.stack([view.response.column(what)[which] for what in most])
    top, three, weights = _highest(
        [beam.place for beam in samples.values()], [columns[..., beam.index] for beam in samples.values()]
    )
    values = (np.array(list(most.values()))[:, None, :, None] - top) / unit  # (what, beam, side, pose)
    is_near = values < view.slopes_below
    share = (weights * np.array([-1.0, 1.0])[:, None, None] / unit)[is_near]
    rows = np.stack([beam.index[three[:, k]] for k, beam in enumerate(samples.values())], axis=1)[is_near]
    pose = np.broadcast_to(poses, is_near.shape)[is_near]
    ends = np.cumsum([0, *is_near.reshape(len(most), -1).sum(axis=1).tolist()])

    def slopes() -> FloatArray:
        out = np.zeros((*values.shape, len(view.response.x)))
        at_three = [
            view.response.slopes_at(what, pose[first:end, None], rows[first:end])
            for what, first, end in zip(most, ends[:-1], ends[1:], strict=True)
        ]
        out[is_near] = (share[:, :, None] * np.concatenate(at_three)).sum(axis=1)
        return out

    def describe_places() -> list[str]:
        names = [f"{beam}, {side}" for what in most for beam in samples for side in SIDE_NAMES[what]]
        return [f"{name}, at {1e3 * pose:.4g} mm" for name in names for pose in view.poses.at[which]]

    return PendingRows(name, values, slopes, describe_places)


def _highest(places: list[FloatArray], values: list[FloatArray]) -> tuple[FloatArray, Any, FloatArray]:
    """Return `largest_of_three` of values (w, p, r) of all beams and of their negatives, (w, beams, 2, p, ...)."""
    both = [np.stack([value, -value], axis=1) for value in values]
    if len({len(place) for place in places}) == 1:  # as a rule: one call for all beams
        return largest_of_three(np.stack(places)[:, None, None], np.stack(both, axis=1))
    extremes = [largest_of_three(place, value) for place, value in zip(places, both, strict=True)]
    top, three, weights = (np.stack(part, axis=1) for part in zip(*extremes, strict=True))
    return top, three, weights


def length_ratio(view: View) -> list[PendingRows]:
    """Length over chord of the beams whose shape varies."""
    ratio = view.task.limits.length_ratio
    if ratio is None:
        return []
    least = 1.0 / ratio
    many = {name: line for name, line in view.response.lengths.items() if name in view.task.shaped}
    values = np.array([line.straightness - least for line in many.values()])
    slopes = np.array([line.by_straightness for line in many.values()])
    return [PendingRows("max_length_ratio", values, lambda: slopes, lambda: list(many))]


def slenderness(view: View) -> list[PendingRows]:
    """Length over the largest thickness of every beam."""
    ratio = view.task.limits.slenderness
    if ratio is None:
        return []
    many = view.response.lengths
    least = ratio * _thicknesses(view)
    values = np.array([line.length for line in many.values()]) / least - 1.0
    slopes = np.array([line.by_length for line in many.values()]) / least[:, None]
    return [PendingRows("min_slenderness", values, lambda: slopes, lambda: list(many))]


def _thicknesses(view: View) -> FloatArray:
    """Return the largest thickness of every beam (b,) [m]."""
    return np.array([thickest_of(beam.section) for beam in view.task.network.beams.values()])


def radius(view: View) -> list[PendingRows]:
    """Signed extremes of the curvature of the beams whose shape varies, before loading."""
    variables = view.response.variables
    least = variables.task.limits.radius
    if least is None or variables.order == 0:
        return []
    u = np.linspace(0, 1, 17)
    powers = np.arange(1, variables.order + 1) * u[:, None] ** np.arange(variables.order)
    rows = []
    for row, name in enumerate(variables.task.shaped):
        first = len(variables.task.coordinates) + variables.order * row
        lengths = view.response.lengths[name]
        turn = powers @ view.response.x[first : first + variables.order]
        for sign in (1.0, -1.0):
            value, _, weights = largest(u, sign * turn)
            slopes = least * value / lengths.length**2 * lengths.by_length
            slopes[first : first + variables.order] -= sign * least / lengths.length * (weights @ powers)
            values = np.atleast_1d(1.0 - least * value / lengths.length)
            rows.append(
                PendingRows("min_radius", values, lambda slopes=slopes: slopes, lambda name=name: [name])  # type: ignore[misc]
            )
    return rows


def clearance(view: View) -> list[PendingRows]:
    """Gap of every pair of beams, and of every beam with itself, before loading and under load."""
    return [] if view.task.limits.clearance is None else [separations(view, pairs(view.task.network))]


def force(view: View) -> list[PendingRows]:
    """Mean force over the window, against a least value and a target."""
    limits, weights = view.task.limits, view.poses.mean
    mean = float(weights @ view.response.force)
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
        return np.outer([factor for _, factor, _ in rows], weights @ view.response.force_slopes)

    values = np.array([value for value, _, _ in rows])
    return [PendingRows("force", values, slopes, lambda: [about for _, _, about in rows])]


LIMIT_FUNCTIONS: dict[str, Callable[[View], list[PendingRows]]] = {
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
BOUND_SHARPNESS = 25.0
"""Of the smooth bound on distances of 17 by 17 places: at most ln(289)/25, 23 % of those required, below the least."""
_N_PLACES = 16
_NO_WEIGHT = 1e-10  # of a pair of places in the smooth bound: its derivative is left out


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
    return [_make_pair(network, *names) for names in combinations_with_replacement(network.beams, 2)]


def _make_pair(network: Network, first: str, second: str) -> Pair:
    ends = [[network.master_of(end) for end in (network.beams[n].start, network.beams[n].end)] for n in (first, second)]
    joints = [(i, j) for i in (0, 1) for j in (0, 1) if ends[0][i] == ends[1][j]]
    return Pair((first, second), () if first == second else tuple(joints))


def separations(view: View, couples: list[Pair]) -> PendingRows:
    """Return (gap / required gap - 1) of all pairs at the poses that are shown, (pairs, q)."""
    shown, limits, opening = view.poses.shown, view.task.limits, view.task.limits.opening
    samples = view.response.samples
    thin = [_thin_out(beam) for beam in samples.values()]
    place, row = np.stack([beam.place for beam in thin]), np.stack([beam.index for beam in thin])
    x, y = (np.stack([view.response.column(axis)[shown][:, chosen] for chosen in row]) for axis in "xy")
    numbers = {name: k for k, name in enumerate(samples)}
    first, second = np.array([[numbers[name] for name in pair.beams] for pair in couples]).T
    ways = _Ways.from_beams(view, couples, place[first], place[second])
    half = 0.5 * _thicknesses(view)
    wanted = ((limits.clearance or 0.0) + half[first] + half[second])[:, None, None]
    is_near = opening * ways.length < wanted
    required = np.where(is_near, opening * ways.length, wanted)
    compared = _choose_pairs(couples, ways.length)
    dx, dy = (line[first][..., :, None] - line[second][..., None, :] for line in (x, y))
    distance = np.sqrt(dx * dx + dy * dy) + 1e-12
    ratio = np.where(compared[:, None], distance / np.where(compared, required, 1.0)[:, None], np.inf)
    soft, weights = soft_least(ratio.reshape(*ratio.shape[:2], -1), BOUND_SHARPNESS)

    def slopes() -> FloatArray:
        share = np.where((soft - 1.0 < view.slopes_below)[..., None] & (weights > _NO_WEIGHT), weights, 0.0)
        at = p, q, i, j = np.nonzero(share.reshape(ratio.shape))
        pull = share.reshape(ratio.shape)[at] / required[p, i, j]
        push = np.where(is_near[p, i, j], opening * pull * ratio[at], 0.0)
        by = -push[:, None] * ways.slopes_at(p, i, j)
        for axis, apart in (("x", dx), ("y", dy)):
            along = (apart[at] / distance[at] * pull)[:, None]
            line, second_slopes = (
                view.response.slopes_at(axis, shown[q], row[side[p], number])
                for side, number in ((first, i), (second, j))
            )
            by += along * (line - second_slopes)
        out = np.zeros((*soft.shape, len(view.response.x)))
        np.add.at(out, (p, q), by)
        return out

    def describe_places() -> list[str]:
        names = [" and ".join(dict.fromkeys(pair.beams)) for pair in couples]
        return [f"{both}, at {1e3 * at:.4g} mm" for both in names for at in view.poses.at[shown]]

    return PendingRows("clearance", soft - 1.0, slopes, describe_places)


def _thin_out(beam: BeamSamples) -> BeamSamples:
    """Return 17 samples, as even as they can be: a smooth bound must not depend on how fine the mesh is."""
    chosen = np.unique(np.linspace(0, len(beam.place) - 1, _N_PLACES + 1).round().astype(np.int64))
    return replace(beam, place=beam.place[chosen], index=beam.index[chosen])


def _choose_pairs(couples: list[Pair], distance: FloatArray) -> Any:
    """Return which places of pairs are compared: not a joint with itself, and no neighbours on one beam."""
    alone = np.array([pair.alone for pair in couples])[:, None, None]
    return np.where(alone, np.triu(np.ones(distance.shape[1:], dtype=bool), 2), distance > 1e-9)


@dataclass(frozen=True, eq=False)
class _Ways:
    """Ways between places of two beams of n pairs along them: length (n, r, r) [m], infinite where they do not meet."""

    length: FloatArray
    # of the beams of each pair, through each of the joints at which they may meet: (n, m, r)
    shares: tuple[FloatArray, FloatArray]
    joint: Any  # (n, r, r) through which of these joints the way is shortest
    apart: FloatArray  # (n, r, r) the way along a pair that is one beam, as a share of its length; NaN of two beams
    by_lengths: tuple[FloatArray, FloatArray]  # (n, k) derivatives of the lengths of both beams

    @classmethod
    def from_beams(cls, view: View, couples: list[Pair], u: FloatArray, v: FloatArray) -> _Ways:
        """Return the ways of pairs between places (n, r) of their first and second beams."""
        lengths = view.response.lengths
        first, second = ([lengths[pair.beams[side]] for pair in couples] for side in (0, 1))
        first_length, second_length = (
            np.array([line.length for line in lines])[:, None, None] for lines in (first, second)
        )
        count = max(1, *(len(pair.joints) for pair in couples))
        ends = np.array([[*pair.joints, *[(np.nan, np.nan)] * (count - len(pair.joints))] for pair in couples])
        p, q = abs(u[:, None] - ends[..., :1]), abs(v[:, None] - ends[..., 1:])
        through = np.nan_to_num(
            p[..., :, None] * first_length[..., None] + q[..., None, :] * second_length[..., None], nan=np.inf
        )
        joint = through.argmin(axis=1)
        length = np.take_along_axis(through, joint[:, None], axis=1)[:, 0]
        alone = np.array([pair.alone for pair in couples])[:, None, None]
        apart = np.where(alone, abs(u[:, :, None] - v[:, None, :]), np.nan)
        length = np.where(alone, apart * first_length, length)
        by_lengths = np.array([line.by_length for line in first]), np.array([line.by_length for line in second])
        return cls(length, (np.nan_to_num(p), np.nan_to_num(q)), joint, apart, by_lengths)

    def slopes_at(self, pair: Any, i: Any, j: Any) -> FloatArray:
        """Return the derivatives of the ways of some pairs at places (m,) of both beams, (m, k)."""
        joint = self.joint[pair, i, j]
        first, second = self.shares[0][pair, joint, i], self.shares[1][pair, joint, j]
        apart = self.apart[pair, i, j]
        first, second = np.where(np.isnan(apart), first, apart), np.where(np.isnan(apart), second, 0.0)
        return np.asarray(first[:, None] * self.by_lengths[0][pair] + second[:, None] * self.by_lengths[1][pair])
