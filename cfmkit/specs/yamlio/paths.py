"""Paths into a specification (``requirements.0.max``): values set there, types allowed there, paths of errors.

pydantic says where an error is by `loc`, which mixes keys with the labels of union members. `trace` follows it through
the types and the tree side by side, so that the user gets the path he wrote.
"""

from __future__ import annotations

import math
import operator
import re
import types
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from cfmkit.specs.block import Model, keys_of
from cfmkit.specs.units.fields import (
    MAX_QUANTITY,
    MIN_QUANTITY,
    MOST_TURNS,
    DimensionedFloat,
    MetricValue,
    TravelShare,
    UnitField,
)
from cfmkit.specs.units.quantities import describe_dimensions, example
from cfmkit.specs.units.strict_decimal_number import quote

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


Path = tuple[str | int, ...]


def parse_indices(path: tuple[str, ...], tree: Any) -> Path:
    """Return a path with list indices as numbers, as far as the tree has lists there."""
    result: list[str | int] = []
    for part in path:
        inside = isinstance(tree, tuple) and part.isdecimal() and int(part) < len(tree)
        key: str | int = int(part) if inside else part
        tree = tree[key] if inside else tree.get(part) if isinstance(tree, dict) else None
        result.append(key)
    return tuple(result)


def to_dotted(path: Path) -> str:
    """Return a path as ``requirements.0.max``; odd keys are quoted."""
    return ".".join(str(part) if re.fullmatch(r"[\w-]{1,60}", str(part)) else quote(str(part)) for part in path)


def read_item_suffix(path: str) -> str:
    """Return the number of an item at the end of a dotted path with its dot; "" if it has none."""
    last = path.rpartition(".")[2]
    return f".{last}" if last.isdecimal() else ""


SHORT_FOR = {"material": "name"}
"""Keys whose bare text is short for a block with that one key: ``material: pla`` is ``material: {name: pla}``."""


class NoSuchPlace(KeyError):
    """There is no place in a specification where a value could go."""

    def __str__(self) -> str:
        """Return the sentence without quotes."""
        return str(self.args[0])


def with_value(tree: Any, path: Sequence[str], value: Any) -> Any:
    """Return a copy of a specification, read or not, with a value at a path; missing blocks are made.

    Raises NoSuchPlace if the path leads through a value, or out of a list.
    """
    head, rest = path[0], path[1:]
    if isinstance(tree, tuple | list):
        index = _parse_index(head, tree)
        new = with_value(tree[index], rest, value) if rest else _keep_dimension(tree[index], value)
        return (*tree[:index], new, *tree[index + 1 :])
    if isinstance(tree, Model):
        tree = keys_of(tree)
    if tree is not None and not isinstance(tree, Mapping):
        raise NoSuchPlace(f"{head!r} is below a value; only blocks and lists have something below them")
    block = dict(tree or {})
    below = block.get(head)
    if rest and head in SHORT_FOR and isinstance(below, str):
        below = {SHORT_FOR[head]: below}
    block[head] = with_value(below, rest, value) if rest else _keep_dimension(below, value)
    return block


def _keep_dimension(before: Any, value: Any) -> Any:
    """Return a value; a number in SI that replaces an angle, say, is an angle, too. Of a share it cannot be known."""
    if isinstance(before, DimensionedFloat) and not isinstance(before, TravelShare) and type(value) is float:
        return type(before)(value, before.dimension)
    return value


def _parse_index(text: str, items: Sequence[Any]) -> int:
    if not re.fullmatch("[0-9]{1,9}", text) or int(text) >= len(items):
        count = f"0 to {len(items) - 1}" if items else "none: the list is empty"
        raise NoSuchPlace(f"{quote(text)} is not an index of this list; there are {count}")
    return int(text)


_PRIMITIVE_WORDS = {int: "a whole number", float: "a number", str: "text", bool: "true or false", dict: "a block"}
_METRIC_MARKER = get_args(MetricValue)[1]
MISSING_VALUE = object()


