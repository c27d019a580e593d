"""Text with a unit to an SI float and back, both to the last bit; faults of such text, with the unit that was meant.

The number is read by `cfmkit.specs.units.strict_decimal_number`, never by pint. Sizes of units are exact fractions, so
that the result is the correctly rounded float: "68 mm", "6.8 cm" and "0.068 m" are the same number.
"""

from __future__ import annotations

import difflib
import itertools
import math
import re
import sys
from decimal import Context, Decimal
from fractions import Fraction
from typing import TYPE_CHECKING

from cfmkit.errors import QuantityError
from cfmkit.specs.units.strict_decimal_number import NUMBER_PATTERN, number_complaint, odd_character, quote, read_number
from cfmkit.specs.units.table import (
    COMMON_UNIT_SIZES,
    DIMENSIONS_BY_NAME,
    UNIT_TABLE,
    UNITLESS_DIMENSIONS,
    UNITS_BY_SYMBOL,
    Size,
    border_size,
    border_unit,
    dimension_of,
    is_unit,
    to_border,
    unit_size,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


MAX_TEXT_LENGTH = 100
_UNIT_START = re.compile(r"$| *[^\W\d_]| *[%°\"'(]| *1 */")
_RADIX_PREFIX = re.compile("[-+]?0[xXoObB][0-9a-fA-F]")
_PRECISE_CONTEXT = Context(prec=60)


def read_quantity(
    text: str,  # a number and a unit; a zero, a ratio and a count need no unit
    dimension: str,  # the name of the dimension that is wanted, a key of `DIMENSIONS`
) -> float:
    """Return the SI value of text such as ``"0.69 N/mm"``.

    Raises QuantityError with what is wrong and what to write instead.

    Examples
    --------
    >>> read_quantity("68 mm", "length") == read_quantity("6.8 cm", "length") == 0.068
    True
    """
    return read_one_of(text, (dimension,))[0]


def read_one_of(text: str, dimensions: tuple[str, ...]) -> tuple[float, str]:
    """Return (SI value, dimension) of text that may be of several dimensions; a bare zero is of the first.

    Raises QuantityError with what is wrong and what to write instead.
    """
    number, unit = _split_number(text, dimensions)
    value = read_number(number)
    if not unit:
        return _number_without_unit(value, number, dimensions), dimensions[0]
    for name in dimensions:
        if (name, unit) in COMMON_UNIT_SIZES:
            return _scale_number(number, unit, COMMON_UNIT_SIZES[name, unit]), name
    if not is_unit(unit):
        raise QuantityError(unit_complaint(unit, dimensions))
    size = unit_size(unit)
    for name in dimensions:
        if size.powers == border_size(name).powers:
            return _scale_number(number, unit, size.factor), name
    problem = f"{quote(f'{number} {unit}')} is {_measured_by(size)}"
    raise QuantityError(f"{problem}; {describe_dimensions(dimensions)} is needed, e.g. {example(dimensions, number)}")


def meant_as_percent(text: str) -> str:
    """Return the percentage that a number without a unit above 1 was probably meant as; empty where it is none.

    Examples
    --------
    >>> meant_as_percent("5"), meant_as_percent("0.05"), meant_as_percent("150 %")
    ('5 %', '', '')
    """
    number, unit = _split_number(text, ("ratio",))
    return f"{number} %" if not unit and read_number(number) > 1 else ""


def check_quantity(text: str) -> str:
    """Return text that is a number, with or without some known unit, tidied; the dimension is left open.

    Raises QuantityError if it is not a number, or its unit is not known.
    """
    number, unit = _split_number(text, ())
    value = read_number(number)
    if not unit:
        return decimal_text(value)
    if not is_unit(unit):
        raise QuantityError(unit_complaint(unit, ()))
    return f"{number} {unit}"


def format_quantity(
    value: float,  # SI value, finite
    dimension: str,  # its dimension, a key of `DIMENSIONS`
    unit: str | None = None,  # the unit to write; default: the border unit of the dimension
) -> str:
    """Return the shortest text that `read_quantity` reads back as exactly `value`.

    Examples
    --------
    >>> format_quantity(0.068, "length")
    '68 mm'
    """
    item = dimension_of(dimension)
    unit = item.unit if unit is None else unit
    if unit in ("1", ""):
        return decimal_text(value)
    factor = COMMON_UNIT_SIZES.get((dimension, unit)) or unit_size(unit).factor
    return f"{_shortest(float(value), factor)} {unit}"


def decimal_text(value: float) -> str:
    """Return the shortest decimal text that reads back as `value`, without a trailing ``.0``."""
    return _shortest(float(value), Fraction(1))


def describe_dimensions(dimensions: tuple[str, ...]) -> str:
    """Return ``a length`` or ``a length or an angle``."""
    return " or ".join(DIMENSIONS_BY_NAME[name].phrase for name in dimensions) or "a number with a unit"


def example(dimensions: tuple[str, ...], number: str = "") -> str:
    """Return what to write, quoted: the user's own number with a unit that fits, or the dimension's example."""
    if not dimensions:
        return "'5 mm'"
    items = [DIMENSIONS_BY_NAME[name] for name in dimensions]
    texts = [
        f"{number} {item.unit}" if number and item.name not in UNITLESS_DIMENSIONS else item.example for item in items
    ]
    return " or ".join(quote(text) for text in texts)


def _split_number(text: str, dimensions: tuple[str, ...]) -> tuple[str, str]:
    """Cut text into number and unit; what does not start with a number is refused with the reason."""
    if odd := odd_character(text):
        raise QuantityError(f"{quote(text)} holds {odd[1]}")
    text = text.strip(" ")
    if not text:
        raise QuantityError(
            f"the text is empty; {describe_dimensions(dimensions)} is needed, e.g. {example(dimensions)}"
        )
    if len(text) > MAX_TEXT_LENGTH:
        raise QuantityError(
            f"{quote(text)} is too long for {describe_dimensions(dimensions)}: at most {MAX_TEXT_LENGTH} characters"
        )
    match = NUMBER_PATTERN.match(text)
    if not match or not _UNIT_START.match(rest := text[match.end() :]) or _RADIX_PREFIX.match(text):
        raise QuantityError(_no_number(text, dimensions))
    return match[0], rest.strip(" ")


def _no_number(text: str, dimensions: tuple[str, ...]) -> str:
    """Return an error about text that does not start with a number."""
    for part in (text.split(" ")[0], re.split("[A-Za-z%]", text)[0].strip(" "), text):
        if complaint := number_complaint(part):
            return complaint
    return f"{quote(text)} is not {describe_dimensions(dimensions)}; write e.g. {example(dimensions)}"


def _number_without_unit(value: float, number: str, dimensions: tuple[str, ...]) -> float:
    """Return a number without a unit, where that is enough."""
    if value == 0:
        return 0.0
    if dimensions[0] not in UNITLESS_DIMENSIONS:
        raise QuantityError(f"{number} has no unit; write {example(dimensions, number)}")
    return value


def _measured_by(size: Size) -> str:
    """Return what a unit measures: ``a force``."""
    names = (name for name in DIMENSIONS_BY_NAME if name != "text" and border_size(name).powers == size.powers)
    return next((DIMENSIONS_BY_NAME[name].phrase for name in names), "of another kind")


def _scale_number(number: str, unit: str, factor: Fraction) -> float:
    """Return number times unit, correctly rounded; `number` is known to be finite and of bounded length."""
    if float(number) == 0:
        return 0.0
    exact = Fraction(Decimal(number)) * factor
    try:
        value = float(exact)
    except OverflowError:
        raise QuantityError(f"{quote(f'{number} {unit}')} is too large") from None
    if value == 0:
        raise QuantityError(f"{quote(f'{number} {unit}')} is too small to differ from zero; write 0 if zero is meant")
    return value


def _shortest(value: float, factor: Fraction) -> str:
    """Return the shortest decimal number that, times `factor`, rounds to `value`.

    Two decimals of 15 digits are never the same float, so one that fits is unique and only its trailing zeros can go;
    17 digits always fit. Below the normal range floats are so coarse that fewer digits do.
    """
    if not math.isfinite(value):
        raise QuantityError(f"{value} cannot be written: it is not a finite number")
    if value == 0:
        return "0"
    exact = Fraction(value) / factor
    decimal = _PRECISE_CONTEXT.divide(Decimal(exact.numerator), Decimal(exact.denominator))
    for digits in (15, 16, 17) if abs(value) > sys.float_info.min * 16 else range(1, 18):
        rounded = Context(prec=digits).plus(decimal)
        if _rounds_to(rounded, factor, value):
            break
    return _plain_decimal_text(rounded)


def _rounds_to(decimal: Decimal, factor: Fraction, value: float) -> bool:
    try:
        return float(Fraction(decimal) * factor) == value
    except OverflowError:
        return False


def _plain_decimal_text(decimal: Decimal) -> str:
    """Return a decimal as people write it: ``0.05``, ``1200``, ``1e-9``."""
    short = decimal.normalize()
    if -4 <= short.adjusted() <= 15:
        return format(short, "f")
    return format(short, "e").replace("e+", "e")


_TYPOGRAPHIC_MARKS = {
    "²": "^2",
    "³": "^3",
    "⁴": "^4",
    "⁻": "^-",
    "¹": "1",
    "·": "*",
    "×": "*",
    "⋅": "*",
    "∙": "*",
    "°": "deg",
}
_TYPOGRAPHIC_MARKS |= {"µ": "u", "μ": "u", "″": "in", '"': "in", "′": "ft", "(": "", ")": ""}
_UNIT_NAMES = {unit.name.lower(): unit.symbol for unit in UNIT_TABLE} | {
    "metre": "m", "millimetre": "mm", "centimetre": "cm", "micron": "um", "feet": "ft", "inches": "in", "sec": "s",
    "secs": "s", "hr": "h", "mins": "min", "kilo": "kg", "pct": "%", "radians": "rad", "lbs": "lb",
    "pounds": "lb", "rps": "rev/s", "turn": "rev", "lbin": "lbf*in", "lbft": "lbf*ft", "nm": "N*m",
}  # fmt: skip
_MOST_TRIES = 200


def unit_complaint(unit: str, dimensions: Sequence[str]) -> str:
    """Return an error that `unit` is none, with the nearest one, of the wanted dimensions if possible."""
    if "(" in unit and is_unit(re.sub("[()]", "", unit)):
        return f"{quote(unit)} has parentheses; write the unit without them, e.g. N/mm/s"
    if re.search(r"[A-Za-z%)] +[A-Za-z(]", unit) and all(
        word in UNITS_BY_SYMBOL for word in re.findall("[A-Za-z%]+", unit)
    ):
        return f"{quote(unit)} has two units side by side; put * or / between them"
    if re.fullmatch("((deg|°) *)?(C|F|[Cc]elsius|[Ff]ahrenheit)", unit):
        # an offset would be lost where values are subtracted and scaled, as tolerances are
        return f"{quote(unit)} is not a unit: temperatures are in K, 23 degrees Celsius are 296.15 K"
    guess = nearest_unit(unit, dimensions)
    hint = f"did you mean {guess!r}?" if guess else "`cfmkit show units` lists them"
    return f"{quote(unit)} is not a unit; {hint}"


def nearest_unit(unit: str, dimensions: Sequence[str]) -> str | None:
    """Return an existing unit that looks like `unit`; one of the wanted dimensions comes first."""
    guesses = [guess for guess in itertools.islice(_guesses(unit), _MOST_TRIES) if is_unit(guess)]
    wanted = [border_size(name).powers for name in dimensions]
    fitting = [guess for guess in guesses if unit_size(guess).powers in wanted]
    return next(iter(fitting or guesses), None)


def _guesses(unit: str) -> Iterator[str]:
    """Yield the unit with every word replaced by what it may mean."""
    tidy = "".join(_TYPOGRAPHIC_MARKS.get(char, char) for char in unit[:60])
    tidy = re.sub(r"\bper\b", "/", tidy)
    tidy = re.sub(r"([A-Za-z])([2-4])\b", r"\1^\2", tidy)
    tidy = re.sub(r" *([*/^]+) *", r"\1", tidy).strip().replace(" ", "*")
    pieces = re.split("([A-Za-z%]+)", tidy)
    for words in itertools.product(*(list(_meanings(word)) for word in pieces[1::2])):
        yield "".join(itertools.chain(*itertools.zip_longest(pieces[0::2], words, fillvalue="")))


def _meanings(word: str) -> Iterator[str]:
    """Yield the unit symbols that `word` may stand for, the likeliest first."""
    if word in UNITS_BY_SYMBOL:
        yield word
        return
    lower = word.lower()
    yield from (symbol for symbol in UNITS_BY_SYMBOL if word == 2 * symbol)  # such as "%%"
    yield from (symbol for symbol in UNITS_BY_SYMBOL if symbol.lower() == lower)
    yield from (_UNIT_NAMES[name] for name in (lower, lower.removesuffix("s")) if name in _UNIT_NAMES)
    yield from _products(word)
    close = difflib.get_close_matches(lower, list(_UNIT_NAMES), n=2, cutoff=0.75)
    yield from (_UNIT_NAMES[name] for name in close)
    yield from difflib.get_close_matches(word, list(UNITS_BY_SYMBOL), n=2, cutoff=0.75)


def _products(word: str) -> Iterator[str]:
    """Yield the splits of ``Nmm`` into two known symbols; nobody multiplies by a percentage."""
    for cut in range(1, len(word)):
        first, second = word[:cut], word[cut:]
        if first != second and first in UNITS_BY_SYMBOL and second in UNITS_BY_SYMBOL and "%" not in word:
            yield f"{first}*{second}"


def format_short(value: float, dimension: str, digits: int = 4) -> str:
    """Return a value as a reader wants it in a sentence, rounded, in the border unit.

    Examples
    --------
    >>> format_short(0.010328365, "length")
    '10.33 mm'
    >>> format_short(0.05, "ratio")
    '5 %'
    """
    if dimension == "ratio":
        return f"{100 * value:.{digits}g} %"
    number = f"{float(to_border(value, dimension)):.{digits}g}"
    if "e+" in number:
        number = f"{float(number):.0f}"
    unit = border_unit(dimension)
    return number if unit in ("", "1") else f"{number} {unit}"
