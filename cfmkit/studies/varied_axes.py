"""Variations: ``mechanism.roller_radius=8 mm:16 mm:5`` read against a specification.

A range includes both ends and is spaced evenly in the unit of the border, so that
8 mm to 16 mm in five steps is 8, 10, 12, 14, 16 mm and not 10.000000000000002 mm.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from cfmkit.errors import Problem, SpecError, UsageError
from cfmkit.specs.units import format_quantity
from cfmkit.studies.variable_paths import CannotVary, Leaf, leaf

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cfmkit.specs.spec import Spec
    from cfmkit.studies.variable_paths import Value

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
    found = []
    for path, content in vary.items():
        found.append(
            WantedVariation(path, content if isinstance(content, str) else tuple(content), f"sweep.vary: {path}")
        )
    return tuple(found)


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
    problems = [Problem(one.source, 0, 0, "", message) for one, message in faults(spec, asked, drawn, joint)]
    if problems:
        raise SpecError(problems)
    return tuple(axis(spec, one, drawn) for one in asked)


def faults(
    spec: Spec, asked: tuple[WantedVariation, ...], drawn: bool, joint: bool = False
) -> Iterator[tuple[WantedVariation, str]]:
    """Yield (request, what is wrong with it)."""
    for index, one in enumerate(asked):
        try:
            found = axis(spec, one, drawn)
        except CannotVary as problem:
            yield one, str(problem)
            continue
        if not joint and (twice := [value for k, value in enumerate(found.listed) if value in found.listed[:k]]):
            yield one, f"{write_value(twice[0], found.dimension)} appears twice in the list"
        for other in asked[:index]:
            if one.path == other.path or f"{one.path}.".startswith(f"{other.path}."):
                yield one, f"{other.path!r} is varied already; one of them is enough"
            elif other.path.startswith(f"{one.path}."):
                yield one, f"{other.path!r}, which lies in it, is varied already; one of them is enough"


def axis(spec: Spec, one: WantedVariation, drawn: bool) -> Axis:
    """Return one thing that varies.

    Raises CannotVary if path or values are wrong.
    """
    found = leaf(type(spec), one.path)
    made = _listed_axis(found, one.content) if isinstance(one.content, tuple) else _range(found, one.content, drawn)
    _try(spec, one.path, made.listed[0] if made.listed else made.ends)
    return made


def _try(spec: Spec, path: str, value: Any) -> None:
    """Raise if the specification has no such place: an index beyond a list, a key below a value."""
    try:
        spec.replace({path: value[0] if isinstance(value, tuple) else value})
    except KeyError as problem:
        raise CannotVary(str(problem.args[0])) from None
    except SpecError:
        return  # a value out of bounds is a matter of one point


def _listed_axis(found: Leaf, items: tuple[Any, ...]) -> Axis:
    if not items:
        raise CannotVary("the list is empty")
    read = [found.read(item) for item in items]
    dimensions = {dimension for _, dimension in read}
    if len(dimensions) > 1:
        raise CannotVary(f"the values are of several kinds: {', '.join(sorted(dimensions))}")
    values = tuple(value for value, _ in read)
    return Axis(found, read[0][1], values, count=len(values))


def _range(found: Leaf, text: str, drawn: bool) -> Axis:
    parts = [part.strip() for part in text.split(":")]
    if found.kind in ("word", "switch"):
        words = ", ".join(map(str, found.choices)) or "a, b"
        raise CannotVary(f"{text!r} is not a list of words; write [{words}]")
    wanted = "start:stop" if drawn else "start:stop:n"
    if len(parts) != (2 if drawn else 3):
        more = "; samples are drawn from it, so that it has no number of steps" if drawn and len(parts) == 3 else ""
        raise CannotVary(f"{text!r} is not a range; write {wanted}, with units, or a list [a, b]{more}")
    start, stop = (_end(found, part) for part in parts[:2])
    if start[1] != stop[1]:
        raise CannotVary(f"{text!r} starts as {start[1]} and stops as {stop[1]}")
    low, high = float(start[0]), float(stop[0])
    if low == high:
        raise CannotVary(f"{text!r} starts where it stops; write [{parts[0]}] for one value")
    if drawn:
        return Axis(found, start[1], ends=(low, high))
    count = _count(parts[2])
    if found.kind == "whole" and (high - low) % (count - 1):
        raise CannotVary(f"{count} steps from {parts[0]} to {parts[1]} are no whole numbers")
    return Axis(found, start[1], ends=(low, high), count=count)


def _end(found: Leaf, text: str) -> tuple[Any, str]:
    """Return (SI value, dimension) of one end of a range."""
    from cfmkit.errors import QuantityError
    from cfmkit.specs.units import read_number

    if found.kind == "quantity":
        return found.read(text)
    try:
        return found.read(read_number(text))
    except QuantityError as error:
        raise CannotVary(str(error)) from None


def _count(text: str) -> int:
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
