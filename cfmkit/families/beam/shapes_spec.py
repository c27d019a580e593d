"""Kinds of reference shapes of beams: what a specification says and must not say, and the engine's shape of each."""

from __future__ import annotations

import itertools
import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator

from cfmkit.elastica.model import shapes as engine
from cfmkit.specs.spec import Model, PositiveLength
from cfmkit.specs.units import Angle, Length

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

Point = tuple[Length, Length]

_CLOSING_RTOL = 1e-9  # of the length; the engine cannot fit what is shorter
# 20 places of the quadrature on each panel, of a turn below a radian on the average
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(20)
CLOSED_SHAPE_MESSAGE = "the shape returns to its start: it cannot be fitted"


def _returns(coefficients: Sequence[float]) -> bool:
    """Return True if a shape whose angle is a polynomial [rad] ends where it starts."""
    panels = 8 + math.ceil(sum(map(abs, coefficients[1:])))
    u = (np.arange(panels)[:, None] + 0.5 * (_GAUSS_NODES + 1)) / panels
    chord = (np.exp(1j * np.polynomial.polynomial.polyval(u, coefficients)) * _GAUSS_WEIGHTS).sum() / (2 * panels)
    return bool(abs(chord) < _CLOSING_RTOL)


MOST_WINDINGS = 1000  # turns that the angle along one beam may make: a shape is sampled as densely as it winds
_MOST_SWEEP = math.radians(360 * MOST_WINDINGS)


class Shape(Model):
    """Base of the kinds of shapes: a new one is a class here and its name in `ShapeSpec`.

    Nothing else compares the name of a kind.
    """

    is_straight: ClassVar[bool] = False

    @abstractmethod
    def build(self) -> engine.Shape:
        """Return the shape as the engine has it."""

    def find_faults(self, reach: float) -> Iterator[tuple[str, str]]:
        """Yield the keys and the reasons why it cannot be fitted between ends so far apart [m]."""
        yield from ()


class Straight(Shape):
    """A straight beam."""

    is_straight = True

    kind: Literal["straight"] = "straight"

    def build(self) -> engine.Shape:
        """Return the shape as the engine has it."""
        return engine.STRAIGHT_SHAPE


class PolynomialShape(Shape):
    """The angle along the beam as a polynomial of the fraction u of its length: c0 + c1 u + c2 u^2 + ..."""

    kind: Literal["polynomial"]
    coefficients: tuple[Angle, ...] = Field(
        min_length=1, max_length=10_000, description="[c0, c1, ...], angles from the x axis"
    )
    length: PositiveLength | None = Field(None, description="nominal length, for `closure` and its report")

    @field_validator("coefficients")
    @classmethod
    def _winds_so_often(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        turns = sum(map(abs, values[1:])) / math.tau
        if turns > MOST_WINDINGS:
            raise ValueError(
                f"the sizes of c1, c2, ... add up to {turns:.4g} turns: at most {MOST_WINDINGS} are supported"
            )
        return values

    def build(self) -> engine.Shape:
        """Return the shape as the engine has it."""
        return engine.Polynomial(self.coefficients, self.length)

    def find_faults(self, reach: float) -> Iterator[tuple[str, str]]:
        """Yield that it returns to its start, if it does."""
        if _returns(self.coefficients):
            yield "coefficients", CLOSED_SHAPE_MESSAGE


class ArcShape(Shape):
    """A circular arc between the nodes."""

    kind: Literal["arc"]
    sweep: Annotated[Angle, Field(ge=-_MOST_SWEEP, le=_MOST_SWEEP)] = Field(
        description="by how much the angle grows from start to end; positive bulges to the right"
    )

    def build(self) -> engine.Shape:
        """Return the shape as the engine has it."""
        return engine.arc(self.sweep)

    def find_faults(self, reach: float) -> Iterator[tuple[str, str]]:
        """Yield that it returns to its start, if it does."""
        if _returns((0.0, self.sweep)):
            yield "sweep", "an arc of whole turns returns to its start: it cannot be fitted"


class CosineShape(Shape):
    """A cosine arch: rise (1 - cos(2 pi x / span)) / 2, to the left of the way from start to end."""

    kind: Literal["cosine"]
    rise: Length = Field(description="height of the arch")
    half: bool = Field(False, description="half an arch, whose ends differ in height by the rise")

    def build(self) -> engine.Shape:
        """Return the shape as the engine has it."""
        return engine.CosineArch(self.rise, 0.5 if self.half else 1.0)

    def find_faults(self, reach: float) -> Iterator[tuple[str, str]]:
        """Yield that half an arch is too high for its ends, if it is."""
        if self.half and abs(self.rise) >= reach:
            yield "rise", "the rise of half an arch must be less than the distance of its ends"


class _ThroughPoints(Shape):
    """Base of shapes through points."""

    def find_faults(self, reach: float) -> Iterator[tuple[str, str]]:
        """Yield that neighbours, or the ends, are at one place, if they are."""
        points: tuple[Point, ...] = self.points  # type: ignore[attr-defined]
        if any(point == following for point, following in itertools.pairwise(points)):
            yield "points", "two neighbouring points are the same"
        elif points[0] == points[-1]:
            yield "points", CLOSED_SHAPE_MESSAGE


class PolylineShape(_ThroughPoints):
    """Straight pieces through points; corners are rigid. Turned and scaled to fit the nodes."""

    kind: Literal["polyline"]
    points: tuple[Point, ...] = Field(min_length=2, description="[[x, y], ...] in any frame")

    def build(self) -> engine.Shape:
        """Return the shape as the engine has it."""
        return engine.Polyline(np.array(self.points))


class SplineShape(_ThroughPoints):
    """A smooth curve through points, a cubic spline. Turned and scaled to fit the nodes."""

    kind: Literal["spline"]
    points: tuple[Point, ...] = Field(min_length=3, description="[[x, y], ...] in any frame")

    def build(self) -> engine.Shape:
        """Return the shape as the engine has it."""
        return engine.Spline(np.array(self.points))


ShapeSpec = Annotated[
    Straight | PolynomialShape | ArcShape | CosineShape | PolylineShape | SplineShape, Field(discriminator="kind")
]
