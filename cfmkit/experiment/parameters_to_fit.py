"""Numbers of a specification, or zeros of a recording, to be fitted: start, bounds, size of each, and their options."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import QuantityError, UsageError
from cfmkit.specs.units import format_short, from_border, read_number, read_quantity
from cfmkit.specs.yamlio.paths import Slot
from cfmkit.studies.variations import CannotVary, leaf

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cfmkit.experiment.reading import Recording
    from cfmkit.specs.spec import Spec

DATA_PREFIX = "data."  # what begins so is no value of the specification, but of the recording
ZERO_OFFSETS = {
    "force": {"force_offset": "force", "displacement_offset": "length", "drift": "force"},
    "torque": {"torque_offset": "torque", "angle_offset": "angle", "drift": "torque"},
}
"""By kind of curve, what can be fitted of a recording, with its dimension: what the sensors show without load and at
the mechanism's zero, and by how much the former grows from the first point of the recording to the last."""
MAX_ZERO_SHIFT = 0.02  # of the recorded travel: how far the zero of the displacement may be off unless bounds say more
BOUND_CLEARANCE = 1e-9  # how far inside an open bound a value stays, in sizes of the parameter


@dataclass(frozen=True)
class FitParameter:
    """A number that is fitted: one value of a specification, or several that err together."""

    path: str  # dotted; of several the first
    dimension: str  # of `cfmkit.specs.units`
    # start, low, high: SI
    start: float
    low: float
    high: float
    size: float  # typical size, SI
    joint: tuple[str, ...] = ()  # all paths of values that err together; empty: one value
    by_factor: bool = False  # whether these err by one factor, else by one amount

    @property
    def label(self) -> str:
        """The paths in words."""
        return ", ".join(self.joint) or self.path

    def format_value(self, value: float, digits: int = 4) -> str:
        """Return a value of the parameter with its unit; shares as plain numbers."""
        return f"{value:.{digits}g}" if self.dimension == "ratio" else format_short(value, self.dimension, digits)

    def changes(self, spec: Spec, value: float) -> dict[str, float]:
        """Return the values of a specification that change with the parameter, by path [SI]."""
        if not self.joint:
            return {self.path: value}
        if self.by_factor:
            return {path: float(spec.get_value(path)) * value / self.start for path in self.joint}
        return {path: float(spec.get_value(path)) + value - self.start for path in self.joint}


def parameters(
    spec: Spec,  # whose values are the start
    paths: Iterable[str],  # dotted paths of numbers; those that begin with ``data.`` are values of the recording
    bounds: Mapping[str, tuple[float, float]] | None = None,  # SI; the specification's own bounds hold besides
    recording: Recording | None = None,  # whose zeros may be fitted
) -> tuple[FitParameter, ...]:
    """Return the parameters at some paths of a specification.

    Raises UsageError if there is nothing to fit at a path, or a start is not inside its bounds.
    """
    names = [path.strip() for path in paths]
    if not names or not all(names):
        raise UsageError("--fit is empty; name one or more values, e.g. --fit mechanism.rolling_friction")
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise UsageError(f"--fit names {twice!r} twice")
    if strange := next((name for name in bounds or {} if name not in names), None):
        raise UsageError(f"--bounds names {strange!r}, which --fit does not")
    return tuple(
        _make_zero_parameter(name, (bounds or {}).get(name), recording)
        if name.startswith(DATA_PREFIX)
        else _make_parameter(spec, name, (bounds or {}).get(name))
        for name in names
    )


def _make_zero_parameter(path: str, bounds: tuple[float, float] | None, recording: Recording | None) -> FitParameter:
    """Return a zero of the recording to fit; it starts from none."""
    dimension = _dimension_of_offset(path, "--fit", recording)
    if recording and path.endswith(("displacement_offset", "angle_offset")):
        size = 0.5 * MAX_ZERO_SHIFT * recording.travel
        low, high = bounds or (-2.0 * size, 2.0 * size)
    else:
        size = 0.01 * float(np.abs(recording.effort).max()) if recording else 1.0
        low, high = bounds or (-math.inf, math.inf)
    if not low <= 0.0 <= high:
        raise UsageError(f"--fit: {path} starts at 0, outside its bounds {_range_in_words(low, high, dimension)}")
    return FitParameter(path, dimension, 0.0, low, high, size)


def _dimension_of_offset(path: str, option: str, recording: Recording | None) -> str:
    """Return the dimension of a value of the recording."""
    offsets = ZERO_OFFSETS[recording.kind if recording else "force"]
    name = path.removeprefix(DATA_PREFIX)
    if name not in offsets:
        listed = ", ".join(DATA_PREFIX + item for item in offsets)
        raise UsageError(f"{option}: there is no {path!r}; a recording has {listed}")
    return offsets[name]


