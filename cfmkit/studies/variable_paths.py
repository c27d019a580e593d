"""Which values of a specification a study may vary: any number, word or switch, by its dotted path."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from cfmkit.errors import QuantityError
from cfmkit.specs.units import BareFloat, UnitField, attach_dimension
from cfmkit.specs.units.fields import describe_value
from cfmkit.specs.yamlio.allowed_at_path import Slot, describe_expected, required_keys
from cfmkit.specs.yamlio.explain_validation_errors import not_among

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.specs.spec import Spec


Value = float | int | str | bool
Kind = Literal["quantity", "number", "whole", "word", "switch"]

FIXED_BLOCKS = ("cfmkit", "family", "name", "description", "requirements", "sweep", "sensitivity")
"""Blocks of a specification that do not describe the mechanism or its analysis."""
NAME_PLACEHOLDER = "NAME"  # stands for any name of a block's own choosing in a path, as the name of a beam
_MAX_DEPTH = 8


class CannotVary(ValueError):
    """A path or a value that a study cannot take; the message says why and what to do."""


@dataclass(frozen=True)
class Leaf:
    """One value of a specification."""

    path: str  # dotted, with indices for the items of lists
    kind: Kind  # "quantity" (a number with a unit), "number", "whole" number, "word" or "switch"
    quantity: UnitField | None = None  # how a quantity is read
    choices: tuple[Any, ...] = ()  # the words of a closed choice

    @property
    def has_several_dimensions(self) -> bool:
        """Return whether a value has to know its own dimension, as a place that is a length or an angle."""
        return self.quantity is not None and len(self.quantity.dimensions) > 1

    def read(self, given: Any) -> tuple[Value, str]:
        """Return (value as `Spec.replace` takes it, dimension) of what a user wrote.

        Raises CannotVary if it is not what this leaf holds.
        """
        if self.kind == "quantity" and self.quantity is not None:
            return self._quantity(given, self.quantity)
        if self.kind == "word":
            if self.choices and given not in self.choices:
                raise CannotVary(not_among(given, self.choices))
            if not isinstance(given, str | int) or isinstance(given, bool):
                raise CannotVary(f"{describe_value(given)} is not text")
            return given, "text"
        if self.kind == "switch":
            if not isinstance(given, bool):
                raise CannotVary(f"{describe_value(given)} is not true or false")
            return given, "text"
        return self._number(given)

    def _quantity(self, given: Any, quantity: UnitField) -> tuple[Value, str]:
        marked = BareFloat(given) if isinstance(given, int | float) and not isinstance(given, bool) else given
        try:
            value, dimension = quantity.read(marked)
        except QuantityError as error:
            raise CannotVary(str(error)) from None
        return (attach_dimension(value, dimension) if self.has_several_dimensions else value), dimension

    def _number(self, given: Any) -> tuple[Value, str]:
        if isinstance(given, bool) or not isinstance(given, int | float):
            raise CannotVary(f"{describe_value(given)} is not a {'whole ' * (self.kind == 'whole')}number")
        if self.kind == "whole":
            if given != int(given):
                raise CannotVary(f"{given} is not a whole number")
            return int(given), "count"
        return float(given), "ratio"


def length_to_vary(spec: Spec) -> tuple[str, float]:
    """Return the path and the value [mm] of the first length of a mechanism, for hints that show how to vary one."""
    from cfmkit.specs.yamlio import dump, read_document

    mechanism = read_document(dump(spec, False), "spec").tree["mechanism"]
    return next(_lengths(mechanism, "mechanism"), ("mechanism.LENGTH", 10.0))


def _lengths(tree: Any, path: str) -> Iterator[tuple[str, float]]:
    for key, value in tree.items():
        below = f"{path}.{key}"
        if isinstance(value, dict):
            yield from _lengths(value, below)
        elif isinstance(value, str) and (found := re.fullmatch(r"([0-9.]+) mm", value)) and float(found[1]) > 0:
            yield below, float(found[1])


def leaf(spec_type: type[Spec], path: str) -> Leaf:
    """Return what stands at a dotted path of a specification.

    Raises CannotVary if there is nothing, or nothing that can be varied; a near miss is named.
    """
    here: tuple[Slot, ...] = (Slot(spec_type),)
    parts = path.split(".")
    if parts[0] in FIXED_BLOCKS:
        raise CannotVary(f"{parts[0]!r} is nothing to vary: it is not part of the mechanism or its analysis")
    for depth, part in enumerate(parts):
        key: str | int = int(part) if part.isdecimal() and part.isascii() and len(part) < 10 else part
        below = tuple(inner for slot in here for inner in slot.child(key))
        if not below:
            raise CannotVary(_unknown(spec_type, path, ".".join(parts[:depth]), here))
        here = below
    return _leaf_of(path, here)


def _leaf_of(path: str, slots: tuple[Slot, ...]) -> Leaf:
    """Return the leaf that one of several allowed types is; the first that can be varied."""
    for slot in slots:
        if (kind := _kind(slot)) is not None:
            return Leaf(path, kind, slot.quantity, slot.choices)
    blocks = [slot.model for slot in slots if slot.model is not None]
    if blocks:
        names = ", ".join(list(blocks[0].model_fields)[:6]) or ", ".join(required_keys(blocks[0]))
        raise CannotVary(f"{path!r} is a block; vary one of its values: {names}")
    raise CannotVary(f"{path!r} holds {describe_expected(slots, plain=True)}: vary one item of it, as {path}.0")


def _kind(slot: Slot) -> Kind | None:
    if slot.quantity is not None:
        return "quantity"
    if slot.choices:
        return "word"
    kinds: dict[Any, Kind] = {bool: "switch", int: "whole", float: "number", str: "word"}
    return kinds.get(slot.kind)


def _unknown(spec_type: type[Spec], path: str, above: str, here: tuple[Slot, ...]) -> str:
    """Return an error that there is nothing at a path, and which one could be meant."""
    known = list(paths(spec_type))
    last = path.rpartition(".")[2]
    endings = {one.rpartition(".")[2] for one in known}
    similar = [last] if last in endings else difflib.get_close_matches(last, endings, n=1, cutoff=0.65)
    alike = [one for one in known if one.rpartition(".")[2] in similar]
    if near := difflib.get_close_matches(path, alike, n=1, cutoff=0.0):
        return f"there is no {path!r}; did you mean {near[0]!r}?"
    names = [name for slot in here if slot.model is not None for name in slot.model.model_fields]
    inside = [name for name in names if above or name not in FIXED_BLOCKS]
    where = f"below {above!r} there are" if above else "a path starts with"
    return f"there is no {path!r}; {where} {', '.join(inside)}" if inside else f"there is nothing below {above!r}"


def paths(spec_type: type[Spec]) -> Iterator[str]:
    """Yield the path of every leaf that can be varied; items of lists as ``.0``, of named ones as ``.NAME``."""
    for name in spec_type.model_fields:
        if name not in FIXED_BLOCKS:
            yield from _paths_below(Slot(spec_type).child(name), name, 1)


def _paths_below(slots: tuple[Slot, ...], path: str, depth: int) -> Iterator[str]:
    if any(_kind(slot) for slot in slots):
        yield path
    for slot in slots if depth < _MAX_DEPTH else ():
        if slot.model is not None:
            for name in slot.model.model_fields:
                yield from _paths_below(slot.child(name), f"{path}.{name}", depth + 1)
        elif slot.origin in (tuple, list):
            yield from _paths_below(slot.child(0), f"{path}.0", depth + 1)
        elif slot.origin is dict:
            yield from _paths_below(slot.child(NAME_PLACEHOLDER), f"{path}.{NAME_PLACEHOLDER}", depth + 1)
