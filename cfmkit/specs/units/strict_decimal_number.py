"""A strict reader for decimal numbers: what YAML 1.2 calls a number, and nothing else.

Python's ``float()`` is too kind for a specification: it takes ``1_000``, ``nan``, Arabic digits and spaces. Here every
text that is not plainly one finite decimal number is refused, with what is wrong and what to write instead.
"""

from __future__ import annotations

import re
import unicodedata
from typing import TYPE_CHECKING

from cfmkit.errors import QuantityError, visible

if TYPE_CHECKING:
    from collections.abc import Callable

MAX_NUMBER_LENGTH = 40
NUMBER_PATTERN = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
"""Sign, digits, dot, exponent; leading zeros are refused separately, with a hint."""
_LEADING_ZERO = re.compile(r"([-+]?)0+([0-9].*)")
_MINUS_SIGNS = "\u2010\u2011\u2012\u2013\u2014\u2212\ufe63\uff0d"
_MAX_SHOWN_LENGTH = 50


def quote(text: str) -> str:
    """Return `text` quoted for a message: on one line, escaped where it cannot be seen, cut where it is long."""
    cut = text if len(text) <= _MAX_SHOWN_LENGTH else text[: _MAX_SHOWN_LENGTH - 3] + "..."
    return f"'{visible(cut)}'"


def odd_character(text: str) -> tuple[int, str] | None:
    """Return (index, what it is and what to use) of the first character that no specification may hold.

    Those are tabs, control characters, line separators, spaces other than the ordinary
    one, and invisible formatting characters. Line feeds and carriage returns are fine.
    """
    if text.isascii() and text.isprintable():
        return None
    for index, char in enumerate(text):
        if complaint := _describe_odd(char):
            return index, complaint
    return None


def _describe_odd(char: str) -> str | None:
    if " " <= char <= "~" or char in "\n\r\u200c\u200d":
        return None
    code = f"U+{ord(char):04X}"
    if char == "\t":
        return "a tab; use spaces"
    category = unicodedata.category(char)
    if category == "Zs":
        return f"a {unicodedata.name(char).lower()} ({code}); use an ordinary space"
    if category in ("Cc", "Cf", "Zl", "Zp", "Cs"):
        return f"an invisible character ({code}, {unicodedata.name(char, 'control character').lower()}); remove it"
    return None


def read_number(
    text: str,  # an optional sign, decimal digits with an optional dot, an optional exponent
) -> float:
    """Return the number that `text` represents.

    Raises QuantityError if the text is anything else, or its value overflows or underflows.

    Examples
    --------
    >>> read_number("1e-3")
    0.001
    """
    if len(text) > MAX_NUMBER_LENGTH:
        raise QuantityError(f"{quote(text)} is too long for a number: at most {MAX_NUMBER_LENGTH} characters")
    if not NUMBER_PATTERN.fullmatch(text):
        raise QuantityError(_describe_not_a_number(text))
    if zeros := _LEADING_ZERO.fullmatch(text):
        raise QuantityError(f"{quote(text)} has a leading zero; write {zeros[1]}{zeros[2]}")
    return _finite_number(text)


def _finite_number(text: str) -> float:
    value = float(text)
    if value in (float("inf"), float("-inf")):
        raise QuantityError(f"{quote(text)} is too large: at most 1.8e308")
    if value == 0 and re.search("[1-9]", re.split("[eE]", text)[0]):
        raise QuantityError(f"{quote(text)} is too small to differ from zero; write 0 if zero is meant")
    return value


def _describe_not_a_number(text: str) -> str:
    if not text:
        return "there is no number"
    return number_complaint(text) or f"{quote(text)} is not a number; write e.g. 12, -0.5 or 1e-3"


def number_complaint(text: str, only_traps: bool = False) -> str | None:
    """Return what is wrong with something that was meant as a number, None if it does not look like one.

    With `only_traps` text that may well be meant as text, such as a date, is left alone.
    """
    if odd := odd_character(text):
        return f"{quote(text)} holds {odd[1]}"
    for trap, pattern, explain in _TRAP_REASONS:
        if (trap or not only_traps) and pattern.fullmatch(text):
            return f"{quote(text)} {explain(text)}"
    return None


def _always(sentence: str) -> Callable[[str], str]:
    return lambda _text: sentence


_TRAP_PATTERNS: tuple[tuple[bool, str, Callable[[str], str]], ...] = (
    (True, rf"[{_MINUS_SIGNS}][0-9.].*", lambda text: f"has a unicode minus (U+{ord(text[0]):04X}); write -{text[1:]}"),
    (False, rf".*[0-9eE][{_MINUS_SIGNS}][0-9].*", _always("has a unicode minus or dash; write the ASCII '-'")),
    (
        True,
        "[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+",
        _always("has a comma; write decimals with a dot, thousands plainly"),
    ),
    (True, "[-+]?[0-9]*,[0-9]+([eE][-+]?[0-9]+)?", lambda text: f"has a decimal comma; write {text.replace(',', '.')}"),
    (True, "[-+]?[0-9.]+,[0-9.,]*", _always("has a comma; write digits with one dot, e.g. 1234.5")),
    (
        True,
        "[-+]?[0-9]+(:[0-9.]+)+",
        _always("has a colon (old YAML reads it in base 60); write one decimal number"),
    ),
    (True, "[-+]?0[xX][0-9a-fA-F_]+", _always("is hexadecimal; write it in decimal")),
    (True, "[-+]?0[oO][0-7_]+", _always("is octal; write it in decimal")),
    (True, "[-+]?0[bB][01_]+", _always("is binary; write it in decimal")),
    (True, "[-+]?[0-9][0-9.]*_[0-9._]*", lambda text: f"has an underscore; write {text.replace('_', '')}"),
    (True, "(?i)[-+]?\\.?(nan|inf(inity)?)", _always("is not a finite number")),
    (False, "[-+]?[0-9.]+( [0-9.]+)+", lambda text: f"has a space in it; write {text.replace(' ', '')}"),
    (False, "[-+]?[0-9.][0-9.eE]*[-+*/^(]+[-+*/^() ]*[0-9].*", _always("is arithmetic; write its value")),
    (False, r"[-+]?[0-9.]*(?![0-9])\d.*", _always("has digits that are not 0-9; write ASCII digits")),
    (False, r"[-+]?[0-9]*(\.[0-9]*){2,}", _always("has more than one dot; write e.g. 1234.5")),
)
_TRAP_REASONS = tuple((trap, re.compile(pattern), explain) for trap, pattern, explain in _TRAP_PATTERNS)
"""What people write instead of a number, in the order in which the explanations should be tried.

True marks the traps: nobody means them as text, and other YAML readers take them for a number.
"""
