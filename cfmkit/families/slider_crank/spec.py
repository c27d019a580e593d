"""What a YAML specification of a slider-crank mechanism may say."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from cfmkit.spec import Analysis, Model, Spec
from cfmkit.units import Angle, Length, Ratio, RotationalStiffness, Stiffness

PositiveLength = Annotated[Length, Field(gt=0)]
PositiveAngle = Annotated[Angle, Field(gt=0)]
TorsionRate = Annotated[RotationalStiffness, Field(ge=0)]
ExtensionRate = Annotated[Stiffness, Field(ge=0)]


class Springs(Model):
    """Rates of the springs of one leg; all are relaxed in the unloaded position."""

    pivot: TorsionRate = Field(0.0, description="torsion between ground and crank, K_RA; say per rad or per deg")
    crank_pin: TorsionRate = Field(0.0, description="torsion between crank and coupler, K_RB")
    slider_pin: TorsionRate = Field(0.0, description="torsion between coupler and slider, K_RC")
    slider: ExtensionRate = Field(0.0, description="extension between slider and ground, K_PC")


class Limits(Model):
    """How far each spring may be moved from the unloaded position, either way."""

    pivot: PositiveAngle | None = Field(None, description="rotation at the pivot")
    crank_pin: PositiveAngle | None = Field(None, description="rotation at the crank pin")
    slider_pin: PositiveAngle | None = Field(None, description="rotation at the slider pin")
    slider: PositiveLength | None = Field(None, description="travel of the slider")


class Mechanism(Model):
    """A crank about a fixed pivot, a coupler, a slider on a straight way; a spring at each joint."""

    crank_length: PositiveLength = Field(description="r1, pivot to crank pin")
    coupler_length: PositiveLength | None = Field(
        None, description="r2, crank pin to slider pin; default: from 'stretched_position'"
    )
    stretched_position: PositiveLength | None = Field(
        None, description="distance of pivot and slider pin along the way when stretched; instead of 'coupler_length'"
    )
    offset: Length = Field(0.0, description="e, height of the slider pin's way above the pivot")
    branch: Literal["right", "left"] = Field("right", description="side of the crank pin on which the slider is")
    unloaded_angle: Angle | None = Field(None, description="crank angle from the slider's way with all springs relaxed")
    unloaded_offset: Angle | None = Field(
        None, description="the same from the stretched position, where 0 is exact; instead of 'unloaded_angle'"
    )
    springs: Springs = Field(default_factory=Springs, description="rates of one leg, each 0 unless given")
    legs: int = Field(1, ge=1, le=1000, description="equal legs in parallel on one crank, or on one slider")
    limits: Limits | None = Field(None, description="largest rotations and travel of the springs")

    @model_validator(mode="after")
    def _coupler_is_known(self) -> Self:
        if (self.coupler_length is None) == (self.stretched_position is None):
            raise ValueError("give either 'coupler_length' or 'stretched_position', from which it follows")
        return self

    @model_validator(mode="after")
    def _unloaded_position_is_known(self) -> Self:
        if (self.unloaded_angle is None) == (self.unloaded_offset is None):
            raise ValueError("give either 'unloaded_angle' or 'unloaded_offset', the angle from the stretched position")
        return self


class CrankAnalysis(Analysis):
    """How a slider-crank is run."""

    drive: Literal["torque", "force"] = Field(
        "torque", description="torque at the crank over its angle, or force at the slider over its travel"
    )
    angle: tuple[Angle, Angle] | None = Field(
        None, description="crank angles to run through; default: one turn, or the arc that the linkage reaches"
    )
    travel: tuple[Length, Length] | None = Field(
        None, description="slider travel from the unloaded position, towards the pivot positive; default: all of it"
    )
    side: Literal["before", "beyond"] | None = Field(
        None, description="where the crank is when a force drives: before or beyond the stretched position"
    )
    tolerance: Annotated[Ratio, Field(gt=0, lt=1)] = Field(
        0.005, description="half width of the constant band, as a fraction of the value at the reference"
    )
    reference_angle: Angle | None = Field(None, description="where the constant band is taken; default: stretched")
    reference_travel: Length | None = Field(
        None, description="where the constant band is taken when a force drives; default: half way"
    )
    fidelity: Literal["prb"] | None = Field(None, description="model: rigid links with springs")

    @model_validator(mode="after")
    def _ranges_increase(self) -> Self:
        for name in ("angle", "travel"):
            ends = getattr(self, name)
            if ends is not None and not ends[0] < ends[1]:
                raise ValueError(f"'{name}' must be increasing")
        return self


class SliderCrankSpec(Spec):
    """A slider-crank with springs at its joints."""

    family: Literal["slider-crank"]
    mechanism: Mechanism
    analysis: CrankAnalysis = Field(default_factory=CrankAnalysis, description="how it is run")
