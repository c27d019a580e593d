"""Meaning of an unquoted scalar: YAML 1.2, minus what misleads.

YAML 1.1 reads ``1:30`` as 90, ``010`` as 8 and ``no`` as false; 1.2 does not, and
people expect either. What two readers take differently is refused with a hint.
"""

from __future__ import annotations

import re
from typing import Any

from cfmkit.errors import QuantityError
from cfmkit.specs.units.strict_decimal_number import MAX_NUMBER_LENGTH, NUMBER_PATTERN, number_complaint, read_number

_CONSTANT_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_CONTROL_PATTERN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f]")
_INTEGER_PATTERN = re.compile("[-+]?[0-9]+")


def read_plain(text: str) -> Any:
    """Return what an unquoted scalar means: None, a bool, an int, a float, or the text itself.

    Raises QuantityError if it looks like a number but is none that everybody reads the same way.
    """
    if text in _CONSTANT_WORDS:
        return _CONSTANT_WORDS[text]
    if NUMBER_PATTERN.fullmatch(text):
        return _number(text)
    if len(text) <= MAX_NUMBER_LENGTH and (complaint := number_complaint(text, only_traps=True)):
        raise QuantityError(_or_quote(complaint))
    return text


def check_text(text: str) -> str:
    """Return the text of a quoted scalar.

    Raises QuantityError if an escape put a control character into it.
    """
    if match := _CONTROL_PATTERN.search(text):
        raise QuantityError(f"the text holds the control character U+{ord(match[0]):04X}; remove it")
    return text


def _number(text: str) -> int | float:
    try:
        value = read_number(text)
    except QuantityError as error:
        raise QuantityError(_or_quote(str(error))) from None
    return int(text) if _INTEGER_PATTERN.fullmatch(text) else value


def _or_quote(complaint: str) -> str:
    return f"{complaint} (or quote it, if text is meant)"
