"""Specification of the cut of leaves and spring, and of the frame around them."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from cfmkit.specs.spec import NonNegativeLength, PositiveLength
from cfmkit.stock.material_and_part_spec import CutPart, PartFrame, RoundedCorners


class StandingFrame(PartFrame):
    """Frame: it joins the walls, stops the shuttle and holds the preload of the spring."""

    stop: PositiveLength | None = Field(
        None, description="travel at which a bar across the shuttle's top lands on the walls; default: no stop"
    )
    seat: NonNegativeLength | None = Field(
        None, description="preload of the spring when seated on the ground below the shuttle; default: no seat"
    )


class VcfmPart(CutPart):
    """Cut of both parts, and what of them stands."""

    frame: StandingFrame | None = Field(
        None, description="{wall, shuttle, ground, stop, seat}: thicknesses, a stop of the travel, a seat of the spring"
    )


class CutLeaves(RoundedCorners):
    """Part of a mechanism of `bistable` leaves and, unless it is bought, a `positive` spring."""

    default_part = VcfmPart

    @property
    def thinnest(self: Any) -> float:
        """Smallest thickness of all leaves that are cut [m]."""
        return min(float(one.thickness) for one in (self.bistable, self.positive) if one is not None)
