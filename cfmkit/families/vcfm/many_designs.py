"""Many mechanisms at once: V-beams and a diamond that is not pulled, by the analytic laws or the paper's.

The laws broadcast over designs and travels, so that a block is the same formulas on a (designs, points) array. What is
not asked is not computed: where all measures have a window, only the samples in it are. The curve is the one without
preload; what is warned of considers the largest preload, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.model.section import hindered_share
from cfmkit.families.base import BlockAnswer
from cfmkit.families.findings import TOO_SOFT
from cfmkit.families.vcfm.findings import EXACT_FORM, PRESSED, returns
from cfmkit.families.vcfm.leaf_laws_from_spec import RIM, share_of
from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Diamond, measured_stiffness_for
from cfmkit.families.vcfm.leaves.truss import TrussDiamond, TrussLeaf
from cfmkit.families.vcfm.leaves.v_beam import (
    FLAT_BUCKLED_ABOVE,
    LINEAR_ABOVE,
    NEGATIVE_ABOVE,
    RELIABLE,
    STEEP,
    THICK,
    VBeam,
    overrated,
)
from cfmkit.families.vcfm.solution import FLAT_PLACES, goes_beyond, is_constant, leaves_plane
from cfmkit.metrics.continuous_means_and_extremes import extremes as extremes_next_to
from cfmkit.metrics.longest_interval_in_band import extremes, flat_window
from cfmkit.metrics.spread import STATIC_BALANCE, ManyWindows, metric_of, metrics_of, static_balance
from cfmkit.results import ROUND_OFF
from cfmkit.specs.units import between

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Block, Measure
    from cfmkit.families.vcfm.spec import VcfmSpec

SLAB = 60_000
"""Samples that are worked on together: few enough to stay in a processor's cache."""

NEAR = 0.8
"""Share of a bound from which on the largest sample may hide one beyond it, between points."""

HALVED = 30
"""Times that the way to a rest position is halved: 1e-9 of the preload is left."""

_SIZES = ("length", "angle", "thickness", "width")
VARIED = {
    **{f"mechanism.positive.{name}": f"spring.{name}" for name in _SIZES},
    **{f"mechanism.bistable.{name}": f"leaf.{name}" for name in _SIZES},
    "mechanism.bistable.half_beams": "half_beams",
    "mechanism.material.youngs_modulus": "modulus",
}
"""What this model can vary, and what it is called here."""


def analyze_block(spec: VcfmSpec, block: Block) -> BlockAnswer | None:
    """Return what is requested about many variants of a mechanism; None where this model does not apply.

    Parameters
    ----------
    spec : VcfmSpec
        What is varied.
    block : Block
        The variants and the measures.
    """
    names = {measure.name for measure in block.measures}
    if spec.analysis.travel is None:
        return None
    block = block.in_places((0.0, spec.travel))
    if not _applies(spec, block) or not names <= set(SCALARS) | METRICS:
        return None
    values = [np.full(block.size, np.nan) for _ in block.measures]
    done = _sound(spec, block, names)
    warnings: dict[str, NDArray[np.bool_]] = {}
    for chosen in _slabs(np.flatnonzero(done), spec.analysis.points):
        slab = Slab.of(spec, {path: np.asarray(item)[chosen] for path, item in block.values.items()}, len(chosen))
        for measure, found in zip(block.measures, values, strict=True):
            found[chosen] = _measured(slab, measure)
            if measure.name in METRICS:
                done[chosen] &= slab.inside(measure.window).mean > slab.error
        for name, mask in warned(spec, slab).items():
            warnings.setdefault(name, np.zeros(block.size, dtype=bool))[chosen] = mask
    named = [{"load" if one.name in METRICS else "": found} for one, found in zip(block.measures, values, strict=True)]
    target = None if spec.design is None or spec.design.force is None else np.full(block.size, spec.design.force)
    return BlockAnswer(done, tuple(named), target, warnings=warnings)


def _applies(spec: VcfmSpec, block: Block) -> bool:
    mechanism, analysis = spec.mechanism, spec.analysis
    plain = (
        analysis.fidelity in ("truss", "analytic")
        and mechanism.kinds == ("diamond", "v-beam")
        and mechanism.bistable.flexure_length is None  # which bounds the length
        and analysis.preloads[0] == min(analysis.preloads) == 0
    )
    ends = [measure.window for measure in block.measures if measure.window and measure.name in METRICS]
    inside = all(low >= 0 and high <= spec.travel for low, high in ends)
    return plain and inside and set(block.values) <= set(VARIED)


