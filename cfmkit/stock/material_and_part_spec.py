"""Specification of a material, of how a part is cut (process, holes, frame, screws), and of pins and guides that rub.

One grammar: a name from the library, a block of values, or a name with some of its values changed; and one for how
a part is cut, and for plain pins and guides that rub.
One rule: the allowable stress is the yield strength over `safety_factor`, which is 1 unless given.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from cfmkit.errors import QuantityError
from cfmkit.metrics.fatigue_and_relaxation import Durability
from cfmkit.specs.spec import Model, refuse
from cfmkit.specs.units import Force, Length, Ratio, Stress, format_short
from cfmkit.specs.units.fields import describe_value
from cfmkit.stock.fatigue_and_relaxation_spec import Fatigue, Relaxation, assumed_laws
from cfmkit.stock.materials import UnknownMaterial, material
from cfmkit.stock.processes import LAYER_STRENGTHS, PROCESSES_BY_NAME, Layers, ProcessAccuracy, ProcessName
from cfmkit.stock.stock_series import System  # noqa: TC001  of a field

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.stock.stock_series import StockSize


PositiveStress = Annotated[Stress, Field(gt=0)]
SafetyFactor = Annotated[Ratio, Field(ge=1, description="allowable stress: yield strength over this factor")]

_POISSON_RATIO = 0.3  # of a material described by its values alone: between that of metals and that of plastics


class MaterialSpec(Model):
    """A material: a name from `show materials`, own values, or a name with some of its values changed.

    What a name stands for is filled in, so that every value is there to be used and varied. Only what was written
    counts as set: with another name come that material's values.
    """

    removed_keys: ClassVar[dict[str, str]] = {"allowable_stress": "write 'yield_strength', beside a 'safety_factor'"}
    name: str | None = Field(None, description="a name from `show materials`")
    youngs_modulus: PositiveStress | None = Field(None, description="E; default: the named material's")
    poisson_ratio: Annotated[Ratio, Field(gt=-1, le=0.5)] | None = Field(
        None, description="for the shear stiffness; default: that of the named material, or 0.3"
    )
    yield_strength: PositiveStress | None = Field(
        None, description="for the allowable stress; default: the named material's, if known"
    )
    layers: Layers | None = Field(
        None,
        description="of a printed part: 'along' if it lies flat and its leaves bend along the layers, 'across' if it "
        "stands; the strength, and the modulus if known, are then those of this direction",
    )
    law: Literal["st-venant-kirchhoff", "neo-hookean"] = Field(
        "st-venant-kirchhoff",
        description="at large strain, for fidelity 'solid': Hooke's law in Green's strain, or rubber-like; beams bend "
        "with small strains, for which both are Hooke's",
    )
    fatigue: Fatigue | None = Field(
        None,
        description="S-N points or Basquin's line, for `fatigue_life`; default: as "
        "assumed in `show materials`, if it has any; null: none",
    )
    relaxation: Relaxation | None = Field(
        None,
        description="Prony terms or moduli over time, for `force_after[1000 h]`; default: as assumed in `show "
        "materials`, if it has any; null: none",
    )

    @model_validator(mode="after")
    def _filled_in(self) -> Self:
        filled: dict[str, Any] = {"poisson_ratio": _POISSON_RATIO}
        if self.name is not None:
            try:
                record = material(self.name)
            except UnknownMaterial as error:
                refuse("Material", {("name",): f"{error}; one of your own has 'youngs_modulus' in place of 'name'"})
                raise
            filled = {key: getattr(record, key) for key in ("youngs_modulus", "poisson_ratio", "yield_strength")}
            filled |= {key: law for key, law in assumed_laws(record.name).items() if key not in self.model_fields_set}
            filled |= self._read_layer_values(record.name)
        elif self.youngs_modulus is None:
            raise ValueError("needs 'name' or 'youngs_modulus'")
        else:
            self._read_layer_values("these values")
        for key, value in filled.items():
            if getattr(self, key) is None:
                object.__setattr__(self, key, value)  # past the frozen model, and not counted as set
        if self.law == "neo-hookean" and self.poisson >= 0.5:
            reported = "'neo-hookean' needs a poisson_ratio below 0.5: at 0.5 it has no finite bulk modulus"
            refuse("Material", {("law",): reported})
        return self

    def _read_layer_values(self, name: str) -> dict[str, float]:
        """Return strength and modulus of a print in the direction that is stated, by their keys."""
        reference = LAYER_STRENGTHS.get(name)
        if self.layers is None or self.yield_strength is not None:
            return {}
        if reference is None:
            named = ", ".join(LAYER_STRENGTHS)
            reported = (
                f"no strength along and across the layers is known of {name}: state 'yield_strength'; known: {named}"
            )
            refuse("Material", {("layers",): reported})
            return {}
        if self.layers == "along":
            return {"yield_strength": reference.along}
        modulus = {} if reference.modulus_across is None else {"youngs_modulus": reference.modulus_across}
        return {"yield_strength": reference.across, **modulus}

    @property
    def modulus(self) -> float:
        """Young's modulus E [Pa]."""
        return self.youngs_modulus or 0.0

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""
        return _POISSON_RATIO if self.poisson_ratio is None else self.poisson_ratio

    @property
    def words(self) -> str:
        """Description: its name, if it has one, its modulus, and its strength, if that is known."""
        values = f"E {format_short(self.modulus, 'stress')}"
        if self.yield_strength is not None:
            values += f", yield {format_short(self.yield_strength, 'stress')}"
        return f"{self.name}: {values}" if self.name else values

    def allowable(self, safety_factor: float) -> float | None:
        """Return the yield strength over a safety factor [Pa]; None if no strength is known.

        Where a part is to last some cycles, it is at most what lasts them, over the same factor.
        """
        limits = [] if self.yield_strength is None else [self.yield_strength]
        if self.fatigue is not None and self.fatigue.cycles is not None:
            limits.append(self.fatigue.law.strength(self.fatigue.cycles))
        return min(limits) / safety_factor if limits else None

    @property
    def durability(self) -> Durability | None:
        """Fatigue and relaxation as metrics need them; None if neither is known."""
        if self.fatigue is None and self.relaxation is None:
            return None
        return Durability(
            self.fatigue.law if self.fatigue else None,
            self.relaxation.law if self.relaxation else None,
            self.relaxation.hold if self.relaxation else (),
            self.assumed_sources,
        )

    @property
    def assumed_sources(self) -> tuple[str, ...]:
        """The sources of what is assumed, because only the name is stated."""
        laws = (("fatigue", self.fatigue), ("relaxation", self.relaxation))
        stated = self.model_fields_set
        return tuple(law.source or "" for key, law in laws if law is not None and key not in stated)


