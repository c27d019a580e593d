"""How leaves and spring are cut, and what stands around them, in a specification."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from cfmkit.specs.spec import NonNegativeLength, PositiveLength
from cfmkit.stock.material_and_part_spec import CutPart, PartFrame, RoundedCorners


class StandingFrame(PartFrame):
    """What joins the walls, stops the shuttle and holds the preload of the spring."""

    stop: PositiveLength | None = Field(
        None, description="travel at which a bar across the shuttle's top lands on the walls; default: no stop"
    )
    seat: NonNegativeLength | None = Field(
        None, description="preload of the spring when seated on the ground below the shuttle; default: no seat"
    )


class VcfmPart(CutPart):
    """How both parts are cut, and what of them stands."""

    frame: StandingFrame | None = Field(
        None, description="{wall, shuttle, ground, stop, seat}: thicknesses, a stop of the travel, a seat of the spring"
    )


class CutLeaves(RoundedCorners):
    """What a mechanism of `bistable` leaves, and a `positive` spring unless that is bought, knows of its part."""

    @property
    def thinnest(self: Any) -> float:
        """Smallest thickness of all leaves that are cut [m]."""
        return min(float(one.thickness) for one in (self.bistable, self.positive) if one is not None)
