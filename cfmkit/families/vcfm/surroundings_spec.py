"""Specification of what stands around leaves: their cut with its frame, and springs that are bought."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from cfmkit.specs.spec import NonNegativeLength, PositiveLength
from cfmkit.specs.units import Stiffness
from cfmkit.stock.material_and_part_spec import CutPart, PartFrame, RoundedCorners
from cfmkit.stock.springs.compression_springs import CompressionSpring
from cfmkit.stock.springs.kinds import AXIAL_KINDS
from cfmkit.stock.springs.spec import InitialTension, Life, PartName, StatedWire, settle_rate
from cfmkit.stock.springs.support_spec import BuiltInSpring

if TYPE_CHECKING:
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring

    AxialKind = str
else:
    AxialKind = Literal[tuple(AXIAL_KINDS)]


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
        return min(float(strip.thickness) for strip in (self.bistable, self.positive) if strip is not None)


class BoughtSprings(BuiltInSpring):
    """Equal helical springs side by side, in place of leaves: the preload moves their far ends.

    Compression springs stand below the shuttle, extension springs hang above it; neither carries anything where it is
    shorter (longer) than relaxed, and all are relaxed when unloaded.
    """

    kind: AxialKind = Field(CompressionSpring.kind, description="how they are loaded")
    stiffness: Annotated[Stiffness, Field(gt=0)] | None = Field(None, description="of one; default: from 'wound'")
    count: int = Field(1, ge=1, le=1000, description="how many in parallel")
    initial_tension: InitialTension = 0.0
    max_elongation: PositiveLength | None = Field(
        None, description="largest elongation (or compression) allowed for a spring"
    )
    free_length: PositiveLength | None = Field(
        None, description="relaxed length, for drawings and for the space required"
    )
    body_length: PositiveLength | None = Field(
        None, description="with the turns touching; default: of closed ends, from 'wound'"
    )
    outer_diameter: PositiveLength | None = Field(None, description="of the coil, for the same")
    name: PartName = None
    wound: StatedWire = None
    life: Life | None = None

    @model_validator(mode="after")
    def _rate_is_known(self, info: ValidationInfo) -> Self:
        settle_rate(self, self.spring_type, info)
        self.check_guide(self.spring_type, self.coil, self.outer_diameter)
        return self

    @property
    def spring_type(self) -> type[HelicalSpring]:
        """Their kind."""
        return AXIAL_KINDS[self.kind]

    @property
    def hang(self) -> bool:
        """True if they hang above the shuttle and are pulled; else they stand below it."""
        return self.spring_type.lengthening > 0

    @property
    def rate(self) -> float:
        """Stiffness of one [N/m]."""
        return self.stiffness or 0.0

    def load(self, deflection: float) -> float:
        """Return the load of one at a deflection [N]: none where it is relaxed, whatever its initial tension."""
        return self.initial_tension * (deflection > 0) + self.rate * max(deflection, 0.0)