Friction = Annotated[Ratio, Field(ge=0, lt=1)]


class Pins(Model):
    """Plain pins that rub as the parts on them turn."""

    diameter: Annotated[Length, Field(gt=0)] = Field(description="of the pins")
    friction: Friction = Field(0.0, description="coefficient of Coulomb friction")


class Guide(Model):
    """The slider's path: what it takes from the force."""

    friction: Friction = Field(0.0, description="coefficient of Coulomb friction, on the transverse load of the slider")
    drag: Annotated[Force, Field(ge=0)] = Field(0.0, description="friction without load: seals, preload")
    length: Annotated[Length, Field(gt=0)] | None = Field(
        None, description="of the guide, between its ends; needed for 'offset'"
    )
    offset: Annotated[Length, Field(ge=0)] = Field(
        0.0, description="distance of the line of force from the middle of the guide"
    )

    @model_validator(mode="after")
    def _offset_has_a_length(self) -> Self:
        if self.offset and self.length is None:
            raise ValueError("the load that 'offset' puts on the guide depends on its length: state 'length'")
        if self.length and 2.0 * self.friction * self.offset >= self.length:
            jam = format_short(2.0 * self.friction * self.offset, "length")
            raise ValueError(f"a guide shorter than {jam} (twice friction times offset) jams like a drawer")
        return self


