"""A model beside a measurement: errors by branch over the window where both exist, and losses of the measured loop."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.errors import DataError
from cfmkit.experiment.branches import LOAD_BRANCH, UNLOAD_BRANCH
from cfmkit.experiment.curves_and_metrics_of_recording import elapsed_fraction
from cfmkit.experiment.recorded_values import (
    RECORDED_VALUES,
    define_recorded_values,
    empty_uncovered,
    holes_of,
    large_holes,
    loop_area,
)
from cfmkit.families import family
from cfmkit.families.base import MeasuredLoop
from cfmkit.metrics import Undefined, Window, window_of
from cfmkit.metrics.branches import span_text
from cfmkit.metrics.compare import ComparedSide, Points, counterpart, effort_at, largest, mean, overlap, rms
from cfmkit.metrics.compare import compare as compare_sides
from cfmkit.numerics.holes_in_samples import holes_between, sample_weights
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.experiment.recorded_values import UnrecordedInterval
    from cfmkit.metrics.compare import Measure
    from cfmkit.results import Result

N_COMPARED_PLACES = 257  # places of a window at which the branches of a loop are laid beside each other
MAX_BRANCH_POINTS = 2000  # points of a branch that are compared; more are averaged in groups


@dataclass(frozen=True)
class Samples:
    """Measured points of one branch, all cycles, inside the window."""

    branch: str  # name in the measurement
    model_branch: str  # name in the model
    # motion, effort, (n,): as measured [m, N] or [rad, N m]
    motion: FloatArray
    effort: FloatArray
    elapsed: FloatArray  # (n,) which part of the recording had passed, 0 to 1
    weight: FloatArray  # (n,) the way that each stands for, over that of all on average
    cycle: NDArray[np.intp]  # (n,) which cycle each is of, counted from 0

    def correct_zeros(self, zeros: Zeros) -> Samples:
        """Return the samples with the errors of the zeros taken out."""
        motion, effort = self.motion - zeros.motion, self.effort - zeros.effort - zeros.drift * self.elapsed
        return replace(self, motion=motion, effort=effort)

    def errors(self, curve: Curve) -> FloatArray:
        """Return model less measurement at every point; NaN where the model has no value."""
        return model_at(curve, self.model_branch, self.motion) - self.effort


@dataclass(frozen=True)
class Zeros:
    """Readings of the sensors where they should read zero."""

    # effort, motion: without load, and at the mechanism's zero [N, m] or [N m, rad]
    effort: float = 0.0
    motion: float = 0.0
    drift: float = 0.0  # by how much more without load at the end of the recording [N or N m]


@dataclass(frozen=True, repr=False)
class Comparison(ShortRepr):
    """A model and a measurement, over a common window."""

    samples: tuple[Samples, ...]  # one a branch
    window: Window  # where they are compared
    curve: Curve  # of the model
    # those of the recording in the window that are too large for numbers over it
    holes: tuple[UnrecordedInterval, ...] = ()
    branches: tuple[Samples, ...] = ()  # the branches as measured, where the samples are their mean; else empty

    @property
    def loop(self) -> MeasuredLoop | None:
        """Both measured branches at even places of the window; None if one way only was measured."""
        by_branch = {item.branch: item for item in self.branches or self.samples}
        if set(by_branch) != {LOAD_BRANCH, UNLOAD_BRANCH}:
            return None
        places = np.linspace(self.window.lo, self.window.hi, N_COMPARED_PLACES)
        up, down = (_average_effort(by_branch[branch], places) for branch in (LOAD_BRANCH, UNLOAD_BRANCH))
        return MeasuredLoop(places, up, down)

    def causes(self, result: Result) -> Mapping[str, Quantity]:
        """Return what the loop says about the causes of its departure from the model, where the family can tell."""
        attribute = family(result.spec.family).attribution
        loop = self.loop
        if attribute is None or loop is None:
            return {}
        return empty_uncovered(attribute(result, loop), self.holes, self.curve.kind)

    def metrics(self) -> dict[str, Quantity]:
        """Return root mean square, largest and mean error per branch, and over all, by name, SI."""
        points = {
            item.branch: Points(item.motion, item.effort, item.model_branch, item.weight) for item in self.samples
        }
        differences = compare_sides(
            ComparedSide("measured", points=points), ComparedSide("model", self.curve), self.window
        )
        return empty_uncovered(differences.summarize(_ERROR_METRICS, self.curve.kind), self.holes, self.curve.kind)

    def loss(self) -> dict[str, Quantity]:
        """Return what a cycle loses, its loss factor, and half the gap of the branches; nothing without a loop."""
        loop = self.loop
        if loop is None:
            return {}
        area = loop_area(loop.places, loop.up, loop.down)
        kind, width = self.curve.kind, self.window.hi - self.window.lo
        meant = define_recorded_values(kind)
        stored = float(np.trapezoid(0.5 * (loop.up + loop.down), loop.places))
        factor = area / (2.0 * np.pi * stored) if stored > 0.0 else None
        quantities = {
            "data_loss": Quantity(area, *meant["data_loss"]),
            "data_loss_factor": Quantity(factor, *meant["data_loss_factor"], "" if factor else "no energy is stored"),
            "data_half_gap": Quantity(0.5 * area / width, *meant["data_half_gap"]),
        }
        return empty_uncovered(quantities, self.holes, kind)

    def compare_mean(self) -> Comparison:
        """Return the comparison of a model without losses: with the mean of the branches, cycle by cycle."""
        up, down = (next(item for item in self.samples if item.branch == name) for name in (LOAD_BRANCH, UNLOAD_BRANCH))
        parts = [_mean_of_branches(up, down, cycle) for cycle in sorted(set(up.cycle) & set(down.cycle))]
        motion, effort, passed = (
            np.concatenate(columns) for columns in zip(*(part[:3] for part in parts), strict=True)
        )
        cycles = np.repeat([cycle for *_, cycle in parts], [len(part[0]) for part in parts])
        mean = Samples(MEAN_BRANCH, up.model_branch, motion, effort, passed, np.ones(len(motion)), cycles)
        return replace(self, samples=(mean,), branches=self.samples)


MEAN_BRANCH = "mean"  # name of the samples that are the mean of both branches


def _mean_of_branches(up: Samples, down: Samples, cycle: int) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return places, mean effort and time of the branches of one cycle, where both were recorded."""
    first, second = ({name: getattr(item, name)[item.cycle == cycle] for name in ("motion", "effort", "elapsed")}
                  for item in (up, down))  # fmt: skip
    first, second = (
        {name: values[np.argsort(part["motion"])] for name, values in part.items()} for part in (first, second)
    )
    low, high = (extreme(part["motion"][end] for part in (first, second)) for extreme, end in ((max, 0), (min, -1)))
    places = np.linspace(low, high, min(len(first["motion"]), len(second["motion"])))
    is_known = np.ones(len(places), dtype=bool)
    for part in (first, second):
        for start, stop in holes_between(part["motion"], low, high):
            is_known &= (places <= start) | (places >= stop)
    places = places[is_known]
    effort, passed = (
        0.5 * sum(np.interp(places, part["motion"], part[name]) for part in (first, second))
        for name in ("effort", "elapsed")
    )
    return places, effort, passed, cycle