@dataclass(frozen=True)
class Slot:
    """One type that is allowed somewhere, with the annotations on it."""

    kind: Any
    metadata: tuple[Any, ...] = ()

    @property
    def model(self) -> type[BaseModel] | None:
        """The block's type, if a block is meant."""
        return self.kind if isinstance(self.kind, type) and issubclass(self.kind, BaseModel) else None

    @property
    def origin(self) -> Any:
        """``tuple`` for ``tuple[int, ...]``, the type itself where it has no arguments."""
        return get_origin(self.kind) or self.kind

    @property
    def quantity(self) -> UnitField | None:
        """The quantity, if a number with a unit is meant."""
        return next((item for item in self.metadata if isinstance(item, UnitField)), None)

    @property
    def choices(self) -> tuple[Any, ...]:
        """The words of a closed choice."""
        return get_args(self.kind) if self.origin is Literal else ()

    @property
    def bounds(self) -> dict[str, Any]:
        """The bounds gt, ge, lt, le that the annotations set."""
        names = ("gt", "ge", "lt", "le")
        return {name: getattr(item, name) for item in self.metadata for name in names if hasattr(item, name)}

    def allows(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which SI numbers may stand here."""
        import numpy as np

        sizes, most = np.abs(values), MAX_QUANTITY
        if self.quantity is not None and "angle" in self.quantity.dimensions:
            most = MOST_TURNS * math.tau
        allowed: NDArray[np.bool_] = (values == 0.0) | ((sizes >= MIN_QUANTITY) & (sizes <= most))
        for name, bound in self.bounds.items():
            allowed &= getattr(operator, name)(values, bound)
        return allowed & (values == np.rint(values)) if self.origin is int else allowed

    def child(self, key: str | int) -> tuple[Slot, ...]:
        """Return what is allowed below a key or index; nothing if it does not exist."""
        if self.model is not None:
            fields = self.model.model_fields
            field = fields.get(str(key)) or next(
                (candidate for candidate in fields.values() if candidate.alias == key), None
            )
            return slots(field.annotation, tuple(field.metadata)) if field else ()
        arguments = get_args(self.kind)
        if isinstance(self.origin, type) and issubclass(self.origin, Mapping):
            return slots(arguments[1]) if len(arguments) == 2 else ()
        if self.origin in (tuple, list) and isinstance(key, int) and arguments:
            fixed = self.origin is tuple and arguments[-1] is not Ellipsis
            return slots(arguments[key]) if fixed and key < len(arguments) else slots(arguments[0])
        return ()

    def matches(self, tag: str) -> bool:
        """Return True if a union member's label of pydantic may mean this type."""
        if self.model is None:
            return str(getattr(self.origin, "__name__", self.origin)).lower() in tag.lower()
        fields = self.model.model_fields.values()
        return self.model.__name__ in tag or any(tag in map(str, get_args(f.annotation)) for f in fields)

    def describe_expected(self) -> str:
        """Return what to write, with an example: ``a length, e.g. '200 mm'``."""
        if self.quantity:
            return f"{describe_dimensions(self.quantity.dimensions)}, e.g. {example(self.quantity.dimensions)}"
        if _METRIC_MARKER in self.metadata:
            return "a number with the unit of the metric, e.g. '5 %'"
        if self.choices:
            return "one of " + ", ".join(map(repr, self.choices)) if len(self.choices) > 1 else repr(self.choices[0])
        if self.model is not None:
            return "a block with " + ", ".join(required_keys(self.model) or list(self.model.model_fields)[:6])
        if self.origin in (tuple, list):
            return f"a list{self._length_in_words()}, each item {describe_expected(self.child(0), plain=True)}"
        return _PRIMITIVE_WORDS.get(self.origin, "a value")

    def _length_in_words(self) -> str:
        arguments = get_args(self.kind)
        fixed = self.origin is tuple and arguments and arguments[-1] is not Ellipsis
        return f" of {len(arguments)}" if fixed else ""


@dataclass(frozen=True)
class Trace:
    """Location of a pydantic error: the path in the tree, what is there, and what is allowed."""

    path: Path
    node: Any
    slots: tuple[Slot, ...]
    parents: tuple[Slot, ...]
    tags: tuple[tuple[Path, str], ...]


def slots(annotation: Any, metadata: tuple[Any, ...] = ()) -> tuple[Slot, ...]:
    """Return every type that an annotation allows, unions and aliases taken apart, None left out."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *extra = get_args(annotation)
        return slots(inner, metadata + _flatten_annotations(extra))
    if origin in (Union, types.UnionType):
        members = (item for item in get_args(annotation) if item is not type(None))
        return tuple(slot for item in members for slot in slots(item, metadata))
    if hasattr(annotation, "__value__"):
        return slots(annotation.__value__, metadata)
    return () if annotation is type(None) else (Slot(annotation, metadata),)


def slots_at(model: type[BaseModel], path: str) -> tuple[Slot, ...]:
    """Return every type that is allowed at a dotted path of a block; none if there is nothing."""
    allowed: tuple[Slot, ...] = (Slot(model),)
    for part in path.split("."):
        key: str | int = int(part) if part.isdecimal() and part.isascii() and len(part) < 10 else part
        allowed = tuple(inner for slot in allowed for inner in slot.child(key))
    return allowed


def _flatten_annotations(extra: list[Any]) -> tuple[Any, ...]:
    """Return annotations in one row: those inside a ``Field(...)`` taken out of it."""
    return tuple(metadata for item in extra for metadata in (*getattr(item, "metadata", ()), item))


def required_keys(model: type[BaseModel]) -> list[str]:
    """Return the keys that a block must have."""
    return [name for name, field in model.model_fields.items() if field.is_required()]


def describe_expected(allowed: tuple[Slot, ...], plain: bool = False) -> str:
    """Return what to write where several types are allowed; `plain` leaves the examples out."""
    words = dict.fromkeys(
        slot.describe_expected().split(", e.g.")[0] if plain else slot.describe_expected() for slot in allowed
    )
    joint = ", or " if any("," in word for word in words) else " or "
    return joint.join(words) or "a value"


def trace(model: type[BaseModel], tree: Any, loc: tuple[str | int, ...]) -> Trace:
    """Return where in the tree pydantic's `loc` points."""
    trace = Trace((), tree, (Slot(model),), (), ())
    label_due = False
    for item in loc:
        if label_due:
            trace, label_due = _narrow_trace(trace, str(item)), False
            continue
        before = trace
        trace = _step_down(trace, item)
        label_due = trace is not before and len(trace.slots) > 1
    return trace


def _narrow_trace(trace: Trace, tag: str) -> Trace:
    members = tuple(slot for slot in trace.slots if slot.matches(tag)) or trace.slots
    return Trace(trace.path, trace.node, members, trace.parents, (*trace.tags, (trace.path, tag)))


def _step_down(trace: Trace, item: str | int) -> Trace:
    """Go one step down.

    What neither the tree nor the types know is a label. A key or index that a
    validator put around what the user wrote adds nothing to the path.
    """
    allowed = tuple(slot for parent in trace.slots for slot in parent.child(item))
    step = _child_of(trace.node, item)
    if step is MISSING_VALUE and not allowed:
        return trace
    if (
        step is MISSING_VALUE
        and trace.node is not MISSING_VALUE
        and not isinstance(trace.node, dict if isinstance(item, str) else tuple)
    ):
        return Trace(trace.path, trace.node, allowed, trace.slots, trace.tags)
    return Trace((*trace.path, item), step, allowed, trace.slots, trace.tags)


def _child_of(node: Any, item: str | int) -> Any:
    if isinstance(node, BaseModel):
        return getattr(node, str(item), MISSING_VALUE)
    if isinstance(node, dict):
        return node.get(item, MISSING_VALUE)
    if isinstance(node, tuple) and isinstance(item, int) and 0 <= item < len(node):
        return node[item]
    return MISSING_VALUE
