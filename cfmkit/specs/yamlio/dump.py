"""From a specification to YAML text that reads back to an equal one."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel

from cfmkit.errors import QuantityError
from cfmkit.specs.units.quantities import decimal_text
from cfmkit.specs.units.strict_decimal_number import odd_character
from cfmkit.specs.yamlio.paths import Slot
from cfmkit.specs.yamlio.tree_builder import read_plain

LINE_WIDTH = 100
_PLAIN_PATTERN = re.compile(r"[\w.+(/][^:#\[\]{},\"'&*!|>%@`\\=?-]*(?:[-%=?'*](?! )[^:#\[\]{},\"&!|>@`\\]*)*")
_OLD_WORDS = re.compile("(?i)(y|yes|n|no|on|off|=|<<|-|[-+]?[0-9]{1,4}-[0-9]{1,2}-[0-9]{1,2}.*)")


def dump(
    spec: BaseModel,  # what to write
    complete: bool = False,  # write every default too, not only what was set
) -> str:
    """Return a specification as YAML that `read_document` and `bind` turn into an equal one; keys as in the model."""
    content = _content(spec, spec.model_dump(mode="json"), (), complete)
    # Lists of blocks, such as the requirements, read best at the end.
    ordered = dict(sorted(content.items(), key=lambda item: _holds_blocks(item[1])))
    return "".join(f"{line}\n" for line in _block_lines(ordered, 0))


def _holds_blocks(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(item, dict) for item in value)


def _content(value: Any, text: Any, allowed: tuple[Slot, ...], complete: bool) -> Any:
    """Return the JSON form of a value without what its reader knows anyway.

    Value and JSON form are walked side by side: one says what was set, the other how it is written.
    """
    if isinstance(value, BaseModel) and isinstance(text, dict):
        must_tell = sum(slot.model is not None for slot in allowed) != 1
        own_slot = Slot(type(value))
        names = [
            name for name in type(value).model_fields if name in text and _is_written(value, name, must_tell, complete)
        ]
        return {name: _content(getattr(value, name), text[name], own_slot.child(name), complete) for name in names}
    if isinstance(value, Mapping) and isinstance(text, dict):
        return {key: _content(value.get(key), item, _slots_below(allowed, key), complete) for key, item in text.items()}
    if isinstance(value, tuple | list) and isinstance(text, list) and len(value) == len(text):
        pairs = enumerate(zip(value, text, strict=True))
        return [_content(*pair, _slots_below(allowed, index), complete) for index, pair in pairs]
    return text


def _slots_below(allowed: tuple[Slot, ...], key: str | int) -> tuple[Slot, ...]:
    return tuple(inner for slot in allowed if slot.model is None for inner in slot.child(key))


def _is_written(model: BaseModel, name: str, must_tell: bool, complete: bool) -> bool:
    """Return whether a field is to be written: a None only where it is not the default.

    With `must_tell` a field that can hold one word only is written too: it tells readers what the block is.
    """
    field = type(model).model_fields[name]
    if getattr(model, name) is None:
        return field.get_default(call_default_factory=False) is not None
    telling = must_tell and get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1
    return complete or telling or name in model.model_fields_set


def _block_lines(content: Mapping[str, Any], indent: int) -> Iterator[str]:
    """Yield the lines of a block."""
    pad = " " * indent
    for key, value in content.items():
        if isinstance(value, dict) and value:
            yield f"{pad}{_scalar_text(key)}:"
            yield from _block_lines(value, indent + 2)
        elif isinstance(value, list) and not _is_short(value):
            yield f"{pad}{_scalar_text(key)}:"
            yield from _list_lines(value, indent + 2)
        else:
            yield f"{pad}{_scalar_text(key)}: {_flow_text(value)}"


def _list_lines(items: list[Any], indent: int) -> Iterator[str]:
    """Yield the lines of a list: plain values many to a line, blocks one below the other."""
    pad = " " * indent
    if all(not isinstance(item, dict | list) for item in items):
        yield from _wrap_list([_flow_text(item) for item in items], pad)
        return
    for item in items:
        if isinstance(item, dict) and item:
            first, *rest = _block_lines(item, indent + 2)
            yield f"{pad}- {first.lstrip(' ')}"
            yield from rest
        else:
            yield f"{pad}- {_flow_text(item)}"


def _wrap_list(words: list[str], pad: str) -> Iterator[str]:
    """Yield a flow list over several lines."""
    line = f"{pad}["
    for number, word in enumerate(words):
        piece = word + ("]" if number == len(words) - 1 else ",")
        if len(line) + len(piece) + 1 > LINE_WIDTH and line.strip() != "[":
            yield line
            line = f"{pad} {piece}"
        else:
            line += piece if line.endswith("[") else f" {piece}"
    yield line


def _is_short(items: list[Any]) -> bool:
    """Return whether a list fits on its key's line: plain values, or a few pairs of numbers."""
    return not any(isinstance(item, dict) for item in items) and len(_flow_text(items)) <= LINE_WIDTH - 40


def _flow_text(value: Any) -> str:
    """Return a value on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_scalar_text(key)}: {_flow_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow_text(item) for item in value) + "]"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, float):
        return decimal_text(value)
    return _scalar_text(value) if isinstance(value, str) else str(value)


def _scalar_text(text: str) -> str:
    """Return text as a scalar, quoted where a reader could take it for something else."""
    plain = _PLAIN_PATTERN.fullmatch(text) and text == text.strip() and text.isprintable()
    return text if plain and not _OLD_WORDS.fullmatch(text) and _reads_as_text(text) else _quote(text)


def _reads_as_text(text: str) -> bool:
    try:
        return isinstance(read_plain(text), str)
    except QuantityError:
        return False


def _quote(text: str) -> str:
    """Return text in double quotes; what cannot be seen is escaped."""
    return "".join(_escape(char) for char in json.dumps(text, ensure_ascii=False))


def _escape(char: str) -> str:
    if char.isprintable() and not odd_character(char):
        return char
    code = ord(char)
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