_ERROR_METRICS: dict[str, Measure] = {
    "data_rmse": (rms, RECORDED_VALUES["data_rmse"][1]),
    "data_error_max": (largest, RECORDED_VALUES["data_error_max"][1]),
    "data_offset": (mean, RECORDED_VALUES["data_offset"][1]),
}
"""What is reported of the errors: name -> (function, definition)."""


def compare(
    result: Result,  # with a curve
    source: MeasuredCurves,  # what was measured; its raw points are compared
    window: Window | None = None,  # default: ``analysis.window``; in any case only where both exist on every branch
) -> Comparison:
    """Return a model beside a measurement.

    Raises DataError if they are of different kinds, or have no travel in common.
    """
    curve, name = result.curve, source.recording.name
    if curve.kind != source.recording.kind:
        raise DataError(f"{name}: holds a {source.recording.kind} curve, but the mechanism has a {curve.kind} curve")
    pairs = {branch: model_branch(curve, branch) for branch in source.raw[0].branches}
    window = _common_window_with_model(curve, source, window or window_of(result), set(pairs.values()))
    samples = tuple(_samples_of_branch(source, branch, mine, window) for branch, mine in pairs.items())
    for item in samples:
        model_at(curve, item.model_branch, item.motion)  # a branch that turns back is refused at once
    if not all(len(item.motion) >= 2 for item in samples):
        raise DataError(f"{name}: has fewer than 2 points in {span_text(window.lo, window.hi, curve.kind)} on a branch")
    size = float(np.concatenate([item.weight for item in samples]).mean())
    samples = tuple(replace(item, weight=item.weight / size) for item in samples)
    return Comparison(samples, window, curve, large_holes(holes_of(source.raw, window), window))


