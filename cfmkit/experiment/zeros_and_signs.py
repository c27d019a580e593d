"""Corrections of a recording of a test: zero readings of the sensors (`--tare`, `--zero`) and signs (`--flip`)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import QuantityError, UsageError

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
    resting = _resting(recording)
    shown = [_to_shown_unit(tare, recording.effort[:resting], "--tare", recording.kind)]
    shown.append(_to_shown_unit(zero, recording.motion[:1], "--zero", recording.motion_dimension))
    signs = [-1.0 if word in flip else 1.0 for word in (effort, motion)]
    notes = [*_notes((effort, motion), shown, recording.kind), *(f"sign of the {word} reversed" for word in flip)]
    if not notes:
        return recording
    return replace(
        recording,
        effort=signs[0] * (recording.effort - shown[0]),
        motion=signs[1] * (recording.motion - shown[1]),
        notes=(*recording.notes, *notes),
        zeros=raw_zeros(recording, *shown),
        signs=(recording.signs[0] * signs[0], recording.signs[1] * signs[1]),
    )


def raw_zeros(recording: Recording, effort: float, motion: float) -> tuple[float, float]:
    """Return the readings, before anything was subtracted or turned, of an effort and a motion of a recording."""
    (tare, zero), (sign_of_effort, sign_of_motion) = recording.zeros, recording.signs
    return tare + sign_of_effort * effort, zero + sign_of_motion * motion


def _resting(recording: Recording) -> int:
    """Return how many points there are before the machine moves; at least one."""
    moved = np.abs(recording.motion - recording.motion[0]) > _STANDSTILL_SHARE * recording.travel
    return max(int(np.argmax(moved)), 1)


def _to_shown_unit(value: str | float | None, first: FloatArray, option: str, dimension: str) -> float:
    from cfmkit.specs.units import read_quantity

    if value is None:
        return 0.0
    if not isinstance(value, str):
        return float(value)
    if value.strip() == START_WORD:
        return float(first.mean())
    try:
        return read_quantity(value, dimension)
    except QuantityError as error:
        raise UsageError(f"{option}: {error}; or write {START_WORD!r} for the mean before the machine moves") from None


def _notes(words: tuple[str, str], shown: list[float], kind: str) -> list[str]:
    from cfmkit.specs.units import format_short

    dimensions = (kind, "length" if kind == "force" else "angle")
    return [
        f"{format_short(value, dimension, 6)} subtracted from the {word}"
        for word, value, dimension in zip(words, shown, dimensions, strict=True)
        if value
    ]
