"""Corrections of a recording: zero readings (`--tare`, `--zero`), signs (`--flip`), and a zero-phase low-pass.

The low-pass is a Butterworth filter, applied to each branch separately. Run back and forth, it delays nothing, and its
gain is the square of one pass's: at the stated cut-off of each pass it is 1/2. With `corrected` the cut-off of the
passes is raised so that both together have -3 dB there. Second-order sections and an odd extension at the ends
(3 (2 n + 1) points for n sections) keep it stable and true at the ends. Filtering across a reversal would smear the
jump of the force there.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.errors import DataError, QuantityError, UsageError

if TYPE_CHECKING:
    from collections.abc import Collection

    from cfmkit.arrays import FloatArray
    from cfmkit.experiment.reading import Recording


START_WORD = "start"  # in place of a value: the mean of the first points, where the machine has not moved yet
_STANDSTILL_SHARE = 1e-3  # the machine has not moved where it is this near to its first place, in parts of the travel


def words_of(kind: str) -> tuple[str, str]:
    """Return what effort and motion of a curve are called."""
    return ("force", "displacement") if kind == "force" else ("torque", "angle")


def correct_recording(
    recording: Recording,  # as recorded
    # force or torque that the sensor shows without load: a text with its unit, a number [N or N m], or ``start`` for
    # the mean of the points before the machine moves
    tare: str | float | None = None,
    # displacement or angle that the sensor shows at the mechanism's zero, likewise [m or rad]
    zero: str | float | None = None,
    # ``force`` and ``displacement``, or ``torque`` and ``angle``: what is recorded with the sign reversed
    flip: Collection[str] = (),
) -> Recording:
    """Return a recording with other zeros and signs: (reading - zero), turned where it is to be.

    Raises UsageError if a value cannot be read, or there is nothing of that name to turn.
    """
    effort, motion = words_of(recording.kind)
    if strange := next((word for word in flip if word not in (effort, motion)), None):
        raise UsageError(f"--flip: {strange!r} is not in this recording; it has {effort} and {motion}")
    resting = _count_resting(recording)
    subtracted = [_reading_to_subtract(tare, recording.effort[:resting], "--tare", recording.kind)]
    subtracted.append(_reading_to_subtract(zero, recording.motion[:1], "--zero", recording.motion_dimension))
    signs = [-1.0 if word in flip else 1.0 for word in (effort, motion)]
    notes = [*_notes((effort, motion), subtracted, recording.kind), *(f"sign of the {word} reversed" for word in flip)]
    if not notes:
        return recording
    return replace(
        recording,
        effort=signs[0] * (recording.effort - subtracted[0]),
        motion=signs[1] * (recording.motion - subtracted[1]),
        notes=(*recording.notes, *notes),
        zeros=raw_zeros(recording, *subtracted),
        signs=(recording.signs[0] * signs[0], recording.signs[1] * signs[1]),
    )


def raw_zeros(recording: Recording, effort: float, motion: float) -> tuple[float, float]:
    """Return the readings, before anything was subtracted or turned, of an effort and a motion of a recording."""
    (tare, zero), (sign_of_effort, sign_of_motion) = recording.zeros, recording.signs
    return tare + sign_of_effort * effort, zero + sign_of_motion * motion


def _count_resting(recording: Recording) -> int:
    """Return how many points there are before the machine moves; at least one."""
    moved = np.abs(recording.motion - recording.motion[0]) > _STANDSTILL_SHARE * recording.travel
    return max(int(np.argmax(moved)), 1)


def _reading_to_subtract(value: str | float | None, resting: FloatArray, option: str, dimension: str) -> float:
    """Return the reading that ``--tare`` or ``--zero`` makes zero [SI]: 0 without it, the mean at rest for `start`."""
    from cfmkit.specs.units import read_quantity

    if value is None:
        return 0.0
    if not isinstance(value, str):
        return float(value)
    if value.strip() == START_WORD:
        return float(resting.mean())
    try:
        return read_quantity(value, dimension)
    except QuantityError as error:
        raise UsageError(f"{option}: {error}; or write {START_WORD!r} for the mean before the machine moves") from None


def _notes(words: tuple[str, str], subtracted: list[float], kind: str) -> list[str]:
    from cfmkit.specs.units import format_short

    dimensions = (kind, "length" if kind == "force" else "angle")
    return [
        f"{format_short(value, dimension, 6)} subtracted from the {word}"
        for word, value, dimension in zip(words, subtracted, dimensions, strict=True)
        if value
    ]


Per = Literal["time", "length", "angle"]

DEFAULT_ORDER = 6
_STEP_RTOL = 1e-3  # steps that differ by less than this part of their mean are even
_FILTER_PATTERN = re.compile(r"(?P<cutoff>.+?)(?:[, ]+order +(?P<order>[0-9]+))?(?P<corrected>[, ]+corrected)?")


@dataclass(frozen=True)
class LowPass:
    """A zero-phase Butterworth low-pass."""

    cutoff: float  # [Hz] for `per` "time", [1/m] for "length", [1/rad] for "angle"
    per: Per  # what it counts cycles over
    order: int = DEFAULT_ORDER  # of each of the two passes
    corrected: bool = False  # whether both passes together have -3 dB at the cut-off, instead of -6 dB

    def __post_init__(self) -> None:
        """Refuse what is no filter."""
        if not (self.cutoff > 0 and math.isfinite(self.cutoff)) or not 1 <= self.order <= 20:
            raise UsageError("a filter needs a cut-off above zero and an order from 1 to 20")

    def sections(self, step: float) -> FloatArray:
        """Return the second-order sections of one pass for samples `step` [s, m or rad] apart.

        Raises DataError if the samples are too far apart for the cut-off.

        Returns
        -------
        (m, 6) array
            Rows b0, b1, b2, 1, a1, a2.
        """
        if self.cutoff * step >= 0.5:
            raise DataError(
                f"the cut-off {self.reported} is not below half the sampling rate; "
                f"use one below {self._format_cutoff(0.5 / step)}"
            )
        tangent = math.tan(math.pi * self.cutoff * step)
        if self.corrected:
            tangent /= (math.sqrt(2.0) - 1.0) ** (1.0 / (2 * self.order))
        from scipy.signal import butter

        sections: FloatArray = butter(self.order, math.atan(tangent) / math.pi, fs=1.0, output="sos")
        return sections

    @property
    def reported(self) -> str:
        """The cut-off with its unit."""
        return self._format_cutoff(self.cutoff)

    def _format_cutoff(self, cutoff: float) -> str:
        if self.per == "time":
            return f"{cutoff:.4g} Hz"
        if self.per == "length":
            return f"{cutoff / 1e3:.4g} 1/mm"
        return f"{cutoff * math.pi / 180:.4g} 1/deg"

    @property
    def sentence(self) -> str:
        """Description of the filter, for reports."""
        at = "-3 dB both passes together" if self.corrected else "-3 dB each pass"
        return (
            f"Butterworth of order {self.order} per pass, back and forth, cut-off {self.reported} ({at}), each branch"
        )


def read_filter(
    text: str,  # such as ``2 Hz``, ``0.24 1/mm, order 3`` or ``2 Hz, corrected``
) -> LowPass | None:
    """Return the filter that a text says; None for ``none``.

    Raises UsageError if it says none.
    """
    if text.strip() == "none":
        return None
    match = _FILTER_PATTERN.fullmatch(text.strip())
    try:
        cutoff, per = _read_cutoff(match["cutoff"] if match else text)
    except QuantityError as error:
        raise UsageError(f"--filter: {error} (e.g. '2 Hz', '0.24 1/mm, order 3', 'none')") from None
    order = int(match["order"]) if match and match["order"] else DEFAULT_ORDER
    return LowPass(cutoff, per, order, bool(match and match["corrected"]))


def _read_cutoff(text: str) -> tuple[float, Per]:
    from cfmkit.specs.units import read_one_of

    match = re.fullmatch(r"\s*(\S+) +1/(deg|rad)\s*", text)
    if match:
        from cfmkit.specs.units import read_number

        return read_number(match[1]) * (180.0 / math.pi if match[2] == "deg" else 1.0), "angle"
    value, dimension = read_one_of(text, ("frequency", "curvature"))
    if value <= 0:
        raise QuantityError(f"a cut-off of {text.strip()} filters everything away")
    return value, "time" if dimension == "frequency" else "length"


def low_passed(
    values: FloatArray,  # (n,): in the order of the branch
    # (n,): time [s], displacement [m] or angle [rad] of each, never turning back. Where the steps are uneven the values
    # are taken at even ones and brought back
    over: FloatArray,
    filtered_by: LowPass,  # what to let through
) -> FloatArray:
    """Return values of one branch, filtered.

    Raises DataError if there are too few values, or they are too far apart.
    """
    steps = np.diff(over)
    step = float(over[-1] - over[0]) / max(len(over) - 1, 1)
    if step == 0 or not len(steps):
        raise DataError("there is no travel to filter over: all points are at one position")
    if np.abs(steps - step).max() <= _STEP_RTOL * abs(step):
        return _filter_both_ways(values, abs(step), filtered_by)
    sign = 1 if step > 0 else -1
    even = np.linspace(over[0], over[-1], len(over))
    smooth = _filter_both_ways(np.interp(sign * even, sign * over, values), abs(step), filtered_by)
    back: FloatArray = np.interp(sign * over, sign * even, smooth)
    return back


def _filter_both_ways(values: FloatArray, step: float, filtered_by: LowPass) -> FloatArray:
    sections = filtered_by.sections(step)
    padding = 3 * (2 * len(sections) + 1)
    if len(values) <= padding:
        raise DataError(
            f"a branch has {len(values)} points, and a filter of order {filtered_by.order} needs more than {padding}; "
            "use a lower order or measure more points"
        )
    head, tail = 2.0 * values[0] - values[padding:0:-1], 2.0 * values[-1] - values[-2 : -padding - 2 : -1]
    forth = _filter_one_way(np.concatenate([head, values, tail]), sections)
    return _filter_one_way(forth[::-1], sections)[::-1][padding:-padding]


def _filter_one_way(values: FloatArray, sections: FloatArray) -> FloatArray:
    """Return values after one pass that starts at rest at the first value.

    The level is taken off before and put back: where the cut-off is far below the sampling rate the initial state that
    holds it, as `scipy.signal.sosfiltfilt` computes it, is known to a few digits only.
    """
    from scipy.signal import sosfilt

    filtered: FloatArray = sosfilt(sections, values - values[0]) + values[0]
    return filtered