def model_branch(curve: Curve, measured: str) -> str:
    """Return the branch of a model that a measured one is compared with: by name, else by its direction."""
    return counterpart(curve, measured, 1.0 if measured == LOAD_BRANCH else -1.0)


def model_at(curve: Curve, branch: str, motion: FloatArray) -> FloatArray:
    """Return the effort of a model's branch at some places, linearly between its points.

    Raises DataError if the branch turns back: it is many-valued, and a measurement does not say which value is meant.
    """
    try:
        return effort_at(curve, branch, motion)
    except Undefined:
        raise DataError(
            f"branch {branch!r} of the model turns back: it cannot be compared with a measurement"
        ) from None


def _average_effort(samples: Samples, places: FloatArray) -> FloatArray:
    """Return the effort at even places: the mean of the samples around each, interpolated where there are none."""
    step = places[1] - places[0]
    index = np.clip(np.rint((samples.motion - places[0]) / step).astype(int), 0, len(places) - 1)
    count = np.bincount(index, minlength=len(places))
    seen = count > 0
    motion, effort = (
        np.bincount(index, values, len(places))[seen] / count[seen] for values in (samples.motion, samples.effort)
    )
    averaged: FloatArray = np.interp(places, motion, effort)
    return averaged


def _common_window_with_model(
    curve: Curve, source: MeasuredCurves, wanted: Window | None, branches: set[str]
) -> Window:
    """Return where every branch of model and measurement exists, inside the window that is wanted."""
    from cfmkit.experiment.curves_and_metrics_of_recording import common_window

    measured, kind = common_window(source.raw), curve.kind
    ends = [(float(part.motion.min()), float(part.motion.max())) for part in map(curve.select_branch, branches)]
    common = overlap([*ends, (measured.lo, measured.hi)], wanted)
    if common is None:
        reported = span_text(measured.lo, measured.hi, kind)
        where = f", window {span_text(wanted.lo, wanted.hi, kind)}" if wanted else ""
        model = span_text(float(curve.motion.min()), float(curve.motion.max()), kind)
        raise DataError(
            f"{source.recording.name}: measurement ({reported}) and model ({model}{where}) have no travel in common; "
            "is the zero of the displacement the same?"
        )
    return common


def _samples_of_branch(source: MeasuredCurves, branch: str, mine: str, window: Window) -> Samples:
    parts = [curve.select_branch(branch) for curve in source.raw]
    slack = 1e-9 * (window.hi - window.lo)
    keep = [(part.motion >= window.lo - slack) & (part.motion <= window.hi + slack) for part in parts]
    times = np.split(elapsed_fraction(source, branch), np.cumsum([len(inside) for inside in keep])[:-1])
    size = max(-(-sum(int(inside.sum()) for inside in keep) // MAX_BRANCH_POINTS), 1)
    # Cycle by cycle: the end of one and the start of the next have nothing to do with each other.
    grouped = []
    for number, (part, inside, passed) in enumerate(zip(parts, keep, times, strict=True)):
        step = 1 if part.motion[-1] >= part.motion[0] else -1
        stands_for = sample_weights(part.motion[inside][::step])[::step]
        motion = np.clip(part.motion[inside], window.lo, window.hi)
        columns = _average_groups((motion, part.effort[inside], passed[inside], stands_for), size)
        grouped.append((*columns, np.full(len(columns[0]), number)))
    motion, effort, passed, stands_for, cycle = (np.concatenate(columns) for columns in zip(*grouped, strict=True))
    return Samples(branch, mine, motion, effort, passed, stands_for, cycle)


def _average_groups(columns: Sequence[FloatArray], size: int) -> Sequence[FloatArray]:
    """Return averages over groups of `size` neighbours."""
    count = len(columns[0])
    if size == 1 or not count:
        return columns
    edges = np.arange(0, count, size)
    lengths = np.diff(np.append(edges, count))
    return [np.add.reduceat(values, edges) / lengths for values in columns]