def _as_block(value: Any) -> Any:
    """Return a bare name as the block that it is short for."""
    if isinstance(value, str):
        return {"name": material(value).name}
    if isinstance(value, bool | int | float | tuple | list):
        # As with quantities, a list is a misfit where lists are allowed, too: what is wrong in it is told then.
        raise QuantityError(
            f"{describe_value(value)} is no material: give a name from `show materials`, or values such as "
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

    at: Place = Field(description="centre [x, y] in the drawing")
    diameter: AboveZero = Field(description="of the hole as cut")


class PartProcess(Model):
    """Process that makes a part, and values known better than assumed."""

    name: ProcessName | None = Field(None, description="the process; default: by the material")
    kerf: FromZero | None = Field(None, description="width of the cut")
    thickness: FromZero | None = Field(None, description="standard deviation of the thickness of a leaf")
    position: FromZero | None = Field(
        None, description="standard deviation of the position of a joint; a kink must be larger"
    )
    least_feature: FromZero | None = Field(None, description="thinnest wall: a nozzle, a cutter, a wire")
    least_radius: FromZero | None = Field(None, description="smallest inside radius")

    def _get_limit(self, key: Literal["least_radius", "least_feature"]) -> float | None:
        """Return a limit of the process [m]; None if neither a name nor a value says it."""
        stated: float | None = getattr(self, key)
        return getattr(PROCESSES_BY_NAME[self.name], key) if stated is None and self.name else stated

    @property
    def smallest(self) -> float | None:
        """Smallest inside radius [m]; None if it is not known."""
        return self._get_limit("least_radius")

    @property
    def prints(self) -> bool:
        """True if it builds a part up: its width is no sheet's."""
        return self.name in ("fdm", "sls")

    @property
    def thinnest(self) -> float | None:
        """Thinnest wall [m]; None if it is not known."""
        return self._get_limit("least_feature")

    def accuracy(self, usual: ProcessAccuracy) -> ProcessAccuracy:
        """Return what the process holds, and what the usual one does where it has no name."""
        accuracy = PROCESSES_BY_NAME[self.name] if self.name else usual
        stated = {
            key: value
            for key in ("kerf", "thickness", "position", "least_feature", "least_radius")
            if (value := getattr(self, key)) is not None
        }
        return replace(accuracy, **stated, reason="values of 'mechanism.part.process'") if stated else accuracy


def _process_block(value: Any) -> Any:
    """Return a bare name as the block that it is short for."""
    return {"name": value} if isinstance(value, str) else value


ProcessField = Annotated[PartProcess, BeforeValidator(_process_block, json_schema_input_type=ProcessName | PartProcess)]
"""The type of a key that says how something is made."""


class PartFrame(Model):
    """Standing and moved pieces around the elastic part: thicknesses in the plane."""

    wall: AboveZero | None = Field(None, description="thickness of the held parts behind the roots")
    shuttle: AboveZero | None = Field(None, description="thickness of the driven part behind the roots")
    ground: AboveZero | None = Field(
        None, description="thickness of the bar that joins all held parts to one piece; default: they are not joined"
    )
    clearance: AboveZero = Field(0.002, description="between this bar and the moving parts, over the whole travel")


class AroundFrame(PartFrame):
    """The frame of a part that is closed around it."""

    inside: tuple[tuple[Length, Length], tuple[Length, Length]] | None = Field(
        None, description="two corners of its opening, [[x, y], [x, y]]; default: as small as the clearance allows"
    )


ScrewName = Literal["M1.6", "M2", "M2.5", "M3", "M4", "M5", "M6", "M8", "M10", "M12", "M16"]


class CutPart(Model):
    """Cut of a part from a sheet, common to all families."""

    process: ProcessField | None = Field(
        None,
        description="manufacturing process: laser, wire-edm, fdm, sls or mill, or your own values: {name: laser, "
        "thickness: 0.02 mm}; its tolerances are used if there are no `design.tolerances`",
    )

    fillet: FromZero | None = Field(
        None,
        description="radius of inside corners, at least that of the cutter; 0: sharp, the stress there has no "
        "value; default: the smallest radius of `process` if stated, or half of the smallest thickness",
    )
    stock: System | None = Field(
        None,
        description="metric or inch: sheets, pins and wire are of sizes that are sold (`show stock`); a design takes "
        "the nearest sheet and is repeated for it, and stated sizes that are not sold are refused",
    )
    sheet: AboveZero | None = Field(
        None,
        description="thickness of the sheet that everything is cut from: every width must be equal to it, and a design "
        "adapts other values",
    )
    holes: Annotated[tuple[Hole, ...], Field(max_length=1000)] = Field(
        (), description="fixing pattern: [{at: [x, y], diameter: 4 mm}]"
    )
    screws: ScrewName | None = Field(
        None,
        description="M3, say: clearance holes in pads, walls and the driven part, where the heads have room beside "
        "what bends",
    )

    @model_validator(mode="after")
    def _rounded_by_the_process(self) -> Self:
        if "fillet" not in self.model_fields_set and self.process is not None and self.process.smallest is not None:
            object.__setattr__(self, "fillet", self.process.smallest)  # not counted as set: it follows the process
        return self


class PaddedPart(CutPart):
    """Cut of a part that ends in pads."""

    pad: tuple[AboveZero, AboveZero] | None = Field(
        None, description="depth and breadth of the pads at held and driven ends"
    )
    frame: AroundFrame | None = Field(
        None, description="{wall, shuttle, ground}: depths of the pads, and a frame around the part that joins them"
    )


USUAL_FILLET = 0.5  # radius of inside corners in smallest thicknesses, where nothing else is stated


def fillet_of(part: CutPart | None, thinnest: float) -> float:
    """Return the radius of the inside corners of a part whose smallest thickness is known [m]."""
    return USUAL_FILLET * thinnest if part is None or part.fillet is None else part.fillet


class RoundedCorners:
    """Part of a mechanism that has `part` and `thinnest`: how it is cut, stated or not, and its inside corners."""

    default_part: ClassVar[type[CutPart]] = PaddedPart
    """Cut where `part` states none."""

    @property
    def cut_part(self: Any) -> Any:
        """The block that says how it is cut."""
        return self.part or self.default_part()

    @property
    def fillet(self: Any) -> float:
        """Radius of the inside corners of what is cut [m]."""
        return fillet_of(self.part, self.thinnest)


def usual_fillet(thinnest: float) -> str:
    """Return how a specification states the usual radius of inside corners, of a part with a smallest thickness [m].

    >>> usual_fillet(0.1e-3)
    'mechanism.part.fillet=0.05 mm'
    """
    return f"mechanism.part.fillet={format_short(USUAL_FILLET * thinnest, 'length')}"


def sheet_of(part: CutPart | None) -> float | None:
    """Return the thickness of the sheet that everything is cut from [m]; None if none is stated."""
    return None if part is None else part.sheet


def stated_sheet(part: CutPart | None) -> Iterator[StockSize]:
    """Yield the sheet that a part is cut from, unless it is printed."""
    if part is not None and (part.process is None or not part.process.prints):
        yield ("part", "sheet"), "sheet", part.sheet


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
    other_widths = {
        key: width for key, width in widths.items() if width is not None and abs(width - sheet) > 1e-9 * sheet
    }
    listed = ", ".join(f"'mechanism.{key}' is {format_short(width, 'length')}" for key, width in other_widths.items())
    text = f"the sheet is {format_short(sheet, 'length')}, but {listed}: make them equal"
    return {("mechanism", "part", "sheet"): text} if other_widths else {}
