"""Specification of springs: those of `design.catalogue` (list, file, generic series), and wire of built-in ones."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from difflib import get_close_matches
from math import inf
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, PrivateAttr, ValidationError, ValidationInfo, WrapValidator, model_validator

from cfmkit.errors import DataError, reason_of
from cfmkit.specs.data_file_paths import DataSource
from cfmkit.specs.spec import Model, is_made, refuse
from cfmkit.specs.units import Angle, Force, Length, Ratio, RotationalStiffness, Stiffness, Stress, Torque, format_short
from cfmkit.specs.units.table import is_unit
from cfmkit.stock.fatigue_and_relaxation_spec import Fatigue
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.kinds import HELICAL_KINDS, list_kinds
from cfmkit.stock.springs.offers import GENERIC_SERIES, Offer, generic_series
from cfmkit.stock.springs.support_spec import SpringSupport
from cfmkit.stock.springs.wire_materials import MUSIC_WIRE, WIRES_BY_NAME, WireOutOfRange
from cfmkit.tables.lab_columns import split_header
from cfmkit.tables.lab_file import decode_file, lines_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring

    KindName = str
    WireName = str
    Head = tuple[str, str | None] | None  # name and unit of a column of a file; None for one that is not read
else:
    KindName, WireName = Literal[tuple(HELICAL_KINDS)], Literal[tuple(WIRES_BY_NAME)]

Positive = Field(gt=0)
LENGTH_RTOL = 0.1  # a stated length may be below that of the turns on each other by so much: makers' tolerance
RATE_RTOL = 0.1  # a stated rate may be off by so much from that of wire, coil and turns: makers' tolerance
MAX_TENSION_RATIO = 3.0
"""Largest initial tension over the upper end of what is easily wound: springs that are wound on a bench have more, but
none has more than this."""
MIDDLE_OF_WIRE = 0.5
"""Wire diameters by which a stated outer diameter may differ from that of coil and wire: half of what tells it from the
mean diameter."""


class WireLimits(Model):
    """Wire of a spring: what it is, and what is known of its strength; nothing of the latter is assumed."""

    material: WireName = Field(MUSIC_WIRE.name, description="class of the wire, which has its moduli and diameters")
    shear_modulus: Annotated[Stress, Positive] | None = Field(
        None, description="of the wire; default: that of 'material'"
    )
    youngs_modulus: Annotated[Stress, Positive] | None = Field(
        None, description="of a torsion spring's wire; default: that of 'material'"
    )
    max_stress: Annotated[Stress, Positive] | None = Field(
        None,
        description="allowable stress in the wire, Wahl's curvature factor included; needs wire, coil and turns",
    )
    fatigue: Fatigue | None = Field(
        None,
        description="S-N points or Basquin's line of the wire, in terms of that stress, for the life; needs the same",
    )

    _class: WireName | None = PrivateAttr(MUSIC_WIRE.name)  # None: it has own moduli, and no class is stated

    @model_validator(mode="after")
    def _moduli_are_known(self) -> Self:
        stated_moduli = self.model_fields_set & {"shear_modulus", "youngs_modulus"}
        self._class = None if stated_moduli and "material" not in self.model_fields_set else self.material
        for key in ("shear_modulus", "youngs_modulus"):
            if getattr(self, key) is None:
                # past the frozen model, and not counted as set: another material then has others
                object.__setattr__(self, key, getattr(WIRES_BY_NAME[self.material], key))
        return self

    def wound_of(self, spring_type: type[HelicalSpring], wire: float, coil: float, turns: float) -> HelicalSpring:
        """Return a spring of this wire."""
        moduli = self.shear_modulus or 0.0, self.youngs_modulus or 0.0
        return spring_type(wire, coil, turns, *moduli, self._class)

    def check_wire(self, wire: float | None, coil: float | None) -> None:
        """Raise `ValueError` for a coil that does not wind, or a wire thinner or thicker than its class is drawn."""
        if wire and coil and coil < 2.0 * wire:
            raise ValueError("'coil' is the mean diameter: at least twice the wire's")
        if wire is None or self._class is None:
            return
        try:
            WIRES_BY_NAME[self._class].check_diameter(wire)
        except WireOutOfRange as error:
            names = ", ".join(
                material.name
                for material in WIRES_BY_NAME.values()
                if material.thinnest <= wire <= material.thickest < float("inf")
            )
            others = f"'material' {names}, or " if names else ""
            raise ValueError(f"{error}; state {others}the wire's own moduli") from None


Life = Annotated[
    float, Field(gt=0, description="life in cycles up to the largest deflection, as stated by the manufacturer")
]


SpringSafety = Annotated[
    float,
    Field(
        ge=1,
        description="least 'spring_safety_factor' of a spring of the catalogue; one of unknown wire is not chosen",
    ),
]


class SpringWire(WireLimits):
    """The wire of a spring that is built in: its rate, its stress and its life follow from it."""

    wire: Annotated[Length, Positive] = Field(description="diameter of the wire")
    coil: Annotated[Length, Positive] = Field(description="mean diameter of the coil")
    turns: Annotated[Ratio, Positive] = Field(description="active turns")

    @model_validator(mode="after")
    def _winds_around(self) -> Self:
        self.check_wire(self.wire, self.coil)
        return self

    def to_wound(self, spring_type: type[HelicalSpring]) -> HelicalSpring:
        """Return the wire as a kind of spring."""
        return self.wound_of(spring_type, self.wire, self.coil, self.turns)


def check_rate(wound: HelicalSpring, stated: float) -> None:
    """Raise `ValueError` for a rate [N/m or N m/rad] that is not that of wire, coil and turns."""
    if abs(stated / wound.rate - 1.0) <= RATE_RTOL:
        return
    alike = [
        material.name
        for material in WIRES_BY_NAME.values()
        if abs(
            stated / replace(wound, shear_modulus=material.shear_modulus, youngs_modulus=material.youngs_modulus).rate
            - 1.0
        )
        <= RATE_RTOL
    ]
    agreement = f" (that of {', '.join(alike)} agrees)" if alike else ""
    raise ValueError(
        f"wire, coil and turns give {wound.rate / stated:.3g} times the rate that is stated: leave one of them out, or "
        f"give the wire's 'material'{agreement} or modulus"
    )


def check_initial_tension(spring_type: type[HelicalSpring], wound: HelicalSpring | None, tension: float) -> None:
    """Raise `ValueError` for an initial tension [N] that a kind of spring, or one of this wire, cannot have."""
    if tension and not spring_type.has_initial_tension:
        tight = list_kinds(kind for kind in HELICAL_KINDS.values() if kind.has_initial_tension)
        raise ValueError(f"'initial_tension' is of {tight} springs; this is of kind {spring_type.kind!r}")
    if wound is None or not tension:
        return
    low, high = (format_short(end, "force") for end in wound.usual_initial_tension)
    if tension > MAX_TENSION_RATIO * wound.usual_initial_tension[1]:
        stated = format_short(tension, "force")
        raise ValueError(f"'initial_tension' of {stated} cannot be wound: such a spring has about {low} to {high}")


PartName = Annotated[str | None, Field(min_length=1, description="designation, for the parts list")]
StatedWire = Annotated[
    SpringWire | None,
    Field(description="wire, coil and turns, for the stress in the wire, and for the rate if none is stated"),
]
InitialTension = Annotated[
    Force,
    Field(
        ge=0,
        description="force at which one extension spring begins to open: it pulls with so much more than its "
        "elongation says",
    ),
]


def settle_rate(springs: Any, spring_type: type[HelicalSpring], info: ValidationInfo) -> None:
    """Check the `stiffness` of springs against their wire `wound`, or compute it where none is stated.

    Their initial tension must be one that such a wire is wound with. The rate of a manufactured spring is not checked:
    its tolerance comes on top of what stated values differ by.
    """
    wound = None if springs.wound is None else springs.wound.to_wound(spring_type)
    check_initial_tension(spring_type, wound, springs.initial_tension)
    if wound is None:
        if springs.stiffness is None:
            refuse(type(springs).__name__, {("stiffness",): "missing: give it, or 'wound' from which it follows"})
    elif springs.stiffness is None:
        # past the frozen model, and not counted as set: another wire then has another rate
        object.__setattr__(springs, "stiffness", wound.rate)
    elif not is_made(info):
        for rate in springs.stiffness if isinstance(springs.stiffness, tuple) else (springs.stiffness,):
            check_rate(wound, rate)


class CatalogueSpring(WireLimits, SpringSupport):
    """A spring that can be bought."""

    name: str = Field(min_length=1, description="part number")
    kind: KindName = Field(ExtensionSpring.kind, description="how it is loaded")
    stiffness: Annotated[Stiffness, Positive] | None = Field(
        None, description="of one spring; default: from wire, coil and turns"
    )
    rate: Annotated[RotationalStiffness, Positive] | None = Field(
        None, description="of one torsion spring, per rad or per deg; default: from wire, coil and turns"
    )
    wire: Annotated[Length, Positive] | None = Field(None, description="diameter of the wire")
    coil: Annotated[Length, Positive] | None = Field(None, description="mean diameter of the coil")
    turns: Annotated[Ratio, Positive] | None = Field(None, description="active turns")
    free_length: Annotated[Length, Positive] | None = Field(
        None, description="relaxed, between the hooks; a spring longer than the space for it is not chosen"
    )
    body_length: Annotated[Length, Positive] | None = Field(
        None, description="of the coil; default: with the turns touching"
    )
    outer_diameter: Annotated[Length, Positive] | None = Field(
        None, description="of the coil; default: from coil and wire"
    )
    initial_tension: Annotated[Force, Field(ge=0)] = Field(
        0.0, description="force at which an extension spring begins to open"
    )
    max_elongation: Annotated[Length, Positive] | None = Field(
        None, description="largest elongation (or compression) allowed"
    )
    max_load: Annotated[Force, Positive] | None = Field(
        None, description="or the largest force allowed, initial tension included"
    )
    max_angle: Annotated[Angle, Positive] | None = Field(None, description="largest angle of a torsion spring")
    max_torque: Annotated[Torque, Positive] | None = Field(None, description="or its largest torque")
    life: Life | None = None
    counts: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = Field((2,), description="numbers in parallel to try")

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        rate_key, wound = self.spring_type.rate_key, self.wound
        for key in {kind.rate_key for kind in HELICAL_KINDS.values()} - {rate_key}:
            if getattr(self, key) is not None:
                raise ValueError(f"a spring of kind {self.kind!r} has no {key!r}")
        stated_sizes = [self.wire, self.coil, self.turns]
        if any(item is not None for item in stated_sizes) and None in stated_sizes:
            raise ValueError("'wire', 'coil' and 'turns' belong together: a rate follows from all three")
        self.check_wire(self.wire, self.coil)
        if (self.max_stress or self.fatigue) and wound is None:
            raise ValueError(
                "'max_stress' and 'fatigue' refer to the stress in the wire: give 'wire', 'coil' and 'turns'"
            )
        stated = getattr(self, rate_key)
        if stated is None and wound is None:
            raise ValueError(f"needs {rate_key!r}, or 'wire', 'coil' and 'turns', from which it follows")
        check_initial_tension(self.spring_type, wound, self.initial_tension)
        self._check_sizes(wound)
        self.check_guide(self.spring_type, wound, self.outer_diameter)
        if stated is not None and wound is not None:
            check_rate(wound, stated)
        return self

    def _check_sizes(self, wound: HelicalSpring | None) -> None:
        """Raise `ValueError` for sizes that no spring of this kind has, or no coil of this wire."""
        outer, free, body = self.outer_diameter, self.free_length, self.body_length
        if wound is not None and outer is not None and abs(outer - wound.outer_diameter) > MIDDLE_OF_WIRE * wound.wire:
            reported = format_short(wound.outer_diameter, "length")
            raise ValueError(f"'outer_diameter' must be 'coil', the mean diameter, and one wire: {reported}")
        closed = body or (None if wound is None else wound.body_length)
        if self.spring_type.deflection_until_closed(free, closed) <= 0.0:
            raise ValueError(
                f"'free_length' of a {self.kind} spring must be larger than its 'body_length' with the turns closed"
            )
        if wound is None:
            return
        least = wound.active_length * (1 - LENGTH_RTOL)
        for key, length in (("body_length", body), ("free_length", free)):
            if length is not None and length < least:
                stacked = format_short(wound.active_length, "length")
                raise ValueError(f"{key!r} is less than the turns on each other: {stacked}")
        room = self.spring_type.deflection_until_closed(free, body or least)
        if self.max_elongation is not None and self.max_elongation > room * (1 + 1e-9):
            raise ValueError(f"'max_elongation' is more than 'free_length' leaves: {format_short(room, 'length')}")

    @classmethod
    def from_offer(cls, offer: Offer) -> Self:
        """Return a spring on offer of which wire, coil and turns are known, as a list has it."""
        wire, spring_type = wire_of(offer), offer.spring_type
        about = {
            "name": offer.name,
            "kind": spring_type.kind,
            spring_type.rate_key: offer.rate,
            "free_length": offer.free_length,
            "body_length": offer.body_length,
            "outer_diameter": offer.outer_diameter,
            "initial_tension": offer.initial_tension,
            spring_type.largest_keys[0]: offer.largest,
            "life": offer.life,
            "counts": offer.counts,
        } | support_of(offer)
        stated = {key: value for key, value in about.items() if value is not None}
        return cls.model_validate((wire.model_dump(exclude_unset=True) if wire else {}) | stated)

    @property
    def spring_type(self) -> type[HelicalSpring]:
        """Its kind."""
        return HELICAL_KINDS[self.kind]

    @property
    def wound(self) -> HelicalSpring | None:
        """Its wire, coil and turns; None if they are not stated."""
        if self.wire is None or self.coil is None or self.turns is None:
            return None
        return self.wound_of(self.spring_type, self.wire, self.coil, self.turns)

    @property
    def offer(self) -> Offer:
        """The spring as designs look at it."""
        wound, spring_type = self.wound, self.spring_type
        stated, *ends = (getattr(self, key) for key in (spring_type.rate_key, *spring_type.largest_keys))
        rate = stated if stated is not None else wound.rate if wound is not None else 0.0
        loads = ends[1:]
        body = self.body_length or (wound.body_length if wound else None)
        if wound is not None and self.max_stress is not None:
            loads.append(self.max_stress / wound.stress(1.0))
        ends = [ends[0], spring_type.deflection_until_closed(self.free_length, body)]
        ends += [max(load - self.initial_tension, 0.0) / rate for load in loads if load is not None]
        largest = min(end for end in ends if end is not None)
        return Offer(
            name=self.name,
            spring_type=spring_type,
            rate=rate,
            largest=largest if largest < inf else None,
            free_length=self.free_length,
            body_length=body,
            initial_tension=self.initial_tension,
            outer_diameter=self.outer_diameter or (wound.outer_diameter if wound else None),
            wound=wound,
            counts=self.counts,
            max_stress=self.max_stress,
            fatigue=None if self.fatigue is None else self.fatigue.law,
            life=self.life,
            seats=self.seats,
            guide_rod=self.guide_rod,
            guide_tube=self.guide_tube,
        )


def check_names(springs: Sequence[CatalogueSpring]) -> None:
    """Raise `ValueError` if two springs of one name are not the same."""
    springs_by_name: dict[str, CatalogueSpring] = {}
    for spring in springs:
        if springs_by_name.setdefault(spring.name, spring) != spring:
            raise ValueError(
                f"there are two springs {spring.name!r} with different values: a name stands for one spring"
            )


def _resolve_file(value: Any, handler: Any, info: ValidationInfo) -> Any:
    """Return a file's name as a file beside the specification; lists and the generic series' word as they are."""
    value_read = handler(value)
    if not isinstance(value_read, str):
        check_names(value_read)
        return value_read
    if value_read == GENERIC_SERIES:
        return value_read
    folder = getattr(value, "folder", None) or (info.context or {}).get("folder") or "."
    return DataSource(value_read, folder)


def wire_of(offer: Offer) -> SpringWire | None:
    """Return the wire of a spring on offer as a specification has it; None if it is not known."""
    wound = offer.wound
    if wound is None:
        return None
    material = WIRES_BY_NAME[wound.material or MUSIC_WIRE.name]
    about = {
        "wire": wound.wire,
        "coil": wound.coil,
        "turns": wound.turns,
        "material": None if wound.material == MUSIC_WIRE.name else wound.material,
        "shear_modulus": None if wound.shear_modulus == material.shear_modulus else wound.shear_modulus,
        "youngs_modulus": None if wound.youngs_modulus == material.youngs_modulus else wound.youngs_modulus,
        "max_stress": offer.max_stress,
        "fatigue": None if offer.fatigue is None else Fatigue.from_law(offer.fatigue),
    }
    return SpringWire.model_validate({key: value for key, value in about.items() if value is not None})


def support_of(offer: Offer) -> dict[str, Any]:
    """Return how a compression spring on offer is held, by key; what is not stated is None."""
    seats = None if offer.seats == "fixed-fixed" else offer.seats
    return {"seats": seats, "guide_rod": offer.guide_rod, "guide_tube": offer.guide_tube}


def block_of(offer: Offer, **keys: Any) -> dict[str, Any]:
    """Return the block of a spring on offer that is built in, with keys of its own; what is None is left out."""
    common = {"name": offer.name, "wound": wire_of(offer), "life": offer.life} | support_of(offer)
    return {key: value for key, value in (common | keys).items() if value is not None}


Catalogue = Annotated[tuple[CatalogueSpring, ...] | str, WrapValidator(_resolve_file)]
"""The type of a key that lists springs: blocks, a CSV file beside the specification, or ``generic_series``."""


def offers(
    catalogue: tuple[CatalogueSpring, ...] | str,  # a list, a file's name, or "generic"
    *spring_types: type[HelicalSpring],  # kinds that are wanted
) -> tuple[Offer, ...]:
    """Return the springs of some kinds on offer.

    Raises DataError if the file cannot be read.
    """
    if isinstance(catalogue, DataSource):
        catalogue = tuple(_read_file(catalogue))
    if isinstance(catalogue, str):
        return tuple(item for spring_type in spring_types for item in generic_series(spring_type))
    return tuple(item.offer for item in catalogue if item.spring_type in spring_types)


_NUMBER_PATTERN = re.compile(r"[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?")
_COMMA_PATTERN = re.compile(r"([+-]?[0-9]*),([0-9]+)")


def _read_file(source: DataSource) -> list[CatalogueSpring]:
    """Return the springs of a CSV: columns are the keys of a catalogue's spring, with units: ``stiffness [N/mm]``."""
    lines = _read_lines(source)
    separator = max(";\t|,", key=lines[0].count) if lines else ","
    rows = csv.reader(lines, delimiter=separator, strict=True)
    springs: list[CatalogueSpring] = []
    try:
        heads = _read_heads(next(rows, []), source)
        for cells in filter(any, ([cell.strip() for cell in row] for row in rows)):
            springs.append(_spring_of_row(heads, cells, separator))
            check_names(springs)
    except (csv.Error, ValueError) as error:
        raise DataError(f"{source}:{rows.line_num}: {error}") from None
    if not springs:
        raise DataError(f"{source}: lists no spring; a header and one line per spring are needed")
    return springs


