"""What the user probably meant by a unit that does not exist."""

from __future__ import annotations

import difflib
import itertools
import re
from typing import TYPE_CHECKING

from cfmkit.specs.units.number_text import shown
from cfmkit.specs.units.registry import border_size, is_unit, unit_size
from cfmkit.specs.units.table import SYMBOLS, UNITS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

_TYPOGRAPHY = {"²": "^2", "³": "^3", "⁴": "^4", "⁻": "^-", "¹": "1", "·": "*", "×": "*", "⋅": "*", "∙": "*", "°": "deg"}
_TYPOGRAPHY |= {"µ": "u", "μ": "u", "″": "in", '"': "in", "′": "ft", "(": "", ")": ""}
_NAMES = {unit.name.lower(): unit.symbol for unit in UNITS} | {
    "metre": "m", "millimetre": "mm", "centimetre": "cm", "micron": "um", "feet": "ft", "inches": "in", "sec": "s",
    "secs": "s", "hr": "h", "mins": "min", "kilo": "kg", "pct": "%", "radians": "rad", "lbs": "lb",
    "pounds": "lb", "rps": "rev/s", "turn": "rev", "lbin": "lbf*in", "lbft": "lbf*ft", "nm": "N*m",
}  # fmt: skip
_MOST_TRIES = 200


def unit_complaint(unit: str, dimensions: Sequence[str]) -> str:
    """Say that `unit` is none, and name the nearest one, of the wanted dimensions if there is one."""
    if "(" in unit and is_unit(re.sub("[()]", "", unit)):
        return f"{shown(unit)} has parentheses; write the unit without them, e.g. N/mm/s"
    if re.search(r"[A-Za-z%)] +[A-Za-z(]", unit) and all(word in SYMBOLS for word in re.findall("[A-Za-z%]+", unit)):
        return f"{shown(unit)} has two units side by side; put * or / between them"
    guess = nearest_unit(unit, dimensions)
    hint = f"did you mean {guess!r}?" if guess else "`cfmkit show units` lists them"
    return f"{shown(unit)} is not a unit; {hint}"


def nearest_unit(unit: str, dimensions: Sequence[str]) -> str | None:
    """Return an existing unit that looks like `unit`; one of the wanted dimensions comes first."""
    guesses = [guess for guess in itertools.islice(_guesses(unit), _MOST_TRIES) if is_unit(guess)]
    wanted = [border_size(name).powers for name in dimensions]
    fitting = [guess for guess in guesses if unit_size(guess).powers in wanted]
    return next(iter(fitting or guesses), None)


def _guesses(unit: str) -> Iterator[str]:
    """Yield the unit with every word replaced by what it may mean."""
    tidy = "".join(_TYPOGRAPHY.get(char, char) for char in unit[:60])
    tidy = re.sub(r"\bper\b", "/", tidy)
    tidy = re.sub(r"([A-Za-z])([2-4])\b", r"\1^\2", tidy)
    tidy = re.sub(r" *([*/^]+) *", r"\1", tidy).strip().replace(" ", "*")
    pieces = re.split("([A-Za-z%]+)", tidy)
    for words in itertools.product(*(list(_meanings(word)) for word in pieces[1::2])):
        yield "".join(itertools.chain(*itertools.zip_longest(pieces[0::2], words, fillvalue="")))


def _meanings(word: str) -> Iterator[str]:
    """Yield the unit symbols that `word` may stand for, the likeliest first."""
    if word in SYMBOLS:
        yield word
        return
    lower = word.lower()
    yield from (symbol for symbol in SYMBOLS if symbol.lower() == lower)
    yield from (_NAMES[name] for name in (lower, lower.removesuffix("s")) if name in _NAMES)
    yield from _products(word)
    near = difflib.get_close_matches(lower, list(_NAMES), n=2, cutoff=0.75)
    yield from (_NAMES[name] for name in near)
    yield from difflib.get_close_matches(word, list(SYMBOLS), n=2, cutoff=0.75)


def _products(word: str) -> Iterator[str]:
    """Yield the splits of ``Nmm`` into two known symbols."""
    for cut in range(1, len(word)):
        first, second = word[:cut], word[cut:]
        if first in SYMBOLS and second in SYMBOLS:
            yield f"{first}*{second}"
