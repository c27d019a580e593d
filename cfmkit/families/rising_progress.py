"""How far a run is, told so that it never falls: a search that looks again stays where it was until it is farther."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


def silent(_fraction: float, _text: str) -> None:
    """Ignore progress: the default for library use."""


class Rising:
    """Passes on the largest fraction so far, with the newest text."""

    def __init__(self, told: Callable[[float, str], None]) -> None:
        """Tell `told`, from 0 on."""
        self._told = told
        self._most = 0.0

    def __call__(self, fraction: float, text: str) -> None:
        """Report a fraction in [0, 1] and a short text."""
        self._most = max(self._most, fraction)
        self._told(self._most, text)


@dataclass(frozen=True)
class Scaled:
    """Passes on the progress of a part of a run as that of the whole: it lies between two shares."""

    whole: Callable[[float, str], None]
    begun: float
    ended: float

    def __call__(self, fraction: float, text: str) -> None:
        """Report a fraction of the part in [0, 1] and a short text."""
        self.whole(self.begun + (self.ended - self.begun) * fraction, text)


def rising(told: Callable[[float, str], None]) -> Callable[[float, str], None]:
    """Return what passes progress on and never falls; what cannot fall is returned as it is."""
    return told if told is silent or isinstance(told, Rising | Scaled) else Rising(told)
