"""A curve that force or torque are to follow, as a specification says it: points, a CSV file or a stiffness.

These are ``design.target`` and ``analysis.target``. What drives the mechanism decides
whether these are forces over displacements or torques over angles; the units say which.
"""

from __future__ import annotations

import csv
import itertools
import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from cfmkit.errors import QuantityError
from cfmkit.specs.block import Model
from cfmkit.specs.data_file_paths import DataSource
from cfmkit.specs.units import Displacement, Place, format_short, read_quantity
from cfmkit.specs.units.fields import DimensionedField, DimensionedFloat

if TYPE_CHECKING:
    from cfmkit.specs.evaluable_target_curve import TargetCurve


EFFORT_DIMENSIONS, SLOPE_DIMENSIONS = ("force", "torque"), ("stiffness", "rotational_stiffness")
MOTION_OF = {"force": "length", "torque": "angle"}
MOST_POINTS = 10_000


Effort = Annotated[float, DimensionedField(EFFORT_DIMENSIONS)]
AnyStiffness = Annotated[float, DimensionedField(SLOPE_DIMENSIONS)]
Interpolation = Literal["smooth", "linear"]


class Target(Model):
    """A curve instead of one force: points, a file of points, or a straight line."""

    points: tuple[tuple[Displacement, Effort], ...] | None = Field(
        None,
        min_length=2,
        max_length=MOST_POINTS,
        description="[[0 mm, 0 N], [5 mm, 10 N], ...], increasing in the displacement or angle",
    )
    file: str | None = Field(
        None,
        description="the same as a CSV beside the specification: displacement [mm], force [N], or angle [deg], "
        "torque [N*mm]",
    )
    stiffness: AnyStiffness | None = Field(None, description="or a straight line: its slope, negative if it falls")
    start: Effort | None = Field(
        None, description="of a line: force or torque at zero; default: that of the design, or 0"
    )
    interpolation: Interpolation = Field(
        "smooth",
        description="between points: monotone cubics, which round steps without overshoot (smooth), or straight lines",
    )

    @field_validator("file", mode="wrap")
    @classmethod
    def _resolve_file(cls, value: Any, handler: Any, info: ValidationInfo) -> Any:
        folder = getattr(value, "folder", None) or (info.context or {}).get("folder") or "."
        if value is None:
            return None
        source = DataSource(handler(value), folder)
        _read_points(source)
        return source

    @model_validator(mode="after")
    def _require_one_source(self) -> Self:
        if sum(source is not None for source in (self.points, self.file, self.stiffness)) != 1:
            raise ValueError("give one of 'points', 'file' and 'stiffness'")
        if self.start is not None and self.stiffness is None:
            raise ValueError("'start' belongs to 'stiffness': points say where they start")
        if self.points is not None:
            _require_increasing_points(self.points)
        if (
            self.start
            and self.stiffness
            and EFFORT_DIMENSIONS.index(_dimension(self.start)) != SLOPE_DIMENSIONS.index(_dimension(self.stiffness))
        ):
            raise ValueError("'stiffness' and 'start' must both be of a force, or both of a torque")
        return self

    @property
    def all_points(self) -> tuple[tuple[float, float], ...] | None:
        """The points, those of a file included [m or rad, N or N m]; None for a straight line."""
        return _read_points(self.file) if isinstance(self.file, DataSource) else self.points

    @property
    def kind(self) -> str | None:
        """Force or torque; None if all numbers are zero."""
        if (points := self.all_points) is not None:
            said = {_dimension(effort) for _, effort in points if effort}
            said |= {"torque" for place, _ in points if place and _dimension(place) == "angle"}
            return said.pop() if said else None
        if self.stiffness:
            return EFFORT_DIMENSIONS[SLOPE_DIMENSIONS.index(_dimension(self.stiffness))]
        return _dimension(self.start) if self.start else None

    def curve(self, level: float | None = None) -> TargetCurve:
        """Return the curve as a function; a line without `start` has a level at zero [N or N m]."""
        from cfmkit.numerics.interpolation import (
            ThroughPoints,  # numpy, which reading a specification does not need
        )
        from cfmkit.specs.evaluable_target_curve import TargetCurve

        points = self.all_points
        if points is None:
            start = self.start if self.start is not None else level or 0.0
            return TargetCurve((float(start), float(self.stiffness or 0.0)), self.kind)
        places, efforts = zip(*((float(place), float(effort)) for place, effort in points), strict=True)
        return TargetCurve(ThroughPoints(places, efforts, self.interpolation == "smooth"), self.kind)

    def written_out(self, level: float | None = None) -> Target:
        """Return the target without a file, which other folders do not have, and a line with its level [N or N m]."""
        if isinstance(self.file, DataSource):
            return Target(points=_read_points(self.file), interpolation=self.interpolation)
        if self.stiffness is not None and self.start is None and level:
            return self.model_copy(
                update={
                    "start": DimensionedFloat(
                        level, EFFORT_DIMENSIONS[SLOPE_DIMENSIONS.index(_dimension(self.stiffness))]
                    )
                }
            )
        return self


