"""What a specification of oblique springs may say."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from cfmkit.specs.spec import Analysis, DesignBlock, Model, NonNegativeLength, PositiveForce, PositiveLength, Spec
from cfmkit.specs.units import Ratio, Stiffness


class Coil(Model):
    """One spring, relaxed in the upper position of the slider."""

    stiffness: Annotated[Stiffness, Field(gt=0)] = Field(description="of this spring alone")
    free_length: PositiveLength = Field(description="when nothing presses it")
    solid_length: NonNegativeLength = Field(0.0, description="at which its coils touch")

    @model_validator(mode="after")
    def _can_be_compressed(self) -> Self:
        if self.solid_length >= self.free_length:
            raise ValueError("'solid_length' must be below 'free_length'")
        return self


class Mechanism(Model):
    """A slider between two anchors."""

    half_span: PositiveLength = Field(description="from the slider's path to either anchor")
    oblique: Coil = Field(description="each of the two springs from an anchor to the slider")
    vertical: Coil = Field(description="the spring below the slider")

    @model_validator(mode="after")
    def _oblique_springs_are_compressed(self) -> Self:
        if self.oblique.free_length <= self.half_span:
            raise ValueError("'oblique.free_length' must be above 'half_span': else nothing pushes the slider apart")
        return self


class ObliqueDesign(DesignBlock):
    """A force that stays constant over a range."""

    force: PositiveForce = Field(description="where the oblique springs lie flat")
    range: PositiveLength = Field(description="of displacements around that place, half of it to each side")
    tolerance: Annotated[Ratio, Field(gt=0, lt=1)] = Field(0.01, description="largest departure from the force there")
    height_max: PositiveLength | None = Field(None, description="from the anchors up to the relaxed slider, at most")


class ObliqueAnalysis(Analysis):
    """How oblique springs are run."""

    travel: PositiveLength | None = Field(None, description="default: down to the mirror image of the upper position")
    fidelity: Literal["cubic", "exact"] = Field("exact", description="the paper's cubic, or the springs as they are")


class ObliqueSpec(Spec):
    """Two oblique springs and a vertical one."""

    family: Literal["oblique"]
    mechanism: Mechanism
    design: ObliqueDesign | None = Field(None, description="what `cfmkit design` is to reach")
    analysis: ObliqueAnalysis = Field(default_factory=ObliqueAnalysis, description="how it is run")
