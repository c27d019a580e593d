"""How every family's `design.catalogue` says what springs are on offer: a list, a file, or the generic series."""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, ValidationInfo, WrapValidator, model_validator

from cfmkit.errors import DataError
from cfmkit.specs.data_file_paths import DataSource
from cfmkit.specs.spec import AS_MADE, Model, refuse
from cfmkit.specs.units import Angle, Force, Length, Ratio, RotationalStiffness, Stiffness, Stress, Torque
from cfmkit.stock.material_and_part_spec import Fatigue
from cfmkit.stock.springs.helical_spring_formulas import SHEAR_MODULUS, YOUNGS_MODULUS, Wound
from cfmkit.stock.springs.offer_type_and_generic_series import GENERIC, Offer, generic

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.stock.springs.helical_spring_formulas import Kind

Positive = Field(gt=0)
AGREE = 0.1
"""A stated rate may be off by so much from that of wire, coil and turns: makers' tolerance."""


class WireLimits(Model):
    """What is known of the strength of a spring's wire; nothing of it is assumed."""

    max_stress: Annotated[Stress, Positive] | None = Field(
        None,
        description="allowable stress in the wire, Wahl's curvature factor included; needs wire, coil and turns",
    )
    fatigue: Fatigue | None = Field(
        None,
        description="S-N points or Basquin's line of the wire, in terms of that stress, for the life; needs the same",
    )


Life = Annotated[
    float, Field(gt=0, description="life in cycles up to the largest deflection, as stated by the manufacturer")
]


def _is_a_coil(wire: float | None, coil: float | None) -> None:
    if wire and coil and coil < 2.0 * wire:
        raise ValueError("'coil' is the mean diameter: at least twice the wire's")


class SpringWire(WireLimits):
    """The wire of a spring that is built in: its rate, its stress and its life follow from it."""

    wire: Annotated[Length, Positive] = Field(description="diameter of the wire")
    coil: Annotated[Length, Positive] = Field(description="mean diameter of the coil")
    turns: Annotated[Ratio, Positive] = Field(description="active turns")
    shear_modulus: Annotated[Stress, Positive] = Field(SHEAR_MODULUS, description="of the wire; default: music wire")
    youngs_modulus: Annotated[Stress, Positive] = Field(
        YOUNGS_MODULUS, description="of a torsion spring's wire; default: music wire"
    )

    @model_validator(mode="after")
    def _winds_around(self) -> Self:
        _is_a_coil(self.wire, self.coil)
        return self

    def wound(self, kind: Kind) -> Wound:
        """Return the wire, loaded as a kind of spring."""
        return Wound(kind, self.wire, self.coil, self.turns, self.shear_modulus, self.youngs_modulus)

    def check_rate(self, kind: Kind, stated: float | None) -> None:
        """Raise if a stated rate [N/m or N m/rad] is not that of the wire."""
        if stated is not None and abs(stated / self.wound(kind).rate - 1.0) > AGREE:
            raise ValueError(_disagree(self.wound(kind).rate / stated))


def _disagree(times: float) -> str:
    return (
        f"wire, coil and turns give {times:.3g} times the rate that is stated: leave one of them out, or give the "
        "wire's modulus"
    )


def is_made(info: ValidationInfo) -> bool:
    """Return True if the values are those of one manufactured part."""
    return bool(info.context) and bool(info.context.get(AS_MADE))  # type: ignore[union-attr]


def settle_rate(springs: Any, kind: Kind, info: ValidationInfo) -> None:
    """Check the `stiffness` of springs against their wire `wound`, or compute it where none is stated.

    The rate of a manufactured spring is not checked: its tolerance comes on top of what stated values differ by.
    """
    if springs.stiffness is None:
        if springs.wound is None:
            refuse(type(springs).__name__, {("stiffness",): "missing: give it, or 'wound' from which it follows"})
        # past the frozen model, and not counted as set: another wire then has another rate
        object.__setattr__(springs, "stiffness", springs.wound.wound(kind).rate)
    elif springs.wound is not None and not is_made(info):
        for one in springs.stiffness if isinstance(springs.stiffness, tuple) else (springs.stiffness,):
            springs.wound.check_rate(kind, one)