def _sound(spec: VcfmSpec, block: Block, names: set[str]) -> NDArray[np.bool_]:
    """Return which variants are valid and of the kind whose asked values have closed forms."""
    done = np.ones(block.size, dtype=bool)
    for path, item in block.values.items():
        given = np.asarray(item, dtype=float)
        done &= (given >= 1) & (given <= 1000) if path.endswith("half_beams") else given > 0
        if path.endswith("angle"):
            done &= given <= np.radians(40)
    farthest = spec.travel + max(spec.analysis.preloads)
    done &= np.ravel(np.broadcast_to(_room(spec, block) >= farthest, (block.size, 1)))
    if names & {"negative_stiffness", "constant_force"} and spec.analysis.fidelity == "analytic":
        whole = Slab.of(spec, block.values, block.size)
        done &= np.ravel(whole.leaf.strip.slenderness > LINEAR_ABOVE)
    return done


def _room(spec: VcfmSpec, block: Block) -> FloatArray:
    """Return how far the spring of each variant can be compressed [m]."""
    strip = Slab.of(spec, block.values, block.size).spring.strip
    return np.asarray(2.0 * strip.rise + spec.mechanism.frame.corner - 2.0 * RIM * strip.thickness)


def _slabs(chosen: NDArray[np.intp], points: int) -> list[NDArray[np.intp]]:
    size = max(1, SLAB // points)
    return [chosen[start : start + size] for start in range(0, len(chosen), size)]


@dataclass(frozen=True)
class Slab:
    """Some designs over one grid of travels; every quantity is a column (k, 1) or an array (k, points).

    `stated` is the window of the analysis [m], if there is one, and `preload` the largest preload [m].
    """

    leaf: VBeam | TrussLeaf
    spring: Diamond | TrussDiamond
    half_beams: Any
    grid: FloatArray
    flatness: float
    target: float | None = None
    stated: tuple[float, float] | None = None
    preload: float = 0.0

    @classmethod
    def of(cls, spec: VcfmSpec, values: Mapping[str, Any], size: int) -> Slab:
        """Return the designs with these values."""
        mechanism, given = spec.mechanism, {VARIED[path]: np.asarray(item, float) for path, item in values.items()}

        def column(name: str, base: float) -> FloatArray:
            return np.broadcast_to(given.get(name, np.float64(base)), size)[:, None]

        modulus = column("modulus", mechanism.material.modulus)

        def strip(kind: str, part: Any) -> LeafStrip:
            sizes = {name: column(f"{kind}.{name}", getattr(part, name)) for name in _SIZES}
            return LeafStrip(**sizes, youngs_modulus=modulus, poisson_ratio=mechanism.material.poisson)

        side, leaf_strip = strip("spring", mechanism.flexures), strip("leaf", mechanism.bistable)
        share, points = share_of(mechanism.flexures), spec.analysis.points
        grid = spec.travel * (np.arange(points) / (points - 1.0))
        paper = spec.analysis.fidelity == "truss"
        leaf: Any = TrussLeaf(leaf_strip) if paper else VBeam(leaf_strip)
        spring: Any = TrussDiamond(side, share) if paper else Diamond(side, share)
        target = spec.design.force if spec.design else None
        leaves = column("half_beams", mechanism.bistable.half_beams)
        window = spec.analysis.window
        stated = None if window is None else between(window, (0.0, spec.travel))
        most = max(spec.analysis.preloads)
        return cls(leaf, spring, leaves, grid, spec.analysis.flatness, target, stated, most)

    def force_at(self, travel: FloatArray) -> FloatArray:
        """Return the forces at some travels, (k, n) [N]."""
        place = travel[None, :]
        return np.asarray(self.half_beams * self.leaf.force(place) + self.spring.force(place))

    @cached_property
    def force(self) -> FloatArray:
        """The forces at all travels [N]."""
        return self.force_at(self.grid)

    @cached_property
    def _windows(self) -> dict[Any, ManyWindows]:
        return {}

    def inside(self, window: tuple[float, float] | None) -> ManyWindows:
        """Return the forces inside a window."""
        if window not in self._windows:
            self._windows[window] = ManyWindows(*self._inside(window), self._extremes, self.error)
        return self._windows[window]

    @cached_property
    def error(self) -> FloatArray:
        """Rounding of the sums of leaves and spring, (k,) [N]: as `results.round_off` has it."""
        leaves, spring = self._parts(self.grid[None, :])
        return np.asarray(ROUND_OFF * (leaves + spring).max(axis=1))

    def _parts(self, travel: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the sizes of the forces of all leaves and of the spring at travels (k or 1, n), (k, n) each [N]."""
        shape = len(self.half_beams), travel.shape[1]
        leaves, spring = self.half_beams * self.leaf.force(travel), self.spring.force(travel)
        return np.broadcast_to(np.abs(leaves), shape), np.broadcast_to(np.abs(spring), shape)

    def static_balance(self, window: tuple[float, float] | None) -> FloatArray:
        """Return the largest force in a window over that of one leaf, or of the spring, (k,)."""
        many = self.inside(window)
        part, _ = extremes_next_to(self._largest_part, many.motion[None, :], self._largest_part(many.motion[None, :]))
        return np.asarray(static_balance(many.spread, part))

    def _largest_part(self, travel: FloatArray) -> FloatArray:
        """Return the largest force of one leaf, or of the spring, at travels of each design, (k, n) [N]."""
        leaves, spring = self._parts(travel)
        return np.asarray(np.maximum(leaves / self.half_beams, spring))

    def _extremes(self, travel: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the largest and smallest force: next to the samples, or where the leaves buckle and straighten."""
        ends = (np.broadcast_to(end, (len(force), 1)) for end in self.leaf.linear)
        knots = np.hstack([np.where(np.isfinite(end), end, travel[0]) for end in ends])
        there = self.exact(np.clip(knots, travel[0], travel[-1]))
        high, low = extremes_next_to(self.exact, travel[None, :], force)
        return np.maximum(high, there.max(axis=1)), np.minimum(low, there.min(axis=1))

    def _inside(self, window: tuple[float, float] | None) -> tuple[FloatArray, FloatArray]:
        """Return the samples in a window, its ends included, as the metrics of one curve take them: travel, force."""
        if window is None:
            return self.grid, self.force
        (low, high), grid = window, self.grid
        slack = 1e-9 * (high - low)
        start, stop = int(np.searchsorted(grid, low - slack)), int(np.searchsorted(grid, high + slack, side="right"))
        head, tail = grid[start] > low + slack, grid[stop - 1] < high - slack
        first, last = start - int(head), stop + int(tail)
        force = self.force_at(grid[first:last]) if "force" not in self.__dict__ else self.force[:, first:last]
        parts, places = [force[:, start - first : stop - first]], [grid[start:stop]]
        if head:
            parts.insert(0, self.force_at(np.array([low])))
            places.insert(0, np.array([low]))
        if tail:
            parts.append(self.force_at(np.array([high])))
            places.append(np.array([high]))
        return np.concatenate(places), np.hstack(parts)

    def exact(self, places: FloatArray) -> FloatArray:
        """Return the forces at places of each design, (k, m) [N]."""
        return np.asarray(self.half_beams * self.leaf.force(places) + self.spring.force(places))

    @cached_property
    def rest(self) -> FloatArray:
        """Where the shuttles rest at the largest preload, (k, 1) [m]: there its spring pulls the leaves hardest."""
        low, high = np.full((len(self.half_beams), 1), -self.preload), np.zeros((len(self.half_beams), 1))
        for _ in range(HALVED if self.preload else 0):
            middle = 0.5 * (low + high)
            force = self.half_beams * self.leaf.force(middle) + self.spring.force(middle + self.preload)
            low, high = np.where(force > 0, low, middle), np.where(force > 0, middle, high)
        return 0.5 * (low + high)

    @cached_property
    def stresses(self) -> tuple[FloatArray, FloatArray]:
        """Largest stresses of leaves and spring at the samples of all preloads, (k, 1) each [Pa]."""
        grid = self.grid[None, :]
        shuttle = np.maximum(_largest(self.leaf.stress(grid)), _largest(self.leaf.stress(self.rest)))
        return shuttle, _largest(self.spring.stress(np.hstack([grid, grid[:, -1:] + self.preload])))

    @cached_property
    def window(self) -> tuple[FloatArray, FloatArray]:
        """Start and end of each longest flat stretch [m]."""

        return flat_window(self.grid, self.force, self.flatness, self.exact)


def _measured(slab: Slab, measure: Measure) -> FloatArray:
    if measure.name in SCALARS:
        return np.ravel(np.broadcast_to(SCALARS[measure.name](slab), (len(slab.half_beams), 1)))
    if measure.name == STATIC_BALANCE:
        return slab.static_balance(measure.window)
    return metric_of(measure.name, slab.inside(measure.window), slab.target)


METRICS = metrics_of("force") | {STATIC_BALANCE}
"""Metrics of one branch inside its window."""


def _window_length(slab: Slab) -> FloatArray:
    start, end = slab.window
    return np.asarray(np.nan_to_num(end - start))[:, None]


@np.errstate(all="ignore")
def _constant_force(slab: Slab) -> FloatArray:
    """Return the force of the spring where the leaves are flat, (k, 1) [N]; NaN where the curve is not flat at it."""
    low, high = (end[:, None] for end in slab.window)
    places = low + (high - low) * np.linspace(0.0, 1.0, FLAT_PLACES)
    flat = np.trapezoid(slab.exact(places), places, axis=1).reshape(-1, 1) / (high - low)
    alone = np.broadcast_to(slab.spring.force(slab.leaf.strip.rise), flat.shape)
    constant = is_constant(alone, flat, slab.flatness, ((low, high), _window(slab)))
    return np.asarray(np.where(constant, alone, np.nan))


def _stroke(slab: Slab) -> Any:
    first, last = slab.leaf.linear
    return np.nan_to_num(last - first)


SCALARS: dict[str, Callable[[Slab], Any]] = {
    "positive_stiffness": lambda slab: slab.spring.stiffness,
    "negative_stiffness": lambda slab: slab.half_beams * slab.leaf.negative_stiffness,
    "first_stiffness": lambda slab: slab.half_beams * slab.leaf.first_stiffness,
    "rise": lambda slab: slab.leaf.strip.rise,
    "slenderness": lambda slab: slab.leaf.strip.slenderness,
    "linear_start": lambda slab: slab.leaf.linear[0],
    "linear_end": lambda slab: slab.leaf.linear[1],
    "linear_stroke": _stroke,
    "constant_force": _constant_force,
    "window_start": lambda slab: slab.window[0][:, None],
    "window_end": lambda slab: slab.window[1][:, None],
    "window_length": _window_length,
}


@np.errstate(all="ignore")
def warned(spec: VcfmSpec, slab: Slab) -> dict[str, NDArray[np.bool_]]:
    """Return the names of findings, each with which designs of a slab have it, (k,) of bool."""
    leaf, spring, about = slab.leaf.strip, slab.spring.strip, spec.mechanism.bistable
    size, paper, travel = len(slab.force), spec.analysis.fidelity == "truss", float(slab.grid[-1])
    q, rise = leaf.slenderness, leaf.rise
    top, bottom = _extremes(slab, *_window(slab))
    end = np.asarray(slab.leaf.linear[1])
    rises = slab.force[:, -1:] - _at(slab, np.broadcast_to(end, (size, 1)))
    found = {
        "truss_law": np.array(paper),
        "no_negative_stiffness": (q < NEGATIVE_ABOVE) & (not paper),
        "no_linear_region": (q >= NEGATIVE_ABOVE) & (q <= LINEAR_ABOVE) & (not paper),
        "not_flat": (top > 0) & ((top - bottom) / top > slab.flatness) & ~_window_is_flat(slab),
        "force_reversal": bottom <= 0,
        "bistable": _stays(slab),
        "overload": goes_beyond(travel, end) & (rises > slab.flatness * np.abs(slab.force[:, -1:])),
        "asymmetric_buckling": np.array(not about.guided),
        "out_of_plane_buckling": leaves_plane(leaf.width, leaf.thickness),
        "imperfection": np.array(about.waviness > 0),
        "theory_range": (
            (leaf.angle > STEEP)
            | (leaf.thickness > THICK * leaf.length)
            | goes_beyond(travel, RELIABLE * rise)
            | (spring.angle > STEEP)
            | ((travel + slab.preload) / (2.0 * spring.length) > PRESSED)
        )
        & (not paper),
        "wide_beam": _too_wide(slab) & (not paper),
        "overstressed": _overstressed(spec, slab),
        "measured_contradiction": np.array(False),
    }
    if (reported := spec.analysis.measured) is not None:
        apart = np.abs(reported.positive_stiffness / measured_stiffness_for(reported.force, rise) - 1.0)
        found["measured_contradiction"] = (q >= FLAT_BUCKLED_ABOVE) & (apart > slab.flatness)
    return {name: np.ravel(np.broadcast_to(mask, (size, 1))) for name, mask in found.items()}


def _stays(slab: Slab) -> NDArray[np.bool_]:
    """Return which mechanisms stay where they snap to, (k, 1): as `Solution.least` has them."""
    grid, rows = slab.grid, np.arange(len(slab.force))

    def alone(place: FloatArray) -> FloatArray:
        return np.asarray(slab.half_beams * slab.leaf.force(place))

    def pulled(place: FloatArray) -> FloatArray:
        return -np.asarray(alone(place) + slab.spring.force(place))

    falls = np.diff(alone(grid[None, :])) < 0
    start, end, step = np.zeros(len(rows)), np.full(len(rows), grid[-1]), float(grid[-1] - grid[-2])
    peak = extremes(alone, grid[falls.argmax(axis=1)], step, (start, end))
    lowest = np.where(grid >= peak[:, None], slab.force, np.inf).argmin(axis=1)
    place = extremes(pulled, np.maximum(grid[lowest], peak), step, (peak, end))
    least = -pulled(place[:, None])
    back = returns(least, np.abs(slab.force).max(axis=1, keepdims=True))
    return np.asarray(falls.any(axis=1, keepdims=True) & ~back)


def _too_wide(slab: Slab) -> NDArray[np.bool_]:
    """Return of which designs leaves or spring are too wide for beams, (k, 1): as the finding `wide_beam` has it."""
    found = np.zeros((len(slab.force), 1), dtype=bool)
    for part, stress in zip((slab.leaf, slab.spring), slab.stresses, strict=True):
        strip = part.strip
        curvature = 2.0 * stress / (strip.youngs_modulus * strip.thickness)
        found = found | (hindered_share(strip.width, strip.thickness, strip.poisson_ratio, curvature) > TOO_SOFT)
    return found


def _largest(stress: Any) -> FloatArray:
    return np.asarray(np.asarray(stress).max(axis=1, keepdims=True))


def _overstressed(spec: VcfmSpec, slab: Slab) -> NDArray[np.bool_]:
    allowed = spec.mechanism.allowable_stress
    if allowed is None:
        return np.array(False)
    leaves, spring = slab.stresses
    slack = np.maximum(overrated(slab.leaf.strip.angle), EXACT_FORM) if isinstance(slab.leaf, VBeam) else EXACT_FORM
    bound = allowed * (1 + slack)
    if ((leaves > NEAR * bound) & (leaves <= bound)).any():
        grid = slab.grid[None, :]
        top, _ = extremes_next_to(slab.leaf.stress, grid, np.asarray(slab.leaf.stress(grid)), uneven=True)
        leaves = np.maximum(leaves, top[:, None])
    return np.asarray((leaves > bound) | (spring > allowed * (1 + EXACT_FORM)))


def _window(slab: Slab) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the windows in which forces are compared, (k, 1) [m]: as `Solution.window` has them."""
    size, travel = len(slab.force), float(slab.grid[-1])
    if slab.stated is not None:
        low, high = (np.full((size, 1), end) for end in slab.stated)
        return low, high
    first, last = (np.broadcast_to(end, (size, 1)) for end in slab.leaf.linear)
    start, stop = (end[:, None] for end in slab.window)
    straight, flat = _straight(slab), np.isfinite(start)
    low = np.where(straight, first, np.where(flat, start, 0.0))
    return low, np.where(straight, np.minimum(last, travel), np.where(flat, stop, travel))


def _straight(slab: Slab) -> NDArray[np.bool_]:
    """Return which leaves buckle within the travel, (k, 1): as `Solution.is_linear` has them."""
    first = np.broadcast_to(slab.leaf.linear[0], (len(slab.force), 1))
    return np.asarray(np.isfinite(first) & (first < float(slab.grid[-1])))


def _window_is_flat(slab: Slab) -> NDArray[np.bool_]:
    """Return of which designs the window is the longest flat stretch itself, (k, 1)."""
    return ~_straight(slab) & np.isfinite(slab.window[0][:, None]) & (slab.stated is None)


def _extremes(slab: Slab, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest and smallest force at the samples in windows and at their ends, (k, 1) [N]."""
    inside = (slab.grid > low) & (slab.grid < high)
    ends = np.hstack([_at(slab, low), _at(slab, high)])
    force = np.hstack([np.where(inside, slab.force, np.nan), ends])
    known = np.isfinite(force)
    top, bottom = np.where(known, force, -np.inf), np.where(known, force, np.inf)
    return top.max(axis=1, keepdims=True), bottom.min(axis=1, keepdims=True)


def _at(slab: Slab, place: FloatArray) -> FloatArray:
    """Return the forces at one place of each design, (k, 1) [N]; NaN beyond the travel."""
    reached = (place >= slab.grid[0]) & (place <= slab.grid[-1])
    return np.asarray(np.where(reached, slab.exact(np.where(reached, place, slab.grid[0])), np.nan))
