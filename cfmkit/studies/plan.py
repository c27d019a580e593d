"""Points of a study in their order: a grid, lists side by side or drawn samples, enumerated when they are needed.

Nothing of the size of a grid is ever allocated: a grid of a million points from two
axes holds two thousand values. Only what is drawn at random is kept as drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cfmkit.errors import UsageError
from cfmkit.numerics.unit_cube_samples import sample_unit_cube
from cfmkit.specs.units import attach_dimension, format_quantity, from_border, to_border
from cfmkit.specs.units.decimal_scaling_and_grids import even_grid, shift_decimal
from cfmkit.tables import border_values

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.variations import Axis

Levels = tuple[Any, ...] | NDArray[Any]

MOST_POINTS = 1_000_000  # points of a study unless the user allows more


@dataclass(frozen=True)
class Variable:
    """One thing that varies, with every value it takes."""

    path: str  # dotted
    dimension: str  # of `cfmkit.specs.units`; "count" for whole numbers, "text" for words and switches
    values: Levels  # SI floats, whole numbers or words, as `Spec.replace` takes them
    shown: Levels  # the same in border units, for tables
    several: bool = False  # whether a value may be of several dimensions: it knows which, as a length or an angle

    def value(self, index: int) -> Any:
        """Return one value as `Spec.replace` takes it."""
        value = self.values[index]
        plain = value.item() if isinstance(value, np.generic) else value
        return attach_dimension(plain, self.dimension) if self.several else plain


@dataclass(frozen=True)
class Plan:
    """All points of a study."""

    variables: tuple[Variable, ...]  # in order; in a grid the first varies slowest
    size: int  # number of points
    # whether the variables go through their values together (zip and samples) rather than in every combination (grid)
    joint: bool = False

    def __len__(self) -> int:
        return self.size

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the values that vary."""
        return tuple(item.path for item in self.variables)

    def point(self, index: int) -> tuple[Any, ...]:
        """Return the values of one point, as `Spec.replace` takes them."""
        return tuple(item.value(at) for item, at in zip(self.variables, self._level_indices(index), strict=True))

    def block(self, start: int, stop: int) -> tuple[NDArray[Any], ...]:
        """Return the values of the points from `start` up to `stop`, one array for each variable."""
        return self._select_points([item.values for item in self.variables], start, stop)

    def list_shown_values(self, start: int, stop: int) -> tuple[NDArray[Any], ...]:
        """Return the same in border units, for tables."""
        return self._select_points([item.shown for item in self.variables], start, stop)

    def part(self, start: int, stop: int) -> Plan:
        """Return the points from `start` up to `stop` as a plan of their own."""
        taken = zip(self.variables, self.block(start, stop), self.list_shown_values(start, stop), strict=True)
        parts = (Variable(item.path, item.dimension, values, shown, item.several) for item, values, shown in taken)
        return Plan(tuple(parts), stop - start, joint=True)

    def _level_indices(self, index: int) -> list[int]:
        if self.joint:
            return [index] * len(self.variables)
        levels = []
        for item in reversed(self.variables):
            index, level = divmod(index, len(item.values))
            levels.append(level)
        return levels[::-1]

    def _select_points(self, columns: Sequence[Levels], start: int, stop: int) -> tuple[NDArray[Any], ...]:
        index = np.arange(start, stop)
        if self.joint:
            return tuple(_as_array(column)[index] for column in columns)
        taken = []
        for column in reversed(columns):
            index, level = np.divmod(index, len(column))
            taken.append(_as_array(column)[level])
        return tuple(taken[::-1])


def _as_array(values: Levels) -> NDArray[Any]:
    if isinstance(values, np.ndarray):
        return values
    kinds = set(map(type, values))
    return np.array(values, dtype=np.float64 if kinds == {float} else np.int64 if kinds == {int} else object)


def grid(axes: Sequence[Axis], most: int = MOST_POINTS) -> Plan:
    """Return every combination; the first axis varies slowest.

    Raises UsageError if there are more points than allowed; nothing is allocated before that is known.
    """
    size = math.prod(item.count or 0 for item in axes)
    refuse_too_many(size, most)
    return Plan(tuple(map(step_axis, axes)), size)


