"""How every family's specification says what a part is made of, and how much of its strength may be used.

One grammar: a name from the library, a block of values, or a name with some of its values changed; and one for how
a part is cut, and for plain pins and guides that rub.
One rule: the allowable stress is the yield strength over `safety_factor`, which is 1 unless given.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from cfmkit.specs.spec import Model, refuse
from cfmkit.specs.units import Force, Length, Ratio, Stress, format_short
from cfmkit.specs.units.fields import described
from cfmkit.stock.materials import UnknownMaterial, material

if TYPE_CHECKING:
    from collections.abc import Mapping


PositiveStress = Annotated[Stress, Field(gt=0)]
SafetyFactor = Annotated[Ratio, Field(ge=1, description="allowable stress: yield strength over this; 1 unless given")]

_POISSON_RATIO = 0.3
"""Of a material described by its values alone: between that of metals and that of plastics."""


class MaterialSpec(Model):
    """A material: a name from `show materials`, own values, or a name with some of its values changed.

    What a name stands for is filled in, so that every value is there to be used and varied. Only what was written
    counts as set: with another name come that material's values.
    """

    name: str | None = Field(None, description="a name from `show materials`")
    youngs_modulus: PositiveStress | None = Field(None, description="E; default: the named material's")
    poisson_ratio: Annotated[Ratio, Field(gt=-1, le=0.5)] | None = Field(
        None, description="for the shear stiffness; default: the named material's, else 0.3"
    )
    yield_strength: PositiveStress | None = Field(
        None, description="for the allowable stress; default: the named material's, if known"
    )

    @model_validator(mode="after")
    def _filled_in(self) -> Self:
        given: dict[str, float | None] = {"poisson_ratio": _POISSON_RATIO}
        if self.name is not None:
            try:
                known = material(self.name)
            except UnknownMaterial as error:
                refuse("Material", {("name",): str(error)})
                raise
            given = {key: getattr(known, key) for key in ("youngs_modulus", "poisson_ratio", "yield_strength")}
        elif self.youngs_modulus is None:
            raise ValueError("needs 'name' or 'youngs_modulus'")
        for key, value in given.items():
            if getattr(self, key) is None:
                object.__setattr__(self, key, value)  # past the frozen model, and not counted as set
        return self

    @property
    def modulus(self) -> float:
        """Young's modulus E [Pa]."""
        return float(self.youngs_modulus or 0.0)

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""
        return _POISSON_RATIO if self.poisson_ratio is None else self.poisson_ratio

    @property
    def words(self) -> str:
        """What it is in words: its name, if it has one, its modulus, and its strength, if that is known."""
        values = f"E {format_short(self.modulus, 'stress')}"
        if self.yield_strength is not None:
            values += f", yield {format_short(self.yield_strength, 'stress')}"
        return f"{self.name}: {values}" if self.name else values

    def allowable(self, safety_factor: float) -> float | None:
        """Return the yield strength over a safety factor [Pa]; None where no strength is known."""
        return None if self.yield_strength is None else self.yield_strength / safety_factor


Friction = Annotated[Ratio, Field(ge=0, lt=1)]


class Pins(Model):
    """Plain pins that rub as the parts on them turn."""

    diameter: Annotated[Length, Field(gt=0)] = Field(description="of the pins")
    friction: Friction = Field(0.0, description="Coulomb friction in them")


class Guide(Model):
    """The slider's way: what it takes from the force."""

    friction: Friction = Field(0.0, description="Coulomb friction on what the slider presses across its way")
    drag: Annotated[Force, Field(ge=0)] = Field(0.0, description="friction without load: seals, preload")
    length: Annotated[Length, Field(gt=0)] | None = Field(
        None, description="of the guide, between its ends; needed for 'offset'"
    )
    offset: Annotated[Length, Field(ge=0)] = Field(
        0.0, description="distance of the force's line from the guide's middle"
    )

    @model_validator(mode="after")
    def _offset_has_a_length(self) -> Self:
        if self.offset and self.length is None:
            raise ValueError("'offset' presses the guide's ends apart: it needs the guide's 'length'")
        if self.length and 2.0 * self.friction * self.offset >= self.length:
            jam = format_short(2.0 * self.friction * self.offset, "length")
            raise ValueError(f"a guide shorter than {jam} (twice friction times offset) jams like a drawer")
        return self


def _as_block(value: Any) -> Any:
    """Return a bare name as the block that it is short for."""
    if isinstance(value, str):
        return {"name": material(value).name}
    if isinstance(value, bool | int | float | tuple | list):
        raise ValueError(
            f"{described(value)} is no material: give a name from `show materials`, or values such as "
            "{youngs_modulus: 2 GPa, yield_strength: 50 MPa}"
        )
    return value


def material_input(kind: type[MaterialSpec]) -> BeforeValidator:
    """Return the annotation that lets a bare name stand for a block of that kind."""
    return BeforeValidator(_as_block, json_schema_input_type=str | kind)


MaterialField = Annotated[MaterialSpec, material_input(MaterialSpec)]
"""The type of a key that says what something is made of."""


Place = tuple[Length, Length]
FromZero = Annotated[Length, Field(ge=0)]
AboveZero = Annotated[Length, Field(gt=0)]


class Hole(Model):
    """A round hole that is cut out of the part."""

    at: Place = Field(description="its middle [x, y], in the drawing")
    diameter: AboveZero = Field(description="of the hole as cut")


class CutPart(Model):
    """How a part is cut: what every family that is cut from a sheet can say."""

    fillet: FromZero = Field(
        0.0005, description="radius of inside corners: that of the cutter; 0: sharp, the stress there has no value"
    )
    sheet: AboveZero | None = Field(
        None, description="thickness of the sheet that everything is cut from: every width must be equal to it"
    )
    holes: Annotated[tuple[Hole, ...], Field(max_length=1000)] = Field(
        (), description="fixing pattern: [{at: [x, y], diameter: 4 mm}]"
    )


class PaddedPart(CutPart):
    """The same of a part that ends in pads."""

    pad: tuple[AboveZero, AboveZero] | None = Field(
        None, description="depth behind the end and breadth across it, of pads at what is held and driven"
    )


def sheet_faults(part: CutPart | None, widths: Mapping[str, float | None]) -> dict[tuple[str | int, ...], str]:
    """Return the fault of a sheet from which not every width, by its key below `mechanism`, can be cut; else nothing.

    Examples
    --------
    >>> sheet_faults(CutPart(sheet="6 mm"), {"width": 0.006, "beam.width": 0.005})
    {('mechanism', 'part', 'sheet'): "the sheet is 6 mm, but 'mechanism.beam.width' is 5 mm: make them equal"}
    """
    if part is None or part.sheet is None:
        return {}
    sheet = float(part.sheet)
    other = {key: width for key, width in widths.items() if width is not None and abs(width - sheet) > 1e-9 * sheet}
    listed = ", ".join(f"'mechanism.{key}' is {format_short(width, 'length')}" for key, width in other.items())
    text = f"the sheet is {format_short(sheet, 'length')}, but {listed}: make them equal"
    return {("mechanism", "part", "sheet"): text} if other else {}
