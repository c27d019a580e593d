"""The distribution of a metric over made parts, with the limits of its requirements and the share that keeps them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.rounding import is_level
from cfmkit.plots.style import BAND, BLUE, INK, SMALL, TROUBLE, axes_mm, new_figure, styled
from cfmkit.plots.text import metric_label, metric_values

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray
    from cfmkit.metrics.limits import Limits
    from cfmkit.studies.sensitivity.findings import Findings

MOST_BINS = 40


@styled
def draw_histogram(found: Findings, number: int) -> Figure:
    """Return how one metric scatters over the parts that were drawn."""
    setup = found.setup
    metric = setup.study.metrics[number]
    drawn = found.outputs[:, 0, number] if found.outputs is not None else np.empty(0)
    known = metric_values(drawn[np.isfinite(drawn)], metric.dimension)
    figure = new_figure(140, 84)
    axes = axes_mm(figure, (18, 14, 116, 56))
    title = f"{setup.study.spec.name}: {metric.label.replace('_', ' ')}"
    figure.text(0.02, 0.98, title, va="top", weight="bold")
    figure.text(0.02, 0.91, _summary(drawn, known, setup.limits(metric)), va="top", size=SMALL, color=INK)
    if len(known):
        axes.hist(known, _edges(known).tolist(), color=BLUE, alpha=0.85)
    axes.set_ylim(0, 1.22 * max(1.0, axes.get_ylim()[1]))
    limits = [limit for one in setup.limits(metric) for limit in _ends(one)]
    nominal = float(metric_values(setup.nominal.values[number], metric.dimension))
    _frame(axes, [*known.tolist(), *limits, nominal])
    _limits(axes, setup.limits(metric))
    axes.axvline(nominal, color=INK, linewidth=1.0, linestyle="--")
    axes.annotate(
        "nominal",
        (nominal, 1.0),
        (2, -2),
        xycoords=axes.get_xaxis_transform(),
        textcoords="offset points",
        size=SMALL,
        va="top",
    )
    axes.set(xlabel=metric_label(metric.name, metric.dimension), ylabel="parts")
    return figure


def _edges(values: FloatArray) -> FloatArray:
    """Return the borders of the bins: as many as the square root of the number of parts, but not too many."""
    low, high = float(values.min()), float(values.max())
    if is_level(values):
        room = 0.01 * abs(low) or 0.5
        return np.array([low - room, low + room])
    return np.linspace(low, high, int(min(MOST_BINS, max(8, len(values) ** 0.5 + 1))) + 1)


def _ends(limits: Limits) -> list[float]:
    return [float(metric_values(end, limits.dimension)) for end in (limits.min, limits.max) if end is not None]


def _frame(axes: Axes, shown: list[float]) -> None:
    low, high = min(shown), max(shown)
    room = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    axes.set_xlim(low - room, high + room)


def _limits(axes: Axes, each: tuple[Limits, ...]) -> None:
    """Shade what is allowed and mark its ends."""
    low, high = axes.get_xlim()
    for limits in each:
        ends = [
            None if end is None else float(metric_values(end, limits.dimension)) for end in (limits.min, limits.max)
        ]
        inside = low if ends[0] is None else ends[0], high if ends[1] is None else ends[1]
        axes.axvspan(*inside, color=BAND, alpha=0.10, linewidth=0, zorder=0)
        for end, words, side in zip(ends, ("min", "max"), (3, -3), strict=True):
            if end is None:
                continue
            axes.axvline(end, color=TROUBLE, linewidth=1.2)
            axes.annotate(
                f"{words} {end:.6g}",
                (end, 0.88),
                (side, 0),
                xycoords=axes.get_xaxis_transform(),
                textcoords="offset points",
                ha="left" if side > 0 else "right",
                size=SMALL,
                color=TROUBLE,
            )


def _summary(drawn: FloatArray, known: FloatArray, limits: tuple[Limits, ...]) -> str:
    """Return number, mean, deviation and the share inside the limits, in one line."""
    missing = len(drawn) - len(known)
    told = [f"{len(drawn)} parts" + (f", {missing} without a result" if missing else "")]
    if len(known) > 1:
        told.append(f"mean {known.mean():.5g}, sd {known.std(ddof=1):.3g}")
        low, high = np.percentile(known, (2.5, 97.5))
        told.append(f"95 % in {low:.5g} ... {high:.5g}")
    if limits and len(known):
        inside = sum(all(one.met(value) for one in limits) for value in drawn[np.isfinite(drawn)].tolist())
        told.append(f"{100 * inside / len(drawn):.1f} % within limits")
    return ";  ".join(told)
