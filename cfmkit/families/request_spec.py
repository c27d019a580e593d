"""Block `suggest` of a specification: requirements of a mechanism, their checks, and the request that they make."""

from __future__ import annotations

from collections.abc import Sequence  # noqa: TC003  read when the program runs
from typing import Annotated, Any, ClassVar, Literal, Self, TypedDict

from pydantic import Field, ValidationError, field_validator, model_validator

from cfmkit.families.request_options import RequestOption, write_band, write_envelope, write_list
from cfmkit.specs.spec import Model, PositiveForce, PositiveLength, Spec, refuse
from cfmkit.specs.units import Angle, Ratio, Torque, format_short
from cfmkit.stock.material_and_part_spec import MaterialField, MaterialSpec, SafetyFactor
from cfmkit.stock.processes import PROCESSES_BY_NAME, ProcessName, why_not_made

PositiveTorque = Annotated[Torque, Field(gt=0)]
PositiveAngle = Annotated[Angle, Field(gt=0)]
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

Springs = Literal["catalogue", "custom"]  # springs as they are sold, or made to a wire, a coil and a number of turns
Prefer = Literal["size", "ripple", "parts", "stress", "depth"]


class SuggestBlock(Model):
    """Requirements of a mechanism. Force with travel, or torque with angle; every number is a hard limit."""

    removed_keys: ClassVar[dict[str, str]] = {"room": "write 'envelope'"}

    force: Annotated[
        PositiveForce | tuple[PositiveForce, PositiveForce] | None,
        RequestOption("FORCE", "Constant force, '20 N', or a band, '19 N, 21 N'.", write_band),
    ] = Field(None, description="force to keep constant; or a band that contains every force: [19 N, 21 N]")
    torque: Annotated[
        PositiveTorque | tuple[PositiveTorque, PositiveTorque] | None,
        RequestOption("TORQUE", "Constant torque, '100 N*mm', or a band.", write_band),
    ] = Field(None, description="torque at a crank to keep constant; or a band that contains every torque")
    travel: Annotated[
        PositiveLength | None, RequestOption("LENGTH", "Travel over which the force is to be constant.")
    ] = Field(None, description="over which the force is constant")
    angle: Annotated[PositiveAngle | None, RequestOption("ANGLE", "Angle over which the torque is to be constant.")] = (
        Field(None, description="over which the torque is constant")
    )
    ripple: Annotated[Share, RequestOption("SHARE", "Largest (max - min)/max over the travel; default: 5 %.")] = Field(
        DEFAULT_RIPPLE, description="largest (max - min)/max over the travel, in each direction"
    )
    envelope: Annotated[
        tuple[PositiveLength, ...],
        RequestOption(
            "AxBxCmm", "Space available: across the travel, along it, and the depth (optional).", write_envelope
        ),
    ] = Field(
        min_length=2,
        max_length=3,
        description="box that it stays in, pressed or not, frame included: across the travel, along it, and the depth, "
        "which may be left out",
    )
    material: Annotated[
        MaterialField | Annotated[tuple[MaterialField, ...], Field(min_length=1)] | None,
        RequestOption("A,B", "Permitted materials; `cfmkit show materials` lists them. Repeatable.", write_list, True),
    ] = Field(None, description="allowed materials: names from `show materials`, or values")
    process: Annotated[
        ProcessName | None, RequestOption("NAME", "Manufacturing process: fdm, sls, laser, wire-edm or mill.")
    ] = Field(
        None, description="manufacturing process: determines the thinnest leaf, and the materials if none are stated"
    )
    adjustable: Annotated[
        tuple[PositiveForce, PositiveForce] | None,
        RequestOption("A,B", "Lowest and highest adjustable force: 15N,25N.", write_list),
    ] = Field(None, description="lowest and highest force of the adjustment")
    overload: Annotated[
        PositiveForce | None,
        RequestOption("FORCE", "Force to bear at the end of the travel, by a rigid end stop: '60 N'."),
    ] = Field(
        None,
        description="force along the travel that it has to bear at its end: a rigid end stop behind the travel carries "
        "what is above its own force",
    )
    hysteresis: Annotated[
        Share | None, RequestOption("SHARE", "Largest energy loss of a cycle, as a share of its work.")
    ] = Field(None, description="largest energy loss of a cycle, as a share of its work")
    springs: Annotated[
        Springs | None, RequestOption("KIND", "Helical springs it may have: catalogue or custom; default: either.")
    ] = Field(None, description="helical springs that it may have; default: either")
    safety: Annotated[
        SafetyFactor, RequestOption("FACTOR", "Least safety factor of stresses, against yield; default: 1.5.")
    ] = Field(DEFAULT_SAFETY, description="least safety factor of stresses, against yield")
    cycles: Annotated[
        Annotated[int, Field(ge=1)] | None,
        RequestOption("N", "Required life in cycles; judged for materials with fatigue data."),
    ] = Field(None, description="required life in cycles; checked for materials with `fatigue` data")
    min_yield: Annotated[
        Share | None,
        RequestOption("SHARE", "Required share of manufactured parts that meet the requirements."),
    ] = Field(
        None,
        alias="yield",
        description="share of manufactured parts that must meet all requirements, with the tolerances assumed for the "
        "process",
    )
    prefer: Annotated[
        tuple[Prefer, ...],
        RequestOption(
            "A,B", "Ranking, most important first: size,ripple,parts,stress,depth. Repeatable.", write_list, True
        ),
    ] = Field(("size", "ripple", "parts", "stress"), description="criteria for the order of the proposals")

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
            motion = "a travel" if wanted == "travel" else "an angle"
            raise ValueError(f"a {what} is constant over {motion}: '{unused}' does not go with '{what}'")
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
        reasons = [why_not_made(self.process, material.name, material.modulus) for material in self._stated_materials]
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
        for material in self._stated_materials:
            fatigue = material.fatigue
            if self.cycles is None or fatigue is None:
                continue
            try:
                type(fatigue).model_validate(fatigue.model_dump(exclude_unset=True) | {"cycles": float(self.cycles)})
            except ValidationError as error:
                refuse("SuggestBlock", {("cycles",): error.errors()[0]["msg"].removeprefix("Value error, ")})
        return self

    @property
    def _stated_materials(self) -> tuple[MaterialSpec, ...]:
        if self.material is None:
            return ()
        return self.material if isinstance(self.material, tuple) else (self.material,)

    @property
    def materials(self) -> tuple[MaterialSpec, ...]:
        """Materials that are allowed: those that are usual for the process if none are stated."""
        usual = USUAL_MATERIALS[self.process] if self.process else ()
        return self._stated_materials or tuple(MaterialSpec(name=name) for name in usual)

    def state_for_cycles(self, entry: MaterialSpec) -> dict[str, Any]:
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

    def as_written(self) -> dict[str, Any]:
        """Return the keys that are stated, as files have them."""
        return self.model_dump(mode="json", exclude_unset=True, by_alias=True)

    @classmethod
    def options(cls) -> dict[str, RequestOption]:
        """Return the options of the command line, by field; option and key have the alias of a field if it has one."""
        return {
            name: option
            for name, field in cls.model_fields.items()
            for option in field.metadata
            if isinstance(option, RequestOption)
        }

    @classmethod
    def key_of(cls, name: str) -> str:
        """Return the key of a file that a field stands for."""
        return cls.model_fields[name].alias or name


class RequestArguments(TypedDict, total=False):
    """Keys of a request as arguments of a function: text with a unit, or a number of what has none."""

    force: str | Sequence[str] | None
    torque: str | Sequence[str] | None
    travel: str | None
    angle: str | None
    ripple: str | float | None
    envelope: Sequence[str] | None
    material: str | Sequence[str] | None
    process: str | None
    adjustable: Sequence[str] | None
    hysteresis: str | float | None
    springs: str | None
    safety: str | float | None
    cycles: int | None
    min_yield: str | float | None
    overload: str | None
    prefer: Sequence[str] | None


class ProposedSpec(Spec):
    """A specification that `suggest` may write."""

    suggest: SuggestBlock | None = Field(
        None, description="requirements that it was proposed for; `cfmkit suggest` takes the file with them"
    )


class SuggestFile(Model):
    """A file with a block `suggest`."""

    removed_keys: ClassVar[dict[str, str]] = {"wish": "write 'suggest'"}

    cfmkit: Literal[1] = Field(1, description="schema version")
    suggest: SuggestBlock = Field(description="what is wanted")
