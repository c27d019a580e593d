"""Settings of a run of a family's function: seed, progress report, time limit, executor of jobs, store of results."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.designing.run_many_starts import Notes


class Executor(Protocol):
    """Executor of independent jobs: see `cfmkit.studies.serial_and_cluster_executors` and `cfmkit.studies.pool`."""

    def __call__(
        self, work: Callable[[Any], Any], jobs: Iterator[Any], stopping: Callable[[], bool], /
    ) -> Iterator[tuple[Any, Any]]:
        """Yield (job, outcome) as they finish; take no more jobs once ``stopping()`` is true."""


def _one_by_one(
    work: Callable[[Any], Any], jobs: Iterator[Any], stopping: Callable[[], bool], /
) -> Iterator[tuple[Any, Any]]:
    """Do one job after the other in this process: the default for library use."""
    for job in jobs:
        if stopping():
            return
        yield job, work(job)


class _NothingKept:
    """Keeps nothing: the default for library use."""

    def find(self, _key: str, /) -> None:
        return None

    def add(self, _key: str, _record: Any, /) -> None:
        pass


def silent(_fraction: float, _text: str) -> None:
    """Ignore progress: the default for library use."""


class Rising:
    """Passes on the largest fraction so far, with the newest text."""

    def __init__(self, report: Callable[[float, str], None]) -> None:
        """Begin a progress report to `report`, from 0 on."""
        self._told = report
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


def rising(report: Callable[[float, str], None]) -> Callable[[float, str], None]:
    """Return what passes progress on and never falls; what cannot fall is returned as it is."""
    return report if report is silent or isinstance(report, Rising | Scaled) else Rising(report)


def read_time(time: str | float | None, name: str = "time_budget") -> float | None:
    """Return a time [s] of a number or a text with its unit; None for None.

    Raises UsageError if it is no time, with the name of what it was given for.

    Examples
    --------
    >>> read_time("2 min"), read_time(20.0)
    (120.0, 20.0)
    """
    from cfmkit.errors import QuantityError, UsageError
    from cfmkit.specs.units import read_quantity

    if time is None or not isinstance(time, str):
        return time
    text = re.sub(r"(?<=\d)(?=[a-zA-Z])", " ", time.strip())
    try:
        return float(text) if re.fullmatch(r"[\d.]+", text) else read_quantity(text, "time")
    except (QuantityError, ValueError) as error:
        raise UsageError(f"{name}: {error}") from None


@dataclass(frozen=True)
class Run:
    """Options of one run of a function."""

    seed: int = 0  # random seed
    # progress callback: takes a fraction in [0, 1], which never falls, and a short text
    progress: Callable[[float, str], None] = silent
    time_budget: float | None = None  # in seconds, a text with its unit is read; None: no limit
    executor: Executor = _one_by_one  # does independent jobs, in this process or in others
    notes: Notes = field(default_factory=_NothingKept)  # keeps what is finished

    def __post_init__(self) -> None:
        """Let no search that looks again take its progress back."""
        object.__setattr__(self, "progress", rising(self.progress))
        object.__setattr__(self, "time_budget", read_time(self.time_budget))

    def part(self, begun: float, ended: float) -> Run:
        """Return a run that is part of this one: what it calls done lies between two shares of the whole."""
        return replace(self, progress=Scaled(self.progress, begun, ended))
