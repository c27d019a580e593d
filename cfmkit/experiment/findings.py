"""Findings about a recording, and their sentences: cycles, signs, spikes, passages at reversals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.experiment.branches import COMPLETE_STROKE_SHARE, covered_fraction
from cfmkit.metrics.branches import span_text
from cfmkit.results import Finding
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cfmkit.experiment.branches import Stroke, Strokes
    from cfmkit.experiment.reading import Recording
    from cfmkit.experiment.reversal_transitions import Settled

RECORDING_FINDINGS = {
    "one_branch": "the recording has no return branch: there is no loop",
    "unfinished_cycle": "strokes that belong to no complete cycle are left out",
    "seating_cycles": "first cycles that cover less of the travel than the others are left out: they seat the parts",
    "short_cycles": "cycles that cover less of the travel than others are left out",
    "window_cut": "one branch of one cycle covers less than the others: the numbers hold over what all of them cover",
    "holes": "a part of the travel was not recorded: what holds over a window with a large hole in it is not known",
    "pauses": "points at which the machine stood are left out",
    "spikes": "points far off their neighbours are left out",
    "reversals": "points next to reversals, where the force passes from one branch to the other, are left out",
    "window_at_reversal": "the window reaches into points that are left out next to reversals: it was shortened",
    "not_filtered": "there are too few points for the filter",
    "negative_force": "the mean force is negative: the sign of the sensor may be reversed",
    "negative_loop": "the mechanism would deliver energy in every cycle: a sign may be reversed",
}


def warnings_of(recording: Recording, strokes: Strokes) -> tuple[Finding, ...]:
    """Return findings on the strokes of a recording and the sign of its effort."""
    warnings = []
    cycles = strokes.cycles
    if not cycles:
        only = strokes.measured[0][0].branch
        warnings.append(Finding("one_branch", f"there is only the branch {only!r}: no loop, and no hysteresis"))
    left = len(strokes.strokes) - (2 * len(strokes.complete) or 1)
    if cycles and covered_fraction(cycles[0]) < COMPLETE_STROKE_SHARE:
        reported = f"the shorter stroke covers only {100 * covered_fraction(cycles[0]):.0f} % of the longer one"
        warnings.append(Finding("unfinished_cycle", f"{reported}: the loop is not closed"))
    if left:
        warnings.append(
            Finding("unfinished_cycle", f"{left} of {len(strokes.strokes)} strokes complete no cycle: left out")
        )
    if strokes.shorter:
        warnings.append(_shorter_cycles_finding(recording, strokes))
    if strokes.pauses:
        reported = f"{strokes.pauses} of {len(recording)} points at which the machine stood are left out"
        warnings.append(Finding("pauses", reported))
    if float(recording.effort.mean()) < 0:
        reported = f"the mean {recording.kind} is negative: is the sensor's sign reversed?"
        warnings.append(Finding("negative_force", reported))
    return tuple(warnings)


def _shorter_cycles_finding(recording: Recording, strokes: Strokes) -> Finding:
    """Return the finding that some cycles cover less travel than others."""
    first = strokes.cycles[0][0].cycle
    numbers = [cycle[0].cycle for cycle in strokes.shorter]
    seating = max(numbers) < first

    def span(cycle: tuple[Stroke, Stroke]) -> str:
        ends = recording.motion[int(cycle[0].points[0]) : int(cycle[1].points[-1]) + 1]
        return span_text(float(ends.min()), float(ends.max()), recording.kind)

    cycle_texts = ", ".join(f"{cycle[0].cycle} ({span(cycle)})" for cycle in strokes.shorter[:4])
    more = f" and {len(numbers) - 4} more" if len(numbers) > 4 else ""
    complete = [cycle[0].cycle for cycle in strokes.complete]
    cycles, verb = ("cycles", "are") if len(numbers) > 1 else ("cycle", "is")
    what = "seating " if seating else ""
    reported = (
        f"{what}{cycles} {cycle_texts}{more} {verb} left out, as others cover {span(strokes.cycles[0])}; "
        f"--cycles {complete[0]}:{complete[-1]} keeps all"
    )
    return Finding("seating_cycles" if seating else "short_cycles", reported)


def spikes_left_out(recording: Recording, spiky: NDArray[np.bool_]) -> tuple[Finding, ...]:
    """Return the finding on spikes that were left out; empty if there are none."""
    count = int(spiky.sum())
    if not count:
        return ()
    return (Finding("spikes", f"{count} of {len(recording)} points are far from their neighbours and are omitted"),)


def passages_left_out(recording: Recording, settled: Settled) -> tuple[Finding, ...]:
    """Return the finding on points next to reversals that were left out; empty if there are none."""
    if not settled.length:
        return ()
    length = format_short(settled.length, recording.motion_dimension, 3)
    points = f"{settled.points} point{'s' * (settled.points > 1)} within {length} of the ends of strokes"
    reported = f"{points} are left out: there the {recording.kind} passes from one branch to the other"
    return (Finding("reversals", reported),)
