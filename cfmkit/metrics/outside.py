"""Windows that a curve does not cover: nothing is measured over them, and the user must hear of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from cfmkit.metrics.evaluation import left_of, travel_of, window_of
from cfmkit.metrics.subjects import span_text
from cfmkit.metrics.traces import covers, traces
from cfmkit.results import WINDOW_OUTSIDE, Finding, Status

if TYPE_CHECKING:
    from cfmkit.curves import Kind
    from cfmkit.metrics.traces import Window
    from cfmkit.results import Result


@dataclass(frozen=True)
class Gap:
    """A window that some branch of the nominal curve does not cover.

    Attributes
    ----------
    window : Window
        In places.
    paths : tuple of str
        Where the specification states it.
    common : tuple of (float, float)
        What all branches cover [m or rad].
    kind : {"force", "torque"}
        Of the curve.
    """

    window: Window
    paths: tuple[str, ...]
    common: tuple[float, float]
    kind: Kind

    @property
    def short(self) -> str:
        """Why there is no value, for the row of a table."""
        wanted, there = span_text(self.window.lo, self.window.hi, self.kind), span_text(*self.common, self.kind)
        return f"no value over {wanted} ({', '.join(self.paths)}): the curve covers {there} only"


def gaps(result: Result) -> tuple[Gap, ...]:
    """Return each window of the specification that some branch of the nominal curve does not cover."""
    if not result.curves or not len(result.curves[0]):
        return ()
    extents = [trace.extent for trace in traces(result.curves[0])]
    paths: dict[Window, list[str]] = {}
    for path, ends in result.spec.windows():
        window = window_of(result, ends)
        if window is not None and not all(covers(extent, window) for extent in extents):
            paths.setdefault(window, []).append(".".join(map(str, path)))
    common = max(low for low, _ in extents), min(high for _, high in extents)
    return tuple(Gap(window, tuple(where), common, result.curves[0].kind) for window, where in paths.items())


def windows_judged(result: Result) -> Result:
    """Return a result that warns of each window that some branch of its nominal curve does not cover."""
    found = tuple(Finding(WINDOW_OUTSIDE, _told(gap, result)) for gap in gaps(result))
    return replace(result, warnings=(*result.warnings, *found)) if found else result


def _told(gap: Gap, result: Result) -> str:
    (low, high), window, kind = gap.common, gap.window, gap.kind
    text = f"{' and '.join(gap.paths)}: the window {span_text(window.lo, window.hi, kind)} is not within the curve, "
    text += span_text(low, high, kind)
    travel = travel_of(result)
    if result.status is Status.PARTIAL and travel is not None and min(travel) <= window.lo and window.hi <= max(travel):
        text += f", which ends before the travel requested does ({span_text(min(travel), max(travel), kind)})"
    if (left := left_of(window, result)) != window and left is not None:
        return f"{text}: metrics are those over {span_text(left.lo, left.hi, kind)}, a requirement over it is missed"
    return (
        f"{text}; what is measured over it has no value. Choose a window inside, or shares of the travel, which "
        "follow it: [1 %, 100 %]"
    )
