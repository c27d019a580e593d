"""Block `suggest` of a specification: requirements of a mechanism, their checks, and the request that they make."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, ValidationError, field_validator, model_validator

from cfmkit.families.base import article
from cfmkit.families.proposals import Request, Springs
from cfmkit.specs.spec import Model, PositiveForce, PositiveLength, refuse
from cfmkit.specs.units import Angle, Ratio, Torque, format_short
from cfmkit.stock.material_and_part_spec import MaterialField, MaterialSpec, SafetyFactor
from cfmkit.stock.processes import PROCESSES_BY_NAME, ProcessName, why_not_made

PositiveTorque = Annotated[Torque, Field(gt=0)]
Share = Annotated[Ratio, Field(gt=0, lt=1)]

MEAN_TOL = 0.025  # how far the mean may be from a force that is required as a number; who wants less gives a band
DEFAULT_RIPPLE = 0.05  # ripple where none is required
DEFAULT_SAFETY = 1.5
"""Safety factor where none is required: usual for parts whose material and loads are known on average."""
USUAL_MATERIALS: dict[str, tuple[str, ...]] = {
    "fdm": ("pla", "petg", "abs"),
    "sls": ("pa12-sls",),
    "laser": ("pom",),
    "wire-edm": ("aluminium-7075-t6", "titanium-6al-4v", "steel-1.4310"),
    "mill": ("pom", "aluminium-7075-t6"),
}
"""What is made by a process where the request names no material."""

Prefer = Literal["size", "ripple", "parts", "stress", "depth"]


class SuggestBlock(Model):
    """Requirements of a mechanism. Force with travel, or torque with angle; every number is a hard limit."""

    removed_keys: ClassVar[dict[str, str]] = {"room": "write 'envelope'"}

    force: PositiveForce | tuple[PositiveForce, PositiveForce] | None = Field(
        None, description="force to keep constant; or a band that contains every force: [19 N, 21 N]"
    )
    torque: PositiveTorque | tuple[PositiveTorque, PositiveTorque] | None = Field(
        None, description="torque at a crank to keep constant; or a band that contains every torque"
    )
    travel: PositiveLength | None = Field(None, description="over which the force is constant")
    angle: Annotated[Angle, Field(gt=0)] | None = Field(None, description="over which the torque is constant")
    ripple: Share = Field(DEFAULT_RIPPLE, description="largest (max - min)/max over the travel, in each direction")
    envelope: tuple[PositiveLength, ...] = Field(
        min_length=2,
        max_length=3,
        description="box that it stays in, pressed or not, frame included: across the travel, along it, and the depth, "
        "which may be left out",
    )
    material: MaterialField | Annotated[tuple[MaterialField, ...], Field(min_length=1)] | None = Field(
        None, description="allowed materials: names from `show materials`, or values"
    )
    process: ProcessName | None = Field(
        None, description="manufacturing process: determines the thinnest leaf, and the materials if none are stated"
    )
    adjustable: tuple[PositiveForce, PositiveForce] | None = Field(
        None, description="lowest and highest force of the adjustment"
    )
    overload: PositiveForce | None = Field(
        None,
        description="force along the travel that it has to bear at its end: a rigid end stop behind the travel carries "
        "what is above its own force",
    )
    hysteresis: Share | None = Field(None, description="largest energy loss of a cycle, as a share of its work")
    springs: Springs | None = Field(None, description="helical springs that it may have; default: either")
    safety: SafetyFactor = Field(DEFAULT_SAFETY, description="least safety factor of stresses, against yield")
    cycles: Annotated[int, Field(ge=1)] | None = Field(
        None, description="required life in cycles; checked for materials with `fatigue` data"
    )
    made_well: Share | None = Field(
        None,
        alias="yield",
        description="share of manufactured parts that must meet all requirements, with the tolerances assumed for the "
        "process",
    )
    prefer: tuple[Prefer, ...] = Field(
        ("size", "ripple", "parts", "stress"), description="criteria for the order of the proposals"
    )

    @field_validator("force", "torque", "adjustable")
    @classmethod
    def _increasing(cls, value: Any) -> Any:
        if isinstance(value, tuple) and not value[0] < value[1]:
            raise ValueError("a range has to increase: the smaller value first")
        return value

    @model_validator(mode="after")
    def _is_one_request(self) -> Self:
        if (self.force is None) == (self.torque is None):
            raise ValueError("give either 'force' (with 'travel') or 'torque' (with 'angle')")
        wanted, unused = ("travel", "angle") if self.force is not None else ("angle", "travel")
        what = "force" if self.force is not None else "torque"
        if getattr(self, unused) is not None:
            raise ValueError(
                f"a {what} is constant over {article(wanted)} {wanted}: '{unused}' does not go with '{what}'"
            )
        if getattr(self, wanted) is None:
            raise ValueError(f"'{wanted}' is missing: over which the {what} is constant")
        return self

    @model_validator(mode="after")
    def _fits_itself(self) -> Self:
        if self.travel is not None and self.travel >= self.envelope[1]:
            reported = (
                f"a travel of {format_short(self.travel, 'length')} does not fit into the second side of the envelope, "
            )
            refuse("SuggestBlock", {("travel",): reported + format_short(self.envelope[1], "length")})
        if self.adjustable is not None:
            if self.force is None:
                refuse("SuggestBlock", {("adjustable",): "goes with 'force' only"})
            low, high = self.ends
            if not self.adjustable[0] <= high or not low <= self.adjustable[1]:
                refuse("SuggestBlock", {("adjustable",): "the force required is not in this range"})
        if self.overload is not None:
            if self.force is None:
                refuse("SuggestBlock", {("overload",): "goes with 'force' only"})
            largest = max((self.ends[1], *(self.adjustable or ())))
            if self.overload <= largest:
                texts = format_short(self.overload, "force"), format_short(largest, "force")
                refuse("SuggestBlock", {("overload",): f"{texts[0]} is not above the largest own force, {texts[1]}"})
        return self

    @model_validator(mode="after")
    def _can_be_made(self) -> Self:
        if self.process is None:
            return self
        reasons = [why_not_made(self.process, material.name, material.modulus) for material in self._materials]
        if reported := "; ".join(dict.fromkeys(filter(None, reasons))):
            refuse("SuggestBlock", {("process",): reported})
        least = PROCESSES_BY_NAME[self.process].least_feature
        for number, side in enumerate(self.envelope):
            if side < least * (1.0 - 1e-9):
                name = ("first side", "second side", "depth")[number]
                sizes = format_short(side, "length"), format_short(least, "length")
                reported = f"the {name}, {sizes[0]}, is below the thinnest wall of {self.process}, {sizes[1]}"
                refuse("SuggestBlock", {("envelope", number): reported})
        return self

    @model_validator(mode="after")
    def _lasts_as_long_as_materials_are_known(self) -> Self:
        for material in self._materials:
            fatigue = material.fatigue
            if self.cycles is None or fatigue is None:
                continue
            try:
                type(fatigue).model_validate(fatigue.model_dump(exclude_unset=True) | {"cycles": float(self.cycles)})
            except ValidationError as error:
                refuse("SuggestBlock", {("cycles",): error.errors()[0]["msg"].removeprefix("Value error, ")})
        return self

    @property
    def _materials(self) -> tuple[MaterialSpec, ...]:
        if self.material is None:
            return ()
        return self.material if isinstance(self.material, tuple) else (self.material,)

    def _state_material(self, entry: MaterialSpec) -> dict[str, Any]:
        """Return a material as a specification states it; with S-N data, assumed ones too, for the requested cycles."""
        block = entry.model_dump(exclude_unset=True)
        law = entry.fatigue
        if self.cycles is None or law is None or (law.points is not None and self.cycles > law.points[-1][0]):
            return block
        return block | {"fatigue": law.model_dump(exclude_unset=True) | {"cycles": float(self.cycles)}}

    @property
    def ends(self) -> tuple[float, float]:
        """The band in which every force has to lie, or of what the mean may be [N or N m]."""
        value: Any = self.force if self.force is not None else self.torque
        return value if isinstance(value, tuple) else (value * (1.0 - MEAN_TOL), value * (1.0 + MEAN_TOL))

    def request(self) -> Request:
        """Return the same as families know it."""
        value: Any = self.force if self.force is not None else self.torque
        usual = USUAL_MATERIALS[self.process] if self.process else ()
        materials = self._materials or tuple(MaterialSpec(name=name) for name in usual)
        blocks = tuple(self._state_material(material) for material in materials)
        low, high = self.ends
        derived: dict[str, Any] = {
            "kind": "force" if self.force is not None else "torque",
            "target": _middle(low, high) if isinstance(value, tuple) else value,
            "low": low,
            "high": high,
            "banded": isinstance(value, tuple),
            "travel": float(self.travel if self.travel is not None else self.angle or 0.0),
            "materials": blocks,
            "good_parts": self.made_well,
        }
        if self.process:
            derived["thinnest"] = PROCESSES_BY_NAME[self.process].least_feature
        # every other key goes on under its own name
        names = {field.name for field in fields(Request)} & type(self).model_fields.keys() - derived.keys()
        return Request(**{name: getattr(self, name) for name in names}, **derived)


def _middle(low: float, high: float) -> float:
    """Return what designs in a band aim at: the middle, of a band over more than an octave that of its logarithm."""
    return math.sqrt(low * high) if high > 2.0 * low else 0.5 * (low + high)


class SuggestFile(Model):
    """A file with a block `suggest`."""

    removed_keys: ClassVar[dict[str, str]] = {"wish": "write 'suggest'"}

    cfmkit: Literal[1] = Field(1, description="schema version")
    suggest: SuggestBlock = Field(description="what is wanted")
