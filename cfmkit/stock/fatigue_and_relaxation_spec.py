"""Fatigue and relaxation of a material as a specification states them, and as they are assumed otherwise."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, model_validator

from cfmkit.metrics.fatigue_and_relaxation import FatigueLaw, RelaxationLaw
from cfmkit.specs.spec import Model
from cfmkit.specs.units import Ratio, Stress, Time, format_short
from cfmkit.stock.materials import ASSUMED_DATA, LastingData

PositiveStress = Annotated[Stress, Field(gt=0)]
PositiveTime = Annotated[Time, Field(gt=0)]
PositiveRatio = Annotated[Ratio, Field(gt=0, lt=1)]
PositiveNumber = Annotated[float, Field(gt=0)]


class Fatigue(Model):
    """Fatigue of a material: S-N points or Basquin's line, with Goodman's line for the mean stress."""

    points: tuple[tuple[PositiveNumber, PositiveStress], ...] | None = Field(
        None, min_length=2, description="S-N points [[cycles, amplitude], ...], fully reversed, cycles increasing"
    )
    coefficient: PositiveStress | None = Field(None, description="instead of points: s_f' of Basquin's s_f' (2 N)^b")
    exponent: Annotated[Ratio, Field(gt=-1, lt=0)] | None = Field(None, description="b of the same, negative")
    ultimate_strength: PositiveStress = Field(description="s_u, at which Goodman's line ends")
    cycles: Annotated[float, Field(gt=0)] | None = Field(
        None,
        description="required life in cycles: the allowable stress is then at most the one that "
        "can be applied so often, from 0 and back",
    )
    source: str | None = Field(None, max_length=300, description="where the values were read")

    @model_validator(mode="after")
    def _one_line(self) -> Self:
        basquin = self.coefficient is not None and self.exponent is not None
        if (self.coefficient is None) != (self.exponent is None):
            raise ValueError("'coefficient' and 'exponent' belong together")
        if basquin == (self.points is not None):
            raise ValueError("give either 'points' or 'coefficient' and 'exponent'")
        for (before, above), (after, below) in pairwise(self.points or ()):
            if after <= before or below > above:
                raise ValueError("'points' must have increasing cycles and amplitudes that do not rise")
        if self.points is not None:
            self._require_range_of_points(self.points)
        return self

    def _require_range_of_points(self, points: tuple[tuple[float, float], ...]) -> None:
        """Raise if an amplitude is more than the material bears once, or more cycles are wanted than were shown."""
        if points[0][1] > self.ultimate_strength:
            reported = (
                f"{format_short(points[0][1], 'stress')} is above {format_short(self.ultimate_strength, 'stress')}"
            )
            raise ValueError(f"an amplitude of 'points' is above 'ultimate_strength': {reported}")
        if self.cycles is not None and self.cycles > points[-1][0] * (1 + 1e-12):
            raise ValueError(
                f"'cycles' is {self.cycles:g}, more than the {points[-1][0]:g} at which 'points' end: add points, or "
                "give Basquin's line"
            )

    @property
    def law(self) -> FatigueLaw:
        """The same as numbers."""
        line = None if self.coefficient is None or self.exponent is None else (self.coefficient, self.exponent)
        return FatigueLaw(self.points or (), line, self.ultimate_strength)

    @classmethod
    def from_law(cls, law: FatigueLaw) -> Self:
        """Return a law as a specification says it."""
        coefficient, exponent = law.basquin or (None, None)
        return cls(
            points=law.points or None, coefficient=coefficient, exponent=exponent, ultimate_strength=law.ultimate
        )


class Relaxation(Model):
    """Relaxation of the modulus while a strain is held: Prony terms, or the modulus at some times."""

    terms: tuple[tuple[PositiveRatio, PositiveTime], ...] | None = Field(
        None, min_length=1, description="Prony terms [[share, relaxation time], ...]: [[20 %, 10 h], [15 %, 500 h]]"
    )
    points: tuple[tuple[Annotated[Time, Field(ge=0)], PositiveStress], ...] | None = Field(
        None, min_length=2, description="or the modulus after some times [[0 h, 1.5 GPa], [1000 h, 1.1 GPa]]"
    )
    hold: tuple[PositiveTime, ...] = Field(
        (3.6e6,), min_length=1, description="after which the force is reported as `force_after[...]`; default: 1000 h"
    )
    temperature: str | None = Field(None, max_length=100, description="of the data, in words")
    source: str | None = Field(None, max_length=300, description="where the values were read")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.terms is None) == (self.points is None):
            raise ValueError("give either 'terms' or 'points'")
        if self.terms is not None and sum(share for share, _ in self.terms) >= 1:
            raise ValueError("the shares of 'terms' must add up to less than 100 %: part of the modulus must remain")
        for (before, above), (after, below) in pairwise(self.points or ()):
            if after <= before or below > above:
                raise ValueError("'points' must have increasing times and moduli that do not rise")
        return self

    @property
    def law(self) -> RelaxationLaw:
        """The same as numbers."""
        return RelaxationLaw(self.terms or (), self.points or ())


def assumed_laws(name: str) -> dict[str, Fatigue | Relaxation]:
    """Return what is assumed of a material of the library, by the key that states it."""
    result, laws = ASSUMED_DATA.get(name, LastingData()), dict[str, Fatigue | Relaxation]()
    if (last := result.fatigue) is not None:
        laws["fatigue"] = Fatigue(points=last.points, ultimate_strength=last.ultimate_strength, source=last.source)
    if (creep := result.relaxation) is not None:
        laws["relaxation"] = Relaxation(points=creep.points, temperature=creep.temperature, source=creep.source)
    return laws
