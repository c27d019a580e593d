"""Options of the command line that stand for keys of a request, and how their values are written in a file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True)
class RequestOption:
    """Option of `cfmkit suggest` for a key of a request, which has the name of the key."""

    metavar: str  # what the help calls its value
    help: str
    write: Callable[[str], str] = str  # returns the value of the option as a file would have it
    is_repeatable: bool = False  # the values of all are one list


def write_list(text: str) -> str:
    """Return values with commas as a list.

    Examples
    --------
    >>> write_list("15N,25N"), write_list("[pom, pla]")
    ('[15N,25N]', '[pom, pla]')
    """
    return text if text.strip().startswith("[") else f"[{text}]"


def write_band(text: str) -> str:
    """Return two values with units as a list, so that a comma between them is no decimal one; one value as it is.

    Examples
    --------
    >>> write_band("19 N, 21 N"), write_band("20 N"), write_band("1,5 N")
    ('[19 N, 21 N]', '20 N', '1,5 N')
    """
    parts = text.split(",")
    return write_list(text) if len(parts) == 2 and all(re.search(r"[a-zA-Z]", part) for part in parts) else text


def write_envelope(text: str) -> str:
    """Return the sides of an envelope as a list: ``80x60x6mm``, or ``80 mm x 60 mm``.

    Examples
    --------
    >>> write_envelope("80x60x6mm"), write_envelope("80 mm x 6 cm"), write_envelope("8e1 x 60mm")
    ('[80 mm, 60 mm, 6 mm]', '[80 mm, 6 cm]', '[8e1 mm, 60 mm]')
    """
    if text.strip().startswith("["):
        return text
    sides = [
        re.sub(r"^([+-]?[\d.,]*(?:[eE][+-]?\d+)?)\s*", r"\1 ", side.strip()).partition(" ")
        for side in re.split(r"(?<=[\d. a-z])x(?=[\d. ])", text.strip())
    ]
    unit = sides[-1][2]
    if not unit:
        raise UsageError(f"--envelope: {text.strip()} has no unit; write {text.strip()}mm")
    return "[" + ", ".join(f"{number} {unit_of_side or unit}" for number, _, unit_of_side in sides) + "]"
