"""Specification of a cam as it is cut: its numbers, its curve of forces, its measured points."""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from cfmkit.numerics.interpolation import ThroughPoints
from cfmkit.specs.block import Model, NonNegativeLength, PositiveLength
from cfmkit.specs.data_file_paths import DataSource
from cfmkit.specs.target_curve import MOST_POINTS, Interpolation
from cfmkit.specs.units import Length, Ratio

DesignFriction = Annotated[Ratio, Field(gt=-1, lt=1)]


class ProfileCurve(Model):
    """Force over travel that a profile is cut for, as shares of 4 K A."""

    points: tuple[tuple[NonNegativeLength, Annotated[Ratio, Field(ge=0)]], ...] = Field(
        min_length=2, max_length=MOST_POINTS, description="[[0 mm, 0.5], [20 mm, 1], ...]: travel, share of 4 K A"
    )
    interpolation: Interpolation = Field(
        "smooth", description="between points: monotone cubics (smooth), or straight lines (linear)"
    )

    @model_validator(mode="after")
    def _can_be_cut(self) -> Self:
        places = [place for place, _ in self.points]
        if places[0] != 0 or any(after <= before for before, after in itertools.pairwise(places)):
            raise ValueError("points must begin at a travel of 0 and increase")
        if min(share for _, share in self.points[1:]) <= 0:
            raise ValueError("shares must be above 0 beyond the start: springs that pull the rollers in cannot push")
        if self.points[0][1] == 0 and not self.shape.slope(0.0) > 0:
            raise ValueError("a force that begins at zero must grow from there: the path would begin vertical")
        return self

    @cached_property
    def shape(self) -> ThroughPoints:
        """The curve as a function of travel [m]."""
        places, shares = zip(*self.points, strict=True)
        return ThroughPoints(places, shares, self.interpolation == "smooth")


class Profile(Model):
    """The cam as it is cut. What is left out follows the mechanism's own values."""

    force_constant: PositiveLength = Field(description="A; the force is 4 K A, K the sum of all springs")
    friction: DesignFriction = Field(
        0.0,
        description="rolling friction that the profile is cut for; positive: exact on the way up, negative: on the way "
        "down",
    )
    slope_factor: Annotated[Ratio, Field(gt=0)] = Field(
        1.0,
        description="factor on the slope of the profile: 1; more if it carries the weight of the moving parts, less if "
        "they hang down",
    )
    curve: ProfileCurve | None = Field(
        None, description="force over travel that the profile is cut for, as shares of 4 K A; default: constant"
    )
    stroke: PositiveLength | None = Field(None, description="slider travel that the flank is cut for")
    brace_length: PositiveLength | None = Field(None, description="length of the brace that the profile is cut for")
    rest_half_width: PositiveLength | None = Field(None, description="half width at which the path starts, x0")
    roller_radius: PositiveLength | None = Field(None, description="radius of the roller that the profile is cut for")
    preload: NonNegativeLength | None = Field(
        None,
        description="elongation of the springs at the start that the profile is cut for, their initial tension "
        "over their stiffness included",
    )
    offset: Length = Field(0.0, description="material left on the flank beyond the profile, outward (a cutting error)")
    file: str | None = Field(None, description="measured points of both flanks, a CSV beside the spec: x [mm], y [mm]")
    noise: PositiveLength | None = Field(None, description="standard deviation of the points in `file`")
    registration: Literal["auto", "motion", "width", "datum"] | None = Field(
        None,
        description="how the points in `file` are registered to the design: by a motion, by a motion and one error of "
        "width, or not at all because they are in the part's datum; auto, the default: with the width if the points "
        "determine it",
    )

    @field_validator("file", mode="wrap")
    @classmethod
    def _resolve_file(cls, value: Any, handler: Any, info: ValidationInfo) -> Any:
        folder = getattr(value, "folder", None) or (info.context or {}).get("folder") or "."
        return None if value is None else DataSource(handler(value), folder)

    @model_validator(mode="after")
    def _noise_is_stated(self) -> Self:
        if (self.file is None) != (self.noise is None):
            raise ValueError("'file' and 'noise' belong together: how exact are the measured points?")
        if self.registration is not None and self.file is None:
            raise ValueError("'registration' is about measured points: it needs a 'file'")
        return self
