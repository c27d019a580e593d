"""Values of a recording: coverage of a window and holes in it, the area of the loop, repeatability of cycles.

A recording's samples stand where machine and clock put them. A mean over them is a mean over the displacement only if
each counts for the way that it stands for. Where the way to the next sample is far longer than is usual there, nothing
is known of what the force did: a hole. What holds over a window with a large hole in it cannot be told.

Definitions stand beside the metrics of any curve, as name -> (dimension, definition): ``{}`` stands for what was
measured, and "effort" for its dimension: force or torque.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import QuantityError, UsageError
from cfmkit.metrics.branches import span_text
from cfmkit.metrics.metric_definitions import split_name
from cfmkit.numerics.holes_in_samples import HOLE_STEP_RATIO, MAX_HOLE_SHARE, holes_between
from cfmkit.results import Finding, Quantity
from cfmkit.specs.units import read_quantity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve, Kind
    from cfmkit.metrics import Window


_OVER_WINDOW = "over the measured travel in the window"
RECORDED_VALUES = {
    "coverage": (
        "ratio",
        f"part of the window that was recorded, from steps of more than {HOLE_STEP_RATIO:g} usual ones; of "
        f"several cycles the "
        "least",
    ),
    "repeatability": (
        "effort",
        "sqrt(mean over the window of the variance (n - 1) of the {} between cycles at the same place)",
    ),
    "data_rmse": ("effort", f"root mean square of (model - measured) {{}}, {_OVER_WINDOW}"),
    "data_error_max": ("effort", "(model - measured) {} where it is largest in magnitude, in the window"),
    "data_offset": ("effort", f"mean of (model - measured) {{}}, {_OVER_WINDOW}"),
    "data_loss": ("energy", "area between the measured branches over the window"),
    "data_loss_factor": (
        "ratio",
        "data_loss over 2 pi times the area under the mean of the branches over the window, which is the energy stored",
    ),
    "data_half_gap": ("effort", "half the mean difference of the measured {} on the way up and back"),
}


def define_recorded_values(kind: str) -> dict[str, tuple[str, str]]:
    """Return name, dimension and definition of each of them, of a force or of a torque.

    Examples
    --------
    >>> define_recorded_values("torque")["torque_repeatability"][0]
    'torque'
    """
    return {
        f"{kind}_repeatability" if name == "repeatability" else name: (
            kind if dimension == "effort" else dimension,
            definition.format(kind),
        )
        for name, (dimension, definition) in RECORDED_VALUES.items()
    }


@dataclass(frozen=True)
class UnrecordedInterval:
    """A part of the travel without samples [m or rad]."""

    low: float
    high: float
    branch: str = ""
    cycle: int | None = None  # None if there is one only

    @property
    def width(self) -> float:
        """Its length [m or rad]."""
        return self.high - self.low

    def text(self, kind: Kind) -> str:
        """Return where it is, for messages: ``9 ... 18 mm on 'load'``."""
        cycle = "" if self.cycle is None else f" of cycle {self.cycle}"
        return span_text(self.low, self.high, kind) + (f" on {self.branch!r}{cycle}" if self.branch else "")


def holes_of(curves: Sequence[Curve], window: Window) -> tuple[UnrecordedInterval, ...]:
    """Return the holes of all branches of all cycles in a window, in their order."""
    holes = []
    for curve in curves:
        cycle = number_of(curve)
        for branch in curve.branches:
            places = np.sort(curve.select_branch(branch).motion)
            holes += [
                UnrecordedInterval(low, high, branch, cycle)
                for low, high in holes_between(places, window.lo, window.hi)
            ]
    return tuple(holes)


def share_covered(holes: Sequence[UnrecordedInterval], window: Window) -> float:
    """Return the recorded share of a window on one branch of one cycle."""
    return 1.0 - sum(hole.width for hole in holes) / (window.hi - window.lo)


def number_of(curve: Curve) -> int | None:
    """Return the number of a curve's cycle; None if there is one only."""
    return int(curve.label["cycle"][0]) if "cycle" in curve.label else None


def select_cycle(holes: Sequence[UnrecordedInterval], curve: Curve) -> list[UnrecordedInterval]:
    """Return the holes of the cycle that a curve belongs to."""
    return [hole for hole in holes if hole.cycle in (None, number_of(curve))]


NOT_RECORDED_TEXT = "not recorded"  # begins the reason why a metric over a hole has no value


def large_holes(
    holes: Sequence[UnrecordedInterval], window: Window, largest: float = MAX_HOLE_SHARE
) -> tuple[UnrecordedInterval, ...]:
    """Return the holes that are larger than a part of a window."""
    return tuple(hole for hole in holes if hole.width > largest * (window.hi - window.lo))


def hole_finding(large: Sequence[UnrecordedInterval], window: Window, kind: Kind, cure: str = "") -> Finding:
    """Return the finding on large holes in a window."""
    spans: dict[str, list[UnrecordedInterval]] = {}
    for hole in large:
        spans.setdefault(span_text(hole.low, hole.high, kind), []).append(hole)
    named = [span + _common_branch_and_cycle(holes) for span, holes in spans.items()]
    listed = ", ".join(named[:4]) + (f" and {len(named) - 4} more" if len(named) > 4 else "")
    share = max(hole.width for hole in large) / (window.hi - window.lo)
    reported = (
        f"{NOT_RECORDED_TEXT}: {listed} (up to {100 * share:.0f} % of the window): numbers over the window "
        f"{span_text(window.lo, window.hi, kind)} cannot be known there and have no value{cure}"
    )
    return Finding("holes", reported)