def zip_axes(axes: Sequence[Axis], most: int = MOST_POINTS) -> Plan:
    """Return the values side by side: the first of each, the second of each, ...

    Raises UsageError if the axes have different numbers of values, or too many.
    """
    counts = {item.leaf.path: item.count or 0 for item in axes}
    if len(set(counts.values())) > 1:
        reported = ", ".join(f"{path} has {count}" for path, count in counts.items())
        raise UsageError(f"values varied in step must be equally many: {reported}")
    size = next(iter(counts.values()))
    refuse_too_many(size, most)
    plan = Plan(tuple(map(step_axis, axes)), size, joint=True)
    seen: dict[tuple[Any, ...], int] = {}
    for index in range(size):
        if (first := seen.setdefault(plan.point(index), index)) != index:
            raise UsageError(f"values varied in step: set number {index + 1} repeats number {first + 1}")
    return plan


@dataclass(frozen=True)
class Draw:
    """Draw of points: of which of `SAMPLE_KINDS`, of how many points, from which seed."""

    method: str
    count: int
    seed: int = 0


def sample_axes(axes: Sequence[Axis], draw: Draw, most: int = MOST_POINTS) -> Plan:
    """Return points drawn from ranges without a number of steps, or from lists.

    Lists and whole numbers get each of their values with the same probability.

    Raises UsageError if there are more points than allowed.
    """
    refuse_too_many(draw.count, most)
    unit = sample_unit_cube(draw.method, len(axes), draw.count, np.random.default_rng(draw.seed))
    return Plan(tuple(_drawn_variable(item, unit[:, k]) for k, item in enumerate(axes)), draw.count, joint=True)


def refuse_too_many(size: int, most: int) -> None:
    """Raise if a study has more points than allowed.

    Raises UsageError with both numbers and the way out.
    """
    if size > most:
        raise UsageError(f"{size} points are more than {most}; vary less, or allow them with --max-points {size}")


def step_axis(axis: Axis) -> Variable:
    """Return the variable that goes through the values of an axis."""
    several = axis.leaf.has_several_dimensions
    if axis.ends is None:
        plain = tuple(float(value) if several else value for value in axis.listed)
        return Variable(
            axis.leaf.path, axis.dimension, plain, tuple(_show_value(v, axis.dimension) for v in plain), several
        )
    count = axis.count or 0
    if axis.leaf.kind == "whole":
        whole = np.linspace(*axis.ends, count).round().astype(np.int64)
        return Variable(axis.leaf.path, axis.dimension, whole, whole)
    ends = [_show_value(end, axis.dimension) for end in axis.ends]
    shown = even_grid(ends[0], ends[1], count)
    return Variable(axis.leaf.path, axis.dimension, _border_to_si(shown, axis.dimension), shown, several)


def _show_value(value: Any, dimension: str) -> Any:
    """Return a value as tables show it: in the border unit, with no more digits than it needs."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | str):
        return value
    return float(format_quantity(value, dimension).split(" ")[0])


def _border_to_si(shown: FloatArray, dimension: str) -> FloatArray:
    """Return border values in SI; where the factor is a power of ten, each the float nearest to its decimal."""
    factor = float(to_border(1.0, dimension))
    power = round(math.log10(factor))
    if factor == float(f"1e{power}"):
        return shift_decimal(shown, -power)
    values: FloatArray = from_border(shown, dimension)
    return values


def _drawn_variable(axis: Axis, unit: FloatArray) -> Variable:
    """Return the variable whose values are an axis at places in [0, 1)."""
    path, dimension, several = axis.leaf.path, axis.dimension, axis.leaf.has_several_dimensions
    if axis.ends is None:
        levels = step_axis(axis)
        index = np.minimum((unit * len(levels.values)).astype(np.intp), len(levels.values) - 1)
        return Variable(path, dimension, _as_array(levels.values)[index], _as_array(levels.shown)[index], several)
    low, high = axis.ends
    if axis.leaf.kind == "whole":
        low, high = min(low, high), max(low, high)
        whole = np.minimum(np.floor(low + unit * (high - low + 1.0)), high).astype(np.int64)
        return Variable(path, dimension, whole, whole)
    values = low + unit * (high - low)
    return Variable(path, dimension, values, border_values(values, dimension), several)
