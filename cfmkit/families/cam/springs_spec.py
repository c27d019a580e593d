"""Specification of the springs of a cam mechanism."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from cfmkit.specs.spec import Model, NonNegativeLength, PositiveLength
from cfmkit.specs.units import Stiffness
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.spec import InitialTension, Life, PartName, StatedWire, block_of, settle_rate

if TYPE_CHECKING:
    from cfmkit.stock.springs.offers import Offer

PositiveStiffness = Annotated[Stiffness, Field(gt=0)]


class Springs(Model):
    """Springs in parallel between the two roller axes."""

    stiffness: PositiveStiffness | tuple[PositiveStiffness, ...] | None = Field(
        None, description="of one spring, or a list with the measured value of each; default: from 'wound'"
    )
    count: int | None = Field(
        None, ge=1, le=1000, description="number of equal springs; default 1, or the list's length"
    )
    preload: NonNegativeLength | None = Field(
        None, description="elongation of the springs at the start, with the rollers at `rest_half_width`; default 0"
    )
    rest_length: PositiveLength | None = Field(
        None, description="instead of `preload`: distance of the roller axes at which the springs are at rest"
    )
    initial_tension: InitialTension = 0.0
    max_elongation: PositiveLength | None = Field(None, description="largest elongation allowed for a spring")
    name: PartName = None
    wound: StatedWire = None
    life: Life | None = None

    @model_validator(mode="after")
    def _rate_is_known(self, info: ValidationInfo) -> Self:
        settle_rate(self, ExtensionSpring, info)
        return self

    @model_validator(mode="after")
    def _one_way_to_say_preload(self) -> Self:
        if self.preload is not None and self.rest_length is not None:
            raise ValueError("'preload' and 'rest_length' say the same: give one of them")
        return self

    @model_validator(mode="after")
    def _count_fits_the_list(self) -> Self:
        if isinstance(self.stiffness, tuple):
            if not self.stiffness:
                raise ValueError("'stiffness' needs at least one value")
            if self.count not in (None, len(self.stiffness)):
                raise ValueError(f"'count' is {self.count} but 'stiffness' lists {len(self.stiffness)} springs")
        return self

    @classmethod
    def from_offer(cls, offer: Offer, count: int) -> Self:
        """Return some springs of one that is on offer."""
        values = {"stiffness": offer.rate, "count": count, "max_elongation": offer.largest}
        return cls.model_validate(block_of(offer, initial_tension=offer.initial_tension or None, **values))

    @property
    def each(self) -> float | tuple[float, ...]:
        """Stiffness of one spring, or of each, [N/m]."""
        return 0.0 if self.stiffness is None else self.stiffness

    @property
    def rates(self) -> tuple[float, ...]:
        """Stiffness of every one of the springs [N/m]."""
        return self.each if isinstance(self.each, tuple) else (self.each,) * self.number

    @property
    def number(self) -> int:
        """Number of springs."""
        return len(self.each) if isinstance(self.each, tuple) else 1 if self.count is None else self.count

    @property
    def total(self) -> float:
        """K, the sum of all parallel springs [N/m]."""
        return sum(self.each) if isinstance(self.each, tuple) else self.each * self.number

    @property
    def stiffest(self) -> float:
        """Stiffness of the stiffest spring [N/m]."""
        return reduce(np.maximum, self.each) if isinstance(self.each, tuple) else self.each

    @property
    def tension_stretch(self) -> float:
        """Elongation at which springs without initial tension would pull as hard as these when they open [m]."""
        if not np.any(self.initial_tension):
            return 0.0
        return self.number * self.initial_tension / self.total

    def scaled_to(self, total: float) -> Springs:
        """Return springs of the same number whose stiffness adds up to `total` [N/m]: of another wire, if of any.

        Their initial tension is in proportion, if they have any.
        """
        made: dict[str, Any] = {} if self.wound is None else {"wound": None, "name": None, "life": None}
        if self.initial_tension:
            made["initial_tension"] = self.initial_tension * total / self.total
        if isinstance(self.stiffness, tuple):
            values = tuple(value * total / self.total for value in self.stiffness)
            return self.model_copy(update={"stiffness": values} | made)
        return self.model_copy(update={"stiffness": total / (self.count or 1)} | made)