def _make_parameter(spec: Spec, path: str, bounds: tuple[float, float] | None) -> FitParameter:
    try:
        place = leaf(type(spec), path)
    except CannotVary as problem:
        raise UsageError(f"--fit: {problem}") from None
    if place.kind not in ("quantity", "number"):
        raise UsageError(f"--fit: {path!r} is not a number that varies continuously")
    value = _start_value(spec, path)
    dimension = place.quantity.dimensions[0] if place.quantity else "ratio"
    low, high = _spec_bounds(type(spec), path)
    asked_low, asked_high = bounds or (-math.inf, math.inf)
    size = _typical_size(value, (max(low, asked_low), min(high, asked_high)), dimension)
    margin = BOUND_CLEARANCE * size
    low = max(low + margin * _excludes_bound(type(spec), path, "gt"), asked_low)
    high = min(high - margin * _excludes_bound(type(spec), path, "lt"), asked_high)
    if not low < high or not low <= value <= high:
        raise UsageError(
            f"--fit: {path} starts at {format_short(value, dimension, 6)}, outside its bounds "
            f"{_range_in_words(low, high, dimension)}"
        )
    return FitParameter(path, dimension, value, low, high, size)


def _start_value(spec: Spec, path: str) -> float:
    try:
        value: Any = spec.get_value(path)
    except KeyError:
        value = None
    if value is None:
        raise UsageError(f"--fit: {path!r} has no value to start from; give one with --set {path}=...")
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise UsageError(f"--fit: {path!r} is a list here; name one item, as {path}.0")
    return float(value)


def _slots_at(spec_type: type[Spec], path: str) -> tuple[Slot, ...]:
    allowed: tuple[Slot, ...] = (Slot(spec_type),)
    for part in path.split("."):
        key: str | int = int(part) if part.isdecimal() else part
        allowed = tuple(inner for slot in allowed for inner in slot.child(key))
    return allowed


def _spec_bounds(spec_type: type[Spec], path: str) -> tuple[float, float]:
    """Return the bounds that the specification sets."""
    low, high = -math.inf, math.inf
    for slot in _slots_at(spec_type, path):
        bounds = slot.bounds
        low = max(low, *(float(bounds[name]) for name in ("gt", "ge") if bounds.get(name) is not None), low)
        high = min(high, *(float(bounds[name]) for name in ("lt", "le") if bounds.get(name) is not None), high)
    return low, high


def _excludes_bound(spec_type: type[Spec], path: str, name: str) -> float:
    return float(any(slot.bounds.get(name) is not None for slot in _slots_at(spec_type, path)))


def _typical_size(value: float, limits: tuple[float, float], dimension: str) -> float:
    """Return how large a typical change is: the value itself; from zero a hundredth of the range, else one unit."""
    if value:
        return abs(value)
    width = limits[1] - limits[0]
    return 0.01 * width if math.isfinite(width) else float(from_border(1.0, dimension))


def _range_in_words(low: float, high: float, dimension: str) -> str:
    return f"{format_short(low, dimension, 6)} ... {format_short(high, dimension, 6)}"


def read_bounds(
    options: Iterable[str], spec: Spec, recording: Recording | None = None
) -> dict[str, tuple[float, float]]:
    """Return what ``--bounds a.b=0:0.01`` says, by path, SI.

    Raises UsageError if one is malformed.
    """
    bounds = {}
    for path, text in split_bounds(options).items():
        option, ends = f"{path}={text}", text.split(":")
        if len(ends) != 2:
            raise UsageError(f"--bounds: {option!r} is not 'a.b=low:high'")
        try:
            low, high = (_read_bound(end, path, spec, recording) for end in ends)
        except (CannotVary, QuantityError, ValueError) as problem:
            raise UsageError(f"--bounds: {option!r}: {problem}") from None
        if not low < high:
            raise UsageError(f"--bounds: {option!r} must be increasing")
        bounds[path] = (low, high)
    return bounds


def split_bounds(options: Iterable[str]) -> dict[str, str]:
    """Return what ``--bounds a.b=low:high`` says as text, by path.

    Raises UsageError if one has no ``=``.
    """
    fixed = {}
    for option in options:
        path, equals, text = (part.strip() for part in option.partition("="))
        if not equals:
            raise UsageError(f"--bounds: {option!r} is not 'a.b=low:high'")
        fixed[path] = text
    return fixed


def _read_bound(text: str, path: str, spec: Spec, recording: Recording | None) -> float:
    """Return one end of ``--bounds`` from its text [SI]: of a path of the file, or of the recording (`DATA_PREFIX`)."""
    if path.startswith(DATA_PREFIX):
        return read_quantity(text, _dimension_of_offset(path, "--bounds", recording))
    return float(leaf(type(spec), path).read(_number(text))[0])


def _number(text: str) -> float | str:
    """Return a bare number as one, anything else as it is."""
    try:
        return read_number(text.strip())
    except QuantityError:
        return text.strip()