def _dimension(number: float) -> str:
    return str(getattr(number, "dimension", ""))


def _require_increasing_points(points: tuple[tuple[float, float], ...]) -> None:
    """Raise if points do not increase, or mix forces and torques."""
    for (before, _), (after, _) in itertools.pairwise(points):
        if not after > before:
            pair = [format_short(float(place), _dimension(place) or "length") for place in (before, after)]
            raise ValueError(
                f"points must increase: {pair[1]} comes after {pair[0]}; a step needs a little travel between its ends"
            )
    efforts = {_dimension(effort) for _, effort in points if effort} or {_dimension(effort) for _, effort in points}
    motions = {_dimension(place) for place, _ in points if place}
    if len(efforts) > 1 or len(motions) > 1 or (efforts and motions - {MOTION_OF[effort] for effort in efforts}):
        raise ValueError("points are forces over displacements, or torques over angles; these are mixed")


_HEADER_PATTERN = re.compile(r"\s*(?P<name>[a-z_]+)\s*\[(?P<unit>[^\[\]]+)\]\s*")
_COLUMN_DIMENSIONS = {"displacement": "length", "force": "force", "angle": "angle", "torque": "torque"}


def _read_points(source: DataSource) -> tuple[tuple[Place, DimensionedFloat], ...]:
    """Return the points of a CSV.

    Raises ValueError if its columns or numbers are not those of a curve; the message names the line.
    """
    try:
        text = source.path.read_text(encoding="utf-8-sig")
    except OSError:
        raise ValueError(f"{source} cannot be read") from None
    except UnicodeDecodeError:
        raise ValueError(f"{source} is not UTF-8; save it as UTF-8") from None
    lines = csv.reader(text.splitlines())
    try:
        rows = list(lines)
    except csv.Error as problem:
        raise ValueError(f"{source}:{lines.line_num}: {problem}") from None
    heads = [_HEADER_PATTERN.fullmatch(cell) for cell in (rows[0] if rows else [])]
    units = {head["name"]: (column, head["unit"]) for column, head in enumerate(heads) if head}
    pair = next((two for two in (("displacement", "force"), ("angle", "torque")) if set(two) <= set(units)), None)
    if pair is None:
        raise ValueError(f"{source}:1: needs columns displacement [mm] and force [N], or angle [deg] and torque [N*mm]")
    points = []
    for line, cells in enumerate(rows[1:], 2):
        if not any(cell.strip() for cell in cells):
            continue
        numbers = []
        for name in pair:
            column, unit = units[name]
            try:
                numbers.append(read_quantity(f"{cells[column].strip()} {unit}", _COLUMN_DIMENSIONS[name]))
            except (QuantityError, IndexError) as problem:
                reported = str(problem) if isinstance(problem, QuantityError) else f"no {name}"
                raise ValueError(f"{source}:{line}: {reported}") from None
        points.append(
            (Place(numbers[0], _COLUMN_DIMENSIONS[pair[0]]), DimensionedFloat(numbers[1], _COLUMN_DIMENSIONS[pair[1]]))
        )
    if not 2 <= len(points) <= MOST_POINTS:
        raise ValueError(f"{source}: a curve has 2 to {MOST_POINTS} points, not {len(points)}")
    try:
        _require_increasing_points(tuple(points))
    except ValueError as problem:
        raise ValueError(f"{source}: {problem}") from None
    return tuple(points)
