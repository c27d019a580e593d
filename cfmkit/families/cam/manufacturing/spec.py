"""What a specification may say about the errors of manufacturing."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from cfmkit.specs.spec import Model
from cfmkit.specs.units import Angle, Length


class Manufacturing(Model):
    """Standard deviations of the errors with which flanks are cut, each flank drawn by itself."""

    waviness: Annotated[Length, Field(ge=0)] = Field(0.0, description="of the flank's distance from the design")
    wavelength: Annotated[Length, Field(gt=0)] = Field(0.010, description="of the shortest waves")
    offset: Annotated[Length, Field(ge=0)] = Field(0.0, description="of the material left on a whole flank")
    angle: Annotated[Angle, Field(ge=0)] = Field(0.0, description="of the angle at which a flank is cut")
    samples: int = Field(200, ge=10, le=100_000, description="cams that are drawn")