def _common_branch_and_cycle(holes: Sequence[UnrecordedInterval]) -> str:
    """Return on which branch and in which cycle holes at one place are; nothing where it is not one."""
    branches, cycles = {hole.branch for hole in holes}, {hole.cycle for hole in holes}
    branch = f" on {holes[0].branch!r}" if len(branches) == 1 else ""
    return branch + (f" of cycle {holes[0].cycle}" if len(cycles) == 1 and holes[0].cycle is not None else "")


def empty_uncovered(
    metrics: Mapping[str, Quantity], large: Sequence[UnrecordedInterval], kind: Kind
) -> dict[str, Quantity]:
    """Return metrics, without a value for branches with a large hole and for what needs all branches."""
    branches = {hole.branch: hole for hole in reversed(large)}
    covered = dict(metrics)
    for name, item in metrics.items():
        branch = split_name(name)[1]
        hole = branches.get(branch) if branch is not None else next(iter(large), None)
        if hole is not None and item.value is not None:
            covered[name] = replace(item, value=None, reason=f"{NOT_RECORDED_TEXT}: {hole.text(kind)}")
    return covered


def coverage(curve: Curve, holes: Sequence[UnrecordedInterval], window: Window) -> dict[str, Quantity]:
    """Return which part of the window each branch of a curve covers, and the least of them."""
    shares = {name: share_covered([hole for hole in holes if hole.branch == name], window) for name in curve.branches}
    named = {f"coverage[{name}]": share for name, share in shares.items()} if len(shares) > 1 else {}
    shares_by_name = {"coverage": min(shares.values()), **named}
    return {name: Quantity(value, *RECORDED_VALUES["coverage"]) for name, value in shares_by_name.items()}


def least(metrics_of_cycles: Sequence[Mapping[str, Quantity]]) -> dict[str, Quantity]:
    """Return the least value of each quantity."""
    return {
        name: min((item[name] for item in metrics_of_cycles), key=lambda quantity: quantity.value or 0.0)
        for name in metrics_of_cycles[0]
    }


def read_largest_hole(text: str | float | None) -> float:
    """Return which part of a window a hole may take, from text such as ``5 %``; by default `MAX_HOLE_SHARE`.

    Raises UsageError if it is no share.
    """
    if text is None:
        return MAX_HOLE_SHARE
    try:
        share = read_quantity(text, "ratio") if isinstance(text, str) else float(text)
    except QuantityError as error:
        raise UsageError(f"--max-hole: {error}") from None
    if not 0 < share <= 1:
        raise UsageError(f"--max-hole: {text} is not allowed: must be above 0 and at most 100 %")
    return share


N_CYCLE_PLACES = 513  # places in the window at which cycles are compared
REVERSED_LOOP_SHARE = 1e-3
"""A loop runs the wrong way round if its area is negative by more than this part of mean force times travel."""


def branch_at(
    curve: Curve,  # whose branch never turns back
    branch: str,  # its name
    places: FloatArray,  # (n,): motion [m or rad], inside what the branch covers
) -> FloatArray:
    """Return the effort of one branch at some places, by linear interpolation."""
    part = curve.select_branch(branch)
    step = 1 if part.motion[-1] >= part.motion[0] else -1
    values: FloatArray = np.interp(places, part.motion[::step], part.effort[::step])
    return values


def loop_area(
    motion: FloatArray,  # (n,): increasing [m or rad]
    # up, down: (n,): effort on each branch there [N or N m]
    up: FloatArray,
    down: FloatArray,
) -> float:
    """Return the area between the branches: the integral of (up - down) over the motion [J].

    Examples
    --------
    >>> loop_area(np.array([0.0, 0.1]), np.array([2.0, 2.0]), np.array([1.0, 1.0]))
    0.1
    """
    return float(np.trapezoid(up - down, motion))


def turned_loop(
    curves: Sequence[Curve],  # one a cycle; a cycle without a way back says nothing
) -> bool:
    """Return whether the loops, summed, run the wrong way round by `REVERSED_LOOP_SHARE` of mean force times travel."""
    areas, sizes = [], []
    for curve in curves:
        if len(curve.branches) < 2:
            continue
        up, down = curve.select_branch("load").motion, curve.select_branch("unload").motion
        low, high = max(up.min(), down.min()), min(up.max(), down.max())
        if low < high:
            places = np.linspace(low, high, N_CYCLE_PLACES)
            areas.append(loop_area(places, branch_at(curve, "load", places), branch_at(curve, "unload", places)))
            sizes.append(float(np.abs(curve.effort).mean() * (high - low)))
    return sum(areas) < -REVERSED_LOOP_SHARE * sum(sizes)


def repeatability(curves: Sequence[Curve], window: Window) -> dict[str, Quantity]:
    """Return how far cycles differ: on each branch the root mean square over the window of the SD between cycles.

    Parameters
    ----------
    curves : sequence of Curve
        One a cycle.
    window : Window
        That all of them cover.

    Returns
    -------
    dict of str to Quantity
        ``force_repeatability[load]`` and so on; without a value where there is one cycle only.
    """
    kind = curves[0].kind
    meant = define_recorded_values(kind)[f"{kind}_repeatability"]
    places = np.linspace(window.lo, window.hi, N_CYCLE_PLACES)
    quantities = {}
    for branch in curves[0].branches:
        name = f"{kind}_repeatability[{branch}]"
        if len(curves) < 2:
            quantities[name] = Quantity(None, *meant, "there is one cycle only")
            continue
        forces = np.array([branch_at(curve, branch, places) for curve in curves])
        quantities[name] = Quantity(float(np.sqrt(forces.var(axis=0, ddof=1).mean())), *meant)
    return quantities