class CatalogueSpring(WireLimits):
    """A spring that can be bought."""

    name: str = Field(min_length=1, description="part number")
    kind: Literal["extension", "compression", "torsion"] = Field("extension", description="how it is loaded")
    stiffness: Annotated[Stiffness, Positive] | None = Field(
        None, description="of one spring; default: from wire, coil and turns"
    )
    rate: Annotated[RotationalStiffness, Positive] | None = Field(
        None, description="of one torsion spring, per rad or per deg; default: from wire, coil and turns"
    )
    wire: Annotated[Length, Positive] | None = Field(None, description="diameter of the wire")
    coil: Annotated[Length, Positive] | None = Field(None, description="mean diameter of the coil")
    turns: Annotated[Ratio, Positive] | None = Field(None, description="active turns")
    shear_modulus: Annotated[Stress, Positive] = Field(SHEAR_MODULUS, description="of the wire; default: music wire")
    youngs_modulus: Annotated[Stress, Positive] = Field(
        YOUNGS_MODULUS, description="of a torsion spring's wire; default: music wire"
    )
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
    max_angle: Annotated[Angle, Positive] | None = Field(None, description="largest angle of a torsion spring")
    max_torque: Annotated[Torque, Positive] | None = Field(None, description="or its largest torque")
    life: Life | None = None
    counts: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = Field((2,), description="numbers in parallel to try")

    @model_validator(mode="after")
    def _rate_is_known(self) -> Self:
        stated = self.rate if self.kind == "torsion" else self.stiffness
        other = "'stiffness'" if self.kind == "torsion" else "'rate'"
        if (self.stiffness if self.kind == "torsion" else self.rate) is not None:
            raise ValueError(f"a spring of kind {self.kind!r} has no {other}")
        given = [self.wire, self.coil, self.turns]
        if any(item is not None for item in given) and None in given:
            raise ValueError("'wire', 'coil' and 'turns' belong together: a rate follows from all three")
        _is_a_coil(self.wire, self.coil)
        if (self.max_stress or self.fatigue) and self.wound is None:
            raise ValueError(
                "'max_stress' and 'fatigue' refer to the stress in the wire: give 'wire', 'coil' and 'turns'"
            )
        if stated is None and self.wound is None:
            word = "rate" if self.kind == "torsion" else "stiffness"
            raise ValueError(f"needs {word!r}, or 'wire', 'coil' and 'turns', from which it follows")
        body = self.body_length or (self.wound.body_length if self.wound else None)
        if self.kind == "compression" and body and self.free_length is not None and self.free_length <= body:
            raise ValueError(
                "'free_length' of a compression spring must be larger than its 'body_length' with the turns closed"
            )
        if stated is not None and self.wound is not None and abs(stated / self.wound.rate - 1.0) > AGREE:
            raise ValueError(_disagree(self.wound.rate / stated))
        return self

    @classmethod
    def of(cls, offer: Offer) -> Self:
        """Return a spring on offer of which wire, coil and turns are known, as a list has it."""
        wire = wire_of(offer)
        angular = offer.kind == "torsion"
        about = {
            "name": offer.name,
            "kind": offer.kind,
            "rate" if angular else "stiffness": offer.rate,
            "free_length": offer.free_length,
            "body_length": offer.body_length,
            "outer_diameter": offer.outer_diameter,
            "initial_tension": offer.initial_tension,
            "max_angle" if angular else "max_elongation": offer.largest,
            "life": offer.life,
            "counts": offer.counts,
        }
        known = {key: value for key, value in about.items() if value is not None}
        return cls.model_validate((wire.model_dump(exclude_unset=True) if wire else {}) | known)

    @property
    def wound(self) -> Wound | None:
        """Its wire, coil and turns; None where they are not stated."""
        if self.wire is None or self.coil is None or self.turns is None:
            return None
        return Wound(self.kind, self.wire, self.coil, self.turns, self.shear_modulus, self.youngs_modulus)

    @property
    def offer(self) -> Offer:
        """The spring as designs look at it."""
        wound = self.wound
        stated = self.rate if self.kind == "torsion" else self.stiffness
        rate = stated if stated is not None else wound.rate if wound is not None else 0.0
        ends = [self.max_elongation]
        if self.kind == "torsion":
            ends = [self.max_angle, self.max_torque / rate if self.max_torque else None]
        body = self.body_length or (wound.body_length if wound else None)
        if self.kind == "compression" and self.free_length is not None and body is not None:
            ends.append(self.free_length - body)  # there the turns touch
        if wound is not None and self.max_stress is not None:
            ends.append(max(self.max_stress / wound.stress(1.0) - self.initial_tension, 0.0) / rate)
        return Offer(
            name=self.name,
            kind=self.kind,
            rate=rate,
            largest=min((end for end in ends if end is not None), default=None),
            free_length=self.free_length,
            body_length=body,
            initial_tension=self.initial_tension,
            outer_diameter=self.outer_diameter or (wound.outer_diameter if wound else None),
            wound=wound,
            counts=self.counts,
            max_stress=self.max_stress,
            fatigue=None if self.fatigue is None else self.fatigue.law,
            life=self.life,
        )


def check_names(springs: Sequence[CatalogueSpring]) -> None:
    """Raise `ValueError` if two springs of one name are not the same."""
    known: dict[str, CatalogueSpring] = {}
    for one in springs:
        if known.setdefault(one.name, one) != one:
            raise ValueError(f"there are two springs {one.name!r} with different values: a name stands for one spring")