def _spring_of_row(heads: Sequence[Head], cells: Sequence[str], separator: str) -> CatalogueSpring:
    """Return the spring of one line of a file; `ValueError` for what is wrong with it."""
    if len(cells) != len(heads):
        raise ValueError(f"has {len(cells)} cells, but the header has {len(heads)}")
    named_cells = ((*head, cell) for head, cell in zip(heads, cells, strict=True) if head and cell)
    block = {name: _read_cell(name, cell, unit, separator) for name, unit, cell in named_cells}
    try:
        return CatalogueSpring.model_validate(block)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or str(block.get("name", ""))
        reported = "missing" if first["type"] == "missing" else first["msg"].removeprefix("Value error, ")
        raise ValueError(f"{place}: {reported}") from None


def _read_lines(source: DataSource) -> list[str]:
    """Return the lines of a file, without the empty ones before the header."""
    try:
        text, _ = decode_file(source.path.read_bytes(), str(source))
    except OSError as error:
        raise DataError(f"{source}: cannot be read: {reason_of(error)}") from None
    return "\n".join(lines_of(text)).lstrip("\n ;,|\t\ufeff").splitlines(keepends=True)


def _read_heads(cells: Sequence[str], source: DataSource) -> list[Head]:
    """Return name and unit of each column; None for a remark, such as a price, which is not read."""
    allowed = [name for name in CatalogueSpring.model_fields if name != "fatigue"]  # a block, which no cell holds
    columns: list[Head] = []
    for cell in cells:
        title, unit = split_header(cell)
        name = title.strip().lower().replace(" ", "_")
        if name in [head[0] for head in columns if head]:
            raise DataError(f"{source}:1: the column {name!r} appears twice")
        close = get_close_matches(name, allowed, n=1, cutoff=0.75)
        if name not in allowed and (close or (unit and is_unit(unit)) or not columns or name == "fatigue"):
            hint = f"; did you mean {close[0]!r}?" if close else ""
            listed = ", ".join(allowed)
            raise DataError(f"{source}:1: {name!r} is not a column of a list of springs{hint}; columns are {listed}")
        columns.append((name, unit) if name in allowed else None)
    return columns


def _read_cell(name: str, cell: str, unit: str | None, separator: str) -> object:
    """Return a cell as a specification would say it."""
    if name == "counts":
        return tuple(int(word) if word.isdigit() else word for word in cell.split())
    if separator != "," and name not in ("name", "kind"):
        cell = _COMMA_PATTERN.sub(r"\1.\2", cell) if _COMMA_PATTERN.fullmatch(cell.split(" ")[0]) else cell
    if name in ("turns", "life") and _NUMBER_PATTERN.fullmatch(cell):
        return float(cell)
    return cell if unit is None else f"{cell} {unit}"
