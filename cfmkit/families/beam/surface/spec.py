"""What a specification may say about a surface that the mechanism follows."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from cfmkit.families.beam.parts.spec import PositiveLength
from cfmkit.specs.formula import formula
from cfmkit.specs.spec import Model, refuse
from cfmkit.specs.units import Length, Ratio
from cfmkit.specs.units.fields import LARGEST
from cfmkit.tables.source import DataSource


class FileProfile(Model):
    """Heights of a surface from a file."""

    kind: Literal["file"]
    file: str = Field(description="a CSV beside the specification: x [mm], y [mm]")
    between: Literal["smooth", "straight"] = Field(
        "smooth", description="how it runs between its points: a cubic spline, or straight lines with corners"
    )

    @field_validator("file", mode="wrap")
    @classmethod
    def _beside_the_spec(cls, value: Any, handler: Any, info: ValidationInfo) -> Any:
        folder = getattr(value, "folder", None) or (info.context or {}).get("folder") or "."
        return DataSource(handler(value), folder)


class FormulaProfile(Model):
    """Heights of a surface by a formula."""

    kind: Literal["formula"]
    height: str = Field(description="in mm, of x in mm: 1.75*(1 - cos(pi*x/12.3))")
    length: PositiveLength = Field(description="how far the tip goes along the surface")
    points: int = Field(201, ge=3, le=100_000, description="places at which it is taken")

    @field_validator("height")
    @classmethod
    def _readable(cls, text: str) -> str:
        formula(text)
        return text

    @model_validator(mode="after")
    def _has_a_height_everywhere(self) -> Self:
        x = np.linspace(0.0, self.length, self.points) * 1e3
        heights = formula(self.height)(x)
        bad = ~(np.abs(heights) <= LARGEST * 1e3)
        if bad.any():
            place = x[int(bad.argmax())]
            told = f"has no height at x = {place:.6g} mm: a finite number of mm is needed everywhere on the surface"
            refuse("FormulaProfile", {("height",): told})
        return self


class Surface(Model):
    """A surface that the driven node follows while the mechanism is carried along it [Lan, Fig. 14]."""

    profile: FileProfile | FormulaProfile = Field(
        discriminator="kind", description="heights: of `kind` file or formula"
    )
    preload: Length = Field(description="displacement of the mechanism where the height is 0")
    friction: Annotated[Ratio, Field(ge=0, lt=2)] = Field(0.0, description="of the tip on the surface")