def _named(value: Any, handler: Any, info: ValidationInfo) -> Any:
    """Return a file's name as a file beside the specification; lists and the generic series' word as they are."""
    found = handler(value)
    if not isinstance(found, str):
        check_names(found)
        return found
    if found == GENERIC:
        return found
    folder = getattr(value, "folder", None) or (info.context or {}).get("folder") or "."
    return DataSource(found, folder)


def wire_of(offer: Offer) -> SpringWire | None:
    """Return the wire of a spring on offer as a specification has it; None where it is not known."""
    wound = offer.wound
    if wound is None:
        return None
    return SpringWire(
        wire=wound.wire,
        coil=wound.coil,
        turns=wound.turns,
        shear_modulus=wound.shear_modulus,
        youngs_modulus=wound.youngs_modulus,
        max_stress=offer.max_stress,
        fatigue=None if offer.fatigue is None else Fatigue.of(offer.fatigue),
    )


Catalogue = Annotated[tuple[CatalogueSpring, ...] | str, WrapValidator(_named)]
"""The type of a key that lists springs: blocks, a CSV file beside the specification, or ``generic``."""


def offers(catalogue: tuple[CatalogueSpring, ...] | str, *kinds: Kind) -> tuple[Offer, ...]:
    """Return the springs of some kinds on offer.

    Parameters
    ----------
    catalogue : tuple of CatalogueSpring or str
        A list, a file's name, or "generic".
    *kinds : str
        Which are wanted.

    Raises
    ------
    cfmkit.errors.DataError
        If the file cannot be read.
    """
    if isinstance(catalogue, DataSource):
        return tuple(item.offer for item in _from_file(catalogue) if item.kind in kinds)
    if isinstance(catalogue, str):
        return tuple(item for kind in kinds for item in generic(kind))
    return tuple(item.offer for item in catalogue if item.kind in kinds)


_NUMBER = re.compile(r"[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?")
_HEADER = re.compile(r"\s*(?P<name>[a-z_]+)\s*(?:\[(?P<unit>[^\[\]]+)\])?\s*")


def _from_file(source: DataSource) -> Iterator[CatalogueSpring]:
    """Yield the springs of a CSV: columns are the keys of a catalogue's spring, with units: ``stiffness [N/mm]``."""
    rows = csv.reader(_lines(source), strict=True)
    try:
        heads = _heads(next(rows, []), source)
        found: list[CatalogueSpring] = []
        for cells in rows:
            if not any(cell.strip() for cell in cells):
                continue
            if len(cells) != len(heads):
                raise DataError(f"{source}:{rows.line_num}: has {len(cells)} cells, but the header has {len(heads)}")
            block = {
                name: _cell(name, cell.strip(), unit)
                for (name, unit), cell in zip(heads, cells, strict=True)
                if cell.strip()
            }
            try:
                found.append(CatalogueSpring.model_validate(block))
                check_names(found)
            except ValidationError as error:
                first = error.errors()[0]
                place = ".".join(str(part) for part in first["loc"]) or str(block.get("name", ""))
                reported = "missing" if first["type"] == "missing" else first["msg"].removeprefix("Value error, ")
                raise DataError(f"{source}:{rows.line_num}: {place}: {reported}") from None
            except ValueError as error:
                raise DataError(f"{source}:{rows.line_num}: {error}") from None
    except csv.Error as error:
        raise DataError(f"{source}:{rows.line_num}: {error}") from None
    if not found:
        raise DataError(f"{source}: lists no spring; a header and one line per spring are needed")
    yield from found


def _lines(source: DataSource) -> list[str]:
    """Return the lines of a file."""
    try:
        text = source.path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise DataError(f"{source}: cannot be read: {(error.strerror or str(error)).lower()}") from None
    except UnicodeDecodeError as error:
        raise DataError(f"{source}: byte {error.start + 1} is not UTF-8") from None
    return text.splitlines(keepends=True)


def _heads(cells: Sequence[str], source: DataSource) -> list[tuple[str, str | None]]:
    """Return name and unit of each column."""
    allowed = [name for name in CatalogueSpring.model_fields if name != "fatigue"]  # a block, which no cell holds
    found: list[tuple[str, str | None]] = []
    for cell in cells:
        head = _HEADER.fullmatch(cell)
        name = head["name"] if head else cell.strip()
        if name not in allowed:
            hint = "; cells are separated by commas" if ";" in name else ""
            listed = ", ".join(allowed)
            raise DataError(f"{source}:1: {name!r} is not a column of a list of springs{hint}; columns are {listed}")
        if name in dict(found):
            raise DataError(f"{source}:1: the column {name!r} appears twice")
        found.append((name, head["unit"] if head else None))
    return found


def _cell(name: str, cell: str, unit: str | None) -> object:
    """Return a cell as a specification would say it."""
    if name == "counts":
        return tuple(int(one) if one.isdigit() else one for one in cell.split())
    if name in ("turns", "life") and _NUMBER.fullmatch(cell):
        return float(cell)
    return cell if unit is None else f"{cell} {unit}"
