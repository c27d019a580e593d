"""Values of a specification that a study varies: which may vary, and how: ``roller_radius=8 mm:16 mm:5``.

Any number, word or switch may vary, by its dotted path. A range includes both ends and is spaced evenly in the unit of
the border, so that 8 mm to 16 mm in five steps is 8, 10, 12, 14, 16 mm and not 10.000000000000002 mm.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from cfmkit.errors import Problem, QuantityError, SpecError, UsageError
from cfmkit.specs.block import STUDY_BLOCKS
from cfmkit.specs.units import BareFloat, UnitField, attach_dimension, format_quantity
from cfmkit.specs.units.fields import describe_value
from cfmkit.specs.yamlio.explain_validation_errors import not_among
from cfmkit.specs.yamlio.paths import Slot, describe_expected, required_keys

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cfmkit.specs.spec import Spec


Value = float | int | str | bool
Kind = Literal["quantity", "number", "whole", "word", "switch"]

FIXED_BLOCKS = ("cfmkit", "family", "name", "description", "requirements", *STUDY_BLOCKS)
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

    def read(self, stated: Any) -> tuple[Value, str]:
        """Return (value as `Spec.replace` takes it, dimension) of what a user wrote.

        Raises CannotVary if it is not what this leaf holds.
        """
        if self.kind == "quantity" and self.quantity is not None:
            return self._read_quantity(stated, self.quantity)
        if self.kind == "word":
            if self.choices and stated not in self.choices:
                raise CannotVary(not_among(stated, self.choices))
            if not isinstance(stated, str | int) or isinstance(stated, bool):
                raise CannotVary(f"{describe_value(stated)} is not text")
            return stated, "text"
        if self.kind == "switch":
            if not isinstance(stated, bool):
                raise CannotVary(f"{describe_value(stated)} is not true or false")
            return stated, "text"
        return self._read_number(stated)

    def _read_quantity(self, stated: Any, quantity: UnitField) -> tuple[Value, str]:
        marked = BareFloat(stated) if isinstance(stated, int | float) and not isinstance(stated, bool) else stated
        try:
            value, dimension = quantity.read(marked)
        except QuantityError as error:
            raise CannotVary(str(error)) from None
        return (attach_dimension(value, dimension) if self.has_several_dimensions else value), dimension

    def _read_number(self, stated: Any) -> tuple[Value, str]:
        if isinstance(stated, bool) or not isinstance(stated, int | float):
            raise CannotVary(f"{describe_value(stated)} is not a {'whole ' * (self.kind == 'whole')}number")
        if self.kind == "whole":
            if stated != int(stated):
                raise CannotVary(f"{stated} is not a whole number")
            return int(stated), "count"
        return float(stated), "ratio"


def length_to_vary(spec: Spec) -> tuple[str, float]:
    """Return the path and the value [mm] of the first length of a mechanism, for hints that show how to vary one."""
    from cfmkit.specs.yamlio import dump, read_document

    mechanism = read_document(dump(spec, False), "spec").tree["mechanism"]
    return next(_find_lengths(mechanism, "mechanism"), ("mechanism.LENGTH", 10.0))


def _find_lengths(tree: Any, path: str) -> Iterator[tuple[str, float]]:
    for key, value in tree.items():
        below = f"{path}.{key}"
        if isinstance(value, dict):
            yield from _find_lengths(value, below)
        elif isinstance(value, str) and (match := re.fullmatch(r"([0-9.]+) mm", value)) and float(match[1]) > 0:
            yield below, float(match[1])


def leaf(spec_type: type[Spec], path: str) -> Leaf:
    """Return what stands at a dotted path of a specification.

    Raises CannotVary if there is nothing, or nothing that can be varied; a near miss is named.
    """
    slots: tuple[Slot, ...] = (Slot(spec_type),)
    parts = path.split(".")
    if parts[0] in FIXED_BLOCKS:
        raise CannotVary(f"{parts[0]!r} is nothing to vary: it is not part of the mechanism or its analysis")
    for depth, part in enumerate(parts):
        key: str | int = int(part) if part.isdecimal() and part.isascii() and len(part) < 10 else part
        below = tuple(inner for slot in slots for inner in slot.child(key))
        if not below:
            raise CannotVary(_explain_unknown_path(spec_type, path, ".".join(parts[:depth]), slots))
        slots = below
    return _leaf_of(path, slots)


def _leaf_of(path: str, slots: tuple[Slot, ...]) -> Leaf:
    """Return the leaf that one of several allowed types is; the first that can be varied."""
    for slot in slots:
        if (kind := _kind_of_slot(slot)) is not None:
            return Leaf(path, kind, slot.quantity, slot.choices)
    blocks = [slot.model for slot in slots if slot.model is not None]
    if blocks:
        names = ", ".join(list(blocks[0].model_fields)[:6]) or ", ".join(required_keys(blocks[0]))
        raise CannotVary(f"{path!r} is a block; vary one of its values: {names}")
    raise CannotVary(f"{path!r} holds {describe_expected(slots, plain=True)}: vary one item of it, as {path}.0")


def _kind_of_slot(slot: Slot) -> Kind | None:
    if slot.quantity is not None:
        return "quantity"
    if slot.choices:
        return "word"
    kinds: dict[Any, Kind] = {bool: "switch", int: "whole", float: "number", str: "word"}
    return kinds.get(slot.kind)


def _explain_unknown_path(spec_type: type[Spec], path: str, above: str, slots: tuple[Slot, ...]) -> str:
    """Return an error that there is nothing at a path, and which one could be meant."""
    known_paths = list(paths(spec_type))
    last = path.rpartition(".")[2]
    endings = {path.rpartition(".")[2] for path in known_paths}
    similar = [last] if last in endings else difflib.get_close_matches(last, endings, n=1, cutoff=0.65)
    alike = [path for path in known_paths if path.rpartition(".")[2] in similar]
    if close := difflib.get_close_matches(path, alike, n=1, cutoff=0.0):
        return f"there is no {path!r}; did you mean {close[0]!r}?"
    names = [name for slot in slots if slot.model is not None for name in slot.model.model_fields]
    inside = [name for name in names if above or name not in FIXED_BLOCKS]
    where = f"below {above!r} there are" if above else "a path starts with"
    return f"there is no {path!r}; {where} {', '.join(inside)}" if inside else f"there is nothing below {above!r}"


def paths(spec_type: type[Spec]) -> Iterator[str]:
    """Yield the path of every leaf that can be varied; items of lists as ``.0``, of named ones as ``.NAME``."""
    for name in spec_type.model_fields:
        if name not in FIXED_BLOCKS:
            yield from _paths_below(Slot(spec_type).child(name), name, 1)


def _paths_below(slots: tuple[Slot, ...], path: str, depth: int) -> Iterator[str]:
    if any(_kind_of_slot(slot) for slot in slots):
        yield path
    for slot in slots if depth < _MAX_DEPTH else ():
        if slot.model is not None:
            for name in slot.model.model_fields:
                yield from _paths_below(slot.child(name), f"{path}.{name}", depth + 1)
        elif slot.origin in (tuple, list):
            yield from _paths_below(slot.child(0), f"{path}.0", depth + 1)
        elif slot.origin is dict:
            yield from _paths_below(slot.child(NAME_PLACEHOLDER), f"{path}.{NAME_PLACEHOLDER}", depth + 1)


VARY_EXAMPLE = "write e.g. --vary 'mechanism.roller_radius=8 mm:16 mm:5' or --vary 'a.b=[1 mm, 2 mm]'"
MAX_COUNT = 10**18  # no count is larger than this: whatever reads it stays a plain integer


@dataclass(frozen=True)
class WantedVariation:
    """Variations as the user wrote them."""

    path: str  # dotted
    content: str | tuple[Any, ...]  # ``start:stop:n`` or a list of values
    source: str = field(default="", compare=False)  # what messages call it: ``--vary mechanism.roller_radius``


@dataclass(frozen=True)
class Axis:
    """One thing that varies: listed values, or a range with or without a number of steps."""

    leaf: Leaf  # what varies
    dimension: str  # of `cfmkit.specs.units`; "text" for words and switches
    listed: tuple[Value, ...] = ()  # values as `Spec.replace` takes them; empty for a range
    ends: tuple[float, float] | None = None  # start and stop of a range [SI]
    count: int | None = None  # number of values; None for a range to draw from


def parse_variation(option: str) -> WantedVariation:
    """Return what ``--vary PATH=...`` asks for.

    Raises UsageError if it is malformed; SpecError if its list holds what no specification may.
    """
    from cfmkit.specs.units.strict_decimal_number import quote
    from cfmkit.specs.yamlio.tree_builder import read_text

    path, equals, content = (part.strip() for part in option.partition("="))
    if not equals or not content:
        raise UsageError(f"--vary {quote(option)}: no values; {VARY_EXAMPLE}")
    if not path or not all(part.strip() for part in path.split(".")):
        raise UsageError(f"--vary {quote(option)}: {quote(path)} is not a dotted path; {VARY_EXAMPLE}")
    source = f"--vary {path}"
    if not content.startswith("["):
        return WantedVariation(path, content, source)
    reading = read_text(content)
    if reading.faults or not isinstance(reading.tree, tuple):
        faults = [fault.message for fault in reading.faults] or [f"{quote(content)} is not a list"]
        raise SpecError([Problem(source, 0, 0, "", message) for message in faults])
    return WantedVariation(path, reading.tree, source)


def collect_variations(vary: Mapping[str, Any]) -> tuple[WantedVariation, ...]:
    """Return what a mapping asks for: path -> ``"start:stop:n"`` or a sequence of values."""
    axes = []
    for path, content in vary.items():
        axes.append(
            WantedVariation(path, content if isinstance(content, str) else tuple(content), f"sweep.vary: {path}")
        )
    return tuple(axes)


def axes(
    spec: Spec,  # what is varied
    wanted: Iterable[WantedVariation],  # in order; the first varies slowest
    drawn: bool = False,  # whether values are drawn from ranges (``start:stop``) rather than stepped through
    joint: bool = False,  # whether the lists are gone through side by side, so that one of them may repeat a value
) -> tuple[Axis, ...]:
    """Return what varies, checked against a specification.

    Raises SpecError with every fault of every request.
    """
    asked = tuple(wanted)
    problems = [Problem(problem.source, 0, 0, "", message) for problem, message in faults(spec, asked, drawn, joint)]
    if problems:
        raise SpecError(problems)
    return tuple(axis(spec, variation, drawn) for variation in asked)


def faults(
    spec: Spec, asked: tuple[WantedVariation, ...], drawn: bool, joint: bool = False
) -> Iterator[tuple[WantedVariation, str]]:
    """Yield (request, what is wrong with it)."""
    for index, variation in enumerate(asked):
        try:
            axis_of_path = axis(spec, variation, drawn)
        except CannotVary as problem:
            yield variation, str(problem)
            continue
        if not joint and (
            twice := [value for k, value in enumerate(axis_of_path.listed) if value in axis_of_path.listed[:k]]
        ):
            yield variation, f"{write_value(twice[0], axis_of_path.dimension)} appears twice in the list"
        for earlier in asked[:index]:
            if variation.path == earlier.path or f"{variation.path}.".startswith(f"{earlier.path}."):
                yield variation, f"{earlier.path!r} is varied already; one of them is enough"
            elif earlier.path.startswith(f"{variation.path}."):
                yield variation, f"{earlier.path!r}, which lies in it, is varied already; one of them is enough"


def axis(spec: Spec, variation: WantedVariation, drawn: bool) -> Axis:
    """Return one thing that varies.

    Raises CannotVary if path or values are wrong.
    """
    place = leaf(type(spec), variation.path)
    made = (
        _listed_axis(place, variation.content)
        if isinstance(variation.content, tuple)
        else _read_range(place, variation.content, drawn)
    )
    _refuse_missing_place(spec, variation.path, made.listed[0] if made.listed else made.ends)
    return made


def _refuse_missing_place(spec: Spec, path: str, value: Any) -> None:
    """Raise if the specification has no such place: an index beyond a list, a key below a value."""
    try:
        spec.replace({path: value[0] if isinstance(value, tuple) else value})
    except KeyError as problem:
        raise CannotVary(str(problem.args[0])) from None
    except SpecError:
        return  # a value out of bounds is a matter of one point


def _listed_axis(place: Leaf, items: tuple[Any, ...]) -> Axis:
    if not items:
        raise CannotVary("the list is empty")
    read = [place.read(item) for item in items]
    dimensions = {dimension for _, dimension in read}
    if len(dimensions) > 1:
        raise CannotVary(f"the values are of several kinds: {', '.join(sorted(dimensions))}")
    values = tuple(value for value, _ in read)
    return Axis(place, read[0][1], values, count=len(values))


def _read_range(place: Leaf, text: str, drawn: bool) -> Axis:
    parts = [part.strip() for part in text.split(":")]
    if place.kind in ("word", "switch"):
        words = ", ".join(map(str, place.choices)) or "a, b"
        raise CannotVary(f"{text!r} is not a list of words; write [{words}]")
    wanted = "start:stop" if drawn else "start:stop:n"
    if len(parts) != (2 if drawn else 3):
        more = "; samples are drawn from it, so that it has no number of steps" if drawn and len(parts) == 3 else ""
        raise CannotVary(f"{text!r} is not a range; write {wanted}, with units, or a list [a, b]{more}")
    start, stop = (_read_end(place, part) for part in parts[:2])
    if start[1] != stop[1]:
        raise CannotVary(f"{text!r} starts as {start[1]} and stops as {stop[1]}")
    low, high = float(start[0]), float(stop[0])
    if low == high:
        raise CannotVary(f"{text!r} starts where it stops; write [{parts[0]}] for one value")
    if drawn:
        return Axis(place, start[1], ends=(low, high))
    count = _read_count(parts[2])
    if place.kind == "whole" and (high - low) % (count - 1):
        raise CannotVary(f"{count} steps from {parts[0]} to {parts[1]} are no whole numbers")
    return Axis(place, start[1], ends=(low, high), count=count)


def _read_end(place: Leaf, text: str) -> tuple[Any, str]:
    """Return (SI value, dimension) of one end of a range."""
    from cfmkit.errors import QuantityError
    from cfmkit.specs.units import read_number

    if place.kind == "quantity":
        return place.read(text)
    try:
        return place.read(read_number(text))
    except QuantityError as error:
        raise CannotVary(str(error)) from None


def _read_count(text: str) -> int:
    if not (text.isascii() and text.isdigit()):
        raise CannotVary(f"{text!r} is not a number of values; write e.g. 11")
    count = int(text) if len(text) < 19 else MAX_COUNT
    if count < 2:
        raise CannotVary(f"a range has at least 2 values, not {count}")
    return count


def write_value(value: Any, dimension: str) -> str:
    """Return a value as a user would write it."""
    if dimension == "text":
        return str(value).lower() if isinstance(value, bool) else str(value)
    return str(value) if isinstance(value, int) else format_quantity(float(value), dimension)
