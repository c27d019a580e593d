"""Errors of pydantic in the words of the person who wrote the specification, with what was probably meant.

One fault gives one message: of a union only the member that the user can have
meant is heard, and a missing key is not reported where a misspelt one explains it.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel

from cfmkit.errors import Problem, QuantityError, SpecError
from cfmkit.specs.units.fields import describe_value
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.specs.yamlio.paths import Path, Trace, describe_expected, to_dotted, trace

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pydantic import ValidationError

MOST_LISTED = 16
MOST_EXPLAINED = 500
_OLD_BOOLS = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}


@dataclass(frozen=True)
class Complaint:
    """One fault: the path it is at, and what to say. `at_key` points at the key, not at its value."""

    path: Path
    message: str
    at_key: bool = False


@dataclass(frozen=True)
class _Error:
    """One line of a pydantic error, traced."""

    kind: str
    trace: Trace
    context: dict[str, Any]
    text: str

    @property
    def misfit(self) -> bool:
        """Whether only the shape is wrong: a list where a number is wanted, and the like."""
        node = self.trace.node
        if isinstance(self.context.get("error"), QuantityError):
            return isinstance(node, dict | tuple | bool) or (isinstance(node, str) and not re.match(" *[-+.0-9]", node))
        return self.kind.endswith("_type") or self.kind in ("int_from_float", "literal_error", "enum")

    @property
    def echo(self) -> bool:
        """True if a list has too few items for pydantic only because it does not count faulty ones."""
        node = self.trace.node
        return self.kind == "too_short" and isinstance(node, tuple | dict) and len(node) >= self.context["min_length"]


def spec_error(error: ValidationError, model: type[BaseModel], tree: Any) -> SpecError:
    """Return a pydantic error about values that come from no file, with the paths that are wrong."""
    return SpecError(
        [Problem("", 0, 0, to_dotted(complaint.path), complaint.message) for complaint in explain(error, model, tree)]
    )


def explain(
    error: ValidationError,  # what validating `tree` as `model` raised
    model: type[BaseModel],  # the type that was wanted
    tree: Any,  # what was validated: nested dicts and tuples
) -> list[Complaint]:
    """Return what is wrong with a tree, one complaint a fault."""
    lines = [
        _Error(line["type"], trace(model, tree, line["loc"]), line.get("ctx", {}), line["msg"])
        for line in error.errors(include_url=False, include_input=False)[:MOST_EXPLAINED]
    ]
    complaints = [_explain_error(line) for line in _drop_unmeant([line for line in lines if not line.echo], 0)]
    return _drop_echoes(list(dict.fromkeys(complaints)))


def _drop_unmeant(lines: list[_Error], depth: int) -> list[_Error]:
    """Return the errors without those of union members that the user cannot have meant."""
    kept = [line for line in lines if len(line.trace.tags) <= depth]
    inside = [line for line in lines if len(line.trace.tags) > depth]
    by_place = sorted(inside, key=lambda line: str(line.trace.tags[depth][0]))
    for _, group in groupby(by_place, key=lambda line: line.trace.tags[depth][0]):
        kept += _drop_unmeant(_likeliest_member(list(group), depth), depth + 1)
    return kept


def _likeliest_member(lines: list[_Error], depth: int) -> list[_Error]:
    """Return the errors of the likeliest member of one union."""
    members: dict[str, list[_Error]] = {}
    for line in lines:
        members.setdefault(line.trace.tags[depth][1], []).append(line)
    place = lines[0].trace.tags[depth][0]
    fitting = [
        member_lines
        for member_lines in members.values()
        if not any(line.misfit and line.trace.path == place for line in member_lines)
    ]
    if fitting:
        return min(fitting, key=len)
    return lines[:1] if len(members) == 1 else [_union_error(lines, place)]


def _union_error(lines: list[_Error], place: Path) -> _Error:
    allowed = tuple(slot for line in lines if line.trace.path == place for slot in line.trace.slots)
    first = lines[0].trace
    return _Error("union", Trace(place, first.node, allowed, first.parents, first.tags), {}, "")


def _explain_error(line: _Error) -> Complaint:
    if line.kind == "missing":
        return _describe_missing(line.trace)
    if line.kind == "extra_forbidden":
        return Complaint(line.trace.path, _describe_unknown_key(line.trace), at_key=True)
    if line.kind.startswith("union_tag"):
        return _unknown_kind(line)
    explainer = _EXPLAINER_BY_TYPE.get(line.kind, _translate_pydantic_message)
    return Complaint(line.trace.path, " ".join(explainer(line).split()))


def _describe_missing(trace: Trace) -> Complaint:
    if not trace.path:
        return Complaint((), f"{describe_expected(trace.slots)} is missing")
    last = trace.path[-1]
    what = f"the key {last!r}" if isinstance(last, str) else f"item {last + 1} of the list"
    return Complaint(trace.path[:-1], f"{what} is missing: {describe_expected(trace.slots)}")


def _describe_unknown_key(trace: Trace) -> str:
    fields = [field for slot in trace.parents if slot.model is not None for field in slot.model.model_fields.items()]
    names = [field.alias or name for name, field in fields]
    key = str(trace.path[-1]) if trace.path else ""
    removed = (getattr(slot.model, "removed_keys", {}).get(key) for slot in trace.parents)
    if instead := next(filter(None, removed), ""):
        return f"the key {quote(key)} was removed; {instead}"
    deeper = [f"{name}.{key}" for name, field in fields if _has_key(field.annotation, key)]
    meant = f"did you mean {' or '.join(map(quote, deeper))}?" if deeper else did_you_mean(key, names)
    hint = meant or list_allowed("allowed are", names)
    return f"unknown key {quote(key)}" + (f"; {hint}" if hint else "")


def _has_key(annotation: Any, key: str) -> bool:
    """Return True if a block has a key."""
    blocks = (annotation, *get_args(annotation))
    return any(
        isinstance(block, type) and issubclass(block, BaseModel) and key in block.model_fields for block in blocks
    )


def _unknown_kind(line: _Error) -> Complaint:
    """Explain a block whose telling key is missing or says something unknown."""
    key = str(line.context.get("discriminator", "")).strip("'")
    allowed = re.findall("'([^']*)'", str(line.context.get("expected_tags", ""))) or [
        str(choice) for slot in line.trace.slots for inner in slot.child(key) for choice in inner.choices
    ]
    if line.kind == "union_tag_not_found":
        return Complaint(line.trace.path, f"the key {key!r} is missing: one of {', '.join(map(repr, allowed))}")
    return Complaint((*line.trace.path, key), not_among(line.context.get("tag"), allowed))


def not_among(value: Any, allowed: Sequence[Any]) -> str:
    """Return an error that a value is none of a closed list of words, and which one comes near."""
    if len(allowed) == 1:
        return f"{describe_value(value)} is not allowed here, only {describe_value(allowed[0])} is"
    hint = did_you_mean(str(value), [str(item) for item in allowed])
    reported = list_allowed("one of", allowed) or "a known choice"
    return f"{describe_value(value)} is not {reported}" + (f"; {hint}" if hint else "")


def did_you_mean(word: str, names: Sequence[str]) -> str:
    """Return ``did you mean 'x'?`` if something known is near, else nothing."""
    tidy = word.lower().replace("-", "_").replace(" ", "_")
    by_tidy = {name.lower().replace("-", "_"): name for name in names}
    close = difflib.get_close_matches(tidy[:100], list(by_tidy), n=1, cutoff=0.65)
    return f"did you mean {by_tidy[close[0]]!r}?" if close else ""


def list_allowed(words: str, items: Sequence[Any]) -> str:
    """Return ``allowed are a, b, c``, or nothing where that would be long."""
    return f"{words} {', '.join(str(item) for item in items)}" if 0 < len(items) <= MOST_LISTED else ""


def _drop_echoes(complaints: list[Complaint]) -> list[Complaint]:
    """Drop missing keys that a misspelt key beside them, or one of an earlier version, explains."""
    hinted = {
        (complaint.path[:-1], match[1])
        for complaint in complaints
        if complaint.at_key and (match := re.search("(?:did you mean|was removed; write) '(.+)'", complaint.message))
    }
    kept = []
    for complaint in complaints:
        match = re.match("the key '(.+?)' is missing", complaint.message)
        if not match or (complaint.path, match[1]) not in hinted:
            kept.append(complaint)
    return kept


def _describe_needed(line: _Error) -> str:
    """Return what is needed in place of what is there, in words."""
    value = line.trace.node
    if value is None:
        return f"nothing is given here; {describe_expected(line.trace.slots)} is needed"
    choices = [str(choice) for slot in line.trace.slots for choice in slot.choices]
    hint = f"; write [{value}]" if line.kind == "tuple_type" and isinstance(value, str) and "," in value[:60] else ""
    hint = hint or (f"; {guess}" if isinstance(value, str) and (guess := did_you_mean(value, choices)) else "")
    return f"{describe_value(value)} does not fit here; {describe_expected(line.trace.slots)} is needed{hint}"


def _describe_not_text(line: _Error) -> str:
    value = line.trace.node
    if isinstance(value, bool | int | float):
        return f"{describe_value(value)} is not text; quote it, if text is meant"
    return _describe_needed(line)


def _describe_not_bool(line: _Error) -> str:
    value = line.trace.node
    hint = _OLD_BOOLS.get(value.lower()) if isinstance(value, str) else None
    return f"{describe_value(value)} is not true or false" + (f"; write {hint}" if hint else "")


def _describe_not_number(line: _Error) -> str:
    value = line.trace.node
    kind = "a whole number" if line.kind.startswith("int") else "a number"
    if isinstance(value, str):
        unit = "; a plain number without a unit is needed" if re.match("[-+.0-9]", value) else ""
        return f"{describe_value(value)} is not {kind}{unit}"
    return f"{describe_value(value)} is not {kind}" if isinstance(value, bool | float) else _describe_needed(line)


def _describe_not_a_choice(line: _Error) -> str:
    choices = [choice for slot in line.trace.slots for choice in slot.choices]
    if not choices:
        return f"{describe_value(line.trace.node)} is not allowed; allowed are {line.context.get('expected', '')}"
    return not_among(line.trace.node, choices)


def _explain_bounds(line: _Error) -> str:
    """Name the value and all its bounds, with units where it has some."""
    slot = next((slot for slot in line.trace.slots if slot.bounds), None)
    value = line.trace.node
    if slot is not None and slot.quantity is not None:
        reported = value.strip() if isinstance(value, str) else slot.quantity.format_value(float(value))
        return f"{reported} is not allowed: must be {slot.quantity.describe_allowed(slot.bounds, reported)}"
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    bounds = slot.bounds if slot else {name: line.context[name] for name in signs if name in line.context}
    limits = " and ".join(f"{signs[name]} {bound}" for name, bound in bounds.items())
    return f"{describe_value(value).strip(chr(39))} is not allowed: must be {limits}"


def _describe_length(line: _Error) -> str:
    least, most = line.context.get("min_length"), line.context.get("max_length")
    limit = f"at least {least} must be there" if least is not None else f"at most {most} may be there"
    value = line.trace.node
    if isinstance(value, str):
        return f"the text has {len(value)} characters; {limit}" if value else "the text is empty"
    if isinstance(value, dict):
        return f"the block has {len(value)} entries; {limit}" if value else f"the block is empty; {limit}"
    return f"the list has {len(value)} items; {limit}" if isinstance(value, tuple) else _describe_needed(line)


def _message_of_validator(line: _Error) -> str:
    return str(line.context.get("error", line.text)) or "is not allowed"


def _translate_pydantic_message(line: _Error) -> str:
    return line.text.replace("Input should", f"{describe_value(line.trace.node)} should").replace("Value error, ", "")


_EXPLAINER_BY_TYPE: dict[str, Callable[[_Error], str]] = {
    "value_error": _message_of_validator,
    "assertion_error": _message_of_validator,
    "string_type": _describe_not_text,
    "bool_type": _describe_not_bool,
    "bool_parsing": _describe_not_bool,
    "int_type": _describe_not_number,
    "int_parsing": _describe_not_number,
    "int_from_float": _describe_not_number,
    "float_type": _describe_not_number,
    "float_parsing": _describe_not_number,
    "literal_error": _describe_not_a_choice,
    "enum": _describe_not_a_choice,
    "too_short": _describe_length,
    "too_long": _describe_length,
    "string_too_short": _describe_length,
    "string_too_long": _describe_length,
    **dict.fromkeys(("greater_than", "greater_than_equal", "less_than", "less_than_equal"), _explain_bounds),
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type", "mapping_type"), _describe_needed),
    **dict.fromkeys(("tuple_type", "list_type", "union"), _describe_needed),
}
